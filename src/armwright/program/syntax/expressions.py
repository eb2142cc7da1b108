"""Parsing the values of RLO-2: expressions, elements of arrays, lists in parentheses."""

# ruff: noqa: ERA001 - each rule of the grammar stands above its function

import math
from collections.abc import Callable
from typing import TypeVar

from armwright.program.language.diagnostic import Fix
from armwright.program.language.source import Span
from armwright.program.language.words import FUNCTIONS_OF_NAMES, PRECEDENCE, PRECEDENCE_OF_NOT, Standard
from armwright.program.syntax import tree
from armwright.program.syntax.lexer import Token, TokenKind
from armwright.program.syntax.token_stream import MAX_DEPTH, TokenStream, describe_token

T = TypeVar("T")

_NAME, _NUMBER, _ARM, _STRING = TokenKind.NAME, TokenKind.NUMBER, TokenKind.ARM, TokenKind.STRING
_CLOSING = {"(": ")", "[": "]"}
_OPERANDS = (_NAME, _NUMBER, _ARM, _STRING)

# What other languages write.
FOREIGN_OPERATORS = {"==": "=", ":=": "=", "!=": "<>", "=<": "<=", "=>": ">=", "&&": "AND", "||": "OR"}
# What may stand behind a name, so that a reserved word in front of it was meant as one.
_FOLLOWS_A_NAME = frozenset((",", ";", ")", "]", ":", "=", "<", "<=", "<>", ">=", ">", "+", "-", "*", "/", "["))
_NEVER_A_NAME = frozenset(("BEGIN", "END", "DIRECTLY", "STRAIGHTLY", "WITH", "VIA", "THEN", "DO", "ELSE", "COEND"))


# expr = conj { "OR" conj } ;   conj = nega { "AND" nega } ;   rel = sum [ ( "<" | "<=" | "=" | ... ) sum ] ;
# sum  = term { ( "+" | "-" ) term } ;   term = unary { ( "*" | "/" ) unary } ;
def expression(tokens: TokenStream, wants: str = "a value", where: str = "here", lowest: int = 1) -> tree.Expression:
    """Read an expression.

    Args:
        tokens: at its first token.
        wants: what is expected, in words.
        where: the position in words, such as ``after TO``.
        lowest: how strongly its operations must hold together.

    Raises:
        PanicModeError: there is none, or it is too deep.
    """
    start, outer = tokens.current, tokens.operand_context
    if wants != "a value" or where not in ("", "here"):
        tokens.operand_context = wants, where
    left_operand = _unary(tokens, wants, where, lowest)
    last = 0
    while (strength := PRECEDENCE.get(tokens.current.key, 0)) >= lowest or (
        tokens.current.key in FOREIGN_OPERATORS and _replace_foreign_operator(tokens)
    ):
        strength = strength or PRECEDENCE[tokens.current.key]
        if strength < lowest:
            break
        chained = strength == last == PRECEDENCE["="]
        if chained:
            _report_chained_comparison(tokens, start)
        # A sum of many terms is long and not deep: only what is nested counts.
        height = tokens.height if strength == last and not chained else tokens.height + 1
        last = strength
        if tokens.depth + height > MAX_DEPTH:
            tokens.fail_too_deep()
        sign = tokens.take()
        tokens.enter_level()
        right = expression(tokens, "a value", "", strength + 1)
        tokens.depth -= 1
        tokens.height = max(height, tokens.height + 1)
        if chained and isinstance(left_operand, tree.Binary):
            # What was meant is that both hold.
            right = tree.Binary(right.span, sign.key, left_operand.right, right)
            left_operand = tokens.node(tree.Binary, start, "AND", left_operand, right)
        else:
            left_operand = tokens.node(tree.Binary, start, sign.key, left_operand, right)
    tokens.operand_context = outer
    return left_operand


def _replace_foreign_operator(tokens: TokenStream) -> bool:
    """Put the sign that was meant in place of one of another language."""
    token = tokens.current
    meant, text = FOREIGN_OPERATORS[token.key], f"`{token.text}` is not a symbol of RLO"
    replacement = f" {meant} " if meant.isalpha() else meant
    tokens.report_once("E123", text, token.span, f"write `{meant}`", replacement=replacement)
    tokens.replace_current(meant)
    return True


