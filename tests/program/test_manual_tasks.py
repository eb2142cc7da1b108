"""Twenty tasks from manuals of other robot languages (docs/manual-tasks.md), as programs that do them."""

import re
from functools import cache
from pathlib import Path

import attrs
import numpy as np
import pytest

from armwright.arrays import Array
from armwright.cell.model import Cell
from armwright.cell.reader import read_cell
from armwright.cell.signals import Input
from armwright.kinematics.forward_kinematics import forward
from armwright.program import Source, compile as translate, run
from armwright.program.formatter.format import formatted
from armwright.program.vm.machine import RunError
from armwright.program.vm.recording import Recording, RunStage, log_csv_lines
from program.running import printed

TASKS = Path(__file__).parent / "manual_tasks"
TABLE = Path(__file__).parents[2] / "docs" / "manual-tasks.md"
PROGRAMS = sorted(TASKS.glob("*.rlo"))
MODULES = sorted(TASKS.glob("modules/*.rlo"))
CELLS = ("kuka", "abb", "ur", "staubli", "fanuc")
PERIOD = 1e-3
# Positions of the hand where a MOVE has ended, and on a path that is only braked and resumed [m].
EXACT = 1e-6
# What a cell allows of a line or an arc [m].
DEVIATION = 1e-3


def never() -> Input:
    return Input()


def at(*times: float) -> Input:
    """Return an input that changes at these times, from off."""
    return Input(timeline=tuple((time, float(number % 2 == 0)) for number, time in enumerate(times)))


@cache
def cell_of_task(number: int) -> Cell:
    """Return the cell of a task: four tasks share one."""
    return read_cell(TASKS / f"{CELLS[(number - 1) // 4]}_cell.toml")


def done(number: int, **inputs: Input) -> Recording:
    """Run a task, with other inputs where they are given."""
    cell = cell_of_task(number)
    return run(PROGRAMS[number - 1], attrs.evolve(cell, inputs={**cell.inputs, **inputs}))


def hand(recording: Recording) -> Array:
    """Return where the hand was at every servo tick [m], (N, 3)."""
    return hands(recording)[:, :3, 3]


def hands(recording: Recording) -> Array:
    """Return the poses of the hand at every servo tick, (N, 4, 4)."""
    placed = recording.cell.arms["ARM_1"]
    return np.asarray(placed.base @ forward(placed.arm, recording.streams[0].q))


def during(recording: Recording, kind: str) -> list[RunStage]:
    return [stage for stage in recording.stages if stage.stage.kind == kind]


def ticks(start: float, end: float) -> slice:
    return slice(round(start / PERIOD), round(end / PERIOD) + 1)


def speeds(points: Array) -> Array:
    return np.linalg.norm(np.diff(points, axis=0), axis=1) / PERIOD


def times_of(recording: Recording, text: str) -> list[float]:
    """Return when effects began whose line of the trace begins so."""
    return [effect.t0 for effect in recording.effects if effect.text.startswith(text)]


def visited(recording: Recording, *points: tuple[float, float, float]) -> list[bool]:
    """Return of points [mm] whether the hand was at them."""
    way = hand(recording)
    return [bool(np.linalg.norm(way - np.array(point) / 1e3, axis=1).min() < EXACT) for point in points]


@pytest.mark.parametrize("path", [*PROGRAMS, *MODULES], ids=lambda path: path.stem)
def test_programs_are_formatted(path: Path) -> None:
    """Programs and modules are as the formatter writes them, and it leaves them so."""
    text = path.read_text(encoding="utf-8")

    assert formatted(Source(path.name, text)) == text


@pytest.mark.parametrize("number", range(1, 21))
def test_programs_have_no_diagnostics(number: int) -> None:
    """Nothing is reported of the programs, not even a warning."""
    assert translate(PROGRAMS[number - 1], cell_of_task(number), strict=True).diagnostics == ()


