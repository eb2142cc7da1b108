"""Arms that yield under their weight: closed forms, and equilibria of MuJoCo with three spring hinges per joint."""

import mujoco
import numpy as np
import pytest
from scipy.optimize import root
from scipy.spatial.transform import Rotation

from armwright.arm.load import load_arm
from armwright.arm.model import Arm, Joint, Link
from armwright.arrays import Array
from armwright.dynamics import joint_loads, static_deflection
from armwright.dynamics.shares import gravity_efforts
from armwright.errors import InvalidValueError, ShapeError
from armwright.kinematics.forward_kinematics import forward

GRAVITY = 9.80665


def beam(joints: int) -> Arm:
    """Return a chain of massless beams of 1 m about horizontal axes, stretched along x."""
    sideways = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
    return Arm(name="beam", joints=[Joint(kind="revolute", a=1.0)] * joints, links=[Link()] * joints, base=sideways)


@pytest.mark.parametrize("joints", [1, 2])
def test_cantilever(joints: int) -> None:
    """A load at the end of stretched beams on springs sinks by the sum of squared levers; small loads, first order."""
    k, mass = np.array([2e5, 7e4])[:joints], 0.1
    compliance = np.zeros((joints, 3))
    compliance[:, 2] = 1 / k
    levers = np.arange(joints, 0, -1.0)

    found = static_deflection(beam(joints), compliance, np.zeros(joints), payload=(mass, 0, 0, 0))

    sinks = mass * GRAVITY * levers**2 / k
    assert found.displacement[0, 2] == pytest.approx(-sinks.sum(), rel=1e-8)
    np.testing.assert_allclose(found.shares[0], sinks, rtol=1e-4)
    np.testing.assert_allclose(found.loads[0, :, 2], -mass * GRAVITY * levers, rtol=1e-8)


def test_one_heavy_beam() -> None:
    """A beam that sinks far rests where k phi = m g cos(phi), which no first order gives."""
    found = static_deflection(beam(1), [[0, 0, 1e-3]], [0.0], payload=(20.0, 0, 0, 0))
    phi = -found.joints[0, 0, 2]
    assert phi == pytest.approx(1e-3 * 20 * GRAVITY * np.cos(phi), rel=1e-11)
    assert phi > 0.19


def test_a_lateral_force_bends_sideways() -> None:
    """A force along the axis of the joint bends the beam about its second lateral axis; a torsion about the first."""
    found = static_deflection(beam(1), [[2e-5, 1e-5, 0]], [0.0], wrench=(0, 30.0, 0, 5.0, 0, 0))
    np.testing.assert_allclose(found.joints[0, 0], [1e-4, 3e-4, 0], rtol=1e-6)
    np.testing.assert_allclose(found.displacement[0], [0, 3e-4, 0], atol=1e-7)


def test_loads_hold_the_arm(rng: np.random.Generator) -> None:
    """About the axis of a joint, the load is the opposite of the effort that holds it, springs included."""
    for name in ("puma560", "stanford-jpl"):
        arm = load_arm(name)
        q = rng.uniform(-1, 1, (5, arm.n))
        np.testing.assert_allclose(joint_loads(arm, q)[:, :, 2], -gravity_efforts(arm, q), atol=1e-10)


def test_rest_of_mujoco(rng: np.random.Generator) -> None:
    """Random arms on three springs per joint rest where MuJoCo, with a hinge for each, has no force left over."""
    for slides in (False, True):
        arm, compliance, q = _random_arm(rng, slides=slides)
        wrench, load = rng.uniform(-30, 30, 6), np.array([2.0, *rng.uniform(-0.2, 0.2, 3)])

        found = static_deflection(arm, compliance, q, payload=load, wrench=wrench)

        joints, tool = _rest(arm, compliance, q, load, wrench)
        assert np.abs(found.joints).max() > 3e-3
        np.testing.assert_allclose(found.joints[0], joints, atol=1e-10)
        np.testing.assert_allclose(found.tool[0, :3, 3], tool, atol=1e-10)
        off = np.linalg.norm(found.displacement[0])
        assert found.shares[0].sum() == pytest.approx(off, rel=0.05)
        np.testing.assert_allclose(found.tool[0, :3, 3] - found.displacement[0], forward(arm, q)[:3, 3], atol=1e-12)


