"""What a call takes, while it is being written."""

from collections.abc import Sequence
from itertools import accumulate

from lsprotocol import types as lsp

from armwright.program.language.position_codec import PositionCodec
from armwright.program.language_server.analysis import Analysis, lexical_context
from armwright.program.language_server.hover import signature
from armwright.program.language_server.keyword_docs import word_doc
from armwright.program.semantics.builtins import FUNCTIONS, MEASURES, WITH_AXIS, WITH_INPUT
from armwright.program.syntax.lexer import Token, TokenKind

_PARAMETERS = {
    **dict.fromkeys(("ROTX", "ROTY", "ROTZ"), ("angle",)),
    "XYZ": ("x", "y", "z"),
    "INV": ("step",),
    "DIST": ("frame", "frame"),
    "TEXT": ("value",),
    "JOINTS": ("q1", "q2", "q3"),
    **dict.fromkeys(WITH_INPUT, ("input",)),
    **dict.fromkeys(("OUTPUT", "SETTING"), ("device",)),
    "TIMER": ("timer",),
    "RPY": ("roll", "pitch", "yaw"),
    "ROT": ("x", "y", "z", "angle"),
    **dict.fromkeys(MEASURES, ("pose",)),
    **dict.fromkeys(("ABS", "SQRT", "ASIN", "ACOS", "ROUND"), ("number",)),
    **dict.fromkeys(("SIN", "COS", "TAN"), ("angle",)),
    "ATAN2": ("y", "x"),
    **dict.fromkeys(("MOD", "MIN", "MAX"), ("a", "b")),
    **dict.fromkeys(WITH_AXIS, ("X | Y | Z",)),
}


def signature_help(text: str, analysis: Analysis, offset: int) -> lsp.SignatureHelp | None:
    """Return what the call takes whose arguments are being written at a position; None where there is none.

    Args:
        text: the program as it is now.
        analysis: of the program, or of what it was before.
        offset: the position.
    """
    context = lexical_context(text, offset, analysis.compiled.standard)
    call = None if context is None else enclosing_call(context.preceding)
    if call is None:
        return None
    name, argument = call
    key = analysis.compiled.brought.get(name.key, name.key)
    procedure, meaning = analysis.compiled.symbols.procedures.get(key), None
    if procedure is not None:
        label, parameters = signature(procedure.node)
    elif name.key in FUNCTIONS and (word := word_doc(name.key)) is not None:
        takes, meaning = _PARAMETERS[name.key], word.text
        label = f"{name.key} ({', '.join(takes)}) : {FUNCTIONS[name.key].result.name}"
        parameters = _parameter_columns(label, takes)
    else:
        return None
    codec = PositionCodec(label, analysis.codec.encoding)
    columns = [lsp.ParameterInformation((codec.width(0, start), codec.width(0, end))) for start, end in parameters]
    active = min(argument, len(parameters) - 1) if parameters else None
    return lsp.SignatureHelp([lsp.SignatureInformation(label, meaning, columns, active)], 0, active)


def enclosing_call(tokens: Sequence[Token]) -> tuple[Token, int] | None:
    """Return the name in front of the innermost parenthesis that is open behind tokens, and how many commas follow."""
    depth = commas = 0
    for index in range(len(tokens) - 1, 0, -1):
        key = tokens[index].key
        if key in (")", "]"):
            depth += 1
        elif key in ("(", "["):
            if depth == 0:
                name = tokens[index - 1]
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


def _parameter_columns(label: str, parameters: Sequence[str]) -> tuple[tuple[int, int], ...]:
    """Return the columns of parameters that are separated by a comma and a blank."""
    starts = accumulate((len(parameter) + 2 for parameter in parameters), initial=label.index("(") + 1)
    return tuple((start, start + len(parameter)) for start, parameter in zip(starts, parameters, strict=False))
