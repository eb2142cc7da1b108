"""URDF files: what stands in them becomes an arm."""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from armwright.arm.limits import Limits
from armwright.arm.load import load_arm, read_arm
from armwright.arm.model import STANDARD_GRAVITY, Arm, Motor
from armwright.arm.urdf.reader import load_urdf, read_urdf
from armwright.arm.urdf.writer import lost_in_urdf, urdf_text
from armwright.arm.write import toml_text
from armwright.cell.reader import read_cell
from armwright.compiled.arm import compile_arm
from armwright.dynamics.inertia_matrix import mass_matrix
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.dynamics.payloads import payload
from armwright.dynamics.shares import gravity_efforts
from armwright.errors import UnsupportedArmError
from armwright.kinematics.forward_kinematics import forward
from armwright.kinematics.inverse_kinematics.recognise import find_geometry
from armwright.kinematics.inverse_kinematics.solve import inverse
from armwright.simulation.controllers import gravity_compensation
from armwright.simulation.simulator import simulate
from urdf_texts import ARM_WITH_GRIPPER, LIMIT, MASS, joint, link, one, robot

ROUNDING = 1e-12


@pytest.fixture
def read(tmp_path: Path) -> Callable[..., Arm]:
    """Write a text into a file and read it as an arm."""

    def write(text: str, **options: object) -> Arm:
        (tmp_path / "arm.urdf").write_text(text, encoding="utf-8")
        return load_urdf(tmp_path / "arm.urdf", **options)

    return write


def test_one_joint(read: Callable[..., Arm]) -> None:
    """A turn about z at the base is an arm whose tool turns about z."""
    arm = read(one())

    assert (arm.name, arm.n, arm.joints[0].kind) == ("test", 1, "revolute")
    assert arm.joints[0].limits == Limits(lower=-1, upper=2, speed=3, effort=30)
    assert arm.source == "arm.urdf, link 'base' to link 'hand'"
    np.testing.assert_allclose(forward(arm, [0.5])[:2, :2], [[np.cos(0.5), -np.sin(0.5)], [np.sin(0.5), np.cos(0.5)]])
    np.testing.assert_array_equal(arm.gravity, (0, 0, -STANDARD_GRAVITY))


def test_by_load_arm(tmp_path: Path) -> None:
    """A path that ends in .urdf is read as URDF, in letters of either case."""
    (tmp_path / "arm.URDF").write_text(one())

    assert load_arm(tmp_path / "arm.URDF") == load_arm(str(tmp_path / "arm.URDF")) == load_urdf(tmp_path / "arm.URDF")


def test_in_a_cell(tmp_path: Path) -> None:
    """An arm of a cell may be a URDF file beside the cell's, if it is built like one that has a closed-form inverse."""
    (tmp_path / "puma.urdf").write_text(urdf_text(load_arm("puma560")))
    (tmp_path / "cell.toml").write_text('[arms.ARM_1]\nmodel = "puma.urdf"\njoint_positions = [0, 0, 1, 0, 1, 0]\n')

    assert read_cell(tmp_path / "cell.toml").arms["ARM_1"].arm == load_urdf(tmp_path / "puma.urdf")


@pytest.mark.parametrize("axis", ["0 0 1", "0 0 -1", "1 0 0", "0 -1 0", "0 0 25", "1e-200 0 0", "1 2 -3"])
@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
def test_joint_positions_are_those_of_the_file(axis: str, kind: str, read: Callable[..., Arm]) -> None:
    """The tool moves about or along the axis as it is written, by q, and never the other way; its length is nothing."""
    arm = read(one(f'<axis xyz="{axis}"/>{LIMIT}', kind))
    u = np.array([float(x) for x in axis.split()])
    u = u / np.abs(u).max()
    u = u / np.linalg.norm(u)

    X = forward(arm, [0.3])

    if kind == "prismatic":
        np.testing.assert_allclose(X[:3, 3], 0.3 * u, atol=ROUNDING)
        return
    np.testing.assert_allclose(X[:3, :3] @ u, u, atol=ROUNDING)
    skew = (X[:3, :3] - X[:3, :3].T) / 2  # sin(q) times the axis
    np.testing.assert_allclose((skew[2, 1], skew[0, 2], skew[1, 0]), np.sin(0.3) * u, atol=ROUNDING)


def test_axis_left_out(read: Callable[..., Arm]) -> None:
    """A joint without an axis moves along x."""
    arm = read(robot(link("base"), link("hand"), joint("slide", "prismatic", "base", "hand", LIMIT)))

    np.testing.assert_allclose(forward(arm, [0.3])[:3, 3], (0.3, 0, 0), atol=ROUNDING)


