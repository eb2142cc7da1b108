"""Tolerances of linkages: their files, the published five-bar, and full equilibria at the ends of all tolerances."""

from pathlib import Path

import numpy as np
import pytest

from armwright.clearance.ideal import tip_position
from armwright.clearance.poses import closed_at, poses_on_path
from armwright.clearance.reader import load_linkage
from armwright.clearance.static_equilibrium import find_static_equilibrium
from armwright.errors import FileFormatError, InvalidValueError, UnknownNameError
from armwright.reliability.linkage_tolerances import LinkageTolerances, read_linkage_tolerances
from armwright.reliability.tip_errors import assess_linkage_tolerances, sampled_tip_errors
from armwright.reliability.tolerances import Tolerance
from armwright.reliability.worst_case import longest_sum

FIVE_BAR = load_linkage("five-bar")
EXAMPLE = Path(__file__).parents[2] / "examples" / "five_bar_tolerances.toml"
# The goals of the thesis, and the clearances of its arm A [m].
GOALS = np.array([(-0.18, -0.6), (0.0, -0.575), (0.18, -0.6)])
ARM_A = (0.328e-3, 0.171e-3, 0.483e-3)
# Probabilities of errors beyond limits [m] at the first goal, and their standard errors, from 4 million linear samples.
PUBLISHED = ((0.58e-3, 0.20268, 0.00023), (0.60e-3, 0.03880, 0.00010), (0.62e-3, 0.003628, 0.000030))


@pytest.fixture(scope="module")
def example() -> LinkageTolerances:
    return read_linkage_tolerances(EXAMPLE, FIVE_BAR)


def read(text: str, folder: Path, name: str = "five-bar") -> LinkageTolerances:
    (folder / "t.toml").write_text(text, encoding="utf-8")
    return read_linkage_tolerances(folder / "t.toml", load_linkage(name))


def test_file(example: LinkageTolerances) -> None:
    """What is named replaces what all have; clearances have means; costs are those of the file."""
    found = {each.name: each for each in example.tolerances}

    assert example.linkage.clearances == pytest.approx({"J2": 2e-5, "J3": 1e-5, "J4": 2e-5})
    assert found["J3.clearance"].half_width == pytest.approx(3e-6)
    assert found["J3.clearance"].most == pytest.approx(1e-5)
    assert found["J3.clearance"].cost == 2
    assert found["link2.length"].half_width == pytest.approx(3e-5)
    assert found["link3.length"].half_width == pytest.approx(2e-5)
    assert found["link4.zero"].half_width == pytest.approx(np.radians(0.005))
    assert found["link4.zero"].unit == "rad"
    assert found["ground:J5.x"].half_width == pytest.approx(2e-5)
    assert {"tool.along", "tool.across"} < set(found)
    assert len(found) == 12


def test_every_table(tmp_path: Path) -> None:
    """Guides, masses and loads have tables too."""
    text = (
        "[clearances_mm]\nB = [0.1, 0.0]\n[guides_deg]\n'slider.direction' = 0.1\n[masses_kg]\nall = 0.01\nrod = 0.02"
    )
    found = {each.name: each for each in read(text, tmp_path, "slider-crank").tolerances}

    assert set(found) == {"slider.direction", "crank.mass", "rod.mass", "slider.mass"}
    assert found["rod.mass"].displayed == (0.02, "kg")
    assert found["slider.direction"].displayed == pytest.approx((0.1, "deg"))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "clearances_mm: missing"),
        ("[clearances_mm]\nJ2 = [0.1, 0.02]", "J3: missing, expected a list of 2 numbers"),
        ("[clearances_mm]\nall = 0.1", "expected a list of 2 numbers"),
        ("[clearances_mm]\nall = [0.1, 0.2]", "expected a tolerance of 0 to the mean clearance, 0.1 mm, got 0.2"),
        ("[clearances_mm]\nall = [20, 0.2]", "to the radius of the journal, 10 mm, got 20"),
        ("[clearances_mm]\nall = [0.1, 0]\nJ9 = [0.1, 0]", "J9: unknown key"),
        ("[clearances_mm]\nall = [0.1, 0]", "expected a tolerance above zero"),
        ("[clearances_mm]\nall = [0.1, 0]\n[lengths_mm]\nlink9 = 1", "did you mean 'link"),
        (
            "[clearances_mm]\nall = [0.1, 0]\n[masses_kg]\nlink2 = 1",
            "tolerance of link2.mass: expected at most its mean",
        ),
        ("[clearances_mm]\nall = [0.1, 0]\n[lengths]\nall = 1", "did you mean 'lengths_mm'"),
        (
            "[clearances_mm]\nall = [0.1, 0]\n[tool_mm]\nall = 1\n[cost.factors]\n'link9.length' = 2",
            "no such dimension",
        ),
    ],
)
def test_bad_files(text: str, said: str, tmp_path: Path) -> None:
    """What a file has wrong is said."""
    with pytest.raises((FileFormatError, InvalidValueError), match=said):
        read(text, tmp_path)


