"""Clearance in a five-bar arm: the thesis' chain from simulation to estimated clearances and a corrected path.

Two arms, A and B, differ only in the clearance of three joints. Their repeatability is equal; their clearances are
estimated from their error curves, which determines the better arm for a task and corrects its path. Tables 5.3 to 5.12,
figures 4.7 to 4.22 and 5.4 to 5.13.

The sliding velocity of friction is that of the joints' centres, with the threshold that reproduces the thesis' numbers
(spec of the clearance, 0.2); the velocity of the surfaces, which is physically right, is used for comparison.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache, lru_cache
from itertools import product
from typing import NamedTuple

import attrs
import numpy as np

from armwright.accuracy.pose import pose_repeatability
from armwright.arrays import Array, ArrayLike
from armwright.clearance.correction import Correction, correct_nodes, tip_errors
from armwright.clearance.equations import FrictionModel
from armwright.clearance.estimation.kriging import Surrogate, check_extra, fit_surrogate, solve_features
from armwright.clearance.estimation.static_estimate import estimate_at_rest, rest_offsets
from armwright.clearance.feature_sweep import FeatureSweep, feature_vector
from armwright.clearance.features import Features, simulation_features
from armwright.clearance.ideal import close_pins, tip_position
from armwright.clearance.linkage import Linkage
from armwright.clearance.paths import Path, PickAndPlace, named_path
from armwright.clearance.reader import load_linkage
from armwright.clearance.scenario import Scenario, assembly_guess, prepare_scenario
from armwright.clearance.settings import Settings, contact_stiffness
from armwright.clearance.simulation import Simulation, simulate
from armwright.clearance.static_equilibrium import find_static_equilibrium

# The two arms: clearances of the pins J2, J3, J4 [m].
ARMS: Mapping[str, tuple[float, float, float]] = {
    "A": (0.328e-3, 0.171e-3, 0.483e-3),
    "B": (0.460e-3, 0.480e-3, 0.460e-3),
}
PATHS = ("y1", "y3", "y7")
LEVELS = tuple(round(0.1e-3 + 0.05e-3 * i, 9) for i in range(9))
FEATURES = ("slope", "intercept", "amp_dc")
SETTINGS = Settings(friction=FrictionModel(velocity="centre"), threshold=1e-2)
SURFACE = Settings()
# Positions of the tip for measurements at rest: the starts of the three paths [m].
POSES = ((-0.15, -0.7), (-0.05, -0.7), (0.15, -0.7))
CYCLES, ENCODER = 30, 5e-6  # of the repeatability test, and the noise of a drive's position [rad]
SPEC_MEAN = 0.056

# ---- numbers of the thesis in its units: mm, mm/s --------------------------------------------------------------------

PRINTED_FEATURES = {
    "y1": (-0.0759, 0.5504, 0.8699),
    "y3": (-0.0817, 0.5439, 0.8676),
    "y7": (-0.0480, 0.5187, 0.8658),
}
# Columns that are illegible in the scan are computed from their accuracies (docs/errata.md).
PRINTED_ESTIMATES = {
    ("A", "intercept"): (0.340, 0.159, 0.478),
    ("A", "amp_dc"): (0.317, 0.190, 0.478),
    ("B", "intercept"): (0.449, 0.487, 0.469),
    ("B", "amp_dc"): (0.432, 0.502, 0.491),
}
PRINTED_MEANS = {("A", "intercept"): 96.09, ("A", "amp_dc"): 94.83, ("B", "intercept"): 98.06, ("B", "amp_dc"): 94.20}
PRINTED_TARGETS = {
    ("A", "true"): (0.562, 0.569, 0.780),
    ("B", "true"): (0.915, 0.698, 0.826),
    ("A", "estimated"): (0.560, 0.566, 0.829),
    ("B", "estimated"): (0.912, 0.708, 0.828),
}
PRINTED_CORRECTED = (0.004, 0.011, 0.080)
PRINTED_NODES = ((-179.901, -599.444), (0.0, -574.457), (180.0, -599.420))


class FeatureRow(NamedTuple):
    """Table 5.4: the features of arm A on a path, printed and computed with both kinds of friction [mm/s, mm, mm]."""

    path: str
    printed: tuple[float, ...]
    centre: tuple[float, ...]
    surface: tuple[float, ...]


class EstimateRow(NamedTuple):
    """Tables 5.5 to 5.8: clearances of an arm by a method, and their accuracy [mm, %]."""

    arm: str
    method: str
    true: tuple[float, ...]
    printed: tuple[float, ...] | None
    ours: tuple[float, ...]
    printed_mean: float | None
    accuracy: tuple[float, ...]

    @property
    def mean(self) -> float:
        """Mean accuracy of the computed clearances [%]."""
        return float(np.mean(self.accuracy))


class TargetRow(NamedTuple):
    """Tables 5.10 and 5.12: errors at the three targets [mm]."""

    arm: str
    case: str
    printed: tuple[float, ...] | None
    ours: tuple[float, ...]


class RepeatRow(NamedTuple):
    """Table 5.3: repeatability of an arm [mm]."""

    arm: str
    clearances: tuple[float, ...]
    printed: float
    ours: float


@attrs.frozen(kw_only=True, eq=False)
class SweepResult:
    """The sweep of 729 linkages on three paths, and the surrogate model that is fitted to it.

    Attributes:
        points: (m, 3) clearances [m].
        values: (m,) features by ``path_feature``, SI.
        surrogate: model of the nine features.
    """

    points: Array
    values: Mapping[str, Array]
    surrogate: Surrogate


@cache
def arm() -> Linkage:
    """Return the thesis' arm; A and B differ from it only by their clearances."""
    return load_linkage("five-bar")


