"""MJCF text as elements that know their file and line, of which only what says something of an arm goes to MuJoCo.

A file from elsewhere can ask MuJoCo for any amount of memory: for a million copies of a body, a texture, a height
field. What may do so is left out where it says nothing of an arm, and refused where it does. No entity is expanded, and
MuJoCo opens no file: includes are put in place here, and meshes are handed to it as bytes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from xml.parsers import expat
from xml.sax.saxutils import quoteattr

import attrs

from armwright.arrays import LARGEST
from armwright.errors import FileFormatError, closest, shown
from armwright.files.inputs import read_bytes, regular_file
from armwright.files.limits import MEGABYTE, limit, limit_message

_ACTUATORS = (
    *("general", "motor", "position", "velocity", "intvelocity", "orientation", "pid", "damper", "cylinder", "muscle"),
    *("adhesion", "dcmotor"),
)
_IN_BODY = ("body", "frame", "inertial", "joint", "freejoint", "geom", "site")
# The elements that are read, by the element they stand in.
_READ: dict[str, tuple[str, ...]] = {
    "mujoco": ("compiler", "option", "default", "asset", "worldbody", "tendon", "equality", "actuator", "keyframe"),
    "option": ("flag",),
    "default": ("default", "mesh", "joint", "geom", "site", "equality", "tendon", *_ACTUATORS),
    "asset": ("mesh",),
    "worldbody": _IN_BODY,
    "body": _IN_BODY,
    "frame": _IN_BODY,
    "tendon": ("spatial", "fixed"),
    "spatial": ("site", "geom", "pulley"),
    "fixed": ("joint",),
    "equality": ("connect", "weld", "joint", "tendon"),
    "actuator": _ACTUATORS,
    "keyframe": ("key",),
}
# Those that say nothing of an arm.
_LEFT_OUT: dict[str, tuple[str, ...]] = {
    "mujoco": ("size", "statistic", "visual", "extension", "contact", "sensor", "custom", "deformable"),
    "default": ("texture", "material", "camera", "light", "pair"),
    "asset": ("texture", "material", "hfield", "skin", "model"),
    "worldbody": ("camera", "light", "plugin"),
    "body": ("camera", "light", "plugin"),
    "frame": ("camera", "light", "plugin"),
    "equality": ("flex", "flexvert", "flexstrain"),
    "actuator": ("plugin",),
}
# Those that make bodies of others, by rules of MuJoCo's.
_EXPANDED = ("attach", "composite", "flexcomp", "replicate")
# What is read of elements of which not all is.
_ATTRIBUTES: dict[str, tuple[str, ...]] = {
    "mujoco": ("model",),
    "compiler": (
        *("angle", "eulerseq", "autolimits", "coordinate", "balanceinertia", "boundmass", "boundinertia"),
        *("inertiafromgeom", "inertiagrouprange", "settotalmass", "alignfree", "strippath"),
    ),
    "option": ("gravity",),
    "flag": ("gravity",),
    "key": ("name", "qpos"),
}
# What is read of no element.
_NO_ATTRIBUTES = {
    *("material", "hfield", "user", "rgba", "plugin", "fluidshape", "fluidcoef", "texcoord", "normal", "content_type"),
    *("fuse", "sleep", "simple", "lengthrange", "castshadow"),
}
# Attributes that are names.
_NAMES = {
    *("name", "class", "childclass", "file", "mesh", "model", "joint", "joint1", "joint2", "jointinparent", "body"),
    *("body1", "body2", "site", "site1", "site2", "geom", "sidesite", "tendon", "tendon1", "tendon2", "refsite"),
    *("cranksite", "slidersite", "base"),
}


@attrs.define(eq=False)
class Node:
    """An element of an MJCF file.

    Attributes:
        path: the file.
        line: where it starts.
        tag: its name.
        attributes: as they are written.
        children: the elements in it.
    """

    path: Path
    line: int
    tag: str
    attributes: dict[str, str]
    children: list[Node] = attrs.field(factory=list)

    def error(self, attribute: str, message: str) -> FileFormatError:
        """Return the error that says ``message`` of an attribute, or of the element itself where that is empty."""
        name = f" {shown(self.attributes['name'])}" if "name" in self.attributes else ""
        key = ", ".join(part for part in (f"<{self.tag}>{name}", attribute) if part)
        return FileFormatError(self.path, self.line, key, message)


@attrs.frozen(kw_only=True, eq=False)
class MjcfText:
    """What of an MJCF file is handed to MuJoCo: one element in a line.

    Attributes:
        text: the text.
        nodes: by line, the element that starts or ends there.
        name: of the model; empty where it has none.
        mesh_folder: where mesh files are looked for.
        bare_names: whether folders in the names of mesh files do not count.
    """

    text: str
    nodes: tuple[Node, ...]
    name: str
    mesh_folder: Path
    bare_names: bool


def read_text(path: Path) -> MjcfText:
    """Return what of an MJCF file, and of those that it includes, is handed to MuJoCo.

    Raises:
        FileFormatError: a file is missing, beyond a limit, not well-formed or no MJCF, or says what is not read.
    """
    root = _Files(path).root
    if root.tag != "mujoco":
        raise FileFormatError(path, root.line, "", f"expected <mujoco>, as MJCF files have, got <{root.tag}>")
    folders = {"meshdir": "", "assetdir": "", "strippath": "false"}
    for node in root.children:
        if node.tag == "compiler":
            folders |= {key: value for key, value in node.attributes.items() if key in folders}
    lines, nodes = zip(*_lines(root), strict=True)
    return MjcfText(
        text="\n".join(lines),
        nodes=nodes,
        name=root.attributes.get("model", ""),
        mesh_folder=path.parent / (folders["meshdir"] or folders["assetdir"]),
        bare_names=folders["strippath"] == "true",
    )


class _Files:
    """A file with those that it includes, their sizes and elements counted together."""

    def __init__(self, path: Path) -> None:
        self._folder, self._bytes, self._elements = path.parent, 0, 0
        self._seen = {path.resolve()}
        self.root = self._parse(path)
        self._include(self.root)

    def _parse(self, path: Path) -> Node:
        """Return the root of one file."""
        data = read_bytes(path)
        self._bytes += len(data)
        if self._bytes > limit("file_mb") * MEGABYTE:
            raise FileFormatError(path, None, "", f"too large with what it includes: {limit_message('file_mb')}")
        parser, open_nodes = expat.ParserCreate(), [Node(path, 0, "", {})]

        def start(tag: str, attributes: dict[str, str]) -> None:
            node = Node(path, parser.CurrentLineNumber, tag, attributes)
            self._elements += 1
            for name, count, message in (
                ("nesting", len(open_nodes), "nested too deeply"),
                ("attributes", len(attributes), "too many attributes"),
                ("elements", self._elements, "too many elements"),
            ):
                if count > limit(name):
                    raise node.error("", f"{message}: {limit_message(name)}")
            open_nodes[-1].children.append(node)
            open_nodes.append(node)

        def end(_tag: str) -> None:
            open_nodes.pop()

        def doctype(*_: object) -> None:
            message = "a document type is not read, and MJCF files need none"
            raise FileFormatError(path, parser.CurrentLineNumber, "<!DOCTYPE>", message)

        parser.StartElementHandler, parser.EndElementHandler = start, end
        parser.StartDoctypeDeclHandler = doctype
        try:
            parser.Parse(data, True)
        except expat.ExpatError as error:
            message = f"not valid XML: {expat.ErrorString(error.code)}"
            raise FileFormatError(path, error.lineno, "", message) from error
        except (LookupError, ValueError) as error:
            if isinstance(error, FileFormatError):
                raise
            raise FileFormatError(path, None, "", f"not valid XML: {error}") from error
        return open_nodes[0].children[0]

    def _include(self, node: Node, depth: int = 1) -> None:
        """Put what is included in the place of every <include>, below an element so deep in the whole."""
        if depth > limit("nesting"):
            raise node.error("", f"nested too deeply with what is included: {limit_message('nesting')}")
        children: list[Node] = []
        for child in node.children:
            if child.tag == "include":
                included = self._included(child)
                self._include(included, depth)
                children += included.children
            else:
                self._include(child, depth + 1)
                children.append(child)
        node.children = children

    def _included(self, node: Node) -> Node:
        path = path_below(self._folder, node, "file")
        if path.resolve() in self._seen:
            raise node.error("file", f"{shown(node.attributes['file'])} is included twice")
        self._seen.add(path.resolve())
        if len(self._seen) > limit("imports"):
            raise node.error("", f"too many files: {limit_message('imports')}")
        return self._parse(path)


def path_below(folder: Path, node: Node, attribute: str, root: Path | None = None, *, bare: bool = False) -> Path:
    """Return the path of a file that an element names, which must be in a folder or below it.

    Args:
        folder: what the name is relative to.
        node: the element.
        attribute: that has the name.
        root: where the file must be; the folder itself when left out.
        bare: whether folders in the name do not count.

    Raises:
        FileFormatError: there is no name, it leads elsewhere, or there is no regular file.
    """
    name = node.attributes.get(attribute, "")
    root = (root or folder).resolve()
    try:
        path = folder / (name.replace("\\", "/").rpartition("/")[2] if bare else name)
        inside = bool(name) and path.resolve().is_relative_to(root)
    except (OSError, ValueError, RuntimeError):
        inside = False
    if not inside:
        raise node.error(attribute, f"expected a file in the folder of the MJCF file or below it, got {shown(name)}")
    return regular_file(path)


def _lines(node: Node) -> Iterator[tuple[str, Node]]:
    """Return the lines of an element, each with the element that it is of."""
    if node.tag == "mesh" and "builtin" in node.attributes:
        raise node.error("builtin", "built-in meshes are not read; write the triangles to a file (STL or OBJ)")
    attributes = "".join(f" {key}={quoteattr(value)}" for key, value in _attributes(node))
    children = list(_children(node))
    yield f"<{node.tag}{attributes}{'' if children else '/'}>", node
    for child in children:
        yield from _lines(child)
    if children:
        yield f"</{node.tag}>", node


def _attributes(node: Node) -> Iterator[tuple[str, str]]:
    known = _ATTRIBUTES.get(node.tag)
    for key, value in node.attributes.items():
        if key in _NO_ATTRIBUTES or (known is not None and key not in known):
            continue
        if key not in _NAMES:
            _refuse_no_numbers(node, key, value)
        yield key, value
    # The name that MuJoCo would make of that of the file.
    if node.tag == "mesh" and "file" in node.attributes and not node.attributes.get("name"):
        yield "name", node.attributes["file"].replace("\\", "/").rpartition("/")[2].rpartition(".")[0]


def _refuse_no_numbers(node: Node, key: str, value: str) -> None:
    """Refuse numbers that are none, or too large: MuJoCo goes on with them."""
    for word in value.split():
        try:
            number = float(word)
        except ValueError:
            continue
        if not math.isfinite(number) or abs(number) > LARGEST:
            raise node.error(key, f"expected a number no larger than {LARGEST:g}, got {shown(word)}")


def _children(node: Node) -> Iterator[Node]:
    """Return the elements in one that are read."""
    read, left_out = _READ.get(node.tag, ()), _LEFT_OUT.get(node.tag, ())
    for child in node.children if read else ():
        if child.tag in _EXPANDED:
            raise child.error(
                "",
                f"<{child.tag}> is not read; MuJoCo writes the bodies that it makes: "
                "mujoco.MjSpec.from_file(FILE).to_xml() after compile()",
            )
        if child.tag in left_out or (child.tag == "geom" and child.attributes.get("type") in {"hfield", "sdf"}):
            continue
        if child.tag not in read:
            near = closest(child.tag, (*read, *left_out))
            hint = f"; did you mean <{near}>?" if near else f"; expected one of {', '.join(read)}"
            raise child.error("", f"unknown element in <{node.tag}>{hint}")
        yield child
