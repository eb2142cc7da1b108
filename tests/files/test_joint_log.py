"""Joint states out of logs: whoever wrote them, and whatever is wrong with them."""

import json
import re
import sqlite3
import struct
from pathlib import Path

import numpy as np
import pytest
import zstandard
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from mcap.writer import CompressionType
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer as BagWriter

from armwright.errors import ArmwrightError, FileFormatError, TooFewError, UnknownNameError
from armwright.files.limits import raised
from armwright.files.logs import joint_log
from armwright.files.logs.joint_log import JointStates, read_joint_log
from files.logs_of_others import (
    EPOCH,
    NAMES,
    ROS2,
    chunk,
    database,
    json_log,
    mcap_file,
    motion,
    record,
    ros_state,
    ros_types,
)

T = np.arange(200) * 0.008
Q = motion(T)
MAGIC = b"\x89MCAP0\r\n"


def assert_read(states: JointStates, *, more: bool) -> None:
    """Compare what was read with what was written, to the last bit; times to a nanosecond."""
    assert states.names == NAMES
    np.testing.assert_allclose(states.t, T, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(states.q, Q)
    expected = (10 * Q, -Q) if more else (np.full_like(Q, np.nan), np.full_like(Q, np.nan))
    np.testing.assert_array_equal(states.qd, expected[0])
    np.testing.assert_array_equal(states.tau, expected[1])


def times() -> list[int]:
    """Return the times of the rows [ns]."""
    return [EPOCH + round(t * 1e9) for t in T]


@pytest.mark.parametrize("compression", list(CompressionType))
def test_json(compression: CompressionType, tmp_path: Path) -> None:
    """Joint states of Foxglove in JSON, in chunks of every compression, come out bit by bit."""
    path = json_log(tmp_path / "a.mcap", T, Q)
    text = path.read_bytes()
    assert text.startswith(MAGIC)
    joints = [[{"name": n, "position": x} for n, x in zip(NAMES, row, strict=True)] for row in Q.tolist()]
    messages = [
        (0, time, json.dumps({"timestamp": {"sec": time // 10**9, "nsec": time % 10**9}, "joints": row}).encode())
        for time, row in zip(times(), joints, strict=True)
    ]
    channels = [("/joint_states", "foxglove.JointStates", "json", "jsonschema", b"{}")]
    mcap_file(tmp_path / "a.mcap", channels, messages, compression=compression, chunk_size=4000)

    log = read_joint_log(tmp_path / "a.mcap")

    assert_read(log.topics["/joint_states"], more=False)
    assert (log.start, log.about, log.lines) == (EPOCH, {}, ())


@pytest.mark.parametrize(
    ("plugin", "mode"),
    [
        (StoragePlugin.MCAP, CompressionMode.NONE),
        (StoragePlugin.MCAP, CompressionMode.STORAGE),
        (StoragePlugin.SQLITE3, CompressionMode.NONE),
    ],
)
def test_bags_of_ros2(plugin: StoragePlugin, mode: CompressionMode, tmp_path: Path) -> None:
    """Bags of ROS 2 are read by their folder, whatever stores their messages."""
    types = ros_types()
    writer = BagWriter(tmp_path / "bag", version=9, storage_plugin=plugin)
    writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        topic = writer.add_connection("/joint_states", ROS2, typestore=types)
        other = writer.add_connection("/note", "std_msgs/msg/String", typestore=types)
        for time, row in zip(times(), Q, strict=True):
            writer.write(topic, time + 10**6, types.serialize_cdr(ros_state(types, time, row), ROS2))
        note = types.types["std_msgs/msg/String"]("hello")
        writer.write(other, EPOCH, types.serialize_cdr(note, "std_msgs/msg/String"))

    log = read_joint_log(tmp_path / "bag")

    # The stamp of a message counts, not the millisecond later when it was recorded.
    assert_read(log.topics["/joint_states"], more=True)
    assert list(log.topics) == ["/joint_states"]


def test_database_of_the_recorder(tmp_path: Path) -> None:
    """A database is read without its metadata, as a recorder that was killed leaves it."""
    assert_read(read_joint_log(database(tmp_path / "a.db3", T, Q)).topics["/joint_states"], more=True)


def test_messages_of_ros1(tmp_path: Path) -> None:
    """Messages of ROS 1 that were converted to MCAP are read too."""
    types = ros_types("ROS1_NOETIC")
    messages = [
        (0, time, bytes(types.serialize_ros1(ros_state(types, time, row), ROS2)))
        for time, row in zip(times(), Q, strict=True)
    ]
    channels = [("/joint_states", "sensor_msgs/JointState", "ros1", "ros1msg", b"")]

    log = read_joint_log(mcap_file(tmp_path / "a.mcap", channels, messages))

    assert_read(log.topics["/joint_states"], more=True)


def joint_states_of_foxglove() -> descriptor_pb2.FileDescriptorSet:
    """Return the definition of foxglove.JointStates as its package has it."""
    field = descriptor_pb2.FieldDescriptorProto
    time = descriptor_pb2.FileDescriptorProto(name="google/protobuf/timestamp.proto", package="google.protobuf")
    stamp = time.message_type.add(name="Timestamp")
    stamp.field.add(name="seconds", number=1, type=field.TYPE_INT64, label=field.LABEL_OPTIONAL)
    stamp.field.add(name="nanos", number=2, type=field.TYPE_INT32, label=field.LABEL_OPTIONAL)
    file = descriptor_pb2.FileDescriptorProto(
        name="foxglove/JointStates.proto", package="foxglove", syntax="proto3", dependency=[time.name]
    )
    joint = file.message_type.add(name="JointState")
    joint.field.add(name="name", number=1, type=field.TYPE_STRING, label=field.LABEL_OPTIONAL)
    for number, name in enumerate(("position", "velocity", "acceleration", "effort"), 2):
        joint.oneof_decl.add(name=f"_{name}")
        joint.field.add(
            name=name, number=number, type=field.TYPE_DOUBLE, label=field.LABEL_OPTIONAL, proto3_optional=True,
            oneof_index=number - 2,
        )  # fmt: skip
    states = file.message_type.add(name="JointStates")
    states.field.add(
        name="timestamp", number=1, type=field.TYPE_MESSAGE, label=field.LABEL_OPTIONAL,
        type_name=".google.protobuf.Timestamp",
    )  # fmt: skip
    states.field.add(
        name="joints", number=2, type=field.TYPE_MESSAGE, label=field.LABEL_REPEATED, type_name=".foxglove.JointState"
    )
    return descriptor_pb2.FileDescriptorSet(file=[time, file])


def test_protobuf(tmp_path: Path) -> None:
    """Joint states of Foxglove in Protobuf are read by the definition in the file; a number of 0 is no missing one."""
    definition = joint_states_of_foxglove()
    pool = descriptor_pool.DescriptorPool()
    for file in definition.file:
        pool.Add(file)
    kind = message_factory.GetMessageClass(pool.FindMessageTypeByName("foxglove.JointStates"))
    messages = []
    for time, row in zip(times(), Q.tolist(), strict=True):
        message = kind()
        message.timestamp.seconds, message.timestamp.nanos = divmod(time, 10**9)
        for name, x in zip(NAMES, row, strict=True):
            message.joints.add(name=name, position=x, velocity=0.0)
        messages.append((0, time, message.SerializeToString()))
    channels = [("/joints", "foxglove.JointStates", "protobuf", "protobuf", definition.SerializeToString())]

    states = read_joint_log(mcap_file(tmp_path / "a.mcap", channels, messages)).topics["/joints"]

    np.testing.assert_array_equal(states.q, Q)
    np.testing.assert_array_equal(states.qd, np.zeros_like(Q))
    assert np.isnan(states.tau).all()


def test_joints_that_come_and_go(tmp_path: Path) -> None:
    """Messages may name other joints, in another order: each has its column, and rows are in the order of time."""
    states = [(2, ["b", "a"], [20, 10]), (1, ["a"], [11]), (3, ["c", "a"], [33, 13])]
    messages = [
        (0, EPOCH + t * 10**9, json.dumps({"name": names, "position": values}).encode()) for t, names, values in states
    ]
    path = mcap_file(tmp_path / "a.mcap", [("/x", ROS2, "json", "jsonschema", b"{}")], messages)

    read = read_joint_log(path).topics["/x"]

    assert read.names == ("b", "a", "c")
    np.testing.assert_array_equal(read.t, [0, 1, 2])
    np.testing.assert_array_equal(read.q, [[np.nan, 11, np.nan], [20, 10, np.nan], [np.nan, 13, 33]])
    np.testing.assert_array_equal(read.of_joints(("a", "b")).q, read.q[:, [1, 0]])
    with pytest.raises(UnknownNameError, match="no joint 'd'"):
        read.of_joints(("d",))


# ---- what is wrong ---------------------------------------------------------------------------------------------------


def refused(path: Path, kind: type[ArmwrightError] = FileFormatError) -> str:
    """Return the one line that refuses a log."""
    with pytest.raises(kind) as caught:
        read_joint_log(path)
    text = str(caught.value)
    assert "\n" not in text
    assert len(text) < 600
    return text


def test_no_joint_states(tmp_path: Path) -> None:
    """A log without joint states is refused, and the topics that there are are named."""
    path = mcap_file(tmp_path / "a.mcap", [("/image", "sensor_msgs/msg/Image", "cdr", "ros2msg", b"")], [(0, 0, b"x")])

    assert "no joint states; topics of the log: /image (sensor_msgs/msg/Image)" in refused(path, TooFewError)


def test_names_in_one_line(tmp_path: Path) -> None:
    """Names of topics and types with line ends and escape codes are told in one line."""
    odd = ("/a\n\x1b[31m", "x\ny", "cdr", "ros2msg", b"")
    path = mcap_file(tmp_path / "a.mcap", [odd], [(0, 0, b"x")])
    assert r"topics of the log: /a\n\x1b[31m (x\ny)" in refused(path, TooFewError)

    path = mcap_file(tmp_path / "b.mcap", [(odd[0], "foxglove.JointStates", "json", "", b"")], [(0, 0, b"x")])
    assert r"b.mcap: /a\n\x1b[31m: a message" in refused(path)
    base = sqlite3.connect(database(tmp_path / "c.db3", T, Q))
    base.execute("UPDATE topics SET name = ?", (odd[0],))
    base.commit()
    base.close()
    assert list(read_joint_log(tmp_path / "c.db3").topics) == [r"/a\n\x1b[31m"]


@pytest.mark.parametrize("part", [0.1, 0.5, 0.9, 0.999])
def test_ends_early(part: float, tmp_path: Path) -> None:
    """A file that was cut anywhere is refused, and what mends it is named where it may help."""
    path = json_log(tmp_path / "a.mcap", T, Q)
    whole = path.read_bytes()
    end = whole.index(record(15, struct.pack("<I", 0)))
    path.write_bytes(whole[: int(part * end)])

    assert re.search("ends early|cannot be unpacked", refused(path))
    path.write_bytes(whole[:end])
    assert "mcap recover" in refused(path)


@pytest.mark.parametrize(
    ("body", "message"),
    [
        (b"", "ends before its end record"),
        (record(5, b"\x01\x00"), "a record is damaged"),
        (record(5, bytes(22)), "a message of channel 0, which the file does not describe"),
        (struct.pack("<BQ", 6, 2**63), r"a record of 9223372036854775808 bytes ends early: 0 bytes are left"),
        (struct.pack("<BQ", 4, 2**62) + b"x", "bytes ends early: 1 bytes are left"),
        (record(4, struct.pack("<HHI", 1, 0, 2**31) + b"x"), "a record"),
        (record(3, struct.pack("<HI", 1, 3) + b"\xff\xfe\xfd"), "a record is damaged: UnicodeDecodeError"),
        (chunk(b"abc", "zstd", 3), "a chunk cannot be unpacked"),
        (record(6, bytes(32) + struct.pack("<Q", 2**64 - 1)), "a record is damaged: OverflowError"),
        (chunk(b"abcdefghijklmnop", "lz4", 3), "a chunk cannot be unpacked"),
        (chunk(b"abc", "rar", 3), "a chunk is compressed by 'rar'; expected zstd, lz4, or not at all"),
        (chunk(b"abc", "", 4), "a chunk is said to unpack to 4 bytes, and does not"),
        (chunk(b"abc", "", 2**62), "too large: 4,611,686,018,427 MB; the limit is 256 MB"),
    ],
)
def test_damaged_records(body: bytes, message: str, tmp_path: Path) -> None:
    """Records that contradict themselves are refused before any memory is taken for what they say."""
    (tmp_path / "a.mcap").write_bytes(MAGIC + body)

    assert re.search(message, refused(tmp_path / "a.mcap"))


def test_bombs(tmp_path: Path) -> None:
    """A few bytes that unpack to gigabytes are unpacked no farther than they are said to be, nor beyond the limits."""
    bomb = zstandard.compress(record(128, bytes(50_000_000 - 9)), 19)
    assert len(bomb) < 5000
    path = tmp_path / "a.mcap"
    path.write_bytes(MAGIC + chunk(bomb, "zstd", 1000))
    assert "is said to unpack to 1000 bytes" in refused(path)
    path.write_bytes(MAGIC + 40 * chunk(bomb, "zstd", 50_000_000))
    with raised(log_unpacked_mb=60):
        assert "100 MB; the limit is 60 MB (`armwright --raise log_unpacked_mb=NUMBER ...` raises it)" in refused(path)
    with raised(log_record_mb=10):
        assert "50 MB; the limit is 10 MB (`armwright --raise log_record_mb=NUMBER ...` raises it)" in refused(path)


def test_sizes(tmp_path: Path) -> None:
    """The size of a file and the number of its joint states have limits."""
    path = json_log(tmp_path / "a.mcap", T, Q)
    with raised(log_rows=100):
        assert "the limit is 100 joint states (`armwright --raise log_rows=NUMBER ...`" in refused(path)
    with raised(joints=2):
        assert "too many joints: the limit is 2 joints" in refused(path)
    with raised(log_records=50):
        assert "too many records: the limit is 50 records" in refused(path)
    with path.open("ab") as file:
        file.truncate(2_000_000)
    with raised(log_mb=1):
        assert "too large: 2 MB; the limit is 1 MB" in refused(path)


def test_many_joints_with_few_numbers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Messages that name a joint each make columns of all their joints, whose numbers are counted before."""
    monkeypatch.setattr(joint_log, "_MAX_NUMBERS", 1000)
    messages = [(0, i, json.dumps({"name": [f"j{i}"], "position": [0]}).encode()) for i in range(20)]
    path = mcap_file(tmp_path / "a.mcap", [("/x", ROS2, "json", "jsonschema", b"{}")], messages)

    assert "too many joint states: 1,200 numbers, expected 1,000" in refused(path)


def test_checksum(tmp_path: Path) -> None:
    """A chunk whose content is not what was written is refused."""
    channels = [("/x", ROS2, "json", "jsonschema", b"{}")]
    path = mcap_file(tmp_path / "a.mcap", channels, [(0, 0, b'{"name": ["a"]}')], compression=CompressionType.NONE)
    path.write_bytes(path.read_bytes().replace(b'["a"]', b'["b"]'))

    assert "the checksum of a chunk differs from its content" in refused(path)


@pytest.mark.parametrize(
    ("message", "text"),
    [
        (b"\xff", "cannot be read: UnicodeDecodeError"),
        (b"[1, 2]", "expected an object of JSON"),
        (b"[" * 100_000, "cannot be read: RecursionError|cannot be read: JSONDecodeError"),
        (b'{"name": ["a", "a"], "position": [1, 2]}', "expected names of joints, each once, got"),
        (b'{"name": ["a", "b"], "position": [1]}', "1 positions of 2 joints; expected one for each, or none"),
        (b'{"name": ["a"], "position": ["x"]}', "could not convert string to float"),
        (b'{"name": ["a"], "position": {"a": 1}}', "expected a list of JSON"),
        (b'{"name": "a"}', "expected a list of JSON"),
        (b'{"name": ["a"], "header": {"stamp": {"sec": 1e99, "nanosec": 0}}}', "no pair of whole numbers"),
        (b'{"name": ["a"], "header": {"stamp": {"sec": 99999999999999, "nanosec": 0}}}', "is no time"),
    ],
)
def test_damaged_json(message: bytes, text: str, tmp_path: Path) -> None:
    """A message that is no joint state is refused with its topic."""
    path = mcap_file(tmp_path / "a.mcap", [("/x", ROS2, "json", "jsonschema", b"{}")], [(0, 5, message)])

    said = refused(path)

    assert re.search(text, said)
    assert "a.mcap: /x: " in said


@pytest.mark.parametrize("count", [4, 2**31, 2**32 - 1])
def test_damaged_cdr(count: int, tmp_path: Path) -> None:
    """Counts of more than a message holds are refused, without memory for them."""
    head = b"\x00\x01\x00\x00" + struct.pack("<iII", 0, 0, 1) + bytes(4)
    for body in (head + struct.pack("<I", count), head + struct.pack("<II", 0, count), head[:9], b""):
        path = mcap_file(tmp_path / "a.mcap", [("/x", ROS2, "cdr", "ros2msg", b"")], [(0, 5, body)])
        assert "/x: a message of sensor_msgs/msg/JointState cannot be read" in refused(path)


@pytest.mark.parametrize("definition", [b"", b"\xff\xff", b"\x0a\x05hello"])
def test_damaged_protobuf(definition: bytes, tmp_path: Path) -> None:
    """A definition that defines nothing is refused, and so is a message that does not follow a good one."""
    channels = [("/x", "foxglove.JointStates", "protobuf", "protobuf", definition)]
    path = mcap_file(tmp_path / "a.mcap", channels, [(0, 5, b"x")])
    assert "/x: a message of foxglove.JointStates cannot be read: the definition" in refused(path)

    good = joint_states_of_foxglove().SerializeToString()
    path = mcap_file(tmp_path / "a.mcap", [(*channels[0][:4], good)], [(0, 5, b"\x12\xff\xff\xff")])
    assert "/x: a message of foxglove.JointStates cannot be read: DecodeError" in refused(path)


def test_damaged_databases(tmp_path: Path) -> None:
    """A database that is none, that lacks a table or has a view for one is refused."""
    import sqlite3

    path = tmp_path / "a.db3"
    path.write_bytes(b"SQLite format 3\0" + bytes(200))
    assert "the database is damaged" in refused(path)
    path.unlink()
    database(path, T[:2], Q[:2])
    base = sqlite3.connect(path)
    base.execute("UPDATE topics SET name = CAST(x'2f92' AS TEXT)")
    base.commit()
    base.close()
    assert list(read_joint_log(path).topics) == ["/\N{REPLACEMENT CHARACTER}"]
    path.unlink()
    base = sqlite3.connect(path)
    base.execute("CREATE TABLE topics (id INTEGER)")
    endless = "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT i AS topic_id FROM n"
    base.execute(f"CREATE VIEW messages AS {endless}")
    base.commit()
    base.close()
    assert "it has no table 'messages'" in refused(path)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.bag", b"#ROSBAG V2.0\n", "got a bag of ROS 1; rosbags-convert makes one of ROS 2"),
        ("a.mcap.zstd", b"\x28\xb5\x2f\xfd....", "compressed by zstd; unpack it by zstd -d"),
        ("a.csv", b"t,q1\n0,1\n", "expected an MCAP file or a .db3 of ROS 2, got b't,q1"),
        ("a.mcap", b"", "got b''"),
    ],
)
def test_other_files(name: str, content: bytes, message: str, tmp_path: Path) -> None:
    """A file of another kind is refused by what helps."""
    (tmp_path / name).write_bytes(content)
    assert message in refused(tmp_path / name)


def test_folders(tmp_path: Path) -> None:
    """A folder without a bag, a missing file, and a link out of a folder are refused."""
    assert "there is no .mcap or .db3 file in it" in refused(tmp_path)
    assert "no such file" in refused(tmp_path / "a.mcap")
    outside = json_log(tmp_path / "a.mcap", T, Q)
    (tmp_path / "bag").mkdir()
    (tmp_path / "bag" / "b.mcap").symlink_to(outside)
    assert "expected the name of a file below this folder" in refused(tmp_path / "bag")
