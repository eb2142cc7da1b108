"""Exporting what a program did in its cell: the files of a target, and the proof that they say the same."""

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from types import ModuleType
from typing import get_args

import attrs

from armwright.cell.model import Cell
from armwright.errors import CheckFailedError, InvalidValueError, one_of
from armwright.export.checkers import (
    fanuc as fanuc_checker,
    fanuc_machine,
    krl as krl_checker,
    krl_machine,
    rapid as rapid_checker,
    rapid_machine,
    urscript as urscript_checker,
    urscript_machine,
)
from armwright.export.checkers.actions import CheckError
from armwright.export.checkers.cell_world import CellWorld
from armwright.export.checkers.comparison import compare
from armwright.export.checkers.joint_tables import compare_counts, compare_trajectory
from armwright.export.checkers.program_comparison import compare_run
from armwright.export.conventions import Convention
from armwright.export.events import events_file
from armwright.export.plan_mode import fixed_notes, plan_statements, refuse_guards, refuse_tracking
from armwright.export.proof import Comparison, Proof
from armwright.export.targets import Mode, Target
from armwright.export.translation.expected import expected
from armwright.export.translation.translate import translate_program
from armwright.export.writers import (
    drive_csv,
    fanuc,
    fanuc_program,
    krl,
    krl_program,
    rapid,
    rapid_program,
    ros2,
    urscript,
    urscript_program,
)
from armwright.program.api import Compilation, compile as compile_program, run
from armwright.program.language.source import Source
from armwright.program.vm.recording import Recording

_LANGUAGES: Mapping[Target, tuple[ModuleType, ModuleType]] = {
    "urscript": (urscript, urscript_checker),
    "krl": (krl, krl_checker),
    "rapid": (rapid, rapid_checker),
    "fanuc": (fanuc, fanuc_checker),
}
# Those in which a program itself can be written, and not only what it did in the cell.
_PROGRAMS: Mapping[Target, tuple[ModuleType, ModuleType]] = {
    "urscript": (urscript_program, urscript_machine),
    "krl": (krl_program, krl_machine),
    "rapid": (rapid_program, rapid_machine),
    "fanuc": (fanuc_program, fanuc_machine),
}
# Languages that do not say in lengths how corners are rounded.
_WITHOUT_ZONES = ("fanuc",)
# Languages with a command for positions at the period of the controller, so that motions run as they are planned.
_STREAMING = ("urscript",)


@attrs.frozen(kw_only=True)
class ExportedProgram:
    """Files for a controller, and the proof of what they say.

    Attributes:
        target: what they are for.
        files: their texts by name; the proof is among them.
        proof: what their checker found.
    """

    target: Target
    files: Mapping[str, str]
    proof: Proof


def usual_mode(target: Target) -> Mode:
    """Return what is exported where nobody says: the program, to controllers in whose language it can be written."""
    return "program" if target in _PROGRAMS else "plan"


def export_program(
    target: Target,
    program: str | Path | Source | Compilation,
    cell: str | Path | Cell | None = None,
    *,
    name: str = "",
    mode: Mode | None = None,
) -> ExportedProgram:
    """Run a program in its cell, and return it, or the resulting motion, for a controller.

    Args:
        target: ``ros2``, ``csv``, ``urscript``, ``krl``, ``rapid`` or ``fanuc``.
        program: the path of its file, its text as a ``Source``, or a compiled program.
        cell: what it acts on, or the path of its file; without one, the first that it IMPORTs and that has arms.
        name: of the exported program; that of the file without one.
        mode: ``program`` for the program with its control flow, ``plan`` for what it did in the cell; without it
            ``program`` to ``urscript``, ``krl``, ``rapid`` and ``fanuc``, and ``plan`` to all others.

    Returns:
        The files, with their proof; every difference from the run is within what is allowed.

    Raises:
        UnknownNameError: there is no such target.
        ProgramError: the program has errors.
        RunError: it does not come to its end.
        ExportError: it does what the target cannot repeat; the message has the line and the reason.
        CheckFailedError: the files differ from the plan.
        MissingExtraError: Lark is not installed, and the target needs it.

    Example:
        ``armwright.export.export_program("rapid", "pick.rlo", "cell.toml").files``
    """
    one_of("target", target, get_args(Target))
    mode = usual_mode(target) if mode is None else mode
    one_of("mode", mode, get_args(Mode))
    compiled = program if isinstance(program, Compilation) else compile_program(program, cell)
    recording = run(compiled)
    name = name or Path(recording.code.source.name).stem
    return export_run(target, recording, name) if mode == "plan" else export_compiled(target, compiled, recording, name)


