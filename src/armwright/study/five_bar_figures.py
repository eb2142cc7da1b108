"""The figures of the study of the five-bar with joint clearance."""

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from armwright.arrays import Array
from armwright.clearance.assessment import ClearanceRun
from armwright.clearance.correction import Correction
from armwright.clearance.features import WINDOW, spectrum
from armwright.clearance.ideal import tip_position
from armwright.clearance.paths import PickAndPlace, named_path
from armwright.clearance.scenario import Scenario
from armwright.clearance.simulation import Simulation
from armwright.report.clearance_figures import paths, spectrum_figure, surface
from armwright.report.clearance_run_figures import clearance_run_figures
from armwright.report.figures import Drawing, curves
from armwright.study import five_bar_clearance as study

_over_time = partial(curves, x_label="time, s")
_SHOWN = {"slope": "slope, mm/s", "intercept": "intercept, mm", "amp_dc": "amplitude, mm"}


def figures(swept: study.SweepResult, correction: Correction) -> list[Drawing]:
    """Return all figures in the order of their numbers."""
    return [*_single_run(), *_curves(), *_surfaces(swept), *_arm_a(), *_corrected(correction)]


def _single_run() -> list[Drawing]:
    """Draw figures 4.6 to 4.9: path y1 with a clearance of half a millimetre in every joint."""
    run = _half("y1")
    drives = "Figure 4.6: drives on path y1"
    drawn = [Drawing("figure4.06", drives, _torques(drives, run.scenario))]
    numbers = {"path": 7, "bearings": 8, "error": 9}
    for drawing in clearance_run_figures(ClearanceRun.of(run)):
        if drawing.name in numbers:
            number = numbers[drawing.name]
            drawn.append(Drawing(f"figure4.{number:02d}", f"Figure 4.{number}: {drawing.caption}", drawing.svg))
    return drawn


def _curves() -> list[Drawing]:
    """Draw figures 4.10 to 4.13: error curves of paths along y and x, and their spectra."""
    y, x = ({name: _half(name) for name in names} for names in (("y1", "y3"), ("x2", "x5")))
    first = x["x2"]
    start, end = first.scenario.path.knots[1:3]
    fits = {f"fit of {name}": _fit(run) for name, run in y.items()}
    title = "Figure 4.10: error curves along y, and the straight part that is fitted"
    along_x = "Figure 4.11: error curves along x"
    drawn = [
        Drawing("figure4.10", title, _error_curves(title, y, WINDOW, fits=fits)),
        Drawing("figure4.11", along_x, _error_curves(along_x, x, (start, end))),
    ]
    spectra = {name: spectrum(run.distance) * 1e3 for name, run in x.items()}
    frequencies = np.arange(len(spectra["x2"])) / (len(first.time) * (first.time[1] - first.time[0]))
    for number, title, highest in (
        ("4.12", "Figure 4.12: spectra of the error along x; the constant part counts twice", 500.0),
        ("4.13", "Figure 4.13: spectra of the error along x, 0 to 20 Hz", 20.0),
    ):
        low = frequencies <= highest
        shown = {name: values[low] for name, values in spectra.items()}
        drawn.append(Drawing(f"figure{number}", title, spectrum_figure(title, frequencies[low], shown, "mm")))
    return drawn


def _surfaces(swept: study.SweepResult) -> list[Drawing]:
    """Draw figures 4.14 to 4.22: each feature of path y1 over the play of J2 and J4, for three of J3."""
    drawn = []
    levels = np.array(study.LEVELS)
    number = 14
    for feature, label in _SHOWN.items():
        table = swept.values[f"y1_{feature}"].reshape(9, 9, 9) * 1e3
        for c3 in (0.1e-3, 0.25e-3, 0.5e-3):
            k = int(np.abs(levels - c3).argmin())
            title = f"Figure 4.{number}: {label.partition(',')[0]} on path y1, play of J3 {c3 * 1e3:g} mm"
            axes = ("play of J2, mm", "play of J4, mm", label)
            svg = surface(title, levels * 1e3, levels * 1e3, table[:, k, :], axes)
            drawn.append(Drawing(f"figure4.{number}", title, svg))
            number += 1
    return drawn


