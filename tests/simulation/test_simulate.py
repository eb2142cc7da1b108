"""Simulated motion against motions that one can calculate."""

import attrs
import numpy as np
import pinocchio as pin
import pytest
from scipy.integrate import solve_ivp

from armwright.arm.limits import Limits
from armwright.arm.load import load_arm
from armwright.arm.model import STANDARD_GRAVITY, Arm, Joint, Link
from armwright.dynamics.energy import kinetic_energy
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.dynamics.shares import gravity_efforts
from armwright.simulation.controllers import gravity_compensation, pd, standing
from armwright.simulation.integrators import Adaptive, Gill
from armwright.simulation.result import Brake, JointState, Status
from armwright.simulation.simulator import simulate
from oracles.arms import random_arm
from oracles.with_pinocchio import pinocchio_model
from simulation.machines import balanced, block, free, lawful, lift, pendulum

COARSE = Gill(length=1e-2)


def test_free_motion_against_pinocchio(rng: np.random.Generator) -> None:
    """Pinocchio's accelerations, integrated by SciPy, lead a tumbling arm to the same place."""
    arm = free(random_arm(rng, 4))
    model, data, _ = pinocchio_model(arm)
    model.armature = np.array([motor.inertia for motor in arm.motors])
    q, qd = rng.normal(size=(2, 4))

    def slope(_t: float, y: np.ndarray) -> np.ndarray:
        return np.concatenate([y[4:], pin.aba(model, data, y[:4], y[4:], np.zeros(4))])

    expected = solve_ivp(slope, (0.0, 0.1), np.concatenate([q, qd]), method="DOP853", rtol=1e-11, atol=1e-12).y[:, -1]

    for integrator, close in ((Gill(length=1e-3), 1e-6), (Adaptive(rtol=1e-10, atol=1e-12), 1e-8)):
        found = simulate(arm, q, qd, duration=0.1, integrator=integrator, period=0.1)
        np.testing.assert_allclose(np.concatenate([found.q[-1], found.qd[-1]]), expected, atol=close)


def test_energy_is_kept_to_the_order_of_gill(rng: np.random.Generator) -> None:
    """Half the step leaves about a sixteenth or less of the energy that free motion gains or loses."""
    arm = free(load_arm("stanford-jpl"))
    q, qd = rng.normal(size=(2, 6))
    errors = []
    for length in (0.02, 0.01, 0.005):
        found = simulate(arm, q, qd, duration=0.4, integrator=Gill(length=length), period=0.4, stops=False)
        errors.append(np.abs(found.energy[-1] - found.energy[0]))

    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (orders > 3.5).all()
    assert errors[-1] < 1e-5 * kinetic_energy(arm, q, qd)


def test_position_converges_in_order_four() -> None:
    """Half the step leaves a sixteenth of the error of a swinging pendulum."""
    swinging = pendulum()
    exact = simulate(swinging, [0.3], duration=1.0, integrator=Adaptive(rtol=1e-12, atol=1e-13), period=0.1).q
    errors = [
        np.abs(simulate(swinging, [0.3], duration=1.0, integrator=Gill(length=length), period=0.1).q - exact).max()
        for length in (0.05, 0.025, 0.0125)
    ]

    np.testing.assert_allclose(np.log2(np.array(errors[:-1]) / errors[1:]), 4.0, atol=0.3)


@pytest.mark.parametrize("integrator", [COARSE, Adaptive()])
def test_block_slides_to_a_halt(integrator: object) -> None:
    """A block of 2 kg at 3 m/s against 5 N stops after m v / F = 1.2 s and m v² / 2F = 1.8 m, and stays."""
    found = simulate(block(coulomb_forward=5.0), [0.0], [3.0], duration=2.0, integrator=integrator, period=0.01)

    (stop,) = found.events
    assert stop.t == pytest.approx(1.2, abs=1e-10)
    assert (stop.before, stop.after) == (JointState.MOVES, JointState.STICKS)
    assert found.q[-1, 0] == pytest.approx(1.8, abs=1e-10)
    assert found.at_rest()
    assert len(np.unique(found.q[found.t > 1.2])) == 1
    assert found.heat[-1, 0] == pytest.approx(2.0 * 3.0**2 / 2)
    balanced(found)


def test_viscous_friction() -> None:
    """A block in oil slows down like exp(-b t / m)."""
    found = simulate(block(viscous=4.0), [0.0], [3.0], duration=1.0, integrator=Gill(length=4e-3), period=0.02)

    np.testing.assert_allclose(found.qd[:, 0], 3 * np.exp(-2 * found.t), rtol=1e-7)
    balanced(found)


