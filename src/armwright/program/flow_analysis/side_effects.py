"""Side effects of a part of a program on any path through it: frames, values, arms.

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

# A part with more side effects than this is taken to change everything.
_MAX_EFFECTS = 400
# An unknown arm.
ANY_ARM = "*"
# Rounds of the fixed-point iteration over procedures that call one another.
_MAX_ROUNDS = 10


@attrs.frozen(kw_only=True)
class SideEffects:
    """Side effects.

    Attributes:
        posed: frames that get a pose by assignment, by AFFIX ... AT or from the camera.
        affixed: frames whose parent AFFIX or UNFIX changes.
        moved: frames that MOVE moves; an AFFIX may be implied.
        values: numbers and TRANS variables.
        arms: used at all; ``*`` for an arm that is not named.
        grasps: whether a gripper may close on something.
        everything: whether it may be anything.
        halts: whether HALT may end it.
        retries: whether RETRY may run a TRY part around it again.
        brakes: whether BRAKE may keep the MOVE that it interrupts from its goal.
    """

    posed: frozenset[str] = frozenset()
    affixed: frozenset[str] = frozenset()
    moved: frozenset[str] = frozenset()
    values: frozenset[str] = frozenset()
    arms: frozenset[str] = frozenset()
    grasps: bool = False
    everything: bool = False
    halts: bool = False
    retries: bool = False
    brakes: bool = False

    def __or__(self, other: "SideEffects") -> "SideEffects":
        """Return the union of two side effects."""
        if self is NOTHING or other is NOTHING:
            return other if self is NOTHING else self
        merged = SideEffects(**{name: getattr(self, name) | getattr(other, name) for name in _FIELDS})
        count = sum(map(len, (merged.posed, merged.affixed, merged.moved, merged.values)))
        if merged.everything or count > _MAX_EFFECTS:
            return attrs.evolve(ANYTHING, halts=merged.halts, retries=merged.retries, brakes=merged.brakes)
        return merged

    @property
    def names(self) -> frozenset[str]:
        """All names that may be changed."""
        return self.posed | self.affixed | self.moved | self.values | self.arms - {ANY_ARM}


_FIELDS = tuple(attrs.fields_dict(SideEffects))
NOTHING = SideEffects()
ANYTHING = SideEffects(arms=frozenset({ANY_ARM}), grasps=True, everything=True)


def written_name(node: tree.Expression, scope: Scope) -> str | None:
    """Return the name of a variable, or of an element: ``SLOT[1,2]``, or ``SLOT[]`` where an index is computed."""
    if isinstance(node, tree.ArmName):
        return node.key
    if isinstance(node, tree.Index):
        literals = [f"{index.value:.12g}" for index in node.indices if isinstance(index, tree.Number)]
        return f"{qualified(node.name.key, scope)}[{','.join(literals) if len(literals) == len(node.indices) else ''}]"
    return qualified(node.key, scope) if isinstance(node, tree.Name) else None


def qualified(key: str, scope: Scope) -> str:
    """Return a name with its procedure in front, if it is local to one."""
    procedure = scope.procedure
    return f"{procedure.node.name.key}.{key}" if procedure is not None and scope.is_local(key) else key


class SideEffectAnalysis:
    """The side effects of every statement of a program, computed once."""

    def __init__(self, program: tree.Program, symbols: Symbols) -> None:
        """Check the procedures."""
        self._symbols = symbols
        self._known: dict[int, SideEffects] = {}
        self._procedures: dict[str, SideEffects] = {}
        bodies = (*program.statements, *(node.body for node in program.procedures))
        # Whether any frame is affixed rigidly.
        self.rigid = any(isinstance(node, tree.Affix) and node.rigid for node in walk_statements(bodies))
        self._solve_procedures()

    def effects_of(self, statement: tree.Statement, scope: Scope) -> SideEffects:
        """Return the side effects of a statement and all inside it."""
        effects = self._known.get(id(statement))
        if effects is None:
            effects = self._own_effects(statement, scope)
            for child in child_statements(statement):
                effects |= self.effects_of(child, scope)
            if isinstance(statement, tree.Try) and effects.retries:
                effects = attrs.evolve(effects, retries=self.effects_of_all(statement.body, scope).retries)
            self._known[id(statement)] = effects
        return effects

    def effects_of_all(self, statements: Iterable[tree.Statement], scope: Scope) -> SideEffects:
        """Return the side effects of several statements."""
        return union(self.effects_of(statement, scope) for statement in statements)

    def effects_of_call(self, call: tree.Call, scope: Scope) -> SideEffects:
        """Return the side effects of a call."""
        procedure = self._symbols.procedures.get(call.name.key)
        if procedure is None:
            return NOTHING
        effects = self._procedures.get(call.name.key, NOTHING)
        arguments = dict(zip(procedure.parameters, call.arguments, strict=False))
        return _in_names_of_caller(effects, call.name.key, arguments, scope, inout=procedure.inout)

    def _solve_procedures(self) -> None:
        """Compute the side effects of procedures, through all that they call, by fixed-point iteration."""
        calls: dict[str, list[tree.Call]] = {}
        for key, procedure in self._symbols.procedures.items():
            scope, nodes = self._symbols.scope(key), list(walk_statements(procedure.node.body.statements))
            calls[key] = [node for node in nodes if isinstance(node, tree.Call)]
            others = (node for node in nodes if not isinstance(node, tree.Call | tree.Retry))
            self._procedures[key] = union(self._own_effects(node, scope) for node in others)
        order = _callees_first({key: [call.name.key for call in several] for key, several in calls.items()})
        for _ in range(_MAX_ROUNDS):
            changed = {}
            for key in order:
                scope, old = self._symbols.scope(key), self._procedures[key]
                new = union((old, *(self.effects_of_call(call, scope) for call in calls[key])))
                if new != old:
                    changed[key] = self._procedures[key] = new
            if not changed:
                return
        self._procedures.update(dict.fromkeys(changed, ANYTHING))

    def _own_effects(self, statement: tree.Statement, scope: Scope) -> SideEffects:
        """Return the side effects of one statement without those inside it."""
        if isinstance(statement, tree.Call):
            return self.effects_of_call(statement, scope)
        own = _OWN_EFFECTS.get(type(statement))
        return NOTHING if own is None else own(scope, statement)


def _effects_of_assign(scope: Scope, node: tree.Assign) -> SideEffects:
    names = _names(scope, node.target)
    head = node.target.name if isinstance(node.target, tree.Index) else node.target
    kind = scope.type(head.key) if isinstance(head, tree.Name) else None
    is_frame = kind is None or kind.kind is VariableKind.FRAME
    return SideEffects(posed=names if is_frame else frozenset(), values=frozenset() if is_frame else names)


def _effects_of_affix(scope: Scope, node: tree.Affix) -> SideEffects:
    affixed = _names(scope, node.child)
    posed = affixed if node.at is not None else frozenset[str]()
    return SideEffects(affixed=affixed, posed=posed, arms=_arms(scope, node.parent))


def _effects_of_poison(scope: Scope, node: tree.Poison) -> SideEffects:
    names = _names(scope, node)
    return SideEffects(posed=names, affixed=names, values=names, arms=_arms(scope, node), grasps=True)


# The side effects of statements without those inside; the others have none.
_OWN_EFFECTS: Mapping[type, Callable[..., SideEffects]] = {
    tree.Assign: _effects_of_assign,
    tree.Affix: _effects_of_affix,
    tree.Unfix: lambda scope, node: SideEffects(affixed=_names(scope, node.child), arms=_arms(scope, node.parent)),
    tree.Open: lambda scope, node: SideEffects(arms=_arms(scope, node.arm)),
    tree.ReadSystem: lambda scope, node: SideEffects(arms=_arms(scope, node.arm)),
    tree.ZeroForce: lambda scope, node: SideEffects(arms=_arms(scope, node.arm)),
    tree.Grasp: lambda scope, node: SideEffects(arms=_arms(scope, node.arm) or frozenset({ANY_ARM}), grasps=True),
    tree.ReadVisions: lambda scope, node: SideEffects(posed=_names(scope, *node.targets)),
    tree.Move: lambda scope, node: SideEffects(moved=_names(scope, node.moved), arms=_arms(scope, node.moved)),
    **dict.fromkeys((tree.Queue, tree.Put), lambda scope, node: SideEffects(arms=_arms(scope, node.arm))),
    tree.For: lambda scope, node: SideEffects(values=_names(scope, node.variable)),
    tree.Halt: lambda _scope, _node: SideEffects(halts=True),
    tree.Retry: lambda _scope, _node: SideEffects(retries=True),
    tree.Brake: lambda _scope, _node: SideEffects(brakes=True),
    tree.Poison: _effects_of_poison,
}


def walk_statements(statements: Iterable[tree.Statement]) -> Iterator[tree.Statement]:
    """Yield statements and all inside them, in the order of the text."""
    waiting = list(statements)[::-1]
    while waiting:
        now = waiting.pop()
        yield now
        waiting += child_statements(now)[::-1]


# The statements directly inside a statement; the others have none inside.
_CHILDREN: Mapping[type, Callable[..., tuple[tree.Statement, ...]]] = {
    tree.Block: lambda node: node.statements,
    tree.If: lambda node: node.statements,
    tree.While: lambda node: (node.body,),
    tree.For: lambda node: (node.body,),
    tree.Lock: lambda node: (node.body,),
    tree.Queue: lambda node: (node.body,),
    tree.Put: lambda node: () if node.otherwise is None else (node.otherwise,),
    tree.When: lambda node: (node.action,),
    tree.Repeat: lambda node: node.body,
    tree.Wait: lambda node: () if node.otherwise is None else (node.otherwise,),
    tree.WaitUntil: lambda node: () if node.otherwise is None else (node.otherwise,),
    tree.Try: lambda node: (*node.body, *node.recovery),
    tree.Cobegin: lambda node: tuple(branch.body for branch in node.branches),
    tree.Move: lambda node: tuple(clause.action for clause in node.clauses if isinstance(clause, tree.On)),
}


def child_statements(statement: tree.Statement) -> tuple[tree.Statement, ...]:
    """Return the statements directly inside a statement, those of actions among them."""
    children = _CHILDREN.get(type(statement))
    return () if children is None else children(statement)


def _names(scope: Scope, *nodes: tree.Expression) -> frozenset[str]:
    """Return the variables that nodes name, or all names of skipped tokens; no arms."""
    names: set[str] = set()
    for node in nodes:
        if isinstance(node, tree.Poison):
            names.update(qualified(key, scope) for key in node.names)
        elif (name := written_name(node, scope)) is not None:
            names.add(name)
    return frozenset(name for name in names if not is_arm(name))


def _arms(scope: Scope, node: tree.Expression | None) -> frozenset[str]:
    """Return the arm that a node names; a parameter may be one."""
    if isinstance(node, tree.Poison):
        return frozenset(filter(is_arm, node.names)) or frozenset({ANY_ARM})
    if isinstance(node, tree.Name):
        name = qualified(node.key, scope)
        return frozenset({name} if _is_parameter(name, scope) else ())
    return frozenset({node.key}) if isinstance(node, tree.ArmName) else frozenset()


def union(several: Iterable[SideEffects]) -> SideEffects:
    """Return the union of side effects."""
    return reduce(or_, several, NOTHING)


def _callees_first(calls: Mapping[str, list[str]]) -> list[str]:
    """Return procedures in an order in which callees come first, as far as recursion allows."""
    order: dict[str, None] = {}
    visited: set[str] = set()
    stack = list(calls)
    while stack:
        key = stack[-1]
        callees = [] if key in visited else [callee for callee in calls.get(key, ()) if callee not in visited]
        visited.add(key)
        stack += callees
        if not callees:
            order[stack.pop()] = None
    return [key for key in order if key in calls]


def _in_names_of_caller(
    effects: SideEffects,
    procedure: str,
    arguments: Mapping[str, tree.Expression],
    scope: Scope,
    *,
    inout: frozenset[str],
) -> SideEffects:
    """Return the side effects of a procedure in the names of its caller; those on its locals are dropped."""

    def caller_name(name: str, *, value: bool = False) -> str:
        """Return the name in the scope of the caller; empty for what it does not see."""
        head, bracket, indices = name.partition("[")
        owner, point, key = head.partition(".")
        if not point:
            return name
        argument = arguments.get(key) if owner == procedure else None
        # Numbers and TRANS are passed by value, arrays by reference.
        if (
            argument is None
            or (value and not bracket and key not in inout)
            or (bracket and not isinstance(argument, tree.Name))
        ):
            return ""
        passed = written_name(argument, scope)
        return f"{passed}{bracket}{indices}" if passed else ""

    def frames(names: frozenset[str]) -> frozenset[str]:
        return frozenset(outer for name in names if (outer := caller_name(name)) and not is_arm(outer))

    def may_be_arm(name: str) -> bool:
        return name == ANY_ARM or is_arm(name) or _is_parameter(name, scope)

    posed, affixed, moved = map(frames, (effects.posed, effects.affixed, effects.moved))
    values = frozenset(outer for name in effects.values if (outer := caller_name(name, value=True)))
    arms = frozenset(filter(may_be_arm, map(caller_name, effects.arms)))
    return attrs.evolve(effects, posed=posed, affixed=affixed, moved=moved, values=values, arms=arms, retries=False)


def _is_parameter(name: str, scope: Scope) -> bool:
    owner, _, key = name.partition(".")
    procedure = scope.procedure
    return procedure is not None and owner == procedure.node.name.key and key in procedure.parameters
