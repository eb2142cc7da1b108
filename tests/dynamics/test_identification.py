"""Base parameters: which columns of the regressor are independent, and what the others add to them."""

import attrs
import numpy as np
import pinocchio as pin
import pytest

from armwright.arm.load import load_arm
from armwright.arm.model import Arm, Joint, Link
from armwright.arrays import Array
from armwright.dynamics.identification import base_parameters, base_regressor, parameter_names
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.dynamics.regressors import dynamic_parameters, regressor
from armwright.errors import KindError, UnsupportedArmError
from oracles.arms import of_all_kinds, random_arm, random_configurations
from oracles.with_pinocchio import pinocchio_model
from samples import Sample

AGREEMENT = 1e-12  # relative to the largest number
DEPENDENT = 1e-9  # a singular value behind the largest, of columns of length 1


def _motion(arm: Arm, rng: np.random.Generator, count: int) -> tuple[Array, Array, Array]:
    return random_configurations(arm, rng, count), *rng.normal(size=(2, count, arm.n))


def _rank(Y: Array) -> int:
    columns = Y.reshape(-1, Y.shape[-1])
    lengths = np.linalg.norm(columns, axis=0)
    columns = columns[:, lengths > AGREEMENT * lengths.max()]
    return int(np.linalg.matrix_rank(columns / np.linalg.norm(columns, axis=0), tol=DEPENDENT))


def test_predicts_the_efforts(sample: Sample) -> None:
    """Base parameters give the efforts of motions they were not found by, and no column is left over."""
    count = sample.count(20)
    for rng in sample.cases(20):
        plain = random_arm(rng, int(rng.integers(1, 7)))
        for arm in (plain, of_all_kinds(plain, rng)):
            motion = _motion(arm, rng, 150)
            expected = inverse_dynamics(arm, *motion)
            base = base_parameters(arm)

            Y = base_regressor(arm, *motion)

            parameters = base.combinations @ dynamic_parameters(arm)
            # Terms that cancel leave the rounding of the largest of them.
            terms = np.abs(Y) @ np.abs(parameters)
            np.testing.assert_allclose(Y @ parameters, expected, rtol=0, atol=AGREEMENT * max(1.0, terms.max()))
            assert len(base.columns) == _rank(regressor(arm, *motion)) == _rank(Y)
            np.testing.assert_array_equal(Y, regressor(arm, *motion)[..., list(base.columns)])
    sample.record("efforts by base parameters are inverse dynamics, random arms", 2 * count, 0)


@pytest.mark.parametrize("name", ["puma560", "ur5", "stanford"])
def test_as_many_as_pinocchio_tells(name: str, rng: np.random.Generator) -> None:
    """Of the parameters of links there are as many as the rank of Pinocchio's regressor; the rotors add their own."""
    arm = load_arm(name)
    model, data, _ = pinocchio_model(arm)
    q, qd, qdd = _motion(arm, rng, 60)
    theirs = [pin.computeJointTorqueRegressor(model, data, *row).copy() for row in zip(q, qd, qdd, strict=True)]
    rotors = np.eye(6) * qdd[:, None, :]
    base = base_parameters(arm)

    of_motion = [name for name in base.names if not name.startswith(("viscous", "forward", "backward"))]

    assert len(of_motion) == _rank(np.concatenate([np.array(theirs), rotors], axis=-1))
    assert sum(not name.startswith("rotor") for name in of_motion) == _rank(np.array(theirs))


def test_planar_arm() -> None:
    """The base parameters of two links in a vertical plane are those of the textbooks."""
    a1, a2 = 0.5, 0.3
    upright = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
    arm = Arm(
        name="planar",
        joints=[Joint(kind="revolute", a=a1), Joint(kind="revolute", a=a2)],
        links=[Link(), Link()],
        base=upright,
    )

    base = base_parameters(arm)

    drives = [f"{name}{i}" for i in (1, 2) for name in ("viscous", "forward", "backward")]
    drives.insert(3, "rotor2")
    assert base.names == ("mx1", "my1", "Izz1", "mx2", "my2", "Izz2", *drives)
    names = parameter_names(arm)
    found = {
        row: dict(zip(names, numbers, strict=True)) for row, numbers in zip(base.names, base.combinations, strict=True)
    }
    # About the origins of the frames, at the ends of the links: m1 is where link 1 ends, m2 + mx2 / a2 as well.
    expected = {
        "mx1": {"mx1": 1.0, "m1": a1, "m2": a1},
        "my1": {"my1": 1.0},
        "Izz1": {"Izz1": 1.0, "rotor1": 1.0, "m1": -(a1**2), "m2": -(a1**2)},
        "mx2": {"mx2": 1.0, "m2": a2},
        "my2": {"my2": 1.0},
        "Izz2": {"Izz2": 1.0, "m2": -(a2**2)},
        **{name: {name: 1.0} for name in drives},
    }
    for row, shares in expected.items():
        assert found[row] == pytest.approx({**dict.fromkeys(names, 0.0), **shares}, abs=1e-13)


def test_of_the_geometry_alone(rng: np.random.Generator) -> None:
    """Another arm of the same geometry has the same base parameters, to the bit."""
    arm = random_arm(rng, 4)
    heavier = attrs.evolve(arm, links=random_arm(rng, 4).links)

    one, other = base_parameters(arm), base_parameters(heavier)

    assert one[:2] == other[:2]
    np.testing.assert_array_equal(one.combinations, other.combinations)


def test_the_callers_own(rng: np.random.Generator) -> None:
    """What a caller does with the combinations changes them for nobody else."""
    arm = random_arm(rng, 2)
    base_parameters(arm).combinations[:] = 0.0

    assert np.any(base_parameters(arm).combinations)


def test_mistakes() -> None:
    """No arm, and an arm of which nothing is known, are refused."""
    with pytest.raises(KindError, match="expected an Arm"):
        base_parameters("stanford")  # type: ignore[arg-type]
    with pytest.raises(UnsupportedArmError, match="unknown"):
        base_parameters(attrs.evolve(load_arm("stanford"), links=[Link(unknown="not said")] * 6))
