"""The syntax tree: what a program says, and where it says it."""

from armwright.program.syntax.tree.control_flow import (
    Block,
    Branch,
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
from armwright.program.syntax.tree.move import (
    Approach,
    Blend,
    Clause,
    Departure,
    Directly,
    Duration,
    Move,
    On,
    Speed,
    Straightly,
    Via,
    clause_word,
)
from armwright.program.syntax.tree.output import Print
from armwright.program.syntax.tree.program import Declaration, Header, Import, Procedure, Program, TypeName, Units
from armwright.program.syntax.tree.statements import Statement
from armwright.program.syntax.tree.traversal import dump, walk
from armwright.program.syntax.tree.values import (
    ArmName,
    Binary,
    Expression,
    Function,
    Index,
    Matrix,
    Mobile,
    Name,
    Node,
    Number,
    Poison,
    String,
    Unary,
    Variable,
    operation_chain,
)

__all__ = ["Statement", "clause_word", "dump", "operation_chain", "walk"]
__all__ += ["Declaration", "Header", "Import", "Procedure", "Program", "TypeName", "Units"]
__all__ += ["Affix", "Assign", "Unfix"]
__all__ += ["Grasp", "Open", "Operate", "ReadSystem", "ReadVisions"]
__all__ += [
    "Approach",
    "Blend",
    "Clause",
    "Departure",
    "Directly",
    "Duration",
    "Move",
    "On",
    "Speed",
    "Straightly",
    "Via",
]
__all__ += ["Block", "Branch", "Call", "Cobegin", "For", "Halt", "If", "Lock", "Pause", "Repeat", "Retry", "Signal"]
__all__ += ["Try", "Wait", "While"]
__all__ += ["Print"]
__all__ += ["ArmName", "Expression", "Index", "Mobile", "Name", "Node", "Number", "Poison", "String", "Variable"]
__all__ += ["Binary", "Function", "Matrix", "Unary"]
