"""Words between the words of a program: the stages of a MOVE, the arm that closes, the names of parameters."""

from bisect import bisect_left
from collections.abc import Iterator
from itertools import takewhile

from lsprotocol import types as lsp

from armwright.program.bytecode.instructions import stages_text
from armwright.program.bytecode.move import form_of
from armwright.program.language.names import is_arm
from armwright.program.language_server.analysis import Analysis
from armwright.program.language_server.positions import offset_of, position
from armwright.program.syntax import tree

# A statement that starts further before a position does not reach it.
_MAX_STATEMENT_LENGTH = 4000


def inlay_hints(analysis: Analysis, within: lsp.Range) -> list[lsp.InlayHint]:
    """Return the hints of a range of text, in order."""
    statements = analysis.hinted_statements
    start, end = offset_of(analysis.codec, within.start), offset_of(analysis.codec, within.end)
    first = bisect_left(statements, start - _MAX_STATEMENT_LENGTH, key=lambda statement: statement.span.start)
    candidates = takewhile(lambda statement: statement.span.start <= end, statements[first:])
    hints = [hint for statement in candidates for hint in _statement_hints(analysis, statement)]
    within_range = (hint for hint in hints if within.start <= hint.position <= within.end)
    return sorted(within_range, key=lambda hint: (hint.position.line, hint.position.character))


def _statement_hints(analysis: Analysis, statement: tree.Move | tree.Call | tree.Grasp) -> Iterator[lsp.InlayHint]:
    match statement:
        case tree.Move():
            yield from _move_hints(analysis, statement)
        case tree.Grasp(arm=None) if (flow := analysis.complete.flow) and (arm := flow.arms.get(statement.span.start)):
            yield _hint(analysis, statement.span.end, arm, "the arm that was named or moved last")
        case tree.Call():
            yield from _call_hints(analysis, statement)


def _hint(analysis: Analysis, offset: int, text: str, tooltip: str, *, names_parameter: bool = False) -> lsp.InlayHint:
    """Return words that name what follows them, or else add to what is in front."""
    return lsp.InlayHint(
        position=position(analysis.codec, offset),
        label=text,
        kind=lsp.InlayHintKind.Parameter if names_parameter else lsp.InlayHintKind.Type,
        tooltip=tooltip,
        padding_left=not names_parameter,
        padding_right=names_parameter,
    )


def _move_hints(analysis: Analysis, move: tree.Move) -> Iterator[lsp.InlayHint]:
    if isinstance(move.moved, tree.Poison) or any(isinstance(node, tree.Poison) for node in tree.walk(move)):
        return
    source, flow = analysis.compiled.source, analysis.complete.flow
    text = stages_text(form_of(move, lambda node: " ".join(source.slice(node.span).split())))
    tooltip = "the stages of this motion: PTP all joints at once, LINE straight, ARC round, SPLINE and BLEND past poses"
    arm = None if flow is None else flow.arms.get(move.span.start)
    if arm and not (isinstance(move.moved, tree.ArmName) and is_arm(move.moved.key)):
        text = f"{arm}: {text}"
    if flow is not None and move.span.start in flow.implied:
        tooltip += "; the frame is attached to the arm first, as if by AFFIX"
    yield _hint(analysis, move.span.end, text, tooltip)


def _call_hints(analysis: Analysis, call: tree.Call) -> Iterator[lsp.InlayHint]:
    key = call.name.key
    procedure = analysis.compiled.symbols.procedures.get(analysis.compiled.brought.get(key, key))
    if procedure is None:
        return
    names = (name for declaration in procedure.node.parameters for name in declaration.names)
    for name, argument in zip(names, call.arguments, strict=False):
        # An argument that reads like its parameter needs no word.
        if isinstance(argument, tree.Poison) or (isinstance(argument, tree.Name) and argument.key == name.key):
            continue
        tooltip = f"parameter {name.text}: {procedure.types.get(name.key)}"
        yield _hint(analysis, argument.span.start, f"{name.text}:", tooltip, names_parameter=True)
