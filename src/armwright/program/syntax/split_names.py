"""Names torn apart by a blank: the report itself prints ``grasp 1`` and ``def 1`` for ``grasp1`` and ``def1``."""

from collections.abc import Collection, Sequence

from armwright.program.language.diagnostic import Diagnostic, DiagnosticList, Fix
from armwright.program.language.source import Source, Span
from armwright.program.syntax.lexer import Token, TokenKind

_NAME, _KEYWORD, _NUMBER = TokenKind.NAME, TokenKind.KEYWORD, TokenKind.NUMBER
# Behind these words a number may stand.
_BEFORE_NUMBERS = {"PAUSE", "STEP", "TO", "PRIORITY", "IF", "WHILE", "UNTIL", "AND", "OR", "NOT", "ON", "AT"}
# Behind these a name stands that an IMPORT may have brought.
_BEFORE_NAMES = {"TO", "FROM", "AFFIX", "UNFIX", "MOVE", "READ", "=", "(", ","}
_BLANKS = " \t"


def join_split_names(
    source: Source, tokens: Sequence[Token], declared: Collection[str] = ()
) -> tuple[Sequence[Token], list[Diagnostic]]:
    """Put names together that a blank has torn apart, and say so.

    A name and a number side by side never make sense, so they are one name where that name is declared. Where names
    are declared nothing else can be meant at all.

    Args:
        source: the text.
        tokens: of the text.
        declared: names of variables that were declared before this text.

    Returns:
        The tokens with one in place of each pair, and what was found.
    """
    pairs = [i for i in range(1, len(tokens)) if tokens[i].kind is _NUMBER and _is_name_and_number(source, tokens, i)]
    if not pairs:
        return tokens, []
    inside, names = _declarations(tokens, frozenset(pairs))
    names |= set(declared)
    imports = any(token.key == "IMPORT" and token.kind is _KEYWORD for token in tokens)
    joined_tokens: list[Token] = []
    findings = DiagnosticList()
    done = 0
    for pair in pairs:
        first, number = tokens[pair - 1], tokens[pair]
        key, before = f"{first.key}{number.key}", tokens[pair - 2].key if pair > 1 else ""
        device = first.kind is _NAME and before == "OPERATE"
        counts = first.kind is _KEYWORD and first.key in _BEFORE_NUMBERS
        certain = pair in inside or device or (key in names and first.key not in names and not counts)
        guessed = imports and first.kind is _NAME and first.key not in names and before in _BEFORE_NAMES
        if not (certain or guessed):
            continue
        text = f"{first.text}{number.text}"
        joined_tokens += [*tokens[done : pair - 1], Token(_NAME, text, key, first.start, number.end)]
        done = pair + 1
        span = Span(first.start, number.end)
        message = f"`{' '.join(source.slice(span).split())}` is not one name"
        fixes = (Fix(span, text),) if certain else ()
        findings.report("E106", message, span, "no blanks in a name", advice=f"write `{text}`", fixes=fixes)
    return [*joined_tokens, *tokens[done:]], findings


def _is_name_and_number(source: Source, tokens: Sequence[Token], index: int) -> bool:
    """Whether a number without sign, point and unit stands behind a word, with nothing but blanks in between."""
    first, number = tokens[index - 1], tokens[index]
    if first.kind is not _NAME and first.kind is not _KEYWORD:
        return False
    is_pair = not number.damaged and not first.damaged and number.text.isdigit()
    return is_pair and not source.text[first.end : number.start].strip(_BLANKS)


def declared_names(tokens: Sequence[Token]) -> set[str]:
    """Return all names that are declared anywhere in a text."""
    return _declarations(tokens, frozenset())[1]


def _declarations(tokens: Sequence[Token], pairs: frozenset[int]) -> tuple[set[int], set[str]]:
    """Return which pairs stand where names are declared, and all names that are declared anywhere in the text."""
    inside: set[int] = set()
    names: set[str] = set()
    declaring = False
    for index, token in enumerate(tokens):
        if token.kind is _KEYWORD:
            # The types and words of a declaration do not end it, and neither do torn words.
            ends = token.key in ("BEGIN", "IMPORT", "UNITS")
            declaring = token.key in ("VAR", "PROCEDURE") or (declaring and not ends)
        elif declaring and token.key in (",", ":") and tokens[index - 2].key not in (":", "OF"):
            if index - 1 in pairs:
                inside.add(index - 1)
                names.add(f"{tokens[index - 2].key}{tokens[index - 1].key}")
            elif tokens[index - 1].kind is _NAME:
                names.add(tokens[index - 1].key)
    return inside, names
