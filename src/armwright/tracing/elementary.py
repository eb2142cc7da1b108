"""Elementary functions as straight-line arithmetic, so that a processor can run many at once.

They are written over traced scalars and become part of every emitted graph that needs them: no branch, and no call.

Accuracy, against correctly rounded values (tests/tracing/test_kernel.py): sine and cosine within 2 ulp for
|x| up to 1e5; beyond, the error grows as |x| · 1e-22 and reaches 1e-9 at 1e13; not meant beyond 1e15. A processor that
rounds products before it adds has 2 ulp up to 1e6, and beyond an error of |x| · 1e-16. Arc tangent within 2 ulp for
lengths from 1e-320 to 1e300. The sine of -0.0 is +0.0, the sign of an arc tangent at y = -0.0 is that of +0.0, and at
x = -0.0 it is the arc tangent at +0.0. Exponentials within 2 ulp; those below 1e-307 are 0. Cube roots within 2 ulp for
magnitudes up to 1e300. What is not a number goes on as such.

Source:
    Argument reduction in three parts: Cody & Waite (1980). Polynomials of sine and cosine: the fdlibm kernels (Sun
    Microsystems, 1993).
"""

import math

from armwright.tracing.graph import LARGEST_POWER, Traced, traced
from armwright.tracing.scalar import Scalar, select

# (1 - atan(t) / t) / t² in powers of t², interpolated at the Chebyshev nodes of |t| <= 0.6: 6e-18 of the angle.
_ARC_TANGENT = (
    0.3333333333333333, -0.19999999999998042, 0.14285714285359047, -0.11111111085648358, 0.09090908134711481,
    -0.07692286079572928, 0.06666348256046135, -0.05879142647055357, 0.05240336902038005, -0.046455869140325824,
    0.03919752596475187, -0.028626739465747564, 0.015276882099043683, -0.004237518151631131,
)  # fmt: skip

# Coefficients of the exponential series, 1 / k! from the thirteenth down to the second: 4e-18 for |x| <= ln 2 / 2.
_POWERS = tuple(1.0 / math.factorial(k) for k in range(13, 1, -1))
# Powers of 2 down to this one are numbers of full precision, and have one factor 2 to spare.
_LEAST_POWER = -1021
# The exponential function of less is 0, that of more infinite.
_POWER_RANGE = -707.0, LARGEST_POWER

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
    low, high = select(steep, ax, ay), select(steep, ay, ax)
    # Above 0.6 the angle is measured from pi/4; one division serves both.
    past = low > 0.6 * high
    above, below = select(past, low - high, low), select(past, low + high, high)
    # Only of the origin the lengths are 0; NaN goes on.
    t = above / select(below <= 0.0, 1.0, below)
    z = t * t
    w = z * z
    even: Scalar = _ARC_TANGENT[12]
    odd: Scalar = _ARC_TANGENT[13]
    for i in range(10, -1, -2):
        even, odd = fma(w, even, _ARC_TANGENT[i]), fma(w, odd, _ARC_TANGENT[i + 1])
    r = fma(-(t * z), fma(z, odd, even), t)
    r = select(past, (r + 3.061616997868383e-17) + 0.7853981633974483, r)
    r = select(steep, (1.5707963267948966 - r) + 6.123233995736766e-17, r)
    r = select(x < 0.0, (3.141592653589793 - r) + 1.2246467991473532e-16, r)
    angle: Traced = select(y < 0.0, -r, r)
    return angle


def exponential(x: Traced) -> Traced:
    """Return e to the power of ``x``: 2^n e^r with a whole n and |r| <= ln 2 / 2."""
    low, high = _POWER_RANGE
    shift = _ROUNDING - _LEAST_POWER
    whole = fma(x, 1.4426950408889634, shift)
    n = whole - shift
    r = fma(n, -1.9082149292705877e-10, fma(n, -0.6931471803691238, x))
    series: Scalar = _POWERS[0]
    for coefficient in _POWERS[1:]:
        series = fma(r, series, coefficient)
    power = (fma(r * r, series, r) + 1.0) * 2.0**_LEAST_POWER
    # The bits of n less the least power, which stand at the end of the representation, each stand for a factor.
    for place in range(10):
        power = select(traced("bit", whole, float(place)), power * 2.0 ** (1 << place), power)
    power = select(traced("bit", whole, 10.0), power * 2.0**512 * 2.0**512, power)
    bounded: Traced = select(x < low, 0.0, select(x > high, math.inf, power))
    return bounded


def cube_root(x: Traced) -> Traced:
    """Return the cube root of ``x``, by Halley's method.

    It begins with |x|^(1/4 + 1/16 + ... + 1/1024), whose exponent is 1/3 but for a thousandth of it.
    """
    # Only the root of 0 is 0; NaN goes on.
    is_zero = abs(x) <= 0.0
    magnitude = select(is_zero, 1.0, abs(x))
    y: Scalar = 1.0
    power = magnitude
    for _ in range(5):
        power = traced("sqrt", traced("sqrt", power))
        y = power * y
    for _ in range(3):
        other = magnitude / (y * y)
        y = y + y * ((other - y) / (y + y + other))
    root: Traced = select(is_zero, 0.0, select(x < 0.0, -y, y))
    return root
