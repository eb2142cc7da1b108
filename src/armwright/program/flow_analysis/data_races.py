"""Data races: variables that several branches of a COBEGIN write without an order between them."""

from collections.abc import Iterable, Iterator, Sequence
from itertools import combinations, islice, product

import attrs

from armwright.program.flow_analysis.side_effects import child_statements, walk_statements, written_name
from armwright.program.language.diagnostic import Diagnostic, DiagnosticList, labels
from armwright.program.language.kinds import VariableKind
from armwright.program.language.names import array_name, is_any_element
from armwright.program.language.source import Span
from armwright.program.semantics.symbols import Scope, ScopedBody, Symbols, scoped_bodies
from armwright.program.syntax import tree

# Concurrent branches that are checked, and pairs of writes, signals and waits that are compared.
_MAX_BRANCHES, _MAX_PAIRS = 30, 1000
# An unknown event.
_ANY = "?"


@attrs.frozen
class _Location:
    """A location in a branch: the number of the statement, and the outermost loop around it."""

    order: int
    loop: int | None

    def may_precede(self, other: "_Location") -> bool:
        """Whether it may run before another location of its branch."""
        return self.order < other.order or (self.loop is not None and self.loop == other.loop)


@attrs.frozen
class _Step:
    """A statement of a branch, or of a procedure that the branch calls.

    Attributes:
        node: the statement.
        scope: the names that it sees.
        locked: variables of the LOCKs around it.
        call: the call in the branch that leads to it.
        location: in the branch.
    """

    node: tree.Statement
    scope: Scope
    locked: frozenset[str]
    call: Span | None
    location: _Location


@attrs.frozen
class _Write:
    """A statement that gives a variable a value.

    Attributes:
        name: of the variable or element, as ``written_name`` gives it.
        text: as the program writes it.
        span: the statement, or the call in the branch that leads to it.
        value: the number, where that is all it depends on.
        locked: whether a LOCK of the variable is around it.
        location: in its branch.
    """

    name: str
    text: str
    span: Span
    value: float | None
    locked: bool
    location: _Location


@attrs.frozen
class _Branch:
    """The writes of a branch, by name, and the events that order it against other branches."""

    writes: dict[str, list[_Write]]
    signals: list[tuple[str, _Location]]
    waits: list[tuple[str, _Location]]

    def leads_to(self, other: "_Branch") -> bool:
        """Whether it signals an event that another waits for."""
        return any(True for _ in self.handshakes(other))

    def orders(self, write: _Write, other: "_Branch", later: _Write) -> bool:
        """Whether it signals after a write an event that another branch awaits before its own write."""
        pairs = self.handshakes(other)
        return any(write.location.may_precede(signal) and wait.may_precede(later.location) for signal, wait in pairs)

    def handshakes(self, other: "_Branch") -> Iterator[tuple[_Location, _Location]]:
        """Yield the SIGNALs and the WAITs of another branch that may be about the same event."""
        for (signalled, signal), (awaited, wait) in islice(product(self.signals, other.waits), _MAX_PAIRS):
            names = {signalled, awaited}
            any_element = any(map(is_any_element, names)) and array_name(signalled) == array_name(awaited)
            if _ANY in names or len(names) == 1 or any_element:
                yield signal, wait


def check(program: tree.Program, symbols: Symbols) -> list[Diagnostic]:
    """Return a warning for each variable that two branches of a COBEGIN write without LOCK.

    Branches of which one waits, before its write, for what the other signals behind its own are no danger.
    """
    findings = DiagnosticList()
    everywhere = scoped_bodies(program, symbols)
    for scope, statements in everywhere:
        cobegins = [node for node in walk_statements(statements) if isinstance(node, tree.Cobegin)]
        inner = {id(node) for cobegin in cobegins for node in walk_statements(child_statements(cobegin))}
        for cobegin in cobegins:
            if len(cobegin.branches) <= _MAX_BRANCHES:
                # A COBEGIN in a branch or a procedure may run concurrently with other statements.
                alone = id(cobegin) not in inner and scope.procedure is None
                _check_branches(findings, cobegin, scope, symbols, () if alone else everywhere)
    return findings


def _check_branches(
    findings: DiagnosticList, cobegin: tree.Cobegin, scope: Scope, symbols: Symbols, others: Sequence[ScopedBody]
) -> None:
    """Check the branches of one COBEGIN; ``others`` may run concurrently."""
    branches = [_branch(_walk((part.body,), scope, symbols), scope) for part in cobegin.branches]
    outside = [_branch(_walk(body, own, symbols), own, without=cobegin.span) for own, body in others]
    names = dict.fromkeys(name for branch in branches for name in branch.writes)
    for name in names:
        writers = [branch for branch in branches if name in branch.writes]
        values = {write.value for writer in writers for write in writer.writes[name]}
        if len(writers) < 2 or (len(values) == 1 and None not in values):
            continue
        for pair in combinations(writers, 2):
            if (conflict := _unordered_writes(name, *pair, [*branches, *outside])) is not None:
                _report(findings, *conflict)
                break


