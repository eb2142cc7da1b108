"""Control flow: what holds on every path through choices, loops, branches, TRY and calls."""

import itertools
from collections.abc import Iterator, Sequence

from armwright.program.flow_analysis import concurrency
from armwright.program.flow_analysis.context import Context, Steps, of_state
from armwright.program.flow_analysis.definite_assignment import need, need_indices
from armwright.program.flow_analysis.facts import Divergence
from armwright.program.flow_analysis.lattice import Outcome, Uncertainty
from armwright.program.flow_analysis.side_effects import ANY_ARM, ANYTHING, SideEffects, union
from armwright.program.flow_analysis.state import LAST, FlowState, Uses
from armwright.program.language.kinds import VariableKind
from armwright.program.language.names import is_any_element, is_arm
from armwright.program.language.source import Span
from armwright.program.syntax import tree

# Loops inside one another of which the first pass is followed by itself.
_MAX_LOOP_DEPTH = 3
# Branches beside which one checks each other one.
_MAX_BRANCHES = 30
# Paths of one IF that are joined name by name where they meet.
_MAX_PATHS = 100


def event(state: FlowState, node: tree.Signal | tree.Wait) -> None:
    """Check the indices of an event."""
    need_indices(state, node.event)


def pause(state: FlowState, node: tree.Pause) -> None:
    """Check the time of a PAUSE."""
    need(state, node.duration)


def if_(context: Context, node: tree.If) -> None:
    """Follow each path of an IF, and go on with what holds on all of them."""
    state = context.state
    need(state, node.condition)
    if state.first:
        state.forget(context.writes(node))
        return
    chain, otherwise = node.else_if_chain
    ways: list[Outcome | None] = []
    with state.perhaps():
        for statement in chain:
            if statement is not node:
                need(state, statement.condition)
            ways.append(context.path(statement.then))
        ways.append(context.path(*(() if otherwise is None else (otherwise,))))
    if len(ways) > _MAX_PATHS and any(way is not None for way in ways):
        state.forget(context.writes(node))
        return
    says, advice = "it gets a value on one side of this IF only", "give it a value before the IF, or on both sides"
    context.merge(*ways, parting=state.parting(node.head, says, advice))


def while_(context: Context, node: tree.While) -> None:
    """Follow a loop that is tested at its top."""
    need(context.state, node.condition)
    _perhaps_never(context, node, node.head, "WHILE", (node.body,), certain=bool(context.state.holds(node.condition)))


def repeat(context: Context, node: tree.Repeat) -> None:
    """Follow a loop that is tested at its end."""
    _loop(context, node, node.body)
    if not context.state.over:
        need(context.state, node.condition)


def for_(context: Context, node: tree.For) -> None:
    """Follow a loop that counts."""
    state = context.state
    need(state, node.first, node.last, node.step)
    passes = state.passes(node)
    variable = state.variable(node.variable, VariableKind.SCALAR)
    if passes == 0:
        return
    if variable is not None:
        state.give(variable, state.number(node.first) if passes == 1 else None, node.head)
    if passes == 1:
        context.follow(node.body)
    else:
        _perhaps_never(context, node, node.head, "FOR", (node.body,), certain=passes is not None)


def _perhaps_never(
    context: Context, node: tree.Statement, head: Span, word: str, body: tuple[tree.Statement, ...], *, certain: bool
) -> None:
    """Follow a loop that may not run once."""
    state = context.state
    says, advice = f"it gets a value inside this {word}, which may not run at all", f"give it a value before the {word}"
    parting = state.parting(head, says, advice)
    if certain:
        _loop(context, node, body)
    else:
        with state.perhaps():
            _loop(context, node, body, parting)


def _loop(
    context: Context, node: tree.Statement, body: tuple[tree.Statement, ...], parting: Divergence | None = None
) -> None:
    """Follow a loop: as at the first pass, then knowing nothing of what it changes.

    Args:
        context: where it stands.
        node: the loop.
        body: what it repeats.
        parting: of a loop that may not run once.
    """
    state, writes = context.state, context.writes(node)
    if state.first:
        if parting is None:
            context.follow(*body)
        state.forget(writes)
        return
    if context.loops < _MAX_LOOP_DEPTH:
        # Follow what is certain to run at the first pass of several, and come back.
        state.first = True
        context.path(*body)
        state.first = False
    context.loops += 1
    mark = state.facts.checkpoint()
    none = state.facts.outcome(mark)
    state.forget(writes)
    again = context.path(*body, mark=mark)
    context.loops -= 1
    context.merge(*(again,) if parting is None else (none, again), parting=parting)


