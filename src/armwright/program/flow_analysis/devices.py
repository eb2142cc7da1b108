"""OPEN, GRASP, OPERATE, READ and ZERO FORCE: grippers, devices and sensors."""

from armwright.errors import closest
from armwright.program.flow_analysis.context import Steps, of_state
from armwright.program.flow_analysis.definite_assignment import require_indices, require_value
from armwright.program.flow_analysis.facts import UNKNOWN
from armwright.program.flow_analysis.frames import set_pose
from armwright.program.flow_analysis.state import LAST, FlowState
from armwright.program.language.diagnostic import did_you_mean, labels
from armwright.program.language.names import is_arm
from armwright.program.language.words import Standard
from armwright.program.semantics.cell_symbols import WORLD
from armwright.program.semantics.expression_types import expression_text
from armwright.program.syntax import tree

# ---- the gripper -----------------------------------------------------------------------------------------------------


def open_(state: FlowState, node: tree.Open) -> None:
    """Open the fingers of an arm."""
    require_value(state, node.width)
    if isinstance(node.arm, tree.ArmName):
        state.note_arms(node.arm)
        state.note_arm_use(node.arm.key, node.span.to(node.arm.span))
        state.table.open(node.arm.key, node.span)


def grasp(state: FlowState, node: tree.Grasp) -> None:
    """Close the fingers of an arm: the one that was used last where none is named."""
    state.note_arms(node.arm)
    arm = node.arm.key if isinstance(node.arm, tree.ArmName) else state.last[LAST]
    if node.arm is not None and not isinstance(node.arm, tree.ArmName):
        return
    if arm is None:
        advice = f"write `GRASP {state.some_arm()}`"
        if state.symbols.std is Standard.RLO_83:
            advice = f"name an arm before, as in `OPEN {state.some_arm()}`"
        text = "GRASP names no arm, and no arm has been used before"
        state.report("E307", text, node.span, "which arm?", advice=advice)
        return
    state.record(node, None if arm == UNKNOWN else arm)
    if arm == UNKNOWN:
        state.forget_arms(grasps=True)
        return
    state.note_arm_use(arm, node.span)
    _note_closed_on_arrival(state, arm)
    state.table.close(arm, node.span)


def _note_closed_on_arrival(state: FlowState, arm: str) -> None:
    """Note a gripper that arrives at its object with closed fingers."""
    gripper = state.table.grippers[arm]
    opened_late = gripper.arrived_open is None and gripper.opened is not None
    never_opened = gripper.arrived_open is False and gripper.opened is None
    if gripper.arrival is None or gripper.at is None or not (opened_late or never_opened):
        return
    text = f"{arm} {'may come' if opened_late else 'comes'} to `{state.name(gripper.at)}` with closed fingers"
    here, advice = labels(gripper.opened, "they open here"), f"write `OPEN {arm}` before this MOVE"
    state.report("L301", text, gripper.arrival, "it arrives here", secondary=here, advice=advice)


# ---- tools and sensors -----------------------------------------------------------------------------------------------


def read_system(state: FlowState, node: tree.ReadSystem) -> None:
    """Read the joint positions of an arm."""
    if isinstance(node.arm, tree.ArmName):
        state.note_arms(node.arm)
        state.note_arm_use(node.arm.key, node.span)
        # The arm may be elsewhere, and with it what it carries.
        state.table.displace(node.arm.key, mover=node.arm.key)


def zero_force(state: FlowState, node: tree.ZeroForce) -> None:
    """Zero the sensor of forces of an arm."""
    if isinstance(node.arm, tree.ArmName):
        state.note_arms(node.arm)
        state.note_arm_use(node.arm.key, node.span)


def read_visions(state: FlowState, node: tree.ReadVisions) -> None:
    """Read frames from the camera."""
    for target in node.targets:
        if isinstance(target, tree.Poison):
            for name in sorted(name for name in target.names if not is_arm(name)):
                state.table.forget(name)
            continue
        require_indices(state, target)
        frame = state.frame(target)
        if frame is None or frame == WORLD:
            continue
        visions = state.cell.visions if state.cell else None
        is_local = "'" in frame or "[" in frame
        if visions is not None and not is_local and frame not in visions and state.is_first_report(frame):
            near = closest(expression_text(target), visions)
            text = f"the camera of the cell has no answer for `{expression_text(target)}`"
            state.report("W601", text, target.span, "will not be found", advice=did_you_mean(near))
        set_pose(state, frame, target, node.span)


def operate(state: FlowState, node: tree.Operate | tree.Pulse) -> None:
    """Switch a device on or off, or set it to a number."""
    value = node.value if isinstance(node, tree.Operate) else node.duration
    require_value(state, value)
    device, devices = node.device, state.cell.devices if state.cell else None
    known = {name.upper() for name in devices or ()}
    is_number = isinstance(node, tree.Operate) and value is not None
    if isinstance(device, tree.Name) and state.cell and device.key in known - state.cell.analogue and is_number:
        text, advice = f"device `{device.text}` is on or off, and cannot be set to a number", "write ON or OFF"
        state.report("R602", text, device.span, "not analogue", advice=advice)
    elif isinstance(device, tree.Name) and devices is not None and device.key not in known:
        listed = ", ".join(sorted(known)) or "none"
        text, note = f"the cell has no device `{device.text}`", f"devices of the cell: {listed}"
        advice = did_you_mean(closest(device.text, known))
        state.report("R602", text, device.span, "no such device", note=note, advice=advice)


STEPS: Steps = {
    tree.Open: of_state(open_),
    tree.Grasp: of_state(grasp),
    tree.Operate: of_state(operate),
    tree.Pulse: of_state(operate),
    tree.SetTimer: of_state(lambda state, node: require_value(state, node.value)),
    tree.ReadVisions: of_state(read_visions),
    tree.ReadSystem: of_state(read_system),
    tree.ZeroForce: of_state(zero_force),
}
