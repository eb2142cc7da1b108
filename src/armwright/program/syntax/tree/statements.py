"""What a program does, statement by statement; each family has a module of its own."""

from typing import TypeAlias

from armwright.program.syntax.tree.control_flow import (
    Block,
    Call,
    Cobegin,
    For,
    Halt,
    If,
    Lock,
    Pause,
    Repeat,
    Retry,
    Signal,
    Try,
    Wait,
    While,
)
from armwright.program.syntax.tree.devices import Grasp, Open, Operate, ReadSystem, ReadVisions
from armwright.program.syntax.tree.frames import Affix, Assign, Unfix
from armwright.program.syntax.tree.move import Move
from armwright.program.syntax.tree.output import Print
from armwright.program.syntax.tree.values import Poison

Statement: TypeAlias = (
    Assign
    | Affix
    | Unfix
    | Open
    | Grasp
    | Operate
    | ReadVisions
    | ReadSystem
    | Move
    | Block
    | If
    | While
    | Repeat
    | For
    | Cobegin
    | Signal
    | Wait
    | Pause
    | Lock
    | Try
    | Retry
    | Halt
    | Print
    | Call
    | Poison
)
