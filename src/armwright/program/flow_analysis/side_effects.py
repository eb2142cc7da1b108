"""What a part of a program may change, on any path through it: frames, values, arms.

Names are those of the text: a parameter or variable of a procedure stands with its procedure, ``FETCH.PART``.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import reduce
from operator import or_

import attrs

from armwright.program.language.kinds import VariableKind
from armwright.program.language.names import is_arm
from armwright.program.semantics.symbols import Scope, Symbols
from armwright.program.syntax import tree

# A part that changes more than this is taken to change everything.
_MAX_EFFECTS = 400
# Any arm, nobody knows which.
ANY_ARM = "*"
# So often what procedures that call one another may change is looked at again.
_MAX_ROUNDS = 10


@attrs.frozen(kw_only=True)
class SideEffects:
    """What may be changed.

    Attributes:
        placed: frames that get another pose by a value, by AFFIX ... AT or from the camera.
        hung: frames that AFFIX or UNFIX hangs elsewhere.
        moved: frames that MOVE moves; an AFFIX may be implied.
        values: numbers and steps.
        arms: used at all; ``*`` for an arm that is not named.
        grasps: whether a gripper may close on something.
        everything: whether it may be anything.
        halts: whether HALT may end it.
        retries: whether RETRY may run a TRY part around it again.
    """

    placed: frozenset[str] = frozenset()
    hung: frozenset[str] = frozenset()
    moved: frozenset[str] = frozenset()
    values: frozenset[str] = frozenset()
    arms: frozenset[str] = frozenset()
    grasps: bool = False
    everything: bool = False
    halts: bool = False
    retries: bool = False

    def __or__(self, other: "SideEffects") -> "SideEffects":
        """Return what either may change."""
        if self is NOTHING or other is NOTHING:
            return other if self is NOTHING else self
        merged = {name: getattr(self, name) | getattr(other, name) for name in _FIELDS}
        return _limited(SideEffects(**merged))

    @property
    def names(self) -> frozenset[str]:
        """All that may be changed."""
        return self.placed | self.hung | self.moved | self.values | self.arms - {ANY_ARM}


_FIELDS = tuple(attrs.fields_dict(SideEffects))
NOTHING = SideEffects()
ANYTHING = SideEffects(arms=frozenset({ANY_ARM}), grasps=True, everything=True)


def _limited(writes: SideEffects) -> SideEffects:
    if writes.everything or sum(map(len, (writes.placed, writes.hung, writes.moved, writes.values))) > _MAX_EFFECTS:
        return attrs.evolve(ANYTHING, halts=writes.halts, retries=writes.retries)
    return writes


def written_name(node: tree.Expression, scope: Scope) -> str | None:
    """Return the name of a variable, or of an element: ``SLOT[1,2]``, or ``SLOT[]`` where an index is computed."""
    if isinstance(node, tree.ArmName):
        return node.key
    if isinstance(node, tree.Index):
        inner = ",".join(f"{index.value:.12g}" for index in node.indices if isinstance(index, tree.Number))
        literal = all(isinstance(index, tree.Number) for index in node.indices)
        return f"{qualified(node.name.key, scope)}[{inner if literal else ''}]"
    return qualified(node.key, scope) if isinstance(node, tree.Name) else None


def qualified(key: str, scope: Scope) -> str:
    """Return a name with its procedure in front, if it is one of its own."""
    procedure = scope.procedure
    return f"{procedure.node.name.key}.{key}" if procedure is not None and scope.is_local(key) else key


class Writing:
    """What each statement of a program may change, found out once."""

    def __init__(self, program: tree.Program, symbols: Symbols) -> None:
        """Check the procedures."""
        self._symbols = symbols
        self._known: dict[int, SideEffects] = {}
        self._procedures: dict[str, SideEffects] = {}
        bodies = (program.statements, *(node.body.statements for node in program.procedures))
        self.rigid = any(
            isinstance(statement, tree.Affix) and statement.rigid for body in bodies for statement in every(body)
        )
        self._settle(program)

    def of(self, statement: tree.Statement, scope: Scope) -> SideEffects:
        """Return what a statement and all inside it may change."""
        effects = self._known.get(id(statement))
        if effects is None:
            effects = self._own(statement, scope)
            for inner in parts(statement):
                effects |= self.of(inner, scope)
            if isinstance(statement, tree.Try) and effects.retries:
                effects = attrs.evolve(effects, retries=self.all(statement.body, scope).retries)
            self._known[id(statement)] = effects
        return effects

    def all(self, statements: Iterable[tree.Statement], scope: Scope) -> SideEffects:
        """Return what several statements may change."""
        return union(self.of(statement, scope) for statement in statements)

    def called(self, call: tree.Call, scope: Scope) -> SideEffects:
        """Return what a call may change."""
        procedure = self._symbols.procedures.get(call.name.key)
        if procedure is None:
            return NOTHING
        writes = self._procedures.get(call.name.key, NOTHING)
        arguments = dict(zip(procedure.parameters, call.arguments, strict=False))
        return _seen_from_outside(writes, call.name.key, arguments, scope)

    def _settle(self, program: tree.Program) -> None:
        """Find out what procedures may change, through all that they call."""
        calls: dict[str, list[tree.Call]] = {}
        for node in program.procedures:
            key = node.name.key
            procedure = self._symbols.procedures.get(key)
            if procedure is None or procedure.node is not node:
                continue
            scope, inner = self._symbols.scope(key), list(every(node.body.statements))
            calls[key] = [
                statement
                for statement in inner
                if isinstance(statement, tree.Call) and statement.name.key in self._symbols.procedures
            ]
            self._procedures[key] = union(
                self._own(statement, scope) for statement in inner if not isinstance(statement, tree.Call | tree.Retry)
            )
        order = _callees_first({key: [statement.name.key for statement in several] for key, several in calls.items()})
        for _ in range(_MAX_ROUNDS):
            news = {}
            for key in order:
                scope, old = self._symbols.scope(key), self._procedures[key]
                new = union((old, *(self.called(call, scope) for call in calls[key])))
                if new != old:
                    news[key] = self._procedures[key] = new
            if not news:
                return
        self._procedures.update(dict.fromkeys(news, ANYTHING))

    def _own(self, statement: tree.Statement, scope: Scope) -> SideEffects:
        """Return what one statement may change by itself, without those inside it."""
        if isinstance(statement, tree.Call):
            return self.called(statement, scope)
        own = _OWN.get(type(statement))
        return NOTHING if own is None else own(scope, statement)


def _assigned(scope: Scope, node: tree.Assign) -> SideEffects:
    names = _names(scope, node.target)
    head = node.target.name if isinstance(node.target, tree.Index) else node.target
    kind = scope.type(head.key) if isinstance(head, tree.Name) else None
    is_frame = kind is None or kind.kind is VariableKind.FRAME
    return SideEffects(placed=names if is_frame else frozenset(), values=frozenset() if is_frame else names)


def _affixed(scope: Scope, node: tree.Affix) -> SideEffects:
    hung = _names(scope, node.child)
    return SideEffects(hung=hung, placed=hung if node.at is not None else frozenset(), arms=_arms(scope, node.parent))


def _unfixed(scope: Scope, node: tree.Unfix) -> SideEffects:
    return SideEffects(hung=_names(scope, node.child), arms=_arms(scope, node.parent))


def _poisoned(scope: Scope, node: tree.Poison) -> SideEffects:
    names = _names(scope, node)
    return SideEffects(placed=names, hung=names, values=names, arms=_arms(scope, node), grasps=True)


# What statements may change by themselves; those that are missing change nothing.
_OWN: Mapping[type, Callable[..., SideEffects]] = {
    tree.Assign: _assigned,
    tree.Affix: _affixed,
    tree.Unfix: _unfixed,
    tree.Open: lambda scope, node: SideEffects(arms=_arms(scope, node.arm)),
    tree.ReadSystem: lambda scope, node: SideEffects(arms=_arms(scope, node.arm)),
    tree.Grasp: lambda scope, node: SideEffects(arms=_arms(scope, node.arm) or frozenset({ANY_ARM}), grasps=True),
    tree.ReadVisions: lambda scope, node: SideEffects(
        placed=frozenset[str]().union(*(_names(scope, target) for target in node.targets))
    ),
    tree.Move: lambda scope, node: SideEffects(moved=_names(scope, node.moved), arms=_arms(scope, node.moved)),
    tree.For: lambda scope, node: SideEffects(values=_names(scope, node.variable)),
    tree.Halt: lambda _scope, _node: SideEffects(halts=True),
    tree.Retry: lambda _scope, _node: SideEffects(retries=True),
    tree.Poison: _poisoned,
}


def every(statements: Iterable[tree.Statement]) -> Iterator[tree.Statement]:
    """Give statements and all inside them, in the order of the text."""
    waiting = list(statements)[::-1]
    while waiting:
        now = waiting.pop()
        yield now
        waiting += parts(now)[::-1]


# The statements directly inside a statement; those that are missing have none inside.
_PARTS: Mapping[type, Callable[..., tuple[tree.Statement, ...]]] = {
    tree.Block: lambda node: node.statements,
    tree.If: lambda node: node.statements,
    tree.While: lambda node: (node.body,),
    tree.For: lambda node: (node.body,),
    tree.Lock: lambda node: (node.body,),
    tree.Repeat: lambda node: node.body,
    tree.Try: lambda node: (*node.body, *node.recovery),
    tree.Cobegin: lambda node: tuple(branch.body for branch in node.branches),
    tree.Move: lambda node: tuple(clause.action for clause in node.clauses if isinstance(clause, tree.On)),
}


def parts(statement: tree.Statement) -> tuple[tree.Statement, ...]:
    """Return the statements directly inside a statement, those of actions among them."""
    inside = _PARTS.get(type(statement))
    return () if inside is None else inside(statement)


def _names(scope: Scope, node: tree.Expression) -> frozenset[str]:
    """Return the variable that a node names, or all of those in what was passed over; no arms."""
    if isinstance(node, tree.Poison):
        return frozenset(qualified(key, scope) for key in node.names if not is_arm(key))
    name = written_name(node, scope)
    return frozenset() if name is None or is_arm(name) else frozenset({name})


def _arms(scope: Scope, node: tree.Expression | None) -> frozenset[str]:
    """Return the arm that a node names; a parameter may be one."""
    if isinstance(node, tree.Poison):
        return frozenset(filter(is_arm, node.names)) or frozenset({ANY_ARM})
    if isinstance(node, tree.Name):
        name = qualified(node.key, scope)
        return frozenset({name} if _is_parameter(name, scope) else ())
    return frozenset({node.key}) if isinstance(node, tree.ArmName) else frozenset()


def union(several: Iterable[SideEffects]) -> SideEffects:
    """Return what any of several parts of a program may change."""
    return reduce(or_, several, NOTHING)


def _callees_first(calls: Mapping[str, list[str]]) -> list[str]:
    """Return procedures in an order in which those that are called come first, as far as that is possible."""
    order: dict[str, None] = {}
    visited: set[str] = set()
    for first in calls:
        way = [(first, iter(calls[first]))] if first not in visited else []
        visited.add(first)
        while way:
            key, others = way[-1]
            callee = next((other for other in others if other not in visited), None)
            if callee is None:
                order[key] = None
                way.pop()
            else:
                visited.add(callee)
                way.append((callee, iter(calls[callee])))
    return list(order)


def _seen_from_outside(
    writes: SideEffects, procedure: str, arguments: Mapping[str, tree.Expression], scope: Scope
) -> SideEffects:
    """Return what a procedure changes, in the names of its caller: its own variables are nobody else's."""

    def outside(name: str, *, value: bool = False) -> str:
        """Return a name as the caller says it; empty for what the caller does not see."""
        head, bracket, indices = name.partition("[")
        owner, point, key = head.partition(".")
        if not point:
            return name
        argument = arguments.get(key) if owner == procedure else None
        # Numbers and steps are given by value; an array is given itself.
        if argument is None or (value and not bracket) or (bracket and not isinstance(argument, tree.Name)):
            return ""
        passed = written_name(argument, scope)
        return f"{passed}{bracket}{indices}" if passed else ""

    def frames(names: frozenset[str]) -> frozenset[str]:
        return frozenset(visited for name in names if (visited := outside(name)) and not is_arm(visited))

    def may_be_arm(name: str) -> bool:
        return name == ANY_ARM or is_arm(name) or _is_parameter(name, scope)

    return SideEffects(
        placed=frames(writes.placed),
        hung=frames(writes.hung),
        moved=frames(writes.moved),
        values=frozenset(visited for name in writes.values if (visited := outside(name, value=True))),
        arms=frozenset(visited for name in writes.arms if (visited := outside(name)) and may_be_arm(visited)),
        grasps=writes.grasps,
        everything=writes.everything,
        halts=writes.halts,
    )


def _is_parameter(name: str, scope: Scope) -> bool:
    procedure = scope.procedure
    if procedure is None:
        return False
    return any(name == f"{procedure.node.name.key}.{key}" for key in procedure.parameters)
