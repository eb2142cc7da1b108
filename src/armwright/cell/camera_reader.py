"""The cameras of a cell file, and what they search for."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.cell.entries import known_name, read_name, read_pose, refuse_too_many, to_pose
from armwright.cell.scene import CAMERA, TABLE, Camera, Fixture, Marker, Part, Sight
from armwright.files.document import Table
from armwright.spatial.lens import Lens, simple_lens
from armwright.spatial.poses import inverse_pose
from armwright.spatial.shapes import LARGEST_SIZE, Shape, Solid, contains, support

# Sides of pictures [px], and how many pixels one may have.
_SIDES, _MAX_PIXELS = (16, 4096), 4_194_304
# How many pixels all cameras may have: where a lens distorts, each needs some 32 bytes.
_MAX_ALL_PIXELS = 4 * _MAX_PIXELS
_FOVY_DEG = (1.0, 150.0)
_MAX_FOCAL = 1e6
_MAX_DISTORTION = 10.0
# How much larger a picture without distortion may be that shows as much.
_MAX_WIDER = 4.0
_MAX_NOISE = 100.0
# Keys of a camera that takes pictures.
_LENS_KEYS = ("width", "height", "fovy_deg", "focal_px", "centre_px", "distortion", "noise", "light")
# So far out of the plane of a marker something is in front of it [m]: more than by rounding.
_IN_FRONT = 5e-5


def read_cameras(main: Table, others: Table, arms: Collection[str]) -> dict[str, Camera]:
    """Read the cameras that take pictures, by name.

    Args:
        main: ``[camera]``; it takes pictures where it says of what width.
        others: ``[cameras]``.
        arms: names of the arms.

    Raises:
        FileFormatError: a key is unknown, missing or out of range, or there is no such arm.
    """
    cameras: dict[str, Camera] = {}
    main.allow(*_LENS_KEYS)
    if "width" in main:
        cameras[CAMERA] = _camera(main, CAMERA, read_pose(main, "pose", np.eye(4)), None)
    elif extra := next((key for key in _LENS_KEYS if key in main), None):
        raise main.error(extra, "it is a key of cameras that take pictures, which need width and height")
    refuse_too_many(others, "entries")
    for key in others:
        name = read_name(others, key, cameras)
        entry = others.table(key)
        on = known_name(entry, "on", entry.text("on"), arms, "an arm") if "on" in entry else None
        entry.allow("on")
        cameras[name] = _camera(entry, name, read_pose(entry, "pose"), on)
        entry.refuse_unknown_keys()
        pixels = sum(camera.lens.width * camera.lens.height for camera in cameras.values())
        if pixels > _MAX_ALL_PIXELS:
            raise entry.error("width", f"expected no more than {_MAX_ALL_PIXELS:,} pixels of all cameras together")
    return cameras


def _camera(entry: Table, name: str, pose: Array, on: str | None) -> Camera:
    return Camera(
        name=name,
        lens=_lens(entry),
        pose=pose,
        on=on,
        noise=entry.number("noise", default=0.0, lower=0.0, upper=_MAX_NOISE),
        light=entry.number("light", default=1.0, lower=0.0, upper=1.0),
    )


def _lens(entry: Table) -> Lens:
    width, height = (entry.whole(key, *_SIDES) for key in ("width", "height"))
    if width * height > _MAX_PIXELS:
        raise entry.error("width", f"expected no more than {_MAX_PIXELS:,} pixels, got {width} times {height}")
    distortion = entry.vector("distortion", 5, default=np.zeros(5))
    if (np.abs(distortion) > _MAX_DISTORTION).any():
        raise entry.error("distortion", f"expected k1, k2, p1, p2, k3 no larger than {_MAX_DISTORTION:g}")
    if "focal_px" in entry:
        if "fovy_deg" in entry:
            raise entry.error("fovy_deg", "the lens is specified twice, by fovy_deg and by focal_px")
        focal = entry.vector("focal_px", 2)
        if (focal < 1).any() or (focal > _MAX_FOCAL).any():
            raise entry.error("focal_px", f"expected 1 to {_MAX_FOCAL:g} pixels along x and along y")
        centre = entry.vector("centre_px", 2, default=((width - 1) / 2, (height - 1) / 2))
        if (centre < 0).any() or (centre > (width - 1, height - 1)).any():
            raise entry.error("centre_px", f"expected a pixel of the picture, up to ({width - 1}, {height - 1})")
        lens = Lens(width=width, height=height, focal=focal, centre=centre, distortion=distortion)
    else:
        fovy = entry.number("fovy_deg", lower=_FOVY_DEG[0], upper=_FOVY_DEG[1])
        lens = simple_lens(width, height, np.radians(fovy), distortion)
    entry.allow("centre_px", "focal_px", "fovy_deg")
    area = np.prod(np.ptp(lens.field(), axis=0) * lens.focal) if lens.is_invertible() else np.inf
    if area > _MAX_WIDER * width * height:
        raise entry.error("distortion", "the field of view is too wide for it: its edge would be seen nowhere or twice")
    return lens


def read_visions(
    table: Table,
    fixtures: Mapping[str, Fixture],
    parts: Mapping[str, Part],
    markers: Mapping[str, Marker],
    cameras: Mapping[str, Camera],
) -> tuple[dict[str, Sight], dict[str, tuple[Array, ...]]]:
    """Read what a camera answers by frame: what it searches for, or a list of poses.

    Raises:
        FileFormatError: there is no such part, marker or camera, or a pose is none.
    """
    refuse_too_many(table, "entries")
    sights: dict[str, Sight] = {}
    visions: dict[str, tuple[Array, ...]] = {}
    for key in table:
        name = read_name(table, key, {*sights, *visions})
        if table.is_table(key):
            entry = table.table(key)
            sights[name] = _sight(entry, fixtures, parts, markers, cameras)
            entry.refuse_unknown_keys()
        else:
            poses = enumerate(table.vectors(key, 12))
            visions[name] = tuple(to_pose(table, key, numbers, index) for index, numbers in poses)
    return sights, visions


def _sight(
    entry: Table,
    fixtures: Mapping[str, Fixture],
    parts: Mapping[str, Part],
    markers: Mapping[str, Marker],
    cameras: Mapping[str, Camera],
) -> Sight:
    if "part" in entry and "marker" in entry:
        raise entry.error("marker", "a camera finds a part or a marker of the scene, not both")
    camera = known_name(entry, "camera", entry.text("camera"), cameras, "a camera") if "camera" in entry else None
    if camera is None and cameras:
        camera = CAMERA if CAMERA in cameras else next(iter(cameras)) if len(cameras) == 1 else None
        if camera is None:
            raise entry.error("camera", f"missing; the cameras are {', '.join(cameras)}")
    entry.allow("camera", "on", "part", "marker")
    if "marker" in entry:
        name = known_name(entry, "marker", entry.text("marker"), markers, "a marker")
        height = _height(entry, fixtures, float(markers[name].pose[2, 3]))
        relation = read_pose(entry, "at", np.eye(4))
        return Sight(kind="marker", name=name, camera=camera, height=height, relation=relation)
    name = known_name(entry, "part", entry.text("part"), parts, "a part")
    height = _height(entry, fixtures, lowest(parts[name].shape, parts[name].pose))
    return Sight(kind="part", name=name, camera=camera, height=height, relation=parts[name].grasp)


def lowest(shape: Shape, pose: Array) -> float:
    """Return the height of the lowest point of a solid at a pose (4, 4) [m]."""
    return float(pose[2, 3] - support(shape, -pose[2, :3]))


def _height(entry: Table, fixtures: Mapping[str, Fixture], start: float) -> float | None:
    """Return the height at which something stands or lies; None where it may be anywhere."""
    if "on" not in entry:
        return start
    if not entry.is_text("on"):
        return entry.number("on", lower=-LARGEST_SIZE, upper=LARGEST_SIZE)
    if entry.choice("on", ("table", "free")) == "free":
        return None
    if TABLE not in fixtures:
        raise entry.error("on", "the scene has no table")
    table = fixtures[TABLE]
    return float(table.pose[2, 3] + support(table.shape, table.pose[2, :3]))


def refuse_hidden_markers(
    top: Table, fixtures: Mapping[str, Fixture], parts: Mapping[str, Part], markers: Mapping[str, Marker]
) -> None:
    """Refuse markers that no camera can see at the start, and markers of one number on a part and in the scene.

    Args:
        top: the file.
        fixtures: bodies of the scene, by name.
        parts: by name.
        markers: of the scene, by name.

    Raises:
        FileFormatError: a marker is inside its part or a body of the scene, or faces into it.
    """
    furniture = [(name, Solid(shape=body.shape, pose=body.pose)) for name, body in fixtures.items()]
    numbers: dict[int, str] = {}
    for key in top.table("parts"):
        part, marker = parts[key.upper()], parts[key.upper()].marker
        if marker is None:
            continue
        numbers[marker.number] = part.name
        itself = Solid(shape=part.shape, pose=part.pose)
        placed = attrs.evolve(marker, pose=part.pose @ marker.pose)
        entry = top.table("parts").table(key).table("marker")
        _refuse_hidden(entry, part.name, placed, [("the part itself", itself), *furniture])
    entries = top.table("scene").tables("markers") if markers else []
    for entry, (name, marker) in zip(entries, markers.items(), strict=True):
        if marker.number in numbers:
            raise entry.error("id", f"{numbers[marker.number]} and {name} have the same marker {marker.number}")
        _refuse_hidden(entry, name, marker, furniture)


def _refuse_hidden(entry: Table, name: str, marker: Marker, solids: Iterable[tuple[str, Solid]]) -> None:
    """Refuse a marker with its pose in the world in front of which there are solids."""
    side = marker.size / 2
    corners = np.array([(0, 0), (-side, side), (side, side), (side, -side), (-side, -side)])
    in_front = marker.pose @ np.column_stack([corners, np.full(5, _IN_FRONT), np.ones(5)]).T
    for other, solid in solids:
        if contains(solid.shape, (inverse_pose(solid.pose) @ in_front)[:3].T).any():
            raise entry.error("at", f"marker {marker.number} of {name} is hidden: {other} is in front of it")
