"""OPEN, GRASP, OPERATE and READ: grippers, devices and sensors."""

from armwright.program.language.kinds import VariableKind, VariableType
from armwright.program.semantics.context import Checks, Context
from armwright.program.semantics.expression_types import (
    ExpressionType,
    declared_type_phrase,
    expression_text,
    quote_expression,
)
from armwright.program.semantics.quantities import check_range
from armwright.program.semantics.scopes import NameResolver
from armwright.program.semantics.type_check import (
    declaration_labels,
    infer_type,
    is_world,
    report_world_assignment,
    require_quantity,
    require_type,
)
from armwright.program.syntax import tree


def open_(context: Context, node: tree.Open) -> None:
    """Check arm and width of one OPEN."""
    names = context.names
    _arm(names, node.arm, "OPEN")
    if node.width is not None and require_quantity(names, node.width, "length", "OPEN ... TO needs a width"):
        check_range(names, node.width, "a width", zero=True)


def grasp(context: Context, node: tree.Grasp) -> None:
    """Check the arm of one GRASP, if it names one."""
    _arm(context.names, node.arm, "GRASP")


def operate(context: Context, node: tree.Operate) -> None:
    """Check that OPERATE names a device; devices are not declared."""
    names, device = context.names, node.device
    if isinstance(device, tree.ArmName):
        names.report("E201", f"OPERATE starts a device, but `{device.text}` is an arm", device.span, "an arm")
    elif isinstance(device, tree.Index):
        text = f"OPERATE starts a device, but {quote_expression(device)} is an element of an array"
        names.report("E201", text, device.span, "no device")


def read_visions(context: Context, node: tree.ReadVisions) -> None:
    """Check the frames that the camera is to find."""
    for target in node.targets:
        context.note_change(target, node.span)
        _vision_target(context.names, target)


def _vision_target(names: NameResolver, target: tree.Mobile) -> None:
    """Check a frame that the camera is to find."""
    if isinstance(target, tree.ArmName):
        help_ = f"write `READ SYSTEM ({target.key})` to read the arm"
        text = f"READ VISIONS finds a FRAME, but `{target.text}` is an arm"
        names.report("E215", text, target.span, "an arm", advice=help_)
    elif is_world(target):
        report_world_assignment(names, target)
    else:
        require_type(names, target, ExpressionType.FRAME, "E215", "READ VISIONS finds a FRAME")


def read_system(context: Context, node: tree.ReadSystem) -> None:
    """Check the arm whose sensors are read."""
    _arm(context.names, node.arm, "READ SYSTEM")


def _arm(names: NameResolver, node: tree.Mobile | None, who: str) -> None:
    """Check that a statement for arms names one."""
    if node is None or isinstance(node, tree.ArmName):
        return
    if isinstance(node, tree.Poison):
        names.mark_used(node.names)
        return
    key = node.key if isinstance(node, tree.Name) else node.name.key
    names.mark_used([key])
    if names.is_poisoned(key):
        return
    near = names.closest_name(expression_text(node), names.arm_names)
    kind = names.type_of_key(key)
    if isinstance(node, tree.Index):
        sort_ = infer_type(names, node)
        if sort_ is None:
            return
        kind = VariableType(VariableKind[sort_.name])
    is_one = "is no arm" if kind is None else f"is {declared_type_phrase(kind)}"
    text = f"{who} needs an arm, but {quote_expression(node)} {is_one}"
    advice = f"did you mean `{near}`?" if near else f"write the name of an arm, such as `{names.arm_names()[0]}`"
    names.report(
        "E201", text, node.span, str(kind or "not an arm"), secondary=declaration_labels(names, node), advice=advice
    )


CHECKS: Checks = {
    tree.Open: open_,
    tree.Grasp: grasp,
    tree.Operate: operate,
    tree.ReadVisions: read_visions,
    tree.ReadSystem: read_system,
}
