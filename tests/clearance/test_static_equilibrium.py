"""How linkages with play lie at rest, against published offsets, the balance of forces, and the least energy."""

import attrs
import numpy as np
import pytest

from armwright.arrays import Array
from armwright.clearance.equations import Contact, ContactMemory, FrictionModel, State, potential_energy, rates
from armwright.clearance.ideal import close_pins, tip_position
from armwright.clearance.linkage import Linkage
from armwright.clearance.placement import Placement
from armwright.clearance.reader import load_linkage
from armwright.clearance.scenario import assembly_guess
from armwright.clearance.settings import contact_stiffness
from armwright.clearance.static_equilibrium import find_static_equilibrium
from armwright.errors import InvalidValueError, ShapeError

# Clearances of the thesis' two arms [m].
ARM_A, ARM_B = np.array((0.328, 0.171, 0.483)) * 1e-3, np.array((0.460, 0.480, 0.460)) * 1e-3
FIRST_GOAL, Y1_START = (-0.18, -0.6), (-0.15, -0.7)
# Four digits of a millimetre are printed.
PRINTED = 5.1e-8
# Newtons that rounding leaves of forces of some ten newtons in springs of 1e8 N/m, at 1 m from the origin.
BALANCED = 1e-6


@pytest.fixture(scope="module")
def linkage() -> Linkage:
    return load_linkage("five-bar")


def ideal(linkage: Linkage, tip: tuple[float, float]) -> Array:
    return close_pins(linkage, assembly_guess(linkage), tip=tip)


@pytest.mark.parametrize(
    ("clearances", "offset_mm", "size_mm"),
    [(ARM_A, (-0.1009, -0.5527), 0.5619), (ARM_B, (0.1967, -0.8931), 0.9146)],
    ids=["A", "B"],
)
def test_first_goal_of_the_thesis(
    linkage: Linkage, clearances: Array, offset_mm: tuple[float, float], size_mm: float
) -> None:
    """At (-180, -600) mm the tip of arm A hangs 0.5619 mm off, that of arm B 0.9146 mm (thesis: 0.562 and 0.915)."""
    equilibrium = find_static_equilibrium(linkage, ideal(linkage, FIRST_GOAL), clearances)

    error = equilibrium.tip - FIRST_GOAL
    np.testing.assert_allclose(error, np.array(offset_mm) * 1e-3, rtol=0, atol=PRINTED)
    assert np.linalg.norm(error) == pytest.approx(size_mm * 1e-3, abs=PRINTED)


def test_start_of_y1(linkage: Linkage) -> None:
    """Where y1 starts, half a millimetre in each pin shifts the tip by 0.2891 mm in x, 0.2893 mm with soft walls."""
    q, c = ideal(linkage, Y1_START), np.full(3, 5e-4)

    rigid, soft = (
        find_static_equilibrium(linkage, q, c),
        find_static_equilibrium(linkage, q, c, contact_stiffness(linkage, c)),
    )

    np.testing.assert_allclose(rigid.tip - Y1_START, (0.2891e-3, -0.9055e-3), rtol=0, atol=PRINTED)
    np.testing.assert_allclose(soft.tip - Y1_START, (0.2893e-3, -0.9059e-3), rtol=0, atol=PRINTED)


@pytest.mark.parametrize("clearances", [ARM_A, ARM_B, np.array((1e-5, 2e-3, 1e-4))])
def test_nothing_moves(linkage: Linkage, clearances: Array) -> None:
    """With its drives held a linkage that lies at rest is in balance: no body begins to move."""
    K = contact_stiffness(linkage, clearances)
    equilibrium = find_static_equilibrium(linkage, ideal(linkage, FIRST_GOAL), clearances, K)

    locked = attrs.evolve(linkage, drives=[attrs.evolve(drive, kind="motion") for drive in linkage.drives])
    contacts = [Contact(*row, 0.15, 0.0, 1e-3) for row in np.stack([clearances, K], axis=-1)]
    state = State(list(equilibrium.q), [0.0] * 8, [ContactMemory(1.0, 1e-3)] * 3)
    now = rates(locked, FrictionModel(), state, [0.0, 0.0], contacts)

    np.testing.assert_allclose([pin.normal for pin in now.pins], equilibrium.forces, rtol=1e-7)
    lightest = 0.0282
    np.testing.assert_allclose(np.array(now.qdd) * lightest, 0.0, atol=BALANCED)


