"""The closed forms of the builds that the PUMA, the Stanford arm and the UR5 are examples of."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product as combinations

import attrs

from armwright.arrays import Array
from armwright.kinematics.inverse_kinematics.branch_angles import branch_angles
from armwright.kinematics.inverse_kinematics.branches import ClosedForm, Solved
from armwright.kinematics.inverse_kinematics.geometry import ClosedFormGeometry, Sign, Signs, rotated_about_y
from armwright.tracing.vectors import Matrix, Vector, add, apply, product, subtract, transpose

# The order of the branches: arm, elbow (or slide), wrist.
BRANCHES: tuple[Signs, ...] = tuple(combinations((1, -1), repeat=3))  # type: ignore[arg-type]
# Which joints move together, from 1, where a choice is left open: the turn of joint 1, the raising of joint 2, the
# wrist.
_SPHERICAL = ((1, 4, 5, 6), (2, 4, 5, 6), (4, 6))
_PARALLEL = ((1, 2, 3, 4, 5, 6), (2, 4), (2, 3, 4, 6))


@attrs.frozen(kw_only=True, eq=False)
class OfBuild(ClosedForm):
    """The closed form of an arm of a build.

    Attributes:
        geometry: lengths and offsets of the arm.
    """

    geometry: ClosedFormGeometry
    signs: tuple[Signs, ...] = BRANCHES
    choosers: tuple[int, ...] = attrs.field()

    @choosers.default
    def _choosers(self) -> tuple[int, ...]:
        return (1, 2, 6) if self.geometry.family == "parallel" else (1, 2, 4)

    def solve(self, R_BT: Matrix, p_BT: Vector, near: Vector, signs: Sequence[Sign]) -> Solved:
        """Return one branch, over abstract scalars: see ``branch_angles``."""
        p, R_S6 = wrist_pose(self.geometry, R_BT, p_BT)
        arm, elbow, flip = signs
        found = branch_angles(self.geometry, p, R_S6, (arm, elbow, flip), self.geometry.angles(near))
        free = dict(zip(self.choosers, (found.turn_free, found.raise_free, found.wrist_free), strict=True))
        return Solved(self.geometry.joints(found.angles), free, found.reach_error)

    def label(self, branch: int, q: Array) -> str:
        """Name a branch: arm, elbow or slide, wrist.

        The elbow is up where it is above the line from joint 2 to the end of the forearm, above as the axis of joint 1
        points. The wrist of a ``parallel`` arm is up where the angle 5 of its build is positive.
        """
        side, second, flip = self.signs[branch]
        geometry, angles = self.geometry, self.geometry.angles(q.tolist())
        arm = "left" if side > 0 else "right"
        if geometry.family == "stanford":
            return f"{arm}, {'out' if second > 0 else 'back'}, {'no-flip' if flip > 0 else 'flip'}"
        upper, _ = rotated_about_y(angles[1], geometry.upper_arm, 0.0)
        fore, _ = rotated_about_y(angles[1] + angles[2], *geometry.forearm)
        # With the wrist behind joint 2, as it is with the arm to the right, elbow above and elbow below change places.
        elbow = "up" if second * (upper + fore) > 0 else "down"
        if geometry.family == "parallel":
            return f"shoulder {arm}, elbow {elbow}, wrist {'up' if flip > 0 else 'down'}"
        return f"{arm}, {elbow}, {'no-flip' if flip > 0 else 'flip'}"

    def moving(self, free: Sequence[bool]) -> set[int]:
        """Return the joints that move together where the turn, the raising or the wrist is free."""
        together = _PARALLEL if self.geometry.family == "parallel" else _SPHERICAL
        return {joint for joints, is_free in zip(together, free, strict=True) if is_free for joint in joints}


def wrist_pose(geometry: ClosedFormGeometry, R_BT: Matrix, p_BT: Vector) -> tuple[Vector, Matrix]:
    """Return the wrist centre and the orientation of the last wrist frame, seen from the shoulder frame."""
    R_SB = transpose(geometry.X_BS[:3, :3].tolist())
    R_ST = product(R_SB, R_BT)
    p = add(apply(R_SB, subtract(p_BT, geometry.X_BS[:3, 3].tolist())), apply(R_ST, geometry.p_TW.tolist()))
    return p, product(R_ST, geometry.R_T6.tolist())
