"""Arms from MJCF files, against MuJoCo itself reading the same text."""

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
import trimesh

from armwright.arm.load import load_arm
from armwright.arm.mjcf.reader import load_mjcf, read_mjcf
from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.compiled.arm import compile_arm
from armwright.errors import FileFormatError, InvalidValueError, KindError, UnknownNameError
from armwright.files.limits import raised
from armwright.kinematics.forward_kinematics import forward
from armwright.spatial.shapes import Box, Capsule, Cylinder, Mesh, Sphere

EXAMPLE = Path(__file__).parents[2] / "examples" / "desk_arm.xml"
# What the product of some dozen transforms loses.
EXACT = 1e-12
FINGERS = ("left", "right")
ARM = """<mujoco model="one">{before}<worldbody><body name="base">
<body name="arm">{joint}{geom}</body></body></worldbody>{after}</mujoco>"""
JOINT, GEOM = '<joint name="turn"/>', '<geom size="0.1"/>'


def written(folder: Path, text: str, name: str = "arm.xml") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def one(before: str = "", joint: str = JOINT, geom: str = GEOM, after: str = "") -> str:
    """The text of an arm of one joint."""
    return ARM.format(before=before, joint=joint, geom=geom, after=after)


def pose(data: Any, kind: str, name: str) -> Array:
    """The pose of a body or a site in MuJoCo's world."""
    X, item = np.eye(4), getattr(data, kind)(name)
    X[:3, :3], X[:3, 3] = item.xmat.reshape(3, 3), item.xpos
    return X


def check(arm: Arm, path: Path, ends: tuple[str, str], sites: dict[str, float], rng: np.random.Generator) -> None:
    """Poses, mass matrix and bias of an arm are those of MuJoCo, other joints being held."""
    model = mujoco.MjModel.from_xml_path(str(path))
    data, (base, tip) = mujoco.MjData(model), ends
    dofs = [model.joint(joint.name).dofadr[0] for joint in arm.joints]
    compiled = compile_arm(arm, quickly=True)
    for _ in range(10):
        q, qd = rng.uniform(-2, 2, arm.n), rng.normal(size=arm.n)
        for name, position in sites.items():
            data.joint(name).qpos[0] = position
        for joint, position, speed in zip(arm.joints, q, qd, strict=True):
            data.joint(joint.name).qpos[0], data.joint(joint.name).qvel[0] = position, speed
        mujoco.mj_forward(model, data)
        X = np.linalg.inv(pose(data, "body", base)) @ pose(data, "site", tip)
        np.testing.assert_allclose(forward(arm, q), X, rtol=0, atol=EXACT)
        M = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, M)
        expected, bias = compiled.mass_and_bias(q, qd)
        np.testing.assert_allclose(M[np.ix_(dofs, dofs)], expected, rtol=0, atol=EXACT * np.abs(expected).max())
        scale = np.abs(bias).max() + np.abs(expected).max()
        np.testing.assert_allclose(data.qfrc_bias[dofs], bias, rtol=0, atol=EXACT * scale)


@pytest.mark.parametrize("open_m", [0.0, 0.03])
def test_what_people_write(open_m: float, rng: np.random.Generator) -> None:
    """Degrees, nested defaults, frames, anchors, references, two joints in one body: the arm moves as in MuJoCo."""
    held = dict.fromkeys(FINGERS, open_m)

    arm = load_mjcf(EXAMPLE, tip="pinch", lock=held)

    assert [joint.name for joint in arm.joints] == ["waist", "shoulder", "elbow", "reach", "pitch", "roll"]
    check(arm, EXAMPLE, ("desk", "pinch"), held, rng)


def test_limits_and_drives() -> None:
    """Ranges are in radians and metres, efforts those of the actuators at the joint, friction that of the joint."""
    reading = read_mjcf(EXAMPLE, tip="pinch", lock=FINGERS)

    limits, arm = reading.arm.limits, reading.arm
    np.testing.assert_allclose(limits.lower, [*np.radians([-170, -30, -150]), -0.05, *np.radians([-120, -120])])
    np.testing.assert_allclose(limits.upper, [*np.radians([170, 120, 0]), 0.1, *np.radians([120, 120])])
    assert limits.effort.tolist() == [60, 60, 40, 12, 12, np.inf]
    assert arm.motor_values("viscous").tolist() == [0.8, 0.8, 0.8, 0.1, 0.1, 0.1]
    assert arm.motor_values("inertia").tolist() == [0.12, 0.12, 0.12, 0.02, 0.02, 0.02]
    for name in ("coulomb_forward", "coulomb_backward"):
        assert arm.motor_values(name).tolist() == [0.3, 0.3, 0.3, 0.05, 0.05, 0.05]
    assert reading.notes == (
        "joint 'elbow': efforts from -40 to 55 are limited to 40 in both directions",
        "gravity: (0, 0, -9.81) m/s² along the axes of 'desk'",
    )
    assert (arm.name, arm.base_link, arm.tool_link, arm.gravity_from) == ("desk_arm", "desk", "pinch", "stated")


