"""Fuzzing of what reads files, by changing valid ones: `python fuzz/files.py TARGET [INPUTS] [SEED]`.

Targets are `arm`, `linkage`, `urdf`, `mjcf`, `cell`, `world` (cells with physics, which are begun), `mesh`, `step`,
`poses`, `iso9283`, `calibration` and `clearance` (measured tables), `pictures`, `corners`, `picture_joints` and `lens`
(of a camera), `log` (MCAP and bags of ROS 2) and `robot` (the calibration of one). It needs the extra `logs`; `world`,
`step` and `pictures` need other extras.

An input is a valid file in which keys, numbers, types, lines and cells were changed, lost, doubled, nested or put
elsewhere. It fails when anything but the reader's own error is raised, when it takes more than five seconds, or when
memory grows beyond 1 GB. The seed and the number of an input make it again.
"""

import base64
import contextlib
import io
import json
import random
import re
import resource
import signal
import sqlite3
import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from pathlib import Path

import numpy as np
from mcap.writer import CompressionType, Writer
from PIL import Image

from armwright.accuracy.measurement_file import read_measurements as read_accuracy
from armwright.arm.load import load_arm, read_arm
from armwright.arm.mjcf.reader import load_mjcf
from armwright.arm.universal_robots.calibrated_arm import calibrated_arm
from armwright.arm.urdf.reader import load_urdf
from armwright.calibration.board import Board
from armwright.calibration.camera_tables import read_corners, read_lens, read_picture_joints
from armwright.calibration.measurements import read_measurements
from armwright.cell.assembly import read_assembly_frames
from armwright.cell.model import Cell
from armwright.cell.reader import read_cell
from armwright.clearance.estimation.measurement_file import read_clearance_measurements
from armwright.clearance.reader import read_linkage
from armwright.errors import ArmwrightError
from armwright.files.logs.joint_log import read_joint_log
from armwright.files.pictures import read_grey_picture
from armwright.motion.poses_file import read_poses
from armwright.motion.replay import arms_of, bases_of, replay
from armwright.physics.collisions import CellCollisions
from armwright.physics.mjcf import arm_mjcf
from armwright.physics.trials import draw_case
from armwright.physics.world import PhysicsCell
from armwright.report.log_content import simulation_log_content
from armwright.report.ros2_log import ros2_bag
from armwright.simulation.simulator import simulate
from armwright.spatial.meshes.reader import read_mesh

ROOT = Path(__file__).resolve().parents[1]
SOURCE = ROOT / "src" / "armwright"
EXAMPLES = ROOT / "examples"
STEP_FILES = ROOT / "tests" / "spatial" / "step_files"
# What stands for a value: of other kinds, of other sizes, and what a careless reader stumbles over.
VALUES = (
    *("0", "-0.0", "1", "-1", "1e-300", "1e99", "1e308", "-1e308", "1e400", "nan", "inf", "-inf", "1" * 30, "0x1f"),
    *(
        '""',
        '"x"',
        '"WORLD"',
        '"../x"',
        "[]",
        "[[]]",
        "[1, 2, 3]",
        "{}",
        "{a = 1}",
        "true",
        "1979-05-27",
        "''",
        ",",
        "",
    ),
    *("9" * 400, '"' + "y" * 300 + '"', "[[1,0,0],[0,1,0],[0,0,1]]", "\u202e", "\x00", "é", "1_000", "+5", ".5", "5."),
)
_NUMBER = re.compile(r"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")
_WORD = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
MAX_S_LENGTH, LARGEST_MB = 5, 1000


def _some(text: str, pattern: re.Pattern[str], rng: random.Random) -> tuple[int, int]:
    found = [match.span() for match in pattern.finditer(text)]
    return rng.choice(found) if found else (0, 0)


def _number(text: str, rng: random.Random) -> str:
    start, end = _some(text, _NUMBER, rng)
    try:
        near = repr(float(text[start:end]) * rng.choice((-1, 0, 1e-12, 1 + 1e-9, 10, 57.3, 1000, 1e9)))
    except ValueError:
        near = "0"
    return text[:start] + (near if rng.random() < 0.5 else rng.choice(VALUES)) + text[end:]


