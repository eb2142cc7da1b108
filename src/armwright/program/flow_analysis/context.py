"""The context of the analysis: the abstract state, and the walk over statements and paths."""

from collections.abc import Callable, Mapping
from typing import Any, TypeAlias, TypeVar

import attrs

from armwright.program.flow_analysis.facts import Divergence
from armwright.program.flow_analysis.lattice import Outcome
from armwright.program.flow_analysis.side_effects import SideEffects, walk_statements
from armwright.program.flow_analysis.state import FlowState
from armwright.program.syntax import tree

Node = TypeVar("Node", bound=tree.Statement)
Step: TypeAlias = Callable[["Context", Any], None]
Steps: TypeAlias = Mapping[type, Step]

# Deepest nesting that is analysed; statements inside it only invalidate facts.
MAX_DEPTH = 100
# Statements of procedures that are analysed at calls, in all.
_MAX_STATEMENTS = 20_000


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
        depth: nesting of statements.
        budget: statements of procedures that may still be analysed at calls.
        activations: the number of calls so far.
        followed: procedures whose body was analysed at a call.
        skipped: procedures whose body was not analysed at a call.
        braked: whether a WHEN may brake a MOVE here, so that it does not come to its goal.
    """

    steps: Steps
    state: FlowState
    loops: int = 0
    recovering: bool = False
    depth: int = 0
    budget: int = _MAX_STATEMENTS
    activations: int = 0
    followed: set[str] = attrs.field(factory=set)
    skipped: set[str] = attrs.field(factory=set)
    braked: bool = False

    def follow(self, *statements: tree.Statement) -> None:
        """Analyse statements in order, up to a HALT; those that are nested too deep only invalidate facts."""
        facts, braked = self.state.facts, self.braked
        uncertainties = facts.uncertainties
        for statement in statements:
            if self.state.ended:
                self.state.report_unreachable(statement.span)
                break
            self.follow_one(statement)
        # Its WHENs are disarmed here.
        facts.uncertainties, self.braked = uncertainties, braked

    def follow_one(self, statement: tree.Statement) -> None:
        """Analyse one statement; where it is nested too deep, only invalidate what it changes."""
        self.budget -= bool(self.state.calls)
        if self.depth >= MAX_DEPTH:
            self._skip(statement)
            return
        self.depth += 1
        self.steps[type(statement)](self, statement)
        self.depth -= 1

    def _skip(self, statement: tree.Statement) -> None:
        self.state.forget(self.side_effects(statement))
        for inner in walk_statements((statement,)):
            if isinstance(inner, tree.Move | tree.Grasp):
                self.state.record(inner, None)
            elif isinstance(inner, tree.Call):
                self.skipped.add(inner.name.key)

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

    def otherwise(self, node: tree.Wait | tree.WaitUntil | tree.Put, message: str, advice: str) -> None:
        """Analyse what the ELSE of a statement says, which may be done or not.

        Args:
            node: the statement.
            message: of a variable that gets its value there only.
            advice: what to do then.
        """
        state, part = self.state, node.otherwise
        if part is None:
            return
        if state.is_first_pass:
            state.forget(self.side_effects(node))
            return
        with state.conditional():
            outcomes = (self.path(part), self.path())
        self.merge(*outcomes, divergence=state.divergence(node.head, message, advice))

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
