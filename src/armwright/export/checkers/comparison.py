"""Running what a checker has read on the model of the arm, beside the plan."""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import TypeVar

import numpy as np

from armwright.arrays import Array
from armwright.compiled.arm import CompiledArm, planning_arm
from armwright.export.checkers.actions import (
    Action,
    CheckError,
    JointAction,
    LineAction,
    OutputAction,
    ReadProgram,
    TextAction,
    WaitAction,
)
from armwright.export.checkers.orientations import angle_apart, from_rotation_vector
from armwright.export.checkers.posture import PostureReader
from armwright.export.conventions import ControllerArm
from armwright.export.proof import Comparison
from armwright.export.statements import (
    ControllerProgram,
    MoveJoints,
    MoveKnots,
    MoveLines,
    Say,
    SetOutput,
    Statement,
    Wait,
)
from armwright.kinematics.forward_kinematics import forward
from armwright.kinematics.jacobians import jacobian
from armwright.motion.plan import StageGoal

# What is allowed: micrometres of targets, of angles, of waiting times; a part of a speed limit that rounding takes.
_PLACE_MM, _ANGLE, _TIME, _ROUNDING = 1e-3, 1e-5, 1e-4, 1e-3
# A stream that ends so much earlier has ended with the plan [s].
_STREAM_END = 1e-6
# Steps along a line: no longer, no larger turn, and so many at most.
_STEP, _TURN, _MOST_STEPS, _FEWEST_STEPS = 0.02, 0.1, 64, 6
# Newton steps to a pose on a line, and what is near enough [m, rad].
_NEWTON, _NEAR = 8, 1e-11
# Directions in which the arm is singular, as a part of its largest singular value.
_SINGULAR = 1e-7
# A way of the tool point that takes no time to speak of [m].
_SHORT = 1e-6
# Points of a stage at which its path is compared.
_LOOKS = 17

_Kind = TypeVar("_Kind", JointAction, LineAction, OutputAction, WaitAction, TextAction)


class Tally:
    """One quantity, while it is compared."""

    def __init__(self, quantity: str, allowed: float, unit: str = "") -> None:
        self._quantity, self._allowed, self._unit = quantity, allowed, unit
        self._count, self._worst, self._where = 0, 0.0, ""

    def add(self, difference: float, line: int) -> None:
        """Take a difference in a line of the file."""
        self._count += 1
        if not difference <= self._worst:
            self._worst, self._where = float(difference), f"line {line}"

    @property
    def result(self) -> Comparison:
        """What was found."""
        return Comparison(
            quantity=self._quantity,
            count=self._count,
            worst=self._worst,
            allowed=self._allowed,
            unit=self._unit,
            where=self._where,
        )


class Model:
    """The arm as its controller sees it."""

    def __init__(self, mapped: ControllerArm) -> None:
        self.mapped = mapped
        fast = planning_arm(mapped.arm)
        self._fast = fast if isinstance(fast, CompiledArm) else None
        self.limits = mapped.arm.limits.speed

    def joints(self, shown: Array) -> Array:
        """Return the joint positions of the arm for those of its controller."""
        own = np.array(shown, dtype=float)
        if self.mapped.convention.coupled is not None:
            joint, other, factor = self.mapped.convention.coupled
            own[..., joint] -= factor * own[..., other]
        return np.asarray(self.mapped.zeros + own / self.mapped.signs)

    def pose(self, q: Array) -> Array:
        """Return tool poses (k, 4, 4) at joint positions (k, n)."""
        return self._fast.forward(q) if self._fast is not None else forward(self.mapped.arm, q)

    def pose_and_jacobian(self, q: Array) -> tuple[Array, Array]:
        """Return tool pose (4, 4) and Jacobian (6, n) at joint positions (n,)."""
        if self._fast is None:
            return forward(self.mapped.arm, q), jacobian(self.mapped.arm, q)
        X, J = self._fast.pose_and_jacobian(q[None])
        return X[0], J[0]

    def follow(self, q: Array, X: Array) -> Array:
        """Return the joint positions (k, n) on the straight line of the tool from a configuration to a pose."""
        begin = self.pose(q[None])[0]
        apart, turn = X[:3, 3] - begin[:3, 3], _rotation_between(begin[:3, :3], X[:3, :3])
        length, angle = float(np.linalg.norm(apart)), float(np.linalg.norm(turn))
        count = int(np.clip(np.ceil(max(length / _STEP, angle / _TURN)), _FEWEST_STEPS, _MOST_STEPS))
        reached = [q]
        for part in np.arange(1, count + 1) / count:
            goal = np.eye(4)
            goal[:3, 3] = begin[:3, 3] + part * apart
            goal[:3, :3] = from_rotation_vector(part * turn) @ begin[:3, :3] if part < 1 else X[:3, :3]
            reached.append(self._reach(reached[-1], goal))
        return np.array(reached)

    def _reach(self, q: Array, goal: Array) -> Array:
        """Return the joint positions (n,) at a pose, by Newton's method from near ones."""
        for _ in range(_NEWTON):
            X, J = self.pose_and_jacobian(q)
            error = np.concatenate([goal[:3, 3] - X[:3, 3], _rotation_between(X[:3, :3], goal[:3, :3])])
            if np.abs(error).max() < _NEAR:
                break
            q = q + np.linalg.lstsq(J, error, rcond=_SINGULAR)[0]
        return q


