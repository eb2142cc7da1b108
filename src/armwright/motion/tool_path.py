"""Where the tool is planned to be: positions and orientations through poses, straight with blends, over time."""

from __future__ import annotations

from typing import Literal, TypeAlias

import attrs
import numpy as np
import numpy.typing as npt

from armwright.arrays import Array, ArrayLike, floats
from armwright.motion.blends import PEAK_ACCELERATION, BlendPlan, Ends, blend_plan, blended, rates_at_points
from armwright.motion.deviation import (
    ErrorBounds,
    ToolBounds,
    ToolSamples,
    TrackingError,
    error_of,
    half_angle_bound,
    half_sines,
)
from armwright.motion.knots import divided, segments_at
from armwright.motion.solver import Solver
from armwright.motion.trajectory import Trajectory
from armwright.spatial.euler import from_zyz, next_zyz, to_zyz
from armwright.spatial.poses import homogeneous, position_text
from armwright.spatial.rotations import rotation_from_vector, rotation_vector
from armwright.tracing.loops import Runner

# Knots to begin with in each blend and on each straight segment, at most.
_ENOUGH = 500

Orientation: TypeAlias = Literal["geodesic", "zyz"]


@attrs.frozen(kw_only=True, eq=False)
class ToolPath:
    """Poses of the tool as a function of time.

    Attributes:
        position: (x, y, z) [m].
        times: (k,) when the poses are passed that it was planned through [s].
        orientation: by rotations about one fixed axis from pose to pose, or by ZYZ angles.
    """

    position: Trajectory
    orientation: Rotations | ZYZAngles
    times: Array

    @property
    def knots(self) -> Array:
        """When blends begin and end [s], start and end among them."""
        return self.position.times

    def __call__(self, t: ArrayLike) -> Array:
        """Return poses (..., 4, 4) at times (...)."""
        t = floats(t, "t")
        return homogeneous(self.orientation(t), self.position(t))

    def poses_for(self, solver: Solver, t: Array) -> Array:  # noqa: ARG002 - of a tool path NumPy computes them
        """Return the poses (k, 4, 4) at times (k,)."""
        return self(t)

    def first_knots(self, step: float, fewest: int) -> Array:
        """Return the first times: so far apart [s], and so many at least in each blend and on each straight segment."""
        parts = np.clip(np.ceil(np.diff(self.knots) / step), fewest, _ENOUGH).astype(np.intp)
        return divided(self.knots, parts)

    def slowed(self, factor: float) -> ToolPath:
        """Return the same path run ``factor`` times slower."""
        position, orientation = self.position.slowed(factor), self.orientation.slowed(factor)
        return ToolPath(position=position, orientation=orientation, times=self.times * factor)

    def bounds(self, times: Array, tool: ToolBounds, run: Runner) -> ErrorBounds:  # noqa: ARG002
        """Return bounds of the error on the intervals between times: those of tool and path together."""
        middles = (times[1:] + times[:-1]) / 2
        piece = segments_at(self.knots, middles, len(self.knots) - 1)
        rate, change = (bound[piece] for bound in self.spin())
        return ErrorBounds(
            tool.acceleration + self.acceleration()[piece],
            half_angle_bound(tool.angular_speed, tool.angular_acceleration, change, rate),
        )

    def error(self, samples: ToolSamples) -> TrackingError:
        """Return how far a sampled tool is from where it should be at the time."""
        planned = self(samples.times)
        distances = np.linalg.norm(samples.poses[..., :3, 3] - planned[..., :3, 3], axis=-1)
        return error_of(samples, distances, half_sines(planned[..., :3, :3], samples.poses[..., :3, :3]).max(axis=1))

    def where(self, t: float) -> tuple[int, float, str]:
        """Return on which segment between poses a time is, at which fraction of it, and that in words."""
        i = int(segments_at(self.times, t, len(self.times) - 1))
        fraction = float(np.clip((t - self.times[i]) / (self.times[i + 1] - self.times[i]), 0.0, 1.0))
        between = f"at {t:.3f} s, between poses {i + 1} and {i + 2}"
        return i, fraction, f"{between}, {position_text(self(t)[:3, 3])},"

    def acceleration(self) -> Array:
        """Return upper bounds (m,) of the acceleration of the position on each interval between ``knots`` [m/s²]."""
        return np.asarray(np.linalg.norm(self.position.segment_peaks(2), axis=-1))

    def spin(self) -> tuple[Array, Array]:
        """Return upper bounds (m,) of angular speed [rad/s] and acceleration [rad/s²] on each interval."""
        return self.orientation.spin((self.knots[1:] + self.knots[:-1]) / 2)


@attrs.frozen(eq=False)
class ZYZAngles:
    """Orientations by ZYZ Euler angles.

    Attributes:
        angles: phi, theta, psi over time [rad].
    """

    angles: Trajectory

    def __call__(self, t: Array) -> Array:
        """Return rotations (..., 3, 3) at times (...)."""
        return from_zyz(self.angles(t))

    def slowed(self, factor: float) -> ZYZAngles:
        """Return the same rotations run ``factor`` times slower."""
        return ZYZAngles(self.angles.slowed(factor))

    def spin(self, _t: Array) -> tuple[Array, Array]:
        """Return upper bounds (m,) of angular speed [rad/s] and acceleration [rad/s²] on each of the m segments."""
        phi, theta, psi = self.angles.segment_peaks(1).T
        # Each angle rotates about an axis of length 1 that the angles before it carry round.
        change = self.angles.segment_peaks(2).sum(axis=-1) + phi * theta + phi * psi + theta * psi
        return phi + theta + psi, np.asarray(change)


