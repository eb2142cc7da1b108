"""Concurrency: deadlocks, equal priorities, and arms that two branches use."""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from itertools import count, dropwhile

import attrs

from armwright.program.flow_analysis.side_effects import child_statements, walk_statements, written_name
from armwright.program.flow_analysis.state import FlowState, Use, Uses
from armwright.program.language.diagnostic import Diagnostic, DiagnosticList, Label
from armwright.program.language.kinds import VariableKind
from armwright.program.language.names import array_name, is_any_element
from armwright.program.language.source import Source
from armwright.program.semantics.expression_types import expression_text
from armwright.program.semantics.symbols import Scope, Symbols, scoped_bodies
from armwright.program.syntax import tree

# Locations shown in one message.
_MAX_LOCATIONS = 3


def check(program: tree.Program, symbols: Symbols, source: Source) -> list[Diagnostic]:
    """Return what is wrong with events and priorities.

    Args:
        program: without errors of syntax.
        symbols: its names.
        source: its text.
    """
    findings = DiagnosticList()
    events = _Events(scoped_bodies(program, symbols))
    for _, cobegin in events.cobegins:
        _check_priorities(findings, cobegin, source)
    if not events.waits or events.may_halt:
        return findings
    _report_never_signalled(findings, events)
    groups = [(scope, [branch.body.statements for branch in cobegin.branches]) for scope, cobegin in events.cobegins]
    for scope, branches in [(symbols.scope(None), [program.statements]), *groups]:
        _check_deadlock(findings, events.sequences(scope, branches), source, main=branches[0] is program.statements)
    return findings


# ---- priorities and arms ---------------------------------------------------------------------------------------------


def _check_priorities(findings: DiagnosticList, cobegin: tree.Cobegin, source: Source) -> None:
    """Warn of branches of equal priority, where it is written."""
    first_use: dict[float, tree.Branch] = {}
    for branch in cobegin.branches:
        if branch.priority is None:
            continue
        first = first_use.setdefault(branch.priority.value, branch)
        if first is not branch:
            text = f"{'both' if len(cobegin.branches) == 2 else 'two'} branches have priority {branch.priority.text}"
            note = "frame-table requests of equal priority are served in the order of the text"
            findings.report("W502", text, branch.head, f"same as line {source.place(first.head.start)}", note=note)


def report_shared_arms(state: FlowState, branches: Sequence[Uses]) -> None:
    """Report arms that more than one branch uses.

    Args:
        state: the abstract state, for diagnostics.
        branches: the arms that each branch of one COBEGIN uses.
    """
    first_use: dict[str, Use] = {}
    used = {arm for branch in branches for arm in branch.arms}
    for branch in branches:
        for arm, use in branch.arms.items():
            first = first_use.setdefault(arm, use)
            if first is use:
                continue
            does = "moved" if first.moves and use.moves else "used"
            text, note = f"{arm} is {does} in two branches of one COBEGIN", "each arm belongs to one process at a time"
            here = (Label(first.span, "first branch"), *dict.fromkeys((*first.affixed_at, *use.affixed_at)))
            free = _unused_arm(state, used)
            advice = f"use {free} in one branch, or give the arm over with SIGNAL and WAIT outside COBEGIN"
            state.report("E503", text, use.span, "second branch", secondary=here, note=note, advice=advice)


def _unused_arm(state: FlowState, used: set[str]) -> str:
    """Return an arm that no branch uses."""
    free = sorted(state.cell.arms - used) if state.cell else []
    return free[0] if free else next(arm for n in count(1) if (arm := f"ARM_{n}") not in used)


# ---- events ----------------------------------------------------------------------------------------------------------


@attrs.frozen
class _EventStep:
    """A SIGNAL or WAIT that is certain to be reached, if nothing before it fails or waits for ever."""

    node: tree.Signal | tree.Wait
    event: str

    @property
    def is_wait(self) -> bool:
        """Whether it is a WAIT."""
        return isinstance(self.node, tree.Wait)


