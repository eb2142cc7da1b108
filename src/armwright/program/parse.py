"""The parser: one function for each rule of the grammar, with the rule above it. It never stops at the first error.

What is missing and obvious is put in, what is misspelt is replaced, and what makes no sense is passed over up to the
next statement; each is reported once.
"""

# ruff: noqa: ERA001 - each rule of the grammar stands above its function

from collections.abc import Callable, Sequence

from armwright.errors import closest
from armwright.program import beyond, tree
from armwright.program.clauses import move
from armwright.program.cursor import LostError, Tokens, shown
from armwright.program.declarations import head, var_part
from armwright.program.diagnostics import Diagnostic, Fix, Label
from armwright.program.source import Source, Span
from armwright.program.tokens import Token, TokenKind
from armwright.program.values import check_length, init, operand, parenthesised
from armwright.program.words import SENSORS, STATEMENTS

_FRAME = "the name of a FRAME"
_ARM = "an arm such as ARM_1"


def parse(source: Source, tokens: Sequence[Token]) -> tuple[tree.Program, list[Diagnostic]]:
    """Return the syntax tree of a program and what is wrong with its syntax.

    Args:
        source: the text, for messages.
        tokens: of the text, the last being its end.
    """
    cursor = Tokens(source, tokens)
    return program(cursor), cursor.found


# program = { var_part } block "." ;
# block   = "BEGIN" statements "END" ;
def program(tokens: Tokens) -> tree.Program:
    """Read a whole program."""
    start = tokens.now
    declarations = head(tokens)
    found: list[tree.Statement] = []
    if not tokens.done:
        _statements(tokens, found, declarations)
        while not tokens.done and not _ends(tokens):
            _statements(tokens, found, declarations)
    elif not tokens.now.damaged:
        at = tokens.gap() if declarations else Span(0, 0)
        text = "the program has no statements" if declarations else "there is no program here"
        tokens.found.say("E115", text, at, "expected `BEGIN ... END.`")
    return tree.Program(tokens.since(start), tuple(declarations), tuple(found), tokens.before.span)


def _ends(tokens: Tokens) -> bool:
    """Read END and the point behind it; whether the program is over."""
    end = tokens.take()
    gap = tokens.gap()
    if tokens.accept("."):
        if not tokens.done:
            last = tokens.now
            tokens.found.say("E114", "text after the end of the program", last.span, "the program ended with `END.`")
            while not tokens.done:
                tokens.take()
            return True
    elif tokens.done or (tokens.sees(";") and tokens.ahead().kind is TokenKind.END):
        if not tokens.now.damaged:
            semicolon = tokens.accept(";")
            tokens.found.say(
                "E110",
                "the program does not end with `.`",
                gap,
                "expected `.` here",
                notes=("the last END of an RLO program is written `END.`",),
                fixes=(Fix(gap.to(semicolon.span) if semicolon else gap, "."),),
            )
    else:
        tokens.found.say("E114", "END closes the program, but more follows", end.span, "the program would end here")
        return False
    return True


# statements = [ statement ] { ";" [ statement ] } ;
def _statements(tokens: Tokens, found: list[tree.Statement], declarations: list[tree.Declaration]) -> None:
    """Read statements up to END, which stays."""
    while True:
        while tokens.accept(";"):
            pass
        if tokens.done:
            _no_end(tokens)
            return
        if _at_end(tokens):
            return
        at = tokens.at
        try:
            if tokens.sees("VAR"):
                _late_declarations(tokens, declarations)
                continue
            found.append(statement(tokens))
            _separator(tokens)
        except LostError:
            _next_statement(tokens)
        if tokens.at == at:
            tokens.take()


def _no_end(tokens: Tokens) -> None:
    if not tokens.now.damaged:
        tokens.found.say("E115", "the program has no END", tokens.gap(), "expected `END.` here")


def _at_end(tokens: Tokens) -> bool:
    """Whether END stands here, also misspelt."""
    if tokens.sees("END"):
        return True
    token = tokens.now
    if token.kind is TokenKind.NAME and tokens.ahead().key == "." and closest(token.text, ["END"]):
        _misspelt(tokens, "END")
        return True
    return False


def _late_declarations(tokens: Tokens, declarations: list[tree.Declaration]) -> None:
    word = tokens.now
    tokens.found.say("E118", "VAR stands behind BEGIN", word.span, "declarations belong in front of BEGIN")
    declarations += var_part(tokens)


