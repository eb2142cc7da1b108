"""Following a path: joints solved at knots, joined by X-splines, and held against path and limits."""

from typing import Literal, NoReturn, TypeAlias

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array, ArrayLike
from armwright.errors import ArmwrightError
from armwright.kinematics.forward import forward
from armwright.kinematics.inverse.closed_form import inverse, inverse_branches
from armwright.kinematics.inverse.solution import Answer, InverseSolution, violations
from armwright.kinematics.inverse.turns import nearest_turn, travel
from armwright.motion.path import NEGLIGIBLE, TURN_RADIUS, Knots, Path, place_knots
from armwright.motion.trajectory import Trajectory, hold
from armwright.motion.xspline import xspline
from armwright.spatial.rotations import angle_between, rotation_from_vector, rotation_vector

Cause: TypeAlias = Literal["reach", "limits", "singular"]

# How often the path is looked at between two knots, and what is added for the peak that lies between two looks.
_LOOKS = 16
_BETWEEN_LOOKS = 1.03
# The rule's knots are halved at most this often before the path is given up: 1/64 of the rule's step.
_HALVINGS = 6
# A path through several frames turns its corners without a stop, so it must round them; and it is gross motion. It
# may leave the straight ways between its frames by this much more than a line may leave its own.
_CORNER_ROOM = 20.0
# A path that asks a joint for this many times its top speed meets a singularity; it is refused, not crawled along.
# Accelerations say nothing of it: a short line asks much of them wherever it lies.
SLOWEST = 20.0
# Turning the hand by this much is allowed where the place may be off by one metre's thousandth: 5 mrad per mm.
TURN_PER_METRE = 5.0


@attrs.frozen(kw_only=True, eq=False)
class Followed:
    """A path that the joints can follow.

    Attributes:
        trajectory: of the joints, at rest at both ends.
        knots: number of knots solved.
        deviation: largest distance of the hand from the path that was found [m].
        turn_deviation: largest angle from the orientation of the path that was found [rad].
        slowed: why it runs slower than the rule says, or empty.
    """

    trajectory: Trajectory
    knots: int
    deviation: float
    turn_deviation: float
    slowed: str


class PathError(ArmwrightError, ValueError):
    """A path cannot be followed.

    Attributes:
        cause: out of ``reach``, beyond the joint ``limits``, or through a ``singular`` posture.
        segment: which way of the path, from 0.
        fraction: how far along that way.
    """

    def __init__(self, cause: Cause, segment: int, fraction: float, message: str) -> None:
        """Say what stops the arm, and where."""
        self.cause, self.segment, self.fraction = cause, segment, fraction
        super().__init__(message)


def follow(arm: Arm, path: Path, q_start: ArrayLike, *, deviation: float, speed: float) -> Followed:
    """Return the joint motion along a path, from rest to rest, passing the poses between without a stop.

    Args:
        arm: an arm with a closed-form inverse.
        path: begins where the hand is at ``q_start``.
        q_start: (n,) present joint positions.
        deviation: allowed distance of the hand from a single straight way [m]; twenty times as much is allowed on a
            path with corners. The orientation may be off by ``TURN_PER_METRE`` times as many radians.
        speed: 1 to 120, 100 is normal.

    Raises:
        PathError: a pose on the way is out of reach, a joint passes a limit, or a singularity keeps the hand from
            staying within the deviation.
        InvalidValueError: deviation or speed are out of range.

    Source:
        TR-83-008, "straight line motion" and "continuous motion"; the knots of its rule are halved until the
        deviation between them, which the rule only estimates, really is within the bound.
    """
    if path.lengths().max() <= NEGLIGIBLE:
        return Followed(trajectory=hold(q_start, 0.0), knots=1, deviation=0.0, turn_deviation=0.0, slowed="")
    _check_ends(arm, path)
    allowed = deviation if len(path.poses) == 2 else _CORNER_ROOM * deviation
    for halving in range(_HALVINGS + 1):
        knots = place_knots(arm, path, deviation=deviation, speed=speed, finer=2**halving)
        q = _solve(arm, path, knots, np.asarray(q_start, dtype=np.float64))
        trajectory = xspline(knots.times, q)
        off, turned = _deviations(arm, path, knots, trajectory)
        excess = np.maximum(off, turned / TURN_PER_METRE) / allowed
        if excess.max() <= 1:
            break
    else:
        _give_up(arm, path, knots, q, excess)
    _check_between(arm, knots, trajectory)
    factor, slowed = _slowing(arm, path, knots, trajectory)
    return Followed(
        trajectory=trajectory.slowed(factor),
        knots=len(q),
        deviation=float(off.max()),
        turn_deviation=float(turned.max()),
        slowed=slowed,
    )


def cause_of(solution: InverseSolution) -> Cause:
    """Return why no posture of a solution can be taken."""
    return "reach" if solution.answer is Answer.OUT_OF_REACH else "limits"


def _check_ends(arm: Arm, path: Path) -> None:
    """Refuse a path to a pose that no posture reaches, before anything between is looked at."""
    for segment, X in enumerate(path.poses[1:]):
        solution = inverse(arm, X)
        if not solution.allowed:
            raise PathError(cause_of(solution), segment, 1.0, solution.explain())


