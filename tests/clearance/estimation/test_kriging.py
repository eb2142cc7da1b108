"""Features learnt from simulations: a known function comes back, and clearances come of features."""

import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from armwright.arrays import Array
from armwright.clearance.estimation.kriging import MAX_POINTS, Surrogate, fit_surrogate, solve_features
from armwright.errors import InvalidValueError, MissingExtraError, ShapeError
from armwright.sweep.designs import sobol
from clearance.arms import ARM_A, ARM_B, PATHS, accuracy
from clearance.conftest import RANGE, Swept
from samples import Sample

pytest.importorskip("sklearn")

# Mean accuracy that is asked for where nothing is measured with noise [%].
WITHOUT_NOISE = 99.5
NAMES = ("a", "b")
# Parameters of other sizes, as a clearance and a coefficient of friction are.
BOUNDS = {"a": (1e-4, 5e-4), "b": (0.0, 0.2)}


def smooth(points: Array) -> Array:
    """Two functions of two parameters that bend a little, never the same twice."""
    u, v = ((points - [1e-4, 0.0]) / [4e-4, 0.2]).T
    return np.stack([u + 0.3 * np.sin(2 * u) + 0.2 * v**2, 3 + v + 0.2 * np.exp(-u * v)], axis=-1)


def design(runs: int) -> Array:
    return sobol(BOUNDS, runs, 3).points


@pytest.fixture(scope="module")
def known() -> Surrogate:
    points = design(64)
    return fit_surrogate(NAMES, points, ("f", "g"), smooth(points), ranges=[BOUNDS[name] for name in NAMES])


def test_smooth_function(known: Surrogate, rng: np.random.Generator) -> None:
    """Of 64 points a smooth function comes back to three digits and more between them, with a deviation as small."""
    points = rng.uniform(*np.array(list(BOUNDS.values())).T, (200, 2))

    mean, deviation = known.predict(points)

    np.testing.assert_allclose(mean, smooth(points), rtol=0, atol=5e-4)
    assert deviation.max() < 1e-3


def test_slope_of_a_surface(known: Surrogate) -> None:
    """The slopes of what was learnt are those of the function, with parameters from 0 to 1."""
    u, v = 0.3, 0.6
    by_hand = [
        (1 + 0.6 * np.cos(2 * u), 0.4 * v),
        (-0.2 * v * np.exp(-u * v), 1 - 0.2 * u * np.exp(-u * v)),
    ]

    result = [process.gradient(np.array([u, v])) for process in known.processes]

    np.testing.assert_allclose(result, by_hand, rtol=0, atol=2e-3)


def test_noise_is_told_from_the_surface(rng: np.random.Generator) -> None:
    """Of values that chance shakes by 0.05 the surface is smooth, and the deviation is what chance adds."""
    points = design(256)
    shaken = smooth(points) + rng.normal(0.0, 0.05, (256, 2))

    surrogate = fit_surrogate(NAMES, points, ("f", "g"), shaken)
    mean, deviation = surrogate.predict(np.array([[3e-4, 0.1]]))

    np.testing.assert_allclose(deviation, 0.05, rtol=0.2)
    np.testing.assert_allclose(mean, smooth(np.array([[3e-4, 0.1]])), rtol=0, atol=0.03)


def test_what_surfaces_miss_together(rng: np.random.Generator) -> None:
    """Where one number comes out too large by chance as another comes out too small, a surrogate knows it."""
    points = design(64)
    chance = 0.02 * rng.standard_normal(len(points))
    values = smooth(points) + np.stack([chance, -chance], axis=-1)

    surrogate = fit_surrogate(NAMES, points, ("f", "g"), values)

    assert surrogate.correlation[0, 1] < -0.8
    np.testing.assert_allclose(np.diag(surrogate.correlation), 1.0)
    assert surrogate.select(("g",)).correlation.shape == (1, 1)


def test_spread_of_single_runs_is_that_of_neighbours() -> None:
    """Where indistinguishable runs differ, a single run is predicted no better; far from there it is."""
    points = design(256)
    late = points[:, 0] > 3e-4
    spreads = np.where(late, 0.1, 0.0)[:, None] * [1.0, 0.0]

    surrogate = fit_surrogate(NAMES, points, ("f", "g"), smooth(points), spreads=spreads)
    _, deviation = surrogate.predict(np.array([[1e-4, 0.1], [5e-4, 0.1]]))

    np.testing.assert_allclose(deviation[1], (0.1, 0.0), rtol=0.05, atol=1e-3)
    assert deviation[0].max() < 0.02
    assert surrogate.select(("g",)).predict(points)[1].max() < 1e-3
    with pytest.raises(ShapeError, match=r"spreads: expected \(256, 2\), as the values, got \(256, 1\)"):
        fit_surrogate(NAMES, points, ("f", "g"), smooth(points), spreads=spreads[:, :1])


