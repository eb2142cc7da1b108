"""Assignments, AFFIX and UNFIX: the variables they change, and the types of values, parents and transformations."""

from armwright.program.language.diagnostic import did_you_mean
from armwright.program.language.words import Standard
from armwright.program.semantics.context import Checks, Context
from armwright.program.semantics.expression_types import (
    ACCEPTED_TYPES,
    ExpressionType,
    expression_text,
    quote_expression,
    type_texts,
    variable_keys,
    variable_phrase,
)
from armwright.program.semantics.scopes import NameResolver
from armwright.program.semantics.type_check import (
    infer_type,
    is_world,
    report_constant_assignment,
    report_world_assignment,
    require_type,
)
from armwright.program.syntax import tree

_VALUE_PHRASES = {
    ExpressionType.SCALAR: "a number",
    ExpressionType.FRAME: "a pose",
    ExpressionType.TRANS: "a transformation",
    ExpressionType.CONDITION: "a condition",
    ExpressionType.TEXT: "a text",
}


def assign(context: Context, node: tree.Assign) -> None:
    """Check that a variable can be assigned a value, and is assigned one of its type."""
    context.note_change(node.target, node.span)
    names, target = context.names, node.target
    actual = infer_type(names, node.value)
    if isinstance(target, tree.ArmName):
        text = f"`{target.text}` is an arm and cannot be assigned a value"
        advice = f"move it, or write `READ SYSTEM ({target.key})`"
        names.report("E218", text, target.span, "an arm", advice=advice)
    elif is_world(target):
        report_world_assignment(names, target)
    elif isinstance(target, tree.Name) and names.scope.is_constant(target.key):
        report_constant_assignment(names, target)
    else:
        required = infer_type(names, target)
        if required is ExpressionType.EVENT:
            names.report_event(target, "given a value")
        elif required is not None and actual is not None and actual not in ACCEPTED_TYPES[required]:
            _report_wrong_value(names, node, required, actual)


def _report_wrong_value(
    names: NameResolver, node: tree.Assign, required: ExpressionType, actual: ExpressionType
) -> None:
    target, value = node.target, node.value
    if actual is ExpressionType.EVENT:
        names.report_event(value, "a value")
        return
    if names.symbols.std is Standard.RLO_83:
        what = "one number" if required is ExpressionType.SCALAR else "twelve numbers in `( )`"
        label, advice = "a matrix" if actual is ExpressionType.MATRIX else "one number", ""
    else:
        phrase, label = type_texts(value, actual)
        what = f"{_VALUE_PHRASES[required]}, but {quote_expression(value)} is {phrase}"
        advice = _value_advice(target, value, required, actual)
    text = f"{quote_expression(target)} is {variable_phrase(required)} and takes {what}"
    head = target.name if isinstance(target, tree.Index) else target
    here = names.declaration_labels(*variable_keys(head))
    names.report_once("E217", text, value.span, label, variable_keys(target), secondary=here, advice=advice)


def _value_advice(
    target: tree.Expression, value: tree.Expression, required: ExpressionType, actual: ExpressionType
) -> str:
    name, text = expression_text(target), expression_text(value)
    advice = ""
    match required, actual:
        case _, ExpressionType.INVERSE:
            advice = "INV of a FRAME goes in front of another FRAME, such as `INV(f) * g`"
        case ExpressionType.SCALAR, ExpressionType.CONDITION:
            advice = f"write `IF {text} THEN {name} = 1 ELSE {name} = 0`"
        case ExpressionType.FRAME, ExpressionType.TRANS:
            advice = f"for the pose that this transformation gives from WORLD write `WORLD * {text}`"
        case ExpressionType.TRANS, ExpressionType.FRAME:
            advice = f"for the transformation from WORLD to this pose write `INV(WORLD) * {text}`"
        case ExpressionType.CONDITION, ExpressionType.SCALAR:
            advice = f"write `{name} = {text} <> 0`"
        case ExpressionType.TEXT, _:
            advice = f"write `{name} = TEXT({text})`"
        case ((ExpressionType.FRAME | ExpressionType.TRANS), ExpressionType.SCALAR):
            advice = "write twelve numbers in `( )`, or make a transformation from numbers by XYZ, ROTX, ROTY and ROTZ"
    return advice


def affix(context: Context, node: tree.Affix) -> None:
    """Check child, parent and step of one AFFIX."""
    names = context.names
    context.note_change(node.child, node.link)
    if node.rigid:
        context.note_change(node.parent, node.link)
    parent = expression_text(node.parent)
    is_reversed = isinstance(node.child, tree.ArmName) and isinstance(node.parent, tree.Name | tree.Index)
    swapped = f"AFFIX {parent} TO {expression_text(node.child)}" if is_reversed else None
    _check_child(names, node.child, "AFFIX hangs", "affixed to a frame", did_you_mean(swapped))
    require_type(names, node.parent, ExpressionType.FRAME, "E215", "AFFIX ... TO needs a FRAME or an arm")
    if node.at is None:
        return
    at, is_arm = expression_text(node.at), isinstance(node.at, tree.ArmName)

    def advice(actual: ExpressionType) -> str:
        is_pose = actual is ExpressionType.FRAME and not (is_arm and names.symbols.std is Standard.RLO_83)
        return f"for the transformation from {parent} to {at} write `AT INV({parent}) * {at}`" if is_pose else ""

    note = "a FRAME is a pose in the cell; a TRANS is the transformation from one frame to another"
    require_type(names, node.at, ExpressionType.TRANS, "E210", "AT needs a TRANS", note=note, advice=advice)


def unfix(context: Context, node: tree.Unfix) -> None:
    """Check child and parent of one UNFIX."""
    context.note_change(node.child, node.span)
    _check_child(context.names, node.child, "UNFIX cuts", "unfixed")
    if node.parent is not None:
        require_type(context.names, node.parent, ExpressionType.FRAME, "E215", "FROM needs a FRAME or an arm")


def _check_child(names: NameResolver, node: tree.Mobile, verb: str, done: str, advice: str = "") -> None:
    """Check the frame that AFFIX hangs or UNFIX cuts."""
    if isinstance(node, tree.ArmName):
        text = f"an arm cannot be {done}"
        names.report("E308", text, node.span, "the cell file fixes the base of an arm", advice=advice)
    elif is_world(node):
        text = f"{quote_expression(node)} cannot be {done.partition(' ')[0]}"
        names.report("E309", text, node.span, "the root of all frames")
    else:
        require_type(names, node, ExpressionType.FRAME, "E215", f"{verb} a FRAME")


CHECKS: Checks = {tree.Assign: assign, tree.Affix: affix, tree.Unfix: unfix}
