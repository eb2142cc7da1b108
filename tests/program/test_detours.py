"""Straight ways of programs that are stopped: where and why is said, and on request they are gone round at a price."""

import re
from functools import cache
from pathlib import Path

import attrs
import numpy as np
import pytest

from armwright.arrays import Array
from armwright.cell.model import Around, Cell
from armwright.cell.reader import read_cell
from armwright.cell.simulator import Simulator
from armwright.kinematics.forward_kinematics import forward
from armwright.motion import detour
from armwright.motion.path import report_speed
from armwright.program import compile as compile_program, known_cell
from armwright.program.language.diagnostic import Diagnostic
from armwright.program.language.source import Source
from armwright.program.vm.interpreter import interpret, motion_warnings
from armwright.program.vm.machine import RunError
from armwright.program.vm.recording import Recording, RunStage
from armwright.report.stage_badges import stage_badges
from armwright.spatial.rotations import angle_between

EXAMPLES = Path(__file__).parents[2] / "examples"
SEAM = (EXAMPLES / "around.rlo").read_text()
# Ends of the seam in the world, and the base of the PUMA there [m].
TOP, BOTTOM, BASE = np.array([0.55, -0.05, 0.36]), np.array([0.55, 0.35, 0.16]), np.array([0.0, 0.0, 0.67])
# The legs of a way round are lines that keep the deviation of the cell, and 5 mrad for each mm of it.
DEVIATION, TURN = 0.5e-3, 2.5e-3
PLACE = re.compile(r"(\d+) % of the path, ([\d.]+) of ([\d.]+) mm, at \(([-\d.]+), ([-\d.]+), ([-\d.]+)\) mm")


def cell(name: str = "puma", around: Around | None = None) -> Cell:
    return attrs.evolve(read_cell(EXAMPLES / f"{name}_cell.toml"), around=around)


def run(text: str, place: Cell) -> Recording:
    compiled = compile_program(Source("test.rlo", text), known_cell(place))
    assert compiled.code is not None, [d.message for d in compiled.diagnostics]
    return interpret(compiled.code, place, Simulator(place))


def stops(text: str, place: Cell) -> Diagnostic:
    with pytest.raises(RunError) as caught:
        run(text, place)
    return caught.value.diagnostic


@cache
def seam_error() -> Diagnostic:
    """Return what stops the straight line along the seam."""
    return stops(SEAM, cell())


@cache
def seam_run(by: Around) -> Recording:
    """Return the run in which that line is gone round."""
    return run(SEAM, cell(around=by))


def down(**places: tuple[float, float, float]) -> str:
    """Return the beginning of a program whose frames have the hand point down."""
    values = " ".join(f"{name} = (1,0,0, 0,-1,0, 0,0,-1, {x},{y},{z}) ;" for name, (x, y, z) in places.items())
    return f"VAR {', '.join(places)} : FRAME ; BEGIN {values}"


def the_line(recording: Recording) -> RunStage:
    (line,) = (stage for stage in recording.stages if stage.stage.kind == "LINE")
    return line


def hand(recording: Recording, stage: RunStage) -> Array:
    """Return the poses of the hand in the world at every tick of a stage."""
    (s,) = recording.streams
    place = recording.cell.arms[stage.arm]
    rows = (s.t >= stage.t0 - 1e-9) & (s.t <= stage.t1 + 1e-9)
    return np.asarray(place.base @ forward(place.arm, s.q[rows]))


def off_the_seam(p: Array) -> Array:
    way = (BOTTOM - TOP) / np.linalg.norm(BOTTOM - TOP)
    return np.asarray(np.linalg.norm(np.cross(p - TOP, way), axis=-1))


