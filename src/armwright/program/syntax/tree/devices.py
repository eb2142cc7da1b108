"""Statements about hands, devices and sensors."""

from typing import TypeAlias

import attrs

from armwright.program.syntax.tree.values import Expression, Mobile, Node


@attrs.frozen
class Open(Node):
    """``OPEN arm [TO width]``."""

    arm: Mobile
    width: Expression | None = None


@attrs.frozen
class Grasp(Node):
    """``GRASP [arm]``."""

    arm: Mobile | None


@attrs.frozen
class Operate(Node):
    """``OPERATE device [ON | OFF]``."""

    device: Mobile
    on: bool = True


@attrs.frozen
class ReadVisions(Node):
    """``READ VISIONS (frame, frame)``."""

    targets: tuple[Mobile, ...]


@attrs.frozen
class ReadSystem(Node):
    """``READ SYSTEM (arm)``."""

    arm: Mobile


DeviceStatement: TypeAlias = Open | Grasp | Operate | ReadVisions | ReadSystem
