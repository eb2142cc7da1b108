"""Control flow: what holds on every path through choices, loops, branches, TRY and calls."""

import itertools
from collections.abc import Iterator, Mapping, Sequence

from armwright.program.flow_analysis import concurrency
from armwright.program.flow_analysis.context import Context, Step, of_state
from armwright.program.flow_analysis.definite_assignment import need, need_indices
from armwright.program.flow_analysis.facts import Parting
from armwright.program.flow_analysis.lattice import Outcome, Shaky
from armwright.program.flow_analysis.side_effects import ANY_ARM, ANYTHING, NOTHING, Writes
from armwright.program.flow_analysis.state import LAST, Course, Uses
from armwright.program.language.kinds import VariableKind
from armwright.program.language.names import is_any, is_arm
from armwright.program.language.source import Span
from armwright.program.syntax import tree

# Loops inside one another of which the first pass is followed by itself.
_DEEPEST_LOOPS = 3
# Branches beside which one looks at each other one.
_MOST_BRANCHES = 30
# Ways of one IF that are joined name by name where they meet.
_MOST_WAYS = 100


def event(course: Course, node: tree.Signal | tree.Wait) -> None:
    """Look at the indices of an event."""
    need_indices(course, node.event)


def pause(course: Course, node: tree.Pause) -> None:
    """Look at the time of a PAUSE."""
    need(course, node.duration)


def if_(context: Context, node: tree.If) -> None:
    """Follow each way of an IF, and go on with what holds on all of them."""
    course = context.course
    need(course, node.condition)
    if course.first:
        course.forget(context.writes(node))
        return
    chain, otherwise = node.chain
    ways: list[Outcome | None] = []
    with course.perhaps():
        for one in chain:
            if one is not node:
                need(course, one.condition)
            ways.append(context.path(one.then))
        ways.append(context.path(*(() if otherwise is None else (otherwise,))))
    if len(ways) > _MOST_WAYS and any(way is not None for way in ways):
        course.forget(context.writes(node))
        return
    says, advice = "it gets one on one side of this IF only", "give it a value before the IF, or on both sides"
    context.merge(*ways, parting=course.parting(node.head, says, advice))


def while_(context: Context, node: tree.While) -> None:
    """Follow a loop that is tested at its top."""
    need(context.course, node.condition)
    _perhaps_never(context, node, node.head, "WHILE", (node.body,), certain=bool(context.course.holds(node.condition)))


def repeat(context: Context, node: tree.Repeat) -> None:
    """Follow a loop that is tested at its end."""
    _loop(context, node, node.body)
    if not context.course.over:
        need(context.course, node.condition)


def for_(context: Context, node: tree.For) -> None:
    """Follow a loop that counts."""
    course = context.course
    need(course, node.first, node.last, node.step)
    passes = course.passes(node)
    variable = course.variable(node.variable, VariableKind.SCALAR)
    if passes == 0:
        return
    if variable is not None:
        course.give(variable, course.number(node.first) if passes == 1 else None, node.head)
    if passes == 1:
        context.follow(node.body)
    else:
        _perhaps_never(context, node, node.head, "FOR", (node.body,), certain=passes is not None)


def _perhaps_never(
    context: Context, node: tree.Statement, head: Span, word: str, body: tuple[tree.Statement, ...], *, certain: bool
) -> None:
    """Follow a loop that may not run once."""
    course = context.course
    says, advice = f"it gets one inside this {word}, which may not run once", f"give it a value before the {word}"
    parting = course.parting(head, says, advice)
    if certain:
        _loop(context, node, body)
    else:
        with course.perhaps():
            _loop(context, node, body, parting)


def _loop(
    context: Context, node: tree.Statement, body: tuple[tree.Statement, ...], parting: Parting | None = None
) -> None:
    """Follow a loop: as at the first pass, then knowing nothing of what it changes.

    Args:
        context: where it stands.
        node: the loop.
        body: what it repeats.
        parting: of a loop that may not run once.
    """
    course, writes = context.course, context.writes(node)
    if course.first:
        if parting is None:
            context.follow(*body)
        course.forget(writes)
        return
    if context.loops < _DEEPEST_LOOPS:
        _first_pass(context, body)
    context.loops += 1
    mark = course.facts.mark()
    none = course.facts.outcome(mark)
    course.forget(writes)
    again = context.path(*body, mark=mark)
    context.loops -= 1
    context.merge(*(again,) if parting is None else (none, again), parting=parting)


