"""Words between the words of a program: the stages of a MOVE, the arm that closes, the names of parameters."""

from bisect import bisect_left
from collections.abc import Iterator

import attrs

from armwright.program.bytecode.instructions import stages_text
from armwright.program.bytecode.move import form_of
from armwright.program.language.names import is_arm
from armwright.program.language.source import Span
from armwright.program.language_server.analysis import Analysis
from armwright.program.syntax import tree

# A statement that starts further in front of a place does not reach it.
_REACH = 4000


@attrs.frozen
class Hint:
    """Words that stand at a place without being written there.

    Attributes:
        place: where.
        text: the words.
        tooltip: what they mean.
        parameter: whether they name what follows, and do not add to what is in front.
    """

    place: int
    text: str
    tooltip: str
    parameter: bool = False


def hints(analysis: Analysis, span: Span) -> tuple[Hint, ...]:
    """Return the words that belong to a stretch of text, in order."""
    statements = analysis.statements
    index = bisect_left(statements, span.start - _REACH, key=lambda statement: statement.span.start)
    result: list[Hint] = []
    while index < len(statements) and statements[index].span.start <= span.end:
        result += _of(analysis, statements[index])
        index += 1
    return tuple(sorted((hint for hint in result if span.start <= hint.place <= span.end), key=lambda hint: hint.place))


def _of(analysis: Analysis, statement: tree.Move | tree.Call | tree.Grasp) -> Iterator[Hint]:
    match statement:
        case tree.Move():
            yield from _move(analysis, statement)
        case tree.Grasp(arm=None):
            flow = analysis.compiled.flow
            arm = None if flow is None else flow.arms.get(statement.span.start)
            if arm:
                yield Hint(statement.span.end, arm, "the arm that was named or moved last")
        case tree.Call():
            yield from _call(analysis, statement)


def _move(analysis: Analysis, move: tree.Move) -> Iterator[Hint]:
    if isinstance(move.moved, tree.Poison) or any(isinstance(node, tree.Poison) for node in tree.walk(move)):
        return
    source, flow = analysis.compiled.source, analysis.compiled.flow
    text = stages_text(form_of(move, lambda node: " ".join(source.slice(node.span).split())))
    tooltip = "the stages of this motion: PTP all joints at once, LINE straight, SPLINE and BLEND through places"
    arm = None if flow is None else flow.arms.get(move.span.start)
    if arm and not (isinstance(move.moved, tree.ArmName) and is_arm(move.moved.key)):
        text = f"{arm}: {text}"
    if flow is not None and move.span.start in flow.implied:
        tooltip += "; the frame is hung on the arm first, as if by AFFIX"
    yield Hint(move.span.end, text, tooltip)


def _call(analysis: Analysis, call: tree.Call) -> Iterator[Hint]:
    procedure = analysis.compiled.symbols.procedures.get(call.name.key)
    if procedure is None:
        return
    names = (name for declaration in procedure.node.parameters for name in declaration.names)
    for name, argument in zip(names, call.arguments, strict=False):
        # An argument that reads like its parameter needs no word.
        if isinstance(argument, tree.Poison) or (isinstance(argument, tree.Name) and argument.key == name.key):
            continue
        kind = procedure.types.get(name.key)
        yield Hint(argument.span.start, f"{name.text}:", f"parameter {name.text}: {kind}", parameter=True)
