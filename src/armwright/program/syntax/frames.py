"""Parsing statements about frames: assignments, AFFIX and UNFIX."""

from armwright.program.language.diagnostic import Fix
from armwright.program.syntax import tree
from armwright.program.syntax.expressions import expression, mobile
from armwright.program.syntax.lexer import TokenKind
from armwright.program.syntax.token_stream import TokenStream

_FRAME = "the name of a FRAME"


# assign = lvalue "=" expr ;
def assign(tokens: TokenStream) -> tree.Assign:
    """Read ``name = value``."""
    token = tokens.current
    target = mobile(tokens, "a name", "here")
    written = tokens.source.slice(tokens.span_since(token))
    expect_equals(tokens, f"`{written}`", written)
    tokens.assignment_target = token.key
    return tokens.node(tree.Assign, token, target, expression(tokens, "a value", ""))


def expect_equals(tokens: TokenStream, what: str, written: str) -> None:
    """Read ``=``, or say that it is missing before a value and go on."""
    if tokens.accept("="):
        return
    token = tokens.current
    if tokens.accept(":=", "=="):
        text = f"{what} gets its value with `=`, not `{token.text}`"
        tokens.report("E109", text, token.span, "write `=`", replacement="=")
    elif tokens.is_at_end or tokens.matches(";", ",", ")", "END") or token.kind is TokenKind.KEYWORD:
        tokens.fail(f"{what} needs `=` and a value", "expected `=` and a value here", code="E109")
    elif not token.damaged:
        text, fix = f"{what} needs `=` before its value", Fix(token.gap, "= ")
        advice = f"write `{written} = (...`" if token.text == "(" else f"write `{written} = {token.text}`"
        tokens.report("E109", text, token.span, "expected `=` before this", advice=advice, fixes=(fix,))


# affix = "AFFIX" mobile "TO" mobile [ "AT" expr ] [ "RIGIDLY" | "NONRIGIDLY" ] ;
def affix(tokens: TokenStream) -> tree.Affix:
    """Read one AFFIX."""
    start = tokens.take()
    child = mobile(tokens, _FRAME, "after AFFIX")
    tokens.expect("TO", "after the frame that follows")
    parent = mobile(tokens, "the name of a FRAME or an arm", "after TO")
    link = tokens.span_since(start)
    at = expression(tokens, "a TRANS", "after AT") if tokens.accept("AT") else None
    rigid = tokens.accept("RIGIDLY", "NONRIGIDLY")
    return tokens.node(tree.Affix, start, link, child, parent, at, rigid is not None and rigid.key == "RIGIDLY")


# unfix = "UNFIX" lvalue [ "FROM" mobile ] ;
def unfix(tokens: TokenStream) -> tree.Unfix:
    """Read one UNFIX."""
    start = tokens.take()
    child = mobile(tokens, _FRAME, "after UNFIX")
    tokens.note_expected_words("FROM")
    over = tokens.is_at_end or tokens.current.key in (";", *tokens.vocabulary.block_ends)
    elsewhere = tokens.current.kind is TokenKind.KEYWORD or not tokens.is_on_same_line()
    if over or (elsewhere and tokens.current.key != "FROM"):
        return tokens.node(tree.Unfix, start, child, None)
    tokens.expect("FROM", "after the frame to detach")
    return tokens.node(tree.Unfix, start, child, mobile(tokens, "the name of a FRAME or an arm", "after FROM"))
