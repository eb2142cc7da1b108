"""The context of the checks: the names of the program, its calls, and the part of it that contains a statement."""

from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

import attrs

from armwright.program.language.source import Span
from armwright.program.semantics.calls import CallChecker
from armwright.program.semantics.scopes import NameResolver
from armwright.program.semantics.symbols import ProcedureSymbols
from armwright.program.syntax import tree

Check: TypeAlias = Callable[["Context", Any], None]
Checks: TypeAlias = Mapping[type, Check]


@attrs.define
class Context:
    """The walk over the statements of a program or procedure.

    Attributes:
        checks: of each kind of statement.
        names: of the program, and the diagnostics so far.
        calls: the checks of calls.
        procedure: the one that contains the statements; None for the main program.
        recovering: whether a RECOVER part contains them, so that RETRY can restart its TRY.
        watches: the WHENs with a name in the stretches of statements around them.
        queues: by arm, the QUEUEs around them.
        interrupting: whether they are the action of a WHEN, or may be called by one.
    """

    checks: Checks
    names: NameResolver
    calls: CallChecker
    procedure: ProcedureSymbols | None = None
    recovering: bool = False
    watches: dict[str, tree.When] = attrs.field(factory=dict)
    interrupting: bool = False
    queues: dict[str, tree.Queue] = attrs.field(factory=dict)

    def check_list(self, *statements: tree.Statement) -> None:
        """Check a stretch of statements, at whose end its WHENs are disarmed."""
        outside, self.watches = self.watches, dict(self.watches)
        self.check(*statements)
        self.watches = outside

    def check(self, *statements: tree.Statement) -> None:
        """Check statements, one after the other."""
        for statement in statements:
            self.checks[type(statement)](self, statement)

    def check_with(self, *statements: tree.Statement, recovering: bool) -> None:
        """Check statements of a RECOVER part, or others: concurrent ones cannot RETRY the TRY around them."""
        outside, self.recovering = self.recovering, recovering
        self.check(*statements)
        self.recovering = outside

    def note_change(self, node: tree.Expression, span: Span) -> None:
        """Note that a statement changes a variable, which may be a parameter."""
        self.calls.note_change(node, self.procedure, span)
