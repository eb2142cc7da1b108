"""What a statement had done before it failed, in words."""

import numpy as np

from armwright.cell.frames import WORLD
from armwright.program.language.names import is_arm
from armwright.program.vm.machine import Machine

# Effects that say nothing of their own in a trace.
SILENT_EFFECTS = ("PLACE", "LOCK", "END", "STOP")
# Nobody reads more of what is no longer so.
_MAX_LISTED = 10
# What is nearer than this was not moved: rounding [m], [rad], and of entries of rotations.
_ROUNDING = 1e-9


def undone_lines(before: Machine, after: Machine) -> list[str]:
    """Say what a statement had done, none of which is so any more.

    Args:
        before: the state that holds again.
        after: what the statement had come to.
    """
    undone = [
        effect.text for effect in after.state.effects[len(before.state.effects) :] if effect.kind not in SILENT_EFFECTS
    ]
    count = len(undone) - _MAX_LISTED
    undone = [*undone[:_MAX_LISTED], f"{count} more"] if count > 1 else undone
    sentences = [f"effects before that were undone: {'; '.join(undone)}"] if undone else []
    restored = _moved_arms(before, after)
    if frames := [after.spelling(name) for name in _moved_frames(before, after)]:
        restored.append(f"{'frames' if len(frames) > 1 else 'frame'} {', '.join(frames)}")
    if after.state.ticks > before.state.ticks:
        restored.append(f"the clock to {before.now:.3f} s")
    return [*sentences, *([f"restored: {', '.join(restored)}"] if restored else [])]


def _moved_arms(before: Machine, after: Machine) -> list[str]:
    """Return the arms that stand otherwise after than before."""
    configurations = ((name, before.hardware.configuration(name, before.now)) for name in after.state.hands)
    now = after.hardware.configuration
    return [name for name, q in configurations if np.abs(q - now(name, after.now)).max() > _ROUNDING]


def _moved_frames(before: Machine, after: Machine) -> list[str]:
    """Return the frames that stand or hang otherwise after than before, arms and their bases aside."""
    names = [name for name in after.state.tree if name != WORLD and not is_arm(name) and not name.endswith(".BASE")]
    return [name for name in names if name in before.state.tree and _has_moved(before, after, name)]


def _has_moved(before: Machine, after: Machine, name: str) -> bool:
    old, new = before.state.tree, after.state.tree
    if before.has_pose(name) != after.has_pose(name) or old.parent(name) != new.parent(name):
        return True
    return after.has_pose(name) and not np.allclose(old.world(name), new.world(name), rtol=0, atol=_ROUNDING)
