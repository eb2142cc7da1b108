"""Names and types of single statements: values, frames, tools, sensors, events, counting, output."""

from armwright.program.language.diagnostic import Label
from armwright.program.language.kinds import VariableKind, VariableType
from armwright.program.language.words import Standard
from armwright.program.semantics import events
from armwright.program.semantics.cell_symbols import WORLD
from armwright.program.semantics.expression_types import (
    FITTING,
    Sort,
    a_type,
    bare,
    called,
    is_what,
    plain_keys,
    written,
)
from armwright.program.semantics.scopes import Names
from armwright.program.semantics.type_check import need, sort
from armwright.program.syntax import tree

_TAKES = {Sort.SCALAR: "a number", Sort.FRAME: "a place", Sort.TRANS: "a step"}


# ---- values --------------------------------------------------------------------------------------------------------


def assign(names: Names, node: tree.Assign) -> None:
    """Check that a variable can be given a value, and gets one of its kind."""
    target = node.target
    given = sort(names, node.value)
    if isinstance(target, tree.ArmName):
        help_ = f"move it, or write `READ SYSTEM ({target.key})`"
        names.found.say(
            "E218", f"`{target.text}` is an arm and cannot be given a value", target.span, "an arm", helps=(help_,)
        )
    elif _is_world(target):
        _refuse_world(names, target)
    else:
        takes = sort(names, target)
        if takes is Sort.EVENT:
            events.refuse(names, target, "given a value")
        elif takes is not given and takes is not None and given is not None and given not in FITTING[takes]:
            _misfit(names, node, takes, given)


def _misfit(names: Names, node: tree.Assign, takes: Sort, given: Sort) -> None:
    target, value = node.target, node.value
    if given is Sort.EVENT:
        events.refuse(names, value, "a value")
        return
    if not names.first("E217", *plain_keys(target)):
        return
    if names.std is Standard.RLO_83:
        what = "one number" if takes is Sort.SCALAR else "twelve numbers in `( )`"
        message, label = "", "a matrix" if given is Sort.MATRIX else "one number"
    else:
        what, is_one = _TAKES[takes], is_what(value, given)
        message, label = f", but {called(value)} is {is_one}", bare(is_one)
    help_ = _advice(target, value, takes, given) if message else ""
    names.found.say(
        "E217",
        f"{called(target)} is {takes.value} and takes {what}{message}",
        value.span,
        label,
        secondary=_declared(names, target),
        helps=(help_,) if help_ else (),
    )


def _advice(target: tree.Expression, value: tree.Expression, takes: Sort, given: Sort) -> str:
    match takes, given:
        case _, Sort.INVERSE:
            return "INV of a FRAME goes in front of another FRAME, such as `INV(f) * g`"
        case Sort.SCALAR, Sort.CONDITION:
            return f"write `IF {written(value)} THEN {written(target)} = 1 ELSE {written(target)} = 0`"
        case Sort.FRAME, Sort.TRANS:
            return f"for the place at this step from WORLD write `WORLD * {written(value)}`"
        case Sort.TRANS, Sort.FRAME:
            return f"for the step from WORLD to this place write `INV(WORLD) * {written(value)}`"
        case ((Sort.FRAME | Sort.TRANS), Sort.SCALAR):
            return "write twelve numbers in `( )`, or make a step from numbers by XYZ, ROTX, ROTY and ROTZ"
        case _:
            return ""


def _declared(names: Names, node: tree.Expression) -> tuple[Label, ...]:
    if isinstance(node, tree.Index):
        node = node.name
    return tuple(label for key in plain_keys(node) for label in names.where_declared(key))


def _is_world(node: tree.Expression) -> bool:
    """Whether this is the root of all frames."""
    return isinstance(node, tree.Name) and node.key == WORLD


def _refuse_world(names: Names, node: tree.Expression) -> None:
    names.found.say("E218", f"{called(node)} cannot be given a value", node.span, "the root of all frames")


# ---- frames --------------------------------------------------------------------------------------------------------


