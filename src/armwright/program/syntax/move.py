"""Parsing MOVE and its clauses, which come in any order."""

# ruff: noqa: ERA001 - each rule of the grammar stands above its function

from collections.abc import Callable

from armwright.errors import closest
from armwright.program.language.diagnostic import Fix, did_you_mean
from armwright.program.language.source import Span
from armwright.program.syntax import tree
from armwright.program.syntax.control_flow import part
from armwright.program.syntax.expressions import expression, listed, mobile
from armwright.program.syntax.frames import equals
from armwright.program.syntax.lexer import Token, TokenKind
from armwright.program.syntax.statement_list import nested
from armwright.program.syntax.token_stream import Tokens, shown

_ACTIONS = (tree.Block, tree.Assign, tree.Call, tree.Halt, tree.Signal, tree.Print, tree.Poison)
_ACTION_WORDS = ("HALT", "SIGNAL", "PRINT", "BEGIN")
_VALUES: dict[str, Callable[[Span, tree.Expression], tree.Clause]] = {
    "APPROACH": tree.Approach,
    "DEPARTURE": tree.Departure,
    "SPEED": tree.Speed,
    "BLEND": tree.Blend,
    "DURATION": tree.Duration,
}


# move = "MOVE" mobile "TO" expr { [","] clause } ;
def move(tokens: Tokens) -> tree.Move:
    """Read one MOVE."""
    start = tokens.take()
    moved = mobile(tokens, "the name of a FRAME or an arm", "after MOVE")
    tokens.expect("TO", "after what is moved")
    goal = expression(tokens, "a pose", "after TO")
    clauses: list[tree.Clause] = []
    while tokens.now.key != ";":
        comma = tokens.accept(",")
        if tokens.done:
            words = (f"WITH {word}" for word in tokens.words.with_clauses)
            tokens.offer(*tokens.words.plain_clauses, *words, given=_words(clauses))
        if not _starts_clause(tokens):
            if comma:
                tokens.lost("expected a clause after `,`", f"found {shown(tokens.now)}")
            break
        if (clause := _clause(tokens, clauses)) is not None:
            clauses.append(clause)
    return tree.Move(tokens.since(start), moved, goal, tuple(clauses))


def _words(clauses: list[tree.Clause]) -> frozenset[str]:
    """Return the words by which clauses begin, behind WITH."""
    return frozenset(tree.clause_word(type(clause)) for clause in clauses)


def _starts_clause(tokens: Tokens) -> bool:
    """Whether a clause stands here, rightly or wrongly spelt, and not the next statement."""
    token, after = tokens.now, tokens.ahead()
    words = tokens.words
    if token.kind is TokenKind.KEYWORD:
        return token.key in words.clauses
    if token.kind is not TokenKind.NAME:
        return False
    if after.key in ("=", ":=", "(", "["):
        # WITH may be missing in front of a misspelt word: `, SPED = 5`.
        return tokens.before.key == "," and closest(token.text, words.with_clauses) is not None
    if token.key in tokens.declared and tokens.before.key != ",":
        return False
    if closest(token.text, words.clauses):
        return True
    return tokens.same_line() and not closest(token.text, (*words.statements, *words.closing))


# clause = "DIRECTLY" | "STRAIGHTLY"
#        | "VIA" "(" expr { "," expr } ")"
#        | "WITH" ( "APPROACH" | "DEPARTURE" | "SPEED" | "BLEND" | "DURATION" ) "=" expr
#        | "ON" expr "DO" action ;
def _clause(tokens: Tokens, others: list[tree.Clause]) -> tree.Clause | None:
    """Read one clause behind others; None when it has been reported and passed over."""
    token = tokens.now
    if token.kind is TokenKind.NAME:
        if not _meant(tokens, token):
            _pass_over(tokens)
            return None
        token = tokens.now
    key = token.key
    if key == "ON":
        return _guard(tokens)
    tokens.take()
    if key == "WITH":
        tokens.offer(*tokens.words.with_clauses, given=_words(others))
        return _with(tokens, token)
    if key in tokens.words.with_clauses:
        gap = Span(token.start, token.start)
        if not token.damaged:
            text = f"{key} needs WITH before it"
            advice = f"write `WITH {key} = ...`"
            tokens.report(
                "E116", text, token.span, "expected WITH before this", advice=advice, fixes=(Fix(gap, "WITH "),)
            )
        return _assigned(tokens, token, key)
    return _plain(tokens, token, key)


