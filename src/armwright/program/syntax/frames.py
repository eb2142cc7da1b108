"""Parsing statements about frames: assignments, AFFIX and UNFIX."""

from armwright.program.language.diagnostic import Fix
from armwright.program.language.source import Span
from armwright.program.syntax import tree
from armwright.program.syntax.expressions import expression, mobile
from armwright.program.syntax.lexer import TokenKind
from armwright.program.syntax.token_stream import Tokens

_FRAME = "the name of a FRAME"


# assign = lvalue "=" expr ;
def assign(tokens: Tokens) -> tree.Assign:
    """Read ``name = value``."""
    token = tokens.now
    target = mobile(tokens, "a name", "here")
    written = tokens.source.slice(tokens.since(token))
    equals(tokens, f"`{written}`", written)
    tokens.target = token.key
    value = expression(tokens, "a value", "")
    return tree.Assign(tokens.since(token), target, value)


def equals(tokens: Tokens, what: str, written: str) -> None:
    """Read ``=``, or say that it is missing before a value and go on."""
    if tokens.accept("="):
        return
    token = tokens.now
    if tokens.accept(":=", "=="):
        text = f"{what} gets its value with `=`, not `{token.text}`"
        tokens.report("E109", text, token.span, "write `=`", fixes=(Fix(token.span, "="),))
    elif tokens.done or tokens.sees(";", ",", ")", "END") or token.kind is TokenKind.KEYWORD:
        tokens.lost(f"{what} needs `=` and a value", "expected `=` and a value here", code="E109")
    elif not token.damaged:
        text, fix = f"{what} needs `=` before its value", Fix(Span(token.start, token.start), "= ")
        advice = f"write `{written} = (...`" if token.text == "(" else f"write `{written} = {token.text}`"
        tokens.report("E109", text, token.span, "expected `=` before this", advice=advice, fixes=(fix,))


# affix = "AFFIX" mobile "TO" mobile [ "AT" expr ] [ "RIGIDLY" | "NONRIGIDLY" ] ;
def affix(tokens: Tokens) -> tree.Affix:
    """Read one AFFIX."""
    start = tokens.take()
    child = mobile(tokens, _FRAME, "after AFFIX")
    tokens.expect("TO", "after the frame that follows")
    parent = mobile(tokens, "the name of a FRAME or an arm", "after TO")
    link = tokens.since(start)
    position = expression(tokens, "a TRANS", "after AT") if tokens.accept("AT") else None
    rigid = tokens.accept("RIGIDLY", "NONRIGIDLY")
    return tree.Affix(tokens.since(start), link, child, parent, position, rigid is not None and rigid.key == "RIGIDLY")


# unfix = "UNFIX" lvalue [ "FROM" mobile ] ;
def unfix(tokens: Tokens) -> tree.Unfix:
    """Read one UNFIX."""
    start = tokens.take()
    child = mobile(tokens, _FRAME, "after UNFIX")
    tokens.offer("FROM")
    over = tokens.done or tokens.now.key in (";", *tokens.words.closing)
    if over or (tokens.now.key != "FROM" and (tokens.now.kind is TokenKind.KEYWORD or not tokens.same_line())):
        return tree.Unfix(tokens.since(start), child, None)
    tokens.expect("FROM", "after the frame to detach")
    parent = mobile(tokens, "the name of a FRAME or an arm", "after FROM")
    return tree.Unfix(tokens.since(start), child, parent)
