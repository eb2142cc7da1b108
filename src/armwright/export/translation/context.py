"""Where a program is translated: what is known at a statement, and what has been translated so far."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, NoReturn, TypeAlias

import attrs
import numpy as np

from armwright.cell.model import Cell, CellArm
from armwright.cell.outputs import Output
from armwright.export.refusals import refusal
from armwright.export.translation.code import (
    Assign,
    Declaration,
    Kind,
    Number,
    Pose,
    Procedure,
    Statement,
    Truth,
    Value,
    Variable,
)
from armwright.export.translation.frames import AmbiguousFrameError, Attachments
from armwright.export.translation.passages import Run
from armwright.program.api import Compilation
from armwright.program.language.kinds import VariableKind, VariableType
from armwright.program.language.source import Span
from armwright.program.semantics.symbols import Scope
from armwright.program.syntax import tree

Translate: TypeAlias = Callable[["Context", Any], None]
Translators: TypeAlias = Mapping[type, Translate]

KINDS: Mapping[VariableKind, Kind] = {
    VariableKind.SCALAR: "number",
    VariableKind.BOOLEAN: "truth",
    VariableKind.TRANS: "pose",
    VariableKind.FRAME: "pose",
}
INITIAL: Mapping[Kind, Value] = {"number": Number(0.0), "truth": Truth(False), "pose": Pose(np.eye(4))}


@attrs.frozen
class Version:
    """A procedure as some of its calls need it.

    Attributes:
        procedure: its code.
        substituted: parameters that are other names of variables of the caller, and have no value of their own.
        written: the variables that it changes.
        after: where the frames hang behind it.
        rehung: frames, its own among them, that hang elsewhere behind it than before.
    """

    procedure: Procedure
    substituted: frozenset[str]
    written: frozenset[str]
    after: Attachments
    rehung: frozenset[str]


@attrs.define(kw_only=True)
class Context:
    """The statement that is translated, and all before it.

    Attributes:
        translators: of each kind of statement; any other is refused.
        call_function: what the call of a FUNCTION becomes.
        compiled: the program.
        cell: it acts on.
        arm: name of the arm that it moves.
        run: what its MOVEs did.
        scope: the names that statements see.
        attachments: where the frames hang.
        out: the statements so far, of this block.
        prefix: what begins the keys of variables of the procedure.
        bindings: parameters that are other names of variables.
        declarations: of all variables so far.
        kinds: of all variables and parameters.
        constants: their values.
        written: keys of variables that the procedure has changed.
        versions: of procedures that were translated, by name, attachments and bindings.
        procedures: their code in order.
        active: names of the procedures that are being translated.
        reached: of the MOVEs, by where they begin, whether the run comes to them.
        reads_hand: whether some value needs the pose of the tool.
        keeps_hand: whether a variable has the pose of the tool.
        notes: what is to be known of the translation, with lines.
        used: names that the program writes.
        outputs: switched by OPERATE, in order.
    """

    translators: Translators
    call_function: Callable[["Context", tree.Function], Value]
    compiled: Compilation
    cell: Cell
    arm: str
    run: Run
    scope: Scope
    attachments: Attachments
    out: list[Statement] = attrs.field(factory=list)
    prefix: str = ""
    bindings: dict[str, Variable] = attrs.field(factory=dict)
    declarations: dict[str, Declaration] = attrs.field(factory=dict)
    kinds: dict[str, Kind] = attrs.field(factory=dict)
    constants: dict[str, Value | str] = attrs.field(factory=dict)
    written: set[str] = attrs.field(factory=set)
    versions: dict[tuple[str, Attachments, tuple[tuple[str, Variable], ...]], Version] = attrs.field(factory=dict)
    procedures: list[Procedure] = attrs.field(factory=list)
    active: list[str] = attrs.field(factory=list)
    reached: dict[int, bool] = attrs.field(factory=dict)
    reads_hand: bool = False
    keeps_hand: bool = False
    used: frozenset[str] = frozenset()
    notes: dict[str, None] = attrs.field(factory=dict)
    outputs: dict[str, Output] = attrs.field(factory=dict)

    @property
    def placed(self) -> CellArm:
        """The arm in the cell."""
        return self.cell.arms[self.arm]

    # ---- refusals --------------------------------------------------------------------------------------------------

    def refuse(self, span: Span, message: str, label: str, *helps: str, code: str = "E619") -> NoReturn:
        """Refuse the program.

        Raises:
            ExportError: always.
        """
        raise refusal(self.compiled.source, code, message, span, label, helps=helps)

    @contextmanager
    def at(self, node: tree.Node) -> Iterator[None]:
        """Refuse a frame of which it is not known where it hangs, with the statement that needs to know."""
        try:
            yield
        except AmbiguousFrameError as error:
            name = error.args[0]
            text = f"where `{name.lower().removesuffix('[]')}` hangs depends on the way that the program takes here"
            label, advice = "this needs to know it", "write AFFIX or UNFIX for it right before this statement"
            self.refuse(node.span, text, label, advice, code="E620")

    # ---- statements ------------------------------------------------------------------------------------------------

    def translate(self, *statements: tree.Statement) -> None:
        """Translate statements, one after the other; what has no translator is refused."""
        for statement in statements:
            translator = self.translators.get(type(statement))
            if translator is None:
                self.refuse_construct(statement)
            translator(self, statement)

    def refuse_construct(self, node: tree.Node) -> NoReturn:
        """Refuse what the translation does not know, by its name.

        Raises:
            ExportError: always.
        """
        name = " ".join(self.compiled.source.slice(node.span).split()[:2]) or type(node).__name__.upper()
        text = f"`{name}` has no counterpart in the languages of controllers that is known here"
        helps = ["leave it to the controller, or export the run by `--mode plan`"]
        self.refuse(node.span, text, "it stands here", *helps)

    def block(self, *statements: tree.Statement) -> tuple[Statement, ...]:
        """Translate the statements of a block, and return them."""
        outside, self.out = self.out, []
        self.translate(*statements)
        inside, self.out = self.out, outside
        return tuple(inside)

    def repeated(self, *statements: tree.Statement) -> tuple[Statement, ...]:
        """Translate the statements of a loop, before and behind which the frames hang alike, and return them."""
        while True:
            before = self.attachments.copy()
            inside = self.block(*statements)
            self.attachments = before.join(self.attachments)
            if self.attachments == before:
                return inside

    def end_way(self) -> None:
        """Take note that nothing behind the last statement is reached from it."""
        self.attachments = Attachments({})

    # ---- variables -------------------------------------------------------------------------------------------------

    def key(self, name: str) -> str:
        """Return the key of a variable as the statements see it."""
        return f"{self.prefix}{name}" if self.scope.is_local(name) else name

    def type_of(self, node: tree.Name) -> VariableType:
        """Return the type of a variable."""
        found = self.scope.type(node.key)
        if found is None or found.kind not in KINDS:
            what = "a variable" if found is None else f"a variable of the type {found.kind}"
            text = f"`{node.text}` is {what}, which the languages of controllers have in no common way"
            self.refuse(node.span, text, "it stands here", "export the run by `--mode plan`")
        return found

    # Keys of the translation's own have a blank, which no name of a program has.

    def declare(self, key: str, kind: Kind, sizes: Sequence[int] = (), initial: Value | None = None) -> Variable:
        """Declare a variable, unless it has been."""
        if key not in self.kinds:
            self.kinds[key] = kind
            value = INITIAL[kind] if initial is None else initial
            self.declarations[key] = Declaration(key=key, kind=kind, sizes=tuple(sizes), initial=value)
        return Variable(key)

    def declare_frame(self, key: str) -> Variable:
        """Declare a frame of the cell, which is where the cell has it."""
        return self.declare(key, "pose", initial=self.initial_pose(key))

    def initial_pose(self, key: str) -> Pose | None:
        """Return where a frame of the cell is at the start: in the world, or on the tool that carries it."""
        frames = self.cell.tree()
        if key not in frames or not frames.has_value(key):
            return None
        X = frames.world(key)
        return Pose(np.linalg.inv(frames.world(self.arm)) @ X if self.arm in frames.ancestors(key) else X)

    def assign(self, target: Variable, value: Value, span: Span) -> None:
        """Let a variable get a value."""
        self.written.add(target.key)
        if value != target:
            self.out.append(Assign(span=span, target=target, value=value))

    def move_hand(self, goal: Value, span: Span) -> None:
        """Take note that the tool is somewhere else."""
        if self.keeps_hand:
            self.assign(Variable(self.arm), goal, span)

    def hand(self) -> Variable:
        """Return the variable that has the pose of the tool."""
        self.reads_hand = True
        return Variable(self.arm)
