"""Drives that move several joints, and joints that several drives move, in the dynamics and in what is compiled."""

import attrs
import numpy as np

from armwright import compile_arm
from armwright.arm import Arm, Coupling, Joint, Link, Motor, load_arm
from armwright.arm.model import STANDARD_GRAVITY
from armwright.arrays import Array
from armwright.dynamics import (
    base_parameters,
    base_regressor,
    dynamic_parameters,
    forward_dynamics,
    forward_dynamics_derivatives,
    inverse_dynamics,
    inverse_dynamics_derivatives,
    kinetic_energy,
    mass_matrix,
    potential_energy,
    regressor,
    terms,
    toacc,
)
from oracles.arms import coupled, of_all_kinds, random_arm, random_configurations, with_all_friction, with_springs
from samples import Sample

AGREEMENT = 1e-12  # relative to the largest number
OF_INVERSE = 1e-9  # where the inverse of a mass matrix enters
OF_DIFFERENCE = 1e-6  # of a quotient of differences


def random_coupled_arm(rng: np.random.Generator, joints: int) -> Arm:
    return coupled(with_springs(with_all_friction(of_all_kinds(random_arm(rng, joints), rng), rng), rng), rng)


def near(found: Array, expected: Array, tolerance: float = AGREEMENT) -> None:
    np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance * max(1.0, np.abs(expected).max()))


def test_remotely_driven_elbow(rng: np.random.Generator) -> None:
    """A planar arm whose elbow is driven by a belt from the base, in the angles of its links to the ground.

    Source: Spong, Hutchinson & Vidyasagar (2006), chapter 7, on the planar elbow manipulator with remotely driven link;
    with rotors beside.
    """
    m1, m2, l1, lc1, lc2, I1, I2, J1, J2 = rng.uniform(0.2, 2.0, size=9)
    l2 = 0.7
    links = [
        Link(mass=m1, com=(lc1 - l1, 0, 0), inertia=np.diag([I1, I1, I1])),
        Link(mass=m2, com=(lc2 - l2, 0, 0), inertia=np.diag([I2, I2, I2])),
    ]
    arm = Arm(
        name="belt",
        joints=[Joint(kind="revolute", a=l1), Joint(kind="revolute", a=l2)],
        links=links,
        motors=[Motor(inertia=J1), Motor(inertia=J2)],
        coupling=Coupling(matrix=[[1, 0], [-1, 1]]),
        gravity=(0, -STANDARD_GRAVITY, 0),
    )
    (p1, p2), (v1, v2), (a1, a2) = p, v, a = rng.normal(size=(3, 2))
    d12, h = m2 * l1 * lc2 * np.cos(p2 - p1), m2 * l1 * lc2 * np.sin(p2 - p1)
    expected = (
        (m1 * lc1**2 + m2 * l1**2 + I1 + J1) * a1
        + d12 * a2
        - h * v2**2
        + (m1 * lc1 + m2 * l1) * STANDARD_GRAVITY * np.cos(p1),
        d12 * a1 + (m2 * lc2**2 + I2 + J2) * a2 + h * v1**2 + m2 * lc2 * STANDARD_GRAVITY * np.cos(p2),
    )
    coupling = arm.coupling
    assert coupling is not None

    tau = inverse_dynamics(arm, *(coupling.joints(x) for x in (p, v, a)))

    near(coupling.drive_efforts(tau), np.array(expected))


def test_lagrange_in_positions_of_the_drives(sample: Sample) -> None:
    """Efforts of the drives are those of Lagrange's equations in their positions, plus the friction of each by itself.

    The energy of the rotors is written down here; that of links and springs is differentiated numerically.
    """
    h = 1e-4
    for rng in sample.cases(40):
        arm = coupled(with_springs(of_all_kinds(random_arm(rng, int(rng.integers(1, 6))), rng), rng), rng)
        coupling = arm.coupling
        assert coupling is not None
        rotors, eye = arm.motor_values("inertia"), np.eye(arm.n)
        m, md, mdd = rng.normal(size=(3, arm.n))

        def lagrangian(m: Array, md: Array, arm: Arm = arm, coupling: Coupling = coupling) -> Array:
            q, qd = m @ coupling.matrix.T, md @ coupling.matrix.T
            return kinetic_energy(arm, q, qd, drives=False) - potential_energy(arm, q)

        def momentum(m: Array, md: Array, eye: Array = eye) -> Array:
            return np.array([(lagrangian(m, md + h * e) - lagrangian(m, md - h * e)) / (2 * h) for e in eye])

        by_time = (momentum(m + h * md, md + h * mdd) - momentum(m - h * md, md - h * mdd)) / (2 * h)
        by_position = np.array([(lagrangian(m + h * e, md) - lagrangian(m - h * e, md)) / (2 * h) for e in eye])
        dry = np.where(md > 0, arm.motor_values("coulomb_forward"), -arm.motor_values("coulomb_backward"))
        expected = by_time - by_position + rotors * mdd + arm.motor_values("viscous") * md + dry

        tau = inverse_dynamics(arm, *(x @ coupling.matrix.T for x in (m, md, mdd)))

        near(coupling.drive_efforts(tau), expected, 1e-5)
    sample.record("coupled drives by Lagrange's equations", sample.count(40), 0)


