"""The equations of linkages with play beside Pinocchio, and beside what every motion must keep."""

import math
from typing import Any

import attrs
import numpy as np
import pinocchio
import pytest

from armwright.clearance.equations import (
    Contact,
    ContactMemory,
    FrictionModel,
    Rates,
    State,
    drive_weights,
    free_forces,
    mass_matrix,
    rates,
)
from armwright.clearance.linkage import Body, BodyPoint, ClearancePin, Drive, Linkage
from armwright.clearance.placement import Placement
from clearance.trees import to_pinocchio, tree

# What differences of twenty terms of order 10 leave.
ROUNDING = 1e-10
# What central differences over a tenth of a microsecond leave of powers of some hundred watts, to begin with [W].
DIFFERENCE = 1e-4
# Deep enough for some hundred newtons [m].
DEPTH = 2e-6


def moving(linkage: Linkage, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    n = len(linkage.coordinates)
    return rng.uniform(-1.0, 1.0, n), rng.uniform(-2.0, 2.0, n)


def pressed(linkage: Linkage, rng: np.random.Generator, depth: float = DEPTH) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates and speeds by chance, with the free last body put so that the journal is in the wall."""
    q, qd = moving(linkage, rng)
    pin, way = linkage.pins[0], rng.uniform(-np.pi, np.pi)
    placed = Placement(linkage, list(q), list(qd))
    hole, shaft = placed.point(pin.bearing), placed.point(pin.journal)
    centre = hole.position.plus(type(hole.position)(math.cos(way), math.sin(way)).times(pin.clearance + depth))
    q[-3:-1] += np.array(centre.minus(shaft.position))
    # The wall is not left in haste: their speeds differ by some centimetres a second.
    qd[-3:-1] += np.array(hole.velocity.minus(shaft.velocity)) + rng.uniform(-0.03, 0.03, 2)
    return q, qd


def rates_of(
    linkage: Linkage,
    q: np.ndarray,
    qd: np.ndarray,
    drives: Any = None,
    *,
    model: FrictionModel | None = None,
    friction: float = 0.1,
    bend: float = 0.0,
) -> Rates:
    contacts = [Contact(pin.clearance, 7e10, 0.15, friction, 1e-3) for pin in linkage.pins]
    memories = [ContactMemory(1.0, 0.3, bend) for _ in linkage.pins]
    efforts = [0.0] * len(linkage.drives) if drives is None else list(drives)
    return rates(linkage, model or FrictionModel(), State(list(q), list(qd), memories), efforts, contacts)


def full(linkage: Linkage, q: np.ndarray) -> np.ndarray:
    n = len(linkage.coordinates)
    M = np.zeros((n, n))
    for (i, j), entry in mass_matrix(Placement(linkage, list(q), [0.0] * n)).items():
        M[i, j] = M[j, i] = entry
    return M


class TestBesidePinocchio:
    """Pins on pins, pins on guides, guides on rotating bodies, and a free body, against Pinocchio's."""

    @pytest.mark.parametrize("seed", range(6))
    def test_inertia(self, seed: int) -> None:
        """The mass matrix is Pinocchio's, taken over to angles against the ground."""
        rng = np.random.default_rng(seed)
        linkage = tree(rng)
        model, T, shift = to_pinocchio(linkage)
        q, _ = moving(linkage, rng)

        other = pinocchio.crba(model, model.createData(), T @ q + shift)
        other = np.triu(other) + np.triu(other, 1).T

        np.testing.assert_allclose(full(linkage, q), T.T @ other @ T, rtol=0, atol=ROUNDING)

    @pytest.mark.parametrize("seed", range(6))
    def test_forces_of_speeds_and_weight(self, seed: int) -> None:
        """Centrifugal and Coriolis forces and weights are Pinocchio's."""
        rng = np.random.default_rng(seed)
        linkage = attrs.evolve(tree(rng), loads=())
        model, T, shift = to_pinocchio(linkage)
        q, qd = moving(linkage, rng)

        other = pinocchio.nonLinearEffects(model, model.createData(), T @ q + shift, T @ qd)

        ours = -np.array(free_forces(Placement(linkage, list(q), list(qd))))
        np.testing.assert_allclose(ours, T.T @ other, rtol=0, atol=ROUNDING)

    @pytest.mark.parametrize("seed", range(6))
    def test_motors(self, seed: int) -> None:
        """A motor between two bodies pushes both: what Pinocchio's joint torque does to joint angles, ours do."""
        rng = np.random.default_rng(seed)
        # In so large a hole the journal flies.
        linkage = attrs.evolve(tree(rng), loads=()).with_clearances({"eye": 1e3})
        model, T, shift = to_pinocchio(linkage)
        q, qd = moving(linkage, rng)
        efforts = rng.uniform(-20.0, 20.0, 3)
        tau = np.zeros(model.nv)
        # The first three bodies have a joint of one coordinate each.
        tau[:3] = efforts

        other = pinocchio.aba(model, model.createData(), T @ q + shift, T @ qd, tau)

        ours = np.array(rates_of(linkage, q, qd, efforts).qdd)
        np.testing.assert_allclose(T @ ours, other, rtol=ROUNDING, atol=ROUNDING)


class TestWhatMotionKeeps:
    """Laws that hold in every configuration, whatever touches."""

    LAWS = (FrictionModel(), FrictionModel(velocity="centre"), FrictionModel(law="tanh"), FrictionModel(law="lugre"))

    @pytest.mark.parametrize("model", LAWS, ids=lambda model: f"{model.law}-{model.velocity}")
    @pytest.mark.parametrize("seed", range(4))
    def test_energy(self, seed: int, model: FrictionModel) -> None:
        """Kinetic, potential and stored energy grow by what drives give and contacts do not take, watt by watt."""
        rng = np.random.default_rng(seed)
        linkage = tree(rng)
        q, qd = pressed(linkage, rng)
        efforts = rng.uniform(-20.0, 20.0, 3)

        now = rates_of(linkage, q, qd, efforts, model=model, bend=1e-6)
        dt, qdd = 1e-7, np.array(now.qdd)
        after, before = (rates_of(linkage, q + s * dt * qd, qd + s * dt * qdd, efforts).energy for s in (1.0, -1.0))

        assert now.pins[0].normal > 50.0
        assert abs(now.powers[2]) > 1e-3
        growth = (sum(after) - sum(before)) / (2 * dt)
        driven, lost, rubbed = now.powers
        assert growth == pytest.approx(driven - lost - rubbed, rel=1e-6, abs=DIFFERENCE)

    def test_friction_of_surfaces_takes_energy(self, rng: np.random.Generator) -> None:
        """Surfaces that slide on one another never gain by it."""
        for _ in range(20):
            linkage = tree(rng)
            now = rates_of(linkage, *pressed(linkage, rng))
            assert now.powers[2] > 0

    @pytest.mark.parametrize("model", LAWS, ids=lambda model: f"{model.law}-{model.velocity}")
    def test_momentum_of_free_bodies(self, rng: np.random.Generator, model: FrictionModel) -> None:
        """Two free bodies in a pin with play keep their momentum and their angular momentum, whatever rubs."""
        linkage = pair(rng)
        q, qd = pressed(linkage, rng)

        qdd = np.array(rates_of(linkage, q, qd, model=model, bend=1e-6).qdd)

        mass = np.array([body.mass for body in linkage.bodies])
        inertia = np.array([body.inertia for body in linkage.bodies])
        centre, pull, turn = q.reshape(2, 3)[:, :2], qdd.reshape(2, 3)[:, :2], qdd.reshape(2, 3)[:, 2]
        assert np.abs(mass[:, None] * pull).max() > 10.0
        np.testing.assert_allclose(mass @ pull, 0.0, atol=ROUNDING)
        moment = mass * (centre[:, 0] * pull[:, 1] - centre[:, 1] * pull[:, 0]) + inertia * turn
        assert moment.sum() == pytest.approx(0.0, abs=ROUNDING)

    def test_moment_about_the_contact(self, rng: np.random.Generator) -> None:
        """About the point where they touch no body's angular momentum changes, though each rotates ever faster."""
        linkage = pair(rng)
        q, qd = pressed(linkage, rng)

        now = rates_of(linkage, q, qd)
        qdd = np.array(now.qdd).reshape(2, 3)
        pin = linkage.pins[0]
        hole = Placement(linkage, list(q), list(qd)).point(pin.bearing).position
        gap = np.array(now.pins[0].gap)
        touch = np.array(hole) + gap / np.linalg.norm(gap) * (pin.clearance + pin.journal_radius)
        for body, (x, y, turn), pose in zip(linkage.bodies, qdd, q.reshape(2, 3), strict=True):
            lever = pose[:2] - touch
            assert abs(turn) > 1.0
            moment = body.mass * (lever[0] * y - lever[1] * x) + body.inertia * turn
            assert moment == pytest.approx(0.0, abs=ROUNDING)


def pair(rng: np.random.Generator) -> Linkage:
    """Two free bodies without weight, one with the hole and one with the journal."""

    def body(name: str) -> Body:
        return Body(name=name, mass=rng.uniform(0.5, 2), inertia=rng.uniform(0.01, 0.05), points={"p": (0.2, 0.1)})

    eye = ClearancePin(
        name="eye", bearing=BodyPoint("one", "p"), journal=BodyPoint("other", "p"), clearance=1e-3, journal_radius=0.02
    )
    return Linkage(
        name="pair",
        ground=Body(name="ground"),
        bodies=[body("one"), body("other")],
        joints=[],
        pins=[eye],
        drives=[],
        tip=BodyPoint("one", "p"),
        gravity=(0.0, 0.0),
    )


class TestGivenMotions:
    """Drives whose motion is given."""

    @pytest.mark.parametrize("seed", range(4))
    def test_efforts_that_do_the_same(self, seed: int) -> None:
        """The efforts that a given motion takes make the same motion when they are given as efforts."""
        rng = np.random.default_rng(seed)
        linkage = tree(rng)
        forced = attrs.evolve(linkage, drives=[Drive(body=d.body, kind="motion") for d in linkage.drives])
        q, qd = pressed(linkage, rng)
        accelerations = rng.uniform(-5.0, 5.0, 3)

        prescribed = rates_of(forced, q, qd, accelerations)
        again = rates_of(linkage, q, qd, prescribed.efforts)

        np.testing.assert_allclose(np.array(prescribed.qdd)[list(linkage.driven)], accelerations, rtol=0, atol=ROUNDING)
        np.testing.assert_allclose(again.qdd, prescribed.qdd, rtol=1e-9, atol=1e-9)
        assert again.powers[0] == pytest.approx(prescribed.powers[0], rel=1e-9)

    def test_mixed(self, rng: np.random.Generator) -> None:
        """A lever with an effort on a sledge whose motion is given: the sledge's drive carries the lever's too."""
        linkage = tree(rng)
        kinds = ("motion", "motion", "effort")
        mixed = attrs.evolve(
            linkage, drives=[Drive(body=d.body, kind=kind) for d, kind in zip(linkage.drives, kinds, strict=True)]
        )
        q, qd = pressed(linkage, rng)

        prescribed = rates_of(mixed, q, qd, (1.0, -2.0, 7.0))
        again = rates_of(linkage, q, qd, prescribed.efforts)

        assert prescribed.efforts[2] == 7.0
        np.testing.assert_allclose(again.qdd, prescribed.qdd, rtol=1e-9, atol=1e-9)


def test_motor_on_a_sledge_turns_what_guides_it(rng: np.random.Generator) -> None:
    """A motor on what slides along a turning arm pushes back on that arm, for the sledge cannot rotate on it."""
    assert drive_weights(tree(rng), "lever") == {2: 1.0, 0: -1.0}


def test_weights_and_loads_do_the_work_of_their_energy(rng: np.random.Generator) -> None:
    """At rest the generalised forces are the slope of the potential energy, load by load."""
    linkage = tree(rng)
    q, _ = moving(linkage, rng)
    still = np.zeros_like(q)
    force = np.array(free_forces(Placement(linkage, list(q), list(still))))

    step = 1e-6
    for i in range(len(q)):
        up, down = (rates_of(linkage, q + s * step * np.eye(len(q))[i], still).energy[1] for s in (1.0, -1.0))
        assert -(up - down) / (2 * step) == pytest.approx(force[i], abs=1e-7)