def run_sweep(progress: Callable[[str, float], None] | None = None, *, levels: Sequence[float] = LEVELS) -> SweepResult:
    """Simulate the 729 linkages on three paths and fit models to the nine features.

    Args:
        progress: called with the current task and the finished part of it.
        levels: levels of each clearance [m]; the thesis has nine.

    Raises:
        MissingExtraError: scikit-learn is not installed.
    """
    check_extra()  # before the simulations, which take a minute
    report = progress or (lambda _task, _part: None)
    points = np.array(list(product(levels, repeat=3)))
    # A single run for each point, as in the thesis.
    task, block, parts = FeatureSweep(linkage=arm(), paths=PATHS, simulation_settings=SETTINGS, replicates=0), 96, []
    for first in range(0, len(points), block):
        parts.append(task(points[first : first + block]))
        report(f"simulating {len(points)} linkages on {len(PATHS)} paths", min(1.0, (first + block) / len(points)))
    values = {name: np.concatenate([part[name] for part in parts]) for name in task.outputs}
    names = [f"{path}_{feature}" for path in PATHS for feature in FEATURES]

    def report_feature(name: str) -> None:
        report("learning nine features", names.index(name) / len(names))

    table = feature_vector(values, PATHS, FEATURES)
    surrogate = fit_surrogate(task.parameters, points, names, table, progress=report_feature)
    report("learning nine features", 1.0)
    return SweepResult(points=points, values=values, surrogate=surrogate)


# ---- tables --------------------------------------------------------------------------------------------------------


def feature_table() -> list[FeatureRow]:
    """Return table 5.4: arm A on its three paths."""
    rows = []
    for path in PATHS:
        both = [_in_print(simulation_features(run_of("A", path, settings))) for settings in (SETTINGS, SURFACE)]
        rows.append(FeatureRow(path, PRINTED_FEATURES[path], *both))
    return rows


def estimate_table(swept: SweepResult) -> list[EstimateRow]:
    """Return tables 5.5 to 5.8, with two further methods that are better."""
    rows = []
    for name, true in ARMS.items():
        kinds = {feature: [f"{path}_{feature}" for path in PATHS] for feature in FEATURES}
        for method, selected in (*kinds.items(), ("all nine", list(swept.surrogate.features))):
            solution = solve_features(swept.surrogate.select(selected), _measured_features(name, selected))
            rows.append(_estimate(name, method, solution))
        rested = estimate_at_rest(arm(), POSES, rest_offsets(arm(), POSES, true))
        rows.append(_estimate(name, "at rest", rested.values))
    return rows


def target_table(rows: list[EstimateRow]) -> list[TargetRow]:
    """Return table 5.10: errors at the targets with the true clearances, and with those estimated from intercepts.

    Args:
        rows: the rows of ``estimate_table``.
    """
    estimated = {row.arm: row.ours for row in rows if row.method == "intercept"}
    table, path = [], PickAndPlace().path()
    for name, true in ARMS.items():
        for case, clearances in (("true", true), ("estimated", tuple(c * 1e-3 for c in estimated[name]))):
            printed = PRINTED_TARGETS[name, case]
            table.append(TargetRow(name, case, printed, target_errors(path, clearances)))
    return table


def corrected(rows: list[EstimateRow], method: str) -> Correction:
    """Return the path corrected for the clearances of arm A as estimated by a method."""
    clearances = next(np.array(row.ours) * 1e-3 for row in rows if (row.arm, row.method) == ("A", method))
    return correct_nodes(arm(), PickAndPlace(), clearances, SETTINGS, rounds=2)


