"""Mesh files that are broken, lie, or want more than they should get: each is refused in one line."""

import copy
import json
import struct
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from armwright.errors import ArmwrightError, FileFormatError, InvalidValueError, KindError, MissingExtraError
from armwright.files.inputs import file_below
from armwright.files.limits import raised
from armwright.spatial.meshes import step_process
from armwright.spatial.meshes.reader import read_assembly, read_mesh
from armwright.spatial.shapes import Mesh
from oracles.gltf_texts import glb, gltf

STEP = Path(__file__).parent / "step_files"
CORNERS = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], dtype=np.float32)
FACES = np.array([(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])


def stl(corners: Any = CORNERS[FACES], count: int | None = None) -> bytes:
    """Return a binary STL file, which may announce another number of triangles."""
    corners = np.asarray(corners, dtype="<f4")
    rows = b"".join(struct.pack("<3f", 0, 0, 0) + triangle.tobytes() + b"\x00\x00" for triangle in corners)
    return b"\x00" * 80 + struct.pack("<I", len(corners) if count is None else count) + rows


def refused(path: Path, data: bytes | str, unit: str | None = "m") -> str:
    """Return what is said of a file, on one line."""
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    with pytest.raises(FileFormatError) as error:
        read_mesh(path, unit=unit)
    said = str(error.value)
    assert said.startswith(str(path))
    assert "\n" not in said
    return said.removeprefix(str(path))


def test_the_tetrahedron_itself(tmp_path: Path) -> None:
    """What the files below are made of is read."""
    (tmp_path / "t.stl").write_bytes(stl())
    (tmp_path / "t.gltf").write_text(json.dumps(TETRAHEDRON), encoding="utf-8")

    assert len(read_mesh(tmp_path / "t.stl", unit="m").faces) == 4
    assert len(read_mesh(tmp_path / "t.gltf").faces) == 4


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"", "no STL: expected 84 bytes or more, or text, got 0"),
        (stl()[:-1], "expected 284 bytes for the 4 triangles announced, got 283"),
        (stl() + b"x", "expected 284 bytes for the 4 triangles announced, got 285"),
        (stl(count=2**32 - 1), "expected 214,748,364,834 bytes for the 4,294,967,295 triangles announced, got 284"),
        (stl(CORNERS[FACES] + [np.nan, 0, 0]), "triangle 1: expected finite numbers"),
        (stl(CORNERS[FACES] + [0, np.inf, 0]), "triangle 1: expected finite numbers"),
        (stl([CORNERS[[0, 1, 1]]] * 9), "expected 4 triangles or more with an area, got 0"),
        (stl(CORNERS[FACES] * [1, 1, 1e-9]), "flat; expected a solid, with a thickness"),
        (stl(CORNERS[FACES] * [1e30, 1, 1]), "probably in another unit"),
        (stl(CORNERS[FACES] + np.float32(2000)), "expected vertices no farther than 1000 m from the origin"),
        (stl(np.concatenate([CORNERS[FACES], CORNERS[FACES[:, ::-1]] + np.float32(2)])), "enclose no volume"),
        ("solid x\nfacet\n", "expected endsolid at the end; the file is not complete"),
        ("solid x\nouter loop\nvertex 0 0 0\nendloop\nendsolid\n", ":4: endloop: expected 3 vertices before it, got 1"),
        ("solid x\nvertex 0 nan 0\n", ":2: vertex: expected a finite number, got 'nan'"),
        ("solid x\nvertex 0 1_0 0\n", ":2: vertex: expected a finite number, got '1_0'"),
        ("solid x\nvertex 0 1\n", ":2: vertex: expected 3 numbers, got 2"),
        ("solid x\nhello\nendsolid", ":2: expected a word of STL such as facet or vertex, got 'hello'"),
        ("solid " + "x" * 1_000_001, "a line is too long"),
    ],
)
def test_stl(data: bytes | str, said: str, tmp_path: Path) -> None:
    """STL that is cut, announces what is not there, or has numbers that are none."""
    assert said in refused(tmp_path / "t.stl", data)


