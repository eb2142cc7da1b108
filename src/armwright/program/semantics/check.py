"""Names and types: every name declared once and used as what it is; clauses that go together; values in range."""

from collections.abc import Callable

from armwright.program.language.diagnostic import Diagnostic
from armwright.program.language.words import Standard
from armwright.program.semantics import headers, move, simple_statements
from armwright.program.semantics.calls import Calls
from armwright.program.semantics.cell_symbols import Imported, KnownCell, ReadImport
from armwright.program.semantics.expression_types import Sort
from armwright.program.semantics.quantities import in_range, measure
from armwright.program.semantics.scopes import Names, Procedure
from armwright.program.semantics.symbols import Symbols
from armwright.program.semantics.type_check import condition, need, quantity, sort
from armwright.program.syntax import tree


def check(
    program: tree.Program,
    cell: KnownCell | None = None,
    *,
    std: Standard = Standard.RLO_2,
    read_import: ReadImport | None = None,
) -> tuple[Symbols, list[Diagnostic], tuple[Imported, ...]]:
    """Look at names, types, clauses and values.

    Args:
        program: as the parser gave it, errors of syntax included.
        cell: what the program will act on, if that is known.
        std: the language it is written in.
        read_import: gives what the file of an IMPORT holds, and raises an ArmwrightError when it cannot be read;
            without it nothing is looked up.

    Returns:
        The names of the program, what is wrong, and what was imported.
    """
    names = Names(cell, std)
    procedures = headers.declare(names, program, read_import)
    calls = Calls(names)
    for procedure in procedures:
        with names.inside(procedure):
            _Statements(names, calls, procedure).all(procedure.node.body.statements)
    _Statements(names, calls, None).all(program.statements)
    calls.finish()
    names.unused()
    return names.symbols, names.found, tuple(names.imports)


class _Statements:
    """Checks statements, one inside the other."""

    def __init__(self, names: Names, calls: Calls, inside: Procedure | None) -> None:
        """Start outside of any RECOVER."""
        self._names, self._calls, self._inside = names, calls, inside
        self._recovering = False
        self._checks: dict[type, Callable[..., None]] = {
            tree.Assign: self._assign,
            tree.Affix: self._affix,
            tree.Unfix: self._unfix,
            tree.Open: self._open,
            tree.Grasp: lambda node: simple_statements.arm(names, node.arm, "GRASP"),
            tree.Operate: lambda node: simple_statements.operate(names, node),
            tree.ReadVisions: self._read_visions,
            tree.ReadSystem: lambda node: simple_statements.arm(names, node.arm, "READ SYSTEM"),
            tree.Move: self._move,
            tree.Block: lambda node: self.all(node.statements),
            tree.If: self._if,
            tree.While: self._while,
            tree.Repeat: self._repeat,
            tree.For: self._for,
            tree.Cobegin: self._cobegin,
            tree.Signal: lambda node: simple_statements.event(names, node.event, "SIGNAL"),
            tree.Wait: lambda node: simple_statements.event(names, node.event, "WAIT"),
            tree.Pause: self._pause,
            tree.Lock: self._lock,
            tree.Try: self._try,
            tree.Retry: self._retry,
            tree.Halt: lambda _: None,
            tree.Print: lambda node: simple_statements.show(names, node),
            tree.Call: lambda node: calls.check(node, inside),
            tree.Poison: lambda node: names.mention(node.names),
        }

    def all(self, statements: tuple[tree.Statement, ...]) -> None:
        """Check several, one after the other."""
        for statement in statements:
            self._checks[type(statement)](statement)

    def one(self, statement: tree.Statement) -> None:
        """Check one statement."""
        self._checks[type(statement)](statement)

    # ---- frames, tools, sensors, motion ----------------------------------------------------------------------------

    def _assign(self, node: tree.Assign) -> None:
        self._calls.changes(node.target, self._inside, node.span)
        simple_statements.assign(self._names, node)

    def _affix(self, node: tree.Affix) -> None:
        self._calls.changes(node.child, self._inside, node.link)
        if node.rigid:
            self._calls.changes(node.parent, self._inside, node.link)
        simple_statements.affix(self._names, node)

    def _unfix(self, node: tree.Unfix) -> None:
        self._calls.changes(node.child, self._inside, node.span)
        simple_statements.child(self._names, node.child, "UNFIX cuts", "unfixed")
        if node.parent is not None:
            need(self._names, node.parent, Sort.FRAME, "E215", "FROM needs a FRAME or an arm")

    def _open(self, node: tree.Open) -> None:
        simple_statements.arm(self._names, node.arm, "OPEN")
        if node.width is not None and quantity(self._names, node.width, "length", "OPEN ... TO needs a width"):
            in_range(self._names, node.width, "a width", zero=True)

    def _read_visions(self, node: tree.ReadVisions) -> None:
        for target in node.targets:
            self._calls.changes(target, self._inside, node.span)
            simple_statements.vision(self._names, target)

    def _move(self, node: tree.Move) -> None:
        move.check(self._names, node)
        for clause in node.clauses:
            if isinstance(clause, tree.On):
                condition(self._names, clause.condition, "ON")
                self._apart(clause.action)

    # ---- control ---------------------------------------------------------------------------------------------------

    def _if(self, node: tree.If) -> None:
        chain, otherwise = node.chain
        for one in chain:
            condition(self._names, one.condition, "IF")
            self.one(one.then)
        if otherwise is not None:
            self.one(otherwise)

    def _while(self, node: tree.While) -> None:
        condition(self._names, node.condition, "WHILE")
        self.one(node.body)

    def _repeat(self, node: tree.Repeat) -> None:
        self.all(node.body)
        condition(self._names, node.condition, "UNTIL")

    def _for(self, node: tree.For) -> None:
        simple_statements.count(self._names, node)
        self.one(node.body)

    def _cobegin(self, node: tree.Cobegin) -> None:
        for branch in node.branches:
            if branch.priority is not None:
                measure(self._names, branch.priority, None, "a priority has no unit")
            self._apart(branch.body)

    def _pause(self, node: tree.Pause) -> None:
        if quantity(self._names, node.duration, "time", "PAUSE needs a time"):
            in_range(self._names, node.duration, "a pause", zero=True)

    def _lock(self, node: tree.Lock) -> None:
        for target in node.targets:
            # What is shared may be of any kind, and a whole array too.
            if isinstance(target, tree.Name):
                self._names.type(target)
            else:
                sort(self._names, target)
        self.one(node.body)

    def _try(self, node: tree.Try) -> None:
        # An error in a RECOVER part goes outward: a TRY inside of it has a RECOVER of its own.
        outside, self._recovering = self._recovering, False
        self.all(node.body)
        self._recovering = True
        self.all(node.recovery)
        self._recovering = outside

    def _retry(self, node: tree.Retry) -> None:
        if not self._recovering:
            self._names.found.say(
                "E225",
                "RETRY stands outside of RECOVER",
                node.span,
                "retry what?",
                notes=("RETRY runs the TRY part again to whose RECOVER it belongs",),
                helps=("write `TRY ... RECOVER ... RETRY END`",),
            )

    def _apart(self, statement: tree.Statement) -> None:
        """Check what runs beside the statements around it: it cannot start their TRY again."""
        outside, self._recovering = self._recovering, False
        self.one(statement)
        self._recovering = outside
