"""OPEN, GRASP, OPERATE, READ and ZERO FORCE: the arms, devices and frames that they name."""

from armwright.program.language.diagnostic import did_you_mean
from armwright.program.language.kinds import VariableType
from armwright.program.semantics.context import Checks, Context
from armwright.program.semantics.expression_types import (
    KIND_OF_TYPE,
    ExpressionType,
    declared_type_phrase,
    expression_text,
    quote_expression,
)
from armwright.program.semantics.quantities import check_range
from armwright.program.semantics.scopes import NameResolver
from armwright.program.semantics.type_check import (
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
    check_arm(names, node.arm, "OPEN")
    if node.width is not None and require_quantity(names, node.width, "length", "OPEN ... TO needs a width"):
        check_range(names, node.width, "a width", zero=True)


def operate(context: Context, node: tree.Operate) -> None:
    """Check that OPERATE names a device; devices are not declared."""
    _device(context.names, node.device, "OPERATE starts a device")
    if node.value is not None:
        require_type(context.names, node.value, ExpressionType.SCALAR, "E216", "OPERATE ... TO needs a number")


def pulse(context: Context, node: tree.Pulse) -> None:
    """Check device and time of a PULSE."""
    _device(context.names, node.device, "PULSE switches a device")
    if require_quantity(context.names, node.duration, "time", "PULSE ... FOR needs a time"):
        check_range(context.names, node.duration, "a pulse", zero=False)


def set_timer(context: Context, node: tree.SetTimer) -> None:
    """Check what a timer is set to; timers are not declared."""
    names = context.names
    if node.on or node.value is not None:
        names.timers.add(node.name.key)
    else:
        names.timers_read.append(node.name)
    if node.value is not None:
        require_quantity(names, node.value, "time", "TIMER ... TO needs a time")


def report_unknown_timers(names: NameResolver) -> None:
    """Report timers that are read or stopped, and that nothing starts."""
    for timer in names.timers_read:
        if timer.key not in names.timers:
            near = names.closest_name(timer.text, lambda: list(names.timers))
            advice = did_you_mean(near) or f"write `TIMER {timer.text} ON` where it begins"
            names.report("E244", f"nothing starts the timer `{timer.text}`", timer.span, "never runs", advice=advice)


def _device(names: NameResolver, device: tree.Mobile, what: str) -> None:
    if isinstance(device, tree.ArmName):
        names.report("E201", f"{what}, but `{device.text}` is an arm", device.span, "an arm")
    elif isinstance(device, tree.Index):
        text = f"{what}, but {quote_expression(device)} is an element of an array"
        names.report("E201", text, device.span, "no device")


def read_visions(context: Context, node: tree.ReadVisions) -> None:
    """Check the frames that the camera is to find."""
    names, what = context.names, "READ VISIONS finds a FRAME"
    for target in node.targets:
        context.note_change(target, node.span)
        if isinstance(target, tree.ArmName):
            advice = f"write `READ SYSTEM ({target.key})` to read the arm"
            names.report("E215", f"{what}, but `{target.text}` is an arm", target.span, "an arm", advice=advice)
        elif is_world(target):
            report_world_assignment(names, target)
        else:
            require_type(names, target, ExpressionType.FRAME, "E215", what)


def check_arm(names: NameResolver, node: tree.Mobile | None, who: str) -> None:
    """Check that a statement for arms names one."""
    if node is None or isinstance(node, tree.ArmName):
        return
    if isinstance(node, tree.Poison):
        names.mark_used(node.names)
        return
    key = node.key if isinstance(node, tree.Name) else node.name.key
    names.mark_used([key])
    if names.scope.is_poisoned(key):
        return
    near = names.closest_name(expression_text(node), names.arm_names)
    kind = names.scope.type(key)
    if isinstance(node, tree.Index):
        element_type = infer_type(names, node)
        if element_type is None:
            return
        kind = VariableType(KIND_OF_TYPE[element_type])
    phrase = "no arm" if kind is None else declared_type_phrase(kind)
    text, label = f"{who} needs an arm, but {quote_expression(node)} is {phrase}", str(kind or "not an arm")
    advice = did_you_mean(near) or f"write the name of an arm, such as `{names.arm_names()[0]}`"
    names.report("E201", text, node.span, label, secondary=names.declaration_labels(key), advice=advice)


CHECKS: Checks = {
    tree.Open: open_,
    tree.Grasp: lambda context, node: check_arm(context.names, node.arm, "GRASP"),
    tree.Operate: operate,
    tree.Pulse: pulse,
    tree.SetTimer: set_timer,
    tree.ReadVisions: read_visions,
    tree.ReadSystem: lambda context, node: check_arm(context.names, node.arm, "READ SYSTEM"),
    tree.ZeroForce: lambda context, node: check_arm(context.names, node.arm, "ZERO FORCE"),
}
