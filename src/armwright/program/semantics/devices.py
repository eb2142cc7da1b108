"""OPEN, GRASP, OPERATE and READ: grippers, devices and sensors."""

from armwright.program.language.kinds import VariableKind, VariableType
from armwright.program.semantics.context import Checks, Context
from armwright.program.semantics.expression_types import ExpressionType, a_type, called, written
from armwright.program.semantics.quantities import in_range
from armwright.program.semantics.scopes import Names
from armwright.program.semantics.type_check import declared, is_world, need, quantity, refuse_world, sort
from armwright.program.syntax import tree


def open_(context: Context, node: tree.Open) -> None:
    """Check arm and width of one OPEN."""
    names = context.names
    _arm(names, node.arm, "OPEN")
    if node.width is not None and quantity(names, node.width, "length", "OPEN ... TO needs a width"):
        in_range(names, node.width, "a width", zero=True)


def grasp(context: Context, node: tree.Grasp) -> None:
    """Check the arm of one GRASP, if it names one."""
    _arm(context.names, node.arm, "GRASP")


def operate(context: Context, node: tree.Operate) -> None:
    """Check that OPERATE names a device; devices are not declared."""
    names, device = context.names, node.device
    if isinstance(device, tree.ArmName):
        names.report("E201", f"OPERATE starts a device, but `{device.text}` is an arm", device.span, "an arm")
    elif isinstance(device, tree.Index):
        text = f"OPERATE starts a device, but {called(device)} is an element of an array"
        names.report("E201", text, device.span, "no device")


def read_visions(context: Context, node: tree.ReadVisions) -> None:
    """Check the frames that the camera is to find."""
    for target in node.targets:
        context.changes(target, node.span)
        _vision_target(context.names, target)


def _vision_target(names: Names, target: tree.Mobile) -> None:
    """Check a frame that the camera is to find."""
    if isinstance(target, tree.ArmName):
        help_ = f"write `READ SYSTEM ({target.key})` to read the arm"
        text = f"READ VISIONS finds a FRAME, but `{target.text}` is an arm"
        names.report("E215", text, target.span, "an arm", advice=help_)
    elif is_world(target):
        refuse_world(names, target)
    else:
        need(names, target, ExpressionType.FRAME, "E215", "READ VISIONS finds a FRAME")


def read_system(context: Context, node: tree.ReadSystem) -> None:
    """Check the arm whose sensors are read."""
    _arm(context.names, node.arm, "READ SYSTEM")


def _arm(names: Names, node: tree.Mobile | None, who: str) -> None:
    """Check that a statement for arms names one."""
    if node is None or isinstance(node, tree.ArmName):
        return
    if isinstance(node, tree.Poison):
        names.use(node.names)
        return
    key = node.key if isinstance(node, tree.Name) else node.name.key
    names.use([key])
    if names.is_poisoned(key):
        return
    near = names.near(written(node), names.arms)
    kind = names.peek(key)
    if isinstance(node, tree.Index):
        sort_ = sort(names, node)
        if sort_ is None:
            return
        kind = VariableType(VariableKind[sort_.name])
    is_one = "is no arm" if kind is None else f"is {a_type(kind)}"
    text = f"{who} needs an arm, but {called(node)} {is_one}"
    advice = f"did you mean `{near}`?" if near else f"write the name of an arm, such as `{names.arms()[0]}`"
    names.report("E201", text, node.span, str(kind or "not an arm"), secondary=declared(names, node), advice=advice)


CHECKS: Checks = {
    tree.Open: open_,
    tree.Grasp: grasp,
    tree.Operate: operate,
    tree.ReadVisions: read_visions,
    tree.ReadSystem: read_system,
}
