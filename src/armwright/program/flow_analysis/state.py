"""The abstract state at one point of a program: frames, values, the arm used last, and the diagnostics so far."""

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Unpack

import attrs

from armwright.program.flow_analysis import constants
from armwright.program.flow_analysis.facts import UNKNOWN, Divergence
from armwright.program.flow_analysis.frame_state import FrameState
from armwright.program.flow_analysis.lattice import EVERYTHING, Facts, FactTable, agreed_value
from armwright.program.flow_analysis.poses import Pose
from armwright.program.flow_analysis.side_effects import ANY_ARM, SideEffectAnalysis, SideEffects
from armwright.program.language.diagnostic import Details, DiagnosticList, Label, labels
from armwright.program.language.kinds import VariableKind
from armwright.program.language.names import array_name, is_any_element, is_arm
from armwright.program.language.source import Source, Span
from armwright.program.semantics.cell_symbols import KnownCell
from armwright.program.semantics.symbols import Scope, Symbols
from armwright.program.syntax import tree

# The key of the arm that was named or moved last; no variable has it.
LAST = "(last)"
# Values of the language that are the same at all times; truth values as numbers.
_VALUES = {"PI": math.pi, "TRUE": 1.0, "FALSE": 0.0}
# Calls named in a message: the innermost ones.
_MAX_CALLS = 3


@attrs.frozen(kw_only=True)
class Activation:
    """The main program, or one run of a procedure.

    Attributes:
        scope: the names its statements see.
        bindings: slots of its local names; None where they are unknown.
    """

    scope: Scope
    bindings: Mapping[str, str | None] = attrs.field(factory=dict)


@attrs.frozen
class Use:
    """The use of an arm by a branch.

    Attributes:
        span: the statement.
        moves: whether it moves the arm.
        affixed_at: labels on the AFFIX through which a moved frame moves the arm.
    """

    span: Span
    moves: bool
    affixed_at: tuple[Label, ...] = ()


@attrs.frozen
class Uses:
    """The arms that a branch has used so far, and the call depth of the branch itself."""

    arms: dict[str, Use]
    depth: int


@attrs.frozen
class Called:
    """A call on the path that is analysed."""

    name: str
    text: str
    span: Span


def _join_arms(arm: str | None, other: str | None) -> str | None:
    return arm if arm == other else UNKNOWN