def _meant(tokens: Tokens, token: Token) -> bool:
    """Put the clause word that a misspelt one was meant to be in its pose; whether there is one."""
    near = closest(token.text, tokens.words.clauses)
    advice = (
        f"did you mean `{near}`?" if near else f"clauses are {', '.join((*tokens.offered.plain_clauses, 'WITH ...'))}"
    )
    tokens.report("E108", f"unknown clause `{token.text}`", token.span, "not a clause of MOVE", advice=advice)
    if near:
        tokens.replace(near)
    return near is not None


def _plain(tokens: Tokens, start: Token, key: str) -> tree.Clause | None:
    if key == "DIRECTLY":
        return tree.Directly(start.span)
    if key == "STRAIGHTLY":
        return tree.Straightly(start.span)
    if key == "VIA":
        points = listed(tokens, expression, "a pose", "after VIA")
        return tree.Via(tokens.since(start), points)
    return None


def _with(tokens: Tokens, start: Token) -> tree.Clause | None:
    """Read what follows WITH."""
    token = tokens.now
    plain, with_words = tokens.words.plain_clauses, tokens.words.with_clauses
    offered = tokens.offered.with_clauses
    expected = f"expected {', '.join(offered[:-1])} or {offered[-1]}"
    if tokens.sees(*plain):
        text, advice = f"{token.key} is written without WITH", f"write `{token.key}` alone"
        fix = Fix(Span(start.start, token.start), "")
        tokens.report("E116", text, start.span, "WITH does not belong here", advice=advice, fixes=(fix,))
        tokens.take()
        return _plain(tokens, token, token.key)
    key: str | None = token.key if tokens.sees(*with_words) else None
    if key is None and token.kind is TokenKind.NAME:
        key = closest(token.text, with_words)
        tokens.report("E108", f"unknown clause `WITH {token.text}`", token.span, expected, advice=did_you_mean(key))
        if key is None:
            _pass_over(tokens)
            return None
    if key is None:
        tokens.lost("expected a clause after WITH", expected, code="E108")
    tokens.take()
    return _assigned(tokens, start, key)


def _assigned(tokens: Tokens, start: Token, key: str) -> tree.Clause:
    equals(tokens, f"`WITH {key}`", f"WITH {key}")
    value = expression(tokens, "a value" if key not in ("APPROACH", "DEPARTURE") else "a pose", f"after {key} =")
    return _VALUES[key](tokens.since(start), value)


# "ON" expr "DO" action
# action = block | assign | call | "HALT" | "SIGNAL" lvalue | print ;
def _guard(tokens: Tokens) -> tree.On:
    """Read what a motion shall watch."""
    start = tokens.take()
    condition = part(tokens, "a condition", "after ON", "DO")
    head = tokens.since(start)
    tokens.expect("DO", "after the condition", statement=True)
    word = tokens.now
    action = nested(tokens, "DO", *_ACTION_WORDS)
    if not isinstance(action, _ACTIONS):
        text, advice = f"{word.text} cannot be the action of ON", f"write `DO BEGIN {word.text} ... END`"
        label = "expected a block, `=`, a call, HALT, SIGNAL or PRINT"
        certain = not isinstance(action, tree.Move) or not action.clauses
        fixes = (Fix(Span(word.start, word.start), "BEGIN "), Fix(tokens.gap(), " END")) if certain else ()
        tokens.report("E121", text, word.span, label, advice=advice, fixes=fixes)
    return tree.On(tokens.since(start), head, condition, action)


def _pass_over(tokens: Tokens) -> None:
    """Pass over the rest of a clause that is none."""
    depth = 0
    words = tokens.words
    stops = (";", *words.closing, *words.statements, *words.plain_clauses, "WITH")
    tokens.take()
    while not tokens.done and not tokens.sees(*stops):
        if depth == 0 and tokens.sees(","):
            break
        depth += tokens.sees("(") - tokens.sees(")")
        tokens.take()
