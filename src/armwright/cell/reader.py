"""Cell files: TOML for people, JSON for programs, with the same content."""

import math
import warnings
from collections.abc import Collection, Iterable, Mapping
from pathlib import Path

import attrs
import numpy as np

from armwright.arm.load import is_path, load_arm
from armwright.arm.model import UPRIGHT_GRAVITY, Arm
from armwright.arm.positions import degrees_by_mistake
from armwright.arrays import Array
from armwright.cell.assembly import is_assembly
from armwright.cell.camera_reader import read_cameras, read_visions, refuse_hidden_markers
from armwright.cell.control_reader import read_alarms, read_force_sensor, read_plant, read_sensors, read_servo
from armwright.cell.entries import ARM_NAME, known_name, read_name, read_pose, read_spread, refuse_too_many
from armwright.cell.frames import WORLD, FrameTree, Node
from armwright.cell.model import Around, Cell, CellArm, ContactPlane, JointTarget
from armwright.cell.moving_frames import MovingFrame
from armwright.cell.moving_frames_reader import read_moving_frame
from armwright.cell.names import arm_name
from armwright.cell.outputs_reader import read_controller, read_devices
from armwright.cell.scene import Spread
from armwright.cell.scene_reader import read_fixtures, read_gripper, read_markers, read_parts
from armwright.cell.signals_reader import read_inputs
from armwright.cell.smooth_reader import read_shaping, with_read_gears
from armwright.cell.trials_reader import read_trials
from armwright.dynamics.arguments import weighed
from armwright.errors import ArmwrightError, FileFormatError, MeshWarning, closest
from armwright.files.document import Document, Table
from armwright.files.inputs import file_path, regular_file
from armwright.files.limits import limit, limit_message
from armwright.kinematics.inverse_kinematics.solution import violations
from armwright.kinematics.inverse_kinematics.solve import inverse
from armwright.spatial.poses import inverse as inverse_pose
from armwright.spatial.shapes import Mesh

# Smallest distance of the bases of two arms [m].
_MIN_BASE_DISTANCE = 0.01
# Arms of fewer joints than these cannot bring a part from one place to another and turn it.
_MIN_JOINTS = 4
# The arm of a cell whose file names none: that of the report.
_DEFAULT_ARM = "stanford"
# Servo periods [ms]: a shorter one fills the disk, a longer one controls nothing.
SERVO_MS = (0.1, 100.0)
DEVIATION_MM = (1e-3, 1e3)
# Corner deviations: below a hundredth of a millimetre the arm would stop.
CORNER_MM = (1e-2, 1e3)
# Distances to other bodies that can be asked for: larger ones are not looked for.
CLEARANCE_MM = (0.0, 50.0)
# The kind of detour of a straight line, by its word in the file.
DETOURS: Mapping[str, Around | None] = {"none": None, "via": "via", "damped": "damped"}
# What the camera finds after its last answer, by its word in the file.
_AFTER_LAST = ("nothing", "same")
# A hundred times that of the earth: more is in another unit [m/s²].
_MAX_GRAVITY = 1000.0
# Fingers and cameras that take longer are in another unit [s].
_MAX_DURATION = 600.0


def read_cell(path: Path | str, *, arms_needed: bool = True) -> Cell:
    """Read a cell from a TOML or JSON file.

    Args:
        path: the file; its format is in docs/cells.md.
        arms_needed: whether a file without arms is refused; an imported file may have frames only.

    Raises:
        FileFormatError: the file is missing or invalid; the message has file, line and key.
    """
    path = file_path(path)
    if is_assembly(path):
        raise FileFormatError(path, None, "", "expected a cell file; an assembly is for IMPORT")
    return _cell(Document.read(path).root, path, arms_needed=arms_needed)


def parse_cell(path: Path, text: str) -> Cell:
    """Return the cell that a TOML file would hold with a text in it.

    Args:
        path: of the file; others are found from its folder.
        text: of it.

    Raises:
        FileFormatError: the text is invalid; the message has file, line and key.
    """
    return _cell(Document.parse(path, text, is_json=False).root, path, arms_needed=True)


