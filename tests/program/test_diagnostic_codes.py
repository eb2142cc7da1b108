"""Every code of a diagnostic is shown by a program on the shelf; the pages that explain them have their own tests."""

import re
from pathlib import Path

import armwright.program
from armwright.program import Source, compile as translate
from program.shelf import ACCEPTED, BARE, REJECTED, compile_program, expectations

SOURCES = Path(armwright.program.__file__).parent
MANUAL = Path(__file__).parents[2] / "docs" / "language.md"


def codes() -> set[str]:
    """What the compiler may say; what a running program says is shown by the tests of the virtual machine."""
    texts = [path.read_text(encoding="utf-8") for path in SOURCES.rglob("*.py") if path.parent.name != "vm"]
    return {code for text in texts for code in re.findall(r'"([EWLR]\d{3})"', text)}


def test_every_code_is_shown() -> None:
    """For each code there is a program whose expectations fail when the check is taken out."""
    shown = {code for path in [*REJECTED, *ACCEPTED] for code, _ in expectations(path.read_text(encoding="utf-8"))}

    assert codes() - shown == set()
    assert len(codes()) > 80


def test_numbers_of_the_ranges() -> None:
    """E1 is syntax, and only with syntax errors the statements are not followed."""
    slips = compile_program("m1").diagnostics

    assert all(one.is_syntax for one in slips)
    assert not any(code.startswith("E4") for code in codes())


def test_program_of_the_manual() -> None:
    """The program that opens the manual has neither errors nor warnings."""
    text = re.search(r"^```\n(.*?)^```", MANUAL.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    assert text is not None

    assert translate(Source("manual.rlo", text[1]), BARE).diagnostics == ()
