"""Parsing statements about hands, devices and sensors: OPEN, GRASP, OPERATE and READ."""

from armwright.errors import closest
from armwright.program.language.source import Span
from armwright.program.language.words import SENSORS
from armwright.program.syntax import rlo83, tree
from armwright.program.syntax.expressions import expression, listed
from armwright.program.syntax.expressions import mobile as element
from armwright.program.syntax.lexer import TokenKind
from armwright.program.syntax.operands import check_length, mobile, operand, parenthesised
from armwright.program.syntax.token_stream import Tokens

_FRAME = "the name of a FRAME"
_ARM = "an arm such as ARM_1"


# open = "OPEN" arm [ "TO" expr ] ;
def open_hand(tokens: Tokens) -> tree.Open:
    """Read one OPEN."""
    start = tokens.take()
    arm = mobile(tokens, _ARM, "after OPEN")
    word = tokens.accept("TO")
    width = None
    if word is not None and tokens.later:
        width = expression(tokens, "a width", "after TO")
    elif word is not None:
        rlo83.report(tokens, "OPEN ... TO", word.span, "RLO-83 opens the fingers wholly")
        found = len(tokens.found)
        rlo83.expression(tokens, "")
        del tokens.found[found:]
    return tree.Open(tokens.since(start), arm, width)


# grasp = "GRASP" ;                                                                              (* RLO-83 *)
# grasp = "GRASP" [ arm ] ;                                                                      (* RLO-2 *)
def grasp(tokens: Tokens) -> tree.Grasp:
    """Read one GRASP."""
    start = tokens.take()
    kind = tokens.now.kind
    arm = None
    if kind is TokenKind.ARM or kind is TokenKind.NAME:
        near = tokens.same_line() or (tokens.later and kind is TokenKind.ARM)
        if near and not _starts_another(tokens):
            arm = mobile(tokens, _ARM, "after GRASP")
            if not tokens.later:
                rlo83.report(tokens, "GRASP with an arm", arm.span, "RLO-83 closes the hand of the arm named last")
    return tree.Grasp(tokens.since(start), arm)


def _starts_another(tokens: Tokens) -> bool:
    after = tokens.ahead().key
    if after in ("=", ":="):
        return True
    if not tokens.later:
        return rlo83.starts_statement(tokens)
    return after in ("(", "[") or closest(tokens.now.text, ("ELSE", *tokens.waiting[-1])) is not None


# operate = "OPERATE" name [ "ON" | "OFF" ] ;
def operate(tokens: Tokens) -> tree.Operate:
    """Read one OPERATE."""
    start = tokens.take()
    wants, where = "the name of a device", "after OPERATE"
    device = mobile(tokens, wants, where) if tokens.later else operand(tokens, wants, where)
    if isinstance(device, tree.Name):
        check_length(tokens, device)
    word = tokens.accept("ON", "OFF")
    if not tokens.later:
        rlo83.trailing(tokens, "OPERATE ...", "RLO-83 only starts a device; it stops at the end", "ON", "OFF")
    return tree.Operate(tokens.since(start), device, word is None or word.key == "ON")


# read = "READ" "VISIONS" "(" lvalue { "," lvalue } ")" | "READ" "SYSTEM" "(" arm ")" ;
def read(tokens: Tokens) -> tree.ReadVisions | tree.ReadSystem:
    """Read one READ."""
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
        targets = _seen(tokens)
        return tree.ReadVisions(tokens.since(start), targets)
    arms = _operands(tokens, _ARM, "after SYSTEM")
    if len(arms) > 1:
        tokens.found.say("E117", "READ SYSTEM reads one arm", arms[1].span, "does not belong here")
    return tree.ReadSystem(tokens.since(start), arms[0] if arms else tree.Poison(tokens.gap()))


def _seen(tokens: Tokens) -> tuple[tree.Mobile, ...]:
    targets = _operands(tokens, _FRAME, "after VISIONS")
    if len(targets) > 1 and not tokens.later:
        rest = Span(targets[1].span.start, targets[-1].span.end)
        rlo83.report(tokens, "reading several frames at once", rest, "RLO-83 reads one frame at a time")
        names = (target.key for target in targets if isinstance(target, tree.Name | tree.ArmName))
        return (tree.Poison(rest, frozenset(names)),)
    return targets


def _operands(tokens: Tokens, wants: str, where: str) -> tuple[tree.Mobile, ...]:
    return listed(tokens, element, wants, where) if tokens.later else parenthesised(tokens, wants, where)