def _arm_a() -> list[Drawing]:
    """Draw figures 5.4 to 5.6: error curves of arm A on its three paths."""
    drawn = []
    for number, path in zip((4, 5, 6), study.PATHS, strict=True):
        both = {
            "speed of centres, as the thesis": study.run_of("A", path, study.SETTINGS),
            "speed of surfaces": study.run_of("A", path, study.SURFACE),
        }
        title = f"Figure 5.{number}: error of arm A on path {path}"
        drawn.append(Drawing(f"figure5.{number:02d}", title, _error_curves(title, both, WINDOW)))
    return drawn


def _corrected(correction: Correction) -> list[Drawing]:
    """Draw figures 5.10 to 5.13: the path as it is and corrected, what arm A makes of it, drives, speeds."""
    both = {"path as it is": PickAndPlace().path(), "path corrected": correction.path}
    targets = np.array(PickAndPlace().nodes) * 1e3
    runs = {name: study.simulated(path, study.ARMS["A"]) for name, path in both.items()}
    wanted = tip_position(study.arm(), runs["path as it is"].scenario.ideal.q) * 1e3
    told = {name: tip_position(study.arm(), run.scenario.ideal.q) * 1e3 for name, run in runs.items()}
    commanded = {name: {"wanted": wanted, "told": told[name]} for name in both}
    taken = {name: {"wanted": wanted, "taken": run.tip * 1e3} for name, run in runs.items()}
    drawn = [
        Drawing(f"figure5.{number}", f"Figure 5.{number}: {text}", paths(f"Figure 5.{number}: {text}", shown, targets))
        for number, text, shown in (
            (10, "the path, and the path corrected", commanded),
            (11, "what arm A makes of them", taken),
        )
    ]
    for letter, (name, run) in zip("ab", runs.items(), strict=True):
        title = f"Figure 5.12 {letter}: drives, {name}"
        drawn.append(Drawing(f"figure5.12{letter}", title, _torques(title, run.scenario)))
    for letter, (name, path) in zip("ab", both.items(), strict=True):
        times = np.linspace(0.0, path.duration, 1001)
        moment = path.evaluate(times)
        lines = {
            "speed x, m/s": moment.velocity[:, 0],
            "speed y, m/s": moment.velocity[:, 1],
            "acceleration x, 10 m/s²": moment.acceleration[:, 0] / 10,
            "acceleration y, 10 m/s²": moment.acceleration[:, 1] / 10,
        }
        title = f"Figure 5.13 {letter}: speeds and accelerations, {name}"
        drawn.append(Drawing(f"figure5.13{letter}", title, _over_time(title, times, lines, y_label="m/s, 10 m/s²")))
    return drawn


def _half(name: str) -> Simulation:
    return study.simulated(named_path(name), (0.5e-3,) * 3)


def _fit(run: Simulation) -> tuple[Array, Array]:
    inside = (run.time >= WINDOW[0]) & (run.time <= WINDOW[1])
    slope, intercept = np.polyfit(run.time[inside], run.distance[inside] * 1e3, 1)
    ends = np.array([0.0, 0.2])
    return ends, intercept + slope * ends


def _torques(title: str, scenario: Scenario) -> str:
    some = slice(None, None, 20)
    times = np.asarray(np.arange(len(scenario.ideal.q))[some] * scenario.h, dtype=np.float64)
    lines = {f"M{i + 1}": scenario.ideal.efforts[some, i] for i in range(2)}
    return _over_time(title, times, lines, y_label="torque, N m")


def _error_curves(title: str, runs: Mapping[str, Simulation], span: tuple[float, float], **options: Any) -> str:
    """Draw the errors of the tip of some runs, with a span of the time marked."""
    time = next(iter(runs.values())).time
    errors = {name: run.distance * 1e3 for name, run in runs.items()}
    return _over_time(title, time, errors, y_label="error, mm", spans=(span,), **options)
