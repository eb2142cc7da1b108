"""Name resolution: what a name stands for where it is used, and each thing that is wrong with it reported once."""

from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import contextmanager
from typing import Unpack

from armwright.errors import closest
from armwright.program.language.diagnostic import Details, DiagnosticList, Label, did_you_mean
from armwright.program.language.kinds import VariableType
from armwright.program.language.source import Span
from armwright.program.language.words import FUNCTIONS_OF_NAMES, Standard
from armwright.program.semantics.cell_symbols import ImportedFrames, KnownCell
from armwright.program.semantics.expression_types import ExpressionType, quote_expression, type_texts, variable_keys
from armwright.program.semantics.symbols import PREDECLARED, ProcedureSymbols, Scope, Symbols, SymbolTable
from armwright.program.syntax import tree

# Looking for what a name was meant to be takes time; a program that goes on like this gets no more advice.
_MAX_COMPARISONS = 20_000
_EVENT_NOTE = "an EVENT counts signals; SIGNAL adds one, WAIT takes one"


class NameResolver:
    """The names of a program as its statements see them, and the diagnostics of the checks so far."""

    def __init__(self, cell: KnownCell | None, std: Standard = Standard.RLO_2) -> None:
        """Start with the predeclared names."""
        self.diagnostics = DiagnosticList()
        self.report = self.diagnostics.report
        self.symbols = Symbols(types=dict(PREDECLARED), std=std)
        self.imports: list[ImportedFrames] = []
        self.cell = cell
        # The kinds of errors that the program raises, as it first spells them, and those that its RECOVERs name.
        self.raised: dict[str, str] = {}
        self.recovered: list[tree.Name] = []
        # The timers that the program starts or sets, and where it reads one.
        self.timers: set[str] = set()
        self.timers_read: list[tree.Name] = []
        # Of each log, in lower case, the statement that first writes it.
        self.logs: dict[str, tree.Log] = {}
        self.scope = Scope(symbols=self.symbols)
        self._called: set[str] = set()
        self._reported: set[tuple[str, int, str]] = set()
        self._comparisons = 0
        self._undeclared_names: set[str] = set()

    @contextmanager
    def enter_procedure(self, procedure: ProcedureSymbols) -> Iterator[None]:
        """Look names up as the statements of a procedure see them."""
        self.scope = Scope(symbols=self.symbols, procedure=procedure)
        yield
        self.scope = Scope(symbols=self.symbols)

    # ---- looking up ------------------------------------------------------------------------------------------------

    def type(self, name: tree.Name) -> VariableType | None:
        """Return the type of a variable, None where that is unknown; report a name once that is not declared."""
        key = name.key
        table = self.scope.table(key)
        table.used.add(key)
        if key not in table.types:
            # Apart from the types: whoever looks for what a name was meant to be goes through all of those.
            if not self.symbols.open_import and key not in self._undeclared_names:
                self._report_undeclared(name)
            self._undeclared_names.add(key)
            table.poisoned.add(key)
        return None if key in table.poisoned else table.types[key]

    def mark_used(self, keys: Iterable[str]) -> None:
        """Note that names are used."""
        for key in keys:
            self.scope.table(key).used.add(key)
            self._called.add(key)

    def poison(self, *keys: str) -> None:
        """Report nothing more of names."""
        for key in keys:
            self.scope.table(key).poisoned.add(key)

    def resolve_call(self, key: str) -> ProcedureSymbols | None:
        """Return a procedure; a call from within itself does not count as use."""
        procedure, around = self.symbols.procedures.get(key), self.scope.procedure
        if procedure is not None and (around is None or around.node.name.key != key):
            self._called.add(key)
        return procedure

    def is_first_report(self, code: str, *keys: str) -> bool:
        """Whether a diagnostic of this code is news of any of these names; it is where there are none."""
        news = {(code, id(self.scope.table(key)), key) for key in keys} - self._reported
        self._reported |= news
        return bool(news) or not keys

    # ---- messages --------------------------------------------------------------------------------------------------

    def report_once(
        self, code: str, message: str, span: Span, label: str, keys: Collection[str], **details: Unpack[Details]
    ) -> None:
        """Report what is wrong with variables where this is news of any of them, pointing at their declarations."""
        if self.is_first_report(code, *keys):
            details.setdefault("secondary", self.declaration_labels(*dict.fromkeys(keys)))
            self.report(code, message, span, label, **details)

    def report_type(
        self, code: str, node: tree.Expression, actual: ExpressionType, required: str, **details: Unpack[Details]
    ) -> None:
        """Report that an expression is of another type than is required; ``required`` begins the message."""
        phrase, label = type_texts(node, actual)
        details.setdefault("secondary", self.declaration_labels(*variable_keys(node)))
        self.report(code, f"{required}, but {quote_expression(node)} is {phrase}", node.span, label, **details)

    def report_event(self, node: tree.Expression, use: str = "computed with") -> None:
        """Report once that an EVENT has no value that could be used."""
        text = f"{quote_expression(node)} is an EVENT and cannot be {use}"
        self.report_once("E223", text, node.span, "EVENT", variable_keys(node), note=_EVENT_NOTE)

    def declaration_labels(self, *keys: str) -> tuple[Label, ...]:
        """Return labels on the declarations of names that have one."""
        return self.scope.declaration_labels(*keys)

    def arm_names(self) -> list[str]:
        """Return the arms there are, as far as is known; at least one."""
        arms = set(self.cell.arms) if self.cell else set()
        for brought in self.imports:
            arms |= set(brought.cell.arms) if brought.cell else set()
        return sorted(arms) or ["ARM_1"]

    def visible_names(self) -> list[str]:
        """Return the variables that can be seen here, as they were declared."""
        tables = (table for table in (self.scope.procedure, self.symbols) if table is not None)
        known = ((table.declared.get(key), key, kind) for table in tables for key, kind in table.types.items())
        return [name.text if name else key for name, key, kind in known if name or kind]

    def closest_name(self, text: str, known: Callable[[], Collection[str]]) -> str | None:
        """Return what a name was probably meant to be; None where nothing is near, or too much was asked.

        Args:
            text: what was written.
            known: gives what could have been meant.
        """
        if self._comparisons > _MAX_COMPARISONS:
            return None
        choices = known()
        self._comparisons += len(choices)
        return closest(text, choices)

    # ---- at the end ------------------------------------------------------------------------------------------------

    def report_unused(self, exported: Collection[str] = ()) -> None:
        """Report names that are declared and never used, and that no other program may use."""
        self._report_unused_names(self.symbols, exported)
        for key, procedure in self.symbols.procedures.items():
            name = procedure.node.name
            if key not in self._called and key not in exported:
                self.report("L304", f"procedure `{name.text}` is never called", name.span, "declared here")
            self._report_unused_names(procedure)

    def _report_unused_names(self, table: SymbolTable, exported: Collection[str] = ()) -> None:
        for key, name in table.declared.items():
            # Of a record single fields may be unused.
            is_record = "." in key
            if key not in table.used and key not in exported and not is_record and table.types[key] is not None:
                self.report("L304", f"`{name.text}` is never used", name.span, "declared here")

    def _declaring_procedure(self, key: str) -> ProcedureSymbols | None:
        """Return a procedure that has a name of its own like this."""
        if self._comparisons > _MAX_COMPARISONS:
            return None
        self._comparisons += len(self.symbols.procedures)
        return next((procedure for procedure in self.symbols.procedures.values() if key in procedure.types), None)

    def _report_undeclared(self, name: tree.Name) -> None:
        note, advice = "", "declare it in the VAR part"
        if (procedure := self.symbols.procedures.get(name.key)) is not None:
            kind = "FUNCTION" if procedure.is_function else "procedure"
            call = f"{name.text}({'...' if procedure.parameters else ''})"
            advice = f"a procedure is called by a statement of its own: `{call}`"
            if procedure.is_function:
                advice = f"the call of a FUNCTION has parentheses: `{call}`"
            self.report("E227", f"`{name.text}` is a {kind} and no variable", name.span, f"a {kind}", advice=advice)
            return
        if not name.text.isascii():
            # The scanner has reported it.
            return
        frames = self.cell.frames if self.cell is not None else {}
        if name.key in frames:
            advice = f"the cell has a frame of this name: declare it with `VAR {name.text} : FRAME ;`"
        elif name.key in FUNCTIONS_OF_NAMES:
            advice = f"this is a function: write `{name.text}(...)`"
        elif near := self.closest_name(name.text, lambda: [*self.visible_names(), *self.arm_names()]):
            advice = did_you_mean(near)
        elif near := self.closest_name(name.text, lambda: [key for key in frames if key not in self.symbols.types]):
            advice = f"did you mean `{near}`, a frame of the cell? Declare it with `VAR {near} : FRAME ;`"
        elif (owner := self._declaring_procedure(name.key)) is not None:
            note = f"procedure `{owner.node.name.text}` declares this name, which is visible only there"
        self.report("E202", f"`{name.text}` is not declared", name.span, "unknown name", note=note, advice=advice)
