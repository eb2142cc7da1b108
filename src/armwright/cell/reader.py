"""Cell files: TOML for people, JSON for programs; both say the same."""

import math
import re
from collections.abc import Iterable, Mapping
from pathlib import Path

import attrs
import numpy as np

from armwright.arm.load import is_path, load_arm
from armwright.arm.model import UPRIGHT_GRAVITY, Arm
from armwright.arm.positions import degrees_by_mistake
from armwright.arrays import Array
from armwright.cell.frames import WORLD, Node
from armwright.cell.model import Around, Cell, CellArm, ContactPlane
from armwright.cell.names import arm_name
from armwright.dynamics.arguments import weighed
from armwright.errors import ArmwrightError, closest
from armwright.files.document import Document, Table
from armwright.files.inputs import regular_file
from armwright.files.limits import limit, limit_message
from armwright.kinematics.inverse_kinematics.solution import violations
from armwright.kinematics.inverse_kinematics.solve import inverse
from armwright.spatial.poses import from_noap, homogeneous, inverse as inverse_pose
from armwright.spatial.rotations import nearest_rotation, orthonormality_error

# Two bases nearer than this are in one another [m].
_APART = 0.01
# Joints that it takes to bring the gripper to any pose.
_PLACE_AND_TURN = 6
# The arm of a cell that names none: the report's.
_REPORT_ARM = "stanford"
_ARM_NAME = re.compile(r"ARM[-_]([0-9]+)", re.IGNORECASE | re.ASCII)
_NAME = re.compile(r"[A-Z][A-Z0-9_]*", re.IGNORECASE | re.ASCII)
# Rotations typed with two digits deviate by up to 0.018; they are made exact. More is a mistake.
_TYPED_ROTATION = 2e-2
# A faster servo fills a disk, a slower one controls nothing [ms].
SERVO_MS = (0.1, 100.0)
DEVIATION_MM = (1e-3, 1e3)
# No more than a corner of any use; a hundredth of a millimetre is no corner any more, but a stop.
CORNER_MM = (1e-2, 1e3)
# The kind of detour of a straight line, as it is written.
DETOURS: Mapping[str, Around | None] = {"none": None, "via": "via", "damped": "damped"}
# What the camera finds after its last answer, as it is written.
_AFTER_LAST = ("nothing", "same")
# A hundred times that of the earth: more is a slip of units [m/s²].
_STRONGEST_GRAVITY = 1000.0
# Fingers and cameras that take longer are a slip of units [s].
_MAX_WAIT = 600.0


def read_cell(path: Path | str, *, arms_needed: bool = True) -> Cell:
    """Read a cell from a TOML or JSON file.

    Args:
        path: the file; its format is in docs/cells.md.
        arms_needed: whether a file without arms is refused; what a program imports may have frames alone.

    Raises:
        FileFormatError: the file is missing, broken, or says what cannot be; the text has file, line and key.
    """
    path = Path(path)
    top = Document.read(path).root
    arms = _arms(top.table("arms", required=True), path.parent) if arms_needed or "arms" in top else {}
    top.allow("arms")
    camera, motion, contact = top.table("camera"), top.table("motion"), top.table("contact")
    height = contact.number("z", default=math.nan)
    cell = Cell(
        name=top.text("name", default=path.name),
        arms=arms,
        gravity=_gravity(top),
        frames=_frames(top.table("frames"), arms),
        visions=_visions(top.table("visions")),
        camera=_pose(camera, "pose", default=np.eye(4)),
        camera_repeats=camera.choice("after_last", _AFTER_LAST, default="nothing") == "same",
        vision_time=camera.number("time_s", default=0.1, lower=0.0, upper=_MAX_WAIT),
        devices=_devices(top.table("devices")) if "devices" in top else None,
        contact=ContactPlane(
            height=None if math.isnan(height) else height,
            stiffness=contact.number("stiffness_N_per_mm", default=20.0, lower=1e-3, upper=1e6) * 1e3,
            deepest=contact.number("deepest_mm", default=5.0, lower=1e-3, upper=1e3) * 1e-3,
        ),
        period=motion.number("servo_ms", default=1.0, lower=SERVO_MS[0], upper=SERVO_MS[1]) * 1e-3,
        deviation=motion.number("deviation_mm", default=1.0, lower=DEVIATION_MM[0], upper=DEVIATION_MM[1]) * 1e-3,
        corner=_corner(motion),
        around=_around(motion),
    )
    top.allow("devices")
    for table in (camera, motion, contact, top):
        table.refuse_unknown_keys()
    return cell


