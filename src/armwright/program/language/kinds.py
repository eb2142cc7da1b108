"""What variables of a program hold: the kinds of things, alone or in arrays."""

import enum

import attrs


class VariableKind(enum.StrEnum):
    """What a name stands for."""

    SCALAR = "SCALAR"
    TRANS = "TRANS"
    FRAME = "FRAME"
    EVENT = "EVENT"
    BOOLEAN = "BOOLEAN"
    TEXT = "TEXT"


# Kinds of which a procedure gets a value, and no variable, where its head does not say otherwise.
BY_VALUE = frozenset((VariableKind.SCALAR, VariableKind.TRANS, VariableKind.BOOLEAN, VariableKind.TEXT))


@attrs.frozen
class VariableType:
    """What a variable holds.

    Attributes:
        kind: of the thing, or of each element.
        sizes: of an array, one for each index; empty for a single thing.
    """

    kind: VariableKind
    sizes: tuple[int, ...] = ()

    def __str__(self) -> str:
        """Return the type as a declaration writes it."""
        sizes = ",".join(map(str, self.sizes))
        return f"ARRAY [{sizes}] OF {self.kind}" if sizes else str(self.kind)
