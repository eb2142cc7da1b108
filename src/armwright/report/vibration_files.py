"""The files of an assessment of vibrations: a page, its numbers, and figures along the motion."""

import json
from collections.abc import Iterator

import numpy as np

from armwright.arrays import Array
from armwright.dynamics.vibration import VibrationAssessment
from armwright.kinematics.forward_kinematics import link_poses
from armwright.report.elements import Card, Tile, downloads, figures, tables
from armwright.report.figures import Drawing, empty_figure, plain_axes, svg_text
from armwright.report.mode_shapes import MovingLine, mode_drawing
from armwright.report.static_page import static_page
from armwright.report.stick_figure import skeleton_points

# A step of the farthest joint, by which the displacement of a mode is taken [rad, m]; direction of view [rad].
_STEP, _AZIMUTH, _ELEVATION = 1e-4, np.radians(-60.0), np.radians(20.0)


def vibration_files(assessment: VibrationAssessment, *, command: str) -> dict[str, str]:
    """Return the files of an assessment by name.

    Args:
        assessment: of the vibrations.
        command: the command line that made it.
    """
    drawn, swinging = list(_drawings(assessment)), list(_swinging(assessment))
    every = [*drawn, *swinging]
    beside = {"vibration.json": "frequencies, damping, shapes, compliance and deflection of every configuration"}
    return {
        "vibration.json": json.dumps(assessment.as_data(), indent=2, ensure_ascii=False) + "\n",
        "report.html": static_page(
            title=f"Vibrations of {assessment.arm.name}",
            command=command,
            sections=[
                Card("Vibrations and deflection", tables(assessment.tables())),
                Card("Figures", figures(drawn)),
                Card(
                    f"Mode shapes at configuration {assessment.numbers[assessment.softest]}",
                    figures(swinging),
                    "magnified",
                ),
                Card("Files", downloads(beside, every)),
            ],
            numbers=_tiles(assessment),
            notes=assessment.notes,
            warnings=(),
            verdict=None,
        ),
        **{f"{drawing.name}.svg": drawing.svg for drawing in every},
    }


def _tiles(assessment: VibrationAssessment) -> Iterator[Tile]:
    yield Tile(f"{assessment.modes.frequencies.min():.2f} Hz", "lowest frequency")
    yield Tile(f"{assessment.stretch.max() * 1e6:.3f} mm/kN", "compliance in the softest direction")
    yield Tile(f"{np.linalg.norm(assessment.deflection, axis=1).max() * 1e3:.3f} mm", "largest deflection of the tool")


def _drawings(assessment: VibrationAssessment) -> Iterator[Drawing]:
    yield Drawing("shapes", "shapes of the modes: how far each joint moves, the farthest as 1", _shapes(assessment))
    if len(assessment.q) > 1:
        frequencies = {f"mode {i + 1}": f for i, f in enumerate(assessment.modes.frequencies.T)}
        yield Drawing(
            "frequencies",
            "frequencies along the motion",
            _along(assessment, frequencies, "Frequencies along the motion", "frequency, Hz"),
        )
        lengths = {"at rest": np.linalg.norm(assessment.at_rest, axis=1) * 1e3}
        if assessment.moving:
            lengths["in motion"] = np.linalg.norm(assessment.deflection, axis=1) * 1e3
        yield Drawing(
            "deflection",
            "deflection of the tool along the motion",
            _along(assessment, lengths, "Deflection of the tool", "deflection, mm"),
        )


def _swinging(assessment: VibrationAssessment) -> Iterator[Drawing]:
    """Give the modes of the softest configuration in motion, looked at from a little above."""
    q, modes = assessment.q[assessment.softest], assessment.modes
    frequencies, shapes = modes.frequencies[assessment.softest], modes.shapes[assessment.softest]
    across = np.array([-np.sin(_AZIMUTH), np.cos(_AZIMUTH), 0.0])
    ahead = np.array([np.cos(_AZIMUTH), np.sin(_AZIMUTH), 0.0])
    up = np.cos(_ELEVATION) * np.array([0.0, 0.0, 1.0]) - np.sin(_ELEVATION) * ahead
    view = np.stack([across, up], axis=-1)
    for i, (frequency, shape) in enumerate(zip(frequencies, shapes.T, strict=True)):
        step = _STEP * shape / np.abs(shape).max()
        behind, rest, before = skeleton_points(
            assessment.arm, link_poses(assessment.arm, q + np.outer((-1, 0, 1), step))
        )
        shift = (before - behind) / (2 * _STEP)
        yield mode_drawing(
            f"mode-{i + 1}", f"Mode {i + 1}, {frequency:.2f} Hz", [MovingLine(rest @ view, shift @ view)]
        )


def _along(assessment: VibrationAssessment, curves: dict[str, Array], title: str, label: str) -> str:
    figure = empty_figure((7.4, 3.6))
    axes = plain_axes(figure, "configuration", label)
    for name, values in curves.items():
        axes.plot(assessment.numbers, values, label=name)
    if "Hz" in label:
        axes.set_yscale("log")
        axes.yaxis.set_major_formatter("{x:g}")
        low, high = axes.get_ylim()
        axes.yaxis.set_minor_formatter("{x:g}" if high < 10 * low else "")
    else:
        axes.set_ylim(bottom=0)
    axes.legend(fontsize="small", loc="center left", bbox_to_anchor=(1.01, 0.5))
    return svg_text(figure, title)


def _shapes(assessment: VibrationAssessment) -> str:
    p = assessment.softest
    shapes, frequencies = assessment.modes.shapes[p], assessment.modes.frequencies[p]
    count, n = len(frequencies), assessment.arm.n
    figure = empty_figure((7.4, 3.4))
    axes = plain_axes(figure, "joint", "part of the farthest joint")
    width = 0.8 / count
    for i, f in enumerate(frequencies):
        scaled = shapes[:, i] / shapes[np.abs(shapes[:, i]).argmax(), i]
        axes.bar(np.arange(1, n + 1) + (i - (count - 1) / 2) * width, scaled, width, label=f"{f:.2f} Hz")
    axes.set_xticks(np.arange(1, n + 1))
    axes.axhline(0, color="C7", linewidth=1)
    axes.legend(fontsize="small", loc="center left", bbox_to_anchor=(1.01, 0.5))
    return svg_text(figure, f"Shapes of the modes at configuration {assessment.numbers[p]}")
