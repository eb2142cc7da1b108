"""Code of OPEN, GRASP, OPERATE and READ."""

from armwright.program.bytecode.context import Context, Generators
from armwright.program.bytecode.instructions import Op
from armwright.program.syntax import tree


def open_(context: Context, node: tree.Open) -> None:
    """Generate one OPEN."""
    width = () if node.width is None else (context.out.value(node.width),)
    context.out.emit(Op.OPEN, context.operand(node.arm), *width, span=node.span)


def grasp(context: Context, node: tree.Grasp) -> None:
    """Generate one GRASP; the arm of one that names none is told by the flow analysis, where it is certain."""
    if node.arm is not None:
        context.out.emit(Op.GRASP, context.operand(node.arm), span=node.span)
        return
    arm = context.flow.arms.get(node.span.start)
    context.out.emit(Op.GRASP, *((arm,) if arm else ()), span=node.span, comment="arm by context")


def operate(context: Context, node: tree.Operate) -> None:
    """Generate one OPERATE."""
    context.out.emit(Op.OPER, context.operand(node.device), "ON" if node.on else "OFF", span=node.span)


def read_visions(context: Context, node: tree.ReadVisions) -> None:
    """Generate one instruction for each frame that the camera is to find."""
    for target in node.targets:
        context.out.emit(Op.READV, context.operand(target), span=node.span)


def read_system(context: Context, node: tree.ReadSystem) -> None:
    """Generate one READ SYSTEM."""
    context.out.emit(Op.READS, context.operand(node.arm), span=node.span)


GENERATORS: Generators = {
    tree.Open: open_,
    tree.Grasp: grasp,
    tree.Operate: operate,
    tree.ReadVisions: read_visions,
    tree.ReadSystem: read_system,
}
