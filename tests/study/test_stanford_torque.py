"""The report's study of the Stanford arm: its figures, its constants, its claims."""

import numpy as np
import pytest

from armwright.dynamics.shares import gravity_efforts
from armwright.errors import UnknownNameError
from armwright.study.stanford_torque import (
    DURATION,
    GOAL,
    GRAVITY,
    START,
    PrintedRow,
    Torques,
    coefficient_table,
    figure,
    form_table,
    joint_table,
    load_table,
    study_arm,
    torques,
)


@pytest.fixture(scope="module")
def study() -> Torques:
    return torques()


@pytest.fixture(scope="module")
def coefficients() -> dict[str, PrintedRow]:
    return {row.name: row for row in coefficient_table()}


def test_motion(study: Torques) -> None:
    """The move starts and ends at rest where the report has it, fastest in the middle with 15/8 of the mean speed."""
    np.testing.assert_allclose(study.q[[0, -1]], (START, GOAL), atol=1e-12)
    np.testing.assert_allclose(study.qd[[0, -1]], 0.0, atol=1e-12)
    np.testing.assert_allclose(study.qdd[[0, -1]], 0.0, atol=1e-11)
    assert np.abs(study.qd[:, 0]).max() == pytest.approx(15 / 8 * 1.57 / DURATION)
    assert np.abs(study.qdd[:, 0]).max() == pytest.approx(10 / np.sqrt(3) * 1.57 / DURATION**2, rel=1e-3)


def test_figures(study: Torques) -> None:
    """Figures 3 to 5 show joint 1 in motion, 6 to 11 the three cases of each joint."""
    assert figure(study, 3).lines["joint 1"][-1] == pytest.approx(1.57)
    assert figure(study, 5).unit == "rad/s²"
    units = [figure(study, number).unit for number in range(6, 12)]
    assert units == ["N m", "N m", "N", "N m", "N m", "N m"]
    for number in range(6, 12):
        shown = figure(study, number)
        assert list(shown.lines) == ["Newton-Euler, no load", "Bejczy", "Newton-Euler, largest load"]
        assert all(curve.shape == study.t.shape for curve in shown.lines.values())
    np.testing.assert_array_equal(figure(study, 8).lines["Bejczy"], study.bejczy[:, 2])
    with pytest.raises(UnknownNameError, match="no figure '12'"):
        figure(study, 12)


def test_where_gravity_is_largest(study: Torques) -> None:
    """At the start only the slide feels gravity, as much as it ever does; on the way joint 2 feels the most.

    The report chose the ends of the move for that.
    """
    weight = gravity_efforts(study_arm(), study.q)

    assert np.abs(weight[0, [0, 1, 3, 4, 5]]).max() < 0.01 * np.abs(weight[:, 1]).max()
    assert np.abs(weight[:, 2]).argmax() == 0
    assert weight[0, 2] == pytest.approx(-6.47 * GRAVITY)
    assert 0 < np.abs(weight[:, 1]).argmax() < len(study.t) - 1
    assert np.abs(weight[:, 2]).min() < 0.02 * np.abs(weight[:, 2]).max()


def test_load_is_felt_most_at_the_wrist(study: Torques) -> None:
    """The report's finding: a load changes the efforts of joints 4 and 5 more than those of any other."""
    rows = joint_table(study)

    order = sorted(rows, key=lambda row: row.load, reverse=True)
    assert {row.joint for row in order[:2]} == {4, 5}
    assert order[1].load > 2 * order[2].load
    assert [row.limit for row in rows] == [91.8, 303.0, 198.0, 10.15, 10.15, 7.15]
    assert [row.joint for row in rows if row.peak_loaded > row.limit] == [5]


def test_what_bejczy_leaves_out_is_felt(study: Torques) -> None:
    """In a fast move speeds and coupling count: the model is off by a third and more at every joint but the last."""
    parts = [row.bejczy for row in joint_table(study)]

    assert min(parts[:5]) > 0.3
    assert parts[5] < 0.15


def test_bejczy_is_right_at_rest(study: Torques) -> None:
    """At the ends of the move, where nothing but gravity acts, model and Newton-Euler agree."""
    peaks = np.abs(study.empty).max(axis=0)

    assert (np.abs(study.bejczy - study.empty)[[0, -1]] < 0.02 * peaks).all()


def test_verdicts(coefficients: dict[str, PrintedRow]) -> None:
    """Wrong are the rotor in b4 and k2, b20, and the factor of k3; all else is as printed or near."""
    wrong = {name for name, row in coefficients.items() if row.verdict == "wrong"}

    assert wrong == {"b4", "k2", "b20", "k3 / b5"}
    assert {name for name, row in coefficients.items() if row.verdict == "near"} == {"b1", "b5"}
    assert all(row.note for row in coefficients.values() if row.verdict == "wrong")


def test_fitted_numbers(coefficients: dict[str, PrintedRow]) -> None:
    """The numbers that must come out, most of them from masses and lengths that one can add up."""
    expected = {
        "b4": 4.25 + 1.08 + 0.63 + 0.51,
        "k2": 6.470,
        "slide": 6.470 + 0.782,
        "k1": -2.793,
        "k3": 0.63 * 0.0566 + 0.51 * (0.2477 - 0.0922),
        "b20": 0.0003,
        "b13": 4.735,
        "b14": 0.1077,
        "b15": 0.0153,
        "b17 + b18": 0.113,
    }
    for name, value in expected.items():
        assert coefficients[name].computed == pytest.approx(value, rel=2e-3), name
    assert coefficients["b1"].computed == pytest.approx(1.452, rel=5e-3)
    assert coefficients["b2"].computed == pytest.approx(2.495, rel=0.01)
    assert coefficients["b3"].computed == pytest.approx(2 * 4.25 * -0.6447, rel=0.01)
    assert 0.230 < coefficients["b5"].computed < 0.241
    assert coefficients["k3 / b5"].computed == pytest.approx(0.5, rel=0.05)


def test_sign_of_gravity() -> None:
    """With gravity up, as the report has it, the slide must be pulled down; its k2 has that sign."""
    assert gravity_efforts(study_arm(), START)[2] < 0


def test_form_of_d11() -> None:
    """Without the square of sin q2 no constants explain D11; with it they leave a twentieth at most."""
    printed, corrected = form_table()

    assert printed.share > 0.5
    assert corrected.share < 0.05


def test_loaded_link() -> None:
    """The load makes link 6 what the report prints, but for y, which it forgets, and two digits that it cuts."""
    rows = {row.name: row for row in load_table()}

    assert {name for name, row in rows.items() if row.verdict == "wrong"} == {"y6", "I6 xx", "I6 yy"}
    assert rows["m6"].computed == pytest.approx(2.31)
    for name in ("I6 xx", "I6 yy"):
        assert int(rows[name].computed * 1000) == 6
