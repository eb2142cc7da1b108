"""Parsing the values of RLO-2: expressions, elements of arrays, lists in parentheses."""

# ruff: noqa: ERA001 - each rule of the grammar stands above its function

import math
from collections.abc import Callable
from typing import TypeVar

from armwright.program.language.diagnostic import Fix
from armwright.program.language.source import Span
from armwright.program.language.words import PRECEDENCE, PRECEDENCE_OF_NOT
from armwright.program.syntax import tree
from armwright.program.syntax.lexer import Token, TokenKind
from armwright.program.syntax.token_stream import MAX_DEPTH, Tokens, shown

T = TypeVar("T")

_NAME, _NUMBER, _ARM, _STRING = TokenKind.NAME, TokenKind.NUMBER, TokenKind.ARM, TokenKind.STRING
_CLOSING = {"(": ")", "[": "]"}
_OPERANDS = (_NAME, _NUMBER, _ARM, _STRING)

# What other languages write.
FOREIGN = {"==": "=", ":=": "=", "!=": "<>", "=<": "<=", "=>": ">=", "&&": "AND", "||": "OR"}
# What may stand behind a name, so that a reserved word in front of it was meant as one.
_BEHIND_A_NAME = frozenset((",", ";", ")", "]", ":", "=", "<", "<=", "<>", ">=", ">", "+", "-", "*", "/", "["))
_NEVER_A_NAME = frozenset(("BEGIN", "END", "DIRECTLY", "STRAIGHTLY", "WITH", "VIA", "THEN", "DO", "ELSE", "COEND"))


# expr = conj { "OR" conj } ;   conj = nega { "AND" nega } ;   rel = sum [ ( "<" | "<=" | "=" | ... ) sum ] ;
# sum  = term { ( "+" | "-" ) term } ;   term = unary { ( "*" | "/" ) unary } ;
def expression(tokens: Tokens, wants: str = "a value", where: str = "here", lowest: int = 1) -> tree.Expression:
    """Read an expression.

    Args:
        tokens: at its first token.
        wants: what is expected, in words.
        where: the pose in words, such as ``after TO``.
        lowest: how strongly its operations must hold together.

    Raises:
        LostError: there is none, or it is too deep.
    """
    start, outer = tokens.now, tokens.asked
    if wants != "a value" or where not in ("", "here"):
        tokens.asked = wants, where
    left_operand = _unary(tokens, wants, where, lowest)
    last = 0
    while (strength := PRECEDENCE.get(tokens.now.key, 0)) >= lowest or (tokens.now.key in FOREIGN and _foreign(tokens)):
        strength = strength or PRECEDENCE[tokens.now.key]
        if strength < lowest:
            break
        chained = strength == last == PRECEDENCE["="]
        if chained:
            _chained(tokens, start)
        # A sum of many terms is long and not deep: only what is nested counts.
        height = tokens.height if strength == last and not chained else tokens.height + 1
        last = strength
        if tokens.depth + height > MAX_DEPTH:
            tokens.too_deep()
        sign = tokens.take()
        tokens.enter()
        right = expression(tokens, "a value", "", strength + 1)
        tokens.depth -= 1
        tokens.height = max(height, tokens.height + 1)
        if chained and isinstance(left_operand, tree.Binary):
            # What was meant is that both hold.
            right = tree.Binary(right.span, sign.key, left_operand.right, right)
            left_operand = tree.Binary(tokens.since(start), "AND", left_operand, right)
        else:
            left_operand = tree.Binary(tokens.since(start), sign.key, left_operand, right)
    tokens.asked = outer
    return left_operand


def _foreign(tokens: Tokens) -> bool:
    """Put the sign that was meant in the pose of one of another language."""
    token = tokens.now
    meant = FOREIGN[token.key]
    blank = " " if meant.isalpha() else ""
    text = f"`{token.text}` is not a symbol of RLO"
    tokens.say_once("E123", text, token.span, f"write `{meant}`", fixes=(Fix(token.span, f"{blank}{meant}{blank}"),))
    tokens.replace(meant)
    return True


def _chained(tokens: Tokens, start: Token) -> None:
    first = tokens.source.slice(tokens.since(start))
    advice = "join two comparisons with AND" if "\n" in first or len(first) > 20 else f"write `{first} AND ...`"
    tokens.say_once("E122", "a comparison cannot be compared", tokens.now.span, "second comparison", advice=advice)


