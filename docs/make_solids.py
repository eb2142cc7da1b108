"""Fit the solids of arms of the catalogue to the public meshes that their files name, and measure them.

`python docs/make_solids.py FOLDER... --arms panda irb120` writes boxes, cylinders and capsules into the arm files where
they are better than those there, and prints a row for each arm: in how many of 1000 random configurations it meets
itself by meshes, by the solids before, and by the new ones, without and with the pairs that are left out; how many they
are, and how far meshes reach out of them at most. The folders have the packages that the files name, unpacked.
`--measure` writes nothing. It requires trimesh and coal, as the tests do.
"""

import argparse
import math
import re
import tomllib
from collections.abc import Iterable, Iterator, Sequence
from itertools import accumulate
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree as ET

import coal
import numpy as np
import trimesh
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.transform import Rotation

from armwright.arm.load import load_arm
from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.kinematics.forward_kinematics import link_poses
from armwright.physics.cell_bodies import arm_bodies
from armwright.physics.self_collision import random_configurations
from armwright.spatial.poses import homogeneous, inverse
from armwright.spatial.shapes import Box, Capsule, Cylinder, Shape, Sphere

CATALOGUE = Path(__file__).parents[1] / "src" / "armwright" / "arm" / "catalogue"
# Of Universal Robots: the base frame of the controllers is turned against that of URDF files, whose links are these.
TURNED = homogeneous(np.diag((-1.0, -1.0, 1.0)), np.zeros(3))
PARTS = ("shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3")
CONFIGURATIONS = 1000
# How many solids a link has at first, and while a pair of it meets too often; how much volume one more has to save.
FEWEST, MORE, MOST, WORTH = 3, 3, 9, 0.004
# How much more often solids may meet than meshes before the links get more solids.
TOO_OFTEN = 0.01
# A pair whose meshes meet hardly ever is left out of the checks where its solids meet often.
HARDLY, OFTEN = 0.005, 0.05
# Solids are smaller than what encloses their part of a mesh by this, of the length of the arm [m].
SHRUNK = 1e-3


class Piece(NamedTuple):
    """A solid around points: its kind, its lengths [m] (three, or radius and length), its pose, and its volume [m³]."""

    kind: str
    lengths: tuple[float, ...]
    pose: Array
    volume: float


def circle(points: Array) -> tuple[Array, float]:
    """Return centre and radius of a small circle around points (k, 2).

    Source:
        Bădoiu & Clarkson (2003), "Smaller core-sets for balls".
    """
    centre = (points.min(axis=0) + points.max(axis=0)) / 2
    for step in range(1, 25):
        away = points - centre
        centre = centre + away[np.argmax((away**2).sum(axis=1))] / (step + 1)
    return centre, float(np.linalg.norm(points - centre, axis=1).max())


def hull(points: Array) -> Array:
    """Return the corners of the convex hull of points; all of them where they lie in a plane."""
    try:
        return points[ConvexHull(points).vertices]
    except QhullError:
        return points


def pieces_along(points: Array, R: Array) -> Iterator[Piece]:
    """Give the solids around points whose axes are the columns of a rotation."""
    seen = points @ R
    low, high = seen.min(axis=0), seen.max(axis=0)
    size, middle = np.maximum(high - low, 2e-3), (low + high) / 2
    yield Piece("box", tuple(size.tolist()), homogeneous(R, R @ middle), float(np.prod(size)))
    for axis in range(3):
        across = [(axis + 1) % 3, (axis + 2) % 3]
        turned = R[:, [*across, axis]]
        centre, radius = circle(seen[:, across])
        place = middle.copy()
        place[across] = centre
        volume = math.pi * radius**2 * float(size[axis])
        yield Piece("cylinder", (radius, float(size[axis])), homogeneous(turned, R @ place), volume)
        # The round ends of a capsule begin as deep inside as the points let them.
        end = np.sqrt(np.maximum(radius**2 - ((seen[:, across] - centre) ** 2).sum(axis=1), 0.0))
        top, bottom = float((seen[:, axis] - end).max()), float((seen[:, axis] + end).min())
        if top > bottom + 1e-3:
            place[axis] = (top + bottom) / 2
            volume = math.pi * radius**2 * (top - bottom + 4 / 3 * radius)
            yield Piece("capsule", (radius, top - bottom), homogeneous(turned, R @ place), volume)


