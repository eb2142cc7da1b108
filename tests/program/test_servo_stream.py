"""The servo stream of programs, and of arms that are stopped on their way, by differences from tick to tick."""

from pathlib import Path

import attrs
import pytest

import armwright.program
from armwright.cell.model import Cell, ContactPlane
from armwright.cell.reader import read_cell
from armwright.cell.simulator import Simulator
from armwright.program.vm.interpreter import interpret
from armwright.program.vm.machine import RunError
from armwright.program.vm.recording import Recording
from armwright.report.run_files import summary_data
from program.guarded import guarded_program
from program.running import cell_of, code_of, corpus_text
from program.streams import Differences, differences, share_at_stop
from samples import Sample

pytestmark = pytest.mark.early

EXAMPLES = Path(__file__).parents[2] / "examples"
CELLS = {
    "bench": "stanford_cell",
    "twelve_moves": "stanford_cell",
    "portable": "stanford_cell",
    "stacking": "stanford_cell",
    "palletise": "stanford_cell",
    "weld": "stanford_cell",
    "sort": "ur5_cell",
    "seam": "ur5_cell",
    "seam_tracking": "seam_cell",
    "smoothly": "springs_cell",
    "fetch": "stanford_cell",
    "belt": "belt_cell",
    "gearbox": "puma_cell",
    "around": "puma_cell",
    "peg": "peg_cell",
    "press": "press_cell",
    "press_zone": "press_zone_cell",
    "stack_by_vision": "vision_cell",
    "insert_peg": "socket_cell",
    "hand_over": "two_arms",
    "hand_over_sideways": "two_arms",
}
HEAD = "VAR f, g : FRAME ; n : SCALAR ; BEGIN f = (1,0,0, 0,-1,0, 0,0,-1, 0.45,0,0.01) ; g = f * XYZ(0, 0.2, -0.1) ; "
PROGRAMS = {
    "peg": corpus_text("p07"),
    "too deep": HEAD + "MOVE ARM_1 TO f STRAIGHTLY, WITH SPEED = 100, ON FORCE(Z) > 8 DO HALT END.",
    "halted": HEAD + "MOVE ARM_1 TO g WITH SPEED = 120, ON DIST(ARM_1, g) < 0.1 DO HALT END.",
    "failing": HEAD + "n = 0 ; MOVE ARM_1 TO g WITH SPEED = 120, ON DIST(ARM_1, g) < 0.1 DO n = 1 / n END.",
}
# How many of 200 random programs have an arm stopped above half a speed limit, two arms, an arm stopped past frames,
# and an error, at least.
SHARES = {"fast": 60, "two arms": 40, "corners": 40, "failed": 20}
# Both arms are under way when one of them divides by 0; the other one is slow, and has stopped sooner.
TWO_ARMS = """
VAR f1, g1, f2 : FRAME ; n : SCALAR ;
BEGIN
  n = 0 ;
  f1 = (1,0,0, 0,-1,0, 0,0,-1, 0.45, 0.25, 0.15) ;
  g1 = (1,0,0, 0,-1,0, 0,0,-1, 0.45,-0.25, 0.20) ;
  f2 = (-1,0,0, 0,1,0, 0,0,-1, 0.65, 0.25, 0.20) ;
  MOVE ARM_1 TO f1 ;
  {TRY}
    COBEGIN
      PRIORITY 1 : BEGIN MOVE ARM_1 TO g1 WITH SPEED = 120, ON DIST(ARM_1, g1) < 0.3 DO n = 1 / n END ;
      PRIORITY 2 : BEGIN MOVE ARM_2 TO f2 WITH SPEED = 10 END
    COEND
  {RECOVER}
END.
"""


def recorded(text: str, cell: Cell) -> tuple[Recording, RunError | None]:
    """Run a program to its end or to its failure; return what is recorded, and the failure."""
    try:
        return interpret(code_of(text, cell), cell, Simulator(cell)), None
    except RunError as error:
        failed = error
    assert failed.recording is not None
    return failed.recording(), failed


@pytest.mark.parametrize("name", sorted(path.stem for path in EXAMPLES.glob("*.rlo")))
@pytest.mark.drawn(0.3)
def test_examples_by_differences(name: str) -> None:
    """In motion.csv of every example all limits hold from tick to tick, and qd and qdd are the derivatives."""
    cell = attrs.evolve(read_cell(EXAMPLES / f"{CELLS[name]}.toml"), around="via" if name == "around" else None)
    recording = armwright.program.run(EXAMPLES / f"{name}.rlo", cell=cell)

    assert (found := differences(recording)).keep(), found


@pytest.mark.parametrize("name", PROGRAMS)
def test_a_stopped_arm_keeps_its_limits(name: str) -> None:
    """At contact, at HALT and after an error no joint passes its limits from tick to tick, and all come to rest."""
    recording, _ = recorded(PROGRAMS[name], cell_of("jam"))

    assert any(stage.stopped for stage in recording.stages)
    assert (found := differences(recording)).keep(), found


def test_all_arms_come_to_rest_when_one_fails() -> None:
    """An arm that fails at full speed brakes longer than the one beside it; the run lasts until both are at rest."""
    text = TWO_ARMS.format(TRY="", RECOVER="")
    recording, failed = recorded(text, read_cell(EXAMPLES / "two_arms.toml"))

    assert failed is not None
    assert failed.diagnostic.code == "E240"
    assert [stage.stopped for stage in recording.stages] == [False, True, True]
    slow, fast = (max(stage.t1 for stage in recording.stages if stage.arm == arm) for arm in ("ARM_2", "ARM_1"))
    assert slow < fast
    assert fast == pytest.approx(recording.duration)
    assert (found := differences(recording)).keep(), found


