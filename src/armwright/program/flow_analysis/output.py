"""PRINT: what is printed needs a value."""

from collections.abc import Mapping

from armwright.program.flow_analysis.context import Step, of_state
from armwright.program.flow_analysis.definite_assignment import need
from armwright.program.flow_analysis.state import FlowState
from armwright.program.syntax import tree


def print_(state: FlowState, node: tree.Print) -> None:
    """Check what one PRINT needs."""
    need(state, *(item for item in node.items if not isinstance(item, tree.String)))


STEPS: Mapping[type, Step] = {tree.Print: of_state(print_)}
