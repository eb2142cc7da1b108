"""Parsing what decides what is done next: blocks, choices, loops, calls, branches side by side, events, recovery."""

from typing import TypeVar

from armwright.errors import closest
from armwright.program.language.source import Span
from armwright.program.language.words import Standard
from armwright.program.syntax import tree
from armwright.program.syntax.expressions import (
    expression,
    expression_list,
    is_reserved_as_name,
    mobile,
    number,
    parenthesised_list,
    variable,
)
from armwright.program.syntax.frames import expect_equals
from armwright.program.syntax.lexer import Token, TokenKind
from armwright.program.syntax.statement_list import (
    ASSIGNMENT_SIGNS,
    expect_closer,
    nested_statement,
    parse_or_skip,
    replace_misspelt_statement,
    skip_to_statement,
    statements,
)
from armwright.program.syntax.token_stream import PanicModeError, TokenStream, describe_token

_T = TypeVar("_T")
_CONDITION = "a condition"
_EVENT = "the name of an EVENT"
# What may stand behind a name in a condition.
_OF_CONDITIONS = ("(", "=", "<>", "<", "<=", ">", ">=", "AND", "OR")
_OPERANDS = (TokenKind.NAME, TokenKind.NUMBER, TokenKind.ARM)
_DOWNTO = "DOWNTO"
_ELSE_IF_SPELLINGS = ("ELSEIF", "ELSIF", "ELIF")


# block = "BEGIN" statements "END" ;
def block(tokens: TokenStream) -> tree.Block:
    """Read a block; where its END is missing, say so. BEGIN has been looked for, and may be missing too."""
    start = tokens.current
    tokens.accept("BEGIN")
    body = statements(tokens, "END")
    return tokens.node(tree.Block, start, body, expect_closer(tokens, "END", start) or tokens.gap_span())


def head_expression(tokens: TokenStream, wants: str, where: str, *ends: str) -> tree.Expression:
    """Read an expression in the head of a statement; pass over one that makes no sense.

    Args:
        tokens: at the expression.
        wants: what is expected, in words.
        where: the position in words.
        ends: the words that may stand behind it.

    Raises:
        PanicModeError: the statement ends there.
    """
    start = tokens.current
    read = _condition if wants == _CONDITION else expression
    body = tokens.attempt(lambda tokens: read(tokens, wants, where))
    if body is None:
        return _skip_head(tokens, start, ends)
    token = tokens.current
    if token.kind in _OPERANDS and _follows_soon(tokens, ends) and not closest(token.text, (*ends, _DOWNTO)):
        text = f"{describe_token(token)} does not belong here"
        tokens.report_once("E117", text, token.span, f"expected `{ends[0]}`")
        _skip_head(tokens, start, ends)
    return body


def _condition(tokens: TokenStream, wants: str, where: str) -> tree.Expression:
    """Read a condition, also where AND and OR are misspelt."""
    start = tokens.current
    body = expression(tokens, wants, where)
    tokens.note_expected_words("AND", "OR")
    while _replace_misspelt_connective(tokens):
        sign = tokens.take()
        body = tokens.node(tree.Binary, start, sign.key, body, expression(tokens, wants, ""))
    return body


def _follows_soon(tokens: TokenStream, ends: tuple[str, ...]) -> bool:
    """Whether one of these words stands near, before anything that starts or ends a statement."""
    stops = (*ends, ";", *tokens.vocabulary.block_ends, *tokens.vocabulary.statements)
    keys = (tokens.peek(steps).key for steps in range(1, 8))
    return next((key for key in keys if key in stops), "") in ends


def _replace_misspelt_connective(tokens: TokenStream) -> bool:
    """Whether AND or OR stands here misspelt; it is replaced."""
    if tokens.current.kind is not TokenKind.NAME or tokens.peek().key == "=":
        return False
    near = closest(tokens.current.text, ("AND", "OR"))
    if near:
        replace_misspelt_statement(tokens, near)
    return near is not None


def _skip_head(tokens: TokenStream, start: Token, ends: tuple[str, ...]) -> tree.Poison:
    """Pass over the rest of the head of a statement; the next word of it may be missing without a further message."""
    names = set()
    while not tokens.matches(*ends, *tokens.vocabulary.statements):
        if tokens.is_at_statement_end:
            raise PanicModeError
        if tokens.current.kind in (TokenKind.NAME, TokenKind.ARM):
            names.add(tokens.current.key)
        tokens.take()
    tokens.suppress_reports()
    return tree.Poison(tokens.span_since(start), frozenset(names))


