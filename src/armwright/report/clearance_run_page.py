"""The page of a clearance run: the moving linkage, its journals in their bearings, and charts over time.

The page is a single HTML file. The names of its arrays end with their unit.
"""

from collections.abc import Iterator, Mapping, Sequence
from string import Template
from typing import Any

import attrs
import numpy as np

from armwright.clearance.assessment import ClearanceRun
from armwright.clearance.ideal import point_position
from armwright.clearance.lane_layout import Integers
from armwright.clearance.linkage import GROUND, BodyPoint, Guide, Linkage, Pin
from armwright.report.clearance_run_figures import magnification_factor, wall_outlines
from armwright.report.elements import (
    Tile,
    badge,
    downloads,
    facts,
    figures,
    headline,
    pairs,
    remarks,
    table,
    warnings as shown_warnings,
)
from armwright.report.figures import Drawing
from armwright.report.markup import asset, page_html
from armwright.report.stick_figure import thinned_rows
from armwright.version import __version__

# Rows of a page at most, and the size of the largest error on the screen relative to that of the linkage.
_MAX_ROWS, _ERROR_SHARE = 2600, 0.09
_SCRIPTS = ("plane.js", "bearings.js", "charts.js", "clearance_run_charts.js", "clearance_run.js")
_MICRO = 1e6
# Figures that are not charts drawn by the scripts.
_STATIC_FIGURES = ("path", "workspace", "bearings", "spectrum")
# Which way the coordinates of the plane count.
_DIRECTED = {"x mm": "x mm →", "y mm": "y mm ↑"}
# What lies beside the page.
_BESIDE = {"summary.json": "the summary of the run", "samples.csv": "all samples, in SI units"}


def animation_data(run: ClearanceRun) -> dict[str, Any]:
    """Return the data of the scripts of the page, at r instants: as many as a screen can tell apart.

    Returns:
        duration: shown duration [s].
        t: (r,) instants [s].
        ground_m: points on the ground, (x, y) each.
        rails: guides on the ground: x, y [m] and direction [rad] of each.
        bodies: names of the bodies with the indices of their points.
        motors: for each drive x, y of its joint on the ground, or the index of its point.
        points_m: (r, 2 k) positions of the points of all bodies without clearance.
        shifts_um: (r, 2 k) displacements of the points by clearance.
        tip: index of the point that is the tip.
        path_m: (r, 2) positions of the tip without clearance.
        error_um: (r, 2) error of the tip.
        pins: name, clearance, farthest place of the journal, indices of the centres of bearing and journal, largest
            force of each pin, and outlines of its wall at equally spaced rows, where it is worn.
        gaps_um: (r, 2 p) vectors from the centre of each bearing to that of its journal.
        forces_N: (r, p) contact forces; the largest since the previous row.
        flies: (r, p) 1 where a journal does not touch its bearing.
        energy_J: (r, 6) driven, kinetic, potential, impact loss, friction loss, residual of the balance.
        magnification: initial magnification of the displacements.
    """
    simulation, linkage = run.simulation, run.simulation.scenario.linkage
    rows = thinned_rows(run.rows, _MAX_ROWS)
    points = [BodyPoint(body.name, point) for body in linkage.bodies for point in body.points]
    q = simulation.q[rows]
    ideal_q = simulation.scenario.ideal.q[rows * simulation.scenario.stride]
    actual = np.stack([point_position(linkage, point, q) for point in points], axis=1)
    ideal = np.stack([point_position(linkage, point, ideal_q) for point in points], axis=1)
    energy = run.energy
    tracks = (energy.driven, energy.kinetic, energy.potential, energy.impact_loss, energy.friction_loss)
    return {
        "duration": float(run.time[-1]),
        "t": run.time[rows],
        "ground_m": [[float(x) for x in point] for point in linkage.ground.points.values()],
        "rails": _guide_data(linkage),
        "bodies": [
            {"name": body.name, "points": [i for i, point in enumerate(points) if point.body == body.name]}
            for body in linkage.bodies
        ],
        "motors": [_motor_data(linkage, drive.body, points) for drive in linkage.drives],
        "points_m": ideal.reshape(len(rows), -1),
        "shifts_um": (actual - ideal).reshape(len(rows), -1) * _MICRO,
        "tip": points.index(linkage.tip) if linkage.tip in points else -1,
        "path_m": simulation.tip[rows] - simulation.error[rows],
        "error_um": simulation.error[rows] * _MICRO,
        "pins": _pin_data(run, points, rows),
        "gaps_um": run.gaps[rows].reshape(len(rows), -1) * _MICRO,
        # A blow between two rows is not lost.
        "forces_N": np.maximum.reduceat(simulation.forces[: run.rows], rows, axis=0),
        "flies": (run.depths[rows] < 0).astype(np.float64),
        "energy_J": np.stack([track[rows] for track in (*tracks, energy.imbalance)], axis=-1),
        "magnification": magnification_factor(
            ideal.reshape(-1, 2), np.concatenate([actual - ideal, simulation.error[rows, None]], 1), _ERROR_SHARE
        ),
    }