# statement = init | affix | unfix | open | grasp | operate | read | move ;
def statement(tokens: Tokens) -> tree.Statement:
    """Read one statement.

    Raises:
        LostError: there is none.
    """
    token, after = tokens.now, tokens.ahead()
    if token.kind is TokenKind.KEYWORD and token.key in _RULES:
        return _RULES[token.key](tokens)
    if token.kind in (TokenKind.NAME, TokenKind.ARM) and after.key in ("=", ":="):
        return init(tokens)
    if token.kind is TokenKind.NAME and (after.kind is TokenKind.NUMBER or after.key in ("(", "-")):
        number = tokens.ahead(2) if after.key in ("(", "-") else after
        if number.kind is TokenKind.NUMBER or number.key == "-":
            return init(tokens)
    if beyond.starts_statement(tokens):
        return beyond.statement(tokens)
    if token.kind is TokenKind.NAME and (near := closest(token.text, STATEMENTS)):
        _misspelt(tokens, near)
        return _RULES[near](tokens)
    return _no_statement(tokens)


def _misspelt(tokens: Tokens, near: str) -> None:
    token = tokens.now
    tokens.found.say(
        "E105",
        f"unknown statement `{token.text}`",
        token.span,
        "not a statement",
        helps=(f"did you mean `{near}`?",),
    )


def _no_statement(tokens: Tokens) -> tree.Statement:
    """Say that no statement starts here."""
    token = tokens.now
    if token.damaged:
        raise LostError
    if token.kind is TokenKind.NAME:
        text, label = f"unknown statement `{token.text}`", "not a statement"
    else:
        text, label = f"{shown(token)} does not start a statement", "expected a statement"
    helps = (f"statements begin with {', '.join(STATEMENTS)}, or with a name and `=`",)
    notes = ("line numbers count only in a text whose first line has one",) if token.kind is TokenKind.NUMBER else ()
    tokens.found.say("E105", text, token.span, label, helps=helps, notes=notes)
    raise LostError


def _separator(tokens: Tokens) -> None:
    """Read ``;``; put it in where the next statement begins without one."""
    if tokens.accept(";") or tokens.done or _at_end(tokens):
        return
    token = tokens.now
    if _starts_statement(tokens):
        gap = tokens.gap()
        tokens.found.say(
            "E104",
            "missing `;` between two statements",
            gap,
            "expected `;` here",
            secondary=(Label(token.span, "a new statement starts here"),),
            fixes=(Fix(gap, ";"),),
        )
        return
    if token.damaged:
        raise LostError
    tokens.lost(f"{shown(token)} does not belong here", "expected `;`", code="E117")


def _starts_statement(tokens: Tokens) -> bool:
    token, after = tokens.now, tokens.ahead()
    if token.kind is TokenKind.KEYWORD:
        return token.key in (*STATEMENTS, "BEGIN", "VAR")
    if token.kind not in (TokenKind.NAME, TokenKind.ARM):
        return False
    if after.key in ("=", ":=") or beyond.starts_statement(tokens) or not tokens.same_line():
        return True
    return token.kind is TokenKind.NAME and closest(token.text, STATEMENTS) is not None


def _next_statement(tokens: Tokens) -> None:
    """Pass over tokens up to the next ``;``, END or statement of the same depth."""
    depth = 0
    while not tokens.done:
        if tokens.sees("END") and (depth == 0 or tokens.ahead().key == "."):
            return
        if depth == 0 and tokens.sees(";", "BEGIN", "VAR", *STATEMENTS):
            return
        depth += tokens.sees("BEGIN") - tokens.sees("END")
        tokens.take()


# affix = "AFFIX" name "TO" mobile [ "AT" name ] ;
def _affix(tokens: Tokens) -> tree.Affix:
    start = tokens.take()
    child = operand(tokens, _FRAME, "after AFFIX")
    tokens.expect("TO", "after the frame that follows")
    parent = operand(tokens, "the name of a FRAME or an arm", "after TO")
    link = tokens.since(start)
    at = operand(tokens, "the name of a TRANS", "after AT") if tokens.accept("AT") else None
    beyond.trailing(
        tokens, "AFFIX ...", "in RLO-83 a frame follows its parent, never the other way", "RIGIDLY", "NONRIGIDLY"
    )
    return tree.Affix(tokens.since(start), link, child, parent, at)