# "IF" expr "THEN" statement [ "ELSE" statement ]
def if_(tokens: TokenStream) -> tree.If:
    """Read one IF, and all that follow it with ELSE IF: they make a chain, which is long and not deep."""
    chain = [_if_then(tokens)]
    otherwise: tree.Statement | None = None
    while accept_else(tokens):
        start = tokens.current
        if not tokens.matches("IF") or tokens.peek().key in ASSIGNMENT_SIGNS:
            otherwise = nested_statement(tokens, "ELSE")
            break
        link = parse_or_skip(tokens, _if_then)
        if link is None:
            otherwise = tree.Poison(tokens.span_since(start))
            break
        chain.append(link)
    for start, head, condition, then in reversed(chain):
        otherwise = tree.If(tokens.span_since(start), head, condition, then, otherwise)
    assert isinstance(otherwise, tree.If)  # noqa: S101 - the chain has one link or more
    return otherwise


def _if_then(tokens: TokenStream) -> tuple[Token, Span, tree.Expression, tree.Statement]:
    """Read an IF up to its ELSE: where it starts, its head, its condition, and what is done where that holds."""
    start = tokens.take()
    condition = head_expression(tokens, _CONDITION, "after IF", "THEN")
    head = tokens.span_since(start)
    tokens.expect("THEN", "after the condition", statement=True)
    tokens.open_closers.append(("ELSE",))
    then = nested_statement(tokens, "THEN")
    tokens.open_closers.pop()
    return start, head, condition, then


def accept_else(tokens: TokenStream) -> bool:
    """Read ELSE, also behind a needless ``;``."""
    if tokens.accept("ELSE"):
        return True
    token, after = tokens.current, tokens.peek()
    if token.key == ";" and after.key == "ELSE":
        tokens.report_once("E124", "no `;` is allowed before ELSE", token.span, "leave it out", replacement="")
        tokens.take()
        tokens.take()
        return True
    if token.kind is not TokenKind.NAME or after.key in ("=", ":=", "(", "["):
        return False
    if token.key in _ELSE_IF_SPELLINGS:
        text, meant = f"unknown statement `{token.text}`", "ELSE IF"
        tokens.report("E105", text, token.span, "not a statement", advice=f"write `{meant}`", replacement=meant)
        tokens.replace_current("IF")
        return True
    if closest(token.text, ("ELSE", *tokens.vocabulary.statements)) == "ELSE":
        replace_misspelt_statement(tokens, "ELSE")
        tokens.take()
        return True
    return False


# "WHILE" expr "DO" statement
def while_(tokens: TokenStream) -> tree.While:
    """Read one WHILE."""
    start = tokens.take()
    condition = head_expression(tokens, _CONDITION, "after WHILE", "DO")
    head = tokens.span_since(start)
    tokens.expect("DO", "after the condition", statement=True)
    return tokens.node(tree.While, start, head, condition, nested_statement(tokens, "DO"))


# "REPEAT" statements "UNTIL" expr
def repeat(tokens: TokenStream) -> tree.Repeat:
    """Read one REPEAT."""
    start = tokens.take()
    body = statements(tokens, "UNTIL")
    tail = tokens.current
    if expect_closer(tokens, "UNTIL", start):
        condition = head_expression(tokens, _CONDITION, "after UNTIL")
        return tree.Repeat(tokens.span_since(start), body, tokens.span_since(tail), condition)
    gap = tokens.gap_span()
    return tree.Repeat(tokens.span_since(start), body, gap, tree.Poison(gap))


# "FOR" name "=" expr "TO" expr [ "STEP" expr ] "DO" statement
def for_(tokens: TokenStream) -> tree.For:
    """Read one FOR."""
    start = tokens.take()
    counter = _loop_variable(tokens)
    expect_equals(tokens, "the variable of FOR", tokens.previous.text)
    first = head_expression(tokens, "a number", "after `=`", "TO", "STEP", "DO")
    if tokens.matches_name(_DOWNTO) or tokens.matches(",", ":"):
        advice = "write `TO ... STEP -1`" if tokens.matches_name(_DOWNTO) else "write `TO`"
        tokens.report_once("E112", "FOR counts with TO and STEP", tokens.current.span, "expected `TO`", advice=advice)
        tokens.replace_current("TO")
    tokens.expect("TO", "after the first number")
    last = head_expression(tokens, "a number", "after TO", "STEP", "DO")
    step = head_expression(tokens, "a number", "after STEP", "DO") if tokens.accept("STEP") else None
    head = tokens.span_since(start)
    tokens.expect("DO", "after the last number", statement=True)
    return tokens.node(tree.For, start, head, counter, first, last, step, nested_statement(tokens, "DO"))