def clearance_run_page(run: ClearanceRun, drawn: Sequence[Drawing], *, title: str, command: str) -> str:
    """Return the text of the page.

    Args:
        run: the run.
        drawn: its figures.
        title: heading of the page.
        command: the command line that made it.

    Returns:
        HTML text; write it as UTF-8.
    """
    data = run.as_data()
    pins, targets, totals, *rods = run.tables()
    shown = [drawing for drawing in drawn if drawing.name in _STATIC_FIGURES]
    return page_html(
        title=title,
        badge=badge(data["status"], good=run.finished),
        facts=facts(_facts(data, command)),
        notes=shown_warnings(run.warnings),
        main=Template(asset("clearance_run.html")).substitute(
            headline=headline(_tiles(run, data)) + remarks(note for note in run.notes if note not in run.warnings),
            pins=table(pins),
            targets=table(attrs.evolve(targets, heads=[_DIRECTED.get(head, head) for head in targets.heads])),
            rods="".join(table(rod) for rod in rods),
            totals=pairs((name, f"{value} {unit}") for name, value, unit in totals.rows),
            settings=pairs(_settings(data)),
            figures=figures(sorted(shown, key=lambda drawing: _STATIC_FIGURES.index(drawing.name))),
            files=downloads(_BESIDE | {f"{drawing.name}.svg": drawing.caption for drawing in drawn}),
        ),
        styles=("figures.css", "clearance_run.css"),
        scripts=_SCRIPTS,
        data=animation_data(run),
        generated=f"armwright {__version__}: {command}",
    )


# ---- the film ------------------------------------------------------------------------------------------------------


def _pin_data(run: ClearanceRun, points: Sequence[BodyPoint], rows: Integers) -> list[dict[str, Any]]:
    """Return the pins; a bearing or journal on the ground has a position instead of an index."""
    linkage = run.simulation.scenario.linkage
    pins = []
    for i, pin in enumerate(linkage.pins):
        bearing, journal = (
            points.index(point) if point in points else [float(x) for x in linkage.point(point)]
            for point in (pin.bearing, pin.journal)
        )
        clearance, peak = float(run.simulation.clearances[i]) * _MICRO, float(run.simulation.peaks[i])
        outlines = np.zeros((0, 0, 2)) if run.simulation.worn is None else wall_outlines(run, i, rows) * _MICRO
        reach = float(np.linalg.norm(outlines, axis=-1).max(initial=clearance))
        ends = {"bearing": bearing, "journal": journal}
        drawn = {"reach_um": reach, "outlines_um": [np.round(outline, 2).ravel().tolist() for outline in outlines]}
        pins.append({"name": pin.name, "clearance_um": clearance, "peak_N": peak, **drawn, **ends})
    return pins


def _guide_data(linkage: Linkage) -> list[list[float]]:
    guides = [joint for joint in linkage.joints if isinstance(joint, Guide) and joint.on.body == GROUND]
    return [[*(float(x) for x in linkage.point(guide.on)), guide.direction] for guide in guides]


def _motor_data(linkage: Linkage, body: str, points: Sequence[BodyPoint]) -> int | list[float]:
    joint = linkage.joint(body)
    assert joint is not None  # noqa: S101 - a linkage has no drive without one
    if isinstance(joint, Pin) and joint.on.body == GROUND:
        return [float(x) for x in linkage.point(joint.on)]
    return points.index(BodyPoint(joint.body, joint.point))


# ---- texts ---------------------------------------------------------------------------------------------------------


def _tiles(run: ClearanceRun, data: Mapping[str, Any]) -> Iterator[Tile]:
    """Give the error of the tip, the largest force, free flight, and what the energy balance leaves."""
    error, pins = data["error"], data["pins"]
    yield Tile(f"{error['largest'] * 1e3:.4g} mm", "largest error of the tip")
    yield Tile(f"{error['mean'] * 1e3:.4g} mm", "mean error of the tip")
    peaks = {name: pin["peak_force"] for name, pin in pins.items()}
    name = max(peaks, key=lambda pin: float("inf") if peaks[pin] is None else peaks[pin])
    force = "∞" if peaks[name] is None else f"{peaks[name]:.4g}"
    yield Tile(f"{force} N", f"largest contact force, in {name}")
    yield Tile(str(sum(pin["impacts"] for pin in pins.values())), "impacts in all bearings")
    if run.predictability is not None:
        certain = run.predictability.to_the_end
        until = "to the end" if certain else f"until {data['predictable_until'] * 1e3:.4g} ms"
        yield Tile(until, "predictable", mark="" if certain else "warn")


def _facts(data: Mapping[str, Any], command: str) -> Iterator[tuple[str, str]]:
    yield "Linkage", data["linkage"]
    yield "Path", f"{data['path']}, {data['duration']:.4g} s"
    yield "Clearance", ", ".join(f"{name} {pin['clearance'] * 1e3:.4g} mm" for name, pin in data["pins"].items())
    yield "Command", command


def _settings(data: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    used = data["settings"]
    step = f"step {used['step']:.3g} s{', impacts located' if used['located'] else ''}"
    yield "Integrator", f"{used['integrator']}, {step}, sampled every {used['sample']:.3g} s"
    gains = f", {used['gains'][0]:g} N m/rad and {used['gains'][1]:g} N m s/rad" if "gains" in used else ""
    yield "Control", f"{used['control']}{gains}"
    yield "Start", used["start"]
    nominal, computed = used["restitution_asked"], used["restitution_given"]
    yield "Impact", f"{used['impact_law']}, restitution {nominal:g} nominal, {computed:.3g} computed"
    threshold = "" if used["friction_law"] == "lugre" else f", fading below {used['friction_threshold'] * 1e3:g} mm/s"
    yield "Friction", f"{used['friction']:g}, {used['friction_law']}, of the {used['friction_velocity']}{threshold}"
    yield "Material", f"E {used['young'] / 1e9:g} GPa, ν {used['poisson']:g}"
    radii = ", ".join(f"{name} {radius * 1e3:g}" for name, radius in used["journal_radius"].items())
    yield "Radius of the journals", f"{radii} mm"
    yield "Versions", ", ".join(f"{name} {version}" for name, version in data["versions"].items())
