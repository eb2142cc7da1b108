"""AFFIX, UNFIX and assignments: what gives variables their values and frames their parents."""

from armwright.program.language.diagnostic import did_you_mean
from armwright.program.language.words import Standard
from armwright.program.semantics import events
from armwright.program.semantics.context import Checks, Context
from armwright.program.semantics.expression_types import (
    ACCEPTED_TYPES,
    ExpressionType,
    expression_text,
    quote_expression,
    type_phrase,
    variable_keys,
    without_article,
)
from armwright.program.semantics.scopes import NameResolver
from armwright.program.semantics.type_check import (
    declaration_labels,
    infer_type,
    is_world,
    report_world_assignment,
    require_type,
)
from armwright.program.syntax import tree

_VALUE_PHRASES = {
    ExpressionType.SCALAR: "a number",
    ExpressionType.FRAME: "a pose",
    ExpressionType.TRANS: "a transformation",
}


def assign(context: Context, node: tree.Assign) -> None:
    """Check that a variable can be given a value, and gets one of its kind."""
    context.note_change(node.target, node.span)
    names, target = context.names, node.target
    actual = infer_type(names, node.value)
    if isinstance(target, tree.ArmName):
        help_ = f"move it, or write `READ SYSTEM ({target.key})`"
        names.report(
            "E218", f"`{target.text}` is an arm and cannot be assigned a value", target.span, "an arm", advice=help_
        )
    elif is_world(target):
        report_world_assignment(names, target)
    else:
        takes = infer_type(names, target)
        if takes is ExpressionType.EVENT:
            events.report_event_as_value(names, target, "given a value")
        elif takes is not actual and takes is not None and actual is not None and actual not in ACCEPTED_TYPES[takes]:
            _report_wrong_value(names, node, takes, actual)


def _report_wrong_value(names: NameResolver, node: tree.Assign, takes: ExpressionType, actual: ExpressionType) -> None:
    target, value = node.target, node.value
    if actual is ExpressionType.EVENT:
        events.report_event_as_value(names, value, "a value")
        return
    if not names.is_first_report("E217", *variable_keys(target)):
        return
    if names.symbols.std is Standard.RLO_83:
        what = "one number" if takes is ExpressionType.SCALAR else "twelve numbers in `( )`"
        message, label = "", "a matrix" if actual is ExpressionType.MATRIX else "one number"
    else:
        what, is_one = _VALUE_PHRASES[takes], type_phrase(value, actual)
        message, label = f", but {quote_expression(value)} is {is_one}", without_article(is_one)
    help_ = _value_advice(target, value, takes, actual) if message else ""
    text = f"{quote_expression(target)} is {takes.value} and takes {what}{message}"
    names.report("E217", text, value.span, label, secondary=declaration_labels(names, target), advice=help_)


def _value_advice(
    target: tree.Expression, value: tree.Expression, takes: ExpressionType, actual: ExpressionType
) -> str:
    match takes, actual:
        case _, ExpressionType.INVERSE:
            return "INV of a FRAME goes in front of another FRAME, such as `INV(f) * g`"
        case ExpressionType.SCALAR, ExpressionType.CONDITION:
            name = expression_text(target)
            return f"write `IF {expression_text(value)} THEN {name} = 1 ELSE {name} = 0`"
        case ExpressionType.FRAME, ExpressionType.TRANS:
            return f"for the pose that this transformation gives from WORLD write `WORLD * {expression_text(value)}`"
        case ExpressionType.TRANS, ExpressionType.FRAME:
            return f"for the transformation from WORLD to this pose write `INV(WORLD) * {expression_text(value)}`"
        case ((ExpressionType.FRAME | ExpressionType.TRANS), ExpressionType.SCALAR):
            return "write twelve numbers in `( )`, or make a transformation from numbers by XYZ, ROTX, ROTY and ROTZ"
        case _:
            return ""


def affix(context: Context, node: tree.Affix) -> None:
    """Check child, parent and step of one AFFIX."""
    names = context.names
    context.note_change(node.child, node.link)
    if node.rigid:
        context.note_change(node.parent, node.link)
    whence = expression_text(node.parent)
    swap = isinstance(node.child, tree.ArmName) and isinstance(node.parent, tree.Name | tree.Index)
    swapped = f"AFFIX {whence} TO {expression_text(node.child)}" if swap else None
    _check_child(names, node.child, "AFFIX hangs", "affixed to a frame", did_you_mean(swapped))
    require_type(names, node.parent, ExpressionType.FRAME, "E215", "AFFIX ... TO needs a FRAME or an arm")
    if node.at is None:
        return
    where, is_arm = expression_text(node.at), isinstance(node.at, tree.ArmName)

    def advice(actual: ExpressionType) -> str:
        is_place = actual is ExpressionType.FRAME and not (is_arm and names.symbols.std is Standard.RLO_83)
        return f"for the transformation from {whence} to {where} write `AT INV({whence}) * {where}`" if is_place else ""

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
