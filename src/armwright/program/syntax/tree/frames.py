"""Statements about frames: what a name stands for, and which frame moves with which."""

import attrs

from armwright.program.language.source import Span
from armwright.program.syntax.tree.values import ArmName, Expression, Mobile, Variable


@attrs.frozen
class Assign:
    """``variable = value``."""

    span: Span
    target: Variable | ArmName
    value: Expression


@attrs.frozen
class Affix:
    """``AFFIX child TO parent [AT step] [RIGIDLY]``; ``link`` reaches from AFFIX to the parent."""

    span: Span
    link: Span
    child: Mobile
    parent: Mobile
    at: Expression | None
    rigid: bool = False


@attrs.frozen
class Unfix:
    """``UNFIX child FROM parent``; the parent is missing where it was left out."""

    span: Span
    child: Mobile
    parent: Mobile | None