def correction_table(rows: list[EstimateRow]) -> list[TargetRow]:
    """Return table 5.12: errors of arm A at the targets, with its path uncorrected and corrected for estimates."""
    table = [
        TargetRow("A", "uncorrected", PRINTED_TARGETS["A", "true"], target_errors(PickAndPlace().path(), ARMS["A"]))
    ]
    for method in ("intercept", "all nine", "at rest"):
        printed = PRINTED_CORRECTED if method == "intercept" else None
        errors = target_errors(corrected(rows, method).path, ARMS["A"])
        table.append(TargetRow("A", f"corrected by {method}", printed, errors))
    known = correct_nodes(arm(), PickAndPlace(), ARMS["A"], SETTINGS, rounds=2)
    table.append(TargetRow("A", "corrected, clearances known", None, target_errors(known.path, ARMS["A"])))
    return table


def repeat_table(seed: int = 0) -> list[RepeatRow]:
    """Return table 5.3: repeatability of 30 cycles at the first target.

    The thesis does not state why its cycles differ; repeated simulations are identical. Here a journal comes to rest
    anywhere inside its friction cone, and the drives stop within the noise of their encoders.
    """
    rng = np.random.default_rng(seed)
    table = []
    for name, true in ARMS.items():
        repeatability = float(pose_repeatability(_cycles(np.array(true), rng)).radius)
        table.append(RepeatRow(name, tuple(c * 1e3 for c in true), SPEC_MEAN, repeatability * 1e3))
    return table


# ---- runs ----------------------------------------------------------------------------------------------------------


@cache
def run_of(name: str, path: str, settings: Settings = SETTINGS) -> Simulation:
    """Return the run of an arm on a path."""
    return simulate(prepare_scenario(arm(), named_path(path), settings), ARMS[name])


def target_errors(path: Path, clearances: ArrayLike) -> tuple[float, ...]:
    """Return the distances of the tip from the three targets on a commanded path [mm]."""
    errors = tip_errors(simulated(path, clearances), PickAndPlace().nodes)
    return tuple(float(distance) * 1e3 for distance in np.linalg.norm(errors, axis=-1))


def simulated(path: Path, clearances: ArrayLike) -> Simulation:
    """Return the run of the arm with some clearances on a path [m]."""
    return simulate(_scenario(path), clearances)


@lru_cache(maxsize=8)
def _scenario(path: Path) -> Scenario:
    """Return the scenario of a path, which several arms share: it takes ten times as long as a run."""
    return prepare_scenario(arm(), path, SETTINGS)


def _cycles(clearances: Array, rng: np.random.Generator) -> Array:
    """Return (30, 2) positions at which an arm comes to rest at the first target [m]."""
    linkage = arm()
    ideal = close_pins(linkage, assembly_guess(linkage), tip=PickAndPlace().nodes[0])
    equilibrium = find_static_equilibrium(linkage, ideal, clearances, contact_stiffness(linkage, clearances))
    cone = np.arctan(linkage.material.friction)
    angle = cone * rng.uniform(-1.0, 1.0, (CYCLES, len(clearances)))
    cosine, sine = np.cos(angle), np.sin(angle)
    x, y = equilibrium.gaps[:, 0], equilibrium.gaps[:, 1]
    gaps = np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=-1)
    drives = ideal[list(linkage.driven)] + ENCODER * rng.standard_normal((CYCLES, len(linkage.drives)))
    return tip_position(linkage, close_pins(linkage, equilibrium.q, drives=drives, gaps=gaps))


def _measured_features(name: str, selected: Iterable[str]) -> Array:
    """Return features of an arm by ``path_feature``, SI."""
    parts = (feature.split("_", 1) for feature in selected)
    return np.array([float(getattr(simulation_features(run_of(name, path)), feature)) for path, feature in parts])


def _estimate(name: str, method: str, ours: Array) -> EstimateRow:
    true = np.array(ARMS[name])
    accuracy = 100 * (1 - np.abs(ours / true - 1))
    printed, printed_mean = PRINTED_ESTIMATES.get((name, method)), PRINTED_MEANS.get((name, method))
    millimetres = tuple(float(x) * 1e3 for x in ours)
    return EstimateRow(name, method, tuple(true * 1e3), printed, millimetres, printed_mean, tuple(accuracy.tolist()))


def _in_print(values: Features) -> tuple[float, ...]:
    """Return slope, intercept and mean amplitude in the thesis' units."""
    return tuple(float(getattr(values, name)) * 1e3 for name in FEATURES)