@pytest.mark.parametrize(
    ("data", "said"),
    [
        ("", "there is no face"),
        (
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n",
            ":4: f: expected numbers of the 3 vertices before it, from 1, got '4'",
        ),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", "got '0'"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf -4 1 2\n", "got '-4'"),
        ("v 0 0 0\nf 1\n", ":2: f: expected 3 vertices or more, got 1"),
        (f"v 0 0 0\nf 1 1 {'9' * 5000}\n", ":2: f: expected numbers of the 1 vertices"),
        ("v 0 0 1e999\n", ":1: v: expected a finite number, got '1e999'"),
        ("v 0 0\n", ":1: v: expected 3 numbers, got 2"),
        ("v 0 0 0\n" + "f 1 1 1\n" * 9, "expected 4 triangles or more with an area, got 0"),
    ],
)
def test_obj(data: str, said: str, tmp_path: Path) -> None:
    """OBJ whose faces have vertices that there are not."""
    assert said in refused(tmp_path / "t.obj", data)


TETRAHEDRON = gltf(
    [CORNERS, FACES.astype(np.uint8).ravel()], [[{"attributes": {"POSITION": 0}, "indices": 1}]], [{"mesh": 0}]
)


def changed(**values: Any) -> dict[str, Any]:
    """Return the tetrahedron with other values, by the path to them with __ between."""
    content = copy.deepcopy(TETRAHEDRON)
    for path, value in values.items():
        *keys, last = (int(key) if key.isdigit() else key for key in path.split("__"))
        table: Any = content
        for key in keys:
            table = table[key]
        table[last] = value
    return content


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"accessors__0__count": 1_000_000_000}, "too many triangles: 333,333,333; the limit is 1,000,000"),
        ({"accessors__1__count": 10**12}, "too many triangles"),
        ({"accessors__0__count": 5}, "accessors 1, count: its 5 elements go beyond the 48 bytes of their bufferView"),
        ({"accessors__0__count": 2.5}, "accessors 1, count: expected a whole number, got 2.5"),
        ({"accessors__0__count": -1}, "accessors 1, count: expected 0 or more, got -1"),
        ({"accessors__0__byteOffset": 4}, "go beyond"),
        ({"accessors__0__componentType": 5122}, "accessors 1, componentType: expected 5126, got 5122"),
        ({"accessors__0__type": "VEC4"}, "accessors 1, type: expected one of VEC3"),
        ({"accessors__0__sparse": {}}, "sparse arrays and those without a bufferView are not read"),
        ({"accessors__0__bufferView": 7}, "accessors 1, bufferView: expected a number below 2, from 0, got 7"),
        ({"bufferViews__0__byteLength": 10**9}, "bytes go beyond the 60 of the buffer"),
        ({"bufferViews__0__byteStride": 0}, "go beyond"),
        ({"buffers__0__byteLength": 61}, "buffers 1, byteLength: got 60 bytes, fewer than announced"),
        ({"buffers__0__uri": "data:application/octet-stream;base64,$"}, "its data are no base64"),
        ({"buffers__0__uri": "data:,x"}, "expected data in base64"),
        ({"buffers__0__uri": "http://example.org/x.bin"}, "nothing is fetched from 'http://example.org/x.bin'"),
        ({"buffers__0__uri": "file:///etc/passwd"}, "nothing is fetched"),
        ({"buffers__0__uri": "../secret.bin"}, "expected the name of a file below this folder, got '../secret.bin'"),
        ({"buffers__0__uri": "%2e%2e/secret.bin"}, "expected the name of a file below this folder"),
        ({"buffers__0__uri": "/etc/passwd"}, "expected the name of a file below this folder"),
        ({"buffers__0__uri": "link.bin"}, "expected the name of a file below this folder, got 'link.bin'"),
        ({"buffers__0__uri": "pipe.bin"}, "expected a file, got a pipe"),
        ({"buffers__0__uri": "none.bin"}, "no such file"),
        ({"buffers__0__uri": "a\x00b"}, "expected the name of a file below this folder"),
        ({"buffers__0": {"byteLength": 1}}, "buffers 1, uri: missing, and the file has no buffer of its own"),
        ({"meshes__0__primitives__0__indices": 0}, "accessors 1, type: expected one of SCALAR"),
        ({"meshes__0__primitives__0__attributes": {}}, "attributes, POSITION: missing"),
        ({"meshes__0__primitives__0__mode": 1}, "expected 4 triangles or more with an area, got 0"),
        ({"nodes__0__children": [0]}, "nodes: every node is a child of another; expected one at the top"),
        ({"nodes__0__children": [0], "scenes": [{"nodes": [0]}]}, "is a child of two nodes, or of itself"),
        ({"nodes": [{"children": [1]}, {"children": [0]}], "scenes": [{"nodes": [0]}]}, "is a child of two nodes"),
        ({"nodes__0__children": [5]}, "nodes 1, children: expected numbers of the 1 nodes, from 0, got 5"),
        ({"nodes__0__mesh": 1}, "nodes 1, mesh: expected a number below 1, from 0, got 1"),
        ({"nodes__0__scale": [1e90, 1, 1]}, "probably in another unit"),
        ({"nodes__0__scale": [0, 1, 1]}, "got 2"),
        ({"nodes__0__rotation": [0, 0, 0, 0]}, "nodes 1, rotation: expected a quaternion of length 1"),
        ({"nodes__0__matrix": [1] * 16}, "nodes 1, matrix: expected 0, 0, 0, 1 in the last row"),
        ({"nodes__0__matrix": [1] * 15}, "nodes 1, matrix: expected 16 numbers, got 15"),
        ({"asset": {"version": "1.0"}}, "asset, version: expected glTF of version 2, got '1.0'"),
        ({"asset": None}, "asset"),
        ({"extensionsRequired": ["KHR_draco_mesh_compression"]}, "'KHR_draco_mesh_compression' is not read"),
        ({"scene": 3, "scenes": [{}]}, "scene: expected a number below 1, from 0, got 3"),
    ],
)
def test_gltf(values: dict[str, Any], said: str, tmp_path: Path) -> None:
    """GlTF whose counts, numbers, trees and names of files are not what they should be."""
    folder = tmp_path / "here"
    folder.mkdir()
    (tmp_path / "secret.bin").write_bytes(b"\x00" * 100)
    (folder / "link.bin").symlink_to(tmp_path / "secret.bin")
    import os

    os.mkfifo(folder / "pipe.bin")

    assert said in refused(folder / "t.gltf", json.dumps(changed(**values)), unit=None)


