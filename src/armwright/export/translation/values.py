"""Values of a program: numbers, conditions and poses; what is constant is worked out at once."""

import math
from collections.abc import Iterable, Mapping
from typing import TypeAlias

import numpy as np

from armwright.cell.frames import WORLD
from armwright.export.translation.code import (
    FunctionCall,
    Number,
    Operation,
    Pose,
    Signal,
    Truth,
    Value,
    Variable,
    values_of,
)
from armwright.export.translation.context import KINDS, Context
from armwright.export.translation.frames import is_array
from armwright.program.bytecode.instructions import Op
from armwright.program.language.kinds import VariableKind
from armwright.program.language.names import is_arm
from armwright.program.language.units import UnitSystem, convert
from armwright.program.syntax import pose_literals, tree
from armwright.program.vm.operators import OPERATIONS, OPERATIONS_WITH_UNITS, EvaluationError

Constant: TypeAlias = Number | Truth | Pose

_ARITHMETIC: Mapping[str, Op] = {"+": Op.ADD, "-": Op.SUB, "*": Op.MUL, "/": Op.DIV}
_COMPARISONS: Mapping[str, Op] = {"<": Op.LT, "<=": Op.LE, "=": Op.EQ, "<>": Op.NE, ">=": Op.GE, ">": Op.GT}
_OTHERS = {"negative": Op.NEG, "not": Op.NOT, "compose": Op.MUL, "inverse": Op.INV}
# Functions that the languages of controllers have too, or that can be written in them.
_FUNCTIONS: tuple[str, ...] = ("XYZ", "ROTX", "ROTY", "ROTZ", "RPY", "DIST", "X", "Y", "Z")
_FUNCTIONS += ("ABS", "SQRT", "SIN", "COS", "TAN", "ATAN2")
_OPERATIONS = {**_ARITHMETIC, **_COMPARISONS, **_OTHERS, **{name.lower(): Op[name] for name in _FUNCTIONS}}


def value_of(context: Context, node: tree.Node) -> Value:  # noqa: PLR0911 - one case per kind
    """Return the value of an expression.

    Raises:
        ExportError: it has what cannot be translated.
    """
    match node:
        case tree.Number():
            return Number(float(convert(node.value, node.unit, context.scope.symbols.units)))
        case tree.Name() if context.scope.is_value(node.key):
            return _value_of_language(context, node)
        case tree.ArmName():
            return _arm(context, node)
        case tree.Name() | tree.Index():
            return _variable(context, node)
        case tree.Unary(operation=operation, operand=operand):
            return operate(context, "not" if operation == "NOT" else "negative", value_of(context, operand), node=node)
        case tree.Binary():
            return _chain(context, node)
        case tree.Matrix():
            return _matrix(context, node)
        case tree.Function():
            return _function(context, node)
    return context.refuse_construct(node)


def operate(context: Context, name: str, *arguments: Value, node: tree.Node) -> Value:
    """Return what an operation makes of values: a constant where all of them are."""
    constants = [argument for argument in arguments if isinstance(argument, Number | Truth | Pose)]
    if len(constants) == len(arguments) and name in _OPERATIONS:
        return _constant(context, name, tuple(constants), node)
    return simplified(name, arguments)


def simplified(name: str, arguments: tuple[Value, ...]) -> Value:  # noqa: PLR0911 - one case per rule
    """Return an operation without what changes nothing in it."""
    match name, arguments:
        case "compose", (Pose() as first, other) if first.is_identity:
            return other
        case "compose", (other, Pose() as last) if last.is_identity:
            return other
        case "compose", (Operation("compose", (first, Pose(X))), Pose(Y)):
            return Operation("compose", (first, Pose(X @ Y)))
        case ("inverse", (Operation("inverse", (inner,)),)) | ("not", (Operation("not", (inner,)),)):
            return inner
        case "inverse", (Pose(X),):
            return Pose(np.linalg.inv(X))
        case "compose", (Pose(X), Pose(Y)):
            return Pose(X @ Y)
    return Operation(name, arguments)


