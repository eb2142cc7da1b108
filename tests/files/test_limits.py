"""The limits of readers: one table, every limit kept, named in the message, and raised where one asks for it."""

import io
import os
import re
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner

from armwright.arm.load import load_arm, read_arm
from armwright.arm.urdf.reader import load_urdf
from armwright.cell.reader import read_cell
from armwright.clearance.estimation.measurement_file import RestMeasurement, read_clearance_measurements
from armwright.clearance.reader import read_linkage
from armwright.cli.app import app
from armwright.errors import ArmwrightError, FileFormatError, InvalidValueError, UnknownNameError
from armwright.files import inputs, limits
from armwright.files.document import Document
from armwright.files.inputs import read_lines, read_text, read_typed_program
from armwright.files.key_lines import longest_dotted_key
from armwright.files.limits import LIMITS, limit, parse_limits, raised
from armwright.files.rows import read_rows
from armwright.motion.poses_file import read_poses
from armwright.program import compile as compile_program
from armwright.program.diagnostics.render import render
from armwright.program.language_server.cell_lookup import CellCache

ROOT = Path(__file__).resolve().parents[2]
IDENTITY = "[1,0,0, 0,1,0, 0,0,1, 0,0,0]"
CELL = "[arms.ARM_1]\njoint_positions = [0, -1, 0.5, 0, 1, 0]\n"
TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


def refused(action: Callable[[], object]) -> str:
    with pytest.raises(FileFormatError) as caught:
        action()
    return str(caught.value)


def urdf(links: int) -> str:
    joints = "".join(
        f"<joint name='j{i}' type='continuous'><parent link='l{i}'/><child link='l{i + 1}'/></joint>"
        for i in range(links - 1)
    )
    return "<robot name='r'>" + "".join(f"<link name='l{i}'/>" for i in range(links)) + joints + "</robot>"


# For each limit, the number that it is set to, a text just beyond it, and who reads it.
BEYOND: dict[str, tuple[int, str, Callable[[Path], object]]] = {
    "file_mb": (1, "x = 1\n" * 200_000, read_text),
    "program_mb": (1, " " * 1_000_001, compile_program),
    "table_mb": (1, "a,b\n" * 300_000, lambda path: [*read_lines(path)]),
    "table_rows": (2, "a,b\n1,2\n1,2\n1,2\n", lambda path: [*read_rows(path)[1]]),
    "table_columns": (2, "a,b,c\n1,2,3\n", read_rows),
    "line_characters": (1_500_000, "a" * 3_000_000, read_rows),
    "nesting": (3, "x = [[[[1]]]]\n", Document.read),
    "digits": (5, "x = 100000\n", Document.read),
    "entries": (2, "[[pose]]\n[[pose]]\n[[pose]]\n", read_poses),
    "joints": (1, "[[joint]]\nkind = 'revolute'\n" * 2, read_arm),
    "bodies": (1, "[ground]\npoints = { A = [0, 0] }\n" + "[[body]]\nname = 'a'\n" * 2, read_linkage),
    "frames": (1, f"[frames]\nA = {IDENTITY}\nB = {IDENTITY}\n", lambda path: read_cell(path, arms_needed=False)),
    "hanging": (
        1,
        f"[frames]\nA = {IDENTITY}\nB = {{ on = 'A', at = {IDENTITY} }}\n",
        lambda path: read_cell(path, arms_needed=False),
    ),
    "parts": (1, f"{CELL}[parts.A]\n[parts.B]\n", read_cell),
    # Of all kinds together.
    "fixtures": (
        2,
        f"{CELL}[scene]\nboxes = [{{ name = 'A', size_mm = [1, 1, 1], at = {IDENTITY} }}]\nspheres = ["
        + ", ".join(f"{{ name = '{name}', diameter_mm = 1, at = {IDENTITY} }}" for name in "BC")
        + "]\n",
        read_cell,
    ),
    "arms": (1, "[arms.ARM_1]\n[arms.ARM_2]\n", read_cell),
    "revolutions": (2, "[[joint]]\nkind = 'revolute'\nlimits = { upper_deg = 721, lower_deg = 0 }\n", read_arm),
}


