"""The context of the analysis: the abstract state, and the walk over statements and paths."""

from collections.abc import Callable, Mapping
from typing import Any, TypeAlias, TypeVar

import attrs

from armwright.program.flow_analysis.calls import CallAnalysis
from armwright.program.flow_analysis.facts import Divergence
from armwright.program.flow_analysis.lattice import Outcome
from armwright.program.flow_analysis.side_effects import SideEffects, walk_statements
from armwright.program.flow_analysis.state import FlowState
from armwright.program.syntax import tree

Node = TypeVar("Node", bound=tree.Statement)
Step: TypeAlias = Callable[["Context", Any], None]
Steps: TypeAlias = Mapping[type, Step]

# Deepest nesting that is analysed; statements inside it only invalidate facts.
_MAX_DEPTH = 100


def of_state(change: Callable[[FlowState, Node], None]) -> Callable[["Context", Node], None]:
    """Return the step of a statement without others inside: it changes nothing but the state."""
    return lambda context, node: change(context.state, node)


@attrs.define
class Context:
    """The walk over the statements of a program.

    Attributes:
        steps: the transfer function of each kind of statement.
        state: the abstract state.
        loops: nesting of loops.
        recovering: whether the statement is in a RECOVER part.
    """

    steps: Steps
    state: FlowState
    loops: int = 0
    recovering: bool = False
    _depth: int = 0
    _calls: CallAnalysis = attrs.field(init=False)

    def __attrs_post_init__(self) -> None:
        """Connect the analysis of calls to that of statements."""
        self._calls = CallAnalysis(self.state, lambda statements: self.follow(*statements))

    def follow(self, *statements: tree.Statement) -> None:
        """Analyse statements in order, up to a HALT; those that are nested too deep only invalidate facts."""
        for statement in statements:
            if self.state.ended:
                self.state.report_unreachable(statement.span)
                return
            self.follow_one(statement)

    def follow_one(self, statement: tree.Statement) -> None:
        """Analyse one statement; where it is nested too deep, only invalidate what it changes."""
        self._calls.count_statement()
        if self._depth >= _MAX_DEPTH:
            self._skip(statement)
            return
        self._depth += 1
        self.steps[type(statement)](self, statement)
        self._depth -= 1

    def call(self, node: tree.Call) -> None:
        """Analyse a call."""
        self._calls.call(node, follow=self._depth < _MAX_DEPTH)

    def follow_uncalled(self) -> None:
        """Analyse the procedures that were not analysed at each of their calls."""
        self._calls.follow_uncalled()

    def _skip(self, statement: tree.Statement) -> None:
        self.state.forget(self.side_effects(statement))
        for inner in walk_statements((statement,)):
            if isinstance(inner, tree.Move | tree.Grasp):
                self.state.record(inner, None)
            elif isinstance(inner, tree.Call):
                self._calls.skip_body(inner.name.key)

    def side_effects(self, *statements: tree.Statement) -> SideEffects:
        """Return the side effects of statements."""
        return self.state.side_effects.effects_of_all(statements, self.state.now.scope)

    def path(self, *statements: tree.Statement, mark: int | None = None) -> Outcome | None:
        """Analyse one path and roll back to a mark, or to here; None where HALT ends the path."""
        state, facts = self.state, self.state.facts
        start = facts.checkpoint() if mark is None else mark
        self.follow(*statements)
        outcome = None if state.ended else facts.outcome(start)
        facts.roll_back(start)
        state.ended = False
        return outcome

    def merge(self, *outcomes: Outcome | None, divergence: Divergence | None = None) -> None:
        """Merge paths; the path ends where none of them arrives.

        Args:
            outcomes: of the paths.
            divergence: reported of a variable that is assigned on some of them only.
        """
        arrived = [outcome for outcome in outcomes if outcome is not None]
        if arrived:
            self.state.table.divergence = divergence
            self.state.facts.join(arrived)
            self.state.table.divergence = None
        else:
            self.state.ended = True