def _gravity(top: Table) -> Array:
    """Read the gravity of the world, along its axes."""
    gravity = top.vector("gravity_m_per_s2", 3, default=UPRIGHT_GRAVITY)
    if np.linalg.norm(gravity) > _STRONGEST_GRAVITY:
        raise top.error(
            "gravity_m_per_s2",
            f"expected no more than {_STRONGEST_GRAVITY:g} m/s² in all; that of the earth is [0, 0, -9.80665]",
        )
    return gravity


def _corner(motion: Table) -> float | None:
    """Read how far a path past several frames may be from its legs; without the key it goes by the deviation."""
    if "corner_mm" not in motion:
        motion.allow("corner_mm")
        return None
    return motion.number("corner_mm", lower=CORNER_MM[0], upper=CORNER_MM[1]) * 1e-3


def _around(motion: Table) -> Around | None:
    """Read the kind of detour of a straight line; without the key there is no detour."""
    return DETOURS[motion.choice("around", DETOURS, default="none")]


def _arms(table: Table, folder: Path) -> dict[str, CellArm]:
    arms: dict[str, CellArm] = {}
    _refuse_more(table, "arms")
    for key in table:
        match = _ARM_NAME.fullmatch(key)
        if match is None:
            raise table.error(key, "expected the name of an arm, such as ARM_1")
        name = arm_name(match[1])
        if name in arms:
            raise table.error(key, f"{name} occurs twice; case, - or _ and leading zeros do not distinguish arms")
        arms[name] = _arm(table.table(key), folder)
        for other in arms:
            apart = float(np.linalg.norm(arms[name].base[:3, 3] - arms[other].base[:3, 3]))
            if other != name and apart < _APART:
                text = f"{name} and {other} have bases {apart * 1e3:.3g} mm apart; two arms need {_APART * 1e3:g}"
                raise table.table(key).error("base", f"{text} mm or more")
    if not arms:
        raise table.error(None, "expected at least one arm, such as [arms.ARM_1]")
    return arms


def _arm(table: Table, folder: Path) -> CellArm:
    name = table.text("model", default=_REPORT_ARM)
    try:
        # The file of an arm is looked for from the folder of the cell, wherever the command was started.
        arm = load_arm(regular_file(folder / name) if is_path(name) else name)
    except ArmwrightError as error:
        raise table.error("model", str(error)) from error
    if arm.n < _PLACE_AND_TURN:
        raise table.error(
            "model",
            f"'{arm.name}' has {arm.n} joints; moves specify position and orientation, which needs six or more",
        )
    try:
        weighed(arm)
    except ArmwrightError as error:
        raise table.error("model", f"{error}, but the motions of a program are computed with efforts") from error
    if "tool" in table:
        arm = attrs.evolve(arm, tool=_pose(table, "tool"))
    table.allow("tool")
    base = _pose(table, "base", default=np.eye(4))
    start = _start(table, arm, base)
    waits = {
        name: table.number(key, default=0.3, lower=0.0, upper=_MAX_WAIT)
        for name, key in (("open_time", "open_s"), ("grasp_time", "grasp_s"))
    }
    table.refuse_unknown_keys()
    return CellArm(arm=arm, base=base, start=start, **waits)


def _start(table: Table, arm: Arm, base: Array) -> Array:
    """Read where an arm stands at the start: joint by joint, or by the pose of its hand in the world."""
    if "joint_positions" in table:
        if "hand" in table:
            raise table.error("hand", "the start is specified twice, as hand and as joint_positions")
        table.allow("hand")
        q = table.vector("joint_positions", arm.n)
        if mistake := degrees_by_mistake(arm, q):
            raise table.error("joint_positions", mistake)
        for fault in violations(arm, q):
            raise table.error("joint_positions", str(fault))
        return q
    table.allow("joint_positions")
    if "hand" not in table:
        raise table.error("hand", "missing; specify the initial pose of the gripper, or the joints as joint_positions")
    solution = inverse(arm, inverse_pose(base) @ _pose(table, "hand"))
    if not solution.allowed:
        raise table.error("hand", solution.explain())
    return solution.best.q


