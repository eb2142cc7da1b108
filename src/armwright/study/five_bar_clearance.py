"""Play in a five-bar arm: the thesis' chain from simulation to estimated clearances and a corrected path.

Two arms, A and B, differ only in the play of three pins. Their repeatability says they are equal; their error curves
tell the clearances, and with these the better arm for a job is found and its path corrected. Tables 5.3 to 5.12,
figures 4.7 to 4.22 and 5.4 to 5.13.

Friction goes by the speed of the joints' centres, with the threshold that brings the thesis' numbers back (spec of the
clearance, 0.2); that of the surfaces, which is physically right, stands beside it where it matters.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import cache, lru_cache
from itertools import product
from typing import NamedTuple

import attrs
import numpy as np

from armwright.accuracy.pose import pose_repeatability
from armwright.arrays import Array
from armwright.clearance.correction import Correction, correct_nodes, tip_errors
from armwright.clearance.equations import FrictionModel
from armwright.clearance.estimation.kriging import Surrogate, check_extra, learn, solve_features
from armwright.clearance.estimation.static import estimate_at_rest, rest_offsets
from armwright.clearance.feature_sweep import FeatureSweep, feature_vector
from armwright.clearance.features import Features, features
from armwright.clearance.ideal import closed, tip_of
from armwright.clearance.linkage import Linkage
from armwright.clearance.paths import Path, PickAndPlace, named_path
from armwright.clearance.reader import load_linkage
from armwright.clearance.rest import at_rest
from armwright.clearance.scenario import Scenario, assembly_guess, prepare
from armwright.clearance.settings import Settings, contact_stiffness
from armwright.clearance.simulation import Simulation, simulate

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
# Where arms rest to be measured: the starts of the three paths [m].
POSES = ((-0.15, -0.7), (-0.05, -0.7), (0.15, -0.7))
CYCLES, ENCODER = 30, 5e-6  # of the repeatability test, and the noise of a drive's place [rad]
SPEC_MEAN = 0.056

# ---- what the thesis prints, in its units: mm, mm/s -----------------------------------------------------------------

PRINTED_FEATURES = {
    "y1": (-0.0759, 0.5504, 0.8699),
    "y3": (-0.0817, 0.5439, 0.8676),
    "y7": (-0.0480, 0.5187, 0.8658),
}
# Columns that the scan has lost are filled in by their accuracies (docs/errata.md).
PRINTED_ESTIMATES = {
    ("A", "intercept"): (0.340, 0.159, 0.478),
    ("A", "amp_dc"): (0.317, 0.190, 0.478),
    ("B", "intercept"): (0.449, 0.487, 0.469),
    ("B", "amp_dc"): (0.432, 0.502, 0.491),
}
PRINTED_MEANS = {("A", "intercept"): 96.09, ("A", "amp_dc"): 94.83, ("B", "intercept"): 98.06, ("B", "amp_dc"): 94.20}
PRINTED_TARGETS = {
    ("A", "given"): (0.562, 0.569, 0.780),
    ("B", "given"): (0.915, 0.698, 0.826),
    ("A", "estimated"): (0.560, 0.566, 0.829),
    ("B", "estimated"): (0.912, 0.708, 0.828),
}
PRINTED_CORRECTED = (0.004, 0.011, 0.080)
PRINTED_NODES = ((-179.901, -599.444), (0.0, -574.457), (180.0, -599.420))


class FeatureRow(NamedTuple):
    """Table 5.4: the features of arm A on one path, printed and ours with both kinds of friction [mm/s, mm, mm]."""

    path: str
    printed: tuple[float, ...]
    centre: tuple[float, ...]
    surface: tuple[float, ...]


class EstimateRow(NamedTuple):
    """Tables 5.5 to 5.8: clearances of an arm by one way, and how near they come [mm, %]."""

    arm: str
    way: str
    given: tuple[float, ...]
    printed: tuple[float, ...] | None
    ours: tuple[float, ...]
    printed_mean: float | None
    accuracy: tuple[float, ...]

    @property
    def mean(self) -> float:
        """Mean accuracy of ours [%]."""
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
class Learnt:
    """The sweep of 729 linkages on three paths, and what was learnt from it.

    Attributes:
        points: (m, 3) clearances [m].
        values: by ``path_feature``, (m,) SI.
        surrogate: of the nine features.
    """

    points: Array
    values: Mapping[str, Array]
    surrogate: Surrogate


@cache
def arm() -> Linkage:
    """Return the thesis' arm, which both A and B are but for their play."""
    return load_linkage("five-bar")


