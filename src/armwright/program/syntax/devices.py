"""Parsing statements about hands, devices and sensors: OPEN, GRASP, OPERATE, READ and ZERO FORCE."""

# ruff: noqa: ERA001 - each rule of the grammar stands above its function

from armwright.errors import closest
from armwright.program.language.diagnostic import did_you_mean
from armwright.program.language.words import SENSORS
from armwright.program.syntax import tree
from armwright.program.syntax.expressions import expression, mobile, parenthesised_list
from armwright.program.syntax.lexer import TokenKind
from armwright.program.syntax.token_stream import TokenStream

_FRAME = "the name of a FRAME"
_ARM = "an arm such as ARM_1"


# open = "OPEN" arm [ "TO" expr ] ;
def open_(tokens: TokenStream) -> tree.Open:
    """Read one OPEN."""
    start = tokens.take()
    arm = mobile(tokens, _ARM, "after OPEN")
    width = expression(tokens, "a width", "after TO") if tokens.accept("TO") else None
    return tokens.node(tree.Open, start, arm, width)


# grasp = "GRASP" [ arm ] ;
def grasp(tokens: TokenStream) -> tree.Grasp:
    """Read one GRASP."""
    start = tokens.take()
    kind = tokens.current.kind
    tokens.note_expected_operand(_ARM, "after GRASP")
    arm = None
    near = kind is TokenKind.ARM or (kind is TokenKind.NAME and tokens.is_on_same_line())
    if near and not _starts_other_statement(tokens):
        arm = mobile(tokens, _ARM, "after GRASP")
    return tokens.node(tree.Grasp, start, arm)


def _starts_other_statement(tokens: TokenStream) -> bool:
    if tokens.peek().key in ("=", ":=", "(", "["):
        return True
    return closest(tokens.current.text, ("ELSE", *tokens.open_closers[-1])) is not None


# operate = "OPERATE" name [ "ON" | "OFF" | "TO" expr ] ;
def operate(tokens: TokenStream) -> tree.Operate:
    """Read one OPERATE."""
    start = tokens.take()
    device = mobile(tokens, "the name of a device", "after OPERATE")
    if isinstance(device, tree.Name):
        tokens.check_name_length(device)
    if tokens.accept("TO"):
        return tokens.node(tree.Operate, start, device, True, expression(tokens, "a number", "after TO"))
    word = tokens.accept("ON", "OFF")
    return tokens.node(tree.Operate, start, device, word is None or word.key == "ON")


# pulse = "PULSE" name "FOR" expr ;
def pulse(tokens: TokenStream) -> tree.Pulse:
    """Read one PULSE."""
    start = tokens.current
    tokens.accept_word("PULSE")
    device = mobile(tokens, "the name of a device", "after PULSE")
    tokens.expect("FOR", "after the device")
    return tokens.node(tree.Pulse, start, device, expression(tokens, "a number of seconds", "after FOR"))


# timer = "TIMER" name ( "ON" | "OFF" | "TO" expr ) ;
def timer(tokens: TokenStream) -> tree.SetTimer:
    """Read one TIMER."""
    start = tokens.current
    tokens.accept_word("TIMER")
    name = tokens.take_name()
    tokens.check_name_length(name)
    if tokens.accept("TO"):
        return tokens.node(tree.SetTimer, start, name, True, expression(tokens, "a number of seconds", "after TO"))
    word = tokens.accept("ON", "OFF")
    if word is None:
        tokens.fail("expected ON, OFF or TO after the name of a timer")
    return tokens.node(tree.SetTimer, start, name, word.key == "ON")


# read = "READ" "VISIONS" "(" lvalue { "," lvalue } ")" | "READ" "SYSTEM" "(" arm ")" ;
def read(tokens: TokenStream) -> tree.ReadVisions | tree.ReadSystem:
    """Read one READ."""
    start = tokens.take()
    word = tokens.current
    tokens.note_expected_operand("a sensor", "after READ")
    sensor = word.key if tokens.matches_name(*SENSORS) else None
    if sensor is None and word.kind is TokenKind.NAME:
        sensor = closest(word.text, SENSORS)
        if sensor:
            text = f"unknown statement `READ {word.text}`"
            tokens.report("E105", text, word.span, "expected VISIONS or SYSTEM", advice=did_you_mean(sensor))
    if sensor is None:
        tokens.fail("READ does not say what to read", "expected VISIONS or SYSTEM")
    tokens.take()
    if sensor == "VISIONS":
        return tokens.node(tree.ReadVisions, start, parenthesised_list(tokens, mobile, _FRAME, "after VISIONS"))
    arms = parenthesised_list(tokens, mobile, _ARM, "after SYSTEM")
    if len(arms) > 1:
        tokens.report("E117", "READ SYSTEM reads one arm", arms[1].span, "does not belong here")
    return tokens.node(tree.ReadSystem, start, arms[0] if arms else tree.Poison(tokens.gap_span()))


# zero = "ZERO" "FORCE" arm ;
def zero_force(tokens: TokenStream) -> tree.ZeroForce:
    """Read one ZERO FORCE."""
    start = tokens.take()
    tokens.take()
    return tokens.node(tree.ZeroForce, start, mobile(tokens, _ARM, "after ZERO FORCE"))