def test_inverse(known: Surrogate, rng: np.random.Generator) -> None:
    """Features of a known function determine the parameters that they are of."""
    true = rng.uniform(*np.array(list(BOUNDS.values())).T, (20, 2))

    parameters = np.array([solve_features(known, features) for features in smooth(true)])

    np.testing.assert_allclose((parameters - true) / [4e-4, 0.2], 0.0, rtol=0, atol=1e-3)


def test_weights(known: Surrogate) -> None:
    """Where the features contradict one another, the one that is known better wins."""
    true = np.array([[2e-4, 0.05]])
    half = known.select(["f", "f", "g"])
    measured = smooth(true)[0][[0, 0, 1]] + [0.0, 0.1, 0.0]

    first = solve_features(half, measured, [1e-4, 1.0, 1e-4])
    second = solve_features(half, measured, [1.0, 1e-4, 1e-4])

    np.testing.assert_allclose(half.predict(first[None])[0][0, 0], measured[0], rtol=0, atol=1e-3)
    np.testing.assert_allclose(half.predict(second[None])[0][0, 1], measured[1], rtol=0, atol=1e-3)


def test_many_points() -> None:
    """Of more points than are needed some are taken, always the same, spread over all."""
    points = design(512)
    surrogate = fit_surrogate(NAMES, points, ("f",), smooth(points)[:, :1])
    again = fit_surrogate(NAMES, points, ("f",), smooth(points)[:, :1])

    assert len(surrogate.processes[0].x) == MAX_POINTS
    np.testing.assert_array_equal(surrogate.processes[0].weights, again.processes[0].weights)
    np.testing.assert_allclose(surrogate.predict(points)[0], smooth(points)[:, :1], rtol=0, atol=5e-4)


def test_failed_runs_are_left_out(known: Surrogate) -> None:
    """Rows that came to nothing teach nothing, and disturb nothing."""
    points = design(64)
    values = smooth(points)
    more = np.vstack([points, [[2e-4, 0.1], [3e-4, 0.15]]])

    surrogate = fit_surrogate(
        NAMES, more, ("f", "g"), np.vstack([values, [[np.nan, 1.0], [np.nan, np.nan]]]), ranges=list(BOUNDS.values())
    )

    np.testing.assert_array_equal(surrogate.processes[0].weights, known.processes[0].weights)


def test_progress() -> None:
    """Each feature is announced before it is learnt."""
    points, names = design(16), []

    fit_surrogate(NAMES, points, ("f", "g"), smooth(points), progress=names.append)

    assert names == ["f", "g"]


