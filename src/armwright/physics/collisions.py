"""Whether a planned MOVE runs into anything: decided along its whole path, before it begins."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import NamedTuple

import attrs
import numpy as np

from armwright.arm.guessed_solids import guessed_radii
from armwright.arm.model import Arm
from armwright.arrays import Array, ArrayLike, read_only
from armwright.cell.model import Cell
from armwright.cell.part_poses import PartPoses
from armwright.compiled.arm import planning_arm
from armwright.kinematics.forward_kinematics import forward, link_poses
from armwright.motion.trajectory import Trajectory, hold
from armwright.physics.cell_bodies import Body, has_solids
from armwright.physics.clearance import RESOLUTION, ClearanceChecker, Closest, PlacedArm, Window
from armwright.physics.configuration_checks import ConfigurationChecks
from armwright.physics.frame_slides import frame_course, slide, slide_base
from armwright.physics.joint_space import Margins
from armwright.physics.placed_bodies import CellBodies, Role
from armwright.physics.planned_move import PlannedMove
from armwright.physics.planner import PlannedPath, plan_path
from armwright.physics.wanted_contacts import Surroundings, WantedContacts

# Larger distances are not looked for [m].
LOOKED_FOR = 0.05
# Distances that are computed at most for the clearance of a stage, and for the depth of a collision.
_EVALUATIONS, _DEPTH_EVALUATIONS = 4000, 1000
# Points on the path of the tool from which its length is summed.
_PATH_POINTS = 201
# Deeper overlaps than this are not distinguished [m].
_FAR = 1e3


@attrs.frozen(kw_only=True)
class StageClearance:
    """The least distance of an arm, and what it holds, to other bodies on a stage; wanted contacts do not count.

    Attributes:
        distance: the least that was found [m]; None where nothing comes as near as ``LOOKED_FOR``.
        bound: it is no less than this anywhere [m].
        bodies: the names of both bodies, that of the arm first; empty where nothing comes near.
        time: when they are so near, since the stage began [s].
        point: (3,) where, in the world [m].
    """

    distance: float | None
    bound: float
    bodies: tuple[str, ...] = ()
    time: float = 0.0
    point: tuple[float, ...] = ()


@attrs.frozen(kw_only=True, eq=False)
class Collision:
    """Where a MOVE would run into something for the first time.

    Attributes:
        bodies: the names of both bodies, that of the arm first.
        stage: on which stage, from 0; the last where it is hit after it has come to rest.
        fraction: how far along the path of that stage.
        time: when, since the MOVE began [s].
        depth: how deep they overlap at most [m]; below 0 where they only come so near that the depth is not known.
        point: (3,) where in the world [m].
        at_start: whether they touch before the arm moves at all.
        at_rest: whether the arm has come to rest before.
        other_arm: the other arm, if the second body is on one; None otherwise.
        guessed: whether the shape of one of them is a guess.
    """

    bodies: tuple[str, str]
    stage: int
    fraction: float
    time: float
    depth: float
    point: Array = attrs.field(converter=read_only)
    at_start: bool
    at_rest: bool
    other_arm: str | None
    guessed: bool


@attrs.frozen(kw_only=True, eq=False)
class MoveCheck:
    """What is known of a planned MOVE.

    Attributes:
        collision: the first; None where it is clear.
        clearances: of each stage, where it is clear.
    """

    collision: Collision | None
    clearances: tuple[StageClearance, ...] = ()


@attrs.frozen(kw_only=True)
class CheckedBodies:
    """What was looked at for collisions in a run.

    Attributes:
        pairs: how many pairs of bodies may not meet, at the start.
        guessed: by arm of which no solids are known, the radii of the guessed ones, the largest and the smallest [m].
        estimated: the names of bodies of other arms that their files call a guess.
        left_out: pairs of names that do not count, because they meet at the start though one of them is a guess.
    """

    pairs: int
    guessed: Mapping[str, tuple[float, float]]
    estimated: tuple[str, ...]
    left_out: tuple[tuple[str, str], ...]


class _PlainArm(NamedTuple):
    """An arm where nothing can be compiled."""

    arm: Arm

    def link_poses(self, q: ArrayLike) -> Array:
        return link_poses(self.arm, q)


class CellCollisions:
    """The bodies of a cell, for motions of its arms."""

    def __init__(self, cell: Cell) -> None:
        """Collect the bodies, and leave out the pairs in which a guess is too fat from the start."""
        self._cell = cell
        self._bodies = CellBodies(cell)
        compiled = {name: planning_arm(arm.arm) for name, arm in cell.arms.items()}
        self._arms = {
            name: PlacedArm(_PlainArm(arm) if isinstance(arm, Arm) else arm, cell.arms[name].base)
            for name, arm in compiled.items()
        }
        self._slides = {
            name: PlacedArm(_PlainArm(slide(name)), slide_base(frame)) for name, frame in cell.moving_frames.items()
        }
        at_start = PartPoses.standing(cell)
        bodies = self._bodies.arranged(at_start)
        pairs = self._bodies.pairs(bodies)
        self._checker = ClearanceChecker(self._arms, bodies, pairs)
        self._left_out = self._too_fat(bodies, pairs)
        self._count = len(pairs) - len(self._left_out)

    def _too_fat(self, bodies: Sequence[Body], pairs: Sequence[tuple[int, int]]) -> frozenset[tuple[int, int]]:
        """Return the pairs that meet where the cell starts, though one of them is only a guess."""
        motions = {name: hold(arm.start, 0.0) for name, arm in self._cell.arms.items()}
        distances = self._checker.distances_at(motions, np.zeros(1), np.arange(len(pairs)), RESOLUTION)[0]
        return frozenset(
            pair
            for pair, distance in zip(pairs, distances.tolist(), strict=True)
            if distance <= 0 and self._may_be_too_fat(bodies, pair)
        )

    def _may_be_too_fat(self, bodies: Sequence[Body], pair: tuple[int, int]) -> bool:
        """Whether a link of a pair is a guess, or the gripper before a link of its own arm."""
        roles = [self._bodies.roles[i] for i in pair]
        of_one = bodies[pair[0]].arm == bodies[pair[1]].arm
        return any(role.guessed or (of_one and role.in_gripper) for role in roles)

    @cached_property
    def checked(self) -> CheckedBodies:
        """What is looked at."""
        bodies = self._bodies.arranged(PartPoses.standing(self._cell))
        radii = {name: guessed_radii(arm.arm) for name, arm in self._cell.arms.items() if not has_solids(arm.arm)}
        return CheckedBodies(
            pairs=self._count,
            estimated=tuple(
                dict.fromkeys(
                    body.name
                    for body, role in zip(bodies, self._bodies.roles, strict=True)
                    if role.guessed and role.arm not in radii
                )
            ),
            guessed={name: (float(r.max()), float(r.min())) for name, r in radii.items()},
            left_out=tuple(dict.fromkeys((bodies[i].name, bodies[j].name) for i, j in sorted(self._left_out))),
        )

    def at_configurations(self, parts: PartPoses) -> ConfigurationChecks:
        """Return what tells how near the bodies are at configurations, while the parts stay where they are.

        What grips may touch parts.
        """
        bodies, roles = self._bodies.arranged(parts), self._bodies.roles
        pairs = [
            (i, j)
            for i, j in self._bodies.pairs(bodies)
            if (i, j) not in self._left_out
            and not (roles[i].grips and roles[j].part)
            and not (roles[j].grips and roles[i].part)
        ]
        return ConfigurationChecks(self._checker.rearranged(bodies, pairs))

    def check(
        self,
        move: PlannedMove,
        others: Mapping[str, Trajectory],
        parts: PartPoses,
        beside: Mapping[str, frozenset[str]],
        *,
        now: float = 0.0,
        clearances: bool = True,
    ) -> MoveCheck:
        """Return whether a planned MOVE runs into anything, and how near it comes.

        Args:
            move: the MOVE.
            others: what every other arm does, from the same time on; an arm at rest holds its position.
            parts: where the parts are.
            beside: by arm, the parts that its fingers may touch.
            now: when the MOVE begins [s], for frames of the cell that move by themselves.
            clearances: whether they are asked for.
        """
        contacts = self._contacts(move, others, parts, beside, now)
        contact = contacts.first_contact()
        if contact is not None:
            return MoveCheck(collision=self._collision(contacts, contact))
        stages = range(len(move.stages)) if clearances else ()
        found = (_clearance(contacts, stage) for stage in stages)
        return MoveCheck(collision=None, clearances=tuple(found))

    def path_past(
        self,
        move: PlannedMove,
        others: Mapping[str, Trajectory],
        parts: PartPoses,
        beside: Mapping[str, frozenset[str]],
        *,
        now: float = 0.0,
        stage: int,
        goals: ArrayLike,
        speed: float,
    ) -> PlannedPath:
        """Return a path instead of a stage of a MOVE that would run into something.

        Args:
            move: the MOVE.
            others: as for ``check``.
            parts: as for ``check``.
            beside: as for ``check``.
            now: as for ``check``.
            stage: which of its stages, from 0; it goes from one configuration to another.
            goals: (k, n) joint positions that it may end at.
            speed: 1 to 120.

        Raises:
            PlanningError: there is none, with the cause.
            IncapableArmError: gravity alone takes more than a joint may give on the path.
            MissingExtraError: OMPL is not installed.
        """
        contacts = self._contacts(move, others, parts, beside, now)
        begin = contacts.starts[stage]
        old = move.stages[stage]

        def certify(trajectory: Trajectory) -> Closest | None:
            stages = (*move.stages[:stage], trajectory, *move.stages[stage + 1 :])
            tried = self._contacts(attrs.evolve(move, stages=stages), others, parts, beside, now)
            contact = tried.first_contact()
            # What comes before and after is looked at by ``check``.
            if contact is None or not begin <= contact.time <= begin + trajectory.duration:
                return None
            return contact._replace(time=contact.time - begin)

        return plan_path(
            contacts.surroundings.checker,
            move.arm,
            old(0.0),
            goals,
            others=others,
            certify=certify,
            speed=speed,
            period=self._cell.period,
            margin=Margins(*(contacts.margins_at(begin + part * old.duration) for part in (0.0, 0.5, 1.0))),
        )

    def tool_pairs(self, arm: str, parts: PartPoses) -> tuple[ClearanceChecker, list[tuple[int, int]]]:
        """Return the pairs of what stands and of the tool of an arm, or what it holds; and a checker of them.

        Args:
            arm: its name.
            parts: where the parts are.
        """
        bodies, roles = self._bodies.arranged(parts), self._bodies.roles
        tool = [
            i
            for i, (body, role) in enumerate(zip(bodies, roles, strict=True))
            if body.arm == arm and (role.in_hand or role.part is not None)
        ]
        standing = [i for i, body in enumerate(bodies) if body.arm is None]
        pairs = [(i, j) for i in tool for j in standing if (min(i, j), max(i, j)) not in self._left_out]
        return self._checker.rearranged(bodies, pairs), pairs

    def _contacts(
        self,
        move: PlannedMove,
        others: Mapping[str, Trajectory],
        parts: PartPoses,
        beside: Mapping[str, frozenset[str]],
        now: float,
    ) -> WantedContacts:
        bodies = self._bodies.arranged(parts)
        pairs = [
            (i, j)
            for i, j in self._bodies.pairs(bodies)
            if move.arm in (bodies[i].arm, bodies[j].arm) and (i, j) not in self._left_out
        ]
        frames = self._cell.moving_frames
        courses = {name: frame_course(frame, now, move.trajectory.duration) for name, frame in frames.items()}
        checker = self._checker.rearranged(bodies, pairs, self._slides)
        motions = {**others, **courses, move.arm: move.trajectory}
        known = list(zip(bodies, self._bodies.roles, strict=True))
        around = Surroundings(checker, motions, known, pairs, beside)
        return WantedContacts(move, around, self._cell.arms[move.arm].arm)

    def _collision(self, contacts: WantedContacts, contact: Closest) -> Collision:
        move, (checker, motions, bodies, pairs, _) = contacts.move, contacts.surroundings
        number = pairs.index(contact.bodies)
        start = float(checker.distances_at(motions, np.zeros(1), np.array([number]), RESOLUTION)[0, 0])
        later = [
            Window(max(it.start, contact.time), it.end, np.array([number]), np.zeros(1))
            for it in contacts.windows
            if it.end >= contact.time and number in it.pairs
        ]
        deepest = checker.least(motions, later, _FAR, _DEPTH_EVALUATIONS).closest
        stage = contacts.stage_at(contact.time)
        return Collision(
            bodies=_named(move.arm, bodies, contact.bodies),
            stage=stage,
            fraction=self._fraction(move, stage, contact.time - contacts.starts[stage]),
            time=contact.time,
            depth=-min(contact.distance, contact.distance if deepest is None else deepest.distance),
            point=checker.nearest_points(motions, contact.time, contact.bodies).mean(axis=0),
            at_start=start <= contacts.margin_at_start(number),
            at_rest=contact.time > move.trajectory.duration,
            other_arm=next(
                (arm for i in contact.bodies if (arm := bodies[i][0].arm) in self._cell.arms and arm != move.arm), None
            ),
            guessed=any(bodies[i][1].guessed for i in contact.bodies),
        )

    def _fraction(self, move: PlannedMove, stage: int, time: float) -> float:
        """Return how far along the path of its tool a stage is after a time; by its time where the tool stands."""
        trajectory = move.stages[stage]
        if time >= trajectory.duration:
            return 1.0
        times = np.concatenate(
            [np.linspace(0.0, time, _PATH_POINTS), np.linspace(time, trajectory.duration, _PATH_POINTS)]
        )
        points = forward(self._cell.arms[move.arm].arm, trajectory(times))[:, :3, 3]
        lengths = np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))
        if lengths[-1] < RESOLUTION:
            return time / trajectory.duration
        return float(lengths[_PATH_POINTS - 1] / lengths[-1])


def _clearance(contacts: WantedContacts, stage: int) -> StageClearance:
    """Return how near to other bodies an arm comes on a stage."""
    checker, motions, bodies, _, _ = contacts.surroundings
    least = checker.least(motions, contacts.clearance_windows(stage), LOOKED_FOR, _EVALUATIONS)
    closest = least.closest
    if closest is None:
        return StageClearance(distance=None, bound=least.bound)
    points = checker.nearest_points(motions, closest.time, closest.bodies)
    return StageClearance(
        distance=closest.distance,
        bound=least.bound,
        bodies=_named(contacts.move.arm, bodies, closest.bodies),
        time=closest.time - contacts.starts[stage],
        point=tuple(points.mean(axis=0).tolist()),
    )


def _named(arm: str, bodies: Sequence[tuple[Body, Role]], pair: tuple[int, int]) -> tuple[str, str]:
    """Return the names of a pair of bodies, that of the moving arm first; its links without the name of the arm."""
    own, other = pair if bodies[pair[0]][0].arm == arm else pair[::-1]
    names = (
        body.name.removeprefix(f"{arm} ") if body.arm == arm else body.name for body, _ in (bodies[own], bodies[other])
    )
    return next(names), next(names)
