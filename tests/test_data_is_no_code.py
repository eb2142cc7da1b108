"""What users write, names above all, is data: it reaches no source that is executed, and no page that runs it."""

import json
from pathlib import Path

import attrs
import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.arm.model import Arm
from armwright.clearance.kernel import Layout, SimulationCode, emit_simulation
from armwright.clearance.linkage import BodyPoint, Linkage
from armwright.clearance.reader import load_linkage
from armwright.clearance.settings import Settings
from armwright.compiled.arm import compile_arm
from armwright.compiled.quantities import emit_quantity
from armwright.errors import InvalidValueError
from armwright.kinematics.forward_kinematics import forward
from armwright.tracing.emit import Emitted, emit
from armwright.tracing.emit_llvm import Target
from armwright.tracing.kernel import Kernel
from cli_calls import armwright
from samples import Sample

# What ends a string, a docstring, a comment, a line, a script or a format in some language or other.
PIECES = (
    '"""', "'''", '"', "'", "\\", "\n", "\r", "\u2028", "\u2029", "\x00", "\x1b[31m", "{", "}", "{0}", "%s", "%",
    "#", ";", "C:\\Users\\arm", "\\N{BULLET}", "\\x41", "</script>", "<!--", "]]>", "$", "$(id)", "`id`", "=1+1", "@",
    "-", "+", ",", "\t", "é", "\U0001f9be", "\u202e", "import os\nos.system('touch PWNED')\n", " ", "a", "Z", "0",
)  # fmt: skip
ESCAPE = 'x"""\nimport os\nos.system("touch PWNED")\n"""'
HOSTILE = {
    "docstring": ESCAPE,
    "path": "C:\\Users\\arm",
    "quotes": "'\"'''",
    "backslash": "\\",
    "braces": "{count} {0} {}",
    "separators": "a\u2028b\u2029c\x85d",
    "carriage return": "a\rimport os",
}


def random_name(rng: np.random.Generator) -> str:
    return "".join(rng.choice(PIECES, size=rng.integers(1, 7)))


@pytest.fixture
def five_bar() -> Linkage:
    return load_linkage("five-bar")


def renamed(linkage: Linkage, name: str) -> Linkage:
    """The same linkage with that name, and with every part called after it too."""
    new = {body.name: f"{body.name}{name}" for body in linkage.bodies}

    def moved(place: BodyPoint) -> BodyPoint:
        return place._replace(body=new.get(place.body, place.body))

    return attrs.evolve(
        linkage,
        name=name,
        bodies=[attrs.evolve(body, name=new[body.name]) for body in linkage.bodies],
        joints=[attrs.evolve(one, on=moved(one.on), body=new[one.body]) for one in linkage.joints],
        pins=[
            attrs.evolve(pin, name=f"{pin.name}{name}", bearing=moved(pin.bearing), journal=moved(pin.journal))
            for pin in linkage.pins
        ],
        drives=[attrs.evolve(drive, body=new[drive.body]) for drive in linkage.drives],
        loads=[attrs.evolve(load, point=moved(load.point)) for load in linkage.loads],
        tip=moved(linkage.tip),
        assembly={new[body]: place for body, place in linkage.assembly.items()},
    )


def source_of(linkage: Linkage) -> SimulationCode:
    return emit_simulation(Layout(linkage=linkage, friction=Settings().friction, control="effort"), "rk4")


def code_of(emitted: Emitted) -> tuple[str, str]:
    target = Target(lanes=8, has_fma=True)
    return emitted.single_ir(target), emitted.rows_ir(target)


@pytest.mark.parametrize("name", HOSTILE.values(), ids=HOSTILE)
def test_name_of_an_arm(name: str) -> None:
    """An arm's source is the same to the letter whatever the arm is called; the title stands beside it."""
    plain = load_arm("puma560")
    for quantity in ("forward", "inverse_branches"):
        told, expected = (emit_quantity(arm, quantity) for arm in (attrs.evolve(plain, name=name, title=name), plain))
        assert code_of(told) == code_of(expected)
        assert told.title == f"{quantity} of {name}"


@pytest.mark.parametrize("name", HOSTILE.values(), ids=HOSTILE)
def test_name_of_a_linkage(five_bar: Linkage, name: str) -> None:
    """A linkage's source is the same to the letter whatever it, its bodies and its pins are called."""
    assert source_of(renamed(five_bar, name)) == source_of(five_bar)


def test_random_names(sample: Sample, five_bar: Linkage) -> None:
    """No name of an arm or a linkage changes a letter of what is executed."""
    plain: Arm = load_arm("puma560")
    expected, of_linkage = emit_quantity(plain, "forward"), source_of(five_bar)
    tried = 0
    for rng in sample.cases(400):
        name = random_name(rng)
        told = emit_quantity(attrs.evolve(plain, name=name, title=name, source=name), "forward")
        assert code_of(told) == code_of(expected), name
        if tried % 10 == 0:
            assert source_of(renamed(five_bar, name)) == of_linkage, name
        tried += 1
    sample.record("names of arms and linkages: sources that a name changed", tried, 0)


def test_hostile_files_compile(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Arms and robots whose names would end a docstring compile, give the same poses, and run nothing."""
    monkeypatch.chdir(tmp_path)
    toml = (Path(load_arm.__code__.co_filename).parent / "catalogue" / "puma560.toml").read_text(encoding="utf-8")
    lines = [line for line in toml.splitlines() if not line.startswith("name")]
    Path("evil.toml").write_text("\n".join([f"name = {json.dumps(ESCAPE)}", *lines]), encoding="utf-8")
    q = np.linspace(-0.5, 0.5, 6)

    arm = load_arm(tmp_path / "evil.toml")

    assert arm.name == ESCAPE
    np.testing.assert_allclose(compile_arm(arm).forward(q), forward(arm, q), atol=1e-12)
    assert not Path("PWNED").exists()


def test_hostile_urdf(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A robot description whose names would end a docstring is simulated as any other."""
    pytest.importorskip("lxml", reason="URDF needs lxml")
    monkeypatch.chdir(tmp_path)
    name = ESCAPE.replace('"', "&quot;").replace("\n", "&#10;")
    body = '<inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    Path("evil.urdf").write_text(
        f'<robot name="{name}"><link name="{name}0"/><link name="{name}1">{body}</link><joint name="{name}" '
        f'type="revolute"><parent link="{name}0"/><child link="{name}1"/><axis xyz="0 1 0"/>'
        '<limit lower="-1" upper="2" effort="30" velocity="3"/></joint></robot>',
        encoding="utf-8",
    )

    done = armwright("simulate", "evil.urdf", "-q", "10", "--duration", "0.02", cwd=tmp_path)

    assert (done.returncode, done.stderr) == (0, "")
    assert [path.name for path in tmp_path.iterdir()] == ["evil.urdf"]


@pytest.mark.parametrize("name", ["q)", "q, *x", "q=print(1)", "", "lambda", "é", "q\n"])
def test_names_of_inputs_are_identifiers(name: str) -> None:
    """What becomes a parameter of a function is an identifier, or is refused."""
    with pytest.raises(InvalidValueError, match="inputs: expected names such as 'qd', got"):
        emit("sum", lambda x: [[x[0] + 1.0]], {name: 1})


def test_name_of_a_function() -> None:
    """The name that a function is given is no part of its source."""
    kernel = Kernel(emitted=emit("sum", lambda x: [[x[0] + 1.0]], {"x": 1}))

    assert kernel.function(ESCAPE).__name__ == ESCAPE
