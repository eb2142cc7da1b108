"""Code of QUEUE and PUT."""

from armwright.program.bytecode.context import Context, Generators
from armwright.program.bytecode.emitter import LATER
from armwright.program.bytecode.instructions import LEFT_OUT, Op
from armwright.program.language.source import Span
from armwright.program.syntax import tree


def queue(context: Context, node: tree.Queue) -> None:
    """Generate a QUEUE, its body and its end."""
    out, arm = context.out, context.out.value(node.arm)
    clauses = {type(clause): clause.value for clause in node.clauses if isinstance(clause, tree.QUEUE_CLAUSES)}
    values = [out.value(clauses[kind]) if kind in clauses else LEFT_OUT for kind in tree.QUEUE_CLAUSES]
    out.emit(Op.QUEUE, arm, *values, span=node.head)
    context.generate(node.body)
    out.begin()
    out.emit(Op.QUEND, arm, span=Span(node.span.end, node.span.end))


def put(context: Context, node: tree.Put) -> None:
    """Generate a PUT, whose frame is where it is now although it may have to wait."""
    out, arm = context.out, context.out.value(node.arm)
    frame = out.value(node.frame, out.passing())
    if node.otherwise is None:
        out.emit(Op.PUT, arm, frame, span=node.head)
        return
    attempt = out.emit(Op.PUT, arm, frame, LATER, span=node.head)
    over = out.emit(Op.JMP, LATER, span=node.head)
    out.patch_jump(attempt)
    context.generate(node.otherwise)
    out.patch_jump(over)


GENERATORS: Generators = {tree.Queue: queue, tree.Put: put}
