"""The files of a run: motion, events, frames, its record, and its page."""

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
from armwright.files.inputs import hash_of_read_file
from armwright.files.output import Content, sha256, write_folder
from armwright.motion.plan import PlannedStage
from armwright.program.language.diagnostic import Diagnostic, to_json
from armwright.program.language.source import Source, Span
from armwright.program.vm.excerpt import EVENT_LOG_HINT, MAX_LIST_ITEMS, Excerpt, excerpt, omission_text, shorten_list
from armwright.program.vm.machine import RunError
from armwright.program.vm.recording import (
    Effect,
    Recording,
    RunStage,
    log_csv_lines,
    measured_csv_lines,
    motion_csv_lines,
)
from armwright.report.collision_text import clearance_data, collision_text
from armwright.report.log_content import run_log_content
from armwright.report.log_files import LogFormat, log_files
from armwright.report.page import run_page
from armwright.report.run_data import run_page_data
from armwright.report.run_scene import part_data, scene_data
from armwright.spatial.poses import to_noap
from armwright.version import __version__

# Digits of the numbers in the JSON files: micrometres and microradians to a millionth.
_DIGITS = 12
# Rows of motion.csv by default: some 220 MB, or an arm for a quarter of an hour at 1 ms.
MOTION_ROWS = 1_000_000
# Pictures that are written at most.
MAX_PICTURES = 2_000


@attrs.frozen(kw_only=True)
class RunInputs:
    """The inputs of a run.

    Attributes:
        program: path of the program.
        cell: path of the cell file; None where the program imports its cell.
        imports: paths of the files that the program imports.
        command: the command line.
        options: options that affect the result, by name.
        motion_rows: limit of the rows of ``motion.csv``.
        text: text of the program where it is written with the results; None where it was read.
    """

    program: Path
    cell: Path | None
    imports: Sequence[Path] = ()
    command: str
    options: Mapping[str, Any]
    motion_rows: int = MOTION_ROWS
    text: str | None = None


def write_run(
    folder: Path,
    recording: Recording,
    diagnostics: Sequence[Diagnostic],
    origin: RunInputs,
    log: LogFormat | None = None,
) -> None:
    """Write the files of a run and its record into a folder, all of them or none.

    Args:
        folder: the folder; it is created where it is missing.
        recording: the recording of the run.
        diagnostics: diagnostics of compilation and run, with the error that ended it.
        origin: the inputs of the run; a program that was not read from a file is written too.
        log: format of a log that is written too; None for none.

    Raises:
        MissingExtraError: what writes the log is not installed.
        OutputError: the folder or a file cannot be written.
    """
    program = {} if origin.text is None else {origin.program.name: origin.text}
    logged = {} if log is None else log_files(log, run_log_content(recording))
    files = {**program, **run_files(recording, diagnostics, origin), **logged}
    write_folder(folder, files, run_record(recording, diagnostics, origin))


def run_files(recording: Recording, diagnostics: Sequence[Diagnostic], origin: RunInputs) -> dict[str, Content]:
    """Return the files of a run by name, identical for identical runs; those of a failed run end at the failure.

    Args:
        recording: the recording of the run.
        diagnostics: diagnostics of compilation and run.
        origin: the inputs of the run.
    """
    return {
        "motion.csv": motion_csv_lines(recording.streams, _written_ticks(recording, origin.motion_rows)),
        **_measured_file(recording, origin.motion_rows),
        **{f"log-{name}.csv": lines for name, lines in log_csv_lines(recording.effects).items()},
        "events.jsonl": _event_lines(recording),
        "frames.json": _json(frame_data(recording)),
        "report.html": run_page(
            run_page_data(recording, diagnostics, origin.command, omission_notes(recording, origin.motion_rows))
        ),
        **{_picture_file(i): picture.png for i, picture in enumerate(recording.pictures[:MAX_PICTURES], 1)},
    }


def _measured_file(recording: Recording, most_rows: int) -> dict[str, Iterable[str]]:
    """Return what the servos measured, in a cell with physics."""
    streams, ticks = recording.measured, _written_ticks(recording, most_rows)
    return {"measured.csv": measured_csv_lines(streams, ticks)} if streams else {}


def _picture_file(number: int) -> str:
    return f"seen-{number:04}.png"


def frame_data(recording: Recording) -> dict[str, Any]:
    """Return the final frame tree: the parent of each frame, and its poses relative to the world and the parent."""
    tree = recording.tree
    table = {}
    for name in (name for name in tree if name != WORLD):
        known, parent = tree.has_value(name), tree.parent(name) or WORLD
        table[name] = {
            "spelling": recording.code.spelled(name),
            "parent": parent,
            "world": _rounded_list(to_noap(tree.world(name))) if known else None,
            "relation": _rounded_list(to_noap(tree.relation(name, parent))) if known else None,
        }
    configurations = {name: _rounded_list(q) for name, q in recording.configurations.items()}
    return {"units": "m, rad", "pose": "columns n, o, a, p", "frames": table, "configurations": configurations}