def test_tables_of_built_arms_are_plain(read: Callable[..., Arm]) -> None:
    """An arm of right angles has a table of right angles and zeros, and is known by its build."""
    bend = '<origin xyz="{}" rpy="{} 0 0"/><axis xyz="0 0 1"/>' + LIMIT
    right = "1.57079632679"  # as files have it that were made with twelve digits
    arm = read(
        robot(
            *(link(f"l{i}") for i in range(7)),
            joint("j1", "revolute", "l0", "l1", bend.format("0 0 0.6", 0)),
            joint("j2", "revolute", "l1", "l2", bend.format("0 0 0", f"-{right}")),
            joint("j3", "revolute", "l2", "l3", bend.format("0.4 0 0.1", 0)),
            joint("j4", "revolute", "l3", "l4", bend.format("0 0 0", right)),
            joint("j5", "revolute", "l4", "l5", bend.format("0 0 0.4", f"-{right}")),
            joint("j6", "revolute", "l5", "l6", bend.format("0 0 0", right)),
        )
    )

    quarter = math.pi / 2
    assert [(j.theta, j.a, j.alpha) for j in arm.joints] == [
        (0, 0, -quarter),
        (0, 0.4, 0),
        (0, 0, quarter),
        (0, 0, -quarter),
        (0, 0, quarter),
        (0, 0, 0),
    ]
    np.testing.assert_allclose([j.d for j in arm.joints], (0, 0.1, 0, 0.4, 0, 0), atol=ROUNDING)
    geometry = find_geometry(arm)
    assert geometry is not None
    assert geometry.family == "puma"


def test_welded_links_are_one_body(read: Callable[..., Arm]) -> None:
    """Two balls of 1 kg and 3 kg, 1 m apart on one welded bar, have their centre 0.75 m out and 0.75 kg m² about it."""
    ball = '<inertial><mass value="{}"/><inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial>'
    arm = read(
        robot(
            link("base", MASS),
            link("near", ball.format(1)),
            link("far", ball.format(3)),
            joint("turn", "continuous", "base", "near", '<axis xyz="0 0 1"/>'),
            joint("weld", "fixed", "near", "far", '<origin xyz="1 0 0" rpy="0.3 0.4 0.5"/>'),
        )
    )

    body = arm.links[0]
    assert body.mass == 4
    np.testing.assert_allclose(body.com, (0.75, 0, 0), atol=ROUNDING)
    np.testing.assert_allclose(body.inertia, np.diag((0, 0.75, 0.75)), atol=ROUNDING)


def test_tensor_is_given_along_turned_axes(read: Callable[..., Arm]) -> None:
    """A rod along x whose tensor is written along axes turned by a quarter about z lies along y."""
    rod = (
        '<inertial><origin xyz="0 0.5 0" rpy="0 0 1.5707963267948966"/><mass value="1.2"/>'
        '<inertia ixx="0" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>'
    )
    arm = read(
        robot(link("base"), link("hand", rod), joint("turn", "continuous", "base", "hand", '<axis xyz="0 0 1"/>'))
    )

    np.testing.assert_allclose(arm.links[0].com, (0, 0.5, 0), atol=ROUNDING)
    np.testing.assert_allclose(arm.links[0].inertia, np.diag((0.1, 0, 0.1)), atol=ROUNDING)


def test_what_stands_still_does_not_count(read: Callable[..., Arm]) -> None:
    """The base, what is fixed to it and another arm on it add nothing to the efforts; their tensors may be anything."""
    impossible = MASS.replace('ixx="1"', 'ixx="100"')
    arm = read(
        robot(
            *(link(name, impossible) for name in ("base", "cabinet", "other")),
            link("hand", MASS),
            joint("screws", "fixed", "base", "cabinet"),
            joint("turn", "continuous", "base", "hand", '<axis xyz="0 0 1"/>'),
            joint("other_turn", "continuous", "cabinet", "other"),
        ),
        tip="hand",
    )

    assert arm.links[0].mass == 2
    assert inverse_dynamics(arm, [0.0], [0.0], [1.0]) == pytest.approx(1.0)  # izz


def test_friction(read: Callable[..., Arm]) -> None:
    """Damping is viscous friction, friction is dry friction either way."""
    arm = read(one(f'{LIMIT}<dynamics damping="0.5" friction="0.25"/>'))

    assert arm.motors == (Motor(viscous=0.5, coulomb_forward=0.25, coulomb_backward=0.25),)


