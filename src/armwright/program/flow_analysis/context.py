"""What the analyses of all statements share: the state, and how statements and paths are followed."""

from collections.abc import Callable, Mapping
from typing import Any, TypeAlias, TypeVar

import attrs

from armwright.program.flow_analysis.calls import Calling
from armwright.program.flow_analysis.facts import Divergence
from armwright.program.flow_analysis.lattice import Outcome
from armwright.program.flow_analysis.side_effects import SideEffects, every
from armwright.program.flow_analysis.state import FlowState
from armwright.program.syntax import tree

Node = TypeVar("Node", bound=tree.Statement)
Step: TypeAlias = Callable[["Context", Any], None]
Steps: TypeAlias = Mapping[type, Step]

# Statements inside one another that are followed; deeper ones only make things unknown.
_MAX_DEPTH = 100


def of_state(change: Callable[[FlowState, Node], None]) -> Callable[["Context", Node], None]:
    """Return the analysis of a statement that holds no others: it changes nothing but the state."""
    return lambda context, node: change(context.state, node)


@attrs.define
class Context:
    """Where statements are followed.

    Attributes:
        steps: how each kind of statement is followed.
        state: the state.
        loops: how many loops are followed, one inside the other.
        recovering: whether the statements stand in a RECOVER part.
    """

    steps: Steps
    state: FlowState
    loops: int = 0
    recovering: bool = False
    _depth: int = 0
    _calling: Calling = attrs.field(init=False)

    def __attrs_post_init__(self) -> None:
        """Let calls follow the statements of procedures."""
        self._calling = Calling(self.state, lambda statements: self.follow(*statements))

    def follow(self, *statements: tree.Statement) -> None:
        """Follow statements, one after the other, up to a HALT; those that stand too deep only make things unknown."""
        for statement in statements:
            if self.state.over:
                self.state.unreached(statement.span)
                return
            self.follow_one(statement)

    def follow_one(self, statement: tree.Statement) -> None:
        """Follow one statement; only forget what it changes where it stands too deep."""
        self._calling.step()
        if self._depth >= _MAX_DEPTH:
            self._pass_over(statement)
            return
        self._depth += 1
        self.steps[type(statement)](self, statement)
        self._depth -= 1

    def call(self, node: tree.Call) -> None:
        """Follow a call."""
        self._calling.call(node, follow=self._depth < _MAX_DEPTH)

    def follow_uncalled(self) -> None:
        """Follow the procedures that were not followed at each of their calls."""
        self._calling.others()

    def _pass_over(self, statement: tree.Statement) -> None:
        self.state.forget(self.writes(statement))
        for inner in every((statement,)):
            if isinstance(inner, tree.Move | tree.Grasp):
                self.state.record(inner, None)
            elif isinstance(inner, tree.Call):
                self._calling.pass_over(inner.name.key)

    def writes(self, *statements: tree.Statement) -> SideEffects:
        """Return what statements may change."""
        return self.state.writing.all(statements, self.state.now.scope)

    def path(self, *statements: tree.Statement, mark: int | None = None) -> Outcome | None:
        """Follow one path from here and come back to a mark, or to here; None where HALT ends it."""
        state, facts = self.state, self.state.facts
        start = facts.checkpoint() if mark is None else mark
        self.follow(*statements)
        outcome = None if state.over else facts.outcome(start)
        facts.take_back(start)
        state.over = False
        return outcome

    def merge(self, *outcomes: Outcome | None, parting: Divergence | None = None) -> None:
        """Go on where paths merge; not at all if none of them comes here.

        Args:
            outcomes: of the paths.
            parting: what is said of a variable that has got a value on some of them only.
        """
        arrived = [outcome for outcome in outcomes if outcome is not None]
        if arrived:
            self.state.table.parting = parting
            self.state.facts.join(arrived)
            self.state.table.parting = None
        else:
            self.state.over = True