class FlowState:
    """The abstract state, which the statements of a program change one after the other.

    Attributes:
        is_first_pass: whether this is the first of several passes of a loop: only what is certain to run counts.
        ended: whether HALT or RETRY has ended the path.
        end_span: that statement.
        conditions: number of conditional parts around the present statement.
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
        self.side_effects = SideEffectAnalysis(program, symbols)
        self.facts = Facts()
        self.table = FrameState(cell, self.facts, rigid=self.side_effects.rigid)
        self.numbers: FactTable[tuple[float, Span] | None] = FactTable(self.facts, None, None, agreed_value)
        self.steps: FactTable[Pose | None] = FactTable(self.facts, None, None, agreed_value)
        self.last: FactTable[str | None] = FactTable(self.facts, None, UNKNOWN, _join_arms)
        self.now = Activation(scope=symbols.scope(None))
        self.calls: list[Called] = []
        self.branches: list[Uses] = []
        self.is_first_pass = self.ended = False
        self.end_span: Span | None = None
        self.conditions = 0
        # Results by where a statement starts: its arm on all paths, and whether an AFFIX is implied on all of them.
        self.arms: dict[int, str | None] = {}
        self.implied: dict[int, bool] = {}
        self._reported_slots: set[str] = set()
        self._reported: set[tuple[str, Span]] = set()
        for name in symbols.imported:
            self.table.forget(name)

    def record(self, statement: tree.Move | tree.Grasp, arm: str | None, *, implied: bool = False) -> None:
        """Record the arm of a statement on this path through it; None where it is unknown."""
        if not self.is_first_pass:
            start = statement.span.start
            self.arms[start] = arm if self.arms.get(start, arm) == arm else None
            self.implied[start] = implied and self.implied.get(start, True)

    # ---- names -------------------------------------------------------------------------------------------------------

    def slot_of(self, key: str) -> str | None:
        """Return the slot of a variable; None where it is unknown."""
        now = self.now
        return now.bindings.get(key) if now.scope.is_local(key) else key

    def variable(self, node: object, kind: VariableKind | None = None) -> str | None:
        """Return the slot of a scalar variable or an element; None for anything else.

        ``SLOT[1,2]`` is an element, ``SLOT[]`` one of which the indices are unknown.

        Args:
            node: an expression that may name one.
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
        slot = self.slot_of(key)
        if not indices or slot is None:
            return slot
        pairs = zip(map(self.constant, indices), result.sizes, strict=False)
        known = [f"{value:.0f}" for value, size in pairs if value and value.is_integer() and 1 <= value <= size]
        return f"{slot}[{','.join(known) if len(known) == len(result.sizes) else ''}]"

    def frame(self, node: object) -> str | None:
        """Return the slot of a FRAME, or the name of an arm; None for anything else, or where it is unknown."""
        return node.key if isinstance(node, tree.ArmName) else self.variable(node, VariableKind.FRAME)

    def number(self, node: tree.Expression) -> tuple[float, Span] | None:
        """Return a constant number and the expression that it comes from; None where it is not constant."""
        if isinstance(node, tree.Number):
            # A number that was reported before is NaN, one with a unit depends on the units of the program.
            return None if node.unit or node.value != node.value else (node.value, node.span)
        if isinstance(node, tree.Binary | tree.Unary):
            result = constants.constant_value(node, self.constant)
            return None if result is None else (result, node.span)
        if isinstance(node, tree.Name) and self.now.scope.is_value(node.key):
            value = _VALUES.get(node.key)
            return None if value is None else (value, node.span)
        name = self.variable(node, VariableKind.SCALAR)
        return None if name is None or is_any_element(name) else self.numbers[name]

    def set_number(self, name: str, value: tuple[float, Span] | None, span: Span) -> None:
        """Record the assignment of a number or TRANS; ``value`` where the number is constant."""
        if is_any_element(name):
            self.facts.invalidate(name)
            return
        self.table.mark_assigned(name)
        self.numbers.set(name, None if value is None else (value[0], span))

    def constant(self, node: tree.Expression) -> float | None:
        """Return the value of a constant number; None where it is not constant."""
        result = self.number(node)
        return None if result is None else result[0]

    def name(self, slot: str) -> str:
        """Return the name of a slot as the program writes it."""
        head, bracket, suffix = slot.partition("[")
        key = head.partition("'")[0].rpartition(".")[2]
        return f"{self.spelling.get(key, key)}{bracket}{suffix}"

    def some_arm(self) -> str:
        """Return an arm to name in advice."""
        return min(self.cell.arms, default="ARM_1") if self.cell else "ARM_1"

    # ---- reachability ------------------------------------------------------------------------------------------------

    def report_unreachable(self, span: Span) -> None:
        """Warn of an unreachable statement."""
        if self.end_span is None:
            return
        here = labels(self.end_span, "no statement after this is executed")
        advice = "remove it, or make the statement that ends the path conditional"
        self.report("L305", "this statement is unreachable", span, "no path leads here", secondary=here, advice=advice)

    # ---- arms --------------------------------------------------------------------------------------------------------

    def note_arms(self, *nodes: tree.Expression | None) -> None:
        """Record the arms among these nodes as used last."""
        for node in nodes:
            arm = None if node is None else self.frame(node)
            if node is not None and arm is not None and is_arm(arm):
                self.last.set(LAST, arm)
                self.check_arm(arm, node.span)

    def note_arm_use(self, arm: str, span: Span, *, moves: bool = False, affixed_at: tuple[Label, ...] = ()) -> None:
        """Record the use of an arm; ``affixed_at`` states why it is this one."""
        self.last.set(LAST, arm)
        for branch in self.branches:
            site = self.calls[branch.depth].span if len(self.calls) > branch.depth else span
            if arm not in branch.arms or (moves and not branch.arms[arm].moves):
                branch.arms[arm] = Use(site, moves, affixed_at)

    def check_arm(self, arm: str, span: Span) -> None:
        """Report once that the cell does not have an arm."""
        if self.cell is None or arm in self.cell.arms or not self.is_first_report(arm):
            return
        known = ", ".join(sorted(self.cell.arms)) or "none"
        self.report("E302", f"the cell has no arm {arm}", span, "no such arm", note=f"arms of the cell: {known}")

    def forget_arms(self, *, grasps: bool) -> None:
        """Invalidate the facts about all grippers: an unknown arm was used, perhaps to grasp something."""
        self.table.forget_gripper(None, grasps=grasps)
        self.last.set(LAST, UNKNOWN)

    # ---- invalidation ------------------------------------------------------------------------------------------------

    def divergence(self, span: Span, message: str, advice: str) -> Divergence:
        """Return the divergence of paths at a statement."""
        return Divergence(span, self.conditions, message, advice)

    def forget_undone(self, effects: SideEffects, divergence: Divergence | None = None) -> None:
        """Invalidate what a part of the program may change that perhaps does not run to its end.

        What had no value before may have one then, or none: there the paths diverge.
        """
        slots = self.slots(effects.values | effects.posed | effects.affixed)
        unassigned = [slot for slot in slots if not is_any_element(slot) and not self.table.may_be_assigned[slot]]
        self.forget(effects)
        for slot in unassigned:
            self.table.definitely_assigned.set(slot, divergence or False)

    def forget(self, effects: SideEffects) -> None:
        """Invalidate what a part of the program may change."""
        if effects.everything:
            self.facts.invalidate(EVERYTHING)
            return
        for name in self.slots(effects.values):
            self._lose_value(name)
        for name in self.slots(effects.posed):
            self.table.forget_pose(name)
        for name in self.slots(effects.affixed):
            self.table.forget(name)
        arms = self._forget_moved(effects)
        if ANY_ARM in arms:
            self.forget_arms(grasps=effects.grasps)
        elif arms:
            for name in sorted(arms):
                self.table.forget_gripper(name, grasps=effects.grasps)
            self.last.set(LAST, UNKNOWN if arms != {self.last[LAST]} else self.last[LAST])
        if arms or effects.posed or effects.affixed:
            self.table.forget_grippers()

    def _forget_moved(self, effects: SideEffects) -> set[str]:
        """Invalidate the parents of frames that MOVE may affix; return the arms that may be used."""
        arms = {name for name in self.slots(effects.arms) if name == ANY_ARM or is_arm(name)}
        for name in self.slots(effects.moved):
            carrier = None if self.table.is_parent_unknown(name) else self.table.carrying_arm(name)
            if carrier is None and (effects.grasps or self.table.holding_arm(name) is not None):
                self.table.forget(name)
            arms.add(carrier or ANY_ARM)
        return arms

    def slots(self, names: frozenset[str]) -> Iterator[str]:
        """Yield the slots of names of the source."""
        for name in sorted(names):
            head, bracket, indices = name.partition("[")
            _, point, key = head.partition(".")
            slot = self.now.bindings.get(key) if point else name
            if slot is not None:
                yield f"{slot}{bracket}{indices}" if point else slot

    def _lose_value(self, name: str) -> None:
        if is_any_element(name):
            self.facts.invalidate(name)
        else:
            self.table.mark_assigned(name)
            # Most variables are numbers or steps of which nothing is certain.
            for table in (self.numbers, self.steps):
                if table[name] is not None:
                    table.set(name, None)

    # ---- diagnostics -------------------------------------------------------------------------------------------------

    def is_first_report(self, slot: str) -> bool:
        """Whether this is the first diagnostic about a variable or an arm; there is only one."""
        key = array_name(slot).partition("'")[0]
        news = key not in self._reported_slots
        self._reported_slots.add(key)
        return news

    def report(self, code: str, message: str, span: Span, label: str, **details: Unpack[Details]) -> None:
        """Report a diagnostic once for each statement; in a procedure with the calls that lead there."""
        if (code, span) in self._reported:
            return
        self._reported.add((code, span))
        calls = tuple(Label(call.span, f"{call.text} is called here") for call in self.calls[: -_MAX_CALLS - 1 : -1])
        details["secondary"] = (*details.get("secondary", ()), *calls)
        self.diagnostics.report(code, message, span, label, **details)

    @contextmanager
    def conditional(self) -> Iterator[None]:
        """Analyse statements that may not run."""
        self.conditions += 1
        yield
        self.conditions -= 1

    @contextmanager
    def in_procedure(self, activation: Activation, called: Called | None = None) -> Iterator[None]:
        """Analyse the statements of a procedure."""
        before, self.now = self.now, activation
        self.calls += [called] if called else []
        yield
        self.now = before
        if called:
            self.calls.pop()
