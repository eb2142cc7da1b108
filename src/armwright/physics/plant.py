"""An arm as bodies of a MuJoCo world, which move as its own equations say.

MuJoCo's compiler refuses what no body can be, such as a massless link or a published tensor of which not all moments
are known. Such bodies are compiled with more inertia, and get their own afterwards.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import attrs
import numpy as np
import numpy.typing as npt

from armwright.arm.drive import Motor
from armwright.arm.model import Arm, Joint, Link
from armwright.arrays import Array
from armwright.dynamics.arguments import weighed
from armwright.errors import UnsupportedArmError
from armwright.kinematics.forward_kinematics import link_poses
from armwright.mujoco_library import load_mujoco
from armwright.physics.cell_bodies import Body
from armwright.physics.geoms import add_geom, placement, principal_inertia, quaternion
from armwright.spatial.poses import inverse

# What MuJoCo's compiler takes as the least [kg], [kg m²].
_LEAST_MASS, _LEAST_MOMENT = 1e-6, 1e-6
# A configuration in which every arm shows that a joint moves nothing.
_BENT = 0.3
# A joint that moves less inertia than this part of the largest moves nothing.
_NOTHING = 1e-12


class Inertia(NamedTuple):
    """The inertia of a body as it is, and as MuJoCo's compiler takes it.

    Attributes:
        body: its name in the world.
        mass: [kg].
        moments: (3,) principal moments [kg m²].
        padded: (3,) moments that a body can have.
    """

    body: str
    mass: float
    moments: Array
    padded: Array

    @property
    def changed(self) -> bool:
        """Whether the compiler does not take it as it is."""
        return self.mass < _LEAST_MASS or not np.array_equal(self.moments, self.padded)


@attrs.frozen(kw_only=True, eq=False)
class PlantArm:
    """An arm in a world that has not been compiled yet.

    Attributes:
        name: before the names of all that is its.
        arm: the model.
        tool: the body of its tool, fixed to the last link.
        inertias: of its bodies.
    """

    name: str
    arm: Arm
    tool: Any
    inertias: tuple[Inertia, ...]

    def restore_inertia(self, model: Any) -> None:
        """Give the bodies of a compiled world the inertia that they have; ``finish`` must be called once after it."""
        for inertia in self.inertias:
            number = model.body(inertia.body).id
            model.body_mass[number], model.body_inertia[number] = inertia.mass, inertia.moments


class ArmIndices(NamedTuple):
    """Where the numbers of an arm stand in the arrays of a compiled world, (n,) each."""

    positions: npt.NDArray[np.intp]
    speeds: npt.NDArray[np.intp]
    motors: npt.NDArray[np.intp]


def new_world(gravity: Array, timestep: float) -> Any:
    """Return a specification with the settings under which held parts do not creep.

    Args:
        gravity: (3,) [m/s²].
        timestep: [s].
    """
    mujoco = load_mujoco()
    spec = mujoco.MjSpec()
    # Angles of joints are given in radians.
    spec.compiler.degree = False
    option = spec.option
    option.timestep, option.gravity = timestep, gravity
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.cone, option.impratio, option.noslip_iterations = mujoco.mjtCone.mjCONE_ELLIPTIC, 10.0, 5
    option.solver, option.iterations, option.tolerance = mujoco.mjtSolver.mjSOL_NEWTON, 50, 1e-10
    return spec


def finish(spec: Any, arms: tuple[PlantArm, ...]) -> Any:
    """Compile a world and give its arms the inertia that they have."""
    mujoco = load_mujoco()
    model = spec.compile()
    if arms:
        for arm in arms:
            arm.restore_inertia(model)
        mujoco.mj_setConst(model, mujoco.MjData(model))
    return model


def add_arm(spec: Any, name: str, arm: Arm, base: Array, bodies: Iterable[Body] = (), **geoms: Any) -> PlantArm:
    """Add an arm to a world: bodies ``NAME/link1``, joints ``NAME/joint1``, motors ``NAME/motor1``, body ``NAME/tool``.

    Args:
        spec: of the world.
        name: of the arm.
        arm: the model, with n joints.
        base: (4, 4) pose of its base frame in the world.
        bodies: its solids; none without.
        geoms: options of their geoms.

    Raises:
        UnsupportedArmError: masses are unknown, or a joint moves nothing that has any; the link is named.
    """
    mujoco = load_mujoco()
    refuse_massless(weighed(arm))
    # Frames 0 to n and the tool, at zero positions, in the base frame.
    frames = link_poses(arm, np.zeros(arm.n))
    body = spec.worldbody.add_body(name=f"{name}/base", **placement(base))
    links = [body]
    behind, inertias = np.eye(4), []
    for i, (joint, link, motor) in enumerate(zip(arm.joints, arm.links, arm.motors, strict=True), 1):
        body = body.add_body(name=f"{name}/link{i}", **placement(inverse(behind) @ frames[i]))
        inertias.append(_set_inertia(body, link))
        _add_joint(body, f"{name}/joint{i}", joint, motor, inverse(frames[i]) @ frames[i - 1])
        motor_of_joint = spec.add_actuator(
            name=f"{name}/motor{i}", target=f"{name}/joint{i}", trntype=mujoco.mjtTrn.mjTRN_JOINT
        )
        motor_of_joint.set_to_motor()
        if np.isfinite(joint.limits.effort):
            motor_of_joint.forcelimited = mujoco.mjtLimited.mjLIMITED_TRUE
            motor_of_joint.forcerange = (-joint.limits.effort, joint.limits.effort)
        links.append(body)
        behind = frames[i]
    tool = body.add_body(name=f"{name}/tool", **placement(inverse(behind) @ frames[arm.n + 1]))
    tool.add_site(name=f"{name}/tool")
    for number, it in enumerate(bodies, 1):
        # What is fixed to the base is told in frame 0 of the table. The links have their inertia already.
        solid = it.solid if it.link else it.solid.moved(arm.base)
        label = f"link{it.link}" if it.link else "base"
        add_geom(spec, links[it.link], f"{name}/{label}/solid{number}", solid, mass=0.0, **geoms)
    return PlantArm(name=name, arm=arm, tool=tool, inertias=tuple(inertias))


def _set_inertia(body: Any, link: Link) -> Inertia:
    """Give a body the inertia of a link, or one that the compiler takes."""
    moments, axes = principal_inertia(link.inertia)
    padded = np.maximum(moments, _LEAST_MOMENT if moments.min() <= 0 else 0.0)
    lacking = padded[2] - padded[0] - padded[1]
    if lacking > 0:
        # A little more than the triangle inequality asks for, so that rounding does not break it.
        padded[:2] += lacking / 2 * (1 + 1e-9) + 1e-12
    body.explicitinertial, body.mass, body.ipos = True, max(link.mass, _LEAST_MASS), link.com
    body.iquat, body.inertia = quaternion(axes), padded
    return Inertia(body.name, link.mass, moments, padded)


def _add_joint(body: Any, name: str, joint: Joint, motor: Motor, before: Array) -> None:
    """Add the joint before a link.

    Args:
        body: of the link.
        name: of the joint.
        joint: the joint.
        motor: its drive.
        before: (4, 4) frame i-1 seen from the link's frame at zero position: the joint is about or along its z.
    """
    mujoco = load_mujoco()
    kinds, limits = mujoco.mjtJoint, joint.limits
    added = body.add_joint(
        name=name,
        type=kinds.mjJNT_HINGE if joint.revolute else kinds.mjJNT_SLIDE,
        axis=before[:3, 2],
        pos=before[:3, 3] if joint.revolute else np.zeros(3),
        armature=motor.inertia,
        damping=[motor.viscous, 0.0, 0.0],
        # The part that both directions share; ``friction`` has the rest.
        frictionloss=(motor.coulomb_forward + motor.coulomb_backward) / 2,
    )
    if joint.spring.stiffness:
        added.stiffness, added.springref = [joint.spring.stiffness, 0.0, 0.0], joint.spring.rest
    if np.isfinite((limits.lower, limits.upper)).all():
        added.limited, added.range = mujoco.mjtLimited.mjLIMITED_TRUE, (limits.lower, limits.upper)


def arm_indices(model: Any, name: str, n: int) -> ArmIndices:
    """Return where the n joints of an arm stand in a compiled world."""
    joints = [model.joint(f"{name}/joint{i}") for i in range(1, n + 1)]
    return ArmIndices(
        positions=np.array([joint.qposadr[0] for joint in joints], dtype=np.intp),
        speeds=np.array([joint.dofadr[0] for joint in joints], dtype=np.intp),
        motors=np.array([model.actuator(f"{name}/motor{i}").id for i in range(1, n + 1)], dtype=np.intp),
    )


def refuse_massless(arm: Arm) -> None:
    """Refuse an arm with a joint that moves nothing: any effort would accelerate it without bound.

    Raises:
        UnsupportedArmError: there is one; its link is named.
    """
    from armwright.dynamics.inertia_matrix import mass_matrix  # noqa: PLC0415 - of worlds only

    moved = np.linalg.eigvalsh(mass_matrix(arm, np.full(arm.n, _BENT)))
    if moved[0] > _NOTHING * max(float(moved[-1]), np.finfo(float).tiny):
        return
    empty = [
        i for i, (link, motor) in enumerate(zip(arm.links, arm.motors, strict=True)) if not link.mass + motor.inertia
    ]
    number = max(empty, default=arm.n - 1)
    name = f" ('{arm.links[number].name}')" if arm.links[number].name else ""
    raise UnsupportedArmError(
        f"arm '{arm.name}': no physics, for joint {number + 1} moves no mass: specify mass and inertia of link "
        f"{number + 1}{name}, or the inertia of its motor"
    )