def _solve(arm: Arm, path: Path, knots: Knots, q_start: Array) -> Array:
    """Solve every knot by the posture nearest to the one before it."""
    X = knots.poses(path)
    candidates, singular = inverse_branches(arm, X, q_start)
    q = np.empty((len(X), arm.n))
    q[0] = q_start
    for k in range(1, len(X)):
        if singular[k].any():
            # A free joint stays where it was at the last knot, not where it was at the start.
            candidates[k], _ = inverse_branches(arm, X[k], q[k - 1])
        q[k] = min(nearest_turn(arm, candidates[k], q[k - 1]), key=lambda posture: travel(arm, q[k - 1], posture))
        _check_knot(arm, X[k], q[k], knots, k)
    return q


def _check_knot(arm: Arm, X: Array, q: Array, knots: Knots, k: int) -> None:
    place = knots.segments[k], knots.fractions[k]
    if np.abs(forward(arm, q)[:3, 3] - X[:3, 3]).max() > 1e-9:
        solution = inverse(arm, X)
        if solution.answer is Answer.OUT_OF_REACH:
            raise PathError("reach", *place, solution.explain())
    for fault in violations(arm, q):
        raise PathError("limits", *place, str(fault))


def _deviations(arm: Arm, path: Path, knots: Knots, trajectory: Trajectory) -> tuple[Array, Array]:
    """Return the largest deviation in place and turn between every two knots, (m-1,) each."""
    fine = (np.arange(_LOOKS) + 0.5) / _LOOKS
    h = np.diff(knots.times)
    t = knots.times[:-1, None] + fine * h[:, None]
    X = forward(arm, trajectory(t))
    segments = np.array(knots.segments[1:])
    A, B = path.poses[segments], path.poses[segments + 1]
    R_back = np.swapaxes(A[:, :3, :3], -1, -2)
    way, turn = B[:, :3, 3] - A[:, :3, 3], rotation_vector(R_back @ B[:, :3, :3])
    come, turned = X[..., :3, 3] - A[:, None, :3, 3], rotation_vector(R_back[:, None] @ X[..., :3, :3])
    along, square = np.sum(come * way[:, None], axis=-1), np.sum(way**2, axis=-1)[:, None]
    s = np.clip(along / np.maximum(square, NEGLIGIBLE**2), 0.0, 1.0)
    off = np.linalg.norm(come - s[..., None] * way[:, None], axis=-1)
    # How far the hand has come is read from place and turn together, so that a turn on the spot has its progress too.
    weight = TURN_RADIUS**2
    progress = (along + weight * np.sum(turned * turn[:, None], axis=-1)) / (
        square + weight * np.sum(turn**2, axis=-1)[:, None]
    )
    R_path = A[:, None, :3, :3] @ rotation_from_vector(np.clip(progress, 0.0, 1.0)[..., None] * turn[:, None])
    twisted = angle_between(R_path, X[..., :3, :3])
    return _BETWEEN_LOOKS * off.max(axis=-1), _BETWEEN_LOOKS * twisted.max(axis=-1)


def _check_between(arm: Arm, knots: Knots, trajectory: Trajectory) -> None:
    """Refuse a spline that swings over a joint limit between knots which keep it."""
    at_knots = trajectory(knots.times)
    for q in trajectory.extremes(0):
        for fault in violations(arm, q):
            nearest = int(np.abs(at_knots[:, fault.joint - 1] - fault.value).argmin())
            raise PathError("limits", knots.segments[nearest], knots.fractions[nearest], str(fault))


def _slowing(arm: Arm, path: Path, knots: Knots, trajectory: Trajectory) -> tuple[float, str]:
    """Return the factor of time that brings speeds and accelerations inside the limits, and its reason."""
    needs = {
        "speed": trajectory.segment_peaks(1) / arm.limit("speed"),
        "acceleration": np.sqrt(trajectory.segment_peaks(2) / arm.limit("acceleration")),
    }
    if needs["speed"].max() > SLOWEST:
        interval, worst = np.unravel_index(int(needs["speed"].argmax()), needs["speed"].shape)
        k = int(interval) + 1
        raise PathError(
            "singular",
            knots.segments[k],
            knots.fractions[k],
            f"near {_place(path, knots, k)} joint {worst + 1} would have to move {needs['speed'].max():.0f} times as "
            "fast as it may: the arm is nearly singular there",
        )
    what = max(needs, key=lambda name: float(needs[name].max()))
    joint = int(np.unravel_index(int(needs[what].argmax()), needs[what].shape)[1])
    factor = float(needs[what].max())
    return (factor, f"{factor:.2f} times slower, for the {what} of joint {joint + 1}") if factor > 1 else (1.0, "")


def _place(path: Path, knots: Knots, k: int) -> str:
    x, y, z = path.at(knots.segments[k], knots.fractions[k])[:3, 3] * 1e3
    return f"({x:.1f}, {y:.1f}, {z:.1f}) mm from the base"


def _give_up(arm: Arm, path: Path, knots: Knots, q: Array, badness: Array) -> NoReturn:
    worst = int(badness.argmax())
    jump = np.abs(q[worst + 1] - q[worst]) / np.where(np.isfinite(arm.limit("speed")), arm.limit("speed"), 1.0)
    joint = int(jump.argmax())
    amount = abs(q[worst + 1, joint] - q[worst, joint])
    verb, unit, scale = ("turn", "deg", 180 / np.pi) if arm.joints[joint].revolute else ("move", "mm", 1e3)
    raise PathError(
        "singular",
        knots.segments[worst + 1],
        knots.fractions[worst + 1],
        f"the hand cannot stay on the path near {_place(path, knots, worst + 1)}: the arm is singular there "
        f"and joint {joint + 1} would have to {verb} {amount * scale:.1f} {unit} at once",
    )
