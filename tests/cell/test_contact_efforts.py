"""What a plane pushes back with is in the efforts: of every tick, of the peaks, of the warnings; Pinocchio agrees."""

import attrs
import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from armwright.arm.load import load_arm
from armwright.arm.model import UPRIGHT_GRAVITY, Arm
from armwright.arrays import Array
from armwright.cell.model import Cell, CellArm, ContactPlane
from armwright.cell.simulator import Simulator
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.kinematics.forward_kinematics import forward
from armwright.program import Source, compile as compile_program, known_cell
from armwright.program.vm.interpreter import interpret, motion_warnings as warnings_of
from armwright.program.vm.recording import Recording
from armwright.spatial.poses import homogeneous
from oracles.with_pinocchio import pinocchio_model, with_rotors

AGREES = 1e-8  # [N m], of efforts up to some hundred
STIFFNESS = 20_000.0
# The part sticks out beside the hand, so that the plane turns the hand as well as it pushes it.
PART = homogeneous(np.eye(3), (0.03, -0.02, 0.05))
TILTED = homogeneous(Rotation.from_rotvec((0.2, -0.15, 0.7)).as_matrix(), (0.1, -0.2, 0.3))
DOWN = """
VAR part, low : FRAME ;
BEGIN
  AFFIX part TO ARM_1 AT XYZ(0.03, -0.02, 0.05) ;
  low = part * TRANS_OR_XYZ ;
  MOVE part TO low STRAIGHTLY, WITH SPEED = 20, ON FORCE(Z) > 25 DO HALT ;
  PAUSE 0.05 ;
  REST
END.
"""


def pressing(arm: Arm, rest: str = "") -> tuple[Recording, Cell]:
    """A PUMA on a tilted base comes down with a part on a plane 20 mm below it, and stops by its guard."""
    start = np.array((0.2, -0.6, 0.7, 0.1, 0.9, 0.2))
    tip = TILTED @ forward(arm, start) @ PART
    cell = Cell(
        name="bench",
        arms={"ARM_1": CellArm(arm=arm, base=TILTED, start=start)},
        contact=ContactPlane(height=float(tip[2, 3]) - 0.02, stiffness=STIFFNESS),
    )
    x, y, z = (tip[:3, :3].T @ (0.0, 0.0, -0.06)).tolist()
    text = DOWN.replace("TRANS_OR_XYZ", f"XYZ({x:.9f}, {y:.9f}, {z:.9f})").replace("REST", rest)
    compiled = compile_program(Source("t.rlo", text), known_cell(cell))
    assert compiled.code is not None, compiled.diagnostics
    return interpret(compiled.code, cell, Simulator(cell)), cell


def pushes(recording: Recording, cell: Cell) -> Array:
    """The force of the plane on every tick, upwards, by how deep the part is in it [N]."""
    (stream,) = recording.streams
    heights = (TILTED @ forward(cell.arms["ARM_1"].arm, stream.q) @ PART)[:, 2, 3]
    assert cell.contact.height is not None
    return STIFFNESS * np.maximum(cell.contact.height - heights, 0.0)