def _word(text: str, rng: random.Random) -> str:
    start, end = _some(text, _WORD, rng)
    other = _some(text, _WORD, rng)
    near = text[start:end].swapcase() if rng.random() < 0.2 else text[other[0] : other[1]]
    return text[:start] + near + text[end:]


def _value(text: str, rng: random.Random) -> str:
    lines = text.split("\n")
    at = rng.randrange(len(lines))
    key, equals, _ = lines[at].partition("=")
    lines[at] = f"{key}{equals} {rng.choice(VALUES)}" if equals else rng.choice(VALUES)
    return "\n".join(lines)


def _lines(text: str, rng: random.Random) -> str:
    lines = text.split("\n")
    start = rng.randrange(len(lines))
    end = min(len(lines), start + rng.choice((1, 1, 1, 2, 5, 20)))
    block = lines[start:end]
    match rng.randrange(4):
        case 0:
            del lines[start:end]
        case 1:
            lines[start:start] = block * rng.choice((1, 1, 2, 30))
        case 2:
            del lines[start:end]
            at = rng.randrange(len(lines) + 1)
            lines[at:at] = block
        case _:
            rng.shuffle(block)
            lines[start:end] = block
    return "\n".join(lines)


def _cell(text: str, rng: random.Random) -> str:
    lines = text.split("\n")
    at = rng.randrange(len(lines))
    cells = lines[at].split(",")
    place = rng.randrange(len(cells))
    match rng.randrange(3):
        case 0:
            cells[place] = rng.choice(VALUES)
        case 1:
            del cells[place]
        case _:
            cells.insert(place, cells[rng.randrange(len(cells))])
    lines[at] = ",".join(cells)
    return "\n".join(lines)


def _letters(text: str, rng: random.Random) -> str:
    at = rng.randrange(len(text) + 1)
    what = rng.choice(("", "[", "]", "{", "}", '"', "=", ".", ",", "\n", "<", ">", "/", "&", "#", "'", "-", "e"))
    return text[:at] + what + text[at + rng.randrange(2) :]


def _nested(text: str, rng: random.Random) -> str:
    start, end = _some(text, _NUMBER, rng)
    depth = rng.choice((1, 2, 70, 2000))
    return text[:start] + "[" * depth + text[start:end] + "]" * depth + text[end:]


def _cut(text: str, rng: random.Random) -> str:
    return text[: rng.randrange(len(text) + 1)]


CHANGES = (_number, _number, _number, _value, _value, _word, _lines, _lines, _cell, _letters, _nested, _cut)


def changed(texts: list[str], rng: random.Random) -> str:
    """Return a valid text with one to four changes; now and then two texts in one."""
    text = rng.choice(texts)
    for _ in range(rng.choice((1, 1, 1, 2, 2, 3, 4))):
        # One change in twelve cuts a file, which leaves little for the others.
        text = rng.choice(CHANGES)(text, rng)
    return text


def _texts(*paths: Path, lines: int = 400) -> list[str]:
    return ["\n".join(path.read_text(encoding="utf-8").split("\n")[:lines]) for path in paths]


def _tables(*paths: Path, lines: int) -> list[str]:
    """Return tables as they are, and with semicolons, decimal commas and units in brackets."""
    texts = _texts(*paths, lines=lines)
    european = [text.replace(",", ";").replace(".", ",").replace("_mm", " [mm]") for text in texts]
    return [*texts, *european, european[0].replace("commanded_", "nominal ")]


