"""The programs of the manual of the language: each has neither errors nor warnings, and runs."""

import re
import textwrap
from pathlib import Path

import pytest

from armwright.cell.reader import read_cell
from armwright.program import Source, run

ROOT = Path(__file__).parents[2]
MANUAL = (ROOT / "docs" / "language.md").read_text(encoding="utf-8")
INDENTED = re.findall(r"(?:^    .*\n|^\n(?=    ))+", MANUAL, re.MULTILINE)
PROGRAMS = [textwrap.dedent(text).strip() for text in INDENTED if "END." in text]


@pytest.mark.parametrize("text", PROGRAMS, ids=range(len(PROGRAMS)))
def test_program_of_the_manual(text: str) -> None:
    """An example can be copied from the manual and run in the cell of the README."""
    recording = run(Source("manual.rlo", text), read_cell(ROOT / "examples" / "stanford_cell.toml"), strict=True)

    assert recording.failure is None
    assert recording.trace()
