"""From a checked tree to intermediate code."""

from collections.abc import Callable, Mapping

from armwright.program.bytecode.emitter import LATER, Emitter
from armwright.program.bytecode.instructions import Code, Form, Op, Operand, ProcedureCode, Text, stages_text
from armwright.program.flow_analysis.analysis import Flow
from armwright.program.language.kinds import VariableType
from armwright.program.language.names import is_arm
from armwright.program.language.source import Source, Span
from armwright.program.semantics.symbols import Symbols
from armwright.program.syntax import tree


def translate(source: Source, program: tree.Program, symbols: Symbols, flow: Flow, spelling: Mapping[str, str]) -> Code:
    """Return the code of a program.

    Args:
        source: its text.
        program: without errors.
        symbols: its names.
        flow: the arms of its statements.
        spelling: how it writes its names.
    """
    out = Emitter(source, symbols.units)
    writer = _Statements(out, flow, spelling)
    writer.all(program.statements)
    out.begin()
    out.emit(Op.STOP, span=program.end)
    procedures = {}
    for procedure in program.procedures:
        own = symbols.procedures[procedure.name.key]
        start = out.here.index
        writer.all(procedure.body.statements)
        out.begin()
        out.emit(Op.RET, span=procedure.body.end)
        procedures[procedure.name.key] = ProcedureCode(start=start, parameters=own.parameters, types=_known(own.types))
    return Code(
        instructions=tuple(out.instructions),
        constants=tuple(out.constants),
        types=_known(symbols.types),
        procedures=procedures,
        units=symbols.units,
        spelling={key: text for key, text in spelling.items() if text != key},
        source=source,
    )


def _known(types: Mapping[str, VariableType | None]) -> dict[str, VariableType]:
    return {key: kind for key, kind in types.items() if kind is not None}


