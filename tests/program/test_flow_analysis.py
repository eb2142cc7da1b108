"""What the flow of a program tells: certain errors are errors of runs, and the arms it names are those that work."""

from collections.abc import Iterator

import pytest

from armwright.cell.simulator import Simulator
from armwright.program import Compilation, KnownCell, Source, compile as translate, known_cell
from armwright.program.bytecode.codegen import generate as code_of
from armwright.program.bytecode.instructions import Code
from armwright.program.flow_analysis.context import Context
from armwright.program.language.diagnostic import Diagnostic
from armwright.program.vm.interpreter import run as run_on
from armwright.program.vm.machine import Limits, Machine, RunError
from program.running import cell_of
from program.shelf import BARE, compile_program
from program.wandering import Wandering
from samples import Sample

CELL = cell_of("cell2")
# Said of single statements that fail when a run comes to them.
CERTAIN = {"E301", "E303", "E304", "E305", "E306", "E307", "E310"}
SHORT = Limits(steps=3000, depth=30, time=200)
SEEDS = 45
MAX_REPAIRS = 8


def compiled(text: str) -> Compilation:
    return translate(Source("test.rlo", text), known_cell(CELL))


def forced(compilation: Compilation) -> Code:
    """Return code also for a program with errors."""
    assert compilation.flow is not None
    return code_of(compilation.source, compilation.tree, compilation.symbols, compilation.flow, {})


class Trial:
    """A program that was run although errors may have been said of it."""

    def __init__(self, compilation: Compilation) -> None:
        source = compilation.source
        self.compilation = compilation
        self.begun: set[int] = set()
        self.machine = Machine(forced(compilation), CELL, Simulator(CELL), SHORT)
        self.failed: int | None = None
        try:
            run_on(self.machine, lambda _, line: self.begun.add(line))
        except RunError as error:
            self.failed = source.line(error.diagnostic.span.start)
        recovered = (one.text for one in self.machine.state.effects if one.kind == "ERROR")
        self.recovered = {int(text.split("in line ")[1].split(":")[0]) for text in recovered}

    def escaped(self) -> Iterator[Diagnostic]:
        """Give the errors of statements that were come to and did not fail."""
        source = self.compilation.source
        # Where the run ended while other processes were at work they may not have got so far.
        beside = self.failed is not None and len(self.machine.state.processes) > 1
        for one in self.compilation.diagnostics:
            line = source.line(one.span.start)
            called = any(label.text.endswith("is called here") for label in one.secondary)
            fails = line == self.failed or line in self.recovered
            if one.code in CERTAIN and line in self.begun and not (called or beside or fails):
                yield one

    def other_arms(self) -> Iterator[str]:
        """Give what was done by another arm than the one that was named."""
        flow = self.compilation.flow
        assert flow is not None
        for one in self.machine.state.effects:
            start = one.span.start
            if one.kind in ("MOVE", "GRASP") and flow.arms.get(start, one.arm) != one.arm:
                yield one.text
            if one.kind == "MOVE" and start in flow.implied and not one.data["implied_affix"]:
                yield f"{one.text}: no AFFIX was implied"


def without(text: str, line: int) -> str | None:
    """Return a program without a statement that failed; None where that is more than one line."""
    lines = text.split("\n")
    if lines[line - 1].startswith(("IF", "FOR", "WHILE", "REPEAT", "UNTIL", "TRY", "COBEGIN")):
        return None
    lines[line - 1] = "n = n ;" if lines[line - 1].endswith(";") else "n = n"
    return "\n".join(lines)


