"""What the statements do to the frames, along all ways through a program: values, affixments, arms; no numbers.

An error is said only where it is certain that a run that comes to the statement fails. Where ways meet, what they
agree on stays known; a loop is followed twice: once as at its first pass, and once knowing nothing of what it changes.
"""

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence

import attrs

from armwright.program.flow_analysis import concurrency, data_races, devices, frames
from armwright.program.flow_analysis.calls import Calling
from armwright.program.flow_analysis.definite_assignment import need, need_indices
from armwright.program.flow_analysis.facts import UNKNOWN, Parting
from armwright.program.flow_analysis.lattice import Outcome, Shaky
from armwright.program.flow_analysis.side_effects import ANY_ARM, ANYTHING, NOTHING, Writes, every
from armwright.program.flow_analysis.state import LAST, Course, Uses
from armwright.program.language.diagnostic import Diagnostic
from armwright.program.language.kinds import VariableKind
from armwright.program.language.names import is_any, is_arm
from armwright.program.language.source import Source, Span
from armwright.program.semantics.cell_symbols import KnownCell
from armwright.program.semantics.symbols import Symbols
from armwright.program.syntax import tree

# Statements inside one another that are followed; deeper ones only make things unknown.
_DEEPEST = 100
# Loops inside one another of which the first pass is followed by itself.
_DEEPEST_LOOPS = 3
# Branches beside which one looks at each other one.
_MOST_BRANCHES = 30
# Ways of one IF that are joined name by name where they meet.
_MOST_WAYS = 100


@attrs.frozen(kw_only=True)
class Flow:
    """What the translator wants to know of statements, by where they start.

    Attributes:
        arms: the arm that a MOVE moves or a GRASP closes, where it is the same on every way there.
        implied: MOVEs that always hang the grasped frame on its arm first.
    """

    arms: Mapping[int, str]
    implied: frozenset[int]


def check(
    program: tree.Program,
    symbols: Symbols,
    spelling: Mapping[str, str],
    cell: KnownCell | None = None,
    *,
    source: Source,
    strict: bool = False,
) -> tuple[Flow, list[Diagnostic]]:
    """Follow a program from statement to statement.

    Args:
        program: without errors of syntax.
        symbols: its names.
        spelling: how it writes them.
        cell: what it will act on; without one, frames may get their values later.
        source: its text.
        strict: whether an AFFIX that is only implied is an error.

    Returns:
        What the translator needs, and what is wrong.
    """
    course = Course(program, symbols, spelling, cell, source=source, strict=strict)
    follower = _Follower(course)
    follower.all(program.statements)
    course.over = False
    follower.others()
    found = [*course.found, *concurrency.check(program, symbols, source), *data_races.check(program, symbols)]
    return Flow(arms=course.arms, implied=course.implied), found