def test_published_probabilities() -> None:
    """Arm A at the first goal with 0.02 mm of spread in each clearance is as often off as the spec has it."""
    model = FIVE_BAR.with_clearances(dict(zip(FIVE_BAR.clearances, ARM_A, strict=True)))
    spread = [Tolerance(name=f"{name}.clearance", half_width=6e-5, most=c) for name, c in model.clearances.items()]

    error = assess_linkage_tolerances(model, GOALS[:1], spread, samples=1).error

    # The spec is linear about no clearance, this about the mean: a part in a thousand of the derivatives.
    np.testing.assert_allclose(error.offset[0], (-0.10075e-3, -0.55272e-3), rtol=0, atol=2e-7)
    for limit, expected, deviation in PUBLISHED:
        assert error.pose_probabilities(limit)[0] == pytest.approx(expected, abs=3 * deviation, rel=0.015)


def test_mean_clearances_shift_the_tip(example: LinkageTolerances) -> None:
    """The shift is that of the full equilibrium; without it, as of a corrected path, the spread alone is left."""
    q = closed_at(example.linkage, GOALS)
    shift = find_static_equilibrium(example.linkage, q).tip - tip_position(example.linkage, q)

    whole, rest = (
        assess_linkage_tolerances(example.linkage, GOALS, example.tolerances, corrected=corrected, samples=5)
        for corrected in (False, True)
    )

    np.testing.assert_allclose(whole.error.offset, shift, rtol=0, atol=1e-12)
    assert not rest.error.offset.any()
    np.testing.assert_array_equal(whole.error.jacobian, rest.error.jacobian)
    assert (whole.worst_case > rest.worst_case).all()
    for found in (whole, rest):
        assert found.nonlinearity < 1e-3
        assert sum("only when the load is reversed" in note for note in found.notes) == 2


def test_the_worst_linkage(example: LinkageTolerances) -> None:
    """With all dimensions at the ends that the worst case names, the full equilibrium is as far off as it says."""
    found = assess_linkage_tolerances(example.linkage, GOALS, example.tolerances, samples=1)
    widths = np.array([each.half_width for each in example.tolerances])
    q = closed_at(example.linkage, GOALS)

    for p, (mean, J) in enumerate(zip(found.error.offset, found.error.jacobian, strict=True)):
        _, ends = longest_sum(J * widths, mean)
        (error,) = sampled_tip_errors(example.linkage, q[p : p + 1], found.error.names, (widths * ends)[None])
        assert np.linalg.norm(error) == pytest.approx(found.worst_case[p], rel=1e-3)


def test_least_cost_keeps_clearances_possible(example: LinkageTolerances) -> None:
    """Tolerances of least cost keep the limit, and no clearance may become negative."""
    found = assess_linkage_tolerances(
        example.linkage, GOALS, example.tolerances, limit=0.3e-3, allocation="statistical", samples=1
    )

    assert found.allocation is not None
    widths = dict(zip(found.error.names, found.allocation.half_widths, strict=True))
    assert widths["J2.clearance"] == pytest.approx(2e-5)
    assert found.allocation.bounds.max() == pytest.approx(0.3e-3, rel=1e-6)
    assert found.allocation.costs.sum() < found.allocation.scaled_cost


def test_a_single_drive() -> None:
    """Of a linkage with one drive a pose is its angle; once round, every linkage stays in its assembly."""
    linkage = load_linkage("slider-crank").with_clearances({"B": 1e-4})
    turn = poses_on_path(linkage, "turn", 9)
    tolerances = [Tolerance(name=name, half_width=2e-5) for name in ("B.clearance", "crank.length", "rod.length")]

    found = assess_linkage_tolerances(linkage, turn, tolerances, samples=3)

    drives, tips = found.mechanism.poses["drives"], found.mechanism.poses["tip_m"]
    np.testing.assert_allclose(drives, turn, atol=1e-12)
    slide = 0.05 * np.cos(turn[:, 0]) + np.sqrt(0.12**2 - (0.05 * np.sin(turn[:, 0])) ** 2)
    np.testing.assert_allclose(tips[:, 0], slide, atol=1e-12)
    assert found.nonlinearity < 0.01
    with pytest.raises(UnknownNameError, match="turn"):
        poses_on_path(linkage, "y1", 3)
