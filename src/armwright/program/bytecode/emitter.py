"""Writing instructions: places that are known later, values in passing, and the code of expressions."""

import math

import attrs

from armwright.program.bytecode.instructions import Constant, Instruction, JumpTarget, Op, Operand, Text
from armwright.program.language.source import Source, Span
from armwright.program.language.units import convert
from armwright.program.language.words import VALUES
from armwright.program.semantics.builtins import WITH_KEY
from armwright.program.semantics.symbols import Scope
from armwright.program.syntax import pose_literals, tree

# A place that will be known later.
LATER = JumpTarget(-1)

_OPERATIONS = {"*": Op.MUL, "/": Op.DIV, "+": Op.ADD, "-": Op.SUB}
_OPERATIONS |= {"<": Op.LT, "<=": Op.LE, "=": Op.EQ, "<>": Op.NE, ">=": Op.GE, ">": Op.GT}


class Emitter:
    """The instructions of a program so far.

    Attributes:
        scope: the names that the present statements see.
    """

    def __init__(self, source: Source, scope: Scope) -> None:
        """Start with nothing."""
        self.source, self.scope, self.units = source, scope, scope.symbols.units
        self.instructions: list[Instruction] = []
        self.constants: list[tuple[float, ...] | float] = []
        self._passing = 0
        self._begins = False

    @property
    def here(self) -> JumpTarget:
        """Where the next instruction will stand."""
        return JumpTarget(len(self.instructions))

    def begin(self) -> None:
        """A statement begins: its first instruction is marked."""
        self._begins = True

    def passing(self) -> str:
        """Return the name of a new value in passing."""
        self._passing += 1
        return f"%{self._passing}"

    def emit(self, op: Op, *operands: Operand, span: Span, comment: str = "") -> int:
        """Write an instruction; return its number."""
        begins, self._begins = self._begins, False
        self.instructions.append(Instruction(op=op, operands=operands, span=span, begins=begins, comment=comment))
        return len(self.instructions) - 1

    def patch_jump(self, number: int) -> None:
        """Let a jump whose target was left open go to the next instruction."""
        old, target = self.instructions[number], self.here
        operands = tuple(target if operand == LATER else operand for operand in old.operands)
        self.instructions[number] = attrs.evolve(old, operands=operands)

    def constant(self, value: tuple[float, ...] | float) -> Constant:
        """Keep a constant."""
        self.constants.append(value)
        return Constant(len(self.constants) - 1)

    # ---- expressions -----------------------------------------------------------------------------------------------

    def value(self, node: tree.Node, into: str | None = None) -> Operand:
        """Write the code of an expression.

        Args:
            node: a checked expression.
            into: a variable or value in passing that shall hold the value; where it goes by itself when left out.

        Returns:
            The operand that has the value: ``into`` if given.
        """
        match node:
            case tree.Name(key=key) if key in VALUES and self.scope.is_value(key):
                return self._value_of_language(node, into)
            case tree.Number():
                operand: Operand = self.literal_value(node)
            case tree.String(value=characters):
                operand = Text(characters)
            case tree.Name(key=key) | tree.ArmName(key=key):
                operand = key
            case tree.Index(name=name, indices=indices):
                operand = self._operation(Op.ELEM, self.passing(), name.key, *map(self.value, indices), node=node)
            case tree.Binary():
                return self._chain(node, into)
            case tree.Matrix():
                return self._matrix(node, into or self.passing())
            case tree.Function():
                return self._function(node, into)
            case tree.Unary():
                value = self.value(node.operand)
                op = Op.NOT if node.operation == "NOT" else Op.NEG
                return self._operation(op, into or self.passing(), value, node=node)
            case _:
                raise AssertionError(f"a checked program has no {type(node).__name__}")
        return operand if into is None else self._operation(Op.COPY, into, operand, node=node)

    def _operation(self, op: Op, to: str, *operands: Operand, node: tree.Expression) -> str:
        """Write an operation; return where its result goes."""
        self.emit(op, to, *operands, span=node.span)
        return to

    def _function(self, node: tree.Function, into: str | None) -> str:
        is_own = node.name.key in self.scope.symbols.procedures
        operands: list[Operand]
        if node.name.key in WITH_KEY and not is_own:
            operands = [name.key for name in node.arguments if isinstance(name, tree.Name)]
        else:
            operands = [self.value(argument) for argument in node.arguments]
        to = into or self.passing()
        if is_own:
            return self._operation(Op.CALLF, to, node.name.key, *operands, node=node)
        if node.name.key == "TORQUE":
            # Force and moment are read by one operation.
            return self._operation(Op.FORCE, to, f"M{operands[0]}", node=node)
        return self._operation(Op[node.name.key], to, *operands, node=node)

    def _value_of_language(self, node: tree.Name, into: str | None) -> Operand:
        if node.key != "PI":
            to = into or self.passing()
            if node.key in ("TIME", "MESSAGE"):
                return self._operation(Op[node.key], to, node=node)
            return self._operation(Op.LOADB, to, node.key, node=node)
        return math.pi if into is None else self._operation(Op.COPY, into, math.pi, node=node)

    def literal_value(self, node: tree.Number) -> float:
        """Return the value of a number literal in the units of the program."""
        return float(convert(node.value, node.unit, self.units))

    def _chain(self, node: tree.Binary, into: str | None) -> Operand:
        """Write the operations of a chain, one after the other."""
        first, chain = tree.operation_chain(node)
        variable = None
        if into is not None and not into.startswith("%") and any(link.operation in ("AND", "OR") for link in chain):
            # The variable may be part of the condition: it gets its value when all of that is worked out.
            variable, into = into, None
        # Both sides of AND and OR go to the same place, so that of the last is that of all in front of it.
        targets: list[str | None] = []
        for link in reversed(chain):
            joins = link.operation in ("AND", "OR")
            targets.append((into or self.passing()) if joins else into)
            into = targets[-1] if joins else None
        left = self.value(first, into)
        for link in chain:
            to = targets.pop()
            if to is not None and link.operation in ("AND", "OR"):
                left = self._joint(link, to)
            else:
                right = self.value(link.right)
                left = self._operation(_OPERATIONS[link.operation], to or self.passing(), left, right, node=link)
        return left if variable is None else self._operation(Op.COPY, variable, left, node=node)

    def _joint(self, node: tree.Binary, to: str) -> str:
        """AND and OR look at the right side only where it matters: ``n > 0 AND a[n] > 2``."""
        decides = to
        if node.operation == "OR":
            decides = self.passing()
            self.emit(Op.NOT, decides, to, span=node.left.span)
        over = self.emit(Op.JZ, decides, LATER, span=node.span)
        self.value(node.right, to)
        self.patch_jump(over)
        return to

    def _matrix(self, node: tree.Matrix, to: str) -> str:
        if not all(isinstance(item, tree.Number) for item in node.items):
            return self._operation(Op.MATX, to, *map(self.value, node.items), node=node)
        numbers, metres = pose_literals.pose_numbers(node), self.units.metres
        shift = [self.literal_value(item) * metres for item in node.items[9:] if isinstance(item, tree.Number)]
        return self._operation(Op.LOADM, to, self.constant((*numbers[:9], *shift)), node=node)
