"""Control flow: facts along the paths through IF, loops, COBEGIN, TRY and calls."""

from collections.abc import Iterator, Sequence
from itertools import takewhile

from armwright.program.flow_analysis import concurrency, constants
from armwright.program.flow_analysis.calls import call
from armwright.program.flow_analysis.context import Context, Steps
from armwright.program.flow_analysis.definite_assignment import require_indices, require_value
from armwright.program.flow_analysis.facts import Divergence
from armwright.program.flow_analysis.lattice import EVERYTHING, Outcome, Uncertainty
from armwright.program.flow_analysis.side_effects import ANY_ARM, ANYTHING, NOTHING, SideEffects, union
from armwright.program.flow_analysis.state import LAST, Uses
from armwright.program.language.kinds import VariableKind
from armwright.program.language.names import is_any_element, is_arm
from armwright.program.language.source import Span
from armwright.program.syntax import tree

# Nesting of loops whose first pass is analysed by itself.
_MAX_LOOP_DEPTH = 3
# Branches whose side effects are combined pair by pair.
_MAX_BRANCHES = 30
# Paths of one IF that are joined name by name.
_MAX_PATHS = 100


def if_(context: Context, node: tree.If) -> None:
    """Analyse each path of an IF and join them."""
    state = context.state
    require_value(state, node.condition)
    if state.is_first_pass:
        state.forget(context.side_effects(node))
        return
    chain, otherwise = node.else_if_chain
    outcomes: list[Outcome | None] = []
    with state.conditional():
        for statement in chain:
            if statement is not node:
                require_value(state, statement.condition)
            outcomes.append(context.path(statement.then))
        outcomes.append(context.path(*(() if otherwise is None else (otherwise,))))
    if len(outcomes) > _MAX_PATHS and any(outcome is not None for outcome in outcomes):
        state.forget(context.side_effects(node))
        return
    message, advice = "it gets a value on one side of this IF only", "give it a value before the IF, or on both sides"
    context.merge(*outcomes, divergence=state.divergence(node.head, message, advice))


def while_(context: Context, node: tree.While) -> None:
    """Analyse a loop with its test at the top."""
    require_value(context.state, node.condition)
    runs = constants.condition_value(node.condition, context.state.constant) is True
    _pretested_loop(context, node, runs=runs)


def repeat(context: Context, node: tree.Repeat) -> None:
    """Analyse a loop with its test at the end."""
    _loop(context, node, *node.body)
    if not context.state.ended:
        require_value(context.state, node.condition)


def for_(context: Context, node: tree.For) -> None:
    """Analyse a counting loop."""
    state = context.state
    require_value(state, node.first, node.last, node.step)
    passes = constants.iteration_count(node, state.constant)
    variable = state.variable(node.variable, VariableKind.SCALAR)
    if passes == 0:
        return
    if variable is not None:
        state.set_number(variable, state.number(node.first) if passes == 1 else None, node.head)
    if passes == 1:
        context.follow(node.body)
    else:
        _pretested_loop(context, node, runs=passes is not None)


def _pretested_loop(context: Context, node: tree.While | tree.For, *, runs: bool) -> None:
    """Analyse a loop that may not run at all unless it is certain that it ``runs``."""
    if runs:
        _loop(context, node, node.body)
        return
    state, word = context.state, type(node).__name__.upper()
    message, advice = f"inside this {word}, which may not run at all", f"give it a value before the {word}"
    divergence = state.divergence(node.head, f"it gets a value {message}", advice)
    with state.conditional():
        _loop(context, node, node.body, divergence=divergence)


def _loop(context: Context, node: tree.Statement, *body: tree.Statement, divergence: Divergence | None = None) -> None:
    """Analyse a loop: its first pass, then any pass, with what the loop changes invalidated.

    Args:
        context: the analysis.
        node: the loop.
        body: its statements.
        divergence: of a loop that may not run at all.
    """
    state, effects = context.state, context.side_effects(node)
    if state.is_first_pass:
        if divergence is None:
            context.follow(*body)
        state.forget(effects)
        return
    if context.loops < _MAX_LOOP_DEPTH:
        # Analyse what is certain to run in the first of several passes, and roll back.
        state.is_first_pass = True
        context.path(*body)
        state.is_first_pass = False
    context.loops += 1
    mark = state.facts.checkpoint()
    none = state.facts.outcome(mark)
    state.forget(effects)
    again = context.path(*body, mark=mark)
    context.loops -= 1
    context.merge(*() if divergence is None else (none,), again, divergence=divergence)


def cobegin(context: Context, node: tree.Cobegin) -> None:
    """Analyse each branch with what the others may change invalidated."""
    state, facts = context.state, context.state.facts
    effects = [context.side_effects(branch.body) for branch in node.branches]
    last, uncertainties = state.last[LAST], facts.uncertainties
    outcomes, uses = [], []
    mark = facts.checkpoint()
    for number, branch in enumerate(node.branches):
        own = effects[number]
        # Of many branches, the others may change anything.
        others = union((*effects[:number], *effects[number + 1 :])) if len(effects) <= _MAX_BRANCHES else ANYTHING
        state.forget(others)
        state.last.set(LAST, last)
        facts.uncertainties = (*uncertainties, _uncertainty(context, own, others))
        state.branches.append(Uses({}, len(state.calls)))
        outcomes.append(context.path(branch.body))
        uses.append(state.branches.pop())
        facts.uncertainties = uncertainties
        facts.roll_back(mark)
    if not state.is_first_pass:
        concurrency.report_shared_arms(state, uses)
    if any(outcome is None for outcome in outcomes):
        state.ended = True
    else:
        facts.join([outcome for outcome in outcomes if outcome is not None], concurrent=True)
        state.last.set(LAST, last)


