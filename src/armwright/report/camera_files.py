"""The files of a calibration of a camera: lines of a cell file, all numbers, the corners, a page and its figures."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from armwright.calibration.board import BoardView
from armwright.calibration.camera_calibration import CameraCalibration
from armwright.calibration.camera_tables import corners_text
from armwright.files.pictures import read_grey_picture
from armwright.report.elements import Card, Tile, downloads, figures, tables
from armwright.report.figures import Drawing, empty_figure, plain_label, svg_text
from armwright.report.static_page import static_page

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# A residual of the median length is drawn as long as this part of the width of the picture.
_ARROW = 0.02
# What lies beside the page.
_BESIDE = {
    "camera.toml": "lines of a cell file: the camera with its lens and its pose",
    "errors.json": "all numbers with standard errors and intervals",
    "corners.csv": "the corners in the pictures",
}
# The longer side of a picture that is shown [px].
_LONGEST = 800


def camera_files(
    calibration: CameraCalibration, *, title: str, command: str, example: Path | None = None
) -> dict[str, str]:
    """Return the files of a calibration of a camera by name.

    Args:
        calibration: of the camera.
        title: of the page.
        command: the command line that made it.
        example: the first picture, which is shown with its corners; None where there are only corners.
    """
    drawn = [
        Drawing(
            "residuals",
            "Residuals of the corners where they are in the picture, enlarged",
            svg_text(_residuals_figure(calibration)),
        ),
        Drawing("figure-pictures", "The pictures one by one", svg_text(_pictures_figure(calibration))),
    ]
    if example is not None:
        view = calibration.views.views[0]
        drawn.append(
            Drawing("figure-corners", f"Corners found in {view.name}", svg_text(_corners_figure(view, example)))
        )
    count = len(calibration.views)
    lines = f"# {command}\n{calibration.cell_lines()}".replace("\r", " ")
    return {
        "camera.toml": lines,
        "errors.json": json.dumps(calibration.as_data(), indent=2) + "\n",
        "corners.csv": corners_text(calibration.views),
        "report.html": static_page(
            title=title,
            command=command,
            sections=[
                Card("Numbers", tables(calibration.tables())),
                Card("Residuals", figures(drawn)),
                Card("Files", downloads(_BESIDE | {f"{one.name}.svg": one.caption for one in drawn})),
            ],
            numbers=_tiles(calibration),
            notes=[note for note in calibration.notes if note not in calibration.warnings],
            warnings=calibration.warnings,
            named=(
                ("Camera", calibration.name),
                ("Pictures", str(count)),
                ("Corners", str(len(calibration.views.pixels))),
            ),
            verdict=("doubtful", False) if calibration.contradictions else None,
        ),
        **{drawing.name + ".svg": drawing.svg for drawing in drawn},
    }


def _tiles(calibration: CameraCalibration) -> Iterator[Tile]:
    """Give the residuals of the corners, how well the pictures agree with the arm, and the focal length."""
    fit, alone = calibration.hand_eye, calibration.intrinsics
    if alone is not None:
        yield Tile(f"{alone.sigma:.3g} px", "standard deviation of a coordinate of a corner")
    if fit is not None:
        yield Tile(f"{fit.disagreement:.2f} x", "as far from the arm as its accuracy and the noise explain")
    yield Tile(f"{calibration.lens.numbers[0]:.1f} px", "focal length along x")


def _residuals_figure(calibration: CameraCalibration) -> "Figure":
    fitted = calibration.intrinsics or calibration.hand_eye
    pixels, residuals = (np.zeros((0, 2)),) * 2 if fitted is None else (fitted.views.pixels, fitted.residuals)
    lens = calibration.lens
    lengths = np.linalg.norm(residuals, axis=1)
    factor = _ARROW * lens.width / max(float(np.median(lengths)), 1e-9)
    figure = empty_figure((7.4, 7.4 * lens.height / lens.width + 0.6))
    axes = figure.subplots()
    axes.quiver(
        *pixels.T, *residuals.T * factor, lengths, angles="xy", scale_units="xy", scale=1, width=0.0016, cmap="viridis"
    )
    axes.set(
        xlim=(-0.5, lens.width - 0.5),
        ylim=(lens.height - 0.5, -0.5),
        xlabel=f"x, px; arrows are {factor:.0f} times as long; median {np.median(lengths):.3f} px",
        ylabel="y, px",
        aspect="equal",
    )
    axes.grid(visible=True, alpha=0.3)
    return figure


def _pictures_figure(calibration: CameraCalibration) -> "Figure":
    fit, alone = calibration.hand_eye, calibration.intrinsics
    bars = []
    if alone is not None:
        bars.append(("rms of corners, px", alone.views.names, alone.rms_by_picture, 0))
    if fit is not None:
        bars.append(("against the arm", fit.names, fit.by_picture, 1))
    figure = empty_figure((7.4, 2.2 * len(bars) + 0.6))
    for axes, (label, names, values, colour) in zip(np.ravel(figure.subplots(len(bars), 1)), bars, strict=True):
        numbers = [calibration.views.names.index(name) + 1 for name in names]
        axes.bar(numbers, values, color=f"C{colour}")
        axes.set(ylabel=label, xlim=(0.4, len(calibration.views) + 0.6))
        axes.grid(visible=True, axis="y", alpha=0.3)
        if colour:
            axes.axhline(1.0, color="0.3", linestyle="--", linewidth=1)
            axes.set_xlabel("picture")
    return figure


def _corners_figure(view: BoardView, example: Path) -> "Figure":
    picture = read_grey_picture(example)
    step = max(1, max(picture.shape) // _LONGEST)
    height, width = picture.shape
    figure = empty_figure((7.4, 7.4 * height / width + 0.5))
    axes = figure.subplots()
    axes.imshow(picture[::step, ::step], cmap="gray", vmin=0, vmax=255, extent=(-0.5, width - 0.5, height - 0.5, -0.5))
    axes.plot(*view.pixels.T, "o", markersize=6, markerfacecolor="none", color="C1")
    for number, (x, y) in zip(view.corners.tolist(), view.pixels.tolist(), strict=True):
        axes.annotate(str(number), (x, y), xytext=(4, -4), textcoords="offset points", fontsize=6, color="C1")
    axes.set(xlabel=f"x, px, of {plain_label(view.name)}", ylabel="y, px")
    return figure
