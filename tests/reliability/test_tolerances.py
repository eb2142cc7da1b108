"""Tolerances of arms: worst case, least cost, and the full kinematics."""

import itertools
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import minimize

from armwright.arm.load import load_arm
from armwright.arm.positions import ranges
from armwright.errors import FileFormatError, InvalidValueError
from armwright.reliability.allocation import allocate, error_bounds
from armwright.reliability.arm_errors import assess_tolerances, sampled_errors, tool_error
from armwright.reliability.farthest_point import farthest_point
from armwright.reliability.linear_error import LinearError
from armwright.reliability.tolerances import Tolerance, dimensions, read_tolerances
from armwright.reliability.worst_case import longest_sum
from samples import Sample

PUMA = load_arm("puma560")
TOLERANCES = """
[joints]
theta_deg = 0.01
d_mm = 0.05
[joint.2]
theta_deg = 0.02
alpha_deg = 0.03
[tool]
position_mm = 0.1
"""


@pytest.fixture
def tolerances(tmp_path: Path) -> tuple[Tolerance, ...]:
    """Those of the file above."""
    (tmp_path / "tolerances.toml").write_text(TOLERANCES, encoding="utf-8")
    return read_tolerances(tmp_path / "tolerances.toml", PUMA)


def configurations(rng: np.random.Generator, count: int) -> np.ndarray:
    """Random configurations of the Puma."""
    return rng.uniform(*ranges(PUMA), size=(count, 6))


def named(widths: np.ndarray, cost: float = 1.0, exponent: float = 1.0) -> list[Tolerance]:
    """Tolerances of lengths."""
    return [Tolerance(name=f"x{i}", half_width=width, cost=cost, exponent=exponent) for i, width in enumerate(widths)]


def unit_error(jacobian: np.ndarray) -> LinearError:
    """An error without a mean; its deviations do not matter."""
    poses, d, k = jacobian.shape
    names = tuple(f"x{i}" for i in range(k))
    return LinearError(names=names, deviations=np.ones(k), offset=np.zeros((poses, d)), jacobian=jacobian)


def test_file(tolerances: tuple[Tolerance, ...]) -> None:
    """A joint's own values replace those of all joints; parallel axes have the tilt of the twist."""
    found = {each.name: each.half_width for each in tolerances}
    assert found["joint1.theta"] == pytest.approx(np.radians(0.01))
    assert found["joint2.theta"] == pytest.approx(np.radians(0.02))
    assert found["joint2.alpha"] == found["joint2.beta"] == pytest.approx(np.radians(0.03))
    assert found["joint2.d"] == pytest.approx(5e-5)
    assert found["tool.y"] == pytest.approx(1e-4)
    assert set(found) == {f"joint{i}.{name}" for i in range(1, 7) for name in ("theta", "d")} | {
        "joint2.alpha", "joint2.beta", "tool.x", "tool.y", "tool.z",
    }  # fmt: skip
    assert set(found) < set(dimensions(PUMA))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "expected a tolerance above zero"),
        ("[joints]\ntheta_deg = -1", "expected 0 to 180"),
        ("[joints]\nd_mm = 1e90", r"expected 0 to 1e\+06"),
        ("[tool]\nposition_mm = 1e-300", "expected 0, or 1e-09 or more"),
        ("[tool]\nposition_mm = 1\n[cost.factors]\n'tool.x' = 1e99", "expected 1e-09 to"),
        ("[joints]\ntheta_dg = 1", "did you mean 'theta_deg'"),
        ("[joint.7]\ntheta_deg = 1", "unknown key"),
        ("[joint.2]\ntheta_deg = nan", "finite"),
        ("[tool]\nposition_mm = 1\n[cost.factors]\n'joint9.d' = 2", "no such dimension"),
        ("[tool]\nposition_mm = 1\n[cost]\nexponent = 0", "expected 0.01 to 10"),
        ("joints = 3", "expected a table"),
    ],
)
def test_bad_files(text: str, said: str, tmp_path: Path) -> None:
    """What a file has wrong is said."""
    (tmp_path / "t.toml").write_text(text, encoding="utf-8")
    with pytest.raises((FileFormatError, InvalidValueError), match=said):
        read_tolerances(tmp_path / "t.toml", PUMA)