@pytest.mark.parametrize("name", BEYOND)
def test_beyond(name: str, tmp_path: Path) -> None:
    """What is beyond a limit is refused by a message with the limit and the option that raises it."""
    number, text, read = BEYOND[name]
    path = tmp_path / "thing.toml"
    path.write_text(text)

    with raised(**{name: number}):
        said = refused(lambda: read(path))

    assert f"the limit is {number:,} {LIMITS[name].unit} (`armwright --raise {name}=NUMBER ...` raises it)" in said


def test_urdf_limits(tmp_path: Path) -> None:
    """The joints of a URDF chain are counted, and its elements are not deeper than the limit."""
    path = tmp_path / "thing.urdf"
    path.write_text(urdf(4))

    assert load_urdf(path).n == 3
    with raised(joints=2):
        assert "too many joints between 'l0' and 'l3': 3; the limit is 2 joints" in refused(lambda: load_urdf(path))
    path.write_text("<robot name='r' " + " ".join(f"a{i}='1'" for i in range(100)) + "/>")
    assert "thing.urdf:1: <robot>: too many attributes: 101; the limit is 100 attributes" in refused(
        lambda: load_urdf(path)
    )
    path.write_text("<robot name='r'>" + "<link>" * 100 + "</link>" * 100 + "</robot>")
    assert "nested too deeply: the limit is 60 levels" in refused(lambda: load_urdf(path))
    path.write_text("<robot name='r'>" + "<link>" * 5000 + "</link>" * 5000 + "</robot>")
    assert "not valid XML: Excessive depth" in refused(lambda: load_urdf(path))


def test_meshes_of_one_file(tmp_path: Path) -> None:
    """The triangles of all meshes that a file names are counted together, as often as they are named."""
    (tmp_path / "a.obj").write_text(TETRAHEDRON)
    meshes = [f"{{ name = '{name}', mesh = 'a.obj', unit = 'm', at = {IDENTITY} }}" for name in "AB"]
    cell = tmp_path / "cell.toml"
    cell.write_text(f"{CELL}[scene]\nmeshes = [{', '.join(meshes)}]\n")
    arm = tmp_path / "arm.toml"
    solids = ", ".join(3 * ["{ kind = 'mesh', mesh = 'a.obj', unit = 'm' }"])
    arm.write_text(f"[[joint]]\nkind = 'revolute'\nlink = {{ solids = [{solids}] }}\n")
    robot = tmp_path / "robot.urdf"
    shapes = "".join(
        f"<collision><geometry><mesh filename='a.obj' scale='{n} 1 1'/></geometry></collision>" for n in (1, 2, 2)
    )
    robot.write_text(urdf(2).replace("<link name='l1'/>", f"<link name='l1'>{shapes}</link>"))

    for path, count, read in ((cell, 8, read_cell), (arm, 12, read_arm), (robot, 8, load_urdf)):
        with raised(file_triangles=count):
            read(path)
        with raised(file_triangles=count - 1):
            message = refused(lambda read=read, path=path: read(path))
        assert f"too many in this file: {count}; the limit is {count - 1} triangles" in message


def test_entities_are_not_expanded(tmp_path: Path) -> None:
    """A billion laughs are none, and a file is not read by the name of an entity."""
    path = tmp_path / "thing.urdf"
    laughs = "".join(f"<!ENTITY l{i + 1} '{f'&l{i};' * 10}'>" for i in range(9))
    path.write_text(f"<!DOCTYPE robot [<!ENTITY l0 'ha'>{laughs}]><robot name='r'><link name='a'/>&l9;</robot>")

    # Versions of libxml2 call it an amplification or a loop.
    assert re.search("entity (amplification|reference loop)", refused(lambda: load_urdf(path)))
    secret = tmp_path / "secret"
    secret.write_text("swordfish")
    path.write_text(f"<!DOCTYPE robot [<!ENTITY s SYSTEM '{secret}'>]><robot name='r'><link name='a'/>&s;</robot>")
    assert "swordfish" not in refused(lambda: load_urdf(path))


