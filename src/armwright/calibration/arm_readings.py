"""Where an arm says that its tool is, and how far from there it may be: for pictures taken with the arm."""

from __future__ import annotations

from collections.abc import Sequence

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array, ArrayLike, floats, joint_array, one_or_each, positive
from armwright.errors import InvalidValueError
from armwright.kinematics.forward_kinematics import forward
from armwright.kinematics.jacobians import jacobian
from armwright.spatial.rotations import rotation_from_vector, skew_matrix


def _deviations(value: ArrayLike | None) -> Array | None:
    if value is None:
        return None
    deviations = floats(value, "standard deviations of the joints", 1e3)
    if not (deviations > 0).all():
        raise InvalidValueError(f"standard deviations of the joints: expected numbers above 0, got {deviations}")
    return deviations


def _position(value: float) -> float:
    return positive(value, "position", "m")


def _orientation(value: float) -> float:
    return positive(value, "orientation", "rad")


@attrs.frozen(kw_only=True, eq=False)
class ArmAccuracy:
    """Standard deviations of where an arm is, about where its joint positions put it.

    Attributes:
        position: of each coordinate of the tool [m].
        orientation: of rotations of the tool about each axis [rad].
        joints: (n,) of each joint [rad] or [m], or one for all; instead of the two above.
    """

    position: float = attrs.field(default=1e-4, converter=_position)
    orientation: float = attrs.field(default=5e-4, converter=_orientation)
    joints: Array | None = attrs.field(default=None, converter=_deviations)

    def scaled(self, factor: float) -> ArmAccuracy:
        """Return the accuracy of an arm with standard deviations that are as many times as large."""
        joints = None if self.joints is None else self.joints * factor
        return ArmAccuracy(position=self.position * factor, orientation=self.orientation * factor, joints=joints)


@attrs.frozen(kw_only=True, eq=False)
class ArmReadings:
    """Joint positions of an arm, each with unknown corrections that its accuracy keeps small.

    Corrections are counted in standard deviations: those of the pose of the tool, or of each joint.

    Attributes:
        arm: with n joints.
        q: (m, n) joint positions [rad] or [m].
        accuracy: of the arm.
    """

    arm: Arm
    q: Array
    accuracy: ArmAccuracy = attrs.field(factory=ArmAccuracy)

    def __attrs_post_init__(self) -> None:
        """Refuse joint positions of another arm."""
        joint_array(self.q, self.arm.n)

    @property
    def corrections(self) -> int:
        """How many corrections a reading has."""
        return 6 if self.accuracy.joints is None else self.arm.n

    def take(self, numbers: Sequence[int]) -> ArmReadings:
        """Return some of the readings, by their numbers from 0."""
        return attrs.evolve(self, q=self.q[list(numbers)])

    def hand(self, corrections: Array) -> tuple[Array, Array]:
        """Return the poses of the tool, and how corrections move it.

        Args:
            corrections: (m, k), in standard deviations.

        Returns:
            (m, 4, 4) in the base frame, and (m, 6, k) twists of the tool.
        """
        if self.accuracy.joints is not None:
            deviations = one_or_each(self.accuracy.joints, self.arm.n, "standard deviations of the joints", "joint")
            q = self.q + corrections * deviations
            return forward(self.arm, q), jacobian(self.arm, q, "tool") * deviations
        X = np.array(forward(self.arm, self.q))
        rho, phi = corrections[:, :3] * self.accuracy.position, corrections[:, 3:] * self.accuracy.orientation
        turned = rotation_from_vector(phi)
        X[:, :3, 3] += (X[:, :3, :3] @ rho[..., None])[..., 0]
        X[:, :3, :3] = X[:, :3, :3] @ turned
        twists = np.zeros((len(X), 6, 6))
        twists[:, :3, :3] = np.swapaxes(turned, 1, 2) * self.accuracy.position
        # The right Jacobian of the rotation, whose vector is small.
        W = skew_matrix(phi)
        twists[:, 3:, 3:] = (np.eye(3) - W / 2 + W @ W / 6) * self.accuracy.orientation
        return X, twists