def test_trees_without_end(tmp_path: Path) -> None:
    """A deep chain of nodes, and one mesh shown by many nodes, are refused before anything is made of them."""
    chain = [{"children": [k + 1]} for k in range(200)] + [{}]
    many = [{"mesh": 0}] * 9000
    big = gltf([np.zeros((3000, 3), dtype=np.float32)], [[{"attributes": {"POSITION": 0}}]], many)

    assert "nested too deeply: the limit is 60 levels" in refused(
        tmp_path / "a.gltf", json.dumps(changed(nodes=chain)), None
    )
    assert "too many triangles: 9,000,000" in refused(tmp_path / "b.gltf", json.dumps(big), None)
    assert "too many values" in refused(tmp_path / "c.gltf", b"[" + b"[]," * 1_000_000 + b"]", None)
    assert "nested too deeply" in refused(tmp_path / "d.gltf", b'{"a":' + b"[" * 5000 + b"]" * 5000 + b"}", None)
    assert "not valid JSON" in refused(tmp_path / "e.gltf", b"{", None)
    assert "not UTF-8" in refused(tmp_path / "f.gltf", b"\xff", None)


def test_binary_gltf(tmp_path: Path) -> None:
    """Binary glTF that is cut, is of another version, or has chunks that go beyond its end."""
    whole, path = glb(TETRAHEDRON), tmp_path / "t.glb"

    assert "expected the" in refused(path, whole[:-4], None)
    assert "got version 1" in refused(path, whole[:4] + b"\x01" + whole[5:], None)
    assert "goes beyond the end" in refused(path, whole[:12] + b"\xff\xff\xff\x00" + whole[16:], None)
    assert "expected a chunk of JSON" in refused(path, b"glTF" + struct.pack("<II", 2, 12), None)
    assert "goes beyond the end" in refused(path, b"glTF" + struct.pack("<III", 2, 16, 99), None)


