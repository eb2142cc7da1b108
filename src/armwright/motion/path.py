"""A path of the tool through poses, and the report's rule for how densely and how fast to run it."""

from __future__ import annotations

import math
from itertools import accumulate
from typing import NamedTuple

import attrs
import numpy as np
import numpy.typing as npt

from armwright.arm.model import Arm
from armwright.arm.reach import reach_of, tool_speed_of
from armwright.arrays import Array, ArrayLike, of_shape
from armwright.errors import InvalidValueError
from armwright.motion.quintic_polynomials import TOP_SPEED, check_speed
from armwright.motion.tolerance import tolerance
from armwright.spatial.poses import between
from armwright.spatial.rotations import angle_between

# A rotation on the spot has no length; it is timed as if a tool this long swept the segment [m].
TURN_RADIUS = 0.2
# A segment shorter than this is none: poses that should be equal differ by rounding [m].
NEGLIGIBLE = 1e-9
# The report's rule lets speed and step vanish for a line over the base axis; they stop falling at this part of the
# reach, which for the arms of the catalogue lies inside the space that the arm cannot enter anyway.
_CLOSEST = 0.1


def _poses(value: ArrayLike) -> Array:
    X = of_shape(value, (4, 4), "poses")
    if X.ndim != 3 or len(X) < 2:
        raise InvalidValueError(f"path: expected shape (n, 4, 4) with at least two poses, got shape {X.shape}")
    return X


@attrs.frozen(kw_only=True, eq=False)
class Path:
    """Straight segments from pose to pose.

    Attributes:
        poses: (k, 4, 4) tool poses in the base frame of the arm.
    """

    poses: Array = attrs.field(converter=_poses)

    def lengths(self) -> Array:
        """Return the length of every segment (k-1,) [m]; a rotation counts with ``TURN_RADIUS``."""
        shift = np.linalg.norm(np.diff(self.poses[:, :3, 3], axis=0), axis=-1)
        angle = angle_between(self.poses[:-1, :3, :3], self.poses[1:, :3, :3])
        return np.asarray(np.maximum(shift, TURN_RADIUS * angle))

    def at(self, segment: int, fraction: ArrayLike) -> Array:
        """Return poses (..., 4, 4) at fractions (...) of one segment."""
        return between(self.poses[segment], self.poses[segment + 1], fraction)


class Knots(NamedTuple):
    """Where on a path the joints are solved for, and when they pass.

    Attributes:
        times: (m,) [s], from 0.
        segments: (m,) which segment of the path each knot is on.
        fractions: (m,) how far along that segment.
    """

    times: Array
    segments: npt.NDArray[np.intp]
    fractions: Array


def closest_to_axis(A: ArrayLike, B: ArrayLike) -> float:
    """Return the shortest distance from the base axis to the segment between two positions (3,) [m]."""
    (x, y, *_), (x_B, y_B, *_) = np.asarray(A, dtype=np.float64).tolist(), np.asarray(B, dtype=np.float64).tolist()
    dx, dy = x_B - x, y_B - y
    square = dx * dx + dy * dy
    s = min(max(-(x * dx + y * dy) / square, 0.0), 1.0) if square else 0.0
    return math.hypot(x + s * dx, y + s * dy)


def report_step(arm: Arm, A: ArrayLike, B: ArrayLike, deviation: float) -> float:
    """Return the distance of knots on a line that the report's rule gives [m].

    An arm that swings about its base with half-radius R/2 leaves a chord of length dy by dx where
    dy² = 8 R dx; R/2 is the shortest distance from the base axis to the line.

    Source:
        TR-83-008, "straight line motion", step 1.
    """
    R = 2 * max(closest_to_axis(A, B), _CLOSEST * reach_of(arm))
    return math.sqrt(8 * R * deviation)


def report_speed(arm: Arm, A: ArrayLike, B: ArrayLike, speed: float) -> float:
    """Return the speed of the tool on a line that the report's rule gives [m/s].

    V = (speed / 120) (r_min / R_MAX) V_MAX: an arm held in moves its tool more slowly.

    Source:
        TR-83-008, "straight line motion", steps 2 and 3, with alpha = 100/120.
    """
    reach = reach_of(arm)
    r_min = max(closest_to_axis(A, B), _CLOSEST * reach)
    return check_speed(speed) / TOP_SPEED * min(r_min / reach, 1.0) * tool_speed_of(arm)


def place_knots(arm: Arm, path: Path, *, deviation: float, speed: float, finer: int = 1) -> Knots:
    """Choose knots on a path by the report's rule.

    The first and the last step are half as long as the others and take as much time: so the tool gathers speed
    and loses it. A segment without length, between equal poses, gets no knots.

    Args:
        arm: the arm; ``reach_of`` and ``tool_speed_of`` it scale the speed.
        path: the segment.
        deviation: allowed distance of the tool from the path [m].
        speed: 1 to 120, 100 is normal.
        finer: how many times more steps than the rule asks.

    Raises:
        InvalidValueError: deviation or speed are out of range.

    Source:
        TR-83-008, "straight line motion" step 5 and "continuous motion".
    """
    tolerance(deviation)
    lengths = path.lengths()
    moving = [i for i, length in enumerate(lengths) if length > NEGLIGIBLE]
    times, segments, fractions = [0.0], [0], [0.0]
    for i in moving:
        A, B = path.poses[i, :3, 3], path.poses[i + 1, :3, 3]
        count = math.ceil(lengths[i] / report_step(arm, A, B, deviation) - 1e-9)
        first, last = i == moving[0], i == moving[-1]
        whole = max(count * finer, 1) - (first and last)
        steps = [*[0.5] * first, *[1.0] * whole, *[0.5] * last]
        per_step = lengths[i] / sum(steps) / report_speed(arm, A, B, speed)
        for done in accumulate(steps):
            times.append(times[-1] + per_step)
            segments.append(i)
            fractions.append(done / sum(steps))
    return Knots(np.array(times), np.array(segments, dtype=np.intp), np.array(fractions))
