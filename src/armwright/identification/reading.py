"""Logs from files: CSV whose column names have units, with times, joint positions, and efforts or motor currents.

``time_s, joint_1_deg, ..., joint_1_effort_nm, ...`` or ``joint_1_current_a, ...``, with ``joint_1_velocity_deg_per_s``
where velocities were measured. The names of ``motion.csv`` (t, q1, qd1, tau1) are known, in SI units. Recordings are
read by ``recordings``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import ArrayLike
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.errors import FileFormatError, InvalidValueError
from armwright.files import column_names as names
from armwright.files.unit_table import Header, read_headers
from armwright.identification.log import Log, with_gains
from armwright.identification.recordings import is_recording, read_recording


def read_logs(
    paths: Sequence[Path | str],
    arm: Arm,
    *,
    gains: ArrayLike | None = None,
    columns: Mapping[str, str] | None = None,
    skip_incomplete: bool = False,
    model_efforts: bool = False,
    topic: str | None = None,
    joint_names: Sequence[str] = (),
) -> list[Log]:
    """Read logs of one arm.

    Args:
        paths: CSV files, MCAP files, databases ``.db3`` of ROS 2, or folders of bags.
        arm: that moved, with n joints.
        gains: (n,) effort at the joint per current [N m/A] or [N/A], for logs of currents; with them the efforts of
            recordings, which have no units, are currents.
        columns: names of columns, with unit, by those in the files: ``{"i_1": "joint_1_current_a"}``; of recordings
            names of joints: ``{"elbow": "joint_3"}``.
        skip_incomplete: leave out rows with empty cells.
        model_efforts: take the efforts of the arm's model where a CSV file has neither efforts nor currents.
        topic: of the joint states in recordings; the only one with efforts that is no plan when left out.
        joint_names: (n,) names of the joints in recordings, where the arm has none.

    Raises:
        FileFormatError: a file is missing or broken, a column is missing or has another unit, or a value is no number.
        InvalidValueError: a log has currents, and there are no gains; it has no efforts, and the arm has no masses; its
            times go back; several topics may be meant.
        UnknownNameError: a recording has no such topic.
        MissingExtraError: what reads a recording is not installed.
    """
    recorded = [is_recording(Path(path)) for path in paths]
    tables = [path for path, is_recorded in zip(paths, recorded, strict=True) if not is_recorded]
    if topic is not None and len(tables) == len(paths):
        raise InvalidValueError(f"topic: expected an MCAP file or a bag, got {Path(paths[0]).name}")
    headers = iter(read_headers(tables, _schema(arm), columns=columns) if tables else [])
    return [
        read_recording(Path(path), arm, gains=gains, topic=topic, renamed=columns, joint_names=joint_names)
        if is_recorded
        else _read(next(headers), arm, gains, skip_incomplete=skip_incomplete, model_efforts=model_efforts)
        for path, is_recorded in zip(paths, recorded, strict=True)
    ]


def _read(header: Header, arm: Arm, gains: ArrayLike | None, *, skip_incomplete: bool, model_efforts: bool) -> Log:
    joints = range(1, arm.n + 1)
    positions, velocities, efforts, currents = (
        [f"{symbol}{i}" for i in joints] for symbol in ("q", "qd", "tau", "current")
    )
    has_currents = bool(header.columns_present(currents))
    if has_currents and header.columns_present(efforts):
        raise header.error(currents[0], f"expected efforts or currents, but the file has both: {header.listing}")
    driven = currents if has_currents else efforts
    if model_efforts and not header.columns_present(driven):
        driven = []
    header.require(["t", *positions, *driven], f"{arm.name} has {arm.n} joints")
    measured = velocities if header.columns_present(velocities) else []
    header.require(measured, "where some joints have velocities, all have")
    table = header.rows(filled=["t", *positions, *driven, *measured], skip_incomplete=skip_incomplete)
    if has_currents and gains is None:
        raise InvalidValueError(
            f"{table.path}: currents need gains, the effort at each joint per current: --gains 11.5,9.8,..., or two "
            "logs without and with a known load"
        )
    t = table.numbers(["t"])[:, 0]
    wrong = np.flatnonzero(np.diff(t) < 0)
    if len(wrong):
        row = int(wrong[0]) + 1
        raise table.error(row, "t", f"expected times that increase, got {t[row]:.6g} s after {t[row - 1]:.6g} s")
    velocity = table.numbers(measured) if measured else None
    try:
        q = table.numbers(positions)
        log = Log.of_readings(table.path.name, t, q, table.numbers(driven) if driven else np.zeros_like(q), velocity)
    except InvalidValueError as error:
        raise FileFormatError(table.path, None, "", str(error)) from error
    if not driven:
        return _with_model_efforts(log, arm)
    return with_gains(log, gains) if has_currents and gains is not None else log


def _with_model_efforts(log: Log, arm: Arm) -> Log:
    """Return a log whose efforts are those that the model of the arm needs for its motion."""
    if arm.massless:
        raise InvalidValueError(f"{log.name}: expected columns of efforts, since {arm.name} has no masses")
    qd = np.gradient(log.q, log.t, axis=0) if log.qd is None else log.qd
    effort = inverse_dynamics(arm, log.q, qd, np.gradient(qd, log.t, axis=0))
    note = f"{log.name}: it has no efforts; those of the model of {arm.name} are taken"
    return attrs.evolve(log, effort=effort, notes=(*log.notes, note))


def _schema(arm: Arm) -> names.Schema:
    columns = [names.Column(name="t", quantity=names.TIME, unit="s", synonyms=("time", "timestamp"))]
    for i, joint in enumerate(arm.joints, 1):
        own = tuple(name for name in (f"joint_{i}", joint.name) if name)

        def column(
            symbol: str, kind: names.Quantity, unit: str, *words: str, own: tuple[str, ...] = own
        ) -> names.Column:
            synonyms = tuple(f"{name}_{word}".rstrip("_") for name in own for word in words)
            return names.Column(name=symbol, quantity=kind, unit=unit, synonyms=synonyms)

        turning = joint.revolute
        columns += [
            column(f"q{i}", names.ANGLE if turning else names.LENGTH, "rad" if turning else "m", "", "position"),
            column(
                f"qd{i}",
                names.ANGULAR_VELOCITY if turning else names.VELOCITY,
                "rad_per_s" if turning else "m_per_s",
                "velocity",
            ),
            column(
                f"tau{i}",
                names.TORQUE if turning else names.FORCE,
                "nm" if turning else "n",
                "effort",
                "torque",
                "force",
            ),
            column(f"current{i}", names.CURRENT, "a", "current"),
        ]
    return names.Schema(columns=columns, ignores_unknown=True)