@pytest.mark.drawn(0.34)
@pytest.mark.parametrize("seed", range(SEEDS))
def test_certain_errors_are_errors_of_runs(seed: int) -> None:
    """A run that comes to a statement of which an error was said fails there; arms that were named do the work."""
    text: str | None = Wandering(seed).program()
    for _ in range(MAX_REPAIRS):
        assert text is not None
        compilation = compiled(text)
        if {one.code for one in compilation.diagnostics if one.is_error} - CERTAIN:
            return
        trial = Trial(compilation)
        assert [one.message for one in trial.escaped()] == []
        assert [*trial.other_arms()] == []
        text = without(text, trial.failed) if trial.failed else None
        if text is None:
            return


def test_unreachable_statements(sample: Sample) -> None:
    """Of a statement that no way leads to no run ever begins one, whatever way it takes."""
    told = 0
    for rng in sample.cases(200):
        lines = Wandering(int(rng.integers(10**6))).program().split("\n")
        for at in rng.permutation(len(lines))[:3]:
            if lines[at].endswith(" ;") and not lines[at].startswith(("VAR", "PROCEDURE", "UNTIL", "END", "COEND")):
                lines[at] = str(rng.choice(["HALT ;", "IF n > 3 THEN HALT ELSE HALT ;"]))
        compilation = compiled("\n".join(lines))
        if any(one.is_error for one in compilation.diagnostics):
            continue
        unreached = {compilation.source.line(one.span.start) for one in compilation.diagnostics if one.code == "L305"}
        told += len(unreached)
        assert not unreached & Trial(compilation).begun
    sample.record("statements told never to be reached, and reached by no run", told, 0)


def test_frames_of_the_cell_are_near() -> None:
    """Who misspells a frame that only the cell has is told its name, and that it is to be declared."""
    cell = KnownCell(arms=frozenset({"ARM_1"}), frames={"FEEDER": "WORLD"})
    (said,) = translate(Source("test.rlo", "BEGIN MOVE ARM_1 TO fedeer END."), cell).diagnostics

    assert said.code == "E202"
    assert said.helps == ("did you mean `FEEDER`, a frame of the cell? Declare it with `VAR FEEDER : FRAME ;`",)


def test_most_runs_fail_where_it_was_said() -> None:
    """What is certain is also found: most straight-line slips are said before the run."""
    seen = failed = 0
    for seed in range(SEEDS):
        compilation = compiled(Wandering(seed).program())
        if {one.code for one in compilation.diagnostics if one.is_error} <= CERTAIN:
            trial = Trial(compilation)
            failed += trial.failed is not None
            lines = {compilation.source.line(one.span.start) for one in compilation.diagnostics if one.is_error}
            seen += trial.failed in lines

    assert failed >= SEEDS / 2
    assert seen >= 0.6 * failed


def test_arms_by_where_statements_start() -> None:
    """The bench task names the arm of each MOVE and GRASP, and the MOVE that hangs the part on it first."""
    compilation = compile_program("p02", BARE)
    flow, text = compilation.flow, compilation.source.text
    assert flow is not None

    assert dict(flow.arms) == {
        text.index("move ARM-1"): "ARM_1",
        text.index("grasp"): "ARM_1",
        text.index("move obj1"): "ARM_1",
    }
    assert flow.implied == {text.index("move obj1")}


def test_arms_only_where_certain() -> None:
    """A GRASP that closes one hand or the other, and a MOVE in a procedure called with both, have no certain arm."""
    text = (
        "VAR f : FRAME ; n : SCALAR ; PROCEDURE go(hand : FRAME) ; BEGIN MOVE hand TO f ; MOVE ARM_2 TO f END ;\n"
        "BEGIN n = 1 ; f = ARM_1 ; go(ARM_1) ; go(ARM_2) ;\n"
        "IF n > 0 THEN OPEN ARM_1 ELSE OPEN ARM_2 ; GRASP ; OPEN ARM_1 ; GRASP END."
    )
    compilation = compiled(text)
    assert compilation.flow is not None

    assert dict(compilation.flow.arms) == {text.index("MOVE ARM_2"): "ARM_2", text.rindex("GRASP"): "ARM_1"}
    assert compilation.diagnostics == ()