def _meshes() -> list[str]:
    """Return a tetrahedron as OBJ, as STL in text, as glTF, and as binary STL and glTF in hexadecimal digits."""
    corners = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], dtype="<f4")
    faces = np.array([(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)], dtype="u1")
    v = [f"v {x} {y} {z}" for x, y, z in corners]
    obj = "\n".join([*v, "vt 0 0", *(f"f {a + 1}/1 {b + 1}/1 {c - 4}/1" for a, b, c in faces.tolist())])
    loops = "\n".join(
        "facet normal 0 0 0\nouter loop\n" + "".join(f"vertex {x} {y} {z}\n" for x, y, z in corners[face]) + "endloop"
        for face in faces
    )
    records = b"".join(bytes(12) + corners[face].tobytes() + bytes(2) for face in faces)
    stl = bytes(80) + len(faces).to_bytes(4, "little") + records
    buffer = corners.tobytes() + faces.tobytes()
    uri = f"data:application/octet-stream;base64,{base64.b64encode(buffer).decode()}"
    gltf = json.dumps(
        {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [
                {"name": "top", "children": [1, 2], "translation": [0, 0, 1]},
                {"name": "a", "mesh": 0, "rotation": [0, 0, 0, 1], "scale": [1, 2, 1]},
                {"name": "b", "mesh": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 3, 0, 0, 1]},
            ],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "mode": 4}]}],
            "accessors": [
                {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "byteOffset": 0},
                {"bufferView": 1, "componentType": 5121, "count": 12, "type": "SCALAR"},
            ],
            "bufferViews": [
                {"buffer": 0, "byteOffset": 0, "byteLength": 48, "byteStride": 12},
                {"buffer": 0, "byteOffset": 48, "byteLength": 12},
            ],
            "buffers": [{"byteLength": 60, "uri": uri}],
        },
        indent=1,
    )
    chunk = gltf.encode() + b" " * (-len(gltf) % 4)
    size = (20 + len(chunk)).to_bytes(4, "little")
    glb = b"glTF" + (2).to_bytes(4, "little") + size + len(chunk).to_bytes(4, "little") + b"JSON" + chunk
    return [obj, f"solid\n{loops}\nendsolid", gltf, gltf, stl.hex(" ", 4), glb.hex(" ", 4)]


