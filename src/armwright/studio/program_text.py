"""The text of the program of a studio: its diagnostics, and changes of it that teaching makes."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

from armwright.cell.model import Cell
from armwright.errors import ArmwrightError, UnknownNameError
from armwright.extras import import_extra
from armwright.files.inputs import read_program
from armwright.files.output import write_back
from armwright.program.api import Compilation, compile as compile_program, import_reader
from armwright.program.flow_analysis.side_effects import walk_statements
from armwright.program.language.diagnostic import Diagnostic
from armwright.program.language.position_codec import UTF_16, UTF_32, PositionCodec, column_count
from armwright.program.language.source import Source
from armwright.program.syntax.nodes import ArmName, Name
from armwright.program.syntax.tree import Blend, Circularly, Directly, Move, Smoothly, Straightly, Via, clause_word

_NORMAL_SPEED = 100.0
# What says how a MOVE goes that goes past no frames.
_NOT_PAST = (Directly, Straightly, Circularly, Smoothly)
# Speeds of a MOVE, and the longest approach [m].
_SPEEDS = (1, 120)
_LONGEST_LINE = 1.0
# Characters of a program at most.
_LONGEST = 500_000
# Diagnostics that a page gets.
_MOST_DIAGNOSTICS = 200
# Completions that it gets.
_MOST_COMPLETIONS = 60


class ProgramTextError(ArmwrightError, ValueError):
    """A text cannot be the program, or cannot be changed so."""


class MoveForm(NamedTuple):
    """How a MOVE goes to its goal.

    Attributes:
        straight: whether along a straight line.
        approach: length of the straight line along the z axis of the goal that ends there [m]; 0 for none.
        departure: length of the straight line against the z axis of the tool by which it begins [m]; 0 for none.
        speed: 100 being normal.
    """

    straight: bool = False
    approach: float = 0.0
    departure: float = 0.0
    speed: float = _NORMAL_SPEED

    def clauses(self, arm: str, frame: str) -> list[str]:
        """Return the clauses of a MOVE of an arm to a frame.

        Raises:
            ProgramTextError: they cannot be combined, or a number is out of range.
        """
        least, most = _SPEEDS
        if not least <= self.speed <= most:
            raise ProgramTextError(f"speed: expected {least} to {most}, got {self.speed:g}")
        lines = {"DEPARTURE": (arm, self.departure), "APPROACH": (frame, self.approach)}
        for word, (_, length) in lines.items():
            if not 0 <= length <= _LONGEST_LINE:
                raise ProgramTextError(
                    f"{word.lower()}: expected 0 to {_LONGEST_LINE * 1e3:g} mm, got {length * 1e3:g}"
                )
        if self.straight and (self.approach or self.departure):
            raise ProgramTextError("a MOVE that goes STRAIGHTLY has no approach and no departure")
        return [
            *(["STRAIGHTLY"] if self.straight else []),
            *(f"WITH {word} = {at} * XYZ(0, 0, {-x * 1e3:g}mm)" for word, (at, x) in lines.items() if x),
            *([f"WITH SPEED = {self.speed:g}"] if self.speed != _NORMAL_SPEED else []),
        ]


class ProgramText:
    """The text of a program.

    Attributes:
        path: of its file; None where it has none yet.
        text: as it is now.
        version: counts its changes.
        compiled: what became of it.
        compilations: counts how often it has been compiled.
    """

    compiled: Compilation
    compilations = 0

    def __init__(self, path: Path | None, text: str, cell: Cell) -> None:
        """Take a text."""
        self.path, self._cell = path, cell
        self._saved = text if path is not None else ""
        self.text, self.version = text, 0
        self._take_compiled(self._compiled(text))

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
        self._take_compiled(self._compiled(self.text))

    def replace(self, text: str) -> None:
        """Take another text.

        Raises:
            ProgramTextError: it is too long, or no text.
        """
        _check_text(text)
        self._take(self._compiled(text.replace("\r\n", "\n")))

    def _take(self, compiled: Compilation) -> None:
        """Take another text that has been compiled."""
        self.text, self.version = compiled.source.main.text, self.version + 1
        self._take_compiled(compiled)

    def _take_compiled(self, compiled: Compilation) -> None:
        self.compiled = compiled
        self.compilations += 1
        self._diagnostics = [self._diagnostic_state(it) for it in self.compiled.diagnostics[:_MOST_DIAGNOSTICS]]

    def _compiled(self, text: str) -> Compilation:
        read_import = None if self.path is None else import_reader(self.path.parent)
        return compile_program(Source(self.name, text), self._cell, read_import=read_import)

    def read_modules(self) -> None:
        """Read the modules that it IMPORTs again: they count as they are in their files now."""
        if self.compiled.source.modules or self._lacks_files():
            self._take_compiled(self._compiled(self.text))

    def _lacks_files(self) -> bool:
        return any(it.code == "E228" for it in self.compiled.diagnostics)

    def line_count(self, file: str = "") -> int:
        """Return how many lines the program has, or the module with a path.

        Raises:
            UnknownNameError: it has no such module.
        """
        source = self.compiled.source
        paths = [module.path for module in source.modules]
        if file and file not in paths:
            raise UnknownNameError("module", file, paths)
        return source.line_count(paths.index(file) + 1) if file else self.text.count("\n") + 1

    def completions(self, text: str, offset: int) -> list[dict[str, Any]]:
        """Return what can be written at a position, the likeliest first, as plain data.

        Args:
            text: the program as it is being written.
            offset: of the position.

        Raises:
            ProgramTextError: the position is not in the text.
            MissingExtraError: the language server is not installed.
        """
        server = import_extra("armwright.program.language_server.completions", "completion", "studio", "lsprotocol")
        _check_text(text)
        if not 0 <= offset <= len(text):
            raise ProgramTextError(f"expected a position from 0 to {len(text)}, got {offset}")
        codec = PositionCodec(text, UTF_32)
        items = server.completions(codec, self._analysis(codec), offset, snippets=False)[:_MOST_COMPLETIONS]
        return [
            {
                "label": it.label,
                "detail": it.detail or "",
                "text": it.text_edit.new_text,
                "start": codec.offset(it.text_edit.range.start.line, it.text_edit.range.start.character),
                "end": codec.offset(it.text_edit.range.end.line, it.text_edit.range.end.character),
            }
            for it in items
        ]

    def description(self, offset: int) -> str:
        """Return what there is to say about what stands at a position; nothing where there is nothing.

        Raises:
            MissingExtraError: the language server is not installed.
        """
        server = import_extra("armwright.program.language_server.hover", "descriptions", "studio", "lsprotocol")
        found = server.hover(self._analysis(PositionCodec(self.text, UTF_32)), offset, markdown=False)
        return "" if found is None else str(found.contents.value)

    def _analysis(self, codec: PositionCodec) -> Any:
        server = import_extra("armwright.program.language_server.analysis", "completion", "studio", "lsprotocol")
        return server.Analysis(compiled=self.compiled, codec=codec, cell=self.compiled.cell or self._cell)

    def save(self, path: Path) -> None:
        """Write it to a file, which is its own from then on; what it IMPORTs is looked for beside that.

        Raises:
            OutputError: the file cannot be written, or somebody else has changed it meanwhile.
        """
        write_back(path, self._saved, self.text, "program_mb")
        self._saved = self.text
        if path != self.path:
            self.path = path
            self._take_compiled(self._compiled(self.text))

    def reload(self) -> None:
        """Take the text that the file has now.

        Raises:
            ProgramTextError: it has no file.
            FileFormatError: the file cannot be read.
        """
        if self.path is None:
            raise ProgramTextError("the program has no file yet; give it a name")
        self._saved = read_program(self.path)
        self.replace(self._saved)

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

    def insert_move(self, line: int, arm: str, frame: str, form: MoveForm) -> None:
        """Insert a MOVE behind the statement that ends in a line.

        Args:
            line: from 1; where no statement of the program itself ends, behind the last one.
            arm: name of the arm.
            frame: its goal.
            form: of the MOVE.

        Raises:
            ProgramTextError: the program has errors of syntax, so that its statements are not known, or would have an
                error with the MOVE; it stays as it is.
        """
        self.require_statements()
        clauses = form.clauses(arm, frame)
        statement = f"MOVE {arm} TO {frame}{' ' if clauses else ''}{', '.join(clauses)} ;"
        self._insert(*self._behind(line, statement), self._declaration(frame))

    def insert_via(self, line: int, frame: str, blend: float) -> None:
        """Let the MOVE in a line go past a frame, behind those that it goes past already.

        Args:
            line: from 1.
            frame: the frame.
            blend: how far before it the corner may begin [m]; 0 for as far as the cell allows.

        Raises:
            ProgramTextError: there is no MOVE in it, or one that goes past no frames.
        """
        if not 0 <= blend <= _LONGEST_LINE:
            raise ProgramTextError(f"blend: expected 0 to {_LONGEST_LINE * 1e3:g} mm, got {blend * 1e3:g}")
        move = self._move_to_go_past(line)
        past = next((it for it in move.clauses if isinstance(it, Via)), None)
        between = self.text[move.goal.span.end : move.clauses[0].span.start] if move.clauses else ","
        separator = "" if "," in between else ","
        place = (
            (move.goal.span.end, f" VIA ({frame}){separator}")
            if past is None
            else (past.points[-1].span.end, f", {frame}")
        )
        rounded = (0, "")
        if blend and not any(isinstance(it, Blend) for it in move.clauses):
            last = move.clauses[-1].span.end if move.clauses else move.goal.span.end
            rounded = last, f", WITH BLEND = {blend * 1e3:g}mm"
        self._insert(place, rounded, self._declaration(frame))

    def _move_to_go_past(self, line: int) -> Move:
        """Return the MOVE in a line if it can go past a frame.

        Raises:
            ProgramTextError: there is no MOVE in it, or one that goes past no frames.
        """
        self.require_statements()
        move = self._move_in(line)
        plain = next((it for it in move.clauses if isinstance(it, _NOT_PAST)), None)
        if plain is not None:
            word = clause_word(type(plain))
            raise ProgramTextError(f"the MOVE in line {line} goes {word}, which cannot be combined with VIA")
        return move

    def _insert(self, *pieces: tuple[int, str]) -> None:
        """Insert texts at offsets; of two at the same place the first stands in front.

        Raises:
            ProgramTextError: the program would have an error that it has not; it stays as it is.
        """
        text = self.text
        for _, (offset, piece) in sorted(enumerate(pieces), key=lambda it: (it[1][0], it[0]), reverse=True):
            text = text[:offset] + piece + text[offset:]
        before = sum(it.is_error for it in self.compiled.diagnostics)
        _check_text(text)
        compiled = self._compiled(text)
        if sum(it.is_error for it in compiled.diagnostics) > before:
            error = first_error(compiled)
            raise ProgramTextError(f"the program would have an error: {error.code}: {error.message}")
        self._take(compiled)

    def _declaration(self, frame: str) -> tuple[int, str]:
        """Return where what declares a frame is to be inserted, and that; nothing where it is declared."""
        program = self.compiled.tree
        if frame.upper() in self.compiled.symbols.declared:
            return 0, ""
        for declared in program.declarations:
            if declared.type.key == "FRAME" and not declared.type.sizes:
                return declared.names[-1].span.end, f", {frame}"
        behind = program.headers[-1].span.end if program.headers else 0
        begin = next(token for token in self.compiled.tokens if token.key == "BEGIN" and token.start >= behind)
        return begin.start, f"VAR {frame} : FRAME ;\n"

    def _behind(self, line: int, statement: str) -> list[tuple[int, str]]:
        """Return what is to be inserted where, so that a statement stands behind the one that ends in a line."""
        program, source, tokens = self.compiled.tree, self.compiled.source, self.compiled.tokens
        if not program.statements:
            # In front of the END whose point ends the program.
            last = next(token for token in reversed(tokens) if token.key == "END")
            lead = "" if self.text[: last.start].endswith("\n") else "\n"
            return [(last.start, f"{lead}  {statement}\n")]
        ends = {source.line(it.span.end - 1): it for it in program.statements}
        before = ends.get(line, program.statements[-1])
        codec = PositionCodec(self.text)
        start = codec.line_starts[source.line(before.span.start) - 1]
        first = self.text[start : before.span.start]
        indent = first if not first.strip() else "  "
        following = [token for token in tokens if token.start >= before.span.end]
        closed = bool(following) and following[0].key == ";"
        place = following[0].end if closed else before.span.end
        rest = following[int(closed)] if len(following) > closed else None
        here = codec.line_of(place)
        pieces = [] if closed else [(place, " ;")]
        if rest is not None and codec.line_of(rest.start) == here:
            # Something else stands in the same line.
            return [*pieces, (place, f"\n{indent}{statement}\n{indent}")]
        end = codec.line_end(here)
        return [*pieces, (end, f"\n{indent}{statement}")]

    def goal_in(self, line: int) -> str:
        """Return the frame to which the MOVE in a line goes.

        Raises:
            ProgramTextError: there is no MOVE to a frame in it.
        """
        goal = self._move_in(line).goal
        if not isinstance(goal, Name):
            raise ProgramTextError(f"the MOVE in line {line} goes to an expression, which has no pose to touch up")
        return self.compiled.names.get(0, {}).get(goal.key, goal.text)

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
        part = self._compiled(text)
        if part.code is None:
            raise ProgramTextError(f"from line {line} on the program cannot run by itself: {first_error(part).message}")
        return part

    # ---- what is shown -------------------------------------------------------------------------------------------

    def _column(self, offset: int) -> int:
        """Return an offset as pages count it."""
        return column_count(self.text[:offset], UTF_16)

    def state(self) -> dict[str, Any]:
        """Return what a page shows of the program beside its text, as plain data."""
        return {
            "version": self.version,
            "name": self.name,
            "named": self.path is not None,
            "changed": self.changed,
            "runs": self.compiled.code is not None,
            "diagnostics": self._diagnostics,
        }

    def modules(self) -> list[dict[str, str | None]]:
        """Return the modules with their texts as plain data; None for texts that make all too long."""
        left, modules = _LONGEST, list[dict[str, str | None]]()
        for path, text in self.module_texts:
            left -= len(text)
            modules.append({"path": path, "text": text if left >= 0 else None})
        return modules

    @property
    def module_texts(self) -> tuple[tuple[str, str], ...]:
        """The modules of the program: paths and texts, whose lines end with line feeds."""
        source = self.compiled.source
        texts = (source.file_text(number).replace("\r\n", "\n") for number in range(1, len(source.modules) + 1))
        return tuple(zip((module.path for module in source.modules), texts, strict=True))

    def _diagnostic_state(self, it: Diagnostic) -> dict[str, Any]:
        source = self.compiled.source
        if source.file_number(it.span.start):
            # A page has the text of the program alone, and cannot change that of a module.
            place: dict[str, Any] = {"start": None, "end": None, "file": source.name_at(it.span.start)}
        else:
            place = {"start": self._column(it.span.start), "end": self._column(it.span.end), "file": ""}
        return {
            **place,
            "line": source.line(it.span.start),
            "severity": it.severity.value,
            "code": it.code,
            "text": it.message,
            "helps": list(it.helps),
            "fixes": [
                {"start": self._column(fix.span.start), "end": self._column(fix.span.end), "text": fix.replacement}
                for fix in (it.fixes if not place["file"] else ())
            ],
        }


def first_error(compiled: Compilation) -> Diagnostic:
    """Return the first error of a program that has one."""
    return next(it for it in compiled.diagnostics if it.is_error)


def _check_text(text: str) -> None:
    if len(text) > _LONGEST:
        raise ProgramTextError(f"a program has at most {_LONGEST:,} characters, got {len(text):,}")
    try:
        text.encode()
    except UnicodeEncodeError:
        raise ProgramTextError("half of a character is no text") from None


def moved_lines(lines: Iterable[int], before: str, after: str) -> set[int]:
    """Return where lines of a text, from 1, are in a changed one; those that are not there any more are left out."""
    old, new = before.split("\n"), after.split("\n")
    shortest = min(len(old), len(new))
    head = next((i for i in range(shortest) if old[i] != new[i]), shortest)
    tail = next((i for i in range(shortest - head) if old[-1 - i] != new[-1 - i]), shortest - head)
    moved = {line: line for line in range(1, head + 1)}
    moved |= {len(old) - i: len(new) - i for i in range(tail)}
    changed = old[head : len(old) - tail], new[head : len(new) - tail]
    for block in difflib.SequenceMatcher(None, *changed, autojunk=False).get_matching_blocks():
        moved |= {head + block.a + i + 1: head + block.b + i + 1 for i in range(block.size)}
    if len(changed[0]) == len(changed[1]):
        # A line that is being written stays the same line.
        moved |= {line: line for line in range(head + 1, len(old) - tail + 1) if line not in moved}
    return {moved[line] for line in lines if line in moved}
