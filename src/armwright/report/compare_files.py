"""The files of a comparison of two linkages: a map of their errors, a table, a page."""

import json
from typing import Any

import numpy as np

from armwright.clearance.error_map import ErrorMap
from armwright.report.elements import Card, downloads, figures, tables
from armwright.report.figures import Drawing, empty_figure, plain_label, svg_text
from armwright.report.motion_table import csv_lines
from armwright.report.static_page import static_page


def compare_files(compared: ErrorMap, *, command: str) -> dict[str, Any]:
    """Return the files of a comparison by name.

    Args:
        compared: both linkages.
        command: the command line that made it.
    """
    drawn = _map(compared)
    columns = {"x_m": compared.positions[:, 0], "y_m": compared.positions[:, 1]}
    for label, error, spread in zip(("first", "second"), compared.errors, compared.spreads, strict=True):
        columns[f"{label}.error_x_m"], columns[f"{label}.error_y_m"] = error.T
        columns[f"{label}.spread_m"] = spread
    beside = {"compare.json": "the numbers, in SI units", "map.csv": "errors at each position", "map.svg": "the map"}
    return {
        "compare.json": json.dumps({"command": command, **compared.as_data()}, indent=2, ensure_ascii=False) + "\n",
        "map.csv": csv_lines(columns, 9),
        "report.html": static_page(
            title=f"{compared.names[0]} and {compared.names[1]}: errors over the workspace",
            command=command,
            sections=[
                Card("Errors", tables(compared.tables())),
                Card("Map", figures([drawn])),
                Card("Files", downloads(beside)),
            ],
            notes=compared.notes,
        ),
        "map.svg": drawn.svg,
    }


def _map(compared: ErrorMap) -> Drawing:
    figure = empty_figure((11.4, 3.8))
    sizes = compared.sizes * 1e3
    known = np.all(np.isfinite(sizes), axis=0)
    top, difference = float(np.quantile(sizes[:, known], 0.99)), sizes[1] - sizes[0]
    apart = max(float(np.quantile(np.abs(difference[known]), 0.99)), 1e-9)
    panels = [(name, size, (0.0, top), "viridis") for name, size in zip(compared.names, sizes, strict=True)]
    panels.append(("second - first", difference, (-apart, apart), "coolwarm"))
    for axis, (name, values, (low, high), colours) in zip(figure.subplots(1, 3), panels, strict=True):
        x, y = compared.positions[known].T * 1e3
        # Squares as wide as a cell of the map, in points.
        width = 72 * 2.6 * compared.cell * 1e3 / max(float(np.ptp(x)), 1e-9)
        shown = axis.scatter(
            x, y, c=values[known], s=width**2, marker="s", vmin=low, vmax=high, cmap=colours, linewidths=0
        )
        axis.set(title=plain_label(name), xlabel="x, mm")
        axis.set_aspect("equal")
        figure.colorbar(shown, ax=axis, label="mm", shrink=0.8)
    return Drawing("map", "Error of the tip at rest: both linkages, and the second less the first", svg_text(figure))
