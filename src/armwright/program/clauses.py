"""Parsing MOVE and its clauses, which come in any order."""

# ruff: noqa: ERA001 - each rule of the grammar stands above its function

from armwright.errors import closest
from armwright.program import beyond, tree
from armwright.program.cursor import Tokens, shown
from armwright.program.diagnostics import Fix
from armwright.program.source import Span
from armwright.program.tokens import Token, TokenKind
from armwright.program.values import equals, operand, parenthesised, signed
from armwright.program.words import CLAUSES, LATER_WITH, PLAIN_CLAUSES, STATEMENTS, WITH_CLAUSES

_FRAME = "the name of a FRAME"
_SPEED = "a number or the name of a SCALAR"
_EXPECTED_WITH = "expected APPROACH, DEPARTURE or SPEED"


# move = "MOVE" mobile "TO" name { [","] clause } ;
def move(tokens: Tokens) -> tree.Move:
    """Read one MOVE."""
    start = tokens.take()
    moved = operand(tokens, "the name of a FRAME or an arm", "after MOVE")
    tokens.expect("TO", "after what is moved")
    goal = operand(tokens, _FRAME, "after TO")
    clauses = []
    while True:
        comma = tokens.accept(",")
        if not _starts_clause(tokens):
            break
        if (clause := _clause(tokens)) is not None:
            clauses.append(clause)
        comma = None
    if comma:
        tokens.lost("expected a clause after `,`", f"found {shown(tokens.now)}")
    return tree.Move(tokens.since(start), moved, goal, tuple(clauses))


def _starts_clause(tokens: Tokens) -> bool:
    """Whether a clause stands here, rightly or wrongly spelt, and not the next statement."""
    token, after = tokens.now, tokens.ahead()
    if token.kind is TokenKind.KEYWORD:
        return token.key in CLAUSES
    if token.kind is not TokenKind.NAME or after.key in ("=", ":=") or beyond.starts_statement(tokens):
        return token.kind is TokenKind.NAME and token.key == "ON"
    if token.key == "ON" or closest(token.text, CLAUSES):
        return True
    return tokens.same_line() and not closest(token.text, STATEMENTS)


# clause = "DIRECTLY" | "STRAIGHTLY"
#        | "VIA" "(" name { "," name } ")"
#        | "WITH" ( "APPROACH" | "DEPARTURE" ) "=" name
#        | "WITH" "SPEED" "=" ( number | name ) ;
def _clause(tokens: Tokens) -> tree.Clause | None:
    """Read one clause; None when it has been reported and passed over."""
    token = tokens.now
    if tokens.sees_word("ON"):
        beyond.guard(tokens)
        return None
    key = token.key
    if token.kind is TokenKind.NAME:
        key = _meant(tokens, token)
        if not key:
            _pass_over(tokens)
            return None
    tokens.take()
    if key == "WITH":
        return _with(tokens, token)
    if key in WITH_CLAUSES:
        gap = Span(token.start, token.start)
        tokens.found.say(
            "E116",
            f"{key} needs WITH in front",
            token.span,
            "expected WITH before this",
            helps=(f"write `WITH {key} = ...`",),
            fixes=(Fix(gap, "WITH "),),
        )
        return _assigned(tokens, token, key)
    return _plain(tokens, token, key)


def _meant(tokens: Tokens, token: Token) -> str:
    """Return the clause word that a misspelt one was meant to be; empty if there is none."""
    near = closest(token.text, CLAUSES)
    tokens.found.say(
        "E108",
        f"unknown clause `{token.text}`",
        token.span,
        "not a clause of MOVE",
        helps=(f"did you mean `{near}`?" if near else f"clauses are {', '.join((*PLAIN_CLAUSES, 'WITH ...'))}",),
    )
    return near or ""


def _plain(tokens: Tokens, start: Token, key: str) -> tree.Clause | None:
    if key == "DIRECTLY":
        return tree.Directly(start.span)
    if key == "STRAIGHTLY":
        return tree.Straightly(start.span)
    if key == "VIA":
        points = parenthesised(tokens, _FRAME, "after VIA")
        return tree.Via(tokens.since(start), points)
    return None


def _with(tokens: Tokens, start: Token) -> tree.Clause | None:
    """Read what follows WITH."""
    token = tokens.now
    if tokens.sees(*PLAIN_CLAUSES):
        tokens.found.say(
            "E116",
            f"{token.key} stands without WITH",
            start.span,
            "WITH does not belong here",
            helps=(f"write `{token.key}` alone",),
            fixes=(Fix(Span(start.start, token.start), ""),),
        )
        tokens.take()
        return _plain(tokens, token, token.key)
    key: str | None = token.key if tokens.sees(*WITH_CLAUSES) else None
    if tokens.sees_word(*LATER_WITH):
        beyond.report(tokens, f"WITH {token.key}", token.span, "RLO-83 has APPROACH, DEPARTURE and SPEED")
        _pass_over(tokens)
        return None
    if key is None and token.kind is TokenKind.NAME:
        key = closest(token.text, WITH_CLAUSES)
        tokens.found.say(
            "E108",
            f"unknown clause `WITH {token.text}`",
            token.span,
            _EXPECTED_WITH,
            helps=(f"did you mean `{key}`?",) if key else (),
        )
        if key is None:
            _pass_over(tokens)
            return None
    if key is None:
        tokens.lost("expected a clause after WITH", _EXPECTED_WITH, code="E108")
    tokens.take()
    return _assigned(tokens, start, key)


def _assigned(tokens: Tokens, start: Token, key: str) -> tree.Clause:
    equals(tokens, f"`WITH {key}`", f"WITH {key}")
    if key == "SPEED":
        value = _speed(tokens)
        return tree.Speed(tokens.since(start), value)
    point = operand(tokens, _FRAME, f"after {key} =")
    make = tree.Approach if key == "APPROACH" else tree.Departure
    return make(tokens.since(start), point)


def _speed(tokens: Tokens) -> tree.Number | tree.Mobile:
    signs = tokens.sees("-", "+")
    number = tokens.ahead() if signs else tokens.now
    behind = tokens.ahead(2 if signs else 1)
    if number.kind is not TokenKind.NUMBER:
        return operand(tokens, _SPEED, "after SPEED =")
    if behind.kind is TokenKind.SYMBOL and behind.key in beyond.OPERATORS:
        return beyond.expression(tokens, _SPEED)
    return signed(tokens)


def _pass_over(tokens: Tokens) -> None:
    """Pass over the rest of a clause that is none."""
    depth = 0
    tokens.take()
    while not tokens.done and not tokens.sees(";", "END", *STATEMENTS, *PLAIN_CLAUSES, "WITH"):
        if depth == 0 and tokens.sees(","):
            break
        depth += tokens.sees("(") - tokens.sees(")")
        tokens.take()
