"""Trials of a cell with physics: what is drawn for one, and whether its world is as it should be at the end."""

from __future__ import annotations

import math
from collections.abc import Mapping

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.cell.model import Cell, CellArm
from armwright.cell.scene import Camera, Part, Spread
from armwright.cell.trials import Interval
from armwright.errors import InvalidValueError, counted
from armwright.physics.draws import drawn_frames, drawn_parts, drawn_pose
from armwright.physics.world import PhysicsCell
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import angle_between, rotation_from_vector
from armwright.spatial.shapes import support

# Where parts would stand inside others, they are drawn anew, so often at most.
_MAX_DRAWS = 100
# A part is at rest that is no faster than this [m/s], [rad/s], for so long [s]; the world goes on for so long [s].
_REST_SPEED, _REST_TURN, _REST_TIME, _PATIENCE = 2e-3, 0.05, 0.1, 1.0
# How often that is checked [s].
_INTERVAL = 0.01
# What is wrong where an arm has pressed on what it should not.
_TOUCHED = "R604"
MOVING, UNRELEASED, MISPLACED = "moving", "not let go", "misplaced"


@attrs.frozen(kw_only=True, eq=False)
class Case:
    """What is drawn for a trial.

    Attributes:
        cell: with its markers, cameras and sensors as they are in this trial.
        parts: as they are in its world, by name.
        frames: (4, 4) where they are in its world, by name.
        seed: of the noise.
    """

    cell: Cell
    parts: Mapping[str, Part]
    frames: Mapping[str, Array]
    seed: int

    def world(self) -> PhysicsCell:
        """Return the world of the trial at its start."""
        return PhysicsCell(self.cell, seed=self.seed, parts=self.parts, frames=self.frames)


@attrs.frozen(kw_only=True)
class Verdict:
    """How the world of a trial is at the end.

    Attributes:
        cause: why the trial fails, as a code or ``moving``, ``not let go``, ``misplaced``; empty where it succeeds.
        message: the cause in words; empty where it succeeds.
        distance: of the part that is farthest from its goal [m].
        angle: of the part that is rotated farthest from its goal [rad].
    """

    cause: str = ""
    message: str = ""
    distance: float
    angle: float


def draw_case(cell: Cell, seed: int, number: int) -> Case:
    """Return what is drawn for one trial of a cell, the same each time, whatever the other trials are.

    Args:
        cell: as its file has it.
        seed: of all trials.
        number: of the trial, from 1.

    Raises:
        InvalidValueError: in a hundred draws something stands inside something else at the start.
    """
    rng = np.random.default_rng([seed, number])
    for _ in range(_MAX_DRAWS):
        case = _drawn_case(cell, rng)
        try:
            case.world()
        except InvalidValueError as error:
            refused = error
        else:
            return case
    raise InvalidValueError(f"trial {number}: in {_MAX_DRAWS} draws parts stand inside something; the last: {refused}")


def _drawn_case(cell: Cell, rng: np.random.Generator) -> Case:
    trials = cell.trials
    near = {name: attrs.evolve(it, spread=trials.poses.get(name, it.spread)) for name, it in cell.parts.items()}
    parts = {
        name: attrs.evolve(
            part,
            friction=_between(trials.friction, part.friction, rng),
            mass=part.mass * (1.0 + trials.mass * rng.uniform(-1.0, 1.0)),
        )
        for name, part in drawn_parts(attrs.evolve(cell, parts=near), rng).items()
    }
    markers = {
        name: attrs.evolve(it, pose=drawn_pose(it.pose, trials.poses[name], rng)) if name in trials.poses else it
        for name, it in cell.markers.items()
    }
    spreads = {name: trials.poses.get(name, cell.spreads.get(name, Spread())) for name in cell.frames}
    frames = drawn_frames(attrs.evolve(cell, spreads={name: it for name, it in spreads.items() if it != Spread()}), rng)
    drawn = attrs.evolve(
        cell,
        markers=markers,
        cameras={name: _noisy_camera(it, trials.noise.pixels, rng) for name, it in cell.cameras.items()},
        arms={name: _noisy_arm(it, trials.noise.force, trials.noise.effort, rng) for name, it in cell.arms.items()},
    )
    return Case(cell=drawn, parts=parts, frames=frames, seed=int(rng.integers(2**63)))


def _between(interval: Interval | None, value: float, rng: np.random.Generator) -> float:
    """Draw from an interval; the value stays where there is none."""
    return value if interval is None else float(rng.uniform(*interval))


def _noisy_camera(camera: Camera, pixels: Interval | None, rng: np.random.Generator) -> Camera:
    return attrs.evolve(camera, noise=_between(pixels, camera.noise, rng))


def _noisy_arm(arm: CellArm, force: Interval | None, effort: Interval | None, rng: np.random.Generator) -> CellArm:
    wrist, sensors = arm.force_sensor, arm.sensors
    return attrs.evolve(
        arm,
        force_sensor=attrs.evolve(wrist, noise=_between(force, wrist.noise, rng)),
        sensors=attrs.evolve(sensors, effort_noise=_between(effort, sensors.effort_noise, rng)),
    )


