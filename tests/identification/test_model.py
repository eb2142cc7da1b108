"""The columns of the model, its base parameters, their names, and how many there must be."""

import re

import attrs
import numpy as np
import pytest

from armwright.arm.coupling import Coupling
from armwright.arm.drive import Motor, Spring
from armwright.arm.load import load_arm
from armwright.arm.model import Arm, Joint
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.dynamics.regressors import dynamic_parameters
from armwright.errors import InvalidValueError, UnknownNameError
from armwright.identification import DynamicModel, structural_count
from armwright.identification.feasible import arm_of
from armwright.identification.groupings import groupings
from armwright.identification.model import LINK_NAMES
from oracles.arms import random_arm, random_configurations
from samples import Sample

AGREEMENT = 1e-11  # relative to the largest effort
FOUR_DIGITS = 5e-4  # of what is written as a number
TERMS = ("rotor", "viscous", "forward", "backward", "offset", "cube_root", "stribeck", "stiffness")


def test_efforts_are_columns_times_parameters(sample: Sample) -> None:
    """The columns times the numbers of an arm are its inverse dynamics, with every kind of friction and springs."""
    for rng in sample.cases(20):
        plain = random_arm(rng, int(rng.integers(1, 7)))
        speeds = rng.uniform(0.05, 0.5, plain.n)
        motors = [
            Motor(
                inertia=a, viscous=b, coulomb_forward=c, coulomb_backward=d, offset=e, cube_root=f, stribeck=g,
                stribeck_speed=h,
            )
            for (a, b, c, d, e, f, g), h in zip(rng.uniform(0, 2, (plain.n, 7)), speeds, strict=True)
        ]  # fmt: skip
        arm = attrs.evolve(plain, motors=motors)
        model = DynamicModel(arm=arm, terms=TERMS[:-1], stribeck_speed=speeds)
        motion = random_configurations(arm, rng, 30), *rng.normal(size=(2, 30, arm.n))
        drives = [
            (m.inertia, m.viscous, m.coulomb_forward, m.coulomb_backward, m.offset, m.cube_root, m.stribeck)
            for m in motors
        ]
        theta = np.concatenate([dynamic_parameters(plain)[: 10 * arm.n], np.ravel(drives)])
        expected = inverse_dynamics(arm, *motion)

        np.testing.assert_allclose(model.columns(*motion) @ theta, expected, atol=AGREEMENT * np.abs(expected).max())
        base = model.base
        np.testing.assert_allclose(
            model.base_columns(*motion) @ (base.combinations @ theta), expected, atol=AGREEMENT * np.abs(expected).max()
        )


def test_spring_pulls_by_stiffness_and_offset(rng: np.random.Generator) -> None:
    """A spring is a stiffness, and the offset that it has at position 0."""
    arm = load_arm("ntu-3r")
    sprung = attrs.evolve(arm, joints=[attrs.evolve(j, spring=Spring(stiffness=7.0, rest=0.3)) for j in arm.joints])
    q, qd, qdd = rng.normal(size=(3, 20, 3))
    model = DynamicModel(arm=arm, terms=("offset", "stiffness"))
    theta = np.concatenate([np.zeros(30), np.tile([-7.0 * 0.3, 7.0], 3)])

    added = inverse_dynamics(sprung, q, qd, qdd) - inverse_dynamics(arm, q, qd, qdd)

    np.testing.assert_allclose(model.columns(q, qd, qdd) @ theta, added, atol=1e-12)


@pytest.mark.share(0.05)
@pytest.mark.parametrize("terms", [(), ("rotor",), ("rotor", "offset"), ("rotor", "viscous", "coulomb", "offset")])
def test_structure_says_how_many_there_are(terms: tuple[str, ...], sample: Sample) -> None:
    """Random states show as many independent columns as the spans of velocities allow, on arms of any geometry.

    Axes that are parallel, at right angles or meet, slides, and gravity along an axis all occur.
    """
    turns, lengths = np.array([0.0, np.pi / 2, -np.pi / 2, 0.7]), np.array([0.0, 0.0, 0.4, -0.25])
    differ, count = 0, 0
    for rng in sample.cases(60):
        joints = [
            Joint(
                kind="prismatic" if rng.random() < 0.3 else "revolute",
                theta=rng.choice(turns), d=rng.choice(lengths), a=rng.choice(lengths), alpha=rng.choice(turns),
            )
            for _ in range(int(rng.integers(1, 7)))
        ]  # fmt: skip
        gravity = rng.choice([(0.0, 0.0, -9.8), (0.0, 0.0, 0.0), (9.8, 0.0, 0.0), (3.0, -5.0, 7.0)])
        arm = Arm(name="random", joints=joints, gravity=gravity)
        count += 1
        differ += structural_count(arm, terms) != len(DynamicModel(arm=arm, terms=terms).base.columns)
    sample.record(f"base parameters by rank and by structure, {', '.join(terms) or 'links alone'}", count, differ)
    assert differ == 0


def test_counts_of_the_books() -> None:
    """The PUMA has 36 base parameters of its links (Gautier & Khalil 1990), a plane pendulum two and one of gravity."""
    assert structural_count(load_arm("puma560"), ()) == 36
    lying = Arm(name="pendulum", joints=[Joint(kind="revolute", a=1.0)], gravity=(0.0, -9.8, 0.0))
    assert structural_count(lying, ()) == 3
    assert structural_count(attrs.evolve(lying, gravity=(0.0, 0.0, -9.8)), ()) == 1


