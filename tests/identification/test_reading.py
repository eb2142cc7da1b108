"""Logs from files: units in the names of columns, other names, currents with gains, and what is wrong in a word."""

from pathlib import Path

import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.errors import FileFormatError, InvalidValueError
from armwright.identification import read_logs

ARM = load_arm("ntu-3r")
T = np.arange(60) / 100
Q = np.stack([np.sin(T), np.cos(T), T], axis=1)


def _csv(folder: Path, head: str, rows: np.ndarray) -> Path:
    path = folder / "log.csv"
    path.write_text("\n".join([head, *(",".join(f"{x:.9g}" for x in row) for row in rows)]) + "\n")
    return path


def test_units_are_those_of_the_columns(tmp_path: Path) -> None:
    """Milliseconds, degrees and millinewton metres come out in SI units, whatever the order of the columns."""
    head = "joint_3_effort_mnm,time_ms," + ",".join(f"joint_{i}_deg" for i in (1, 2, 3)) + ",tau1,tau2"
    path = _csv(tmp_path, head, np.column_stack([1e3 * Q[:, 2], 1e3 * T, np.degrees(Q), Q[:, :2]]))

    (log,) = read_logs([path], ARM)

    np.testing.assert_allclose(log.t, T, atol=1e-9)
    np.testing.assert_allclose(log.q, Q, atol=1e-8)
    np.testing.assert_allclose(log.effort, Q, atol=1e-8)
    assert log.qd is None


def test_motion_tables_and_velocities_are_known(tmp_path: Path) -> None:
    """The names of motion.csv are known, in SI units, and other columns are ignored."""
    head = "t,arm," + ",".join(f"{name}{i}" for name in ("q", "qd", "qdd", "tau") for i in (1, 2, 3))
    path = _csv(tmp_path, head.replace("arm,", ""), np.column_stack([T, Q, 2 * Q, 3 * Q, 4 * Q]))

    (log,) = read_logs([path], ARM)

    np.testing.assert_allclose(log.qd, 2 * Q, atol=1e-8)
    np.testing.assert_allclose(log.effort, 4 * Q, atol=1e-8)


def test_columns_may_have_other_names_and_currents_need_gains(tmp_path: Path) -> None:
    """A map of columns names those of a robot; currents are efforts with gains, and without them refused."""
    path = _csv(tmp_path, "stamp,a,b,c,i_0,i_1,i_2", np.column_stack([T, Q, Q]))
    columns = {"stamp": "time_s", "a": "q1", "b": "q2", "c": "q3"} | {f"i_{k}": f"current{k + 1}_a" for k in range(3)}

    (log,) = read_logs([path], ARM, columns=columns, gains=[1.0, -2.0, 3.0])

    np.testing.assert_allclose(log.effort, Q * [1.0, -2.0, 3.0], atol=1e-8)
    with pytest.raises(InvalidValueError, match="currents need gains"):
        read_logs([path], ARM, columns=columns)


@pytest.mark.parametrize(
    ("head", "message"),
    [
        ("t,q1,q2,q3,tau1,tau2,tau4", "tau3: no such column; ntu-3r has 3 joints"),
        ("t,q1_mm,q2,q3,tau1,tau2,tau3", "q1: no such column"),
        ("t,q1,q2,q3,tau1_a,tau2,tau3", "tau1: no such column"),
        ("t,q1,q2,q3,tau1,tau2,tau3,qd1", "where some joints have velocities, all have"),
        ("t,q1,q2,q3,tau1,tau2,tau3,current1_a", "efforts or currents, but the file has both"),
    ],
)
def test_says_which_column_is_wrong(tmp_path: Path, head: str, message: str) -> None:
    """A missing column, a unit of another quantity, and both of two are refused by name."""
    path = _csv(tmp_path, head, np.column_stack([T, Q, Q, Q[:, 0]])[:, : len(head.split(","))])
    with pytest.raises(FileFormatError, match=message):
        read_logs([path], ARM)


def test_times_must_increase(tmp_path: Path) -> None:
    """A time that goes back is refused with its line."""
    t = T.copy()
    t[30] = 0.1
    path = _csv(tmp_path, "t,q1,q2,q3,tau1,tau2,tau3", np.column_stack([t, Q, Q]))
    with pytest.raises(FileFormatError, match=r"log.csv:32: t: expected times that increase, got 0.1 s after 0.29 s"):
        read_logs([path], ARM)


def test_repeated_times_are_left_out_and_told(tmp_path: Path) -> None:
    """Of two readings of one time the first is kept."""
    rows = np.repeat(np.column_stack([T, Q, Q]), np.where(np.arange(60) % 20 == 3, 2, 1), axis=0)
    rows[4, 1:] += 1
    path = _csv(tmp_path, "t,q1,q2,q3,tau1,tau2,tau3", rows)

    (log,) = read_logs([path], ARM)

    np.testing.assert_allclose(log.q, Q, atol=1e-8)
    assert log.notes == ("log.csv: 3 readings repeat the time of the one before, and are left out",)
