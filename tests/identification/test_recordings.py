"""Logs from MCAP files and bags of ROS 2: joints by name, topics, currents, and what is wrong in a word."""

import sys
from collections.abc import Callable
from pathlib import Path

import attrs
import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer as BagWriter

from armwright.arm.load import load_arm
from armwright.errors import (
    ArmwrightError,
    FileFormatError,
    InvalidValueError,
    MissingExtraError,
    UnknownNameError,
)
from armwright.identification import read_logs
from armwright.identification.recordings import read_recording
from cli_calls import armwright
from files.logs_of_others import EPOCH, NAMES, ROS2, database, json_log, motion, ros_state, ros_types
from identification.simulated import log, truth

PLAIN = load_arm("ntu-3r")
# The joints of the recordings, in another order.
ARM = attrs.evolve(
    PLAIN, joints=[attrs.evolve(j, name=n) for j, n in zip(PLAIN.joints, ("wrist", "shoulder", "elbow"), strict=True)]
)
ORDER = [2, 0, 1]
T = np.arange(80) * 0.008
Q = motion(T)


def bag(folder: Path, topics: dict[str, tuple[str, ...]], *, plugin: StoragePlugin = StoragePlugin.MCAP) -> Path:
    """Write a bag in which each topic has the same states, of joints with its names."""
    types = ros_types()
    with BagWriter(folder, version=9, storage_plugin=plugin) as writer:
        for topic, names in topics.items():
            connection = writer.add_connection(topic, ROS2, typestore=types)
            for t, row in zip(T, Q, strict=True):
                stamp = EPOCH + round(t * 1e9)
                state = ros_state(types, stamp, np.resize(row, len(names)), names)
                writer.write(connection, stamp, types.serialize_cdr(state, ROS2))
    return folder


@pytest.mark.parametrize("kind", ["mcap", "sqlite", "database", "file"])
def test_joints_are_found_by_their_names(kind: str, tmp_path: Path) -> None:
    """Of a bag, its file or a database, the joints come in the order of the arm; times begin at 0."""
    if kind == "database":
        path = database(tmp_path / "a.db3", T, Q)
    else:
        plugin = StoragePlugin.SQLITE3 if kind == "sqlite" else StoragePlugin.MCAP
        path = bag(tmp_path / "bag", {"/joint_states": NAMES}, plugin=plugin)
        path = next(path.glob("*.mcap")) if kind == "file" else path

    (read,) = read_logs([path], ARM)

    assert read.name == path.name
    np.testing.assert_allclose(read.t, T, atol=1e-9)
    np.testing.assert_array_equal(read.q, Q[:, ORDER])
    np.testing.assert_array_equal(read.effort, -Q[:, ORDER])
    np.testing.assert_array_equal(read.qd, 10 * Q[:, ORDER])
    assert read.notes == ()


def test_joints_without_common_names_keep_their_order_and_that_is_told(tmp_path: Path) -> None:
    """An arm whose joints have no names takes them in the order of the recording, by a map, or by given names."""
    path = bag(tmp_path / "bag", {"/joint_states": NAMES})

    (ordered,) = read_logs([path], PLAIN)
    (mapped,) = read_logs([path], PLAIN, columns={"wrist": "joint_1", "shoulder": "joint_2", "elbow": "joint_3"})
    (named,) = read_logs([path], PLAIN, joint_names=["wrist", "shoulder", "elbow"])

    np.testing.assert_array_equal(ordered.q, Q)
    assert ordered.notes == ("bag: its joints are taken in their order: shoulder, elbow, wrist",)
    np.testing.assert_array_equal(mapped.q, Q[:, ORDER])
    np.testing.assert_array_equal(named.q, Q[:, ORDER])
    assert mapped.notes == named.notes == ()


def test_efforts_are_currents_where_gains_are_given(tmp_path: Path) -> None:
    """Recordings have no units: with gains their efforts are currents."""
    path = bag(tmp_path / "bag", {"/joint_states": NAMES})
    (read,) = read_logs([path], ARM, gains=[2.0, -3.0, 4.0])
    np.testing.assert_array_equal(read.effort, -Q[:, ORDER] * [2.0, -3.0, 4.0])


