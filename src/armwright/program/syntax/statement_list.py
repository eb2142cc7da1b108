"""Parsing a stretch of statements: what separates them, what ends them, and how to go on after nonsense."""

from collections.abc import Callable
from typing import TypeVar

from armwright.errors import closest
from armwright.program.language.diagnostic import Fix, did_you_mean, labels
from armwright.program.language.source import Span
from armwright.program.language.words import (
    BLOCK_CLOSERS,
    BLOCK_OPENERS,
    COMPARISONS,
    FOREIGN_STATEMENTS,
    STATEMENT_PHRASES,
    STATEMENTS_ALONE,
    STATEMENTS_BEFORE_ARM,
    STATEMENTS_BEFORE_FRAME,
    STATEMENTS_BEFORE_NAME,
    STATEMENTS_BEFORE_TEXT,
    UNSUPPORTED_STATEMENTS,
    Standard,
)
from armwright.program.syntax import tree
from armwright.program.syntax.lexer import Token, TokenKind
from armwright.program.syntax.token_stream import ANY_VALUE, NestingError, PanicModeError, TokenStream, describe_token

_Parsed = TypeVar("_Parsed")
_NAME, _KEYWORD, _ARM, _NUMBER = TokenKind.NAME, TokenKind.KEYWORD, TokenKind.ARM, TokenKind.NUMBER
_BEFORE_STATEMENTS = frozenset((";", "BEGIN", "TRY", "RECOVER", "REPEAT"))
# What stands behind a name that is given a value.
ASSIGNMENT_SIGNS = ("=", ":=", "==")
# What goes on with a condition that begins in parentheses.
_BEHIND_OPERAND = frozenset((*COMPARISONS, "+", "-", "*", "/", "AND", "OR", "DO"))
_BEGINNINGS = "statements begin with a keyword such as MOVE, AFFIX or IF, with a name and `=`, or with a name and `(`"
# What opens the stretch that a word ends, for one that ends none.
_OPENER_OF = {"UNTIL": "REPEAT", "COEND": "COBEGIN", "PRIORITY": "COBEGIN", "RECOVER": "TRY"}
# Words that start a statement in front of some kinds of tokens.
_BEFORE_KINDS = (
    (STATEMENTS_BEFORE_NAME, (_NAME,)),
    (STATEMENTS_BEFORE_ARM, (_ARM,)),
    (STATEMENTS_BEFORE_FRAME, (_NAME, _ARM)),
)
_OPENER_OF |= {"ELSE": "IF", "THEN": "IF", "DO": "WHILE or FOR"}


# statements = [ statement ] { ";" [ statement ] } ;
def statements(tokens: TokenStream, *closing: str) -> tuple[tree.Statement, ...]:
    """Read statements up to one of the ``closing`` words, which stays, or to where it is clearly missing."""
    statements_: list[tree.Statement] = []
    depth, level = tokens.depth, len(tokens.open_closers)
    tokens.open_closers.append(closing)
    while True:
        while tokens.current.key == ";":
            tokens.take()
        starts = tokens.previous.key in _BEFORE_STATEMENTS
        words = tokens.vocabulary.statements if starts else ()
        tokens.note_expected_words(*words, *(("RETURN",) if starts and tokens.in_function else ()), *closing)
        tokens.note_expected_words(starts_statement=starts)
        if tokens.is_at_end or _is_at_list_end(tokens):
            break
        if _skip_stray_closer(tokens):
            continue
        index = tokens.index
        if not level:
            tokens.overflow_index = -1
        try:
            statements_.append(statement(tokens))
            _statement_separator(tokens)
        except NestingError:
            if level:
                raise
            _skip_nested_statement(tokens, index)
        except PanicModeError:
            skip_to_statement(tokens)
        # Where nothing was lost, this is so already.
        del tokens.open_closers[level + 1 :]
        tokens.depth = depth
        if tokens.index == index:
            tokens.take()
    tokens.open_closers.pop()
    return tuple(statements_)


def _is_at_list_end(tokens: TokenStream) -> bool:
    """Whether the stretch of statements ends with the next token."""
    token = tokens.current
    if token.kind is _NAME:
        return not (_starts_phrase(tokens) or starts_return(tokens)) and _replace_misspelt_end(tokens)
    if token.kind is not _KEYWORD:
        return False
    if token.key in tokens.vocabulary.block_ends:
        return token.key == "END" or any(token.key in words for words in tokens.open_closers)
    # A procedure cannot hold another, so its own END is missing.
    return bool(tokens.enclosing_procedure) and token.key in tokens.vocabulary.headers and token.key != "VAR"