class TestFiveBar:
    """128 five-bars on the thesis' three paths."""

    def test_surfaces(self, swept: Swept, rng: np.random.Generator) -> None:
        """Arms that were not learnt from have the features that the surfaces say: R² ≥ 0.9994, 0.99 of amplitudes.

        What impacts do to the amplitude is chance, and the surface says so: nine of ten lie within its 90 %.
        """
        held_out = rng.uniform(*RANGE, (48, 3))
        measured = swept.features(held_out)

        mean, deviation = swept.surrogate.predict(held_out)

        part = ((mean - measured) ** 2).sum(axis=0) / ((measured - measured.mean(axis=0)) ** 2).sum(axis=0)
        for name, accuracy_part in zip(swept.surrogate.features, 1 - part, strict=True):
            assert accuracy_part > (0.99 if "amp" in name else 0.9994), name
        amplitudes = [i for i, name in enumerate(swept.surrogate.features) if "amp" in name]
        inside = np.abs(mean - measured)[:, amplitudes] < 1.645 * deviation[:, amplitudes]
        assert 0.8 < inside.mean() < 0.97

    @pytest.mark.parametrize("clearances", [ARM_A, ARM_B], ids=["A", "B"])
    def test_all_features(self, swept: Swept, clearances: Array) -> None:
        """All features of the error curves together determine arms A and B to 99.99 % without noise."""
        parameters = solve_features(swept.surrogate, swept.features(clearances)[0])

        assert accuracy(parameters, clearances) > 99.99 > WITHOUT_NOISE

    @pytest.mark.share(0.3)
    def test_held_out(self, swept: Swept, rng: np.random.Generator, sample: Sample) -> None:
        """Held-out arms are estimated to 99.99 % on average, the worst to 99.9 %."""
        true = rng.uniform(*RANGE, (sample.count(40), 3))

        parameters = [solve_features(swept.surrogate, row) for row in swept.features(true)]

        right = accuracy(parameters, true)
        assert right.mean() > 99.99
        assert right.min() > 99.9 > WITHOUT_NOISE

    @pytest.mark.share(0.4)
    def test_more_features_tell_more(self, swept: Swept, rng: np.random.Generator, sample: Sample) -> None:
        """One feature of three paths, as in the thesis, is less accurate than three features together, with 99 %."""
        true = rng.uniform(*RANGE, (sample.count(20), 3))
        measured = swept.features(true)
        names = swept.surrogate.features

        def right(chosen: Callable[[str], bool]) -> float:
            some = [i for i, name in enumerate(names) if chosen(name)]
            part = swept.surrogate.select([names[i] for i in some])
            return float(np.median(accuracy([solve_features(part, row) for row in measured[:, some]], true)))

        amplitude, nine = right(lambda name: "amp_dc" in name), right(lambda name: "offset" not in name)
        assert amplitude < 97
        assert nine > 99

    def test_offsets_agree_with_rest(self, swept: Swept) -> None:
        """The offset that a sweep finds at the start of a path is that of the resting tip: no second law."""
        from armwright.clearance.estimation.static_estimate import rest_offsets
        from clearance.arms import STARTS

        rested = rest_offsets(swept.task.linkage, STARTS, swept.points)

        for k, path in enumerate(PATHS):
            result = np.stack([swept.values[f"{path}_offset_{axis}"] for axis in "xy"], axis=-1)
            np.testing.assert_allclose(result, rested[:, k], rtol=0, atol=1e-12)


def test_without_scikit_learn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where scikit-learn is not installed it is said how to get it."""
    monkeypatch.setitem(sys.modules, "sklearn.gaussian_process", None)
    points = design(16)
    with pytest.raises(
        MissingExtraError, match=r"needs scikit-learn; install it by: pip install 'armwright\[clearance\]'"
    ):
        fit_surrogate(NAMES, points, ("f", "g"), smooth(points))


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"values": np.zeros((16, 3))}, ShapeError, r"expected \(m, 2\) points and \(m, 2\) values, got \(16, 2\) and"),
        (
            {"points": design(8), "values": smooth(design(8))},
            InvalidValueError,
            "expected 12 or more simulations that",
        ),
        ({"values": np.full((16, 2), np.nan)}, InvalidValueError, "12 or more simulations that finished, got 0"),
        ({"points": design(16) * [1, 0]}, InvalidValueError, "parameter b does not vary: it is 0 in every run"),
        ({"ranges": [(1e-4, 5e-4)]}, ShapeError, r"ranges: expected a shape ending in \(2, 2\), got \(1, 2\)"),
        ({"ranges": [(1e-4, 3e-4), (0.0, 0.2)]}, InvalidValueError, "ranges: a point lies outside"),
    ],
)
def test_bad_tables(change: dict[str, Any], error: type[Exception], message: str) -> None:
    """Tables that do not fit, too few runs, and parameters that do not vary are named."""
    points = design(16)
    with pytest.raises(error, match=message):
        fit_surrogate(
            **{"parameters": NAMES, "points": points, "features": ("f", "g"), "values": smooth(points), **change}
        )


def test_features_that_do_not_fit(known: Surrogate) -> None:
    """There is one number for each feature."""
    with pytest.raises(ShapeError, match=r"measured features: expected a shape ending in \(2,\), got \(3,\)"):
        solve_features(known, [0.0, 0.0, 0.0])


def test_feature_of_chance_alone_teaches_nothing(rng: np.random.Generator) -> None:
    """A feature that impacts leave to chance is noise of its whole spread, not a surface through the runs."""
    x = rng.random((96, 3))
    values = np.column_stack([x @ [1.0, 0.5, 0.2], rng.standard_normal(96)])

    surrogate = fit_surrogate("pqr", x, ("smooth", "chance"), values, ranges=[(0, 1)] * 3)

    new = rng.random((200, 3))
    mean, deviation = surrogate.predict(new)
    assert np.abs(mean[:, 0] - new @ [1.0, 0.5, 0.2]).max() < 1e-2
    assert np.median(deviation[:, 1]) > 0.7 * values[:, 1].std()