def test_the_place_on_the_path() -> None:
    """The error of a singular line says how far along, where in space, and which joint, and these agree."""
    error = seam_error()

    found = PLACE.match(error.notes[0])
    assert error.code == "E403"
    assert found is not None, error.notes
    percent, along, length, *place = map(float, found.groups())
    assert length == pytest.approx(1e3 * np.linalg.norm(BOTTOM - TOP), abs=0.05)
    assert along == pytest.approx(percent / 100 * length, abs=0.005 * length)
    np.testing.assert_allclose(1e-3 * np.array(place) + BASE, TOP + along / length * (BOTTOM - TOP), atol=2e-4)
    assert "joint 6 would have to move" in error.notes[0]
    assert "(wrist)" in error.notes[0]
    assert error.helps == ("`armwright run --around via` searches for a detour",)


@pytest.mark.parametrize("by", ["via", "damped"])
def test_the_warning(by: Around) -> None:
    """A line that is gone round is told at its MOVE, with the place and cause of the error, the way and the price."""
    recording = seam_run(by)

    (warning,) = motion_warnings(recording.stages, recording.cell)
    assert (warning.code, warning.is_error) == ("W402", False)
    assert SEAM[warning.span.start : warning.span.end] == "MOVE ARM_1 TO bottom STRAIGHTLY"
    assert "the straight line to `bottom`" in warning.message
    assert seam_error().notes[0] in warning.notes[0]
    assert ("via pose" if by == "via" else "damped least squares") in warning.notes[1]
    assert re.search(r"[\d.]+ mm off the line, [\d.]+ mrad, \+[\d.]+ s$", warning.message)
    badge = next(badge for badge in stage_badges(the_line(recording)) if badge.text.startswith("detour"))
    assert "the straight line is infeasible at 50 % of the path" in badge.title


@pytest.mark.parametrize("by", ["via", "damped"])
def test_the_price_is_paid(by: Around) -> None:
    """What the warning says of distance, turn and time is what every tick of the motion shows."""
    recording = seam_run(by)
    line = the_line(recording)
    assert line.stage.detour is not None
    price = line.stage.detour.price
    X = hand(recording, line)

    distance, turn = off_the_seam(X[:, :3, 3]).max(), angle_between(X[:, :3, :3], X[0, :3, :3]).max()

    leg = DEVIATION if by == "via" else 0.0
    assert 0.7 * price.distance <= distance <= price.distance + leg + 1e-9
    assert 0.7 * price.rotation <= turn <= price.rotation + (TURN if by == "via" else 0.0) + 1e-9
    assert line.stage.deviation is not None
    assert distance <= line.stage.deviation <= price.distance + leg
    # By the report's rule: even speed, but for a quarter of the time at either end, where it rises and falls.
    speed = report_speed(recording.cell.arms["ARM_1"].arm, TOP - BASE, BOTTOM - BASE, 100)
    duration = np.linalg.norm(BOTTOM - TOP) / speed / 0.75
    assert line.stage.trajectory.duration - price.time == pytest.approx(duration, abs=recording.cell.period)


@pytest.mark.parametrize("by", ["via", "damped"])
def test_a_stage_like_any_other(by: Around) -> None:
    """A way round begins where the last stage ended, lasts whole ticks, ends at rest at the goal, inside all limits."""
    recording = seam_run(by)
    line = the_line(recording)
    motion, arm, period = line.stage.trajectory, recording.cell.arms["ARM_1"].arm, recording.cell.period
    before = recording.stages[0].stage.trajectory

    np.testing.assert_allclose(motion(0.0), before(before.duration), atol=1e-12)
    np.testing.assert_allclose(motion([0.0, motion.duration], 1), 0, atol=1e-6)
    assert motion.duration / period == pytest.approx(round(motion.duration / period), abs=1e-9)
    np.testing.assert_allclose(hand(recording, line)[-1, :3, 3], BOTTOM, atol=2e-6)
    lowest, highest = motion.extremes(0)
    assert (lowest >= arm.limits.lower).all()
    assert (highest <= arm.limits.upper).all()
    assert (motion.peaks(1) <= arm.limits.speed * (1 + 1e-9)).all()
    assert (motion.peaks(2) <= arm.limits.acceleration * (1 + 1e-9)).all()