def smallest(points: Array, rotations: Iterable[Array]) -> Piece:
    """Return the smallest solid around points along one of some axes."""
    corners = hull(points)
    return min((piece for R in rotations for piece in pieces_along(corners, R)), key=lambda piece: piece.volume)


def enclosing(points: Array) -> Piece:
    """Return the smallest solid around points along the axes of their frame, or those in which they are spread."""
    corners = hull(points)
    spread = np.linalg.eigh(np.cov(corners.T))[1]
    spread[:, 2] = np.cross(spread[:, 0], spread[:, 1])
    return smallest(points, [np.eye(3), spread])


def cut(points: Array, whole: Piece) -> tuple[float, list[Array]]:
    """Return the parts into which one or two parallel cuts split points, and how much volume that saves."""
    saved, parts = -math.inf, [points]
    own = whole.pose[:3, :3]
    for R in [np.eye(3)] if np.isin(np.abs(own), (0.0, 1.0)).all() else [np.eye(3), own]:
        for along in (points @ R).T:
            low, high = float(along.min()), float(along.max())
            places, edge = np.linspace(low, high, 9)[1:-1], (high - low) * 0.01
            below = [points[along <= place + edge] for place in places]
            above = [points[along >= place - edge] for place in places]
            volumes = [[smallest(x, [R]).volume if len(x) > 10 else math.inf for x in side] for side in (below, above)]
            for i in range(len(places)):
                gain = whole.volume - volumes[0][i] - volumes[1][i]
                if gain > saved:
                    saved, parts = gain, [below[i], above[i]]
                for j in range(i + 2, len(places), 2):
                    middle = points[(along >= places[i] - edge) & (along <= places[j] + edge)]
                    rest = whole.volume - volumes[0][i] - volumes[1][j]
                    if len(middle) > 10 and rest > saved:
                        # Two solids more have to save more.
                        gain = (rest - smallest(middle, [R]).volume) * 0.7
                        if gain > saved:
                            saved, parts = gain, [below[i], middle, above[j]]
    return saved, parts


def fits(mesh: trimesh.Trimesh) -> list[list[Piece]]:
    """Return fits of a mesh by more and more solids: the part whose cut saves most is cut, again and again."""
    points = cloud(mesh, 4000)
    least = WORTH * abs(float(mesh.convex_hull.volume))
    parts = [(points, enclosing(points))]
    cuts: dict[int, tuple[float, list[Array]]] = {}
    found = [[piece for _, piece in parts]]
    while len(parts) < MOST:
        for part, piece in parts:
            if id(part) not in cuts:
                cuts[id(part)] = cut(part, piece)
        best = max(range(len(parts)), key=lambda k: cuts[id(parts[k][0])][0])
        saved, new = cuts[id(parts[best][0])]
        if saved < least:
            break
        parts[best : best + 1] = [(part, enclosing(part)) for part in new]
        found.append([piece for _, piece in parts])
    return found


def cloud(mesh: trimesh.Trimesh, count: int) -> Array:
    """Return points on a mesh (k, 3): the corners of its hull, some of the others, and some of its triangles."""
    corners = np.asarray(mesh.vertices)[np.unique(mesh.faces)]
    if len(corners) > count:
        corners = corners[np.random.default_rng(1).choice(len(corners), count, replace=False)]
    sampled, _ = trimesh.sample.sample_surface(mesh, count, seed=1)
    return np.vstack([mesh.convex_hull.vertices, corners, sampled])


