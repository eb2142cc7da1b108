"""The built-in functions of the language: their parameters, and the types of their results."""

from collections.abc import Mapping, Sequence

import attrs

from armwright.errors import counted
from armwright.program.language.units import Dimension
from armwright.program.language.words import FUNCTIONS_OF_NAMES
from armwright.program.semantics.expression_types import ACCEPTED_TYPES, ExpressionType, quote_expression, variable_keys
from armwright.program.semantics.quantities import check_unit
from armwright.program.semantics.scopes import NameResolver
from armwright.program.semantics.symbols import Scope
from armwright.program.syntax import tree

AXES = ("X", "Y", "Z")
# Functions whose argument is an axis, not a variable.
WITH_AXIS = ("FORCE", "TORQUE")
# Functions whose argument is an input or a device of the cell.
WITH_INPUT = ("INPUT", "ANALOG")
WITH_DEVICE = (*WITH_INPUT, "OUTPUT", "SETTING")
# Functions whose argument is a name that is no variable.
WITH_NAME = FUNCTIONS_OF_NAMES
# Functions whose argument is a name that is not declared.
WITH_KEY = tuple(function for function in WITH_NAME if function not in WITH_AXIS)
# Functions of the queue of an arm, which is their first argument.
WITH_QUEUE = ("QUEUED", "CAPACITY", "AWAITED")
# The goal of a MOVE by the positions of the joints, or by the name of a joint target of the cell.
JOINTS = "JOINTS"
# Procedures of programs may not have the names of these: all other functions came later than such programs.
FIRST_FUNCTIONS = ("XYZ", "ROTX", "ROTY", "ROTZ", "INV", "DIST", "FORCE")


@attrs.frozen
class Signature:
    """The parameters and the result of a function.

    Attributes:
        parameters: as a message says it.
        count: how many there are.
        argument_types: what each argument may be.
        result: the type of the value; of INV it depends on the argument.
        dimension: what a number with a unit must measure; None where it may measure anything.
        more: whether there may be more arguments than that.
    """

    parameters: str
    count: int
    argument_types: frozenset[ExpressionType]
    result: ExpressionType
    dimension: Dimension | None = None
    more: bool = False


_SCALARS = ACCEPTED_TYPES[ExpressionType.SCALAR]
_FRAMES = ACCEPTED_TYPES[ExpressionType.FRAME]
_POSES = ACCEPTED_TYPES[ExpressionType.TRANS] | {ExpressionType.FRAME}
_INVERTIBLE = _POSES | {ExpressionType.INVERSE}
_PRINTABLE = frozenset(ExpressionType) - {ExpressionType.EVENT}
_NUMBER, _TRANS = ExpressionType.SCALAR, ExpressionType.TRANS
# Numbers out of poses: positions, angles of roll, pitch and yaw, and the one rotation about an axis.
MEASURES = ("X", "Y", "Z", "ROLL", "PITCH", "YAW", "ANGLE", "AXISX", "AXISY", "AXISZ")
FUNCTIONS: Mapping[str, Signature] = {
    "XYZ": Signature("three lengths", 3, _SCALARS, ExpressionType.TRANS, "length"),
    **dict.fromkeys(("ROTX", "ROTY", "ROTZ"), Signature("one angle", 1, _SCALARS, ExpressionType.TRANS, "angle")),
    "TEXT": Signature("a value or more", 1, _PRINTABLE, ExpressionType.TEXT, more=True),
    JOINTS: Signature("a position for each joint", 1, _SCALARS, ExpressionType.FRAME, more=True),
    "INV": Signature("one TRANS or FRAME", 1, _INVERTIBLE, ExpressionType.TRANS),
    "DIST": Signature("two FRAMEs", 2, _FRAMES, ExpressionType.SCALAR),
    **dict.fromkeys(WITH_AXIS, Signature("one axis, X, Y or Z", 1, frozenset(), ExpressionType.SCALAR)),
    **dict.fromkeys(("INPUT", "OUTPUT"), Signature("one name of the cell", 1, frozenset(), ExpressionType.CONDITION)),
    **dict.fromkeys(("ANALOG", "SETTING"), Signature("one name of the cell", 1, frozenset(), _NUMBER)),
    "TIMER": Signature("one name of a timer", 1, frozenset(), _NUMBER),
    **dict.fromkeys(("QUEUED", "CAPACITY"), Signature("one arm", 1, _FRAMES, _NUMBER)),
    "AWAITED": Signature("an arm and a number", 2, _FRAMES | _SCALARS, ExpressionType.FRAME),
    "RPY": Signature("three angles", 3, _SCALARS, _TRANS, "angle"),
    "ROT": Signature("the three components of an axis and an angle", 4, _SCALARS, _TRANS, "angle"),
    **dict.fromkeys(MEASURES, Signature("one FRAME or TRANS", 1, _POSES, _NUMBER)),
    **dict.fromkeys(("SIN", "COS", "TAN"), Signature("one angle", 1, _SCALARS, _NUMBER, "angle")),
    **dict.fromkeys(("ABS", "SQRT", "ASIN", "ACOS", "ROUND"), Signature("one number", 1, _SCALARS, _NUMBER)),
    **dict.fromkeys(("ATAN2", "MOD"), Signature("two numbers", 2, _SCALARS, _NUMBER)),
    **dict.fromkeys(("MIN", "MAX"), Signature("two numbers or more", 2, _SCALARS, _NUMBER, more=True)),
}
_INVERSES = {ExpressionType.FRAME: ExpressionType.INVERSE, ExpressionType.INVERSE: ExpressionType.FRAME}


