"""The summary of a run: its trace, its stages, and where the frames were when it failed."""

from collections.abc import Iterator, Sequence
from typing import Any

import attrs

from armwright.cell.frames import WORLD
from armwright.errors import counted
from armwright.files.result_table import ResultTable
from armwright.program.bytecode.instructions import Code
from armwright.program.language.diagnostic import Diagnostic
from armwright.program.vm.excerpt import MAX_TERMINAL_LINES, Excerpt, excerpt, omission_text, shorten_line, shorten_list
from armwright.program.vm.machine import RunError
from armwright.program.vm.move_diagnostics import path_text
from armwright.program.vm.recording import Effect, Recording, RunStage
from armwright.report.collision_text import collision_text
from armwright.report.run_files import ending_data, summary_data
from armwright.report.tracking import physics_text


@attrs.frozen(kw_only=True, eq=False)
class RunSummary:
    """The summary of a run, also of one that failed.

    Attributes:
        recording: the recording of the run.
        diagnostics: diagnostics of compilation and run, with the error that ended it.
        hint: note on the omitted lines of a trace that is too long.
    """

    recording: Recording
    diagnostics: Sequence[Diagnostic]
    hint: str

    @property
    def notes(self) -> tuple[str, ...]:
        """The stages that were slowed, planned anew or shaped, and the numbers of the run; none if it failed."""
        recording = self.recording
        if recording.failure is not None:
            return ()
        slowed = [
            f"line {recording.code.source.place(run.span.start)}: {run.stage.kind} to {run.goal_names[-1]} runs "
            f"{run.stage.slowed}"
            for run in recording.stages
            if run.stage.slowed
        ]
        planned = [
            f"line {recording.code.source.place(run.span.start)}: {run.stage.kind} to {run.goal_names[-1]}: "
            f"{path_text(run.path)}"
            for run in recording.stages
            if run.path is not None
        ]
        smooth = [
            f"line {recording.code.source.place(run.span.start)}: {run.stage.kind} to {run.goal_names[-1]}: "
            f"{run.stage.shaping.summary}"
            for run in recording.stages
            if run.stage.shaping is not None
        ]
        moves = sum(effect.kind == "MOVE" for effect in recording.effects)
        ticks = len(recording.streams[0].t) if recording.streams else 0
        numbers = (
            f"{recording.code.source.name}: {recording.duration:.3f} s in {recording.cell.name}, "
            f"{counted(moves, 'move')}, {counted(len(recording.stages), 'stage')}, {counted(ticks, 'servo tick')}"
        )
        collisions = (
            "Collisions are not checked." if recording.checked is None else f"Collisions: {collision_text(recording)}."
        )
        unknown = [
            f"the masses of {placed.arm.name} ({name}) are unknown, and so are its efforts"
            for name, placed in recording.cell.arms.items()
            if placed.arm.massless
        ]
        return (
            *shorten_list([*slowed, *planned, *smooth], MAX_TERMINAL_LINES, self.hint),
            numbers,
            *unknown,
            *([text] if (text := physics_text(recording)) else []),
            collisions,
        )

    def as_data(self) -> dict[str, Any]:
        """Return the summary as plain data in SI units."""
        return {**ending_data(self.recording), **summary_data(self.recording, self.diagnostics, self.hint)}

    def tables(self) -> Iterator[ResultTable]:
        """Yield the trace and, of a run that finished, its stages."""
        yield self._trace_table()
        if self.recording.failure is None:
            yield self._stage_table()

    def _trace_table(self) -> ResultTable:
        recording = self.recording
        several = len(recording.processes) > 1

        def row(effect: Effect) -> tuple[str, ...]:
            end = f"{effect.t1:.3f}" if effect.t1 > effect.t0 else ""
            times = recording.code.source.place(effect.span.start), f"{effect.t0:.3f}", end
            return (*times, *((effect.process,) if several else ()), shorten_line(effect.text, self.hint))

        effects = excerpt([effect for effect in recording.effects if effect.kind != "PLACE"], MAX_TERMINAL_LINES)
        heads = ("line", "from s", "to s", *(("process",) if several else ()), "effect")
        omitted = (*[""] * (len(heads) - 1), omission_text(effects.omitted, self.hint))
        return ResultTable(title="", heads=heads, rows=effects.map(row).join(omitted), numbers=(0, 1, 2))

    def _stage_table(self) -> ResultTable:
        stages: Excerpt[RunStage | None] = excerpt(self.recording.stages, MAX_TERMINAL_LINES)
        rows: list[tuple[str, ...]] = []
        exceeded: list[tuple[int, int]] = []
        for run in stages.join(None):
            if run is None:
                rows.append(("", omission_text(stages.omitted, self.hint), *[""] * 6))
                continue
            stage, arm = run.stage, self.recording.cell.arms[run.arm].arm
            peaks = []
            # Without masses the efforts are none of the arm.
            efforts = None if arm.massless else run.effort_shares(arm)
            for column, shares in ((6, run.motion.peaks(1) / arm.limits.speed), (7, efforts)):
                if shares is None:
                    peaks.append("unknown")
                    continue
                joint = int(shares.argmax())
                peaks.append(f"{shares[joint] * 100:.0f} % j{joint + 1}")
                if shares[joint] > 1 + 1e-9:
                    exceeded.append((len(rows), column))
            title = f"{run.arm} {stage.kind} {' '.join(run.goal_names)}{', stopped' if run.stopped else ''}"
            numbers = f"{run.t0:.3f}", f"{run.duration:.3f}", f"{run.length * 1e3:.0f}"
            deviation = "" if stage.deviation is None else f"{stage.deviation * 1e3:.3f}"
            line = self.recording.code.source.place(run.span.start)
            rows.append((line, title, *numbers, deviation, *peaks))
        return ResultTable(
            title="",
            heads=("line", "stage", "from s", "s", "mm", "deviation mm", "peak speed", "peak effort"),
            rows=rows,
            numbers=(0, 2, 3, 4, 5, 6, 7),
            exceeded=exceeded,
        )


def frame_table(error: RunError, code: Code) -> ResultTable:
    """Return the positions of all frames when a program failed [mm]."""

    def row(name: str) -> tuple[str, ...]:
        parent = (error.tree.parent(name) or WORLD).removesuffix(".BASE")
        position = "no value yet"
        if error.tree.has_value(name):
            position = ", ".join(f"{x * 1e3:z.1f}" for x in error.tree.world(name)[:3, 3])
        return code.spelled(name), "its base" if parent == name else code.spelled(parent), position

    frames = excerpt([name for name in error.tree if name != WORLD and not name.endswith(".BASE")], MAX_TERMINAL_LINES)
    omitted = (omission_text(frames.omitted, "all in frames.json of `-o FOLDER`"), "", "")
    return ResultTable(
        title=f"frames at {error.time:.3f} s",
        heads=("frame", "parent", "x, y, z in the world, mm"),
        rows=frames.map(row).join(omitted),
        numbers=(2,),
    )
