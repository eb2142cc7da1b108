"""Looking names up: what is known of them so far, and speaking once of each that is not what it should be."""

from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import contextmanager

from armwright.errors import closest
from armwright.program.language.diagnostic import DiagnosticList, Label, did_you_mean
from armwright.program.language.kinds import VariableType
from armwright.program.language.words import Standard
from armwright.program.semantics.cell_symbols import ImportedFrames, KnownCell
from armwright.program.semantics.symbols import PREDECLARED, ProcedureSymbols, Scope, Symbols, SymbolTable
from armwright.program.syntax import tree

# Looking for what a name was meant to be takes time; a program that goes on like this gets no more advice.
_MAX_COMPARISONS = 20_000


class NameResolver:
    """What is known of the names so far, and what has been found."""

    def __init__(self, cell: KnownCell | None, std: Standard = Standard.RLO_2) -> None:
        """Start with the predeclared names."""
        self.diagnostics = DiagnosticList()
        self.report = self.diagnostics.report
        self.symbols = Symbols(types=dict(PREDECLARED), std=std)
        self.imports: list[ImportedFrames] = []
        self.cell = cell
        # Whether some IMPORT was not looked up, so that any name may be that of a frame in it.
        self.open_import = False
        self._scope = Scope(symbols=self.symbols)
        self._called: set[str] = set()
        self._reported: set[tuple[str, int, str]] = set()
        self._comparisons = 0
        self._undeclared_names: set[str] = set()

    @contextmanager
    def enter_procedure(self, procedure: ProcedureSymbols) -> Iterator[None]:
        """Look names up as the statements of a procedure see them."""
        self._scope = Scope(symbols=self.symbols, procedure=procedure)
        yield
        self._scope = Scope(symbols=self.symbols)

    # ---- looking up ------------------------------------------------------------------------------------------------

    def type(self, name: tree.Name) -> VariableType | None:
        """Return what a name stands for; say once when it is not declared. None where that is unknown."""
        key = name.key
        table = self._scope.table(key)
        table.used.add(key)
        if key not in table.types:
            # Apart from the types: whoever looks for what a name was meant to be goes through all of those.
            if not self.open_import and key not in self._undeclared_names:
                self._report_undeclared(name)
            self._undeclared_names.add(key)
            table.poisoned.add(key)
        return None if key in table.poisoned else table.types[key]

    def type_of_key(self, key: str) -> VariableType | None:
        """Return what a name stands for, without asking anything of it."""
        return self._scope.type(key)

    def mark_used(self, keys: Iterable[str]) -> None:
        """Take note that names are used."""
        for key in keys:
            self._scope.table(key).used.add(key)
            self._called.add(key)

    def mark_skipped(self, keys: Iterable[str]) -> None:
        """Take note of names in a part of the program that is passed over: used, and nothing is asked of them."""
        for key in keys:
            self._scope.table(key).used.add(key)
            self._called.add(key)
            self.poison(key)

    def poison(self, key: str) -> None:
        """Ask nothing more of a name."""
        self._scope.table(key).poisoned.add(key)

    def is_poisoned(self, key: str) -> bool:
        """Whether nothing more is asked of a name."""
        return self._scope.is_poisoned(key)

    def resolve_call(self, key: str) -> ProcedureSymbols | None:
        """Return a procedure; a call from within itself does not count as use."""
        procedure, around = self.symbols.procedures.get(key), self._scope.procedure
        if procedure is not None and (around is None or around.node.name.key != key):
            self._called.add(key)
        return procedure

    def is_first_report(self, code: str, *keys: str) -> bool:
        """Whether a diagnostic of this code is news of any of these names; it is where there are none."""
        news = {(code, id(self._scope.table(key)), key) for key in keys} - self._reported
        self._reported |= news
        return bool(news) or not keys

    # ---- words for messages ----------------------------------------------------------------------------------------

    def declaration_labels(self, *keys: str) -> tuple[Label, ...]:
        """Return labels on the declarations of names that have one."""
        return tuple(label for key in keys for label in self._scope.declaration_labels(key))

    def arm_names(self) -> list[str]:
        """Return the arms there are, as far as is known; at least one."""
        arms = set(self.cell.arms) if self.cell else set()
        for brought in self.imports:
            arms |= set(brought.cell.arms) if brought.cell else set()
        return sorted(arms) or ["ARM_1"]

    def visible_names(self) -> list[str]:
        """Return the variables that can be seen here, as they were declared."""
        own = self._scope.procedure
        tables: list[SymbolTable] = [self.symbols] if own is None else [own, self.symbols]
        return [
            table.declared[key].text if key in table.declared else key
            for table in tables
            for key in table.types
            if key in table.declared or table.types[key] is not None
        ]

    def _undeclared_cell_frames(self) -> list[str]:
        """Return the frames that the cell has and the program has not."""
        return [] if self.cell is None else [name for name in self.cell.frames if name not in self.symbols.types]

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

    def report_unused(self) -> None:
        """Point at names that are declared and never used."""
        self._report_unused_names(self.symbols)
        for key, procedure in self.symbols.procedures.items():
            name = procedure.node.name
            if key not in self._called:
                self._report_unused_name(f"procedure `{name.text}` is never called", name)
            self._report_unused_names(procedure)

    def _report_unused_names(self, table: SymbolTable) -> None:
        for key, name in table.declared.items():
            if key not in table.used and table.types[key] is not None:
                self._report_unused_name(f"`{name.text}` is never used", name)

    def _report_unused_name(self, message: str, name: tree.Name) -> None:
        self.report("L304", message, name.span, "declared here")

    def _declaring_procedure(self, key: str) -> ProcedureSymbols | None:
        """Return a procedure that has a name of its own like this."""
        if self._comparisons > _MAX_COMPARISONS:
            return None
        self._comparisons += len(self.symbols.procedures)
        return next((procedure for procedure in self.symbols.procedures.values() if key in procedure.types), None)

    def _report_undeclared(self, name: tree.Name) -> None:
        note, advice = "", "declare it in the VAR part"
        if name.key in self.symbols.procedures:
            text = f"`{name.text}` is a procedure and no variable"
            help_ = f"a procedure is called by a statement of its own: `{name.text}(...)`"
            self.report("E227", text, name.span, "a procedure", advice=help_)
            return
        if not name.text.isascii():
            # Told of as a name that cannot be one.
            return
        if self.cell is not None and name.key in self.cell.frames:
            advice = f"the cell has a frame of this name: declare it with `VAR {name.text} : FRAME ;`"
        elif near := self.closest_name(name.text, lambda: [*self.visible_names(), *self.arm_names()]):
            advice = did_you_mean(near)
        elif near := self.closest_name(name.text, self._undeclared_cell_frames):
            advice = f"did you mean `{near}`, a frame of the cell? Declare it with `VAR {near} : FRAME ;`"
        elif (owner := self._declaring_procedure(name.key)) is not None:
            note = f"procedure `{owner.node.name.text}` declares this name, which is visible only there"
        self.report("E202", f"`{name.text}` is not declared", name.span, "unknown name", note=note, advice=advice)
