"""Code of MOVE, with its clauses and its guards."""

from collections.abc import Callable

import attrs

from armwright.program.bytecode.context import Context, Generators
from armwright.program.bytecode.emitter import LATER
from armwright.program.bytecode.instructions import Form, Op, Operand, stages_text
from armwright.program.syntax import tree

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


def move(context: Context, node: tree.Move) -> None:
    """Generate one MOVE: its places, its instructions in one stretch, then conditions and actions of its guards."""
    out = context.out
    guards = [clause for clause in node.clauses if isinstance(clause, tree.On)]
    moved, goal = context.operand(node.moved), out.value(node.goal)
    # Places are worked out before the motion begins, so that its own instructions follow one another.
    parts = [(op, clause, _operands(context, clause)) for op, clause in _in_order(node)]
    out.emit(Op.MVBEG, moved, goal, span=node.span)
    form = form_of(node, context.text)
    if form.direct:
        out.emit(Op.MVDIR, span=node.span)
    for op, clause, operands in parts:
        out.emit(op, *operands, span=clause.span)
    conditions = [(guard, out.emit(Op.MVON, LATER, out.passing(), LATER, span=guard.head)) for guard in guards]
    comment = stages_text(form)
    arm = context.flow.arms.get(node.span.start)
    if arm and moved != arm:
        comment += f", r = {arm} -> {context.text(node.moved)}"
    out.emit(Op.MVEND, span=node.span, comment=comment)
    if guards:
        over = out.emit(Op.JMP, LATER, span=node.span)
        for guard, number in conditions:
            _guard(context, guard, number)
        out.patch_jump(over)


def _guard(context: Context, guard: tree.On, number: int) -> None:
    """Generate condition and action of a guard, each ended by RET."""
    out = context.out
    old = out.instructions[number]
    _, truth, _ = old.operands
    condition = out.here
    out.value(guard.condition, str(truth))
    out.emit(Op.RET, span=guard.head)
    action = out.here
    context.generate_with(guard.action, in_action=True)
    out.emit(Op.RET, span=guard.span)
    out.instructions[number] = attrs.evolve(old, operands=(condition, truth, action))


def _in_order(move: tree.Move) -> list[tuple[Op, tree.Clause]]:
    return [(op, clause) for kind, op in _CLAUSES.items() for clause in move.clauses if isinstance(clause, kind)]


def _operands(context: Context, clause: tree.Clause) -> tuple[Operand, ...]:
    out = context.out
    match clause:
        case tree.Via(points=points):
            return tuple(out.value(point) for point in points)
        case tree.Approach(point=value) | tree.Departure(point=value):
            return (out.value(value),)
        case tree.Speed(value=value) | tree.Blend(value=value) | tree.Duration(value=value):
            return (out.value(value),)
        case _:
            return ()


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


GENERATORS: Generators = {tree.Move: move}