@pytest.mark.parametrize(
    ("change", "error", "said"),
    [
        ({"compliance": -np.ones((6, 3))}, InvalidValueError, "compliance: expected numbers of 0 or more, got -1"),
        ({"compliance": np.ones(6)}, ShapeError, r"compliance: expected a shape ending in \(6, 3\), got \(6,\)"),
        ({"compliance": np.ones((6, 3))}, InvalidValueError, "yields by more than 0.5 rad or m: is its stiffness in"),
        ({"payload": (-1, 0, 0, 0)}, InvalidValueError, "payload: expected a mass of 0 kg or more, got -1"),
        ({"wrench": np.ones(5)}, ShapeError, r"wrench: expected shape \(6,\) or \(1, 6\), got \(5,\)"),
    ],
)
def test_refused(change: dict[str, Array], error: type[Exception], said: str) -> None:
    """What no arm has is refused."""
    values = {"compliance": np.zeros((6, 3)), "q": np.zeros(6), **change}
    with pytest.raises(error, match=said):
        static_deflection(load_arm("puma560"), **values)


def _random_arm(rng: np.random.Generator, *, slides: bool) -> tuple[Arm, Array, Array]:
    n = 4
    kinds = ["prismatic" if slides and i == 1 else "revolute" for i in range(n)]
    numbers = rng.uniform(-0.4, 0.4, (n, 4))
    joints = [
        Joint(kind=kind, theta=theta, d=d, a=a, alpha=4 * alpha)
        for kind, (theta, d, a, alpha) in zip(kinds, numbers, strict=True)
    ]
    links = [Link(mass=rng.uniform(1, 6), com=rng.uniform(-0.2, 0.2, 3), inertia=0.05 * np.eye(3)) for _ in kinds]
    tool = np.eye(4)
    tool[:3, 3] = rng.uniform(-0.2, 0.2, 3)
    arm = Arm(name="random", joints=joints, links=links, gravity=rng.uniform(-6, 6, 3), tool=tool)
    return arm, rng.uniform(0.5e-4, 3e-4, (n, 3)), rng.uniform(-1, 1, n)


def _rest(arm: Arm, compliance: Array, q: Array, load: Array, wrench: Array) -> tuple[Array, Array]:
    """Return how far the joints (n, 3) of an arm yield in MuJoCo, and where its tool (3,) comes to rest."""
    spec = mujoco.MjSpec()
    spec.option.gravity = arm.gravity
    body, X = spec.worldbody, arm.base
    for i, (joint, link) in enumerate(zip(arm.joints, arm.links, strict=True)):
        turn, slide = joint.theta + joint.revolute * q[i], joint.d + (not joint.revolute) * q[i]
        Z, T = np.eye(4), np.eye(4)
        Z[:2, :2] = [[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]
        T[2, 3] = slide
        before, behind = (np.eye(4), Z @ T @ joint.behind) if joint.revolute else (Z, T @ joint.behind)
        X = X @ before
        body = body.add_body(pos=X[:3, 3], quat=_quaternion(X))
        for axis in range(3):
            along = axis == 2 and not joint.revolute
            kind = mujoco.mjtJoint.mjJNT_SLIDE if along else mujoco.mjtJoint.mjJNT_HINGE
            spring = body.add_joint(type=kind, axis=np.eye(3)[axis])
            spring.stiffness = 1 / compliance[i, axis] * np.eye(1, np.size(spring.stiffness))[0]
        body.mass, body.ipos = link.mass, behind[:3, :3] @ link.com + behind[:3, 3]
        body.inertia, body.explicitinertial = (0.05, 0.05, 0.05), True
        X = behind
    tool = X @ arm.tool
    held = body.add_body(pos=tool[:3, 3], quat=_quaternion(tool), mass=load[0], ipos=load[1:])
    held.inertia, held.explicitinertial = (1e-3, 1e-3, 1e-3), True
    model = spec.compile()
    data = mujoco.MjData(model)

    def left_over(yielded: Array) -> Array:
        data.qpos[:], data.qvel[:], data.qfrc_applied[:] = yielded, 0, 0
        mujoco.mj_forward(model, data)
        mujoco.mj_applyFT(model, data, wrench[:3], wrench[3:], data.xpos[-1], model.nbody - 1, data.qfrc_applied)
        return np.asarray(data.qfrc_passive - data.qfrc_bias + data.qfrc_applied)

    solution = root(left_over, np.zeros(model.nv), tol=1e-14)
    left_over(solution.x)
    return solution.x.reshape(-1, 3), data.xpos[-1].copy()


def _quaternion(X: Array) -> Array:
    return np.roll(Rotation.from_matrix(X[:3, :3]).as_quat(), 1)
