"""MOVE SMOOTHLY: stages that are shaped, so that an arm with flexible gears does not vibrate at their ends."""

import re
from pathlib import Path

import attrs
import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.cell.model import Cell, CellArm
from armwright.cell.reader import parse_cell
from armwright.cell.simulator import Simulator
from armwright.dynamics import links_at_rest, modes, with_gears
from armwright.errors import FileFormatError
from armwright.kinematics import forward
from armwright.motion import Trajectory, ninth, settling
from armwright.motion.mode_shaping import ModeShaping
from armwright.program import Source
from armwright.program.formatter.format import formatted
from armwright.program.language.position_codec import PositionCodec
from armwright.program.language_server.analysis import Settings, analyse
from armwright.program.language_server.cell_lookup import CellCache
from armwright.program.language_server.completions import completions
from armwright.program.language_server.hover import hover
from armwright.program.vm.interpreter import interpret
from armwright.program.vm.machine import RunError
from armwright.program.vm.recording import Recording
from armwright.report.run_files import summary_data
from armwright.report.run_summary import RunSummary
from armwright.simulation import Adaptive, simulate_flexible
from program.running import check_going_back, check_ticks, code_of, failure, printed, run, tool_positions
from samples import Sample

EXAMPLES = Path(__file__).parents[2] / "examples"
TWO_LINKS = load_arm(str(EXAMPLES / "two_link_springs.toml"))
CELL = """
[arms.ARM_1]
model = "ur5"
hand = [1, 0, 0,  0,-1, 0,  0, 0,-1,   0.40, 0.00, 0.25]
[arms.ARM_1.smooth]
stiffness_Nm_per_rad = [{stiffness}, inf, inf, inf]
damping_Nms = [5, 5, 5, 0, 0, 0]
"""
DECLARED = "UNITS MM ; VAR f, g : FRAME ; n : SCALAR ; BEGIN f = ARM_1 ; g = f * XYZ(0, -150, 50) ; n = 0 ;"


def cell(stiffness: str = "8000, 8000, 5000", more: str = "") -> Cell:
    """A cell with a UR5 on springs."""
    return parse_cell(Path("cell.toml"), CELL.format(stiffness=stiffness) + more)


SPRINGS = cell()
FLAT = cell(more='shaper = "flat"')


def ran(text: str, where: Cell = SPRINGS) -> Recording:
    """The run of statements behind those that declare where the arm is, and a goal beside it."""
    return run(f"{DECLARED} {text} END.", where)


def command(recording: Recording, number: int = -1) -> Trajectory:
    """What the motors are commanded on a stage."""
    return recording.stages[number].motion


@pytest.mark.drawn(0.34)
@pytest.mark.parametrize("kind", ["zvd", "ei", "flat"])
def test_two_links_come_to_rest(kind: str) -> None:
    """Of the vibration of two links after a MOVE little is left, simulated along what their motors do."""
    placed = CellArm(arm=TWO_LINKS, start=(0.2, 0.3), smooth=ModeShaping(kind=kind, tolerance=0.01))
    where = Cell(name="two links", arms={"ARM_1": placed}, gravity=(0, -9.81, 0))
    program = "BEGIN MOVE ARM_1 TO JOINTS(1rad, 1.2rad) {} WITH SPEED = 100 ; END."

    plain = settling(TWO_LINKS, command(run(program.format(""), where))).residual
    smooth = run(program.format("SMOOTHLY,"), where)

    assert plain > 5e-3
    assert settling(TWO_LINKS, command(smooth)).residual < 0.01 * plain
    np.testing.assert_allclose(command(smooth)(command(smooth).duration), (1.0, 1.2), atol=1e-12)


