"""Arms as TOML files, which ``load_arm`` reads back to equal arms: every number to the last bit, in SI and radians.

Of a base or tool whose rotation is off by more than rounding, the nearest true one is read back.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence

import attrs
import numpy as np

from armwright.arm.collision_pairs import body_names
from armwright.arm.coupling import Coupling
from armwright.arm.documents import SourceDocument
from armwright.arm.drive import Motor
from armwright.arm.limits import Limits
from armwright.arm.model import UPRIGHT_GRAVITY, Arm, Joint, Link
from armwright.arm.positions import known_arm
from armwright.arm.tensors import impossible_moments
from armwright.arm.uncertainty import Uncertainty
from armwright.arrays import Array
from armwright.errors import InvalidValueError
from armwright.spatial.shapes import Box, Capsule, Cylinder, Mesh, Solid, Sphere


def toml_text(arm: Arm) -> str:
    """Return an arm as the text of an arm file; its format is in docs/arms.md.

    What is as it would be if left out is left out.

    Raises:
        KindError: it is no arm.
        InvalidValueError: arm files cannot hold it: a gear ratio that is not above 0, a tensor that no body has.
    """
    return "\n".join(_lines(known_arm(arm)))


def without_meshes(arm: Arm) -> tuple[Arm, list[str]]:
    """Return an arm without the meshes among its solids, which an arm file cannot hold, and say which these are."""
    lost: list[str] = []

    def kept(solids: Sequence[Solid], what: str) -> tuple[Solid, ...]:
        meshes = [solid.shape.name for solid in solids if isinstance(solid.shape, Mesh)]
        lost.extend(f"{what}: the mesh '{name}' is not in the file" for name in meshes)
        return tuple(solid for solid in solids if not isinstance(solid.shape, Mesh))

    base = kept(arm.base_solids, "base")
    links = [
        attrs.evolve(link, solids=kept(link.solids, link.name or f"link {i}")) for i, link in enumerate(arm.links, 1)
    ]
    return attrs.evolve(arm, base_solids=base, links=links), lost


def _lines(arm: Arm) -> Iterator[str]:
    yield f"name = {_text(arm.name)}"
    for key in ("title", "source", "base_link", "tool_link"):
        if getattr(arm, key):
            yield f"{key} = {_text(getattr(arm, key))}"
    yield from _solids("base_solids", arm.base_solids)
    yield ""
    hand = {"reach_m": arm.reach, "speed_m_per_s": arm.tool_speed}
    yield from _table("hand", {key: value for key, value in hand.items() if math.isfinite(value)})
    yield from _pose("base", arm.base)
    yield from _pose("tool", arm.tool)
    if arm.gravity_from == "stated" or not np.array_equal(arm.gravity, UPRIGHT_GRAVITY):
        yield from _table("gravity", {"m_per_s2": arm.gravity})
    yield from _collisions(arm)
    if arm.coupling is not None:
        yield from _coupling(arm.coupling)
    yield from _documents(arm.documents)
    for i, (joint, link, motor) in enumerate(zip(arm.joints, arm.links, arm.motors, strict=True), 1):
        yield f"[[joint]]  # {i}"
        yield f'kind = "{joint.kind}"'
        if joint.name:
            yield f"name = {_text(joint.name)}"
        geometry = {"theta_rad": joint.theta, "d_m": joint.d, "a_m": joint.a, "alpha_rad": joint.alpha}
        yield from _numbers({key: value for key, value in geometry.items() if value})
        yield ""
        if joint.fixed is not None:
            yield from _pose("joint.fixed", joint.fixed) if not np.array_equal(joint.fixed, np.eye(4)) else ()
        yield from _table("joint.limits", _limits(joint, joint.limits))
        yield from _table("joint.spring", _spring(joint))
        yield from _body(arm, i, link)
        yield from _table("joint.motor", _motor(arm, i, motor, joint))
        if arm.coupling is not None and arm.coupling.limits:
            yield from _table("joint.motor.limits", _limits(joint, arm.coupling.limits[i - 1]))
    if arm.uncertainty is not None:
        yield from _uncertainty(arm.uncertainty)


def _documents(documents: Sequence[SourceDocument]) -> Iterator[str]:
    for document in documents:
        yield "[[document]]"
        for key, value in attrs.asdict(document).items():
            if value:
                yield f"{key} = {_text(value) if isinstance(value, str) else json.dumps(value)}"
        yield ""


def _collisions(arm: Arm) -> Iterator[str]:
    """Write the pairs of bodies that are checked for collisions, or not, whatever the rule says."""
    names = body_names(arm.n)
    lists = {"leave_out": arm.collisions.leave_out, "check": arm.collisions.check}
    if any(lists.values()):
        yield "[collisions]"
        for key, pairs in lists.items():
            if pairs:
                yield f"{key} = {json.dumps([[names[a], names[b]] for a, b in pairs])}"
        yield ""


def _uncertainty(known: Uncertainty) -> Iterator[str]:
    yield "[uncertainty]  # covariance in m and rad"
    yield f"errors = [{', '.join(map(_text, known.errors))}]"
    yield "covariance = ["
    yield from (f"    {row.tolist()!r}," for row in known.covariance + 0.0)
    yield "]"
    yield from _numbers({"noise_m": known.noise})


def _coupling(coupling: Coupling) -> Iterator[str]:
    """Write how the drives move the joints."""
    yield "[coupling]  # rows of joints, columns of drives"
    yield "matrix = ["
    yield from (f"    {row.tolist()!r}," for row in coupling.matrix + 0.0)
    yield "]"
    yield ""


def _limits(joint: Joint, limits: Limits) -> dict[str, float]:
    """Return what a joint, or its drive, may do."""
    position, effort = ("rad", "Nm") if joint.revolute else ("m", "N")
    units = (position, position, f"{position}_per_s", f"{position}_per_s2", effort)
    numbers = zip(attrs.asdict(limits).items(), units, strict=True)
    return {f"{name}_{unit}": value for (name, value), unit in numbers if math.isfinite(value)}


def _spring(joint: Joint) -> dict[str, float]:
    stiffness, rest = ("Nm_per_rad", "rad") if joint.revolute else ("N_per_m", "m")
    values = {f"stiffness_{stiffness}": joint.spring.stiffness, f"rest_{rest}": joint.spring.rest}
    return {key: value for key, value in values.items() if value}


def _body(arm: Arm, i: int, link: Link) -> Iterator[str]:
    """Write the table of a link: its name, and its mass or why that is not known."""
    texts = {key: value for key, value in (("name", link.name), ("unknown", link.unknown)) if value}
    numbers = {} if link.unknown else _link(arm, i, link)
    if texts or numbers or link.solids:
        yield "[joint.link]"
        yield from (f"{key} = {_text(value)}" for key, value in texts.items())
        yield from _numbers(numbers)
        yield from _solids("solids", link.solids)
        yield ""


def _solids(key: str, solids: Sequence[Solid]) -> Iterator[str]:
    """Write the solids of a body, one on a line."""
    if solids:
        yield f"{key} = ["
        yield from (f"    {{{_solid(solid)}}}," for solid in solids)
        yield "]"


def _solid(solid: Solid) -> str:
    values: dict[str, object] = {}
    match solid.shape:
        case Box(size=size):
            kind, values["size_m"] = "box", size.tolist()
        case Sphere(radius=radius):
            kind, values["diameter_m"] = "sphere", 2 * radius
        case Cylinder(radius=radius, length=length) | Capsule(radius=radius, length=length):
            kind = "cylinder" if isinstance(solid.shape, Cylinder) else "capsule"
            values["diameter_m"], values["length_m"] = 2 * radius, length
        case Mesh():
            raise InvalidValueError(f"an arm file cannot hold the triangles of the mesh '{solid.shape.name}'")
    X = solid.pose + 0.0
    if X[:3, 3].any():
        values["xyz_m"] = X[:3, 3].tolist()
    if not np.array_equal(X[:3, :3], np.eye(3)):
        values["rotation"] = X[:3, :3].tolist()
    guess = ["guess = true"] if solid.guessed else []
    return ", ".join([f'kind = "{kind}"', *(f"{name} = {value!r}" for name, value in values.items()), *guess])


def _link(arm: Arm, i: int, link: Link) -> dict[str, float | Array]:
    if impossible_moments(link.mass, link.com, link.inertia) is not None:
        raise InvalidValueError(
            f"arm '{arm.name}': link {i} has the inertia {link.inertia.tolist()}, of which not all moments are known; "
            "an arm file cannot represent this"
        )
    I = link.inertia
    moments, products = np.diag(I), np.array((I[0, 1], I[0, 2], I[1, 2]))
    tensor = np.append(moments, products) if products.any() else moments
    values: dict[str, float | Array] = {"mass_kg": link.mass, "com_m": link.com, "inertia_kgm2": tensor}
    return {key: value for key, value in values.items() if np.any(value)}


def _motor(arm: Arm, i: int, motor: Motor, joint: Joint) -> dict[str, float]:
    if not motor.gear_ratio > 0:
        raise InvalidValueError(
            f"arm '{arm.name}': {arm.joint_label(i - 1)} has the gear ratio {motor.gear_ratio:g}; "
            "an arm file needs one above 0"
        )
    units = ("kgm2", "Nms", "Nm", "rad_per_s") if joint.revolute else ("kg", "Ns_per_m", "N", "m_per_s")
    inertia, viscous, dry, speed = units
    values = {
        f"inertia_{inertia}": motor.inertia,
        f"viscous_{viscous}": motor.viscous,
        f"coulomb_forward_{dry}": motor.coulomb_forward,
        f"coulomb_backward_{dry}": motor.coulomb_backward,
        f"offset_{dry}": motor.offset,
        f"stribeck_{dry}": motor.stribeck,
        f"stribeck_speed_{speed}": motor.stribeck_speed,
        f"cube_root_{dry}": motor.cube_root,
        "stiffness_Nm_per_rad" if joint.revolute else "stiffness_N_per_m": motor.stiffness,
        f"damping_{viscous}": motor.damping,
    }
    values = {key: value for key, value in values.items() if value and math.isfinite(value)}
    return values if motor.gear_ratio == 1 else {**values, "gear_ratio": motor.gear_ratio}


def _pose(name: str, X: Array) -> Iterator[str]:
    values: dict[str, Array] = {}
    if X[:3, 3].any():
        values["xyz_m"] = X[:3, 3]
    if not np.array_equal(X[:3, :3], np.eye(3)):
        values["rotation"] = X[:3, :3]
    yield from _table(name, values)


def _table(name: str, values: Mapping[str, float | Array]) -> Iterator[str]:
    """Write a table and an empty line below it; nothing if there is nothing in it."""
    if values:
        yield f"[{name}]"
        yield from _numbers(values)
        yield ""


def _numbers(values: Mapping[str, float | Array]) -> Iterator[str]:
    for key, value in values.items():
        # -0.0 + 0.0 is 0.0; repr and tolist write a number so that it is read back to the last bit.
        yield f"{key} = {(np.asarray(value) + 0.0).tolist()!r}"


def _text(text: str) -> str:
    """Write a text as TOML does: as JSON, but for the one control character that JSON lets stand.

    Bytes of a file name that are no text, which Python keeps as half characters, are shown as escapes.
    """
    whole = text.encode("utf-8", "backslashreplace").decode("utf-8")
    return json.dumps(whole, ensure_ascii=False).replace("\x7f", "\\u007F")
