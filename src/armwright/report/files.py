"""The files of a run: motion, events, frames, what made them, and the page."""

import hashlib
import json
import platform
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.cell.frames import WORLD
from armwright.errors import ExitStatus
from armwright.files.inputs import hash_read
from armwright.files.output import sha256
from armwright.motion.plan import Stage
from armwright.program.bytecode.instructions import Code
from armwright.program.language.diagnostic import Diagnostic, to_json
from armwright.program.vm.excerpt import IN_A_LIST, KEPT, Excerpt, excerpt, listed, more
from armwright.program.vm.machine import RunError
from armwright.program.vm.recording import Effect, Recording, RunStage, motion_rows
from armwright.report.page import COLLISIONS, run_page
from armwright.report.run_data import page_of
from armwright.spatial.poses import to_noap
from armwright.version import __version__

# Digits of the numbers in the JSON files: micrometres and microradians to a millionth.
_DIGITS = 12
# Rows of motion.csv unless more are asked for: some 220 MB, or one arm for a quarter of an hour at 1 ms.
MOTION_ROWS = 1_000_000


@attrs.frozen(kw_only=True)
class Origin:
    """What made a run.

    Attributes:
        program: path of the program.
        cell: path of the cell file; None where the program imports its cell.
        imports: paths of the files that the program imports.
        command: the command line.
        options: those that shape the result, by name.
        motion_rows: how many rows ``motion.csv`` may have.
        text: of the program where it is written with the results; None where it was read.
    """

    program: Path
    cell: Path | None
    imports: Sequence[Path] = ()
    command: str
    options: Mapping[str, Any]
    motion_rows: int = MOTION_ROWS
    text: str | None = None


def result_files(
    recording: Recording, code: Code, diagnostics: Sequence[Diagnostic], origin: Origin
) -> dict[str, str | Iterable[str]]:
    """Return the files of a run by name, the same text for the same run; of one that failed, up to the failure.

    Args:
        recording: what happened.
        code: the program that ran.
        diagnostics: warnings of translation and run.
        origin: what made it.
    """
    return {
        "motion.csv": motion_rows(recording.streams, _kept(recording, origin.motion_rows)),
        "events.jsonl": _events(recording, code),
        "frames.json": _json(frames(recording, code)),
        "report.html": run_page(
            page_of(recording, code, diagnostics, origin.command, left_out(recording, origin.motion_rows))
        ),
    }


def frames(recording: Recording, code: Code) -> dict[str, Any]:
    """Return the final frame tree: per frame its parent and its pose, seen from the world and from the parent."""
    tree = recording.tree
    table = {}
    for name in tree:
        if name == WORLD:
            continue
        known = tree.has_value(name)
        parent = tree.parent(name) or WORLD
        table[name] = {
            "spelling": code.spelled(name),
            "parent": parent,
            "world": _numbers(to_noap(tree.world(name))) if known else None,
            "relation": _numbers(to_noap(tree.relation(name, parent))) if known else None,
        }
    configurations = {name: _numbers(q) for name, q in recording.configurations.items()}
    return {"units": "m, rad", "pose": "columns n, o, a, p", "frames": table, "configurations": configurations}


def ending(recording: Recording, code: Code) -> dict[str, Any]:
    """Return how a run ended: its exit status, and of one that failed why, where and when."""
    failure = recording.failure
    if failure is None:
        return {"ended": "finished", "exit_status": int(ExitStatus.DONE)}
    source, span = code.source, failure.diagnostic.span
    error = {
        "class": RunError.__name__,
        **to_json(failure.diagnostic, source),
        "file": source.name,
        "statement": " ".join(source.slice(span).split()),
        "time": failure.time,
        "arm": failure.arm,
    }
    return {"ended": "failed", "exit_status": int(RunError.exit_status), "error": error}


def summary(recording: Recording, code: Code, diagnostics: Sequence[Diagnostic], where: str = KEPT) -> dict[str, Any]:
    """Return a run in short, as plain data in SI units.

    Args:
        recording: what happened.
        code: the program that ran.
        diagnostics: warnings of translation and run, and what ended it.
        where: what is said of the lines of a trace that is too long.
    """
    found = {
        "program": code.source.name,
        "cell": recording.cell.name,
        "duration": recording.duration,
        "trace": listed(recording.trace(), IN_A_LIST, where),
        "contacts": [
            {
                "line": code.source.line(one.span.start),
                "arm": one.arm,
                "t0": one.t0,
                "t1": one.t1,
                **one.data["contact"],
            }
            for one in _contacts(recording).joined()
        ],
        "collisions": COLLISIONS,
        "stages": [_stage(stage, recording, code) for stage in recording.stages],
        "diagnostics": [to_json(one, code.source) for one in diagnostics],
    }
    return {name: rounded(value) for name, value in found.items()}


def _contacts(recording: Recording) -> Excerpt[Effect]:
    # Where an arm is braked its STOP has the contact too.
    return excerpt([one for one in recording.effects if one.kind == "MOVE" and "contact" in one.data], IN_A_LIST)


