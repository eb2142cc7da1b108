"""Parsing statements about frames: assignments, AFFIX and UNFIX."""

import math

from armwright.program.language.diagnostic import Fix
from armwright.program.syntax import expressions, rlo83, tree
from armwright.program.syntax.lexer import TokenKind
from armwright.program.syntax.operands import equals, mobile, signed_or_none, value
from armwright.program.syntax.token_stream import Tokens, shown

_FRAME = "the name of a FRAME"
_SET_WANTS = "a number or twelve numbers in `( )`"


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
        number = signed_or_none(tokens)
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
        number = signed_or_none(tokens)
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


# affix = "AFFIX" name "TO" mobile [ "AT" name ] ;                                              (* RLO-83 *)
# affix = "AFFIX" mobile "TO" mobile [ "AT" expr ] [ "RIGIDLY" | "NONRIGIDLY" ] ;               (* RLO-2 *)
def affix(tokens: Tokens) -> tree.Affix:
    """Read one AFFIX."""
    start = tokens.take()
    child = mobile(tokens, _FRAME, "after AFFIX")
    tokens.expect("TO", "after the frame that follows")
    parent = mobile(tokens, "the name of a FRAME or an arm", "after TO")
    link = tokens.since(start)
    at = None
    if tokens.accept("AT"):
        at = value(tokens, "a TRANS" if tokens.later else "the name of a TRANS", "after AT")
    rigid = tokens.accept("RIGIDLY", "NONRIGIDLY")
    if not tokens.later:
        rlo83.trailing(
            tokens, "AFFIX ...", "in RLO-83 a frame follows its parent, never the other way", "RIGIDLY", "NONRIGIDLY"
        )
    return tree.Affix(tokens.since(start), link, child, parent, at, rigid is not None and rigid.key == "RIGIDLY")


# unfix = "UNFIX" name "FROM" mobile ;                                                          (* RLO-83 *)
# unfix = "UNFIX" lvalue [ "FROM" mobile ] ;                                                    (* RLO-2 *)
def unfix(tokens: Tokens) -> tree.Unfix:
    """Read one UNFIX."""
    start = tokens.take()
    child = mobile(tokens, _FRAME, "after UNFIX")
    if tokens.done or tokens.now.key in (";", *tokens.words.closing):
        if not tokens.later:
            rlo83.report(tokens, "UNFIX without FROM", tokens.gap(), "RLO-83 names the frame it hangs on: `FROM ...`")
        return tree.Unfix(tokens.since(start), child, None)
    if tokens.later and tokens.now.key != "FROM" and (tokens.now.kind is TokenKind.KEYWORD or not tokens.same_line()):
        return tree.Unfix(tokens.since(start), child, None)
    tokens.expect("FROM", "after the frame to cut")
    parent = mobile(tokens, "the name of a FRAME or an arm", "after FROM")
    return tree.Unfix(tokens.since(start), child, parent)