def test_imports(tmp_path: Path) -> None:
    """The files that a program imports are counted, and so are the frames of all of them together."""
    for i in range(3):
        (tmp_path / f"{i}.toml").write_text(f"[frames]\nA{i} = {IDENTITY}\nB{i} = {IDENTITY}\n")
    program = tmp_path / "p.rlo"
    program.write_text("".join(f'IMPORT "{i}.toml" ;\n' for i in range(3)) + "BEGIN PAUSE 1 END.\n")

    def notes() -> list[str]:
        return [note for one in compile_program(program).diagnostics if one.code == "E228" for note in one.notes]

    assert notes() == []
    with raised(imports=2):
        assert notes() == ["too many files: the limit is 2 files (`armwright --raise imports=NUMBER ...` raises it)"]
    with raised(frames=5):
        assert "too many frames in all files together: 6; the limit is 5 frames" in notes()[0]


def test_a_long_line_among_others(tmp_path: Path) -> None:
    """A line that ends is held to the limit as one is that does not, and counted."""
    table = tmp_path / "table.csv"
    table.write_text(f"a,b\n1,2\n{'1' * 19},2\n")

    with raised(line_characters=20):
        assert "table.csv:3: a line is too long" in refused(lambda: [*read_lines(table)])


def test_poses_of_a_linkage(tmp_path: Path) -> None:
    """The poses at which a linkage was measured are counted, however often each was read."""
    table = tmp_path / "rest.csv"
    rows = "".join(f"P{i // 2},{i // 2},0,{i // 2},0.1\n" for i in range(6))
    table.write_text(f"pose,commanded_x_mm,commanded_y_mm,x_mm,y_mm\n{rows}")

    found = read_clearance_measurements(table)
    assert isinstance(found, RestMeasurement)
    assert len(found.poses) == 3
    with raised(entries=2):
        assert "rest.csv:6: pose: too many: the limit is 2 entries" in refused(
            lambda: read_clearance_measurements(table)
        )


def test_typed_programs() -> None:
    """What is piped into a command is read up to the limit, and not further."""
    assert read_typed_program(io.BytesIO(b"\xef\xbb\xbfBEGIN\r\n")) == "BEGIN\n"
    endless = io.BytesIO(b" " * 5_000_000)
    assert refused(lambda: read_typed_program(endless)).startswith("standard input: too large: the limit is 1 MB")
    assert endless.tell() == 1_000_001
    assert "standard input:2: not UTF-8" in refused(lambda: read_typed_program(io.BytesIO(b"a\n\xff")))


# ---- what a file names ---------------------------------------------------------------------------------------------


