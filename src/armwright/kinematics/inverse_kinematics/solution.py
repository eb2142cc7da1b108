"""What inverse kinematics answers: branches with labels and violations, and one word on the whole."""

from __future__ import annotations

import enum
import math
from collections.abc import Iterator, Sequence

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array, ArrayLike, array_key, joint_array, read_only, reduce_by_fields
from armwright.errors import ArmwrightError, counted
from armwright.notebook import html_table
from armwright.spatial.poses import position_text

# A position this close to its limit, relative to the range of the joint, is at the limit and not beyond it.
_AT_LIMIT = 1e-9
# A nearest pose turned by less than this has the orientation that was asked for [rad].
_SHOWN_TURN = 2e-6
# A nearest pose moved by less than this is at the position that was asked for [m].
_AT_POSITION = 1e-5


class Outcome(enum.StrEnum):
    """One word on a pose.

    ``SOLVED``: at least one configuration inside the limits. ``SINGULAR``: the same, but a joint is free there.
    ``OUT_OF_LIMITS``: configurations exist, none inside the limits. ``OUT_OF_REACH``: no configuration exists.
    """

    SOLVED = "solved"
    SINGULAR = "singular"
    OUT_OF_LIMITS = "out of limits"
    OUT_OF_REACH = "out of reach"


@attrs.frozen(kw_only=True)
class Violation:
    """One joint outside its limits, or the drive of one.

    Attributes:
        joint: number of the joint, from 1.
        value: where it would stand [rad] or [m].
        limit: the limit it passes.
        revolute: whether ``value`` is an angle.
        name: of the joint; empty where it has none.
        drive: whether it is the drive of the joint, one of coupled drives with limits of their own.
    """

    joint: int
    value: float
    limit: float
    revolute: bool
    name: str = ""
    drive: bool = False

    @property
    def excess(self) -> float:
        """How far beyond the limit [rad] or [m]."""
        return abs(self.value - self.limit)

    def __str__(self) -> str:
        """Say it in degrees or millimetres."""
        unit, scale = ("deg", math.degrees(1.0)) if self.revolute else ("mm", 1e3)
        name = f" ('{self.name}')" if self.name else ""
        of = "the drive of " if self.drive else ""
        return (
            f"{of}joint {self.joint}{name} would be at {self.value * scale:.1f} {unit}, "
            f"{self.excess * scale:.1f} {unit} beyond its limit {self.limit * scale:.1f} {unit}"
        )


@attrs.frozen(kw_only=True)
class Branch:
    """One solution.

    Attributes:
        q: (n,) joint positions [rad] or [m].
        label: such as ``right, up, no-flip``.
        violations: joints outside their limits; empty when the configuration can be taken.
        free: numbers of the joints that may rotate together without moving the tool, from 1; empty unless singular.
        position_error: distance of the tool from the goal [m].
        rotation_error: angle of the tool from the orientation of the goal [rad].
        swivel: of an arm of seven joints with a closed form: see ``swivel_of`` [rad] or [m].
    """

    q: Array = attrs.field(converter=read_only, eq=array_key)
    label: str
    violations: tuple[Violation, ...] = ()
    free: tuple[int, ...] = ()
    position_error: float = 0.0
    rotation_error: float = 0.0
    swivel: float | None = None

    __reduce__ = reduce_by_fields

    @property
    def allowed(self) -> bool:
        """Whether every joint is inside its limits."""
        return not self.violations


