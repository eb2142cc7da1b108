"""The tables of an arm: geometry, limits, inertia and drives in degrees and millimetres; as plain data in SI."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import attrs
import numpy as np

from armwright.arm.coupling import Coupling
from armwright.arm.gravity import vector_text
from armwright.arm.limits import Limits
from armwright.arm.model import Arm, Joint
from armwright.arm.reach import reach_of, tool_speed_of
from armwright.arrays import Array
from armwright.errors import counted
from armwright.files.result_table import ResultTable
from armwright.spatial.euler import to_rpy
from armwright.spatial.poses import to_noap

# The origin of the gravity vector, in words.
_GRAVITY_FROM = {
    "standard": "the default; in a cell, the gravity of the cell applies",
    "stated": "stated by the arm file; in a cell, the gravity of the cell applies",
    "root": "downwards in the root link of the file; in a cell, the gravity of the cell applies",
    "world": "the gravity of the cell",
}
# Of links whose mass and inertia are unknown, so many are named with the reason.
_MAX_UNKNOWN = 2
# Parameters of a drive that affect the motion of the joint.
_DRIVE = ("inertia", "viscous", "coulomb_forward", "coulomb_backward", "offset", "stribeck", "cube_root")


def tables(model: Arm) -> Iterator[ResultTable]:
    """Yield the tables of an arm [deg, mm]; a title without columns states that there are no data."""
    if any(joint.name or link.name for joint, link in zip(model.joints, model.links, strict=True)):
        yield _joint_name_table(model)
    yield _dh_table(model)
    if any(joint.fixed is not None for joint in model.joints):
        yield _fixed_joint_table(model)
    yield _limit_table(model, "Limits", [joint.limits for joint in model.joints])
    if unknown := [f"link {i}: {link.unknown}" for i, link in enumerate(model.links, 1) if link.unknown]:
        more = f"; and {counted(len(unknown) - _MAX_UNKNOWN, 'more link')}" if len(unknown) > _MAX_UNKNOWN else ""
        title = f"Mass and inertia are unknown, so there is no dynamics. {'; '.join(unknown[:_MAX_UNKNOWN])}{more}"
        yield ResultTable(title=title, heads=(), rows=())
    if any(link.mass or link.inertia.any() for link in model.links):
        yield _mass_table(model)
        yield _inertia_table(model)
    else:
        yield ResultTable(title="Links: no masses or inertias are known", heads=(), rows=())
    if any(any(getattr(motor, name) for name in _DRIVE) for motor in model.motors):
        yield _drive_table(model)
    else:
        yield ResultTable(title="Drives: no inertia or friction is known", heads=(), rows=())
    if model.coupling is not None:
        yield _coupling_table(model.coupling)
        if model.coupling.limits:
            yield _limit_table(model, "Limits of the drives", model.coupling.limits, "drive")
    if any(joint.spring.stiffness for joint in model.joints):
        yield _spring_table(model)


def facts(model: Arm) -> list[tuple[str, str]]:
    """Return the poses of base and tool, gravity, reach and speed, each with its name."""

    def noap(X: Array) -> str:
        numbers = to_noap(X) + 0.0
        columns = ["  ".join(f"{x:z.6g}" for x in numbers[k : k + 3].round(12)) for k in (0, 3, 6)]
        position = "  ".join(f"{x * 1e3:z.6g}" for x in numbers[9:].round(12))
        return f"n ({columns[0]})  o ({columns[1]})  a ({columns[2]})  p ({position}) mm"

    pairs = [("base", noap(model.base)), ("tool", noap(model.tool))]
    pairs.append(("gravity", f"{vector_text(model.gravity)}, {_GRAVITY_FROM[model.gravity_from]}"))
    not_stated = "; not stated, "
    reach = "" if math.isfinite(model.reach) else not_stated + "the length of the stretched arm is used"
    speed = "" if math.isfinite(model.tool_speed) else not_stated + "the usual speed is used"
    pairs.append(("reach", _length(reach_of(model)) + reach))
    pairs.append(("tool speed", f"{_length(tool_speed_of(model))}/s at full reach{speed}"))
    return pairs


def as_data(model: Arm) -> dict[str, Any]:
    """Return an arm as plain data in SI units; infinite limits are None."""

    def plain(_owner: object, _field: object, value: Any) -> Any:
        if isinstance(value, np.ndarray):
            return value.tolist()
        return None if isinstance(value, float) and math.isinf(value) else value

    return attrs.asdict(model, value_serializer=plain)


def _fixed_joint_table(model: Arm) -> ResultTable:
    title = "Fixed transforms, after theta and d and before a and alpha"
    rows = []
    for i, joint in enumerate(model.joints, 1):
        if joint.fixed is not None:
            position = (f"{x * 1e3:z.6g}" for x in joint.fixed[:3, 3])
            rows.append((str(i), *position, *(f"{math.degrees(x):z.6g}°" for x in to_rpy(joint.fixed[:3, :3]))))
    return ResultTable(title=title, heads=("joint", "x mm", "y mm", "z mm", "roll", "pitch", "yaw"), rows=rows)


def _joint_name_table(model: Arm) -> ResultTable:
    rows = [(str(i), j.name, k.name) for i, (j, k) in enumerate(zip(model.joints, model.links, strict=True), 1)]
    return ResultTable(title="Names", heads=("number", "joint", "link"), rows=rows)


def _dh_table(model: Arm) -> ResultTable:
    rows = []
    for i, joint in enumerate(model.joints, 1):
        theta, d = _angle(joint.theta), _length(joint.d)
        if joint.revolute:
            theta = f"q{i}" if joint.theta == 0 else f"q{i} {math.degrees(joint.theta):+g}°"
        else:
            d = f"q{i}" if joint.d == 0 else f"q{i} {joint.d * 1e3:+g} mm"
        rows.append((str(i), joint.kind, theta, d, _length(joint.a), _angle(joint.alpha)))
    heads = ("joint", "kind", "theta", "d", "a", "alpha")
    return ResultTable(title="Denavit-Hartenberg, standard", heads=heads, rows=rows)


def _limit_table(model: Arm, title: str, each: Sequence[Limits], what: str = "joint") -> ResultTable:
    rows = []
    for i, (joint, limits) in enumerate(zip(model.joints, each, strict=True), 1):
        effort = "-" if math.isinf(limits.effort) else f"{limits.effort:g} {joint.units.effort}"
        positions = _position(joint, limits.lower), _position(joint, limits.upper)
        rates = _position(joint, limits.speed, "/s"), _position(joint, limits.acceleration, "/s²")
        rows.append((str(i), *positions, *rates, effort))
    return ResultTable(title=title, heads=(what, "from", "to", "speed", "acceleration", "effort"), rows=rows)


def _coupling_table(coupling: Coupling) -> ResultTable:
    rows = [(str(i), *(f"{x:z.6g}" for x in row)) for i, row in enumerate(coupling.matrix, 1)]
    title = "Coupling: the joints by the drives (rad, m)"
    return ResultTable(title=title, heads=("joint", *(f"drive {i}" for i in range(1, len(rows) + 1))), rows=rows)


def _mass_table(model: Arm) -> ResultTable:
    title = "Links: mass, and centre of mass in the frame of the link"
    masses = enumerate(model.links, 1)
    rows = [(str(i), f"{link.mass:g}", *(f"{x * 1e3:z.6g}" for x in link.com)) for i, link in masses]
    return ResultTable(title=title, heads=("link", "kg", "x mm", "y mm", "z mm"), rows=rows)


def _inertia_table(model: Arm) -> ResultTable:
    entries = {"Ixx": (0, 0), "Iyy": (1, 1), "Izz": (2, 2), "Ixy": (0, 1), "Ixz": (0, 2), "Iyz": (1, 2)}
    links = enumerate(model.links, 1)
    rows = [(str(i), *(f"{link.inertia[entry]:z.4g}" for entry in entries.values())) for i, link in links]
    return ResultTable(title="Inertia about the centre of mass, kg m²", heads=("link", *entries), rows=rows)


def _drive_table(model: Arm) -> ResultTable:
    rows = []
    # Terms that few arms have are shown where there are some.
    names = {"offset": "offset", "Stribeck friction": "stribeck", "cube-root friction": "cube_root"}
    others = [head for head, name in names.items() if model.motor_values(name).any()]
    flexible = bool(np.isfinite(model.motor_values("stiffness")).any())
    for i, (motor, joint) in enumerate(zip(model.motors, model.joints, strict=True), 1):
        forward, backward, units = motor.coulomb_forward, motor.coulomb_backward, joint.units
        coulomb = f"{forward:g}" if forward == backward else f"+{forward:g} / -{backward:g}"
        friction = f"{motor.viscous:g} {units.viscous}", f"{coulomb} {units.effort}"
        values = {head: f"{getattr(motor, name):g} {units.effort}" for head, name in names.items()}
        if motor.stribeck:
            values["Stribeck friction"] += f", exp(-(v / {_position(joint, motor.stribeck_speed, '/s')})²)"
        more = [values[head] for head in others]
        gear = [f"{motor.stiffness:g} {units.stiffness}", f"{motor.damping:g} {units.viscous}"] if flexible else []
        rows.append((str(i), f"{motor.inertia:g} {units.inertia}", *friction, *more, f"{motor.gear_ratio:g}", *gear))
    what, title = "joint", "Drives, reflected to the joint"
    if model.coupling is not None:
        what, title = "drive", "Drives, behind their gears"
    gear_heads = ("stiffness", "damping") if flexible else ()
    heads = (what, "inertia", "viscous", "Coulomb friction", *others, "gear ratio", *gear_heads)
    return ResultTable(title=title, heads=heads, rows=rows)


def _spring_table(model: Arm) -> ResultTable:
    rows = []
    for i, joint in enumerate(model.joints, 1):
        if joint.spring.stiffness:
            rows.append(
                (str(i), f"{joint.spring.stiffness:g} {joint.units.stiffness}", _position(joint, joint.spring.rest))
            )
    return ResultTable(title="Springs at the joints", heads=("joint", "stiffness", "at rest at"), rows=rows)


def _angle(value: float) -> str:
    return f"{math.degrees(value):g}°"


def _length(value: float) -> str:
    return f"{value * 1e3:zg} mm"


def _position(joint: Joint, value: float, per: str = "") -> str:
    if math.isinf(value):
        return "-"
    return f"{math.degrees(value):z.4g}°{per}" if joint.revolute else f"{value * 1e3:zg} mm{per}"