def export_compiled(target: Target, compiled: Compilation, recording: Recording, name: str) -> ExportedProgram:
    """Return a program, with its control flow, for a controller; see ``export_program``.

    Args:
        target: ``urscript``, ``krl``, ``rapid`` or ``fanuc``.
        compiled: the program.
        recording: its run in the cell; the exported program is run there too, and does the same.
        name: of the exported program.
    """
    one_of("target", target, _PROGRAMS)
    if recording.failure is not None:
        raise InvalidValueError(f"recording: the run failed: {recording.failure.diagnostic.message}")
    writer, machine = _PROGRAMS[target]
    code = translate_program(compiled, recording, name)
    written = writer.write(code)
    wanted = expected(code, recording)
    try:
        configurations = {stream.arm: stream.q for stream in recording.streams}
        world = CellWorld(recording.cell, wanted.ends, configurations)
        done = machine.run([*written.files.values()], world)
    except CheckError as error:
        raise CheckFailedError(f"the exported program cannot be run: {error}") from error
    proof = Proof(
        target=target,
        mode="program",
        comparisons=compare_run(done, wanted.program),
        approximations=written.approximations,
        notes=code.notes,
        sources=tuple(_source_lines(code.mapped.convention)),
    )
    return _proved(target, written.files, proof)


def export_run(target: Target, recording: Recording, name: str) -> ExportedProgram:
    """Return the motion of a run for a controller; see ``export_program``.

    Args:
        target: ``ros2``, ``csv``, ``urscript``, ``krl``, ``rapid`` or ``fanuc``.
        recording: a run that came to its end.
        name: of the exported program.
    """
    one_of("target", target, get_args(Target))
    if recording.failure is not None:
        raise InvalidValueError(f"recording: the run failed: {recording.failure.diagnostic.message}")
    try:
        if target in _LANGUAGES:
            files, proof = _language(target, recording, name)
        else:
            files, proof = _tables(target, recording)
    except CheckError as error:
        raise CheckFailedError(f"the exported program cannot be read back: {error}") from error
    return _proved(target, files, proof)


def _proved(target: Target, files: dict[str, str], proof: Proof) -> ExportedProgram:
    """Return files with their proof.

    Raises:
        CheckFailedError: it found too large a difference.
    """
    proof.require()
    data = json.dumps({**proof.as_data(), "words": proof.lines()}, indent=2, ensure_ascii=False) + "\n"
    return ExportedProgram(target=target, files={**files, "proof.json": data}, proof=proof)


def _language(target: Target, recording: Recording, name: str) -> tuple[dict[str, str], Proof]:
    """Return the file of a target that has a language, with its proof."""
    writer, checker = _LANGUAGES[target]
    zones, streams = target not in _WITHOUT_ZONES, target in _STREAMING
    program = plan_statements(recording, name, zones=zones, streams=streams)
    written = writer.write(program)
    proof = Proof(
        target=target,
        comparisons=compare(checker.read(written.text), program),
        approximations=written.approximations,
        notes=program.notes,
        sources=tuple(_source_lines(program.mapped.convention)),
    )
    return {written.name: written.text}, proof


def _tables(target: Target, recording: Recording) -> tuple[dict[str, str], Proof]:
    """Return the files of a target that takes joint positions in time, one arm after the other."""
    refuse_tracking(recording)
    refuse_guards(recording)
    files: dict[str, str] = {}
    comparisons: list[Comparison] = []
    approximations: dict[str, None] = {}
    for arm in recording.cell.arms:
        written = (ros2 if target == "ros2" else drive_csv).write(recording, arm)
        files |= {file.name: file.text for file in written}
        approximations |= dict.fromkeys(text for file in written for text in file.approximations)
        check: Callable[..., tuple[Comparison, ...]] = compare_trajectory if target == "ros2" else compare_counts
        found = check(*(file.text for file in written), recording, arm)
        comparisons += [attrs.evolve(one, quantity=f"{arm}: {one.quantity}") for one in found]
    proof = Proof(
        target=target,
        comparisons=tuple(comparisons),
        approximations=tuple(approximations),
        notes=tuple(fixed_notes(recording)),
    )
    return {**files, "events.json": events_file(recording)}, proof


def _source_lines(convention: Convention) -> list[str]:
    """Return the sources of a convention, one line each."""
    return [f"{source.says}: {source.document}, {source.revision}" for source in convention.sources]