def _report_chained_comparison(tokens: TokenStream, start: Token) -> None:
    first = tokens.source.slice(tokens.span_since(start))
    advice = "join two comparisons with AND" if "\n" in first or len(first) > 20 else f"write `{first} AND ...`"
    text = "a comparison cannot be compared"
    tokens.report_once("E122", text, tokens.current.span, "second comparison", advice=advice)


# nega = "NOT" nega | rel ;   unary = "-" unary | prim ;
def _unary(tokens: TokenStream, wants: str, where: str, lowest: int) -> tree.Expression:
    token = tokens.current
    kind = token.kind
    if kind is _NAME or kind is _ARM:
        return _name_or_call(tokens)
    if kind is _NUMBER or (token.key in ("-", "+") and tokens.peek().kind is _NUMBER):
        return number(tokens)
    if token.key == "(" or (kind is _STRING and tokens.standard is Standard.RLO_2):
        return _parenthesised(tokens) if token.key == "(" else _string(tokens)
    if token.key not in ("-", "+", "NOT"):
        tokens.note_expected_operand(*tokens.operand_context)
        return _report_missing_value(tokens, wants, where)
    misplaced = token.key == "NOT" and lowest > PRECEDENCE_OF_NOT
    if misplaced:
        text = f"NOT needs parentheses after `{tokens.previous.text}`"
        tokens.report_once("E122", text, token.span, "put `( )` around NOT and what follows")
    if token.key == "+":
        tokens.report_once("E113", "a value has no `+` in front", token.span, "leave it out", replacement="")
    tokens.take()
    tokens.enter_level()
    operand = expression(tokens, "a value", "", PRECEDENCE_OF_NOT if token.key == "NOT" else PRECEDENCE["*"] + 1)
    tokens.depth -= 1
    tokens.height += 1
    if token.key == "+":
        return operand
    return tokens.node(tree.Poison, token) if misplaced else tokens.node(tree.Unary, token, token.key, operand)


# number = digits [ "." digits ] [ "E" ["+"|"-"] digits ] [ unit ] ;
def number(tokens: TokenStream) -> tree.Number:
    """Read a number with its sign.

    Raises:
        PanicModeError: there is none.
    """
    start = token = tokens.current
    if start.key in ("-", "+"):
        tokens.take()
        token = tokens.current
        if start.key == "+":
            tokens.report("E113", "a number has no `+` in front", start.span, "leave it out", replacement="")
    if token.kind is not _NUMBER:
        tokens.fail("expected a number")
    tokens.take()
    tokens.height = 1
    value = math.nan if token.damaged else float(token.key)
    unit = None if token.damaged else token.text[len(token.key) :].upper() or None
    if start.key == "-":
        return tokens.node(tree.Number, start, f"-{token.text}", -value, unit)
    return tokens.node(tree.Number, start, token.text, value, unit)


def _string(tokens: TokenStream) -> tree.String:
    token = tokens.take()
    tokens.height = 1
    return tree.String(token.span, token.text[1:-1])


# prim = number | string | arm | lvalue | name "(" [ expr { "," expr } ] ")" | "(" expr { "," expr } ")" ;
def _name_or_call(tokens: TokenStream) -> tree.Expression:
    tokens.height = 1
    if tokens.current.kind is _ARM:
        return _arm(tokens)
    name = tokens.take_name()
    if tokens.current.key == "[":
        return _index(tokens, name)
    if tokens.current.key != "(":
        return _function_of_name(tokens, name) if name.key in FUNCTIONS_OF_NAMES else name
    is_empty = tokens.standard is Standard.RLO_2 and tokens.peek().key == ")"
    arguments = expression_list(tokens, "a value", f"after {name.text}", empty=is_empty)
    tokens.height += 1
    start = name.span
    if not arguments and not is_empty:
        return tokens.node(tree.Poison, start)
    return tokens.node(tree.Function, start, name, arguments)


