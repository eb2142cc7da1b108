"""Variables that several branches of a COBEGIN write, one not waiting for the other."""

from collections.abc import Iterator

import attrs

from armwright.program.following.writes import every, parts, written_name
from armwright.program.intermediate.code import Kind
from armwright.program.meaning.names import Scope, Symbols
from armwright.program.messages.diagnostics import Diagnostic, Findings, Label, Severity
from armwright.program.syntax import tree
from armwright.program.text.source import Span

# Branches beside one another of which one looks at each.
_MOST_BRANCHES = 30


@attrs.frozen
class _Write:
    """A statement that gives a variable a value.

    Attributes:
        name: of the variable or element, as ``writes.written_name`` gives it.
        text: as the program writes it.
        span: the statement, or the call in the branch that leads to it.
        value: the number, where that is all it depends on.
        locked: whether a LOCK of the variable is around it.
    """

    name: str
    text: str
    span: Span
    value: float | None
    locked: bool


def check(program: tree.Program, symbols: Symbols) -> list[Diagnostic]:
    """Return a warning for each variable that two branches of a COBEGIN write without LOCK.

    A branch that waits for others by WAIT settles with them who writes when.
    """
    found = Findings()
    bodies = [(symbols.scope(None), program.statements)]
    for node in program.procedures:
        procedure = symbols.procedures.get(node.name.key)
        if procedure is not None and procedure.node is node:
            bodies.append((symbols.scope(node.name.key), node.body.statements))
    for scope, statements in bodies:
        for one in every(statements):
            if isinstance(one, tree.Cobegin) and len(one.branches) <= _MOST_BRANCHES:
                _branches(found, one, scope, symbols)
    return found


def _branches(found: Findings, fork: tree.Cobegin, scope: Scope, symbols: Symbols) -> None:
    writes: dict[str, dict[int, list[_Write]]] = {}
    for number, branch in enumerate(fork.branches):
        if any(isinstance(one, tree.Wait) for one in _reached(branch.body, scope, symbols)):
            continue
        for write in _writes(branch.body, scope, symbols):
            writes.setdefault(write.name, {}).setdefault(number, []).append(write)
    for by_branch in writes.values():
        several = [write for some in by_branch.values() for write in some]
        values = {write.value for write in several}
        unlocked = next((write for write in several if not write.locked), None)
        if len(by_branch) < 2 or unlocked is None or (len(values) == 1 and None not in values):
            continue
        first, second, *_ = ([write for write in some if not write.locked] or some for some in by_branch.values())
        found.say(
            "W503",
            f"`{unlocked.text}` is written in two branches of one COBEGIN without LOCK",
            second[0].span,
            "second branch",
            secondary=(Label(first[0].span, "first branch"),),
            notes=("which of them writes last depends on how long each takes",),
            helps=(f"write `LOCK ({unlocked.text}) DO ...` around what reads and writes it in each branch",),
            severity=Severity.WARNING,
        )


def _reached(body: tree.Statement, scope: Scope, symbols: Symbols) -> Iterator[tree.Statement]:
    """Give a statement, all inside it, and all in the procedures that it calls."""
    return (node for node, _, _, _ in _walk(body, scope, symbols))


def _writes(body: tree.Statement, scope: Scope, symbols: Symbols) -> Iterator[_Write]:
    """Give what a branch writes of the variables that it shares with others."""
    for node, own, locked, call in _walk(body, scope, symbols):
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
            if kind is None or kind.kind is Kind.EVENT or (own is not scope and own.is_local(head.key)):
                continue
            is_locked = bool(locked & {name, name.partition("[")[0]})
            span = node.head if isinstance(node, tree.For) else node.span
            text = head.text + (f"[{name.partition('[')[2]}" if isinstance(target, tree.Index) else "")
            yield _Write(name, text, call or span, value, is_locked)


def _walk(
    body: tree.Statement, scope: Scope, symbols: Symbols
) -> Iterator[tuple[tree.Statement, Scope, frozenset[str], Span | None]]:
    """Give statements with the names that they see, those that are locked around them, and the call they stand in."""
    called: set[str] = set()
    waiting: list[tuple[tree.Statement, Scope, frozenset[str], Span | None]] = [(body, scope, frozenset(), None)]
    while waiting:
        node, own, locked, call = waiting.pop()
        yield node, own, locked, call
        if isinstance(node, tree.Lock):
            locked |= {name for one in node.targets if (name := written_name(one, own)) is not None}
        # A COBEGIN inside has branches of its own, which are looked at there.
        waiting += [(inner, own, locked, call) for inner in reversed(parts(node))]
        if isinstance(node, tree.Call) and node.name.key not in called:
            called.add(node.name.key)
            procedure = symbols.procedures.get(node.name.key)
            if procedure is not None:
                seen, site = symbols.scope(node.name.key), call or node.span
                waiting += [(inner, seen, locked, site) for inner in reversed(procedure.node.body.statements)]
