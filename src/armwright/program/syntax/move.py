"""Parsing MOVE and its clauses, which come in any order."""

# ruff: noqa: ERA001 - each rule of the grammar stands above its function

from collections.abc import Callable

from armwright.errors import closest
from armwright.program.language.diagnostic import Fix, did_you_mean
from armwright.program.language.source import Span
from armwright.program.language.words import PLAIN_CLAUSES_IN_CONTEXT, WITH_CLAUSES_IN_CONTEXT, Standard
from armwright.program.syntax import tree
from armwright.program.syntax.control_flow import head_expression
from armwright.program.syntax.expressions import expression, mobile, parenthesised_list
from armwright.program.syntax.frames import expect_equals
from armwright.program.syntax.lexer import Token, TokenKind
from armwright.program.syntax.statement_list import nested_statement
from armwright.program.syntax.token_stream import TokenStream, either

_ACTIONS = (tree.Block, tree.Assign, tree.Call, tree.Halt, tree.Signal, tree.Print, tree.Poison)
_ACTION_WORDS = ("HALT", "SIGNAL", "PRINT", "BEGIN")
VALUED_CLAUSES: dict[str, Callable[[Span, tree.Expression], tree.Clause]] = {
    tree.clause_word(kind): kind
    for kind in (
        *(tree.Approach, tree.Departure, tree.Speed, tree.Blend, tree.Duration, *tree.TOOL_LIMITS),
        *(tree.Correction, tree.Bound, tree.Rate, tree.Capacity),
    )
} | {"TRACKING": tree.Tracking}
ADVERBS: dict[str, Callable[[Span], tree.Clause]] = {
    tree.clause_word(kind): kind for kind in (tree.Directly, tree.Straightly, tree.Circularly, tree.Smoothly)
}
_CLAUSES_IN_CONTEXT = (*PLAIN_CLAUSES_IN_CONTEXT, *WITH_CLAUSES_IN_CONTEXT)


# move = "MOVE" mobile "TO" expr { [","] clause } ;
def move(tokens: TokenStream) -> tree.Move:
    """Read one MOVE."""
    start = tokens.take()
    moved = mobile(tokens, "the name of a FRAME or an arm", "after MOVE")
    tokens.expect("TO", "after what is moved")
    goal = expression(tokens, "a pose", "after TO")
    clauses: list[tree.Clause] = []
    while tokens.current.key != ";":
        comma = tokens.accept(",")
        if tokens.is_at_end:
            words = (f"WITH {word}" for word in _with_words(tokens))
            plain = _plain_words(tokens)
            tokens.note_expected_words(*plain, *words, present_clauses=clause_words(clauses))
        if not _starts_clause(tokens):
            if comma:
                tokens.fail("expected a clause after `,`")
            break
        if (clause := _clause(tokens, clauses)) is not None:
            clauses.append(clause)
    return tokens.node(tree.Move, start, moved, goal, tuple(clauses))


def _plain_words(tokens: TokenStream) -> tuple[str, ...]:
    """Return the clauses that stand without WITH: also those that are words only here, which RLO-83 lacks."""
    words = tokens.vocabulary.plain_clauses
    return (*words, *PLAIN_CLAUSES_IN_CONTEXT) if tokens.standard is Standard.RLO_2 else words


def _with_words(tokens: TokenStream) -> tuple[str, ...]:
    """Return the clauses that stand behind WITH, in the same way."""
    words = tokens.vocabulary.with_clauses
    return (*words, *WITH_CLAUSES_IN_CONTEXT) if tokens.standard is Standard.RLO_2 else words


def clause_words(clauses: list[tree.Clause]) -> frozenset[str]:
    """Return the words by which clauses begin, behind WITH."""
    return frozenset(tree.clause_word(type(clause)) for clause in clauses)


def _starts_clause(tokens: TokenStream) -> bool:
    """Whether a clause stands here, rightly or wrongly spelt, and not the next statement."""
    token, after = tokens.current, tokens.peek()
    words = tokens.vocabulary
    if tokens.matches_word(*_CLAUSES_IN_CONTEXT) and (
        tokens.previous.key == "," or after.key not in ("=", ":=", "(", "[")
    ):
        return True
    if token.kind is TokenKind.KEYWORD:
        return token.key in words.clauses
    if token.kind is not TokenKind.NAME:
        return False
    if after.key in ("=", ":=", "(", "["):
        # WITH may be missing in front of a misspelt word: `, SPED = 5`.
        return tokens.previous.key == "," and closest(token.text, _with_words(tokens)) is not None
    if token.key in tokens.declared and tokens.previous.key != ",":
        return False
    is_near = closest(token.text, (*_plain_words(tokens), *_with_words(tokens), *words.clauses)) is not None
    others = (*words.statements, *words.block_ends)
    return is_near or (tokens.is_on_same_line() and not closest(token.text, others))


