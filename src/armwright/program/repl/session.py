"""A session: statements are done in a simulated cell as they are entered, and can be taken back.

What was entered stays a program at all times: every input is checked together with all that came before it, so
that the checker knows values and affixments, and only what is new is translated and run. A state of the cell is a
machine that nobody advances; each statement goes on in a twin of it. So an error, an interruption and an undo all
come to the same: going on from an earlier state.
"""

from collections.abc import Callable, Mapping
from functools import cache
from typing import TypeAlias

import attrs

from armwright.cell.model import Cell
from armwright.errors import ExitStatus
from armwright.program.bytecode.codegen import generate
from armwright.program.bytecode.instructions import Code
from armwright.program.flow_analysis import analysis
from armwright.program.flow_analysis.analysis import Flow
from armwright.program.language.diagnostic import Diagnostic, sort_diagnostics
from armwright.program.language.source import Source, Span
from armwright.program.language.words import Standard
from armwright.program.repl import snapshots
from armwright.program.repl.declarations import MergedHeaders, RedefinitionError, merge_headers
from armwright.program.repl.input import ParsedInput, parse_input, shift_diagnostic
from armwright.program.repl.session_text import header_title, program_text
from armwright.program.repl.undo_report import undone_lines
from armwright.program.semantics import check
from armwright.program.semantics.cell_symbols import ImportedFrames, ReadImport, known_cell
from armwright.program.semantics.symbols import Symbols
from armwright.program.syntax import tree
from armwright.program.vm.machine import Limits, Machine, RunError
from armwright.program.vm.recording import Effect

# Returns how a session names a file that it imports.
ImportPath: TypeAlias = Callable[[str], str]
# What a declaration is good for shows later than in a whole program.
_SUPPRESSED_CODES = ("L304",)
_NO_CELL = "no cell"


@attrs.frozen(kw_only=True, eq=False)
class SessionState:
    """Where a session has come to.

    Attributes:
        headers: declarations, units, imports and procedures.
        statements: done so far.
        spelling: how names are written, by key.
        symbols: what names stand for.
        cell: as programs are checked against it, without imported frames.
        machine: the cell, the values and the clock.
        text: what led here from the state before.
    """

    headers: tuple[tree.Header, ...] = ()
    statements: tuple[tree.Statement, ...] = ()
    spelling: Mapping[str, str] = attrs.field(factory=dict)
    symbols: Symbols
    cell: Cell
    machine: Machine
    text: str = ""


@attrs.frozen(kw_only=True)
class InputResult:
    """What came of an input.

    Attributes:
        is_complete: whether it was taken; otherwise it goes on in the next line, and nothing was done.
        effects: what was done and stays done, in order; the PRINT of a value that was asked for among them.
        diagnostics: what is wrong or odd.
        source: the text that they are about.
        remarks: what else is to be known, such as what an error took back.
        is_refused: whether there was nothing wrong with it but that the program has come to a HALT.
        has_failed: whether it was begun and could not go on.
    """

    is_complete: bool = True
    effects: tuple[Effect, ...] = ()
    diagnostics: tuple[Diagnostic, ...] = ()
    source: Source
    remarks: tuple[str, ...] = ()
    is_refused: bool = False
    has_failed: bool = False

    @property
    def is_wrong(self) -> bool:
        """Whether something in it could not be done."""
        return self.is_refused or any(diagnostic.is_error for diagnostic in self.diagnostics)

    @property
    def status(self) -> ExitStatus:
        """How a command ends with which nothing else was done."""
        if self.is_refused or self.has_failed:
            return ExitStatus.INFEASIBLE
        return ExitStatus.PROGRAM_ERRORS if self.is_wrong else ExitStatus.DONE

    @property
    def printed_lines(self) -> tuple[str, ...]:
        """The lines that were printed."""
        return tuple(str(effect.data["printed"]) for effect in self.effects if effect.kind == "PRINT")


@attrs.frozen(eq=False)
class _CheckedInput:
    """An input that can be done.

    Attributes:
        source: all that was entered so far.
        parsed: the input.
        merged_headers: its declarations together with those before.
        flow: the arms of its statements.
        state: that its declarations lead to, with the machine of the state before.
    """

    source: Source
    parsed: ParsedInput
    merged_headers: MergedHeaders
    flow: Flow
    state: SessionState

    def code(self, *statements: tree.Statement) -> Code:
        """Return the code of some statements, with all procedures."""
        end, state = _end_span(self.source), self.state
        program = tree.Program(end, state.headers, statements, end)
        return generate(self.source, program, state.symbols, self.flow, state.spelling)


