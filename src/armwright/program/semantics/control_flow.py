"""Conditionals, loops, concurrent branches, events, locks, recovery and calls."""

from armwright.program.language.diagnostic import did_you_mean, labels
from armwright.program.language.error_kinds import KINDS
from armwright.program.language.kinds import VariableKind, VariableType
from armwright.program.semantics.context import Checks, Context
from armwright.program.semantics.expression_types import (
    TYPE_OF_KIND,
    ExpressionType,
    declared_type_phrase,
    expression_text,
    variable_phrase,
)
from armwright.program.semantics.quantities import check_range, check_unit
from armwright.program.semantics.scopes import NameResolver
from armwright.program.semantics.type_check import (
    check_any,
    report_constant_assignment,
    require_condition,
    require_quantity,
    require_type,
)
from armwright.program.syntax import tree


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
    context.check_list(*node.body)
    require_condition(context.names, node.condition, "UNTIL")


def for_(context: Context, node: tree.For) -> None:
    """Check variable, bounds, step and body of a FOR."""
    names, variable = context.names, node.variable
    if isinstance(variable, tree.Poison):
        names.mark_used(variable.names)
    else:
        kind = names.type(variable)
        if names.scope.is_constant(variable.key):
            report_constant_assignment(names, variable)
        elif kind is not None and kind != VariableType(VariableKind.SCALAR):
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
    # A branch is another process: it switches no WHEN of this one, and no action of this one brakes its MOVEs.
    watches, interrupting = context.watches, context.interrupting
    context.watches, context.interrupting = {}, interrupting and context.procedure is not None
    for branch in node.branches:
        if branch.priority is not None:
            check_unit(context.names, branch.priority, None, "a priority has no unit")
        context.check_with(branch.body, recovering=False)
    context.watches, context.interrupting = watches, interrupting


def event(context: Context, node: tree.Signal | tree.Wait) -> None:
    """Check the event of a SIGNAL or WAIT."""
    what = f"{type(node).__name__.upper()} needs an EVENT"
    declared = "an event is declared with EVENT as its type, such as `VAR ready : EVENT ;`"
    until = f"write `WAIT UNTIL {expression_text(node.event)}`" if isinstance(node, tree.Wait) else declared

    def advice(actual: ExpressionType) -> str:
        return until if actual is ExpressionType.CONDITION else declared

    require_type(context.names, node.event, ExpressionType.EVENT, "E223", what, advice=advice)
    if isinstance(node, tree.Wait):
        _limit(context, node)


def wait_until(context: Context, node: tree.WaitUntil) -> None:
    """Check condition, time and statement of a WAIT UNTIL."""
    require_condition(context.names, node.condition, "WAIT UNTIL")
    _limit(context, node)


def _limit(context: Context, node: tree.Wait | tree.WaitUntil) -> None:
    """Check how long a wait may last, and what is done then."""
    if node.limit is not None and require_quantity(context.names, node.limit, "time", "WITHIN needs a time"):
        check_range(context.names, node.limit, "a time", zero=True)
    if node.otherwise is not None:
        context.check(node.otherwise)


def pause(context: Context, node: tree.Pause) -> None:
    """Check the time of a PAUSE."""
    if require_quantity(context.names, node.duration, "time", "PAUSE needs a time"):
        check_range(context.names, node.duration, "a pause", zero=True)


def when(context: Context, node: tree.When) -> None:
    """Check name, priority, condition and action of a WHEN."""
    names, name = context.names, node.name
    if node.priority is not None:
        check_unit(names, node.priority, None, "a priority has no unit")
    require_condition(names, node.condition, "WHEN")
    if name is not None:
        if (first := context.watches.get(name.key)) is not None:
            text, here = f"`{name.text}` is the name of two WHENs", labels(first.head, "first")
            names.report("E241", text, name.span, "second", secondary=here, advice="give this one another name")
        context.watches[name.key] = node
    outside, context.interrupting = context.interrupting, True
    context.check_with(node.action, recovering=False)
    context.interrupting = outside


def watch_switch(context: Context, node: tree.WatchSwitch) -> None:
    """Check that what is armed or disarmed is a WHEN of a block around it."""
    names, name = context.names, node.name
    if name.key not in context.watches:
        near = names.closest_name(
            name.text, lambda: [watch.name.text for watch in context.watches.values() if watch.name]
        )
        advice = (
            did_you_mean(near) or f"write `WHEN {name.text} : condition DO ...` before, in this block or one around it"
        )
        names.report("E242", f"no WHEN here is called `{name.text}`", name.span, "not known here", advice=advice)


