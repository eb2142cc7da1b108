"""IF ... ELSE IF ... ELSE: a chain is long and not deep."""

from pathlib import Path

import pytest

from armwright.cell.reader import read_cell
from armwright.cell.simulator import Simulator
from armwright.program import Source, compile as translate
from armwright.program.formatter.format import formatted
from armwright.program.syntax import tree
from armwright.program.vm.interpreter import interpret

CELL = Path(__file__).parents[2] / "examples" / "stanford_cell.toml"
LINKS = 1500
CHAIN = "".join(f"IF n = {number} THEN x = {number} ELSE " for number in range(LINKS))


def test_long_chain() -> None:
    """ELSE IF may follow ELSE IF any number of times in a program that is checked, run, laid out and shown."""
    first = LINKS - 2
    text = f"VAR n, x : SCALAR ;\nBEGIN\n  FOR n = {first} TO {LINKS} DO\n  BEGIN {CHAIN} x = -1 ; PRINT(x) END\nEND.\n"
    compiled = translate(Source("t.rlo", text))
    assert compiled.code is not None
    cell = read_cell(CELL)

    recording = interpret(compiled.code, cell, Simulator(cell))
    laid_out = formatted(Source("t.rlo", text))

    assert not compiled.diagnostics
    printed = [effect.text for effect in recording.effects if effect.kind == "PRINT"]
    assert [line.split('"')[1] for line in printed] == [str(first), str(first + 1), "-1"]
    assert max(len(line) - len(line.lstrip()) for line in laid_out.splitlines()) == 6
    assert formatted(Source("t.rlo", laid_out)) == laid_out
    assert sum(1 for _ in tree.dump(compiled.tree)) > LINKS


def test_values_in_a_chain() -> None:
    """A value on every link is certain behind the chain; one that a link leaves out is not, however long the chain."""
    text = "VAR n, x, y : SCALAR ;\nBEGIN n = 1 ; {} y = 2 ; PRINT(x, y) END.\n"
    whole = "".join(f"IF n = {number} THEN BEGIN x = 1 ; y = 1 END ELSE " for number in range(50)) + "{}"

    sure = translate(Source("t.rlo", text.format(whole.format("x = 2 ;"))))
    unsure = translate(Source("t.rlo", text.format(whole.format("n = 2 ;"))))

    assert not sure.diagnostics
    assert [(one.code, one.message) for one in unsure.diagnostics] == [("W207", "`x` may have no value here")]


def test_chain_with_comments() -> None:
    """A comment behind ELSE sends its IF to the next line, and the chain does not walk off to the right."""
    text = f"BEGIN {CHAIN.replace('ELSE', 'ELSE // c' + chr(10))} HALT END."

    laid_out = formatted(Source("t.rlo", text))

    assert len(laid_out) < 2 * len(text)
    assert formatted(Source("t.rlo", laid_out)) == laid_out


@pytest.mark.parametrize(
    "broken", ["IF a = 1 THEN ; ELSE ", "IF THEN HALT ELSE ", "IF a = 1 HALT ELSE ", "IFF a = 1 THEN HALT ELSE "]
)
def test_broken_links(broken: str) -> None:
    """Every link of a chain is read by itself: what is wrong in one is told of it, and the others are read on."""
    compiled = translate(Source("t.rlo", f"VAR a : SCALAR ; BEGIN a = 2 ; {broken * 3} HALT END."))

    assert len(compiled.diagnostics) == 3
