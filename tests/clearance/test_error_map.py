"""Errors of two five-bars over the workspace, against the geometry of circles and against drawn journals."""

import attrs
import numpy as np
import pytest

from armwright.arrays import Array
from armwright.clearance.error_map import compare_linkages
from armwright.clearance.five_bar import FiveBar, elbow_positions, inverse
from armwright.clearance.five_bar_parts import five_bar_coordinates
from armwright.clearance.ideal import close_pins, tip_position
from armwright.clearance.linkage import Linkage
from armwright.clearance.reader import load_linkage
from armwright.clearance.static_equilibrium import find_static_equilibrium
from armwright.errors import InvalidValueError

CLEARANCES = {"J2": 3e-4, "J3": 2e-4, "J4": 4e-4}


def five_bar(scale: float) -> Linkage:
    return load_linkage("five-bar").with_clearances({name: scale * c for name, c in CLEARANCES.items()})


def test_a_longer_rod_moves_the_tip_to_another_circle() -> None:
    """Without clearance the first has no error, and the second that of the intersection of its circles."""
    first = five_bar(0.0)
    longer = [
        attrs.evolve(body, points={"J2": (0, 0), "J3": (0.651, 0)}) if body.name == "link2" else body
        for body in first.bodies
    ]
    compared = compare_linkages(first, attrs.evolve(first, bodies=longer), cells=8)

    left, right = np.moveaxis(
        elbow_positions(FiveBar.of(first), inverse(FiveBar.of(first), compared.positions)[:, [0, 3]]), 1, 0
    )
    np.testing.assert_allclose(compared.errors[0], 0.0, atol=1e-12)
    np.testing.assert_allclose(
        compared.positions + compared.errors[1], lower_point(left, right, 0.651, 0.65), atol=1e-12
    )


def lower_point(left: Array, right: Array, r: float, s: float) -> Array:
    """Return the lower intersection of circles about two points."""
    base = right - left
    distance = np.linalg.norm(base, axis=1, keepdims=True)
    along = (r**2 - s**2 + distance**2) / (2 * distance)
    unit = base / distance
    return left + along * unit + np.sqrt(r**2 - along**2) * np.stack([unit[:, 1], -unit[:, 0]], axis=1)


def test_twice_the_clearance_is_twice_the_error() -> None:
    """Errors at rest are linear in the clearances, but for a part in a thousand, and so are their spreads."""
    compared = compare_linkages(five_bar(0.1), five_bar(0.2), cells=8)

    np.testing.assert_allclose(compared.sizes[1], 2 * compared.sizes[0], rtol=1e-3)
    np.testing.assert_allclose(compared.spreads[1], 2 * compared.spreads[0], rtol=1e-3)


def test_spread_is_that_of_journals_in_their_cones() -> None:
    """The spread is the standard deviation of the tip over journals drawn evenly from their friction cones."""
    linkage = five_bar(0.5)
    compared = compare_linkages(linkage, linkage, cells=6)
    position = compared.positions[0]
    q = close_pins(linkage, five_bar_coordinates(linkage, inverse(FiveBar.of(linkage), position)), tip=position)
    gaps = find_static_equilibrium(linkage, q).gaps
    tilts = np.arctan(linkage.material.friction) * np.random.default_rng(1).uniform(-1, 1, (2000, 3))
    c, s = np.cos(tilts), np.sin(tilts)
    drawn = np.stack([c * gaps[:, 0] - s * gaps[:, 1], s * gaps[:, 0] + c * gaps[:, 1]], axis=-1)

    tips = tip_position(linkage, close_pins(linkage, q, drives=q[list(linkage.driven)], gaps=drawn))

    # Four standard errors of a standard deviation.
    assert np.sqrt(tips.var(axis=0).sum()) == pytest.approx(compared.spreads[0, 0], rel=4 / np.sqrt(2 * 2000))


def test_what_is_no_five_bar() -> None:
    """Only five-bars are compared, on a map of a sensible size."""
    with pytest.raises(InvalidValueError, match="slider"):
        compare_linkages(five_bar(1.0), load_linkage("slider-crank"))
    with pytest.raises(InvalidValueError, match="cells: expected 2 to 200"):
        compare_linkages(five_bar(1.0), five_bar(1.0), cells=1000)
