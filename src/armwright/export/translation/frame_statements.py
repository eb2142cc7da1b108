"""Assignments, AFFIX and UNFIX: poses are kept in the world, and on the tool for what an arm carries."""

from collections.abc import Sequence

import attrs

from armwright.cell.frames import WORLD
from armwright.export.translation.code import Pose, Value, Variable
from armwright.export.translation.context import Context, Translators
from armwright.export.translation.frames import IN_THE_WORLD, Hanging
from armwright.export.translation.values import (
    elements,
    frame_of,
    name_of,
    plain_variable,
    require_arm,
    simplified,
    value_of,
)
from armwright.program.language.kinds import VariableKind
from armwright.program.language.names import is_arm
from armwright.program.language.source import Span
from armwright.program.syntax import tree

# Frames that are moved one by one with that which they hang on; more of them are a table.
_MOST_MOVED = 60


def assign(context: Context, node: tree.Assign) -> None:
    """Translate an assignment."""
    if isinstance(node.target, tree.ArmName) or is_arm(name_of(node.target).key):
        context.refuse_construct(node)
    name = name_of(node.target)
    kind, value = context.type_of(name).kind, value_of(context, node.value)
    if kind is VariableKind.FRAME:
        place_frame(context, node, *frame_of(context, node.target), value)
    else:
        context.assign(plain_variable(context, node.target), value, node.span)


def place_frame(context: Context, node: tree.Node, name: str, variable: Variable, value: Value) -> None:
    """Give a frame a pose in the world, and move what hangs on it."""
    attachments, span = context.attachments, node.span
    if not attachments[name].parents:
        attachments.set(name, IN_THE_WORLD)
    with context.at(node):
        carried = attachments.carried_by(name) == context.arm
        top = attachments.rigid_root(name)
        moved = [*([top] if top != name else []), *attachments.descendants(top)]
    if is_arm(top) or top == WORLD:
        context.refuse_construct(node)
    own = _on_tool(context, value) if carried else value
    others = [one for one in moved if one != name]
    _displace(context, variable, own, others, span)


def _displace(context: Context, variable: Variable, value: Value, others: Sequence[str], span: Span) -> None:
    """Let a frame get its pose, and others move with it."""
    known = [one for name in others if name.removesuffix("[]") in context.used for one in _declared(context, name)]
    if len(known) > _MOST_MOVED:
        text = f"{len(known)} frames move with this one, and each would be a line"
        context.refuse(span, text, "they move here", code="E620")
    if not known:
        context.assign(variable, value, span)
        return
    change = context.declare("CHANGE OF FRAME", "pose")
    context.assign(change, simplified("compose", (value, simplified("inverse", (variable,)))), span)
    # Before the others: the value may be that of one of them, where it is now.
    context.assign(variable, value, span)
    for one in known:
        context.assign(one, simplified("compose", (change, one)), span)


def _declared(context: Context, name: str) -> list[Variable]:
    context.declare_frame(name.removesuffix("[]"))
    return elements(context, name)


def _on_tool(context: Context, value: Value) -> Value:
    return simplified("compose", (simplified("inverse", (context.hand(),)), value))


def affix(context: Context, node: tree.Affix) -> None:
    """Translate an AFFIX."""
    require_arm(context, node.parent)
    step = None if node.at is None else value_of(context, node.at)
    name, variable = frame_of(context, node.child)
    parent, place, root = _parent(context, node)
    hang(context, node, name, variable, Hanging(frozenset({parent}), root, node.rigid))
    if step is not None:
        with context.at(node):
            others = [*context.attachments.descendants(name)]
        _displace(context, variable, simplified("compose", (place, step)), others, node.span)


def _parent(context: Context, node: tree.Affix) -> tuple[str, Value, str]:
    """Return what a frame is to hang on: its name, its pose there where it is kept, and the arm or WORLD."""
    if isinstance(node.parent, tree.ArmName) or is_arm(name_of(node.parent).key):
        return context.arm, Pose.identity(), context.arm
    if name_of(node.parent).key == WORLD:
        return WORLD, Pose.identity(), WORLD
    parent, place = frame_of(context, node.parent)
    with context.at(node):
        return parent, place, context.attachments.carried_by(parent)


def hang(context: Context, node: tree.Node, name: str, variable: Variable, where: Hanging) -> None:
    """Let a frame hang elsewhere from now on, where it is, with all that hangs on it."""
    attachments = context.attachments
    if attachments[name].parents:
        with context.at(node):
            before = attachments.carried_by(name)
            others = [*attachments.descendants(name)]
        if before != where.root:
            known = [
                one for other in others if other.removesuffix("[]") in context.used for one in _declared(context, other)
            ]
            for one in (variable, *known):
                there = _on_tool(context, one) if where.root != WORLD else simplified("compose", (context.hand(), one))
                context.assign(one, there, node.span)
            for other in others:
                attachments.replace(other, attrs.evolve(attachments[other], root=where.root))
    attachments.set(name, where)


def unfix(context: Context, node: tree.Unfix) -> None:
    """Translate an UNFIX."""
    name, variable = frame_of(context, node.child)
    hang(context, node, name, variable, IN_THE_WORLD)


TRANSLATORS: Translators = {tree.Assign: assign, tree.Affix: affix, tree.Unfix: unfix}