def _loop_variable(tokens: TokenStream) -> tree.Name | tree.Poison:
    """Read the variable of FOR."""
    token = tokens.current
    tokens.note_expected_operand("the name of a SCALAR", "after FOR")
    if token.kind is TokenKind.NAME and tokens.peek().key != "[":
        return tokens.take_name()
    if token.kind in (TokenKind.NAME, TokenKind.ARM):
        body = mobile(tokens, "a name", "after FOR")
        text = "FOR counts with a variable of its own" if token.kind is TokenKind.NAME else "FOR counts with a SCALAR"
        tokens.report("E111", text, body.span, "expected the name of a SCALAR")
        return tree.Poison(body.span, frozenset((token.key,)))
    if is_reserved_as_name(tokens):
        tokens.report_reserved_name()
        tokens.take()
        return tree.Poison(token.span, frozenset((token.key,)))
    return tokens.fail("expected the name of a SCALAR after FOR")


# "COBEGIN" branch { ";" branch } [";"] "COEND"
def cobegin(tokens: TokenStream) -> tree.Cobegin:
    """Read one COBEGIN."""
    start = tokens.take()
    branches: list[tree.Branch] = []
    tokens.open_closers.append(("COEND", "PRIORITY"))
    tokens.note_expected_words("BEGIN", "PRIORITY", "COEND", starts_statement=True)
    while not (tokens.is_at_end or tokens.matches("COEND", "UNTIL", "RECOVER")):
        index = tokens.index
        if tokens.matches("END") and not _skip_surplus_end(tokens):
            break
        if not tokens.attempt(lambda tokens: _branch_and_separator(tokens, branches)):
            skip_to_statement(tokens)
            tokens.accept(";")
            tokens.suppress_reports()
        if tokens.index == index:
            tokens.take()
    tokens.open_closers.pop()
    if not branches and tokens.matches("COEND"):
        tokens.report_once("E126", "COBEGIN has no branches", tokens.current.span, "expected `BEGIN ... END`")
    end = expect_closer(tokens, "COEND", start)
    return tokens.node(tree.Cobegin, start, tuple(branches), end or tokens.gap_span())


def _branch_and_separator(tokens: TokenStream, branches: list[tree.Branch]) -> bool:
    """Read one more branch, and the ``;`` behind it."""
    branches.append(_branch(tokens))
    _branch_separator(tokens)
    if tokens.previous.key == ";":
        tokens.note_expected_words("BEGIN", "PRIORITY", "COEND", starts_statement=True)
    return True


# branch = [ "PRIORITY" number ":" ] block ;
def _branch(tokens: TokenStream) -> tree.Branch:
    start = tokens.current
    priority, head = None, start.span
    if tokens.matches("PRIORITY"):
        priority = _priority_and_colon(tokens)
        head = start.span.to(priority.span) if priority is not None else start.span
    tokens.note_expected_words("BEGIN", starts_statement=True)
    body = block(tokens) if tokens.matches("BEGIN") else _branch_without_block(tokens)
    return tokens.node(tree.Branch, start, head, priority, body)


def _priority_and_colon(tokens: TokenStream) -> tree.Number | None:
    """Read PRIORITY, the number behind it and the colon; return the number, None where there is none."""
    tokens.take()
    if tokens.current.kind is not TokenKind.NUMBER:
        text = "expected a number after PRIORITY"
        tokens.report_once("E111", text, tokens.current.span, "a number without a sign, such as `2`")
    priority = _priority(tokens)
    tokens.expect(":", "after the priority", statement=True)
    return priority


def _priority(tokens: TokenStream) -> tree.Number | None:
    """Read what stands for a priority."""
    is_number_next = tokens.peek().kind is TokenKind.NUMBER
    if tokens.current.kind is TokenKind.NUMBER or (is_number_next and tokens.matches("-", "+")):
        return number(tokens)
    if tokens.current.kind is TokenKind.NAME and not is_number_next:
        tokens.take()
    return None


def _branch_without_block(tokens: TokenStream) -> tree.Block:
    """Read a statement that stands for a branch of COBEGIN."""
    token = tokens.current
    if token.key == ";":
        tokens.fail("a `;` is allowed only between two branches", "expected `BEGIN`", code="E126")
    text, advice = "a branch of COBEGIN is a block", "write `BEGIN ... END` around the statements of each branch"
    tokens.report_once("E126", text, token.span, "expected `BEGIN` before this", advice=advice)
    body = statements(tokens, "END")
    if tokens.matches("END") and tokens.peek().key != ".":
        tokens.take()
    else:
        tokens.suppress_reports()
    return tokens.node(tree.Block, token, body, tokens.gap_span())


