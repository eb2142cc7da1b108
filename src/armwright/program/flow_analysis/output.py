"""PRINT: what is printed needs a value."""

from armwright.program.flow_analysis.context import Steps, of_state
from armwright.program.flow_analysis.definite_assignment import need
from armwright.program.flow_analysis.state import FlowState
from armwright.program.syntax import tree


def print_(state: FlowState, node: tree.Print) -> None:
    """Check what one PRINT needs."""
    need(state, *(item for item in node.items if not isinstance(item, tree.String)))


STEPS: Steps = {tree.Print: of_state(print_)}
