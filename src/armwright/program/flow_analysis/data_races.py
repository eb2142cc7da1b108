"""Variables that several branches of a COBEGIN write, while nothing keeps the one behind the other."""

from collections.abc import Iterable, Iterator, Sequence
from itertools import combinations, islice, product

import attrs

from armwright.program.flow_analysis.side_effects import every, parts, written_name
from armwright.program.language.diagnostic import Diagnostic, Findings, Label, Severity
from armwright.program.language.kinds import VariableKind
from armwright.program.language.source import Span
from armwright.program.semantics.symbols import Scope, Symbols
from armwright.program.syntax import tree

# Branches beside one another of which one looks at each, and pairs of writes, signals and waits that are compared.
_MOST_BRANCHES, _MOST_PAIRS = 30, 1000
# An event of which nobody knows which it is.
_ANY = "?"


@attrs.frozen
class _Place:
    """Where in a branch something is done: the number of the statement, and the outermost loop around it."""

    order: int
    loop: int | None

    def may_precede(self, other: "_Place") -> bool:
        """Whether it may be done before something else of its branch."""
        return self.order < other.order or (self.loop is not None and self.loop == other.loop)


@attrs.frozen
class _Step:
    """A statement of a branch, or of a procedure that the branch calls.

    Attributes:
        node: the statement.
        scope: the names that it sees.
        locked: what is locked around it.
        call: the call in the branch that leads to it.
        place: in the branch.
    """

    node: tree.Statement
    scope: Scope
    locked: frozenset[str]
    call: Span | None
    place: _Place


@attrs.frozen
class _Write:
    """A statement that gives a variable a value.

    Attributes:
        name: of the variable or element, as ``writes.written_name`` gives it.
        text: as the program writes it.
        span: the statement, or the call in the branch that leads to it.
        value: the number, where that is all it depends on.
        locked: whether a LOCK of the variable is around it.
        place: in its branch.
    """

    name: str
    text: str
    span: Span
    value: float | None
    locked: bool
    place: _Place


@attrs.frozen
class _Branch:
    """What a branch writes, by name, and the events by which it comes behind others and others behind it."""

    writes: dict[str, list[_Write]]
    signals: list[tuple[str, _Place]]
    waits: list[tuple[str, _Place]]

    def leads_to(self, other: "_Branch") -> bool:
        """Whether it signals an event that another waits for."""
        return any(_alike(one, two) for one, two in self._met(other))

    def settles(self, write: _Write, other: "_Branch", later: _Write) -> bool:
        """Whether it signals behind a write what another waits for before its own."""
        return any(
            _alike(one, two) and write.place.may_precede(one[1]) and two[1].may_precede(later.place)
            for one, two in self._met(other)
        )

    def _met(self, other: "_Branch") -> "Iterator[tuple[tuple[str, _Place], tuple[str, _Place]]]":
        return islice(product(self.signals, other.waits), _MOST_PAIRS)


def _alike(one: tuple[str, _Place], other: tuple[str, _Place]) -> bool:
    """Whether two events may be the same."""
    names = {one[0], other[0]}
    any_element = any(name.endswith("[]") for name in names) and len({name.partition("[")[0] for name in names}) == 1
    return _ANY in names or len(names) == 1 or any_element


def check(program: tree.Program, symbols: Symbols) -> list[Diagnostic]:
    """Return a warning for each variable that two branches of a COBEGIN write without LOCK.

    Branches of which one waits, before its write, for what the other signals behind its own are no danger.
    """
    found = Findings()
    bodies = [(symbols.scope(None), program.statements)]
    for node in program.procedures:
        procedure = symbols.procedures.get(node.name.key)
        if procedure is not None and procedure.node is node:
            bodies.append((symbols.scope(node.name.key), node.body.statements))
    for scope, statements in bodies:
        forks = [one for one in every(statements) if isinstance(one, tree.Cobegin)]
        inner = {id(one) for fork in forks for one in every(part.body for part in fork.branches)}
        for fork in forks:
            if len(fork.branches) <= _MOST_BRANCHES:
                # Beside a COBEGIN that stands in a branch or a procedure others may be at work.
                alone = id(fork) not in inner and scope.procedure is None
                _branches(found, fork, scope, symbols, () if alone else bodies)
    return found


def _branches(
    found: Findings,
    fork: tree.Cobegin,
    scope: Scope,
    symbols: Symbols,
    others: Sequence[tuple[Scope, tuple[tree.Statement, ...]]],
) -> None:
    """Look at the branches of one COBEGIN; ``others`` may be at work beside it."""
    branches = [_branch(_walk((part.body,), scope, symbols), scope) for part in fork.branches]
    outside = [
        _branch((step for step in _walk(body, own, symbols) if not _is_inside(step.node.span, fork.span)), own)
        for own, body in others
    ]
    names = dict.fromkeys(name for one in branches for name in one.writes)
    for name in names:
        writers = [one for one in branches if name in one.writes]
        values = {write.value for one in writers for write in one.writes[name]}
        if len(writers) < 2 or (len(values) == 1 and None not in values):
            continue
        for pair in combinations(writers, 2):
            if (met := _unsettled(name, *pair, [*branches, *outside])) is not None:
                _say(found, *met)
                break