def test_flat_feedforward() -> None:
    """Motors begin and end where a program says, links follow, and the simulated efforts of weak motors keep limits."""
    joints = [
        attrs.evolve(joint, limits=attrs.evolve(joint.limits, effort=effort))
        for joint, effort in zip(TWO_LINKS.joints, (150, 45), strict=True)
    ]
    weak = attrs.evolve(TWO_LINKS, joints=joints)
    recordings = []
    for arm in (TWO_LINKS, weak):
        placed = CellArm(arm=arm, start=(0.2, 0.3), smooth=ModeShaping(kind="flat"))
        where = Cell(name="two links", arms={"ARM_1": placed}, gravity=(0, -9.81, 0))
        recordings.append(run("BEGIN MOVE ARM_1 TO JOINTS(1rad, 1.2rad) SMOOTHLY, WITH SPEED = 120 ; END.", where))
    motors = command(recordings[1])
    ends = np.array((0.0, motors.duration))
    start, goal = (links_at_rest(weak, motors(t)) for t in ends)
    by = Adaptive(rtol=1e-7, atol=1e-9)
    found = simulate_flexible(weak, start, duration=motors.duration, motors=motors, integrator=by, period=5e-3)

    check_ticks(recordings[1])
    assert motors.duration > command(recordings[0]).duration
    np.testing.assert_allclose(motors(ends), ((0.2, 0.3), (1.0, 1.2)), atol=1e-12)
    assert max(np.abs(motors(ends, order)).max() for order in (1, 2)) < 1e-7
    np.testing.assert_allclose(found.q, ninth(start, goal, motors.duration)(found.t), atol=1e-5)
    assert (np.abs(found.tau).max(axis=0) <= weak.limits.effort).all()
    assert (np.abs(found.tau).max(axis=0) > 0.98 * weak.limits.effort).any()
    shaping = recordings[1].stages[0].stage.shaping
    assert shaping is not None
    assert not len(shaping.frequencies)
    assert shaping.deviation > 0
    notes = " ".join(RunSummary(recording=recordings[1], diagnostics=(), hint="").notes)
    assert "flat feedforward: +0." in notes
    assert "limited by the effort of joint" in notes


@pytest.mark.drawn(0.34)
def test_flat_feedforward_of_six_joints() -> None:
    """Of the vibration of a UR5 on springs a hundredth is left at most."""
    arm = SPRINGS.arms["ARM_1"].arm
    plain, smooth = (command(ran(f"MOVE ARM_1 TO g {word} WITH SPEED = 120 ;", FLAT)) for word in ("", "SMOOTHLY,"))

    assert settling(arm, smooth).residual < 0.01 * settling(arm, plain).residual


def test_stops_of_flat_feedforward() -> None:
    """Guards, BRAKE and RESUME stop the motors on their path, and let them go on to the goal."""
    motion = "MOVE ARM_1 TO g SMOOTHLY, WITH SPEED = 40"
    interrupt = "WHEN w : TIME > 0.6 DO BEGIN BRAKE ; PAUSE 0.1 ; RESUME END"
    halted = ran(f"{motion}, ON Y(ARM_1) > 60 DO HALT ; PRINT(Y(ARM_1)) ;", FLAT)
    braked = ran(f"{interrupt} ; {motion} ; PRINT(DIST(ARM_1, g)) ;", FLAT)

    for recording in (halted, braked):
        check_ticks(recording)
    assert 60 < float(printed(halted)[0]) < 149
    assert float(printed(braked)[0]) < 1e-6
    assert [stage.stage.shaping is None for stage in braked.stages] == [False, True]


def test_flat_feedforward_of_lines() -> None:
    """Straight lines are refused before the arm moves, by the compiler where it knows the cell."""
    for way in ("STRAIGHTLY, SMOOTHLY", "SMOOTHLY, WITH DEPARTURE = f * XYZ(0, 0, -20)"):
        text = f"{DECLARED} MOVE ARM_1 TO g {way} ; END."
        with pytest.raises(AssertionError, match=r"E258.*motions of the joints and no straight line"):
            run(text, FLAT)
        with pytest.raises(RunError, match="motions of the joints and no straight line") as error:
            interpret(code_of(text, SPRINGS), FLAT, Simulator(FLAT))
        assert error.value.diagnostic.code == "E258"