class _Statements:
    """Writes statements."""

    def __init__(self, out: Emitter, flow: Flow, spelling: Mapping[str, str]) -> None:
        self._out, self._flow, self._spelling = out, flow, spelling
        self._in_action = False

    def all(self, statements: tuple[tree.Statement, ...]) -> None:
        """Write several, one after the other."""
        for statement in statements:
            self.one(statement)

    def one(self, statement: tree.Statement) -> None:
        """Write one statement."""
        if isinstance(statement, tree.Block):
            self.all(statement.statements)
            return
        self._out.begin()
        match statement:
            case tree.Assign() | tree.Affix() | tree.Unfix():
                self._frames(statement)
            case tree.Move():
                self._move(statement)
            case tree.Open() | tree.Grasp() | tree.Operate() | tree.ReadVisions() | tree.ReadSystem():
                self._tool_or_sensor(statement)
            case tree.If() | tree.While() | tree.Repeat() | tree.For():
                self._control(statement)
            case tree.Cobegin() | tree.Signal() | tree.Wait() | tree.Pause() | tree.Lock():
                self._processes(statement)
            case _:
                self._others(statement)

    # ---- frames, tools, sensors ------------------------------------------------------------------------------------

    def _frames(self, statement: tree.Assign | tree.Affix | tree.Unfix) -> None:
        out = self._out
        match statement:
            case tree.Assign(target=target, value=value):
                to = str(self._operand(target))
                if isinstance(value, tree.Number):
                    out.emit(Op.LOADS, to, out.constant(float(out.value(value))), span=statement.span)  # type: ignore[arg-type]
                else:
                    out.value(value, to)
                    self._whole(statement.span)
            case tree.Affix(child=child, parent=parent, at=at):
                operands = [self._operand(child), self._operand(parent)]
                if at is not None:
                    operands.append(out.value(at))
                rigid = ("RIGIDLY",) if statement.rigid else ()
                out.emit(Op.AFFIX if at is None else Op.AFFAT, *operands, *rigid, span=statement.span)
            case tree.Unfix(child=child, parent=parent):
                above = () if parent is None else (self._operand(parent),)
                out.emit(Op.UNFIX, self._operand(child), *above, span=statement.span)

    def _whole(self, span: Span) -> None:
        """The instruction written last does what its whole statement says."""
        out = self._out
        last = out.instructions[-1]
        out.instructions[-1] = type(last)(op=last.op, operands=last.operands, span=span, begins=last.begins)

    def _tool_or_sensor(
        self, statement: tree.Open | tree.Grasp | tree.Operate | tree.ReadVisions | tree.ReadSystem
    ) -> None:
        out, span = self._out, statement.span
        match statement:
            case tree.Open(arm=arm, width=width):
                wide = () if width is None else (out.value(width),)
                out.emit(Op.OPEN, self._operand(arm), *wide, span=span)
            case tree.Grasp(arm=None):
                known = self._flow.arms.get(span.start)
                out.emit(Op.GRASP, *((known,) if known else ()), span=span, comment="arm by context")
            case tree.Grasp(arm=arm) if arm is not None:
                out.emit(Op.GRASP, self._operand(arm), span=span)
            case tree.Operate(device=device, on=on):
                out.emit(Op.OPER, self._operand(device), "ON" if on else "OFF", span=span)
            case tree.ReadVisions(targets=targets):
                for target in targets:
                    out.emit(Op.READV, self._operand(target), span=span)
            case tree.ReadSystem(arm=arm):
                out.emit(Op.READS, self._operand(arm), span=span)

    # ---- motion ----------------------------------------------------------------------------------------------------

    def _move(self, move: tree.Move) -> None:
        out = self._out
        guards = [clause for clause in move.clauses if isinstance(clause, tree.On)]
        moved, goal = self._operand(move.moved), out.value(move.goal)
        # Places are worked out before the motion begins, so that its own instructions follow one another.
        parts = [(op, clause, self._parts(clause)) for op, clause in _in_order(move)]
        out.emit(Op.MVBEG, moved, goal, span=move.span)
        form = form_of(move, self._text)
        if form.direct:
            out.emit(Op.MVDIR, span=move.span)
        for op, clause, operands in parts:
            out.emit(op, *operands, span=clause.span)
        conditions = [(guard, out.emit(Op.MVON, LATER, out.passing(), LATER, span=guard.head)) for guard in guards]
        comment = stages_text(form)
        arm = self._flow.arms.get(move.span.start)
        if arm and moved != arm:
            comment += f", r = {arm} -> {self._text(move.moved)}"
        out.emit(Op.MVEND, span=move.span, comment=comment)
        if guards:
            over = out.emit(Op.JMP, LATER, span=move.span)
            for guard, number in conditions:
                self._guard(guard, number)
            out.land(over)

    def _guard(self, guard: tree.On, number: int) -> None:
        """Write condition and action of a guard, each ended by RET."""
        out = self._out
        old = out.instructions[number]
        truth = old.operands[1]
        condition = out.here
        out.value(guard.condition, str(truth))
        out.emit(Op.RET, span=guard.head)
        action = out.here
        inside, self._in_action = self._in_action, True
        self.one(guard.action)
        self._in_action = inside
        out.emit(Op.RET, span=guard.span)
        out.instructions[number] = type(old)(
            op=old.op, operands=(condition, truth, action), span=old.span, begins=old.begins
        )

    def _parts(self, clause: tree.Clause) -> tuple[Operand, ...]:
        out = self._out
        match clause:
            case tree.Via(points=points):
                return tuple(out.value(point) for point in points)
            case tree.Approach(point=value) | tree.Departure(point=value):
                return (out.value(value),)
            case tree.Speed(value=value) | tree.Blend(value=value) | tree.Duration(value=value):
                return (out.value(value),)
            case _:
                return ()

    def _text(self, node: tree.Expression) -> str:
        if isinstance(node, tree.Name | tree.ArmName):
            return node.key if is_arm(node.key) else self._spelling.get(node.key, node.key)
        return self._out.text(node)

    # ---- control ---------------------------------------------------------------------------------------------------

    def _control(self, statement: tree.If | tree.While | tree.Repeat | tree.For) -> None:
        out = self._out
        match statement:
            case tree.If():
                self._if(statement)
            case tree.While(condition=condition, body=body, head=head):
                top = out.here
                over = out.emit(Op.JZ, out.value(condition), LATER, span=head)
                self.one(body)
                out.emit(Op.JMP, top, span=head)
                out.land(over)
            case tree.Repeat(body=inner, condition=condition, tail=tail):
                top = out.here
                self.all(inner)
                out.begin()
                out.emit(Op.JZ, out.value(condition), top, span=tail)
            case tree.For():
                self._for(statement)

    def _if(self, choice: tree.If) -> None:
        out = self._out
        chain, otherwise = choice.chain
        overs: list[int] = []
        for one in chain:
            if one is not choice:
                out.begin()
            otherwise_at = out.emit(Op.JZ, out.value(one.condition), LATER, span=one.head)
            self.one(one.then)
            if one.otherwise is not None:
                overs.append(out.emit(Op.JMP, LATER, span=one.head))
            out.land(otherwise_at)
        if otherwise is not None:
            self.one(otherwise)
        for over in reversed(overs):
            out.land(over)

    def _for(self, loop: tree.For) -> None:
        out, head = self._out, loop.head
        count = out.passing()
        # The bounds may be variables that the loop changes: they count as they were.
        bounds = [out.passing() for _ in range(3)]
        for bound, node in zip(bounds, (loop.first, loop.last, loop.step), strict=True):
            if node is None:
                out.emit(Op.COPY, bound, 1.0, span=head)
            else:
                out.value(node, bound)
        out.emit(Op.COPY, count, 0.0, span=head)
        out.begin()
        top = out.here
        over = out.emit(Op.FOR, self._operand(loop.variable), count, *bounds, LATER, span=head)
        self.one(loop.body)
        out.emit(Op.JMP, top, span=head)
        out.land(over)

    # ---- processes -------------------------------------------------------------------------------------------------

    def _processes(self, statement: tree.Cobegin | tree.Signal | tree.Wait | tree.Pause | tree.Lock) -> None:
        out, span = self._out, statement.span
        match statement:
            case tree.Cobegin():
                self._cobegin(statement)
            case tree.Signal(event=event):
                out.emit(Op.SIG, self._operand(event), span=span)
            case tree.Wait(event=event):
                out.emit(Op.WAIT, self._operand(event), span=span)
            case tree.Pause(duration=duration):
                out.emit(Op.PAUSE, out.value(duration), span=span)
            case tree.Lock(targets=targets, body=body, head=head):
                locked = [self._operand(target) for target in targets]
                out.emit(Op.LOCK, *locked, span=head)
                self.one(body)
                out.emit(Op.UNLK, *locked, span=head)

    def _cobegin(self, cobegin: tree.Cobegin) -> None:
        out = self._out
        forks = []
        for branch in cobegin.branches:
            rank = () if branch.priority is None else (branch.priority.value,)
            forks.append(out.emit(Op.FORK, LATER, *rank, span=branch.head))
        join = out.emit(Op.JOIN, span=cobegin.span)
        over = out.emit(Op.JMP, LATER, span=out.instructions[join].span)
        # HALT in a branch ends the program, also where the branch is part of an action.
        inside, self._in_action = self._in_action, False
        for branch, fork in zip(cobegin.branches, forks, strict=True):
            out.land(fork)
            self.all(branch.body.statements)
            out.begin()
            out.emit(Op.QUIT, span=branch.body.end)
        self._in_action = inside
        out.land(over)

    # ---- the rest --------------------------------------------------------------------------------------------------

    def _others(self, statement: tree.Statement) -> None:
        out = self._out
        match statement:
            case tree.Try(body=body, recovery=recovery, span=span):
                attempt = out.emit(Op.TRY, LATER, span=span)
                self.all(body)
                well = out.emit(Op.ENDT, LATER, span=span)
                out.land(attempt)
                self.all(recovery)
                out.emit(Op.ENDR, span=span)
                out.land(well)
            case tree.Retry(span=span):
                out.emit(Op.RETRY, span=span)
            case tree.Halt(span=span):
                out.emit(Op.MVHLT if self._in_action else Op.HALT, span=span)
            case tree.Print(items=items, span=span):
                shown = [Text(item.value) if isinstance(item, tree.String) else out.value(item) for item in items]
                out.emit(Op.PRINT, *shown, span=span)
            case tree.Call(name=name, arguments=arguments, span=span):
                values = [out.value(argument) for argument in arguments]
                out.emit(Op.CALL, name.key, *values, span=span)
            case _:
                raise AssertionError(f"a checked program has no {type(statement).__name__}")

    def _operand(self, node: tree.Mobile) -> Operand:
        assert not isinstance(node, tree.Poison)  # noqa: S101 - a checked program has none
        return self._out.value(node)


