"""Parsing what decides what is done next: blocks, choices, loops, calls, branches side by side, events, recovery."""

from armwright.errors import closest
from armwright.program.language.diagnostic import Fix
from armwright.program.language.source import Span
from armwright.program.syntax import tree
from armwright.program.syntax.expressions import expression, listed, mobile, number, reserved_as_name, values, variable
from armwright.program.syntax.frames import equals
from armwright.program.syntax.lexer import Token, TokenKind
from armwright.program.syntax.statement_list import (
    ASSIGNING,
    close,
    misspelt,
    nested,
    next_statement,
    salvaged,
    statements,
)
from armwright.program.syntax.token_stream import LostError, Tokens, TooDeepError, shown

_CONDITION = "a condition"
_EVENT = "the name of an EVENT"
_OPERANDS = (TokenKind.NAME, TokenKind.NUMBER, TokenKind.ARM)
_DOWNWARDS = "DOWNTO"
_ELSE_IF = ("ELSEIF", "ELSIF", "ELIF")


# block = "BEGIN" statements "END" ;
def block(tokens: Tokens) -> tree.Block:
    """Read a block; where its END is missing, say so. BEGIN has been looked for, and may be missing too."""
    start = tokens.now
    tokens.accept("BEGIN")
    body = statements(tokens, "END")
    end = close(tokens, "END", start)
    return tree.Block(tokens.since(start), body, end or tokens.gap())


def part(tokens: Tokens, wants: str, where: str, *ends: str) -> tree.Expression:
    """Read an expression in the head of a statement; pass over one that makes no sense.

    Args:
        tokens: at the expression.
        wants: what is expected, in words.
        where: the pose in words.
        ends: the words that may stand behind it.

    Raises:
        LostError: the statement ends there.
    """
    start, depth = tokens.now, tokens.depth
    try:
        body = expression(tokens, wants, where)
        if wants == _CONDITION:
            tokens.offer("AND", "OR")
        while wants == _CONDITION and _misspelt_joint(tokens):
            sign = tokens.take()
            right = expression(tokens, wants, "")
            body = tree.Binary(tokens.since(start), sign.key, body, right)
    except TooDeepError:
        raise
    except LostError:
        tokens.depth = depth
        return _passed_over(tokens, start, ends)
    if tokens.now.kind in _OPERANDS and _comes_soon(tokens, ends) and not closest(tokens.now.text, (*ends, _DOWNWARDS)):
        tokens.say_once("E117", f"{shown(tokens.now)} does not belong here", tokens.now.span, f"expected `{ends[0]}`")
        _passed_over(tokens, start, ends)
    return body


def _comes_soon(tokens: Tokens, ends: tuple[str, ...]) -> bool:
    """Whether one of these words stands near, before anything that starts or ends a statement."""
    stops = (";", *tokens.words.closing, *tokens.words.statements)
    for steps in range(1, 8):
        key = tokens.ahead(steps).key
        if key in ends:
            return True
        if key in stops:
            return False
    return False


def _misspelt_joint(tokens: Tokens) -> bool:
    """Whether AND or OR stands here misspelt; it is replaced."""
    if tokens.now.kind is not TokenKind.NAME or tokens.ahead().key == "=":
        return False
    near = closest(tokens.now.text, ("AND", "OR"))
    if near:
        misspelt(tokens, near)
    return near is not None


def _passed_over(tokens: Tokens, start: Token, ends: tuple[str, ...]) -> tree.Poison:
    """Pass over the rest of the head of a statement; the next word of it may be missing without a further message."""
    names = set()
    stops = (";", *tokens.words.closing, *tokens.words.statements)
    while not tokens.sees(*ends):
        if tokens.done or tokens.sees(";", *tokens.words.closing):
            raise LostError
        if tokens.sees(*stops):
            break
        if tokens.now.kind in (TokenKind.NAME, TokenKind.ARM):
            names.add(tokens.now.key)
        tokens.take()
    tokens.hush()
    return tree.Poison(tokens.since(start), frozenset(names))