def _cell(top: Table, path: Path, *, arms_needed: bool) -> Cell:
    arms = _read_arms(top.table("arms", required=True), path.parent) if arms_needed or "arms" in top else {}
    top.allow("arms")
    camera, motion, contact = top.table("camera"), top.table("motion"), top.table("contact")
    frames, spreads, moves = _read_frames(top.table("frames"), arms)
    standing = _standing(frames, arms)
    scene = top.table("scene")
    fixtures, markers = read_fixtures(scene, standing), read_markers(scene)
    moving = _read_moving_frames(moves, frames, standing)
    parts = read_parts(top.table("parts"), moving, {*fixtures, *markers})
    refuse_hidden_markers(top, fixtures, parts, markers)
    cameras = read_cameras(camera, top.table("cameras"), arms)
    sights, visions = read_visions(top.table("visions"), fixtures, parts, markers, cameras)
    devices = read_devices(top.table("devices")) if "devices" in top else None
    cell = Cell(
        name=top.text("name", default=path.name),
        arms=arms,
        gravity=_read_gravity(top),
        frames=frames,
        moving_frames=moving,
        joint_targets=_read_joint_targets(top.table("joint_targets"), arms, frames),
        spreads=spreads,
        fixtures=fixtures,
        parts=parts,
        markers=markers,
        cameras=cameras,
        sights=sights,
        visions=visions,
        camera=read_pose(camera, "pose", default=np.eye(4)),
        camera_repeats=camera.choice("after_last", _AFTER_LAST, default="nothing") == "same",
        alarms=read_alarms(top.table("limits")),
        vision_time=camera.number("time_s", default=0.1, lower=0.0, upper=_MAX_DURATION),
        devices=devices,
        inputs=read_inputs(top.table("inputs"), devices, arms, _still(standing, frames, moves)),
        contact=ContactPlane(
            height=_optional_number(contact, "z"),
            stiffness=contact.number("stiffness_N_per_mm", default=20.0, lower=1e-3, upper=1e6) * 1e3,
            max_depth=contact.number("deepest_mm", default=5.0, lower=1e-3, upper=1e3) * 1e-3,
        ),
        period=motion.number("servo_ms", default=1.0, lower=SERVO_MS[0], upper=SERVO_MS[1]) * 1e-3,
        deviation=motion.number("deviation_mm", default=1.0, lower=DEVIATION_MM[0], upper=DEVIATION_MM[1]) * 1e-3,
        corner=_optional_number(motion, "corner_mm", 1e-3, *CORNER_MM),
        clearance=motion.number("clearance_mm", default=0.0, lower=CLEARANCE_MM[0], upper=CLEARANCE_MM[1]) * 1e-3,
        around=DETOURS[motion.choice("around", DETOURS, default="none")],
        plan=motion.flag("plan"),
        trials=read_trials(top.table("trials"), parts, markers, frames, standing),
    )
    top.allow("devices", "inputs")
    for table in (camera, motion, contact, top):
        table.refuse_unknown_keys()
    _warn_of_hulls(cell)
    return cell


def _warn_of_hulls(cell: Cell) -> None:
    """Warn where collisions are found with shapes that differ much from the meshes of bodies."""
    solids = {f"{name} base": arm.arm.base_solids for name, arm in cell.arms.items()}
    for name, arm in cell.arms.items():
        solids |= {f"{name} {link.name or f'link {i}'}": link.solids for i, link in enumerate(arm.arm.links, 1)}
    bodies = [(name, solid.shape) for name, row in solids.items() for solid in row]
    bodies += [(name, fixture.shape) for name, fixture in cell.fixtures.items()]
    bodies += [(name, part.shape) for name, part in cell.parts.items()]
    if any(isinstance(shape, Mesh) for _, shape in bodies):
        from armwright.spatial.meshes.hulls import hull_messages  # noqa: PLC0415 - few cells have meshes

        for message in hull_messages(bodies):
            warnings.warn(f"cell '{cell.name}': {message}", MeshWarning, stacklevel=3)


def _read_gravity(top: Table) -> Array:
    """Read the gravity of the world, along its axes."""
    gravity = top.vector("gravity_m_per_s2", 3, default=UPRIGHT_GRAVITY)
    if np.linalg.norm(gravity) > _MAX_GRAVITY:
        raise top.error(
            "gravity_m_per_s2",
            f"expected no more than {_MAX_GRAVITY:g} m/s² in all; that of the earth is [0, 0, -9.80665]",
        )
    return gravity


def _optional_number(
    table: Table, key: str, unit: float = 1.0, lower: float = -math.inf, upper: float = math.inf
) -> float | None:
    """Read a number of units; without the key there is none."""
    value = table.number(key, default=math.nan, lower=lower, upper=upper)
    return None if math.isnan(value) else value * unit


