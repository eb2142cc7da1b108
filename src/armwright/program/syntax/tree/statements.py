"""What a program does, statement by statement; each family has a module of its own."""

from typing import TypeAlias

from armwright.program.syntax.tree.control_flow import ControlStatement
from armwright.program.syntax.tree.devices import DeviceStatement
from armwright.program.syntax.tree.frames import FrameStatement
from armwright.program.syntax.tree.move import Move
from armwright.program.syntax.tree.output import Print
from armwright.program.syntax.tree.values import Poison

Statement: TypeAlias = FrameStatement | DeviceStatement | Move | ControlStatement | Print | Poison