def by_pinocchio(arm: Arm, recording: Recording, force: Array, k: int) -> Array:
    """The efforts of one tick: those of the motion less JᵀF of the force on the part."""
    (stream,) = recording.streams
    model, _, tool = pinocchio_model(attrs.evolve(arm, base=TILTED @ arm.base, gravity=UPRIGHT_GRAVITY))
    model, data = with_rotors(model, arm)
    parent = model.frames[tool].parentJoint
    part = model.addFrame(
        pin.Frame("part", parent, model.frames[tool].placement * pin.SE3(PART), pin.FrameType.OP_FRAME)
    )
    data = model.createData()
    tau = pin.rnea(model, data, stream.q[k], stream.qd[k], stream.qdd[k])
    J = pin.computeFrameJacobian(model, data, stream.q[k], part, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
    return np.asarray(tau - J[:3].T @ (0.0, 0.0, force[k]))


def dry(arm: Arm, q: Array, qd: Array) -> Array:
    """What the drives take besides the inertia of their rotors."""
    still = np.zeros_like(q)
    return inverse_dynamics(arm, q, qd, still) - inverse_dynamics(arm, q, qd, still, drives=False)


def test_every_tick_as_pinocchio_has_it() -> None:
    """On the way in, while it brakes and while it stands pressed, motors bear the plane; in the air they do not."""
    arm = load_arm("puma560")
    recording, cell = pressing(arm)
    (stream,) = recording.streams
    mine, force = cell.arms["ARM_1"].arm, pushes(recording, cell)
    assert force.max() > 25
    assert (stream.qd[-1] == 0).all()  # it stands pressed at the end
    assert force[-1] > 25

    inside = np.flatnonzero(force > 0)
    for k in (*range(0, len(force), 97), *inside[::11].tolist(), len(force) - 1):
        expected = by_pinocchio(arm, recording, force, k) + dry(mine, stream.q[k], stream.qd[k])
        np.testing.assert_allclose(stream.tau[k], expected, atol=AGREES)


def test_peaks_and_warning() -> None:
    """The largest efforts of a stage have the plane in them, and so has the warning."""
    arm = load_arm("puma560")
    recording, cell = pressing(arm)
    (stream,), (stage,) = recording.streams, recording.stages
    during = slice(round(stage.t0 / cell.period), round(stage.t1 / cell.period) + 1)
    found = np.abs(stream.tau[during])

    np.testing.assert_allclose(stage.peak_effort, found.max(axis=0), atol=AGREES)
    np.testing.assert_allclose(stage.peak_time, found.argmax(axis=0) * cell.period, atol=1e-9)

    # A motor that can do all but bear the plane.
    free = np.abs(inverse_dynamics(cell.arms["ARM_1"].arm, stream.q, stream.qd, stream.qdd)).max(axis=0)
    joint = int((stage.peak_effort - free).argmax())
    between = float((stage.peak_effort[joint] + free[joint]) / 2)
    joints = [
        attrs.evolve(j, limits=attrs.evolve(j.limits, effort=between)) if i == joint else j
        for i, j in enumerate(arm.joints)
    ]
    weak, _ = pressing(attrs.evolve(arm, joints=joints))
    messages = [one.message for one in warnings_of(weak.stages, weak.cell) if one.code == "W401"]
    assert len(messages) == 1
    assert f"would need {stage.peak_effort[joint]:.1f} N m" in messages[0]


def test_let_go_it_does_not_push() -> None:
    """From the tick at which the fingers open the motors bear the arm alone."""
    recording, cell = pressing(load_arm("puma560"), "OPEN ARM_1 ; PAUSE 0.05 ;")
    (stream,) = recording.streams
    (opened,) = (one for one in recording.effects if one.kind == "OPEN")
    tick = round(opened.t0 / cell.period)
    arm = cell.arms["ARM_1"].arm
    alone = inverse_dynamics(arm, stream.q[tick:], stream.qd[tick:], stream.qdd[tick:])

    np.testing.assert_allclose(stream.tau[tick:], alone, atol=AGREES)
    assert np.abs(stream.tau[tick - 1] - alone[0]).max() > 1


@pytest.mark.parametrize("share", [0.0, 0.5])
def test_the_wrench_at_the_tool(share: float) -> None:
    """From some tick on, the wrenches are those of that tick on, and the last one stays."""
    arm = load_arm("puma560")
    recording, cell = pressing(arm)
    (stage,) = recording.stages
    hardware = Simulator(cell)
    hardware.start_motion("ARM_1", stage.motion, 0.0, PART)
    whole = hardware.tool_wrenches("ARM_1", 0.0)
    tick = round(share * (len(whole) - 1))

    np.testing.assert_allclose(hardware.tool_wrenches("ARM_1", tick * cell.period), whole[tick:], atol=AGREES)
    np.testing.assert_allclose(hardware.tool_wrenches("ARM_1", 1e3), whole[-1:], atol=AGREES)
    up = TILTED[:3, :3].T @ (0.0, 0.0, 1.0)
    np.testing.assert_allclose(np.cross(whole[-1, :3], up), 0.0, atol=AGREES)
    assert hardware.contact_wrench("ARM_1", 1e3)[2] == pytest.approx(float(whole[-1, :3] @ up))
