"""Trying out the programs of the pages: their comments say in what cell, in what language, within what limits.

``// std=83`` and ``// strict`` are the options of the command line. ``// cell: arms ARM_1, ARM_2`` tells what a
program is checked against, and so do ``frames``, ``devices``, ``visions``, ``inputs``, ``analogue``, ``joints`` and
``targets``; ``// import: parts.toml: CUP, LID on CUP`` tells what an IMPORT brings, and ``// module: grip.rlo: MODULE
grip ; END.`` has the text of a module. ``// run in one_arm`` has the program run in a cell that comes with the pages,
with ``// around: via``, ``// limits: steps 1000`` and ``// physics`` as on the command line; ``// effort: 60 in joint
2`` makes a joint of its arms that weak. ``// export urscript`` has its motion exported afterwards, by
``armwright.export``, and ``// export urscript program`` the program.
``// cell: joints ARM_1 RRPRRR`` tells which joints turn and which slide, ``targets HOME of ARM_1`` of joint targets.
"""

import re
from collections.abc import Mapping
from pathlib import Path

import attrs

from armwright.cell.hardware import HardwareFactory
from armwright.cell.model import Around, Cell, CellArm
from armwright.cell.reader import read_cell
from armwright.errors import FileFormatError
from armwright.physics.kinematic_cell import kinematic_cell
from armwright.program.api import Compilation, compile as translate, run
from armwright.program.language.diagnostic import Diagnostic
from armwright.program.language.source import Source
from armwright.program.language.words import Standard
from armwright.program.semantics.cell_symbols import ImportedFrames, ImportedModule, KnownCell, ReadImport
from armwright.program.vm.interpreter import motion_warnings
from armwright.program.vm.machine import Limits, RunError
from armwright.program.vm.recording import Recording

_CELLS = Path(__file__).parent / "pages" / "cells"
_RUN = re.compile(r"^// run in (\w+)$", re.MULTILINE)
_AROUND = re.compile(r"^// around: (via|damped)$", re.MULTILINE)
_DETOUR_METHODS: Mapping[str, Around] = {"via": "via", "damped": "damped"}
_EFFORT = re.compile(r"^// effort: (\d+) in joint (\d)$", re.MULTILINE)
_LIMIT = re.compile(r"^// limits: (steps|depth|time) (\d+)$", re.MULTILINE)
_PHYSICS = re.compile(r"^// physics$", re.MULTILINE)
_KNOWN = re.compile(r"^// cell: (arms|frames|devices|visions|inputs|analogue|joints|targets) (.+)$", re.MULTILINE)
_IMPORT = re.compile(r"^// import: (\S+): (.+)$", re.MULTILINE)
_MODULE = re.compile(r"^// module: (\S+): (.+)$", re.MULTILINE)
_OLD = re.compile(r"^// std=83$", re.MULTILINE)
_STRICT = re.compile(r"^// strict$", re.MULTILINE)


def run_example(source: Source) -> tuple[tuple[Diagnostic, ...], Compilation, Recording | None]:
    """Return what is said of a program, by the translator and, where its comments have it run, on the way.

    Args:
        source: the program, with its comments.

    Returns:
        The diagnostics, the compiled program, and the run; None where there is none, or it did not come to its end.
    """
    cell = _run_cell(source.text)
    compiled = translate(
        source,
        cell or _known_cell(source.text),
        strict=bool(_STRICT.search(source.text)),
        std=Standard.RLO_83 if _OLD.search(source.text) else Standard.RLO_2,
        read_import=_import_reader(source.text),
    )
    if cell is None or compiled.code is None:
        return compiled.diagnostics, compiled, None
    limits = Limits(**{quantity: int(count) for quantity, count in _LIMIT.findall(source.text)})
    try:
        recording = run(compiled, limits=limits, hardware=_hardware(source.text))
    except RunError as error:
        return (*compiled.diagnostics, error.diagnostic), compiled, None
    return (*compiled.diagnostics, *motion_warnings(recording.stages, recording.cell)), compiled, recording


def _run_cell(text: str) -> Cell | None:
    """Return the cell that a program is run in; None where it is not run."""
    match = _RUN.search(text)
    if match is None:
        return None
    cell = read_cell(_CELLS / f"{match[1]}.toml")
    if detour := _AROUND.search(text):
        cell = attrs.evolve(cell, around=_DETOUR_METHODS[detour[1]])
    for effort, number in _EFFORT.findall(text):
        arms = {name: _limit_effort(arm, int(number) - 1, float(effort)) for name, arm in cell.arms.items()}
        cell = attrs.evolve(cell, arms=arms)
    return cell


def _hardware(text: str) -> HardwareFactory:
    """Return how the cell is set up in which a program is run."""
    if not _PHYSICS.search(text):
        return kinematic_cell
    from armwright.physics.world import PhysicsCell  # noqa: PLC0415 - few programs need it

    return PhysicsCell


def _limit_effort(placed: CellArm, joint: int, effort: float) -> CellArm:
    """Return an arm of a cell of which one joint has no more effort than this."""
    joints = list(placed.arm.joints)
    limits = attrs.evolve(joints[joint].limits, effort=effort)
    joints[joint] = attrs.evolve(joints[joint], limits=limits)
    return attrs.evolve(placed, arm=attrs.evolve(placed.arm, joints=joints))


def _known_cell(text: str) -> KnownCell | None:
    """Return the cell that a program is checked against."""
    known: Mapping[str, list[str]] = {what: names.split(", ") for what, names in _KNOWN.findall(text)}
    if not known:
        return None
    return KnownCell(
        arms=frozenset(known["arms"]),
        frames=_frame_parents(known.get("frames", [])),
        devices=frozenset(known["devices"]) if "devices" in known else None,
        visions=frozenset(known["visions"]) if "visions" in known else None,
        inputs=frozenset(known["inputs"]) if "inputs" in known else None,
        analogue=frozenset(known.get("analogue", ())),
        joints=dict(one.split() for one in known.get("joints", ())),
        targets=dict(one.split(" of ") for one in known["targets"]) if "targets" in known else None,
    )


def _frame_parents(names: list[str]) -> dict[str, str]:
    """Return what each frame hangs on, of names such as ``LID on CUP``."""
    parts = (name.partition(" on ") for name in names)
    return {name: parent or "WORLD" for name, _, parent in parts}


def _import_reader(text: str) -> ReadImport | None:
    """Return a reader of the files that a program is told of; any other file is missing."""
    files = {path: _frame_parents(names.split(", ")) for path, names in _IMPORT.findall(text)}

    modules = dict(_MODULE.findall(text))

    def read(path: str) -> ImportedFrames | ImportedModule:
        if path in modules:
            return ImportedModule(text=modules[path])
        if path not in files:
            raise FileFormatError(path, None, "", "there is no such file")
        return ImportedFrames(frames=files[path])

    return read if files or modules else None
