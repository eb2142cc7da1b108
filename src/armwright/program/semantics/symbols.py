"""The names of a program: what each stands for, and where it was declared; of the program and of each procedure."""

from collections.abc import Mapping

import attrs

from armwright.program.language.kinds import VariableKind, VariableType
from armwright.program.language.units import UnitSystem
from armwright.program.language.words import Standard
from armwright.program.semantics.cell_symbols import STATION, WORLD
from armwright.program.syntax import tree

FRAME = VariableType(VariableKind.FRAME)
PREDECLARED: Mapping[str, VariableType] = {WORLD: FRAME, STATION: FRAME}


@attrs.frozen(kw_only=True)
class ProcedureSymbols:
    """A procedure and its own names.

    Attributes:
        node: the procedure.
        parameters: their names, in order; a name given twice stands here twice.
        types: what parameters and own variables stand for; None where that was reported as wrong.
        declared: where each was declared.
        poisoned: own names of which something has been said, so that they give no second message.
    """

    node: tree.Procedure
    parameters: tuple[str, ...]
    types: Mapping[str, VariableType | None]
    declared: Mapping[str, tree.Name]
    poisoned: frozenset[str] = frozenset()


@attrs.frozen(kw_only=True)
class Symbols:
    """The names of a program.

    Attributes:
        types: what each declared, predeclared or imported name stands for; None where that was reported as wrong.
        declared: where each was declared; predeclared and imported names have no such pose.
        procedures: by name.
        poisoned: names of which something has been said, so that they give no second message.
        units: what bare numbers count.
        imported: the frames that IMPORT has brought.
        std: the language.
    """

    types: Mapping[str, VariableType | None]
    declared: Mapping[str, tree.Name]
    procedures: Mapping[str, ProcedureSymbols] = attrs.field(factory=dict)
    poisoned: frozenset[str] = frozenset()
    units: UnitSystem = attrs.field(factory=UnitSystem)
    imported: frozenset[str] = frozenset()
    std: Standard = Standard.RLO_2

    def scope(self, procedure: str | None) -> "Scope":
        """Return the names as the statements of a procedure see them, or those of the main program for None.

        Raises:
            KeyError: there is no such procedure.
        """
        return Scope(symbols=self, procedure=None if procedure is None else self.procedures[procedure])


@attrs.frozen(kw_only=True)
class Scope:
    """The names that statements see: a procedure's own hide those of the program.

    Attributes:
        symbols: all names.
        procedure: the one the statements are in; None in the main program.
    """

    symbols: Symbols
    procedure: ProcedureSymbols | None = None

    def is_local(self, key: str) -> bool:
        """Whether a name is a parameter or own variable of the procedure."""
        return self.procedure is not None and key in self.procedure.types

    def type(self, key: str) -> VariableType | None:
        """Return what a name stands for; None where it is unknown or was reported as wrong."""
        local = self.procedure
        return local.types[key] if local is not None and key in local.types else self.symbols.types.get(key)

    def declared(self, key: str) -> tree.Name | None:
        """Return where a name was declared; None where it has no such pose."""
        local = self.procedure
        table = local.declared if local is not None and key in local.types else self.symbols.declared
        return table.get(key)

    def is_poisoned(self, key: str) -> bool:
        """Whether something has been said of a name, so that it is passed over in silence."""
        local = self.procedure
        return key in (local.poisoned if local is not None and key in local.types else self.symbols.poisoned)

    def frame(self, node: object) -> str | None:
        """Return the canonical name of a single FRAME or an arm; None for anything else or what is unknown."""
        if isinstance(node, tree.ArmName):
            return node.key
        return node.key if isinstance(node, tree.Name) and self.type(node.key) == FRAME else None