@pytest.mark.parametrize(
    ("kind", "limit", "expected"),
    [
        ("continuous", "", Limits()),
        ("continuous", '<limit effort="5" velocity="6"/>', Limits(effort=5, speed=6)),
        ("continuous", '<limit lower="-1" upper="1" effort="5" velocity="6"/>', Limits(effort=5, speed=6)),
        ("revolute", '<limit lower="-1" upper="1"/>', Limits(lower=-1, upper=1)),
        ("prismatic", '<limit upper="0.5" effort="0" velocity="0"/>', Limits(lower=0, upper=0.5)),
        ("revolute", '<limit lower="-1e30" upper="1" effort="1e30" velocity="2e30"/>', Limits(upper=1)),
    ],
)
def test_limits(kind: str, limit: str, expected: Limits, read: Callable[..., Arm]) -> None:
    """A joint that turns without end has no stops; an effort or speed of 0 is not known, one of 1e30 has no bound."""
    assert read(one(limit, kind)).joints[0].limits == expected


def test_unknown_limits_are_told(tmp_path: Path) -> None:
    """That an effort of 0 was taken for unknown is told to who asks."""
    (tmp_path / "arm.urdf").write_text(one('<limit lower="-1" upper="1" effort="0" velocity="3"/>'))

    assert read_urdf(tmp_path / "arm.urdf").notes == ("joint 'turn': a maximum effort of 0 is interpreted as unknown",)


def test_locked_joints_are_fixed(read: Callable[..., Arm]) -> None:
    """With both fingers locked, a gripper is one body with the hand, whichever of its links is the tool."""
    arm = read(ARM_WITH_GRIPPER, tip="camera", lock=["left_slide", "right_slide"])

    assert (arm.n, arm.links[0].mass) == (1, 8)
    np.testing.assert_allclose(forward(arm, [0.0])[:3, 3], (0.5, 0, 0.1), atol=ROUNDING)


def test_locked_where_it_is_wanted(read: Callable[..., Arm], rng: np.random.Generator) -> None:
    """A joint held at a position is where it would be if it had moved there."""
    held = {"left_slide": 0.02, "right_slide": -0.01}
    arm, free = read(ARM_WITH_GRIPPER, tip="left", lock=held), read(ARM_WITH_GRIPPER, tip="left", lock=["right_slide"])
    q = rng.uniform(-3, 3)

    np.testing.assert_allclose(forward(arm, [q]), forward(free, [q, 0.02]), atol=ROUNDING)
    np.testing.assert_allclose(arm.links[0].com[1] * 8, 2 * 0.02 - 2 * 0.01, atol=ROUNDING)
    wrist = robot(
        *(link(name, MASS) for name in ("base", "arm", "hand")),
        joint("turn", "continuous", "base", "arm", '<axis xyz="0 0 1"/>'),
        joint("bend", "revolute", "arm", "hand", f'<origin xyz="0.5 0 0" rpy="0.3 0 1"/><axis xyz="0 1 1"/>{LIMIT}'),
    )
    bent = read(wrist, lock={"bend": 0.7})
    np.testing.assert_allclose(forward(bent, [q]), forward(read(wrist), [q, 0.7]), atol=ROUNDING)


def test_several_ends_on_one_link(tmp_path: Path) -> None:
    """Where a flange carries a tool point and a sensor, the flange is the tool: it moves as much as they do."""
    text = robot(
        *(link(name) for name in ("base", "arm", "flange", "tool0", "sensor")),
        joint("turn", "continuous", "base", "arm", '<axis xyz="0 0 1"/>'),
        joint("screws", "fixed", "arm", "flange", '<origin xyz="0.5 0 0"/>'),
        joint("to_tool", "fixed", "flange", "tool0", '<origin xyz="0 0 0.1"/>'),
        joint("to_sensor", "fixed", "flange", "sensor"),
    )
    (tmp_path / "arm.urdf").write_text(text)

    reading = read_urdf(tmp_path / "arm.urdf")

    assert reading.notes == (
        "the tool is 'flange', which carries 'tool0', 'sensor'; each moves as it does and may be the tip (--tip)",
    )
    assert reading.arm.tool_link == "flange"
    np.testing.assert_allclose(forward(reading.arm, [0.0])[:3, 3], (0.5, 0, 0), atol=ROUNDING)


