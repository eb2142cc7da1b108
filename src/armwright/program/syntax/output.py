"""Parsing what a program writes: PRINT."""

from armwright.program.syntax import tree
from armwright.program.syntax.expressions import expression, parenthesised_list
from armwright.program.syntax.token_stream import TokenStream


# "PRINT" "(" expr { "," expr } ")"
def print_(tokens: TokenStream) -> tree.Print:
    """Read one PRINT."""
    start = tokens.take()
    return tokens.node(tree.Print, start, parenthesised_list(tokens, expression, "a value or a text", "after PRINT"))
