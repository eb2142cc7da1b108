"""Friction of all kinds and springs in simulated motion, against closed forms, SciPy and the ledger of energy."""

from collections.abc import Callable

import attrs
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from armwright.arm.load import load_arm
from armwright.arm.model import Arm, Motor, Spring
from armwright.arrays import Array
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.simulation.controllers import computed_torque, gravity_compensation, standing
from armwright.simulation.integrators import Adaptive, Gill, Integrator
from armwright.simulation.result import JointState, Simulation, Status
from armwright.simulation.simulator import simulate
from oracles.arms import random_arm, with_all_friction, with_springs
from samples import Sample
from simulation.machines import balanced, block, free, pendulum

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

MASS = 2.0
FRICTION = {"coulomb_forward": 2.5, "coulomb_backward": 1.5, "stribeck": 1.2, "stribeck_speed": 0.05, "offset": -0.4}


def pushed(effort: float) -> Callable[[float, Array, Array], Array]:
    return lambda _t, _q, _qd: np.array([effort])


def lawful(found: Simulation) -> None:
    """At every moment drives, friction and what holds give what links and springs take."""
    bare = attrs.evolve(found.arm, motors=[Motor(inertia=motor.inertia) for motor in found.arm.motors])
    taken = inverse_dynamics(bare, found.q, found.qd, found.qdd)
    given = found.tau + found.friction + found.hold
    np.testing.assert_allclose(given, taken, atol=1e-9 * max(1.0, np.abs(taken).max()))


@pytest.mark.parametrize("integrator", [Gill(), Adaptive()], ids=["Gill", "Adaptive"])
def test_break_away(integrator: Integrator) -> None:
    """A joint rests between the bounds, which Stribeck friction widens and an offset shifts, and moves beyond them."""
    low, high = Motor(**FRICTION).break_away
    assert (low, high) == (pytest.approx(-3.1), pytest.approx(3.3))
    for bound, outward in ((low, -1.0), (high, 1.0)):
        still = simulate(block(MASS, **FRICTION), [0.0], duration=0.5, controller=pushed(bound - 1e-6 * outward))
        assert not still.qd.any()
        assert (still.state == JointState.STICKS).all()
        lawful(still)

        moved = simulate(
            block(MASS, **FRICTION),
            [0.0],
            duration=1.0,
            controller=pushed(bound + 0.1 * outward),
            integrator=integrator,
        )
        assert (moved.qd[1:, 0] * outward > 0).all()
        # Once it moves, Stribeck friction goes, and drives it on.
        assert abs(moved.qdd[-1, 0]) > 0.5 * 1.2 / MASS
        lawful(moved)
        balanced(moved)


def test_an_offset_without_dry_friction() -> None:
    """It is a constant effort: a free block falls along it, and its work comes back where the block returns."""
    found = simulate(block(MASS, offset=3.0), [0.0], [1.5], duration=2.0)

    np.testing.assert_allclose(found.q[:, 0], 1.5 * found.t - 0.75 * found.t**2, atol=1e-9)
    assert found.heat[-1, 0] == pytest.approx(0.0, abs=1e-9)
    balanced(found)


@pytest.mark.parametrize("integrator", [Gill(), Adaptive()], ids=["Gill", "Adaptive"])
def test_the_cube_root_of_speed(integrator: Integrator) -> None:
    """A block that only this friction slows stops at 3/2 m v^(2/3) / c, for good."""
    c, v = 3.0, 1.0
    found = simulate(block(MASS, cube_root=c), [0.0], [v], duration=1.5, integrator=integrator)
    assert found.status is Status.FINISHED
    end = 1.5 * MASS * v ** (2 / 3) / c

    expected = np.maximum(v ** (2 / 3) - 2 / 3 * c / MASS * found.t, 0.0) ** 1.5
    np.testing.assert_allclose(found.qd[:, 0], expected, atol=1e-4)
    assert found.q[-1, 0] == pytest.approx(0.4 * end * v, rel=1e-4)
    assert found.t[-1] > end
    assert (found.friction * found.qd <= 0).all()


def test_the_whole_law_against_scipy(rng: np.random.Generator) -> None:
    """A pendulum with a spring and every kind of friction swings once as SciPy integrates the law."""
    motor = Motor(viscous=0.3, cube_root=0.8, **FRICTION)
    swinging = attrs.evolve(pendulum(), motors=[motor])
    spring = Spring(stiffness=7.0, rest=0.4)
    swinging = attrs.evolve(swinging, joints=[attrs.evolve(swinging.joints[0], spring=spring)])
    speed = rng.uniform(6.0, 8.0)

    def slope(_t: float, y: Array) -> Array:
        q, v = y
        dry = 2.5 + 1.2 * np.exp(-((v / 0.05) ** 2))
        effort = 2.0 * 9.80665 * 0.5 * np.cos(q) + 7.0 * (q - 0.4) + 0.3 * v + dry + 0.8 * np.cbrt(v) - 0.4
        return np.array([v, -effort / (2.0 * 0.25)])

    def stops(_t: float, y: Array) -> float:
        return float(y[1])

    stops.terminal = True  # type: ignore[attr-defined]
    way = solve_ivp(
        slope, (0, 2), [0.0, speed], method="DOP853", rtol=1e-11, atol=1e-12, events=stops, dense_output=True
    )
    end = float(way.t[-1])
    assert 0.1 < end < 2

    found = simulate(swinging, [0.0], [speed], duration=2.0, integrator=Adaptive(rtol=1e-10, atol=1e-12))

    # Then it turns: what SciPy integrates has no other direction.
    before = found.t < end
    np.testing.assert_allclose(found.q[before, 0], way.sol(found.t[before])[0], atol=1e-7)
    np.testing.assert_allclose(found.qd[before, 0], way.sol(found.t[before])[1], atol=1e-6)
    assert (found.qd[~before, 0] <= 0)[0]
    lawful(found)
    balanced(found)