@pytest.mark.proof
@pytest.mark.share(0.05)
def test_longest_sum(sample: Sample) -> None:
    """It is the longest of all sums with factors of one either way, parallel and coplanar generators included."""
    for rng in sample.cases(1000):
        d, k = int(rng.integers(1, 4)), int(rng.integers(1, 10))
        G = rng.normal(size=(d, k)) * 10 ** rng.uniform(-5, 5)
        if rng.random() < 0.5:
            G[:, rng.integers(k)] = G[:, 0] * rng.normal()
        if rng.random() < 0.3:
            G[:, rng.integers(k)] = 0
        if rng.random() < 0.3:
            G[d - 1] = 0
        if rng.random() < 0.4 and k > 4:
            G[:, 2], G[:, 3], G[:, 4] = G[:, 0] + G[:, 1], G[:, 0] - 2 * G[:, 1], G[:, 1] - 3 * G[:, 0]
        offset = rng.normal(size=d) * abs(G).max() if rng.random() < 0.5 else None
        start = np.zeros(d) if offset is None else offset
        signs = np.array(list(itertools.product((-1, 1), repeat=k)))
        expected = np.linalg.norm(start + signs @ G.T, axis=1).max()

        length, factors = longest_sum(G, offset)

        assert length == pytest.approx(expected, rel=1e-9, abs=1e-300)
        assert np.linalg.norm(start + G @ factors) == pytest.approx(length, rel=1e-12, abs=1e-300)
        assert set(factors) <= {-1, 1}
    sample.record("longest sums", sample.count(1000), 0)


def test_tool_error_is_linear(tolerances: tuple[Tolerance, ...], rng: np.random.Generator) -> None:
    """The longest error of a path is that of the full kinematics within a hundredth, for the same random arms."""
    q = configurations(rng, 15)
    error = tool_error(PUMA, q, tolerances)
    full = sampled_errors(PUMA, q, tolerances, samples=300, seed=5).max(axis=1)
    z = np.random.default_rng(5).normal(scale=1 / 3, size=(300, len(tolerances)))
    widths = np.array([each.half_width for each in tolerances])
    linear = np.linalg.norm(np.einsum("pdk,mk->mpd", error.jacobian, z * widths), axis=-1).max(axis=1)

    np.testing.assert_allclose(linear, full, rtol=1e-2)
    bound, _ = error_bounds(error, widths, "worst-case")
    uniform = sampled_errors(PUMA, q, tolerances, samples=300, seed=6, uniform=True)
    assert (uniform <= bound * 1.001).all()


def test_least_cost_of_one_direction(rng: np.random.Generator) -> None:
    """In one dimension at one pose the least cost has a closed form."""
    a, cost, limit = rng.uniform(0.1, 3, 6), rng.uniform(0.5, 4, 6), 0.7
    tolerances = [Tolerance(name=f"x{i}", half_width=1.0, cost=c, exponent=1.0) for i, c in enumerate(cost)]
    error = unit_error(a[None, None])

    worst = allocate(tolerances, error, limit, "worst-case")
    statistical = allocate(tolerances, error, limit, "statistical")

    # Lagrange: t is in proportion to sqrt(cost / a), and to (cost / a²)^(1/3).
    expected = np.sqrt(cost / a)
    np.testing.assert_allclose(worst.half_widths, expected * limit / (a @ expected), rtol=1e-4)
    assert worst.costs.sum() == pytest.approx(np.sqrt(a * cost).sum() ** 2 / limit, rel=1e-7)
    expected = np.cbrt(cost / a**2)
    np.testing.assert_allclose(statistical.half_widths, expected * limit / np.sqrt(a**2 @ expected**2), rtol=1e-4)


