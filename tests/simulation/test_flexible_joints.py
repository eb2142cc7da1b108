"""Arms on the springs of their gears, against equations by hand, another simulator, their modes and energy."""

from pathlib import Path

import attrs
import mujoco
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from armwright.arm.load import load_arm
from armwright.arm.model import Limits, Motor
from armwright.arrays import Array
from armwright.dynamics.flexible_joints import modes, with_gears
from armwright.errors import InvalidValueError, ShapeError, UnsupportedArmError
from armwright.simulation.controllers import pd, standing
from armwright.simulation.flexible_joints import simulate_flexible
from armwright.simulation.integrators import Adaptive
from armwright.simulation.result import Status
from cli_calls import armwright
from oracles.arms import coupled, random_arm

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

FILE = Path(__file__).parents[2] / "examples" / "two_link_springs.toml"
TWO_LINKS = load_arm(str(FILE))
FINE = Adaptive(rtol=1e-10, atol=1e-12)
K, D, B = np.array((6000.0, 2500.0)), np.array((3.0, 1.0)), np.array((0.8, 0.3))
START = np.array((0.2, 0.3))


def acceleration_by_hand(q: Array, qd: Array, effort: Array) -> Array:
    """Two rods of 8 and 5 kg, 0.5 and 0.4 m, that hang in the plane of x and y."""
    cosine, sine = np.cos(q[1]), np.sin(q[1])
    inner = 5 * 0.4**2 / 3
    side = inner + 5 * 0.5 * 0.2 * cosine
    M = np.array(((8 * 0.5**2 / 3 + 5 * 0.5**2 + 2 * side - inner, side), (side, inner)))
    swing = 5 * 0.5 * 0.2 * sine * np.array((-2 * qd[0] * qd[1] - qd[1] ** 2, qd[0] ** 2))
    far = 5 * 0.2 * 9.81 * np.cos(q.sum())
    weight = np.array(((8 * 0.25 + 5 * 0.5) * 9.81 * np.cos(q[0]) + far, far))
    return np.linalg.solve(M, effort - swing - weight)


def test_guided_by_hand() -> None:
    """With motors on a given course the links follow the equations of Spong's model."""

    def course(t: float, order: int) -> Array:
        angles = 0.3 * np.sin(9 * t) ** 2, 2.7 * np.sin(18 * t), 48.6 * np.cos(18 * t)
        return np.where(order == 0, START, 0) + angles[order]

    def slope(t: float, y: Array) -> Array:
        effort = K * (course(t, 0) - y[:2]) + D * (course(t, 1) - y[2:])
        return np.append(y[2:], acceleration_by_hand(y[:2], y[2:], effort))

    found = simulate_flexible(TWO_LINKS, START, duration=0.3, motors=course, integrator=FINE, period=0.05)

    expected = solve_ivp(slope, (0, 0.3), (*START, 0, 0), "DOP853", found.t, rtol=1e-12, atol=1e-13).y.T
    np.testing.assert_allclose(found.q, expected[:, :2], atol=1e-10)
    assert np.abs(found.energy_imbalance).max() < 1e-7


def test_driven_by_hand() -> None:
    """With efforts on the motors both sides of the gears follow the equations of Spong's model."""
    control = pd(TWO_LINKS, standing(START + 0.1), 900.0, 30.0)

    def slope(t: float, y: Array) -> Array:
        q, qd, theta, thetad = y.reshape(4, 2)
        effort = K * (theta - q) + D * (thetad - qd)
        push = np.clip(control(t, theta, thetad), -np.array((400, 200)), (400, 200))
        return np.concatenate([qd, acceleration_by_hand(q, qd, effort), thetad, (push - effort) / B])

    found = simulate_flexible(TWO_LINKS, START, duration=0.3, controller=control, integrator=FINE, period=0.05)

    expected = solve_ivp(slope, (0, 0.3), (*START, 0, 0, *START, 0, 0), "DOP853", found.t, rtol=1e-12, atol=1e-13).y.T
    np.testing.assert_allclose(np.hstack([found.q, found.motors]), expected[:, [0, 1, 4, 5]], atol=1e-9)
    assert np.abs(found.energy_imbalance).max() < 1e-7


