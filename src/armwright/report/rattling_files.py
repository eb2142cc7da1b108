"""The files of the vibration of a linkage with clearance: a page, its numbers, the ranking, modes in motion, laws."""

import json
from collections.abc import Iterator

import numpy as np

from armwright.arrays import Array
from armwright.clearance.ideal import place_bodies, point_derivatives
from armwright.clearance.linkage import BodyPoint, Linkage
from armwright.clearance.placement import Placement
from armwright.clearance.vibration.assessment import QUANTITIES, PathModes, RattlingAssessment
from armwright.clearance.vibration.move_law import Aim
from armwright.clearance.vibration.rattling import RUNS
from armwright.report.elements import Card, Tile, downloads, figures, tables
from armwright.report.figures import Drawing, curves, empty_figure, plain_axes, plain_label, svg_text
from armwright.report.mode_shapes import MovingLine, mode_drawing
from armwright.report.static_page import static_page

# Moments of a path at which its speed is drawn.
_MOMENTS = 251


def rattling_files(assessment: RattlingAssessment, *, command: str) -> dict[str, str]:
    """Return the files of a vibration by name.

    Args:
        assessment: of the vibration.
        command: the command line that made it.
    """
    several = len(assessment.rattlings) > 1
    drawn, swinging = [], []
    if several:
        drawn.append(_ranking(assessment))
    if isinstance(assessment.modes, PathModes):
        drawn.append(_frequencies(assessment.modes))
        swinging = list(_shapes(assessment.linkage, assessment.modes))
    if assessment.aim is not None:
        drawn.append(_laws(assessment.aim))
    sections = [Card("Paths" if several else "Vibration", tables(assessment.tables()))]
    if drawn:
        sections.append(Card("Figures", figures(drawn)))
    if swinging:
        sections.append(Card("Mode shapes at rest in the middle of the path", figures(swinging), "magnified"))
    beside = {"vibration.json": "all numbers, in SI units"}
    sections.append(Card("Files", downloads(beside, (*drawn, *swinging))))
    paths = f"{len(assessment.rattlings)} paths" if several else assessment.rattlings[0].path.name
    return {
        "vibration.json": json.dumps({"command": command, **assessment.as_data()}, indent=2, ensure_ascii=False) + "\n",
        "report.html": static_page(
            title=f"{assessment.linkage.name}: vibration on {paths}",
            command=command,
            sections=sections,
            numbers=_tiles(assessment),
            notes=assessment.notes,
        ),
        **{f"{drawing.name}.svg": drawing.svg for drawing in (*drawn, *swinging)},
    }


def _tiles(assessment: RattlingAssessment) -> Iterator[Tile]:
    ranking = assessment.ranking()
    if len(ranking) > 1:
        quantity = QUANTITIES[assessment.quantity]
        for ranked, text in ((ranking[0], "least"), (ranking[-1], "most")):
            shown = f"{ranked.mean * quantity.factor:.3g} ± {ranked.spread * quantity.factor:.2g}"
            yield Tile(shown, f"{quantity.head} on {ranked.rattling.path.name}, the {text}")
        yield Tile(f"{sum(bool(ranked.alike) for ranked in ranking)}", "paths that cannot be told from a neighbour")
        return
    (rattling,) = assessment.rattlings
    yield Tile(f"{rattling.loss.mean() * 1e3:.3g} mJ", "lost in impacts")
    yield Tile(f"{rattling.motion_rms.mean():.3g} m/s²", "acceleration of the moving tip, RMS")
    if rattling.dwell:
        yield Tile(f"{rattling.dwell_rms.mean():.3g} m/s²", "acceleration after the path, RMS")
    if isinstance(assessment.modes, PathModes):
        yield Tile(f"{np.nanmin(assessment.modes.modes.frequencies):.3g} Hz", "lowest natural frequency at rest")
    if assessment.aim is not None:
        yield Tile(f"{assessment.aim.move.rattling.loss.mean() * 1e3:.3g} mJ", "lost with the chosen move law")


def _ranking(assessment: RattlingAssessment) -> Drawing:
    quantity, ranking = QUANTITIES[assessment.quantity], assessment.ranking()
    figure = empty_figure((7.4, 1.2 + 0.24 * len(ranking)))
    axes = plain_axes(figure, quantity.head, "")
    rows = np.arange(len(ranking))
    means = np.array([ranked.mean for ranked in ranking]) * quantity.factor
    spreads = np.array([ranked.spread for ranked in ranking]) * quantity.factor
    alike = np.array([bool(ranked.alike) for ranked in ranking])
    for chosen, colour, label in ((~alike, "C0", "told from its neighbours"), (alike, "C1", "alike a neighbour")):
        if chosen.any():
            axes.errorbar(
                means[chosen], rows[chosen], xerr=spreads[chosen], fmt="o", color=colour, capsize=3, label=label
            )
    axes.set_yticks(rows, [plain_label(ranked.rattling.path.name) for ranked in ranking])
    axes.set_ylim(len(ranking) - 0.4, -0.6)
    axes.set_xlim(left=0.0)
    axes.legend(fontsize="small")
    return Drawing("ranking", f"Ranking of the paths: means and standard deviations over {RUNS} runs", svg_text(figure))


def _frequencies(along: PathModes) -> Drawing:
    figure = empty_figure((7.4, 3.8))
    axes = plain_axes(figure, "passed at, s", "frequency, Hz")
    for i, frequencies in enumerate(along.modes.frequencies.T):
        # A body that nothing holds has no place on a logarithmic axis.
        axes.plot(along.time, np.where(frequencies > 0, frequencies, np.nan), label=f"mode {i + 1}")
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter("{x:g}")
    axes.legend(fontsize="small", loc="center left", bbox_to_anchor=(1.01, 0.5))
    return Drawing("frequencies", "Natural frequencies along the path, at rest at each place", svg_text(figure))


def _shapes(linkage: Linkage, along: PathModes) -> Iterator[Drawing]:
    """Give the mode shapes in the middle of the path, each in motion."""
    middle = len(along.time) // 2
    placement = place_bodies(linkage, along.modes.q[middle])
    frequencies, shapes = along.modes.frequencies[middle], along.modes.shapes[middle]
    for i, (frequency, shape) in enumerate(zip(frequencies, shapes.T, strict=True)):
        lines = list(_moving_lines(placement, shape))
        text = "not stable" if np.isnan(frequency) else f"{frequency:.1f} Hz"
        yield mode_drawing(f"mode-{i + 1}", f"Mode {i + 1}, {text}", lines)


def _moving_lines(placement: Placement, shape: Array) -> Iterator[MovingLine]:
    def line(points: list[BodyPoint], *, ring: bool = False) -> MovingLine:
        places = np.array([[*placement.point(point).position] for point in points], dtype=np.float64)
        return MovingLine(
            places, np.array([point_derivatives(placement, point) @ shape for point in points]), ring=ring
        )

    for body in placement.linkage.bodies:
        yield line([BodyPoint(body.name, name) for name in body.points])
    for pin in placement.linkage.pins:
        yield line([pin.bearing], ring=True)


def _laws(aim: Aim) -> Drawing:
    own, chosen = aim.candidates[0].rattling.path, aim.move.rattling.path
    time = np.linspace(0.0, own.duration, _MOMENTS)
    speeds = {
        name: np.linalg.norm(path.evaluate(time).velocity, axis=-1)
        for name, path in (("the path itself", own), ("the chosen law", chosen))
    }
    text = curves("", time, speeds, x_label="time, s", y_label="speed, m/s")
    return Drawing("laws", "Speed of the tip: the path itself, and the chosen law", text)