def away(piece: Piece, points: Array) -> Array:
    """Return how far points are outside of a solid, (k,) [m]."""
    seen = (points - piece.pose[:3, 3]) @ piece.pose[:3, :3]
    if piece.kind == "box":
        return np.asarray(np.linalg.norm(np.maximum(np.abs(seen) - np.array(piece.lengths) / 2, 0.0), axis=1))
    radius, length = piece.lengths
    across, beyond = np.hypot(seen[:, 0], seen[:, 1]), np.maximum(np.abs(seen[:, 2]) - length / 2, 0.0)
    if piece.kind == "cylinder":
        return np.hypot(np.maximum(across - radius, 0.0), beyond)
    return np.asarray(np.maximum(np.hypot(across, beyond) - radius, 0.0))


def grown(piece: Piece, points: Array) -> Piece:
    """Return a solid that has points in it, too: each side moves as far as it must."""
    pose = piece.pose.copy()
    seen = (points - pose[:3, 3]) @ pose[:3, :3]
    if piece.kind == "capsule":
        radius, length = piece.lengths
        return piece._replace(lengths=(radius + float(away(piece, points).max(initial=0.0)), length))
    if piece.kind == "box":
        half = np.array(piece.lengths) / 2
        low, high = (
            np.minimum(-half, seen.min(axis=0, initial=0.0)),
            np.maximum(half, seen.max(axis=0, initial=0.0)),
        )
        lengths = tuple((high - low).tolist())
    else:
        half = np.array((0.0, 0.0, piece.lengths[1] / 2))
        low = np.minimum(-half, [0.0, 0.0, seen[:, 2].min(initial=0.0)])
        high = np.maximum(half, [0.0, 0.0, seen[:, 2].max(initial=0.0)])
        radius = max(piece.lengths[0], float(np.hypot(seen[:, 0], seen[:, 1]).max(initial=0.0)))
        lengths = (radius, float(high[2] - low[2]))
    pose[:3, 3] += pose[:3, :3] @ (low + high) / 2
    return piece._replace(lengths=lengths, pose=pose)


def shrunk(pieces: Sequence[Piece], mesh: trimesh.Trimesh, by: float) -> tuple[list[Piece], float]:
    """Return solids that are smaller by a length all round, and how far the mesh reaches out of them at most [m].

    Points of the mesh that the fit has not seen, and that reach out, first move the sides of the nearest solid.
    """
    points = cloud(mesh, 20_000)
    distances = np.array([away(piece, points) for piece in pieces])
    nearest = np.where(distances.min(axis=0) > 0, distances.argmin(axis=0), -1)
    result = []
    for number, piece in enumerate(pieces):
        more = grown(piece, points[nearest == number])
        less = {"box": (2.0, 2.0, 2.0), "cylinder": (1.0, 2.0), "capsule": (1.0, 0.0)}[more.kind]
        lengths = np.maximum(np.array(more.lengths) - by * np.array(less), 2e-3)
        result.append(more._replace(lengths=tuple(lengths.tolist())))
    return result, float(np.min([away(piece, points) for piece in result], axis=0).max())


def entry(piece: Piece) -> str:
    """Return a solid as arm files have it, its lengths rounded up to tenths of a millimetre."""
    up = [f"{math.ceil(length * 1e4 - 1e-6) / 10:g}" for length in piece.lengths]
    if piece.kind == "box":
        size = f"size_mm = [{', '.join(up)}]"
    else:
        size = f"diameter_mm = {math.ceil(piece.lengths[0] * 2e4 - 1e-6) / 10:g}, length_mm = {up[1]}"
    xyz = ", ".join(f"{round(x * 1e3, 1) + 0.0:g}" for x in piece.pose[:3, 3])
    angles = Rotation.from_matrix(piece.pose[:3, :3]).as_euler("xyz", degrees=True)
    rpy = ", ".join(f"{round(x, 2) + 0.0:g}" for x in angles)
    turned = "" if np.abs(angles).max() < 5e-3 else f", rpy_deg = [{rpy}]"
    return f'    {{ kind = "{piece.kind}", {size}, xyz_mm = [{xyz}]{turned} }},\n'


