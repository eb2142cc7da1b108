"""Arcs of circles with a certificate: from where the tool is, through a position, to a pose."""

from __future__ import annotations

import math
from functools import cached_property, partial
from itertools import pairwise

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.errors import InvalidValueError
from armwright.motion.certified_motion import CertifiedMotion, fastest
from armwright.motion.deviation import (
    ErrorBounds,
    ToolBounds,
    ToolSamples,
    TrackingError,
    error_of,
    half_angle_bound,
    half_sines,
)
from armwright.motion.obstruction import PathError
from armwright.motion.path import TURN_RADIUS, report_speed
from armwright.motion.solver import AnyArm, Solver, solver_of
from armwright.motion.straight import RAMP, limited_time, requested_time, tried_deviations
from armwright.motion.tolerance import Tolerance, tolerance
from armwright.motion.tool_limits import ToolLimits
from armwright.motion.tracking import Task, check_velocities, track
from armwright.spatial.poses import homogeneous, position_text
from armwright.spatial.rotations import rotation_from_vector, rotation_vector
from armwright.tracing.loops import Runner

# Three positions are on a line when one is nearer than this to the line through the others: a part of the longest
# distance between two of them, or so much [m].
_FLAT, _FLAT_LENGTH = 1e-3, 1e-6
# Knots to begin with, for a whole turn and at least; legs by which the speed of the report's rule is found.
_KNOTS_PER_TURN, _MIN_KNOTS, _LEGS = 48, 9, 24


class FlatArcError(InvalidValueError):
    """Three positions are on one line, or nearly so, and give no arc."""


@attrs.frozen(kw_only=True, eq=False)
class Arc:
    """An arc of a circle from pose to pose, run at even speed.

    The orientation turns about one fixed axis from the start to the end, evenly along the arc.

    Attributes:
        start: (4, 4) pose at which it begins.
        centre: (3,) of the circle [m].
        axes: (2, 3) from the centre to the start, and at a right angle to it where the arc leads; as long as the
            radius [m].
        angle: from the start to the end [rad].
        through: which part of it leads to the position that it was laid through.
        rotation: (3,) rotation vector from start to end, in the axes at the start [rad].
        duration: of the whole arc [s].
    """

    start: Array
    centre: Array
    axes: Array
    angle: float
    through: float
    rotation: Array
    duration: float

    @cached_property
    def radius(self) -> float:
        """Of the circle [m]."""
        return float(np.linalg.norm(self.axes[0]))

    @property
    def length(self) -> float:
        """Of the arc [m]."""
        return self.radius * self.angle

    def at(self, fraction: Array) -> Array:
        """Return the poses (..., 4, 4) at fractions (...) of the arc."""
        part = np.asarray(fraction, dtype=np.float64)[..., None]
        turned = self.angle * part
        p = self.centre + np.cos(turned) * self.axes[0] + np.sin(turned) * self.axes[1]
        return homogeneous(self.start[:3, :3] @ rotation_from_vector(part * self.rotation), p)

    def __call__(self, t: Array) -> Array:
        """Return the poses (..., 4, 4) at times (...)."""
        return self.at(np.asarray(t) / self.duration)

    def poses_for(self, solver: Solver, t: Array) -> Array:  # noqa: ARG002 - of an arc NumPy computes them
        """Return the poses (k, 4, 4) at times (k,)."""
        return self(t)

    def bounds(self, times: Array, tool: ToolBounds, run: Runner) -> ErrorBounds:  # noqa: ARG002 - it is the same all along
        """Return bounds of the error on the intervals between times: those of tool and arc together."""
        rate = float(np.linalg.norm(self.rotation)) / self.duration
        inwards = self.radius * (self.angle / self.duration) ** 2
        still = np.zeros_like(tool.angular_speed)
        turning = half_angle_bound(tool.angular_speed, tool.angular_acceleration, still, still + rate)
        return ErrorBounds(tool.acceleration + inwards, turning)

    def error(self, samples: ToolSamples) -> TrackingError:
        """Return how far a sampled tool is from where it should be at the time."""
        planned = self(samples.times)
        distances = np.linalg.norm(samples.poses[..., :3, 3] - planned[..., :3, 3], axis=-1)
        return error_of(samples, distances, half_sines(planned[..., :3, :3], samples.poses[..., :3, :3]).max(axis=1))

    def where(self, t: float) -> tuple[int, float, str]:
        """Return whether a time is before the position between, 0, or behind it, 1; at which fraction; in words."""
        part = min(max(t / self.duration, 0.0), 1.0)
        segment = int(part > self.through)
        fraction = (part - self.through) / (1 - self.through) if segment else part / self.through
        return segment, fraction, f"on the arc near {position_text(self.at(np.array(part))[:3, 3])}"

    def part(self, segment: int, fraction: float) -> float:
        """Return which fraction of the whole a fraction of the way to, 0, or from, 1, the position between is."""
        return self.through + fraction * (1 - self.through) if segment else fraction * self.through


