"""MJCF text as a model of MuJoCo: its defaults, angles and frames resolved by MuJoCo itself."""

from __future__ import annotations

import posixpath
import re
import warnings
from pathlib import Path
from typing import Any

from armwright.arm.mjcf.elements import MjcfText, Node, path_below
from armwright.errors import FileFormatError, shown
from armwright.files.inputs import read_bytes
from armwright.files.limits import MEGABYTE, limit, limit_message
from armwright.mujoco_library import load_mujoco

_MESH_FILES = (".stl", ".obj")
_LINE = re.compile(r"line (\d+)")


def compile_mjcf(path: Path, text: MjcfText) -> Any:
    """Return the model that MuJoCo makes of a text.

    Raises:
        MissingExtraError: MuJoCo cannot be loaded.
        FileFormatError: MuJoCo refuses the text, or a mesh file is missing or beyond a limit.
    """
    mujoco = load_mujoco()
    try:
        spec = mujoco.MjSpec.from_string(text.text)
        spec.compiler.usethread = False
        # Muscles would be simulated to know how far they go.
        spec.compiler.LRopt.mode = mujoco.mjtLRMode.mjLRMODE_NONE
        _leave_out_pictures(mujoco, spec)
        spec.assets = _mesh_files(spec, path, text)
        with warnings.catch_warnings():
            # That a mass matrix is nearly singular concerns simulations.
            warnings.simplefilter("ignore")
            return spec.compile()
    except FileFormatError:
        raise
    except (ValueError, RuntimeError, MemoryError, mujoco.FatalError) as error:
        raise _as_ours(error, path, text) from error


def is_solid(geom: Any) -> bool:
    """Whether a geom collides with others, and is not only drawn."""
    return bool(geom.contype or geom.conaffinity)


def _leave_out_pictures(mujoco: Any, spec: Any) -> None:
    """Take away geoms that are only drawn, where others collide and neither tells the mass; and meshes of no geom."""
    by_geoms = spec.compiler.inertiafromgeom == mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE
    for body in spec.bodies:
        geoms = list(body.geoms)
        if body.explicitinertial and not by_geoms and any(map(is_solid, geoms)):
            for geom in geoms:
                if not is_solid(geom):
                    spec.delete(geom)
    used = {geom.meshname for geom in spec.geoms} | {site.meshname for site in spec.sites}
    for mesh in list(spec.meshes):
        if mesh.name not in used:
            spec.delete(mesh)


def _mesh_files(spec: Any, path: Path, text: MjcfText) -> dict[str, bytes]:
    """Read the mesh files, and return them by the names that the meshes have from now on."""
    nodes: dict[str, Node] = {}
    for each in text.nodes:
        if each.tag == "mesh" and (name := each.attributes.get("file")):
            # MuJoCo shortens paths such as `./a//b.stl`.
            nodes[name] = nodes[posixpath.normpath(re.sub(r"[\\/]+", "/", name))] = each
    names: dict[Path, str] = {}
    files: dict[str, bytes] = {}
    total = 0
    for mesh in spec.meshes:
        if not mesh.file:
            continue
        node = nodes.get(mesh.file)
        if node is None:
            raise FileFormatError(path, None, "mesh", f"expected a plain file name, got one such as {shown(mesh.file)}")
        place = path_below(text.mesh_folder, node, "file", root=path.parent, bare=text.bare_names)
        kind = place.suffix.lower()
        if kind not in _MESH_FILES:
            raise node.error("file", f"expected a mesh in {' or '.join(_MESH_FILES)}, got {place.name}")
        if place not in names:
            names[place] = f"{len(names)}{kind}"
            try:
                files[names[place]] = read_bytes(place, "mesh_mb")
            except FileFormatError as error:
                raise node.error("file", str(error)) from error
        # A file that two meshes are made of takes memory twice.
        total += len(files[names[place]])
        if total > limit("mesh_mb") * MEGABYTE:
            raise node.error("file", f"the meshes are too large together: {limit_message('mesh_mb')}")
        mesh.file = names[place]
    return files


def _as_ours(error: Exception, path: Path, text: MjcfText) -> FileFormatError:
    """Return the error of MuJoCo, which counts the lines of the text that it got, in one line."""
    message = " ".join(str(error).split())
    for start in ("XML Error: ", "Schema violation: ", "Error: "):
        message = message.removeprefix(start)
    number = _LINE.search(message)
    node: Node | None = None
    if number and 0 < int(number[1]) <= len(text.nodes):
        node = text.nodes[int(number[1]) - 1]
        message = message.partition(" Element ")[0]
    return FileFormatError(path, None, "", message) if node is None else node.error("", message)
