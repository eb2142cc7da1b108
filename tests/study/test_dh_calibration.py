"""The thesis' board: what its fit reaches, and what a complete model reaches on the same points."""

import numpy as np
import pytest

from armwright.study import dh_calibration as study
from armwright.study.dh_calibration_study import DhCalibration


def test_board() -> None:
    """The board has 33 points in one plane, tilted as the thesis tilts it."""
    for attitude, (roll, pitch) in study.ATTITUDES.items():
        points = study.board(attitude)
        assert len(points) == len(np.unique(points.round(9), axis=0)) == 33
        normal = np.linalg.svd(points - points.mean(axis=0))[2][2]
        assert np.degrees(np.arccos(abs(normal[2]))) == pytest.approx(np.hypot(roll, pitch), abs=1e-6)


def test_the_true_arm_touches_the_points() -> None:
    """Without noise the cameras see the points where the true arm has its tool."""
    data = study.measure_board("roll", noise=0.0)

    np.testing.assert_allclose(study.chain().forward(data.q, study.truth()).position, data.points, atol=1e-9)


@pytest.fixture(scope="module")
def verification() -> list[study.Row]:
    return study.verification_table()


def test_headline(verification: list[study.Row]) -> None:
    """The page begins with the error of the nominal arm and of the best fit of each model."""
    numbers = [*DhCalibration(verification=verification, parameters=[]).headline()]

    means = {
        name: [row.mean for row in verification if row.model == name] for name in ("nominal", "thesis", "complete")
    }
    assert [tile.value for tile in numbers[:3]] == [
        f"{means['nominal'][0]:.1f} mm",
        f"{min(means['thesis']):.3g} mm",
        f"{min(means['complete']):.3g} mm",
    ]
    assert numbers[3].value == "16.4 mm"


def test_verification(verification: list[study.Row]) -> None:
    """The arm is off by what the thesis' is; its fit leaves millimetres, the complete model takes 95 % away."""
    rows = {(row.model, row.points): row for row in verification}

    first = rows["nominal", "none"]
    assert first.mean == pytest.approx(np.mean(study.PRINTED["nominal"]), rel=0.05)
    assert all(rows["complete", one].mean < 0.05 * first.mean for one in (*study.ATTITUDES, "all three"))
    assert all(0.1 * first.mean < rows["thesis", one].mean < 0.3 * first.mean for one in study.ATTITUDES)


def test_parameters() -> None:
    """Where the arm stands is found, within four deviations of what is stated."""
    found = {name: (true, ours, deviation) for name, true, _, ours, deviation in study.parameter_table()}

    for name in ("base.x", "base.y"):
        true, ours, deviation = found[name]
        assert ours is not None
        assert deviation is not None
        assert abs(ours - true) < 4 * deviation