def test_the_table_names_the_programs() -> None:
    """The table of tasks has four of each language, and names each program in its order."""
    rows = re.findall(r"^\| (\d+) \| (\w+) \|.*\| `(\w+\.rlo)` \|", TABLE.read_text(encoding="utf-8"), re.MULTILINE)

    languages = ("KRL", "RAPID", "URScript", "VAL3", "Karel")
    assert rows == [(str(n + 1), languages[n // 4], PROGRAMS[n].name) for n in range(20)]


def test_clean_and_go_on() -> None:
    """1: the arm leaves the line where it braked, cleans, and goes on there; the spray is off meanwhile."""
    recording = done(1)

    assert printed(recording) == [f"sprayed with 1 cleanings, left at {hand(recording)[2022, 1] * 1e3:.6g}"]
    (off, _), (_, on) = times_of(recording, "spray OFF"), times_of(recording, "spray ON")
    assert 2.0 < off < 2.1
    assert on > 4.0
    assert visited(recording, (350, 0, 350), (450, 200, 200)) == [True, True]
    way = hand(recording)
    assert np.linalg.norm(way[round(off / PERIOD)] - way[round(on / PERIOD)]) < EXACT
    on_line = np.concatenate([way[ticks(0.449, off)], way[ticks(on, recording.duration)]])
    assert np.abs(on_line[:, [0, 2]] - (0.45, 0.2)).max() < DEVIATION


def test_end_of_the_shift_comes_first() -> None:
    """1: the interrupt of higher priority ends the program, also while the other one acts."""
    recording = done(1, END_OF_SHIFT=at(2.3))

    assert printed(recording) == ["end of the shift"]
    assert 2.3 < recording.duration < 2.6
    assert times_of(recording, "ARM_1 RESUME") == []


def test_clamp_within_time() -> None:
    """2: the first try ends after two seconds, the second succeeds half a second after it begins."""
    recording = done(2)

    assert printed(recording) == ["try 1 : the clamp is not closed after 2 s", "closed in 2 tries, after 0.5 s"]
    with pytest.raises(RunError, match="not closed in 3 tries"):
        done(2, CLAMPED=never())


def test_switch_on_the_path() -> None:
    """3: the glue is on from 50 mm behind the start to 50 mm before the end, at the full speed of the line."""
    recording = done(3)

    (on,), (off,) = times_of(recording, "glue ON"), times_of(recording, "glue OFF")
    tick = 200 * PERIOD  # [mm]
    way = hand(recording)
    assert -150 <= way[round(on / PERIOD), 1] * 1e3 <= -150 + tick
    assert 150 <= way[round(off / PERIOD), 1] * 1e3 <= 150 + tick
    np.testing.assert_allclose(speeds(way[ticks(on, off)]), 0.2, rtol=3e-3)


def test_program_number() -> None:
    """4: the programs that are asked for run in order; a wrong parity is refused and not acknowledged."""
    recording = done(4)

    asked = ["program 1", "program 3", "number 2 has a wrong parity", "program 2", "program 0"]
    assert printed(recording) == asked
    assert len(times_of(recording, "acknowledged PULSE")) == 4
    assert visited(recording, (400, -100, 150), (450, -100, 150), (500, -100, 150)) == [True] * 3


def test_search_the_stack() -> None:
    """5: three plates are found, each 20 mm lower, and taken; the fourth search finds nothing."""
    recording = done(5)

    assert printed(recording) == [
        *(f"plate {n} at {height}" for n, height in ((1, 60), (2, 40), (3, 20))),
        "nothing above 10 mm",
        "plates taken: 3",
    ]
    for n, name in enumerate(("TOP", "MIDDLE", "BOTTOM"), 1):
        holder, X_WP = recording.parts[name].at(recording.duration)
        assert holder is None
        # The search stops within half a millimetre of the top, and the plates are let go 1 mm higher.
        np.testing.assert_allclose(X_WP[:3, 3] * 1e3, (350, -200, 20 * n - 10 + 1), atol=0.5)


def test_count_by_interrupt() -> None:
    """6: parts that pass while the interrupt is asleep are not counted."""
    assert printed(done(6)) == ["on the way there: 2", "in all: 4"]
    assert printed(done(6, PART_PASSES=never())) == ["on the way there: 0", "in all: 0"]


def test_try_three_times() -> None:
    """7: the lathe answers at the second try; the mill never does, and after three tries the error goes up."""
    recording = done(7)

    assert printed(recording) == ["turned in 2 tries", "the mill does not answer in 3 tries"]
    assert recording.duration == pytest.approx(1.5 + 3 * 1.0)
    assert printed(done(7, MILL_DONE=at(2.0)))[-1] == "both are done"


def test_two_work_objects() -> None:
    """8: the holes are the same in both plates; the log has the time that each took."""
    recording = done(8)

    expected = []
    for plate in ("PLATE_1", "PLATE_2"):
        X_WP = recording.tree.world(plate)
        holes = [X_WP[:3, 3] + X_WP[:3, :3] @ np.array(offset) for offset in ((0, 0, 0), (0.04, 0, 0), (0.04, 0.03, 0))]
        expected += [(n, *np.round(hole * 1e3, 3)) for n, hole in enumerate(holes, 1)]
    said = [tuple(map(float, re.findall(r"-?[\d.]+(?:e-?\d+)?", line))) for line in printed(recording)]
    np.testing.assert_allclose(said, expected, atol=1e-2)
    rows = [list(map(float, line.split(","))) for line in log_csv_lines(recording.effects)["cycles"][1:]]
    begun, ended = times_of(recording, "TIMER cycle ON"), times_of(recording, "TIMER cycle OFF")
    np.testing.assert_allclose(rows, [[b, n, b - a] for n, a, b in zip((1, 2), begun, ended, strict=True)], atol=1e-9)


def test_height_and_tilt() -> None:
    """9: the tilt is that of the plate; the cup of 30 mm meets it with its rim, a little higher than its middle."""
    lines = printed(done(9))

    height = float(lines[0].removeprefix("height "))
    tilt = [float(word) for word in lines[1].split()[1:]]
    np.testing.assert_allclose(tilt, [0, 3], atol=0.01)
    assert float(lines[2].removeprefix("not flat by ")) < 0.01
    angle = np.radians(3)
    assert height == pytest.approx(50 + 10 / np.cos(angle) + 15 * np.tan(angle) - 0.3, abs=0.05)


def test_feeder_thread() -> None:
    """10: no part is taken that was not fed, none is lost, and no more than three are under way."""
    recording = done(10)

    words = printed(recording)[0].split()
    fed, taken, waiting = (int(words[n]) for n in (1, 3, 5))
    assert (taken, fed - taken) == (4, waiting)
    assert len(times_of(recording, "feeder PULSE")) == fed
    assert 0 <= waiting <= 3
    # Both were at work at once.
    moves = [(effect.t0, effect.t1) for effect in recording.effects if effect.kind == "MOVE"]
    assert any(start < pulse < end for start, end in moves for pulse in times_of(recording, "feeder PULSE"))


def test_bead() -> None:
    """11: one speed of the tool along the bead, corners within their radius, an arc of 50 mm."""
    recording = done(11)

    (on,), (off,) = times_of(recording, "valve ON"), times_of(recording, "valve OFF")
    way = hand(recording)
    pace = speeds(way[ticks(on, off)])
    assert pace.max() < 0.05 * (1 + 1e-4)
    assert (pace > 0.05 * 0.99).mean() > 0.8
    for corner in ((500, 100, 150), (500, 0, 150)):
        nearest = np.linalg.norm(way - np.array(corner) / 1e3, axis=1).min()
        assert EXACT < nearest < 0.01
    (arc,) = during(recording, "ARC")
    along = way[ticks(arc.t0, off)]
    np.testing.assert_allclose(np.linalg.norm(along - (0.45, 0.05, 0.15), axis=1), 0.05, atol=1e-4)


def test_plane_of_a_tray() -> None:
    """12: the frame from three points has its x along the first two and the third in its plane."""
    recording = done(12)

    corner, along, across = (recording.tree.world(name)[:3, 3] for name in ("CORNER", "ALONG", "ACROSS"))
    x = (along - corner) / np.linalg.norm(along - corner)
    y = (across - corner) - ((across - corner) @ x) * x
    y /= np.linalg.norm(y)
    assert visited(recording, *((corner + 0.04 * n * x + 0.03 * y) * 1e3 for n in range(3))) == [True] * 3
    np.testing.assert_allclose(recording.tree.world("TRAY")[:3, :3], np.column_stack((x, y, np.cross(x, y))), atol=1e-9)
    assert printed(recording) == ["spot 0 30 0", "spot 40 30 0", "spot 80 30 0"]


def test_fetch_with_appro() -> None:
    """13: the sensor is awaited with the part still in its place, and the way past `home` has no stop there."""
    recording = done(13)

    assert printed(recording) == ["part at 350 -200 50"]
    (wait,) = (effect for effect in recording.effects if effect.text.startswith("WAIT UNTIL INPUT(held)"))
    assert wait.t1 == pytest.approx(4.5)
    (blend,) = during(recording, "BLEND")
    way = hand(recording)[ticks(blend.t0, blend.t0 + blend.motion.duration)]
    apart = np.linalg.norm(way - (0.4, 0, 0.2), axis=1)
    assert apart.min() < 0.05
    assert speeds(way)[int(apart.argmin()) - 1] > 0.05
    with pytest.raises(RunError, match="no part in the gripper"):
        done(13, HELD=never())


def test_two_tasks() -> None:
    """14: the machine is loaded only while it stands, and works while the arm fetches the next part."""
    recording = done(14)

    assert printed(recording) == ["loaded 1", "worked 1", "loaded 2", "worked 2"]
    starts, stops = times_of(recording, "spindle ON"), times_of(recording, "spindle OFF")
    np.testing.assert_allclose(np.subtract(stops, starts), 2.3, atol=2 * PERIOD)
    to_machine = times_of(recording, "ARM_1 MOVE: PTP machine * lift")
    assert to_machine[1] >= stops[0]
    assert any(starts[0] <= time < stops[0] for time in times_of(recording, "ARM_1 MOVE: PTP feeder * lift"))


def test_stop_and_restart() -> None:
    """15: the motion goes on along its line after the second switch."""
    recording = done(15)

    way = hand(recording)
    stopped, ended = printed(recording)
    assert stopped == f"stopped at {way[2000, 1] * 1e3:.6g}"
    assert ended.startswith("done at -150 at ")
    assert np.abs(way[:, [0, 2]] - (0.4, 0.2)).max() < DEVIATION
    # It rests from the stop to the switch.
    assert speeds(way[ticks(1.4, 3.0)]).max() < EXACT


def test_stop_and_abandon() -> None:
    """15: or it is abandoned, and the arm goes home from where it stopped."""
    recording = done(15, GO_ON=never(), ABANDON=at(2.0))

    assert printed(recording)[1:] == ["abandoned"]
    assert visited(recording, (400, -150, 200)) == [False]
    np.testing.assert_allclose(hand(recording)[-1], (0.4, 0, 0.2), atol=EXACT)


def test_rings_from_libraries() -> None:
    """16: two full circles; the turn of the tool limits the small one, the speed of its point the large one."""
    recording = done(16)

    assert printed(recording) == ["radii 30 60"]
    poses = hands(recording)
    arcs = during(recording, "ARC")
    assert len(arcs) == 4
    for n, arc in enumerate(arcs):
        radius, pace, turn = ((0.03, 0.06, 20.0), (0.06, 0.12, 30.0))[n // 2]
        along = poses[ticks(arc.t0, arc.t0 + arc.motion.duration)]
        apart = np.linalg.norm(along[:, :3, 3] - (0.45, 0, 0.1), axis=1)
        np.testing.assert_allclose(apart, radius, atol=1e-4)
        cosine = (np.trace(along[:-1, :3, :3].swapaxes(1, 2) @ along[1:, :3, :3], axis1=1, axis2=2) - 1) / 2
        reached = speeds(along[:, :3, 3]).max() / pace, np.degrees(np.arccos(cosine.clip(-1, 1))).max() / PERIOD / turn
        assert max(reached) == pytest.approx(1, abs=0.01)
        assert reached[1 - n // 2] > 0.99


def test_condition_handlers() -> None:
    """17: sparks count only after chips were seen; the third one cancels the motion."""
    recording = done(17)

    assert times_of(recording, "blower PULSE") == [1.0]
    assert times_of(recording, "WHEN sparking") == [1.5, 2.0, 2.5]
    assert printed(recording)[0].startswith("sparks 3 stopped at -9")
    np.testing.assert_allclose(hand(recording)[-1], (0.4, 0, 0.2), atol=EXACT)
    undisturbed = done(17, SPARK=at(0.5, 0.6))
    assert printed(undisturbed) == ["sparks 0 stopped at -150"]


def test_hexagon() -> None:
    """18: the corners lie on a circle whose radius is the side, and the sides are straight."""
    recording = done(18)

    angles = np.radians(60 * np.arange(1, 7))
    corners = np.column_stack((420 + 60 * np.cos(angles), -60 * np.sin(angles), np.full(6, 200.0)))
    assert visited(recording, *corners) == [True] * 6
    assert printed(recording) == [f"{round(x)} {round(y) + 0} 60" for x, y, _ in corners]
    assert [stage.stage.kind for stage in recording.stages] == ["PTP"] + ["LINE"] * 6


def test_sort_to_pallets() -> None:
    """19: each part goes to the next slot of the pallet of its kind, until one is full."""
    recording = done(19)

    origins, pitches = {1: (350, 250), 2: (350, -200)}, {1: 50, 2: 40}
    counts = {1: 0, 2: 0}
    lines = printed(recording)
    for line in lines[:-1]:
        kind, number, x, y = (int(float(word)) for word in re.findall(r"-?[\d.]+", line))
        row, column = divmod(counts[kind], 2)
        counts[kind] += 1
        assert number == counts[kind]
        assert (x, y) == (origins[kind][0] + column * pitches[kind], origins[kind][1] - row * pitches[kind])
    full = 1 if counts[1] == 2 else 2
    assert counts[full] == (2, 4)[full - 1]
    assert lines[-1] == f"pallet {full} is full"
    assert len(times_of(recording, f"full_{full} ON")) == 1
    assert len(set(counts.values()) | {0}) == 3


def test_log_positions() -> None:
    """20: the file has the places that were reached, with time and warmth; the third is skipped with a message."""
    recording = done(20)

    titles, *rows = log_csv_lines(recording.effects)["places"]
    assert titles == "t,n,X(ARM_1),Y(ARM_1),Z(ARM_1),TIMER(work),ANALOG(warmth)\n"
    values = np.array([[float(word) for word in row.split(",")] for row in rows])
    np.testing.assert_array_equal(values[:, 1], [1, 2, 4])
    np.testing.assert_allclose(values[:, 2:5], [(400, 80 * n - 200, 150) for n in (1, 2, 4)], atol=1e-3)
    np.testing.assert_allclose(values[:, 5], values[:, 0], atol=1e-9)
    np.testing.assert_allclose(values[:, 6], 20.5 + np.floor(values[:, 0]))
    skipped, last = printed(recording)
    assert skipped.startswith("place 3 skipped: `place[3]` cannot be reached")
    assert last == "skipped 1"