def _read_arms(table: Table, folder: Path) -> dict[str, CellArm]:
    arms: dict[str, CellArm] = {}
    refuse_too_many(table, "arms")
    for key in table:
        match = ARM_NAME.fullmatch(key)
        if match is None:
            raise table.error(key, "expected the name of an arm, such as ARM_1")
        name = arm_name(match[1])
        if name in arms:
            raise table.error(key, f"{name} occurs twice; case, - and _, and leading zeros are ignored")
        arms[name] = _read_arm(table.table(key), folder)
        for other in arms:
            distance = float(np.linalg.norm(arms[name].base[:3, 3] - arms[other].base[:3, 3]))
            if other != name and distance < _MIN_BASE_DISTANCE:
                raise table.table(key).error(
                    "base",
                    f"{name} and {other} have bases {distance * 1e3:.3g} mm apart; two arms need "
                    f"{_MIN_BASE_DISTANCE * 1e3:g} mm or more",
                )
    if not arms:
        raise table.error(None, "expected at least one arm, such as [arms.ARM_1]")
    return arms


def _read_arm(table: Table, folder: Path) -> CellArm:
    name = table.text("model", default=_DEFAULT_ARM)
    packages = {key: folder / table.table("packages").text(key) for key in table.table("packages")}
    try:
        # The paths of an arm file and of packages are relative to the folder of the cell file.
        arm = load_arm(regular_file(folder / name) if is_path(name) else name, packages=packages)
    except ArmwrightError as error:
        raise table.error("model", str(error)) from error
    if arm.n < _MIN_JOINTS:
        raise table.error(
            "model",
            f"'{arm.name}' has {arm.n} joints; an arm in a cell needs four or more",
        )
    try:
        weighed(arm)
    except ArmwrightError as error:
        raise table.error("model", f"{error}, but the motions of a program are computed with efforts") from error
    arm = with_read_gears(_with_tool(arm, table), table.table("smooth"))
    base = read_pose(table, "base", default=np.eye(4))
    table.allow("hand", "joint_positions")
    start = _read_start(table, arm, base)
    open_time, grasp_time = (
        table.number(key, default=0.3, lower=0.0, upper=_MAX_DURATION) for key in ("open_s", "grasp_s")
    )
    result = CellArm(
        arm=arm,
        base=base,
        start=start,
        open_time=open_time,
        grasp_time=grasp_time,
        gripper=read_gripper(table.table("gripper")) if "gripper" in table else None,
        servo=read_servo(table.table("servo")),
        plant=_with_tool(read_plant(table.table("plant"), arm, folder), table) if "plant" in table else None,
        sensors=read_sensors(table.table("sensors")),
        force_sensor=read_force_sensor(table.table("force")),
        controller=read_controller(table, arm.n),
        smooth=read_shaping(table.table("smooth")),
    )
    table.allow("gripper", "plant")
    table.refuse_unknown_keys()
    return result


def _with_tool(arm: Arm, table: Table) -> Arm:
    """Return an arm with the tool that the cell file specifies, if it does."""
    return attrs.evolve(arm, tool=read_pose(table, "tool", default=arm.tool))


def _read_positions(table: Table, arm: Arm) -> Array:
    """Read joint positions of an arm that its limits allow."""
    q = table.vector("joint_positions", arm.n)
    if mistake := degrees_by_mistake(arm, q):
        raise table.error("joint_positions", mistake)
    for fault in violations(arm, q):
        raise table.error("joint_positions", str(fault))
    return q


def _read_start(table: Table, arm: Arm, base: Array) -> Array:
    """Read the initial configuration of an arm: its joint positions, or the pose of its gripper in the world."""
    if "joint_positions" in table:
        if "hand" in table:
            raise table.error("hand", "the start is specified twice, as hand and as joint_positions")
        return _read_positions(table, arm)
    if "hand" not in table:
        raise table.error("hand", "missing; specify the initial pose of the gripper, or the joints as joint_positions")
    solution = inverse(arm, inverse_pose(base) @ read_pose(table, "hand"))
    if not solution.allowed:
        raise table.error("hand", solution.explain())
    return solution.best.q