def affix(names: Names, node: tree.Affix) -> None:
    """Check child, parent and step of one AFFIX."""
    whence = written(node.parent)
    swap = isinstance(node.child, tree.ArmName) and isinstance(node.parent, tree.Name | tree.Index)
    helps = (f"did you mean `AFFIX {whence} TO {written(node.child)}`?",) if swap else ()
    child(names, node.child, "AFFIX hangs", "affixed to a frame", helps)
    need(names, node.parent, Sort.FRAME, "E215", "AFFIX ... TO needs a FRAME or an arm")
    if node.at is None:
        return
    where, is_arm = written(node.at), isinstance(node.at, tree.ArmName)

    def advice(found: Sort) -> str:
        is_place = found is Sort.FRAME and not (is_arm and names.std is Standard.RLO_83)
        return f"for the step from {whence} to {where} write `AT INV({whence}) * {where}`" if is_place else ""

    need(
        names,
        node.at,
        Sort.TRANS,
        "E210",
        "AT needs a TRANS",
        notes=("a FRAME is a place in the cell; a TRANS is the step from one frame to another",),
        helps=advice,
    )


def child(names: Names, node: tree.Mobile, verb: str, done: str, helps: tuple[str, ...] = ()) -> None:
    """Check the frame that AFFIX hangs or UNFIX cuts."""
    if isinstance(node, tree.ArmName):
        text = f"an arm cannot be {done}"
        names.found.say("E308", text, node.span, "an arm hangs on its own base", helps=helps)
    elif _is_world(node):
        text = f"{called(node)} cannot be {done.partition(' ')[0]}"
        names.found.say("E309", text, node.span, "the root of all frames")
    else:
        need(names, node, Sort.FRAME, "E215", f"{verb} a FRAME")


# ---- tools and sensors ---------------------------------------------------------------------------------------------


def arm(names: Names, node: tree.Mobile | None, who: str) -> None:
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
        found = sort(names, node)
        if found is None:
            return
        kind = VariableType(VariableKind[found.name])
    is_one = "is no arm" if kind is None else f"is {a_type(kind)}"
    names.found.say(
        "E201",
        f"{who} needs an arm, but {called(node)} {is_one}",
        node.span,
        str(kind or "not an arm"),
        secondary=_declared(names, node),
        helps=(f"did you mean `{near}`?",) if near else (f"write the name of an arm, such as `{names.arms()[0]}`",),
    )


def operate(names: Names, node: tree.Operate) -> None:
    """Check that OPERATE names a device; devices are not declared."""
    device = node.device
    if isinstance(device, tree.ArmName):
        names.found.say("E201", f"OPERATE starts a device, but `{device.text}` is an arm", device.span, "an arm")
    elif isinstance(device, tree.Index):
        text = f"OPERATE starts a device, but {called(device)} is an element of an array"
        names.found.say("E201", text, device.span, "no device")


def vision(names: Names, target: tree.Mobile) -> None:
    """Check a frame that the camera is to find."""
    if isinstance(target, tree.ArmName):
        help_ = f"write `READ SYSTEM ({target.key})` to read the arm"
        text = f"READ VISIONS finds a FRAME, but `{target.text}` is an arm"
        names.found.say("E215", text, target.span, "an arm", helps=(help_,))
    elif _is_world(target):
        _refuse_world(names, target)
    else:
        need(names, target, Sort.FRAME, "E215", "READ VISIONS finds a FRAME")


# ---- events, counting, output --------------------------------------------------------------------------------------


def event(names: Names, node: tree.Variable, who: str) -> None:
    """Check what SIGNAL or WAIT is about."""
    need(
        names,
        node,
        Sort.EVENT,
        "E223",
        f"{who} needs an EVENT",
        helps=lambda _: "an event is declared with EVENT as its type, such as `VAR ready : EVENT ;`",
    )


def count(names: Names, node: tree.For) -> None:
    """Check variable, bounds and step of a FOR."""
    variable = node.variable
    if isinstance(variable, tree.Poison):
        names.use(variable.names)
    else:
        kind = names.type(variable)
        if kind is not None and kind != VariableType(VariableKind.SCALAR):
            names.poison(variable.key)
            names.found.say(
                "E229",
                f"FOR counts with a SCALAR, but `{variable.text}` is {a_type(kind)}",
                variable.span,
                str(kind),
                secondary=names.where_declared(variable.key),
            )
    for bound in (node.first, node.last, node.step):
        if bound is not None:
            need(names, bound, Sort.SCALAR, "E229", "FOR counts in numbers")
    if isinstance(node.step, tree.Number) and node.step.value == 0:
        text = "a FOR with STEP 0 would never end"
        names.found.say("E229", text, node.step.span, "goes nowhere", helps=("leave STEP out to count by 1",))


def show(names: Names, node: tree.Print) -> None:
    """Check what is printed: anything but an EVENT."""
    for item in node.items:
        if not isinstance(item, tree.String) and sort(names, item) is Sort.EVENT:
            events.refuse(names, item, "printed")
