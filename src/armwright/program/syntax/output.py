"""Parsing what a program writes: PRINT and LOG."""

from armwright.program.syntax import tree
from armwright.program.syntax.expressions import expression, parenthesised_list
from armwright.program.syntax.token_stream import TokenStream


# "PRINT" "(" expr { "," expr } ")"
def print_(tokens: TokenStream) -> tree.Print:
    """Read one PRINT."""
    start = tokens.take()
    return tokens.node(tree.Print, start, parenthesised_list(tokens, expression, "a value or a text", "after PRINT"))


# "LOG" string "(" expr { "," expr } ")"
def log(tokens: TokenStream) -> tree.Log:
    """Read one LOG."""
    start = tokens.current
    tokens.accept_word("LOG")
    name = tokens.take()
    items = parenthesised_list(tokens, expression, "a value", "after the name of the log")
    return tokens.node(tree.Log, start, tree.String(name.span, name.text[1:-1]), items)
