"""Bodies that explain measurements: possible, near the drawing where nothing was measured, and exact where all was."""

import sys

import attrs
import numpy as np
import pytest
from scipy.linalg import eigvalsh, null_space

from armwright.arm.load import load_arm
from armwright.arm.model import Arm, Joint, Link
from armwright.arrays import Array
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.errors import ContradictionError, MissingExtraError
from armwright.identification.equations import Equations
from armwright.identification.feasible import arm_of, feasible
from armwright.identification.fitting import summed, weighted
from armwright.identification.model import DynamicModel
from identification.simulated import truth
from oracles.arms import random_arm, random_configurations
from samples import Sample

pytest.importorskip("clarabel", reason="the extra identification is not installed")


def _equations(arm: Arm, model: DynamicModel, rng: np.random.Generator, sigma: float = 0.0) -> Equations:
    q = random_configurations(attrs.evolve(arm, joints=[_limited(j) for j in arm.joints]), rng, 600)
    qd, qdd = rng.normal(size=(2, 600, arm.n))
    tau = inverse_dynamics(arm, q, qd, qdd)
    tau = tau + sigma * tau.std(axis=0) * rng.normal(size=tau.shape)
    return Equations("log", np.arange(600.0), model.base_columns(q, qd, qdd), tau, np.ones(tau.shape, dtype=bool))


def _limited(joint: Joint) -> Joint:
    limits = attrs.evolve(joint.limits, lower=max(joint.limits.lower, -3.0), upper=min(joint.limits.upper, 3.0))
    return attrs.evolve(joint, limits=limits)


def test_exact_measurements_of_an_exact_drawing_leave_it_as_it_is(sample: Sample) -> None:
    """Where efforts are those of the drawing, the bodies are those of the drawing, also what no motion tells."""
    worst = 0.0
    for rng in sample.cases(60):
        arm = random_arm(rng, 4)
        model = DynamicModel(arm=arm)
        sums = summed([_equations(arm, model, rng)])

        found = arm_of(model, feasible(model, sums, np.ones(4)).values)

        for link, expected in zip(found.links, arm.links, strict=True):
            assert link.mass == pytest.approx(expected.mass, rel=1e-5)
            np.testing.assert_allclose(link.com, expected.com, atol=1e-5)
            np.testing.assert_allclose(link.inertia, expected.inertia, atol=1e-5)
            worst = max(worst, abs(link.mass / expected.mass - 1))
        assert found.motor_values("inertia") == pytest.approx(arm.motor_values("inertia"), abs=1e-5)
    sample.record("exact efforts of exact drawings leave the bodies as they are", sample.count(60), 0, worst_mass=worst)


def test_what_no_motion_tells_is_as_near_to_the_drawing_as_can_be(sample: Sample) -> None:
    """No change of the links that leaves all base parameters as they are brings them nearer to the drawing."""
    nearer = 0.0
    for rng in sample.cases(40):
        arm = random_arm(rng, int(rng.integers(1, 6)))
        drawn = attrs.evolve(arm, links=[Link(mass=rng.uniform(0.5, 5), inertia=0.02 * np.eye(3)) for _ in arm.links])
        model = DynamicModel(arm=drawn)
        sums = summed([_equations(arm, model, rng, sigma=10.0 ** rng.uniform(-3, -0.5))])

        found = feasible(model, sums, weighted(sums).sigma, weight=10.0 ** rng.uniform(-1, 3)).values

        hidden = null_space(model.base.combinations[:, : 10 * arm.n])
        for _ in range(10):
            change = hidden @ rng.normal(size=hidden.shape[1])
            change /= _size(found, change)
            slope = _distance(drawn, found, change, 1e-3) - _distance(drawn, found, change, -1e-3)
            bend = (
                _distance(drawn, found, change, 1e-3)
                + _distance(drawn, found, change, -1e-3)
                - 2 * _distance(drawn, found, change, 0.0)
            )
            # By how much a parabola through the three is lower at its lowest point.
            nearer = max(nearer, slope**2 / bend / 8)
    sample.record("links nearer to the drawing with the same base parameters", sample.count(40), 0, nearer=nearer)
    assert nearer < 1e-6


def _size(values: Array, change: Array) -> float:
    """The largest eigenvalue of a change of the pseudo-inertias, by what they are."""
    pairs = zip(change.reshape(-1, 10), values[: len(change)].reshape(-1, 10), strict=True)
    return max(float(np.abs(eigvalsh(_pseudo_of(own), _pseudo_of(of))).max()) for own, of in pairs)


def _distance(drawn: Arm, values: Array, change: Array, part: float) -> float:
    """The entropic distance of links from the drawing, to which a part of a change is added."""
    total = 0.0
    for i, own in enumerate(drawn.links):
        rows = slice(10 * i, 10 * (i + 1))
        P0 = _pseudo(own)
        P, dP = (_pseudo_of(x[rows]) for x in (values, change))
        total += np.trace(np.linalg.solve(P0, P + part * dP)) - np.linalg.slogdet(P + part * dP)[1]
    return float(total)


