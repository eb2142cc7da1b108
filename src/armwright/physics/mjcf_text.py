"""A specification of MuJoCo as MJCF text, every number to the last bit: MuJoCo's own writer keeps six digits."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, TypeAlias
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np

from armwright.mujoco_library import load_mujoco

# How something is called in the text, from its kind and its name in the specification.
Rename: TypeAlias = Callable[[str, str], str]

# Attributes, by element: as MJCF has them, and as specifications have them.
_OPTION = (
    *("timestep", "gravity", "integrator", "cone", "impratio", "iterations", "tolerance", "noslip_iterations"),
    "ccd_tolerance",
)
_INERTIAL = {"pos": "ipos", "quat": "iquat", "mass": "mass", "diaginertia": "inertia"}
_JOINT = (
    *("type", "pos", "axis", "ref", "limited", "range", "armature", "damping", "frictionloss", "stiffness"),
    *("springref", "actuatorfrcrange"),
)
_TENDON = ("limited", "range", "armature", "damping", "frictionloss")
_GEOM = (
    *("type", "size", "pos", "quat", "mass", "contype", "conaffinity", "condim", "friction", "priority"),
    *("margin", "gap", "solref", "solimp", "adhesion", "group", "rgba"),
)
_GENERAL = (
    *("forcelimited", "forcerange", "ctrllimited", "ctrlrange", "gear", "gaintype", "gainprm", "biastype", "biasprm"),
    "dyntype",
)
_PAIR = ("condim", "friction", "solref", "solreffriction", "solimp", "gap", "margin")
_SPEC_NAMES = {"actuatorfrcrange": "actfrcrange"}


def spec_text(spec: Any, name: str, comment: Iterable[str], rename: Rename = lambda _, name: name) -> str:
    """Return a specification as the text of an MJCF file.

    What is written: option, meshes of triangles, bodies with joints, inertia, geoms and sites, actuators, equalities of
    joints, and keyframes; of defaults and frames nothing, since the elements of a specification have all numbers.

    Args:
        spec: the MjSpec.
        name: of the model.
        comment: sentences at the beginning of the file.
        rename: what names are in the text.
    """
    mujoco = load_mujoco()
    root = Element("mujoco", model=name)
    SubElement(root, "compiler", angle="radian")
    plain = mujoco.MjSpec()
    _set(SubElement(root, "option"), spec.option, plain.option, _OPTION, mujoco)
    meshes = [mesh for mesh in spec.meshes if len(mesh.uservert)]
    assets = SubElement(root, "asset") if meshes else root
    for mesh in meshes:
        element = SubElement(assets, "mesh", name=rename("mesh", mesh.name), inertia=_word(mesh.inertia))
        element.set("vertex", _numbers(np.array(mesh.uservert)))
        element.set("face", _numbers(np.array(mesh.userface)))
    _add_body(SubElement(root, "worldbody"), spec.worldbody, rename, mujoco)
    _add_tendons(root, spec, rename, mujoco)
    _add_actuators(root, spec, rename, mujoco)
    _add_couplings(root, spec, rename, mujoco)
    _add_pairs(root, spec, rename, mujoco)
    if spec.keys:
        keys = SubElement(root, "keyframe")
        for key in spec.keys:
            element = SubElement(keys, "key", name=key.name, qpos=_numbers(np.array(key.qpos)))
            if len(key.ctrl):
                element.set("ctrl", _numbers(np.array(key.ctrl)))
    indent(root)
    # Two hyphens would end the comment.
    lines = [line.replace("--", "- -").replace("--", "- -") for line in comment]
    head = "".join(f"<!-- {line} -->\n" for line in lines)
    return f"<?xml version='1.0' encoding='utf-8'?>\n{head}{tostring(root, encoding='unicode')}\n"


def _add_body(element: Element, body: Any, rename: Rename, mujoco: Any) -> None:
    """Write what is in a body, and the bodies in it."""
    plain = mujoco.MjSpec().worldbody.add_body()
    if body.explicitinertial:
        inertial = SubElement(element, "inertial")
        for attribute, field in _INERTIAL.items():
            # A centre of mass that nobody has set is no number.
            inertial.set(attribute, _numbers(np.nan_to_num(np.atleast_1d(getattr(body, field)))))
    for joint in body.joints:
        free = joint.type == mujoco.mjtJoint.mjJNT_FREE
        own = _named(element, "freejoint" if free else "joint", "joint", joint, rename)
        if not free:
            _set(own, joint, plain.add_joint(), _JOINT, mujoco)
    for geom in body.geoms:
        own = _named(element, "geom", "geom", geom, rename)
        _set(own, geom, plain.add_geom(), _GEOM, mujoco)
        if geom.meshname:
            own.set("mesh", rename("mesh", geom.meshname))
    for site in body.sites:
        _set(_named(element, "site", "site", site, rename), site, plain.add_site(), ("pos", "quat"), mujoco)
    for child in body.bodies:
        own = _named(element, "body", "body", child, rename)
        _set(own, child, plain, ("pos", "quat", "gravcomp"), mujoco)
        _add_body(own, child, rename, mujoco)


def _add_tendons(root: Element, spec: Any, rename: Rename, mujoco: Any) -> None:
    """Write the tendons, all of which are sums of joints."""
    if not spec.tendons:
        return
    tendons, plain = SubElement(root, "tendon"), mujoco.MjSpec().add_tendon()
    for tendon in spec.tendons:
        element = _named(tendons, "fixed", "tendon", tendon, rename)
        _set(element, tendon, plain, _TENDON, mujoco)
        for wrap in tendon.path:
            joint = rename("joint", wrap.target.name)
            SubElement(element, "joint", joint=joint, coef=_numbers(np.atleast_1d(wrap.coef)))


def _add_actuators(root: Element, spec: Any, rename: Rename, mujoco: Any) -> None:
    if not spec.actuators:
        return
    actuators, plain = SubElement(root, "actuator"), mujoco.MjSpec().add_actuator()
    for actuator in spec.actuators:
        kind = _word(actuator.trntype)
        element = _named(actuators, "general", "actuator", actuator, rename)
        element.set(kind, rename(kind, actuator.target))
        _set(element, actuator, plain, _GENERAL, mujoco)


def _add_couplings(root: Element, spec: Any, rename: Rename, mujoco: Any) -> None:
    if not spec.equalities:
        return
    equalities, plain = SubElement(root, "equality"), mujoco.MjSpec().add_equality()
    for equality in spec.equalities:
        assert equality.type == mujoco.mjtEq.mjEQ_JOINT  # noqa: S101 - worlds have no others
        element = _named(equalities, "joint", "equality", equality, rename)
        element.set("joint1", rename("joint", equality.name1))
        element.set("joint2", rename("joint", equality.name2))
        element.set("polycoef", _numbers(np.array(equality.data[:5])))
        _set(element, equality, plain, ("solref", "solimp"), mujoco)


def _add_pairs(root: Element, spec: Any, rename: Rename, mujoco: Any) -> None:
    if not spec.pairs:
        return
    contact, plain = SubElement(root, "contact"), mujoco.MjSpec().add_pair()
    for pair in spec.pairs:
        element = _named(contact, "pair", "pair", pair, rename)
        element.set("geom1", rename("geom", pair.geomname1))
        element.set("geom2", rename("geom", pair.geomname2))
        _set(element, pair, plain, _PAIR, mujoco)


def _named(element: Element, tag: str, kind: str, item: Any, rename: Rename) -> Element:
    return SubElement(element, tag, {"name": rename(kind, item.name)} if item.name else {})


def _set(element: Element, item: Any, plain: Any, attributes: Iterable[str], mujoco: Any) -> None:
    """Write the attributes of an item that are not as a plain item has them."""
    for attribute in attributes:
        field = _SPEC_NAMES.get(attribute, attribute)
        value, usual = getattr(item, field), getattr(plain, field)
        if not _same(value, usual):
            element.set(attribute, _text(attribute, value, mujoco))


def _same(value: Any, usual: Any) -> bool:
    """Whether two members of an enumeration are one, or all numbers are the same; what nobody has set is no number."""
    if hasattr(value, "name"):
        return bool(value == usual)
    return np.array_equal(np.asarray(value, dtype=np.float64), np.asarray(usual, dtype=np.float64), equal_nan=True)


def _text(attribute: str, value: Any, mujoco: Any) -> str:
    words = {"integrator": mujoco.mjtIntegrator, "cone": mujoco.mjtCone}
    if attribute in words:
        return _word(words[attribute](value))
    if attribute in {"damping", "stiffness"}:
        # Powers of the speed, of which few have more than the first.
        value = np.trim_zeros(np.atleast_1d(value), "b")
    return _word(value) if hasattr(value, "name") else _numbers(np.atleast_1d(value))


def _word(value: Any) -> str:
    """Return the word of MJCF for a member of an enumeration, such as mjGEOM_BOX."""
    return str(value.name).rpartition("_")[2].lower()


def _numbers(values: Any) -> str:
    return " ".join(repr(value + 0) for value in values.tolist())