def test_lowest_place(linkage: Linkage, rng: np.random.Generator) -> None:
    """In rigid walls no other contact directions have less energy: links and load hang as low as they can."""
    q = ideal(linkage, FIRST_GOAL)
    equilibrium = find_static_equilibrium(linkage, q, ARM_A)

    def energy(q: Array) -> Array:
        placement = Placement(linkage, [q[..., i] for i in range(8)], [0.0] * 8)
        return np.asarray(potential_energy(placement))

    angles = np.arctan2(equilibrium.gaps[:, 1], equilibrium.gaps[:, 0]) + rng.normal(0.0, 0.5, (500, 3))
    sizes = ARM_A * rng.choice([1.0, 0.9], (500, 3))
    gaps = sizes[..., None] * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    others = close_pins(linkage, equilibrium.q, drives=q[[0, 7]], gaps=gaps)

    assert np.all(energy(others) > energy(equilibrium.q))


def test_play_shifts_in_proportion(linkage: Linkage) -> None:
    """A tenth of the play is a tenth of the shift, better and better as the play becomes small."""
    q = ideal(linkage, FIRST_GOAL)
    shares = np.array((1e-1, 1e-2, 1e-3))

    shifts = find_static_equilibrium(linkage, q, shares[:, None] * ARM_A).tip - tip_position(linkage, q)
    slopes = shifts / shares[:, None]

    assert np.abs(slopes[0] - slopes[2]).max() < 1e-3 * np.abs(slopes).max()
    assert np.abs(slopes[1] - slopes[2]).max() < 0.2 * np.abs(slopes[0] - slopes[2]).max()


def test_no_play(linkage: Linkage) -> None:
    """Without play the tip is where it should be, and the pins carry what they carry."""
    equilibrium = find_static_equilibrium(linkage, ideal(linkage, FIRST_GOAL), [0.0, 0.0, 0.0])

    np.testing.assert_allclose(equilibrium.tip, FIRST_GOAL, rtol=0, atol=1e-12)
    assert np.all(equilibrium.forces > 1.0)


def test_leading_axes(linkage: Linkage, rng: np.random.Generator) -> None:
    """Many clearances at many poses make a table of offsets, each as it is alone."""
    q = close_pins(linkage, assembly_guess(linkage), tip=[[-0.1, -0.6], [0.1, -0.5]])
    c = rng.uniform(1e-4, 5e-4, (4, 1, 3))

    equilibrium = find_static_equilibrium(linkage, q, c)

    assert equilibrium.tip.shape == (4, 2, 2)
    np.testing.assert_allclose(
        find_static_equilibrium(linkage, q[1], c[2, 0]).tip, equilibrium.tip[2, 1], rtol=0, atol=1e-13
    )


def test_slack_pins_are_refused(linkage: Linkage) -> None:
    """Without weight and load nothing says where the journals lie."""
    adrift = attrs.evolve(linkage, gravity=(0.0, 0.0), loads=())
    with pytest.raises(InvalidValueError, match="pin J2 of five-bar carries no force at rest"):
        find_static_equilibrium(adrift, ideal(linkage, FIRST_GOAL))


def test_clearances_that_do_not_fit(linkage: Linkage) -> None:
    """There is one clearance for each pin, and none is negative."""
    q = ideal(linkage, FIRST_GOAL)
    with pytest.raises(ShapeError, match=r"clearances of J2, J3, J4: expected a shape ending in \(3,\), got \(2,\)"):
        find_static_equilibrium(linkage, q, [1e-4, 1e-4])
    with pytest.raises(InvalidValueError, match=r"clearances: expected none below 0, got -0\.1 mm"):
        find_static_equilibrium(linkage, q, [1e-4, -1e-4, 1e-4])
