"""What the operations on values do: numbers, truth values, poses and steps."""

import math
import operator
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from armwright.arrays import Array
from armwright.program.bytecode.instructions import Op
from armwright.program.language.units import UnitSystem
from armwright.program.syntax.pose_literals import EXACT_TOLERANCE, REPAIR_TOLERANCE
from armwright.spatial.poses import from_noap, homogeneous, inverse
from armwright.spatial.rotations import nearest_rotation, orthonormality_error

# Numbers beyond this are a slip, and squares of them would overflow.
MAX_NUMBER = 1e100
# Points nearer than this part of their distance from the origin, or of a metre, are the same point.
_ROUNDING = 1e-12


class EvaluationError(Exception):
    """An operation has no value; the code of the diagnostic, its message and the word at the location."""

    def __init__(self, code: str, message: str, label: str) -> None:
        """Keep what to say."""
        super().__init__(message)
        self.code, self.message, self.label = code, message, label


def _multiply(a: Any, b: Any) -> Any:
    return _checked_number(a * b) if isinstance(a, float) else _checked_pose(a @ b)


def _divide(a: float, b: float) -> float:
    if b == 0:
        raise EvaluationError("E240", f"{a:g} cannot be divided by 0", "divided by 0 here")
    return _checked_number(a / b)


def _checked_number(value: float) -> float:
    if not abs(value) <= MAX_NUMBER:
        raise EvaluationError("E240", f"the result exceeds {MAX_NUMBER:g}, the largest number", "too large")
    return value


def _checked_pose(X: Array) -> Array:
    """Return a pose or a step whose lengths are numbers of a robot."""
    _checked_number(float(np.abs(X[:3, 3]).max()))
    return X


def _rotation_about(axis: int) -> Callable[[float, UnitSystem], Array]:
    first, second = (axis + 1) % 3, (axis + 2) % 3

    def rotation(angle: float, units: UnitSystem) -> Array:
        # Whole quarter turns are exact: 90 degrees leave no 6e-17 in a program's poses.
        quarters = angle / (math.pi / 2 / units.radians)
        exact = {0: (1.0, 0.0), 1: (0.0, 1.0), 2: (-1.0, 0.0), 3: (0.0, -1.0)}
        is_quarter = quarters == round(quarters)
        radians = angle * units.radians
        c, s = exact[round(quarters) % 4] if is_quarter else (math.cos(radians), math.sin(radians))
        X = np.eye(4)
        X[first, first], X[first, second], X[second, first], X[second, second] = c, -s, s, c
        return X

    return rotation


def _translation(x: float, y: float, z: float, units: UnitSystem) -> Array:
    X = np.eye(4)
    X[:3, 3] = x * units.metres, y * units.metres, z * units.metres
    return X


def _distance(p: Array, q: Array) -> float:
    """Return how far two points are apart [m]: nothing, where rounding alone may have put them apart.

    Where a gripper stands is worked out through joints and frames some metres long, each of which rounds.
    """
    distance = float(np.linalg.norm(p - q))
    scale = max(1.0, float(np.abs(p).max()), float(np.abs(q).max()))
    return distance if distance > _ROUNDING * scale else 0.0


def _pose_from_numbers(numbers: Sequence[float], units: UnitSystem) -> Array:
    """Return twelve numbers as a pose, the rotation made exact where it nearly is one.

    Raises:
        EvaluationError: the first nine are no rotation.
    """
    X = from_noap([*numbers[:9], *(length * units.metres for length in numbers[9:])])
    error = float(orthonormality_error(X[:3, :3]))
    if error > REPAIR_TOLERANCE:
        raise EvaluationError("E206", "the first nine numbers are not a rotation", f"off by {error:.2g}")
    return X if error <= EXACT_TOLERANCE else homogeneous(nearest_rotation(X[:3, :3]), X[:3, 3])


# Those with units take them as their last argument.
OPERATIONS: Mapping[Op, Callable[..., Any]] = {
    Op.MUL: _multiply,
    Op.DIV: _divide,
    Op.ADD: lambda a, b: _checked_number(a + b),
    Op.SUB: lambda a, b: _checked_number(a - b),
    Op.NEG: operator.neg,
    Op.INV: inverse,
    Op.LT: operator.lt,
    Op.LE: operator.le,
    Op.EQ: operator.eq,
    Op.NE: operator.ne,
    Op.GE: operator.ge,
    Op.GT: operator.gt,
    Op.NOT: operator.not_,
    Op.XYZ: _translation,
    Op.ROTX: _rotation_about(0),
    Op.ROTY: _rotation_about(1),
    Op.ROTZ: _rotation_about(2),
    Op.DIST: lambda f, g, units: _distance(f[:3, 3], g[:3, 3]) / units.metres,
    Op.MATX: lambda *values: _pose_from_numbers(values[:-1], values[-1]),
}
# Operations that count in the program's units.
OPERATIONS_WITH_UNITS = frozenset({Op.XYZ, Op.ROTX, Op.ROTY, Op.ROTZ, Op.DIST, Op.MATX})