def test_no_way_round_where_none_is_needed() -> None:
    """A program whose lines are all free runs to the bit as it does without."""
    text = (EXAMPLES / "gearbox.rlo").read_text()

    plain, asked = run(text, cell()), run(text, cell(around="via"))

    np.testing.assert_array_equal(asked.streams[0].q, plain.streams[0].q)
    assert motion_warnings(asked.stages, asked.cell) == motion_warnings(plain.stages, plain.cell)


def test_round_a_limit() -> None:
    """The boom of the Stanford arm cannot draw in on a line over its base: it is led round, outside its limit."""
    text = down(a=(0.3, 0.3, 0.1), b=(-0.3, -0.3, 0.1)) + "MOVE ARM_1 TO a ; MOVE ARM_1 TO b STRAIGHTLY ; END."

    error = stops(text, cell("stanford"))
    recording = run(text, cell("stanford", around="via"))

    assert error.code == "E402"
    assert "leads joint 3 of ARM_1 beyond its limits" in error.message
    (warning,) = motion_warnings(recording.stages, recording.cell)
    assert error.notes[0] in warning.notes[0]
    line = the_line(recording)
    assert line.stage.obstacle is not None
    assert (line.stage.obstacle.cause, line.stage.obstacle.joint) == ("limits", 3)
    np.testing.assert_allclose(recording.tree.world("ARM_1")[:3, 3], (-0.3, -0.3, 0.1), atol=1e-6)
    assert line.stage.length > np.linalg.norm([0.6, 0.6, 0])


@pytest.mark.parametrize("by", ["via", "damped"])
def test_no_way_round(by: Around, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where no detour is found the error is that of the line, and says that one was looked for."""
    # A pose near the joint move would help by `via`.
    monkeypatch.setattr(detour, "_ON_THE_WAY", ())
    monkeypatch.setattr(detour, "_SCATTER", ())
    text = down(a=(0.34, 0.08, 0.85), b=(0.06, -0.55, 0.63)) + "MOVE ARM_1 TO a ; MOVE ARM_1 TO b STRAIGHTLY ; END."

    plain, asked = stops(text, cell()), stops(text, cell(around=by))

    assert attrs.evolve(asked, helps=plain.helps) == plain
    assert "no detour" in asked.helps[0]


def test_a_way_through_frames_is_not_gone_round() -> None:
    """A path through several frames that is stopped says which of its ways it is, and that it is not replanned."""
    text = down(a=(-0.32, 0.03, 0.46), v=(-0.32, 0.08, 0.46), b=(0.14, 0.06, 0.31))

    error = stops(text + "MOVE ARM_1 TO a ; MOVE ARM_1 TO b VIA (v) ; END.", cell(around="via"))

    assert error.code == "E401"
    assert error.message == "the path to `b` leads out of the reach of ARM_1"
    assert "% of the path from `v` (segment 2 of 2), " in error.notes[0]
    assert "has no detour" in error.helps[0]


def test_a_goal_that_cannot_be_had() -> None:
    """Where the goal itself is the obstacle its place is told, and no detour is promised."""
    text = down(far=(3, 0, 0.2)) + "MOVE ARM_1 TO far STRAIGHTLY ; END."

    error = stops(text, cell("stanford"))

    assert error.notes[0].startswith("at (3000.0, 0.0, 200.0) mm from the base of ARM_1: ")
    assert error.helps == ()


def test_weak_motors() -> None:
    """An arm that cannot hold itself up gets no detour by lines that keep its efforts: the error stays."""
    place = cell()
    arm = place.arms["ARM_1"].arm
    joints = [attrs.evolve(joint, limits=attrs.evolve(joint.limits, effort=0.1)) for joint in arm.joints]
    weak = {"ARM_1": attrs.evolve(place.arms["ARM_1"], arm=attrs.evolve(arm, joints=joints))}

    assert stops(SEAM, attrs.evolve(place, arms=weak, around="via")).code == "E403"
