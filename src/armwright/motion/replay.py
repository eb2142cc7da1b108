"""A log replayed: each measured motion of it beside what was planned."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import attrs
import numpy as np

from armwright.arm.load import parse_arm
from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.errors import InvalidValueError, UnknownNameError
from armwright.files.logs.joint_log import JointLog, JointStates
from armwright.files.result_table import ResultTable
from armwright.motion.joint_tracking import JointTracking, MotionPair, is_planned, motion_pairs, track_joints
from armwright.spatial.poses import from_noap, one_pose


@attrs.frozen(kw_only=True, eq=False)
class ReplayedMotion:
    """A measured motion of a log.

    Attributes:
        name: of its arm in the log, or of its topic.
        arm: the arm; None where it is not known.
        measured: what was measured.
        planned: the plan; None where there is none.
        tracking: how the plan was followed; None without one.
    """

    name: str
    arm: Arm | None
    measured: JointStates
    planned: JointStates | None
    tracking: JointTracking | None


@attrs.frozen(kw_only=True, eq=False)
class Replay:
    """The motions of a log.

    Attributes:
        log: the log.
        motions: in the order of their topics.
    """

    log: JointLog
    motions: tuple[ReplayedMotion, ...]

    @property
    def notes(self) -> tuple[str, ...]:
        """How each motion followed its plan, in words."""
        notes = []
        for motion in self.motions:
            if motion.tracking is None:
                missing = "no plan beside it; --planned names a log that has one"
                if is_planned(motion.measured.topic):
                    missing = "a plan, and nothing measured beside it"
                notes.append(f"{motion.measured.topic}: {missing}")
            else:
                notes += [f"{motion.name}: {note}" for note in motion.tracking.notes]
        return tuple(notes)

    def as_data(self) -> dict[str, Any]:
        """Return the motions as plain data in SI units."""
        return {
            "log": str(self.log.path),
            "topics": {topic: _extent(states) for topic, states in self.log.topics.items()},
            "motions": [
                {
                    "name": motion.name,
                    "arm": None if motion.arm is None else motion.arm.name,
                    "measured": motion.measured.topic,
                    "planned": None if motion.planned is None else motion.planned.topic,
                    "tracking": None if motion.tracking is None else motion.tracking.as_data(),
                }
                for motion in self.motions
            ],
        }

    def tables(self) -> Iterator[ResultTable]:
        """Yield a table of the topics, and one of the joints of each motion that has a plan."""
        rows = []
        for topic, states in self.log.topics.items():
            extent = _extent(states)
            known = ", ".join(
                name
                for name, values in (("position", states.q), ("speed", states.qd), ("effort", states.tau))
                if np.isfinite(values).any()
            )
            rate = "" if extent["rate"] is None else f"{extent['rate']:.4g}"
            rows.append((topic, f"{len(states.names)}", f"{len(states.t)}", f"{extent['from']:.3f}",
                         f"{extent['to']:.3f}", rate, known))  # fmt: skip
        heads = ("topic", "joints", "states", "from s", "to s", "per s", "known")
        yield ResultTable(title="Joint states", heads=heads, rows=rows, numbers=range(1, 6))
        for motion in self.motions:
            if motion.tracking is not None:
                for table in motion.tracking.tables():
                    yield attrs.evolve(table, title=f"{motion.name}: {table.title.lower()}")


def replay(
    log: JointLog,
    plan: JointLog | None = None,
    *,
    measured_topic: str | None = None,
    planned_topic: str | None = None,
    arms: Mapping[str, Arm] | None = None,
) -> Replay:
    """Compare the measured motions of a log with their plans.

    Args:
        log: the log.
        plan: another log that has the plans, whose clock is another; the log itself when left out.
        measured_topic: the only motion that is looked at; those whose names do not say that they are planned when left
            out.
        planned_topic: its plan; the one whose name fits when left out.
        arms: the arms of the log by name; a motion is of the one whose name is part of its topic, or of the only one.

    Raises:
        UnknownNameError: there is no such topic.
        InvalidValueError: the joints of a motion, its plan and its arm differ.
    """
    plans = log if plan is None else plan
    for topic, here in ((measured_topic, log), (planned_topic, plans)):
        if topic is not None and topic not in here.topics:
            raise UnknownNameError("topic", topic, here.topics)
    pairs = [
        pair
        for pair in (_pairs(log, plans) if planned_topic is None else _pairs_with(log, planned_topic))
        if measured_topic in {None, pair.measured}
    ]
    if measured_topic is not None and not pairs:
        pairs = [MotionPair(measured_topic, planned_topic)]
    # Where nothing was measured, plans are shown by themselves.
    pairs = pairs or [MotionPair(topic, None) for topic in log.topics]
    motions = [_motion(log, plans, pair, arms or {}, same_clock=plan is None) for pair in pairs]
    return Replay(log=log, motions=tuple(motions))


def arms_of(log: JointLog) -> dict[str, Arm]:
    """Return the arms that armwright's own log describes, by name; none of other logs.

    Raises:
        FileFormatError: an arm file in the log is broken.
    """
    arms = log.about.get("arms", {})
    texts = {str(name): arm.get("file") for name, arm in _items(arms) if isinstance(arm, Mapping)}
    return {name: parse_arm(text, log.path) for name, text in texts.items() if isinstance(text, str)}


def bases_of(log: JointLog) -> dict[str, Array]:
    """Return where the arms of armwright's own log stand in the world (4, 4), by name; those that it says."""
    found = {}
    for name, arm in _items(log.about.get("arms", {})):
        numbers = arm.get("base") if isinstance(arm, Mapping) else None
        if isinstance(numbers, list) and len(numbers) == 12 and all(isinstance(x, int | float) for x in numbers):
            found[str(name)] = one_pose(from_noap(numbers), f"{log.path}: {name}: base")
    return found