class _Events:
    """The SIGNALs, WAITs and COBEGINs of a program, by event."""

    def __init__(self, scoped_bodies: Sequence[tuple[Scope, Sequence[tree.Statement]]]) -> None:
        self.cobegins: list[tuple[Scope, tree.Cobegin]] = []
        self.waits: dict[str, list[tuple[Scope, tree.Wait]]] = {}
        self.signals: dict[str, list[tree.Signal]] = {}
        # Events that are passed to procedures, which may signal them.
        self.passed: set[str] = set()
        for scope, statements in scoped_bodies:
            for statement in walk_statements(statements):
                self._collect(scope, statement)
        self.may_halt = bool(self.waits) and any(_may_halt_while_waiting(*body) for body in scoped_bodies)

    def _collect(self, scope: Scope, node: tree.Statement) -> None:
        if isinstance(node, tree.Cobegin):
            self.cobegins.append((scope, node))
        elif isinstance(node, tree.Call):
            names = (written_name(argument, scope) for argument in node.arguments)
            self.passed.update(array_name(name) for name in names if name)
        elif isinstance(node, tree.Signal | tree.Wait) and (name := written_name(node.event, scope)) is not None:
            if isinstance(node, tree.Wait) and node.limit is not None:
                # It may take a signal, or none.
                self.passed.add(array_name(name))
            elif isinstance(node, tree.Wait):
                self.waits.setdefault(name, []).append((scope, node))
            else:
                self.signals.setdefault(name, []).append(node)

    def is_signalled(self, array: str) -> bool:
        """Whether something may signal an event, or an element of an array of events."""
        return array in self.passed or array in map(array_name, self.signals)

    def sequences(self, scope: Scope, branches: Iterable[Sequence[tree.Statement]]) -> list[list[_EventStep]]:
        """Return the SIGNALs and WAITs of branches in order, of events that no other statement uses."""
        sequences = [[*_unconditional_steps(branch, scope)] for branch in branches]
        here = {id(step.node) for steps in sequences for step in steps}
        # Of each event, in how many branches it is awaited.
        awaited = Counter(event for steps in sequences for event in {step.event for step in steps if step.is_wait})
        own = {event for event, number in awaited.items() if number == 1 and self._is_closed(event, scope, here)}
        return [[step for step in steps if step.event in own] for steps in sequences]

    def _is_closed(self, name: str, scope: Scope, here: set[int]) -> bool:
        array = array_name(name)
        key = array.rpartition(".")[2]
        # Several activations of a procedure share what is not local to it.
        is_shared = scope.procedure is not None and (not scope.is_local(key) or scope.is_parameter(key))
        any_element = is_any_element(name) or f"{array}[]" in (*self.waits, *self.signals)
        if is_shared or any_element or array in self.passed or name not in self.signals:
            return False
        nodes = (*self.signals[name], *(node for _, node in self.waits[name]))
        return all(id(node) in here for node in nodes)


def _unconditional_steps(statements: Sequence[tree.Statement], scope: Scope) -> Iterator[_EventStep]:
    """Yield the unconditional SIGNALs and WAITs, up to a HALT."""
    for node in statements:
        if isinstance(node, tree.Signal) or (isinstance(node, tree.Wait) and node.limit is None):
            if (name := written_name(node.event, scope)) is not None:
                yield _EventStep(node, name)
        elif isinstance(node, tree.Block | tree.Lock | tree.Queue):
            yield from _unconditional_steps(child_statements(node), scope)
        elif isinstance(node, tree.Halt | tree.Raise):
            return


def _may_halt_while_waiting(scope: Scope, statements: Sequence[tree.Statement]) -> bool:
    """Whether a HALT may end the program while processes wait, or the action of a WHEN may end a wait by an error."""
    waiting = [(statement, scope.procedure is not None) for statement in statements]
    while waiting:
        node, is_concurrent = waiting.pop()
        if is_concurrent and isinstance(node, tree.Halt | tree.Raise):
            return True
        # In an action of a MOVE it only ends the MOVE.
        children = () if isinstance(node, tree.Move) else child_statements(node)
        waiting += [(child, is_concurrent or isinstance(node, tree.Cobegin | tree.When)) for child in children]
    return False


