"""Parsing what stands for a value: in RLO-83 names, arms, numbers, matrices; in RLO-2 any expression."""

# ruff: noqa: ERA001 - each rule of the grammar stands above its function

import math

from armwright.program.language.diagnostic import Fix
from armwright.program.language.source import Span
from armwright.program.language.words import PLAIN_CLAUSES
from armwright.program.syntax import expressions, rlo83, tree
from armwright.program.syntax.lexer import TokenKind
from armwright.program.syntax.token_stream import Tokens, shown

_SET_WANTS = "a number or twelve numbers in `( )`"
# What may stand behind a name, so that a reserved word in front of it was meant as one.
_BEHIND_A_NAME = (",", ";", ")", ":", "=", "TO", "FROM", "AT", "WITH", "VIA")


def mobile(tokens: Tokens, wants: str, where: str) -> tree.Mobile:
    """Read a name, an arm or, in RLO-2, an element of an array.

    Args:
        tokens: at the operand.
        wants: what is expected, in words.
        where: the place in words, such as ``after TO``.

    Raises:
        LostError: there is nothing that could be meant.
    """
    return expressions.mobile(tokens, wants, where) if tokens.later else operand(tokens, wants, where)


def value(tokens: Tokens, wants: str, where: str) -> tree.Expression:
    """Read a name or an arm or, in RLO-2, any expression; the arguments are those of ``mobile``.

    Raises:
        LostError: there is nothing that could be meant.
    """
    return expressions.expression(tokens, wants, where) if tokens.later else operand(tokens, wants, where)


# mobile = arm | name ;
def operand(tokens: Tokens, wants: str, where: str) -> tree.Mobile:
    """Read a name or an arm; pass over an expression.

    Args:
        tokens: at the operand.
        wants: what RLO-83 takes here, in words.
        where: the place in words, such as ``after TO``.

    Raises:
        LostError: there is nothing that could be meant.
    """
    token, after = tokens.now, tokens.ahead()
    if token.kind in (TokenKind.NAME, TokenKind.ARM):
        if after.kind is TokenKind.SYMBOL and after.key in (*rlo83.OPERATORS, "(", "["):
            return rlo83.expression(tokens, wants)
        tokens.take()
        make = tree.ArmName if token.kind is TokenKind.ARM else tree.Name
        return make(token.span, token.text, token.key)
    if tokens.sees("(", "-"):
        return rlo83.expression(tokens, wants)
    if _reserved_as_name(tokens):
        tokens.refuse_reserved()
        return tree.Poison(tokens.take().span)
    return tokens.lost(f"expected {wants} {where}", f"found {shown(token)}")


def _reserved_as_name(tokens: Tokens) -> bool:
    """Whether a reserved word stands where a name should, and was meant as one."""
    token, after = tokens.now, tokens.ahead()
    return (
        token.kind is TokenKind.KEYWORD
        and token.key not in (*PLAIN_CLAUSES, "WITH", "BEGIN", "END")
        and after.key in _BEHIND_A_NAME
        and tokens.same_line()
    )


def check_length(tokens: Tokens, name: tree.Name) -> None:
    """Refuse a name that is too long."""
    longest = tokens.words.longest_name
    if len(name.text) > longest:
        tokens.found.say(
            "E103",
            f"the name `{name.text}` is longer than {longest} characters",
            name.span,
            f"{len(name.text)} characters",
            notes=(f"names of {tokens.words.name} have 1 to {longest} characters",),
        )


# init   = name "=" ( matrix | signed ) ;                      (* RLO-83 *)
# assign = lvalue "=" expr ;                                   (* RLO-2 *)
def assign(tokens: Tokens) -> tree.Assign:
    """Read ``name = value``."""
    token = tokens.now
    target: tree.Mobile
    if tokens.later:
        target = expressions.mobile(tokens, "a name", "here")
        if tokens.now.key == "=":
            tokens.take()
        else:
            written = tokens.source.slice(tokens.since(token))
            equals(tokens, f"`{written}`", written)
        value = expressions.expression(tokens, "a value", "")
        return tree.Assign(tokens.since(token), target, value)
    tokens.take()
    make = tree.ArmName if token.kind is TokenKind.ARM else tree.Name
    target = make(token.span, token.text, token.key)
    equals(tokens, f"`{token.text}`", token.text)
    found = _value(tokens)
    return tree.Assign(tokens.since(token), target, found)


def equals(tokens: Tokens, what: str, written: str) -> None:
    """Read ``=``, or say that it is missing before a value and go on."""
    if tokens.accept("="):
        return
    token = tokens.now
    if tokens.accept(":=", "=="):
        tokens.found.say(
            "E109",
            f"{what} gets its value with `=`, not `{token.text}`",
            token.span,
            "write `=`",
            fixes=(Fix(token.span, "="),),
        )
    elif tokens.done or tokens.sees(";", ",", ")", "END") or (tokens.later and token.kind is TokenKind.KEYWORD):
        tokens.lost(f"{what} needs `=` and a value", "expected `=` and a value here", code="E109")
    elif not token.damaged:
        tokens.found.say(
            "E109",
            f"{what} needs `=` before its value",
            token.span,
            "expected `=` before this",
            helps=(f"write `{written} = {token.text}`",) if token.text != "(" else (f"write `{written} = (...`",),
            fixes=(Fix(Span(token.start, token.start), "= "),),
        )


