"""Compiled dynamics of long arms, whose loops over links are loops of the code."""

from collections.abc import Iterator

import attrs
import numpy as np
import pinocchio as pin
import pytest

from armwright.arm.model import Arm, Link, Motor
from armwright.arrays import Array
from armwright.compiled.arm import compile_arm
from armwright.compiled.quantities import emit_quantity, quantity_kernel
from armwright.dynamics.accelerations import forward_dynamics
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.errors import InvalidValueError, UnsupportedArmError
from armwright.tracing.native import processor
from oracles.arms import random_arm, random_configurations, random_pose, squared
from oracles.with_pinocchio import pinocchio_model, with_rotors

ROUNDING = 1e-13  # of sums over all links, relative to the largest result
# Accelerations are quotients of such sums; of a long arm the last are a little worse.
QUOTIENTS = 1e-11
DYNAMICS = ("inverse_dynamics", "forward_dynamics")


@pytest.fixture(scope="module", autouse=True)
def _own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Compile into a folder of the module's own; the modules behind it use the user's again."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setenv("ARMWRIGHT_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


def _long_arm(rng: np.random.Generator, joints: int) -> Arm:
    """Return a random arm with friction."""
    arm = random_arm(rng, joints)
    motors = [
        attrs.evolve(
            m, viscous=rng.uniform(0, 2), coulomb_forward=rng.uniform(0, 2), coulomb_backward=rng.uniform(0, 2)
        )
        for m in arm.motors
    ]
    return attrs.evolve(arm, motors=motors)


def _with_fixed_transforms(arm: Arm, rng: np.random.Generator) -> Arm:
    """Return an arm some of whose links are any transform, as in URDF."""
    joints = [attrs.evolve(j, fixed=random_pose(rng)) if rng.random() < 0.4 else j for j in arm.joints]
    return attrs.evolve(arm, joints=joints)


def _motion(arm: Arm, rng: np.random.Generator, rows: int) -> tuple[Array, Array, Array]:
    q = random_configurations(arm, rng, rows)
    qd, third = rng.normal(size=(2, rows, arm.n))
    return q, qd, third


def _near(value: Array, expected: Array, tolerance: float) -> None:
    assert np.abs(value - expected).max() <= tolerance * np.abs(expected).max()


@pytest.mark.parametrize(
    ("joints", "kind"), [(20, "skew"), (27, "any transforms"), (50, "right angles"), (100, "skew")]
)
def test_as_the_plain_functions(joints: int, kind: str, rng: np.random.Generator) -> None:
    """Efforts, with a push at the tool too, and accelerations are those of the plain functions."""
    arm = _long_arm(rng, joints)
    if kind != "skew":
        arm = squared(arm, rng) if kind == "right angles" else _with_fixed_transforms(arm, rng)
    fast = compile_arm(arm)
    q, qd, third = _motion(arm, rng, 11)
    qd[0] = 0.0
    wrench = rng.normal(size=(11, 6))

    _near(fast.inverse_dynamics(q, qd, third), inverse_dynamics(arm, q, qd, third), ROUNDING)
    pushed = fast.inverse_dynamics_with_wrench(q, qd, third, wrench)
    _near(pushed, inverse_dynamics(arm, q, qd, third, wrench=wrench), ROUNDING)
    _near(fast.forward_dynamics(q, qd, third), forward_dynamics(arm, q, qd, third), QUOTIENTS)


def test_against_pinocchio(rng: np.random.Generator) -> None:
    """Efforts and accelerations of 50 joints are those of Pinocchio."""
    arm = random_arm(rng, 50)
    fast = compile_arm(arm)
    model, data = with_rotors(pinocchio_model(arm)[0], arm)
    q, qd, third = _motion(arm, rng, 9)

    efforts = np.array([pin.rnea(model, data, *row).copy() for row in zip(q, qd, third, strict=True)])
    accelerations = np.array([pin.aba(model, data, *row).copy() for row in zip(q, qd, third, strict=True)])

    _near(fast.inverse_dynamics(q, qd, third), efforts, ROUNDING)
    _near(fast.forward_dynamics(q, qd, third), accelerations, QUOTIENTS)


def test_there_and_back(rng: np.random.Generator) -> None:
    """The efforts of accelerations of 60 joints cause these accelerations."""
    arm = _long_arm(rng, 60)
    fast = compile_arm(arm)
    q, qd, qdd = _motion(arm, rng, 8)

    _near(fast.forward_dynamics(q, qd, fast.inverse_dynamics(q, qd, qdd)), qdd, 1e-9)


@pytest.mark.parametrize("quantity", DYNAMICS)
def test_same_bits_in_any_company_and_width(
    quantity: str, rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A configuration has the same bits alone, in any batch, and in vectors of 8, 4 and 2 lanes."""
    arm = _long_arm(rng, 23)
    rows = _motion(arm, rng, 29)
    host = processor()
    alone = quantity_kernel(arm, quantity)
    expected = np.array([alone(*row) for row in zip(*rows, strict=True)])
    for lanes in (8, 4, 2):
        narrow = host._replace(target=host.target._replace(lanes=lanes))
        monkeypatch.setattr("armwright.tracing.kernel.processor", lambda narrow=narrow: narrow)
        kernel = quantity_kernel(arm, quantity)
        for count in (1, 2, 3, 5, 8, 9, 16, 23, 29):
            np.testing.assert_array_equal(kernel(*(x[:count] for x in rows)), expected[:count])


@pytest.mark.parametrize("quantity", DYNAMICS)
def test_bad_numbers_are_refused(quantity: str, rng: np.random.Generator) -> None:
    """NaN, infinity and numbers beyond what has a meaning are refused, whichever joint and row they belong to."""
    arm = _long_arm(rng, 30)
    function = getattr(compile_arm(arm), quantity)
    rows = _motion(arm, rng, 13)
    function(*rows)
    turning = int(np.flatnonzero(arm.revolute)[-1])
    for k, i, bad in ((0, 0, np.nan), (0, turning, 1e13), (1, 29, np.inf), (2, 17, -np.inf), (2, 5, 1e101)):
        changed = [x.copy() for x in rows]
        changed[k][12, i] = bad
        with pytest.raises(InvalidValueError):
            function(*changed)
        with pytest.raises(InvalidValueError):
            function(*(x[12] for x in changed))


def test_joint_without_inertia(rng: np.random.Generator) -> None:
    """A last joint that moves nothing has no acceleration, and is named."""
    arm = _long_arm(rng, 24)
    bare = attrs.evolve(
        arm,
        links=[*arm.links[:-1], Link(mass=0.0, com=np.zeros(3), inertia=np.zeros((3, 3)))],
        motors=[*arm.motors[:-1], Motor()],
    )

    with pytest.raises(UnsupportedArmError, match="joint 24"):
        compile_arm(bare).forward_dynamics(*_motion(arm, rng, 3))


def test_code_of_a_hundred_joints(rng: np.random.Generator) -> None:
    """An arm of 100 joints and its first 50 have loops of the same steps, each written once for a kind of joint."""
    arm = random_arm(rng, 100)
    half = attrs.evolve(arm, joints=arm.joints[:50], links=arm.links[:50], motors=arm.motors[:50])
    for quantity in DYNAMICS:
        codes = [emit_quantity(one, quantity).code.graph for one in (half, arm)]
        steps = [[step.graph.nodes for loop in code.loops for step in loop.steps] for code in codes]

        assert steps[0] == steps[1]
        assert all(len(loop.steps) <= 2 for code in codes for loop in code.loops)
