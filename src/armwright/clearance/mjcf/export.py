"""The export of a linkage with closed pins and its path to MuJoCo: a model, the efforts of its drives, and a script.

The ideal joints make trees of bodies, and each pin with clearance closes a loop by a constraint of two points. A body's
axes are those of the linkage's file.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from importlib import resources
from itertools import pairwise
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np

from armwright.arrays import LARGEST, Array, exact_shape
from armwright.clearance.drive_tables import csv_text, drive_table
from armwright.clearance.elastic_rod import refuse_rods
from armwright.clearance.ideal import tip_position
from armwright.clearance.linkage import GROUND, Body, BodyPoint, Coordinate, Guide, Linkage, Pin
from armwright.clearance.plane_vectors import rotate
from armwright.clearance.scenario import Scenario
from armwright.errors import InvalidValueError

# A body that only slides needs no inertia, and MuJoCo one above 0 [kg m²].
_NO_INERTIA = 1e-12
# Constraints that are as stiff as MuJoCo has them; their time constant is two steps.
_SOLIMP = "0.9999 0.9999 0.001"


def mjcf_files(scenario: Scenario) -> dict[str, str]:
    """Return the files of a linkage on its path for MuJoCo, by name: script, model, efforts, and the tip to compare.

    Args:
        scenario: the prepared path; its step is that of the model. The clearances of the pins do not matter.

    Raises:
        InvalidValueError: there is a controller, a body is elastic, or a name cannot stand in a model.
    """
    refuse_rods("export to MuJoCo", scenario.linkage.rods)
    linkage = scenario.linkage
    if scenario.settings.control != "effort":
        raise InvalidValueError("MuJoCo has no counterpart for a controller; expected control by effort")
    ideal = scenario.ideal
    units = ["N" if isinstance(linkage.joint(drive.body), Guide) else "Nm" for drive in linkage.drives]
    heads = [f"{drive.body}_{unit}" for drive, unit in zip(linkage.drives, units, strict=True)]
    rows = slice(None, None, scenario.stride)
    time = np.arange(scenario.steps + 1)[rows] * scenario.h
    return {
        "run_linkage.py": resources.files("armwright.clearance.mjcf").joinpath("run_linkage.py").read_text("utf-8"),
        "linkage.xml": linkage_mjcf(linkage, ideal.q[0], ideal.qd[0], step=scenario.h),
        "drives.csv": csv_text(["time_s", *heads], drive_table(scenario, ideal.efforts)),
        "reference.csv": csv_text(
            ["time_s", "tip_x_m", "tip_y_m"], np.column_stack([time, tip_position(linkage, ideal.q[rows])])
        ),
    }


def linkage_mjcf(linkage: Linkage, q: Array, qd: Array, *, step: float) -> str:
    """Return a linkage with closed pins as a model of MuJoCo, whose keyframe ``start`` has a configuration.

    The actuators with names of bodies are its drives, in N m or N.

    Args:
        linkage: with n coordinates.
        q: (n,) closed coordinates [rad, m].
        qd: (n,) their speeds.
        step: of the simulation [s].

    Raises:
        InvalidValueError: a name has characters that no XML file can hold, a body's a colon, or one is called world.
        ShapeError: coordinates or speeds are not those of the joints of rigid bodies.
    """
    _check_names(linkage)
    root = Element("mujoco", model=linkage.name)
    SubElement(root, "compiler", angle="radian", autolimits="true")
    SubElement(root, "option", timestep=_numbers([step]), gravity=_numbers([*linkage.gravity, 0.0]), integrator="RK4")
    default = SubElement(root, "default")
    SubElement(default, "geom", contype="0", conaffinity="0", mass="0", rgba="0.45 0.6 0.8 1")
    SubElement(default, "equality", solref=_numbers([2 * step, 1.0]), solimp=_SOLIMP)
    world = SubElement(root, "worldbody")
    elements = {GROUND: world}
    radius = 0.02 * _extent(linkage)
    _add_looks(world, linkage.ground, radius)
    for body in linkage.bodies:
        elements[body.name] = _add_body(elements, linkage, body, radius)
    SubElement(elements[linkage.tip.body], "site", name="tip", pos=_vector(linkage.point(linkage.tip)))
    equality = SubElement(root, "equality")
    for pin in linkage.pins:
        SubElement(equality, "connect", name=pin.name, site1=str(pin.bearing), site2=str(pin.journal))
    actuator = SubElement(root, "actuator")
    for drive in linkage.drives:
        kind = "slide" if isinstance(linkage.joint(drive.body), Guide) else "angle"
        SubElement(actuator, "motor", name=drive.body, joint=f"{drive.body}.{kind}")
    for number, load in enumerate(linkage.loads, 1):
        # It pulls at a point against the origin of the ground, always as much.
        SubElement(
            actuator,
            "general",
            name=f"load {number} on {load.point}",
            site=str(load.point),
            refsite=GROUND,
            gear=_numbers([*load.force, 0.0, 0.0, 0.0, 0.0]),
            gainprm="0",
            biastype="affine",
            biasprm="1",
        )
    joints = (len(list(world.iter("joint"))),)
    q, qd = exact_shape(q, joints, "coordinates of rigid bodies", LARGEST), exact_shape(qd, joints, "speeds", LARGEST)
    keyframe = SubElement(root, "keyframe")
    SubElement(
        keyframe,
        "key",
        name="start",
        qpos=_numbers(joint_coordinates(linkage, q)),
        qvel=_numbers(joint_coordinates(linkage, qd, at_rest=True)),
    )
    indent(root)
    return f"<?xml version='1.0' encoding='utf-8'?>\n{tostring(root, encoding='unicode')}\n"


def joint_coordinates(linkage: Linkage, q: Array, *, at_rest: bool = False) -> Array:
    """Return the coordinates (..., n) of the model's joints: angles against the body that carries, slides, positions.

    Args:
        linkage: with n coordinates.
        q: (..., n) its coordinates, or their speeds.
        at_rest: whether they are speeds, of which no constant angle is taken.
    """
    q = np.asarray(q, dtype=np.float64)
    joints = np.array(q)
    zero = 0.0 if at_rest else linkage.zero
    directions = {GROUND: np.zeros(q.shape[:-1])}
    numbers = {coordinate: i for i, coordinate in enumerate(linkage.coordinates)}
    for body in linkage.bodies:
        joint = linkage.joint(body.name)
        if isinstance(joint, Guide):
            directions[body.name] = directions[joint.on.body] + (0.0 if at_rest else joint.angle)
            continue
        number = numbers[Coordinate(body.name, "angle")]
        directions[body.name] = q[..., number] + zero
        carrier = joint.on.body if isinstance(joint, Pin) else GROUND
        joints[..., number] = directions[body.name] - directions[carrier]
    return joints


def _add_body(elements: dict[str, Element], linkage: Linkage, body: Body, radius: float) -> Element:
    """Add a body to the one that carries it, where it is when all its joints are at 0."""
    joint = linkage.joint(body.name)
    angle = joint.angle if isinstance(joint, Guide) else 0.0
    own = body.centre if joint is None else body.points[joint.point]
    on = np.zeros(2) if joint is None else linkage.point(joint.on)
    position = on - rotate(own, np.asarray(angle))
    carrier = elements[GROUND if joint is None else joint.on.body]
    element = SubElement(carrier, "body", name=body.name, pos=_vector(position), euler=_numbers([0.0, 0.0, angle]))
    inertia = body.inertia or _NO_INERTIA
    SubElement(
        element, "inertial", pos=_vector(body.centre), mass=_numbers([body.mass]), diaginertia=_numbers([inertia] * 3)
    )
    if isinstance(joint, Guide):
        way = joint.direction - joint.angle
        axis = _vector([math.cos(way), math.sin(way)])
        SubElement(element, "joint", name=f"{body.name}.slide", type="slide", axis=axis)
    else:
        if joint is None:
            SubElement(element, "joint", name=f"{body.name}.x", type="slide", axis="1 0 0")
            SubElement(element, "joint", name=f"{body.name}.y", type="slide", axis="0 1 0")
        SubElement(element, "joint", name=f"{body.name}.angle", type="hinge", axis="0 0 1", pos=_vector(own))
    _add_looks(element, body, radius)
    return element


def _add_looks(element: Element, body: Body, radius: float) -> None:
    """Add the points of a body as sites, and bars between them."""
    if body.name == GROUND:
        SubElement(element, "site", name=GROUND)
    for name, point in body.points.items():
        site = str(BodyPoint(body.name, name))
        SubElement(element, "site", name=site, pos=_vector(point), size=_numbers([1.2 * radius]))
    if body.name == GROUND:
        return
    for start, end in pairwise(body.points.values()):
        if np.linalg.norm(end - start) > 0.1 * radius:
            ends = _numbers([*start, 0.0, *end, 0.0])
            SubElement(element, "geom", type="capsule", fromto=ends, size=_numbers([radius]))


def _extent(linkage: Linkage) -> float:
    """Return how far the points of a body are apart at most [m]; 1 where they are not apart."""
    spreads = [np.ptp(list(body.points.values()), axis=0).max() for body in linkage.bodies if body.points]
    return float(max(spreads, default=0.0)) or 1.0


def _check_names(linkage: Linkage) -> None:
    """Refuse names that a model cannot hold, or that it has for something else."""
    bodies = [body.name for body in linkage.bodies]
    points = [name for body in (linkage.ground, *linkage.bodies) for name in body.points]
    for name in (linkage.name, *bodies, *points, *(pin.name for pin in linkage.pins)):
        if not name.isprintable():
            raise InvalidValueError(f"name {name!r}: expected characters that can be printed, for a model of MuJoCo")
    for name in bodies:
        if ":" in name or name == "world":
            raise InvalidValueError(
                f"body {name!r}: expected a name other than 'world' and without a colon, for a model of MuJoCo"
            )


def _vector(point: Iterable[float]) -> str:
    return _numbers([*point, 0.0])


def _numbers(values: Iterable[float]) -> str:
    return " ".join(repr(float(x)) for x in values)