def _items(value: object) -> Iterable[tuple[object, Any]]:
    return value.items() if isinstance(value, Mapping) else ()


def _pairs(log: JointLog, plans: JointLog) -> list[MotionPair]:
    """Return the motions of a log with their plans, which may be in another."""
    if plans is log:
        return motion_pairs(list(log.topics))
    planned = [topic for topic in plans.topics if is_planned(topic)] or list(plans.topics)
    measured = [topic for topic in log.topics if not is_planned(topic)] or list(log.topics)
    if len(planned) == 1:
        return [MotionPair(topic, planned[0]) for topic in measured]
    return [pair for pair in motion_pairs([*measured, *planned]) if pair.measured in measured]


def _pairs_with(log: JointLog, planned_topic: str) -> list[MotionPair]:
    measured = [topic for topic in log.topics if topic != planned_topic and not is_planned(topic)]
    return [MotionPair(topic, planned_topic) for topic in measured]


def _motion(
    log: JointLog, plans: JointLog, pair: MotionPair, arms: Mapping[str, Arm], *, same_clock: bool
) -> ReplayedMotion:
    measured = log.topics[pair.measured]
    planned = None if pair.planned is None else plans.topics[pair.planned]
    # Of ARM_1 and ARM_12 the longer one that fits.
    name = max((name for name in arms if name.lower() in pair.measured.lower()), key=len, default=None)
    if name is None and len(arms) == 1:
        name = next(iter(arms))
    arm = None if name is None else arms[name]
    joints = len(measured.names if planned is None else planned.names)
    if arm is not None and arm.n != joints:
        raise InvalidValueError(f"{pair.planned or pair.measured}: {joints} joints, but {arm.name} has {arm.n}")
    tracking = None
    if planned is not None:
        tracking = track_joints(planned, measured, arm=arm, same_clock=same_clock)
        measured = measured if set(planned.names) - set(measured.names) else measured.of_joints(planned.names)
    return ReplayedMotion(name=name or pair.measured, arm=arm, measured=measured, planned=planned, tracking=tracking)


def _extent(states: JointStates) -> dict[str, Any]:
    """Return names, times and the rate of a topic as plain data."""
    span = float(states.t[-1] - states.t[0])
    rate = (len(states.t) - 1) / span if span > 0 else None
    return {
        "joints": list(states.names),
        "states": len(states.t),
        "from": float(states.t[0]),
        "to": float(states.t[-1]),
        "rate": rate,
    }