def _constant(context: Context, name: str, arguments: tuple[Constant, ...], node: tree.Node) -> Value:
    try:
        return worked_out(name, arguments, context.scope.symbols.units)
    except EvaluationError as error:
        context.refuse(node.span, error.message, error.label, code="E619")


def worked_out(name: str, arguments: Iterable[Constant], units: UnitSystem) -> Constant:
    """Return what an operation of the language makes of constants.

    Raises:
        EvaluationError: it has no value.
    """
    op = _OPERATIONS[name]
    plain = [one.X if isinstance(one, Pose) else one.value for one in arguments]
    result = OPERATIONS[op](*plain, *((units,) if op in OPERATIONS_WITH_UNITS else ()))
    if isinstance(result, bool | np.bool_):
        return Truth(bool(result))
    return Pose(result) if isinstance(result, np.ndarray) else Number(float(result))


def number_of(context: Context, node: tree.Node) -> float:
    """Return a number that has to be constant.

    Raises:
        ExportError: it is none.
    """
    value = value_of(context, node)
    if not isinstance(value, Number):
        text = "this number is worked out while the program runs, and the motion of the controller is fixed before"
        context.refuse(node.span, text, "not constant", "write a constant")
    return value.value


# ---- kinds of expressions ------------------------------------------------------------------------------------------


def _value_of_language(context: Context, node: tree.Name) -> Value:
    if node.key in ("TRUE", "FALSE"):
        return Truth(node.key == "TRUE")
    if node.key != "PI":
        context.refuse_construct(node)
    return Number(math.pi)


def _arm(context: Context, node: tree.ArmName) -> Value:
    require_arm(context, node)
    return context.hand()


def require_arm(context: Context, node: tree.Node) -> None:
    """Refuse another arm than that of the controller.

    Raises:
        ExportError: it is another one.
    """
    if isinstance(node, tree.ArmName) and node.key != context.arm:
        text = f"the program of a controller moves one arm, here {context.arm}"
        context.refuse(node.span, text, f"{node.key} is another one", code="E613")


def name_of(node: tree.Node) -> tree.Name:
    """Return the name of a variable, or of the array of an element."""
    name = node.name if isinstance(node, tree.Index) else node
    assert isinstance(name, tree.Name)  # noqa: S101 - a checked program has no other
    return name


def _variable(context: Context, node: tree.Node) -> Value:
    name = name_of(node)
    if is_arm(name.key):
        return context.hand()
    if name.key == WORLD:
        return Pose(np.eye(4))
    constant = context.constants.get(name.key) if context.scope.is_constant(name.key) else None
    if constant is not None and not isinstance(constant, str):
        return constant
    kind = context.type_of(name).kind
    if kind is VariableKind.FRAME:
        return read_frame(context, node)
    return plain_variable(context, node)


def plain_variable(context: Context, node: tree.Node) -> Variable:
    """Return a variable that is no frame, or an element of one, as it is written and read."""
    name = name_of(node)
    own = context.type_of(name)
    bound = context.bindings.get(name.key) if context.scope.is_parameter(name.key) else None
    variable = context.declare(context.key(name.key), KINDS[own.kind], own.sizes) if bound is None else bound
    if isinstance(node, tree.Index):
        return Variable(variable.key, tuple(value_of(context, index) for index in node.indices))
    return variable


def _chain(context: Context, node: tree.Binary) -> Value:
    first, links = tree.operation_chain(node)
    left = value_of(context, first)
    for link in links:
        right, name = value_of(context, link.right), link.operation.lower()
        if name in ("and", "or"):
            _refuse_careful(context, link, right)
        elif name == "*" and is_pose(context, left):
            name = "compose"
        left = operate(context, name, left, right, node=link)
    return left


