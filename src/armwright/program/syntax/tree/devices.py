"""Statements about hands, devices and sensors."""

import attrs

from armwright.program.language.source import Span
from armwright.program.syntax.tree.values import Expression, Mobile


@attrs.frozen
class Open:
    """``OPEN arm [TO width]``."""

    span: Span
    arm: Mobile
    width: Expression | None = None


@attrs.frozen
class Grasp:
    """``GRASP [arm]``."""

    span: Span
    arm: Mobile | None


@attrs.frozen
class Operate:
    """``OPERATE device [ON | OFF]``."""

    span: Span
    device: Mobile
    on: bool = True


@attrs.frozen
class ReadVisions:
    """``READ VISIONS (frame, frame)``."""

    span: Span
    targets: tuple[Mobile, ...]


@attrs.frozen
class ReadSystem:
    """``READ SYSTEM (arm)``."""

    span: Span
    arm: Mobile