def feature_sweep() -> FeatureSweep:
    """Return the task whose 729 points the thesis simulates, once each as it does."""
    return FeatureSweep(linkage=arm(), paths=PATHS, simulation_settings=SETTINGS, replicates=0)


def learnt(progress: Callable[[str, float], None] | None = None, *, levels: Sequence[float] = LEVELS) -> Learnt:
    """Simulate the 729 linkages on three paths and learn the nine features.

    Args:
        progress: told what is done, and how much of it.
        levels: of each clearance; the thesis has nine [m].

    Raises:
        MissingExtraError: scikit-learn is not installed.
    """
    check_extra()  # not after all the simulations
    points = np.array(list(product(levels, repeat=3)))
    task, block, parts = feature_sweep(), 96, []
    for first in range(0, len(points), block):
        parts.append(task(points[first : first + block]))
        if progress is not None:
            progress(
                f"simulating {len(points)} linkages on {len(PATHS)} paths", min(1.0, (first + block) / len(points))
            )
    values = {name: np.concatenate([part[name] for part in parts]) for name in task.outputs}
    names = [f"{path}_{feature}" for path in PATHS for feature in FEATURES]
    done: list[str] = []

    def told(name: str) -> None:
        if progress is not None:
            progress("learning nine features", len(done) / len(names))
        done.append(name)

    table = feature_vector(values, PATHS, FEATURES)
    surrogate = learn(task.parameters, points, names, table, progress=told)
    if progress is not None:
        progress("learning nine features", 1.0)
    return Learnt(points=points, values=values, surrogate=surrogate)


# ---- tables --------------------------------------------------------------------------------------------------------


def feature_table() -> list[FeatureRow]:
    """Return table 5.4: arm A on its three paths."""
    rows = []
    for path in PATHS:
        both = [_in_print(features(run_of("A", path, settings))) for settings in (SETTINGS, SURFACE)]
        rows.append(FeatureRow(path, PRINTED_FEATURES[path], *both))
    return rows


def estimate_table(found: Learnt) -> list[EstimateRow]:
    """Return tables 5.5 to 5.8, and beside the thesis' ways the two that are better."""
    rows = []
    for name, given in ARMS.items():
        seen = _seen(name)
        for feature in FEATURES:
            part = [f"{path}_{feature}" for path in PATHS]
            rows.append(_estimate(name, feature, solve_features(found.surrogate.select(part), _picked(seen, part))))
        rows.append(
            _estimate(name, "all nine", solve_features(found.surrogate, _picked(seen, found.surrogate.features)))
        )
        rested = estimate_at_rest(arm(), POSES, rest_offsets(arm(), POSES, given))
        rows.append(_estimate(name, "at rest", rested.values))
    return rows


def target_table(rows: list[EstimateRow]) -> list[TargetRow]:
    """Return table 5.10: errors at the targets with the given clearances, and with those the intercepts tell.

    Args:
        rows: of ``estimate_table``.
    """
    estimated = {row.arm: row.ours for row in rows if row.way == "intercept"}
    table, path = [], PickAndPlace().path()
    for name, given in ARMS.items():
        for case, clearances in (("given", given), ("estimated", tuple(c * 1e-3 for c in estimated[name]))):
            printed = PRINTED_TARGETS[name, case]
            table.append(TargetRow(name, case, printed, target_errors(path, clearances)))
    return table


def corrected(rows: list[EstimateRow], way: str) -> Correction:
    """Return the path corrected for the clearances of arm A as one way tells them."""
    clearances = next(np.array(row.ours) * 1e-3 for row in rows if (row.arm, row.way) == ("A", way))
    return correct_nodes(arm(), PickAndPlace(), clearances, SETTINGS, rounds=2)