def test_path_of_the_joints() -> None:
    """Point to point the joints keep their straight path, and take as much longer as is said, up to a tick."""
    plain, smooth = (command(ran(f"MOVE ARM_1 TO g {word} ;")) for word in ("", "SMOOTHLY"))
    t = np.linspace(0, smooth.duration, 500)
    start, end = smooth(0.0), smooth(smooth.duration)
    part = (smooth(t) - start) @ (end - start) / ((end - start) @ (end - start))

    np.testing.assert_allclose(smooth(t), start + part[:, None] * (end - start), atol=1e-12)
    np.testing.assert_allclose(end, plain(plain.duration), atol=1e-12)
    assert np.abs(smooth(np.array((0.0, smooth.duration)), 1)).max() < 1e-9
    recording = ran("MOVE ARM_1 TO g SMOOTHLY ;")
    shaping = recording.stages[0].stage.shaping
    assert shaping is not None
    model = recording.cell.arms["ARM_1"].arm
    frequencies = modes(model, plain(np.linspace(0, plain.duration, 101))).frequencies.mean(axis=0)
    np.testing.assert_allclose(shaping.frequencies, frequencies[:2], rtol=1e-12)
    assert shaping.added == pytest.approx(smooth.duration - plain.duration)
    assert shaping.added == pytest.approx((1 / frequencies[:2]).sum(), abs=2e-3)
    assert shaping.deviation == 0


def test_line() -> None:
    """A line stays within its certificate, the summary and the data of the run say what was added."""
    recording = ran("MOVE ARM_1 TO g STRAIGHTLY, SMOOTHLY, WITH SPEED = 60 ;")
    (stage,), model = recording.stages, recording.cell.arms["ARM_1"].arm
    q, certificate = command(recording)(np.linspace(0, command(recording).duration, 5000)), stage.stage.certificate
    p = forward(model, q)[:, :3, 3]
    along = (p[-1] - p[0]) / np.linalg.norm(p[-1] - p[0])
    off = np.linalg.norm(p - p[0] - np.outer((p - p[0]) @ along, along), axis=1).max()

    assert certificate is not None
    assert 1e-6 < off <= certificate.deviation <= recording.cell.deviation
    assert stage.stage.deviation == certificate.deviation
    assert certificate.holds
    check_ticks(recording)
    (note, *_) = RunSummary(recording=recording, diagnostics=(), hint="").notes
    assert "LINE to g: zvd for " in note
    assert f" s, path deviation {certificate.deviation * 1e3:.3f} mm" in note
    (data,) = summary_data(recording, ())["stages"]
    assert data["shaping"]["shaper"] == "zvd"
    assert data["shaping"]["path_deviation"] == pytest.approx(certificate.deviation, abs=1e-9)


@pytest.mark.parametrize("way", ["XYZ(0, 100, 20) * ROTZ(180)", "XYZ(0, 0.0001, 0)", "XYZ(0, 0.0001, 0) * ROTZ(0.1)"])
def test_certain_lines(way: str) -> None:
    """A half turn is one the way that the tool goes, and a line of less than a micrometre is a line."""
    (stage,) = ran(f"MOVE ARM_1 TO f * {way} STRAIGHTLY, SMOOTHLY, WITH SPEED = 60 ;").stages

    assert stage.stage.certificate is not None
    assert stage.stage.certificate.holds
    assert stage.stage.shaping is not None


def test_every_stage() -> None:
    """With APPROACH and DEPARTURE each of the three stages is shaped for itself, and ends at rest."""
    recording = ran(
        "MOVE ARM_1 TO g SMOOTHLY, WITH DEPARTURE = f * XYZ(0, 0, -20), WITH APPROACH = g * XYZ(0, 0, -30) ;"
    )

    assert [stage.stage.kind for stage in recording.stages] == ["LINE", "PTP", "LINE"]
    for number, stage in enumerate(recording.stages):
        assert stage.stage.shaping is not None
        assert stage.stage.shaping.added > 0.1
        motion = command(recording, number)
        assert np.abs(motion(np.array((0.0, motion.duration)), 1)).max() < 1e-9
    assert recording.trace()[0].endswith("smoothly @100")
    check_ticks(recording)


