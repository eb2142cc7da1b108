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

from armwright.arm.coupling import Coupling
from armwright.arm.drive import Motor
from armwright.arm.losses import mean_dry_friction
from armwright.arm.mjcf.drives import NO_LIMIT
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
    """Where the numbers of an arm stand in the arrays of a compiled world, (n,) each.

    Attributes:
        positions: of the joints.
        speeds: of the joints.
        motors: of the drives.
        tendons: of the drives; -1 of one that moves as its joint does.
    """

    positions: npt.NDArray[np.intp]
    speeds: npt.NDArray[np.intp]
    motors: npt.NDArray[np.intp]
    tendons: npt.NDArray[np.intp]


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

    A drive that does not move as a joint does is a tendon ``NAME/drive1`` of the joints: its length is the position of
    the drive. The motor pulls there, and there are inertia, friction and limits of the drive.

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
    behind, inertias, at_joints = np.eye(4), [], drives_at_joints(arm)
    for i, (joint, link, motor) in enumerate(zip(arm.joints, arm.links, arm.motors, strict=True), 1):
        body = body.add_body(name=f"{name}/link{i}", **placement(inverse(behind) @ frames[i]))
        inertias.append(_set_inertia(body, link))
        own = motor if i - 1 in at_joints else Motor()
        added = _add_joint(body, f"{name}/joint{i}", joint, own, inverse(frames[i]) @ frames[i - 1])
        if arm.coupling is None:
            _add_motor(spec, f"{name}/motor{i}", added, joint.limits.effort)
        elif np.isfinite(joint.limits.effort):
            added.actfrclimited = mujoco.mjtLimited.mjLIMITED_TRUE
            added.actfrcrange = (-joint.limits.effort, joint.limits.effort)
        links.append(body)
        behind = frames[i]
    if arm.coupling is not None:
        _add_drives(spec, name, arm, arm.coupling)
    tool = body.add_body(name=f"{name}/tool", **placement(inverse(behind) @ frames[arm.n + 1]))
    tool.add_site(name=f"{name}/tool")
    for number, it in enumerate(bodies, 1):
        # What is fixed to the base is told in frame 0 of the table. The links have their inertia already.
        solid = it.solid if it.link else it.solid.moved(arm.base)
        label = f"link{it.link}" if it.link else "base"
        add_geom(spec, links[it.link], f"{name}/{label}/solid{number}", solid, mass=0.0, **geoms)
    return PlantArm(name=name, arm=arm, tool=tool, inertias=tuple(inertias))


def drives_at_joints(arm: Arm) -> frozenset[int]:
    """Return the drives, from 0, that move as their joints do."""
    if arm.coupling is None:
        return frozenset(range(arm.n))
    return frozenset(np.flatnonzero((arm.coupling.inverse == np.eye(arm.n)).all(axis=1)).tolist())


def _add_drives(spec: Any, name: str, arm: Arm, coupling: Coupling) -> None:
    """Add the motors of coupled drives, and a tendon for each drive that needs one."""
    mujoco = load_mujoco()
    at_joints, own = drives_at_joints(arm), coupling.drive_limits
    for i, (motor, weights) in enumerate(zip(arm.motors, coupling.inverse, strict=True)):
        pulled, ends = spec.joint(f"{name}/joint{i + 1}"), np.array((own.lower[i], own.upper[i]))
        if i not in at_joints or np.isfinite(ends).any():
            tendon = spec.add_tendon(name=f"{name}/drive{i + 1}")
            for j in np.flatnonzero(weights).tolist():
                tendon.wrap_joint(f"{name}/joint{j + 1}", float(weights[j]))
            if i not in at_joints:
                pulled, tendon.armature = tendon, motor.inertia
                tendon.damping, tendon.frictionloss = [motor.viscous, 0.0, 0.0], mean_dry_friction(motor)
            if np.isfinite(ends).any():
                tendon.limited, tendon.range = mujoco.mjtLimited.mjLIMITED_TRUE, np.clip(ends, -NO_LIMIT, NO_LIMIT)
        _add_motor(spec, f"{name}/motor{i + 1}", pulled, float(own.effort[i]))


def _add_motor(spec: Any, name: str, pulled: Any, effort: float) -> None:
    """Add the motor of a joint or a tendon, with its largest effort."""
    mujoco = load_mujoco()
    kinds = mujoco.mjtTrn
    kind = kinds.mjTRN_JOINT if isinstance(pulled, mujoco.MjsJoint) else kinds.mjTRN_TENDON
    motor = spec.add_actuator(name=name, target=pulled.name, trntype=kind)
    motor.set_to_motor()
    if np.isfinite(effort):
        motor.forcelimited, motor.forcerange = mujoco.mjtLimited.mjLIMITED_TRUE, (-effort, effort)


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


def _add_joint(body: Any, name: str, joint: Joint, motor: Motor, before: Array) -> Any:
    """Add the joint before a link, and return it.

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
        frictionloss=mean_dry_friction(motor),
    )
    if joint.spring.stiffness:
        added.stiffness, added.springref = [joint.spring.stiffness, 0.0, 0.0], joint.spring.rest
    if np.isfinite((limits.lower, limits.upper)).all():
        added.limited, added.range = mujoco.mjtLimited.mjLIMITED_TRUE, (limits.lower, limits.upper)
    return added


def arm_indices(model: Any, name: str, n: int) -> ArmIndices:
    """Return where the n joints of an arm stand in a compiled world."""
    joints = [model.joint(f"{name}/joint{i}") for i in range(1, n + 1)]
    motors = [model.actuator(f"{name}/motor{i}") for i in range(1, n + 1)]
    pulls = [motor.trntype[0] == load_mujoco().mjtTrn.mjTRN_TENDON for motor in motors]
    return ArmIndices(
        positions=np.array([joint.qposadr[0] for joint in joints], dtype=np.intp),
        speeds=np.array([joint.dofadr[0] for joint in joints], dtype=np.intp),
        motors=np.array([motor.id for motor in motors], dtype=np.intp),
        tendons=np.array([m.trnid[0] if p else -1 for m, p in zip(motors, pulls, strict=True)], dtype=np.intp),
    )


def refuse_massless(arm: Arm) -> None:
    """Refuse an arm with a joint that moves nothing: any effort would accelerate it without bound.

    Raises:
        UnsupportedArmError: there is one; its link is named.
    """
    from armwright.dynamics.inertia_matrix import massless_joint  # noqa: PLC0415 - of worlds only

    number = massless_joint(arm)
    if number is None:
        return
    name = f" ('{arm.links[number].name}')" if arm.links[number].name else ""
    raise UnsupportedArmError(
        f"arm '{arm.name}': no physics, for joint {number + 1} moves no mass: specify mass and inertia of link "
        f"{number + 1}{name}, or the inertia of its motor"
    )