def _skip_surplus_end(tokens: TokenStream) -> bool:
    """Pass over an END between branches that closes nothing; whether it was one."""
    token, after = tokens.current, tokens.peek()
    if after.key == ";":
        after = tokens.peek(2)
    if after.key not in ("BEGIN", "COEND", "PRIORITY"):
        return False
    tokens.report_once("E127", "`END` without BEGIN", token.span, "no BEGIN is open in this COBEGIN")
    tokens.take()
    tokens.accept(";")
    tokens.suppress_reports()
    return True


def _branch_separator(tokens: TokenStream) -> None:
    """Read the ``;`` between two branches."""
    if tokens.accept(";") or tokens.is_at_end or tokens.matches("COEND", "END", "UNTIL", "RECOVER"):
        return
    if tokens.matches("PRIORITY") and tokens.is_reported:
        return
    gap = tokens.gap_span()
    if tokens.matches("BEGIN", "PRIORITY"):
        tokens.report_once("E104", "missing `;` between two branches", gap, "expected `;` here", replacement=";")
        return
    tokens.fail(f"{describe_token(tokens.current)} does not belong here", "expected `;`", code="E117")


# "LOCK" "(" lvalue { "," lvalue } ")" "DO" statement
def lock(tokens: TokenStream) -> tree.Lock:
    """Read one LOCK."""
    start = tokens.take()
    targets = parenthesised_list(tokens, variable, "the name of a variable", "after LOCK")
    head = tokens.span_since(start)
    tokens.expect("DO", "after the names", statement=True)
    return tokens.node(tree.Lock, start, head, targets, nested_statement(tokens, "DO"))


# "TRY" statements "RECOVER" [ "(" name { "," name } ")" ] statements "END"
def try_(tokens: TokenStream) -> tree.Try:
    """Read one TRY."""
    start = tokens.take()
    body = statements(tokens, "RECOVER")
    recovery: tuple[tree.Statement, ...] = ()
    kinds: tuple[tree.Name | tree.Poison, ...] = ()
    recover, end = expect_closer(tokens, "RECOVER", start), None
    if recover:
        if tokens.standard is Standard.RLO_2 and tokens.matches("("):
            kinds = _error_kinds(tokens)
        tokens.recover_depth += 1
        try:
            recovery = statements(tokens, "END")
        finally:
            tokens.recover_depth -= 1
        end = expect_closer(tokens, "END", start)
    elif tokens.matches("END") and tokens.peek().key != ".":
        tokens.take()
    gap = tokens.gap_span()
    return tree.Try(tokens.span_since(start), body, recover or gap, recovery, end or gap, kinds)


def _error_kinds(tokens: TokenStream) -> tuple[tree.Name | tree.Poison, ...]:
    """Read the kinds of errors behind RECOVER; what is none is passed over up to the end of the list."""
    kinds = tokens.attempt(lambda tokens: parenthesised_list(tokens, _error_kind, "a kind of error", "after RECOVER"))
    if kinds is None:
        tokens.skip_to(")", ";", "END")
        tokens.accept(")")
        tokens.suppress_reports()
    return kinds or ()


def _error_kind(tokens: TokenStream, wants: str, where: str) -> tree.Name | tree.Poison:
    tokens.note_expected_operand(wants, where)
    if tokens.current.kind is TokenKind.NAME:
        tokens.height = 1
        kind = tokens.take_name()
        tokens.check_name_length(kind)
        return kind
    return tokens.fail(f"expected {wants} {where or f'after `{tokens.previous.text}`'}")


# "RAISE" name [ "WITH" expr ]
def raise_(tokens: TokenStream) -> tree.Raise:
    """Read one RAISE."""
    start = tokens.current
    tokens.accept_word("RAISE")
    kind = tokens.take_name()
    tokens.check_name_length(kind)
    text = expression(tokens, "a text", "after WITH") if tokens.accept("WITH") else None
    return tokens.node(tree.Raise, start, kind, text)


# "RETRY"
def retry(tokens: TokenStream) -> tree.Retry:
    """Read one RETRY."""
    return tree.Retry(tokens.take().span)


# "SIGNAL" lvalue
def signal(tokens: TokenStream) -> tree.Signal:
    """Read one SIGNAL."""
    return tokens.node(tree.Signal, tokens.take(), variable(tokens, _EVENT, "after SIGNAL"))


