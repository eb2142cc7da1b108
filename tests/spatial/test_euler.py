"""ZYZ Euler angles, there and back, and as MATLAB gives them."""

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.spatial.transform import Rotation

from armwright.errors import ShapeError
from armwright.spatial.euler import from_zyz, matlab_zyz, next_zyz, to_rpy, to_zyz

# Products of a dozen roundings of numbers of size 1.
ROUNDING = 1e-12

angle = st.floats(-10, 10)
# The rotations of the poses of the project on the PUMA's trajectories, as printed.
POSE_A = [[0.64, 0.77, 0], [0.77, -0.64, 0], [0, 0, -1]]
POSE_B = [[0.87, -0.1, 0.48], [0.29, 0.9, -0.34], [-0.4, 0.43, 0.81]]


@given(angle, angle, angle)
def test_as_scipy_has_them(phi: float, theta: float, psi: float) -> None:
    """The rotation is that of SciPy's intrinsic ZYZ sequence."""
    expected = Rotation.from_euler("ZYZ", [phi, theta, psi]).as_matrix()

    np.testing.assert_allclose(from_zyz([phi, theta, psi]), expected, atol=ROUNDING)


@given(angle, st.one_of(angle, st.sampled_from([0.0, np.pi, -np.pi, 1e-8])), angle)
def test_there_and_back(phi: float, theta: float, psi: float) -> None:
    """Angles found from a rotation give that rotation, at the singular places too, both ways of counting them."""
    R = from_zyz([phi, theta, psi])

    np.testing.assert_allclose(from_zyz(to_zyz(R)), R, atol=2e-9)
    np.testing.assert_allclose(from_zyz(matlab_zyz(R)), R, atol=2e-9)
    assert 0 <= to_zyz(R)[1] <= np.pi
    assert -np.pi <= matlab_zyz(R)[1] <= 0


def test_many_at_once() -> None:
    """A stack of rotations gives a stack of angles."""
    R = Rotation.random(12, random_state=1).as_matrix().reshape(3, 4, 3, 3)

    assert to_zyz(R).shape == (3, 4, 3)
    np.testing.assert_allclose(from_zyz(to_zyz(R)), R, atol=ROUNDING)
    np.testing.assert_allclose(from_zyz(matlab_zyz(R)), R, atol=ROUNDING)


def test_straight_up_and_down() -> None:
    """Where theta is 0 or half a turn, phi is 0 and psi is the whole turn about z."""
    np.testing.assert_allclose(to_zyz(from_zyz([0.3, 0.0, 0.4])), (0, 0, 0.7), atol=ROUNDING)
    np.testing.assert_allclose(to_zyz(from_zyz([0.3, np.pi, 0.4])), (0, np.pi, 0.1), atol=1e-9)


@pytest.mark.parametrize(
    ("R", "degrees"),
    [
        # The example of MATLAB's own documentation of rotm2eul.
        ([[0, 0, 1], [0, 1, 0], [-1, 0, 0]], (-180, -90, -180)),
        # The singular pose of the project: atan2(0.77, -0.64) about z.
        (POSE_A, (0, -180, np.degrees(np.arctan2(0.77, -0.64)))),
        # phi = -atan2(-0.34, -0.48), theta = -atan2(|(0.4, 0.43)|, 0.81), psi = -atan2(0.43, -0.40)
        (
            POSE_B,
            np.degrees([-np.arctan2(-0.34, -0.48), -np.arctan2(np.hypot(0.4, 0.43), 0.81), -np.arctan2(0.43, -0.4)]),
        ),
    ],
)
def test_as_matlab_has_them(R: object, degrees: object) -> None:
    """MATLAB counts theta downwards, and takes rotations as they were typed."""
    np.testing.assert_allclose(np.degrees(matlab_zyz(R)), degrees, atol=1e-9)


@given(angle, st.floats(-3, 3), angle, st.tuples(*[st.floats(-0.2, 0.2)] * 3))
def test_the_next_ones(phi: float, theta: float, psi: float, step: tuple[float, float, float]) -> None:
    """Angles of a rotation nearby are angles nearby, whatever their sign and however many turns they have made."""
    last = np.array([phi, theta, psi])
    R = from_zyz(last + step)

    found = next_zyz(R, last)

    np.testing.assert_allclose(from_zyz(found), R, atol=1e-8)
    # There is such a solution; the one that is found is no farther.
    assert np.abs(found - last).sum() <= np.abs(step).sum() + 1e-6


def test_what_is_no_rotation() -> None:
    """What is not 3 x 3 is refused by name."""
    with pytest.raises(ShapeError, match=r"rotation: .*\(2, 2\)"):
        to_zyz(np.eye(2))
    with pytest.raises(ShapeError, match="ZYZ angles"):
        from_zyz([1.0, 2.0])


@pytest.mark.parametrize("pitch", [0.3, np.pi / 2, -np.pi / 2, np.pi / 2 - 1e-10])
def test_roll_pitch_yaw(pitch: float, rng: np.random.Generator) -> None:
    """Roll, pitch and yaw give their rotation again, also where yaw and roll turn about one axis."""
    for roll, yaw in rng.uniform(-3, 3, (20, 2)):
        R = Rotation.from_euler("xyz", (roll, pitch, yaw)).as_matrix()

        found = to_rpy(R)

        np.testing.assert_allclose(Rotation.from_euler("xyz", found).as_matrix(), R, atol=1e-14)
        assert abs(found[1]) <= np.pi / 2
