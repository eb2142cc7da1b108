"""Paths of the tool planned in time."""

from itertools import pairwise

import numpy as np
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation, Slerp

from armwright.arrays import Array
from armwright.motion.blends import blended
from armwright.motion.tool_path import Orientation, ToolPath, tool_path, zyz_angles
from armwright.spatial.euler import matlab_zyz
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import rotation_vector

TIMES = np.array([0.0, 1.0, 1.7, 3.0])
BLENDS = np.array([0.3, 0.4, 0.2, 0.5])

seeds = st.integers(0, 2**32 - 1)
ends = st.sampled_from(["rest", "running"])
orientations: st.SearchStrategy[Orientation] = st.sampled_from(["geodesic", "zyz"])


def random_path(seed: int, ends: str, orientation: Orientation) -> tuple[ToolPath, Array]:
    """Return a path through four random poses, and the poses."""
    rng = np.random.default_rng(seed)
    poses = homogeneous(Rotation.random(4, random_state=rng).as_matrix(), rng.normal(size=(4, 3)))
    return tool_path(poses, TIMES, BLENDS, ends=ends, orientation=orientation), poses  # type: ignore[arg-type]


def body_rates(path: ToolPath, t: Array) -> Array:
    """Return the angular velocity in the axes of the tool at times, by central differences."""
    h = 1e-5
    before, after = path(t - h)[..., :3, :3], path(t + h)[..., :3, :3]
    return rotation_vector(np.swapaxes(before, -1, -2) @ after) / (2 * h)


@given(seeds, ends, orientations)
def test_ends_and_straight_lines(seed: int, ends: str, orientation: Orientation) -> None:
    """The path begins and ends at its first and last pose, and is no other path when run slower."""
    path, poses = random_path(seed, ends, orientation)

    np.testing.assert_allclose(path([0.0, 3.0]), poses[[0, 3]], atol=1e-9)
    t = np.linspace(0, 3, 50)
    np.testing.assert_allclose(path.slowed(2.5)(2.5 * t), path(t), atol=1e-9)


@given(seeds, ends)
def test_between_the_blends_about_one_axis(seed: int, ends: str) -> None:
    """On a straight line the tool rotates as SciPy's Slerp does between the two poses."""
    path, poses = random_path(seed, ends, "geodesic")
    # The way between the second and the third pose, off their blends; it belongs to one pose and then to the other.
    t = np.linspace(1.4, 1.5, 21)

    expected = Slerp([1.0, 1.7], Rotation.from_matrix(poses[1:3, :3, :3]))(t).as_matrix()

    np.testing.assert_allclose(path(t)[:, :3, :3], expected, atol=1e-9)


@given(seeds, ends, orientations)
def test_turns_without_jolts(seed: int, ends: str, orientation: Orientation) -> None:
    """Orientation, rate and acceleration have no jump, and none is above the bounds that the path gives."""
    path, _ = random_path(seed, ends, orientation)
    fastest, change = (bounds.max() for bounds in path.spin())
    t = np.linspace(1e-3, 3 - 1e-3, 3001)

    rates = body_rates(path, t)

    # Central differences of angles of size 1 over 2e-5 s have some ten digits left.
    assert np.linalg.norm(rates, axis=-1).max() <= fastest + 1e-6
    # A jump of the rate would be a change as large in however short a step.
    assert np.linalg.norm(np.diff(rates, axis=0), axis=-1).max() <= change * (t[1] - t[0]) + 1e-6


@given(seeds)
def test_rates_of_change_are_continuous(seed: int) -> None:
    """Where blends begin and end, and where one pose hands over to the next, the angular acceleration does not jump."""
    path, _ = random_path(seed, "rest", "geodesic")
    t = np.sort(np.concatenate([path.knots[1:-1], [(1.4 + 1.5) / 2, (0.3 + 0.6) / 2, (1.9 + 2.5) / 2]]))
    h = 1e-3

    before, after = (body_rates(path, t + k * h) - body_rates(path, t + (k - 1) * h) for k in (0, 1))

    # The jerk on blends of 0.2 s of turns of some rad/s is some hundreds of rad/s³.
    change = path.spin()[1].max()
    assert np.abs(after - before).max() / h <= 30 * h * change / BLENDS.min()


def test_the_seeds_angles() -> None:
    """The seed's way blends MATLAB's angles, whose first turn is longer than the shortest by far."""
    R = np.array(
        [
            [[0.64, 0.77, 0], [0.77, -0.64, 0], [0, 0, -1]],
            [[0.87, -0.1, 0.48], [0.29, 0.9, -0.34], [-0.4, 0.43, 0.81]],
            [[0.41, -0.29, 0.87], [0.69, 0.71, -0.09], [-0.6, 0.64, 0.49]],
        ]
    )

    by_matlab, by_nearest = (np.abs(np.diff(angles, axis=0)).sum(axis=1) for angles in (matlab_zyz(R), zyz_angles(R)))

    # By hand: from (0, -180, 129.7) to (144.7, -35.9, -132.9) deg.
    np.testing.assert_allclose(np.degrees(by_matlab[0]), 144.69 + 144.06 + 262.66, atol=0.02)
    assert by_nearest[0] < 0.5 * by_matlab[0]


def test_positions_are_blended() -> None:
    """Places are those of the blended trajectory, exactly."""
    path, poses = random_path(1, "rest", "geodesic")
    t = np.linspace(-1, 4, 77)

    np.testing.assert_array_equal(path(t)[:, :3, 3], blended(TIMES, poses[:, :3, 3], BLENDS)(t))
    assert path.acceleration().max() <= np.linalg.norm(path.position.peaks(2)) + 1e-12


@settings(max_examples=10)
@given(seeds, ends, orientations)
def test_bounds_hold_between_knots(seed: int, ends: str, orientation: Orientation) -> None:
    """On each interval by itself the bounds hold; on lines positions and rotations about an axis are even."""
    path, _ = random_path(seed, ends, orientation)
    t = np.linspace(1e-3, 3 - 1e-3, 3001)
    rates = np.linalg.norm(body_rates(path, t), axis=-1)
    changes = np.linalg.norm(np.diff(body_rates(path, t), axis=0), axis=-1) / (t[1] - t[0])
    accelerations = np.linalg.norm(path.position(t, 2), axis=-1)
    fastest, change = path.spin()

    for k, (start, end) in enumerate(pairwise(path.knots)):
        inside = (t > start + 1e-3) & (t < end - 1e-3)
        assert rates[inside].max() <= fastest[k] + 1e-6
        assert changes[inside[:-1] & inside[1:]].max() <= change[k] + 1e-3
        assert accelerations[inside].max() <= path.acceleration()[k] + 1e-9
        if (accelerations[inside] < 1e-9).all() and orientation == "geodesic":
            assert change[k] == 0
