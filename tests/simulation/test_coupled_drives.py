"""Arms with coupled drives in the simulation: what it takes, and what it refuses."""

import attrs
import numpy as np
import pytest

from armwright.arm import Arm, Coupling, Limits
from armwright.dynamics import inverse_dynamics
from armwright.errors import UnsupportedArmError
from armwright.motion.quintic_polynomials import quintic
from armwright.simulation import computed_torque, simulate
from armwright.simulation.result import Brake
from oracles.arms import coupled, random_arm
from samples import Sample
from simulation.machines import balanced


def smooth(rng: np.random.Generator, joints: int) -> Arm:
    arm = random_arm(rng, joints)
    motors = [attrs.evolve(each, viscous=rng.uniform(0, 2), cube_root=rng.uniform(0, 1)) for each in arm.motors]
    free = [attrs.evolve(joint, limits=Limits()) for joint in arm.joints]
    return coupled(attrs.evolve(arm, motors=motors, joints=free), rng)


def test_computed_torque_follows(sample: Sample) -> None:
    """A controller that knows the arm follows a motion to rounding, its efforts are the inverse dynamics."""
    for rng in sample.cases(8):
        arm = smooth(rng, int(rng.integers(2, 5)))
        start = rng.uniform(-0.5, 0.5, size=arm.n)
        move = quintic(start, start + rng.uniform(-0.5, 0.5, size=arm.n), 0.5)
        run = simulate(arm, start, controller=computed_torque(arm, move, 400.0, 40.0), duration=0.5)

        np.testing.assert_allclose(run.q, move(run.t), atol=1e-8)
        expected = inverse_dynamics(arm, move(run.t), move(run.t, 1), move(run.t, 2))
        np.testing.assert_allclose(run.tau, expected, atol=1e-5 * np.abs(expected).max())
        balanced(run)
    sample.record("arms with coupled drives that follow by computed torque", sample.count(8), 0)


def test_largest_efforts_of_drives(rng: np.random.Generator) -> None:
    """Drives give no more than they can, whatever is asked for at the joints."""
    arm = smooth(rng, 3)
    coupling = arm.coupling
    assert coupling is not None
    weak = attrs.evolve(arm, coupling=Coupling(matrix=coupling.matrix, limits=[Limits(effort=2.0)] * 3))
    run = simulate(weak, np.zeros(3), controller=lambda _t, _q, _qd: np.full(3, 50.0), duration=0.05)

    efforts = coupling.drive_efforts(run.tau)
    assert np.abs(efforts).max() == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("motor", "limits", "message"),
    [
        ({"coulomb_forward": 1.0}, [], "has coupled drives, and that of joint 1 has dry friction, which holds drives"),
        ({"stribeck": 1.0, "stribeck_speed": 0.1}, [], "that of joint 1 has dry friction"),
        ({}, [Limits(), Limits(lower=-1.0)], "the drive of joint 2 has position limits of its own"),
    ],
)
def test_what_is_refused(motor: dict[str, float], limits: list[Limits], message: str, rng: np.random.Generator) -> None:
    """Dry friction and stops of coupled drives hold no joints: they are refused, with the way out."""
    arm = random_arm(rng, 2)
    motors = [attrs.evolve(each, **motor) for each in arm.motors]
    arm = attrs.evolve(arm, motors=motors, coupling=Coupling(matrix=[[1, 0], [-1, 1]], limits=limits))

    with pytest.raises(UnsupportedArmError, match=message) as caught:
        simulate(arm, np.zeros(2), duration=0.1)

    assert "armwright run --physics" in str(caught.value)


def test_brakes(rng: np.random.Generator) -> None:
    """A brake holds a drive, which is no joint where drives are coupled; elsewhere it holds."""
    arm = attrs.evolve(smooth(rng, 3), coupling=Coupling(matrix=[[1, 0, 0], [0, 1, 0], [0, -1, 1]]))

    run = simulate(arm, np.zeros(3), brakes=[Brake(joint=0)], duration=0.1)
    assert np.abs(run.q[:, 0]).max() == 0
    assert np.abs(run.q[:, 1:]).max() > 0
    with pytest.raises(UnsupportedArmError, match="the drive of joint 2 is coupled, so that a brake would"):
        simulate(arm, np.zeros(3), brakes=[Brake(joint=1)], duration=0.1)
