"""Joint axes as a Denavit-Hartenberg table: frames are put where the convention wants them.

Frame i stands on the axis of joint i+1, where the common normal of the axes of the joints i and i+1 meets it. Two
parallel axes have any number of common normals: that through the place the file gives to joint i+1 is taken.

Axes that are nearly parallel are the hard case. Their common normal is far away, 100 km for an angle of 1e-5 rad and
axes 1 m apart, and dynamics seen from there lose twice as many digits as the distance has. Such axes are meant to be
parallel: a half turn typed as 3.1416 is 0.7e-5 rad off. So they are made parallel.
"""

import math
from collections.abc import Sequence

import attrs
import numpy as np

from armwright.arm.dh import turn, twist
from armwright.arrays import Array
from armwright.spatial.poses import pose

# Axes that differ less from parallel are made so [rad]: what is left out is as small as what far frames would lose.
PARALLEL = 1e-5
# Angles this close to a right one, and lengths this close to 0 beside the size of the arm, are so: typed numbers of
# twelve digits, multiplied a few times.
ROUNDING = 1e-11
_RIGHT_ANGLE = math.pi / 2


@attrs.frozen(kw_only=True)
class Row:
    """A row of the table: the four numbers of one joint, at joint position 0."""

    theta: float
    d: float
    a: float
    alpha: float


@attrs.frozen(kw_only=True, eq=False)
class Frames:
    """The table of a chain of n joints, all joints at 0, in the frame in which the axes are given.

    Attributes:
        first: (4, 4) frame 0.
        rows: n rows.
        poses: n poses (4, 4) of the frames 1 to n.
        bent: (n - 1) angle by which the axis of joint i+1 was turned to make it parallel to that of joint i [rad].
    """

    first: Array
    rows: tuple[Row, ...]
    poses: tuple[Array, ...]
    bent: tuple[float, ...]


def frames_of(joints: Sequence[Array], axes: Sequence[Array], size: float) -> Frames:
    """Return the frames of a chain of joint axes.

    The z axes point as the joint axes do, so joint positions keep their signs. The last frame is the one before it,
    moved by the last joint.

    Args:
        joints: n poses (4, 4) of frames on the axes.
        axes: n unit vectors (3,).
        size: of the arm; lengths are rounded beside it [m].

    Source:
        Denavit & Hartenberg (1955).
    """
    first = X = pose(_first_turn(joints[0][:3, :3], axes[0]), joints[0][:3, 3])
    rows, poses, bent = [], [], []
    for joint, axis in zip(joints[1:], axes[1:], strict=True):
        row, angle = _row(X, joint[:3, 3], axis, size * ROUNDING)
        X = X @ pose(turn(2, row.theta), (0.0, 0.0, row.d)) @ twist(row.alpha, row.a)
        rows.append(row)
        poses.append(X)
        bent.append(angle)
    last = Row(theta=0.0, d=0.0, a=0.0, alpha=0.0)
    return Frames(first=first, rows=(*rows, last), poses=(*poses, X), bent=tuple(bent))


def cleared(array: Array, size: float) -> Array:
    """Return an array without the rounding that stands in place of zeros, beside numbers of some size."""
    return np.where(np.abs(array) <= size * ROUNDING, 0.0, array)


def cleared_pose(X: Array, size: float) -> Array:
    """Return a pose (4, 4) in which the zeros and ones of right angles, and lengths of 0, are exact."""
    R, whole = X[:3, :3], np.round(X[:3, :3])
    return pose(np.where(np.abs(R - whole) <= ROUNDING, whole + 0.0, R), cleared(X[:3, 3], size))


def _first_turn(R: Array, z: Array) -> Array:
    """Return the turn (3, 3) of frame 0: its x along that axis of the joint's own frame which fits best."""
    own = R.T @ z
    largest = int(np.abs(own).argmax())
    x = R[:, (largest + 1) % 3]
    x = x - (x @ z) * z
    x = x / np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], axis=-1)


def _row(X: Array, p: Array, u: Array, tiny: float) -> tuple[Row, float]:
    """Return the row that leads from frame X to a frame on the line through p along u, and how far u was turned."""
    x, z, way = X[:3, 0], X[:3, 2], p - X[:3, 3]
    across, c = np.cross(z, u), float(z @ u)
    s = float(np.linalg.norm(across))
    if s <= PARALLEL:
        aside = way - (way @ z) * z
        a = float(np.linalg.norm(aside))
        normal = aside / a if a > tiny else x
        alpha, d = 0.0 if c > 0 else math.pi, float(way @ z)
        bent = s
    else:
        normal = across / s
        a, alpha, d = float(way @ normal), math.atan2(s, c), float(np.cross(way, u) @ across) / s**2
        bent = 0.0
    # The normal has two directions. The nearer one to the x axis before it keeps theta small; failing that, a > 0.
    nearer = float(x @ normal)
    if nearer < -ROUNDING or (nearer <= ROUNDING and a < -tiny):
        normal, a, alpha = -normal, -a, -alpha if s > PARALLEL else alpha
    theta = math.atan2(float(np.cross(x, normal) @ z), float(x @ normal))
    a, d = (0.0 if abs(length) <= tiny else length for length in (a, d))
    return Row(theta=_squared(theta), d=d, a=a, alpha=_squared(alpha)), bent


def _squared(angle: float) -> float:
    """Return an angle, the multiple of a right angle where it is one but for rounding."""
    whole = round(angle / _RIGHT_ANGLE) * _RIGHT_ANGLE
    return whole + 0.0 if abs(angle - whole) <= ROUNDING else angle