def _unsettled(name: str, one: _Branch, other: _Branch, all_branches: list[_Branch]) -> tuple[_Write, _Write] | None:
    """Return two writes of two branches of which nobody knows which comes last; None where there are none."""
    beside = [third for third in all_branches if third is not one and third is not other]
    if _leads_round(one, other, beside) or _leads_round(other, one, beside):
        return None
    pairs = product(*(sorted(branch.writes[name], key=lambda write: write.locked) for branch in (one, other)))
    for mine, its in islice(pairs, _MOST_PAIRS):
        if not ((mine.locked and its.locked) or one.settles(mine, other, its) or other.settles(its, one, mine)):
            return mine, its
    return None


def _leads_round(start: _Branch, end: _Branch, beside: list[_Branch]) -> bool:
    """Whether one branch leads to another through third ones, in whatever order."""
    reached = [third for third in beside if start.leads_to(third)]
    for third in reached:
        reached += [more for more in beside if more not in reached and third.leads_to(more)]
    return any(third.leads_to(end) for third in reached)


def _say(found: Findings, first: _Write, second: _Write) -> None:
    unlocked = second if first.locked else first
    found.say(
        "W503",
        f"`{unlocked.text}` is written in two branches of one COBEGIN without LOCK",
        second.span,
        "second branch",
        secondary=(Label(first.span, "first branch"),),
        notes=("which of them writes last depends on how long each takes",),
        helps=(f"write `LOCK ({unlocked.text}) DO ...` around what reads and writes it in each branch",),
        severity=Severity.WARNING,
    )


def _is_inside(span: Span, around: Span) -> bool:
    return around.start <= span.start and span.end <= around.end


# ---- what a branch does --------------------------------------------------------------------------------------------


def _branch(steps: Iterable[_Step], scope: Scope) -> _Branch:
    """Return what the statements of a branch do to what it shares with others."""
    branch = _Branch({}, [], [])
    for step in steps:
        if isinstance(step.node, tree.Signal | tree.Wait):
            name = written_name(step.node.event, step.scope)
            # In a procedure an event may be one that the procedure was given.
            known = name is not None and "." not in name
            (branch.signals if isinstance(step.node, tree.Signal) else branch.waits).append(
                (name if known and name is not None else _ANY, step.place)
            )
        for write in _writes(step, scope):
            branch.writes.setdefault(write.name, []).append(write)
    return branch


def _writes(step: _Step, scope: Scope) -> Iterator[_Write]:
    """Give what a statement writes of the variables that its branch shares with others."""
    node, own = step.node, step.scope
    targets: tuple[tree.Expression, ...] = ()
    value = None
    if isinstance(node, tree.Assign):
        targets, value = (node.target,), node.value.value if isinstance(node.value, tree.Number) else None
    elif isinstance(node, tree.For):
        targets = (node.variable,)
    elif isinstance(node, tree.ReadVisions):
        targets = node.targets
    for target in targets:
        name = written_name(target, own)
        if name is None or name.endswith("[]") or not isinstance(target, tree.Name | tree.Index):
            continue
        head = target.name if isinstance(target, tree.Index) else target
        kind = own.type(head.key)
        # In a procedure that is called only the variables of the program are those of everybody.
        if kind is None or kind.kind is VariableKind.EVENT or (own is not scope and own.is_local(head.key)):
            continue
        is_locked = bool(step.locked & {name, name.partition("[")[0]})
        span = node.head if isinstance(node, tree.For) else node.span
        text = head.text + (f"[{name.partition('[')[2]}" if isinstance(target, tree.Index) else "")
        yield _Write(name, text, step.call or span, value, is_locked, step.place)


def _walk(body: Sequence[tree.Statement], scope: Scope, symbols: Symbols) -> Iterator[_Step]:
    """Give statements, all inside them, and all in the procedures that they call, each of those once."""
    called: set[str] = set()
    order = 0
    waiting: list[tuple[tree.Statement, Scope, frozenset[str], Span | None, int | None]] = [
        (one, scope, frozenset(), None, None) for one in reversed(body)
    ]
    while waiting:
        node, own, locked, call, loop = waiting.pop()
        order += 1
        yield _Step(node, own, locked, call, _Place(order, loop))
        if isinstance(node, tree.Lock):
            locked |= {name for one in node.targets if (name := written_name(one, own)) is not None}
        if loop is None and isinstance(node, tree.While | tree.Repeat | tree.For):
            loop = order
        # A COBEGIN inside has branches of its own, which are looked at there.
        waiting += [(inner, own, locked, call, loop) for inner in reversed(parts(node))]
        if isinstance(node, tree.Call) and node.name.key not in called:
            called.add(node.name.key)
            procedure = symbols.procedures.get(node.name.key)
            if procedure is not None:
                seen, site = symbols.scope(node.name.key), call or node.span
                waiting += [(inner, seen, locked, site, loop) for inner in reversed(procedure.node.body.statements)]
