"""The text of the program of a studio: its diagnostics, and changes of it that teaching makes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from armwright.cell.model import Cell
from armwright.errors import ArmwrightError
from armwright.files.inputs import read_program
from armwright.files.output import write_file
from armwright.program.api import Compilation, compile as compile_program
from armwright.program.flow_analysis.side_effects import walk_statements
from armwright.program.language.source import Source
from armwright.program.syntax.nodes import ArmName, Name
from armwright.program.syntax.tree import Move

_NORMAL_SPEED = 100.0
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
            ProgramTextError: it has no file, or somebody else has changed the file meanwhile.
            OutputError: the file cannot be written.
        """
        if self.path is None:
            raise ProgramTextError("the program has no file; name one on the command line")
        if self.path.exists() and read_program(self.path) != self._saved:
            raise ProgramTextError(f"{self.path.name} has been changed by another program; nothing is written over it")
        write_file(self.path, self.text, back=True)
        self._saved = self.text

    # ---- teaching ------------------------------------------------------------------------------------------------

    def require_statements(self) -> None:
        """Begin an empty program, and refuse one whose statements are not known.

        Raises:
            ProgramTextError: it has errors of syntax.
        """
        if not self.text.strip():
            self.replace("BEGIN\nEND.\n")
        if any(it.code.startswith("E1") for it in self.compiled.diagnostics):
            raise ProgramTextError("the program has errors of syntax; correct them before a MOVE is inserted")

    def insert_move(self, line: int, arm: str, frame: str, *, straight: bool, speed: float) -> None:
        """Insert a MOVE behind a line.

        Args:
            line: from 1; 0, and every line that no statement can follow, for behind the last statement.
            arm: name of the arm.
            frame: its goal.
            straight: whether along a straight line.
            speed: 100 being normal.

        Raises:
            ProgramTextError: the program has errors of syntax, so that its statements are not known.
        """
        self.require_statements()
        clauses = [
            *(["STRAIGHTLY"] if straight else []),
            *([f"WITH SPEED = {speed:g}"] if speed != _NORMAL_SPEED else []),
        ]
        offset, indent = self._place_behind(line)
        declaration, place = self._declaration(frame)
        statement = f"{indent}MOVE {' '.join([arm, 'TO', frame, ', '.join(clauses)]).rstrip()} ;\n"
        text = self.text[:offset] + statement + self.text[offset:]
        # What is declared stands in front of all statements.
        self.replace(text[:place] + declaration + text[place:])

    def _declaration(self, frame: str) -> tuple[str, int]:
        """Return what declares a frame, and where it is to be inserted; nothing where it is declared."""
        program = self.compiled.tree
        if frame.upper() in self.compiled.symbols.declared:
            return "", 0
        for declared in program.declarations:
            if declared.type.key == "FRAME" and not declared.type.sizes:
                return f", {frame}", declared.names[-1].span.end
        behind = program.headers[-1].span.end if program.headers else 0
        begin = next(token for token in self.compiled.tokens if token.key == "BEGIN" and token.start >= behind)
        return f"VAR {frame} : FRAME ;\n", begin.start

    def _place_behind(self, line: int) -> tuple[int, str]:
        """Return where a statement can be inserted behind a line, and the blanks in front of it."""
        program, source = self.compiled.tree, self.compiled.source
        ends = {source.line(statement.span.end - 1): statement for statement in program.statements}
        if line in ends:
            start = source.line(ends[line].span.start)
        elif program.statements:
            start = source.line(program.statements[-1].span.start)
            line = source.line(program.statements[-1].span.end - 1)
        else:
            start, line = 0, source.line(program.end.start) - 1
        lines = self.text.splitlines(keepends=True)
        offset = sum(map(len, lines[:line]))
        first = lines[start - 1] if start else "  "
        return offset, first[: len(first) - len(first.lstrip())]

    def goal_in(self, line: int) -> str:
        """Return the frame to which the MOVE in a line goes.

        Raises:
            ProgramTextError: there is no MOVE to a frame in it.
        """
        goal = self._move_in(line).goal
        if not isinstance(goal, Name):
            raise ProgramTextError(f"the MOVE in line {line} goes to an expression, which has no pose to touch up")
        return goal.text

    def moved_in(self, line: int) -> str:
        """Return the arm that the MOVE in a line moves.

        Raises:
            ProgramTextError: there is no MOVE in it, or it moves something that an arm holds.
        """
        moved = self._move_in(line).moved
        if not isinstance(moved, ArmName):
            raise ProgramTextError(
                f"the MOVE in line {line} moves what an arm holds; touch up its frame by teaching it"
            )
        return moved.key

    def _move_in(self, line: int) -> Move:
        source, program = self.compiled.source, self.compiled.tree
        bodies = (*(procedure.body for procedure in program.procedures), *program.statements)
        for node in walk_statements(bodies):
            if isinstance(node, Move) and source.line(node.span.start) <= line <= source.line(node.span.end - 1):
                return node
        raise ProgramTextError(f"there is no MOVE in line {line}")

    def part_from(self, line: int, *, only: bool) -> Compilation:
        """Return the program with nothing but its headers and its statements from a line on.

        Args:
            line: from 1; the statement in it, or the next one.
            only: whether nothing is left but this statement.

        Raises:
            ProgramTextError: no statement is there, or what is left makes no program by itself.
        """
        source, statements = self.compiled.source, self.compiled.tree.statements
        first = next((i for i, it in enumerate(statements) if source.line(it.span.end - 1) >= line), None)
        if first is None:
            raise ProgramTextError(f"no statement is in line {line} or below")
        kept = statements[first : first + 1] if only else statements[first:]
        blanked = [*statements[:first], *statements[first + len(kept) :]]
        text = self.text
        for it in blanked:
            # A semicolon that stays behind separates empty statements.
            empty = "".join(c if c in "\r\n" else " " for c in text[it.span.start : it.span.end])
            text = text[: it.span.start] + empty + text[it.span.end :]
        part = compile_program(Source(self.name, text), self._cell)
        if part.code is None:
            error = next(it for it in part.diagnostics if it.is_error)
            raise ProgramTextError(f"from line {line} on the program cannot run by itself: {error.message}")
        return part

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
