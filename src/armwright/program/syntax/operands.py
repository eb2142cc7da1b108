"""Parsing what stands for a value: in RLO-83 names, arms and numbers; in RLO-2 any expression."""

# ruff: noqa: ERA001 - each rule of the grammar stands above its function

import math

from armwright.program.language.diagnostic import Fix
from armwright.program.language.source import Span
from armwright.program.language.words import PLAIN_CLAUSES
from armwright.program.syntax import expressions, rlo83, tree
from armwright.program.syntax.lexer import TokenKind
from armwright.program.syntax.token_stream import Tokens, shown

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


# signed = [ "-" ] number ;
def signed(tokens: Tokens) -> tree.Number:
    """Read a number with its sign.

    Raises:
        LostError: there is none.
    """
    number = signed_or_none(tokens)
    if number is None:
        tokens.lost("expected a number", f"found {shown(tokens.now)}")
    return number


def signed_or_none(tokens: Tokens) -> tree.Number | None:
    """Read a number with its sign; None where there is none."""
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
