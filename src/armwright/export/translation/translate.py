"""Translating a checked program into what every writer prints."""

from collections.abc import Iterator

from armwright.cell.frames import WORLD, FrameTree
from armwright.export.plan_mode import mapped_arm, only_arm
from armwright.export.translation import calls, frame_statements, statements
from armwright.export.translation.code import (
    Call,
    FunctionCall,
    Pose,
    Procedure,
    ProgramCode,
    Variable,
    every_statement,
    every_value,
)
from armwright.export.translation.context import Context, Translators
from armwright.export.translation.frames import Attachments, Hanging
from armwright.export.translation.passages import Run
from armwright.export.translation.values import value_of
from armwright.program.api import Compilation
from armwright.program.syntax import tree
from armwright.program.vm.recording import Recording

TRANSLATORS: Translators = {**frame_statements.TRANSLATORS, **statements.TRANSLATORS, **calls.TRANSLATORS}


def translate_program(compiled: Compilation, recording: Recording, name: str) -> ProgramCode:
    """Return a program in the words of no controller.

    Args:
        compiled: the program; without errors.
        recording: its run in the cell, which says the configurations and speeds of its MOVEs.
        name: of the exported program.

    Raises:
        ExportError: it has what cannot be translated; the message has the line and the reason.
    """
    arm = only_arm(recording)
    mapped = mapped_arm(recording, arm)
    context = _translated(compiled, recording, arm, keeps_hand=False)
    if context.reads_hand:
        context = _translated(compiled, recording, arm, keeps_hand=True)
    procedures = _called(context)
    blocks = [tuple(context.out), *(procedure.body for procedure in procedures)]
    used = {value.key for value in every_value(blocks) if isinstance(value, Variable)}
    return ProgramCode(
        name=name,
        source=compiled.source,
        units=compiled.symbols.units,
        arm_name=arm,
        placed=context.placed,
        mapped=mapped,
        declarations=tuple(one for key, one in context.declarations.items() if key in used),
        procedures=procedures,
        statements=tuple(context.out),
        kinds=context.kinds,
        outputs=tuple(context.outputs.items()),
        notes=tuple(_notes(context)),
    )


def _translated(compiled: Compilation, recording: Recording, arm: str, *, keeps_hand: bool) -> Context:
    cell = recording.cell
    names = (node.key for node in tree.walk(compiled.whole) if isinstance(node, tree.Name))
    context = Context(
        translators=TRANSLATORS,
        call_function=calls.call_function,
        compiled=compiled,
        cell=cell,
        arm=arm,
        run=Run(recording, arm),
        scope=compiled.symbols.scope(None),
        attachments=Attachments(_hanging(cell.tree(), arm)),
        keeps_hand=keeps_hand,
        used=frozenset(names),
    )
    if keeps_hand:
        context.declare(arm, "pose", initial=Pose(cell.tree().world(arm)))
    _refuse_moving_frames(context)
    _constants(context)
    context.translate(*compiled.whole.statements)
    return context


def _refuse_moving_frames(context: Context) -> None:
    """Refuse a program that uses a frame which moves by itself.

    Raises:
        ExportError: it does.
    """
    code = context.compiled.code
    if code is None or not context.cell.moving_frames:
        return
    for step in code.instructions:
        if found := context.cell.moving_frames.keys() & {one for one in step.operands if isinstance(one, str)}:
            text = (
                f"`{code.spelled(min(found))}` moves by itself, and what moves it has no counterpart that is known here"
            )
            context.refuse(step.span, text, "a frame that moves", "let the controller track its conveyor")


def _constants(context: Context) -> None:
    """Work out the constants of the program."""
    for node in context.compiled.symbols.constant_assignments(context.compiled.whole):
        key = node.target.key  # type: ignore[union-attr]
        context.constants[key] = (
            node.value.value if isinstance(node.value, tree.String) else value_of(context, node.value)
        )


def _hanging(frames: FrameTree, arm: str) -> dict[str, Hanging]:
    """Return where the frames of a cell hang; what stands on the base of an arm stands in the world."""
    return {
        name: Hanging(
            frozenset({node.parent if node.parent in frames.nodes and not node.parent.endswith(".BASE") else WORLD}),
            arm if arm in frames.ancestors(name) else WORLD,
            node.rigid,
        )
        for name, node in frames.nodes.items()
        if node.relation is not None and not name.endswith(".BASE") and name != arm
    }


def _called(context: Context) -> tuple[Procedure, ...]:
    """Return the procedures that are called, each behind those that it calls."""
    known = {one.key: one for one in context.procedures}
    wanted: set[str] = set()
    waiting = [tuple(context.out)]
    while waiting:
        block = [waiting.pop()]
        keys = {one.procedure for one in every_statement(block) if isinstance(one, Call)}
        keys |= {one.procedure for one in every_value(block) if isinstance(one, FunctionCall)}
        waiting += [known[key].body for key in keys - wanted]
        wanted |= keys
    return tuple(one for one in context.procedures if one.key in wanted)


def _notes(context: Context) -> Iterator[str]:
    """Give what is to be known of the translation, with lines."""
    source = context.compiled.source
    yield from context.notes
    for start, reached in sorted(context.reached.items()):
        if not reached:
            yield f"line {source.place(start)}: the run does not come to this MOVE: it is slow, and not compared"
