"""The robot language: translating a long program, frame statements, two arms at once; Lark reads the same grammar."""

from measure import in_turn, progress, section, table  # isort: skip - sets the threads first

from collections.abc import Callable
from itertools import cycle, islice
from pathlib import Path

from lark import Lark

from armwright.cell.model import Cell
from armwright.cell.reader import read_cell
from armwright.cell.simulator import Simulator
from armwright.program import Compilation, Source, compile, known_cell  # noqa: A004 - what a translator does
from armwright.program.bytecode.instructions import Code
from armwright.program.language.words import Standard
from armwright.program.syntax.lexer import scan
from armwright.program.syntax.line_numbers import blank_line_numbers
from armwright.program.syntax.parser import parse
from armwright.program.vm.interpreter import Limits, Machine, interpret, run

CORPUS = Path(__file__).parents[1] / "tests" / "program" / "corpus"
LINES = 10_000
HEAD = """UNITS MM ;
VAR a, b, c : FRAME ; t : TRANS ; n, m : SCALAR ; x : ARRAY [10] OF FRAME ;
BEGIN
  a = (1,0,0, 0,-1,0, 0,0,-1, 400, 150, 50) ;
  t = XYZ(0, 0, -100) ;
  n = 1 ; m = 2 ; b = a ;
"""
BODY = """  MOVE ARM_1 TO a WITH APPROACH = a * t, WITH SPEED = 80 ;
  UNFIX b ;
  AFFIX b TO a AT XYZ(n * 10, 0, 120mm) ;
  c = b * t * XYZ(0, 0, 1) ;
  IF n = 1 AND DIST(a, b) > 5 THEN
    PRINT("far", DIST(a, c))
  ELSE
    m = m + 1 ;
  FOR n = 1 TO 10 DO
    x[n] = a * XYZ(n, 0, 0) ;
  OPEN ARM_1 ;
  GRASP ARM_1 ;
  a = (1,0,0, 0,-1,0, 0,0,-1, 400, 150, 50) ;
  { a comment }
  MOVE ARM_1 TO x[3] STRAIGHTLY ;
"""
FRAMES = """VAR f, g : FRAME ; t : TRANS ; n : SCALAR ;
BEGIN
  t = XYZ(0, 0, 0.001) ; f = WORLD ;
  FOR n = 1 TO 5000 DO BEGIN g = f * t ; AFFIX g TO f ; UNFIX g FROM f END
END.
"""


def long_program() -> str:
    """Return a program of ten thousand lines in which every kind of statement comes again and again."""
    body = BODY.splitlines(keepends=True)
    whole = (LINES - HEAD.count("\n") - 1) // len(body) * len(body)
    return HEAD + "".join(islice(cycle(body), whole)) + "END.\n"


def translated(text: str, cell: Cell) -> Code:
    """Return the code of a program without errors."""
    compilation = compile(Source("bench.rlo", text), known_cell(cell))
    assert compilation.code is not None, [one.message for one in compilation.diagnostics]  # noqa: S101
    return compilation.code


def reading() -> None:
    """Measure the translator, and our parser beside Lark's on the same grammar."""
    progress("a program of ten thousand lines")
    text, cell = long_program(), read_cell(CORPUS / "cell1.json")
    source, known = Source("long.rlo", text), known_cell(cell)
    lark = Lark((CORPUS / "rlo.lark").read_text(encoding="utf-8"), parser="lalr")

    def parsed() -> None:
        plain, _ = blank_line_numbers(source)
        parse(source, scan(source, plain, Standard.RLO_2).tokens, Standard.RLO_2)

    def whole() -> Compilation:
        return compile(source, known)

    # By itself: the hundred thousand nodes of the other parser's tree would lie in the way.
    (everything,) = in_turn(whole)
    ours, theirs = in_turn(parsed, lambda: lark.parse(text))
    lines = text.count("\n")
    section(
        f"A program of {lines} lines",
        "Lark's LALR parser reads the same language from its grammar and builds a tree; ours finds the places of "
        "errors and goes on after them. The whole translation adds names, types, flow and code.",
        table(
            ["work", "ms", "lines per second"],
            [
                ["Lark, LALR", f"{theirs * 1e3:.0f}", f"{lines / theirs:.3g}"],
                ["armwright, lexer and parser", f"{ours * 1e3:.0f}", f"{lines / ours:.3g}"],
                ["armwright, the whole translation", f"{everything * 1e3:.0f}", f"{lines / everything:.3g}"],
            ],
        ),
    )


def running() -> None:
    """Measure the interpreter: statements on frames, and whole programs against their own clock."""
    progress("the interpreter")
    one, two = read_cell(CORPUS / "cell1.json"), read_cell(CORPUS / "cell2.json")
    frames = translated(FRAMES, one)
    programs = {"p05": one, "p06": one, "p08": two}
    codes = {
        name: translated((CORPUS / f"{name}.rlo").read_text(encoding="utf-8"), programs[name]) for name in programs
    }

    def played(name: str) -> Callable[[], object]:
        return lambda: interpret(codes[name], programs[name], Simulator(programs[name]))

    def changed() -> None:
        run(Machine(frames, one, Simulator(one), Limits()))

    taken, *times = in_turn(changed, *(played(name) for name in programs))
    rows = [["changes of the frame table, one frame statement each", "", f"{15000 / taken:.3g} per second"]]
    says = {"p05": "six parts on a pallet", "p06": "two passes of a weld", "p08": "two arms, hand-over"}
    for name, seconds in zip(programs, times, strict=True):
        clock = interpret(codes[name], programs[name], Simulator(programs[name])).duration
        rows.append([f"{name}: {says[name]}", f"{clock:.1f} s", f"{clock / seconds:.0f} times real time"])
    section(
        "Programs at work",
        "Planning of every MOVE, and positions, speeds, accelerations and efforts of every joint every millisecond.",
        table(["program", "on its clock", "simulated at"], rows),
    )


if __name__ == "__main__":
    reading()
    running()