def ending_data(recording: Recording) -> dict[str, Any]:
    """Return the exit status of a run, and the error of a failed run with its location and time."""
    failure, source = recording.failure, recording.code.source
    if failure is None:
        return {"ended": "finished", "exit_status": int(ExitStatus.DONE)}
    error = {
        "class": RunError.__name__,
        **to_json(failure.diagnostic, source),
        "file": source.name_at(failure.diagnostic.span.start),
        "statement": " ".join(source.slice(failure.diagnostic.span).split()),
        "time": failure.time,
        "arm": failure.arm,
    }
    return {"ended": "failed", "exit_status": int(RunError.exit_status), "error": error}


def source_place(source: Source, span: Span) -> dict[str, Any]:
    """Return the line of a place, and in a module the name of its file, as plain data."""
    line = {"line": source.line(span.start)}
    return {**line, "file": source.name_at(span.start)} if source.file_number(span.start) else line


def summary_data(recording: Recording, diagnostics: Sequence[Diagnostic], hint: str = EVENT_LOG_HINT) -> dict[str, Any]:
    """Return a summary of a run as plain data in SI units.

    Args:
        recording: the recording of the run.
        diagnostics: diagnostics of compilation and run, with the error that ended it.
        hint: note on the omitted lines of a trace that is too long.
    """
    source = recording.code.source
    data = {
        "program": source.name,
        "cell": recording.cell.name,
        "duration": recording.duration,
        "trace": shorten_list(recording.trace(), MAX_LIST_ITEMS, hint),
        "contacts": [
            {**source_place(source, e.span), "arm": e.arm, "t0": e.t0, "t1": e.t1, **e.data["contact"]}
            for e in _contacts(recording).join()
        ],
        "collisions": collision_text(recording),
        "stages": [_stage_data(stage, recording) for stage in recording.stages],
        "diagnostics": [to_json(diagnostic, source) for diagnostic in diagnostics],
    }
    if recording.observations.facts:
        data["physics"] = recording.observations.facts
    return {name: round_numbers(value) for name, value in data.items()}


def _contacts(recording: Recording) -> Excerpt[Effect]:
    # The STOP of an arm that is braked has the contact too.
    return excerpt([e for e in recording.effects if e.kind == "MOVE" and "contact" in e.data], MAX_LIST_ITEMS)


def _stage_data(run: RunStage, recording: Recording) -> dict[str, Any]:
    arm = recording.cell.arms[run.arm].arm
    motion = run.motion
    return {
        **source_place(recording.code.source, run.span),
        "arm": run.arm,
        "kind": run.stage.kind,
        "to": list(run.goal_names),
        "speed": run.speed,
        "start": run.t0,
        "duration": motion.duration,
        "length": run.length,
        "stopped": run.stopped,
        "deviation": run.stage.deviation,
        "certificate": None if run.stage.certificate is None else run.stage.certificate.as_data(),
        "slowed": run.stage.slowed,
        "detour": _detour_data(run.stage),
        "shaping": None if run.stage.shaping is None else run.stage.shaping.as_data(),
        "clearance": clearance_data(run.clearance),
        "planned_path": None if run.path is None else run.path.as_data(),
        "peak_speed": _rounded_list(motion.peaks(1)),
        "peak_acceleration": _rounded_list(motion.peaks(2)),
        "peak_effort": None if arm.massless else _rounded_list(run.peak_effort[: arm.n]),
        "speed_of_limit": _rounded_list(motion.peaks(1) / arm.limits.speed),
        "effort_of_limit": None if arm.massless else _rounded_list(run.effort_shares(arm)),
    }


def _detour_data(stage: PlannedStage) -> dict[str, Any] | None:
    """Return the obstacle of a straight line with the detour of the stage and its cost; None without an obstacle."""
    obstacle, detour = stage.obstacle, stage.detour
    if obstacle is None or detour is None:
        return None
    return {
        "method": detour.method,
        "via": None if detour.via is None else _rounded_list(to_noap(detour.via)),
        "obstacle": obstacle.reason,
        "cause": obstacle.cause,
        "joint": obstacle.joint,
        "fraction": obstacle.fraction,
        "along": obstacle.along,
        "line": obstacle.length,
        "position": _rounded_list(obstacle.place),
        "position_deviation": detour.price.distance,
        "rotation_deviation": detour.price.rotation,
        "extra_time": detour.price.time,
    }