def _bytes_of(digits: bytes) -> bytes:
    """Return the bytes of hexadecimal digits among other signs."""
    known = re.sub(rb"[^0-9a-f]", b"", digits).decode()
    return bytes.fromhex(known[: len(known) // 2 * 2])


def _read_mesh(path: Path) -> None:
    """Read a text as the format that it is, and its components, where it has some."""
    data = path.read_bytes()
    if data[:1] in b"06":
        data = _bytes_of(data)
    suffix = ".glb" if data[:4] == b"glTF" else ".gltf" if data.lstrip()[:1] in b"{[" else ".stl"
    suffix = ".obj" if suffix == ".stl" and data[:2] == b"v " else suffix
    named = path.with_suffix(suffix)
    named.write_bytes(data)
    if suffix in {".glb", ".gltf"}:
        with contextlib.suppress(ArmwrightError):
            read_assembly_frames(named)
        read_mesh(named)
    else:
        read_mesh(named, unit="m")


def _cells() -> list[str]:
    """Return the cells of the examples, and one with every key, which counts twice."""
    every = _texts(Path(__file__).with_name("every_key.toml"))
    return [*_texts(*EXAMPLES.glob("*cell*.toml")), *every, *every]


def _read_cell(path: Path) -> Cell:
    """Read a cell beside which there is a mesh of a wedge."""
    corners = "v 0 0 0\nv 40 0 0\nv 0 40 0\nv 0 0 40\n"
    path.with_name("wedge.obj").write_text(f"{corners}f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n", encoding="utf-8")
    return read_cell(path)


def _begin_world(path: Path) -> None:
    """Begin the world of a cell, the collisions that are looked for in it, and one of its trials."""
    cell = _read_cell(path)
    CellCollisions(cell)
    for world in (PhysicsCell(cell, seed=1), draw_case(cell, 1, 1).world()):
        world.advance(3 * cell.period)
        world.observations()


def _pictures() -> list[str]:
    """Return pictures of a chessboard as PNG and JPEG, in hexadecimal digits."""
    board = np.kron(np.indices((5, 6)).sum(axis=0) % 2, np.ones((12, 12)))
    grey = np.pad(255 - 200 * board, 12, constant_values=255).astype(np.uint8)
    pictures = [Image.fromarray(grey), Image.fromarray(grey).convert("RGB"), Image.fromarray(grey).convert("P")]
    texts = []
    for picture, kind in zip((*pictures, *pictures[:2]), ("PNG", "PNG", "PNG", "JPEG", "JPEG"), strict=True):
        file = io.BytesIO()
        picture.save(file, kind)
        texts.append(file.getvalue().hex(" ", 4))
    return texts


def _read_picture(path: Path) -> None:
    named = path.with_suffix(".png")
    named.write_bytes(_bytes_of(path.read_bytes()))
    read_grey_picture(named)


def _logs() -> list[str]:
    """Return small logs in hexadecimal digits: joint states in JSON and CDR, a trace, what made it, and a database."""
    simulation = simulate(load_arm("puma560"), np.zeros(6), duration=0.02, period=0.01)
    bag = ros2_bag(simulation_log_content(simulation))["bag.mcap"]
    messages = [
        ("/js", "sensor_msgs/msg/JointState", b'{"name": ["a", "b"], "position": [1, 2], "velocity": [3, 4]}'),
        ("/js", "sensor_msgs/msg/JointState", b'{"name": ["b"], "header": {"stamp": {"sec": 1, "nanosec": 2}}}'),
        ("/js", "sensor_msgs/msg/JointState", b'{"name": ["a", "b"], "position": [1, 3], "effort": [3, 4]}'),
        ("/js", "sensor_msgs/msg/JointState", b'{"name": ["a", "b"], "position": [1, 4], "effort": [3, 4]}'),
        (
            "/plan",
            "foxglove.JointStates",
            b'{"timestamp": {"sec": 0, "nsec": 0}, "joints": [{"name": "a", "position": 1}]}',
        ),
        ("/log", "foxglove.Log", b'{"message": "hello", "level": 2, "line": 3, "name": "x"}'),
        ("/armwright/run", "armwright.Run", b'{"arms": {"A": {"file": "name = \'x\'", "base": [1, 0, 0, 0, 1, 0]}}}'),
    ]
    file = io.BytesIO()
    # Without checksums, which nearly every change would break, and packed in chunks that are read as they are.
    writer = Writer(file, compression=CompressionType.NONE, enable_crcs=False)
    writer.start()
    channels: dict[str, int] = {}
    for time_ns, (topic, kind, data) in enumerate(messages):
        if topic not in channels:
            channels[topic] = writer.register_channel(topic, "json", writer.register_schema(kind, "jsonschema", b"{}"))
        writer.add_message(channels[topic], log_time=time_ns, publish_time=time_ns, data=data)
    writer.finish()
    base = sqlite3.connect(":memory:")
    base.execute("CREATE TABLE topics (id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT)")
    base.execute("CREATE TABLE messages (id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)")
    base.execute("INSERT INTO topics VALUES (1, '/js', 'sensor_msgs/msg/JointState', 'cdr')")
    state = bytes.fromhex("00010000 01000000 02000000 01000000 00000000 01000000 02000000 61000000 00000000 00000000")
    base.execute("INSERT INTO messages (topic_id, timestamp, data) VALUES (1, 5, ?)", (state + bytes(8),))
    base.commit()
    logs = (bag, file.getvalue(), file.getvalue(), bytes(base.serialize()))
    return [log.hex(" ", 4) for log in logs]


def _read_log(path: Path) -> None:
    """Read a log, and replay it."""
    named = path.with_suffix(".mcap")
    named.write_bytes(_bytes_of(path.read_bytes()))
    log = read_joint_log(named)
    result = replay(log, arms=arms_of(log))
    bases_of(log)
    result.as_data()
    list(result.tables())


def _read_robot(path: Path) -> None:
    """Read the calibration of one robot, in the form that it is in."""
    is_yaml = b"kinematics" in path.read_bytes()
    calibrated_arm(load_arm("ur5"), path.rename(path.with_suffix(".yaml" if is_yaml else ".conf")))


_LENS = """[cameras.TOP]
width      = 640
height     = 480
focal_px   = [612, 610]
centre_px  = [322, 236]
distortion = [-0.12, 0.05, 0.001, -0.0005, 0]
"""

TARGETS: dict[str, tuple[str, Callable[[Path], object], Callable[[], list[str]]]] = {
    "arm": (".toml", read_arm, lambda: _texts(*(SOURCE / "arm" / "catalogue").glob("*.toml"))),
    "linkage": (".toml", read_linkage, lambda: _texts(*(SOURCE / "clearance" / "catalogue").glob("*.toml"))),
    "urdf": (".urdf", load_urdf, lambda: _texts(EXAMPLES / "seven_joints.urdf")),
    "mjcf": (
        ".xml",
        lambda path: load_mjcf(path, tip="pinch", lock=["left", "right"]),
        lambda: [*_texts(EXAMPLES / "desk_arm.xml"), arm_mjcf(load_arm("puma560")).text],
    ),
    "cell": (".toml", _read_cell, _cells),
    "world": (".toml", _begin_world, _cells),
    "mesh": (".mesh", _read_mesh, _meshes),
    "step": (".step", read_mesh, lambda: _texts(*STEP_FILES.glob("*.step"), lines=100_000)),
    "poses": (".toml", read_poses, lambda: _texts(EXAMPLES / "puma_poses.toml", EXAMPLES / "round_the_post.toml")),
    "iso9283": (
        ".csv",
        lambda path: read_accuracy([path]),
        lambda: _tables(EXAMPLES / "measured_poses.csv", EXAMPLES / "measured_paths.csv", lines=80),
    ),
    "calibration": (
        ".csv",
        lambda path: read_measurements(path, load_arm("puma560")),
        lambda: _tables(EXAMPLES / "puma_points.csv", lines=40),
    ),
    "pictures": (".txt", _read_picture, _pictures),
    "corners": (
        ".csv",
        lambda path: read_corners(path, Board(columns=9, rows=7, square=0.03, marker=0.022), (640, 480)),
        lambda: _tables(EXAMPLES / "board_corners.csv", lines=400),
    ),
    "picture_joints": (
        ".csv",
        lambda path: read_picture_joints(path, load_arm("ur5")),
        lambda: _tables(EXAMPLES / "board_joints.csv", lines=40),
    ),
    "log": (".txt", _read_log, _logs),
    "robot": (".conf", _read_robot, lambda: _texts(*(ROOT / "tests" / "arm" / "universal_robots").glob("*.[cy]*"))),
    "lens": (".toml", read_lens, lambda: [_LENS]),
    "clearance": (
        ".csv",
        read_clearance_measurements,
        lambda: _tables(EXAMPLES / "five_bar_rest.csv", EXAMPLES / "five_bar_paths.csv", lines=300),
    ),
}


class SlowError(Exception):
    """An input takes too long."""


def _too_slow(_signal: int, _frame: object) -> None:
    raise SlowError


def fails(target: str, path: Path, text: str) -> str:
    """Read a text from a file; return what went wrong, nothing where it was read or refused as it should be."""
    path.write_bytes(text.encode("utf-8", "surrogatepass"))
    try:
        TARGETS[target][1](path)
    except ArmwrightError:
        return ""
    except Exception:  # noqa: BLE001 - whatever it is, it is what is looked for
        return traceback.format_exc()
    return ""


def main() -> None:
    """Read changed files of one kind until one fails."""
    target = sys.argv[1]
    count, seed = (int(word) for word in (*sys.argv[2:4], *("100000", "1")[len(sys.argv) - 2 :]))
    suffix, _, texts = TARGETS[target]
    valid, slowest, failures = texts(), 0.0, 0
    signal.signal(signal.SIGALRM, _too_slow)
    begin = time.monotonic()
    with tempfile.TemporaryDirectory(dir="/dev/shm" if Path("/dev/shm").is_dir() else None) as folder:  # noqa: S108
        path = Path(folder) / f"input{suffix}"
        for number in range(count):
            text = changed(valid, random.Random(f"{seed} {number}"))  # noqa: S311 - chance, not secrets
            start = time.process_time()
            signal.setitimer(signal.ITIMER_REAL, 60 * MAX_S_LENGTH)
            said = fails(target, path, text)
            signal.setitimer(signal.ITIMER_REAL, 0)
            taken = time.process_time() - start
            slowest = max(slowest, taken)
            memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
            if said or taken > MAX_S_LENGTH or memory > LARGEST_MB:
                failures += 1
                kept = ROOT / "out" / "fuzz" / f"{target}-{seed}-{number}{suffix}"
                kept.parent.mkdir(parents=True, exist_ok=True)
                kept.write_text(text, encoding="utf-8", errors="surrogatepass")
                print(f"{kept}: {taken:.1f} s, {memory:.0f} MB\n{said}", flush=True)
                if failures > 20:
                    break
    print(
        f"{target}: {number + 1} inputs, seed {seed}, {failures} failures, slowest {slowest:.2f} s, {memory:.0f} MB at "
        f"most, {time.monotonic() - begin:.0f} s in all",
        flush=True,
    )
    sys.exit(bool(failures))


if __name__ == "__main__":
    main()
