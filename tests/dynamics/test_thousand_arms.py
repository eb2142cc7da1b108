"""What the motion of a thousand random arms takes, against Pinocchio, and Lagrange-Euler against Newton-Euler."""

from collections.abc import Callable

import attrs
import numpy as np
import pinocchio as pin
import pytest

from armwright.arrays import Array
from armwright.dynamics.accelerations import forward_dynamics, toacc, unit_accelerations
from armwright.dynamics.energy import kinetic_energy, potential_energy
from armwright.dynamics.equation_of_motion import Terms, terms
from armwright.dynamics.inertia_matrix import composite_rigid_body, mass_matrix
from armwright.dynamics.lagrange_euler import (
    coriolis_matrix,
    lagrange_euler,
)
from armwright.dynamics.newton_euler import inverse_dynamics, newton_euler
from armwright.dynamics.payloads import payload
from armwright.dynamics.shares import coriolis_efforts, gravity_efforts
from oracles.thousand import AGREEMENT, Case, deviation, largest_deviation, thousand_arms
from oracles.with_pinocchio import pushed

pytestmark = pytest.mark.proof

TWO_WAYS = 1e-10  # relative; energies and free bodies over the same links
COMPLEX_STEP = 1e-30  # no difference is taken, so it may be as small as one likes


def test_inverse_dynamics() -> None:
    """Pinocchio asks the same efforts of the links."""
    deviation = largest_deviation(
        lambda case: inverse_dynamics(case.arm, case.q, case.qd, case.qdd, drives=False),
        lambda case: pin.rnea(*case.links, case.q, case.qd, case.qdd),
    )
    assert deviation < AGREEMENT


def test_inverse_dynamics_of_a_driven_and_pushed_arm() -> None:
    """With rotors, viscous friction and a push on the tool the efforts are Pinocchio's, friction added."""
    deviation = largest_deviation(
        lambda case: inverse_dynamics(case.arm, case.q, case.qd, case.qdd, wrench=case.wrench),
        lambda case: pin.rnea(*case.driven, case.q, case.qd, case.qdd, case.push) + case.friction,
    )
    assert deviation < AGREEMENT


def test_inverse_dynamics_on_a_base_that_accelerates() -> None:
    """Carried by three joints of its own, Pinocchio's base has the commanded acceleration of ours."""

    def theirs(case: Case) -> Array:
        still = np.zeros(3)
        q, qd, qdd = (np.append(*pair) for pair in ((still, case.q), (still, case.qd), (case.carrying, case.qdd)))
        return pin.rnea(*case.carried, q, qd, qdd)[3:]

    def ours(case: Case) -> Array:
        return inverse_dynamics(case.arm, case.q, case.qd, case.qdd, base_acceleration=case.carrying, drives=False)

    assert largest_deviation(ours, theirs) < AGREEMENT


def test_inverse_dynamics_with_a_load() -> None:
    """A load with lever and products of inertia is for Pinocchio one more body on the last joint."""

    def ours(case: Case) -> Array:
        arm = payload(case.arm, case.load.mass, case.load.com, case.load.inertia)
        return inverse_dynamics(arm, case.q, case.qd, case.qdd, drives=False)

    assert largest_deviation(ours, lambda case: pin.rnea(*case.loaded, case.q, case.qd, case.qdd)) < AGREEMENT


def test_load_joined_to_the_last_link() -> None:
    """Last link and load are one body, of the mass, centre and tensor that Pinocchio gives the two."""
    worst = 0.0
    for case in thousand_arms():
        link = payload(case.arm, case.load.mass, case.load.com, case.load.inertia).links[-1]
        model, _ = case.loaded
        # From the frame of the last link to that of its joint.
        tool_placement = case.links[0].frames[case.tool].placement * pin.SE3(case.arm.tool).inverse()
        body = pin.Inertia(link.mass, link.com, link.inertia).se3Action(tool_placement)
        worst = max(worst, deviation(body.matrix(), model.inertias[case.arm.n].matrix()))

    assert worst < AGREEMENT


