"""The files of a replayed log: its numbers, figures, and a page of the arms as they moved and were to move."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.cell.model import Cell
from armwright.errors import counted
from armwright.files.logs.joint_log import JointStates
from armwright.motion.joint_tracking import JointTracking
from armwright.motion.replay import Replay, ReplayedMotion
from armwright.report.animation import Animation
from armwright.report.arm_figure import Placed, arm_figure
from armwright.report.elements import Card, Tile, downloads, figures, table_cards
from armwright.report.figures import Drawing, empty_figure, plain_label, svg_text
from armwright.report.page import ArmRecord, Effect, MeasuredMotion, Message, RunPage, run_page
from armwright.report.run_scene import fixture_bodies, placed_arms
from armwright.report.shape_table import ShapeTable
from armwright.report.static_page import static_page
from armwright.report.stick_figure import arm_record, thinned_rows
from armwright.report.tracking import largest_between
from armwright.version import __version__

# Instants of the animation per second, and at most.
_FPS, _MAX_INSTANTS = 30.0, 1200


def replay_files(
    replay: Replay, *, title: str, command: str, bases: Mapping[str, Array], cell: Cell | None = None
) -> dict[str, str]:
    """Return the files of a replayed log by name.

    Args:
        replay: the motions of the log.
        title: of the page.
        command: the command line that made it.
        bases: (4, 4) where the arms stand, by name; at the origin where left out.
        cell: in which they moved, for the view; None without one.
    """
    drawn = [
        Drawing(name, f"{motion.name}: planned and measured, and the error beside", _joints_figure(motion))
        for motion, name in zip(replay.motions, _figure_names(len(replay.motions)), strict=True)
    ]
    beside = {"summary.json": "all numbers, in SI units", **{f"{one.name}.svg": one.caption for one in drawn}}
    known = [motion for motion in replay.motions if motion.arm is not None and _can_move(motion)]
    if known:
        page = run_page(_page(replay, known, title=title, command=command, bases=bases, cell=cell))
    else:
        page = static_page(
            title=title,
            command=command,
            sections=[
                *table_cards(replay.tables()),
                Card("Over time", figures(drawn)),
                Card("Files", downloads(beside)),
            ],
            numbers=list(_tiles(replay)),
            notes=replay.notes,
        )
    data = json.dumps(replay.as_data(), indent=2, ensure_ascii=False) + "\n"
    return {"summary.json": data, **{f"{drawing.name}.svg": drawing.svg for drawing in drawn}, "report.html": page}


def _can_move(motion: ReplayedMotion) -> bool:
    """Whether all positions are known at two times or more."""
    return int(np.isfinite(motion.measured.q).all(axis=1).sum()) > 1


def _figure_names(count: int) -> list[str]:
    return ["joints"] if count == 1 else [f"{number:02d}-joints" for number in range(1, count + 1)]


def _tiles(replay: Replay) -> list[Tile]:
    tiles = []
    for motion in replay.motions:
        if (tracking := motion.tracking) is not None:
            worst = int(np.abs(tracking.error).max(axis=0).argmax())
            value = float(np.abs(tracking.error[:, worst]).max())
            tiles.append(Tile(f"{value:.3g}", f"largest error [rad] or [m], {tracking.names[worst]}", motion.name))
            if np.isfinite(tracking.common_delay):
                tiles.append(Tile(f"{tracking.common_delay * 1e3:z.2f} ms", "delay of all joints", motion.name))
    return tiles


# ---- figure ----------------------------------------------------------------------------------------------------------


def _joints_figure(motion: ReplayedMotion) -> str:
    """Draw each joint: its position as planned and measured, and its error beside."""
    tracking, measured = motion.tracking, motion.measured
    names = measured.names if tracking is None else tracking.names
    figure = empty_figure((8.4, 0.8 + 1.5 * len(names)))
    grid = figure.subplots(len(names), 1 if tracking is None else 2, sharex=True, squeeze=False)
    for i, name in enumerate(names):
        unit, scale = "rad or m", 1.0
        if motion.arm is not None:
            units = motion.arm.joints[i].units
            unit, scale = units.display, units.scale
        axis = grid[i, 0]
        if tracking is None:
            rows = thinned_rows(len(measured.t))
            axis.plot(measured.t[rows], measured.q[rows, i] / scale, linewidth=1.0)
        else:
            rows = thinned_rows(len(tracking.t))
            t = tracking.t[rows]
            axis.plot(t, tracking.planned[rows, i] / scale, color="C0", alpha=0.35, linewidth=3.0, label="planned")
            axis.plot(t, tracking.measured[rows, i] / scale, color="C1", linewidth=1.0, label="measured")
            error = largest_between(tracking.error[:, [i]], rows)[:, 0]
            error_unit = "rad or m" if motion.arm is None else motion.arm.joints[i].units.position
            grid[i, 1].plot(t, error, color="C3", linewidth=0.9)
            grid[i, 1].set_ylabel(error_unit, fontsize="small")
            grid[i, 1].grid(visible=True, alpha=0.3)
        axis.set_title(plain_label(name), fontsize="small", loc="left")
        axis.set_ylabel(unit, fontsize="small")
        axis.grid(visible=True, alpha=0.3)
    if tracking is not None:
        grid[0, 0].legend(fontsize="x-small", loc="upper right")
        grid[0, 1].set_title("measured less planned", fontsize="small", loc="left")
    for axis in grid[-1]:
        axis.set_xlabel("time, s")
    return svg_text(figure)


# ---- page ------------------------------------------------------------------------------------------------------------


def _page(
    replay: Replay,
    motions: Sequence[ReplayedMotion],
    *,
    title: str,
    command: str,
    bases: Mapping[str, Array],
    cell: Cell | None,
) -> RunPage:
    about = replay.log.about
    program, text = (str(about.get(key, "")) for key in ("program", "text"))
    start = min(float(motion.measured.t[0]) for motion in motions)
    end = max(float(motion.measured.t[-1]) for motion in motions)
    records = [_record(motion, start, bases.get(motion.name, np.eye(4))) for motion in motions]
    return RunPage(
        title=title,
        status="finished",
        program_name=program if text else replay.log.path.name,
        program_text=text or _topics_text(replay),
        text_kind="Program" if text else "Topics",
        cell_name=cell.name if cell is not None else str(about.get("cell", "")),
        generated_by=f"armwright {__version__}",
        command=command,
        duration=end - start,
        messages=[Message(severity="note", text=note) for note in replay.notes],
        # Lines of others name lines of programs that are not in the log.
        effects=_effects(replay, start, end) if text else [],
        arms=records,
        animation=_animation(motions, start, end, bases, cell),
        collisions="not looked for in a log",
    )


def _topics_text(replay: Replay) -> str:
    """Return the topics of a log, one on a line, with what they are."""
    roles = {}
    for motion in replay.motions:
        roles[motion.measured.topic] = "measured" if motion.tracking is not None else "alone"
        if motion.planned is not None:
            roles.setdefault(motion.planned.topic, "planned")
    return "".join(
        f"{topic}  # {roles.get(topic, 'not shown')}, {counted(len(states.t), 'state')}\n"
        for topic, states in replay.log.topics.items()
    )


def _effects(replay: Replay, start: float, end: float) -> list[Effect]:
    """Return the lines of the log that lie within its motions."""
    effects = []
    for line in replay.log.lines:
        t = (line.time - replay.log.start) / 1e9 - start
        if -1e-6 <= t <= end - start + 1e-6:
            effects.append(Effect(t0=t, t1=t, line=max(line.line, 1), text=line.text))
    return effects


def _record(motion: ReplayedMotion, start: float, base: Array) -> ArmRecord:
    """Return the record of an arm: the plan with the measurements beside it, or these alone where there is none."""
    arm, states = _known_arm(motion), motion.measured if motion.planned is None else motion.planned
    shift = 0.0 if motion.tracking is None else motion.tracking.offset
    rows = np.isfinite(states.q).all(axis=1)
    t, q = states.t[rows] + (shift if motion.planned is not None else 0.0) - start, states.q[rows]
    qd = _or_rates(t, q, states.qd[rows])
    tau = states.tau[rows]
    qdd = _or_rates(t, qd, np.full_like(qd, np.nan))
    record = arm_record(motion.name, arm, (t, q, qd, qdd, tau if np.isfinite(tau).all() else None), base)
    if motion.tracking is None:
        return record
    return attrs.evolve(record, measured=_measured(motion.tracking, motion.measured, start))


def _measured(tracking: JointTracking, states: JointStates, start: float) -> MeasuredMotion:
    rows = thinned_rows(len(tracking.t))
    error, sizes = tracking.error, np.abs(tracking.error)
    t = tracking.t[rows]
    nearest = np.clip(np.searchsorted(states.t, t), 0, len(states.t) - 1)
    qd = _or_rates(tracking.t, tracking.measured, np.full_like(tracking.measured, np.nan))[rows]
    own = states.qd[nearest]
    return MeasuredMotion(
        t=t - start,
        q=tracking.measured[rows],
        qd=np.where(np.isfinite(own), own, qd),
        tau=np.nan_to_num(states.tau[nearest]),
        error=largest_between(error, rows),
        worst=sizes.max(axis=0),
        worst_t=tracking.t[sizes.argmax(axis=0)] - start,
    )


def _or_rates(t: Array, values: Array, rates: Array) -> Array:
    """Return rates of change as they are known, or else from the values."""
    if np.isfinite(rates).all():
        return rates
    steps = np.gradient(values, t, axis=0) if len(t) > 1 and (np.diff(t) > 0).all() else np.zeros_like(values)
    return np.where(np.isfinite(rates), rates, steps)


def _animation(
    motions: Sequence[ReplayedMotion], start: float, end: float, bases: Mapping[str, Array], cell: Cell | None
) -> Animation:
    duration = max(end - start, 1e-9)
    fps = min(_FPS, _MAX_INSTANTS / duration)
    t = np.append(np.arange(int(np.ceil(duration * fps))) / fps, duration)
    shapes, placed = ShapeTable(), {} if cell is None else placed_arms(cell)
    figures_of_arms = {}
    for motion in motions:
        arm = _known_arm(motion)
        where = placed.get(motion.name, Placed(arm, base=bases.get(motion.name, np.eye(4))))
        q = _at(motion.measured.t, motion.measured.q, t + start)
        figure = arm_figure(motion.name, where._replace(arm=arm), q, None, shapes)
        if motion.tracking is not None:
            figure = attrs.evolve(figure, planned=_at(motion.tracking.t, motion.tracking.planned, t + start))
        figures_of_arms[motion.name] = figure
    fixtures = [] if cell is None else fixture_bodies(cell, shapes)
    return Animation(fps=fps, t=t, arms=figures_of_arms, fixtures=fixtures, shapes=shapes.as_data())


def _at(times: Array, q: Array, t: Array) -> Array:
    rows = np.isfinite(q).all(axis=1)
    return np.stack([np.interp(t, times[rows], column) for column in q[rows].T], axis=1)


def _known_arm(motion: ReplayedMotion) -> Arm:
    assert motion.arm is not None  # noqa: S101 - of those alone there is a view
    return motion.arm