def _stage(run: RunStage, recording: Recording, code: Code) -> dict[str, Any]:
    arm = recording.cell.arms[run.arm].arm
    motion = run.motion
    return {
        "line": code.source.line(run.span.start),
        "arm": run.arm,
        "kind": run.stage.kind,
        "to": list(run.to),
        "speed": run.speed,
        "start": run.t0,
        "duration": motion.duration,
        "length": run.length,
        "stopped": run.stopped,
        "deviation": run.stage.deviation,
        "certificate": None if run.stage.certificate is None else run.stage.certificate.as_data(),
        "slowed": run.stage.slowed,
        "detour": _detour(run.stage),
        "peak_speed": _numbers(motion.peaks(1)),
        "peak_acceleration": _numbers(motion.peaks(2)),
        "peak_effort": _numbers(run.peak_effort),
        "speed_of_limit": _numbers(motion.peaks(1) / arm.limit("speed")),
        "effort_of_limit": _numbers(run.peak_effort / arm.limit("effort")),
    }


def _detour(stage: Stage) -> dict[str, Any] | None:
    """Return what stopped a straight line, how the stage goes round it and the price; None where nothing did."""
    obstacle, detour = stage.obstacle, stage.detour
    if obstacle is None or detour is None:
        return None
    return {
        "by": detour.by,
        "via": None if detour.via is None else _numbers(to_noap(detour.via)),
        "stopped_by": obstacle.reason,
        "cause": obstacle.cause,
        "joint": obstacle.joint,
        "fraction": obstacle.fraction,
        "along": obstacle.along,
        "line": obstacle.length,
        "place": _numbers(obstacle.place),
        "off_the_line": detour.price.distance,
        "turned_off": detour.price.turn,
        "longer_by": detour.price.time,
    }


def rounded(value: Any) -> Any:
    """Return plain data with its numbers as people write them: ticks times the period is 6.7490000000000006."""
    if isinstance(value, float):
        return round(value, _DIGITS) + 0.0  # adding 0 turns -0 into 0
    if isinstance(value, Mapping):
        return {name: rounded(one) for name, one in value.items()}
    if isinstance(value, list | tuple):
        return [rounded(one) for one in value]
    return value


def _events(recording: Recording, code: Code) -> Iterator[str]:
    for effect in recording.effects:
        source = code.source
        event = {
            "t0": effect.t0,
            "t1": effect.t1,
            "line": source.line(effect.span.start),
            "column": source.column(effect.span.start),
            "kind": effect.kind,
            "process": effect.process,
            "arm": effect.arm,
            "text": effect.text,
            "source": " ".join(source.slice(effect.span).split()),
            **effect.data,
        }
        yield json.dumps(rounded(event), ensure_ascii=False) + "\n"


def left_out(recording: Recording, most_rows: int) -> tuple[str, ...]:
    """Say what the files of a run leave out, since there is too much of it; empty where they have all.

    Args:
        recording: what happened.
        most_rows: of ``motion.csv``.
    """
    rows, contacts = sum(len(one.t) for one in recording.streams), _contacts(recording).left_out
    more_contacts = (f"run.json lists the first and the last contacts: {more(contacts)}",) if contacts else ()
    if rows <= most_rows:
        return more_contacts
    ticks, kept = len(recording.streams[0].t), _kept(recording, most_rows)
    first, end, _ = kept.indices(ticks)
    part = "last" if first else "first"
    text = (
        f"motion.csv holds the {part} {(end - first) * recording.cell.period:.3f} s of {recording.duration:.3f} s: "
        f"{(end - first) * len(recording.streams)} of {rows} rows; `--motion-rows {rows}` keeps all"
    )
    return (text, *more_contacts)


def _kept(recording: Recording, most_rows: int) -> slice:
    """Return the ticks that ``motion.csv`` holds: the first ones, or the last ones before a failure."""
    ticks = most_rows // max(len(recording.streams), 1)
    if recording.failure is None or not recording.streams:
        return slice(0, ticks)
    return slice(max(0, len(recording.streams[0].t) - ticks), None)


def run_record(recording: Recording, code: Code, diagnostics: Sequence[Diagnostic], origin: Origin) -> dict[str, Any]:
    """Return what ``run.json`` says of a run: how it ended, what made it, what was left out, and the summary.

    Args:
        recording: what happened.
        code: the program that ran.
        diagnostics: warnings of translation and run, and what ended it.
        origin: what made it.
    """
    arms = {name: place.arm.name for name, place in recording.cell.arms.items()}
    return {
        **ending(recording, code),
        "command": origin.command,
        "inputs": {
            "program": _file(origin.program, origin.text),
            "cell": None if origin.cell is None else _file(origin.cell),
            "imports": [_file(path) for path in origin.imports],
            "arms": arms,
            "gravity_m_per_s2": recording.cell.gravity.tolist(),
        },
        "options": dict(origin.options),
        "left_out": list(left_out(recording, origin.motion_rows)),
        "versions": {"armwright": __version__, "python": platform.python_version(), "numpy": np.__version__},
        **summary(recording, code, diagnostics),
    }


def _file(path: Path, text: str | None = None) -> dict[str, str | None]:
    digest = hash_read(path) or sha256(path) if text is None else hashlib.sha256(text.encode()).hexdigest()
    return {"path": str(path), "sha256": digest}


def _numbers(values: Array) -> list[float]:
    rounded: list[float] = (np.round(values, _DIGITS) + 0.0).tolist()  # adding 0 turns -0 into 0
    return rounded


def _json(value: Any) -> str:
    return json.dumps(value, indent=2, ensure_ascii=False) + "\n"