def _skip_stray_closer(tokens: TokenStream) -> bool:
    """Pass over a word that ends a stretch that nothing has opened."""
    token = tokens.current
    if token.kind is not _KEYWORD or token.key not in _OPENER_OF:
        return False
    opening = _OPENER_OF[token.key]
    # A missing COBEGIN leaves many words behind.
    if opening not in tokens.reported_missing:
        tokens.report_once("E127", f"`{token.text}` without {opening}", token.span, f"no {opening} is open here")
    if opening == "COBEGIN":
        tokens.reported_missing.add(opening)
    tokens.take()
    if token.key == "UNTIL" or (token.key == "PRIORITY" and tokens.current.kind is _NUMBER):
        skip_to_statement(tokens)
    tokens.suppress_reports()
    return True


def _replace_misspelt_end(tokens: TokenStream) -> bool:
    """Whether END or another word that is waited for stands here, misspelt."""
    token, after = tokens.current, tokens.peek()
    if after.key in (*ASSIGNMENT_SIGNS, "(", "[") or token.key in UNSUPPORTED_STATEMENTS or _is_known(tokens, token):
        return False
    expected = ("END",) if after.key == "." else tokens.open_closers[-1]
    near = closest(token.text, expected if after.key == "." else (*expected, *tokens.vocabulary.statements))
    if near not in expected:
        return False
    replace_misspelt_statement(tokens, near)
    return True


def replace_misspelt_statement(tokens: TokenStream, near: str) -> None:
    """Say that a word is misspelt, and put the one that was meant in its place."""
    token = tokens.current
    text = f"unknown statement `{token.text}`"
    tokens.report("E105", text, token.span, "not a statement", advice=did_you_mean(near))
    tokens.replace_current(near)


def statement(tokens: TokenStream) -> tree.Statement:
    """Read one statement.

    Raises:
        PanicModeError: there is none.
    """
    token = tokens.current
    tokens.operand_context, tokens.assignment_target = ANY_VALUE, ""
    if token.kind is _KEYWORD and token.key in tokens.rules:
        if tokens.peek().key in ASSIGNMENT_SIGNS:
            return _assignment_to_reserved_word(tokens)
        tokens.statement_depth = tokens.depth + 1
        tokens.enter_level()
        read = tokens.rules[token.key](tokens)
        tokens.depth -= 1
        return read
    after = tokens.peek()
    if token.kind is _ARM and after.key in ASSIGNMENT_SIGNS:
        return tokens.rules["="](tokens)
    if token.kind is _NAME:
        return _statement_from_name(tokens, after)
    return _report_no_statement(tokens)


def _statement_from_name(tokens: TokenStream, after: Token) -> tree.Statement:
    """Read a statement that begins with a name."""
    token = tokens.current
    if _starts_phrase(tokens) or starts_return(tokens):
        return tokens.rules[token.key](tokens)
    if after.key in ASSIGNMENT_SIGNS or after.key == "[":
        return tokens.rules["="](tokens)
    if after.key == "(" and (tokens.peek(2).kind is not TokenKind.STRING or tokens.standard is Standard.RLO_2):
        return tokens.rules["("](tokens)
    known = _is_known(tokens, token)
    foreign = not known and (token.key in FOREIGN_STATEMENTS or token.key in UNSUPPORTED_STATEMENTS)
    near = None if foreign or known else closest(token.text, tokens.vocabulary.statements)
    # In front of a number or a matrix only the sign of equality is missing.
    number = tokens.peek(2) if after.key in ("(", "-") else after
    valued = number.kind is _NUMBER or (number.key == "-" and number is not after)
    if valued and not foreign and not near:
        return tokens.rules["="](tokens)
    if number.kind is TokenKind.STRING and number is not after:
        near = "PRINT"
    if not near:
        return _report_no_statement(tokens)
    replace_misspelt_statement(tokens, near)
    return statement(tokens)