def correction_table(rows: list[EstimateRow]) -> list[TargetRow]:
    """Return table 5.12: errors of arm A at the targets, its path as it is and corrected for estimated clearances."""
    table = [TargetRow("A", "as it is", PRINTED_TARGETS["A", "given"], target_errors(PickAndPlace().path(), ARMS["A"]))]
    for way in ("intercept", "all nine", "at rest"):
        printed = PRINTED_CORRECTED if way == "intercept" else None
        errors = target_errors(corrected(rows, way).path, ARMS["A"])
        table.append(TargetRow("A", f"corrected by {way}", printed, errors))
    known = correct_nodes(arm(), PickAndPlace(), ARMS["A"], SETTINGS, rounds=2)
    table.append(TargetRow("A", "corrected, clearances known", None, target_errors(known.path, ARMS["A"])))
    return table


def repeat_table(seed: int = 0) -> list[RepeatRow]:
    """Return table 5.3: repeatability of 30 cycles at the first target.

    The thesis does not say what makes its cycles differ; a simulation that starts anew each time repeats itself
    exactly. Here a journal comes to rest anywhere inside its friction cone, and the drives stop within the noise of
    their encoders.
    """
    rng = np.random.default_rng(seed)
    table = []
    for name, given in ARMS.items():
        places = _cycles(np.array(given), rng)
        table.append(
            RepeatRow(name, tuple(c * 1e3 for c in given), SPEC_MEAN, float(pose_repeatability(places).radius) * 1e3)
        )
    return table


# ---- runs ----------------------------------------------------------------------------------------------------------


@cache
def run_of(name: str, path: str, settings: Settings = SETTINGS) -> Simulation:
    """Return the run of an arm on a path."""
    return simulate(prepare(arm(), named_path(path), settings), ARMS[name])


def target_errors(path: Path, clearances: tuple[float, ...] | Array) -> tuple[float, ...]:
    """Return how far the tip is from the three targets when it is told to follow a path [mm]."""
    run = simulate(_ready(path), clearances)
    goals = np.array(PickAndPlace().nodes)
    return tuple(float(one) * 1e3 for one in np.linalg.norm(tip_errors(run, goals), axis=-1))


@lru_cache(maxsize=8)
def _ready(path: Path) -> Scenario:
    """Return a path made ready; several arms follow the same."""
    return prepare(arm(), path, SETTINGS)


def _cycles(clearances: Array, rng: np.random.Generator) -> Array:
    """Return (30, 2) places at which an arm comes to rest at the first target [m]."""
    linkage = arm()
    ideal = closed(linkage, assembly_guess(linkage), tip=PickAndPlace().nodes[0])
    rest = at_rest(linkage, ideal, clearances, contact_stiffness(linkage, clearances))
    cone = np.arctan(linkage.material.friction)
    turn = cone * rng.uniform(-1.0, 1.0, (CYCLES, len(clearances)))
    cosine, sine = np.cos(turn), np.sin(turn)
    x, y = rest.gaps[:, 0], rest.gaps[:, 1]
    gaps = np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=-1)
    drives = ideal[list(linkage.driven)] + ENCODER * rng.standard_normal((CYCLES, len(linkage.drives)))
    return tip_of(linkage, closed(linkage, rest.q, drives=drives, gaps=gaps))


def _seen(name: str) -> dict[str, float]:
    found: dict[str, float] = {}
    for path in PATHS:
        found |= {f"{path}_{feature}": float(x) for feature, x in features(run_of(name, path))._asdict().items()}
    return found


def _picked(seen: Mapping[str, float], names: tuple[str, ...] | list[str]) -> Array:
    return np.array([seen[name] for name in names])


def _estimate(name: str, way: str, ours: Array) -> EstimateRow:
    given = np.array(ARMS[name])
    accuracy = 100 * (1 - np.abs(ours / given - 1))
    return EstimateRow(
        arm=name,
        way=way,
        given=tuple(given * 1e3),
        printed=PRINTED_ESTIMATES.get((name, way)),
        ours=tuple(float(x) * 1e3 for x in ours),
        printed_mean=PRINTED_MEANS.get((name, way)),
        accuracy=tuple(map(float, accuracy)),
    )


def _in_print(found: Features) -> tuple[float, ...]:
    """Return slope, intercept and mean amplitude in the thesis' units."""
    return tuple(float(getattr(found, name)) * 1e3 for name in FEATURES)
