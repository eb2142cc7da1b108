"""Parsing a stretch of statements: what separates them, what ends them, and how to go on after nonsense."""

from collections.abc import Callable
from typing import NoReturn, TypeVar

from armwright.errors import closest
from armwright.program.language.diagnostic import Fix, did_you_mean, labels
from armwright.program.language.source import Span
from armwright.program.language.words import ABSENT, CLOSING, ELSEWHERE, OPENING
from armwright.program.syntax import tree
from armwright.program.syntax.lexer import Token, TokenKind
from armwright.program.syntax.token_stream import ANY_VALUE, MAX_DEPTH, LostError, Tokens, TooDeepError, shown

_Read = TypeVar("_Read")
_NAME, _KEYWORD, _ARM, _NUMBER = TokenKind.NAME, TokenKind.KEYWORD, TokenKind.ARM, TokenKind.NUMBER
_BEFORE_STATEMENTS = frozenset((";", "BEGIN", "TRY", "RECOVER", "REPEAT"))
# What stands behind a name that is given a value.
ASSIGNING = ("=", ":=", "==")
# What opens the stretch that a word ends, for one that ends none.
_OPENED_BY = {
    "UNTIL": "REPEAT",
    "COEND": "COBEGIN",
    "PRIORITY": "COBEGIN",
    "RECOVER": "TRY",
    "ELSE": "IF",
    "THEN": "IF",
    "DO": "WHILE or FOR",
}


# statements = [ statement ] { ";" [ statement ] } ;
def statements(tokens: Tokens, *closing: str) -> tuple[tree.Statement, ...]:
    """Read statements up to one of the ``closing`` words, which stays, or to where it is clearly missing."""
    statements_: list[tree.Statement] = []
    depth, level = tokens.depth, len(tokens.waiting)
    tokens.waiting.append(closing)
    while True:
        while tokens.now.key == ";":
            tokens.take()
        starts = tokens.before.key in _BEFORE_STATEMENTS
        tokens.offer(*(tokens.words.statements if starts else ()), *closing, starts=starts)
        if tokens.done or _ends_here(tokens):
            break
        if _ends_nothing(tokens):
            continue
        index = tokens.at
        if not level:
            tokens.deep = -1
        try:
            statements_.append(statement(tokens))
            _separator(tokens)
        except TooDeepError:
            if level:
                raise
            _pass_over_all(tokens, index)
        except LostError:
            next_statement(tokens)
        # Where nothing was lost, this is so already.
        del tokens.waiting[level + 1 :]
        tokens.depth = depth
        if tokens.at == index:
            tokens.take()
    tokens.waiting.pop()
    return tuple(statements_)


def _ends_here(tokens: Tokens) -> bool:
    """Whether the stretch of statements ends with the next token."""
    token = tokens.now
    if token.kind is _NAME:
        return _misspelt_end(tokens)
    if token.kind is not _KEYWORD:
        return False
    if token.key in tokens.words.closing:
        return token.key == "END" or any(token.key in words for words in tokens.waiting)
    # A procedure cannot hold another, so its own END is missing.
    return bool(tokens.in_procedure) and token.key in tokens.words.headers and token.key != "VAR"


def _ends_nothing(tokens: Tokens) -> bool:
    """Pass over a word that ends a stretch that nothing has opened."""
    token = tokens.now
    if token.kind is not _KEYWORD or token.key not in _OPENED_BY:
        return False
    opening = _OPENED_BY[token.key]
    # A missing COBEGIN leaves many words behind.
    if opening not in tokens.missed:
        tokens.say_once("E127", f"`{token.text}` without {opening}", token.span, f"no {opening} is open here")
    if opening == "COBEGIN":
        tokens.missed.add(opening)
    tokens.take()
    if token.key == "UNTIL" or (token.key == "PRIORITY" and tokens.now.kind is _NUMBER):
        next_statement(tokens)
    tokens.hush()
    return True


def _misspelt_end(tokens: Tokens) -> bool:
    """Whether END or another word that is waited for stands here, misspelt."""
    token, after = tokens.now, tokens.ahead()
    if after.key in (*ASSIGNING, "(", "[") or token.key in ABSENT or _is_known(tokens, token):
        return False
    expected = ("END",) if after.key == "." else tokens.waiting[-1]
    near = closest(token.text, expected if after.key == "." else (*expected, *tokens.words.statements))
    if near not in expected:
        return False
    misspelt(tokens, near)
    return True