@pytest.fixture(params=["a pipe", "a device", "a folder"])
def strange(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[str, str]:
    """What is no regular file: its kind, and its path."""
    if request.param == "a device":
        return request.param, "/dev/zero"
    path = tmp_path / "strange.toml"
    if request.param == "a pipe":
        os.mkfifo(path)
    else:
        path.mkdir()
    return request.param, str(path)


def test_what_a_program_imports(strange: tuple[str, str], tmp_path: Path) -> None:
    """A program imports regular files alone: a pipe or a device would be read for ever."""
    kind, path = strange
    program = tmp_path / "a.rlo"
    program.write_text(f'IMPORT "{path}" ;\nBEGIN PAUSE 1\nEND.\n')

    compiled = compile_program(program)

    assert f"expected a file, got {kind}" in render(compiled.diagnostics, compiled.source)
    assert f"expected a file, got {kind}" in refused(lambda: CellCache().read_import(tmp_path, path))
    assert f"expected a file, got {kind}" in refused(lambda: CellCache().find_cell(tmp_path, "", Path(path)))


def test_the_model_of_an_arm(strange: tuple[str, str], tmp_path: Path) -> None:
    """So does a cell with the model of an arm."""
    kind, path = strange
    (tmp_path / "cell.toml").write_text(f"[arms.ARM_1]\nmodel = '{path}{'' if path.endswith('.toml') else '/'}'\n")

    said = refused(lambda: read_cell(tmp_path / "cell.toml"))

    assert "arms, ARM_1, model" in said
    assert f"got {kind}" in said


def test_a_pipe_that_the_user_names() -> None:
    """What the user names may be a pipe."""
    out, into = os.pipe()
    os.write(into, b"name = 'pipe'\n[[joint]]\nkind = 'revolute'\n")
    os.close(into)

    assert load_arm(Path(f"/dev/fd/{out}")).name == "pipe"
    os.close(out)


# ---- raising -------------------------------------------------------------------------------------------------------


def test_raising(monkeypatch: pytest.MonkeyPatch) -> None:
    """A limit is raised in Python, by the environment or by an option; Python comes first."""
    assert limit("frames") == LIMITS["frames"].usual
    monkeypatch.setenv(limits.VARIABLE, "frames=7, table_rows=8")
    assert (limit("frames"), limit("table_rows")) == (7, 8)
    with raised(frames=9):
        assert (limit("frames"), limit("table_rows")) == (9, 8)
        with raised(table_rows=10):
            assert (limit("frames"), limit("table_rows")) == (9, 10)
    assert limit("frames") == 7


@pytest.mark.parametrize(
    "text", ["frames", "frames=", "frames=-1", "frames=1.5", "frames=1e9", "frames=" + "9" * 99, ""]
)
def test_no_limit(text: str) -> None:
    """A limit is a name and a whole number."""
    with pytest.raises(InvalidValueError, match="expected limits such as table_rows=10000000, got"):
        parse_limits(text)


def test_wrong_limits() -> None:
    """An unknown limit is answered with the nearest; none is nothing."""
    with pytest.raises(UnknownNameError, match=r"no limit .frame.\. Did you mean .frames."):
        parse_limits("frame=1")
    with pytest.raises(InvalidValueError, match="frames: expected an integer of 1 or more, got 0"):
        parse_limits("frames=0")
    with (
        pytest.raises(InvalidValueError, match="frames: expected an integer of 1 or more, got True"),
        raised(frames=True),
    ):
        pass


def test_the_option(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The option of the command line stands before the command."""
    monkeypatch.setenv(limits.VARIABLE, "file_mb=1")
    (tmp_path / "cell.toml").write_text(f"# {'x' * 1_000_000}\n[frames]\nA = {IDENTITY}\n")
    (tmp_path / "a.rlo").write_text('IMPORT "cell.toml" ;\nBEGIN PAUSE 1\nEND.\n')

    refusal = CliRunner().invoke(app, ["check", str(tmp_path / "a.rlo")])
    assert "the limit is 1 MB" in refusal.output
    allowed = CliRunner().invoke(app, ["--raise", "file_mb=2", "check", str(tmp_path / "a.rlo")])
    assert "MB" not in allowed.output
    wrong = CliRunner().invoke(app, ["--raise", "file=2", "check", str(tmp_path / "a.rlo")])
    assert wrong.exit_code == 2
    assert "no limit 'file'" in wrong.output


def test_the_page() -> None:
    """The documentation has the table as it is: docs/make_limits.py writes it."""
    page = (ROOT / "docs" / "limits.md").read_text(encoding="utf-8")

    rows = [f"| `{name}` | {one.usual:,} {one.unit} | {one.bounds} |" for name, one in LIMITS.items()]
    assert "|---|---|---|\n" + "\n".join(rows) + "\n\n" in page


# ---- no more than once ---------------------------------------------------------------------------------------------


def test_every_file_is_read_in_one_place() -> None:
    """Nobody but the readers opens a file that a user names, or parses what it holds."""
    own = {
        "files/inputs.py",
        "files/document.py",
        "files/key_lines.py",
        "files/rows.py",
        "files/toml_text.py",
        "arm/urdf/elements.py",
    }
    opening = re.compile(
        r"tomllib\.|csv\.reader|etree\.(parse|fromstring)|stdin\.buffer\.read\(|\bread_bytes\(\)|\.read_text\("
    )
    found = {
        f"{path.relative_to(ROOT / 'src' / 'armwright')}:{number}: {line.strip()}"
        for path in (ROOT / "src" / "armwright").rglob("*.py")
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if opening.search(line) and str(path.relative_to(ROOT / "src" / "armwright")) not in own
    }
    # Files that armwright wrote itself, or that come with it.
    ours = (
        "files/output.py",
        "report/movie.py",
        "report/ros2_log.py",
        "export/",
        "clearance/exudyn/",
        "clearance/mjcf/",
        "program/bytecode/verify.py",  # looks at titles that a program has in a text
        "report/markup.py",
        "program/diagnostics/index.py",
        "sweep/folder.py",
        "files/store.py",
        "spatial/meshes/step_process.py",  # gets by a pipe what was read
        "tracing/",
    )
    assert [one for one in sorted(found) if not any(name in one for name in ours)] == []


def test_dotted_keys() -> None:
    """The longest dotted key is found in any text, whatever stands in strings and comments."""
    assert longest_dotted_key('a.b . \'c.d\'."e\\".f" = 1') == 4
    assert longest_dotted_key("x = 'a.b.c' # a.b.c\ny = '''\na.b.c\n'''\nz = \"\"\"a.b.c\\\"\"\"\" \nu.v = 1") == 2
    assert longest_dotted_key("[" + "a." * 999 + "a]") == 1000
    for odd in (
        "'",
        '"',
        '"""',
        "'''",
        "\\",
        "a" * 100_000,
        "'" * 100_001,
        '"' * 100_001,
        '"\\' * 50_000,
        "'''\"\"\"" * 20_000,
    ):
        assert longest_dotted_key(odd) <= 1


def test_a_table_is_not_held(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A table of many rows is read in the memory of a few, whatever its size: its rows would take ten times as much."""
    monkeypatch.setattr(inputs, "_PIECE_BYTES", 1 << 12)
    path = tmp_path / "long.csv"
    path.write_text("a,b\n" + "1.25,2.5\n" * 5000)
    # What reading imports is none of its memory.
    next(read_rows(path)[1])
    peaks = []
    # What other threads take meanwhile counts as well, and only adds to it.
    for _ in range(3):
        tracemalloc.start()
        assert sum(1 for _ in read_rows(path)[1]) == 5000
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()

    assert min(peaks) < 160e3, peaks


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_ends_of_lines(end: str, tmp_path: Path) -> None:
    """Lines end as on any system, also where a piece of the file ends between the two letters of an end."""
    path = tmp_path / "a.csv"
    for shift in range(3):
        text = "a" * ((1 << 20) - 2 + shift - 300 * 4) + end
        path.write_bytes(
            text[:500_000].encode() + end.encode() + text[500_000:].encode() + ("b,c" + end).encode() * 500
        )
        assert [*read_lines(path)][2:] == ["b,c" + end] * 500
    path.write_bytes(b"a,b\n1,2\n\n\xe9,1\n")
    assert ":4: not UTF-8 text: byte 0xe9" in refused(lambda: [*read_lines(path)])


def test_long_names_and_many() -> None:
    """A word of a page is no misspelt name, and of many names a hundred are told."""
    said = str(UnknownNameError("frame", "x" * 100_000, [f"F{i:05}" for i in range(20_000)]))

    assert len(said) < 1200
    assert "and 19,900 more" in said
    assert isinstance(UnknownNameError("frame", "x", []), ArmwrightError)


def test_regular_files_are_not_waited_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A regular file of the system may make its reader wait, as /proc/kmsg does: none is waited for, but a pipe is."""
    opened: dict[str, int] = {}
    really = os.open
    monkeypatch.setattr(os, "open", lambda path, flags: opened.update({str(path): flags}) or really(path, flags))
    path = tmp_path / "thing.toml"
    path.write_text("x = 1\n")
    pipe, end = os.pipe()
    os.write(end, b"x = 2\n")
    os.close(end)

    assert read_text(path) == "x = 1\n"
    assert read_text(f"/proc/self/fd/{pipe}") == "x = 2\n"
    assert [flags & os.O_NONBLOCK for flags in opened.values()] == [os.O_NONBLOCK, 0]
