"""URDF text as elements that know their location: what is read is checked, and named with file, line and key.

Elements and attributes that URDF does not have are skipped, as files are full of what other programs put there. But
one that is spelt nearly as URDF spells it is refused, since what it says would be lost; and so is whatever else an
<origin> says of a pose.
"""

from __future__ import annotations

import math
import re
import shlex
from collections.abc import Collection
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from armwright.arrays import LARGEST, Array
from armwright.errors import FileFormatError, closest, shown
from armwright.extras import import_extra
from armwright.files.inputs import read_bytes
from armwright.files.limits import limit, limit_message
from armwright.spatial.euler import from_rpy
from armwright.spatial.poses import homogeneous

_MISSING: Any = object()
# What is matched is not given back: a word of a million digits and a letter is passed once.
_NUMBER = re.compile(r"[+-]?(\d++\.?\d*+|\.\d++)([eE][+-]?\d++)?", re.ASCII)
# What URDF has in a link, in a joint, and below those: elements, attributes.
_KNOWN: dict[str, tuple[Collection[str], Collection[str]]] = {
    "robot": (("link", "joint", "material", "transmission", "gazebo", "sensor"), ("name", "version")),
    "link": (("inertial", "visual", "collision"), ("name", "type")),
    "joint": (
        ("origin", "parent", "child", "axis", "calibration", "dynamics", "limit", "mimic", "safety_controller"),
        ("name", "type"),
    ),
    "inertial": (("origin", "mass", "inertia"), ()),
    "visual": (("origin", "geometry", "material"), ("name",)),
    "collision": (("origin", "geometry", "verbose", "contact_coefficients"), ("name", "group")),
    "geometry": (("box", "cylinder", "sphere", "capsule", "mesh"), ()),
    "box": ((), ("size",)),
    "cylinder": ((), ("radius", "length")),
    "sphere": ((), ("radius",)),
    "capsule": ((), ("radius", "length")),
    "mesh": ((), ("filename", "scale")),
    "origin": ((), ("xyz", "rpy")),
    "mass": ((), ("value",)),
    "inertia": ((), ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")),
    "parent": ((), ("link",)),
    "child": ((), ("link",)),
    "axis": ((), ("xyz",)),
    "limit": ((), ("lower", "upper", "effort", "velocity")),
    "dynamics": ((), ("damping", "friction")),
    "mimic": ((), ("joint", "multiplier", "offset")),
}


@attrs.frozen(kw_only=True, eq=False)
class Element:
    """An element of a URDF file.

    Attributes:
        path: the file.
        line: where the element starts.
        location: how messages call it, such as ``joint 'elbow', limit``; empty for the robot.
        tag: its name.
        attributes: its attributes as they are written.
        children: the elements in it, those of other namespaces left out.
    """

    path: Path
    line: int
    location: str
    tag: str
    attributes: dict[str, str]
    children: tuple[Element, ...]

    @property
    def name(self) -> str:
        """The attribute ``name``."""
        return self.text("name")

    def error(self, attribute: str, message: str) -> FileFormatError:
        """Return the error that says ``message`` of an attribute, or of the element itself where that is empty."""
        key = ", ".join(part for part in (self.location, attribute) if part)
        return FileFormatError(self.path, self.line, key, message)

    def find_all(self, tag: str) -> list[Element]:
        """Return the elements in it that have a name, in their order."""
        return [child for child in self.children if child.tag == tag]

    def find(self, tag: str) -> Element | None:
        """Return the element in it that has a name, or None.

        Raises:
            FileFormatError: there are two.
        """
        children = self.find_all(tag)
        if len(children) > 1:
            raise children[1].error("", f"occurs twice, first in line {children[0].line}")
        return children[0] if children else None

    def require(self, tag: str) -> Element:
        """Return the element in it that has a name.

        Raises:
            FileFormatError: there is none, or there are two.
        """
        child = self.find(tag)
        if child is None:
            raise self.error("", f"expected <{tag}> in it")
        return child

    def text(self, attribute: str) -> str:
        """Return an attribute as it is written.

        Raises:
            FileFormatError: it is missing or empty.
        """
        text = self.attributes.get(attribute, "")
        if not text:
            raise self.error(attribute, "missing")
        return text

    def number(self, attribute: str, default: Any = _MISSING, *, lower: float = -math.inf) -> float:
        """Return an attribute as a number.

        Raises:
            FileFormatError: it is missing without a default, no number, too large, or below ``lower``.
        """
        if attribute not in self.attributes and default is not _MISSING:
            return float(default)
        value = self._number(attribute, self.text(attribute).strip())
        if value < lower:
            raise self.error(attribute, f"expected {lower:g} or more, got {value:g}")
        return value

    def vector(self, attribute: str, default: Any = _MISSING) -> Array:
        """Return an attribute as three numbers, (3,).

        Raises:
            FileFormatError: it is missing without a default, or something else.
        """
        if attribute not in self.attributes and default is not _MISSING:
            return np.array(default, dtype=np.float64)
        numbers = [self._number(attribute, word) for word in self.text(attribute).split()]
        if len(numbers) != 3:
            raise self.error(attribute, f"expected 3 numbers, got {len(numbers)}")
        return np.array(numbers)

    def _number(self, attribute: str, word: str) -> float:
        if not _NUMBER.fullmatch(word):
            hint = f"; {_expand_first(self.path)}" if "${" in word else ""
            raise self.error(attribute, f"expected a number, got {shown(word)}{hint}")
        value = float(word)
        if abs(value) > LARGEST:
            raise self.error(attribute, f"expected a number no larger than {LARGEST:g}, got {shown(word)}")
        return value


def origin_of(element: Element) -> Array:
    """Return the pose (4, 4) that the <origin> in an element gives; the same frame where there is none.

    Raises:
        FileFormatError: it is not written as one.
    """
    origin = element.find("origin")
    if origin is None:
        return np.eye(4)
    rpy, xyz = (origin.vector(key, (0.0, 0.0, 0.0)) for key in ("rpy", "xyz"))
    return homogeneous(from_rpy(*rpy), xyz)


def read_elements(path: Path) -> Element:
    """Return the element ``robot`` of a URDF file.

    Raises:
        MissingExtraError: lxml is not installed.
        FileFormatError: the file is missing, no XML, or no URDF.
    """
    data = read_bytes(path)
    etree: Any = import_extra("lxml.etree", "reading URDF", "urdf")
    # Nothing is fetched, and entities stay as they are: a file from elsewhere cannot make this read other files.
    # What is deep or huge is refused by the parser itself.
    safely: Any = {
        "resolve_entities": False,
        "no_network": True,
        "load_dtd": False,
        "remove_comments": True,
        "huge_tree": False,
    }
    parser = etree.XMLParser(**safely)
    try:
        raw = etree.fromstring(data, parser)
    except etree.XMLSyntaxError as error:
        # A prefix without a namespace belongs to another program, such as Drake, and is let pass as by other readers.
        prefix = etree.ErrorTypes.NS_ERR_UNDEFINED_NAMESPACE
        errors = [each for each in parser.error_log if each.type != prefix or "xacro" in each.message]
        if errors:
            message = errors[0].message
            hint = f"; {_expand_first(path)}" if "xacro" in message else ""
            raise FileFormatError(path, errors[0].line or None, "", f"not valid XML: {message}{hint}") from error
        raw = etree.fromstring(data, etree.XMLParser(recover=True, **safely))
    space, tag = _split(raw)
    if tag != "robot":
        raise FileFormatError(path, raw.sourceline, "", f"expected <robot>, as URDF files have, got <{tag}>")
    foreign = next((each for each in raw.iter() if "xacro" in _split(each)[0]), None)
    if foreign is not None:
        raise FileFormatError(path, foreign.sourceline, f"<{_split(foreign)[1]}>", _expand_first(path))
    _refuse_deep(path, raw)
    return _element(path, raw, space, "")


def _expand_first(path: Path) -> str:
    """Say what to do with a file of xacro."""
    name = path.name.removesuffix(".xacro").removesuffix(".urdf")
    return f"expand xacro files to URDF first: xacro {shlex.quote(path.name)} > {shlex.quote(name + '-expanded.urdf')}"


def _refuse_deep(path: Path, raw: Any) -> None:
    """Refuse elements in one another beyond the limit."""
    row, most = list(raw), limit("nesting")
    for _ in range(most):
        row = [child for element in row for child in element]
        if not row:
            return
    raise FileFormatError(path, row[0].sourceline, "", f"nested too deeply: {limit_message('nesting')}")


def _split(raw: Any) -> tuple[str, str]:
    """Return namespace and name of an element; those of a processing instruction or an entity are empty."""
    if not isinstance(raw.tag, str):
        return "", ""
    space, _, tag = raw.tag.rpartition("}")
    return space.removeprefix("{"), tag


def _element(path: Path, raw: Any, space: str, around: str) -> Element:
    tag, line = _split(raw)[1], raw.sourceline
    # lxml looks for each from the first one, so many take the square of the time.
    if len(raw.attrib) > limit("attributes"):
        message = f"too many attributes: {limit_message('attributes', len(raw.attrib))}"
        raise FileFormatError(path, line, f"<{tag}>", message)
    attributes = dict(raw.attrib)
    if tag in {"link", "joint"} and not around:
        location = f"{tag} {shown(attributes['name'])}" if "name" in attributes else tag
    else:
        location = ", ".join(part for part in (around, tag) if part and tag != "robot")
    inside = [each for each in raw if _split(each)[0] == space and _split(each)[1]] if tag in _KNOWN else []
    children = tuple(_element(path, each, space, location) for each in inside)
    element = Element(path=path, line=line, location=location, tag=tag, attributes=attributes, children=children)
    _refuse_misspelt(element)
    return element


def _refuse_misspelt(element: Element) -> None:
    """Refuse what is not an element or an attribute of URDF, but nearly so."""
    if element.tag not in _KNOWN:
        return
    tags, attributes = _KNOWN[element.tag]
    for child in element.children:
        near = None if child.tag in tags else closest(child.tag, tags)
        if near:
            raise child.error("", f"unknown element; did you mean <{near}>?")
    for attribute in element.attributes:
        near = None if attribute in attributes else closest(attribute, attributes)
        if near:
            raise element.error(attribute, f"unknown attribute; did you mean '{near}'?")
        if element.tag == "origin" and attribute not in attributes:
            raise element.error(attribute, "unknown attribute; expected xyz or rpy")