def _function_of_name(tokens: TokenStream, name: tree.Name) -> tree.Expression:
    """Read ``TIMER t``, in the way of a statement, as the function that was meant; a variable of that name is one."""
    argument = tokens.current
    is_argument = argument.kind is _NAME and tokens.is_on_same_line() and tokens.peek().key not in ("=", ":=")
    is_variable = name.key in tokens.declared or name.key in tokens.procedures
    if not is_argument or is_variable or tokens.standard is not Standard.RLO_2:
        return name
    opening = Span(name.span.end, argument.start)
    tokens.take()
    tokens.height += 1
    text, gap = f"`{name.text}` is a function here, and its argument stands in `( )`", tokens.gap_span()
    fixes, advice = (Fix(opening, "("), Fix(gap, ")")), f"write `{name.text}({argument.text})`"
    tokens.report_once("E112", text, argument.span, "expected `(` and `)` around this", fixes=fixes, advice=advice)
    return tokens.node(tree.Function, name.span, name, (tree.Name(argument.span, argument.text, argument.key),))


def _arm(tokens: TokenStream) -> tree.ArmName:
    token = tokens.take()
    return tree.ArmName(token.span, token.text, token.key)


def _index(tokens: TokenStream, name: tree.Name) -> tree.Index | tree.Poison:
    indices = expression_list(tokens, "an index", f"after {name.text}", "[")
    tokens.height += 1
    name = _field(tokens, name)
    span = tokens.span_since(name.span)
    return tree.Index(span, name, indices) if indices else tree.Poison(span, frozenset((name.key,)))


def _field(tokens: TokenStream, name: tree.Name) -> tree.Name:
    """Read the field of an element of an array, if one follows: ``parts[2].weight`` is the element of that field."""
    has_field = tokens.current.key == "." and tokens.peek().kind is _NAME
    if not has_field or tokens.standard is not Standard.RLO_2:
        return name
    tokens.take()
    read = tokens.take_name()
    return tree.Name(name.span, f"{name.text}.{read.text}", f"{name.key}.{read.key}")


def _parenthesised(tokens: TokenStream) -> tree.Expression:
    start = tokens.current
    items = expression_list(tokens, "a value", "here")
    if len(items) == 1:
        return items[0]
    tokens.height += 1
    return tokens.node(tree.Matrix, start, items) if items else tokens.node(tree.Poison, start)


# mobile = arm | lvalue ;
def mobile(tokens: TokenStream, wants: str, where: str) -> tree.Mobile:
    """Read a variable, an element of an array, or an arm.

    Raises:
        PanicModeError: there is none.
    """
    return _arm(tokens) if tokens.current.kind is _ARM else _lvalue(tokens, wants, where)


# lvalue = name [ "[" expr { "," expr } "]" [ "." name ] ] ;
def _lvalue(tokens: TokenStream, wants: str, where: str) -> tree.Variable:
    if tokens.current.kind is not _NAME:
        tokens.note_expected_operand(wants, where)
        return _report_missing_value(tokens, wants, where)
    name = tokens.take_name()
    return _index(tokens, name) if tokens.current.key == "[" else name


def variable(tokens: TokenStream, wants: str, where: str) -> tree.Variable:
    """Read a variable or an element of an array.

    Raises:
        PanicModeError: there is none.
    """
    if tokens.current.kind is _ARM:
        tokens.report_once("E111", f"expected {wants} {where}".rstrip(), tokens.current.span, "this is an arm")
        return tree.Poison(tokens.take().span)
    return _lvalue(tokens, wants, where)


def expression_list(
    tokens: TokenStream, wants: str, where: str, opening: str = "(", *, empty: bool = False
) -> tuple[tree.Expression, ...]:
    """Read expressions in parentheses; the arguments are those of ``parenthesised_list``."""
    items = parenthesised_list(tokens, expression, wants, where, opening, empty=empty)
    if items and tokens.peek(-2).key == ",":
        # Nothing follows the last comma; it has been reported, and counts as a value.
        return (*items, tree.Poison(tokens.gap_span()))
    return items


