"""Concurrency: deadlocks, equal priorities, and arms that two branches use."""

from collections.abc import Iterable, Iterator, Sequence

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
            findings.report("W502", text, branch.head, f"same as line {source.line(first.head.start)}", note=note)


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
            free = _unused_arm(state, used)
            first = first_use.setdefault(arm, use)
            if first is use:
                continue
            does = "moved" if first.moves and use.moves else "used"
            text, note = f"{arm} is {does} in two branches of one COBEGIN", "each arm belongs to one process at a time"
            here = (Label(first.span, "first branch"), *dict.fromkeys((*first.affixed_at, *use.affixed_at)))
            advice = f"use {free} in one branch, or give the arm over with SIGNAL and WAIT outside COBEGIN"
            state.report("E503", text, use.span, "second branch", secondary=here, note=note, advice=advice)


def _unused_arm(state: FlowState, used: set[str]) -> str:
    """Return an arm that no branch uses."""
    free = sorted(state.cell.arms - used) if state.cell else []
    return free[0] if free else next(arm for n in range(1, len(used) + 2) if (arm := f"ARM_{n}") not in used)


# ---- events ----------------------------------------------------------------------------------------------------------


@attrs.frozen
class _EventStep:
    """A SIGNAL or WAIT that is certain to be reached, if nothing before it fails or waits for ever."""

    node: tree.Signal | tree.Wait
    event: str


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
            self.passed.update(
                array_name(name) for argument in node.arguments if (name := written_name(argument, scope))
            )
        elif isinstance(node, tree.Signal | tree.Wait) and (name := written_name(node.event, scope)) is not None:
            if isinstance(node, tree.Wait):
                self.waits.setdefault(name, []).append((scope, node))
            else:
                self.signals.setdefault(name, []).append(node)

    def is_signalled(self, name: str) -> bool:
        """Whether something may signal an event, or another element of its array."""
        return array_name(name) in self.passed or any(array_name(other) == array_name(name) for other in self.signals)

    def sequences(self, scope: Scope, branches: Iterable[Sequence[tree.Statement]]) -> list[list[_EventStep]]:
        """Return the SIGNALs and WAITs of branches in order, of events that no other statement uses."""
        steps = [[*_unconditional_steps(branch, scope)] for branch in branches]
        here = {id(step.node) for several in steps for step in several}
        waiting = [{step.event for step in several if isinstance(step.node, tree.Wait)} for several in steps]
        names = {step.event for several in steps for step in several}
        own = {
            name
            for name in names
            if self._is_closed(name, scope, here) and sum(name in statement for statement in waiting) == 1
        }
        return [[step for step in several if step.event in own] for several in steps]

    def _is_closed(self, name: str, scope: Scope, here: set[int]) -> bool:
        procedure = scope.procedure
        if procedure is not None:
            # Several activations of a procedure share what is not local to it.
            key = array_name(name).rpartition(".")[2]
            if not scope.is_local(key) or key in procedure.parameters:
                return False
        unclear = is_any_element(name) or f"{array_name(name)}[]" in (*self.waits, *self.signals)
        if unclear or array_name(name) in self.passed or name not in self.signals:
            return False
        nodes = [*self.signals[name], *(node for _, node in self.waits.get(name, ()))]
        return all(id(node) in here for node in nodes)


def _unconditional_steps(statements: Sequence[tree.Statement], scope: Scope) -> Iterator[_EventStep]:
    """Yield the unconditional SIGNALs and WAITs, up to a HALT."""
    for node in statements:
        match node:
            case tree.Signal(event=event) | tree.Wait(event=event):
                name = written_name(event, scope)
                if name is not None:
                    yield _EventStep(node, name)
            case tree.Block(statements=inner):
                yield from _unconditional_steps(inner, scope)
            case tree.Lock(body=body):
                yield from _unconditional_steps((body,), scope)
            case tree.Halt():
                return
            case _:
                pass