def _uncertainty(context: Context, own: SideEffects, others: SideEffects) -> Uncertainty:
    """Return what the other branches may change while a branch runs."""
    state = context.state
    names = frozenset(state.slots(others.names))
    mine = frozenset(arm for arm in state.slots(own.arms) if is_arm(arm) and arm not in names)
    return Uncertainty(
        names=names,
        everything=others.everything,
        arms=ANY_ARM in others.arms or bool(others.moved),
        excepted=mine | {LAST},
        moves_frames=state.side_effects.rigid and bool(others.posed),
    )


def try_(context: Context, node: tree.Try) -> None:
    """Analyse both parts: RECOVER begins with the facts that hold whichever statement failed."""
    state, effects = context.state, context.side_effects(node)
    if state.is_first_pass:
        # A failure in the first pass is recovered from, and the next pass may succeed.
        state.forget(effects)
        return
    retries = context.side_effects(*node.recovery).retries
    mark = state.facts.checkpoint()
    if retries:
        state.forget_undone(effects)
    completed = context.path(*node.body, mark=mark)
    state.forget_undone(effects if retries else context.side_effects(*node.body))
    for name in _assigned_before_failure(context, node.body):
        state.table.mark_assigned(name)
    outside, context.recovering = context.recovering, True
    recovered = context.path(*node.recovery, mark=mark)
    context.recovering = outside
    message = "it gets a value in this TRY, where a statement before may fail"
    advice = "give it a value before the TRY, or after RECOVER too"
    word = Span(node.span.start, node.span.start + len("TRY"))
    context.merge(completed, recovered, divergence=state.divergence(word, message, advice))


def _assigned_before_failure(context: Context, statements: Sequence[tree.Statement]) -> Iterator[str]:
    """Yield the variables that are assigned before any statement can fail."""
    for statement in takewhile(lambda statement: isinstance(statement, tree.Assign | tree.Print), statements):
        name = context.state.variable(statement.target) if isinstance(statement, tree.Assign) else None
        if name is not None and not is_any_element(name):
            yield name


def when(context: Context, node: tree.When) -> None:
    """Analyse an action that may run at any time, up to the end of this stretch of statements, or never."""
    state, facts = context.state, context.state.facts
    require_value(state, node.condition)
    effects = context.side_effects(node.action)
    if not state.is_first_pass:
        mark, uncertainties = facts.checkpoint(), facts.uncertainties
        facts.invalidate(EVERYTHING)
        outside, context.recovering = context.recovering, False
        with state.conditional():
            context.follow(node.action)
        context.recovering = outside
        facts.roll_back(mark)
        facts.uncertainties, state.ended = uncertainties, False
    message, advice = "it gets a value in the action of this WHEN, which may not run", "give it a value before the WHEN"
    state.forget_undone(effects, state.divergence(node.head, message, advice))
    facts.uncertainties = (*facts.uncertainties, _uncertainty(context, NOTHING, effects))
    context.braked = context.braked or bool(effects.arms) or effects.brakes or effects.everything


def lock(context: Context, node: tree.Lock) -> None:
    """Analyse the body of a LOCK."""
    require_indices(context.state, *node.targets)
    context.follow(node.body)


def end(context: Context, node: tree.Halt | tree.Retry) -> None:
    """End this path."""
    # A RETRY without a TRY has been reported.
    is_valid = isinstance(node, tree.Halt) or context.recovering
    context.state.ended, context.state.end_span = True, node.span if is_valid else None


def wait(context: Context, node: tree.Wait) -> None:
    """Analyse a wait for an event."""
    require_indices(context.state, node.event)
    _late(context, node)


def wait_until(context: Context, node: tree.WaitUntil) -> None:
    """Analyse a wait for a condition."""
    require_value(context.state, node.condition)
    _late(context, node)


def _late(context: Context, node: tree.Wait | tree.WaitUntil) -> None:
    """Analyse what may run where what is waited for does not come in time."""
    require_value(context.state, node.limit)
    message, advice = "it gets a value only where this WAIT ends too late", "give it a value before the WAIT"
    context.otherwise(node, message, advice)


def raise_(context: Context, node: tree.Raise) -> None:
    """End the path with an error."""
    require_value(context.state, node.text)
    context.state.ended, context.state.end_span = True, node.span


def return_(context: Context, node: tree.Return) -> None:
    """End the path of a FUNCTION with its value."""
    require_value(context.state, node.value)
    context.state.ended, context.state.end_span = True, node.span


STEPS: Steps = {
    tree.Block: lambda context, node: context.follow(*node.statements),
    tree.If: if_,
    tree.While: while_,
    tree.Repeat: repeat,
    tree.For: for_,
    tree.Cobegin: cobegin,
    tree.Signal: lambda context, node: require_indices(context.state, node.event),
    tree.Wait: wait,
    tree.WaitUntil: wait_until,
    tree.Pause: lambda context, node: require_value(context.state, node.duration),
    tree.When: when,
    tree.WatchSwitch: lambda *_: None,
    tree.Brake: lambda *_: None,
    tree.Resume: lambda *_: None,
    tree.Lock: lock,
    tree.Try: try_,
    tree.Retry: end,
    tree.Halt: end,
    tree.Raise: raise_,
    tree.Return: return_,
    tree.Call: call,
    tree.Poison: lambda context, node: context.state.forget(context.side_effects(node)),
}