def _read_frames(table: Table, arms: Iterable[str]) -> tuple[dict[str, Node], dict[str, Spread], dict[str, Table]]:
    """Read the frames, how far from there those may be that have a spread, and the tables of those that move."""
    refuse_too_many(table, "frames")
    frames: dict[str, Node] = {}
    spreads: dict[str, Spread] = {}
    entries: dict[str, Table] = {}
    moves: dict[str, Table] = {}
    for key in table:
        name = read_name(table, key, frames)
        if table.is_table(key):
            entry = entries[name] = table.table(key)
            parent = read_name(entry, "on", (), entry.text("on", default=WORLD))
            frames[name] = Node(parent=parent, relation=read_pose(entry, "at"))
            if (spread := read_spread(entry, "spread_mm", "spread_deg", "tilt_deg")) != Spread():
                spreads[name] = spread
            if "moves" in entry:
                moves[name] = entry.table("moves")
            entry.allow("moves")
            entry.refuse_unknown_keys()
        else:
            frames[name] = Node(parent=WORLD, relation=read_pose(table, key))
    known = {WORLD, "STATION", *arms, *frames}
    max_depth = limit("hanging")
    for name, entry in entries.items():
        parent = frames[name].parent
        if parent not in known:
            near = closest(parent, known - {name})
            hint = f"; did you mean {near}?" if near else ""
            raise entry.error("on", f"{name} is attached to {parent}, which is not a frame of the cell{hint}")
        path = _path_to_root(name, frames, max_depth)
        if frames[path[-1]].parent == name:
            by = f" by way of {', '.join(path[1:])}" if len(path) > 1 else ""
            raise entry.error("on", f"{name} is attached to itself{by}")
        if len(path) > max_depth:
            raise entry.error("on", f"{name} is too deep in the frame tree: {limit_message('hanging')}")
        if name in spreads and (arm := frames[path[-1]].parent) in arms:
            raise entry.error(None, f"{name} moves with {arm}; only a frame that stands can have a spread")
    return frames, spreads, moves


def _read_moving_frames(
    moves: Mapping[str, Table], frames: Mapping[str, Node], standing: FrameTree
) -> dict[str, MovingFrame]:
    """Read how frames move, which hang on nothing that moves."""
    depth = limit("hanging")
    for name, entry in moves.items():
        below = [*_path_to_root(name, frames, depth)[1:]]
        if name not in standing or any(parent in moves for parent in below):
            raise entry.error(None, f"{name} moves by itself, so what it is on must stand")
    return {name: read_moving_frame(entry, standing.world(name)) for name, entry in moves.items()}


def _read_joint_targets(table: Table, arms: Mapping[str, CellArm], frames: Collection[str]) -> dict[str, JointTarget]:
    """Read the named configurations of arms."""
    refuse_too_many(table, "frames")
    targets: dict[str, JointTarget] = {}
    for key in table:
        name = read_name(table, key, targets)
        if name in frames or name == "STATION":
            raise table.error(key, f"{name} is a frame of the cell already")
        entry = table.table(key)
        arm = known_name(entry, "arm", entry.text("arm", default=next(iter(arms), "ARM_1")), arms, "an arm")
        targets[name] = JointTarget(arm=arm, q=_read_positions(entry, arms[arm].arm))
        entry.refuse_unknown_keys()
    return targets


def _standing(frames: Mapping[str, Node], arms: Iterable[str]) -> FrameTree:
    """Return the frames that do not move with an arm."""
    moving, depth = set(arms), limit("hanging")
    standing = {
        name: it for name, it in frames.items() if frames[_path_to_root(name, frames, depth)[-1]].parent not in moving
    }
    return FrameTree({"STATION": Node(parent=WORLD, relation=np.eye(4)), **standing})


def _still(standing: FrameTree, frames: Mapping[str, Node], moves: Collection[str]) -> FrameTree:
    """Return the frames that neither move with an arm nor by themselves."""
    depth = limit("hanging")
    moving = {name for name in frames if any(below in moves for below in _path_to_root(name, frames, depth))}
    return FrameTree({name: node for name, node in standing.nodes.items() if name not in moving})


def _path_to_root(name: str, frames: Mapping[str, Node], max_depth: int) -> list[str]:
    """Return the frames of the file from ``name`` towards the root, each once, at most ``max_depth`` + 1."""
    path, parent = {name: None}, frames[name].parent
    while parent in frames and parent not in path and len(path) <= max_depth:
        path[parent] = None
        parent = frames[parent].parent
    return list(path)