def _report_never_signalled(findings: DiagnosticList, events: _Events) -> None:
    # The first WAIT of each event or array of events.
    first: dict[str, tuple[Scope, tree.Wait]] = {}
    for name, waits in events.waits.items():
        first.setdefault(array_name(name), waits[0])
    for array, (scope, node) in first.items():
        key = array.rpartition(".")[2]
        kind, text = scope.type(key), expression_text(node.event)
        is_event = kind is not None and kind.kind is VariableKind.EVENT
        if is_event and not scope.is_parameter(key) and not events.is_signalled(array):
            message = f"nothing signals `{text}`, so this WAIT never ends"
            here, advice = scope.declaration_labels(key), f"write `SIGNAL {text}` in another branch"
            findings.report("E501", message, node.span, "waits for ever", secondary=here, advice=advice)


# ---- waits that cannot end -------------------------------------------------------------------------------------------


def _check_deadlock(findings: DiagnosticList, branches: list[list[_EventStep]], source: Source, *, main: bool) -> None:
    """Report branches that wait for one another for ever."""
    reached = _simulate(branches)
    stuck = {number: branches[number][index] for number, index in enumerate(reached) if index < len(branches[number])}
    if not stuck:
        return
    # Each waits for a branch that is stuck itself: following them closes a cycle.
    signals: dict[str, tuple[int, _EventStep]] = {}
    for number in stuck:
        for step in branches[number][reached[number] :]:
            if not step.is_wait:
                signals.setdefault(step.event, (number, step))
    path: dict[int, None] = {}
    now = min(stuck)
    while now not in path:
        path[now] = None
        if stuck[now].event not in signals:
            _report_too_few_signals(findings, stuck[now], branches)
            return
        now, _ = signals[stuck[now].event]
    cycle = [stuck[number] for number in dropwhile(lambda number: number != now, path)]
    _report_cyclic_wait(findings, [(wait, signals[wait.event][1]) for wait in cycle], source, main=main)


def _simulate(branches: list[list[_EventStep]]) -> list[int]:
    """Simulate the branches and return how far each comes: SIGNALs are counted, each event has one waiting branch."""
    reached = [0] * len(branches)
    counts: Counter[str] = Counter()
    waiting_branches: dict[str, int] = {}
    ready = list(range(len(branches)))
    while ready:
        number = ready.pop()
        while reached[number] < len(branches[number]):
            step = branches[number][reached[number]]
            if step.is_wait and not counts[step.event]:
                waiting_branches[step.event] = number
                break
            counts[step.event] += -1 if step.is_wait else 1
            if not step.is_wait and step.event in waiting_branches:
                ready.append(waiting_branches.pop(step.event))
            reached[number] += 1
    return reached


def _report_too_few_signals(findings: DiagnosticList, step: _EventStep, branches: list[list[_EventStep]]) -> None:
    steps = [other for branch in branches for other in branch if other.event == step.event]
    signals = [other.node.span for other in steps if not other.is_wait]
    text = f"`{expression_text(step.node.event)}` is waited for more often than it is signalled"
    here = tuple(Label(span, "signalled here") for span in signals[:_MAX_LOCATIONS])
    note = f"{len(steps) - len(signals)} WAITs, and {len(signals)} SIGNAL{'s' * (len(signals) > 1)}"
    findings.report("E501", text, step.node.span, "waits for ever", secondary=here, note=note)


def _report_cyclic_wait(
    findings: DiagnosticList, cycle: list[tuple[_EventStep, _EventStep]], source: Source, *, main: bool
) -> None:
    """Report branches of which each waits for what the next would signal.

    Args:
        findings: the diagnostics.
        cycle: the WAIT of each, and the SIGNAL that it waits for.
        source: of the program.
        main: whether it is the main program, waiting for itself.
    """
    labels = []
    for wait, signal in cycle:
        labels.append(Label(wait.node.span, f"waits for the SIGNAL in line {source.place(signal.node.span.start)}"))
        labels.append(Label(signal.node.span, "comes after that WAIT"))
    first, *others = sorted(labels, key=lambda label: label.span.start)
    message = f"these {len(cycle)} branches wait for one another for ever"
    if len(cycle) == 1:
        message = f"{'the program' if main else 'this branch'} waits for itself for ever"
    elif len(cycle) == 2:
        message = "these two branches wait for each other for ever"
    findings.report("E501", message, first.span, first.text, secondary=tuple(others))
