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
from armwright.program.language.diagnostic import Diagnostic, in_order
from armwright.program.language.source import Source, Span
from armwright.program.language.words import Standard
from armwright.program.repl.declarations import Heading, NotNowError, merged
from armwright.program.repl.input import Entry, moved, read
from armwright.program.repl.session_text import program_text, title
from armwright.program.repl.snapshots import bring, forget, fresh, go_through, new_warnings, rename, with_code
from armwright.program.repl.undo_report import SILENT, taken_back
from armwright.program.semantics import check
from armwright.program.semantics.cell_symbols import ReadImport, known_cell
from armwright.program.semantics.symbols import Symbols
from armwright.program.syntax import tree
from armwright.program.vm.machine import Limits, Machine, RunError
from armwright.program.vm.recording import Effect

# Returns how a session names a file that it imports.
PathOf: TypeAlias = Callable[[str], str]
# What a declaration is good for shows later than in a whole program.
_TOO_EARLY = ("L304",)
_NO_CELL = "no cell"


@attrs.frozen(kw_only=True, eq=False)
class State:
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
class Answer:
    """What came of an input.

    Attributes:
        complete: whether it was taken; otherwise it goes on in the next line, and nothing was done.
        effects: what was done and stays done, in order; the PRINT of a value that was asked for among them.
        diagnostics: what is wrong or odd.
        source: the text that they are about.
        remarks: what else is to be known, such as what an error took back.
        refused: whether there was nothing wrong with it but that the program has come to a HALT.
        failed: whether it was begun and could not go on.
    """

    complete: bool = True
    effects: tuple[Effect, ...] = ()
    diagnostics: tuple[Diagnostic, ...] = ()
    source: Source
    remarks: tuple[str, ...] = ()
    refused: bool = False
    failed: bool = False

    @property
    def is_wrong(self) -> bool:
        """Whether something in it could not be done."""
        return self.refused or any(diagnostic.is_error for diagnostic in self.diagnostics)

    @property
    def status(self) -> ExitStatus:
        """How a command ends with which nothing else was done."""
        if self.refused or self.failed:
            return ExitStatus.INFEASIBLE
        return ExitStatus.PROGRAM_ERRORS if self.is_wrong else ExitStatus.DONE

    @property
    def printed(self) -> tuple[str, ...]:
        """The lines that were printed."""
        return tuple(str(effect.data["printed"]) for effect in self.effects if effect.kind == "PRINT")

    @property
    def trace(self) -> tuple[str, ...]:
        """The lines of the trace, printed ones aside."""
        return tuple(effect.text for effect in self.effects if effect.kind not in (*SILENT, "PRINT"))


