"""Program mode: programs of controllers do what the RLO program did in its cell, statement by statement."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from armwright.errors import ArmwrightError, CheckFailedError
from armwright.export import ExportedProgram, ExportError, export_compiled, export_program
from armwright.export.api import usual_mode
from armwright.export.checkers import fanuc_machine, krl_machine, rapid_machine, urscript_machine
from armwright.export.checkers.cell_world import CellWorld
from armwright.export.checkers.machine import angles_of, pose_of
from armwright.export.checkers.orientations import from_zyx_degrees
from armwright.export.checkers.program_comparison import compare_run
from armwright.export.translation import translate
from armwright.export.translation.expected import expected
from armwright.export.translation.translate import translate_program
from armwright.export.writers import krl_program
from armwright.program import Compilation, Recording, RunError, Source, compile as compile_program, run
from armwright.program.syntax import tree
from export.cases import EXAMPLES
from export.random_programs import Writer

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

CELLS = {
    "urscript": EXAMPLES / "ur5_cell.toml",
    "krl": EXAMPLES / "kr6_cell.toml",
    "rapid": EXAMPLES / "irb120_cell.toml",
    "fanuc": EXAMPLES / "lrmate_cell.toml",
}
MACHINES = {"urscript": urscript_machine, "krl": krl_machine, "rapid": rapid_machine, "fanuc": fanuc_machine}
STATEMENTS = "statements that differ in kind, text or order"
EVERY = ["bench", "palletise", "portable", "sort", "stacking", "twelve_moves", "weld"]
# Places that hang on what the inputs were before, and those that a camera sees, are known at run time alone.
UNKNOWN = {("fanuc", "sort"), ("fanuc", "stacking")}
HOSTILE = "E619", "E620"
# Parts that are sorted on two trays, one place on each.
TRAYS = """UNITS MM ;
VAR feeder, small_tray, large_tray, part : FRAME ; n : SCALAR ;
PROCEDURE away ; BEGIN OPEN ARM_1 ; MOVE ARM_1 TO ARM_1 * XYZ(0, 0, -80) STRAIGHTLY END ;
BEGIN
  feeder = (1,0,0, 0,-1,0, 0,0,-1, 400,200,100) ; small_tray = feeder * XYZ(30, 200, 0) ;
  large_tray = (1,0,0, 0,-1,0, 0,0,-1, 350,-100,100) ;
  FOR n = 1 TO 4 DO
  BEGIN
    WAIT UNTIL INPUT(part_there) WITHIN 20s ; PAUSE 2 ;
    MOVE ARM_1 TO feeder ; GRASP ARM_1 ; part = feeder * XYZ(0, 0, 5) ; AFFIX part TO ARM_1 ;
    IF INPUT(large) THEN
    BEGIN MOVE part TO large_tray ; PRINT("a large one, on its tray") ; PULSE lamp FOR 200ms ; away() END
    ELSE BEGIN MOVE part TO small_tray WITH APPROACH = small_tray * XYZ(0, 0, -60) ; away() END ;
    UNFIX part ;
  END ;