def misspelt(tokens: Tokens, near: str) -> None:
    """Say that a word is misspelt, and put the one that was meant in its pose."""
    token = tokens.now
    text = f"unknown statement `{token.text}`"
    tokens.report("E105", text, token.span, "not a statement", advice=did_you_mean(near))
    tokens.replace(near)


def statement(tokens: Tokens) -> tree.Statement:
    """Read one statement.

    Raises:
        LostError: there is none.
    """
    token = tokens.now
    tokens.asked, tokens.target = ANY_VALUE, ""
    if token.kind is _KEYWORD and token.key in tokens.rules:
        if tokens.ahead().key in ASSIGNING:
            return _reserved(tokens)
        tokens.depth += 1
        tokens.statement_depth = tokens.depth
        if tokens.depth > MAX_DEPTH:
            tokens.too_deep()
        read = tokens.rules[token.key](tokens)
        tokens.depth -= 1
        return read
    after = tokens.ahead()
    if token.kind is _ARM and after.key in ASSIGNING:
        return tokens.rules["="](tokens)
    if token.kind is _NAME:
        return _named(tokens, after)
    return _no_statement(tokens)


def _named(tokens: Tokens, after: Token) -> tree.Statement:
    """Read a statement that begins with a name."""
    token = tokens.now
    if after.key in ASSIGNING or after.key == "[":
        return tokens.rules["="](tokens)
    if after.key == "(" and tokens.ahead(2).kind is not TokenKind.STRING:
        return tokens.rules["("](tokens)
    known = _is_known(tokens, token)
    elsewhere = not known and (token.key in ELSEWHERE or token.key in ABSENT)
    near = None if elsewhere or known else closest(token.text, tokens.words.statements)
    # In front of a number or a matrix only the sign of equality is missing.
    number = tokens.ahead(2) if after.key in ("(", "-") else after
    valued = number.kind is _NUMBER or (number.key == "-" and number is not after)
    if valued and not elsewhere and not near:
        return tokens.rules["="](tokens)
    if number.kind is TokenKind.STRING and number is not after:
        near = "PRINT"
    if near:
        misspelt(tokens, near)
    return statement(tokens) if near else _no_statement(tokens)


def _reserved(tokens: Tokens) -> tree.Statement:
    """Read an assignment to a reserved word."""
    tokens.refuse_reserved()
    word = tokens.now
    tokens.replace(word.key, _NAME)
    read = tokens.rules["="](tokens)
    assert isinstance(read, tree.Assign)  # noqa: S101 - that is what the rule reads
    return tree.Assign(read.span, tree.Poison(word.span, frozenset((word.key,))), read.value)


def _no_statement(tokens: Tokens) -> tree.Statement:
    """Say that no statement starts here."""
    token = tokens.now
    if token.damaged:
        raise LostError
    if token.kind is _NAME:
        text, label = f"unknown statement `{token.text}`", "not a statement"
    else:
        text, label = f"{shown(token)} does not start a statement", "expected a statement"
    if token.key in tokens.procedures:
        name = tokens.take_name()
        tokens.insert("()", "after the name of a procedure")
        return tree.Call(name.span, name, ())
    if _is_known(tokens, token):
        _value_missing(tokens)
    if token.key in ELSEWHERE:
        advice = did_you_mean(ELSEWHERE[token.key])
    else:
        general = (
            "statements begin with a keyword such as MOVE, AFFIX or IF, with a name and `=`, or with a name and `(`"
        )
        advice = ABSENT.get(token.key, general)
    note = "line numbers are allowed only if the first line has one" if token.kind is _NUMBER else ""
    tokens.report("E105", text, token.span, label, note=note, advice=advice)
    raise LostError


def _value_missing(tokens: Tokens) -> NoReturn:
    """Say that a variable alone is no statement.

    Raises:
        LostError: always.
    """
    name, sign = tokens.now.text, tokens.ahead().key
    advice = f"write `{name} = {name} {sign} ...`" if sign in ("+", "-", "*", "/") else ""
    tokens.lost(f"`{name}` needs `=` and a value", "a name alone is not a statement", code="E109", advice=advice)


def nested(tokens: Tokens, behind: str, *words: str) -> tree.Statement:
    """Read the one statement behind a word such as THEN; one that makes no sense is passed over.

    Args:
        tokens: behind the word.
        behind: the word.
        words: those that the statement may begin with; all without them.
    """
    token = tokens.now
    tokens.offer(*(words or tokens.words.statements), starts=True)
    if tokens.done or token.key == ";" or (token.kind is _KEYWORD and token.key in tokens.words.closing):
        gap = tokens.gap()
        tokens.say_once("E111", f"expected a statement after {behind}", gap, "expected a statement here")
        tokens.hush()
        return tree.Poison(gap)
    return salvaged(tokens, statement) or tree.Poison(tokens.since(token))


