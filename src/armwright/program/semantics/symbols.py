"""Symbol tables of a program and its procedures: the type of each name, and where it was declared."""

from collections.abc import Mapping
from typing import TypeAlias

import attrs

from armwright.program.language.diagnostic import Label
from armwright.program.language.kinds import VariableKind, VariableType
from armwright.program.language.units import UnitSystem
from armwright.program.language.words import VALUES, Standard
from armwright.program.semantics.cell_symbols import STATION, WORLD
from armwright.program.syntax import tree

FRAME = VariableType(VariableKind.FRAME)
PREDECLARED: Mapping[str, VariableType] = {WORLD: FRAME, STATION: FRAME}


@attrs.define(kw_only=True, eq=False)
class SymbolTable:
    """The names of a program, or those of one procedure.

    Attributes:
        types: of each name; None where its declaration was reported as wrong.
        declared: the declaration of each; predeclared and imported names have none.
        poisoned: names that were reported, so that they give no second message.
        used: names that statements use.
    """

    types: dict[str, VariableType | None] = attrs.field(factory=dict)
    declared: dict[str, tree.Name] = attrs.field(factory=dict)
    poisoned: set[str] = attrs.field(factory=set)
    used: set[str] = attrs.field(factory=set)


@attrs.define(kw_only=True, eq=False)
class ProcedureSymbols(SymbolTable):
    """A procedure with its parameters and own variables.

    Attributes:
        node: the procedure.
        parameters: their names, in order; a name declared twice stands here twice.
        inout: the parameters that are declared INOUT.
        result: of a FUNCTION, the type of its value; None for a procedure, and where it was reported as wrong.
    """

    node: tree.Procedure
    parameters: tuple[str, ...]
    inout: frozenset[str] = frozenset()
    result: VariableType | None = None

    @property
    def is_function(self) -> bool:
        """Whether it has a value."""
        return self.node.result is not None


@attrs.define(kw_only=True, eq=False)
class Symbols(SymbolTable):
    """The names of a program, those that are predeclared or imported among them.

    Attributes:
        procedures: by name.
        units: what bare numbers count.
        constants: the names of CONST parts.
        arguments: values that are given for constants in place of their own.
        imported: the frames that IMPORT has brought.
        open_import: whether some IMPORT was not looked up, so that any name may be that of a frame in it.
        std: the language.
    """

    procedures: dict[str, ProcedureSymbols] = attrs.field(factory=dict)
    units: UnitSystem = attrs.field(factory=UnitSystem)
    constants: set[str] = attrs.field(factory=set)
    arguments: dict[str, tree.Expression] = attrs.field(factory=dict)
    imported: set[str] = attrs.field(factory=set)
    open_import: bool = False
    std: Standard = Standard.RLO_2

    def constant_assignments(self, program: tree.Program) -> list[tree.Assign]:
        """Return the constants of a program as assignments, each of its own value or the one that is given for it."""
        nodes = program.constants
        return [tree.Assign(node.span, node.name, self.arguments.get(node.name.key, node.value)) for node in nodes]

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

    def is_parameter(self, key: str) -> bool:
        """Whether a name is a parameter of the procedure."""
        return self.procedure is not None and self.is_local(key) and key in self.procedure.parameters

    def table(self, key: str) -> SymbolTable:
        """Return the names among which a name is looked up."""
        local = self.procedure
        return local if local is not None and key in local.types else self.symbols

    def type(self, key: str) -> VariableType | None:
        """Return the type of a name; None where it is unknown or was reported as wrong."""
        return self.table(key).types.get(key)

    def is_constant(self, key: str) -> bool:
        """Whether a name is that of a constant."""
        return key in self.symbols.constants and not self.is_local(key)

    def is_value(self, key: str) -> bool:
        """Whether a name stands for a value of the language, because nothing else is called so."""
        symbols = self.symbols
        if key not in VALUES or symbols.std is not Standard.RLO_2 or symbols.open_import:
            return False
        return not self.is_local(key) and key not in symbols.types and key not in symbols.procedures

    def declared(self, key: str) -> tree.Name | None:
        """Return the declaration of a name; None where it has none."""
        return self.table(key).declared.get(key)

    def declaration_labels(self, *keys: str) -> tuple[Label, ...]:
        """Return labels on the declarations of names that have one."""
        return tuple(Label(name.span, "declared here") for name in map(self.declared, keys) if name is not None)

    def is_poisoned(self, key: str) -> bool:
        """Whether a name was reported, so that it gives no second message."""
        return key in self.table(key).poisoned


ScopedBody: TypeAlias = tuple[Scope, tuple[tree.Statement, ...]]


def scoped_bodies(program: tree.Program, symbols: Symbols) -> list[ScopedBody]:
    """Return the statements of the main program and of each procedure, with the names that they see."""
    procedures = symbols.procedures.items()
    inside = [(symbols.scope(key), procedure.node.body.statements) for key, procedure in procedures]
    return [(symbols.scope(None), program.statements), *inside]