# In the order of the listing: the way, the points on it, the speed.
_CLAUSES: dict[type, Op] = {
    tree.Straightly: Op.MVSTR,
    tree.Departure: Op.MVDEP,
    tree.Via: Op.MVVIA,
    tree.Approach: Op.MVAPP,
    tree.Speed: Op.MVSPD,
    tree.Blend: Op.MVBLD,
    tree.Duration: Op.MVDUR,
}


def _in_order(move: tree.Move) -> list[tuple[Op, tree.Clause]]:
    return [(op, clause) for kind, op in _CLAUSES.items() for clause in move.clauses if isinstance(clause, kind)]


def form_of(move: tree.Move, text: Callable[[tree.Expression], str]) -> Form:
    """Return the form of a MOVE, its places in the words that ``text`` gives for them."""
    via: tuple[str, ...] = ()
    ends: dict[type, str] = {}
    for clause in move.clauses:
        if isinstance(clause, tree.Via):
            via = tuple(text(point) for point in clause.points)
        elif isinstance(clause, tree.Approach | tree.Departure):
            ends[type(clause)] = text(clause.point)
    return Form(
        goal=text(move.goal),
        via=via,
        approach=ends.get(tree.Approach),
        departure=ends.get(tree.Departure),
        straight=any(isinstance(clause, tree.Straightly) for clause in move.clauses),
        blend=any(isinstance(clause, tree.Blend) for clause in move.clauses),
    )