# nega = "NOT" nega | rel ;   unary = "-" unary | prim ;
def _unary(tokens: Tokens, wants: str, where: str, lowest: int) -> tree.Expression:
    token = tokens.now
    kind = token.kind
    if kind is _NAME or kind is _ARM:
        return _named(tokens)
    if kind is _NUMBER or (token.key in ("-", "+") and tokens.ahead().kind is _NUMBER):
        return number(tokens)
    if token.key == "(":
        return _parenthesised(tokens)
    if token.key not in ("-", "+", "NOT"):
        tokens.want(*tokens.asked)
        return _no_value(tokens, wants, where)
    misplaced = token.key == "NOT" and lowest > PRECEDENCE_OF_NOT
    if misplaced:
        text = f"NOT needs parentheses after `{tokens.before.text}`"
        tokens.say_once("E122", text, token.span, "put `( )` around NOT and what follows")
    if token.key == "+":
        tokens.say_once("E113", "a value has no `+` in front", token.span, "leave it out", fixes=(Fix(token.span, ""),))
    tokens.take()
    tokens.enter()
    operand = expression(tokens, "a value", "", PRECEDENCE_OF_NOT if token.key == "NOT" else PRECEDENCE["*"] + 1)
    tokens.depth -= 1
    tokens.height += 1
    if token.key == "+":
        return operand
    return tree.Poison(tokens.since(token)) if misplaced else tree.Unary(tokens.since(token), token.key, operand)


# number = digits [ "." digits ] [ "E" ["+"|"-"] digits ] [ unit ] ;
def number(tokens: Tokens) -> tree.Number:
    """Read a number with its sign.

    Raises:
        LostError: there is none.
    """
    start = token = tokens.now
    if start.key in ("-", "+"):
        tokens.take()
        token = tokens.now
        if start.key == "+":
            fix = Fix(start.span, "")
            tokens.report("E113", "a number has no `+` in front", start.span, "leave it out", fixes=(fix,))
    if token.kind is not _NUMBER:
        tokens.lost("expected a number", f"found {shown(token)}")
    tokens.take()
    tokens.height = 1
    text, key = token.text, token.key
    value = math.nan if token.damaged else float(key)
    unit = text[len(key) :].upper() if len(text) > len(key) and not token.damaged else None
    if start.key == "-":
        return tree.Number(Span(start.start, token.end), f"-{text}", -value, unit)
    return tree.Number(Span(start.start, token.end), text, value, unit)


# prim = number | arm | lvalue | name "(" expr { "," expr } ")" | "(" expr { "," expr } ")" ;
def _named(tokens: Tokens) -> tree.Expression:
    tokens.height = 1
    if tokens.now.kind is _ARM:
        return _arm(tokens)
    name = tokens.take_name()
    behind = tokens.now.key
    if behind == "[":
        return _index(tokens, name)
    if behind == "(":
        arguments = values(tokens, "a value", f"after {name.text}")
        tokens.height += 1
        span = tokens.since(name.span)
        return tree.Function(span, name, arguments) if arguments else tree.Poison(span)
    return name


def _arm(tokens: Tokens) -> tree.ArmName:
    token = tokens.take()
    return tree.ArmName(token.span, token.text, token.key)


def _index(tokens: Tokens, name: tree.Name) -> tree.Index | tree.Poison:
    indices = values(tokens, "an index", f"after {name.text}", "[")
    tokens.height += 1
    span = tokens.since(name.span)
    return tree.Index(span, name, indices) if indices else tree.Poison(span, frozenset((name.key,)))


def _parenthesised(tokens: Tokens) -> tree.Expression:
    start = tokens.now
    items = values(tokens, "a value", "here")
    if len(items) == 1:
        return items[0]
    tokens.height += 1
    span = tokens.since(start)
    return tree.Matrix(span, items) if items else tree.Poison(span)


# mobile = arm | lvalue ;
def mobile(tokens: Tokens, wants: str, where: str) -> tree.Mobile:
    """Read a variable, an element of an array, or an arm.

    Raises:
        LostError: there is none.
    """
    return _arm(tokens) if tokens.now.kind is _ARM else _lvalue(tokens, wants, where)


# lvalue = name [ "[" expr { "," expr } "]" ] ;
def _lvalue(tokens: Tokens, wants: str, where: str) -> tree.Variable:
    if tokens.now.kind is not _NAME:
        tokens.want(wants, where)
        return _no_value(tokens, wants, where)
    name = tokens.take_name()
    return _index(tokens, name) if tokens.now.key == "[" else name


def variable(tokens: Tokens, wants: str, where: str) -> tree.Variable:
    """Read a variable or an element of an array.

    Raises:
        LostError: there is none.
    """
    if tokens.now.kind is _ARM:
        tokens.say_once("E111", f"expected {wants} {where}".rstrip(), tokens.now.span, "this is an arm")
        return tree.Poison(tokens.take().span)
    return _lvalue(tokens, wants, where)


def values(
    tokens: Tokens, wants: str, where: str, opening: str = "(", *, empty: bool = False
) -> tuple[tree.Expression, ...]:
    """Read expressions in parentheses; the arguments are those of ``listed``."""
    items = listed(tokens, expression, wants, where, opening, empty=empty)
    if items and tokens.ahead(-2).key == ",":
        # Nothing follows the last comma; it has been reported, and counts as a value.
        return (*items, tree.Poison(tokens.gap()))
    return items