@pytest.mark.parametrize("drives", [False, True])
def test_mass_matrix(drives: bool) -> None:  # noqa: FBT001
    """Pinocchio finds the same mass matrix, without rotors and with them."""

    def theirs(case: Case) -> Array:
        upper = np.triu(pin.crba(*(case.driven if drives else case.links), case.q))
        return upper + np.triu(upper, 1).T

    assert largest_deviation(lambda case: mass_matrix(case.arm, case.q, drives=drives), theirs) < AGREEMENT


def test_mass_matrix_by_unit_accelerations() -> None:
    """The report's n calls of Newton-Euler give Pinocchio's mass matrix too."""

    def theirs(case: Case) -> Array:
        upper = np.triu(pin.crba(*case.driven, case.q))
        return upper + np.triu(upper, 1).T

    assert largest_deviation(lambda case: unit_accelerations(case.arm, case.q.tolist()), theirs) < AGREEMENT


def test_gravity() -> None:
    """Pinocchio holds the arms with the same efforts."""
    deviation = largest_deviation(
        lambda case: gravity_efforts(case.arm, case.q), lambda case: pin.computeGeneralizedGravity(*case.links, case.q)
    )
    assert deviation < AGREEMENT


def test_coriolis_efforts() -> None:
    """What speeds ask of the joints is what Pinocchio asks beyond gravity."""

    def theirs(case: Case) -> Array:
        both = pin.nonLinearEffects(*case.links, case.q, case.qd).copy()
        return both - pin.computeGeneralizedGravity(*case.links, case.q)

    assert largest_deviation(lambda case: coriolis_efforts(case.arm, case.q, case.qd), theirs) < AGREEMENT


def test_coriolis_matrix() -> None:
    """Pinocchio's Coriolis matrix is made of the Christoffel symbols as well: entry by entry it is ours."""
    deviation = largest_deviation(
        lambda case: coriolis_matrix(case.arm, case.q, case.qd),
        lambda case: pin.computeCoriolisMatrix(*case.links, case.q, case.qd),
    )
    assert deviation < AGREEMENT


def test_energies() -> None:
    """Pinocchio finds the same kinetic energy, and the same potential energy between two configurations."""
    motion = largest_deviation(
        lambda case: kinetic_energy(case.arm, case.q, case.qd, drives=False),
        lambda case: pin.computeKineticEnergy(*case.links, case.q, case.qd),
    )
    driven = largest_deviation(
        lambda case: kinetic_energy(case.arm, case.q, case.qd),
        lambda case: (
            pin.computeKineticEnergy(*case.links, case.q, case.qd) + (case.driven[0].armature * case.qd) @ case.qd / 2
        ),
    )
    height = largest_deviation(
        lambda case: potential_energy(case.arm, case.q + case.qd) - potential_energy(case.arm, case.q),
        lambda case: (
            pin.computePotentialEnergy(*case.links, case.q + case.qd) - pin.computePotentialEnergy(*case.links, case.q)
        ),
    )

    assert max(motion, driven, height) < AGREEMENT


@pytest.mark.parametrize("solve", [forward_dynamics, toacc])
def test_forward_dynamics(solve: Callable[..., Array]) -> None:
    """Articulated bodies and TOACC both give Pinocchio's accelerations, rotors, friction and push included."""
    deviation = largest_deviation(
        lambda case: solve(case.arm, case.q, case.qd, case.tau, wrench=case.wrench),
        lambda case: pin.aba(*case.driven, case.q, case.qd, case.tau - case.friction, case.push),
    )
    assert deviation < AGREEMENT


@pytest.mark.parametrize("solve", [forward_dynamics, toacc])
def test_forward_dynamics_of_links_alone(solve: Callable[..., Array]) -> None:
    """So they do without drives."""
    deviation = largest_deviation(
        lambda case: solve(case.arm, case.q, case.qd, case.tau, drives=False),
        lambda case: pin.aba(*case.links, case.q, case.qd, case.tau),
    )
    assert deviation < AGREEMENT