class Source:
    """The meshes of the bodies of an arm, 0 being the base, in the frames that its file has, and those of the table."""

    def __init__(self, name: str, folders: Sequence[Path]) -> None:
        """Read them.

        Raises:
            FileNotFoundError: none of the folders has the file that the arm names.
        """
        self.path = CATALOGUE / f"{name}.toml"
        self.arm: Arm = load_arm(name)
        told = tomllib.loads(self.path.read_text(encoding="utf-8"))
        (place,) = [one["path"] for one in told["document"] if "solids" in one.get("gives", ()) and "path" in one]
        file = next((folder / place for folder in folders if (folder / place).is_file()), None)
        if file is None:
            raise FileNotFoundError(place)
        # What xacro has around the links, and prefixes of names, say nothing of meshes.
        text = re.sub(r"<(/?)\w+:[^>]*>|\$\{prefix\}|\$\(arg robot_name\)/|xmlns:?\w*=\"[^\"]*\"", "", file.read_text())
        for written, angle in (("pi/2", math.pi / 2), ("pi", math.pi)):
            text = re.sub(rf"\$\{{(-?){written}\}}", rf"\g<1>{angle}", text)
        root = ET.fromstring(re.sub(r" \w+:(?=\w+=)", " ", text))  # noqa: S314 - files of known packages
        links = {link.get("name", "").lstrip("/"): link for link in root.iter("link")}
        if told.get("convention") == "urdf":
            names = [told["base_link"], *(joint["link"]["name"] for joint in told["joint"])]
            steps = [np.eye(4)] * len(names)
            frames = list(accumulate([_pose(joint) for joint in told["joint"]], np.matmul))
        else:
            base = "base_link_inertia" if "base_link_inertia" in links else "base_link"
            names = [base, *(f"{part}_link" for part in PARTS)]
            frames = list(link_poses(self.arm, np.zeros(self.arm.n))[1 : self.arm.n + 1])
            told_poses = [TURNED @ _pose_in(root, link) for link in names]
            steps = [inverse(F) @ X for F, X in zip([np.eye(4), *frames], told_poses, strict=True)]
        self.meshes = [
            _mesh(links[link], file, step) if link in links else None for link, step in zip(names, steps, strict=True)
        ]
        table = link_poses(self.arm, np.zeros(self.arm.n))
        self.carried = [inverse(X) @ F for X, F in zip(table, [np.eye(4), *frames], strict=False)]


def _pose(joint: dict[str, Any]) -> Array:
    """Return the pose that a joint of an arm file has."""
    angles = joint.get("rpy_rad", np.radians(joint.get("rpy_deg", (0, 0, 0))))
    return homogeneous(Rotation.from_euler("xyz", angles).as_matrix(), np.array(joint.get("xyz_m", (0, 0, 0)), float))


def _origin(element: ET.Element) -> Array:
    """Return the pose in the ``origin`` of an element of URDF."""
    origin = element.find("origin")
    xyz, rpy = (
        [float(x) for x in (origin.get(key) or "0 0 0").split()] if origin is not None else [0.0] * 3
        for key in ("xyz", "rpy")
    )
    return homogeneous(Rotation.from_euler("xyz", rpy).as_matrix(), np.array(xyz))


def _pose_in(root: ET.Element, link: str) -> Array:
    """Return the pose of a link at zero positions, seen from ``base_link``."""
    parents = {
        joint.find("child").get("link"): joint for joint in root.iter("joint") if joint.find("child") is not None
    }
    X = np.eye(4)
    while link != "base_link":
        joint = parents[link]
        X = _origin(joint) @ X
        link = joint.find("parent").get("link") or ""
    return X


