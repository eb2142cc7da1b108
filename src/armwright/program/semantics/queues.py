"""QUEUE and PUT: their arms, their clauses, and where a queue is open."""

from armwright.program.language.diagnostic import labels
from armwright.program.language.units import MOST_FRAMES
from armwright.program.semantics.context import Checks, Context
from armwright.program.semantics.devices import check_arm
from armwright.program.semantics.expression_types import ExpressionType
from armwright.program.semantics.move import check_durations, check_pose, check_quantity, check_speed
from armwright.program.semantics.quantities import check_unit
from armwright.program.semantics.scopes import NameResolver
from armwright.program.semantics.type_check import require_type
from armwright.program.syntax import tree


def queue(context: Context, node: tree.Queue) -> None:
    """Check one QUEUE: its arm, its clauses, and that it stands where an arm can be run by it."""
    names, first = context.names, dict[type, tree.Clause]()
    check_arm(names, node.arm, "QUEUE")
    for clause in node.clauses:
        word = tree.clause_word(type(clause))
        if (earlier := first.setdefault(type(clause), clause)) is not clause:
            text, here = f"{word} is given twice in one QUEUE", labels(earlier.span, "first")
            names.report("E213", text, clause.span, "second", secondary=here)
        match clause:
            case tree.Capacity(value=value):
                _check_capacity(names, value)
            case tree.Speed(value=value):
                check_speed(names, value)
            case tree.Blend() | tree.Velocity():
                check_quantity(names, clause, clause.value)
    check_durations(names, first)
    arm = node.arm.key if isinstance(node.arm, tree.ArmName) else ""
    if context.interrupting and context.procedure is None:
        text, advice = "an action cannot open a queue", "write QUEUE around the statements that the action interrupts"
        names.report("E256", text, node.head, "in the action of a WHEN", advice=advice)
    elif arm in context.queues:
        text, here = f"the queue of {arm} is open already", labels(context.queues[arm].head, "opened here")
        names.report("E256", text, node.head, "opened a second time", secondary=here)
    outside = context.queues
    context.queues = {**outside, arm: node} if arm else outside
    context.check(node.body)
    context.queues = outside


def _check_capacity(names: NameResolver, value: tree.Expression) -> None:
    """Check how many frames a queue is to hold."""
    is_number = require_type(names, value, ExpressionType.SCALAR, "E216", "CAPACITY needs a number or a SCALAR")
    if not is_number or not isinstance(value, tree.Number) or not check_unit(names, value, None, "it counts frames"):
        return
    if not (1 <= value.value <= MOST_FRAMES and value.value == round(value.value)):
        text = f"a queue cannot hold {value.text} frames"
        names.report("E256", text, value.span, f"expected a whole number from 1 to {MOST_FRAMES}")


def put(context: Context, node: tree.Put) -> None:
    """Check one PUT: its frame, its arm, and that the queue of that may be open here."""
    names = context.names
    check_pose(names, node.frame, "E211", "PUT puts a FRAME into a queue")
    check_arm(names, node.arm, "PUT")
    if isinstance(node.arm, tree.ArmName) and context.procedure is None and node.arm.key not in context.queues:
        text, advice = (
            f"{node.arm.key} has no open queue here",
            f"write `QUEUE {node.arm.key} DO BEGIN ... END` around it",
        )
        names.report("E256", text, node.head, "into which queue?", advice=advice)
    if node.otherwise is not None:
        context.check(node.otherwise)


CHECKS: Checks = {tree.Queue: queue, tree.Put: put}
