"""The text of the program of a studio: its diagnostics, and changes of it that teaching makes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from armwright.cell.model import Cell
from armwright.errors import ArmwrightError
from armwright.files.output import write_file
from armwright.program.api import Compilation, compile as compile_program
from armwright.program.language.source import Source

# Characters of a program at most.
_LONGEST = 500_000
# Diagnostics that a page gets.
_MOST_DIAGNOSTICS = 200


class ProgramTextError(ArmwrightError, ValueError):
    """A text cannot be the program, or cannot be changed so."""


class ProgramText:
    """The text of a program.

    Attributes:
        path: of its file; None where it has none yet.
        text: as it is now.
        version: counts its changes.
        compiled: what became of it.
    """

    def __init__(self, path: Path | None, text: str, cell: Cell) -> None:
        """Take a text."""
        self.path, self._cell = path, cell
        self._saved = text if path is not None else ""
        self.text, self.version = text, 0
        self.compiled = self._compile()

    @property
    def name(self) -> str:
        """What messages call it."""
        return "program.rlo" if self.path is None else self.path.name

    @property
    def changed(self) -> bool:
        """Whether it differs from its file."""
        return self.text != self._saved

    def set_cell(self, cell: Cell) -> None:
        """Take another cell, in which frames may have other names."""
        self._cell = cell
        self.compiled = self._compile()

    def replace(self, text: str) -> None:
        """Take another text.

        Raises:
            ProgramTextError: it is too long.
        """
        if len(text) > _LONGEST:
            raise ProgramTextError(f"a program has at most {_LONGEST:,} characters, got {len(text):,}")
        self.text, self.version = text, self.version + 1
        self.compiled = self._compile()

    def _compile(self) -> Compilation:
        return compile_program(Source(self.name, self.text), self._cell)

    def save(self) -> None:
        """Write it to its file.

        Raises:
            ProgramTextError: it has no file.
            OutputError: the file cannot be written.
        """
        if self.path is None:
            raise ProgramTextError("the program has no file yet; name one")
        write_file(self.path, self.text)
        self._saved = self.text

    # ---- what is shown -------------------------------------------------------------------------------------------

    def state(self) -> dict[str, Any]:
        """Return what a page shows of the program beside its text, as plain data."""
        return {
            "version": self.version,
            "name": self.name,
            "changed": self.changed,
            "runs": self.compiled.code is not None,
            "diagnostics": [
                {
                    "start": it.span.start,
                    "end": it.span.end,
                    "line": self.compiled.source.line(it.span.start),
                    "severity": it.severity.value,
                    "code": it.code,
                    "text": it.message,
                    "helps": list(it.helps),
                    "fixes": [
                        {"start": fix.span.start, "end": fix.span.end, "text": fix.replacement} for fix in it.fixes
                    ],
                }
                for it in self.compiled.diagnostics[:_MOST_DIAGNOSTICS]
            ],
        }
