"""What the generators of all statements share: the instructions so far, and what is known of the statements."""

from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

import attrs

from armwright.program.bytecode.emitter import Emitter
from armwright.program.bytecode.instructions import JumpTarget, Op, Operand
from armwright.program.flow_analysis.analysis import Flow
from armwright.program.language.names import is_arm
from armwright.program.language.source import Span
from armwright.program.syntax import tree

Generate: TypeAlias = Callable[["Context", Any], object]
Generators: TypeAlias = Mapping[type, Generate]


@attrs.define
class Context:
    """Where the code of statements is generated.

    Attributes:
        generators: of each kind of statement.
        out: the instructions so far.
        flow: the arms of the statements.
        spelling: how the program writes its names.
        in_action: whether the statements are the action of an ON, whose HALT ends the MOVE and not the program.
        watches: the WHENs of the present stretch of statements, by their instructions.
    """

    generators: Generators
    out: Emitter
    flow: Flow
    spelling: Mapping[str, str]
    in_action: bool = False
    watches: list[int] = attrs.field(factory=list)

    def generate(self, *statements: tree.Statement) -> None:
        """Generate the code of statements, one after the other."""
        for statement in statements:
            # A block is no statement of its own.
            if not isinstance(statement, tree.Block):
                self.out.begin()
            self.generators[type(statement)](self, statement)

    def generate_list(self, *statements: tree.Statement) -> None:
        """Generate a stretch of statements, at whose end its WHENs are disarmed."""
        outside, self.watches = self.watches, []
        self.generate(*statements)
        if self.watches:
            # No statement of its own: it belongs to the end of the stretch.
            span = statements[-1].span
            self.out.emit(Op.DISARM, *map(JumpTarget, self.watches), span=Span(span.end, span.end))
        self.watches = outside

    def generate_with(self, *statements: tree.Statement, in_action: bool) -> None:
        """Generate the code of statements as those of an action, or as others."""
        outside, self.in_action = self.in_action, in_action
        self.generate(*statements)
        self.in_action = outside

    def values(self, node: tree.Node) -> list[Operand]:
        """Generate the values of the parts of a node, and return where they are."""
        return [self.out.value(part) for part in tree.child_nodes(node)]

    def text(self, node: tree.Expression) -> str:
        """Return an expression as the program writes it, on one line."""
        if isinstance(node, tree.Name | tree.ArmName):
            return node.key if is_arm(node.key) else self.spelling.get(node.key, node.key)
        return " ".join(self.out.source.slice(node.span).split())


def one_instruction(op: Op) -> Generate:
    """Return the generator of statements that are one instruction, whose operands are the values of their parts."""

    def generate(context: Context, node: tree.Node) -> None:
        context.out.emit(op, *context.values(node), span=node.span)

    return generate