def _frames(table: Table, arms: Iterable[str]) -> dict[str, Node]:
    _refuse_more(table, "frames")
    frames: dict[str, Node] = {}
    keys: dict[str, str] = {}
    for key in table:
        name = _name(table, key, frames)
        keys[name] = key
        if table.is_table(key):
            place = table.table(key)
            frames[name] = Node(
                parent=_name(place, "on", (), place.text("on", default=WORLD)), relation=_pose(place, "at")
            )
            place.refuse_unknown_keys()
        else:
            frames[name] = Node(parent=WORLD, relation=_pose(table, key))
    known = {WORLD, "STATION", *arms, *frames}
    most = limit("hanging")
    for name, node in frames.items():
        if node.parent not in known:
            near = closest(node.parent, known - {name})
            hint = f"; did you mean {near}?" if near else ""
            raise table.table(keys[name]).error(
                "on", f"{name} is attached to {node.parent}, which is not a frame of the cell{hint}"
            )
        way = _way_up(name, frames, most)
        if frames[way[-1]].parent == name:
            by = f" by way of {', '.join(way[1:])}" if len(way) > 1 else ""
            raise table.table(keys[name]).error("on", f"{name} is attached to itself{by}")
        if len(way) > most:
            raise table.table(keys[name]).error(
                "on", f"{name} is too deep in the frame tree: {limit_message('hanging')}"
            )
    return frames


def _way_up(name: str, frames: Mapping[str, Node], most: int) -> list[str]:
    """Return the frames of the file from ``name`` upwards, none twice, and one more than ``most`` at the most."""
    way, above = {name: None}, frames[name].parent
    while above in frames and above not in way and len(way) <= most:
        way[above] = None
        above = frames[above].parent
    return list(way)


def _refuse_more(table: Table, bound: str) -> None:
    """Refuse a table with more keys than a limit."""
    got = sum(1 for _ in table)
    if got > limit(bound):
        raise table.error(None, f"too many: {limit_message(bound, got)}")


def _visions(table: Table) -> dict[str, tuple[Array, ...]]:
    _refuse_more(table, "entries")
    visions: dict[str, tuple[Array, ...]] = {}
    for key in table:
        name = _name(table, key, visions)
        answers = enumerate(table.vectors(key, 12))
        visions[name] = tuple(_checked(table, key, numbers, index) for index, numbers in answers)
    return visions


def _devices(table: Table) -> frozenset[str]:
    _refuse_more(table, "entries")
    devices: set[str] = set()
    for key in table:
        devices.add(_name(table, key, devices))
        table.table(key).refuse_unknown_keys()
    return frozenset(devices)


def _name(table: Table, key: str, taken: Iterable[str], text: str | None = None) -> str:
    """Return a name as the language compares it: in upper case, and one that a program can write."""
    written = key if text is None else text
    name, match = written.upper(), _ARM_NAME.fullmatch(written)
    if text is not None and match:
        return arm_name(match[1])
    if not _NAME.fullmatch(written) or (text is None and (name == WORLD or match)):
        raise table.error(
            key, f"{written!r} cannot name a frame or device: letters A to Z, digits and _, not WORLD or an arm"
        )
    if name in taken:
        raise table.error(key, f"{name} occurs twice; case does not distinguish names")
    return name


def _pose(table: Table, key: str, default: Array | None = None) -> Array:
    if default is not None and key not in table:
        table.allow(key)
        return default
    return _checked(table, key, table.vector(key, 12))


def _checked(table: Table, key: str, numbers: Array, index: int | None = None) -> Array:
    X = from_noap(numbers)
    error = float(orthonormality_error(X[:3, :3]))
    if error > _TYPED_ROTATION:
        by_rows = np.linalg.norm(numbers.reshape(3, 4)[:, :3], axis=-1)
        rows = np.allclose(by_rows, 1.0, atol=_TYPED_ROTATION)
        hint = "; they look like rows: write the columns n, o, a, p" if rows else ""
        raise table.error(key, f"the first nine numbers are not a rotation (error {error:.2g}){hint}", index)
    return homogeneous(nearest_rotation(X[:3, :3]), X[:3, 3])
