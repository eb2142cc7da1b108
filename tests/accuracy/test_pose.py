"""Accuracy and repeatability of poses, distances, and what changes them."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st
from hypothesis.extra.numpy import arrays

from armwright.accuracy.compliance import static_compliance
from armwright.accuracy.distance import distance_accuracy, distance_repeatability
from armwright.accuracy.pose import pose_accuracy, pose_repeatability
from armwright.accuracy.variation import exchangeability, multidirectional_variation, pose_drift
from armwright.errors import InvalidValueError, KindError, ShapeError, TooFewError
from armwright.spatial.rotations import rotation_from_vector

# Rounding of positions of a metre.
ROUNDING = 1e-12
CROSS = np.array(((1.0, 0.0), (-1.0, 0.0), (0.0, 3.0), (0.0, -3.0)))
CLOUDS = arrays(np.float64, (30, 3), elements=st.floats(-1, 1))
VECTORS = arrays(np.float64, 3, elements=st.floats(-3, 3))


def test_by_hand() -> None:
    """Distances 1, 1, 3, 3 from the middle have mean 2 and deviation sqrt(4/3); the middle is (4, 3) accuracy."""
    result = pose_repeatability(CROSS, few=True)
    accuracy = pose_accuracy(CROSS + np.array((3.0, 4.0)), (0.0, 0.0), few=True)

    assert result.mean_distance == pytest.approx(2.0)
    assert result.deviation == pytest.approx(np.sqrt(4 / 3))
    assert result.radius == pytest.approx(2 + 3 * np.sqrt(4 / 3))
    assert result.cycles == 4
    assert accuracy.position == pytest.approx(5.0)
    np.testing.assert_allclose(accuracy.components, (3, 4))


def test_pure_offset() -> None:
    """A robot that always stops at the same wrong position has AP of the offset and RP 0."""
    positions = np.tile((0.4, 0.1, 0.3), (30, 1)) + np.array((0.001, -0.002, 0.002))

    assert pose_accuracy(positions, (0.4, 0.1, 0.3)).position == pytest.approx(0.003, abs=ROUNDING)
    assert pose_repeatability(positions).radius == pytest.approx(0.0, abs=ROUNDING)


@pytest.mark.parametrize(("size", "radius"), [(2, 3.2187), (3, 3.6160)])
def test_gaussian_cloud(size: int, radius: float, rng: np.random.Generator) -> None:
    """RP of a Gaussian cloud is 3.2187 sigma in a plane and 3.6160 sigma in space."""
    count = 400_000
    # l + 3 S of so many: the mean scatters by 0.7 / sqrt(n), the deviation by about the same, five times that.
    tolerance = 5 * (0.7 + 3 * 0.5) / np.sqrt(count)

    result = pose_repeatability(rng.normal(scale=1e-3, size=(count, size)))

    assert result.radius / 1e-3 == pytest.approx(radius, abs=tolerance)


@given(positions=CLOUDS, turn=VECTORS, shift=VECTORS)
def test_rigid_motion_of_poses(positions: np.ndarray, turn: np.ndarray, shift: np.ndarray) -> None:
    """AP, RP and the distances of poses do not depend on the frame in which they are measured."""
    R, goal = rotation_from_vector(turn), np.array((0.1, 0.2, 0.3))
    moved = positions @ R.T + shift
    other, other_moved = positions[::-1], positions[::-1] @ R.T + shift

    one, two = pose_accuracy(positions, goal), pose_accuracy(moved, R @ goal + shift)

    assert two.position == pytest.approx(one.position, abs=1e-12)
    assert pose_repeatability(moved).radius == pytest.approx(pose_repeatability(positions).radius, abs=1e-11)
    spread = distance_repeatability(positions, other).distance
    assert distance_repeatability(moved, other_moved).distance == pytest.approx(spread, abs=1e-11)


@given(turns=arrays(np.int64, (30, 1), elements=st.integers(-3, 3)), middle=st.floats(-np.pi, np.pi))
def test_turns_do_not_matter(turns: np.ndarray, middle: float) -> None:
    """Angles a revolution more or less are the same angles, wherever on the circle they are."""
    small = 0.01 * np.sin(np.arange(30.0))[:, None]
    positions = np.zeros((30, 2))

    result = pose_repeatability(positions, angles=middle + small + 2 * np.pi * turns)
    accuracy = pose_accuracy(
        positions, (0, 0), angles=middle + small + 2 * np.pi * turns, commanded_angles=[middle - 0.02]
    )

    np.testing.assert_allclose(result.angles, 3 * small.std(axis=0, ddof=1), rtol=1e-9)
    np.testing.assert_allclose(accuracy.angles, small.mean(axis=0) + 0.02, atol=1e-12)


def test_half_a_turn() -> None:
    """179.9 and -179.9 deg have the mean 180 deg and a deviation of 0.1414 deg, not of 254."""
    angles = np.radians(((179.9,), (-179.9,)))

    result = pose_repeatability(np.zeros((2, 2)), angles=angles, few=True)
    accuracy = pose_accuracy(np.zeros((2, 2)), (0, 0), angles=angles, commanded_angles=[np.pi], few=True)

    assert np.degrees(result.angles[0]) == pytest.approx(3 * 0.1 * np.sqrt(2))
    assert accuracy.angles[0] == pytest.approx(0.0, abs=ROUNDING)


def test_directions_of_approach() -> None:
    """Play of 0.2 mm, felt from both sides, moves the pose by 0.2 mm; the two sides are named."""
    clouds = [np.full((30, 2), 1.0) + np.array((side, 0.0)) for side in (-1e-4, 1e-4, 0.0)]

    result = multidirectional_variation(clouds)

    assert result.position == pytest.approx(2e-4)
    assert result.pair == (0, 1)


def test_exchanged_robots() -> None:
    """Of five robots the two that are farthest apart decide; angles across 180 deg are near."""
    clouds = [np.full((30, 3), 1e-3 * k) for k in (0, 2, 5, 1, 3)]
    angles = [np.full((30, 1), np.pi - 0.01 + 0.005 * k) for k in range(5)]

    result = exchangeability(clouds, angles=angles)

    assert result.position == pytest.approx(5e-3 * np.sqrt(3))
    assert result.pair == (0, 2)
    np.testing.assert_allclose(result.angles, [0.02])


def test_drift() -> None:
    """A robot that grows by 1 mm while it warms up drifts by 1 mm, and a cloud twice as wide has twice the RP."""
    shape = np.vstack([CROSS, -CROSS, CROSS]) * 1e-5

    result = pose_drift([0, 600, 1200], [shape, 2 * shape + (5e-4, 0), 2 * shape + (1e-3, 0)], (0, 0))

    assert result.accuracy_change == pytest.approx(1e-3)
    np.testing.assert_allclose(result.accuracy, (0, 5e-4, 1e-3), atol=ROUNDING)
    assert result.repeatability_change == pytest.approx(result.repeatability[0])


def test_distances() -> None:
    """Attained distances of 1.001 and 1.003 for 1: AD is 2 mm, RD three times sqrt(2) mm."""
    first = np.zeros((2, 2))
    second = np.array(((0.0, 1.001), (0.0, 1.003)))

    accuracy = distance_accuracy(first, second, (0, 0), (0, 1), few=True)
    spread = distance_repeatability(first, second, few=True)

    assert accuracy.distance == pytest.approx(0.002)
    np.testing.assert_allclose(accuracy.components, (0, 0.002), atol=ROUNDING)
    assert spread.distance == pytest.approx(3e-3 * np.sqrt(2))


def test_angles_of_distances() -> None:
    """Of 10 degrees asked 10.1 and 10.3 are attained: AD_c is 0.2 degrees, RD_c three times 0.2 / sqrt(2)."""
    position, turned = np.zeros((2, 2)), np.radians([[10.1], [10.3]])
    angles = (np.zeros((2, 1)), turned)

    accuracy = distance_accuracy(
        position, position, (0, 0), (0, 0), angles=angles, commanded_angles=([0], [np.pi / 18]), few=True
    )
    spread = distance_repeatability(position, position, angles=angles, few=True)

    np.testing.assert_allclose(np.degrees(accuracy.angles), [0.2], atol=1e-9)
    np.testing.assert_allclose(np.degrees(spread.angles), [3 * 0.2 / np.sqrt(2)], atol=1e-9)


def test_half_a_turn_between_two_poses() -> None:
    """Rotations of 179.9 and 180.1 degrees, of 180 commanded, are 0.2 degrees apart: AD is 0, unfolded."""
    position = np.zeros((2, 2))
    angles = (np.radians([[-90.0], [-90.0]]), np.radians([[89.9], [-269.9]]))
    goals = ([-np.pi / 2], [np.pi / 2])

    accuracy = distance_accuracy(position, position, (0, 0), (0, 0), angles=angles, commanded_angles=goals, few=True)
    spread = distance_repeatability(position, position, angles=angles, few=True)

    np.testing.assert_allclose(np.degrees(accuracy.angles), [0.0], atol=1e-9)
    np.testing.assert_allclose(np.degrees(spread.angles), [3 * 0.2 / np.sqrt(2)], atol=1e-9)


def test_drift_of_angles() -> None:
    """A tool that rotates by 2 mrad while the robot warms up, and scatters twice as much, drifts by that."""
    positions = [np.zeros((10, 2))] * 2
    turn = 1e-3 * np.resize((1.0, -1.0), (10, 1))

    result = pose_drift([0, 600], positions, (0, 0), angles=[turn, 2 * turn + 2e-3], commanded_angles=[0.0])

    np.testing.assert_allclose(result.accuracy_change_angles, [2e-3], atol=ROUNDING)
    np.testing.assert_allclose(result.repeatability_change_angles, [3e-3 * np.sqrt(10 / 9)], atol=ROUNDING)


def test_compliance() -> None:
    """A spring of 1e5 N/m yields by 1e-5 m/N along the force, and by a tenth of it across."""
    loads = np.repeat(np.arange(0.0, 110.0, 10.0), 3)
    positions = np.array((1.0, 2.0, 3.0)) + loads[:, None] * (-1e-5, 1e-6, 0.0)

    result = static_compliance(loads, positions, (-2.0, 0.0, 0.0))

    assert result.along == pytest.approx(1e-5)
    np.testing.assert_allclose(result.components, (-1e-5, 1e-6, 0), atol=1e-15)
    assert result.cycles == 3
    assert result.deflections[-1, 0] == pytest.approx(-1e-3)


THIRTY = np.zeros((30, 2))
MISTAKES: dict[str, tuple[Any, type[Exception], str]] = {
    "few": (lambda: pose_accuracy(THIRTY[:12], (0, 0)), TooFewError, "pose: ISO 9283 requires 30 cycles, got 12"),
    "one": (lambda: pose_repeatability(THIRTY[:1], few=True), TooFewError, "expected at least 2 cycles, got 1"),
    "directions": (
        lambda: multidirectional_variation([THIRTY, THIRTY]),
        TooFewError,
        "requires 3 directions of approach, got 2",
    ),
    "robots": (lambda: exchangeability([THIRTY], few=True), TooFewError, "expected at least 2 robots, got 1"),
    "few of one robot": (
        lambda: exchangeability([THIRTY] * 4 + [THIRTY[:9]]),
        TooFewError,
        "exchangeability: ISO 9283 requires 30 cycles, got 9",
    ),
    "loads": (lambda: static_compliance([0, 1, 2], THIRTY[:3], (1, 0)), TooFewError, "10 loads besides none, got 2"),
    "no rest": (lambda: static_compliance([1, 2], THIRTY[:2], (1, 0)), InvalidValueError, "a measurement without load"),
    "pull": (lambda: static_compliance([0, -2], THIRTY[:2], (1, 0)), InvalidValueError, "reverse the direction"),
    "no direction": (lambda: static_compliance([0, 2], THIRTY[:2], (0, 0)), InvalidValueError, "direction is 0"),
    "text": (lambda: pose_repeatability("abc"), KindError, "positions: expected numbers, got 'abc'"),
    "NaN": (lambda: pose_repeatability(THIRTY * np.nan), InvalidValueError, "every number must be finite, got nan"),
    "columns": (lambda: pose_repeatability(np.zeros((30, 4))), ShapeError, "expected shape (n, 2) in a plane or"),
    "goal": (lambda: pose_accuracy(THIRTY, (0, 0, 0)), ShapeError, "commanded position: expected 2 numbers"),
    "angles": (lambda: pose_repeatability(THIRTY, angles=np.zeros((29, 1))), ShapeError, "expected shape (30, k)"),
    "no goal for angles": (
        lambda: pose_accuracy(THIRTY, (0, 0), angles=np.zeros((30, 2))),
        ShapeError,
        "commanded angles: expected 2 numbers, as many as were measured",
    ),
    "all round": (
        lambda: pose_repeatability(THIRTY, angles=np.linspace(0, 6, 30)[:, None]),
        InvalidValueError,
        "defined only for angles within 90 deg",
    ),
    "two sizes": (
        lambda: multidirectional_variation([THIRTY, THIRTY, np.zeros((30, 3))]),
        ShapeError,
        "multidirectional: all parts of a test must have the same columns, got 2 and 3",
    ),
    "cycles of a distance": (
        lambda: distance_repeatability(THIRTY, THIRTY[1:]),
        ShapeError,
        "the two poses need the same cycles, got shapes (30, 2) and (29, 2)",
    ),
    "time back": (lambda: pose_drift([1, 0], [THIRTY] * 2, (0, 0)), InvalidValueError, "each later than the one"),
    "times": (lambda: pose_drift([1], [THIRTY] * 2, (0, 0)), ShapeError, "expected one per measurement, 2"),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_mistakes(name: str) -> None:
    """What cannot be measured is refused with what was expected."""
    call, kind, message = MISTAKES[name]

    with pytest.raises(kind) as caught:
        call()

    assert message in str(caught.value)