def interrupted_move(context: Context, node: tree.Brake | tree.Resume) -> None:
    """Check that BRAKE or RESUME may be run by the action of a WHEN."""
    if not context.interrupting:
        word, note = type(node).__name__.upper(), "it acts on the MOVE that a WHEN interrupts"
        text, advice = (
            f"{word} is outside of the action of a WHEN",
            f"write `WHEN condition DO BEGIN ... {word} ... END`",
        )
        context.names.report("E243", text, node.span, "which MOVE?", note=note, advice=advice)


def lock(context: Context, node: tree.Lock) -> None:
    """Check what is locked, which may be of any type, and a whole array too; then the body."""
    for target in node.targets:
        check_any(context.names, target)
    context.check(node.body)


def try_(context: Context, node: tree.Try) -> None:
    """Check both parts. An error in a RECOVER part goes outward: a TRY inside of it has a RECOVER of its own."""
    context.names.recovered += [kind for kind in node.kinds if isinstance(kind, tree.Name)]
    context.check_with(tree.Block(node.span, node.body, node.recover), recovering=False)
    context.check_with(tree.Block(node.span, node.recovery, node.end), recovering=True)


def retry(context: Context, node: tree.Retry) -> None:
    """Check that a RETRY stands in a RECOVER part."""
    if not context.recovering:
        text, advice = "RETRY is outside of RECOVER", "write `TRY ... RECOVER ... RETRY END`"
        note = "RETRY repeats the TRY of the RECOVER that contains it"
        context.names.report("E225", text, node.span, "retry what?", note=note, advice=advice)


def raise_(context: Context, node: tree.Raise) -> None:
    """Check kind and text of a RAISE."""
    names, kind = context.names, node.kind
    if kind.key in KINDS:
        text, note = f"`{kind.text}` is a kind of errors of the language", f"it stands for: {KINDS[kind.key]}"
        advice = "give the errors of the program a name of their own"
        names.report("E236", text, kind.span, "not a kind of its own", note=note, advice=advice)
    names.raised.setdefault(kind.key, kind.text)
    if node.text is not None:
        require_type(names, node.text, ExpressionType.TEXT, "E217", "RAISE ... WITH needs a text")


def report_unknown_kinds(names: NameResolver) -> None:
    """Report kinds of errors that a RECOVER names and that nothing can be."""
    for kind in names.recovered:
        if kind.key not in KINDS and kind.key not in names.raised:
            near = names.closest_name(kind.text, lambda: [*KINDS, *names.raised.values()])
            advice = did_you_mean(near) or f"write `RAISE {kind.text}` where it occurs"
            note = f"kinds of the language are {', '.join(KINDS)}"
            text = f"no error is of the kind `{kind.text}`"
            names.report("E236", text, kind.span, "nothing raises it", note=note, advice=advice)


def return_(context: Context, node: tree.Return) -> None:
    """Check that a RETURN gives a value of the type of its FUNCTION."""
    names, procedure = context.names, context.procedure
    if procedure is None or procedure.result is None:
        check_any(names, node.value)
        return
    required = TYPE_OF_KIND[procedure.result.kind]
    what = f"`{procedure.node.name.text}` gives {variable_phrase(required)}"
    require_type(names, node.value, required, "E217", what)


def poison(context: Context, node: tree.Poison) -> None:
    """Report nothing of the names in a statement that could not be parsed."""
    context.names.mark_used(node.names)
    context.names.poison(*node.names)


CHECKS: Checks = {
    tree.Block: lambda context, node: context.check_list(*node.statements),
    tree.If: if_,
    tree.While: while_,
    tree.Repeat: repeat,
    tree.For: for_,
    tree.Cobegin: cobegin,
    tree.Signal: event,
    tree.Wait: event,
    tree.WaitUntil: wait_until,
    tree.Pause: pause,
    tree.When: when,
    tree.WatchSwitch: watch_switch,
    tree.Brake: interrupted_move,
    tree.Resume: interrupted_move,
    tree.Lock: lock,
    tree.Try: try_,
    tree.Retry: retry,
    tree.Halt: lambda *_: None,
    tree.Raise: raise_,
    tree.Return: return_,
    tree.Call: lambda context, node: context.calls.check(node, context.procedure),
    tree.Poison: poison,
}