END.
"""
SORTED = {"urscript": "sort", "krl": "sort", "rapid": "sort", "fanuc": TRAYS}


@cache
def exported(target: str, text: str) -> ExportedProgram:
    """An example, or a text, as a program of a controller."""
    program = EXAMPLES / f"{text}.rlo" if text in EVERY else Source("test.rlo", text)
    return export_program(target, program, CELLS[target], name="test", mode="program")


def main_text(target: str, text: str) -> str:
    """The text of the file that has the statements."""
    return next(text for name, text in exported(target, text).files.items() if name != "proof.json")


@pytest.mark.parametrize("name", EVERY)
@pytest.mark.parametrize("target", CELLS)
@pytest.mark.drawn(0.4)
def test_examples(target: str, name: str) -> None:
    """Seven of the examples for one arm go out to each language, and do what the run did."""
    if (target, name) in UNKNOWN:
        with pytest.raises(ExportError, match=r"^\w+\.rlo:\d+: E620"):
            exported(target, name)
        return
    worst = {one.quantity: one for one in exported(target, name).proof.comparisons}

    assert worst[STATEMENTS].worst == 0
    assert worst["positions of targets"].worst < 3e-4  # mm
    assert worst["orientations of targets"].worst < 1e-6
    assert worst["joints at targets, at the ends of straight lines too"].worst < 1e-6
    assert worst[STATEMENTS].count > 5


def test_program_mode_is_usual_where_it_exists() -> None:
    """The languages of controllers get programs, and what has joint positions alone gets the plan."""
    assert {target: usual_mode(target) for target in ("urscript", "krl", "rapid", "fanuc", "ros2", "csv")} == {
        "urscript": "program",
        "krl": "program",
        "rapid": "program",
        "fanuc": "program",
        "ros2": "plan",
        "csv": "plan",
    }


@pytest.mark.parametrize("target", CELLS)
def test_both_branches_of_an_if_are_seen(target: str) -> None:
    """Small and large parts come by the timeline of the cell; a machine that reads another input does otherwise."""
    name = SORTED[target]
    file = main_text(target, name)
    if target == "fanuc":
        assert failures(target, name, file.replace("DI[2]", "DI[1]"))
        return
    small, large = file.count("small_tray"), file.count("large_tray")
    _, recording = ran(target, "sort")
    said = [effect.data["printed"] for effect in recording.effects if effect.kind == "PRINT"]

    assert (small > 1, large > 1) == (True, True)
    assert said[-1] == "small 3 large 1"
    old, new = {"urscript": ("_in(2)", "_in(1)"), "krl": ("$IN[2]", "$IN[1]"), "rapid": ("diLarge", "diPart")}[target]
    assert failures(target, "sort", file.replace(old, new))


@cache
def ran(target: str, name: str) -> tuple[Compilation, Recording]:
    """An example, compiled and run in the cell of a target."""
    program = EXAMPLES / f"{name}.rlo" if name in EVERY else Source("test.rlo", name)
    compiled = compile_program(program, CELLS[target])
    return compiled, run(compiled)


def failures(target: str, name: str, text: str) -> list[str]:
    """What differs when a machine runs another text in the place of that of an example."""
    compiled, recording = ran(target, name)
    code = translate_program(compiled, recording, "test")
    wanted = expected(code, recording)
    others = [*exported(target, name).files.values()][1:-1]
    try:
        done = MACHINES[target].run([text, *others], CellWorld(recording.cell, wanted.ends))
    except ArmwrightError as error:
        return [str(error)]
    except ValueError as error:
        return [str(error)]
    return [one.quantity for one in compare_run(done, wanted.program) if not one.passed]


FAULTS = {
    "urscript": [
        ("< 4.5", "< 3.5"),
        ("p[0.43,", "p[0.43002,"),
        ("if get_standard_digital_in(2):", "if not get_standard_digital_in(2):"),
        ("_out(0, True)", "_out(0, False)"),
    ],
    "krl": [
        ("TO 4", "TO 3"),
        ("X 430,", "X 430.02,"),
        ("IF $IN[2] THEN", "IF NOT $IN[2] THEN"),
        ("$OUT[1]=TRUE", "$OUT[1]=FALSE"),
    ],
    "rapid": [
        ("TO 4", "TO 3"),
        ("[[430,", "[[430.02,"),
        ("IF (DInput(diLarge)", "IF NOT (DInput(diLarge)"),
        ("SetDO doGrip,1", "SetDO doGrip,0"),
    ],
    "fanuc": [
        ("=1 TO 4", "=1 TO 3"),
        ("IF (DI[2]) THEN", "IF (!DI[2]) THEN"),
        ("DO[1]=ON", "DO[1]=OFF"),
        ("J P[4]", "J P[3]"),
        ("J5= -49.47072", "J5= -49.47272"),
        ("0.2sec", "0.3sec"),
    ],
}


@pytest.mark.parametrize("target", CELLS)
def test_the_file_as_it_is_has_no_fault(target: str) -> None:
    """The comparison of the next test passes without a fault."""
    assert failures(target, SORTED[target], main_text(target, SORTED[target])) == []


@pytest.mark.parametrize(("target", "old", "new"), [(target, *one) for target, ones in FAULTS.items() for one in ones])
@pytest.mark.drawn(0.34)
def test_planted_faults_are_found(target: str, old: str, new: str) -> None:
    """A loop that ends too soon, a tray 20 µm aside, a choice the other way round, a gripper that stays open."""
    text = main_text(target, SORTED[target])
    assert old in text

    assert failures(target, SORTED[target], text.replace(old, new))


# ---- what is refused -----------------------------------------------------------------------------------------------

HEAD = "VAR f, g : FRAME ; n : SCALAR ; e : EVENT ; s : TEXT ;\n"
PROCEDURE = "PROCEDURE again(k : SCALAR) ; BEGIN IF k > 0 THEN again(k - 1) END ;\n"
REFUSED = {
    "n = TIME": ("E619", "TIME"),
    'LOG "x" (n)': ("E619", "LOG"),
    "SIGNAL e": ("E619", "SIGNAL"),
    "COBEGIN BEGIN PAUSE 0.1 END COEND": ("E619", "COBEGIN"),
    "TRY PAUSE 0.1 ; RECOVER PAUSE 0.2 ; END": ("E619", "TRY"),
    "ZERO FORCE ARM_1": ("E619", "ZERO"),
    "n = MOD(n, 2)": ("E619", "MOD"),
    's = "x"': ("E619", "TEXT"),
    "again(2)": ("E619", "calls itself"),
    "OPEN ARM_1 TO 0.02": ("E616", "width"),
    "MOVE ARM_1 TO g STRAIGHTLY, ON DIST(ARM_1, g) < 0.03 DO HALT": ("E611", "guard"),
    "PRINT(f)": ("E619", "pose"),
    "LOCK (n) DO n = 2": ("E619", "LOCK"),
    "FOR n = 1 TO 3 STEP n DO PAUSE 0.1": ("E619", "constant"),
    "IF n > 0 AND 1 / n > 0 THEN PAUSE 0.1": ("E619", "both sides"),
}


@pytest.mark.parametrize("statement", REFUSED)
def test_refusals(statement: str) -> None:
    """What has no counterpart is refused by its name, with its line and a code."""
    text = (
        f"{HEAD}{PROCEDURE}BEGIN\nf = ARM_1 ; g = f * XYZ(0, 0, 0.05) ; n = 1 ;\n{statement} ;\nMOVE ARM_1 TO g\nEND."
    )
    with pytest.raises(ExportError) as caught:
        export_program("urscript", Source("test.rlo", text), CELLS["urscript"], mode="program")
    code, word = REFUSED[statement]

    assert caught.value.diagnostic.code == code
    assert word in str(caught.value) + caught.value.diagnostic.label
    assert str(caught.value).startswith(("test.rlo:5: ", "test.rlo:2: "))


def test_what_has_no_translator_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """A statement of a later language is refused by its first words, because the table does not have it."""
    known = {kind: one for kind, one in translate.TRANSLATORS.items() if kind is not tree.Pause}
    monkeypatch.setattr(translate, "TRANSLATORS", known)
    with pytest.raises(ExportError, match=r"E619: `PAUSE 0\.1` has no counterpart"):
        export_program("krl", Source("test.rlo", "BEGIN PAUSE 0.1 END."), CELLS["krl"], mode="program")


@pytest.mark.parametrize("target", CELLS)
def test_frames_that_hang_here_or_there(target: str) -> None:
    """Where a frame hangs on the arm in one branch alone, its next use is refused; without a use it is not."""
    head = "VAR f : FRAME ; n : SCALAR ; BEGIN n = 1 ; f = ARM_1 ;\nIF n > 0 THEN AFFIX f TO ARM_1 ;\n"
    text = head + "{use}MOVE ARM_1 TO ARM_1 * XYZ(0, 0, 0.02) END."
    with pytest.raises(ExportError, match=r"test\.rlo:3: E620") as caught:
        export_program(target, Source("test.rlo", text.format(use="PRINT(X(f)) ;")), CELLS[target], mode="program")
    assert "hangs depends on the way" in str(caught.value)
    assert exported(target, text.format(use="")).proof.mode == "program"


def test_signals_without_an_address(tmp_path: Path) -> None:
    """An output or an input of which the cell file says no number or name is refused with what to write."""
    cell = CELLS["urscript"].read_text(encoding="utf-8")
    cell = cell.replace("LAMP  = { output = 1 }", 'LAMP = { signal = "doLamp" }').replace("input = 2, ", "")
    path = tmp_path / "cell.toml"
    path.write_text(cell.replace('signal = "diLarge", ', ""), encoding="utf-8")
    for statement, word in (("OPERATE LAMP ON", "LAMP no number"), ("IF INPUT(large) THEN PAUSE 1", "which input")):
        with pytest.raises(ExportError, match="E615") as caught:
            export_program("urscript", Source("test.rlo", f"BEGIN {statement} END."), path, mode="program")
        assert word in str(caught.value)


def test_a_base_in_the_world(tmp_path: Path) -> None:
    """Where the arm stands elsewhere in the world, targets are still those of the world, by a frame of the program."""
    cell = CELLS["urscript"].read_text(encoding="utf-8")
    moved = cell.replace('model = "ur5"', 'model = "ur5"\nbase = [0,1,0, -1,0,0, 0,0,1, 0.1, 0.2, 0.05]')
    path = tmp_path / "cell.toml"
    path.write_text(moved, encoding="utf-8")
    done = export_program("urscript", EXAMPLES / "palletise.rlo", path, mode="program")

    assert "global world = p[" in done.files["palletise.script"]
    assert "pose_trans(world, feeder)" in done.files["palletise.script"]


CLASHES = """UNITS MM ;
VAR change, waited, inverse_of : FRAME ; n_next, n : SCALAR ;
PROCEDURE movej(x : SCALAR) ; BEGIN PRINT("called", x) END ;
BEGIN
  n_next = 7 ; change = ARM_1 ; waited = ARM_1 * XYZ(0, 20, 0) ; AFFIX waited TO change ;
  change = change * XYZ(0, 0, 10) ;
  FOR n = 1 TO 2 DO movej(n) ;
  inverse_of = waited ; AFFIX inverse_of TO ARM_1 ; MOVE inverse_of TO change ;
  WAIT UNTIL INPUT(large) WITHIN 0.1 ELSE PRINT(n_next, X(change), Y(waited)) ;
