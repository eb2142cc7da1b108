"""The result of a simulation: the motion, its energies and the events of its joints."""

from __future__ import annotations

import math
from collections.abc import Iterator
from enum import Enum, IntEnum
from numbers import Integral
from typing import NamedTuple

import attrs
import numpy as np
import numpy.typing as npt

from armwright.arm.model import Arm
from armwright.arrays import Array, number, read_only, reduce_by_fields
from armwright.errors import InvalidValueError, KindError, shown
from armwright.files.result_table import ResultTable

# Changes of joint states that a table lists at most.
_LISTED_EVENTS = 20


class JointState(IntEnum):
    """The state of a joint."""

    MOVES = 0
    STICKS = 1
    LOWER_STOP = 2
    UPPER_STOP = 3
    BRAKED = 4

    @property
    def words(self) -> str:
        """The state in words, as in ``lower stop``."""
        return self.name.lower().replace("_", " ")


class Status(Enum):
    """How a simulation ended."""

    FINISHED = "finished"
    IMPRECISE = "a step could not reach the requested accuracy"
    DIVERGED = "a position or speed became unreasonably large"
    ENTANGLED = "events followed one another without time advancing"


class Event(NamedTuple):
    """A joint changed what it does.

    Attributes:
        t: when [s].
        joint: which, from 0.
        before: its state until then.
        after: its state from then on.
    """

    t: float
    joint: int
    before: JointState
    after: JointState


@attrs.frozen(kw_only=True)
class Brake:
    """A brake that is on for some time; it stops its joint at once and holds it against any effort.

    Attributes:
        joint: which, from 0.
        start: when it goes on [s].
        end: when it goes off [s]; never when left out.

    Source:
        TR-83-008, subroutine GLAGRA, which sets the speed of a braked joint to zero.
    """

    joint: int
    start: float = 0.0
    end: float = math.inf

    def __attrs_post_init__(self) -> None:
        """Refuse a brake of no joint, and one that goes off before it goes on."""
        if isinstance(self.joint, bool) or not isinstance(self.joint, Integral):
            raise KindError(f"brake: expected the index of a joint, from 0, got {shown(self.joint)}")
        if not 0 <= number(self.start, "brake: start") < number(self.end, "brake: end"):
            raise InvalidValueError(f"brake: start {self.start} must be 0 or later, and before end {self.end}")

    def on(self, t: float) -> bool:
        """Whether the brake is on at a time, and stays on."""
        return self.start <= t < self.end


@attrs.frozen(kw_only=True, eq=False)
class Simulation:
    """A simulated motion of n joints at m moments.

    At every moment M qdd + coriolis + gravity + springs = tau + friction + hold.

    Attributes:
        arm: the simulated arm.
        status: how it ended.
        t: (m,) times [s]; up to the asked end when it finished.
        q: (m, n) joint positions [rad] or [m].
        qd: (m, n) joint speeds.
        qdd: (m, n) joint accelerations.
        tau: (m, n) efforts of the drives, within their limits [N m] or [N].
        friction: (m, n) efforts of friction on moving joints, against their motion but for its offset; of joints at
            rest the offset alone.
        hold: (m, n) efforts of what keeps joints at rest: dry friction, stops, brakes.
        state: (m, n) what each joint does, as numbers of ``JointState``.
        kinetic: (m,) energy of motion, rotors included [J].
        potential: (m,) energy in the field of gravity and in springs [J].
        work: (m, n) what the drives have put in since the start [J].
        heat: (m, n) what friction has taken out [J]; its offset gives back what it takes where a joint returns.
        impact: (m,) what stops and brakes have taken out [J].
        events: what happened to joints, in order.
    """

    arm: Arm
    status: Status
    t: Array = attrs.field(converter=read_only)
    q: Array = attrs.field(converter=read_only)
    qd: Array = attrs.field(converter=read_only)
    qdd: Array = attrs.field(converter=read_only)
    tau: Array = attrs.field(converter=read_only)
    friction: Array = attrs.field(converter=read_only)
    hold: Array = attrs.field(converter=read_only)
    state: npt.NDArray[np.int8] = attrs.field(converter=read_only)
    kinetic: Array = attrs.field(converter=read_only)
    potential: Array = attrs.field(converter=read_only)
    work: Array = attrs.field(converter=read_only)
    heat: Array = attrs.field(converter=read_only)
    impact: Array = attrs.field(converter=read_only)
    events: tuple[Event, ...]

    __reduce__ = reduce_by_fields

    @property
    def energy(self) -> Array:
        """Kinetic and potential energy together, (m,) [J]."""
        return self.kinetic + self.potential

    @property
    def energy_imbalance(self) -> Array:
        """Energy that the ledger cannot explain, (m,) [J]: the error of the integration."""
        return np.asarray(self.energy - self.energy[0] - self.work.sum(-1) + self.heat.sum(-1) + self.impact)

    def at_rest(self, index: int = -1) -> bool:
        """Whether no joint moves at one of the moments, the last one when left out."""
        return not self.qd[index].any() and not self.qdd[index].any()

    @property
    def notes(self) -> tuple[str, ...]:
        """How and when the simulation ended."""
        return (f"{self.status.name.lower()} after {self.t[-1]:.3f} s",)

    def _energies(self) -> dict[str, float]:
        """Return the energy balance from start to end [J]."""
        return {
            "kinetic": float(self.kinetic[-1]),
            "potential_change": float(self.potential[-1] - self.potential[0]),
            "work_of_drives": float(self.work[-1].sum()),
            "heat_of_friction": float(self.heat[-1].sum()),
            "lost_at_stops": float(self.impact[-1]),
            "imbalance": float(abs(self.energy_imbalance).max()),
        }

    def as_data(self) -> dict[str, str | float]:
        """Return the status, the end and the energy balance as plain data in SI units."""
        return {"status": self.status.name.lower(), "t": float(self.t[-1]), **self._energies()}

    def tables(self) -> Iterator[ResultTable]:
        """Yield the tables of the joints [deg, mm], of the energy balance, and of the first events."""
        rows = []
        for i, joint in enumerate(self.arm.joints):
            values = (self.q[0, i], self.q[-1, i], self.qd[-1, i])
            texts = (f"{x / joint.units.scale:z.3f}" for x in values)
            rows.append((self.arm.joint_label(i), joint.units.display, *texts))
        heads = ("joint", "unit", "start", "end", "speed at the end, per s")
        yield ResultTable(title="", heads=heads, rows=rows, numbers=(2, 3, 4))
        energies = ((name.replace("_", " "), f"{value:z.6g}") for name, value in self._energies().items())
        yield ResultTable(title="", heads=("energy", "J"), rows=energies, numbers=(1,))
        events = self.events[:_LISTED_EVENTS]
        more = len(self.events) - len(events)
        yield ResultTable(
            title="",
            heads=("s", "joint", "before", "after"),
            rows=((f"{e.t:.4f}", self.arm.joint_label(e.joint), e.before.words, e.after.words) for e in events),
            numbers=(0,),
            remark=f"... and {more} more changes" if more else "",
        )