def _mesh(link: ET.Element, file: Path, step: Array) -> trimesh.Trimesh | None:
    """Return what a link has for collisions, or else what is drawn of it; None where no mesh can be read."""
    meshes = []
    for shape in link.findall("collision") or link.findall("visual"):
        mesh = shape.find("geometry/mesh")
        parts = [] if mesh is None else re.sub(r"^\w+://", "", mesh.get("filename", "")).split("/")
        tails = (folder.joinpath(*parts[first:]) for folder in file.parents for first in range(len(parts)))
        found = next((tail for tail in tails if tail.is_file()), None)
        if mesh is None or found is None or found.suffix.lower() == ".dae":
            return None
        read = trimesh.load(found, force="mesh")
        read.apply_scale([float(x) for x in (mesh.get("scale") or "1 1 1").split()])
        read.apply_transform(step @ _origin(shape))
        meshes.append(read)
    return trimesh.util.concatenate(meshes) if meshes else None


Geoms = list[tuple[Any, Array]]


def coal_mesh(mesh: trimesh.Trimesh) -> Any:
    """Return a mesh for coal."""
    model = coal.BVHModelOBBRSS()
    model.beginModel(len(mesh.faces), len(mesh.vertices))
    model.addVertices(np.asarray(mesh.vertices, dtype=float))
    for face in mesh.faces:
        model.addTriangle(*(mesh.vertices[i] for i in face))
    model.endModel()
    return model


def coal_shape(shape: Shape) -> Any:
    """Return a solid for coal."""
    match shape:
        case Box(size=size):
            return coal.Box(*size)
        case Cylinder(radius=radius, length=length):
            return coal.Cylinder(radius, length)
        case Capsule(radius=radius, length=length):
            return coal.Capsule(radius, length)
        case Sphere(radius=radius):
            return coal.Sphere(radius)
    raise NotImplementedError(shape)


def of_piece(piece: Piece) -> Any:
    """Return a fitted solid for coal."""
    return {"box": coal.Box, "cylinder": coal.Cylinder, "capsule": coal.Capsule}[piece.kind](*piece.lengths)


def meetings(arm: Arm, bodies: Sequence[Geoms], pairs: Iterable[tuple[int, int]]) -> dict[tuple[int, int], Array]:
    """Return in which random configurations pairs of bodies meet."""
    poses = [link_poses(arm, q) for q in random_configurations(arm)[:CONFIGURATIONS]]
    return {(a, b): np.array([_meet(bodies[a], X[a], bodies[b], X[b]) for X in poses]) for a, b in pairs}


def _meet(ones: Geoms, X: Array, others: Geoms, Y: Array) -> bool:
    request, result = coal.CollisionRequest(), coal.CollisionResult()
    placed = [(geom, coal.Transform3s((Y @ pose)[:3, :3], (Y @ pose)[:3, 3])) for geom, pose in others]
    for geom, pose in ones:
        here = coal.Transform3s((X @ pose)[:3, :3], (X @ pose)[:3, 3])
        for other, there in placed:
            coal.collide(geom, here, other, there, request, result)
            if result.isCollision():
                return True
    return False


def rate(met: dict[tuple[int, int], Array], pairs: Iterable[tuple[int, int]]) -> float:
    """Return the part of the configurations in which one of some pairs meets."""
    return float(np.mean(np.any([met[pair] for pair in pairs], axis=0)))