def test_a_recovery_begins_when_all_arms_are_at_rest() -> None:
    """What follows on the error of a branch waits for the arm of that branch, however long it brakes."""
    text = TWO_ARMS.format(TRY="TRY", RECOVER="RECOVER MOVE ARM_1 TO f1 END")
    recording, failed = recorded(text, read_cell(EXAMPLES / "two_arms.toml"))

    assert failed is None
    *_, stopped, back = (stage for stage in recording.stages if stage.arm == "ARM_1")
    assert (stopped.stopped, back.stopped) == (True, False)
    assert back.t0 == pytest.approx(stopped.t1)
    assert (found := differences(recording)).keep(), found


def test_a_failure_waits_for_an_arm_that_still_brakes() -> None:
    """While an arm brakes after an error that its branch recovers, another branch fails: the run ends at rest."""
    text = TWO_ARMS.format(TRY="", RECOVER="")
    text = text.replace("BEGIN MOVE ARM_1 TO g1", "BEGIN TRY MOVE ARM_1 TO g1").replace(
        "/ n END", "/ n RECOVER PAUSE 1 END END"
    )
    text = text.replace("MOVE ARM_2 TO f2 WITH SPEED = 10", "WHILE DIST(ARM_1, g1) > 0.27 DO PAUSE 0.001 ; n = 1 / n")
    recording, failed = recorded(text, read_cell(EXAMPLES / "two_arms.toml"))

    assert failed is not None
    braked = recording.stages[-1]
    assert (braked.arm, braked.stopped) == ("ARM_1", True)
    assert recording.failure is not None
    assert braked.t0 < recording.failure.time < braked.t1 - 0.1
    assert braked.t1 == pytest.approx(recording.duration)
    assert (found := differences(recording)).keep(), found


def cells(folder: Path) -> tuple[Cell, list[Cell]]:
    """Return a cell of two arms and some of one, all above a plane of contact."""
    two = attrs.evolve(read_cell(EXAMPLES / "two_arms.toml"), contact=ContactPlane(height=0.02), deviation=0.01)
    ones = []
    for model in ("stanford", "ur5", "puma560"):
        place = folder / f"{model}.toml"
        place.write_text(
            f'[arms.ARM_1]\nmodel = "{model}"\nhand = [1,0,0, 0,-1,0, 0,0,-1, 0.45,0,0.25]\n'
            "[contact]\nz = 0.02\n[motion]\ndeviation_mm = 10\n",
            encoding="utf-8",
        )
        ones.append(read_cell(place))
    return two, ones


@pytest.mark.share(0.035)
def test_random_programs_by_differences(sample: Sample, tmp_path: Path) -> None:
    """Guards, contact, corners, errors, two arms: no limit is passed from tick to tick, and all arms come to rest."""
    two, ones = cells(tmp_path)
    full, drawn = 200, 0
    found = {"fast": 0, "two arms": 0, "corners": 0, "failed": 0}
    worst = Differences(speed=0.0, acceleration=0.0, off=0.0)
    for rng in sample.cases(full):
        arms, fails = 1 + sample.case % 5 // 3, sample.case % 20 in (0, 3, 13)
        text = guarded_program(rng, arms=arms, corners=sample.case % 2 == 0, fails=fails)
        recording, failed = recorded(text, two if arms == 2 else ones[sample.case % 3])
        one = differences(recording)
        assert one.keep(), f"{one}\n{text}"
        worst, drawn = worst.worst(one), drawn + 1
        stopped = [stage for stage in recording.stages if stage.stopped]
        found["fast"] += any(share_at_stop(recording, stage) > 0.5 for stage in stopped)
        found["corners"] += any(stage.stage.kind in ("BLEND", "SPLINE") for stage in stopped)
        found["two arms"] += arms == 2
        found["failed"] += failed is not None
    figures = {**found, **attrs.asdict(worst)}
    sample.record("guarded, halting and failing programs", drawn, 0, **figures)
    # Programs differ: in a small sample the shares say less.
    least = drawn / full if sample.whole else drawn / full / 2
    if drawn < sample.count(full):
        return  # one case is repeated
    assert {name: found[name] >= least * share for name, share in SHARES.items()} == dict.fromkeys(SHARES, True), found


def test_too_deep() -> None:
    """An arm that comes down too fast is stopped all the same; the message says how deep it came and what helps."""
    recording, error = recorded(PROGRAMS["too deep"], cell_of("jam"))
    assert error is not None
    said = error.diagnostic

    assert (said.code, "deeper than 5 mm" in said.message) == ("E404", True)
    assert any("unavoidable" in note for note in said.notes)
    assert "use a lower speed" in said.helps[0]
    (stop,) = (effect for effect in recording.effects if effect.kind == "STOP")
    depth = 0.045 - recording.tree.world("ARM_1")[2, 3]
    assert depth > 0.005
    assert stop.data["contact"] == {
        "depth": pytest.approx(depth, abs=1e-6),
        "force": pytest.approx(2e4 * depth, rel=1e-3),
    }
    *_, move = (effect for effect in recording.effects if effect.kind == "MOVE")
    assert move.data["contact"] == stop.data["contact"]
    (contact,) = summary_data(recording, [])["contacts"]
    assert (contact["t1"], contact["depth"]) == (pytest.approx(move.t1), pytest.approx(depth, abs=1e-6))