def parenthesised_list(
    tokens: TokenStream,
    item: Callable[[TokenStream, str, str], T],
    wants: str,
    where: str,
    opening: str = "(",
    *,
    empty: bool = False,
) -> tuple[T, ...]:
    """Read a list in parentheses.

    Args:
        tokens: at the opening parenthesis.
        item: how to read one.
        wants: what one is, in words.
        where: the position in words, such as ``after VIA``.
        opening: what opens the list.
        empty: whether nothing is needed between them.

    Returns:
        What stands in it; empty also where that has been reported.

    Raises:
        PanicModeError: what stands there makes no sense, or lies too deep.
    """
    closing = _CLOSING[opening]
    start = tokens.current
    if start.key != opening:
        return _list_without_opening(tokens, item, wants, where, opening)
    tokens.take()
    if tokens.current.key == closing:
        if not empty:
            text = f"expected {wants} between `{opening}{closing}`"
            tokens.report_once("E111", text, tokens.current.span, "there is nothing in between")
        tokens.take()
        return ()
    tokens.enter_level()
    items: list[T] = []
    height = 0
    while True:
        if tokens.current.key == "," and items:
            tokens.report_once("E117", "two `,` follow each other", tokens.current.span, "one of them is superfluous")
            tokens.take()
        items.append(item(tokens, wants, ""))
        height = max(height, tokens.height)
        if tokens.current.key == ",":
            comma = tokens.take()
            if tokens.current.key == closing:
                tokens.report_once("E111", f"expected {wants} after `,`", comma.span, "nothing follows")
                break
        elif not _insert_missing_comma(tokens):
            break
    if tokens.current.key != closing:
        _close_list(tokens, start, closing)
    else:
        tokens.take()
    tokens.depth -= 1
    tokens.height = height
    return tuple(items)


def _list_without_opening(
    tokens: TokenStream, item: Callable[[TokenStream, str, str], T], wants: str, where: str, opening: str
) -> tuple[T, ...]:
    """Read a list without its opening parenthesis; say so once."""
    closing = _CLOSING[opening]
    gap = tokens.gap_span()
    tokens.discard_expected()
    items = [item(tokens, wants, where)]
    while tokens.current.key == "," and tokens.peek().kind in _OPERANDS:
        tokens.take()
        items.append(item(tokens, wants, "after `,`"))
    fixes = [Fix(gap, f" {opening}")]
    if not tokens.accept(closing):
        fixes.append(Fix(tokens.gap_span(), closing))
    tokens.report("E112", f"missing `{opening}` {where}", gap, f"expected `{opening}` here", fixes=tuple(fixes))
    return tuple(items)


def _insert_missing_comma(tokens: TokenStream) -> bool:
    """Insert a missing comma between two values; return whether it was missing."""
    token = tokens.current
    if token.kind not in _OPERANDS or token.damaged or tokens.previous.damaged:
        return False
    if token.kind is not _NUMBER and (not tokens.is_on_same_line() or tokens.peek().key in ("=", ":=")):
        return False
    tokens.insert_missing(",", "between two values")
    return True


def _close_list(tokens: TokenStream, start: Token, closing: str) -> None:
    """Put in a closing parenthesis, or pass over what stands before it in the same line."""
    token = tokens.current
    if token.kind in _OPERANDS or token.key in ("(", "[", ")", "]", ".", ":", "+"):
        steps = next((n for n in range(20) if tokens.peek(n).key in (closing, ";", "")), 20)
        line = tokens.source.line
        if tokens.peek(steps).key == closing and line(tokens.peek(steps).start) == line(start.start):
            text = f"{describe_token(token)} does not belong here"
            tokens.report_once("E117", text, token.span, f"expected `,` or `{closing}`")
            for _ in range(steps + 1):
                tokens.take()
            return
    tokens.expect(closing, "after the last value" if closing == ")" else "after the last index")


def _report_missing_value(tokens: TokenStream, wants: str, where: str) -> tree.Poison:
    """Say that there is no value here; go on where it is clear what was meant to be one.

    Raises:
        PanicModeError: it is not.
    """
    token = tokens.current
    where = where or f"after `{tokens.previous.text}`"
    if token.kind is _STRING:
        tokens.report_once("E111", f"expected {wants} {where}", token.span, "a text can only be printed")
        return tree.Poison(tokens.take().span)
    if is_reserved_as_name(tokens):
        tokens.report_reserved_name()
        tokens.take()
        return tree.Poison(token.span, frozenset((token.key,)))
    return tokens.fail(f"expected {wants} {where}".rstrip())


def is_reserved_as_name(tokens: TokenStream) -> bool:
    """Whether a reserved word stands where a name should, and was meant as one."""
    token = tokens.current
    if token.kind is not TokenKind.KEYWORD or token.key in _NEVER_A_NAME or not tokens.is_on_same_line():
        return False
    after = tokens.peek()
    return after.key in _FOLLOWS_A_NAME or (after.kind is TokenKind.KEYWORD and after.key not in ("BEGIN", "END"))
