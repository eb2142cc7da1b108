"""PRINT and LOG: their items need a value."""

from armwright.program.flow_analysis.context import Steps, of_state
from armwright.program.flow_analysis.definite_assignment import require_value
from armwright.program.flow_analysis.state import FlowState
from armwright.program.syntax import tree


def written(state: FlowState, node: tree.Print | tree.Log) -> None:
    """Require a value of what is written."""
    require_value(state, *node.items)


STEPS: Steps = {tree.Print: of_state(written), tree.Log: of_state(written)}
