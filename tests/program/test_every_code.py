"""Every code of a diagnostic is shown by a program and explained in the manual."""

import re
from pathlib import Path

import armwright.program
from armwright.program import Source
from armwright.program import compile as translate
from program.shelf import ACCEPTED, BARE, REJECTED, compile_program, expectations

SOURCES = Path(armwright.program.__file__).parent
MANUAL = Path(__file__).parents[2] / "docs" / "language.md"
# What a running program says is shown by its own tests.
RUNNING = {"interpret.py", "obstacles.py"}


def codes() -> set[str]:
    texts = [path.read_text() for path in SOURCES.glob("*.py") if path.name not in RUNNING]
    return {code for text in texts for code in re.findall(r'"([EWLR]\d{3})"', text)}


def test_every_code_is_shown() -> None:
    """For each code there is a program whose expectations fail when the check is taken out."""
    shown = {code for path in [*REJECTED, *ACCEPTED] for code, _ in expectations(path.read_text(encoding="utf-8"))}

    assert codes() - shown == set()
    assert len(codes()) > 50


def test_every_code_is_explained() -> None:
    """The manual has a row for each code, and no row for a code that nothing says."""
    rows = set(re.findall(r"^\| ([EWLR]\d{3}) \|", MANUAL.read_text(encoding="utf-8"), re.MULTILINE))
    running = {code for name in RUNNING for code in re.findall(r'"([EWLR]\d{3})"', (SOURCES / name).read_text())}

    assert codes() | running <= rows
    assert rows <= codes() | running


def test_numbers_of_the_ranges() -> None:
    """E1 is syntax, and only with syntax errors the statements are not followed."""
    slips = compile_program("m1").diagnostics

    assert all(one.is_syntax for one in slips)
    assert not any(code.startswith("E4") for code in codes())


def test_program_of_the_manual() -> None:
    """The program that opens the manual has neither errors nor warnings."""
    text = re.search(r"^```\n(var.*?)^```", MANUAL.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    assert text is not None

    assert translate(Source("manual.rlo", text[1]), BARE).diagnostics == ()
