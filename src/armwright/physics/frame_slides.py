"""Frames that move by themselves, as arms of one slide: so what lies on them is checked for collisions as they move."""

from __future__ import annotations

import numpy as np

from armwright.arm.model import Arm, Joint
from armwright.arrays import Array
from armwright.cell.moving_frames import MovingFrame
from armwright.motion.trajectory import Trajectory, hold
from armwright.spatial.poses import homogeneous, inverse

# The travel is a polynomial of fourth degree on each piece, which so many samples give.
_SAMPLES = 5


def slide(name: str) -> Arm:
    """Return an arm of one slide, along z of its base."""
    return Arm(name=name, joints=(Joint(kind="prismatic"),))


def slide_base(frame: MovingFrame) -> Array:
    """Return the pose (4, 4) in the world of the base of a slide that moves as a frame does."""
    z = frame.direction
    x = np.cross(z, np.eye(3)[np.abs(z).argmin()])
    x /= np.linalg.norm(x)
    return homogeneous(np.column_stack([x, np.cross(z, x), z]), frame.pose[:3, 3])


def part_on_slide(frame: MovingFrame, X_FP: Array) -> Array:
    """Return the pose (4, 4) of a part on the slide, that of the part on the frame being ``X_FP``."""
    return np.asarray(inverse(slide_base(frame)) @ frame.pose @ X_FP)


def frame_course(frame: MovingFrame, now: float, duration: float) -> Trajectory:
    """Return the motion of the slide from a time on, for so long [s]."""
    if duration <= 0:
        return hold(frame.travel(np.array([now])), 0.0)
    inside = frame.joints[(frame.joints > now) & (frame.joints < now + duration)]
    times = np.unique([now, *inside, now + duration])
    lengths = np.diff(times)
    x = np.linspace(0.0, 1.0, _SAMPLES)
    samples = frame.travel((times[:-1, None] + lengths[:, None] * x).ravel()).reshape(-1, _SAMPLES)
    scaled = np.linalg.solve(np.vander(x, increasing=True), samples.T).T
    coefficients = scaled / lengths[:, None] ** np.arange(_SAMPLES)
    return Trajectory(times=times - now, coefficients=coefficients[:, :, None])
