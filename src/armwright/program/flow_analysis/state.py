"""One moment in a program: the frames, the values, the arm named or moved last, and what has been found."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Unpack

import attrs

from armwright.program.flow_analysis import constants
from armwright.program.flow_analysis.facts import UNKNOWN, Divergence
from armwright.program.flow_analysis.frame_state import FrameState
from armwright.program.flow_analysis.lattice import EVERYTHING, Facts, FactTable, same
from armwright.program.flow_analysis.poses import Pose
from armwright.program.flow_analysis.side_effects import ANY_ARM, SideEffects, Writing
from armwright.program.language.diagnostic import Details, DiagnosticList, Label, labels
from armwright.program.language.kinds import VariableKind
from armwright.program.language.names import array_name, is_any_element, is_arm
from armwright.program.language.source import Source, Span
from armwright.program.semantics.cell_symbols import KnownCell
from armwright.program.semantics.symbols import Scope, Symbols
from armwright.program.syntax import tree

# The name under which the arm named or moved last is kept; no variable has it.
LAST = "(last)"
# Calls named in a message: the innermost ones.
_MAX_CALLS = 3


@attrs.frozen(kw_only=True)
class Activation:
    """The main program, or one run of a procedure.

    Attributes:
        scope: the names its statements see.
        bindings: where its own names are kept; None where that is unknown.
    """

    scope: Scope
    bindings: Mapping[str, str | None] = attrs.field(factory=dict)


@attrs.frozen
class Use:
    """Where a branch uses an arm.

    Attributes:
        span: the statement.
        moves: whether it moves the arm.
        hung: where the frame was hung on the arm that the statement moves instead of it.
    """

    span: Span
    moves: bool
    hung: tuple[Label, ...] = ()


@attrs.frozen
class Uses:
    """The arms that a branch has used so far, and in how many calls the branch itself stands."""

    arms: dict[str, Use]
    depth: int


@attrs.frozen
class Called:
    """A call that is being followed."""

    name: str
    text: str
    span: Span


def _joined_arms(arm: str | None, other: str | None) -> str | None:
    return arm if arm == other else UNKNOWN


class FlowState:
    """The state that the statements of a program change one after the other.

    Attributes:
        first: whether this is the first pass of a loop that has others: what is not certain to run is passed over.
        over: whether HALT has ended the path that is being followed.
        ended: the HALT or RETRY that did.
        conditions: in how many parts that may not be done the statement lies that is being followed.
    """

    def __init__(
        self,
        program: tree.Program,
        symbols: Symbols,
        spelling: Mapping[str, str],
        cell: KnownCell | None,
        *,
        source: Source,
        strict: bool,
    ) -> None:
        """Start in front of the first statement."""
        self.diagnostics = DiagnosticList()
        self.symbols, self.spelling, self.cell = symbols, spelling, cell
        self.source, self.strict = source, strict
        self.writing = Writing(program, symbols)
        self.facts = Facts()
        self.table = FrameState(cell, self.facts, rigid=self.writing.rigid)
        self.numbers: FactTable[tuple[float, Span] | None] = FactTable(
            self.facts, default=None, unknown=None, joined=same
        )
        self.steps: FactTable[Pose | None] = FactTable(self.facts, default=None, unknown=None, joined=same)
        self.last: FactTable[str | None] = FactTable(self.facts, default=None, unknown=UNKNOWN, joined=_joined_arms)
        self.now = Activation(scope=symbols.scope(None))
        self.calls: list[Called] = []
        self.branches: list[Uses] = []
        self.first = self.over = False
        self.ended: Span | None = None
        self.conditions = 0
        self._arms: dict[int, str | None] = {}
        self._implied: dict[int, bool] = {}
        self._settled: set[str] = set()
        self._said: set[tuple[str, Span]] = set()
        for name in symbols.imported:
            self.table.forget(name)

    # ---- what the translator wants to know -------------------------------------------------------------------------

    @property
    def arms(self) -> dict[int, str]:
        """The arms of MOVEs and GRASPs that are the same on every path through them, by where they start."""
        return {start: arm for start, arm in self._arms.items() if arm is not None}

    @property
    def implied(self) -> frozenset[int]:
        """The MOVEs that always hang the grasped frame on its arm first, by where they start."""
        return frozenset(start for start, always in self._implied.items() if always)

    def record(self, statement: tree.Move | tree.Grasp, arm: str | None, *, implied: bool = False) -> None:
        """Take note of the arm of a statement on this path through it; None where it is unknown."""
        if not self.first:
            start = statement.span.start
            self._arms[start] = arm if self._arms.get(start, arm) == arm else None
            self._implied[start] = implied and self._implied.get(start, True)

    # ---- names -----------------------------------------------------------------------------------------------------

    def bound(self, key: str) -> str | None:
        """Return where a variable is kept; None where that is unknown."""
        now = self.now
        return now.bindings.get(key) if now.scope.is_local(key) else key

    def variable(self, node: object, kind: VariableKind | None = None) -> str | None:
        """Return where a single variable or an element is kept; None for anything else.

        ``SLOT[1,2]`` is an element, ``SLOT[]`` one of which the indices are unknown.

        Args:
            node: what may name one.
            kind: what it must be; None for any kind that has values.
        """
        indices: tuple[tree.Expression, ...] = ()
        if isinstance(node, tree.Name):
            key = node.key
        elif isinstance(node, tree.Index):
            key, indices = node.name.key, node.indices
        else:
            return None
        result = self.now.scope.type(key)
        if result is None or bool(result.sizes) is not bool(indices):
            return None
        if result.kind is not kind if kind else result.kind is VariableKind.EVENT:
            return None
        slot = self.bound(key)
        if not indices or slot is None:
            return slot
        numbers = [self._index(*pair) for pair in zip(indices, result.sizes, strict=False)]
        known = [str(number) for number in numbers if number is not None]
        return f"{slot}[{','.join(known) if len(known) == len(result.sizes) else ''}]"

    def frame(self, node: object) -> str | None:
        """Return where a FRAME is kept, or an arm; None for anything else or what is unknown."""
        return node.key if isinstance(node, tree.ArmName) else self.variable(node, VariableKind.FRAME)

    def number(self, node: tree.Expression) -> tuple[float, Span] | None:
        """Return a number that is certain, and where it comes from."""
        if isinstance(node, tree.Number):
            # A number that was reported before is NaN, one with a unit depends on the units of the program.
            return None if node.unit or node.value != node.value else (node.value, node.span)
        if isinstance(node, tree.Binary | tree.Unary):
            result = constants.value(node, self._known)
            return None if result is None else (result, node.span)
        name = self.variable(node, VariableKind.SCALAR)
        return None if name is None or is_any_element(name) else self.numbers[name]

    def give(self, name: str, value: tuple[float, Span] | None, span: Span) -> None:
        """Give a number or step a value; ``value`` is that of a number that is certain."""
        if is_any_element(name):
            self.facts.wipe(name)
            return
        self.table.has(name)
        self.numbers.put(name, None if value is None else (value[0], span))

    def holds(self, node: tree.Expression) -> bool | None:
        """Return whether a condition holds; None where that is not certain."""
        return constants.holds(node, self._known)

    def passes(self, node: tree.For) -> int | None:
        """Return how often a FOR runs: 0, 1, or 2 for more often; None where that is not certain."""
        return constants.passes(node, self._known)

    def _known(self, node: tree.Expression) -> float | None:
        result = None if isinstance(node, tree.Binary | tree.Unary) else self.number(node)
        return None if result is None else result[0]

    def name(self, slot: str) -> str:
        """Return a kept name as the program writes it."""
        head, bracket, suffix = slot.partition("[")
        key = head.partition("'")[0].rpartition(".")[2]
        return f"{self.spelling.get(key, key)}{bracket}{suffix}"

    def some_arm(self) -> str:
        """Return an arm to name in advice."""
        return min(self.cell.arms, default="ARM_1") if self.cell else "ARM_1"

    def last_arm(self) -> str | None:
        """Return the arm named or moved last, for advice."""
        return None if (arm := self.last[LAST]) == UNKNOWN else arm

    def _index(self, node: tree.Expression, size: int) -> int | None:
        known = self.number(node)
        value = 0.0 if known is None else known[0]
        return int(value) if value.is_integer() and 1 <= value <= size else None

    # ---- what is said of the path ------------------------------------------------------------------------------------

    def unreached(self, span: Span) -> None:
        """Point at a statement that no path leads to."""
        if self.ended is None:
            return
        here = labels(self.ended, "no statement after this is executed")
        advice = "remove it, or make the statement that ends the path conditional"
        self.report("L305", "this statement is unreachable", span, "no path leads here", secondary=here, advice=advice)

    # ---- arms ------------------------------------------------------------------------------------------------------

    def mention(self, *nodes: tree.Expression | None) -> None:
        """Take note of the arms among these nodes."""
        for node in nodes:
            arm = None if node is None else self.frame(node)
            if node is not None and arm is not None and is_arm(arm):
                self.last.put(LAST, arm)
                self.look_up(arm, node.span)

    def use(self, arm: str, span: Span, *, moves: bool = False, hung: tuple[Label, ...] = ()) -> None:
        """Take note that an arm is set to work; ``hung`` states why it is this one."""
        self.last.put(LAST, arm)
        for branch in self.branches:
            site = self.calls[branch.depth].span if len(self.calls) > branch.depth else span
            if arm not in branch.arms or (moves and not branch.arms[arm].moves):
                branch.arms[arm] = Use(site, moves, hung)

    def look_up(self, arm: str, span: Span) -> None:
        """Say once that the cell does not have an arm."""
        if self.cell is None or arm in self.cell.arms or not self.settle(arm):
            return
        known = ", ".join(sorted(self.cell.arms)) or "none"
        self.report("E302", f"the cell has no arm {arm}", span, "no such arm", note=f"arms of the cell: {known}")

    def lose_arms(self, *, grasps: bool) -> None:
        """Take note that an arm was used, nobody knows which, perhaps to grasp something."""
        self.table.forget_hand(None, grasps=grasps)
        self.last.put(LAST, UNKNOWN)

    # ---- forgetting ------------------------------------------------------------------------------------------------

    def parting(self, span: Span, says: str, advice: str) -> Divergence:
        """Return what parts the paths here; see ``Divergence``."""
        return Divergence(span, self.conditions, says, advice)

    def forget_undone(self, writes: SideEffects, parting: Divergence | None = None) -> None:
        """Give up what a part of the program may change that is perhaps not done to its end.

        What had no value before may have one then, or none: there the paths part.
        """
        names = writes.values | writes.placed | writes.hung
        lacking = [name for name in self.kept(names) if not is_any_element(name) and not self.table.valued[name]]
        self.forget(writes)
        for name in lacking:
            self.table.sure.put(name, parting or False)

    def forget(self, writes: SideEffects) -> None:
        """Give up what a part of the program may change."""
        if writes.everything:
            self.facts.wipe(EVERYTHING)
            return
        for name in self.kept(writes.values):
            self._lose_value(name)
        for name in self.kept(writes.placed):
            self.table.shift(name)
        for name in self.kept(writes.hung):
            self.table.forget(name)
        arms = self._forget_moved(writes)
        if ANY_ARM in arms:
            self.lose_arms(grasps=writes.grasps)
        elif arms:
            for name in sorted(arms):
                self.table.forget_hand(name, grasps=writes.grasps)
            self.last.put(LAST, UNKNOWN if arms != {self.last[LAST]} else self.last[LAST])
        if arms or writes.placed or writes.hung:
            self.table.lose()

    def _forget_moved(self, writes: SideEffects) -> set[str]:
        """Give up where frames hang that MOVE may hang on an arm; return the arms that may be used."""
        arms = {name for name in self.kept(writes.arms) if name == ANY_ARM or is_arm(name)}
        for name in self.kept(writes.moved):
            carrier = None if self.table.unknown(name) else self.table.carrier(name)
            if carrier is None and (writes.grasps or self.table.holder(name) is not None):
                self.table.forget(name)
            arms.add(carrier or ANY_ARM)
        return arms

    def kept(self, names: frozenset[str]) -> Iterator[str]:
        """Give where the variables are kept that a part of the program calls so."""
        for name in sorted(names):
            head, bracket, indices = name.partition("[")
            _, point, key = head.partition(".")
            slot = self.now.bindings.get(key) if point else name
            if slot is not None:
                yield f"{slot}{bracket}{indices}" if point else slot

    def _lose_value(self, name: str) -> None:
        if is_any_element(name):
            self.facts.wipe(name)
        else:
            self.table.has(name)
            # Most variables are numbers or steps of which nothing is certain.
            for book in (self.numbers, self.steps):
                if book[name] is not None:
                    book.put(name, None)

    # ---- saying ----------------------------------------------------------------------------------------------------

    def settle(self, slot: str) -> bool:
        """Whether this is the first thing said of a variable or an arm; no second shall follow."""
        key = array_name(slot).partition("'")[0]
        news = key not in self._settled
        self._settled.add(key)
        return news

    def report(self, code: str, message: str, span: Span, label: str, **details: Unpack[Details]) -> None:
        """Say something once of each statement; of one in a procedure, with the calls that lead there."""
        if (code, span) in self._said:
            return
        self._said.add((code, span))
        calls = tuple(Label(call.span, f"{call.text} is called here") for call in self.calls[: -_MAX_CALLS - 1 : -1])
        details["secondary"] = (*details.get("secondary", ()), *calls)
        self.diagnostics.report(code, message, span, label, **details)

    @contextmanager
    def perhaps(self) -> Iterator[None]:
        """Follow what may not be done."""
        self.conditions += 1
        yield
        self.conditions -= 1

    @contextmanager
    def inside(self, activation: Activation, called: Called | None = None) -> Iterator[None]:
        """Follow the statements of a procedure."""
        before, self.now = self.now, activation
        self.calls += [called] if called else []
        yield
        self.now = before
        if called:
            self.calls.pop()