@pytest.mark.parametrize("rule", ["worst-case", "statistical"])
def test_least_cost_on_a_path(rule: str, rng: np.random.Generator) -> None:
    """The limit is kept at every pose, no other tolerances found cost less, and the lower bound is met."""
    jacobian = rng.normal(size=(4, int(rng.integers(2, 4)), 5))
    tolerances, error, limit = named(rng.uniform(0.1, 2, 5), exponent=rng.uniform(0.5, 2)), unit_error(jacobian), 0.3

    found = allocate(tolerances, error, limit, rule)

    bounds, _ = error_bounds(error, found.half_widths, rule)
    assert bounds.max() == pytest.approx(limit, rel=1e-6)
    assert bounds.max() <= limit * (1 + 1e-9)
    assert found.least_cost <= found.costs.sum() * (1 + 1e-9)
    assert found.costs.sum() <= found.least_cost * (1 + 1e-6)
    assert found.costs.sum() <= found.scaled_cost * (1 + 1e-9)
    given, exponent = np.array([each.half_width for each in tolerances]), tolerances[0].exponent

    def cost(logs: np.ndarray) -> float:
        widths = given * np.exp(logs)
        widths *= limit / error_bounds(error, widths, rule)[0].max()
        return float(((given / widths) ** exponent).sum())

    start = np.log(found.half_widths / given)
    other = minimize(cost, start + rng.normal(scale=0.3, size=5), method="Nelder-Mead", options={"maxiter": 1500})
    assert other.fun >= found.costs.sum() * (1 - 1e-6)


def test_idle_dimensions_are_free() -> None:
    """A dimension that moves the tool at no pose needs no tolerance; if none moves it, nothing can be allocated."""
    jacobian = np.array([[[1.0, 0.0]]])
    found = allocate(named(np.ones(2)), unit_error(jacobian), 0.5, "worst-case")
    np.testing.assert_allclose(found.half_widths, [0.5, np.inf])
    assert found.costs[1] == 0
    with pytest.raises(InvalidValueError, match="no deviation moves the tool"):
        allocate(named(np.ones(2)), unit_error(jacobian * 0), 0.5, "worst-case")


@pytest.mark.parametrize("scale", [1e-300, 1e-150, 1e150, 1e200])
def test_longest_sum_is_as_long_in_other_units(scale: float, rng: np.random.Generator) -> None:
    """Products of small or large generators neither vanish nor overflow."""
    G = rng.normal(size=(3, 7))
    length, _ = longest_sum(G)
    assert longest_sum(G * scale)[0] == pytest.approx(length * scale, rel=1e-12)
    assert longest_sum(G * 0)[0] == 0


def test_short_generators_beside_long_ones(rng: np.random.Generator) -> None:
    """Generators that leave the plane of long ones by rounding have corners too."""
    for _ in range(50):
        G = rng.normal(size=(3, 9)) * 10.0 ** rng.choice([0, -10], size=9)
        signs = np.array(list(itertools.product((-1, 1), repeat=9)))
        assert longest_sum(G)[0] == pytest.approx(np.linalg.norm(signs @ G.T, axis=1).max(), rel=1e-9)


@pytest.mark.parametrize("uniform", [False, True])
def test_linear_law_is_compared_for_the_same_arms(*, uniform: bool) -> None:
    """By whatever law arms are drawn, the linear one is near for small tolerances, and is said not to be for large."""
    q = [[0.1, -0.3, 0.5, 0, 0.7, 0]]
    for degrees, near in ((0.01, True), (180.0, False)):
        swing = [Tolerance(name="joint1.theta", half_width=np.radians(degrees), unit="rad")]
        found = assess_tolerances(PUMA, q, swing, samples=200, uniform=uniform)
        assert (found.nonlinearity < 1e-4) == near
        assert any("trust the sampled" in note for note in found.notes) == (not near)
    spin = [Tolerance(name="tool.rx", half_width=0.01, unit="rad")]
    assert assess_tolerances(PUMA, q, spin, samples=20).nonlinearity < 1e-3