def compare(read: ReadProgram, program: ControllerProgram) -> tuple[Comparison, ...]:
    """Return how the program that was read from a file differs from the plan.

    Args:
        read: what the checker of the target has read.
        program: the plan.
    """
    return Comparing(program).run(read)


class Comparing:
    """A program of a controller, run beside its plan."""

    def __init__(self, program: ControllerProgram) -> None:
        self._program, self._model = program, Model(program.mapped)
        self._postures = PostureReader(program.mapped)
        self._q = np.array(program.start)
        self.statements = Tally("statements that differ in kind, text or order", 0)
        self.places = Tally("positions of targets", _PLACE_MM, "mm")
        self.angles = Tally("orientations of targets", _ANGLE, "rad")
        self.joints = Tally("joints at targets, at the ends of straight lines too", _ANGLE, "rad")
        self.postures = Tally("configuration words that the joints do not have", 0)
        self.zones = Tally("corner zones beyond the BLEND of the program, or past half a leg", _PLACE_MM, "mm")
        self.straightness = Tally("planned path beside lines and knots of the file, of what is allowed", 1)
        self.speeds = Tally("joint speeds that the file asks for, of the limits", 1 + _ROUNDING)
        self.times = Tally("durations", _TIME, "s")

    def run(self, read: ReadProgram) -> tuple[Comparison, ...]:
        """Compare all statements in order."""
        self._poses(read.X_CT, self._program.mapped.X_CT, 1)
        actions = iter(read.actions)
        first = next(actions, None)
        if isinstance(first, JointAction):
            self._joints(first, self._q)
        else:
            self.statements.add(1, 1)
        for statement in self._program.statements:
            self._statement(statement, actions)
        for action in actions:
            self.statements.add(1, action.line)
        self._end_of_program()
        tallies = (
            self.statements,
            self.places,
            self.angles,
            self.joints,
            self.postures,
            self.zones,
            self.straightness,
            self.speeds,
            self.times,
        )
        return tuple(tally.result for tally in tallies)

    def _statement(self, statement: Statement, actions: Iterator[Action]) -> None:
        match statement:
            case MoveJoints(q=q, duration=duration):
                if (joints := self._next(actions, JointAction)) is not None:
                    self._target(joints, q, duration)
            case MoveLines():
                self._lines(statement, actions)
            case MoveKnots():
                self._knots(statement, actions)
            case SetOutput(output=output, on=on):
                if (switched := self._next(actions, OutputAction)) is not None:
                    right = switched.output in (output.number, output.signal) and switched.on == on
                    self.statements.add(0 if right else 1, switched.line)
            case Wait(seconds=seconds):
                if (wait := self._next(actions, WaitAction)) is not None:
                    self._duration(wait.seconds, seconds, wait)
            case Say(text=text):
                self._text(text, actions)

    def _end_of_program(self) -> None:
        """Compare what can be compared only when all has been done."""

    def _next(self, actions: Iterator[Action], kind: type[_Kind]) -> _Kind | None:
        """Return the next action, which is to be of a kind; None where it is none."""
        action = next(actions, None)
        if isinstance(action, kind):
            self.statements.add(0, action.line)
            return action
        self.statements.add(1, 0 if action is None else action.line)
        return None

    def _text(self, text: str, actions: Iterator[Action]) -> None:
        """Compare a text, of which a file may have what it cannot hold as ? or ', in lines that are not too long."""
        shown = ""
        line = 0
        while len(shown) < len(text) or not line:
            action = next(actions, None)
            if not isinstance(action, TextAction):
                self.statements.add(1, line)
                return
            shown, line = shown + action.text, action.line
        alike = len(shown) == len(text) and all(a == b or a in "?'" for a, b in zip(shown, text, strict=True))
        self.statements.add(0 if alike else 1, line)

    # ---- motions ---------------------------------------------------------------------------------------------------

    def _target(self, action: JointAction, q: Array, duration: float) -> None:
        before = self._q
        self._joints(action, q)
        if action.duration is not None:
            self._duration(action.duration, duration, action)
            part = np.abs(self._q - before) / max(action.duration, np.finfo(float).tiny) / self._model.limits
            self.speeds.add(float(part.max()), action.line)
        elif action.speed_part is not None:
            self.speeds.add(action.speed_part, action.line)
        self.statements.add(int(action.passes), action.line)

    def _joints(self, action: JointAction, q: Array) -> None:
        """Take joint positions of the file, which are to be those of the plan."""
        own = self._model.joints(action.q)
        self.joints.add(float(np.abs(own - q).max()), action.line)
        X, Y = self._model.pose(np.stack([own, q]))
        self._poses(X, Y, action.line)
        self._q = own

    def _poses(self, X: Array, Y: Array, line: int) -> None:
        self.places.add(float(np.linalg.norm(X[:3, 3] - Y[:3, 3])) * 1e3, line)
        self.angles.add(angle_apart(X[:3, :3], Y[:3, :3]), line)

    def _lines(self, statement: MoveLines, actions: Iterator[Action]) -> None:
        motion, goal = statement.stage.motion, statement.stage.stage.goal
        poses = statement.poses if goal is None else goal.poses
        corners, zones, line = [self._model.pose(self._q[None])[0, :3, 3]], [0.0], 0
        for pose in poses:
            action = self._next(actions, LineAction)
            if action is None:
                return
            X = self._end(action)
            self._poses(X, pose, action.line)
            begin, path = self._model.pose(self._q[None])[0], self._model.follow(self._q, X)
            if action.q is not None:
                self.joints.add(float(np.abs(path[-1] - self._model.joints(action.q)).max()), action.line)
            self._speed(path, action, begin, X)
            self._q = path[-1]
            self._configuration(action)
            if action.duration is not None:
                self._duration(action.duration, statement.duration, action)
            corners.append(X[:3, 3])
            zones.append(action.zone)
            line = action.line
        self.joints.add(float(np.abs(self._q - motion(motion.duration)).max()), line)
        self.statements.add(int(zones[-1] > 0), line)
        blend = self._width(goal) if statement.stage.stage.obstacle is None and goal is not None else None
        allowed_zones = [*np.broadcast_to(0.0 if blend is None else blend, len(poses) - 1).tolist(), 0.0]
        legs = np.linalg.norm(np.diff(corners, axis=0), axis=-1)
        for leg, (before, after), most in zip(legs, pairwise(zones), allowed_zones, strict=True):
            self.zones.add(max(before - leg / 2, after - leg / 2, after - most, 0.0) * 1e3, line)
        # The planned path is where the straight lines of the file are, but for what was certified and for corners.
        points = self._model.pose(motion(np.linspace(0.0, motion.duration, _LOOKS)))[:, :3, 3]
        far = float(_distances(points, np.array(corners)).max())
        allowed = (statement.stage.stage.deviation or 0.0) + max(zones) + _PLACE_MM * 1e-3
        self.straightness.add(far / allowed, line)

    def _width(self, goal: StageGoal) -> float | Array | None:
        """Return how far from each corner a controller may begin to round it [m]."""
        return goal.blend

    def _end(self, action: LineAction) -> Array:
        """Return the pose (4, 4) of the tool at the end of a line, seen from the base of the arm."""
        if action.q is not None:
            return np.asarray(self._model.pose(self._model.joints(action.q)[None])[0])
        if action.X is None:
            raise CheckError(f"line {action.line}: a straight line without an end")
        return np.asarray(self._program.mapped.X_BC @ action.X)

    def _duration(self, found: float, planned: float, action: JointAction | LineAction | WaitAction) -> None:
        """Compare a time with that of the plan, from which it may be rounded up."""
        late = found - planned
        self.times.add(max(-late, late - action.rounding, 0.0), action.line)

    def _configuration(self, action: LineAction) -> None:
        """Compare the configuration words of the file with the joints that its lines have led to."""
        if action.configuration:
            words = self._postures.words(self._program.mapped.joints(self._q))
            wrong = sum(value not in words[word] for word, value in action.configuration.items())
            self.postures.add(wrong, action.line)

    def _speed(self, path: Array, action: LineAction, begin: Array, end: Array) -> None:
        """Compare the joint speeds along a line, the tool moving evenly in the time it is given, with the limits."""
        length, turn = float(np.linalg.norm(end[:3, 3] - begin[:3, 3])), angle_apart(begin[:3, :3], end[:3, :3])
        if action.duration is not None:
            time = action.duration
        else:
            parts = [(length, action.speed, _SHORT), (turn, action.turn_speed, _ANGLE)]
            time = max((way / speed for way, speed, least in parts if speed and way > least), default=0.0)
        if time:
            steps = np.abs(np.diff(path, axis=0)) * (len(path) - 1)
            self.speeds.add(float((steps / time / self._model.limits).max()), action.line)

    def _knots(self, statement: MoveKnots, actions: Iterator[Action]) -> None:
        """Compare knots with the plan: samples of a stream at equal times, others at those of the statement."""
        motion = statement.stage.motion
        taken: list[JointAction] = []
        while len(taken) < 2 or not self._is_last(taken, statement):
            action = next(actions, None)
            if not isinstance(action, JointAction):
                self.statements.add(1, 0 if action is None else action.line)
                return
            taken.append(action)
        self.statements.add(int(taken[-1].passes), taken[-1].line)
        streamed = taken[0].streamed
        times = np.linspace(0.0, motion.duration, len(taken) + 1)[1:] if streamed else statement.times
        if streamed:
            late = sum(action.duration or 0.0 for action in taken) - motion.duration
            self.times.add(max(-late, late - (taken[0].duration or 0.0), 0.0), taken[-1].line)
        begin = self._q
        for action, q in zip(taken, motion(times), strict=True):
            before = self._q
            self._joints(action, q)
            if action.duration is not None:
                part = np.abs(self._q - before) / action.duration / self._model.limits
                self.speeds.add(float(part.max()), action.line)
            elif action.speed_part is not None:
                self.speeds.add(action.speed_part, action.line)
        self._between([begin, *(self._model.joints(action.q) for action in taken)], statement, taken[-1].line)

    def _is_last(self, taken: Sequence[JointAction], statement: MoveKnots) -> bool:
        """Whether all actions of knots have been taken: a stream lasts as long as the plan, others pass all knots."""
        if taken[0].streamed:
            return sum(action.duration or 0.0 for action in taken) >= statement.stage.motion.duration - _STREAM_END
        return len(taken) >= len(statement.times)

    def _between(self, ends: Sequence[Array], statement: MoveKnots, line: int) -> None:
        """Compare the path of the tool between knots, the joints running straight, with that of the plan."""
        q = np.array(ends)
        middles = self._model.pose((q[:-1] + q[1:]) / 2)[:, :3, 3]
        motion = statement.stage.motion
        path = self._model.pose(motion(np.linspace(0.0, motion.duration, _LOOKS * len(q))))[:, :3, 3]
        far = float(_distances(middles, path).max())
        self.straightness.add(far / (self._program.deviation + _PLACE_MM * 1e-3), line)