def test_solids() -> None:
    """Geoms are solids of their links, those of the base too; a plane is none."""
    arm = load_mjcf(EXAMPLE, tip="pinch", lock=FINGERS)

    kinds = [[type(solid.shape) for solid in link.solids] for link in arm.links]
    assert kinds == [[Cylinder], [Capsule], [Capsule], [Sphere], [], [Capsule, Box, Box]]
    (desk,) = arm.base_solids
    assert desk.shape.size.tolist() == [0.8, 0.6, 0.04]
    np.testing.assert_allclose(desk.pose[:3, 3], (0, 0, -0.02))


def test_drawn_geoms_and_meshes(tmp_path: Path) -> None:
    """Where geoms collide, those only drawn are left out, and their files not even read; meshes stay as typed."""
    block = trimesh.creation.box((0.1, 0.2, 0.3)).apply_translation((0.5, 0.0, 0.0))
    (tmp_path / "meshes").mkdir()
    block.export(tmp_path / "meshes" / "block.stl")
    geoms = """<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
        <geom type="mesh" mesh="block" pos="0 0 1" euler="0 0 90"/>
        <geom type="mesh" mesh="gone" contype="0" conaffinity="0"/>"""
    before = """<compiler meshdir="meshes"/><asset><mesh file="block.stl" scale="2 2 2"/>
        <mesh name="gone" file="no.stl"/></asset>"""

    (solid,) = load_mjcf(written(tmp_path, one(before, geom=geoms))).links[0].solids

    assert isinstance(solid.shape, Mesh)
    world = solid.shape.vertices @ solid.pose[:3, :3].T + solid.pose[:3, 3]
    # Twice as large, turned by 90 degrees about z, raised by a metre.
    np.testing.assert_allclose(world.min(axis=0), (-0.2, 0.9, 0.7), atol=1e-6)
    np.testing.assert_allclose(world.max(axis=0), (0.2, 1.1, 1.3), atol=1e-6)


@pytest.mark.parametrize("name", ["./block.stl", "a//block.stl", "a/./block.stl", "a/../block.stl", ".//./block.stl"])
def test_names_of_mesh_files(name: str, tmp_path: Path) -> None:
    """A mesh is found by any name of its file, though MuJoCo shortens it."""
    (tmp_path / "a").mkdir()
    for folder in (tmp_path, tmp_path / "a"):
        trimesh.creation.box((0.1, 0.2, 0.3)).export(folder / "block.stl")
    text = one(f'<asset><mesh name="m" file="{name}"/></asset>', geom='<geom type="mesh" mesh="m"/>')

    (solid,) = load_mjcf(written(tmp_path, text)).links[0].solids

    assert isinstance(solid.shape, Mesh)
    np.testing.assert_allclose(np.sort(np.ptp(solid.shape.vertices, axis=0)), (0.1, 0.2, 0.3), atol=1e-6)


def test_includes(tmp_path: Path) -> None:
    """What a file includes is read as if it stood there."""
    (tmp_path / "parts").mkdir()
    written(tmp_path / "parts", f"<mujocoinclude>{JOINT}{GEOM}</mujocoinclude>", "joint.xml")

    arm = load_arm(written(tmp_path, one(joint='<include file="parts/joint.xml"/>', geom="")))

    assert [joint.name for joint in arm.joints] == ["turn"]


def test_names(tmp_path: Path) -> None:
    """Quotes and other signs in names stay; what has no name is called by its number."""
    joint = '<joint name="a &quot;b&quot; &amp; c --"/>'
    text = one(joint=joint, geom=GEOM + f'<body pos="1 0 0"><joint/>{GEOM}</body>')

    arm = load_mjcf(written(tmp_path, text))

    assert [joint.name for joint in arm.joints] == ['a "b" & c --', "joint1"]
    assert [link.name for link in arm.links] == ["arm", "body3"]