def test_terms() -> None:
    """Every cause asks of the joints what Pinocchio finds for it alone, and together they ask what it finds for all."""

    def ours(case: Case) -> dict[str, Array]:
        efforts = terms(case.arm, case.q, case.qd, case.qdd, load=case.load, wrench=case.wrench)
        return {name: getattr(efforts, name) for name in (*(field.name for field in attrs.fields(Terms)), "total")}

    worst: dict[str, float] = {}
    for case in thousand_arms():
        theirs = _terms_of_pinocchio(case)
        for name, value in ours(case).items():
            worst[name] = max(worst.get(name, 0.0), deviation(value, theirs[name]))

    assert len(worst) == 13
    assert max(worst.values()) < AGREEMENT, worst


def _terms_of_pinocchio(case: Case) -> dict[str, Array]:
    q, qd, qdd, n = case.q, case.qd, case.qdd, case.arm.n
    upper = np.triu(pin.crba(*case.links, q))
    M = upper + np.triu(upper, 1).T
    # At a unit speed of joint k the Coriolis matrix is the slice k of the tensor.
    h = np.stack([pin.computeCoriolisMatrix(*case.links, q, unit).copy() for unit in np.eye(n)], axis=-1)
    pairs = 2 * h * np.outer(qd, qd)
    links = pin.rnea(*case.links, q, qd, qdd).copy()
    model, data = case.loaded
    rotors, push = case.driven[0].armature.copy(), pushed(*case.links, case.tool, q, case.wrench)
    return {
        "own": np.diag(M) * qdd,
        "coupling": (M - np.diag(np.diag(M))) * qdd,
        "motor": rotors * qdd,
        "centrifugal": np.einsum("ijj,j->ij", h, qd**2),
        "coriolis": pairs * np.triu(np.ones((n, n)), 1),
        "gravity": pin.computeGeneralizedGravity(*case.links, q).copy(),
        "viscous": case.friction,
        "dry": np.zeros(n),
        "smooth": np.zeros(n),
        "spring": np.zeros(n),
        "load": pin.rnea(model, data, q, qd, qdd) - links,
        "outside": pin.rnea(*case.links, q, qd, qdd, push) - links,
        "total": pin.rnea(model, data, q, qd, qdd, push) + rotors * qdd + case.friction,
    }


def test_lagrange_euler_against_newton_euler() -> None:
    """Energies and free bodies lead to the same efforts, ten times closer than to those of Pinocchio."""
    deviation = largest_deviation(
        lambda case: lagrange_euler(case.arm, case.q.tolist(), case.qd.tolist(), case.qdd.tolist()),
        lambda case: newton_euler(case.arm, case.q.tolist(), case.qd.tolist(), case.qdd.tolist()),
    )
    assert deviation < TWO_WAYS


def test_skew_symmetry() -> None:
    """dM/dt - 2 C is skew: centrifugal and Coriolis efforts do no work beyond what the mass matrix stores.

    The mass matrix is that of the composite bodies, which knows nothing of C; its slope is taken by a step into the
    imaginary, in which no digits cancel.
    """

    def slope(case: Case) -> Array:
        along = [np.array([complex(x, COMPLEX_STEP * speed)]) for x, speed in zip(case.q, case.qd, strict=True)]
        rows = composite_rigid_body(case.arm, along)
        return np.array([[float(np.squeeze(np.imag(x))) for x in row] for row in rows]) / COMPLEX_STEP

    def both(case: Case) -> Array:
        C = coriolis_matrix(case.arm, case.q, case.qd)
        return C + C.T

    assert largest_deviation(both, slope) < TWO_WAYS
    assert np.median([np.abs(slope(case)).max() for case in thousand_arms()]) > 1