def test_bodies_are_possible_whatever_is_measured(sample: Sample) -> None:
    """Of noisy efforts of random arms and a drawing that is wrong, all pseudo-inertias are positive definite."""
    worst = np.inf
    for rng in sample.cases(40):
        arm = random_arm(rng, int(rng.integers(1, 7)))
        drawn = attrs.evolve(arm, links=[Link(mass=rng.uniform(0.5, 5), inertia=0.02 * np.eye(3)) for _ in arm.links])
        model = DynamicModel(arm=drawn)
        sums = summed([_equations(arm, model, rng, sigma=0.3)])

        standard = feasible(model, sums, weighted(sums).sigma)

        found = arm_of(model, standard.values)
        for link in found.links:
            moments = np.linalg.eigvalsh(link.inertia)
            assert link.mass > 0
            assert moments[0] > 0
            assert moments[2] < moments[0] + moments[1]
        assert all(motor.inertia >= 0 and motor.viscous >= 0 for motor in found.motors)
        worst = min(worst, standard.smallest)
    sample.record("identified bodies of random arms are possible", sample.count(40), 0, smallest=worst)
    assert worst > 0


def test_heavier_drawings_pull_more(rng: np.random.Generator) -> None:
    """The more the drawing weighs, the nearer are the masses to it, and the larger are the residuals."""
    arm = random_arm(rng, 4)
    drawn = attrs.evolve(
        arm, links=[attrs.evolve(link, mass=2 * link.mass, inertia=2 * link.inertia) for link in arm.links]
    )
    model = DynamicModel(arm=drawn)
    sums = summed([_equations(arm, model, rng, sigma=0.05)])
    sigma = weighted(sums).sigma

    light, heavy = (feasible(model, sums, sigma, weight=weight) for weight in (1.0, 1e5))

    def distance(found: Arm) -> float:
        """The entropic distance of the bodies from the drawing."""
        pairs = [(_pseudo(link), _pseudo(own)) for link, own in zip(found.links, drawn.links, strict=True)]
        return float(sum(np.trace(np.linalg.solve(P0, P)) - np.linalg.slogdet(P)[1] for P, P0 in pairs))

    assert distance(arm_of(model, heavy.values)) < distance(arm_of(model, light.values))
    assert (sums.squares(heavy.base) / sigma**2).sum() > (sums.squares(light.base) / sigma**2).sum()


def _pseudo_of(theta: Array) -> Array:
    """The pseudo-inertia of ten parameters: half the trace of the tensor less the tensor, first moments, mass."""
    m, h = theta[0], theta[1:4]
    tensor = theta[[4, 5, 6, 5, 7, 8, 6, 8, 9]].reshape(3, 3)
    return np.block([[np.trace(tensor) / 2 * np.eye(3) - tensor, h[:, None]], [h[None], np.array([[m]])]])


def _pseudo(link: Link) -> Array:
    """The pseudo-inertia of a link: what its mass is distributed over, about the origin of its frame."""
    spread = np.trace(link.inertia) / 2 * np.eye(3) - link.inertia + link.mass * np.outer(link.com, link.com)
    h = link.mass * link.com
    return np.block([[spread, h[:, None]], [h[None], np.array([[link.mass]])]])


def test_arm_keeps_what_is_not_identified() -> None:
    """Names, limits and solids stay; masses and drives are the identified ones."""
    arm = load_arm("ur5")
    model = DynamicModel(arm=arm, terms=("rotor", "viscous", "forward", "backward", "stribeck"))
    values = np.ones(len(model.names))
    values[:60] = np.tile([2.0, 0, 0, 0, 0.1, 0, 0, 0.1, 0, 0.1], 6)

    found = arm_of(model, values, "identified")

    assert found.joints == arm.joints
    assert [link.name for link in found.links] == [link.name for link in arm.links]
    assert found.links[3].mass == 2.0
    assert (found.motors[2].coulomb_backward, found.motors[2].stribeck, found.motors[2].stribeck_speed) == (1, 1, 0.1)
    assert found.source == "identified"


def test_says_what_is_missing(rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without Clarabel the message has the command that installs it; without sense the program says so."""
    arm = truth("ntu-3r")
    model = DynamicModel(arm=arm)
    sums = summed([_equations(arm, model, rng)])
    with pytest.raises(ContradictionError, match="no set of bodies"):
        feasible(model, sums._replace(products=sums.products * np.nan), np.ones(3))
    monkeypatch.setitem(sys.modules, "clarabel", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'armwright\[identification\]'"):
        feasible(model, sums, np.ones(3))