def _refuse_careful(context: Context, link: tree.Binary, right: Value) -> None:
    """Refuse a right side that may have no value where the left one decides: controllers work out both."""
    for value in values_of(right):
        element = isinstance(value, Variable) and not all(isinstance(index, Number) for index in value.indices)
        if element or isinstance(value, FunctionCall) or (isinstance(value, Operation) and value.name in ("/", "sqrt")):
            text = f"the controller works out both sides of {link.operation}, and the right one may have no value then"
            context.refuse(link.right.span, text, "worked out always", "write two IFs, one in the other")


def is_pose(context: Context, value: Value) -> bool:
    """Whether a value is a pose."""
    match value:
        case Pose() | Operation("compose" | "inverse" | "xyz" | "rotx" | "roty" | "rotz" | "rpy", _):
            return True
        case Variable(key=key):
            return context.kinds.get(key) == "pose"
        case FunctionCall(procedure=key):
            return any(one.key == key and one.result == "pose" for one in context.procedures)
    return False


def _matrix(context: Context, node: tree.Matrix) -> Value:
    if all(isinstance(item, tree.Number) for item in node.items):
        lengths = [number_of(context, item) for item in node.items[9:]]
        numbers = [*pose_literals.pose_numbers(node)[:9], *lengths]
    else:
        numbers = [number_of(context, item) for item in node.items]
    try:
        return Pose(OPERATIONS[Op.MATX](*numbers, context.scope.symbols.units))
    except EvaluationError as error:
        context.refuse(node.span, error.message, error.label)


def _function(context: Context, node: tree.Function) -> Value:
    key = node.name.key
    if key in context.scope.symbols.procedures:
        return context.call_function(context, node)
    if key == "INV":
        return operate(context, "inverse", value_of(context, node.arguments[0]), node=node)
    if key in ("INPUT", "OUTPUT"):
        return _signal(context, node)
    if key not in _FUNCTIONS:
        context.refuse_construct(node)
    return operate(context, key.lower(), *(value_of(context, one) for one in node.arguments), node=node)


def _signal(context: Context, node: tree.Function) -> Value:
    name, is_input = name_of(node.arguments[0]).key, node.name.key == "INPUT"
    if is_input:
        known = context.cell.inputs.get(name)
        address = None if known is None else known.address
    else:
        address = context.cell.output_of(name)
    if address is None:
        table, key = ("inputs", "input") if is_input else ("devices", "output")
        what = "input" if is_input else "output"
        text = f"the cell file does not say which {what} of the controller {name} is"
        context.refuse(node.span, text, "it is read here", f"write `[{table}]` `{name} = {{ {key} = 1 }}`", code="E615")
    return Signal(name, address, is_input)


# ---- frames --------------------------------------------------------------------------------------------------------


def frame_of(context: Context, node: tree.Node) -> tuple[str, Variable]:
    """Return what a frame is called among those that hang somewhere, and its variable; an array is one of them."""
    name = name_of(node)
    own = context.type_of(name)
    bound = context.bindings.get(name.key) if context.scope.is_parameter(name.key) else None
    if bound is None:
        key = context.key(name.key)
        variable = context.declare(key, "pose", own.sizes, context.initial_pose(key))
    else:
        variable = bound
    if isinstance(node, tree.Index):
        variable = Variable(variable.key, tuple(value_of(context, index) for index in node.indices))
    return f"{variable.key}[]" if variable.indices else variable.key, variable


def read_frame(context: Context, node: tree.Node) -> Value:
    """Return the pose of a frame in the world."""
    name, variable = frame_of(context, node)
    with context.at(node):
        carried = context.attachments.carried_by(name) == context.arm
    return simplified("compose", (context.hand(), variable)) if carried else variable


def elements(context: Context, name: str) -> list[Variable]:
    """Return the variables of a frame, or of all elements of an array of frames."""
    key = name.removesuffix("[]")
    if not is_array(name):
        return [Variable(key)]
    sizes = context.declarations[key].sizes
    return [Variable(key, tuple(Number(float(i + 1)) for i in place)) for place in np.ndindex(sizes)]
