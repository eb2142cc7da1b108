"""What belongs to RLO-2: recognised, named once, and passed over, so that the rest of the program is still judged."""

from armwright.program.language.source import Span
from armwright.program.language.words import CLOSING, LATER_HEADERS, LATER_STATEMENTS, LATER_TYPES, OPENING
from armwright.program.syntax import tree
from armwright.program.syntax.lexer import Token, TokenKind
from armwright.program.syntax.token_stream import Tokens

OPERATORS = ("+", "-", "*", "/", "<", "<=", "<>", ">=", ">")
_WORD_OPERATORS = ("AND", "OR", "NOT")
_OPERANDS = (TokenKind.NAME, TokenKind.ARM, TokenKind.NUMBER, TokenKind.STRING)
_LONGEST_SHOWN = 16


def report(tokens: Tokens, what: str, span: Span, instead: str, *helps: str) -> None:
    """Say that something belongs to RLO-2, and what RLO-83 has instead."""
    tokens.found.say("E214", f"{what} belongs to RLO-2", span, instead, helps=helps)


def expression(tokens: Tokens, wants: str) -> tree.Poison:
    """Pass over an expression where RLO-83 takes ``wants``."""
    start = tokens.now
    names = _operands(tokens)
    span = tokens.since(start)
    report(tokens, _called(tokens, start, span), span, f"RLO-83 takes {wants} here")
    return tree.Poison(span, names)


def starts_header(tokens: Tokens) -> bool:
    """Whether a part of an RLO-2 program stands where declarations or BEGIN should."""
    return tokens.sees_word(*LATER_HEADERS) and tokens.ahead().key not in (",", ":")


def header(tokens: Tokens) -> None:
    """Pass over IMPORT, UNITS or a PROCEDURE."""
    word = tokens.take()
    report(tokens, f"{word.key}", word.span, LATER_HEADERS[word.key])
    while not tokens.done and not tokens.sees(";", "BEGIN"):
        tokens.take()
    if word.key == "PROCEDURE":
        # Its own VAR part lies between its head and its body.
        while not tokens.done and not tokens.sees("BEGIN"):
            tokens.take()
        _body(tokens)
    tokens.accept(";")


def statement(tokens: Tokens) -> tree.Poison:
    """Pass over a statement of RLO-2 with everything inside it."""
    word = tokens.now
    if word.key == "BEGIN":
        report(tokens, "a block inside a program", word.span, "RLO-83 has one BEGIN and one END")
    elif word.key in LATER_STATEMENTS:
        report(tokens, word.key, word.span, LATER_STATEMENTS[word.key])
    elif tokens.ahead().key == "[":
        report(tokens, "indexing", tokens.ahead().span, "RLO-83 has no arrays")
    else:
        report(tokens, f"the call of `{word.text}`", word.span, "RLO-83 has no procedures")
    return tree.Poison(word.span, _body(tokens))


def starts_statement(tokens: Tokens) -> bool:
    """Whether a statement of RLO-2 stands here. Its words are no keywords: ``wait = 5`` sets a scalar."""
    token, after = tokens.now, tokens.ahead()
    if token.kind is TokenKind.KEYWORD:
        return token.key == "BEGIN"
    if token.kind is not TokenKind.NAME or after.key in ("=", ":="):
        return False
    return token.key in LATER_STATEMENTS or after.key in ("(", "[")


def type_name(tokens: Tokens) -> tree.TypeName:
    """Pass over a type of RLO-2, up to the end of the declaration."""
    word = tokens.take()
    report(tokens, word.key, word.span, LATER_TYPES[word.key])
    if word.key == "ARRAY":
        while not tokens.done and not tokens.sees(";", "VAR", "BEGIN", "END"):
            tokens.take()
    return tree.TypeName(tokens.since(word), word.text, None)


def trailing(tokens: Tokens, what: str, instead: str, *words: str) -> None:
    """Pass over one word that RLO-2 allows behind a statement."""
    if word := tokens.accept_word(*words):
        report(tokens, f"{what} {word.key}", word.span, instead)


def guard(tokens: Tokens) -> tree.Poison:
    """Pass over ``ON condition DO action`` in a MOVE, up to the next clause."""
    word = tokens.now
    report(tokens, "ON ... DO", word.span, "RLO-83 has no guarded motions")
    return tree.Poison(word.span, _body(tokens, stop=","))


def _body(tokens: Tokens, stop: str = ";") -> frozenset[str]:
    """Pass over tokens up to ``;`` (or ``stop``) or END, with every block on the way; return the names in them."""
    names = set()
    depth = brackets = 0
    while not tokens.done:
        token = tokens.now
        last_end = token.key == "END" and tokens.ahead().key == "."
        if last_end or (depth == 0 and (tokens.sees(";", "END") or (brackets <= 0 and tokens.sees(stop)))):
            break
        depth += _step(token)
        brackets += (token.key in ("(", "[")) - (token.key in (")", "]"))
        if token.kind in (TokenKind.NAME, TokenKind.ARM):
            names.add(token.key)
        tokens.take()
    return frozenset(names)


def _step(token: Token) -> int:
    """Return by how much a token changes the depth of nested statements."""
    if token.kind not in (TokenKind.NAME, TokenKind.KEYWORD):
        return 0
    return (token.key in OPENING) - (token.key in CLOSING)


def _operands(tokens: Tokens) -> frozenset[str]:
    """Pass over one expression, as far as it makes sense; return the names in it."""
    names = set()
    depth = 0
    operand_due = True
    while not tokens.done and tokens.now.kind is not TokenKind.KEYWORD:
        token = tokens.now
        if token.kind in _OPERANDS:
            if token.key in _WORD_OPERATORS:
                operand_due = True
            elif operand_due:
                operand_due = False
                names.add(token.key)
            else:
                break
        elif token.key in ("(", "["):
            depth, operand_due = depth + 1, True
        elif token.key in (")", "]") and depth:
            depth, operand_due = depth - 1, False
        elif token.key in OPERATORS or (depth and token.key in (",", "=")):
            operand_due = True
        else:
            break
        tokens.take()
    return frozenset(names)


def _called(tokens: Tokens, start: Token, span: Span) -> str:
    """Return how an expression is called in a message."""
    text = tokens.source.slice(span)
    if span == start.span and start.kind is not TokenKind.STRING:
        return f"`{text}` as a value"
    if len(text) <= _LONGEST_SHOWN and text.isprintable():
        return f"`{text}`"
    inner = tokens.source.text[start.end :].lstrip(" \t")
    return f"`{start.text}(...)`" if start.kind is TokenKind.NAME and inner.startswith("(") else "this expression"
