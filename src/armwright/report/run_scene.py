"""The scene and the parts of a run: for the view of its page, and as data for its record."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from armwright.arrays import Array
from armwright.cell.frames import WORLD
from armwright.cell.model import Cell
from armwright.cell.part_poses import PartPoses, PartTrack, width_across
from armwright.cell.scene import Fixture
from armwright.program.vm.recording import Effect, Recording
from armwright.report.animation import Body, MovedPart
from armwright.report.arm_figure import Placed
from armwright.report.shape_table import ShapeTable, shape_data
from armwright.report.tracking import nearest_ticks
from armwright.spatial.poses import to_noap
from armwright.spatial.shapes import Box

# Bodies of the scene that the view draws at most, and as many parts.
MAX_BODIES = 400
# A part that moved less than this since the last pose is drawn there [m], [rad].
_STILL = 2e-4
# Poses at which a part is shown while the frame that carries it changes its speed.
_RAMP_POSES = 17
# Poses of all parts together on a page at most.
_MAX_POSES = 12_000
_DIGITS = 9


def placed_arms(cell: Cell) -> dict[str, Placed]:
    """Return the arms of a cell where they stand, by name.

    Their guessed links are drawn as they are checked for collisions, wherever there is anything to collide with.
    """
    return {
        name: Placed(
            arm=arm.arm,
            base=arm.base,
            floor=_floor_below((arm.base @ arm.arm.base)[:3, 3], cell.fixtures),
            gripper=arm.gripper,
            as_checked=cell.collisions_matter,
        )
        for name, arm in cell.arms.items()
    }


def _floor_below(point: Array, fixtures: Mapping[str, Fixture]) -> float:
    """Return the height of what is below a point: the highest top of an upright box, or the floor."""
    tops = [0.0]
    for fixture in fixtures.values():
        if isinstance(fixture.shape, Box) and abs(fixture.pose[2, 2]) > 1 - 1e-9:
            inside = np.abs(fixture.pose[:3, :3].T @ (point - fixture.pose[:3, 3])) <= fixture.shape.size / 2 + 1e-9
            top = float(fixture.pose[2, 3] + fixture.shape.size[2] / 2)
            if inside[:2].all() and top <= point[2] + 1e-3:
                tops.append(top)
    return max(tops) if len(tops) == 1 else max(tops[1:])


def fixture_bodies(cell: Cell, shapes: ShapeTable) -> list[Body]:
    """Return what stands in a cell, as the view draws it."""
    return [
        Body(name=name, shape=shapes.number(it.shape), pose=to_noap(it.pose))
        for name, it in list(cell.fixtures.items())[:MAX_BODIES]
    ]


def moved_parts(recording: Recording, shapes: ShapeTable) -> list[MovedPart]:
    """Return the parts and where they were, as the view draws them.

    In a cell with physics they are followed all the time; otherwise only events change what is known of them.
    """
    tracks = list(part_tracks(recording).items())[:MAX_BODIES]
    most = _MAX_POSES // max(len(tracks), 1)
    return [
        MovedPart(
            name=name,
            shape=shapes.number(recording.cell.parts[name].shape),
            times=[float(track.times[i]) for i in kept],
            arms=[track.carriers[i] for i in kept],
            poses=[to_noap(track.poses[i]) for i in kept],
            changes_evenly=bool(recording.measured) or recording.cell.parts[name].on != WORLD,
        )
        for name, track in tracks
        if (kept := kept_poses(track, most))
    ]


def part_tracks(recording: Recording) -> dict[str, PartTrack]:
    """Return where each part of the cell was during a run, by name: in the world, or on the hand that held it."""
    start = PartPoses(recording.cell).tracks
    return {name: _in_world(recording, recording.parts.get(name, track)) for name, track in start.items()}


def _in_world(recording: Recording, track: PartTrack) -> PartTrack:
    """Return a track with poses in the world, closely enough, where a frame that moves by itself carried the part."""
    frames, entries = recording.cell.moving_frames, list[tuple[float, str | None, Array]]()
    ends = [*track.times[1:], max(recording.duration, track.times[-1])]
    for begin, end, carrier, X in zip(track.times, ends, track.carriers, track.poses, strict=True):
        if carrier is None or carrier not in frames:
            entries.append((begin, carrier, X))
            continue
        frame = frames[carrier]
        starts = np.array([time for time, _ in frame.changes])
        ramps = (starts[:, None] + np.linspace(0.0, frame.ramp, _RAMP_POSES)).ravel()
        moments = np.unique([begin, *ramps[(ramps > begin) & (ramps < end)], end])
        entries += [(time, None, frame.pose_at(time) @ X) for time in moments.tolist()]
    times, carriers, poses = zip(*entries, strict=True)
    return PartTrack(times=times, carriers=carriers, poses=poses)


def kept_poses(track: PartTrack, most: int) -> list[int]:
    """Return the numbers of the poses of a track that a page shows.

    A change of the arm is always kept, and so is the last pose; of the others those that differ, each with the one
    before it, up to which the part stood still, and so many at most.

    Args:
        track: of a part.
        most: poses at most, beside the changes of the arm.
    """
    count = len(track.times)
    changes = [i for i in range(count) if i in (0, count - 1) or track.carriers[i] != track.carriers[i - 1]]
    kept, last = set(changes), 0
    moved = []
    for i in range(1, count):
        has_moved = np.abs(track.poses[i] - track.poses[last]).max() > _STILL
        if has_moved and last < i - 1:
            moved.append(i - 1)
        if has_moved or i in kept:
            last = i
            if i not in kept:
                moved.append(i)
    stride = max(1, -(-len(moved) // max(most, 1)))
    return sorted(kept.union(moved[::stride]))


def has_gripper(recording: Recording, arm: str) -> bool:
    """Return whether an arm has a gripper: the cell says so, or the program uses one."""
    used = any(effect.arm == arm and effect.kind in ("OPEN", "GRASP") for effect in recording.effects)
    return used or recording.cell.arms[arm].gripper is not None


def finger_opening(recording: Recording, arm: str, t: Array, opening: float) -> Array:
    """Return the opening of the fingers at each instant, 0 to 1: as it was measured, where there are fingers.

    Otherwise they are open at the start, as in the cell, and fingers that close on a part stop at its sides.

    Args:
        recording: of the run.
        arm: the name of the arm.
        t: (M,) instants [s].
        opening: distance between the open fingers [m].
    """
    measured = {stream.arm: stream for stream in recording.measured if len(stream.t)}
    if arm in measured and recording.cell.arms[arm].gripper_or_usual.kind == "fingers":
        stream = measured[arm]
        return np.asarray(np.clip(stream.opening[nearest_ticks(stream.t, t)] / opening, 0.0, 1.0))
    tracks = part_tracks(recording)
    times, values = [0.0], [1.0]
    for effect in recording.effects:
        if effect.arm == arm and effect.kind in ("OPEN", "GRASP"):
            times += [effect.t0, effect.t1]
            end = 1.0 if effect.kind == "OPEN" else min(_held_width(recording, tracks, effect) / opening, 1.0)
            values += [values[-1], end]
    return np.interp(t, times, values)


def _held_width(recording: Recording, tracks: Mapping[str, PartTrack], grasp: Effect) -> float:
    """Return how far apart the fingers are that closed on a part [m]; 0 where they closed on nothing."""
    widths = [0.0]
    for name, track in tracks.items():
        i = int(np.searchsorted(track.times, grasp.t1 + 1e-9, side="right")) - 1
        if i >= 0 and track.carriers[i] == grasp.arm:
            widths.append(width_across(recording.cell.parts[name].shape, track.poses[i]))
    return max(widths)


def scene_data(cell: Cell) -> list[dict[str, Any]]:
    """Return what stands in a cell as plain data, in SI units."""
    return [
        {"name": name, "shape": shape_data(it.shape), "pose": _numbers(it.pose), "friction": it.friction}
        for name, it in cell.fixtures.items()
    ]


def part_data(recording: Recording) -> dict[str, Any]:
    """Return the parts of a run and where they were as plain data, in SI units; as many poses as the page shows."""
    cell = recording.cell
    tracks = part_tracks(recording)
    most = _MAX_POSES // max(len(tracks), 1)
    return {
        name: {
            "shape": shape_data(cell.parts[name].shape),
            "mass": cell.parts[name].mass,
            "friction": cell.parts[name].friction,
            "grasp": _numbers(cell.parts[name].grasp),
            "track": list(_track_data(track, kept_poses(track, most))),
        }
        for name, track in tracks.items()
    }


def _track_data(track: PartTrack, kept: Sequence[int]) -> Iterator[dict[str, Any]]:
    for i in kept:
        yield {"from": float(track.times[i]), "arm": track.carriers[i], "pose": _numbers(track.poses[i])}


def _numbers(X: Array) -> list[float]:
    rounded: list[float] = (np.round(to_noap(X), _DIGITS) + 0.0).tolist()  # adding 0 turns -0 into 0
    return rounded