END.
"""


@pytest.mark.parametrize("target", CELLS)
def test_names_of_the_writer_are_no_names_of_the_program(target: str) -> None:
    """Variables and procedures that are called as the writer calls its own, or as the language does, stay apart."""
    assert {one.quantity: one.worst for one in exported(target, CLASHES).proof.comparisons}[STATEMENTS] == 0


# ---- meanings ------------------------------------------------------------------------------------------------------

MEANINGS = {
    "a frame moves what hangs on it": "AFFIX b TO a AT XYZ(20, 0, 0) ; a = a * XYZ(0, 30, 0) ; MOVE ARM_1 TO b",
    "a frame goes where one is that hangs on it": (
        "AFFIX b TO a AT XYZ(20, 0, 0) ; a = b * XYZ(0, 0, 5) ; MOVE ARM_1 TO a ; MOVE ARM_1 TO b"
    ),
    "a rigid frame moves its parent": "AFFIX b TO a AT XYZ(20, 0, 0) RIGIDLY ; b = b * XYZ(0, 30, 0) ; MOVE ARM_1 TO a",
    "what is carried moves with the arm": (
        "MOVE ARM_1 TO a ; AFFIX b TO ARM_1 ; AFFIX c TO b AT XYZ(0, 10, 0) ; MOVE b TO a ; UNFIX b ; MOVE ARM_1 TO c"
    ),
    "a loop keeps its bounds": "m = 3 ; FOR n = 1 TO m DO BEGIN m = 1 ; MOVE ARM_1 TO a * XYZ(0, n, 0) END ; PRINT(n)",
    "a loop without a pass": "FOR n = 3 TO 1 DO PRINT(n) ; FOR n = 3 TO 1 STEP -1 DO PRINT(n) ; PRINT(n)",
    "halves": "FOR n = 0 TO 1 STEP 0.25 DO PRINT(n / 2) ; n = 7 ; m = 2 ; PRINT(n / m, (n - 1) / (m + 2))",
    "a HALT ends all": 'REPEAT n = n + 1 ; IF n > 2 THEN BEGIN OPERATE lamp ON ; HALT END UNTIL n > 5 ; PRINT("on")',
    "angles": "MOVE ARM_1 TO a * ROTZ(n + 20) * RPY(0, 5*n, 0) ; PRINT(SIN(30*n), SQRT(ABS(-4*n)), ATAN2(n, n))",
    "a duration": "MOVE ARM_1 TO a WITH DURATION = 3 ; MOVE ARM_1 TO a WITH DURATION = 1 ; MOVE ARM_1 TO a",
}


@pytest.mark.parametrize("meaning", MEANINGS)
@pytest.mark.parametrize("target", CELLS)
def test_meanings(target: str, meaning: str) -> None:
    """The statements mean on the controller what they mean in RLO."""
    head = "UNITS MM ; VAR a, b, c : FRAME ; n, m : SCALAR ; BEGIN n = 1 ; "
    frames = "a = WORLD * XYZ(400, 20, 120) * RPY(180, 0, 10) ; b = a * XYZ(0, 0, -30) ; "
    text = f"{head}{frames}{MEANINGS[meaning]} END."

    assert {one.quantity: one.worst for one in exported(target, text).proof.comparisons}[STATEMENTS] == 0


@pytest.mark.share(0.05)
def test_inverses_of_krl(sample) -> None:
    """The inverse of a frame that is computed in KRL is that of linear algebra, at quarter turns of B too."""
    helper = krl_program.HELPERS["INVERSE OF"].format(name="inverse_of")
    for rng in sample.cases(400):
        angles = rng.uniform(-180, 180, 3) if rng.random() < 0.7 else rng.choice([-90.0, 0.0, 90.0, 180.0], 3)
        place = rng.uniform(-900, 900, 3)
        fields = ",".join(f"{name} {value:.9f}" for name, value in zip("XYZABC", [*place, *angles], strict=True))
        text = f"DEF x( )\n$TOOL=inverse_of({{FRAME: {fields}}})\nEND\n{helper}\n"
        found = krl_machine.run([text], CellWorld(ran("krl", "bench")[1].cell, ())).X_CT
        X = pose_of(from_zyx_degrees(angles), place / 1e3)

        np.testing.assert_allclose(found @ X, np.eye(4), atol=1e-8)
        np.testing.assert_allclose(from_zyx_degrees(angles_of(X)), X[:3, :3], atol=1e-12)


@pytest.mark.share(0.02)
@pytest.mark.parametrize("target", CELLS)
def test_random_programs(target: str, sample) -> None:
    """Random programs that run in the cell go out with their proof, or are refused with a reason."""
    proved = refused = failed = 0
    for rng in sample.cases(400):
        text = Writer(rng).text()
        compiled = compile_program(Source("random.rlo", text), CELLS[target])
        assert compiled.code is not None, f"{compiled.diagnostics}\n{text}"
        try:
            recording = run(compiled)
        except RunError:
            failed += 1
            continue
        try:
            export_compiled(target, compiled, recording, "random")
            proved += 1
        except ExportError as error:
            if error.diagnostic.code not in HOSTILE:
                raise AssertionError(f"{error}\n{text}") from error
            refused += 1
        except CheckFailedError as error:
            raise AssertionError(f"{error}\n{text}") from error
    sample.record(f"random programs in {target}", proved, 0, refused=refused, not_run=failed)
    # A quarter needs poses that are known at run time alone, which FANUC cannot compute.
    assert target == "fanuc" or proved + failed > refused
    assert proved


RACK = """MODULE rack ;
UNITS MM ;
RECORD tray ; corner : FRAME ; used : SCALAR ; END ;
VAR n : SCALAR ; STOP : FRAME ; mine : tray ;
PROCEDURE go (INOUT t : tray, dx : SCALAR) ;
BEGIN
  MOVE ARM_1 TO t.corner * XYZ(dx, 0, 0) STRAIGHTLY ;
  t.used = t.used + 1 ; n = n + 1 ;
