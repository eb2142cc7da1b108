"""Figures of several runs of linkages with clearance: features over clearances, original and corrected paths."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from armwright.arrays import Array
from armwright.report.figures import empty_figure, figure_title, plain_label, svg_text

# Half the width of what is shown around a target [mm].
_DETAIL_HALF_WIDTH = 1.5


def surface(title: str, x: Array, y: Array, z: Array, labels: Sequence[str]) -> str:
    """Draw a quantity over two others, as a surface with its points and the contours below it.

    Args:
        title: title of the figure.
        x: (a,) values along the first axis.
        y: (b,) values along the second axis.
        z: (a, b) the quantity.
        labels: labels of the three axes, with units.

    Returns:
        An SVG file's text.
    """
    figure = empty_figure((6.6, 5.0))
    axis: Any = figure.add_subplot(projection="3d")
    X, Y = np.meshgrid(x, y, indexing="ij")
    axis.plot_surface(X, Y, z, cmap="viridis", alpha=0.85, linewidth=0.3, edgecolor="0.35")
    axis.scatter(X.ravel(), Y.ravel(), z.ravel(), s=5, color="0.15", depthshade=False)
    axis.set(title=figure_title(figure, title), xlabel=labels[0], ylabel=labels[1], zlabel=labels[2])
    axis.locator_params(nbins=5)
    axis.view_init(elev=24, azim=-128)
    axis.set_box_aspect(None, zoom=0.88)
    return svg_text(figure)


def spectrum_figure(title: str, frequencies: Array, spectra: Mapping[str, Array], unit: str) -> str:
    """Draw amplitudes over frequency, with the lines of several spectra side by side.

    Args:
        title: title of the figure.
        frequencies: (m,) [Hz].
        spectra: (m,) by name.
        unit: unit of the amplitudes.

    Returns:
        An SVG file's text.
    """
    figure = empty_figure((7.2, 2.3 * len(spectra) + 0.8))
    panels = figure.subplots(len(spectra), sharex=True, squeeze=False)[:, 0]
    for axis, (name, values) in zip(panels, spectra.items(), strict=True):
        axis.vlines(frequencies, 0, values, color="C0", linewidth=1.6)
        axis.plot(frequencies, values, "o", color="C0", markersize=3)
        axis.set(title=plain_label(name), ylabel=f"amplitude, {unit}")
        axis.set_ylim(bottom=0)
        axis.grid(visible=True, alpha=0.3)
    panels[-1].set_xlabel("frequency, Hz")
    return svg_text(figure, title)


def paths(title: str, panels: Mapping[str, Mapping[str, Array]], targets: Array) -> str:
    """Draw paths in the plane, several panels side by side, and around each target what happens there.

    Args:
        title: title of the figure.
        panels: by title, (m, 2) positions by the name of the path [mm].
        targets: (k, 2) [mm].

    Returns:
        An SVG file's text.
    """
    figure = empty_figure((4.6 * len(panels) + 0.6, 6.4))
    columns = len(targets)
    grid = figure.add_gridspec(2, len(panels) * columns, height_ratios=(1.7, 1.0))
    for i, (name, lines) in enumerate(panels.items()):
        axis = figure.add_subplot(grid[0, i * columns : (i + 1) * columns])
        _draw_paths(axis, lines, targets)
        axis.set(title=plain_label(name), xlabel="x, mm", ylabel="y, mm")
        axis.set_aspect("equal", adjustable="datalim")
        axis.legend(fontsize="small", loc="lower center")
        for k, target in enumerate(targets):
            detail = figure.add_subplot(grid[1, i * columns + k])
            _draw_paths(detail, lines, targets)
            xlim, ylim = ((x - _DETAIL_HALF_WIDTH, x + _DETAIL_HALF_WIDTH) for x in target)
            detail.set(xlim=xlim, ylim=ylim, title=f"Q{k + 1}")
            detail.set_aspect("equal")
            detail.tick_params(labelsize="x-small")
    return svg_text(figure, title)


def _draw_paths(axis: Any, lines: Mapping[str, Array], targets: Array) -> None:
    for style, (name, positions) in zip(("k--", "C0-", "C1-"), lines.items(), strict=False):
        axis.plot(*positions.T, style, linewidth=1.2, label=plain_label(name))
    axis.plot(*targets.T, "r+", markersize=9, label="targets")
    axis.grid(visible=True, alpha=0.3)