def _unordered_writes(
    name: str, first: _Branch, other: _Branch, all_branches: list[_Branch]
) -> tuple[_Write, _Write] | None:
    """Return two writes of two branches without an order between them; None where there are none."""
    beside = [third for third in all_branches if third is not first and third is not other]
    if _is_ordered_through(first, other, beside) or _is_ordered_through(other, first, beside):
        return None
    pairs = product(*(sorted(branch.writes[name], key=lambda write: write.locked) for branch in (first, other)))
    for mine, its in islice(pairs, _MAX_PAIRS):
        if not ((mine.locked and its.locked) or first.orders(mine, other, its) or other.orders(its, first, mine)):
            return mine, its
    return None


def _is_ordered_through(start: _Branch, end: _Branch, beside: list[_Branch]) -> bool:
    """Whether one branch leads to another through others, in any order."""
    reached = [third for third in beside if start.leads_to(third)]
    for third in reached:
        reached += [more for more in beside if more not in reached and third.leads_to(more)]
    return any(third.leads_to(end) for third in reached)


def _report(findings: DiagnosticList, first: _Write, second: _Write) -> None:
    name, here = second.text if first.locked else first.text, labels(first.span, "first branch")
    text = f"`{name}` is written in two branches of one COBEGIN without LOCK"
    note = "which of them writes last depends on how long each takes"
    advice = f"write `LOCK ({name}) DO ...` around what reads and writes it in each branch"
    findings.report("W503", text, second.span, "second branch", secondary=here, note=note, advice=advice)


# ---- what a branch does ----------------------------------------------------------------------------------------------


def _branch(steps: Iterable[_Step], scope: Scope, *, without: Span | None = None) -> _Branch:
    """Return the writes and events of the statements of a branch, those in a span left out."""
    branch = _Branch({}, [], [])
    for step in steps:
        node = step.node
        if without is not None and without.start <= node.span.start and node.span.end <= without.end:
            continue
        if isinstance(node, tree.Signal) or (isinstance(node, tree.Wait) and node.limit is None):
            name = written_name(node.event, step.scope) or _ANY
            events = branch.signals if isinstance(node, tree.Signal) else branch.waits
            # In a procedure an event may be a parameter.
            events.append((_ANY if "." in name else name, step.location))
        for write in _writes(step, scope):
            branch.writes.setdefault(write.name, []).append(write)
    return branch


def _writes(step: _Step, scope: Scope) -> Iterator[_Write]:
    """Yield the writes of a statement to shared variables."""
    node, own = step.node, step.scope
    targets: tuple[tree.Expression, ...] = ()
    value = None
    if isinstance(node, tree.Assign):
        targets, value = (node.target,), node.value.value if isinstance(node.value, tree.Number) else None
    elif isinstance(node, tree.For):
        targets = (node.variable,)
    elif isinstance(node, tree.ReadVisions):
        targets = node.targets
    elif isinstance(node, tree.Call) and (callee := scope.symbols.procedures.get(node.name.key)) is not None:
        pairs = zip(callee.parameters, node.arguments, strict=False)
        targets = tuple(argument for parameter, argument in pairs if parameter in callee.inout)
    for target in targets:
        name = written_name(target, own)
        if name is None or is_any_element(name) or not isinstance(target, tree.Name | tree.Index):
            continue
        head = target.name if isinstance(target, tree.Index) else target
        kind = own.type(head.key)
        # In a called procedure only global variables are shared.
        if kind is None or kind.kind is VariableKind.EVENT or (own is not scope and own.is_local(head.key)):
            continue
        is_locked = bool(step.locked & {name, array_name(name)})
        span = node.head if isinstance(node, tree.For) else node.span
        text = head.text + (f"[{name.partition('[')[2]}" if isinstance(target, tree.Index) else "")
        yield _Write(name, text, step.call or span, value, is_locked, step.location)


def _walk(body: Sequence[tree.Statement], scope: Scope, symbols: Symbols) -> Iterator[_Step]:
    """Yield statements, all inside them, and all in the procedures that they call, each procedure once."""
    called: set[str] = set()
    order = 0
    waiting: list[tuple[tree.Statement, Scope, frozenset[str], Span | None, int | None]]
    waiting = [(node, scope, frozenset(), None, None) for node in reversed(body)]
    while waiting:
        node, own, locked, call, loop = waiting.pop()
        order += 1
        yield _Step(node, own, locked, call, _Location(order, loop))
        if isinstance(node, tree.Lock):
            locked |= {name for target in node.targets if (name := written_name(target, own)) is not None}
        if loop is None and isinstance(node, tree.While | tree.Repeat | tree.For):
            loop = order
        # The branches of an inner COBEGIN are checked there.
        waiting += [(child, own, locked, call, loop) for child in reversed(child_statements(node))]
        if isinstance(node, tree.Call) and node.name.key in symbols.procedures and node.name.key not in called:
            called.add(node.name.key)
            callee, site = symbols.scope(node.name.key), call or node.span
            statements = symbols.procedures[node.name.key].node.body.statements
            waiting += [(child, callee, locked, site, loop) for child in reversed(statements)]