class _Follower:
    """Follows statements, one inside the other."""

    def __init__(self, course: Course) -> None:
        self._course = course
        self._calling = Calling(course, self.all)
        self._depth = self._loops = 0
        self._recovering = False
        self._steps: dict[type, Callable[..., None]] = {
            tree.Assign: lambda node: frames.assign(course, node),
            tree.Affix: lambda node: frames.affix(course, node),
            tree.Unfix: lambda node: frames.unfix(course, node),
            tree.Open: lambda node: devices.open_hand(course, node),
            tree.Grasp: lambda node: devices.grasp(course, node),
            tree.Operate: lambda node: devices.operate(course, node),
            tree.ReadVisions: lambda node: devices.read(course, node),
            tree.ReadSystem: lambda node: devices.read_arm(course, node),
            tree.Move: self._move,
            tree.Block: lambda node: self.all(node.statements),
            tree.If: self._if,
            tree.While: self._while,
            tree.Repeat: self._repeat,
            tree.For: self._for,
            tree.Cobegin: self._cobegin,
            tree.Signal: lambda node: need_indices(course, node.event),
            tree.Wait: lambda node: need_indices(course, node.event),
            tree.Pause: lambda node: need(course, node.duration),
            tree.Lock: self._lock,
            tree.Try: self._try,
            tree.Retry: self._end,
            tree.Halt: self._end,
            tree.Print: self._print,
            tree.Call: lambda node: self._calling.call(node, follow=self._depth < _DEEPEST),
            tree.Poison: lambda node: course.forget(self._writes(node)),
        }

    def all(self, statements: Sequence[tree.Statement]) -> None:
        """Follow several, one after the other, up to a HALT."""
        for statement in statements:
            if self._course.over:
                self._course.unreached(statement.span)
                return
            self.one(statement)

    def one(self, statement: tree.Statement) -> None:
        """Follow one statement; only forget what it changes where it stands too deep."""
        self._calling.step()
        if self._depth >= _DEEPEST:
            self._pass_over(statement)
            return
        self._depth += 1
        self._steps[type(statement)](statement)
        self._depth -= 1

    def others(self) -> None:
        """Follow the procedures that were not followed at each of their calls."""
        self._calling.others()

    def _pass_over(self, statement: tree.Statement) -> None:
        course = self._course
        course.forget(self._writes(statement))
        for inner in every((statement,)):
            if isinstance(inner, tree.Move | tree.Grasp):
                course.record(inner, None)
            elif isinstance(inner, tree.Call):
                self._calling.pass_over(inner.name.key)

    def _writes(self, *statements: tree.Statement) -> Writes:
        return self._course.writing.all(statements, self._course.now.scope)

    def _end(self, node: tree.Halt | tree.Retry) -> None:
        # Of a RETRY that has no TRY to go back to something has been said.
        says = isinstance(node, tree.Halt) or self._recovering
        self._course.over, self._course.ended = True, node.span if says else None

    def _print(self, node: tree.Print) -> None:
        need(self._course, *(item for item in node.items if not isinstance(item, tree.String)))

    def _lock(self, node: tree.Lock) -> None:
        need_indices(self._course, *node.targets)
        self.one(node.body)

    # ---- ways that part --------------------------------------------------------------------------------------------

    def _way(self, statements: Sequence[tree.Statement], mark: int | None = None) -> Outcome | None:
        """Follow one way from here and come back to a mark, or to here; None where HALT ends it."""
        course, facts = self._course, self._course.facts
        start = facts.mark() if mark is None else mark
        self.all(statements)
        outcome = None if course.over else facts.outcome(start)
        facts.take_back(start)
        course.over = False
        return outcome

    def _meet(self, *outcomes: Outcome | None, parting: Parting | None = None) -> None:
        """Go on where ways meet; not at all if none of them comes here.

        Args:
            outcomes: of the ways.
            parting: what is said of a variable that has got a value on some of them only.
        """
        arrived = [outcome for outcome in outcomes if outcome is not None]
        if arrived:
            self._course.table.parting = parting
            self._course.facts.join(arrived)
            self._course.table.parting = None
        else:
            self._course.over = True

    def _if(self, node: tree.If) -> None:
        course = self._course
        need(course, node.condition)
        if course.first:
            course.forget(self._writes(node))
            return
        chain, otherwise = node.chain
        ways: list[Outcome | None] = []
        with course.perhaps():
            for one in chain:
                if one is not node:
                    need(course, one.condition)
                ways.append(self._way((one.then,)))
            ways.append(self._way(() if otherwise is None else (otherwise,)))
        if len(ways) > _MOST_WAYS and any(way is not None for way in ways):
            course.forget(self._writes(node))
            return
        says, advice = "it gets one on one side of this IF only", "give it a value before the IF, or on both sides"
        self._meet(*ways, parting=course.parting(node.head, says, advice))

    def _move(self, node: tree.Move) -> None:
        """Follow a MOVE; what its actions do may happen or not, while the arm is on its way."""
        course = self._course
        arm = devices.begin(course, node)
        guards = [clause for clause in node.clauses if isinstance(clause, tree.On)]
        for guard in guards:
            need(course, guard.condition)
            writes = self._writes(guard.action)
            if not course.first:
                mark = course.facts.mark()
                if arm is None:
                    course.lose_arms(grasps=False)
                else:
                    course.table.arrive(arm, UNKNOWN, None)
                with course.perhaps():
                    self.one(guard.action)
                course.facts.take_back(mark)
                course.over = False
            says, advice = "it gets one in this action, which may not happen", "give it a value before the MOVE"
            course.forget_undone(writes, course.parting(guard.head, says, advice))
        halted = any(self._writes(guard.action).halts for guard in guards)
        devices.end(course, node, arm, halted=halted)

    def _try(self, node: tree.Try) -> None:
        """Follow both parts: recovery begins with what holds whichever statement of the first part failed."""
        course, writes = self._course, self._writes(node)
        if course.first:
            # What goes wrong at the first pass is recovered from, and may go well at the next.
            course.forget(writes)
            return
        retries = self._writes(*node.recovery).retries
        mark = course.facts.mark()
        if retries:
            course.forget_undone(writes)
        well = self._way(node.body, mark)
        course.forget_undone(writes if retries else self._writes(*node.body))
        for name in self._given_at_once(node.body):
            course.table.has(name)
        outside, self._recovering = self._recovering, True
        recovered = self._way(node.recovery, mark)
        self._recovering = outside
        says = "it gets one in this TRY, where something may fail before"
        advice = "give it a value before the TRY, or behind RECOVER too"
        self._meet(well, recovered, parting=course.parting(_first_word(node.span), says, advice))

    def _given_at_once(self, statements: Sequence[tree.Statement]) -> Iterator[str]:
        """Give the variables that have a value before anything can fail."""
        for one in itertools.takewhile(lambda one: isinstance(one, tree.Assign | tree.Print), statements):
            name = self._course.variable(one.target) if isinstance(one, tree.Assign) else None
            if name is not None and not is_any(name):
                yield name

    # ---- loops -----------------------------------------------------------------------------------------------------

    def _while(self, node: tree.While) -> None:
        need(self._course, node.condition)
        self._perhaps_never(node, node.head, "WHILE", (node.body,), certain=bool(self._course.holds(node.condition)))

    def _repeat(self, node: tree.Repeat) -> None:
        self._loop(node, node.body)
        if not self._course.over:
            need(self._course, node.condition)

    def _for(self, node: tree.For) -> None:
        course = self._course
        need(course, node.first, node.last, node.step)
        passes = course.passes(node)
        variable = course.variable(node.variable, VariableKind.SCALAR)
        if passes == 0:
            return
        if variable is not None:
            frames.give(course, variable, course.number(node.first) if passes == 1 else None, node.head)
        if passes == 1:
            self.one(node.body)
        else:
            self._perhaps_never(node, node.head, "FOR", (node.body,), certain=passes is not None)

    def _perhaps_never(
        self, node: tree.Statement, head: Span, word: str, body: tuple[tree.Statement, ...], *, certain: bool
    ) -> None:
        """Follow a loop that may not run once."""
        course = self._course
        says, advice = f"it gets one inside this {word}, which may not run once", f"give it a value before the {word}"
        parting = course.parting(head, says, advice)
        if certain:
            self._loop(node, body)
        else:
            with course.perhaps():
                self._loop(node, body, parting)

    def _loop(self, node: tree.Statement, body: tuple[tree.Statement, ...], parting: Parting | None = None) -> None:
        """Follow a loop: as at the first pass, then knowing nothing of what it changes.

        Args:
            node: the loop.
            body: what it repeats.
            parting: of a loop that may not run once.
        """
        course, writes = self._course, self._writes(node)
        if course.first:
            if parting is None:
                self.all(body)
            course.forget(writes)
            return
        if self._loops < _DEEPEST_LOOPS:
            self._first_pass(body)
        self._loops += 1
        mark = course.facts.mark()
        none = course.facts.outcome(mark)
        course.forget(writes)
        again = self._way(body, mark)
        self._loops -= 1
        self._meet(*(again,) if parting is None else (none, again), parting=parting)

    def _first_pass(self, body: Sequence[tree.Statement]) -> None:
        """Follow what is certain to run at the first pass of several, and come back."""
        self._course.first = True
        self._way(body)
        self._course.first = False

    # ---- branches --------------------------------------------------------------------------------------------------

    def _cobegin(self, node: tree.Cobegin) -> None:
        """Follow each branch, knowing nothing of what the others change."""
        course, facts = self._course, self._course.facts
        writes = [self._writes(branch.body) for branch in node.branches]
        last, shaky = course.last[LAST], facts.shaky
        outcomes, uses = [], []
        mark = facts.mark()
        for number, branch in enumerate(node.branches):
            own, others = writes[number], _others(writes, number)
            course.forget(others)
            course.last.put(LAST, last)
            facts.shaky = (*shaky, self._shaky(own, others))
            course.branches.append(Uses({}, len(course.calls)))
            outcomes.append(self._way((branch.body,)))
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

    def _shaky(self, own: Writes, others: Writes) -> Shaky:
        """Return what a branch cannot know because of the others."""
        course = self._course
        names = frozenset(course.kept(others.names))
        mine = frozenset(arm for arm in course.kept(own.arms) if is_arm(arm) and arm not in names)
        return Shaky(
            names=names,
            everything=others.everything,
            arms=ANY_ARM in others.arms or bool(others.moved),
            excepted=mine | {LAST},
            places=course.writing.rigid and bool(others.placed),
        )


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
