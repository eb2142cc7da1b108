"""QUEUE and PUT: an arm that runs along frames while the program goes on."""

from armwright.program.flow_analysis import plausibility
from armwright.program.flow_analysis.context import Context, Steps
from armwright.program.flow_analysis.definite_assignment import require_value
from armwright.program.flow_analysis.facts import UNKNOWN
from armwright.program.flow_analysis.move import check_speed
from armwright.program.flow_analysis.state import FlowState
from armwright.program.language.source import Span
from armwright.program.syntax import tree


def queue(context: Context, node: tree.Queue) -> None:
    """Analyse a QUEUE, during which its arm may be anywhere on its path."""
    state = context.state
    _run_by_queue(state, node.arm, node.head)
    for clause in node.clauses:
        if isinstance(clause, tree.Speed):
            check_speed(state, clause.value)
        elif isinstance(clause, tree.QUEUE_CLAUSES):
            require_value(state, clause.value)
    context.follow(node.body)
    if not state.ended:
        _run_by_queue(state, node.arm, node.head)


def put(context: Context, node: tree.Put) -> None:
    """Analyse a PUT; what is done when the queue is full may be done or not."""
    state = context.state
    require_value(state, node.frame)
    plausibility.check_lengths(state, node.frame)
    _run_by_queue(state, node.arm, node.head)
    message, advice = "it gets a value only where this queue is full", "give it a value before the PUT"
    context.otherwise(node, message, advice)


def _run_by_queue(state: FlowState, arm: tree.Mobile, span: Span) -> None:
    """Note that an arm runs along its queue."""
    state.note_arms(arm)
    if isinstance(arm, tree.ArmName):
        state.note_arm_use(arm.key, span, moves=True)
        state.table.arrive(arm.key, UNKNOWN, None)


STEPS: Steps = {tree.Queue: queue, tree.Put: put}
