"""The files of a plan of checks: a page, its numbers, the corrections of the path, and figures."""

import json
from collections.abc import Iterator
from typing import Any

import numpy as np

from armwright.arrays import Array
from armwright.clearance.maintenance.assessment import CheckPlan
from armwright.report.elements import Card, Tile, downloads, figures, tables
from armwright.report.figures import Drawing, empty_figure, plain_axes, plain_label, svg_text
from armwright.report.motion_table import csv_lines
from armwright.report.static_page import static_page


def check_plan_files(plan: CheckPlan, *, command: str) -> dict[str, Any]:
    """Return the files of a plan by name.

    Args:
        plan: of the checks.
        command: the command line that made it.
    """
    drawn = [_timeline(plan), _clearances(plan), _stops(plan)]
    beside = {"plan.json": "all numbers, in SI units", "corrections.csv": "by how much each correction moves the path"}
    return {
        "plan.json": json.dumps({"command": command, **plan.as_data()}, indent=2, ensure_ascii=False) + "\n",
        "corrections.csv": csv_lines(_moves(plan), 9),
        "report.html": static_page(
            title=f"{plan.machine.linkage.name}: checks on {plan.machine.stroke.name}",
            command=command,
            sections=[
                Card("Plan", tables(plan.tables())),
                Card("Figures", figures(drawn)),
                Card("Files", downloads(beside, drawn)),
            ],
            numbers=_tiles(plan),
            notes=plan.notes,
        ),
        **{f"{drawing.name}.svg": drawing.svg for drawing in drawn},
    }


def _moves(plan: CheckPlan) -> dict[str, Array]:
    """Return columns with a row for each correction and place of the path."""
    machine = plan.machine
    strokes, _, moves = zip(*plan.corrections(), strict=True)
    count, places = len(strokes), machine.watched
    names: tuple[str, ...] = ("x_m", "y_m")
    commanded = places.tip
    if not machine.by_tip:
        (drive,) = machine.linkage.driven
        unit = "m" if machine.linkage.coordinates[drive].kind == "slide" else "rad"
        names, commanded = (f"{machine.linkage.drives[0].body}_{unit}",), places.q[:, [drive]]
    return {
        "strokes": np.repeat(strokes, len(machine.times)),
        "t_s": np.tile(machine.times, count),
        **{f"commanded_{name}": np.tile(commanded[:, i], count) for i, name in enumerate(names)},
        **{f"move_{name}": np.concatenate(moves)[:, i] for i, name in enumerate(names)},
    }


def _tiles(plan: CheckPlan) -> Iterator[Tile]:
    due = plan.next_stop.strokes
    yield Tile(f"{due:.3g}" if np.isfinite(due) else "none", "strokes at which the next check is due")
    yield Tile(f"{plan.planned.stops.mean():.2g}", "stops expected")
    same = plan.equally_safe()
    if same is not None and plan.planned.outside.any():
        yield Tile(f"{same.stops.mean():.2g}", "stops at equal distances, as safe")
    yield Tile(f"{plan.planned.outside.mean():.2%}", "of strokes out of limit")


def _timeline(plan: CheckPlan) -> Drawing:
    """Draw what was done, and what is planned; after the next check as in a life with the median number of stops."""
    figure = empty_figure((7.4, 3.0))
    axes = plain_axes(figure, "strokes", "")
    lives = sorted(plan.planned.lives, key=lambda life: len(life.stops))
    typical = lives[len(lives) // 2]
    past = [known.strokes for known in plan.history[1:]]
    planned = [n for n, _, _ in plan.corrections()]
    later = [stop.strokes for stop in typical.stops]
    changed = [(stop.strokes, plan.pins[pin]) for stop in typical.stops for pin in stop.changed]
    rows = {"check": 2, "correct": 1, "change": 0}
    axes.scatter(past, [rows["check"]] * len(past), color="C0", label="made")
    axes.scatter(later, [rows["check"]] * len(later), color="C7", marker="o", facecolors="none", label="a typical life")
    axes.scatter(planned, [rows["correct"]] * len(planned), color="C3", marker="|", s=80, label="planned")
    if np.isfinite(plan.next_stop.strokes):
        axes.scatter([plan.next_stop.strokes], [rows["check"]], color="C3", marker="D")
    for strokes, pin in [*((n, pin) for pin, n in plan.changed.items()), *changed]:
        made = strokes in plan.changed.values()
        axes.scatter([strokes], [rows["change"]], color="C0" if made else "C7", marker="s")
        axes.annotate(plain_label(pin), (strokes, rows["change"]), (0, 6), textcoords="offset points", ha="center")
    axes.set_yticks(list(rows.values()), labels=list(rows))
    axes.set_ylim(-0.6, 2.6)
    axes.set_xlim(0, plan.planner.strategy.horizon)
    figure.legend(loc="outside lower center", ncols=3, frameon=False, fontsize="small")
    return Drawing("timeline", "Timeline: checks, corrections of the path, and changes of bearings", svg_text(figure))


def _clearances(plan: CheckPlan) -> Drawing:
    figure = empty_figure((7.4, 4.0))
    axes = plain_axes(figure, "strokes", "clearance, mm")
    times, bands = plan.forecast()
    for i, pin in enumerate(plan.pins):
        low, middle, high = bands[:, :, i].T * 1e3
        axes.plot(times, middle, f"C{i}-", label=plain_label(pin))
        axes.fill_between(times, low, high, color=f"C{i}", alpha=0.15)
        strokes = np.array([known.strokes for known in plan.history])
        below, mean, above = np.array([known.clearances[:, i] for known in plan.history]).T * 1e3
        axes.errorbar(
            strokes, mean, (mean - below, above - mean), fmt="o:", linewidth=1, color=f"C{i}", markersize=4, capsize=2
        )
    if np.isfinite(plan.next_stop.strokes):
        axes.axvline(plan.next_stop.strokes, color="C3", linestyle=":", linewidth=1, label="next check")
    axes.set_xlim(0, plan.planner.strategy.horizon)
    axes.set_ylim(bottom=0)
    axes.legend(fontsize="small", loc="upper left")
    caption = "Clearances over the strokes: what was known, and bands that hold nine in ten if nothing is measured"
    return Drawing("clearances", caption, svg_text(figure))


def _stops(plan: CheckPlan) -> Drawing:
    figure = empty_figure((7.4, 3.6))
    axes = plain_axes(figure, "stops", "strokes out of limit, %")
    fixed = [(one.stops.mean(), one.outside.mean() * 100) for one in plan.fixed]
    axes.plot(*zip(*fixed, strict=True), "C7o-", label="checks at equal distances")
    axes.plot([plan.planned.stops.mean()], [plan.planned.outside.mean() * 100], "C3D", label="plan")
    axes.axhline(plan.planner.strategy.alpha * 100, color="C3", linestyle=":", linewidth=1, label="alpha")
    axes.set_ylim(bottom=-0.05 * axes.get_ylim()[1])
    axes.legend(fontsize="small")
    return Drawing("stops", "Stops and strokes out of limit: the plan, and checks at equal distances", svg_text(figure))
