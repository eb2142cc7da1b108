"""The scene, the parts and the grippers of a cell file."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np

from armwright.arm.solid_entries import shape_in
from armwright.cell.entries import ARM_NAME, known_name, read_name, read_pose, read_spread, refuse_too_many
from armwright.cell.frames import WORLD, FrameTree
from armwright.cell.moving_frames import MovingFrame
from armwright.cell.scene import TABLE, USUAL_CONTACT_TIME, Fixture, Gripper, Marker, Part, table
from armwright.errors import counted
from armwright.files.document import Table
from armwright.spatial.shapes import LARGEST_SIZE, Mesh, Shape, inertia, is_closed, open_edges

# A coefficient of friction beyond this is that of glue.
_MAX_FRICTION = 10.0
_MAX_MASS = 1e5
_MAX_FORCE = 1e5
# Smaller moments of inertia are nothing that a simulation can divide by; trials may take off nine tenths [kg m²].
_MIN_MOMENT = 1e-14
# Markers of the dictionary 4X4_50.
_MARKERS = 50
_MAX_SYMMETRY = 360
_SHAPES = ("box", "cylinder", "mesh", "sphere")
_FIXTURES = {"boxes": "box", "cylinders": "cylinder", "meshes": "mesh", "spheres": "sphere"}


def read_fixtures(scene: Table, frames: FrameTree) -> dict[str, Fixture]:
    """Read the bodies that stand where they are, by name.

    Args:
        scene: an empty table where the file has none.
        frames: those that bodies can be on.

    Raises:
        FileFormatError: a key is unknown, missing or out of range, a name occurs twice, or a frame does not exist.
    """
    fixtures: dict[str, Fixture] = {}
    if "table" in scene:
        fixtures[TABLE] = _table(scene.table("table"))
    scene.allow("table")
    for kind, shape in _FIXTURES.items():
        for entry in scene.tables(kind) if kind in scene else ():
            entry.add_amount("fixtures", 1, "name")
            name = _body_name(entry, fixtures)
            on = known_name(entry, "on", entry.text("on", default=WORLD), [*frames], "a standing frame")
            fixtures[name] = Fixture(
                name=name,
                shape=shape_in(entry, shape),
                pose=frames.world(on) @ read_pose(entry, "at"),
                friction=_friction(entry),
                contact_time=entry.number("contact_ms", default=USUAL_CONTACT_TIME * 1e3, lower=2.0, upper=1e3) * 1e-3,
                on=on,
            )
            entry.refuse_unknown_keys()
        scene.allow(kind)
    scene.allow("markers")
    scene.refuse_unknown_keys()
    return fixtures


def read_markers(scene: Table) -> dict[str, Marker]:
    """Read the markers that lie in the world, by name.

    Raises:
        FileFormatError: a key is unknown, missing or out of range, or a name or a number occurs twice.
    """
    markers: dict[str, Marker] = {}
    numbers: dict[int, str] = {}
    for entry in scene.tables("markers") if "markers" in scene else ():
        name = _body_name(entry, markers)
        markers[name] = _marker(entry)
        if (other := numbers.setdefault(markers[name].number, name)) != name:
            raise entry.error("id", f"{other} and {name} have the same marker {markers[name].number}")
    return markers


def _body_name(entry: Table, taken: Collection[str]) -> str:
    """Read the name of a body or a marker of the scene, which is not that of an arm or of the world."""
    name = read_name(entry, "name", taken, entry.text("name"))
    if name == WORLD or ARM_NAME.fullmatch(name):
        raise entry.error("name", f"{name} cannot name a body or a marker of the scene, as it names something else")
    return name


def _table(entry: Table) -> Fixture:
    corner, opposite = entry.vector("from", 2), entry.vector("to", 2)
    for key, other in (("to", corner), ("from", opposite)):
        if (np.abs(entry.vector(key, 2)) > LARGEST_SIZE).any():
            raise entry.error(key, f"expected metres, no more than {LARGEST_SIZE:g}")
        if (entry.vector(key, 2) == other).any():
            raise entry.error(key, "the corners of a table must differ in x and in y")
    result = table(
        entry.number("z", lower=-LARGEST_SIZE, upper=LARGEST_SIZE),
        corner,
        opposite,
        entry.number("thickness_mm", default=50.0, lower=1.0, upper=1e4) * 1e-3,
        _friction(entry),
    )
    entry.refuse_unknown_keys()
    return result


def read_parts(parts: Table, moving: Mapping[str, MovingFrame], taken: Collection[str] = ()) -> dict[str, Part]:
    """Read the parts, by name.

    Args:
        parts: the table of them.
        moving: the frames that parts can be on.
        taken: names of bodies and markers of the scene, which no part has.

    Raises:
        FileFormatError: a key is unknown, missing or out of range, two markers have one number, or a frame does not
            exist.
    """
    result: dict[str, Part] = {}
    numbers: dict[int, str] = {}
    refuse_too_many(parts, "parts")
    for key in parts:
        entry = parts.table(key)
        name = read_name(parts, key, result)
        if name in taken:
            raise parts.error(key, f"{name} is the name of a body or a marker of the scene too; rename one of them")
        marker = _marker(entry.table("marker")) if "marker" in entry else None
        if marker is not None and (other := numbers.setdefault(marker.number, name)) != name:
            raise entry.table("marker").error(
                "id", f"the parts {other} and {name} have the same marker {marker.number}"
            )
        entry.allow("marker")
        shape = _part_shape(entry)
        on = known_name(entry, "on", entry.text("on", default=WORLD), [WORLD, *moving], "a frame that moves by itself")
        start = moving[on].pose if on in moving else np.eye(4)
        result[name] = Part(
            name=name,
            shape=shape,
            mass=_part_mass(entry, shape),
            friction=_friction(entry),
            pose=start @ read_pose(entry, "at"),
            on=on,
            spread=read_spread(entry, "spread_mm", "spread_deg"),
            grasp=read_pose(entry, "grasp", np.eye(4)),
            marker=marker,
            symmetry=entry.whole("symmetry", 1, _MAX_SYMMETRY, default=1),
        )
        entry.refuse_unknown_keys()
    return result


def _part_shape(entry: Table) -> Shape:
    """Read the shape of a part, which must enclose the volume that its mass fills."""
    shape = shape_in(entry, entry.choice("shape", _SHAPES, default="mesh" if "mesh" in entry else "box"))
    if isinstance(shape, Mesh) and not is_closed(shape):
        edges = counted(open_edges(shape), "edge")
        raise entry.error(
            "mesh",
            f"{shape.name} is not closed ({edges} without one triangle on either side); expected a mesh that encloses "
            "the mass of the part",
        )
    return shape


def _part_mass(entry: Table, shape: Shape) -> float:
    """Read the mass of a part, with which it has moments of inertia about all axes."""
    mass = entry.number("mass_kg", lower=1e-6, upper=_MAX_MASS)
    moment = mass * float(np.linalg.eigvalsh(inertia(shape))[0])
    if not moment >= _MIN_MOMENT:
        message = f"about an axis its moment of inertia is {moment:.3g} kg m²; expected {_MIN_MOMENT:g} or more"
        raise entry.error("mass_kg", f"too small for such a shape; {message}")
    return mass


def _marker(entry: Table) -> Marker:
    marker = Marker(
        number=entry.whole("id", 0, _MARKERS - 1),
        size=entry.number("size_mm", lower=1.0, upper=1e4) * 1e-3,
        pose=read_pose(entry, "at"),
    )
    entry.refuse_unknown_keys()
    return marker


def read_gripper(entry: Table) -> Gripper:
    """Read what an arm holds parts with.

    Raises:
        FileFormatError: a key is unknown or out of range.
    """
    gripper = Gripper(
        kind="suction" if entry.choice("kind", ("fingers", "suction"), default="fingers") == "suction" else "fingers",
        force=entry.number("force_N", default=30.0, lower=1e-3, upper=_MAX_FORCE),
        opening=entry.number("opening_mm", default=80.0, lower=1.0, upper=1e4) * 1e-3,
        friction=_friction(entry, 1.0),
    )
    entry.refuse_unknown_keys()
    return gripper


def _friction(entry: Table, default: float = 0.8) -> float:
    return entry.number("friction", default=default, lower=0.0, upper=_MAX_FRICTION)
