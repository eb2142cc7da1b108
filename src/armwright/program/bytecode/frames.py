"""Code of AFFIX, UNFIX and assignments."""

import attrs

from armwright.program.bytecode.context import Context, Generators
from armwright.program.bytecode.instructions import Op
from armwright.program.syntax import tree


def assign(context: Context, node: tree.Assign) -> None:
    """Generate the value, and let the last instruction stand for the whole statement."""
    out, to = context.out, str(context.out.value(node.target))
    if isinstance(node.value, tree.Number):
        out.emit(Op.LOADS, to, out.constant(out.literal_value(node.value)), span=node.span)
        return
    out.value(node.value, to)
    out.instructions[-1] = attrs.evolve(out.instructions[-1], span=node.span, comment="")


def affix(context: Context, node: tree.Affix) -> None:
    """Generate one AFFIX."""
    operands = [context.out.value(part) for part in (node.child, node.parent, node.at) if part is not None]
    rigid = ("RIGIDLY",) if node.rigid else ()
    context.out.emit(Op.AFFIX if node.at is None else Op.AFFAT, *operands, *rigid, span=node.span)


def unfix(context: Context, node: tree.Unfix) -> None:
    """Generate one UNFIX."""
    parent = () if node.parent is None else (context.out.value(node.parent),)
    context.out.emit(Op.UNFIX, context.out.value(node.child), *parent, span=node.span)


GENERATORS: Generators = {tree.Assign: assign, tree.Affix: affix, tree.Unfix: unfix}