END ;
PROCEDURE never ;
BEGIN
  {} ;
END ;
BEGIN
  n = 5 ; mine.used = 0 ; mine.corner = STOP * XYZ(10, 0, -40) ; STOP = STOP * XYZ(0, 20, 0) ;
END.
"""
RACKED = """IMPORT "rack.rlo" AS r ;
UNITS MM ;
VAR n : SCALAR ; t : r.tray ;
BEGIN
  n = 7 ; t = r.mine ;
  r.go(r.mine, 15) ; r.go(t, 25) ;
  IF r.n > 6 THEN MOVE ARM_1 TO r.STOP ELSE r.never() ;
  PRINT("n", n, r.n, t.used) ;
END.
"""


@pytest.mark.parametrize("target", CELLS)
def test_modules_and_records(target: str, tmp_path: Path) -> None:
    """What modules do before the program begins is done, their names stay apart, and notes name their files."""
    (tmp_path / "rack.rlo").write_text(RACK.format("MOVE ARM_1 TO mine.corner"), "utf-8")
    (tmp_path / "main.rlo").write_text(RACKED, "utf-8")
    files = export_program(target, tmp_path / "main.rlo", CELLS[target], mode="program")

    assert next(one.worst for one in files.proof.comparisons if one.quantity == STATEMENTS) == 0
    assert any(note.startswith("line 12 of rack.rlo: ") for note in files.proof.notes)


def test_what_a_module_cannot_is_refused_in_its_file(tmp_path: Path) -> None:
    """A statement of a module that has no counterpart is named with the line of the module."""
    (tmp_path / "rack.rlo").write_text(RACK.format("TIMER t ON"), "utf-8")
    (tmp_path / "main.rlo").write_text(RACKED, "utf-8")
    with pytest.raises(ExportError, match=r"^rack\.rlo:12: E619: `TIMER t`"):
        export_program("krl", tmp_path / "main.rlo", CELLS["krl"], mode="program")


def test_plan_mode_names_the_when_that_stopped_a_move() -> None:
    """A MOVE that a WHEN brakes is not called guarded: the WHEN is refused."""
    text = "BEGIN\nWHEN TIME > 0.1 DO BEGIN BRAKE ; RESUME END ;\nMOVE ARM_1 TO ARM_1 * XYZ(0, 0.1, 0) ;\nEND."
    with pytest.raises(ExportError, match=r"^test\.rlo:2: E611: what a WHEN does"):
        export_program("urscript", Source("test.rlo", text), CELLS["urscript"], mode="plan")
