"""Sine, cosine and arc tangent as straight-line arithmetic, so that a processor can run many at once.

They are written over traced scalars and become part of every emitted graph that needs them: no branch, and no call.

Accuracy, against correctly rounded values (tests/tracing/test_kernel.py): sine and cosine within 2 ulp for
|x| up to 1e5; beyond, the error grows as |x| · 1e-22 and reaches 1e-9 at 1e13; not meant beyond 1e15. A processor that
rounds products before it adds has 2 ulp up to 1e6, and beyond an error of |x| · 1e-16. Arc tangent within 2 ulp for
lengths from 1e-320 to 1e300. The sine of -0.0 is +0.0, the sign of an arc tangent at y = -0.0 is that of +0.0, and at
x = -0.0 it is the arc tangent at +0.0. What is not a number goes on as such.

Source:
    Argument reduction in three parts: Cody & Waite (1980). Polynomials of sine and cosine: the fdlibm kernels (Sun
    Microsystems, 1993). Rational function of the arc tangent: Moshier, Cephes (1989).
"""

from armwright.tracing.graph import Traced, traced
from armwright.tracing.scalar import Scalar, select

# Adding 1.5 · 2^52 rounds to an integer, which then stands in the last bits of the sum.
_ROUNDING = 6755399441055744.0


def fma(a: Scalar, b: Scalar, c: Scalar) -> Traced:
    """Return a · b + c, rounded once."""
    return traced("fma", a, b, c)


def rounded(x: Traced) -> Traced:
    """Return the integer nearest to ``x``, for |x| up to 2^51; the even one of two."""
    return (x + _ROUNDING) - _ROUNDING


def root(x: Traced) -> Traced:
    """Return the root of ``x``, and 0 for what rounding has pushed below 0."""
    # NaN is not below 0, and its root is NaN.
    return traced("sqrt", select(x <= 0.0, 0.0, x))


def sine_cosine(x: Traced) -> tuple[Traced, Traced]:
    """Return the sine and the cosine of ``x`` [rad]."""
    quarters = fma(x, 0.6366197723675814, _ROUNDING)
    n = quarters - _ROUNDING
    r = fma(n, -2.0222662487959506e-21, fma(n, -6.077100506303966e-11, fma(n, -1.5707963267341256, x)))
    z = r * r
    p = fma(z, fma(z, 1.58969099521155e-10, -2.5050760253406863e-08), 2.7557313707070068e-06)
    p = fma(z, fma(z, p, -1.984126982985795e-04), 0.00833333333332249)
    s = fma(r * z, fma(z, p, -0.16666666666666632), r)
    p = fma(z, fma(z, -1.1359647557788195e-11, 2.087572321298175e-09), -2.7557314351390663e-07)
    p = fma(z, fma(z, p, 2.480158728947673e-05), -0.001388888888887411)
    w = fma(z, -0.5, 1.0)
    c = w + fma(z * z, fma(z, p, 0.0416666666666666), fma(z, -0.5, 1.0 - w))
    # Odd quarters exchange sine and cosine; the sine is negative in the last two, the cosine in the middle ones.
    odd, late = traced("bit", quarters, 0.0), traced("bit", quarters, 1.0)
    sine, cosine = select(odd, c, s), select(odd, s, c)
    return select(late, -sine, sine), select(traced("differ", odd, late), -cosine, cosine)


def arc_tangent(y: Traced, x: Traced) -> Traced:
    """Return the angle of the point (x, y) [rad], in (-pi, pi]; 0 for the origin."""
    ax, ay = abs(x), abs(y)
    steep = ax < ay
    low, high = select(ay < ax, ay, ax), select(ay < ax, ax, ay)
    # Above 0.66 the angle is measured from pi/4; one division serves both.
    past = low > 0.66 * high
    above, below = select(past, low - high, low), select(past, low + high, high)
    # Only of the origin the lengths are 0; NaN goes on.
    t = above / select(below <= 0.0, 1.0, below)
    z = t * t
    p = fma(z, fma(z, -0.8750608600031904, -16.157537187333652), -75.00855792314705)
    p = z * fma(z, fma(z, p, -122.88666844901361), -64.85021904942025)
    q = fma(z, fma(z, z + 24.858464901423062, 165.02700983169885), 432.88106049129027)
    q = fma(z, fma(z, q, 485.3903996359137), 194.5506571482614)
    r = fma(t, p / q, t)
    r = select(past, (r + 3.061616997868383e-17) + 0.7853981633974483, r)
    r = select(steep, (1.5707963267948966 - r) + 6.123233995736766e-17, r)
    r = select(x < 0.0, (3.141592653589793 - r) + 1.2246467991473532e-16, r)
    angle: Traced = select(y < 0.0, -r, r)
    return angle