def cobegin(context: Context, node: tree.Cobegin) -> None:
    """Follow each branch, knowing nothing of what the others change."""
    state, facts = context.state, context.state.facts
    writes = [context.writes(branch.body) for branch in node.branches]
    last, shaky = state.last[LAST], facts.shaky
    outcomes, uses = [], []
    mark = facts.checkpoint()
    for number, branch in enumerate(node.branches):
        own, others = writes[number], _others(writes, number)
        state.forget(others)
        state.last.put(LAST, last)
        facts.shaky = (*shaky, _shaky(context, own, others))
        state.branches.append(Uses({}, len(state.calls)))
        outcomes.append(context.path(branch.body))
        uses.append(state.branches.pop())
        facts.shaky = shaky
        facts.take_back(mark)
    if not state.first:
        concurrency.shared_arms(state, uses)
    if any(outcome is None for outcome in outcomes):
        state.over = True
    else:
        facts.join([outcome for outcome in outcomes if outcome is not None], together=True)
        state.last.put(LAST, last)


def _shaky(context: Context, own: SideEffects, others: SideEffects) -> Uncertainty:
    """Return what a branch cannot know because of the others."""
    state = context.state
    names = frozenset(state.kept(others.names))
    mine = frozenset(arm for arm in state.kept(own.arms) if is_arm(arm) and arm not in names)
    return Uncertainty(
        names=names,
        everything=others.everything,
        arms=ANY_ARM in others.arms or bool(others.moved),
        excepted=mine | {LAST},
        places=state.writing.rigid and bool(others.placed),
    )


def try_(context: Context, node: tree.Try) -> None:
    """Follow both parts: recovery begins with what holds whichever statement of the first part failed."""
    state, writes = context.state, context.writes(node)
    if state.first:
        # What goes wrong at the first pass is recovered from, and may go well at the next.
        state.forget(writes)
        return
    retries = context.writes(*node.recovery).retries
    mark = state.facts.checkpoint()
    if retries:
        state.forget_undone(writes)
    well = context.path(*node.body, mark=mark)
    state.forget_undone(writes if retries else context.writes(*node.body))
    for name in _given_at_once(context, node.body):
        state.table.has(name)
    outside, context.recovering = context.recovering, True
    recovered = context.path(*node.recovery, mark=mark)
    context.recovering = outside
    says = "it gets a value in this TRY, where a statement before may fail"
    advice = "give it a value before the TRY, or after RECOVER too"
    word = Span(node.span.start, node.span.start + len("TRY"))
    context.merge(well, recovered, parting=state.parting(word, says, advice))


def _given_at_once(context: Context, statements: Sequence[tree.Statement]) -> Iterator[str]:
    """Give the variables that have a value before anything can fail."""
    for link in itertools.takewhile(lambda statement: isinstance(statement, tree.Assign | tree.Print), statements):
        name = context.state.variable(link.target) if isinstance(link, tree.Assign) else None
        if name is not None and not is_any_element(name):
            yield name


def lock(context: Context, node: tree.Lock) -> None:
    """Follow the body of a LOCK."""
    need_indices(context.state, *node.targets)
    context.follow(node.body)


def end(context: Context, node: tree.Halt | tree.Retry) -> None:
    """End this path."""
    # Of a RETRY that has no TRY to go back to something has been said.
    says = isinstance(node, tree.Halt) or context.recovering
    context.state.over, context.state.ended = True, node.span if says else None


def _others(writes: list[SideEffects], number: int) -> SideEffects:
    """Return what all branches but one may change; where there are many of them, anything."""
    return ANYTHING if len(writes) > _MAX_BRANCHES else union((*writes[:number], *writes[number + 1 :]))


STEPS: Steps = {
    tree.Block: lambda context, node: context.follow(*node.statements),
    tree.If: if_,
    tree.While: while_,
    tree.Repeat: repeat,
    tree.For: for_,
    tree.Cobegin: cobegin,
    tree.Signal: of_state(event),
    tree.Wait: of_state(event),
    tree.Pause: of_state(pause),
    tree.Lock: lock,
    tree.Try: try_,
    tree.Retry: end,
    tree.Halt: end,
    tree.Call: lambda context, node: context.call(node),
    tree.Poison: lambda context, node: context.state.forget(context.writes(node)),
}