# "WAIT" ( lvalue | "UNTIL" expr ) [ "WITHIN" expr [ "ELSE" statement ] ]
def wait(tokens: TokenStream) -> tree.Wait | tree.WaitUntil:
    """Read one WAIT."""
    start = tokens.take()
    if tokens.standard is Standard.RLO_2 and tokens.accept("UNTIL"):
        return _wait_until(tokens, start)
    if tokens.current.kind is TokenKind.NUMBER:
        text = tokens.current.text
        advice = f"to let {text} seconds pass, write `PAUSE {text}`"
        tokens.fail(f"expected {_EVENT} after WAIT", f"found `{text}`", advice=advice)
    if tokens.standard is Standard.RLO_2 and tokens.matches("FOR") and tokens.peek(2).key != "=":
        # As in KRL and Karel; what follows is no loop.
        advice = "for a condition write `WAIT UNTIL ...`; to let time pass, `PAUSE 2`"
        tokens.report("E111", f"expected {_EVENT} after WAIT", tokens.take().span, "found `FOR`", advice=advice)
        raise PanicModeError
    event = variable(tokens, _EVENT, "after WAIT")
    if tokens.standard is Standard.RLO_2 and tokens.current.key in _OF_CONDITIONS:
        tokens.fail(f"expected {_EVENT} after WAIT", "a condition", advice="for a condition write `WAIT UNTIL ...`")
    return tokens.node(tree.Wait, start, *_limited(tokens, start, event))


def _wait_until(tokens: TokenStream, start: Token) -> tree.WaitUntil:
    condition = head_expression(tokens, _CONDITION, "after UNTIL", "WITHIN")
    return tokens.node(tree.WaitUntil, start, *_limited(tokens, start, condition))


def _limited(
    tokens: TokenStream, start: Token, awaited: _T
) -> tuple[Span, _T, tree.Expression | None, tree.Statement | None]:
    """Read how long a wait may last, and what is done then; return it with the head and what is waited for."""
    limit = otherwise = None
    if tokens.accept_word("WITHIN"):
        limit = head_expression(tokens, "a number of seconds", "after WITHIN", "ELSE")
    head = tokens.span_since(start)
    if limit is not None and accept_else(tokens):
        otherwise = nested_statement(tokens, "ELSE")
    return head, awaited, limit, otherwise


# "PAUSE" expr
def pause(tokens: TokenStream) -> tree.Pause:
    """Read one PAUSE."""
    return tokens.node(tree.Pause, tokens.take(), expression(tokens, "a number of seconds", "after PAUSE"))


# when = "WHEN" [ name ":" ] [ "PRIORITY" number ":" ] expr "DO" statement ;
# "WHEN" name ( "ON" | "OFF" )
def when(tokens: TokenStream) -> tree.When | tree.WatchSwitch:
    """Read one WHEN, or what arms and disarms one by its name."""
    start = tokens.current
    tokens.accept_word("WHEN")
    name = priority = None
    if tokens.current.kind is TokenKind.NAME and tokens.peek().key in (":", "ON", "OFF"):
        name = tokens.take_name()
        tokens.check_name_length(name)
        if (word := tokens.accept("ON", "OFF")) is not None:
            return tokens.node(tree.WatchSwitch, start, name, word.key == "ON")
        tokens.take()
    elif tokens.is_at_end:
        tokens.note_expected_words("PRIORITY")
    if tokens.matches("PRIORITY"):
        priority = _priority_and_colon(tokens)
    condition = head_expression(tokens, _CONDITION, "after WHEN", "DO")
    head = tokens.span_since(start)
    tokens.expect("DO", "after the condition", statement=True)
    return tokens.node(tree.When, start, head, name, priority, condition, nested_statement(tokens, "DO"))


# "BRAKE"
def brake(tokens: TokenStream) -> tree.Brake:
    """Read one BRAKE."""
    start = tokens.current
    tokens.accept_word("BRAKE")
    return tree.Brake(start.span)


# "RESUME"
def resume(tokens: TokenStream) -> tree.Resume:
    """Read one RESUME."""
    start = tokens.current
    tokens.accept_word("RESUME")
    return tree.Resume(start.span)


# "HALT"
def halt(tokens: TokenStream) -> tree.Halt:
    """Read one HALT."""
    return tree.Halt(tokens.take().span)


# "RETURN" expr
def return_(tokens: TokenStream) -> tree.Return:
    """Read one RETURN."""
    start = tokens.current
    tokens.accept_word("RETURN")
    return tokens.node(tree.Return, start, expression(tokens, "a value", "after RETURN"))


# name "(" [ expr { "," expr } ] ")"
def call(tokens: TokenStream) -> tree.Call:
    """Read the call of a procedure."""
    name = tokens.take_name()
    arguments = expression_list(tokens, "a value", f"after {name.text}", empty=True)
    return tokens.node(tree.Call, name.span, name, arguments)