def test_slope_sticks_or_slides() -> None:
    """Friction of 40 N holds 3 kg on an upright slide; 20 N let it go with the rest of its weight."""
    holds = simulate(lift(coulomb_backward=40.0), [1.0], duration=0.5, integrator=COARSE)
    slides = simulate(lift(coulomb_backward=20.0), [1.0], duration=0.5, integrator=COARSE)

    assert holds.at_rest()
    assert holds.q[-1, 0] == 1.0
    np.testing.assert_allclose(holds.hold, 3 * STANDARD_GRAVITY)
    assert slides.q[-1, 0] == pytest.approx(1 - (STANDARD_GRAVITY - 20 / 3) * 0.5**2 / 2)


@pytest.mark.parametrize("integrator", [COARSE, Adaptive()])
def test_push_that_grows_breaks_the_block_away(integrator: object) -> None:
    """Against 5 N, a push of 4 N/s moves nothing for 1.25 s; from then on speed grows with the square of time."""
    found = simulate(
        block(coulomb_forward=5.0),
        [0.0],
        duration=2.0,
        controller=lambda t, _q, _qd: [4.0 * t],
        integrator=integrator,
        period=0.01,
    )

    breaks = found.events[-1]
    assert breaks.t == pytest.approx(1.25, abs=1e-7)
    assert breaks.after == JointState.MOVES
    assert not found.q[found.t < 1.25].any()
    assert found.qd[-1, 0] == pytest.approx(4.0 * 0.75**2 / 2 / 2.0, abs=1e-7)
    balanced(found)


def test_spring_and_dry_friction() -> None:
    """On a spring each half swing is shorter by 2 F / k; at the first turn within F / k of the middle it ends.

    From 1 m with k = 50 N/m and F = 6 N the turns are at 1, -0.76, 0.52, -0.28 and 0.04 m, pi sqrt(m/k) apart.
    """
    load = block(coulomb_forward=6.0, coulomb_backward=6.0)
    spring = pd(load, standing([0.0]), kp=50.0, kd=0.0)

    found = simulate(load, [1.0], duration=4.0, controller=spring, integrator=Gill(length=2e-3), period=0.01)

    half = np.pi * np.sqrt(2.0 / 50.0)
    assert found.q[-1, 0] == pytest.approx(0.04, abs=1e-7)
    assert found.at_rest()
    assert [event.after for event in found.events] == [JointState.STICKS]
    assert found.events[-1].t == pytest.approx(4 * half, abs=1e-6)
    for k, turn in enumerate((1.0, -0.76, 0.52, -0.28)):
        during = (found.t > k * half) & (found.t < (k + 1) * half)
        swing = turn - np.sign(turn) * 0.12
        middle = np.sign(turn) * 0.12
        expected = middle + swing * np.cos(np.sqrt(25.0) * (found.t[during] - k * half))
        np.testing.assert_allclose(found.q[during, 0], expected, atol=1e-6)
    balanced(found)


@pytest.mark.parametrize("integrator", [COARSE, Adaptive()])
def test_fall_onto_a_stop(integrator: object) -> None:
    """A lift falls 1 m in sqrt(2 h / g), loses all its energy to the stop, and the stop then carries its weight."""
    found = simulate(lift(), [1.0], duration=0.8, integrator=integrator, period=0.01)

    (lands,) = found.events
    assert lands.t == pytest.approx(np.sqrt(2 / STANDARD_GRAVITY), abs=1e-9)
    assert lands.after == JointState.LOWER_STOP
    assert found.q[-1, 0] == 0.0
    assert found.impact[-1] == pytest.approx(3 * STANDARD_GRAVITY)
    assert found.hold[-1, 0] == pytest.approx(3 * STANDARD_GRAVITY)
    balanced(found)


def test_stop_lets_go() -> None:
    """A lift on its lower stop stays until the drive carries all of its weight, then rises to the upper one."""
    found = simulate(
        lift(), [0.0], duration=3.0, controller=lambda t, _q, _qd: [20.0 * t], integrator=COARSE, period=0.01
    )

    assert [event.after for event in found.events] == [
        JointState.LOWER_STOP,
        JointState.MOVES,
        JointState.UPPER_STOP,
    ]
    assert found.events[1].t == pytest.approx(3 * STANDARD_GRAVITY / 20)
    assert found.q[-1, 0] == 2.0
    assert found.hold[-1, 0] == pytest.approx(3 * STANDARD_GRAVITY - 60)
    balanced(found)