class Session:
    """A program that is entered piece by piece, and the cell that it acts on."""

    def __init__(
        self,
        cell: Cell | None = None,
        std: Standard = Standard.RLO_2,
        read_import: ReadImport | None = None,
        *,
        name: str = "session",
        limits: Limits | None = None,
    ) -> None:
        """Begin in front of an empty program.

        Args:
            cell: in which it runs; without one there are only frames, until an IMPORT brings arms.
            std: the language.
            read_import: how to read what an IMPORT names.
            name: of the session in messages.
            limits: when a statement is taken to run for ever.
        """
        self.std, self.name = std, name
        self.limits = limits or Limits()
        # Each file counts as it was when it was first read.
        self._read_import = None if read_import is None else cache(read_import)
        self._text = ""
        cell = cell or Cell(name=_NO_CELL, arms={})
        empty = tree.Program(Span(0, 0), (), (), Span(0, 0))
        symbols, _, _ = check.check(empty, known_cell(cell), std=std)
        self._states = [
            SessionState(symbols=symbols, cell=cell, machine=snapshots.new_machine(cell, self.source, self.limits))
        ]
        self._index = 0

    # ---- what there is ---------------------------------------------------------------------------------------------

    @property
    def source(self) -> Source:
        """All that was entered so far."""
        return Source(self.name, self._text)

    @property
    def state(self) -> SessionState:
        """Where the session is."""
        return self._states[self._index]

    @property
    def line(self) -> int:
        """The number of the line that is entered next."""
        return self._text.count("\n") + 1

    def program(self, remark: str = "", import_path: ImportPath = str) -> str:
        """Return the session as a program that runs to the same end in the same cell.

        Args:
            remark: for its first line, if any.
            import_path: how it shall name a file that the session has imported.
        """
        headers, statements = self.state.headers, self.state.statements
        return program_text(self.source, headers, statements, self.std, remark=remark, import_path=import_path)

    # ---- back and forth --------------------------------------------------------------------------------------------

    def undo(self, count: int = 1) -> tuple[str, ...]:
        """Take back the last statements or declarations; return what they were, the last one first.

        Frames, values, arms, the clock, the devices and the answers of the camera are as they were before.
        """
        end = self._index + 1
        self._index -= min(count, self._index)
        return tuple(state.text for state in reversed(self._states[self._index + 1 : end]))

    def redo(self, count: int = 1) -> tuple[str, ...]:
        """Let what was taken back last be done again; return what it was, the first one first."""
        start = self._index + 1
        self._index = min(self._index + count, len(self._states) - 1)
        return tuple(state.text for state in self._states[start : self._index + 1])

    def _append_state(self, state: SessionState) -> None:
        self._states = [*self._states[: self._index + 1], state]
        self._index += 1

    # ---- entering --------------------------------------------------------------------------------------------------

    def skip_lines(self, text: str) -> None:
        """Count lines that say nothing to the cell, so that messages name the lines that people have seen."""
        self._text += text if text.endswith("\n") or not text else f"{text}\n"

    def enter(
        self, text: str, import_path: ImportPath = str, *, complete: bool = False, is_file: bool = False
    ) -> InputResult:
        """Take declarations, statements, or an expression whose value is to be shown.

        Args:
            text: an input; or its beginning, which is then given again with the next line behind it.
            import_path: how the session shall name a file that the input imports.
            complete: whether nothing more comes, so that what is missing is an error.
            is_file: whether it is the text of a file; elsewhere a number that begins a line may begin an expression.
        """
        start, symbols = len(self._text), self.state.symbols
        source = Source(self.name, self._text + (text if text.endswith("\n") else f"{text}\n"))
        entry = parse_input(
            source,
            start,
            self.std,
            names=symbols.types,
            procedures=symbols.procedures,
            functions=[key for key, procedure in symbols.procedures.items() if procedure.is_function],
            is_file=is_file,
        )
        if not (entry.is_complete or complete):
            return InputResult(is_complete=False, source=source)
        # Whatever becomes of it: the lines of the session keep their numbers.
        self._text = source.text
        try:
            checked, reported = self._check(source, start, entry, import_path)
        except RedefinitionError as refused:
            return InputResult(source=source, diagnostics=(refused.diagnostic,))
        if checked is None:
            return InputResult(source=source, diagnostics=reported)
        answer = self._execute(checked)
        remarks = (*checked.merged_headers.remarks, *answer.remarks)
        return attrs.evolve(answer, diagnostics=(*reported, *answer.diagnostics), remarks=remarks)

    def load(self, file: Source, import_path: ImportPath = str) -> InputResult:
        """Take the text of a file, such as a whole program; messages about it name its own lines.

        Args:
            file: its name and text.
            import_path: how the session shall name a file that this one imports.
        """
        start = len(self._text)
        answer = self.enter(file.text, import_path, complete=True, is_file=True)
        spans = [label.span for diagnostic in answer.diagnostics for label in diagnostic.secondary]
        spans += [diagnostic.span for diagnostic in answer.diagnostics]
        if any(span.start < start for span in spans):
            return answer
        own = tuple(shift_diagnostic(diagnostic, -start) for diagnostic in answer.diagnostics)
        return attrs.evolve(answer, source=file, diagnostics=own)

    # ---- checking --------------------------------------------------------------------------------------------------

    def _check(
        self, source: Source, start: int, entry: ParsedInput, import_path: ImportPath
    ) -> tuple[_CheckedInput | None, tuple[Diagnostic, ...]]:
        """Check an input together with all that came before it.

        Returns:
            What can be done, None if something is wrong; and what there is to say.
        """
        before = self.state
        fixed = {*before.machine.cell.frames, *before.cell.seen_frames, "STATION"}
        heading = merge_headers(
            before.headers, before.statements, entry, self.std, cell_names=fixed, import_path=import_path
        )
        spelling = {**entry.spelling, **before.spelling, **heading.spelling}
        end = _end_span(source)
        program = tree.Program(Span(0, end.end), heading.headers, (*heading.statements, *entry.statements), end)
        cell, symbols, wrong = self._check_names(program)
        diagnostics = [*entry.diagnostics, *wrong]
        flow = None
        if not any(diagnostic.is_syntax for diagnostic in diagnostics):
            flow, warnings = analysis.check(program, symbols, spelling, known_cell(cell), source=source)
            diagnostics += warnings
        new = (
            diagnostic
            for diagnostic in diagnostics
            if diagnostic.is_error or (diagnostic.span.start >= start and diagnostic.code not in _SUPPRESSED_CODES)
        )
        reported = sort_diagnostics(new)
        if flow is None or any(diagnostic.is_error for diagnostic in reported):
            return None, reported
        state = attrs.evolve(before, headers=heading.headers, statements=heading.statements)
        state = attrs.evolve(state, spelling=spelling, symbols=symbols, cell=cell)
        return _CheckedInput(source, entry, heading, flow, state), reported

    def _check_names(self, program: tree.Program) -> tuple[Cell, Symbols, list[Diagnostic]]:
        """Check names and types; where nothing was done yet, the arms of an imported cell are those of the session."""
        cell, read_import = self.state.cell, self._read_import
        symbols, diagnostics, imports = check.check(program, known_cell(cell), std=self.std, read_import=read_import)
        other = next((imported.cell for imported in imports if imported.cell and imported.cell.arms), None)
        if other is not None and not cell.arms and not self.state.statements:
            cell = other
            symbols, diagnostics, _ = check.check(program, known_cell(cell), std=self.std, read_import=read_import)
        return cell, symbols, diagnostics

    # ---- doing -----------------------------------------------------------------------------------------------------

    def _execute(self, checked: _CheckedInput) -> InputResult:
        """Declare what an input declares and run its statements, one after the other, up to one that fails."""
        source, entry = checked.source, checked.parsed
        if checked.state.headers != self.state.headers:
            self._declare(checked)
        answer = InputResult(source=source)
        effects: list[Effect] = []
        diagnostics: list[Diagnostic] = []
        for number, statement in enumerate(entry.statements):
            before, shown = self.state, statement.span.start in entry.printed_starts
            if before.machine.state.has_ended and not shown:
                remark = "the program has executed HALT; `:undo` restores the state before it"
                answer = InputResult(source=source, remarks=(remark,), is_refused=True)
                break
            machine = snapshots.load_code(before.machine, checked.code(statement), self.limits)
            machine.state.has_ended = False
            try:
                snapshots.run_statement(machine)
            except RunError as error:
                diagnostics.append(error.diagnostic)
                remarks = (*undone_lines(before.machine, machine), *_skipped_text(len(entry.statements) - number - 1))
                answer = InputResult(source=source, remarks=remarks, has_failed=True)
                break
            effects += machine.state.effects[len(before.machine.state.effects) :]
            diagnostics += snapshots.new_warnings(before.machine, machine)
            if not shown:
                text = " ".join(source.slice(statement.span).split())
                done = (*before.statements, statement)
                self._append_state(attrs.evolve(checked.state, machine=machine, statements=done, text=text))
        return attrs.evolve(answer, effects=tuple(effects), diagnostics=tuple(diagnostics))

    def _declare(self, checked: _CheckedInput) -> None:
        before, heading, source = self.state, checked.merged_headers, checked.source
        cell = checked.state.cell
        machine = before.machine.copy() if cell is before.cell else snapshots.new_machine(cell, source, self.limits)
        snapshots.rename_variables(machine, heading.new_names)
        snapshots.remove_unused(machine, heading.unused_names)
        for header in heading.imports:
            brought = None if self._read_import is None else self._read_import(header.path.value)
            imported = brought.cell if isinstance(brought, ImportedFrames) else None
            if imported is not None:
                snapshots.import_frames(machine, imported.frames, header.span)
        machine = snapshots.load_code(machine, checked.code(), self.limits)
        text = "; ".join(header_title(source, header) for header in checked.parsed.headers)
        self._append_state(attrs.evolve(checked.state, machine=machine, text=text))


def _end_span(source: Source) -> Span:
    return Span(len(source.text) - 1, len(source.text) - 1)


def _skipped_text(count: int) -> list[str]:
    return [f"not executed: the {f'{count} statements' if count > 1 else 'statement'} after it"] if count else []
