"""A whole program and what stands in front of its statements."""

from typing import TypeAlias

import attrs

from armwright.program.language.source import Span
from armwright.program.syntax.tree.control_flow import Block
from armwright.program.syntax.tree.statements import Statement
from armwright.program.syntax.tree.values import Name, Node, Number, String


@attrs.frozen
class TypeName(Node):
    """The type of a declaration.

    Attributes:
        span: where it stands.
        text: as written.
        key: SCALAR, TRANS, FRAME or EVENT; None when it is none of them.
        sizes: of an array, one for each index; empty for a single thing.
    """

    text: str
    key: str | None
    sizes: tuple[Number, ...] = ()


@attrs.frozen
class Declaration(Node):
    """``a, b : TYPE``, in a VAR part or as a parameter."""

    names: tuple[Name, ...]
    type: TypeName


@attrs.frozen
class Import(Node):
    """``IMPORT "file"``."""

    path: String


@attrs.frozen
class Units(Node):
    """``UNITS unit, unit``."""

    units: tuple[Name, ...]


@attrs.frozen
class Procedure(Node):
    """``PROCEDURE name (parameters) ; VAR ... BEGIN ... END``; ``head`` reaches up to the closing parenthesis."""

    head: Span
    name: Name
    parameters: tuple[Declaration, ...]
    declarations: tuple[Declaration, ...]
    body: Block


Header: TypeAlias = Declaration | Import | Units | Procedure


@attrs.frozen
class Program(Node):
    """A whole program.

    Attributes:
        span: from the first token to the last.
        headers: declarations, imports, units and procedures, in the order of the text.
        statements: in order.
        end: the closing END.
    """

    headers: tuple[Header, ...]
    statements: tuple[Statement, ...]
    end: Span

    @property
    def declarations(self) -> tuple[Declaration, ...]:
        """The declarations of the VAR parts."""
        return tuple(header for header in self.headers if isinstance(header, Declaration))

    @property
    def procedures(self) -> tuple[Procedure, ...]:
        """The procedures."""
        return tuple(header for header in self.headers if isinstance(header, Procedure))