def test_long_tables_are_thinned(tolerances: tuple[Tolerance, ...]) -> None:
    """Of many poses some are computed, the first and the last included; their numbers are those of the table."""
    q = np.linspace([0, -0.4, 0.5, 0, 0.6, 0], [1, 0.2, 0.9, 0.4, 0.8, 0.2], 10_000)

    found = assess_tolerances(PUMA, q, tolerances, samples=10, most=4)

    assert found.numbers.tolist() == [1, 3334, 6667, 10_000]
    np.testing.assert_array_equal(found.mechanism.poses["q"], q[found.numbers - 1])
    assert any("4 of the 10000 poses" in note for note in found.notes)
    assert [pose["number"] for pose in found.as_data()["poses"]] == found.numbers.tolist()


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"samples": 10**9}, "at most 20000000 random mechanisms"),
        ({"limit": 1e-300}, "limit: expected 1e-12 to"),
        ({"limit": 1e90}, "limit: expected 1e-12 to"),
    ],
)
def test_what_is_too_much(options: dict, said: str, tolerances: tuple[Tolerance, ...]) -> None:
    """Numbers of samples and limits are bounded."""
    with pytest.raises(InvalidValueError, match=said):
        assess_tolerances(PUMA, np.zeros(6), tolerances, **options)


@pytest.mark.parametrize("rule", ["worst-case", "statistical"])
def test_least_cost_beside_a_mean_error(rule: str, rng: np.random.Generator) -> None:
    """A mean error leaves the rest of the limit; a tolerance that has a most is not wider, which costs more."""
    a, mean, limit = np.array([1.0, 2.0, 0.5]), 0.4, 1.0
    line = LinearError(names=("x", "y", "z"), deviations=np.ones(3), offset=[[mean]], jacobian=a[None, None])
    centred = allocate(named(np.ones(3)), unit_error(a[None, None]), limit - mean, rule)
    np.testing.assert_allclose(
        allocate(named(np.ones(3)), line, limit, rule).half_widths, centred.half_widths, rtol=1e-4
    )

    error = LinearError(
        names=tuple("abcd"), deviations=np.ones(4), offset=rng.normal(scale=0.1, size=(3, 2)),
        jacobian=rng.normal(size=(3, 2, 4)),
    )  # fmt: skip
    bounded = [Tolerance(name=f"x{i}", half_width=0.05, most=0.06 if i == 2 else np.inf) for i in range(4)]
    free, held = allocate(named(np.full(4, 0.05)), error, limit, rule), allocate(bounded, error, limit, rule)
    assert free.half_widths[2] > 0.06
    assert held.half_widths[2] <= 0.06 * (1 + 1e-9)
    for found in (free, held):
        assert error_bounds(error, found.half_widths, rule)[0].max() <= limit * (1 + 1e-9)
        assert found.costs.sum() <= found.least_cost * (1 + 1e-6)
    assert held.costs.sum() > free.costs.sum()
    narrow = [Tolerance(name=f"x{i}", half_width=0.01, most=0.02) for i in range(3)]
    np.testing.assert_array_equal(allocate(narrow, line, limit, rule).half_widths, [0.02] * 3)
    with pytest.raises(InvalidValueError, match="limit: expected more than the mean error, 400 mm"):
        allocate(named(np.ones(3)), line, mean, rule)


@pytest.mark.proof
def test_farthest_point(sample: Sample) -> None:
    """No point of the ellipsoid is farther, and near it none is much nearer; flat ones and centred ones included."""
    for rng in sample.cases(300):
        d = int(rng.integers(1, 4))
        root = rng.normal(size=(d, d)) * rng.choice([0, 1], size=d, p=[0.2, 0.8]) * 10 ** rng.uniform(-3, 3)
        mean = rng.normal(size=d) * rng.choice([0, 1]) * abs(root).max()
        if rng.random() < 0.3:
            # The hard case: the mean is across the longest axis.
            mean -= (axis := np.linalg.svd(root)[0][:, 0]) * (axis @ mean)
        z = rng.normal(size=(20000, d))
        around = mean + (z / np.linalg.norm(z, axis=1)[:, None]) @ root.T

        found = np.linalg.norm(farthest_point(mean, root @ root.T))

        assert np.linalg.norm(around, axis=1).max() <= found * (1 + 1e-7)
        assert np.linalg.norm(around, axis=1).max() == pytest.approx(found, rel=2e-2)
    sample.record("farthest points of ellipsoids", sample.count(300), 0)