def _may_halt_while_waiting(scope: Scope, statements: Sequence[tree.Statement]) -> bool:
    """Whether a HALT may end the program while other processes wait."""
    waiting = [(statement, scope.procedure is not None) for statement in statements]
    while waiting:
        node, beside = waiting.pop()
        if beside and isinstance(node, tree.Halt):
            return True
        # In an action of a MOVE it only ends the MOVE.
        inside = () if isinstance(node, tree.Move) else child_statements(node)
        waiting += [(inner, beside or isinstance(node, tree.Cobegin)) for inner in inside]
    return False


def _report_never_signalled(findings: DiagnosticList, events: _Events) -> None:
    reported: set[str] = set()
    for name, waits in events.waits.items():
        scope, node = waits[0]
        key = array_name(name).rpartition(".")[2]
        kind, procedure = scope.type(key), scope.procedure
        is_parameter = procedure is not None and scope.is_local(key) and key in procedure.parameters
        if (
            kind is None
            or kind.kind is not VariableKind.EVENT
            or is_parameter
            or events.is_signalled(name)
            or array_name(name) in reported
        ):
            continue
        reported.add(array_name(name))
        text = expression_text(node.event)
        message = f"nothing signals `{text}`, so this WAIT never ends"
        advice = f"write `SIGNAL {text}` in another branch"
        findings.report(
            "E501", message, node.span, "waits for ever", secondary=scope.declaration_labels(key), advice=advice
        )


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
            if isinstance(step.node, tree.Signal):
                signals.setdefault(step.event, (number, step))
    path: dict[int, None] = {}
    now = min(stuck)
    while now not in path:
        path[now] = None
        if stuck[now].event not in signals:
            _report_too_few_signals(findings, stuck[now], branches)
            return
        now, _ = signals[stuck[now].event]
    cycle = list(path)[list(path).index(now) :]
    _report_cyclic_wait(
        findings, [(stuck[statement], signals[stuck[statement].event][1]) for statement in cycle], source, main=main
    )


def _simulate(branches: list[list[_EventStep]]) -> list[int]:
    """Simulate the branches and return how far each comes: SIGNALs are counted, each event has one waiting branch."""
    reached = [0] * len(branches)
    counts: dict[str, int] = {}
    waiting_branches: dict[str, int] = {}
    ready = list(range(len(branches)))
    while ready:
        number = ready.pop()
        steps = branches[number]
        while reached[number] < len(steps):
            step = steps[reached[number]]
            if isinstance(step.node, tree.Signal):
                counts[step.event] = counts.get(step.event, 0) + 1
                if step.event in waiting_branches:
                    ready.append(waiting_branches.pop(step.event))
            elif counts.get(step.event, 0) == 0:
                waiting_branches[step.event] = number
                break
            else:
                counts[step.event] -= 1
            reached[number] += 1
    return reached


def _report_too_few_signals(findings: DiagnosticList, step: _EventStep, branches: list[list[_EventStep]]) -> None:
    nodes = [statement.node for several in branches for statement in several if statement.event == step.event]
    signals = [node.span for node in nodes if isinstance(node, tree.Signal)]
    text = f"`{expression_text(step.node.event)}` is waited for more often than it is signalled"
    here = tuple(Label(span, "signalled here") for span in signals[:_MAX_LOCATIONS])
    note = f"{len(nodes) - len(signals)} WAITs, and {len(signals)} SIGNAL{'s' * (len(signals) > 1)}"
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
        labels.append(Label(wait.node.span, f"waits for the SIGNAL in line {source.line(signal.node.span.start)}"))
        labels.append(Label(signal.node.span, "comes after that WAIT"))
    first, *others = sorted(labels, key=lambda label: label.span.start)
    count = len(cycle)
    message = {
        1: f"{'the program' if main else 'this branch'} waits for itself for ever",
        2: "these two branches wait for each other for ever",
    }.get(count, f"these {count} branches wait for one another for ever")
    findings.report("E501", message, first.span, first.text, secondary=tuple(others))