def result_type(
    names: NameResolver, node: tree.Function, argument_types: Sequence[ExpressionType | None]
) -> ExpressionType | None:
    """Return the type of the result of a built-in function, and report what is wrong with its arguments.

    Args:
        names: the names, and where errors are reported.
        node: a call of one of ``FUNCTIONS``.
        argument_types: types of the arguments; not used where the argument is an axis.
    """
    key, signature = node.name.key, FUNCTIONS[node.name.key]
    if key == JOINTS:
        text, advice = "JOINTS is no value: it says where a MOVE ends", "write `MOVE ARM_1 TO JOINTS(...)`"
        names.report("E245", text, node.span, "not the goal of a MOVE", advice=advice)
        return None
    required = f"{key} takes {signature.parameters}"
    given = len(node.arguments)
    if given < signature.count or (given > signature.count and not signature.more):
        count = counted(given, "argument")
        names.report("E220", f"{required}, not {count}", node.span, f"{count} here")
        return signature.result if key != "INV" else None
    if key in WITH_NAME:
        (_check_axis if key in WITH_AXIS else _check_key)(names, key, node.arguments[0])
        return signature.result
    if key in WITH_QUEUE:
        _check_queue(names, key, node.arguments, argument_types)
        return signature.result
    for argument, argument_type in zip(node.arguments, argument_types, strict=True):
        if argument_type is ExpressionType.EVENT:
            names.report_event(argument)
        elif argument_type is not None and argument_type not in signature.argument_types:
            names.report_type("E220", argument, argument_type, required)
        elif argument_type is not None and signature.dimension is not None:
            check_unit(names, argument, signature.dimension, required)
    if key != "INV":
        return signature.result
    inverted = argument_types[0]
    return _INVERSES.get(inverted, inverted) if inverted in signature.argument_types else None


def is_joints(scope: Scope, node: tree.Node) -> bool:
    """Whether an expression is JOINTS with its arguments, and not a call of a procedure of this name."""
    return isinstance(node, tree.Function) and node.name.key == JOINTS and JOINTS not in scope.symbols.procedures


def joint_target(scope: Scope, node: tree.Function) -> tree.Name | None:
    """Return the one argument of JOINTS where that is the name of a joint target, as nothing else is called so."""
    only = node.arguments[0] if len(node.arguments) == 1 else None
    if not isinstance(only, tree.Name) or scope.is_value(only.key):
        return None
    return None if only.key in scope.table(only.key).types else only


def _check_key(names: NameResolver, function: str, node: tree.Expression) -> None:
    if isinstance(node, tree.Name) and function == "TIMER":
        names.timers_read.append(node)
    if isinstance(node, tree.Poison | tree.Name):
        return
    names.mark_used(variable_keys(node))
    what = "input" if function in WITH_INPUT else "timer" if function == "TIMER" else "device"
    name = {"input": "an input of the cell", "device": "a device of the cell"}.get(what, "a timer")
    text = f"{function} takes the name of {name}, not {quote_expression(node)}"
    names.report("E220", text, node.span, f"no {what}")


def _check_queue(
    names: NameResolver,
    function: str,
    arguments: Sequence[tree.Expression],
    argument_types: Sequence[ExpressionType | None],
) -> None:
    arm, *numbers = arguments
    if not isinstance(arm, tree.ArmName | tree.Poison):
        text, advice = (
            f"{function} takes an arm, not {quote_expression(arm)}",
            f"write `{function}(ARM_1{', 1' * len(numbers)})`",
        )
        names.report("E220", text, arm.span, "no arm", advice=advice)
    for argument, argument_type in zip(numbers, argument_types[1:], strict=True):
        if argument_type is not None and argument_type not in _SCALARS:
            names.report_type("E220", argument, argument_type, f"{function} takes an arm and a number")


def _check_axis(names: NameResolver, function: str, node: tree.Expression) -> None:
    if isinstance(node, tree.Poison) or (isinstance(node, tree.Name) and node.key in AXES):
        return
    names.mark_used(variable_keys(node))
    text = f"{function} takes one axis, X, Y or Z, not {quote_expression(node)}"
    names.report("E220", text, node.span, "no axis", advice=f"write `{function}(Z)`")
