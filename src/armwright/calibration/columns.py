"""The columns of a file of measurements, and which of them belong together."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

from armwright.arm.model import Arm
from armwright.files.column_names import ANGLE, LENGTH, MASS, NUMBER, Column, Schema
from armwright.files.unit_table import Header, read_header

NAMES = ("name", "pose", "step_order")
POINTS = ("x", "y", "z")
NOMINAL = ("x_nominal", "y_nominal", "z_nominal")
DEVIATIONS = ("x_deviation", "y_deviation", "z_deviation")
RPY = ("roll", "pitch", "yaw")
QUATERNION = ("qw", "qx", "qy", "qz")
DISTANCE = "distance"
PAYLOAD = ("payload", "payload_x", "payload_y", "payload_z")
_WORDS = (*NAMES, "set", "frame", "plane", "anchor", "to")


def joint_columns(arm: Arm) -> list[str]:
    """Return the names of the columns of the joints, in the order of the arm."""
    return [f"joint_{i + 1}" for i in range(arm.n)]


def position_columns(arm: Arm) -> list[Column]:
    """Return the columns of the joint positions, in the order of the arm. Joints also have the names of their URDF."""
    return [
        Column(
            name=name,
            quantity=ANGLE if joint.revolute else LENGTH,
            synonyms=(name, f"q{i}", joint.name),
            explanation=f"{arm.joint_label(i - 1)} of {arm.name} is {joint.kind}",
        )
        for i, (name, joint) in enumerate(zip(joint_columns(arm), arm.joints, strict=True), 1)
    ]


def measured_columns(arm: Arm) -> Schema:
    """Return the columns that measurements of an arm may have."""
    joints = position_columns(arm)
    points = [Column(name=name, quantity=LENGTH, group="coordinates") for name in POINTS]
    group = "nominal coordinates and deviations"
    deviations = [
        Column(name=f"{axis}_{what}", quantity=LENGTH, group=group, synonyms=(f"{axis}_{short}", f"{short}_{axis}"))
        for what, short in (("nominal", "t"), ("deviation", "dif"))
        for axis in POINTS
    ]
    angles = [Column(name=name, quantity=ANGLE, group="angles") for name in RPY]
    others = [Column(name=name, quantity=NUMBER) for name in QUATERNION]
    words = [Column(name=name) for name in _WORDS]
    distance = Column(name=DISTANCE, quantity=LENGTH)
    payload = [Column(name=name, quantity=LENGTH if name in PAYLOAD[1:] else MASS) for name in PAYLOAD]

    def explain(name: str) -> str:
        """Say what a joint is that the arm has not."""
        joint = re.match(r"joint_\d", name)
        return f"{arm.name} has {arm.n} joints; is this a measurement of another arm?" if joint else ""

    return Schema(
        columns=(*joints, *points, *angles, *others, distance, *payload, *deviations, *words), explain=explain
    )


def read_columns(
    path: Path | str, arm: Arm, *, columns: Mapping[str, str] | None, units: Mapping[str, str]
) -> tuple[Header, tuple[str, ...], tuple[str, ...]]:
    """Read which columns a file of measurements has.

    Args:
        path: the file.
        arm: that was measured.
        columns: names of columns by those in the file.
        units: for columns whose names have none.

    Returns:
        The header; the columns of the position of the tool, points or nominal points and deviations from them; and
        those of its orientation. Either may be empty.

    Raises:
        FileFormatError: the file is missing or empty; a column is missing, unknown, there twice or without unit; joints
            are not those of the arm.
    """
    header = read_header(path, measured_columns(arm), columns=columns, units=units)
    joints = joint_columns(arm)
    count = len(header.columns_present(joints))
    header.require(joints, f"{arm.name} has {arm.n} joints, and the file has {count}")
    points, deviations, angles, quaternion = map(header.columns_present, (POINTS, DEVIATIONS, RPY, QUATERNION))
    if points and deviations:
        raise header.error("x", f"give the points, or nominal points and deviations, not both: {header.listing}")
    if angles and quaternion:
        raise header.error("qw", f"give roll, pitch and yaw, or a quaternion, not both: {header.listing}")
    orientation = RPY if angles else QUATERNION if quaternion else ()
    position: tuple[str, ...] = POINTS
    if not points and (deviations or header.columns_present(NOMINAL)):
        position = (*NOMINAL, *DEVIATIONS)
    elif not points and not orientation and header.columns_present(("plane", DISTANCE)):
        position = ()
    header.require((*position, *orientation))
    _require_related(header)
    return header, position, orientation


def _require_related(header: Header) -> None:
    """Refuse columns that lack what they belong to."""
    labels = header.columns_present(NAMES)
    if len(labels) > 1:
        raise header.error(labels[1], f"rows have a single name, and column {labels[0]} contains it")
    if DISTANCE in header and not header.columns_present(("anchor", "to")):
        raise header.error(DISTANCE, "expected a column anchor, or a column to with names of rows, beside it")
    for name in header.columns_present(("anchor", "to")):
        header.require([DISTANCE], f"a row with {name} has a distance")
    for name in header.columns_present(PAYLOAD[1:]):
        header.require(PAYLOAD[:1], f"{name} is of the centre of mass of a payload")
    if "to" in header and not labels:
        header.require(["name"], "column to has names of rows")