def test_coupled_wrist_adds_rotor_and_friction_of_its_motor() -> None:
    """A motor that turns with two joints adds its rotor, viscous and Coulomb friction: 58 and 3 base parameters."""
    coupling = np.eye(6)
    coupling[5, 4] = 1.0
    model = DynamicModel(arm=load_arm("puma560"), coupling=coupling)

    assert model.names[-3:] == ("coupled_rotor6", "coupled_viscous6", "coupled_coulomb6")
    assert len(model.base.columns) == structural_count(model.arm, model.terms) + 3 == 61


def test_power_of_a_coupling_is_that_of_its_motors(rng: np.random.Generator) -> None:
    """What motors give is what joints take: efforts at joints times their speeds are those of motors times theirs."""
    coupling = np.eye(6) + np.triu(rng.normal(size=(6, 6)), 1)
    model = DynamicModel(arm=load_arm("puma560"), coupling=coupling)
    efforts, speeds = rng.normal(size=(2, 6))

    assert model.joint_efforts(efforts) @ speeds == pytest.approx(efforts @ (coupling @ speeds))


def test_coupling_of_the_arm(sample: Sample) -> None:
    """An arm with coupled drives has their parameters: its own numbers give its efforts, and give the arm back."""
    for rng in sample.cases(10):
        C = np.eye(6)
        C[2, 1], C[5, 4] = -1.0, rng.uniform(0.2, 1.0)
        plain = load_arm("puma560")
        motors = [Motor(inertia=m, viscous=v) for m, v in rng.uniform(0.5, 3.0, (6, 2))]
        arm = attrs.evolve(plain, motors=motors, coupling=Coupling(matrix=C))
        model = DynamicModel(arm=arm, terms=("rotor", "viscous"))
        assert model.coupled_motors == (2, 5)
        values = dict.fromkeys(model.names, 0.0)
        links = [f"{name}{i}" for i in range(1, 7) for name in LINK_NAMES]
        values |= dict(zip(links, dynamic_parameters(arm)[: len(links)].tolist(), strict=True))
        for i, motor in enumerate(motors):
            before = "coupled_" if i in model.coupled_motors else ""
            values |= {f"{before}rotor{i + 1}": motor.inertia, f"{before}viscous{i + 1}": motor.viscous}
        theta = np.array(list(values.values()))
        motion = rng.uniform(-1, 1, (3, 20, 6))

        expected = inverse_dynamics(arm, *motion)

        np.testing.assert_allclose(model.columns(*motion) @ theta, expected, atol=1e-9)
        np.testing.assert_allclose(inverse_dynamics(arm_of(model, theta), *motion), expected, atol=1e-9)


def test_groupings_are_those_of_two_links_in_a_plane() -> None:
    """Of two links in a plane, the first carries the mass of the second at the end of its length."""
    joints = [Joint(kind="revolute", a=0.5), Joint(kind="revolute", a=0.3)]
    arm = Arm(name="planar", joints=joints, gravity=(0.0, -9.8, 0.0))

    texts = groupings(DynamicModel(arm=arm, terms=()))

    # Of the first link, frames stand at the far ends, as Denavit and Hartenberg have them.
    assert texts[0].startswith("mx1 ")
    assert "a1 (m1 + m2)" in texts[0]
    assert all(name in " ".join(texts) for name in ("Izz1", "mx2", "my2", "Izz2"))


def test_groupings_tell_the_coefficients(sample: Sample) -> None:
    """The text of a grouping, evaluated with the lengths of the arm, gives its coefficients back."""
    for rng in sample.cases(10):
        a, d = rng.choice([0.0, 0.5, 0.4, 0.3], (2, 4)).round(2)
        twists = rng.choice([0.0, np.pi / 2, -np.pi / 2], 4)
        joints = [Joint(kind="revolute", a=x, d=y, alpha=z) for x, y, z in zip(a, d, twists, strict=True)]
        model = DynamicModel(arm=Arm(name="arm", joints=joints), terms=("rotor",))
        values = dict(zip(model.names, rng.normal(size=len(model.names)), strict=True))
        lengths = {f"a{i + 1}": abs(x) for i, x in enumerate(a)} | {f"d{i + 1}": abs(x) for i, x in enumerate(d)}
        terms = model.base.combinations * list(values.values())

        for text, row in zip(groupings(model), terms, strict=True):
            code = re.sub(r"(?<=[\w)]) (?=[\w(])", "*", text.replace("²", "**2"))
            assert eval(code, {}, values | lengths) == pytest.approx(row.sum(), abs=FOUR_DIGITS * np.abs(row).sum())


def test_refuses_unknown_terms_and_couplings() -> None:
    """A term that there is not is refused with the nearest one, and a coupling without inverse."""
    arm = load_arm("ntu-3r")
    with pytest.raises(UnknownNameError, match="Did you mean 'viscous'"):
        DynamicModel(arm=arm, terms=("viscos",))
    with pytest.raises(InvalidValueError, match="once"):
        DynamicModel(arm=arm, terms=("rotor", "rotor"))
    with pytest.raises(InvalidValueError, match="inverse"):
        DynamicModel(arm=arm, coupling=np.zeros((3, 3)))