def _assignment_to_reserved_word(tokens: TokenStream) -> tree.Statement:
    """Read an assignment to a reserved word."""
    tokens.report_reserved_name()
    word = tokens.current
    tokens.replace_current(word.key, _NAME)
    read = tokens.rules["="](tokens)
    assert isinstance(read, tree.Assign)  # noqa: S101 - that is what the rule reads
    return tree.Assign(read.span, tree.Poison(word.span, frozenset((word.key,))), read.value)


def _report_no_statement(tokens: TokenStream) -> tree.Statement:
    """Say that no statement starts here."""
    token = tokens.current
    if token.damaged:
        raise PanicModeError
    if token.kind is _NAME:
        text, label = f"unknown statement `{token.text}`", "not a statement"
    else:
        text, label = f"{describe_token(token)} does not start a statement", "expected a statement"
    if token.key in tokens.procedures:
        name = tokens.take_name()
        tokens.insert_missing("()", "after the name of a procedure")
        return tree.Call(name.span, name, ())
    if _is_known(tokens, token):
        # A variable alone is no statement.
        sign = tokens.peek().key
        advice = f"write `{token.text} = {token.text} {sign} ...`" if sign in ("+", "-", "*", "/") else ""
        text = f"`{token.text}` needs `=` and a value"
        tokens.fail(text, "a name alone is not a statement", code="E109", advice=advice)
    phrase = f"{token.key} {STATEMENT_PHRASES[token.key]}" if token.key in STATEMENT_PHRASES else ""
    advice = did_you_mean(FOREIGN_STATEMENTS.get(token.key) or phrase) or UNSUPPORTED_STATEMENTS.get(
        token.key, _BEGINNINGS
    )
    note = "line numbers are allowed only if the first line has one" if token.kind is _NUMBER else ""
    tokens.report("E105", text, token.span, label, note=note, advice=advice)
    raise PanicModeError


def nested_statement(tokens: TokenStream, behind: str, *words: str) -> tree.Statement:
    """Read the one statement behind a word such as THEN; one that makes no sense is passed over.

    Args:
        tokens: behind the word.
        behind: the word.
        words: those that the statement may begin with; all without them.
    """
    token = tokens.current
    tokens.note_expected_words(*(words or tokens.vocabulary.statements), starts_statement=True)
    if tokens.is_at_statement_end:
        gap = tokens.gap_span()
        tokens.report_once("E111", f"expected a statement after {behind}", gap, "expected a statement here")
        tokens.suppress_reports()
        return tree.Poison(gap)
    nested = parse_or_skip(tokens, statement) or tree.Poison(tokens.span_since(token))
    if isinstance(nested, tree.When):
        text, advice = (
            f"a WHEN behind {behind} would be disarmed at once",
            "write it in the block around this statement",
        )
        tokens.report("E128", text, nested.head, "it is armed until the end of its block", advice=advice)
    return nested


def parse_or_skip(tokens: TokenStream, read: Callable[[TokenStream], _Parsed]) -> _Parsed | None:
    """Read something; pass over to the next statement where it makes no sense."""
    parsed = tokens.attempt(read)
    if parsed is None:
        skip_to_statement(tokens)
        tokens.suppress_reports()
    return parsed


def expect_closer(tokens: TokenStream, key: str, opening: Token) -> Span | None:
    """Read the word that ends what ``opening`` opened; None when it is missing, which is said once for one position."""
    token = tokens.current
    if tokens.matches(key):
        point = tokens.peek()
        if key != "END" or point.key != ".":
            return tokens.take().span
        if tokens.surplus_ends and tokens.peek(2).kind is TokenKind.END:
            # An END too many stands further above, and was reported.
            tokens.surplus_ends -= 1
            return None
        if tokens.peek(2).kind is not TokenKind.END:
            # More follows, so this was not meant to be the last END.
            tokens.take()
            tokens.report_once("E114", "`.` ends the program, but more follows", point.span, "write `;`")
            tokens.take()
            tokens.suppress_reports()
            return token.span
    # An END that nothing else waits for was meant to be this word.
    instead = key not in ("END", "RECOVER") and tokens.matches("END") and tokens.has_surplus_end()
    span, here = token.span if instead else tokens.gap_span(), labels(opening.span, "opened here")
    fixes = (Fix(token.span, key),) if instead and key == "COEND" else ()
    text, label = f"{opening.text} has no {key}", f"expected `{key}` here"
    tokens.report_once("E115", text, span, label, secondary=here, fixes=fixes)
    if instead:
        tokens.take()
    tokens.suppress_reports()
    return None


