"""The linkages of the catalogue beside two independent simulators: with clearance in Exudyn, without in MuJoCo."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from importlib import import_module
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, ClassVar

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.clearance.exudyn.export import IMPACT_LAW, exudyn_files
from armwright.clearance.mjcf.export import mjcf_files
from armwright.clearance.paths import Path as TipPath, constant_speed_path, thesis_path
from armwright.clearance.reader import load_linkage
from armwright.clearance.scenario import Scenario, prepare_scenario
from armwright.clearance.settings import Settings
from armwright.clearance.simulation import simulate
from armwright.files.result_table import ResultTable
from armwright.mujoco_library import load_mujoco
from armwright.report.elements import Tile
from armwright.report.figures import Drawing, curves

# Farther apart, two runs with clearance have rattled apart [m].
CHAOS = 5e-6
_STEP, _EVERY = 1e-5, 1e-3
# By so much larger are the clearances of the runs that tell what rattling makes of a small difference [m].
_OTHER = 1e-8
# Below this a difference is rounding; a logarithm needs some number [m].
_ROUNDING = 1e-13
_CLOSED = "closed pins: MuJoCo gets the efforts of the linkage without clearance; the tip is to stay on the path"
_OPEN = (
    "with clearance: from some blow on, pins rattle apart; runs of armwright with clearances that are "
    f"{_OTHER * 1e9:g} nm larger tell from when differences of that size decide"
)
_EXUDYN = "Exudyn has a contact, a law of friction and an integrator of its own"
_MISSING = "Exudyn is not installed; `pip install exudyn` adds its rows"
_SPEED = 300 * 2 * math.pi / 60


@attrs.frozen(kw_only=True, eq=False)
class Comparison:
    """A linkage on its path in another simulator.

    Attributes:
        linkage: its name.
        motion: what it does.
        simulator: the other one, with its version, or what differs.
        pins: ``with clearance``, or ``closed``.
        time: (s,) of the samples [s].
        apart: (s,) distance of both tips [m].
    """

    linkage: str
    motion: str
    simulator: str
    pins: str
    time: Array
    apart: Array

    @property
    def together(self) -> int:
        """The number of samples, at least one, before the tips are farther apart than ``CHAOS``."""
        beyond = np.flatnonzero(self.apart > CHAOS)
        return max(1, int(beyond[0])) if len(beyond) else len(self.apart)


@attrs.frozen(kw_only=True, eq=False)
class LinkageSimulators:
    """All linkages of the catalogue beside other simulators.

    Attributes:
        comparisons: those that could be made.
        notes: what a reader must know.
    """

    comparisons: list[Comparison]
    notes: tuple[str, ...]

    title: ClassVar[str] = "the linkages of the catalogue beside Exudyn and MuJoCo"

    @classmethod
    def run(cls, progress: Callable[[str, float], None] | None = None) -> LinkageSimulators:
        """Run the study; without Exudyn its rows are left out, and a note tells so.

        Raises:
            MissingExtraError: MuJoCo cannot be loaded.
        """
        report = progress or (lambda _task, _part: None)
        simulators = {f"MuJoCo {load_mujoco().__version__}": (mjcf_files, "mjcf", "closed")}
        missing = find_spec("exudyn") is None
        if not missing:
            simulators[f"Exudyn {version('exudyn')}"] = (exudyn_files, "exudyn", "with clearance")
        comparisons = []
        for k, (linkage, path) in enumerate(motions()):
            report(linkage, k / 3)
            settings = Settings(step=_STEP, sample=_EVERY, impact=IMPACT_LAW)
            scenario = prepare_scenario(load_linkage(linkage), path, settings)
            runs = {
                name: (pins, *_distance(files(scenario), folder)) for name, (files, folder, pins) in simulators.items()
            }
            runs[f"armwright, {_OTHER * 1e9:g} nm more"] = ("with clearance", *_sensitivity(scenario))
            comparisons += [
                Comparison(linkage=linkage, motion=path.name, simulator=name, pins=pins, time=time, apart=apart)
                for name, (pins, time, apart) in runs.items()
            ]
        return cls(comparisons=comparisons, notes=(_CLOSED, _OPEN, _MISSING if missing else _EXUDYN))

    def as_data(self) -> dict[str, Any]:
        """Return the distances of the tips as plain data."""
        return {
            "comparisons": [
                {**attrs.asdict(row), "time": row.time.tolist(), "apart": row.apart.tolist()}
                for row in self.comparisons
            ]
        }

    def tables(self) -> Iterator[ResultTable]:
        """Yield how far the tips are apart at most, and until when."""
        yield ResultTable(
            title="Largest distance of the tips, steps of 10 µs",
            heads=("linkage", "motion", "simulator", "pins", "apart um", "until s", "at the end um"),
            rows=[
                (
                    row.linkage,
                    row.motion,
                    row.simulator,
                    row.pins,
                    f"{row.apart[: row.together].max() * 1e6:.3g}",
                    f"{row.time[row.together - 1]:.3g}",
                    f"{row.apart[-1] * 1e6:.3g}",
                )
                for row in self.comparisons
            ],
            numbers=range(4, 7),
        )

    def headline(self) -> Iterator[Tile]:
        """Give the largest distance from each simulator before tips rattle apart."""
        for name in dict.fromkeys(row.simulator for row in self.comparisons if "armwright" not in row.simulator):
            rows = [row for row in self.comparisons if row.simulator == name]
            most = max(float(row.apart[: row.together].max()) for row in rows)
            when = "pins closed" if rows[0].pins == "closed" else "before pins rattle apart"
            yield Tile(f"{most * 1e6:.2g} µm", f"from {name} at most, {when}")

    def figures(self) -> list[Drawing]:
        """Return the distance of the tips over time for each linkage."""
        drawn = []
        for linkage in dict.fromkeys(row.linkage for row in self.comparisons):
            rows = [row for row in self.comparisons if row.linkage == linkage]
            title = f"{linkage}, {rows[0].motion}: distance of the tips"
            lines = {f"{row.simulator}, {row.pins}": np.maximum(row.apart, _ROUNDING) * 1e6 for row in rows}
            svg = curves(title, rows[0].time, lines, x_label="time, s", y_label="µm", logarithmic=True)
            drawn.append(Drawing(linkage, title, svg))
        return drawn


def motions() -> list[tuple[str, TipPath]]:
    """Return what each linkage of the catalogue does: the thesis' path y1, or a revolution at 300 rev/min."""
    turns = [
        (name, constant_speed_path("300 rev/min", start, _SPEED, 2 * math.pi / _SPEED))
        for name, start in (("slider-crank", 0.0), ("four-bar", math.pi / 3))
    ]
    return [("five-bar", thesis_path("y1")), *turns]


def _sensitivity(scenario: Scenario) -> tuple[Array, Array]:
    """Return times (s,) and distances (s,) of the tips of two runs with slightly different clearances."""
    clearances = scenario.linkage.clearance_array(None)
    run = simulate(scenario, np.array([clearances, clearances + _OTHER]))
    return run.time, np.linalg.norm(run.tip[1] - run.tip[0], axis=1)


def _distance(files: dict[str, str], package: str) -> tuple[Array, Array]:
    """Return times (s,) and distances (s,) of the tips of files whose script is that of a package."""
    script = import_module(f"armwright.clearance.{package}.run_linkage")
    with TemporaryDirectory() as folder:
        for name, text in files.items():
            (Path(folder) / name).write_text(text, encoding="utf-8")
        tip = script.simulate(Path(folder))
        reference = np.loadtxt(Path(folder) / "reference.csv", delimiter=",", skiprows=1)
    count = min(len(tip), len(reference))
    return tip[:count, 0], np.linalg.norm(tip[:count, 1:] - reference[:count, 1:], axis=1)