def test_limits(tmp_path: Path) -> None:
    """Triangles and bytes beyond a limit are refused, and a limit can be raised."""
    path = tmp_path / "t.stl"
    with raised(mesh_triangles=3):
        assert "too many triangles: 4; the limit is 3 triangles" in refused(path, stl())
        assert "too many triangles" in refused(tmp_path / "t.obj", "v 0 0 0\n" + "f 1 1 1\n" * 4)
        text = "solid\n" + ("outer loop\n" + "vertex 0 0 0\n" * 3 + "endloop\n") * 4 + "endsolid"
        assert "too many triangles: 4" in refused(path, text)
        assert "too many triangles: 4" in refused(tmp_path / "t.gltf", json.dumps(TETRAHEDRON), None)
    with raised(mesh_mb=1):
        assert "too large: 1.1; the limit is 1 MB" in refused(path, b"\x00" * 1_100_000)
        two = changed(
            buffers__0__uri="x.bin", buffers=[{"byteLength": 9, "uri": "x.bin"}] * 2, bufferViews__1__buffer=1
        )
        two["buffers"] = [{"byteLength": 48, "uri": "x.bin"}] * 2
        (tmp_path / "x.bin").write_bytes(b"\x00" * 900_000)
        assert "buffers are too large: the limit is 1 MB" in refused(tmp_path / "t.gltf", json.dumps(two), None)


def test_units(tmp_path: Path) -> None:
    """A length of 40 m, or of 0.04 mm, is asked about, with the units in which it is likely."""
    path = tmp_path / "block.stl"
    path.write_bytes(stl(CORNERS[FACES] * 40))
    with pytest.raises(FileFormatError, match=r'40 m long, probably in another unit; unit = "mm" gives 0\.04 m'):
        read_mesh(path, unit="m")
    path.write_bytes(stl(CORNERS[FACES] * 0.04))
    with pytest.raises(FileFormatError, match=r'4e-05 m long, probably in another unit; unit = "m" gives 0\.04 m'):
        read_mesh(path, unit="mm")
    with raised(mesh_m=50):
        path.write_bytes(stl(CORNERS[FACES] * 40))
        assert np.ptp(read_mesh(path, unit="m").vertices) == pytest.approx(40)


@pytest.mark.parametrize(
    ("ask", "error", "said"),
    [
        (read_mesh, InvalidValueError, "unit: missing, as STL files have none; expected one of m,"),
        (lambda path: read_mesh(path, unit="ft"), InvalidValueError, "unit: expected one of m, mm, cm, in, got 'ft'"),
        (lambda path: read_mesh(path, unit=3), KindError, "unit: expected one of m, mm, cm, in, got 3"),
        (lambda path: read_mesh(path, unit="m", scale=(1, 0, 1)), InvalidValueError, "scale: expected numbers other"),
        (lambda path: read_mesh(path.with_suffix(".glb"), unit="m"), InvalidValueError, "t.glb has its unit; omit it"),
        (lambda path: read_mesh(path.with_suffix(".stll")), FileFormatError, "did you mean .stl?"),
        (lambda path: read_mesh(path.with_suffix(".3mf")), FileFormatError, "ends in one of .stl, .obj, .gltf, .glb"),
        (read_assembly, FileFormatError, "ends in one of .gltf, .glb, .step, .stp"),
        (lambda path: read_mesh(path.with_name("u.stl"), unit="m"), FileFormatError, "no such file; did you mean"),
        (lambda path: read_mesh(path.parent / "x.stl", unit="m"), FileFormatError, "expected a file, got a folder"),
        (lambda _: read_mesh(3, unit="m"), KindError, "expected the path of a file, got 3"),
        (
            lambda _: Mesh(vertices=CORNERS, faces=FACES, pieces=[1]),
            KindError,
            "pieces: expected meshes",
        ),
    ],
)
def test_arguments(ask: Callable[[Path], object], error: type[ArmwrightError], said: str, tmp_path: Path) -> None:
    """Units that are none, formats that are not read, files that are not there."""
    (tmp_path / "t.stl").write_bytes(stl())
    (tmp_path / "x.stl").mkdir()
    with pytest.raises(error) as got:
        ask(tmp_path / "t.stl")
    assert said in str(got.value)


