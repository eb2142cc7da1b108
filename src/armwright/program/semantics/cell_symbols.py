"""The cell as the compiler sees it: names and parents of frames, without numbers."""

from collections.abc import Callable, Mapping
from typing import TypeAlias

import attrs
import numpy as np

from armwright.arm.reach import reach_of
from armwright.cell.frames import WORLD
from armwright.cell.model import Cell

STATION = "STATION"


@attrs.frozen(kw_only=True)
class KnownCell:
    """The part of a cell that the checker asks for. Names are in upper case.

    Attributes:
        arms: such as ``ARM_1``.
        frames: that have a value from the start, each with its parent.
        devices: that can be operated; None when any will do.
        analogue: the devices and inputs that are numbers, and not only on or off.
        inputs: that can be read; None when nothing is known of them.
        visions: frames that the camera has an answer for; None when nothing is known of the camera.
        reach: of the arm that reaches farthest [m]; None when that is not known.
        joints: of each arm whose joints are known a letter for each, R for one that turns and P for one that slides.
        moving: the frames that move by themselves; None when nothing is known of them.
        flexible: the arms with a gear that is a spring; None when nothing is known of them.
        flat: the arms whose MOVEs SMOOTHLY are shaped by flat feedforward.
        targets: the joint targets, each with its arm; None when nothing is known of them.
    """

    arms: frozenset[str]
    frames: Mapping[str, str] = attrs.field(factory=dict)
    devices: frozenset[str] | None = None
    analogue: frozenset[str] = frozenset()
    inputs: frozenset[str] | None = None
    visions: frozenset[str] | None = None
    reach: float | None = None
    joints: Mapping[str, str] = attrs.field(factory=dict)
    targets: Mapping[str, str] | None = None
    moving: frozenset[str] | None = None
    flexible: frozenset[str] | None = None
    flat: frozenset[str] = frozenset()


@attrs.frozen(kw_only=True)
class ImportedFrames:
    """The frames of an IMPORT.

    Attributes:
        frames: each with its parent, in upper case, like those of a cell.
        cell: the cell that the file describes; None for a file of frames alone.
    """

    frames: Mapping[str, str] = attrs.field(factory=dict)
    cell: Cell | None = None


@attrs.frozen(kw_only=True)
class ImportedModule:
    """The module of an IMPORT.

    Attributes:
        text: of its file.
    """

    text: str


# Reads the file of an IMPORT; it raises an ArmwrightError when the file cannot be read.
ReadImport: TypeAlias = Callable[[str], ImportedFrames | ImportedModule]


def known_cell(cell: Cell) -> KnownCell:
    """Return the symbols of a cell."""
    return KnownCell(
        arms=frozenset(cell.arms),
        frames={name: node.parent for name, node in cell.frames.items()},
        devices=None if cell.devices is None else frozenset(cell.devices),
        analogue=frozenset(
            name for some in (cell.devices or {}, cell.inputs) for name, one in some.items() if one.analogue
        ),
        inputs=frozenset(cell.inputs),
        visions=cell.seen_frames,
        reach=max((reach_of(arm.arm) for arm in cell.arms.values()), default=None),
        joints={name: "".join("RP"[not it.revolute] for it in arm.arm.joints) for name, arm in cell.arms.items()},
        targets={name: target.arm for name, target in cell.joint_targets.items()},
        moving=frozenset(cell.moving_frames),
        flexible=frozenset(
            name for name, it in cell.arms.items() if np.isfinite(it.arm.motor_values("stiffness")).any()
        ),
        flat=frozenset(name for name, it in cell.arms.items() if it.smooth.kind == "flat"),
    )


__all__ = ["STATION", "WORLD", "ImportedFrames", "ImportedModule", "KnownCell", "ReadImport", "known_cell"]