def listed(
    tokens: Tokens,
    item: Callable[[Tokens, str, str], T],
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
        where: the pose in words, such as ``after VIA``.
        opening: what opens the list.
        empty: whether nothing is needed between them.

    Returns:
        What stands in it; empty also where that has been reported.

    Raises:
        LostError: what stands there makes no sense, or lies too deep.
    """
    closing = _CLOSING[opening]
    start = tokens.now
    if start.key != opening:
        return _unparenthesised(tokens, item, wants, where, opening)
    tokens.take()
    if tokens.now.key == closing:
        if not empty:
            text = f"expected {wants} between `{opening}{closing}`"
            tokens.say_once("E111", text, tokens.now.span, "there is nothing in between")
        tokens.take()
        return ()
    tokens.enter()
    items: list[T] = []
    height = 0
    while True:
        if tokens.now.key == "," and items:
            tokens.say_once("E117", "two `,` follow each other", tokens.now.span, "one of them is superfluous")
            tokens.take()
        items.append(item(tokens, wants, ""))
        height = max(height, tokens.height)
        if tokens.now.key == ",":
            comma = tokens.take()
            if tokens.now.key == closing:
                tokens.say_once("E111", f"expected {wants} after `,`", comma.span, "nothing follows")
                break
        elif not _comma_missing(tokens):
            break
    if tokens.now.key != closing:
        _not_closed(tokens, start, closing)
    else:
        tokens.take()
    tokens.depth -= 1
    tokens.height = height
    return tuple(items)


def _unparenthesised(
    tokens: Tokens, item: Callable[[Tokens, str, str], T], wants: str, where: str, opening: str
) -> tuple[T, ...]:
    """Read a list without its opening parenthesis; say so once."""
    closing = _CLOSING[opening]
    gap = tokens.gap()
    tokens.guess()
    items = [item(tokens, wants, where)]
    while tokens.now.key == "," and tokens.ahead().kind in _OPERANDS:
        tokens.take()
        items.append(item(tokens, wants, "after `,`"))
    fixes = [Fix(gap, f" {opening}")]
    if not tokens.accept(closing):
        fixes.append(Fix(tokens.gap(), closing))
    tokens.report("E112", f"missing `{opening}` {where}", gap, f"expected `{opening}` here", fixes=tuple(fixes))
    return tuple(items)


def _comma_missing(tokens: Tokens) -> bool:
    """Put a comma in between two values; whether it was missing."""
    token = tokens.now
    if token.kind not in _OPERANDS or token.damaged or tokens.before.damaged:
        return False
    if token.kind is not _NUMBER and (not tokens.same_line() or tokens.ahead().key in ("=", ":=")):
        return False
    tokens.insert(",", "between two values")
    return True


def _not_closed(tokens: Tokens, start: Token, closing: str) -> None:
    """Put in a closing parenthesis, or pass over what stands before it in the same line."""
    token = tokens.now
    if token.kind in _OPERANDS or token.key in ("(", "[", ")", "]", ".", ":", "+"):
        steps = 0
        while tokens.ahead(steps).key not in (closing, ";", "") and steps < 20:
            steps += 1
        line = tokens.source.line
        if tokens.ahead(steps).key == closing and line(tokens.ahead(steps).start) == line(start.start):
            tokens.say_once("E117", f"{shown(token)} does not belong here", token.span, f"expected `,` or `{closing}`")
            for _ in range(steps + 1):
                tokens.take()
            return
    tokens.expect(closing, "after the last value" if closing == ")" else "after the last index")


def _no_value(tokens: Tokens, wants: str, where: str) -> tree.Poison:
    """Say that there is no value here; go on where it is clear what was meant to be one.

    Raises:
        LostError: it is not.
    """
    token = tokens.now
    where = where or f"after `{tokens.before.text}`"
    if token.kind is _STRING:
        tokens.say_once("E111", f"expected {wants} {where}", token.span, "a text can only be printed")
        return tree.Poison(tokens.take().span)
    if reserved_as_name(tokens):
        tokens.refuse_reserved()
        tokens.take()
        return tree.Poison(token.span, frozenset((token.key,)))
    return tokens.lost(f"expected {wants} {where}".rstrip(), f"found {shown(token)}")


def reserved_as_name(tokens: Tokens) -> bool:
    """Whether a reserved word stands where a name should, and was meant as one."""
    token = tokens.now
    if token.kind is not TokenKind.KEYWORD or token.key in _NEVER_A_NAME or not tokens.same_line():
        return False
    after = tokens.ahead()
    return after.key in _BEHIND_A_NAME or (after.kind is TokenKind.KEYWORD and after.key not in ("BEGIN", "END"))
