"""The conformance programs: what is said about them, and the code that they become."""

import pytest

from armwright.program import Compilation, Source, compile as translate, known_cell
from armwright.program.bytecode.instructions import Op, listing
from armwright.program.diagnostics.render import render
from armwright.program.language.words import Standard
from program.running import cell_of
from program.shelf import BARE, CORPUS, ONE_ARM, compile_program, said


def stage_lists(compilation: Compilation) -> list[str]:
    code = compilation.code
    assert code is not None
    return [step.comment.partition(",")[0] for step in code.instructions if step.op is Op.MVEND]


@pytest.mark.parametrize("name", ["m1", "m2", "m4", "m6"])
def test_rejected_word_for_word(name: str) -> None:
    """Slips of syntax, of types and clauses, in the frame tree and among processes are told in the agreed words."""
    compilation = compile_program(name, BARE)

    assert render(compilation.diagnostics, compilation.source) == (CORPUS / f"{name}.txt").read_text()


@pytest.mark.parametrize(
    ("name", "warnings"),
    [
        ("p01", [("L301", 5)]),
        ("p02", [("W201", 14), ("W203", 14)]),
        ("p03", []),
        ("p04", [("W203", 15)]),
    ],
)
def test_accepted(name: str, warnings: list[tuple[str, int]]) -> None:
    """The programs of RLO-83 get their listed warnings in their cell, no more and no less."""
    compilation = compile_program(name, ONE_ARM)

    assert said(compilation) == warnings
    assert compilation.code is not None


def test_stop_without_a_cell() -> None:
    """Without a cell nothing gives STOP a value; that is a warning, because a cell may."""
    compilation = compile_program("p01")

    assert said(compilation) == [("L301", 5), ("W204", 12)]
    assert compilation.code is not None


def test_strict() -> None:
    """With --strict the implied AFFIX is an error, and only that."""
    compilation = compile_program("p02", ONE_ARM, strict=True)

    assert [(one.code, one.is_error) for one in compilation.diagnostics] == [("W201", True), ("W203", False)]
    assert compilation.code is None


def test_moved_bench() -> None:
    """Turning and shifting the bench changes one line and no message."""
    text = (CORPUS / "p04.rlo").read_text()
    moved = text.replace(
        "station = (1,0,0, 0,1,0, 0,0,1, 0.45, 0, 0)", "station = (0,1,0, -1,0,0, 0,0,1, 0.50, 0.05, 0)"
    )
    compilation = translate(Source("p04.rlo", moved), ONE_ARM)

    assert moved != text
    assert said(compilation) == [("W203", 15)]
    assert stage_lists(compilation) == ["PTP apf1 / LINE obj1", "PTP obj2"]


@pytest.mark.parametrize("name", ["p05", "p06", "p07", "p08"])
def test_programs_of_rlo_2(name: str) -> None:
    """The programs of RLO-2 are accepted with a word on style at most; RLO-83 names what it does not have."""
    cell = known_cell(cell_of("cell2" if name == "p08" else "cell1"))

    assert not any(one.is_error for one in compile_program(name, cell).diagnostics)
    old = compile_program(name, BARE, std=Standard.RLO_83).diagnostics
    assert {one.code for one in old} == {"E214"}
    assert all("RLO-2" in one.message and "RLO-83" in one.label for one in old)


@pytest.mark.parametrize("name", ["p01", "p02", "p03", "p04"])
def test_programs_of_rlo_83(name: str) -> None:
    """A program of the report says the same in both languages, and becomes the same code."""
    old, new = (compile_program(name, ONE_ARM, std=std) for std in Standard)

    assert said(old) == said(new)
    assert old.code is not None
    assert new.code is not None
    assert listing(old.code) == listing(new.code)


def test_twelve_forms() -> None:
    """The twelve forms of MOVE become the stages of the report."""
    assert stage_lists(compile_program("p03", ONE_ARM)) == [
        "PTP f2",
        "PTP f3",
        "PTP ap2 / LINE f2",
        "PTP ap3 / LINE f3",
        "LINE ap3 / PTP f2",
        "LINE ap2 / PTP f3",
        "SPLINE v2 v1 ap2 / LINE f2",
        "SPLINE v1 v2 ap3 / LINE f3",
        "LINE ap3 / SPLINE v2 v1 f2",
        "LINE ap2 / SPLINE v1 v2 f3",
        "LINE f2",
        "LINE f3",
    ]


def test_listing() -> None:
    """The bench task is listed instruction by instruction, with lines, stages and constants."""
    code = compile_program("p02", ONE_ARM).code
    assert code is not None

    assert (
        listing(code)
        == """\
      line  op     operands
0000   5    LOADM  station c0
0001   6    LOADM  obj1 c1
0002   7    LOADM  obj2 c2
0003   8    LOADM  t1 c3
0004   9    AFFIX  obj1 station
0005  10    AFFAT  apf1 obj1 t1
0006  11    MVBEG  ARM_1 obj1
0007  11    MVAPP  apf1
0008  12    MVSPD  100
0009  11    MVEND                     ; PTP apf1 / LINE obj1
0010  13    GRASP  ARM_1              ; arm by context
0011  14    MVBEG  obj1 obj2
0012  14    MVDIR
0013  14    MVEND                     ; PTP obj2, r = ARM_1 -> obj1
0014  15    STOP

c0    1,0,0, 0,1,0, 0,0,1, 0.45,0,0
c1    1,0,0, 0,-1,0, 0,0,-1, 0.4,0.15,0.05
c2    1,0,0, 0,-1,0, 0,0,-1, 0.55,-0.1,0.05
c3    1,0,0, 0,1,0, 0,0,1, 0,0,-0.1
"""
    )
