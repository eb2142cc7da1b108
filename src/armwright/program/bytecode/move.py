"""Code of MOVE, with its clauses and its guards."""

from collections.abc import Callable

import attrs

from armwright.program.bytecode.context import Context, Generators
from armwright.program.bytecode.emitter import LATER
from armwright.program.bytecode.instructions import Form, Op, Operand, stages_text
from armwright.program.semantics.builtins import is_joints, joint_target
from armwright.program.syntax import tree

# In the order of the listing: the way, the points on it, the speed.
_CLAUSES: dict[type, Op] = {
    tree.Straightly: Op.MVSTR,
    tree.Circularly: Op.MVCIR,
    tree.Smoothly: Op.MVSMO,
    tree.Departure: Op.MVDEP,
    tree.Via: Op.MVVIA,
    tree.Approach: Op.MVAPP,
    tree.Speed: Op.MVSPD,
    tree.Blend: Op.MVBLD,
    tree.Duration: Op.MVDUR,
    tree.Velocity: Op.MVVEL,
    tree.Rotation: Op.MVROT,
    tree.Acceleration: Op.MVACC,
    tree.Tracking: Op.MVTRK,
    tree.Bound: Op.MVBND,
    tree.Rate: Op.MVRAT,
}


def move(context: Context, node: tree.Move) -> None:
    """Generate one MOVE: its places, its instructions in one stretch, then conditions and actions of its guards."""
    out = context.out
    guards = [clause for clause in node.clauses if isinstance(clause, tree.On)]
    moved = out.value(node.moved)
    joints = _joints(context, node.goal)
    goal = out.value(node.goal) if joints is None else moved
    # Places are worked out before the motion begins, so that its own instructions follow one another.
    kinds = list(_CLAUSES)
    clauses = sorted((one for one in node.clauses if type(one) in kinds), key=lambda one: kinds.index(type(one)))
    parts = [(_CLAUSES[type(clause)], clause.span, context.values(clause)) for clause in clauses]
    out.emit(Op.MVBEG, moved, goal, span=node.span)
    form = form_of(node, context.text)
    if form.direct:
        out.emit(Op.MVDIR, span=node.span)
    if joints is not None:
        op, operands = joints
        out.emit(op, *operands, span=node.goal.span)
    for op, span, operands in parts:
        out.emit(op, *operands, span=span)
    conditions = [(guard, out.emit(Op.MVON, LATER, out.passing(), LATER, span=guard.head)) for guard in guards]
    corrections = [
        (clause, out.emit(Op.MVCOR, LATER, out.passing(), span=clause.span))
        for clause in node.clauses
        if isinstance(clause, tree.Correction)
    ]
    comment = stages_text(form)
    arm = context.flow.arms.get(node.span.start)
    if arm and moved != arm:
        comment += f", r = {arm} -> {context.text(node.moved)}"
    out.emit(Op.MVEND, span=node.span, comment=comment)
    if guards or corrections:
        over = out.emit(Op.JMP, LATER, span=node.span)
        for guard, number in conditions:
            _guard(context, guard, number)
        for clause, number in corrections:
            out.patch_jump(number)
            out.value(clause.value, str(out.instructions[number].operands[1]))
            out.emit(Op.RET, span=clause.span)
        out.patch_jump(over)


def _joints(context: Context, goal: tree.Expression) -> tuple[Op, list[Operand]] | None:
    """Return the part of a MOVE that gives its goal by joint positions; None where that is a frame."""
    scope = context.out.scope
    if not isinstance(goal, tree.Function) or not is_joints(scope, goal):
        return None
    if (name := joint_target(scope, goal)) is not None:
        return Op.MVTGT, [name.key]
    return Op.MVJNT, [context.out.value(argument) for argument in goal.arguments]


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


def form_of(move: tree.Move, text: Callable[[tree.Expression], str]) -> Form:
    """Return the form of a MOVE, its places in the words that ``text`` gives for them."""
    clauses = {type(clause) for clause in move.clauses}
    via = [clause.points for clause in move.clauses if isinstance(clause, tree.Via)]
    ends = {type(end): text(end.point) for end in move.clauses if isinstance(end, tree.Approach | tree.Departure)}
    return Form(
        goal=text(move.goal),
        via=tuple(map(text, via[-1])) if via else (),
        approach=ends.get(tree.Approach),
        departure=ends.get(tree.Departure),
        straight=tree.Straightly in clauses,
        blend=tree.Blend in clauses,
        circular=tree.Circularly in clauses,
        tracking=tree.Tracking in clauses,
        smooth=tree.Smoothly in clauses,
    )


GENERATORS: Generators = {tree.Move: move}