def judge(world: PhysicsCell, cell: Cell, now: float, ended_by: tuple[str, str] | None = None) -> Verdict:
    """Return whether the parts of a world are where they should be; the world goes on until they are at rest.

    Success needs all of this: the program has come to its end, no arm has pressed on what it should not, and each part
    with a goal is at rest within a second, touched by no arm, within the distance and the angle of its goal.

    Args:
        world: at the end of the program.
        cell: of the trial.
        now: the time [s].
        ended_by: code and message of the error that has ended the program; None where none has.
    """
    moving = _come_to_rest(world, cell, now)
    errors = {
        part: placing_error(world.true_pose(part), goal_pose(cell, part, world), cell.parts[part])
        for part in cell.trials.goals
    }
    cause, message = ended_by or _fault(world, cell, moving, errors) or ("", "")
    return Verdict(
        cause=cause,
        message=f"{message}{_before(world)}" if cause in {MOVING, UNRELEASED, MISPLACED} else message,
        distance=max((distance for distance, _ in errors.values()), default=0.0),
        angle=max((angle for _, angle in errors.values()), default=0.0),
    )


def _fault(
    world: PhysicsCell, cell: Cell, moving: tuple[str, ...], errors: Mapping[str, tuple[float, float]]
) -> tuple[str, str] | None:
    """Return the first cause for which a trial fails, whose program has come to its end, and the cause in words."""
    for mishap in world.mishaps:
        if mishap.code == _TOUCHED:
            return _TOUCHED, f"{mishap.message} at {mishap.time:.3f} s"
    for part in moving:
        return MOVING, f"{part} still moves {_PATIENCE:g} s after the end"
    for part in cell.trials.goals:
        if arms := world.touching_arms(part):
            return UNRELEASED, f"{part} is touched by {', '.join(arms)}"
    for part, (distance, angle) in errors.items():
        goal = cell.trials.goals[part]
        if distance > goal.distance or angle > goal.angle:
            amount = f"{distance * 1e3:.3g} mm and {math.degrees(angle):.3g} deg"
            return MISPLACED, f"{part} is {amount} from its goal at {goal.at}"
    return None


def _before(world: PhysicsCell) -> str:
    """Return which mishap the program dealt with last, as that may be why it went wrong; nothing where none was."""
    if not world.mishaps:
        return ""
    last = world.mishaps[-1]
    count = counted(len(world.mishaps), "mishap")
    return f"; {count} before, the last {last.code} at {last.time:.3f} s: {last.message}"


def _come_to_rest(world: PhysicsCell, cell: Cell, now: float) -> tuple[str, ...]:
    """Let a world go on until all parts with a goal have been at rest for some time; return those that still move."""
    moving, resting = tuple(cell.trials.goals), 0
    for check in range(1, round(_PATIENCE / _INTERVAL) + 1):
        while world.advance(now + check * _INTERVAL) is not None:
            pass
        fast = tuple(part for part in cell.trials.goals if _moves(world, part))
        resting = 0 if fast else resting + 1
        if resting * _INTERVAL >= _REST_TIME:
            return ()
        moving = fast or moving
    return moving


def _moves(world: PhysicsCell, part: str) -> bool:
    speed, turn = world.speed(part)
    return not (speed <= _REST_SPEED and turn <= _REST_TURN)


def goal_pose(cell: Cell, part: str, world: PhysicsCell | None = None) -> Array:
    """Return the pose (4, 4) in the world at which a part stands upright on the frame, marker or part of its goal.

    Another part is where it is in the world now, or where the cell has it at the start; so is a frame.
    """
    at = cell.trials.goals[part].at
    if at in cell.parts:
        top = support(cell.parts[at].shape, np.array([0.0, 0.0, 1.0]))
        X_WP = cell.parts[at].pose if world is None else world.true_pose(at)
        X_WG = X_WP @ homogeneous(np.eye(3), (0.0, 0.0, top))
    elif at in cell.markers:
        X_WG = cell.markers[at].pose
    else:
        X_WG = cell.tree().world(at) if world is None else world.true_frame(at)
    height = support(cell.parts[part].shape, np.array([0.0, 0.0, -1.0]))
    return np.asarray(X_WG @ homogeneous(np.eye(3), (0.0, 0.0, height)))


def placing_error(X: Array, goal: Array, part: Part) -> tuple[float, float]:
    """Return how far a part is from a pose.

    Args:
        X: (4, 4) of the part in the world.
        goal: (4, 4) where it is to be.
        part: whose equal orientations about its z count as one.

    Returns:
        distance: of the origins of its solid [m].
        angle: of the rotation to the nearest equal orientation [rad].
    """
    turns = 2 * np.pi * np.arange(part.symmetry) / part.symmetry
    equal = (goal[:3, :3] @ rotation_from_vector(np.array([0.0, 0.0, turn])) for turn in turns)
    angle = min(float(angle_between(X[:3, :3], R)) for R in equal)
    return float(np.linalg.norm(X[:3, 3] - goal[:3, 3])), angle
