"""Simulations that end early, requests that make no sense, and everything at once."""

import numpy as np
import pytest

from armwright.arm.model import Arm, Joint
from armwright.errors import InvalidValueError, ShapeError, UnsupportedArmError
from armwright.simulation.controllers import pd, standing
from armwright.simulation.integrators import Adaptive, Gill
from armwright.simulation.result import Brake, Status
from armwright.simulation.simulator import simulate
from simulation.machines import block, lawful, lift, pendulum, rough

COARSE = Gill(length=1e-2)


def test_divergence_is_a_status() -> None:
    """A controller that pushes ever harder ends in numbers that are none; the result says so and keeps what was."""
    found = simulate(
        block(lower=-np.inf, upper=np.inf),
        [1.0],
        duration=20.0,
        controller=lambda _t, q, _qd: q**3 * 1e4,
        integrator=COARSE,
        period=0.1,
    )

    assert found.status is Status.DIVERGED
    assert found.t[-1] < 20.0
    assert np.isfinite(found.q).all()


def test_divergence_in_the_first_step() -> None:
    """Even when the first step fails there is a result: where the arm started."""
    found = simulate(block(), [1.0], duration=1.0, controller=lambda t, _q, _qd: [np.inf if t > 0 else 0.0])

    assert found.status is Status.DIVERGED
    np.testing.assert_array_equal(found.q, [[1.0]])


def test_imprecision_is_a_status() -> None:
    """A push that grows beyond all bounds at half a second cannot be followed through it."""
    found = simulate(
        block(lower=-np.inf, upper=np.inf),
        [0.0],
        duration=1.0,
        controller=lambda t, _q, _qd: [1.0 / (0.5 - t) ** 2],
        integrator=Adaptive(method="RK23", rtol=1e-2, atol=1e-2, longest=0.1),
        period=0.01,
    )

    assert found.status is Status.IMPRECISE
    assert 0.4 < found.t[-1] <= 0.5


def test_entanglement_is_a_status() -> None:
    """A controller that pushes forward at rest and backward in motion never gets anywhere; it is not let run on."""
    found = simulate(
        block(coulomb_forward=1.0, coulomb_backward=1.0),
        [0.0],
        duration=1.0,
        controller=lambda _t, _q, qd: np.where(qd == 0, 10.0, -10.0),
    )

    assert found.status is Status.ENTANGLED
    assert len(found.t) < 10


def test_samples() -> None:
    """Moments come every period, from the start to the end that was asked."""
    found = simulate(pendulum(), [0.0], duration=0.25, period=0.1)

    np.testing.assert_allclose(found.t, (0.0, 0.1, 0.2, 0.25))
    assert found.q.shape == found.tau.shape == found.state.shape == (4, 1)


def test_what_cannot_be_simulated() -> None:
    """Starts outside the stops, times that do not pass, brakes without a joint and wrong controllers are refused."""
    hoist = lift()
    with pytest.raises(InvalidValueError, match=r"joint 1 starts at 2500 mm, outside its stops at 0 and 2000 mm"):
        simulate(hoist, [2.5], duration=1.0)
    assert simulate(hoist, [2.5], duration=0.01, stops=False).status is Status.FINISHED
    with pytest.raises(InvalidValueError, match="duration: expected more than 0 s, got 0"):
        simulate(hoist, [1.0], duration=0)
    with pytest.raises(InvalidValueError, match="period: expected more than 0 s, got -1"):
        simulate(hoist, [1.0], duration=1.0, period=-1)
    with pytest.raises(InvalidValueError, match="brake: expected a joint from 0 to 0, got 1"):
        simulate(hoist, [1.0], duration=1.0, brakes=[Brake(joint=1)])
    with pytest.raises(InvalidValueError, match="brake: start 2 must be 0 or later, and before end 1"):
        Brake(joint=0, start=2, end=1)
    with pytest.raises(ShapeError, match=r"efforts of the controller at 0 s: expected shape \(1,\), got \(2,\)"):
        simulate(hoist, [1.0], duration=1.0, controller=lambda _t, _q, _qd: np.zeros(2))
    with pytest.raises(UnsupportedArmError, match="joint 1"):
        simulate(Arm(name="rail", joints=[Joint(kind="prismatic")]), [0.0], duration=1.0)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.drawn(0.34)
def test_everything_at_once(seed: int) -> None:
    """Skew arms with friction, stops, a brake and a spring obey Newton's law, and both integrators see the same."""
    rng = np.random.default_rng(seed)
    arm = rough(rng, 3)
    q, qd = rng.uniform(-0.05, 0.05, 3), rng.normal(size=3)
    controller = pd(arm, standing(np.zeros(3)), 50.0, 2.0)
    brakes = [Brake(joint=1, start=0.2, end=0.3)]

    fixed, adaptive = (
        simulate(arm, q, qd, duration=0.5, controller=controller, integrator=how, period=0.01, brakes=brakes)
        for how in (Gill(length=5e-3), Adaptive(rtol=1e-8, atol=1e-10))
    )

    for found in (fixed, adaptive):
        lawful(arm, found)
        assert found.status is Status.FINISHED
        assert (found.q >= arm.limits.lower - 1e-11).all()
        assert (found.q <= arm.limits.upper + 1e-11).all()
        scale = max(1.0, np.abs(found.energy).max(), found.heat.max(), found.impact.max())
        assert np.abs(found.energy_imbalance).max() < 1e-6 * scale
    assert [event[1:] for event in fixed.events] == [event[1:] for event in adaptive.events]
    np.testing.assert_allclose(fixed.q, adaptive.q, atol=1e-4)