def test_topics_are_chosen_or_named(tmp_path: Path) -> None:
    """Plans and topics of other joints are not meant; of two that may be, one must be named."""
    hand = ("finger",)
    one = bag(tmp_path / "one", {"/planned/states": NAMES, "/states": NAMES, "/hand": hand})
    two = bag(tmp_path / "two", {"/left/states": NAMES, "/right/states": NAMES})

    assert len(read_logs([one], ARM)) == 1
    assert len(read_logs([two], ARM, topic="/right/states")) == 1
    with pytest.raises(InvalidValueError, match="several topics have joint states: /left/states, /right/states"):
        read_logs([two], ARM)
    with pytest.raises(UnknownNameError, match="topic '/rihgt/states'"):
        read_logs([two], ARM, topic="/rihgt/states")


def _no_efforts(folder: Path) -> Path:
    return json_log(folder / "a.mcap", T, Q)


def _another_arm(folder: Path) -> Path:
    return bag(folder / "bag", {"/joint_states": ("shoulder", "elbow", "hand", "thumb")})


def _empty(folder: Path) -> Path:
    (folder / "empty").mkdir()
    return folder / "empty"


def _text(folder: Path) -> Path:
    (folder / "a.mcap").write_text("t,q1\n")
    return folder / "a.mcap"


def _missing(folder: Path) -> Path:
    return folder / "none.db3"


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (_no_efforts, FileFormatError, "expected positions and efforts, and it has no efforts"),
        (_another_arm, FileFormatError, "no joint wrist, only shoulder, elbow, hand, thumb; --columns NAME=joint_1"),
        (_empty, FileFormatError, "there is no .mcap or .db3 file in it"),
        (_text, FileFormatError, "expected an MCAP file or a .db3 of ROS 2"),
        (_missing, FileFormatError, "no such file"),
    ],
    ids=lambda value: getattr(value, "__name__", None),
)
def test_says_what_is_wrong(
    make: Callable[[Path], Path], error: type[ArmwrightError], message: str, tmp_path: Path
) -> None:
    """What a recording lacks is said by name."""
    with pytest.raises(error, match=message):
        read_logs([make(tmp_path)], ARM)


def test_a_topic_needs_a_recording_and_readings(tmp_path: Path) -> None:
    """A topic is none of a CSV file, and a few readings are no log."""
    with pytest.raises(InvalidValueError, match=r"topic: expected an MCAP file or a bag, got log\.csv"):
        read_logs([tmp_path / "log.csv"], ARM, topic="/joint_states")
    short = database(tmp_path / "a.db3", T[:20], Q[:20])
    with pytest.raises(FileFormatError, match="expected at least 50 readings, got 20"):
        read_logs([short], ARM)


def test_says_which_extra_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the libraries of the extra the message has the command that installs it."""
    path = json_log(tmp_path / "a.mcap", T, Q)
    monkeypatch.setitem(sys.modules, "mcap.records", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'armwright\[logs\]'"):
        read_recording(path, ARM)


def test_identify_reads_a_bag(rng: np.random.Generator, tmp_path: Path) -> None:
    """A bag tells what a CSV file with the same readings tells."""
    pytest.importorskip("clarabel", reason="the extra identification is not installed")
    arm = truth()
    reading = log(arm, rng, seconds=10.0)
    names = [f"joint_{i}" for i in range(1, 7)]
    types = ros_types()
    with BagWriter(tmp_path / "bag", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connection = writer.add_connection("/joint_states", ROS2, typestore=types)
        for t, q, tau in zip(reading.t, reading.q, reading.effort, strict=True):
            stamp = EPOCH + round(t * 1e9)
            state = ros_state(types, stamp, q, names, more=False)
            state.effort = tau
            writer.write(connection, stamp, types.serialize_cdr(state, ROS2))
    heads = ["t", *(f"q{i}" for i in range(1, 7)), *(f"tau{i}" for i in range(1, 7))]
    table = np.column_stack([reading.t, reading.q, reading.effort])
    np.savetxt(tmp_path / "log.csv", table, delimiter=",", header=",".join(heads), comments="")

    found = [
        armwright("identify", "puma560", tmp_path / name, "-o", tmp_path / f"of_{name}", "--quiet")
        for name in ("bag", "log.csv")
    ]

    for done in found:
        assert done.returncode == 0, done.stderr
    bag_arm, csv_arm = (load_arm(tmp_path / f"of_{name}" / "arm.toml") for name in ("bag", "log.csv"))
    for one, other in zip(bag_arm.links, csv_arm.links, strict=True):
        assert one.mass == pytest.approx(other.mass, rel=1e-4)
        np.testing.assert_allclose(one.com, other.com, atol=1e-5)
    assert bag_arm.motor_values("viscous") == pytest.approx(csv_arm.motor_values("viscous"), rel=1e-4)
