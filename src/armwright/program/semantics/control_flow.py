"""Control flow: choices, loops, processes, events, locks, recovery, calls."""

from armwright.program.language.kinds import VariableKind, VariableType
from armwright.program.semantics.context import Checks, Context
from armwright.program.semantics.expression_types import ExpressionType, declared_type_phrase
from armwright.program.semantics.quantities import check_range, check_unit
from armwright.program.semantics.scopes import NameResolver
from armwright.program.semantics.type_check import infer_type, require_condition, require_quantity, require_type
from armwright.program.syntax import tree


def block(context: Context, node: tree.Block) -> None:
    """Check the statements of a block."""
    context.check(*node.statements)


def if_(context: Context, node: tree.If) -> None:
    """Check conditions and statements of IF and the ELSE IFs behind it."""
    chain, otherwise = node.else_if_chain
    for choice in chain:
        require_condition(context.names, choice.condition, "IF")
        context.check(choice.then)
    if otherwise is not None:
        context.check(otherwise)


def while_(context: Context, node: tree.While) -> None:
    """Check condition and body of WHILE."""
    require_condition(context.names, node.condition, "WHILE")
    context.check(node.body)


def repeat(context: Context, node: tree.Repeat) -> None:
    """Check body and condition of REPEAT."""
    context.check(*node.body)
    require_condition(context.names, node.condition, "UNTIL")


def for_(context: Context, node: tree.For) -> None:
    """Check variable, bounds, step and body of a FOR."""
    names, variable = context.names, node.variable
    if isinstance(variable, tree.Poison):
        names.mark_used(variable.names)
    else:
        kind = names.type(variable)
        if kind is not None and kind != VariableType(VariableKind.SCALAR):
            names.poison(variable.key)
            message = f"FOR counts with a SCALAR, but `{variable.text}` is {declared_type_phrase(kind)}"
            names.report("E229", message, variable.span, str(kind), secondary=names.declaration_labels(variable.key))
    for bound in (node.first, node.last, node.step):
        if bound is not None:
            require_type(names, bound, ExpressionType.SCALAR, "E229", "the variable of FOR is a number")
    if isinstance(node.step, tree.Number) and node.step.value == 0:
        text = "a FOR with STEP 0 would never end"
        names.report("E229", text, node.step.span, "goes nowhere", advice="leave STEP out to count by 1")
    context.check(node.body)


def cobegin(context: Context, node: tree.Cobegin) -> None:
    """Check priorities and bodies of branches."""
    for branch in node.branches:
        if branch.priority is not None:
            check_unit(context.names, branch.priority, None, "a priority has no unit")
        context.check_concurrent(branch.body)


def signal(context: Context, node: tree.Signal) -> None:
    """Check the event of a SIGNAL."""
    _event(context.names, node.event, "SIGNAL")


def wait(context: Context, node: tree.Wait) -> None:
    """Check the event of a WAIT."""
    _event(context.names, node.event, "WAIT")


def _event(names: NameResolver, node: tree.Variable, who: str) -> None:
    """Check what SIGNAL or WAIT is about."""
    advice = "an event is declared with EVENT as its type, such as `VAR ready : EVENT ;`"
    require_type(names, node, ExpressionType.EVENT, "E223", f"{who} needs an EVENT", advice=lambda _: advice)


def pause(context: Context, node: tree.Pause) -> None:
    """Check the time of a PAUSE."""
    if require_quantity(context.names, node.duration, "time", "PAUSE needs a time"):
        check_range(context.names, node.duration, "a pause", zero=True)


def lock(context: Context, node: tree.Lock) -> None:
    """Check what is locked, which may be of any kind, and a whole array too; then the body."""
    for target in node.targets:
        if isinstance(target, tree.Name):
            context.names.type(target)
        else:
            infer_type(context.names, target)
    context.check(node.body)


def try_(context: Context, node: tree.Try) -> None:
    """Check both parts. An error in a RECOVER part goes outward: a TRY inside of it has a RECOVER of its own."""
    context.check_with(*node.body, recovering=False)
    context.check_with(*node.recovery, recovering=True)


def retry(context: Context, node: tree.Retry) -> None:
    """Check that a RETRY stands in a RECOVER part."""
    if not context.recovering:
        text = "RETRY is outside of RECOVER"
        note = "RETRY repeats the TRY of the RECOVER that contains it"
        context.names.report(
            "E225", text, node.span, "retry what?", note=note, advice="write `TRY ... RECOVER ... RETRY END`"
        )


def call(context: Context, node: tree.Call) -> None:
    """Check procedure and arguments of a call."""
    context.calls.check(node, context.procedure)


def mention(context: Context, node: tree.Poison) -> None:
    """Use the names of what could not be read."""
    context.names.mark_skipped(node.names)


CHECKS: Checks = {
    tree.Block: block,
    tree.If: if_,
    tree.While: while_,
    tree.Repeat: repeat,
    tree.For: for_,
    tree.Cobegin: cobegin,
    tree.Signal: signal,
    tree.Wait: wait,
    tree.Pause: pause,
    tree.Lock: lock,
    tree.Try: try_,
    tree.Retry: retry,
    tree.Halt: lambda *_: None,
    tree.Call: call,
    tree.Poison: mention,
}
