"""Parsing what a program writes: PRINT."""

from armwright.program.syntax import tree
from armwright.program.syntax.expressions import expression, listed
from armwright.program.syntax.lexer import TokenKind
from armwright.program.syntax.token_stream import Tokens


# "PRINT" "(" ( expr | string ) { "," ( expr | string ) } ")"
def printing(tokens: Tokens) -> tree.Print:
    """Read one PRINT."""
    start = tokens.take()
    items = listed(tokens, _printed, "a value or a text", "after PRINT")
    return tree.Print(tokens.since(start), items)


def _printed(tokens: Tokens, wants: str, where: str) -> tree.Expression | tree.String:
    token = tokens.now
    if token.kind is not TokenKind.STRING:
        return expression(tokens, wants, where)
    tokens.take()
    tokens.height = 1
    return tree.String(token.span, token.text[1:-1])
