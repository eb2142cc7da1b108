"""The configuration words of controllers, by plane trigonometry on the links of the arm in its zero position."""

import cmath
import math
from collections.abc import Mapping

import numpy as np

from armwright.arrays import Array
from armwright.export.conventions import ControllerArm
from armwright.kinematics.forward_kinematics import link_poses

# An angle this near the border of two words may have either [rad]; the same part of a metre for the wrist centre.
_BORDER = 1e-6


class PostureReader:
    """What the controller of one arm would say of its joints.

    Seen from the side, with axis 1 upright, the links of the arm are complex numbers: forward, and i times up.
    """

    def __init__(self, mapped: ControllerArm) -> None:
        """Measure the links of an arm in the zero position of its controller."""
        frames = link_poses(mapped.arm, mapped.zeros)
        axes = mapped.convention.axes
        wrist = _crossing(frames[4], frames[5])
        shoulder, elbow, wrist_centre = (complex(p[0], p[2]) for p in (frames[1, :3, 3], frames[2, :3, 3], wrist))
        self._shoulder = shoulder - complex(frames[0, 0, 3], frames[0, 2, 3]).real
        self._upper, self._fore = elbow - shoulder, wrist_centre - elbow
        self._senses = (float(np.sign(axes[1, 1])), float(np.sign(axes[2, 1])))
        self._coupled = mapped.convention.coupled

    def words(self, shown: Array) -> Mapping[str, set[int]]:
        """Return, by the names of KRL and RAPID, the words that joint positions (6,) of the controller may have."""
        q = np.array(shown)
        if self._coupled is not None:
            joint, other, factor = self._coupled
            q[joint] -= factor * q[other]
        second, third = self._senses[0] * q[1], self._senses[1] * q[2]
        upper, fore = self._upper * cmath.exp(-1j * second), self._fore * cmath.exp(-1j * (second + third))
        ahead = (self._shoulder + upper + fore).real
        bend = -self._senses[1] * cmath.phase(fore / upper)
        negative = [_signs(float(angle)) for angle in shown]
        flipped = _flips(float(shown[4]))
        return {
            "S": {a + 2 * (1 - b) + 4 * c for a in _signs(ahead) for b in _signs(bend) for c in flipped},
            "T": _sums([{bit << i for bit in bits} for i, bits in enumerate(negative)]),
            "cf1": _quadrants(float(shown[0])),
            "cf4": _quadrants(float(shown[3])),
            "cf6": _quadrants(float(shown[5])),
            "cfx": {4 * a + 2 * b + c for a in _signs(ahead) for b in _signs(bend) for c in negative[4]},
        }


def _signs(value: float) -> set[int]:
    """Return 1 for a negative value, 0 for another one, both at the border."""
    return {int(value - _BORDER < 0), int(value + _BORDER < 0)}


def _flips(angle: float) -> set[int]:
    """Return bit 2 of the status of KRL: whether axis 5 is negative, beyond half a turn the other way round."""
    return {bit if abs(angle) < math.pi else 1 - bit for bit in _signs(angle)}


def _quadrants(angle: float) -> set[int]:
    """Return the quadrant of an angle, counted from zero; both at a border."""
    return {math.floor((angle + side) / (math.pi / 2)) for side in (-_BORDER, _BORDER)}


def _sums(parts: list[set[int]]) -> set[int]:
    """Return all sums of one number of each set."""
    sums = {0}
    for part in parts:
        sums = {total + number for total in sums for number in part}
    return sums


def _crossing(first: Array, second: Array) -> Array:
    """Return the point (3,) where the z axes of two frames (4, 4) are nearest, half way between them."""
    A = np.column_stack([first[:3, 2], -second[:3, 2]])
    along = np.linalg.lstsq(A, second[:3, 3] - first[:3, 3], rcond=None)[0]
    return np.asarray((first[:3, 3] + along[0] * first[:3, 2] + second[:3, 3] + along[1] * second[:3, 2]) / 2)