@attrs.frozen(eq=False)
class _Checked:
    """An input that can be done.

    Attributes:
        source: all that was entered so far.
        entry: the input.
        heading: its declarations together with those before.
        flow: the arms of its statements.
        state: that its declarations lead to, with the machine of the state before.
    """

    source: Source
    entry: Entry
    heading: Heading
    flow: Flow
    state: State

    def code(self, *statements: tree.Statement) -> Code:
        """Return the code of some statements, with all procedures."""
        end, state = _end(self.source), self.state
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
        self._states = [State(symbols=symbols, cell=cell, machine=fresh(cell, self.source, self.limits))]
        self._at = 0

    # ---- what there is ---------------------------------------------------------------------------------------------

    @property
    def source(self) -> Source:
        """All that was entered so far."""
        return Source(self.name, self._text)

    @property
    def state(self) -> State:
        """Where the session is."""
        return self._states[self._at]

    @property
    def line(self) -> int:
        """The number of the line that is entered next."""
        return self._text.count("\n") + 1

    def program(self, remark: str = "", path_of: PathOf = str) -> str:
        """Return the session as a program that runs to the same end in the same cell.

        Args:
            remark: for its first line, if any.
            path_of: how it shall name a file that the session has imported.
        """
        headers, statements = self.state.headers, self.state.statements
        return program_text(self.source, headers, statements, self.std, remark=remark, path_of=path_of)

    # ---- back and forth --------------------------------------------------------------------------------------------

    def undo(self, count: int = 1) -> tuple[str, ...]:
        """Take back the last statements or declarations; return what they were, the last one first.

        Frames, values, arms, the clock, the devices and the answers of the camera are as they were before.
        """
        end = self._at + 1
        self._at -= min(count, self._at)
        return tuple(state.text for state in reversed(self._states[self._at + 1 : end]))

    def redo(self, count: int = 1) -> tuple[str, ...]:
        """Let what was taken back last be done again; return what it was, the first one first."""
        start = self._at + 1
        self._at = min(self._at + count, len(self._states) - 1)
        return tuple(state.text for state in self._states[start : self._at + 1])

    def _go_on(self, state: State) -> None:
        self._states = [*self._states[: self._at + 1], state]
        self._at += 1

    # ---- entering --------------------------------------------------------------------------------------------------

    def pass_over(self, text: str) -> None:
        """Count lines that say nothing to the cell, so that messages name the lines that people have seen."""
        self._text += text if text.endswith("\n") or not text else f"{text}\n"

    def enter(self, text: str, path_of: PathOf = str, *, complete: bool = False, is_file: bool = False) -> Answer:
        """Take declarations, statements, or an expression whose value is to be shown.

        Args:
            text: an input; or its beginning, which is then given again with the next line behind it.
            path_of: how the session shall name a file that the input imports.
            complete: whether nothing more comes, so that what is missing is an error.
            is_file: whether it is the text of a file; elsewhere a number that begins a line may begin an expression.
        """
        start, symbols = len(self._text), self.state.symbols
        source = Source(self.name, self._text + (text if text.endswith("\n") else f"{text}\n"))
        entry = read(source, start, self.std, names=symbols.types, procedures=symbols.procedures, is_file=is_file)
        if not (entry.complete or complete):
            return Answer(complete=False, source=source)
        # Whatever becomes of it: the lines of the session keep their numbers.
        self._text = source.text
        try:
            checked, reported = self._check(source, start, entry, path_of)
        except NotNowError as refused:
            return Answer(source=source, diagnostics=(refused.diagnostic,))
        if checked is None:
            return Answer(source=source, diagnostics=reported)
        answer = self._do(checked)
        remarks = (*checked.heading.remarks, *answer.remarks)
        return attrs.evolve(answer, diagnostics=(*reported, *answer.diagnostics), remarks=remarks)

    def load(self, file: Source, path_of: PathOf = str) -> Answer:
        """Take the text of a file, such as a whole program; messages about it name its own lines.

        Args:
            file: its name and text.
            path_of: how the session shall name a file that this one imports.
        """
        start = len(self._text)
        answer = self.enter(file.text, path_of, complete=True, is_file=True)
        spans = [label.span for diagnostic in answer.diagnostics for label in diagnostic.secondary]
        spans += [diagnostic.span for diagnostic in answer.diagnostics]
        if any(span.start < start for span in spans):
            return answer
        own = tuple(moved(diagnostic, -start) for diagnostic in answer.diagnostics)
        return attrs.evolve(answer, source=file, diagnostics=own)

    # ---- checking --------------------------------------------------------------------------------------------------

    def _check(
        self, source: Source, start: int, entry: Entry, path_of: PathOf
    ) -> tuple[_Checked | None, tuple[Diagnostic, ...]]:
        """Check an input together with all that came before it.

        Returns:
            What can be done, None if something is wrong; and what there is to say.
        """
        before = self.state
        fixed = {*before.machine.cell.frames, *before.cell.visions, "STATION"}
        heading = merged(before.headers, before.statements, entry, self.std, fixed=fixed, path_of=path_of)
        spelling = {**entry.spelling, **before.spelling, **heading.spelling}
        end = _end(source)
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
            if diagnostic.is_error or (diagnostic.span.start >= start and diagnostic.code not in _TOO_EARLY)
        )
        reported = in_order(new)
        if flow is None or any(diagnostic.is_error for diagnostic in reported):
            return None, reported
        state = attrs.evolve(before, headers=heading.headers, statements=heading.statements)
        state = attrs.evolve(state, spelling=spelling, symbols=symbols, cell=cell)
        return _Checked(source, entry, heading, flow, state), reported

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

    def _do(self, checked: _Checked) -> Answer:
        """Declare what an input declares and run its statements, one after the other, up to one that fails."""
        source, entry = checked.source, checked.entry
        if checked.state.headers != self.state.headers:
            self._declare(checked)
        answer = Answer(source=source)
        effects: list[Effect] = []
        diagnostics: list[Diagnostic] = []
        for number, statement in enumerate(entry.statements):
            before, shown = self.state, statement.span.start in entry.shown
            if before.machine.state.has_ended and not shown:
                remark = "the program has executed HALT; `:undo` restores the state before it"
                answer = Answer(source=source, remarks=(remark,), refused=True)
                break
            machine = with_code(before.machine, checked.code(statement), self.limits)
            machine.state.has_ended = False
            try:
                go_through(machine)
            except RunError as error:
                diagnostics.append(error.diagnostic)
                remarks = (*taken_back(before.machine, machine), *_left(len(entry.statements) - number - 1))
                answer = Answer(source=source, remarks=remarks, failed=True)
                break
            effects += machine.state.effects[len(before.machine.state.effects) :]
            diagnostics += new_warnings(before.machine, machine)
            if not shown:
                text = " ".join(source.slice(statement.span).split())
                done = (*before.statements, statement)
                self._go_on(attrs.evolve(checked.state, machine=machine, statements=done, text=text))
        return attrs.evolve(answer, effects=tuple(effects), diagnostics=tuple(diagnostics))

    def _declare(self, checked: _Checked) -> None:
        before, heading, source = self.state, checked.heading, checked.source
        cell = checked.state.cell
        machine = before.machine.copy() if cell is before.cell else fresh(cell, source, self.limits)
        rename(machine, heading.renamed)
        forget(machine, heading.dropped)
        for header in heading.imports:
            imported = None if self._read_import is None else self._read_import(header.path.value).cell
            if imported is not None:
                bring(machine, imported.frames, header.span)
        machine = with_code(machine, checked.code(), self.limits)
        text = "; ".join(title(source, header) for header in checked.entry.headers)
        self._go_on(attrs.evolve(checked.state, machine=machine, text=text))


def _end(source: Source) -> Span:
    return Span(len(source.text) - 1, len(source.text) - 1)


def _left(count: int) -> list[str]:
    if not count:
        return []
    return [f"not executed: the {count} statements after it" if count > 1 else "not executed: the statement after it"]
