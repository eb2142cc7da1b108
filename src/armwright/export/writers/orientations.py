"""Orientations as controllers write them: quaternions, axis and angle, and angles about Z, Y and X."""

import math

from armwright.arrays import Array

# Below this part of a unit vector, a component says nothing about an angle.
_NOTHING = 1e-12


def quaternion(R: Array) -> tuple[float, float, float, float]:
    """Return the unit quaternion w, x, y, z of a rotation (3, 3), w not negative.

    The component that is largest is found first, so that nothing is divided by a small number, for half turns as well.

    Source:
        S. W. Shepperd, Quaternion from rotation matrix, Journal of Guidance and Control 1 (1978).
    """
    m = R.tolist()
    trace = m[0][0] + m[1][1] + m[2][2]
    diagonal = (trace, m[0][0], m[1][1], m[2][2])
    largest = max(range(4), key=diagonal.__getitem__)
    if largest == 0:
        q = [1 + trace, m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]]
    else:
        i = largest - 1
        j, k = (i + 1) % 3, (i + 2) % 3
        q = [m[k][j] - m[j][k], 0.0, 0.0, 0.0]
        q[1 + i] = 1 + 2 * m[i][i] - trace
        q[1 + j] = m[i][j] + m[j][i]
        q[1 + k] = m[i][k] + m[k][i]
    norm = math.sqrt(sum(x * x for x in q))
    if abs(q[0]) < _NOTHING * norm:
        # Both quaternions of a half turn are as good: the one whose first component that counts is positive.
        q[0] = 0.0
    norm = math.copysign(norm, next(x for x in q if abs(x) >= _NOTHING * norm))
    return q[0] / norm, q[1] / norm, q[2] / norm, q[3] / norm


def rotation_vector(R: Array) -> list[float]:
    """Return the axis of a rotation (3, 3), as long as its angle [rad], which is pi at most."""
    w, *xyz = quaternion(R)
    sine = math.sqrt(sum(x * x for x in xyz))
    factor = 2.0 if sine < _NOTHING else 2.0 * math.atan2(sine, w) / sine
    return [factor * x for x in xyz]


def zyx_angles(R: Array) -> tuple[float, float, float]:
    """Return the angles [deg] about Z, then the new Y, then the new X of a rotation (3, 3).

    Where the second is a quarter turn only the sum or the difference of the others counts, and the third is 0.
    """
    m = R.tolist()
    level = math.hypot(m[0][0], m[1][0])
    b = math.atan2(-m[2][0], level)
    if level < _NOTHING:
        a, c = math.atan2(-m[0][1], m[1][1]), 0.0
    else:
        a = math.atan2(m[1][0], m[0][0])
        # Of what is left without the first turn, whose rounding near a quarter turn the third then makes good.
        c = math.atan2(math.sin(a) * m[0][2] - math.cos(a) * m[1][2], math.cos(a) * m[1][1] - math.sin(a) * m[0][1])
    return math.degrees(a), math.degrees(b), math.degrees(c)
