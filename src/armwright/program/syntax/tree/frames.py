"""Statements about frames: what a name stands for, and which frame moves with which."""

from typing import TypeAlias

import attrs

from armwright.program.language.source import Span
from armwright.program.syntax.tree.values import ArmName, Expression, Mobile, Node, Variable


@attrs.frozen
class Assign(Node):
    """``variable = value``."""

    target: Variable | ArmName
    value: Expression


@attrs.frozen
class Affix(Node):
    """``AFFIX child TO parent [AT step] [RIGIDLY]``; ``link`` reaches from AFFIX to the parent."""

    link: Span
    child: Mobile
    parent: Mobile
    at: Expression | None
    rigid: bool = False


@attrs.frozen
class Unfix(Node):
    """``UNFIX child FROM parent``; the parent is missing where it was left out."""

    child: Mobile
    parent: Mobile | None


FrameStatement: TypeAlias = Assign | Affix | Unfix