# "IF" expr "THEN" statement [ "ELSE" statement ]
def if_(tokens: Tokens) -> tree.If:
    """Read one IF, and all that follow it with ELSE IF: they make a chain, which is long and not deep."""
    chain = [_choice(tokens)]
    otherwise: tree.Statement | None = None
    while _else(tokens):
        start = tokens.now
        if not tokens.sees("IF") or tokens.ahead().key in ASSIGNING:
            otherwise = nested(tokens, "ELSE")
            break
        link = salvaged(tokens, _choice)
        if link is None:
            otherwise = tree.Poison(tokens.since(start))
            break
        chain.append(link)
    for start, head, condition, then in reversed(chain):
        otherwise = tree.If(tokens.since(start), head, condition, then, otherwise)
    assert isinstance(otherwise, tree.If)  # noqa: S101 - the chain has one link or more
    return otherwise


def _choice(tokens: Tokens) -> tuple[Token, Span, tree.Expression, tree.Statement]:
    """Read an IF up to its ELSE: where it starts, its head, its condition, and what is done where that holds."""
    start = tokens.take()
    condition = part(tokens, _CONDITION, "after IF", "THEN")
    head = tokens.since(start)
    tokens.expect("THEN", "after the condition", statement=True)
    tokens.waiting.append(("ELSE",))
    then = nested(tokens, "THEN")
    tokens.waiting.pop()
    return start, head, condition, then


def _else(tokens: Tokens) -> bool:
    """Read ELSE, also behind a needless ``;``."""
    if tokens.accept("ELSE"):
        return True
    token, after = tokens.now, tokens.ahead()
    if token.key == ";" and after.key == "ELSE":
        tokens.say_once(
            "E124", "no `;` is allowed before ELSE", token.span, "leave it out", fixes=(Fix(token.span, ""),)
        )
        tokens.take()
        tokens.take()
        return True
    if token.kind is not TokenKind.NAME or after.key in ("=", ":=", "(", "["):
        return False
    if token.key in _ELSE_IF:
        text = f"unknown statement `{token.text}`"
        tokens.report(
            "E105", text, token.span, "not a statement", advice="write `ELSE IF`", fixes=(Fix(token.span, "ELSE IF"),)
        )
        tokens.replace("IF")
        return True
    if closest(token.text, ("ELSE", *tokens.words.statements)) == "ELSE":
        misspelt(tokens, "ELSE")
        tokens.take()
        return True
    return False


# "WHILE" expr "DO" statement
def while_(tokens: Tokens) -> tree.While:
    """Read one WHILE."""
    start = tokens.take()
    condition = part(tokens, _CONDITION, "after WHILE", "DO")
    head = tokens.since(start)
    tokens.expect("DO", "after the condition", statement=True)
    body = nested(tokens, "DO")
    return tree.While(tokens.since(start), head, condition, body)


# "REPEAT" statements "UNTIL" expr
def repeat(tokens: Tokens) -> tree.Repeat:
    """Read one REPEAT."""
    start = tokens.take()
    body = statements(tokens, "UNTIL")
    tail = tokens.now
    if close(tokens, "UNTIL", start):
        condition = part(tokens, _CONDITION, "after UNTIL")
        return tree.Repeat(tokens.since(start), body, tokens.since(tail), condition)
    gap = tokens.gap()
    return tree.Repeat(tokens.since(start), body, gap, tree.Poison(gap))


# "FOR" name "=" expr "TO" expr [ "STEP" expr ] "DO" statement
def for_(tokens: Tokens) -> tree.For:
    """Read one FOR."""
    start = tokens.take()
    counter = _counter(tokens)
    equals(tokens, "the variable of FOR", tokens.before.text)
    first = part(tokens, "a number", "after `=`", "TO", "STEP", "DO")
    if tokens.sees_word(_DOWNWARDS) or tokens.sees(",", ":"):
        advice = "write `TO ... STEP -1`" if tokens.sees_word(_DOWNWARDS) else "write `TO`"
        tokens.say_once("E112", "FOR counts with TO and STEP", tokens.now.span, "expected `TO`", advice=advice)
        tokens.replace("TO")
    tokens.expect("TO", "after the first number")
    last = part(tokens, "a number", "after TO", "STEP", "DO")
    step = part(tokens, "a number", "after STEP", "DO") if tokens.accept("STEP") else None
    head = tokens.since(start)
    tokens.expect("DO", "after the last number", statement=True)
    body = nested(tokens, "DO")
    return tree.For(tokens.since(start), head, counter, first, last, step, body)