def round_numbers(value: Any) -> Any:
    """Return plain data with rounded numbers: a number of ticks times the period may be 6.7490000000000006."""
    if isinstance(value, float):
        return round(value, _DIGITS) + 0.0  # adding 0 turns -0 into 0
    if isinstance(value, Mapping):
        return {name: round_numbers(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [round_numbers(item) for item in value]
    return value


def _event_lines(recording: Recording) -> Iterator[str]:
    source = recording.code.source
    for effect in recording.effects:
        event = {
            "t0": effect.t0,
            "t1": effect.t1,
            **source_place(source, effect.span),
            "column": source.column(effect.span.start),
            "kind": effect.kind,
            "process": effect.process,
            "arm": effect.arm,
            "text": effect.text,
            "source": " ".join(source.slice(effect.span).split()),
            **effect.data,
        }
        yield json.dumps(round_numbers(event), ensure_ascii=False) + "\n"


def omission_notes(recording: Recording, most_rows: int) -> tuple[str, ...]:
    """Return notes on what the files of a run omit because of their limits; empty where they are complete.

    Args:
        recording: the recording of the run.
        most_rows: limit of the rows of ``motion.csv``.
    """
    notes = []
    rows, contacts = sum(len(stream.t) for stream in recording.streams), _contacts(recording).omitted
    if rows > most_rows:
        first, end, _ = _written_ticks(recording, most_rows).indices(len(recording.streams[0].t))
        part, written = "last" if first else "first", end - first
        notes.append(
            f"motion.csv holds the {part} {written * recording.cell.period:.3f} s of {recording.duration:.3f} s: "
            f"{written * len(recording.streams)} of {rows} rows; `--motion-rows {rows}` writes all"
        )
    if contacts:
        notes.append(f"run.json lists the first and the last contacts: {omission_text(contacts)}")
    if len(recording.pictures) > MAX_PICTURES:
        notes.append(f"the first {MAX_PICTURES:,} of {len(recording.pictures):,} pictures are written")
    return tuple(notes)


def _written_ticks(recording: Recording, most_rows: int) -> slice:
    """Return the ticks in ``motion.csv``: the first ones, or the last ones before a failure."""
    ticks = most_rows // max(len(recording.streams), 1)
    if recording.failure is None or not recording.streams:
        return slice(0, ticks)
    return slice(max(0, len(recording.streams[0].t) - ticks), None)


def run_record(recording: Recording, diagnostics: Sequence[Diagnostic], origin: RunInputs) -> dict[str, Any]:
    """Return the record of a run for ``run.json``: its end, inputs, options, omissions, and the summary.

    Args:
        recording: the recording of the run.
        diagnostics: diagnostics of compilation and run, with the error that ended it.
        origin: the inputs of the run.
    """
    arms = {name: arm.arm.name for name, arm in recording.cell.arms.items()}
    return {
        **ending_data(recording),
        "command": origin.command,
        "inputs": {
            "program": _file_record(origin.program, origin.text),
            "cell": None if origin.cell is None else _file_record(origin.cell),
            "imports": [_file_record(path) for path in origin.imports],
            "arms": arms,
            "gravity_m_per_s2": recording.cell.gravity.tolist(),
        },
        "options": dict(origin.options),
        "left_out": list(omission_notes(recording, origin.motion_rows)),
        "versions": {"armwright": __version__, "python": platform.python_version(), "numpy": np.__version__},
        **summary_data(recording, diagnostics),
        "scene": scene_data(recording.cell),
        "parts": part_data(recording),
        "pictures": [
            {
                "file": _picture_file(i),
                "time": picture.time,
                "camera": picture.camera,
                "frame": picture.frame,
                "found": picture.found,
                "text": picture.text,
            }
            for i, picture in enumerate(recording.pictures[:MAX_PICTURES], 1)
        ],
    }


def input_hashes(origin: RunInputs) -> dict[str, str | None]:
    """Return the SHA-256 hashes of program, cell and imports, by what they are, to tell whether they are as before."""
    paths = {
        "program": origin.program,
        **({} if origin.cell is None else {"cell": origin.cell}),
        **{f"import {number}": path for number, path in enumerate(origin.imports, 1)},
    }
    return {name: _file_record(path)["sha256"] for name, path in paths.items()}


def _file_record(path: Path, text: str | None = None) -> dict[str, str | None]:
    digest = hash_of_read_file(path) or sha256(path) if text is None else hashlib.sha256(text.encode()).hexdigest()
    return {"path": str(path), "sha256": digest}


def _rounded_list(values: Array) -> list[float]:
    rounded: list[float] = (np.round(values, _DIGITS) + 0.0).tolist()  # adding 0 turns -0 into 0
    return rounded


def _json(value: Any) -> str:
    return json.dumps(value, indent=2, ensure_ascii=False) + "\n"