# unfix = "UNFIX" name "FROM" mobile ;
def _unfix(tokens: Tokens) -> tree.Unfix:
    start = tokens.take()
    child = operand(tokens, _FRAME, "after UNFIX")
    if tokens.sees(";", "END") or tokens.done:
        beyond.report(tokens, "UNFIX without FROM", tokens.gap(), "RLO-83 names the frame it hangs on: `FROM ...`")
        return tree.Unfix(tokens.since(start), child, None)
    tokens.expect("FROM", "after the frame to cut")
    parent = operand(tokens, "the name of a FRAME or an arm", "after FROM")
    return tree.Unfix(tokens.since(start), child, parent)


# open = "OPEN" arm ;
def _open(tokens: Tokens) -> tree.Open:
    start = tokens.take()
    arm = operand(tokens, _ARM, "after OPEN")
    if (word := tokens.accept("TO")) is not None:
        beyond.report(tokens, "OPEN ... TO", word.span, "RLO-83 opens the fingers wholly")
        _pass_expression(tokens)
    return tree.Open(tokens.since(start), arm)


def _pass_expression(tokens: Tokens) -> None:
    found = len(tokens.found)
    beyond.expression(tokens, "")
    del tokens.found[found:]


# grasp = "GRASP" [ arm ] ;
def _grasp(tokens: Tokens) -> tree.Grasp:
    start = tokens.take()
    arm = None
    if tokens.now.kind in (TokenKind.NAME, TokenKind.ARM) and tokens.same_line() and not _assigns(tokens):
        arm = operand(tokens, _ARM, "after GRASP")
    return tree.Grasp(tokens.since(start), arm)


def _assigns(tokens: Tokens) -> bool:
    return tokens.ahead().key in ("=", ":=") or beyond.starts_statement(tokens)


# operate = "OPERATE" name ;
def _operate(tokens: Tokens) -> tree.Operate:
    start = tokens.take()
    device = operand(tokens, "the name of a device", "after OPERATE")
    if isinstance(device, tree.Name):
        check_length(tokens, device)
    beyond.trailing(tokens, "OPERATE ...", "RLO-83 only starts a device; it stops at the end", "ON", "OFF")
    return tree.Operate(tokens.since(start), device)


# read = "READ" "VISIONS" "(" name ")" | "READ" "SYSTEM" "(" arm ")" ;
def _read(tokens: Tokens) -> tree.ReadVisions | tree.ReadSystem:
    start = tokens.take()
    word = tokens.now
    sensor = word.key if tokens.sees_word(*SENSORS) else None
    if sensor is None and word.kind is TokenKind.NAME:
        sensor = closest(word.text, SENSORS)
        if sensor:
            tokens.found.say(
                "E105",
                f"unknown statement `READ {word.text}`",
                word.span,
                "expected VISIONS or SYSTEM",
                helps=(f"did you mean `{sensor}`?",),
            )
    if sensor is None:
        tokens.lost("READ does not say what to read", "expected VISIONS or SYSTEM")
    tokens.take()
    if sensor == "VISIONS":
        targets = parenthesised(tokens, _FRAME, "after VISIONS")
        if len(targets) > 1:
            rest = Span(targets[1].span.start, targets[-1].span.end)
            beyond.report(tokens, "reading several frames at once", rest, "RLO-83 reads one frame at a time")
            names = frozenset(target.key for target in targets if not isinstance(target, tree.Poison))
            return tree.ReadVisions(tokens.since(start), tree.Poison(rest, names))
        return tree.ReadVisions(tokens.since(start), targets[0])
    arms = parenthesised(tokens, _ARM, "after SYSTEM")
    if len(arms) > 1:
        tokens.found.say("E117", "READ SYSTEM reads one arm", arms[1].span, "does not belong here")
    return tree.ReadSystem(tokens.since(start), arms[0])


_RULES: dict[str, Callable[[Tokens], tree.Statement]] = {
    "AFFIX": _affix,
    "UNFIX": _unfix,
    "OPEN": _open,
    "GRASP": _grasp,
    "OPERATE": _operate,
    "READ": _read,
    "MOVE": move,
}
