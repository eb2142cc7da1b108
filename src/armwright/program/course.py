"""One moment in a program: the frames, the names, the arm named or moved last, and what has been found."""

from collections.abc import Mapping

from armwright.program import tree
from armwright.program.code import Kind
from armwright.program.diagnostics import Findings, Label, Severity
from armwright.program.hanging import Hanging, is_arm
from armwright.program.known import KnownCell
from armwright.program.names import Symbols
from armwright.program.source import Span


class Course:
    """The state that the statements of a program change one after the other."""

    def __init__(self, symbols: Symbols, spelling: Mapping[str, str], cell: KnownCell | None, *, strict: bool) -> None:
        """Start in front of the first statement."""
        self.found = Findings()
        self.arms: dict[int, str] = {}
        self.implied: set[int] = set()
        self.symbols, self.spelling, self.cell, self.strict = symbols, spelling, cell, strict
        self.table = Hanging(cell)
        self.settled = set(symbols.poisoned)
        self.steps: set[str] = set()
        self.scalars: dict[str, tuple[float | None, Span]] = {}
        self.last_arm: str | None = None
        self.arm_unknown = False
        self.index = 0

    def need_value(self, node: tree.Mobile) -> None:
        """Say once that a frame has no value where it needs one."""
        key = self.symbols.frame(node)
        if key is None or is_arm(key) or key in self.table.valued or key in self.settled:
            return
        self.settled.add(key)
        assert not isinstance(node, tree.Poison)  # noqa: S101 - it has no name
        any_value = bool(self.table.assigned) or bool(self.table.links)
        note = "a frame gets its value from `=`, AFFIX ... AT, READ VISIONS or an imported cell file"
        if self.cell is None:
            note = "no cell was given; a cell file may give it one"
        self.found.say(
            "E304" if self.cell else "W204",
            f"frame `{node.text}` is used before it has a value",
            node.span,
            "no value here",
            secondary=self.declared(key) if any_value or not self.cell else (),
            notes=() if any_value and self.cell else (note,),
            severity=Severity.ERROR if self.cell else Severity.WARNING,
        )

    def need_number(self, node: tree.Mobile | None, kind: Kind) -> bool:
        """Say once that a scalar or trans has no value; whether it has one."""
        if not isinstance(node, tree.Name) or self.symbols.kinds.get(node.key) is not kind:
            return False
        if node.key in self.settled or node.key in (self.scalars if kind is Kind.SCALAR else self.steps):
            return True
        self.settled.add(node.key)
        self.found.say(
            "E303",
            f"`{node.text}` is used before it has a value",
            node.span,
            "no value here",
            secondary=self.declared(node.key),
            helps=(f"write `{node.text} = {'100' if kind is Kind.SCALAR else '( twelve numbers )'} ;` before",),
        )
        return False

    def mention(self, *nodes: tree.Mobile | None) -> None:
        """Take note of the arms among these nodes."""
        for node in nodes:
            if isinstance(node, tree.ArmName):
                self.use_arm(node)

    def use_arm(self, arm: tree.ArmName) -> None:
        """Take note of the arm named last; say once when the cell does not have it."""
        self.last_arm, self.arm_unknown = arm.key, False
        if self.cell is None or arm.key in self.cell.arms or arm.key in self.settled:
            return
        self.settled.add(arm.key)
        known = ", ".join(sorted(self.cell.arms)) or "none"
        self.found.say(
            "E302", f"the cell has no arm {arm.key}", arm.span, "no such arm", notes=(f"arms of the cell: {known}",)
        )

    def name(self, key: str) -> str:
        """Return a canonical name as the program writes it."""
        return self.spelling.get(key, key)

    def some_arm(self) -> str:
        """Return an arm to name in advice."""
        return min(self.cell.arms, default="ARM_1") if self.cell else "ARM_1"

    def declared(self, key: str) -> tuple[Label, ...]:
        """Return a label on the declaration of a name, if it has one."""
        declared = self.symbols.declared.get(key)
        return (Label(declared.span, "declared here"),) if declared else ()