def test_warning_of_one_call_alone() -> None:
    """What is odd only when called with one frame is said once, with the call."""
    compilation = compiled(
        "VAR f, g : FRAME ; PROCEDURE hang(part : FRAME) ; BEGIN AFFIX part TO ARM_1 END ;\n"
        "BEGIN f = ARM_1 ; g = ARM_2 ;\nhang(f) ;\nAFFIX g TO f ;\nhang(g) ; hang(g) END."
    )

    assert [one.code for one in compilation.diagnostics] == ["W203"]
    assert [label.text for label in compilation.diagnostics[0].secondary] == [
        "affixed to f here",
        "hang is called here",
    ]


def steps(text: str, monkeypatch: pytest.MonkeyPatch) -> int:
    """Return how many statements were followed, each as often as it was."""
    count = 0
    follow = Context.follow_one

    def counted(self: Context, statement: object) -> None:
        nonlocal count
        count += 1
        follow(self, statement)  # type: ignore[arg-type]

    monkeypatch.setattr(Context, "follow_one", counted)
    assert not [found for found in compiled(text).diagnostics if found.is_error]
    monkeypatch.undo()
    return count


@pytest.mark.parametrize("head", ["WHILE n > 0 DO", "FOR n = 1 TO 9 DO", "REPEAT", "TRY", "IF n > 0 THEN", "COBEGIN"])
def test_nesting_takes_no_exponential_time(head: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever stands inside one another, forty deep, each statement is followed a few times and not 2**40 times."""
    before, after = {
        "REPEAT": ("REPEAT ", " UNTIL n > 0"),
        "TRY": ("TRY ", " RECOVER n = 1 ; RETRY END"),
        "COBEGIN": ("COBEGIN BEGIN ", " END ; BEGIN PAUSE 1 END COEND"),
    }.get(head, (f"{head} BEGIN ", " END"))
    deep = steps(f"VAR n : SCALAR ; BEGIN n = 1 ; {before * 40} n = 2 {after * 40} END.", monkeypatch)

    assert 40 < deep < 40 * 20


def test_calls_take_no_exponential_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """Thirty procedures that each call the next one twice are not followed 2**30 times."""
    procedures = "".join(
        f"PROCEDURE p{i}(f : FRAME) ; BEGIN f = ARM_1 ; p{i + 1}(f) ; p{i + 1}(f) END ;\n" for i in range(30)
    )
    text = f"VAR f : FRAME ; {procedures} PROCEDURE p30(f : FRAME) ; BEGIN MOVE ARM_1 TO f END ; BEGIN p0(f) END."

    assert steps(text, monkeypatch) < 40_000


def test_deepest_nesting() -> None:
    """What stands as deep as the language allows is still followed, in a procedure called from as deep too."""
    deep = "IF n > 0 THEN " * 90
    procedure = f"PROCEDURE p ; BEGIN {deep} p() END ;"
    text = f"VAR f : FRAME ; n : SCALAR ; {procedure} BEGIN n = 1 ; {deep} p() ;\nMOVE f TO f END."

    assert [one.code for one in compiled(text).diagnostics] == ["E301", "E304"]


def test_many_writes() -> None:
    """A loop that gives hundreds of frames their places makes all of them uncertain, and says nothing false."""
    names = [f"f{i}" for i in range(500)]
    body = " ; ".join(f"AFFIX {name} TO ARM_1 AT XYZ(0, 0, 0.1)" for name in names)
    loop = f"WHILE n < 2 DO BEGIN {body} ; n = 2 END"
    text = f"VAR {', '.join(names)}, g : FRAME ; n : SCALAR ;\nBEGIN n = 1 ; g = ARM_1 ; {loop} ;\n"
    moves = " ; ".join(f"MOVE {name} TO g" for name in names)

    assert [one.code for one in compiled(f"{text}{moves} ; MOVE g TO g END.").diagnostics] == []
