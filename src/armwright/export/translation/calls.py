"""Procedures and functions: arguments by value, and other names of variables where a procedure changes them."""

from armwright.cell.frames import WORLD
from armwright.export.translation.code import Call, FunctionCall, Number, Procedure, Value, Variable
from armwright.export.translation.context import KINDS, Context, Translators, Version
from armwright.export.translation.frames import Attachments, Hanging
from armwright.export.translation.values import frame_of, plain_variable, value_of
from armwright.program.language.kinds import VariableKind
from armwright.program.language.source import Span
from armwright.program.semantics.symbols import ProcedureSymbols
from armwright.program.syntax import tree


def call(context: Context, node: tree.Call) -> None:
    """Translate the call of a procedure."""
    key, arguments = _called(context, node.name, node.arguments, node.span)
    context.out.append(Call(span=node.span, procedure=key, arguments=arguments))


def call_function(context: Context, node: tree.Function) -> Value:
    """Return the value of a FUNCTION."""
    return FunctionCall(*_called(context, node.name, node.arguments, node.span))


def _called(
    context: Context, name: tree.Name, arguments: tuple[tree.Expression, ...], span: Span
) -> tuple[str, tuple[Value, ...]]:
    """Return the key of a procedure as a call needs it, and the arguments that it passes."""
    own = context.scope.symbols.procedures.get(name.key)
    if own is None or own.node not in context.compiled.whole.procedures:
        text = f"`{name.text}` is no procedure of this file"
        context.refuse(span, text, "it is called here", "write it into the program")
    if name.key in context.active:
        text = f"`{name.text}` calls itself, which programs of controllers cannot do in general"
        context.refuse(span, text, "called here", "write a loop")
    by_name = dict(zip(own.parameters, arguments, strict=True))
    substituted = frozenset(key for key in own.parameters if key in own.inout or own.types[key].sizes)  # type: ignore[union-attr]
    while True:
        version = _version(context, own, by_name, substituted, span)
        changed = {key for key in own.parameters if _changes(context, own, key, by_name[key], version)}
        if changed <= substituted:
            break
        substituted |= changed
    context.written |= version.written
    context.attachments = version.after.copy()
    passed = tuple(value_as_kept(context, by_name[key]) for key in own.parameters if key not in substituted)
    return version.procedure.key, passed


def value_as_kept(context: Context, node: tree.Expression) -> Value:
    """Return the value of an argument: of a frame that an arm carries, where it is on the tool."""
    if _is_frame_variable(context, node):
        return frame_of(context, node)[1]
    return value_of(context, node)


def _is_frame_variable(context: Context, node: tree.Expression) -> bool:
    if not isinstance(node, tree.Name | tree.Index):
        return False
    name = node.name if isinstance(node, tree.Index) else node
    found = context.scope.type(name.key)
    return found is not None and found.kind is VariableKind.FRAME and name.key != WORLD


def _changes(context: Context, own: ProcedureSymbols, key: str, node: tree.Expression, version: Version) -> bool:
    """Whether a procedure changes a parameter by value that stands for a frame of the caller, or changes that frame."""
    if key in version.substituted or not _is_frame_variable(context, node):
        return False
    name, variable = frame_of(context, node)
    mine = f"{own.node.name.key}.{key}"
    return (
        mine in version.written or variable.key in version.written or mine in version.rehung or name in version.rehung
    )


def _version(
    context: Context,
    own: ProcedureSymbols,
    by_name: dict[str, tree.Expression],
    substituted: frozenset[str],
    span: Span,
) -> Version:
    """Translate a procedure for a call, or return what was translated for one like it."""
    prefix, name = f"{own.node.name.key}.", own.node.name.key
    inside, bindings = context.attachments.copy(), dict[str, Variable]()
    for key in own.parameters:
        node = by_name[key]
        kind = own.types[key]
        if kind is None or kind.kind not in KINDS:
            context.refuse(span, f"`{own.node.name.text}` takes what controllers do not know", "called here")
        if key in substituted:
            bindings[key] = _bound(context, node, key, own)
        elif kind.kind is VariableKind.FRAME and _is_frame_variable(context, node):
            inside.replace(f"{prefix}{key}", context.attachments[frame_of(context, node)[0]])
        elif kind.kind is VariableKind.FRAME:
            inside.replace(f"{prefix}{key}", Hanging(frozenset({WORLD})))
    found = (name, inside, tuple(sorted(bindings.items(), key=lambda item: item[0])))
    if found not in context.versions:
        context.versions[found] = _translated(context, own, inside, bindings, substituted)
    return context.versions[found]


def _bound(context: Context, node: tree.Expression, key: str, own: ProcedureSymbols) -> Variable:
    """Return the variable of the caller that a parameter is another name of."""
    variable = None
    if isinstance(node, tree.Name | tree.Index):
        variable = frame_of(context, node)[1] if _is_frame_variable(context, node) else plain_variable(context, node)
    if variable is None or not all(isinstance(index, Number) for index in variable.indices):
        text = f"`{own.node.name.text}` changes its parameter `{key.lower()}`, which here is no single variable"
        context.refuse(node.span, text, "passed here", "copy it into a variable before, and back behind the call")
    return variable


def _translated(
    context: Context,
    own: ProcedureSymbols,
    inside: Attachments,
    bindings: dict[str, Variable],
    substituted: frozenset[str],
) -> Version:
    """Translate the body of a procedure."""
    name, prefix = own.node.name.key, f"{own.node.name.key}."
    outside = (context.scope, context.prefix, context.bindings, context.attachments, context.written, context.out)
    context.scope, context.prefix = context.scope.symbols.scope(name), prefix
    context.bindings, context.attachments, context.written, context.out = bindings, inside.copy(), set(), []
    context.active.append(name)
    parameters = []
    for key in own.parameters:
        if key not in substituted:
            kind = KINDS[own.types[key].kind]  # type: ignore[union-attr]
            context.kinds[f"{prefix}{key}"] = kind
            parameters.append((f"{prefix}{key}", kind))
    if own.result is not None and own.result.kind not in KINDS:
        context.refuse(own.node.head, "a function of controllers has a number, a condition or a pose", "another value")
    body = context.block(*own.node.body.statements)
    # A function changes nothing, and behind a HALT there is nothing.
    after = inside.copy() if own.result is not None else context.attachments
    written = frozenset(context.written)
    context.active.pop()
    context.scope, context.prefix, context.bindings, context.attachments, context.written, context.out = outside
    number = sum(1 for one in context.procedures if one.key.split("#")[0] == name)
    procedure = Procedure(
        key=f"{name}#{number + 1}" if number else name,
        parameters=tuple(parameters),
        result=None if own.result is None else KINDS[own.result.kind],
        body=body,
    )
    same = [one for one in context.procedures if _alike(one, procedure)]
    if same:
        procedure = same[0]
    else:
        context.procedures.append(procedure)
    rehung = frozenset(one for one in inside.names() if after[one].parents and after[one] != inside[one])
    after.drop(prefix)
    return Version(procedure, substituted, written, after, rehung)


def _alike(first: Procedure, second: Procedure) -> bool:
    """Whether two versions of a procedure say the same."""
    return first.key.split("#")[0] == second.key.split("#")[0] and repr(
        (first.parameters, first.result, first.body)
    ) == repr((second.parameters, second.result, second.body))


TRANSLATORS: Translators = {tree.Call: call}
