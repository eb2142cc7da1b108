"""What a call takes, while it is being written."""

from collections.abc import Sequence

import attrs

from armwright.program.language_server.analysis import Analysis, before
from armwright.program.language_server.hover import signature
from armwright.program.language_server.keyword_docs import explained
from armwright.program.semantics.builtins import FUNCTIONS
from armwright.program.syntax import tree
from armwright.program.syntax.lexer import Token, TokenKind

_TAKES = {
    **dict.fromkeys(("ROTX", "ROTY", "ROTZ"), ("angle",)),
    "XYZ": ("x", "y", "z"),
    "INV": ("step",),
    "DIST": ("frame", "frame"),
    "FORCE": ("X | Y | Z",),
}


@attrs.frozen
class Signature:
    """What a procedure or function takes.

    Attributes:
        label: its head.
        parameters: what it takes, each a part of the label: its first character and the one after its last.
        active: which of them is being written.
        text: what it does; empty for procedures.
    """

    label: str
    parameters: tuple[tuple[int, int], ...]
    active: int
    text: str = ""


def signature_at(text: str, analysis: Analysis, offset: int) -> Signature | None:
    """Return what the call takes whose arguments are being written at a place; None where there is none.

    Args:
        text: the program as it is now.
        analysis: of the program, or of what it was before.
        offset: the place.
    """
    around = before(text, offset, analysis.compiled.standard)
    found = None if around is None else open_call(around.tokens)
    if found is None:
        return None
    name, active = found
    procedure = analysis.compiled.symbols.procedures.get(name.key)
    if procedure is not None:
        return _of_procedure(procedure.node, active)
    word = explained(name.key) if name.key in FUNCTIONS else None
    if word is None:
        return None
    takes = _TAKES[name.key]
    label = f"{name.key} ({', '.join(takes)}) : {FUNCTIONS[name.key].gives.name}"
    return Signature(label, _places(label, takes), min(active, len(takes) - 1), word.text)


def open_call(tokens: Sequence[Token]) -> tuple[Token, int] | None:
    """Return the name in front of the innermost parenthesis that is open behind tokens, and how many commas follow."""
    depth = commas = 0
    for at in range(len(tokens) - 1, 0, -1):
        key = tokens[at].key
        if key in (")", "]"):
            depth += 1
        elif key in ("(", "["):
            if depth == 0:
                name = tokens[at - 1]
                if key == "(" and name.kind is TokenKind.NAME:
                    return name, commas
                # An index, or parentheses around a part of an argument: what is outside of them counts.
                commas = 0
                continue
            depth -= 1
        elif key == "," and depth == 0:
            commas += 1
        elif key == ";" or key in ("BEGIN", "END"):
            return None
    return None


def _of_procedure(node: tree.Procedure, active: int) -> Signature:
    label, places = signature(node)
    return Signature(label, places, min(active, max(0, len(places) - 1)))


def _places(label: str, parts: Sequence[str]) -> tuple[tuple[int, int], ...]:
    at, places = label.find("("), []
    for part in parts:
        at = label.find(part, at + 1)
        places.append((at, at + len(part)))
        at += len(part)
    return tuple(places)
