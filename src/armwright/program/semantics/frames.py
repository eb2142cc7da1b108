"""AFFIX, UNFIX and assignments: what gives variables their values and frames their parents."""

from armwright.program.language.diagnostic import did_you_mean
from armwright.program.language.words import Standard
from armwright.program.semantics import events
from armwright.program.semantics.context import Checks, Context
from armwright.program.semantics.expression_types import (
    FITTING,
    ExpressionType,
    bare,
    called,
    is_what,
    plain_keys,
    written,
)
from armwright.program.semantics.scopes import Names
from armwright.program.semantics.type_check import declared, is_world, need, refuse_world, sort
from armwright.program.syntax import tree

_TAKES = {ExpressionType.SCALAR: "a number", ExpressionType.FRAME: "a pose", ExpressionType.TRANS: "a transformation"}


def assign(context: Context, node: tree.Assign) -> None:
    """Check that a variable can be given a value, and gets one of its kind."""
    context.changes(node.target, node.span)
    names, target = context.names, node.target
    actual = sort(names, node.value)
    if isinstance(target, tree.ArmName):
        help_ = f"move it, or write `READ SYSTEM ({target.key})`"
        names.report(
            "E218", f"`{target.text}` is an arm and cannot be assigned a value", target.span, "an arm", advice=help_
        )
    elif is_world(target):
        refuse_world(names, target)
    else:
        takes = sort(names, target)
        if takes is ExpressionType.EVENT:
            events.refuse(names, target, "given a value")
        elif takes is not actual and takes is not None and actual is not None and actual not in FITTING[takes]:
            _misfit(names, node, takes, actual)


def _misfit(names: Names, node: tree.Assign, takes: ExpressionType, actual: ExpressionType) -> None:
    target, value = node.target, node.value
    if actual is ExpressionType.EVENT:
        events.refuse(names, value, "a value")
        return
    if not names.first("E217", *plain_keys(target)):
        return
    if names.symbols.std is Standard.RLO_83:
        what = "one number" if takes is ExpressionType.SCALAR else "twelve numbers in `( )`"
        message, label = "", "a matrix" if actual is ExpressionType.MATRIX else "one number"
    else:
        what, is_one = _TAKES[takes], is_what(value, actual)
        message, label = f", but {called(value)} is {is_one}", bare(is_one)
    help_ = _advice(target, value, takes, actual) if message else ""
    text = f"{called(target)} is {takes.value} and takes {what}{message}"
    names.report("E217", text, value.span, label, secondary=declared(names, target), advice=help_)


def _advice(target: tree.Expression, value: tree.Expression, takes: ExpressionType, actual: ExpressionType) -> str:
    match takes, actual:
        case _, ExpressionType.INVERSE:
            return "INV of a FRAME goes in front of another FRAME, such as `INV(f) * g`"
        case ExpressionType.SCALAR, ExpressionType.CONDITION:
            return f"write `IF {written(value)} THEN {written(target)} = 1 ELSE {written(target)} = 0`"
        case ExpressionType.FRAME, ExpressionType.TRANS:
            return f"for the pose that this transformation gives from WORLD write `WORLD * {written(value)}`"
        case ExpressionType.TRANS, ExpressionType.FRAME:
            return f"for the transformation from WORLD to this pose write `INV(WORLD) * {written(value)}`"
        case ((ExpressionType.FRAME | ExpressionType.TRANS), ExpressionType.SCALAR):
            return "write twelve numbers in `( )`, or make a transformation from numbers by XYZ, ROTX, ROTY and ROTZ"
        case _:
            return ""


def affix(context: Context, node: tree.Affix) -> None:
    """Check child, parent and step of one AFFIX."""
    names = context.names
    context.changes(node.child, node.link)
    if node.rigid:
        context.changes(node.parent, node.link)
    whence = written(node.parent)
    swap = isinstance(node.child, tree.ArmName) and isinstance(node.parent, tree.Name | tree.Index)
    swapped = f"AFFIX {whence} TO {written(node.child)}" if swap else None
    _child(names, node.child, "AFFIX hangs", "affixed to a frame", did_you_mean(swapped))
    need(names, node.parent, ExpressionType.FRAME, "E215", "AFFIX ... TO needs a FRAME or an arm")
    if node.at is None:
        return
    where, is_arm = written(node.at), isinstance(node.at, tree.ArmName)

    def advice(actual: ExpressionType) -> str:
        is_place = actual is ExpressionType.FRAME and not (is_arm and names.symbols.std is Standard.RLO_83)
        return f"for the transformation from {whence} to {where} write `AT INV({whence}) * {where}`" if is_place else ""

    note = "a FRAME is a pose in the cell; a TRANS is the transformation from one frame to another"
    need(names, node.at, ExpressionType.TRANS, "E210", "AT needs a TRANS", note=note, advice=advice)


def unfix(context: Context, node: tree.Unfix) -> None:
    """Check child and parent of one UNFIX."""
    context.changes(node.child, node.span)
    _child(context.names, node.child, "UNFIX cuts", "unfixed")
    if node.parent is not None:
        need(context.names, node.parent, ExpressionType.FRAME, "E215", "FROM needs a FRAME or an arm")


def _child(names: Names, node: tree.Mobile, verb: str, done: str, advice: str = "") -> None:
    """Check the frame that AFFIX hangs or UNFIX cuts."""
    if isinstance(node, tree.ArmName):
        text = f"an arm cannot be {done}"
        names.report("E308", text, node.span, "the cell file fixes the base of an arm", advice=advice)
    elif is_world(node):
        text = f"{called(node)} cannot be {done.partition(' ')[0]}"
        names.report("E309", text, node.span, "the root of all frames")
    else:
        need(names, node, ExpressionType.FRAME, "E215", f"{verb} a FRAME")


CHECKS: Checks = {tree.Assign: assign, tree.Affix: affix, tree.Unfix: unfix}