BEYOND = {
    "a ball": (
        one(joint='<joint name="b" type="ball"/>', geom=f"{GEOM}<body>{JOINT}{GEOM}</body>"),
        "joint 'b': an arm cannot have a ball joint; expected slide or hinge: replace it by three hinges",
    ),
    "a free body": (
        '<mujoco><worldbody><body name="a"><freejoint/><geom size="1"/></body></worldbody></mujoco>',
        "no body moves by a hinge or a slide",
    ),
    "an equality": (
        one(after='<equality><joint name="locks" joint1="turn"/></equality>'),
        "joint 'turn': the equality 'locks' acts on it; an arm can only have independent joints: remove that",
    ),
    "a weld": (
        one(after='<equality><weld body1="arm" body2="base"/></equality>'),
        "joint 'turn': the equality number 1 acts on it",
    ),
    "a tendon": (
        one(after='<tendon><fixed name="rope"><joint joint="turn" coef="1"/></fixed></tendon>'),
        "joint 'turn': the tendon 'rope' acts on it",
    ),
    "branches": (
        one(geom=GEOM + "".join(f'<body name="{n}"><joint name="{n}"/>{GEOM}</body>' for n in "ab")),
        "it could be 'a', 'b', or a link before them; specify one as tip: load_mjcf(path, tip='arm')",
    ),
    "two arms": (
        "<mujoco><worldbody>"
        + "".join(f'<body name="{n}"><body><joint/>{GEOM}</body></body>' for n in "ab")
        + "</worldbody></mujoco>",
        "the base is ambiguous: it could be 'a', 'b'; specify one as base (--base)",
    ),
}


@pytest.mark.parametrize("what", BEYOND)
def test_what_no_arm_has(what: str, tmp_path: Path) -> None:
    """What is no chain of hinges and slides is refused by name, with what to do."""
    text, message = BEYOND[what]

    with pytest.raises(FileFormatError) as caught:
        load_mjcf(written(tmp_path, text))

    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


NESTED = "<mujoco><worldbody>" + "<body>" * 100 + "</body>" * 100 + "</worldbody></mujoco>"
BOMB = '<!DOCTYPE m [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;&a;&a;">]><mujoco model="&b;"/>'
HOSTILE = {
    "nothing": ("", "arm.xml:1: not valid XML: no element found"),
    "no XML": ("<mujoco", "arm.xml:1: not valid XML: unclosed token"),
    "a mesh of another scheme": (
        one('<asset><mesh name="m" file="http://x/y.stl"/></asset>', geom='<geom type="mesh" mesh="m"/>'),
        "y.stl: no such file",
    ),
    "a mesh with a slash at its end": (
        one('<asset><mesh name="m" file="y.stl/"/></asset>', geom='<geom type="mesh" mesh="m"/>'),
        "y.stl: no such file",
    ),
    "another format": ("<robot/>", "arm.xml:1: expected <mujoco>, as MJCF files have, got <robot>"),
    "entities": (BOMB, "arm.xml:1: <!DOCTYPE>: a document type is not read, and MJCF files need none"),
    "depth": (NESTED, "arm.xml:1: <body>: nested too deeply: the limit is 60 levels"),
    "elements": ("<mujoco>" + "<a/>" * 100_001 + "</mujoco>", "too many elements: the limit is 100,000 elements"),
    "size": ("<mujoco>" + " " * 4_000_001 + "</mujoco>", "the limit is 4 MB"),
    "not a number": (
        one(geom='<geom size="nan"/>'),
        "<geom>, size: expected a number no larger than 1e+100, got 'nan'",
    ),
    "huge numbers": (one(geom='<geom size="1e300"/>'), "<geom>, size: expected a number no larger than 1e+100"),
    "letters": (one(geom='\n<geom size="a b"/>'), "arm.xml:3: <geom>: bad format in attribute 'size'"),
    "a long shaft": (one(geom='<geom size="1e30"/>'), "arm.xml: "),
    "a misspelt element": (one(joint="<jiont/>"), "<jiont>: unknown element in <body>; did you mean <joint>?"),
    "a misspelt attribute": (one(joint='<joint axs="0 0 1"/>'), "<joint>: unrecognized attribute: 'axs'"),
    "copies": (
        one(geom='<replicate count="1000000000"/>'),
        "<replicate> is not read; MuJoCo writes the bodies that it",
    ),
    "a cloth": (one(geom='<flexcomp name="c" count="9999 9999 1"/>'), "<flexcomp> 'c': <flexcomp> is not read"),
    "a built-in mesh": (one('<asset><mesh name="m" builtin="sphere" params="12"/></asset>'), "built-in meshes are not"),
    "no mass": (one(geom=""), "mass and inertia of moving bodies must be larger than mjMINVAL"),
    "no file": (one(joint='<include file="no.xml"/>'), "no.xml: no such file"),
    "itself": (one(joint='<include file="arm.xml"/>'), "'arm.xml' is included twice"),
    "a file elsewhere": (
        one(joint='<include file="../../../etc/passwd"/>'),
        "<include>, file: expected a file in the folder of the MJCF file or below it, got '../../../etc/passwd'",
    ),
    "an absolute path": (one(joint='<include file="/etc/passwd"/>'), "got '/etc/passwd'"),
    "a mesh elsewhere": (
        one(
            '<compiler meshdir="/etc"/><asset><mesh name="m" file="x.stl"/></asset>',
            geom='<geom type="mesh" mesh="m"/>',
        ),
        "<mesh> 'm', file: expected a file in the folder of the MJCF file or below it, got 'x.stl'",
    ),
    "another mesh": (
        one('<asset><mesh name="m" file="x.ply"/></asset>', geom='<geom type="mesh" mesh="m"/>'),
        "<mesh> 'm', file: expected a mesh in .stl or .obj, got x.ply",
    ),
    "a broken mesh": (
        one('<asset><mesh name="m" file="arm.stl"/></asset>', geom='<geom type="mesh" mesh="m"/>'),
        "arm.stl",
    ),
}