@pytest.mark.share(0.02)
def test_random_moves(sample: Sample) -> None:
    """Whatever the springs, the way and the speed, a MOVE keeps all limits, or is refused by a message of its own."""
    refused = 0
    for random in sample.cases(60):
        stiffness = ", ".join(f"{x:.0f}" for x in 10 ** random.uniform(3, 5, 3))
        shaper = random.choice(["zv", "zvd", "ei", "flat"])
        where = cell(stiffness, f'shaper = "{shaper}"\nmodes = {random.integers(1, 4)}\n')
        ways = ["", "STRAIGHTLY,", "WITH APPROACH = g * XYZ(0, 0, -40),"]
        way = "" if shaper == "flat" else random.choice(ways)
        v = random.uniform(50, 600)
        how = ["WITH SPEED = 120", f"WITH VELOCITY = {v:.3f}", "WITH DURATION = 4", "WITH ROTATION = 40deg"]
        clause = how[random.integers(4)]
        x, y, z = random.uniform((-100, -300, -100), (150, 300, 200))
        goal = f"g = f * XYZ({x:.1f}, {y:.1f}, {z:.1f}) * ROTZ({random.uniform(-60, 60):.1f})"
        program = f"{DECLARED} {goal} ; TRY MOVE ARM_1 TO g {way} SMOOTHLY, {clause} RECOVER PRINT(MESSAGE) END ; END."
        recording = run(program, where)

        if said := printed(recording):
            assert re.search("leave the straight line|cannot be reached|infeasible in", said[0]), said
            refused += 1
            continue
        check_ticks(recording)
        for stage in recording.stages:
            ticks = stage.motion.duration / where.period
            assert ticks == pytest.approx(round(ticks), abs=1e-6)
            certificate = stage.stage.certificate
            assert (certificate is None) == (stage.stage.kind == "PTP")
            assert certificate is None or certificate.holds
        if "DURATION" in clause:
            assert recording.duration == pytest.approx(4, abs=1.5e-3)
        if "VELOCITY" in clause:
            assert np.linalg.norm(np.diff(tool_positions(recording), axis=0), axis=1).max() / where.period <= v * 1e-3
    sample.record("moves", sample.count(60), 0, refused=refused)


@pytest.mark.drawn(0.34)
@pytest.mark.parametrize(
    ("text", "code", "says"),
    [
        ("MOVE ARM_1 TO f * XYZ(0, -300, 0) STRAIGHTLY, SMOOTHLY, WITH SPEED = 120 ;", "E413", "straight line to `f"),
        ("MOVE ARM_1 TO f * ROTZ(30) STRAIGHTLY, SMOOTHLY ;", "E413", "the tool only turns"),
        ("MOVE ARM_1 TO g SMOOTHLY, WITH DURATION = 0.3 ;", "E405", "shaped, it takes"),
        ("MOVE ARM_1 TO g * XYZ(3000, 0, 0) SMOOTHLY ;", "E401", "cannot be reached"),
        ("MOVE ARM_1 TO f * XYZ(-750, 0, 0) STRAIGHTLY, SMOOTHLY ;", "E401", "has no detours; go there by other"),
    ],
)
def test_what_cannot_be_done(text: str, code: str, says: str) -> None:
    """Each is an error of motion before the arm moves."""
    soft = cell("900, 900, 700")
    error = failure(f"{DECLARED} {text} END.", soft).diagnostic

    assert error.code == code
    assert says in " ".join((error.message, error.label, *error.notes, *error.helps))
    assert any("leave STRAIGHTLY out" in advice for advice in error.helps) == ("only turns" in says)


def test_rigid_and_coupled_arms() -> None:
    """An arm with rigid gears is refused when it moves, where the checker does not know it; gears too soft as well."""
    rigid = attrs.evolve(SPRINGS, arms={"ARM_1": CellArm(arm=load_arm("ur5"), start=SPRINGS.arms["ARM_1"].start)})
    code = f"{DECLARED} MOVE ARM_1 TO g SMOOTHLY ; END."
    soft = attrs.evolve(rigid.arms["ARM_1"], arm=with_gears(load_arm("ur5"), 0.01))
    assert failure(code, attrs.evolve(rigid, arms={"ARM_1": soft})).diagnostic.code == "E414"
    gears = (1.2e4, 1.2e4, 8e3, np.inf, np.inf, np.inf)
    for damped in (with_gears(load_arm("ur5"), 10.0, 1e6), with_gears(load_arm("ur5"), gears, 252.0)):
        placed = attrs.evolve(rigid.arms["ARM_1"], arm=damped)
        (stage,) = run(code, attrs.evolve(rigid, arms={"ARM_1": placed})).stages
        assert stage.stage.shaping is not None
        assert "zvd for no mode that swings: +0.000 s" in stage.stage.shaping.summary
    with pytest.raises(AssertionError, match="ARM_1 has no flexible gear"):
        run(code, rigid)


