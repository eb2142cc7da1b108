"""From a checked tree to intermediate code."""

from collections.abc import Iterator, Mapping

import attrs

from armwright.program import matrices, tree
from armwright.program.code import Code, Instruction, Kind, Move, Op, stages_text
from armwright.program.flow import Flow
from armwright.program.names import Symbols
from armwright.program.source import Source


def translate(source: Source, program: tree.Program, symbols: Symbols, flow: Flow, spelling: Mapping[str, str]) -> Code:
    """Return the code of a program.

    Args:
        source: its text.
        program: without errors.
        symbols: its names.
        flow: the arms of its statements.
        spelling: how it writes its names.
    """
    frame = Code(
        instructions=(),
        spelling=spelling,
        kinds={key: kind for key, kind in symbols.kinds.items() if kind is not None}
        | dict.fromkeys(flow.arms.values(), Kind.FRAME),
        source=source,
    )
    translator = _Translator(frame, flow)
    instructions: list[Instruction] = []
    for index, statement in enumerate(program.statements):
        instructions += translator.statement(index, statement)
    instructions.append(Instruction(op=Op.STOP, span=program.end))
    return attrs.evolve(frame, instructions=tuple(instructions), constants=tuple(translator.constants))


class _Translator:
    """The constants so far."""

    def __init__(self, frame: Code, flow: Flow) -> None:
        self.constants: list[tuple[float, ...] | float] = []
        self._frame, self._flow = frame, flow

    def statement(self, index: int, statement: tree.Statement) -> Iterator[Instruction]:
        match statement:
            case tree.Init():
                yield self._init(statement)
            case tree.Affix(child=child, parent=parent, at=None):
                yield Instruction(op=Op.AFFIX, operands=(_key(child), _key(parent)), span=statement.span)
            case tree.Affix(child=child, parent=parent, at=step):
                yield Instruction(op=Op.AFFAT, operands=(_key(child), _key(parent), _key(step)), span=statement.span)
            case tree.Unfix(child=child, parent=parent):
                yield Instruction(op=Op.UNFIX, operands=(_key(child), _key(parent)), span=statement.span)
            case tree.Move():
                yield from self._move(index, statement)
            case tree.Grasp(arm=arm):
                comment = "" if arm else "arm by context"
                yield Instruction(op=Op.GRASP, operands=(self._flow.arms[index],), span=statement.span, comment=comment)
            case (
                tree.Open(arm=name)
                | tree.Operate(device=name)
                | tree.ReadVisions(target=name)
                | tree.ReadSystem(arm=name)
            ):
                yield Instruction(op=_ONE_NAME[type(statement)], operands=(_key(name),), span=statement.span)

    def _init(self, init: tree.Init) -> Instruction:
        index = len(self.constants)
        if isinstance(init.value, tree.Matrix):
            self.constants.append(matrices.constant(init.value))
            return Instruction(op=Op.LOADM, operands=(init.name.key, index), span=init.span)
        assert isinstance(init.value, tree.Number)  # noqa: S101 - a checked program has nothing else
        self.constants.append(init.value.value)
        return Instruction(op=Op.LOADS, operands=(init.name.key, index), span=init.span)

    def _move(self, index: int, move: tree.Move) -> Iterator[Instruction]:
        whole = _whole(move, arm=self._flow.arms[index], implied=index in self._flow.implied)
        yield Instruction(op=Op.MVBEG, operands=(whole.moved, whole.goal), span=move.span)
        if whole.direct and not any(isinstance(clause, tree.Directly) for clause in move.clauses):
            yield Instruction(op=Op.MVDIR, span=move.span)
        for kind, op in _CLAUSES.items():
            for clause in move.clauses:
                if isinstance(clause, kind):
                    yield Instruction(op=op, operands=_operands(clause), span=clause.span)
        comment = stages_text(self._frame, whole)
        if whole.moved != whole.arm:
            comment += f", r = {whole.arm} -> {self._frame.spelled(whole.moved)}"
        yield Instruction(op=Op.MVEND, span=move.span, move=whole, comment=comment)


_ONE_NAME: dict[type, Op] = {
    tree.Open: Op.OPEN,
    tree.Operate: Op.OPER,
    tree.ReadVisions: Op.READV,
    tree.ReadSystem: Op.READS,
}
# In the order of the listing: the way, the points on it, the speed.
_CLAUSES: dict[type, Op] = {
    tree.Directly: Op.MVDIR,
    tree.Straightly: Op.MVSTR,
    tree.Departure: Op.MVDEP,
    tree.Via: Op.MVVIA,
    tree.Approach: Op.MVAPP,
    tree.Speed: Op.MVSPD,
}


def _whole(move: tree.Move, arm: str, *, implied: bool) -> Move:
    """Return all that a MOVE says."""
    whole = Move(moved=_key(move.moved), arm=arm, implied=implied, goal=_key(move.goal))
    for clause in move.clauses:
        match clause:
            case tree.Straightly():
                whole = attrs.evolve(whole, straight=True)
            case tree.Via(points=points):
                whole = attrs.evolve(whole, via=tuple(_key(point) for point in points))
            case tree.Approach(point=point):
                whole = attrs.evolve(whole, approach=_key(point))
            case tree.Departure(point=point):
                whole = attrs.evolve(whole, departure=_key(point))
            case tree.Speed(value=value):
                whole = attrs.evolve(whole, speed=value.value if isinstance(value, tree.Number) else _key(value))
            case _:
                pass
    # No word on the way means the shortest.
    return attrs.evolve(whole, direct=not (whole.straight or whole.via or whole.approach or whole.departure))


def _operands(clause: tree.Clause) -> tuple[str | float, ...]:
    match clause:
        case tree.Via(points=points):
            return tuple(_key(point) for point in points)
        case tree.Approach(point=point) | tree.Departure(point=point):
            return (_key(point),)
        case tree.Speed(value=tree.Number(value=value)):
            return (value,)
        case tree.Speed(value=tree.Name(key=key)):
            return (key,)
        case _:
            return ()


def _key(node: tree.Mobile | None) -> str:
    assert isinstance(node, tree.Name | tree.ArmName)  # noqa: S101 - a checked program has nothing else
    return node.key
