"""Sine, cosine and arc tangent as straight-line arithmetic, so that a compiler can run many at once.

The text of these functions goes into every emitted kernel that needs them. They use no branch that a compiler
cannot replace by a choice between two values, and no call but ``fma``.

Accuracy, against correctly rounded values (tests/tracing/test_kernel.py): sine and cosine within 2 ulp for
|x| up to 1e5; beyond, the error grows as |x| · 1e-22 and reaches 1e-9 at 1e13; not meant beyond 1e15. Arc tangent
within 2 ulp everywhere; its sign at y = -0.0 is that of +0.0.

Source:
    Argument reduction in three parts: Cody & Waite (1980). Polynomials of sine and cosine: the fdlibm kernels (Sun
    Microsystems, 1993). Rational function of the arc tangent: Moshier, Cephes (1989).
"""


def fma(a: float, b: float, c: float) -> float:
    """Return a · b + c; in a kernel it is the processor's instruction, which rounds once."""
    return a * b + c


def sine_cosine(x: float) -> tuple[float, float]:
    """Return the sine and the cosine of ``x`` [rad]."""
    # Adding and taking away 1.5 · 2^52 rounds to a whole number: the multiples of pi/2 in x.
    n = fma(x, 0.6366197723675814, 6755399441055744.0) - 6755399441055744.0
    r = fma(n, -2.0222662487959506e-21, fma(n, -6.077100506303966e-11, fma(n, -1.5707963267341256, x)))
    z = r * r
    p = fma(z, fma(z, 1.58969099521155e-10, -2.5050760253406863e-08), 2.7557313707070068e-06)
    p = fma(z, fma(z, p, -1.984126982985795e-04), 0.00833333333332249)
    s = fma(r * z, fma(z, p, -0.16666666666666632), r)
    p = fma(z, fma(z, -1.1359647557788195e-11, 2.087572321298175e-09), -2.7557314351390663e-07)
    p = fma(z, fma(z, p, 2.480158728947673e-05), -0.001388888888887411)
    w = fma(z, -0.5, 1.0)
    c = w + fma(z * z, fma(z, p, 0.0416666666666666), fma(z, -0.5, 1.0 - w))
    # The quarter, -2 to 2: odd ones swap sine and cosine, and pi changes the sign.
    m = fma(fma(n, 0.25, 6755399441055744.0) - 6755399441055744.0, -4.0, n)
    odd = abs(m) == 1.0
    half = abs(m) == 2.0
    sine = c if odd else s
    cosine = s if odd else c
    sine = -sine if half | (m == -1.0) else sine
    cosine = -cosine if half | (m == 1.0) else cosine
    return sine, cosine


def arc_tangent(y: float, x: float) -> float:
    """Return the angle of the point (x, y) [rad], in (-pi, pi]; 0 for the origin."""
    ax = abs(x)
    ay = abs(y)
    low = ay if ay < ax else ax
    high = ax if ay < ax else ay
    # Above 0.66 the angle is measured from pi/4; one division serves both.
    past = 1.0 if low > 0.66 * high else 0.0
    below = fma(past, low, high)
    t = fma(past, -high, low) / (below if below > 0.0 else 1.0)
    z = t * t
    p = fma(z, fma(z, -0.8750608600031904, -16.157537187333652), -75.00855792314705)
    p = z * fma(z, fma(z, p, -122.88666844901361), -64.85021904942025)
    q = fma(z, fma(z, 24.858464901423062 + z, 165.02700983169885), 432.88106049129027)
    q = fma(z, fma(z, q, 485.3903996359137), 194.5506571482614)
    r = fma(past, 3.061616997868383e-17, fma(t, p / q, t))
    r = fma(past, 0.7853981633974483, r)
    r = (1.5707963267948966 - r) + 6.123233995736766e-17 if ay > ax else r
    r = (3.141592653589793 - r) + 1.2246467991473532e-16 if x < 0.0 else r
    return -r if y < 0.0 else r
