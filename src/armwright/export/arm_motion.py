"""What one arm does during a whole run, as one motion of its joints."""

from armwright.motion.trajectory import Trajectory, hold, join
from armwright.program.vm.recording import Recording

# Rests shorter than this are none [s].
_NOTHING = 1e-9


def arm_motion(recording: Recording, arm: str) -> Trajectory:
    """Return the motion of an arm from the start of a run to its end, the rests between MOVEs included."""
    parts, now = [], 0.0
    for stage in recording.stages:
        if stage.arm == arm and stage.duration:
            if stage.t0 > now + _NOTHING:
                parts.append(hold(stage.motion(0.0), stage.t0 - now))
            parts.append(stage.motion)
            now = stage.t1
    end = parts[-1](parts[-1].duration) if parts else recording.cell.arms[arm].start
    if recording.duration > now + _NOTHING or not parts:
        parts.append(hold(end, max(recording.duration - now, 0.0)))
    return join(parts)