def _value(tokens: Tokens) -> tree.Matrix | tree.Number | tree.Poison:
    start = tokens.at
    token = tokens.now
    if tokens.sees("("):
        found = len(tokens.found)
        matrix = _matrix(tokens)
        if matrix is not None and len(matrix.items) > 1 and not tokens.sees(*rlo83.OPERATORS):
            return matrix
        # Not a list of numbers but an expression that begins with a parenthesis.
        del tokens.found[found:]
        tokens.back(start)
        return rlo83.expression(tokens, _SET_WANTS)
    if token.kind is TokenKind.NUMBER or tokens.sees("-", "+"):
        number = _signed_or_none(tokens)
        if number is not None and not tokens.sees(*rlo83.OPERATORS):
            return number
        tokens.back(start)
        return rlo83.expression(tokens, _SET_WANTS)
    if token.kind in (TokenKind.NAME, TokenKind.ARM, TokenKind.STRING):
        return rlo83.expression(tokens, _SET_WANTS)
    return tokens.lost("expected a value after `=`", f"found {shown(token)}")


# matrix = "(" signed "," signed ... 12 in all ... ")" ;
def _matrix(tokens: Tokens) -> tree.Matrix | None:
    """Read numbers in parentheses; None where something else is among them."""
    start = tokens.take()
    numbers: list[tree.Number] = []
    while True:
        number = _signed_or_none(tokens)
        if number is None:
            if numbers and tokens.sees(")") and tokens.before.key == ",":
                tokens.found.say("E111", "expected a number after `,`", tokens.now.span, "found `)`")
                numbers.append(tree.Number(tokens.gap(), "", math.nan))
                break
            if tokens.done or tokens.sees(";", "END", ")", ","):
                tokens.lost("expected a number", f"found {shown(tokens.now)}")
            return None
        numbers.append(number)
        if tokens.accept(","):
            continue
        if tokens.now.kind is TokenKind.NUMBER and not tokens.before.damaged:
            gap = tokens.gap()
            tokens.found.say(
                "E112", "missing `,` between two numbers", gap, "expected `,` here", fixes=(Fix(gap, ","),)
            )
            continue
        break
    if tokens.now.kind in (TokenKind.NAME, TokenKind.ARM, TokenKind.STRING) or tokens.sees(*rlo83.OPERATORS, "(", "["):
        return None
    tokens.expect(")", "after the last number")
    return tree.Matrix(tokens.since(start), tuple(numbers))


# signed = [ "-" ] number ;
def signed(tokens: Tokens) -> tree.Number:
    """Read a number with its sign.

    Raises:
        LostError: there is none.
    """
    number = _signed_or_none(tokens)
    if number is None:
        tokens.lost("expected a number", f"found {shown(tokens.now)}")
    return number


def _signed_or_none(tokens: Tokens) -> tree.Number | None:
    start = tokens.now
    sign = start.key if tokens.sees("-", "+") else ""
    token = tokens.ahead() if sign else start
    if token.kind is not TokenKind.NUMBER:
        return None
    if sign:
        tokens.take()
    tokens.take()
    if sign == "+":
        tokens.found.say(
            "E113", "a number has no `+` in front", start.span, "leave it out", fixes=(Fix(start.span, ""),)
        )
    if not token.damaged and token.key != token.text:
        unit = token.text[len(token.key) :]
        rlo83.report(tokens, f"the unit `{unit}`", token.span, "RLO-83 counts in metres and takes bare numbers")
    value = math.nan if token.damaged or token.key != token.text else float(token.key)
    text = token.text if sign != "-" else f"-{token.text}"
    return tree.Number(tokens.since(start), text, -value if sign == "-" else value)


# "(" ... ")"
def parenthesised(tokens: Tokens, wants: str, where: str) -> tuple[tree.Mobile, ...]:
    """Read names in parentheses; say once when the parentheses are missing."""
    opening = tokens.accept("(")
    gap = tokens.gap()
    names = [operand(tokens, wants, where)]
    while comma := tokens.accept(","):
        # Without parentheses a comma may also lead to the next clause.
        if not opening and tokens.now.kind not in (TokenKind.NAME, TokenKind.ARM):
            tokens.back(tokens.at - 1)
            break
        if tokens.sees(")"):
            tokens.found.say("E111", f"expected {wants} after `,`", comma.span, "nothing follows")
            break
        names.append(operand(tokens, wants, "after `,`"))
    if opening:
        tokens.expect(")", "after the last name")
    else:
        closing = tokens.accept(")")
        fixes = (Fix(gap, " ("),) if closing else (Fix(gap, " ("), Fix(tokens.gap(), ")"))
        tokens.found.say("E112", f"missing `(` {where}", gap, "expected `(` here", fixes=fixes)
    return tuple(names)