# clause = "DIRECTLY" | "STRAIGHTLY" | "CIRCULARLY" | "SMOOTHLY"
#        | "VIA" "(" expr { "," expr } ")"
#        | "WITH" ( "APPROACH" | "DEPARTURE" | "SPEED" | "BLEND" | "DURATION" ) "=" expr
#        | "WITH" ( "VELOCITY" | "ROTATION" | "ACCELERATION" | "TRACKING" ) "=" expr
#        | "WITH" ( "CORRECTION" | "BOUND" | "RATE" ) "=" expr
#        | "ON" expr "DO" action ;
def _clause(tokens: TokenStream, others: list[tree.Clause]) -> tree.Clause | None:
    """Read one clause behind others; None when it has been reported and passed over."""
    if tokens.matches_word(*_CLAUSES_IN_CONTEXT):
        tokens.current.kind = TokenKind.KEYWORD
    elif tokens.current.kind is TokenKind.NAME and not _replace_misspelt_clause(tokens):
        return None
    token, key = tokens.current, tokens.current.key
    if key == "ON":
        return _guard(tokens)
    tokens.take()
    if key == "WITH":
        tokens.note_expected_words(*_with_words(tokens), present_clauses=clause_words(others))
        return _with_clause(tokens, token)
    if key in _with_words(tokens):
        if not token.damaged:
            text, advice, fix = f"{key} needs WITH before it", f"write `WITH {key} = ...`", Fix(token.gap, "WITH ")
            tokens.report("E116", text, token.span, "expected WITH before this", advice=advice, fixes=(fix,))
        return valued_clause(tokens, token, key)
    return _plain_clause(tokens, token, key)


def _replace_misspelt_clause(tokens: TokenStream) -> bool:
    """Put the clause word that was meant in place of a misspelt one; pass over a clause for which there is none."""
    token = tokens.current
    near = closest(token.text, (*_plain_words(tokens), *_with_words(tokens), *tokens.vocabulary.clauses))
    in_context = _plain_words(tokens)[len(tokens.vocabulary.plain_clauses) :]
    known = f"clauses are {', '.join((*tokens.standard_vocabulary.plain_clauses, *in_context, 'WITH ...'))}"
    advice = did_you_mean(near) or known
    tokens.report("E108", f"unknown clause `{token.text}`", token.span, "not a clause of MOVE", advice=advice)
    if near:
        tokens.replace_current(near)
    else:
        _skip_clause(tokens)
    return near is not None


def _plain_clause(tokens: TokenStream, start: Token, key: str) -> tree.Clause | None:
    if key in ADVERBS:
        return ADVERBS[key](start.span)
    if key == "VIA":
        return tokens.node(tree.Via, start, parenthesised_list(tokens, expression, "a pose", "after VIA"))
    return None


def _with_clause(tokens: TokenStream, start: Token) -> tree.Clause | None:
    """Read what follows WITH."""
    token = tokens.current
    in_context = _with_words(tokens)[len(tokens.vocabulary.with_clauses) :]
    expected = f"expected {either((*tokens.standard_vocabulary.with_clauses, *in_context))}"
    if tokens.matches(*tokens.vocabulary.plain_clauses) or tokens.matches_word(*PLAIN_CLAUSES_IN_CONTEXT):
        token.kind = TokenKind.KEYWORD
        text, advice = f"{token.key} is written without WITH", f"write `{token.key}` alone"
        fix = Fix(Span(start.start, token.start), "")
        tokens.report("E116", text, start.span, "WITH does not belong here", advice=advice, fixes=(fix,))
        tokens.take()
        return _plain_clause(tokens, token, token.key)
    if tokens.matches_word(*WITH_CLAUSES_IN_CONTEXT):
        token.kind = TokenKind.KEYWORD
    key: str | None = token.key if tokens.matches(*_with_words(tokens)) else None
    if key is None and token.kind is TokenKind.NAME:
        key = closest(token.text, _with_words(tokens))
        tokens.report("E108", f"unknown clause `WITH {token.text}`", token.span, expected, advice=did_you_mean(key))
        if key is None:
            _skip_clause(tokens)
            return None
    if key is None:
        tokens.fail("expected a clause after WITH", expected, code="E108")
    tokens.take()
    return valued_clause(tokens, start, key)


def valued_clause(tokens: TokenStream, start: Token, key: str) -> tree.Clause:
    """Read the sign of equality and the value of a clause, behind its word."""
    expect_equals(tokens, f"`WITH {key}`", f"WITH {key}")
    wants = "a pose" if key in ("APPROACH", "DEPARTURE", "TRACKING") else "a value"
    return tokens.node(VALUED_CLAUSES[key], start, expression(tokens, wants, f"after {key} ="))


# "ON" expr "DO" action
# action = block | assign | call | "HALT" | "SIGNAL" lvalue | print ;
def _guard(tokens: TokenStream) -> tree.On:
    """Read what a motion shall watch."""
    start = tokens.take()
    condition = head_expression(tokens, "a condition", "after ON", "DO")
    head = tokens.span_since(start)
    tokens.expect("DO", "after the condition", statement=True)
    word = tokens.current
    action = nested_statement(tokens, "DO", *_ACTION_WORDS)
    if not isinstance(action, _ACTIONS):
        text, advice = f"{word.text} cannot be the action of ON", f"write `DO BEGIN {word.text} ... END`"
        label = "expected a block, `=`, a call, HALT, SIGNAL or PRINT"
        certain = not isinstance(action, tree.Move) or not action.clauses
        fixes = (Fix(word.gap, "BEGIN "), Fix(tokens.gap_span(), " END")) if certain else ()
        tokens.report("E121", text, word.span, label, advice=advice, fixes=fixes)
    return tokens.node(tree.On, start, head, condition, action)


def _skip_clause(tokens: TokenStream) -> None:
    """Pass over the rest of a clause that is none."""
    depth = 0
    words = tokens.vocabulary
    stops = (";", *words.block_ends, *words.statements, *words.plain_clauses, "WITH")
    tokens.take()
    while not tokens.is_at_end and not tokens.matches(*stops):
        if depth == 0 and tokens.matches(","):
            break
        depth += tokens.matches("(") - tokens.matches(")")
        tokens.take()