def salvaged(tokens: Tokens, read: Callable[[Tokens], _Read]) -> _Read | None:
    """Read something; pass over to the next statement where it makes no sense."""
    depth, level = tokens.depth, len(tokens.waiting)
    try:
        return read(tokens)
    except TooDeepError:
        raise
    except LostError:
        del tokens.waiting[level:]
        tokens.depth = depth
        next_statement(tokens)
        tokens.hush()
        return None


def close(tokens: Tokens, key: str, opening: Token) -> Span | None:
    """Read the word that ends what ``opening`` opened; None when it is missing, which is said once for one pose."""
    token = tokens.now
    if tokens.sees(key):
        point = tokens.ahead()
        if key != "END" or point.key != ".":
            return tokens.take().span
        if tokens.spare and tokens.ahead(2).kind is TokenKind.END:
            # An END too many stands further above, and was reported.
            tokens.spare -= 1
            return None
        if tokens.ahead(2).kind is not TokenKind.END:
            # More follows, so this was not meant to be the last END.
            tokens.take()
            tokens.say_once("E114", "`.` ends the program, but more follows", point.span, "write `;`")
            tokens.take()
            tokens.hush()
            return token.span
    # An END that nothing else waits for was meant to be this word.
    instead = key not in ("END", "RECOVER") and tokens.sees("END") and tokens.more_ends()
    span, here = token.span if instead else tokens.gap(), labels(opening.span, "opened here")
    fixes = (Fix(token.span, key),) if instead and key == "COEND" else ()
    text, label = f"{opening.text} has no {key}", f"expected `{key}` here"
    tokens.say_once("E115", text, span, label, secondary=here, fixes=fixes)
    if instead:
        tokens.take()
    tokens.hush()
    return None


def _separator(tokens: Tokens) -> None:
    """Read ``;``; put it in where the next statement begins without one."""
    token = tokens.now
    if token.key == ";":
        tokens.take()
        return
    if tokens.done or (token.kind is _KEYWORD and token.key in tokens.words.closing):
        return
    if token.kind is _NAME and _misspelt_end(tokens):
        return
    if _starts_statement(tokens):
        text, gap = "missing `;` between two statements", tokens.gap()
        here = labels(token.span, "a new statement starts here")
        tokens.say_once("E104", text, gap, "expected `;` here", secondary=here, fixes=(Fix(gap, ";"),))
        return
    advice = ABSENT.get(token.key, "")
    tokens.lost(f"{shown(token)} does not belong here", "expected `;`", code="E117", advice=advice)


def _starts_statement(tokens: Tokens) -> bool:
    token, after = tokens.now, tokens.ahead()
    if token.kind is _KEYWORD:
        return token.key in (*tokens.words.statements, *tokens.words.headers, "BEGIN")
    if token.kind is not _NAME and token.kind is not _ARM:
        return False
    if after.key in ASSIGNING or not tokens.same_line():
        return True
    if after.key in ("(", "["):
        return after.key == "[" or token.key in tokens.procedures
    wrong = token.kind is _NAME and not _is_known(tokens, token)
    return wrong and closest(token.text, tokens.words.statements) is not None


def _is_known(tokens: Tokens, token: Token) -> bool:
    """Whether a name has been declared, so that it is no misspelt word."""
    return token.key in tokens.declared or token.key in tokens.procedures


def next_statement(tokens: Tokens) -> None:
    """Pass over tokens up to the next ``;``, word that ends something, or start of a statement."""
    stops = {";", "BEGIN", *tokens.words.closing, *tokens.words.headers, *tokens.words.statements}
    while not tokens.done:
        token = tokens.now
        if token.key in stops and (token.kind is _KEYWORD or token.key == ";"):
            return
        tokens.take()


def _pass_over_all(tokens: Tokens, index: int) -> None:
    """Pass over a statement from its start with all that is in it, at least to where it was too deep."""
    tokens.back(index)
    depth = 0
    while not tokens.done:
        token = tokens.now
        last = token.key == "END" and tokens.ahead().key == "."
        if tokens.at >= tokens.deep and (last or (depth <= 0 and token.key in (";", "END"))):
            return
        depth += (token.key in OPENING) - (token.key in CLOSING)
        tokens.take()
