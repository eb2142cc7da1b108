"""Figures of a linkage with play: its path, the journals in their bearings, the error and its spectrum.

Source:
    Thesis, figures 4.7, 4.8, 4.9 and 4.12.
"""

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from armwright.arrays import Array, evenly_spread
from armwright.clearance.assessment import ClearanceRun
from armwright.clearance.features import spectrum
from armwright.clearance.ideal import tip_position
from armwright.clearance.lane_layout import Integers
from armwright.clearance.worn_walls import pin_directions
from armwright.report.figures import (
    Drawing,
    empty_figure,
    evenly_spaced,
    plain_axes,
    plain_label,
    round_number,
    svg_text,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# The largest error is drawn as this part of the size of the path, and no curve with more points than this.
_ERROR_SHARE, _MAX_POINTS = 0.2, 2500
# The way of a journal is coloured by time in so many pieces.
_SEGMENTS = 100
# Outlines of a worn wall over a run, as many as the eye can follow, and points of each.
_OUTLINES, _OUTLINE_POINTS = 25, 120
# So many places of the path without play are tied to those of the same moment with it.
_LINKS = 31
# A label of y is read from below, so that its arrow points up.
_UPWARDS = "y, mm \N{RIGHTWARDS ARROW}"
# The spectrum is shown up to here [Hz].
_MAX_FREQUENCY = 200.0


def clearance_run_figures(run: ClearanceRun) -> list[Drawing]:
    """Return the figures of a run: path, bearings, error, forces, energy, spectrum."""
    drawn = []
    path = f"The path without play and the path taken, its error magnified {magnification(run):g} times"
    worn = "" if run.simulation.worn is None else ", red: worn walls at the start, and dotted at the end"
    for name, draw, caption in (
        ("path", _draw_path, path),
        ("bearings", _draw_bearings, f"Centres of the journals in their bearings; circles: clearances{worn}"),
        ("error", _draw_error, "Error of the tip over time"),
        ("spectrum", _draw_spectrum, "Amplitudes of the error: mean removed, up to 200 Hz"),
        ("forces", _draw_forces, "Forces between journals and bearings; a gap in a curve: the journal flies"),
        ("energy", _draw_energy, "Energy taken by impacts and friction, and the residual of the energy balance"),
    ):
        figure = empty_figure((7.4, 4.2))
        draw(figure, run)
        drawn.append(Drawing(name, caption, svg_text(figure)))
    return drawn


def magnification(run: ClearanceRun) -> float:
    """Return a round number by which errors are magnified so that one sees them beside the path."""
    path = tip_position(run.simulation.scenario.linkage, run.simulation.scenario.ideal.q)
    return magnification_factor(path, run.error, _ERROR_SHARE)


def magnification_factor(points: Array, errors: Array, share: float) -> float:
    """Return a round factor by which errors (..., 2) are magnified to at most this share of the extent of points."""
    size = float(np.ptp(points, axis=0).max())
    largest = float(np.linalg.norm(errors, axis=-1).max())
    return round_number(share * size / largest) if largest > 0 else 1.0


def _draw_path(figure: "Figure", run: ClearanceRun) -> None:
    simulation, factor = run.simulation, magnification(run)
    samples = evenly_spaced(run.rows, _MAX_POINTS)
    ideal = (simulation.tip[: run.rows] - run.error)[samples] * 1e3
    actual = ideal + factor * run.error[samples] * 1e3
    width, height = np.ptp(np.concatenate([ideal, actual]), axis=0)
    figure.set_size_inches(float(np.clip(5.0 * width / max(height, 1e-9), 3.8, 8.0)), 5.4)
    axis = figure.subplots()
    # Of the same moment.
    for k in np.unique(np.linspace(0, len(samples) - 1, _LINKS).astype(int)):
        axis.plot(*np.stack([ideal[k], actual[k]], axis=-1), color="C7", linewidth=0.7)
    axis.plot(*ideal.T, "k--", linewidth=1.3, label="without play")
    axis.plot(*actual.T, color="C0", linewidth=1.3, label=f"with play, error × {factor:g}")
    for k, label in ((0, "start"), (-1, "end")):
        axis.plot(*actual[k], "os"[k], color="C3", markersize=6, fillstyle="none", linestyle="", label=label)
    axis.set(xlabel="x, mm \N{RIGHTWARDS ARROW}", ylabel=_UPWARDS)
    axis.set_aspect("equal", adjustable="datalim")
    axis.grid(visible=True, alpha=0.3)
    figure.legend(*axis.get_legend_handles_labels(), loc="outside lower center", ncols=2, frameon=False)


def wall_outlines(run: ClearanceRun, pin: int, rows: Integers) -> Array:
    """Return (k, d, 2) how far the middle of a journal can go in a worn bearing, in the axes of the ground [m].

    Args:
        run: of a linkage with worn pins.
        pin: number of the pin.
        rows: numbers of rows of the run, of which k at most are taken, evenly spread.
    """
    simulation = run.simulation
    assert simulation.worn is not None  # noqa: S101 - round walls have no outline
    q = simulation.q[rows[evenly_spread(len(rows), _OUTLINES)]]
    angles = pin_directions(simulation.scenario.linkage, q)
    around = np.arange(_OUTLINE_POINTS) * (2 * np.pi / _OUTLINE_POINTS)
    turned, rotation = around - angles.bearing[:, pin, None], angles.rotation[:, pin, None]
    reach = simulation.clearances[pin] + simulation.worn.at(pin, turned, rotation).growth
    return np.asarray(reach[..., None] * np.stack([np.cos(around), np.sin(around)], axis=-1))


def _draw_bearings(figure: "Figure", run: ClearanceRun) -> None:
    from matplotlib.collections import LineCollection  # noqa: PLC0415
    from matplotlib.patches import Circle  # noqa: PLC0415

    pins, samples = run.simulation.scenario.linkage.pins, evenly_spaced(run.rows, _MAX_POINTS)
    figure.set_size_inches(3.1 * len(pins) + 1.0, 3.6)
    panels = figure.subplots(1, len(pins), squeeze=False)[0]
    # Each piece begins where the one before it ends.
    bounds = np.unique(np.linspace(0, len(samples) - 1, _SEGMENTS + 1).astype(int))
    segments = [slice(a, b + 1) for a, b in pairwise(bounds)]
    factor = np.array([run.time[samples[a]] for a in bounds[:-1]]) * 1e3
    lines: Any = None
    for i, (axis, pin) in enumerate(zip(panels, pins, strict=True)):
        gaps = run.gaps[samples, i] * 1e3
        clearance = wall = float(run.simulation.clearances[i]) * 1e3
        axis.add_patch(Circle((0, 0), wall, fill=False, color="k", linewidth=1.2))
        if run.simulation.worn is not None:
            for outline, style in zip(wall_outlines(run, i, np.array([0, run.rows - 1])) * 1e3, "-:", strict=True):
                axis.plot(*np.vstack([outline, outline[:1]]).T, style, color="C3", linewidth=1.0)
                wall = max(wall, float(np.linalg.norm(outline, axis=-1).max()))
        lines = LineCollection([gaps[segment] for segment in segments], array=factor, cmap="viridis", linewidths=1.0)
        axis.add_collection(lines)
        axis.plot(*gaps[0], "o", color="C3", markersize=6, fillstyle="none", zorder=4)
        shown = (-1.12 * wall, 1.12 * wall)
        axis.set(
            title=plain_label(f"{pin.name}, {clearance:g} mm"),
            xlabel="x, mm \N{RIGHTWARDS ARROW}",
            xlim=shown,
            ylim=shown,
        )
        axis.set_aspect("equal")
        axis.grid(visible=True, alpha=0.3)
    panels[0].set_ylabel(_UPWARDS)
    figure.colorbar(lines, ax=panels, label="time, ms", shrink=0.8)


def _draw_error(figure: "Figure", run: ClearanceRun) -> None:
    axis, samples = plain_axes(figure, "time, s", "error, mm"), evenly_spaced(run.rows, _MAX_POINTS)
    t = run.time[samples]
    lines = (("E", run.distance, "-", "C0"), ("x", run.error[:, 0], "--", "C1"), ("y", run.error[:, 1], "-.", "C2"))
    for name, values, style, colour in lines:
        axis.plot(t, values[samples] * 1e3, style, color=colour, linewidth=1.3, label=name)
    for knot in run.simulation.scenario.path.knots[1:-1]:
        axis.axvline(knot, color="0.6", linewidth=0.8, linestyle=":")
    if run.predictability is not None and not run.predictability.to_the_end:
        axis.axvline(run.predictability.until, color="C3", linewidth=1.0, linestyle="--", label="predictable until")
    axis.set_xlim(float(t[0]), float(t[-1]) or 1.0)
    axis.legend(fontsize="small")


def _draw_spectrum(figure: "Figure", run: ClearanceRun) -> None:
    axis = plain_axes(figure, "frequency, Hz", "amplitude, mm")
    waves = spectrum(run.distance) * 1e3
    per_line = 1.0 / (len(run.time) * (run.time[1] - run.time[0])) if len(run.time) > 1 else 1.0
    frequencies = per_line * np.arange(len(waves))
    shown = (frequencies > 0) & (frequencies <= max(_MAX_FREQUENCY, 20 * per_line))
    axis.vlines(frequencies[shown], 0.0, waves[shown], color="C0", linewidth=1.6)
    axis.plot(frequencies[shown], waves[shown], "o", color="C0", markersize=3.5)
    axis.set_ylim(bottom=0.0)
    axis.set_title(f"constant part, counted twice: {waves[0]:.4g} mm", fontsize="medium")


def _draw_forces(figure: "Figure", run: ClearanceRun) -> None:
    axis, samples = plain_axes(figure, "time, s", "force, N"), evenly_spaced(run.rows, _MAX_POINTS)
    for i, pin in enumerate(run.simulation.scenario.linkage.pins):
        forces = run.simulation.forces[: run.rows, i][samples]
        contact = np.where(forces > 0, forces, np.nan)
        axis.plot(run.time[samples], contact, linewidth=1.1, color=f"C{i % 10}", label=plain_label(pin.name))
    if np.any(run.simulation.forces[: run.rows] > 0):
        axis.set_yscale("log")
    axis.legend(fontsize="small")


def _draw_energy(figure: "Figure", run: ClearanceRun) -> None:
    axis, samples, energy = plain_axes(figure, "time, s", "energy, J"), evenly_spaced(run.rows, _MAX_POINTS), run.energy
    for name, track, style in (
        ("lost in impacts", energy.impact_loss, "-"),
        ("lost in friction", energy.friction_loss, "--"),
        ("in the walls", energy.stored, "-."),
        ("residual of the balance", energy.imbalance, ":"),
    ):
        axis.plot(run.time[samples], track[: run.rows][samples], style, linewidth=1.4, label=name)
    axis.legend(fontsize="small")