def test_a_stop_on_the_way() -> None:
    """Guards, BRAKE and RESUME stop a shaped motion on its path, and let it go on to the goal."""
    motion = "MOVE ARM_1 TO g STRAIGHTLY, SMOOTHLY, WITH SPEED = 40"
    halted = ran(f"{motion}, ON Y(ARM_1) > 60 DO HALT ; PRINT(Y(ARM_1)) ;")
    braked = ran(f"WHEN w : TIME > 0.6 DO BEGIN BRAKE ; PAUSE 1 ; RESUME END ; {motion} ; PRINT(DIST(ARM_1, g)) ;")

    for recording in (halted, braked):
        p = tool_positions(recording)
        along = np.array((0.0, 150.0, -50.0)) / np.hypot(150, 50)
        assert np.linalg.norm(p - p[0] - np.outer((p - p[0]) @ along, along), axis=1).max() <= recording.cell.deviation
        check_ticks(recording)
    assert 60 < float(printed(halted)[0]) < 149
    assert float(printed(braked)[0]) < 1e-6
    assert [stage.stage.shaping is None for stage in braked.stages] == [False, True]


def test_no_other_way() -> None:
    """A MOVE with BLEND stops in front of a shaped one; detours and planned paths are those of other MOVEs."""
    recording = ran(
        "MOVE ARM_1 TO f * XYZ(0, 0, -30) STRAIGHTLY, WITH BLEND = 10 ; MOVE ARM_1 TO g STRAIGHTLY, SMOOTHLY ;"
    )

    assert [stage.stage.shaping is None for stage in recording.stages] == [True, False]
    standing = ran("MOVE ARM_1 TO f SMOOTHLY ; MOVE ARM_1 TO f SMOOTHLY, WITH DURATION = 2 ; PRINT(TIME) ;")
    assert float(printed(standing)[0]) == pytest.approx(2, abs=1e-2)


def test_going_back() -> None:
    """The debugger goes back into a shaped motion, and on from there alike."""
    text = f"{DECLARED} MOVE ARM_1 TO g SMOOTHLY, ON X(ARM_1) > 9000 DO HALT ; MOVE ARM_1 TO f SMOOTHLY ; END."
    check_going_back(text, SPRINGS, lambda machine: machine.state.ticks > 300)


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ('shaper = "zdv"', "expected one of ei, flat, zv, zvd, got the text 'zdv'; did you mean 'zv'"),
        ("modes = 9", "modes"),
        ("tolerance = 0.9", "tolerance"),
        ("modus = 2", "modus"),
    ],
)
def test_wrong_keys(line: str, says: str) -> None:
    """A key that is unknown or out of range is refused with its line."""
    with pytest.raises(FileFormatError, match=says):
        cell(more=line)
    for value in (-5, 0):
        with pytest.raises(FileFormatError, match=f"0.001 to 1e\\+12, or inf for a rigid gear, got {value}"):
            cell(f"1e4, {value}, 0")
    with pytest.raises(FileFormatError, match="6 numbers"):
        cell("1e4")


def test_tools() -> None:
    """The word is offered where it may stand, explained where it stands, and written in upper case."""
    text = "VAR f : FRAME ; BEGIN f = ARM_1 ; MOVE ARM_1 TO f straightly, smoothly ; END."
    analysis = analyse("t.rlo", PositionCodec(text), None, CellCache(), Settings(cell=None))

    shown = hover(analysis, text.index("smoothly"), markdown=False)
    assert shown is not None
    assert "vibrate" in str(shown.contents)
    assert "STRAIGHTLY, SMOOTHLY ;" in formatted(Source("t.rlo", text))
    for written, is_offered in (("", True), ("STRAIGHTLY, ", True), ("VIA (f), ", False), ("SMOOTHLY, ", False)):
        begun = f"{text[: text.index('MOVE')]}MOVE ARM_1 TO f {written}"
        labels = [item.label for item in completions(PositionCodec(begun), analysis, len(begun), snippets=False)]
        assert ("SMOOTHLY" in labels) is is_offered