def test_power(sample: Sample) -> None:
    """The power of drives and joints is the same, and goes into energy and the friction of the drives."""
    for rng in sample.cases(60):
        arm = random_coupled_arm(rng, int(rng.integers(1, 8)))
        coupling = arm.coupling
        assert coupling is not None
        q, (qd, qdd) = random_configurations(arm, rng, 1)[0], rng.normal(size=(2, arm.n))
        tau, md, h = inverse_dynamics(arm, q, qd, qdd), coupling.drives(qd), 1e-5

        power = coupling.drive_efforts(tau) @ md

        near(power, tau @ qd)
        energy = [kinetic_energy(arm, q + t * qd, qd + t * qdd) + potential_energy(arm, q + t * qd) for t in (h, -h)]
        friction = coupling.drive_efforts(terms(arm, q, qd, qdd).friction) @ md
        near(power, (energy[0] - energy[1]) / (2 * h) + friction, 1e-6)
        near(coupling.joints(md), qd)
        near(coupling.joint_efforts(coupling.drive_efforts(tau)), tau)
    sample.record("power of coupled drives", sample.count(60), 0)


def test_all_quantities_agree(sample: Sample) -> None:
    """Accelerations, masses, energies, terms and regressors are those of the efforts, plain and compiled."""
    for number, rng in enumerate(sample.cases(60)):
        arm = random_coupled_arm(rng, int(rng.integers(1, 8)))
        q, (qd, qdd) = random_configurations(arm, rng, 3), rng.normal(size=(2, 3, arm.n))
        tau, M = inverse_dynamics(arm, q, qd, qdd), mass_matrix(arm, q)
        condition = max(1.0, float(np.linalg.cond(M).max()) / 1e4)

        assert (np.linalg.eigvalsh(M) > 0).all()
        near(M, np.swapaxes(M, -1, -2))
        near(kinetic_energy(arm, q, qd), np.einsum("ki,kij,kj->k", qd, M, qd) / 2)
        near(terms(arm, q, qd, qdd).total, tau)
        near(np.einsum("kij,kj->ki", M, qdd) + inverse_dynamics(arm, q, qd, np.zeros_like(qdd)), tau)
        for by in (forward_dynamics, toacc):
            near(by(arm, q, qd, tau), qdd, OF_INVERSE * condition)
        near(regressor(arm, q, qd, qdd) @ dynamic_parameters(arm), tau)
        base = base_parameters(arm)
        near(base_regressor(arm, q, qd, qdd) @ (base.combinations @ dynamic_parameters(arm)), tau, 1e-8)
        if number % 5 == 0:
            compiled = compile_arm(arm, quickly=True)
            near(compiled.inverse_dynamics(q, qd, qdd), tau)
            near(compiled.forward_dynamics(q, qd, tau), qdd, OF_INVERSE * condition)
            near(compiled.mass_matrix(q), M)
            near(compiled.kinetic_energy(q, qd), kinetic_energy(arm, q, qd))
            near(compiled.regressor(q, qd, qdd), regressor(arm, q, qd, qdd))
    sample.record("arms with coupled drives of which all quantities agree", sample.count(60), 0)


def test_derivatives(sample: Sample) -> None:
    """Derivatives of efforts and accelerations are quotients of differences."""
    h = 1e-6
    for rng in sample.cases(30):
        arm = coupled(with_all_friction(random_arm(rng, int(rng.integers(1, 5))), rng), rng)
        q, qd, qdd = rng.uniform(0.5, 1.0, size=(3, arm.n))
        tau, eye = inverse_dynamics(arm, q, qd, qdd), np.eye(arm.n)
        found = inverse_dynamics_derivatives(arm, q, qd, qdd)
        back = forward_dynamics_derivatives(arm, q, qd, tau)

        near(found.M, mass_matrix(arm, q))
        near(back.dtau @ found.M, eye, OF_INVERSE)
        for function, derivatives, last in (
            (inverse_dynamics, found, qdd),
            (forward_dynamics, back, tau),
        ):
            by_q = [(function(arm, q + h * e, qd, last) - function(arm, q - h * e, qd, last)) / (2 * h) for e in eye]
            by_qd = [(function(arm, q, qd + h * e, last) - function(arm, q, qd - h * e, last)) / (2 * h) for e in eye]
            near(derivatives.dq, np.array(by_q).T, OF_DIFFERENCE)
            near(derivatives.dqd, np.array(by_qd).T, OF_DIFFERENCE)
    sample.record("arms with coupled drives whose derivatives are differences", sample.count(30), 0)


def test_without_a_coupling_nothing_changes() -> None:
    """A coupling by which each drive moves its own joint alone is none, so that kernels are found by the same name."""
    arm = load_arm("puma560")
    alone = attrs.evolve(arm, coupling=Coupling(matrix=np.eye(arm.n)))

    assert alone == arm
    assert alone.coupling is None
    assert "oupling" not in compile_arm(arm)._origin
    assert "oupling" in compile_arm(attrs.evolve(arm, coupling=Coupling(matrix=2 * np.eye(arm.n))))._origin


def test_a_drive_that_moves_nothing_else(rng: np.random.Generator) -> None:
    """Of drives that are not coupled to others efforts have the bits that they have without a coupling."""
    arm = load_arm("puma560")
    C = np.eye(6)
    C[5, 4] = -1.0
    wrist = attrs.evolve(arm, coupling=Coupling(matrix=C))
    q, qd, qdd = rng.normal(size=(3, 6))

    found, alone = inverse_dynamics(wrist, q, qd, qdd), inverse_dynamics(arm, q, qd, qdd)

    assert found[:4].tolist() == alone[:4].tolist()
    assert not np.isclose(found[4:], alone[4:]).any()