def arc(start: Array, through: Array, end: Array, duration: float = 1.0) -> Arc:
    """Return the arc from a pose (4, 4) through the position of another, (4, 4), to a third one.

    Raises:
        FlatArcError: the three positions are on one line, or nearly so.
    """
    p, v, e = start[:3, 3], through[:3, 3], end[:3, 3]
    normal = np.cross(v - p, e - p)
    longest = max(math.dist(p, v), math.dist(v, e), math.dist(p, e))
    height = float(np.linalg.norm(normal)) / longest if longest > 0 else 0.0
    if height < max(_FLAT * longest, _FLAT_LENGTH):
        raise FlatArcError(
            f"three positions give no arc: one is {height * 1e3:.3g} mm from the line through the others, which are "
            f"{longest * 1e3:.4g} mm apart"
        )
    # The centre is as far from the start as from both others.
    a, b = v - p, e - p
    square = float(normal @ normal)
    to_centre = ((a @ a) * np.cross(b, normal) + (b @ b) * np.cross(normal, a)) / (2 * square)
    centre = p + to_centre
    outward = -to_centre
    sideways = np.cross(normal / math.sqrt(square), outward)
    angles = [math.atan2(float((q - centre) @ sideways), float((q - centre) @ outward)) % (2 * math.pi) for q in (v, e)]
    return Arc(
        start=start,
        centre=centre,
        axes=np.stack([outward, sideways]),
        angle=angles[1],
        through=angles[0] / angles[1],
        rotation=rotation_vector(start[:3, :3].T @ end[:3, :3]),
        duration=duration,
    )


def certified_arc(
    arm: AnyArm,
    q_start: Array,
    through: Array,
    end: Array,
    allowed: Tolerance,
    *,
    speed: float,
    tool: ToolLimits | None = None,
) -> CertifiedMotion:
    """Plan an arc of the tool and certify it, as ``straight_line`` plans a line.

    Args:
        arm: the arm, or a compiled one.
        q_start: (n,) present joint positions.
        through: (4, 4) pose whose position is passed.
        end: (4, 4) pose at the end.
        allowed: how far the tool may be from the arc.
        speed: 1 to 120, 100 is normal: by the report's rule, as for a line; the slowest of the legs of the arc counts.
        tool: as for ``certified_line``.

    Returns:
        The motion, at rest at both ends, and its certificate.

    Raises:
        FlatArcError: the positions are on one line.
        PathError: a pose of the arc is out of reach, a joint passes a limit, or a singularity is in the path.
    """
    solver = solver_of(arm)
    planned = arc(np.asarray(solver.forward(q_start)), through, end)
    corners = planned.at(np.linspace(0.0, 1.0, _LEGS + 1))[:, :3, 3]
    slowest = min(report_speed(solver.arm, A, B, speed) for A, B in pairwise(corners))
    angle = math.hypot(*planned.rotation)
    even, ramp = max(planned.length, TURN_RADIUS * angle) / slowest, 0.0
    if tool is not None:
        even = limited_time(solver.arm, planned.length, angle, slowest, tool)
        ramp = planned.length / even / tool.acceleration
    planned = attrs.evolve(planned, duration=even)
    task = Task(solver, planned, q_start, allowed, allowed, rest=False, clock=partial(requested_time, even))
    count = max(_MIN_KNOTS, _KNOTS_PER_TURN * planned.angle / (2 * math.pi))
    before, after = (math.ceil(count * part) for part in (planned.through, 1 - planned.through))
    # The position between is passed at a knot.
    there, on = np.linspace(0.0, planned.through, before + 1), np.linspace(planned.through, 1.0, after + 1)
    knots = even * np.concatenate([there, on[1:]])
    tracked = track(task, knots)
    check_velocities(task, tracked)
    return fastest(solver, tracked, allowed, nominal=max(even / (1 - RAMP), even + ramp), weak=True, ramp=ramp)


def coarse_arc(
    arm: AnyArm,
    q_start: Array,
    through: Array,
    end: Array,
    *,
    deviation: float,
    speed: float,
    tool: ToolLimits | None = None,
) -> CertifiedMotion:
    """Return the arc of a program: kept closer than asked where that is no obstruction, as ``coarse_line`` does.

    Raises:
        PathError: as for ``certified_arc``.
        FlatArcError: the positions are on one line.
    """
    errors: list[PathError] = []
    for tried in tried_deviations(deviation, tool):
        try:
            return certified_arc(arm, q_start, through, end, tolerance(tried), speed=speed, tool=tool)
        except PathError as error:
            errors.append(error)
            if error.cause == "reach":  # a pose out of reach is so for every deviation
                break
    raise errors[0]