def test_step_that_is_none(tmp_path: Path) -> None:
    """STEP that is cut, is something else, or names other files is refused in one line."""
    pytest.importorskip("cascadio")
    whole, path = (STEP / "cylinder.step").read_bytes(), tmp_path / "t.step"

    assert "no STEP: expected ISO-10303-21; at its beginning" in refused(path, "hello", None)
    assert "no surfaces could be read from it" in refused(path, whole[: len(whole) // 2], None)
    other = whole.replace(b"#1 =", b"#999 = DOCUMENT_FILE('/etc/x.step','','',#8,'','');\n#1 =", 1)
    assert "names other files (DOCUMENT_FILE)" in refused(path, other, None)


def test_the_process_of_step(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Too little memory or time, and the death of the process that reads STEP, are one line."""
    pytest.importorskip("cascadio")
    whole, path = (STEP / "torus.step").read_bytes(), tmp_path / "t.step"
    with raised(step_mb=60):
        assert "needs too much memory: the limit is 60 MB" in refused(path, whole, None)
    script = tmp_path / "other.py"
    monkeypatch.setattr(step_process, "__file__", str(script))
    script.write_text("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)", encoding="utf-8")
    assert "the process that reads STEP died" in refused(path, whole, None)
    # What the system does to a process that has computed for its whole time.
    script.write_text("import os, signal; os.kill(os.getpid(), signal.SIGXCPU)", encoding="utf-8")
    with raised(step_s=1):
        assert "needs more than 1 s" in refused(path, whole, None)
    script.write_text("import time; time.sleep(60)", encoding="utf-8")
    monkeypatch.setattr("armwright.spatial.meshes.step._WAITING", 0.1)
    with raised(step_s=1):
        assert "takes too long: the limit is 1 s" in refused(path, whole, None)
    monkeypatch.setattr(sys, "executable", str(tmp_path / "nothing"))
    assert "the process that reads STEP did not start: No such file" in refused(path, whole, None)


def test_without_cascadio(monkeypatch: pytest.MonkeyPatch) -> None:
    """STEP without its library says how to install it."""
    monkeypatch.setitem(sys.modules, "cascadio", None)
    with pytest.raises(
        MissingExtraError, match=r"reading STEP needs cascadio; install it by: pip install 'armwright\[cad\]'"
    ):
        read_mesh(STEP / "torus.step")


def test_files_below(tmp_path: Path) -> None:
    """A file that data name lies below their folder, by whatever way the name goes there."""
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "x").touch()
    (tmp_path / "link").symlink_to(tmp_path / "a")
    (tmp_path / "circle").symlink_to(tmp_path / "circle")
    assert file_below(tmp_path, "a/../a/x").samefile(tmp_path / "a" / "x")
    assert file_below(tmp_path / "link", "x").samefile(tmp_path / "a" / "x")
    for folder, name in (
        ("a", "../a2"), ("a", str(tmp_path / "a" / "x")), (".", "x\x00"), (".", "circle/x"), (".", "y" * 5000),
    ):  # fmt: skip
        with pytest.raises(FileFormatError, match="expected the name of a file below this folder"):
            file_below(tmp_path / folder, name)