def _first_pass(context: Context, body: Sequence[tree.Statement]) -> None:
    """Follow what is certain to run at the first pass of several, and come back."""
    context.course.first = True
    context.path(*body)
    context.course.first = False


def cobegin(context: Context, node: tree.Cobegin) -> None:
    """Follow each branch, knowing nothing of what the others change."""
    course, facts = context.course, context.course.facts
    writes = [context.writes(branch.body) for branch in node.branches]
    last, shaky = course.last[LAST], facts.shaky
    outcomes, uses = [], []
    mark = facts.mark()
    for number, branch in enumerate(node.branches):
        own, others = writes[number], _others(writes, number)
        course.forget(others)
        course.last.put(LAST, last)
        facts.shaky = (*shaky, _shaky(context, own, others))
        course.branches.append(Uses({}, len(course.calls)))
        outcomes.append(context.path(branch.body))
        uses.append(course.branches.pop())
        facts.shaky = shaky
        facts.take_back(mark)
    if not course.first:
        concurrency.shared_arms(course, uses)
    if any(outcome is None for outcome in outcomes):
        course.over = True
    else:
        facts.join([outcome for outcome in outcomes if outcome is not None], together=True)
        course.last.put(LAST, last)


def _shaky(context: Context, own: Writes, others: Writes) -> Shaky:
    """Return what a branch cannot know because of the others."""
    course = context.course
    names = frozenset(course.kept(others.names))
    mine = frozenset(arm for arm in course.kept(own.arms) if is_arm(arm) and arm not in names)
    return Shaky(
        names=names,
        everything=others.everything,
        arms=ANY_ARM in others.arms or bool(others.moved),
        excepted=mine | {LAST},
        places=course.writing.rigid and bool(others.placed),
    )


def try_(context: Context, node: tree.Try) -> None:
    """Follow both parts: recovery begins with what holds whichever statement of the first part failed."""
    course, writes = context.course, context.writes(node)
    if course.first:
        # What goes wrong at the first pass is recovered from, and may go well at the next.
        course.forget(writes)
        return
    retries = context.writes(*node.recovery).retries
    mark = course.facts.mark()
    if retries:
        course.forget_undone(writes)
    well = context.path(*node.body, mark=mark)
    course.forget_undone(writes if retries else context.writes(*node.body))
    for name in _given_at_once(context, node.body):
        course.table.has(name)
    outside, context.recovering = context.recovering, True
    recovered = context.path(*node.recovery, mark=mark)
    context.recovering = outside
    says = "it gets one in this TRY, where something may fail before"
    advice = "give it a value before the TRY, or behind RECOVER too"
    context.merge(well, recovered, parting=course.parting(_first_word(node.span), says, advice))


def _given_at_once(context: Context, statements: Sequence[tree.Statement]) -> Iterator[str]:
    """Give the variables that have a value before anything can fail."""
    for one in itertools.takewhile(lambda one: isinstance(one, tree.Assign | tree.Print), statements):
        name = context.course.variable(one.target) if isinstance(one, tree.Assign) else None
        if name is not None and not is_any(name):
            yield name


def lock(context: Context, node: tree.Lock) -> None:
    """Follow the body of a LOCK."""
    need_indices(context.course, *node.targets)
    context.follow(node.body)


def end(context: Context, node: tree.Halt | tree.Retry) -> None:
    """End this path."""
    # Of a RETRY that has no TRY to go back to something has been said.
    says = isinstance(node, tree.Halt) or context.recovering
    context.course.over, context.course.ended = True, node.span if says else None


def _others(writes: list[Writes], number: int) -> Writes:
    """Return what all branches but one may change; where there are many of them, anything."""
    if len(writes) > _MOST_BRANCHES:
        return ANYTHING
    others = NOTHING
    for own in (*writes[:number], *writes[number + 1 :]):
        others |= own
    return others


def _first_word(span: Span) -> Span:
    """Return where the TRY stands that begins a statement."""
    return Span(span.start, span.start + len("TRY"))


STEPS: Mapping[type, Step] = {
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
    tree.Poison: lambda context, node: context.course.forget(context.writes(node)),
}