def test_beside_mujoco() -> None:
    """Two hinges for a joint, one with the rotor and one with the spring, are a joint with a flexible gear."""
    bodies = ""
    for i, (mass, length, inertia) in enumerate(((8, 0.5, 1 / 6), (5, 0.4, 1 / 15))):
        bodies += f"""<body pos="{0.5 * i} 0 0">
            <joint axis="0 0 1" armature="{B[i]}"/><joint axis="0 0 1" stiffness="{K[i]}" damping="{D[i]}"/>
            <inertial pos="{length / 2} 0 0" mass="{mass}" diaginertia="{inertia} {inertia} {inertia}"/>"""
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><option timestep="2e-5" integrator="RK4" gravity="0 -9.81 0"/>
        <worldbody>{bodies}</body></body></worldbody></mujoco>"""
    )
    data = mujoco.MjData(model)
    data.qpos[[0, 2]] = START
    mujoco.mj_step(model, data, 5000)

    found = simulate_flexible(TWO_LINKS, START, duration=0.1, integrator=FINE, period=0.1)

    np.testing.assert_allclose(found.motors[-1], data.qpos[[0, 2]], atol=1e-7)
    np.testing.assert_allclose(found.q[-1], data.qpos[[0, 2]] + data.qpos[[1, 3]], atol=1e-7)


@pytest.mark.parametrize("mode", [0, 1])
def test_period_of_a_mode(mode: int) -> None:
    """An arm that swings a little in a mode is back after the period of the mode, without weight and damping."""
    arm = attrs.evolve(with_gears(TWO_LINKS, K), gravity=np.zeros(3))
    found = modes(arm, START)
    swing = 1e-6 * found.shapes[:, mode]
    period = 1 / float(found.frequencies[mode])

    end = simulate_flexible(
        arm, START + swing, duration=period, motors=standing(START), integrator=Adaptive(rtol=1e-11, atol=1e-15)
    )

    np.testing.assert_allclose(end.q[-1] - START, swing, rtol=1e-4, atol=1e-6 * np.abs(swing).max())
    # At the turning point the position says little of the period, and the speed all.
    speed = np.abs(end.qd[-1]).max() / (np.abs(swing).max() * 2 * np.pi / period)
    assert speed < 1e-6 * 2 * np.pi


def test_rigid_gears(rng: np.random.Generator) -> None:
    """The link of a rigid gear moves as its motor, in both kinds of drive, and the energy balances."""
    stiffness = np.array((np.inf, 4e4, np.inf, 1e4))
    arm = random_arm(rng, 4)
    unlimited = [attrs.evolve(joint, limits=Limits()) for joint in arm.joints]
    arm = attrs.evolve(arm, motors=[Motor(inertia=2.0, viscous=1.0)] * 4, joints=unlimited)
    arm = with_gears(arm, stiffness, 20.0)
    q = rng.uniform(-1, 1, 4)

    def course(t: float, order: int) -> Array:
        return np.where(order == 0, q, 0) + (0.1 * t**3, 0.3 * t**2, 0.6 * t)[order]

    for drive in ({"motors": course}, {}):
        found = simulate_flexible(arm, q, duration=0.1, period=0.05, **drive)

        assert found.status is Status.FINISHED
        np.testing.assert_array_equal(found.q[:, ::2], found.motors[:, ::2])
        assert np.abs(found.q[-1, 1::2] - found.motors[-1, 1::2]).max() > 1e-6
        assert np.abs(found.energy_imbalance).max() < 1e-6


def test_refused(rng: np.random.Generator) -> None:
    """What no smooth equation describes is refused by name."""
    rubs = with_gears(load_arm("puma560"), 1e5)
    with pytest.raises(UnsupportedArmError, match="joint 1 has dry friction"):
        simulate_flexible(rubs, np.zeros(6), duration=0.1)
    light = attrs.evolve(TWO_LINKS, motors=[attrs.evolve(motor, inertia=0.0) for motor in TWO_LINKS.motors])
    with pytest.raises(UnsupportedArmError, match="joint 1 has no inertia"):
        simulate_flexible(light, START, duration=0.1)
    with pytest.raises(UnsupportedArmError, match="coupled drives"):
        simulate_flexible(with_gears(coupled(random_arm(rng, 3), rng), 1e4), np.zeros(3), duration=0.1)
    with pytest.raises(InvalidValueError, match="neither efforts nor a start"):
        simulate_flexible(TWO_LINKS, START, duration=0.1, motors=standing(START), theta=START)
    with pytest.raises(ShapeError, match=r"motion of the motors at 0 s: expected shape \(2,\), got \(1,\)"):
        simulate_flexible(TWO_LINKS, START, duration=0.1, motors=standing(START[:1]))
    with pytest.raises(ShapeError, match=r"efforts of the controller at 0.\d+ s: expected shape \(2,\), got \(1,\)"):
        simulate_flexible(TWO_LINKS, START, duration=0.1, controller=lambda t, _q, _qd: np.zeros(2 if t < 0.05 else 1))
    with pytest.raises(InvalidValueError, match="shorter or the period longer"):
        simulate_flexible(TWO_LINKS, START, duration=1e9)
    with pytest.raises(InvalidValueError, match="leave such a gear rigid"):
        simulate_flexible(with_gears(TWO_LINKS, 1e12), START, duration=1.0)


def test_command(tmp_path: Path) -> None:
    """Held drives need flexible gears; links and motors have a table each."""
    done = armwright(
        "simulate", FILE, "-q", "57,69", "--duration", "0.05", "--flexible", "--drives", "held", "-o", "out",
        cwd=tmp_path,
    )  # fmt: skip
    refused = armwright("simulate", FILE, "-q", "57,69", "--drives", "held")

    assert {path.name for path in (tmp_path / "out").iterdir()} >= {"motion.csv", "motors.csv"}
    assert "largest deflection of the tool, mm" in done.stdout
    assert refused.returncode == 2
    assert "expected --flexible with them" in " ".join(refused.stderr.replace("│", " ").split())
