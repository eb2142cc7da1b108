"""Sine, cosine and arc tangent as straight-line arithmetic, so that a compiler can run many at once.

The text of these functions goes into every emitted kernel that needs them. They use no branch that a compiler
cannot turn into a choice between two values, and no call.

Accuracy, against correctly rounded values (tests/tracing/test_elementary.py): sine and cosine within 2 ulp for
|x| up to 1e5; beyond, the error grows as |x| · 1e-22 and reaches 1e-9 at 1e13; not meant beyond 1e15. Arc tangent
within 2 ulp everywhere; its sign at y = -0.0 is that of +0.0.

Source:
    Argument reduction in three parts: Cody & Waite (1980). Polynomials of sine and cosine: the fdlibm kernels (Sun
    Microsystems, 1993). Rational function of the arc tangent: Moshier, Cephes (1989).
"""


def sine_cosine(x: float) -> tuple[float, float]:
    """Return the sine and the cosine of ``x`` [rad]."""
    # Adding and taking away 1.5 · 2^52 rounds to a whole number: the quarter turns in x.
    n = (x * 0.6366197723675814 + 6755399441055744.0) - 6755399441055744.0
    r = ((x - n * 1.5707963267341256) - n * 6.077100506303966e-11) - n * 2.0222662487959506e-21
    z = r * r
    p = -2.5050760253406863e-08 + z * 1.58969099521155e-10
    p = -1.984126982985795e-04 + z * (2.7557313707070068e-06 + z * p)
    s = r + r * z * (-0.16666666666666632 + z * (0.00833333333332249 + z * p))
    w = 1.0 - 0.5 * z
    p = 2.087572321298175e-09 + z * -1.1359647557788195e-11
    p = 2.480158728947673e-05 + z * (-2.7557314351390663e-07 + z * p)
    p = 0.0416666666666666 + z * (-0.001388888888887411 + z * p)
    c = w + (((1.0 - w) - 0.5 * z) + z * z * p)
    # The quarter, -2 to 2: odd ones swap sine and cosine, and half a turn changes the sign.
    m = n - 4.0 * ((n * 0.25 + 6755399441055744.0) - 6755399441055744.0)
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
    # Above 0.66 the angle is measured from an eighth of a turn; one division serves both.
    past = 1.0 if low > 0.66 * high else 0.0
    below = high + past * low
    t = (low - past * high) / (below if below > 0.0 else 1.0)
    z = t * t
    p = -16.157537187333652 + z * -0.8750608600031904
    p = -122.88666844901361 + z * (-75.00855792314705 + z * p)
    p = z * (-64.85021904942025 + z * p)
    q = 165.02700983169885 + z * (24.858464901423062 + z)
    q = 485.3903996359137 + z * (432.88106049129027 + z * q)
    q = 194.5506571482614 + z * q
    r = (t + t * (p / q)) + past * 3.061616997868383e-17
    r = r + past * 0.7853981633974483
    r = (1.5707963267948966 - r) + 6.123233995736766e-17 if ay > ax else r
    r = (3.141592653589793 - r) + 1.2246467991473532e-16 if x < 0.0 else r
    return -r if y < 0.0 else r