def _distances(points: Array, corners: Array) -> Array:
    """Return how far points (k, 3) are from a line through corners (m, 3) with straight legs [m]."""
    begin, legs = corners[:-1], np.diff(corners, axis=0)
    squared = np.maximum((legs**2).sum(axis=-1), np.finfo(float).tiny)
    part = np.clip(np.einsum("kmi,mi->km", points[:, None] - begin, legs) / squared, 0.0, 1.0)
    apart = points[:, None] - (begin + part[..., None] * legs)
    return np.asarray(np.linalg.norm(apart, axis=-1).min(axis=-1))


def _rotation_between(R: Array, S: Array) -> Array:
    """Return the rotation vector (3,) in the base frame that turns one orientation into another [rad]."""
    D = S @ R.T
    twice_sine = np.array((D[2, 1] - D[1, 2], D[0, 2] - D[2, 0], D[1, 0] - D[0, 1]))
    sine, cosine = float(np.linalg.norm(twice_sine)) / 2, (float(np.trace(D)) - 1) / 2
    if sine > _NEAR or cosine > 0:
        return np.asarray(twice_sine * (np.arctan2(sine, cosine) / (2 * sine) if sine > _NEAR else 0.5))
    # Half a turn: its axis is the column of D + 1 that is longest.
    columns = D + np.eye(3)
    axis = columns[:, int(np.linalg.norm(columns, axis=0).argmax())]
    return np.asarray(np.pi * axis / np.linalg.norm(axis))