@pytest.mark.parametrize("what", HOSTILE)
def test_hostile_files(what: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file that is broken, or asks for any amount of memory or for other files, is refused in one line."""
    text, message = HOSTILE[what]
    monkeypatch.chdir(tmp_path)
    written(tmp_path, text)

    with pytest.raises(FileFormatError) as caught:
        load_mjcf("arm.xml")

    assert message in str(caught.value)
    assert "\n" not in str(caught.value)
    assert [path.name for path in tmp_path.iterdir()] == ["arm.xml"]


def test_what_is_left_out(tmp_path: Path) -> None:
    """Textures, height fields and sensors take no memory; that ellipsoids and parts of springs are not read is said."""
    before = """<size memory="1000G" nkey="1000000000"/><asset>
        <texture name="t" builtin="flat" width="99999" height="99999"/>
        <hfield name="h" nrow="99999" ncol="99999" size="1 1 1 1"/><material name="m" texture="t"/></asset>"""
    text = one(
        before,
        joint='<joint name="turn" stiffness="3 1 0"/>',
        geom='<geom type="ellipsoid" size="0.1 0.2 0.3" material="m"/><geom type="hfield" hfield="h"/>',
        after='<sensor><jointpos joint="turn"/></sensor>',
    )

    reading = read_mjcf(written(tmp_path, text))

    assert reading.arm.links[0].solids == ()
    assert {"joint 'turn': of its spring only the linear part is read", "body 'arm': ellipsoids are not read"} <= {
        *reading.notes
    }


def test_limits_are_raised(tmp_path: Path) -> None:
    """Whoever has deeper files reads them."""
    text = NESTED.replace("</body>", f"{JOINT}{GEOM}</body>", 1)
    with raised(nesting=200):
        assert load_mjcf(written(tmp_path, text)).n == 1


def test_wrong_calls(tmp_path: Path) -> None:
    """What is no path, no link, no joint or no position of one is said."""
    path = written(tmp_path, one())
    with pytest.raises(KindError, match="expected the path of an MJCF file, got 3"):
        load_mjcf(3)  # type: ignore[arg-type]
    with pytest.raises(UnknownNameError, match=r"no link 'amr'\. Did you mean 'arm'\?"):
        load_mjcf(path, tip="amr")
    with pytest.raises(UnknownNameError, match=r"no joint 'trun'\. Did you mean 'turn'\?"):
        load_mjcf(path, lock=["trun"])
    with pytest.raises(KindError, match="lock: expected a list of names"):
        load_mjcf(path, lock="turn")
    with pytest.raises(InvalidValueError, match=r"joint 'left' cannot be locked at 0.05 \(rad or m\)"):
        load_mjcf(EXAMPLE, lock={"left": 0.05})
