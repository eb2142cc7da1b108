"""What the operations on values do: numbers, truth values, poses and steps."""

import math
import operator
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from armwright.arrays import Array
from armwright.program.bytecode.instructions import Op
from armwright.program.language.units import MAX_NUMBER, UnitSystem
from armwright.program.syntax.pose_literals import EXACT_TOLERANCE, REPAIR_TOLERANCE
from armwright.spatial.euler import from_rpy, to_rpy
from armwright.spatial.poses import from_noap, homogeneous, inverse
from armwright.spatial.rotations import (
    exact_cosine,
    exact_sine,
    nearest_rotation,
    orthonormality_error,
    rotation_from_vector,
    rotation_vector,
)

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


# ---- numbers out of poses, and back --------------------------------------------------------------------------------

_NO_SHIFT = np.zeros(3)


def _coordinate(axis: int) -> Callable[[Array, UnitSystem], float]:
    def coordinate(X: Array, units: UnitSystem) -> float:
        value, scale = float(X[axis, 3]), max(1.0, float(np.abs(X[:3, 3]).max()))
        return value / units.metres if abs(value) > _ROUNDING * scale else 0.0

    return coordinate


def _rpy_angle(which: int) -> Callable[[Array, UnitSystem], float]:
    return lambda X, units: float(to_rpy(X[:3, :3])[which]) / units.radians


def _turn_angle(X: Array, units: UnitSystem) -> float:
    return float(np.linalg.norm(rotation_vector(X[:3, :3]))) / units.radians


def _axis_component(axis: int) -> Callable[[Array], float]:
    """Return a component of the unit vector about which a pose is turned: z where it is not turned."""

    def component(X: Array) -> float:
        w = rotation_vector(X[:3, :3])
        angle = float(np.linalg.norm(w))
        return float(w[axis]) / angle if angle else float(axis == 2)

    return component


def _turn_rpy(roll: float, pitch: float, yaw: float, units: UnitSystem) -> Array:
    return homogeneous(from_rpy(*(angle * units.radians for angle in (roll, pitch, yaw))), _NO_SHIFT)


def _turn_about(x: float, y: float, z: float, angle: float, units: UnitSystem) -> Array:
    length = math.hypot(x, y, z)
    if not length:
        raise EvaluationError("E240", "an axis of rotation needs a direction, but this is (0, 0, 0)", "no axis")
    return homogeneous(rotation_from_vector(np.array([x, y, z]) / length * (angle * units.radians)), _NO_SHIFT)


# ---- numbers -------------------------------------------------------------------------------------------------------


def _square_root(value: float) -> float:
    if value < 0:
        raise EvaluationError("E240", f"{value:g} has no square root", "negative")
    return math.sqrt(value)


def _rounded(value: float) -> float:
    """Return the nearest whole number; of two, the one farther from 0."""
    return math.copysign(math.floor(abs(value) + 0.5), value) + 0.0


def _tangent(angle: float, units: UnitSystem) -> float:
    radians = angle * units.radians
    if not (cosine := exact_cosine(radians)):
        raise EvaluationError("E240", f"{angle:g} {units.angle.lower()} has no tangent", "a right angle")
    return _checked_number(exact_sine(radians) / cosine)


def _arc(name: str, function: Callable[[float], float]) -> Callable[[float, UnitSystem], float]:
    def arc(value: float, units: UnitSystem) -> float:
        if not -1 <= value <= 1:
            raise EvaluationError("E240", f"{name} takes a number from -1 to 1, not {value:g}", "out of range")
        return function(value) / units.radians

    return arc


def _modulo(value: float, divisor: float) -> float:
    """Return the remainder, which has the sign of the divisor."""
    if not divisor:
        raise EvaluationError("E240", f"{value:g} cannot be divided by 0", "divided by 0 here")
    return value % divisor


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
    Op.RPY: _turn_rpy,
    Op.ROT: _turn_about,
    **{op: _coordinate(axis) for axis, op in enumerate((Op.X, Op.Y, Op.Z))},
    **{op: _rpy_angle(which) for which, op in enumerate((Op.ROLL, Op.PITCH, Op.YAW))},
    Op.ANGLE: _turn_angle,
    **{op: _axis_component(axis) for axis, op in enumerate((Op.AXISX, Op.AXISY, Op.AXISZ))},
    Op.ABS: abs,
    Op.SQRT: _square_root,
    Op.ROUND: _rounded,
    Op.SIN: lambda angle, units: exact_sine(angle * units.radians),
    Op.COS: lambda angle, units: exact_cosine(angle * units.radians),
    Op.TAN: _tangent,
    Op.ASIN: _arc("ASIN", math.asin),
    Op.ACOS: _arc("ACOS", math.acos),
    Op.ATAN2: lambda y, x, units: math.atan2(y, x) / units.radians,
    Op.MOD: _modulo,
    Op.MIN: min,
    Op.MAX: max,
}
# Operations that count in the program's units.
OPERATIONS_WITH_UNITS = frozenset(
    {Op.XYZ, Op.ROTX, Op.ROTY, Op.ROTZ, Op.DIST, Op.MATX, Op.RPY, Op.ROT, Op.X, Op.Y, Op.Z, Op.ROLL, Op.PITCH, Op.YAW}
    | {Op.ANGLE, Op.SIN, Op.COS, Op.TAN, Op.ASIN, Op.ACOS, Op.ATAN2}
)
