"""The pages of clearances: what measurements say about them, and what a sweep over them found."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from armwright.clearance.estimation.assessment import EstimateAssessment
from armwright.clearance.free_parameters import FREE_PARAMETERS
from armwright.clearance.sweep_summary import SweepSummary
from armwright.files.result_table import ResultTable
from armwright.report.elements import Card, Tile, downloads, figures, length_text, table, tables
from armwright.report.figures import Drawing, empty_figure, plain_axes, plain_label, svg_text
from armwright.report.static_page import static_page

if TYPE_CHECKING:
    from xarray import Dataset

# Less than this share of a path is marked where no more of it is predictable.
_PREDICTABLE = 0.5


def estimate_files(assessment: EstimateAssessment, *, name: str, command: str) -> dict[str, str]:
    """Return the files of an estimate by name.

    Args:
        assessment: the estimate.
        name: of the linkage.
        command: the command line that made it.
    """
    title = f"{name}: estimated clearances"
    drawn = Drawing("clearances", "Means and 90 % intervals", _intervals(title, assessment.parameters))
    beside = {"summary.json": "the estimate, in SI units", "clearances.svg": "means and intervals"}
    named = ("Estimate", "What the readings would reveal")
    return {
        "summary.json": json.dumps(assessment.as_data(), indent=2, ensure_ascii=False) + "\n",
        "report.html": static_page(
            title=title,
            command=command,
            sections=[
                Card("Clearances", figures([drawn])),
                *(
                    Card(head, tables([shown]))
                    for head, shown in zip(named, assessment.tables(), strict=True)
                    if shown.rows
                ),
                Card("Files", downloads(beside)),
            ],
            numbers=_estimate_tiles(assessment),
            notes=assessment.notes,
        ),
        "clearances.svg": drawn.svg,
    }


def _estimate_tiles(assessment: EstimateAssessment) -> Iterator[Tile]:
    for name, it in assessment.parameters.items():
        low, high = it["interval"]
        if name in FREE_PARAMETERS:
            unit = FREE_PARAMETERS[name].unit.replace("1", "")
            between = f"90 % from {low:.4f} to {high:.4f} {unit}".rstrip()
            text = between if it["identifiable"] else "not identifiable"
            yield Tile(f"{it['mean']:.4f} {unit}".rstrip(), f"{name.replace('_', ' ')}, {text}", mark=_mark(it))
        else:
            between = f"90 % from {low * 1e3:.3f} to {high * 1e3:.3f} mm"
            text = between if it["identifiable"] else "not identifiable"
            yield Tile(length_text(it["mean"]), f"clearance of {name}, {text}", between, _mark(it))
    yield Tile(f"{assessment.misfit:.2g}", "probability of residuals as large, where the model holds")


def _mark(parameter: Mapping[str, Any]) -> str:
    return "" if parameter["identifiable"] else "warn"


def _intervals(title: str, parameters: Mapping[str, Mapping[str, Any]]) -> str:
    """Draw the estimates as dots with their intervals, those of lengths on one scale."""
    lengths = {name: it for name, it in parameters.items() if name not in FREE_PARAMETERS}
    figure = empty_figure((6.4, 1.3 + 0.42 * len(lengths)))
    axes = plain_axes(figure, "radial clearance, mm", "")
    for row, it in enumerate(lengths.values()):
        low, high = (1e3 * x for x in it["interval"])
        axes.plot([low, high], [row, row], "-", color="C0", linewidth=2.4, solid_capstyle="butt")
        # What the data do not determine is a ring.
        fill = "full" if it["identifiable"] else "none"
        axes.plot(1e3 * it["mean"], row, "o", color="C0", markersize=8, fillstyle=fill)
    axes.set_yticks(range(len(lengths)), [plain_label(name) for name in lengths])
    axes.set_ylim(len(lengths) - 0.4, -0.6)
    axes.set_xlim(left=0.0)
    return svg_text(figure, title)


def sweep_page(summary: SweepSummary, results: Dataset, *, name: str, command: str) -> str:
    """Return the page of a sweep.

    Args:
        summary: of the sweep.
        results: of the sweep.
        name: of the linkage.
        command: the command line that made it.
    """
    title = f"{name}: error curves at many clearances"
    caption = "The mean error of each linkage, with its spread over copies a nanometre apart"
    drawn = Drawing("errors", caption, _errors(title, summary, results))
    cards = [Card("Mean errors", figures([drawn]))]
    if summary.chaos:
        cards.append(Card("How long the runs are predictions", table(_predictions(summary))))
    return static_page(
        title=title,
        command=command,
        sections=cards,
        numbers=_sweep_tiles(summary, results),
        notes=[
            f"The results are in {summary.folder}: results.nc has a row for each linkage",
            "A feature is dominated by random variation where copies differ by more than the design does",
        ],
        warnings=[f"{summary.failed} of {summary.runs} linkages could not be simulated"] if summary.failed else (),
    )


def _sweep_tiles(summary: SweepSummary, results: Dataset) -> Iterator[Tile]:
    yield Tile(f"{summary.runs - summary.failed:,}", f"linkages on {len(summary.paths)} paths")
    for path in summary.paths:
        mean = _of_path(results, path, "amp_dc") / 2
        if np.isfinite(mean).any():
            low, high = np.nanmin(mean), np.nanmax(mean)
            yield Tile(f"{low * 1e3:.3f} to {high * 1e3:.3f} mm", f"mean error on {path}")
    for path, limits in summary.chaos.items():
        share = limits["earliest"] / limits["duration"]
        mark = "warn" if share < _PREDICTABLE else ""
        yield Tile(f"{100 * share:.0f} %", f"of {path} is predictable in all runs", mark=mark)


def _predictions(summary: SweepSummary) -> ResultTable:
    heads = ("path", "half of the runs, s", "all runs, s", "of, s", "dominated by random variation")
    rows = [
        (path, *(f"{it[key]:.4g}" for key in ("until", "earliest", "duration")), ", ".join(it["chance"]) or "none")
        for path, it in summary.chaos.items()
    ]
    return ResultTable(title="", heads=heads, rows=rows, numbers=range(1, 4))


def _errors(title: str, summary: SweepSummary, results: Dataset) -> str:
    """Draw the mean error of each linkage over the mean of its clearances, a panel for each path."""
    clearances = [np.asarray(results[one].to_numpy()) for one in results.coords if str(one).startswith("c_")]
    size = np.mean(clearances, axis=0) * 1e3
    columns = min(3, len(summary.paths))
    rows = math.ceil(len(summary.paths) / columns)
    figure = empty_figure((2.6 * columns + 0.8, 2.5 * rows + 0.8))
    axes = figure.subplots(rows, columns, squeeze=False)
    for axis, path in zip(axes.flat, summary.paths, strict=False):
        mean = _of_path(results, path, "amp_dc") / 2 * 1e3
        axis.plot(size, mean, "o", color="C0", markersize=3.5)
        if f"{path}_amp_dc_spread" in results:
            spread = _of_path(results, path, "amp_dc_spread") / 2 * 1e3
            axis.vlines(size, mean - spread, mean + spread, color="C0", linewidth=1.0)
        axis.set(title=plain_label(path), ylim=(0.0, None))
        axis.grid(visible=True, alpha=0.3)
    for axis in axes.flat[len(summary.paths) :]:
        axis.set_axis_off()
    figure.supxlabel("mean clearance of the pins, mm", fontsize="medium")
    figure.supylabel("mean error, mm", fontsize="medium")
    return svg_text(figure, title)


def _of_path(results: Dataset, path: str, feature: str) -> Any:
    return np.asarray(results[f"{path}_{feature}"].to_numpy())