def _counter(tokens: Tokens) -> tree.Name | tree.Poison:
    """Read the variable of FOR."""
    token = tokens.now
    tokens.want("the name of a SCALAR", "after FOR")
    if token.kind is TokenKind.NAME and tokens.ahead().key != "[":
        return tokens.take_name()
    if token.kind in (TokenKind.NAME, TokenKind.ARM):
        body = mobile(tokens, "a name", "after FOR")
        text = "FOR counts with a variable of its own" if token.kind is TokenKind.NAME else "FOR counts with a SCALAR"
        tokens.report("E111", text, body.span, "expected the name of a SCALAR")
        return tree.Poison(body.span, frozenset((token.key,)))
    if reserved_as_name(tokens):
        tokens.refuse_reserved()
        tokens.take()
        return tree.Poison(token.span, frozenset((token.key,)))
    return tokens.lost("expected the name of a SCALAR after FOR", f"found {shown(token)}")


# "COBEGIN" branch { ";" branch } [";"] "COEND"
def cobegin(tokens: Tokens) -> tree.Cobegin:
    """Read one COBEGIN."""
    start = tokens.take()
    body: list[tree.Branch] = []
    depth, level = tokens.depth, len(tokens.waiting)
    tokens.waiting.append(("COEND", "PRIORITY"))
    tokens.offer("BEGIN", "PRIORITY", "COEND", starts=True)
    while not (tokens.done or tokens.sees("COEND", "UNTIL", "RECOVER")):
        index = tokens.at
        if tokens.sees("END") and not _needless_end(tokens):
            break
        try:
            body.append(_branch(tokens))
            _between(tokens)
            if tokens.before.key == ";":
                tokens.offer("BEGIN", "PRIORITY", "COEND", starts=True)
        except TooDeepError:
            raise
        except LostError:
            del tokens.waiting[level + 1 :]
            tokens.depth = depth
            next_statement(tokens)
            tokens.accept(";")
            tokens.hush()
        if tokens.at == index:
            tokens.take()
    tokens.waiting.pop()
    if not body and tokens.sees("COEND"):
        tokens.say_once("E126", "COBEGIN has no branches", tokens.now.span, "expected `BEGIN ... END`")
    end = close(tokens, "COEND", start)
    return tree.Cobegin(tokens.since(start), tuple(body), end or tokens.gap())


# branch = [ "PRIORITY" number ":" ] block ;
def _branch(tokens: Tokens) -> tree.Branch:
    start = tokens.now
    priority = None
    if tokens.accept("PRIORITY"):
        if tokens.now.kind is not TokenKind.NUMBER:
            tokens.say_once(
                "E111", "expected a number after PRIORITY", tokens.now.span, "a number without a sign, such as `2`"
            )
        priority = _priority(tokens)
        head = tokens.since(start)
        tokens.expect(":", "after the priority", statement=True)
    else:
        head = start.span
    tokens.offer("BEGIN", starts=True)
    body = block(tokens) if tokens.sees("BEGIN") else _bare(tokens)
    return tree.Branch(tokens.since(start), head, priority, body)


def _priority(tokens: Tokens) -> tree.Number | None:
    """Read what stands for a priority."""
    if tokens.now.kind is TokenKind.NUMBER or tokens.ahead().kind is TokenKind.NUMBER:
        return number(tokens) if tokens.now.kind is TokenKind.NUMBER or tokens.sees("-", "+") else None
    if tokens.now.kind is TokenKind.NAME:
        tokens.take()
    return None


def _bare(tokens: Tokens) -> tree.Block:
    """Read a statement that stands for a branch of COBEGIN."""
    token = tokens.now
    if token.key == ";":
        tokens.lost("a `;` is allowed only between two branches", "expected `BEGIN`", code="E126")
    advice = "write `BEGIN ... END` around the statements of each branch"
    tokens.say_once("E126", "a branch of COBEGIN is a block", token.span, "expected `BEGIN` before this", advice=advice)
    body = statements(tokens, "END")
    if tokens.sees("END") and tokens.ahead().key != ".":
        tokens.take()
    else:
        tokens.hush()
    return tree.Block(tokens.since(token), body, tokens.gap())