@pytest.mark.parametrize(("moment", "said"), [("-1", "-1, 1, 1"), ("3", "1, 1, 3")])
def test_a_tensor_that_no_body_has(read: Callable[..., Arm], moment: str, said: str, tmp_path: Path) -> None:
    """A link with such a tensor has kinematics; dynamics says what is missing, of which link, and where it stands."""
    body = MASS.replace('ixx="1"', f'ixx="{moment}"')
    arm = read(one().replace('<link name="hand">', f'<link name="hand">{body}'))

    np.testing.assert_allclose(forward(arm, [0.5])[:2, 0], (np.cos(0.5), np.sin(0.5)))
    message = (
        f"arm 'test': no dynamics, for mass and inertia of link 1 ('hand') are unknown: {tmp_path / 'arm.urdf'}:3: "
        f"link 'hand', inertial, inertia: a body cannot have the principal moments {said} kg m² about its centre of "
        "mass"
    )
    asked = (
        lambda: inverse_dynamics(arm, [0.0], [0.0], [0.0]),
        lambda: gravity_efforts(arm, [0.0]),
        lambda: mass_matrix(arm, [0.0]),
        lambda: payload(arm, 1.0),
        lambda: compile_arm(arm).inverse_dynamics,
        lambda: gravity_compensation(arm),
        lambda: simulate(arm, [0.0], duration=0.1),
    )
    for ask in asked:
        with pytest.raises(UnsupportedArmError) as caught:
            ask()
        assert message in str(caught.value)
    assert str(caught.value).endswith("Kinematics does not need them")
    # It is kept in files of our own, and told by those that cannot hold it.
    (tmp_path / "arm.toml").write_text(toml_text(arm), encoding="utf-8")
    assert read_arm(tmp_path / "arm.toml") == arm
    assert any("its mass and inertia are unknown" in sentence for sentence in lost_in_urdf(arm))


def test_names_are_kept(read: Callable[..., Arm], tmp_path: Path) -> None:
    """Joints and links keep their names on the way through an arm file and URDF, and messages use them."""
    arm = read(one())
    assert (arm.joints[0].name, arm.links[0].name, arm.base_link, arm.tool_link) == ("turn", "hand", "base", "hand")

    (tmp_path / "arm.toml").write_text(toml_text(arm), encoding="utf-8")
    again = read_arm(tmp_path / "arm.toml")
    assert again == arm
    written = urdf_text(again)
    assert '<joint name="turn" type="revolute">' in written
    assert '<link name="hand" />' in written
    assert '<link name="tool" />' in written  # the hand is the tool; two links cannot have one name
    solution = inverse(arm, forward(arm, [2.5]))
    assert "joint 1 ('turn') would be at 143.2 deg, 28.6 deg beyond its limit 114.6 deg" in solution.explain()


def test_links_without_mass_may_move_beside_the_chain(read: Callable[..., Arm]) -> None:
    """A joint beside the chain that carries nothing changes nothing."""
    arm = read(
        robot(
            link("base"),
            link("hand", MASS),
            link("flap"),
            joint("turn", "continuous", "base", "hand", '<axis xyz="0 0 1"/>'),
            joint("hinge", "continuous", "hand", "flap"),
        ),
        tip="hand",
    )

    assert (arm.n, arm.links[0].mass) == (1, 2)


def test_base_on_a_wall(read: Callable[..., Arm]) -> None:
    """Gravity points down in the root of the file, also where the base is a link that is screwed to a wall."""
    text = robot(
        link("room"),
        link("base"),
        link("hand", MASS),
        joint("screws", "fixed", "room", "base", '<origin xyz="0 0 2" rpy="0 1.5707963267948966 0"/>'),
        joint("turn", "continuous", "base", "hand", '<axis xyz="0 0 1"/>'),
    )

    np.testing.assert_array_equal(read(text, base="base").gravity, (STANDARD_GRAVITY, 0, 0))
    np.testing.assert_array_equal(read(text).gravity, (0, 0, -STANDARD_GRAVITY))


def test_what_other_programs_put_there_is_skipped(read: Callable[..., Arm]) -> None:
    """Shapes, materials, transmissions, comments and elements of other namespaces change nothing."""
    plain = read(one())
    busy = one().replace(
        '<robot name="test">',
        '<?xml version="1.0" encoding="ISO-8859-1"?><!-- links --><robot name="test" xmlns="http://a" xmlns:d="http://b">'
        '<material name="grey"/><gazebo reference="hand"/><d:tree/>'
        '<transmission name="t"><joint name="turn"/></transmission>',
    )
    busy = busy.replace('<link name="hand">', '<link name="hand"><visual><origin xyz="x"/></visual><!-- none -->')

    assert read(busy) == plain