@attrs.frozen(kw_only=True)
class InverseSolution:
    """All solutions for one pose.

    Attributes:
        arm: the arm.
        outcome: one word on the whole.
        branches: the solutions, those inside the limits first, each nearest to the start that was passed first.
        distance: how far the pose is out of reach [m]; 0 where it is in reach.
        nearest_pose: (4, 4) the pose in reach nearest to the goal: with a closed form of the same orientation,
            else the best that was found.
        rotation_error: angle between the orientations of the nearest and the requested pose [rad].
    """

    arm: Arm
    outcome: Outcome
    branches: tuple[Branch, ...]
    distance: float
    nearest_pose: Array = attrs.field(converter=read_only, eq=array_key)
    rotation_error: float = 0.0

    __reduce__ = reduce_by_fields

    def __iter__(self) -> Iterator[Branch]:
        """Walk through the branches, nearest first."""
        return iter(self.branches)

    @property
    def allowed(self) -> tuple[Branch, ...]:
        """The branches inside the limits, nearest first; none when the pose is out of reach."""
        if self.outcome is Outcome.OUT_OF_REACH:
            return ()
        return tuple(branch for branch in self.branches if branch.allowed)

    @property
    def best(self) -> Branch:
        """The nearest branch inside the limits.

        Raises:
            NoSolutionError: there is none; the text says why and how far out.
        """
        for branch in self.allowed:
            return branch
        raise NoSolutionError(self)

    def explain(self) -> str:
        """Say in one sentence why no configuration can be taken."""
        turned = _shown(math.degrees(self.rotation_error), 2)
        if self.outcome is Outcome.OUT_OF_REACH and self.rotation_error > _SHOWN_TURN and self.distance < _AT_POSITION:
            return (
                f"'{self.arm.name}', an arm of {counted(self.arm.n, 'joint')}, cannot turn its tool to the pose: at "
                f"this position the nearest orientation is {turned} deg away"
            )
        if self.outcome is Outcome.OUT_OF_REACH:
            also = f" and {turned} deg" if self.rotation_error > _SHOWN_TURN else ""
            return (
                f"the pose is {_shown(self.distance * 1e3, 1)} mm{also} out of reach of '{self.arm.name}'; "
                f"the nearest in reach has its origin at {position_text(self.nearest_pose[:3, 3])}"
            )
        least = min(self.branches, key=lambda branch: max((fault.excess for fault in branch.violations), default=0.0))
        faults = "; ".join(str(violation) for violation in least.violations)
        return f"no configuration of '{self.arm.name}' is inside the joint limits; in the closest, {faults}"

    def _repr_html_(self) -> str:
        """Show the outcome, and every branch with its configuration and what keeps it from being taken."""
        columns = ("branch", *(f"q{number}" for number in range(1, self.arm.n + 1)), "outside its limits")
        rows = [(branch.label, *branch.q.tolist(), "; ".join(map(str, branch.violations))) for branch in self.branches]
        return html_table(f"{self.arm.name}: {self.outcome} (rad, m)", columns, rows)


def _shown(value: float, decimals: int) -> str:
    """Write a number with some decimals, or with more where these would be zeros."""
    text = f"{value:.{decimals}f}"
    return text if float(text) else f"{value:.1g}"


class NoSolutionError(ArmwrightError, ValueError):
    """No configuration inside the limits brings the tool to the pose; ``solution`` has the nearest results."""

    def __init__(self, solution: InverseSolution) -> None:
        """Keep the solution; its explanation is the text."""
        self.solution = solution
        super().__init__(solution.explain())


def violations(arm: Arm, q: ArrayLike) -> tuple[Violation, ...]:
    """Return the joints that one configuration (n,) puts outside their limits, in order."""
    return violations_of(arm, joint_array(q, arm.n).tolist())


def violations_of(arm: Arm, positions: Sequence[float]) -> tuple[Violation, ...]:
    """Return the same of n joint positions that have been checked."""
    if arm.coupling is not None and arm.coupling.limits:
        positions = [*positions, *arm.coupling.drives(np.array(positions)).tolist()]
    return violations_of_all(arm, positions)


def violations_of_all(arm: Arm, positions: Sequence[float]) -> tuple[Violation, ...]:
    """Return the same of the positions of all that has limits: joints, and drives behind them where they have some."""
    violated = []
    own = [joint.limits for joint in arm.joints]
    limits = own if len(positions) == arm.n or arm.coupling is None else [*own, *arm.coupling.limits]
    for k, (it, value) in enumerate(zip(limits, positions, strict=True)):
        limit = min(max(value, it.lower), it.upper)
        if abs(value - limit) > _AT_LIMIT * max(1.0, abs(limit)):
            joint, number = arm.joints[k % arm.n], k % arm.n + 1
            violated.append(
                Violation(
                    joint=number, value=value, limit=limit, revolute=joint.revolute, name=joint.name, drive=k >= arm.n
                )
            )
    return tuple(violated)