def _needless_end(tokens: Tokens) -> bool:
    """Pass over an END between branches that closes nothing; whether it was one."""
    token, after = tokens.now, tokens.ahead()
    if after.key == ";":
        after = tokens.ahead(2)
    if after.key not in ("BEGIN", "COEND", "PRIORITY"):
        return False
    tokens.say_once("E127", "`END` without BEGIN", token.span, "no BEGIN is open in this COBEGIN")
    tokens.take()
    tokens.accept(";")
    tokens.hush()
    return True


def _between(tokens: Tokens) -> None:
    """Read the ``;`` between two branches."""
    if tokens.accept(";") or tokens.done or tokens.sees("COEND", "END", "UNTIL", "RECOVER"):
        return
    if tokens.sees("PRIORITY") and tokens.silent:
        return
    gap = tokens.gap()
    if tokens.sees("BEGIN", "PRIORITY"):
        text, fix = "missing `;` between two branches", Fix(gap, ";")
        tokens.say_once("E104", text, gap, "expected `;` here", fixes=(fix,))
        return
    tokens.lost(f"{shown(tokens.now)} does not belong here", "expected `;`", code="E117")


# "LOCK" "(" lvalue { "," lvalue } ")" "DO" statement
def lock(tokens: Tokens) -> tree.Lock:
    """Read one LOCK."""
    start = tokens.take()
    targets = listed(tokens, variable, "the name of a variable", "after LOCK")
    head = tokens.since(start)
    tokens.expect("DO", "after the names", statement=True)
    body = nested(tokens, "DO")
    return tree.Lock(tokens.since(start), head, targets, body)


# "TRY" statements "RECOVER" statements "END"
def try_(tokens: Tokens) -> tree.Try:
    """Read one TRY."""
    start = tokens.take()
    body = statements(tokens, "RECOVER")
    recovery: tuple[tree.Statement, ...] = ()
    recover, end = close(tokens, "RECOVER", start), None
    if recover:
        tokens.recovering += 1
        try:
            recovery = statements(tokens, "END")
        finally:
            tokens.recovering -= 1
        end = close(tokens, "END", start)
    elif tokens.sees("END") and tokens.ahead().key != ".":
        tokens.take()
    gap = tokens.gap()
    return tree.Try(tokens.since(start), body, recover or gap, recovery, end or gap)


# "RETRY"
def retry(tokens: Tokens) -> tree.Retry:
    """Read one RETRY."""
    return tree.Retry(tokens.take().span)


# "SIGNAL" lvalue
def signal(tokens: Tokens) -> tree.Signal:
    """Read one SIGNAL."""
    start = tokens.take()
    event = variable(tokens, _EVENT, "after SIGNAL")
    return tree.Signal(tokens.since(start), event)


# "WAIT" lvalue
def wait(tokens: Tokens) -> tree.Wait:
    """Read one WAIT."""
    start = tokens.take()
    if tokens.now.kind is TokenKind.NUMBER:
        text = tokens.now.text
        advice = f"to let {text} seconds pass, write `PAUSE {text}`"
        tokens.lost(f"expected {_EVENT} after WAIT", f"found `{text}`", advice=advice)
    event = variable(tokens, _EVENT, "after WAIT")
    return tree.Wait(tokens.since(start), event)


# "PAUSE" expr
def pause(tokens: Tokens) -> tree.Pause:
    """Read one PAUSE."""
    start = tokens.take()
    duration = expression(tokens, "a number of seconds", "after PAUSE")
    return tree.Pause(tokens.since(start), duration)


# "HALT"
def halt(tokens: Tokens) -> tree.Halt:
    """Read one HALT."""
    return tree.Halt(tokens.take().span)


# name "(" [ expr { "," expr } ] ")"
def call(tokens: Tokens) -> tree.Call:
    """Read the call of a procedure."""
    name = tokens.take_name()
    arguments = values(tokens, "a value", f"after {name.text}", empty=True)
    return tree.Call(tokens.since(name.span), name, arguments)