def test_impact_passes_through_the_arm() -> None:
    """An elbow that meets its stop turns the shoulder: the arm keeps its angular momentum and loses energy once."""
    arm = Arm(
        name="elbow",
        joints=[
            Joint(kind="revolute", a=0.5),
            Joint(kind="revolute", a=0.3, limits=Limits(lower=-1.0, upper=1.0)),
        ],
        links=[Link(mass=2.0), Link(mass=1.5)],
        gravity=(0.0, 0.0, 0.0),
    )
    found = simulate(arm, [0.0, 0.9], [0.0, 5.0], duration=0.1, period=1e-3)

    meets = next(event for event in found.events if event.after == JointState.UPPER_STOP)
    before, after = found.t < meets.t, found.t > meets.t
    momentum = (inverse_dynamics(arm, found.q, np.zeros_like(found.q), found.qd))[:, 0]
    np.testing.assert_allclose(momentum, momentum[0], rtol=1e-9)
    assert np.abs(found.qd[before][-1, 1]) > 1
    assert np.abs(found.qd[after][0, 1]) < 0.1
    assert np.ptp(found.kinetic[before]) < 1e-9
    assert np.ptp(found.kinetic[after]) < 1e-9
    assert found.impact[-1] == pytest.approx(found.kinetic[0] - found.kinetic[-1])
    assert found.impact[-1] > 0.1
    balanced(found)


def test_brake() -> None:
    """A brake stops the pendulum at once, holds its weight while it is on, and lets it go again."""
    found = simulate(pendulum(), [0.0], duration=0.5, brakes=[Brake(joint=0, start=0.2, end=0.4)])

    during = (found.t >= 0.2) & (found.t < 0.4)
    assert (found.state[during] == JointState.BRAKED).all()
    assert len(np.unique(found.q[during])) == 1
    np.testing.assert_allclose(found.hold[during, 0], gravity_efforts(pendulum(), found.q[during][0])[0])
    assert found.impact[-1] == pytest.approx(found.kinetic[found.t < 0.2][-1], rel=0.05)
    assert found.qd[-1, 0] < -1
    assert [event.t for event in found.events] == [0.2, 0.4]
    balanced(found)


def test_saturation() -> None:
    """A drive that may give 7 N gives 7 N, however much the controller asks; without saturation it gives all."""
    load = block()
    weak = attrs.evolve(load, joints=[attrs.evolve(load.joints[0], limits=Limits(effort=7.0))])

    def eager(_t: float, _q: np.ndarray, _qd: np.ndarray) -> list[float]:
        return [100.0]

    found = simulate(weak, [0.0], duration=0.3, controller=eager)
    unbounded = simulate(weak, [0.0], duration=0.3, controller=eager, saturation=False)

    assert found.qd[-1, 0] == pytest.approx(7.0 / 2 * 0.3)
    assert unbounded.qd[-1, 0] == pytest.approx(100.0 / 2 * 0.3)
    assert found.work[-1, 0] == pytest.approx(2.0 * found.qd[-1, 0] ** 2 / 2)


def test_puma_released() -> None:
    """A PUMA whose drives go off sinks: joints with less weight than friction stay, and it comes to rest.

    At the end every joint stands where dry friction or a stop can hold what gravity asks.
    """
    arm = load_arm("puma560")
    q = np.radians((0.0, 20.0, 40.0, 0.0, 20.0, 0.0))
    weight = gravity_efforts(arm, q)
    dry = np.array([motor.coulomb_forward for motor in arm.motors])
    stays = np.abs(weight) < dry
    assert stays.any()
    assert not stays.all()

    found = simulate(arm, q, duration=5.0, integrator=Adaptive(rtol=1e-6, atol=1e-8), period=0.02)

    lawful(arm, found)
    assert found.status is Status.FINISHED
    assert np.abs(found.energy_imbalance).max() < 1e-5 * found.heat.sum(axis=1).max()
    start = found.state[0]
    assert (start[np.abs(weight) > dry] == JointState.MOVES).all()
    assert found.at_rest()
    rest = gravity_efforts(arm, found.q[-1])
    np.testing.assert_allclose(found.hold[-1], rest, atol=1e-9)
    stuck = found.state[-1] == JointState.STICKS
    assert (np.abs(rest[stuck]) <= dry[stuck] + 1e-8).all()
    assert len(found.events) < 60


def test_puma_in_the_report_step() -> None:
    """The same PUMA in the report's fixed steps: nothing chatters, and the ledger balances."""
    arm = load_arm("puma560")

    found = simulate(arm, np.radians((0.0, -30.0, 30.0, 5.0, 20.0, 0.0)), duration=0.1)

    lawful(arm, found)
    balanced(found)
    assert len(found.events) < 12


def test_gravity_compensation_holds(rng: np.random.Generator) -> None:
    """An arm whose drives carry its weight stays where it is; pushed, it drifts without gaining energy of motion."""
    arm = free(load_arm("stanford-jpl"))
    q = rng.uniform(-1, 1, 6)
    controller = gravity_compensation(arm)

    still = simulate(arm, q, duration=0.2, controller=controller, integrator=COARSE, period=0.1)
    drifts = simulate(arm, q, np.full(6, 0.5), duration=0.2, controller=controller, integrator=COARSE, period=0.1)

    np.testing.assert_allclose(still.q, np.broadcast_to(q, still.q.shape), atol=1e-12)
    np.testing.assert_allclose(drifts.kinetic, drifts.kinetic[0], rtol=1e-6)
