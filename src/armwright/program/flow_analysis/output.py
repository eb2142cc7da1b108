"""PRINT: its items need a value."""

from armwright.program.flow_analysis.context import Steps, of_state
from armwright.program.flow_analysis.definite_assignment import require_value
from armwright.program.flow_analysis.state import FlowState
from armwright.program.syntax import tree


def print_(state: FlowState, node: tree.Print) -> None:
    """Require a value of the items of a PRINT."""
    require_value(state, *node.items)


STEPS: Steps = {tree.Print: of_state(print_)}