def test_a_spring() -> None:
    """A block on a spring swings about its rest with the frequency of mechanics, and keeps its energy."""
    sprung = block(MASS)
    spring = Spring(stiffness=50.0, rest=0.2)
    sprung = attrs.evolve(sprung, joints=[attrs.evolve(sprung.joints[0], spring=spring)])

    found = simulate(sprung, [0.5], duration=3.0)

    np.testing.assert_allclose(found.q[:, 0], 0.2 + 0.3 * np.cos(5.0 * found.t), atol=1e-8)
    assert found.potential[0] == pytest.approx(25 * 0.3**2)
    balanced(found)


def test_energy_of_arms(sample: Sample) -> None:
    """The ledger of arms with springs and all friction is balanced, and Newton's law holds at every moment."""
    for rng in sample.cases(20):
        arm = with_springs(with_all_friction(random_arm(rng, int(rng.integers(1, 4))), rng), rng)
        # An inertia at every joint keeps the motion as slow as the step.
        arm = attrs.evolve(free(arm), motors=[attrs.evolve(motor, inertia=1.0) for motor in arm.motors])
        q, qd = rng.uniform(-1, 1, size=(2, arm.n))

        found = simulate(arm, q, qd, duration=0.3, integrator=Adaptive(rtol=1e-9, atol=1e-11), period=0.01)

        assert found.status is Status.FINISHED
        lawful(found)
        scale = max(1.0, np.abs(found.energy).max(), np.abs(found.heat).max())
        assert np.abs(found.energy_imbalance).max() < 1e-7 * scale


def pulled(**motor: float) -> Simulation:
    """A block that a spring of 100 N/m pulls along at 10 mm/s."""
    arm = block(MASS, coulomb_forward=0.5, coulomb_backward=0.5, viscous=5.0, **motor)

    def pull(t: float, q: Array, _qd: Array) -> Array:
        return np.asarray(100.0 * (0.01 * t - q))

    return simulate(arm, [0.0], duration=8.0, controller=pull, integrator=Adaptive(), period=0.01)


def test_stick_and_slip() -> None:
    """A mass pulled slowly by a spring sticks and slips again and again with Stribeck friction, and not without."""
    without, slips = pulled(), pulled(stribeck=1.0, stribeck_speed=0.05)

    def breaks(found: Simulation) -> list[float]:
        return [event.t for event in found.events if event.after is JointState.MOVES and event.t > 0]

    assert len(breaks(without)) <= 1
    np.testing.assert_allclose(without.qd[without.t > 6, 0], 0.01, atol=1e-4)
    times = breaks(slips)
    assert len(times) >= 3
    # It first breaks away at 1.5 N, and slips faster than it is pulled.
    assert times[0] == pytest.approx(1.5, abs=1e-6)
    assert slips.qd.max() > 0.02


def test_controllers_know_the_law(rng: np.random.Generator) -> None:
    """Drives that carry weight and springs leave an arm at rest, and computed torque keeps a moving one on its way."""
    arm = with_springs(free(load_arm("stanford-jpl")), rng)
    q = np.array([0.3, 1.0, 0.5, -0.4, 0.6, 0.2])
    held = simulate(arm, q, duration=0.05, controller=gravity_compensation(arm))
    np.testing.assert_allclose(held.q, np.broadcast_to(q, held.q.shape), atol=1e-9)

    rubbing = with_all_friction(arm, rng)
    rubbing = attrs.evolve(rubbing, motors=[attrs.evolve(motor, inertia=1.0) for motor in rubbing.motors])

    def steady(t: float, order: int) -> Array:
        return q + 0.3 * t if order == 0 else np.full(6, 0.3 if order == 1 else 0.0)

    controller = computed_torque(rubbing, steady, 100.0, 20.0)
    found = simulate(rubbing, q, np.full(6, 0.3), duration=0.05, controller=controller)
    np.testing.assert_allclose(found.qd, 0.3, atol=1e-9)
    assert standing(q)(0.0, 0) is not None


def test_arms_without_them() -> None:
    """An arm that has none of this moves as before, to the bit: terms of 0 leave no trace."""
    arm = load_arm("puma560")
    zeros = {"offset": 0.0, "stribeck": 0.0, "stribeck_speed": 0.2, "cube_root": 0.0}
    same: Arm = attrs.evolve(arm, motors=[attrs.evolve(motor, **zeros) for motor in arm.motors])
    one, other = (simulate(x, [0.1] * 6, duration=0.05) for x in (arm, same))

    for name in ("q", "qd", "friction", "hold", "heat"):
        assert getattr(one, name).tobytes() == getattr(other, name).tobytes()