def _statement_separator(tokens: TokenStream) -> None:
    """Read ``;``; put it in where the next statement begins without one."""
    token = tokens.current
    if tokens.accept(";") or tokens.is_at_statement_end:
        return
    if token.kind is _NAME and not starts_return(tokens) and _replace_misspelt_end(tokens):
        return
    if _starts_statement(tokens):
        text, here = "missing `;` between two statements", labels(token.span, "a new statement starts here")
        tokens.report_once("E104", text, tokens.gap_span(), "expected `;` here", secondary=here, replacement=";")
        return
    advice = UNSUPPORTED_STATEMENTS.get(token.key, "")
    tokens.fail(f"{describe_token(token)} does not belong here", "expected `;`", code="E117", advice=advice)


def _starts_statement(tokens: TokenStream) -> bool:
    token, after = tokens.current, tokens.peek()
    if token.kind is _KEYWORD:
        return token.key in (*tokens.vocabulary.statements, *tokens.vocabulary.headers, "BEGIN")
    if token.kind is not _NAME and token.kind is not _ARM:
        return False
    if after.key in ASSIGNMENT_SIGNS or not tokens.is_on_same_line():
        return True
    if _starts_phrase(tokens) or starts_return(tokens):
        return True
    if after.key in ("(", "["):
        return after.key == "[" or token.key in tokens.procedures
    wrong = token.kind is _NAME and not _is_known(tokens, token)
    return wrong and closest(token.text, tokens.vocabulary.statements) is not None


def _starts_phrase(tokens: TokenStream) -> bool:
    """Whether a word starts a statement here by what stands behind it, though programs may use it as a name."""
    after = tokens.peek()
    if after.kind is TokenKind.STRING and tokens.matches_word(*STATEMENTS_BEFORE_TEXT):
        return True
    if tokens.matches_word("WHEN"):
        return _starts_when(tokens, after)
    if tokens.matches_word(*STATEMENTS_ALONE):
        return after.key not in (*ASSIGNMENT_SIGNS, "(", "[")
    for words, kinds in _BEFORE_KINDS:
        if tokens.matches_word(*words):
            return after.kind in kinds
    return after.kind is _NAME and STATEMENT_PHRASES.get(tokens.current.key) == after.key


def _starts_when(tokens: TokenStream, after: Token) -> bool:
    """Whether WHEN begins a statement here: not where it gets a value, nor where all of it is a call."""
    if after.key != "(":
        return after.key not in (*ASSIGNMENT_SIGNS, "[")
    depth, steps = 0, 1
    while (token := tokens.peek(steps)).kind is not TokenKind.END:
        depth += (token.key == "(") - (token.key == ")")
        steps += 1
        if not depth:
            break
    return tokens.peek(steps).key in _BEHIND_OPERAND


def starts_return(tokens: TokenStream) -> bool:
    """Whether RETURN stands here, which in a FUNCTION is a name only where it gets a value."""
    return tokens.in_function and tokens.matches_word("RETURN") and tokens.peek().key not in (*ASSIGNMENT_SIGNS, "[")


def _is_known(tokens: TokenStream, token: Token) -> bool:
    """Whether a name has been declared, so that it is no misspelt word."""
    return token.key in tokens.declared or token.key in tokens.procedures


def skip_to_statement(tokens: TokenStream) -> None:
    """Pass over tokens up to the next ``;``, word that ends something, or start of a statement."""
    words = tokens.vocabulary
    tokens.skip_to(";", "BEGIN", *words.block_ends, *words.headers, *words.statements)


def _skip_nested_statement(tokens: TokenStream, index: int) -> None:
    """Pass over a statement from its start with all that is in it, at least to where it was too deep."""
    tokens.rewind(index)
    depth = 0
    while not tokens.is_at_end:
        token = tokens.current
        last = token.key == "END" and tokens.peek().key == "."
        if tokens.index >= tokens.overflow_index and (last or (depth <= 0 and token.key in (";", "END"))):
            return
        depth += (token.key in BLOCK_OPENERS) - (token.key in BLOCK_CLOSERS)
        tokens.take()