def refit(name: str, folders: Sequence[Path], *, write: bool) -> str:
    """Fit the solids of an arm, write them, and return what was measured in a line."""
    source = Source(name, folders)
    arm, meshes = source.arm, source.meshes
    known = [number for number, mesh in enumerate(meshes) if mesh is not None]
    pairs = [(a, b) for a in known for b in known if b >= a + 2]
    met = meetings(
        arm,
        [[] if mesh is None else [(coal_mesh(mesh), X)] for mesh, X in zip(meshes, source.carried, strict=True)],
        pairs,
    )
    old: list[Geoms] = [[] for _ in range(arm.n + 1)]
    for body in arm_bodies(name, arm):
        old[body.link].append((coal_shape(body.solid.shape), body.solid.pose))
    before = meetings(arm, old, pairs)
    told = f"| `{name}` | {rate(met, pairs):.1%} | {rate(before, pairs):.1%}"
    if not write:
        return f"{told} | {sum(map(len, old))} |"
    by = SHRUNK * sum(joint.span() for joint in arm.joints)
    all_fits = {number: fits(meshes[number]) for number in known}
    level = dict.fromkeys(known, FEWEST)
    while True:
        chosen, gap = {}, 0.0
        for number in known:
            pieces = next((x for x in reversed(all_fits[number]) if len(x) <= level[number]), all_fits[number][0])
            chosen[number], reach = shrunk(pieces, meshes[number], by)
            gap = max(gap, reach)
        new = [
            [(of_piece(piece), source.carried[i] @ piece.pose) for piece in chosen[i]] if i in chosen else old[i]
            for i in range(arm.n + 1)
        ]
        after = meetings(arm, new, pairs)
        worst = {x for pair in pairs if after[pair].mean() - met[pair].mean() > TOO_OFTEN for x in pair}
        more = {x for x in worst if level[x] < MOST}
        if not more:
            break
        level.update({x: level[x] + MORE for x in more})
    # A pair of which the solids meet again and again, and the meshes never or hardly ever.
    skipped = [
        pair
        for pair in pairs
        if after[pair].mean() > (OFTEN if met[pair].any() else TOO_OFTEN) and met[pair].mean() <= HARDLY
    ]
    if rate(after, pairs) < rate(before, pairs):
        _write(source.path, chosen, skipped, gap)
    rest = rate(after, [pair for pair in pairs if pair not in skipped])
    return f"{told} | {rate(after, pairs):.1%} | {rest:.1%} | {sum(map(len, new))} | {gap * 1e3:.1f} mm |"


def _write(path: Path, chosen: dict[int, list[Piece]], skipped: Sequence[tuple[int, int]], gap: float) -> None:
    """Write solids, pairs that are left out and the largest gap into an arm file."""
    head, *joints = path.read_text(encoding="utf-8").split("\n[[joint]]")
    for number, pieces in chosen.items():
        text = "[\n" + "".join(map(entry, pieces)) + "]\n"
        section = head if number == 0 else joints[number - 1]
        before, after = re.split(r"\[\n {4}\{ kind = .*?\n\]\n", section, maxsplit=1, flags=re.DOTALL)
        section = before + text + after
        if number == 0:
            head = section
        else:
            joints[number - 1] = section
    head = re.sub(r"\[collisions\].*?\n\n", "", head, flags=re.DOTALL)
    if skipped:
        names = ", ".join(f"[{_body(a)}, {_body(b)}]" for a, b in skipped)
        most = f"{HARDLY * CONFIGURATIONS:.0f} of {CONFIGURATIONS} random configurations at most"
        note = f"# pairs whose meshes meet in {most}, and whose solids in many"
        head = head.replace(
            "\n[[document]]", f"\n[collisions]                  {note}\nleave_out = [{names}]\n\n[[document]]", 1
        )
    head = re.sub(r"(reach\s(?:# )?out of\s(?:# )?them by) \d+ mm", rf"\1 {math.ceil(gap * 1e3)} mm", head)
    path.write_text("\n[[joint]]".join([head, *joints]), encoding="utf-8")


def _body(number: int) -> str:
    return '"base"' if number == 0 else f'"link {number}"'


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--arms", nargs="+", required=True)
    parser.add_argument("--measure", action="store_true")
    arguments = parser.parse_args()
    for each in arguments.arms:
        print(refit(each, arguments.folders, write=not arguments.measure), flush=True)  # noqa: T201
