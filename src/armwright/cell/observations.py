"""What a cell leaves of a run beside the recording of the program: measurements, pictures, where parts were."""

from __future__ import annotations

from collections.abc import Mapping

import attrs

from armwright.arrays import Array
from armwright.cell.part_poses import PartTrack


@attrs.frozen(kw_only=True, eq=False)
class MeasuredStream:
    """What the servo of an arm measured at its ticks.

    Attributes:
        arm: its name.
        t: (k,) times [s].
        q: (k, n) joint positions, as the sensors read them [rad] or [m].
        qd: (k, n) joint speeds, as the sensors read them.
        tau: (k, n) efforts of the motors, at the joints [N m] or [N].
        sent: (k, n) joint positions that the arm was sent to.
        actual: (k, n) joint positions as they were in the world.
        opening: (k,) distance between the fingers [m].
    """

    arm: str
    t: Array
    q: Array
    qd: Array
    tau: Array
    sent: Array
    actual: Array
    opening: Array


@attrs.frozen(kw_only=True, eq=False)
class Picture:
    """A picture that a camera took.

    Attributes:
        time: when [s].
        camera: its name.
        frame: the frame that was looked for.
        png: the bytes of its file.
        found: whether it was found.
        text: what was found, or why nothing was.
    """

    time: float
    camera: str
    frame: str
    png: bytes
    found: bool
    text: str


@attrs.frozen(kw_only=True, eq=False)
class Observations:
    """What a cell leaves of a run.

    Attributes:
        parts: where each part was, by name.
        measured: one stream per arm; none of a cell without physics.
        pictures: in the order in which they were taken.
        facts: further facts as plain data, such as the largest tracking error.
    """

    parts: Mapping[str, PartTrack] = attrs.field(factory=dict)
    measured: tuple[MeasuredStream, ...] = ()
    pictures: tuple[Picture, ...] = ()
    facts: Mapping[str, object] = attrs.field(factory=dict)