@attrs.frozen(kw_only=True, eq=False)
class Rotations:
    """Orientations through k poses: about one fixed axis from pose to pose, with a blend around each pose.

    Around each pose the rotation vector of the rotation from it is blended, so that rate and its change are continuous.
    Between the blends of two poses, on one and the same fixed axis in either direction, the next pose takes over.

    Attributes:
        R: (k, 3, 3) orientations of the poses.
        plan: times, blends, and the rates of the rotation vector before and after each pose, in its own axes.
    """

    R: Array
    plan: BlendPlan

    def _nearest(self, t: Array) -> npt.NDArray[np.intp]:
        """Return the numbers (...) of the poses whose blends, and the segments beside them, times (...) belong to."""
        c, b = self.plan.centres, self.plan.blend
        handed_over = (c[:-1] + b[:-1] + c[1:] - b[1:]) / 2
        return np.asarray(np.searchsorted(handed_over, t), dtype=np.intp)

    def __call__(self, t: Array) -> Array:
        """Return rotations (..., 3, 3) at times (...)."""
        c, b = self.plan.centres, self.plan.blend
        inside = np.clip(t, 0.0, self.plan.end)
        i = self._nearest(inside)
        since, width = (inside - c[i])[..., None], b[i][..., None]
        before, after = self.plan.before[i], self.plan.after[i]
        h = np.clip(since + width, 0.0, 2 * width)
        safe = np.where(width > 0, width, 1.0)
        blend = before * (h - width) + (after - before) * h**3 * (1 / (4 * safe**2) - h / (16 * safe**3))
        vector = np.where(since <= -width, before * since, np.where(since >= width, after * since, blend))
        return np.asarray(self.R[i] @ rotation_from_vector(vector))

    def slowed(self, factor: float) -> Rotations:
        """Return the same rotations run ``factor`` times slower."""
        p = self.plan
        slow = BlendPlan(
            p.centres * factor, p.blend * factor, p.points, p.before / factor, p.after / factor, p.end * factor
        )
        return Rotations(R=self.R, plan=slow)

    def spin(self, t: Array) -> tuple[Array, Array]:
        """Return upper bounds (m,) of angular speed [rad/s] and acceleration [rad/s²] around times (m,).

        They hold in all of the blend that a time is in; between two blends, in all of the segment.
        """
        plan, i = self.plan, self._nearest(t)
        since, width = t - plan.centres[i], plan.blend[i]
        before, after = (np.linalg.norm(rates[i], axis=-1) for rates in (plan.before, plan.after))
        change = np.linalg.norm(plan.after[i] - plan.before[i], axis=-1)
        blending = np.abs(since) < width
        rate = np.where(blending, np.maximum(before, after), np.where(since < 0, before, after))
        # The angular velocity is T(v) v' of the rotation vector v, where T shrinks, and changes by less than |v'|.
        peak = PEAK_ACCELERATION * change / np.where(blending, width, 1.0) + rate**2
        return rate, np.where(blending, peak, 0.0)


def tool_path(poses: Array, times: ArrayLike, blend: ArrayLike, *, ends: Ends, orientation: Orientation) -> ToolPath:
    """Plan positions and orientations through poses.

    Args:
        poses: (k, 4, 4) with exact rotations.
        times: as for ``blended``.
        blend: as for ``blended``.
        ends: as for ``blended``.
        orientation: ``geodesic`` rotates about one fixed axis from pose to pose, ``zyz`` blends the ZYZ Euler angles.

    Raises:
        ArmwrightError: as for ``blended``.

    Source:
        Paul, "Manipulator Cartesian path control" (1979); for ``zyz`` the project on the PUMA's trajectories, 3.2.
    """
    position = blended(times, poses[:, :3, 3], blend, ends=ends)
    R, t = poses[:, :3, :3], floats(times, "times")
    if orientation == "zyz":
        angles = ZYZAngles(blended(times, zyz_angles(R), blend, ends=ends))
        return ToolPath(position=position, orientation=angles, times=t)
    plan = blend_plan(times, poses[:, :3, 3], blend, ends)
    # A rotation is the same vector in the axes of the pose before it and of that after it.
    turns = rotation_vector(np.swapaxes(R[:-1], -1, -2) @ R[1:]) / np.diff(plan.centres)[:, None]
    before, after = rates_at_points(turns, ends)
    rotations = Rotations(R=R, plan=plan._replace(before=before, after=after))
    return ToolPath(position=position, orientation=rotations, times=t)


def zyz_angles(R: Array) -> Array:
    """Return ZYZ angles (k, 3) of orientations, each next to those before it.

    Where theta is 0 or pi at the first pose, phi is what the second pose has; later on it stays as it was.
    """
    angles = [to_zyz(R[0])]
    for each in R[1:]:
        angles.append(next_zyz(each, angles[-1]))
    if len(R) > 1:
        angles[0] = next_zyz(R[0], angles[1])
    return np.array(angles)
