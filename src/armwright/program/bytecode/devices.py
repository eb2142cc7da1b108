"""Code of OPEN, GRASP, OPERATE, READ and ZERO FORCE."""

from armwright.program.bytecode.context import Context, Generators, one_instruction
from armwright.program.bytecode.instructions import Op
from armwright.program.syntax import tree


def grasp(context: Context, node: tree.Grasp) -> None:
    """Generate one GRASP; the arm of one that names none is told by the flow analysis, where it is certain."""
    if node.arm is not None:
        context.out.emit(Op.GRASP, context.out.value(node.arm), span=node.span)
        return
    arm = context.flow.arms.get(node.span.start)
    context.out.emit(Op.GRASP, *((arm,) if arm else ()), span=node.span, comment="arm by context")


def operate(context: Context, node: tree.Operate) -> None:
    """Generate one OPERATE."""
    if node.value is not None:
        value = context.out.value(node.value)
        context.out.emit(Op.OPSET, context.out.value(node.device), value, span=node.span)
        return
    context.out.emit(Op.OPER, context.out.value(node.device), "ON" if node.on else "OFF", span=node.span)


def set_timer(context: Context, node: tree.SetTimer) -> None:
    """Generate one TIMER."""
    if node.value is not None:
        context.out.emit(Op.TIMSET, node.name.key, context.out.value(node.value), span=node.span)
    else:
        context.out.emit(Op.TIMSW, node.name.key, "ON" if node.on else "OFF", span=node.span)


def read_visions(context: Context, node: tree.ReadVisions) -> None:
    """Generate one instruction for each frame that the camera is to find."""
    for target in node.targets:
        context.out.emit(Op.READV, context.out.value(target), span=node.span)


GENERATORS: Generators = {
    tree.Open: one_instruction(Op.OPEN),
    tree.Grasp: grasp,
    tree.Operate: operate,
    tree.Pulse: one_instruction(Op.PULSE),
    tree.SetTimer: set_timer,
    tree.ReadVisions: read_visions,
    tree.ReadSystem: one_instruction(Op.READS),
    tree.ZeroForce: one_instruction(Op.ZEROF),
}
