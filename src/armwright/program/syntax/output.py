"""Parsing what a program writes: PRINT."""

from armwright.program.syntax import tree
from armwright.program.syntax.expressions import expression, parenthesised_list
from armwright.program.syntax.lexer import TokenKind
from armwright.program.syntax.token_stream import TokenStream


# "PRINT" "(" ( expr | string ) { "," ( expr | string ) } ")"
def print_(tokens: TokenStream) -> tree.Print:
    """Read one PRINT."""
    start = tokens.take()
    return tokens.node(tree.Print, start, parenthesised_list(tokens, _print_item, "a value or a text", "after PRINT"))


def _print_item(tokens: TokenStream, wants: str, where: str) -> tree.Expression | tree.String:
    token = tokens.current
    if token.kind is not TokenKind.STRING:
        return expression(tokens, wants, where)
    tokens.take()
    tokens.height = 1
    return tree.String(token.span, token.text[1:-1])
