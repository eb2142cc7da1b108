"""Drives that move several joints, and joints that several drives move: a constant matrix between both.

The joints are where the drives have them,

    q = C m

with the positions m of the drives, behind their gears. Speeds and accelerations follow the same matrix. The power is
the same on both sides, so that efforts follow its transpose: the drives give Cᵀ tau where the joints need tau.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property

import attrs
import numpy as np

from armwright.arm.limits import JointLimits, Limits
from armwright.arrays import LARGEST, Array, ArrayLike, array_key, floats, read_only, reduce_by_fields
from armwright.errors import InvalidValueError, KindError, ShapeError, shown

# A matrix whose rows and columns are of length 1 and that shrinks some direction more than this has no inverse.
_SINGULAR = 1e-6
# What an inverse leaves in place of whole numbers, and in place of zeros beside numbers of some size.
_NOISE = 1e-14


def _matrix(value: ArrayLike) -> Array:
    C = floats(value, "coupling", LARGEST)
    if C.ndim != 2 or C.shape[0] != C.shape[1] or not C.size:
        raise ShapeError(f"coupling: expected a square matrix, a row for each joint, got shape {C.shape}")
    return read_only(C)


def _limits(value: Iterable[Limits]) -> tuple[Limits, ...]:
    try:
        limits = tuple(value)
    except TypeError as error:
        raise KindError(f"coupling: expected the limits of the drives as a list, got {shown(value)}") from error
    for i, each in enumerate(limits, 1):
        if not isinstance(each, Limits):
            raise KindError(f"coupling: expected limits to be Limits, got {shown(each)} for drive {i}")
    return limits if any(each != Limits() for each in limits) else ()


@attrs.frozen(kw_only=True)
class Coupling:
    """How the n drives of an arm move its n joints.

    Drive i is the ``Motor`` number i of the arm, in the units of joint i: [rad] where that rotates, else [m]. Inertia,
    friction and gear ratio of a motor are those of the drive, at its position m_i behind the gear.

    Attributes:
        matrix: (n, n) C of q = C m: a row for each joint, a column for each drive.
        limits: what each drive may do, beside what the joints may; one for each drive, or none at all.

    Source:
        Spong, Hutchinson & Vidyasagar (2006), chapter 7, on the planar elbow manipulator with remotely driven link.
    """

    matrix: Array = attrs.field(converter=_matrix, eq=array_key)
    limits: tuple[Limits, ...] = attrs.field(default=(), converter=_limits)

    __reduce__ = reduce_by_fields

    def __attrs_post_init__(self) -> None:
        """Refuse a matrix by which no drives move the joints anywhere, and limits of other drives."""
        n = len(self.matrix)
        if self.limits and len(self.limits) != n:
            raise ShapeError(f"coupling: expected limits for all {n} drives or for none, got {len(self.limits)}")
        if self.limits and np.array_equal(self.matrix, np.eye(n)):
            raise InvalidValueError(
                "coupling: each drive moves its own joint alone, so that its limits are those of the joint; specify "
                "them there"
            )
        scaled = self.matrix
        for axis in (1, 0):
            lengths = np.linalg.norm(scaled, axis=axis, keepdims=True)
            if not lengths.all():
                what = f"no drive moves joint {int(np.argmin(lengths)) + 1}"
                what = what if axis == 1 else f"drive {int(np.argmin(lengths)) + 1} moves no joint"
                raise InvalidValueError(f"coupling: {what}: its row or column is 0; expected a matrix with an inverse")
            scaled = scaled / lengths
        if np.linalg.svd(scaled, compute_uv=False)[-1] < _SINGULAR:
            raise InvalidValueError(
                f"coupling: the matrix {self.matrix.tolist()} is singular, so that some positions of the joints have "
                "no or endless positions of the drives; expected a matrix with an inverse"
            )

    @cached_property
    def inverse(self) -> Array:
        """The inverse (n, n) of ``matrix``: the drives by the joints; whole numbers in it are exact."""
        T = np.linalg.inv(self.matrix)
        size = np.minimum(np.abs(T).max(axis=0), np.abs(T).max(axis=1, keepdims=True))
        T = np.where(np.abs(T) < _NOISE * size, 0.0, T)
        whole = np.round(T)
        return read_only(np.where((whole != 0) & (np.abs(T - whole) < _NOISE), whole, T))

    @cached_property
    def drive_limits(self) -> JointLimits:
        """The limits of all drives, each (n,); infinite where nothing is known."""
        limits = self.limits or (Limits(),) * len(self.matrix)
        values = np.array([attrs.astuple(each) for each in limits]).T
        return JointLimits(**dict(zip(attrs.fields_dict(Limits), values, strict=True)))

    @property
    def mixed(self) -> tuple[int, ...]:
        """Which drives, from 0, do not move just as their joint does, or do not move it alone."""
        off = self.matrix - np.eye(len(self.matrix))
        return tuple(np.flatnonzero(off.any(axis=0) | off.any(axis=1)).tolist())

    def drives(self, q: Array) -> Array:
        """Return positions, speeds or accelerations (..., n) of the drives, from those of the joints."""
        return np.asarray(q @ self.inverse.T)

    def joints(self, m: Array) -> Array:
        """Return positions, speeds or accelerations (..., n) of the joints, from those of the drives."""
        return np.asarray(m @ self.matrix.T)

    def drive_efforts(self, tau: Array) -> Array:
        """Return the efforts (..., n) of the drives, from those at the joints [N m] or [N]."""
        return np.asarray(tau @ self.matrix)

    def joint_efforts(self, efforts: Array) -> Array:
        """Return the efforts (..., n) at the joints, from those of the drives [N m] or [N]."""
        return np.asarray(efforts @ self.inverse)
