"""Arms and cells as MJCF files: compiled by MuJoCo, and read back."""

import math
from pathlib import Path
from typing import Any

import attrs
import mujoco
import numpy as np
import pytest

from armwright.arm.limits import Limits
from armwright.arm.load import load_arm, read_arm
from armwright.arm.mjcf.reader import load_mjcf
from armwright.arm.model import Arm, Joint, Link, Motor
from armwright.arm.tensors import impossible_moments
from armwright.arrays import Array
from armwright.cell.reader import read_cell
from armwright.cell.scene import Gripper
from armwright.compiled.arm import compile_arm
from armwright.errors import FileFormatError, InvalidValueError, UnsupportedArmError
from armwright.kinematics.forward_kinematics import forward
from armwright.physics.mjcf import arm_mjcf, cell_mjcf
from armwright.physics.mjcf_cell import read_cell_mjcf
from armwright.physics.mjcf_text import spec_text
from armwright.physics.world_model import world_spec
from armwright.spatial.shapes import Box, Capsule, Cylinder, Mesh, Solid, Sphere, volume
from oracles.arms import of_all_kinds, random_arm, random_pose
from oracles.catalogue import FEW_WITH_MASSES, WITH_MASSES
from samples import Sample

EXAMPLES = Path(__file__).parents[2] / "examples"
# What the product of some dozen transforms loses, and what must come back of what MJCF holds.
EXACT, SAME = 1e-12, 1e-9


def holds_its_inertia(arm: Arm) -> bool:
    """Whether all links are bodies that MuJoCo's compiler takes."""

    def taken(link: Link) -> bool:
        moments = np.linalg.eigvalsh(link.inertia)
        return link.mass > 1e-6 and moments[0] > 0 and moments[2] <= moments[0] + moments[1]

    return all(map(taken, arm.links))


def states(arm: Arm, rng: np.random.Generator, count: int) -> tuple[Array, Array]:
    low, high = np.maximum(arm.limits.lower, -3), np.minimum(arm.limits.upper, 3)
    return rng.uniform(low, high, (count, arm.n)), rng.normal(size=(count, arm.n))


def check(arm: Arm, folder: Path, rng: np.random.Generator) -> None:
    """What MuJoCo makes of the file moves as the arm, and what is read back is the arm."""
    path = folder / "arm.xml"
    path.write_text(arm_mjcf(arm).text, encoding="utf-8")
    model = mujoco.MjModel.from_xml_path(str(path))
    data, M = mujoco.MjData(model), np.zeros((arm.n, arm.n))
    again = load_mjcf(path)
    one, other, exact = compile_arm(arm, quickly=True), compile_arm(again, quickly=True), holds_its_inertia(arm)

    for q, qd in zip(*states(arm, rng, 5), strict=True):
        data.qpos[:], data.qvel[:] = q, qd
        mujoco.mj_forward(model, data)
        mujoco.mj_fullM(model, data, M)
        X, (mass, bias) = forward(arm, q), one.mass_and_bias(q, qd)
        scale = 1 + np.abs(X[:3, 3]).max()
        np.testing.assert_allclose(forward(again, q), X, rtol=0, atol=SAME * scale)
        np.testing.assert_allclose(data.site(0).xpos, X[:3, 3], rtol=0, atol=EXACT * scale)
        back, bias_back = other.mass_and_bias(q, qd)
        weight, force = np.abs(mass).max(), np.abs(bias).max() + np.abs(mass).max()
        # MuJoCo's numbers and those read back are of the same bodies.
        np.testing.assert_allclose(back, M, rtol=0, atol=SAME * weight)
        np.testing.assert_allclose(bias_back, data.qfrc_bias, rtol=0, atol=SAME * force)
        if exact:
            np.testing.assert_allclose(M, mass, rtol=0, atol=EXACT * weight)
            np.testing.assert_allclose(data.qfrc_bias, bias, rtol=0, atol=EXACT * force)
    for name in ("lower", "upper", "effort"):
        np.testing.assert_allclose(getattr(again.limits, name), getattr(arm.limits, name), rtol=SAME)
    for name in ("inertia", "viscous"):
        np.testing.assert_allclose(again.motor_values(name), arm.motor_values(name), rtol=SAME)
    dry = (arm.motor_values("coulomb_forward") + arm.motor_values("coulomb_backward")) / 2
    np.testing.assert_allclose(again.motor_values("coulomb_forward"), dry, rtol=SAME)
    np.testing.assert_allclose(again.gravity, arm.gravity, rtol=0, atol=SAME)


@pytest.mark.drawn(FEW_WITH_MASSES)
@pytest.mark.parametrize("name", WITH_MASSES)
def test_the_catalogue_comes_back(name: str, tmp_path: Path, rng: np.random.Generator) -> None:
    """An arm of the catalogue written as MJCF is the same arm for MuJoCo, and when it is read again."""
    check(load_arm(name), tmp_path, rng)


def test_random_arms_come_back(tmp_path: Path, sample: Sample) -> None:
    """So is any arm: joints of both kinds, skew axes, massless links, fixed transforms, bases turned anyhow."""
    arms = 200 if sample.whole else 10
    for k in range(arms):
        rng = np.random.default_rng([sample.seed, k])
        arm = random_arm(rng, int(rng.integers(1, 8)))
        check(of_all_kinds(arm, rng) if k % 2 else arm, tmp_path, rng)
    sample.record("arms to MJCF and back", arms, 0)


def test_modified_tables_come_back(tmp_path: Path, rng: np.random.Generator) -> None:
    """So is an arm whose file has a modified table."""
    rows = "".join(
        f'[[joint]]\nkind = "{kind}"\na_m = 0.{i}\nalpha_deg = {40 * i}\nd_m = 0.1\n'
        f"[joint.link]\nmass_kg = {i}\ncom_m = [0.1, 0, 0.2]\ninertia_kgm2 = [0.02, 0.03, 0.04]\n"
        for i, kind in enumerate(("revolute", "prismatic", "revolute", "revolute"), 1)
    )
    (tmp_path / "modified.toml").write_text(f'convention = "modified"\n{rows}', encoding="utf-8")

    check(read_arm(tmp_path / "modified.toml"), tmp_path, rng)


def small(**changes: Any) -> Arm:
    """An arm of two joints."""
    link = Link(mass=1.0, com=(0.1, 0, 0), inertia=np.diag((0.02, 0.03, 0.04)))
    joints = [Joint(kind="revolute", a=0.3), Joint(kind="prismatic", alpha=1.0)]
    return attrs.evolve(Arm(name="small", joints=joints, links=[link, link]), **changes)


def back(arm: Arm, folder: Path) -> Arm:
    (folder / "arm.xml").write_text(arm_mjcf(arm).text, encoding="utf-8")
    return load_mjcf(folder / "arm.xml")


def test_one_sided_limits(tmp_path: Path) -> None:
    """A joint with one end has it afterwards too, and one without ends none."""
    for ends in ((-1.0, math.inf), (-math.inf, 2.0), (-math.inf, math.inf)):
        limits = Limits(lower=ends[0], upper=ends[1])
        joints = [attrs.evolve(joint, limits=limits) for joint in small().joints]

        again = back(small(joints=joints), tmp_path)

        assert [(joint.limits.lower, joint.limits.upper) for joint in again.joints] == [ends, ends]


def test_names_come_back(tmp_path: Path) -> None:
    """Names of the arm, its joints, links, base and tool stay, with quotes and hyphens; others have numbers."""
    named = small(
        name='an "arm" -- <of> & mine',
        joints=[attrs.evolve(small().joints[0], name='the "first" --'), small().joints[1]],
        links=[attrs.evolve(small().links[0], name="upper"), small().links[1]],
        base_link="pedestal",
        tool_link="tip",
    )

    again = back(named, tmp_path)

    assert again.name == named.name
    assert [joint.name for joint in again.joints] == ['the "first" --', "joint2"]
    assert [link.name for link in again.links] == ["upper", "link2"]
    assert (again.base_link, again.tool_link) == ("pedestal", "tip")


def test_a_name_beyond_xml() -> None:
    """A name that XML cannot hold is refused."""
    with pytest.raises(InvalidValueError, match="XML cannot represent every character of this name"):
        arm_mjcf(small(name="bell \x07"))


def test_solids_come_back(tmp_path: Path) -> None:
    """Solids of links and of the base stay where they are, meshes too; guessed ones are not written."""
    rng = np.random.default_rng(1)
    corners = np.array([(0, 0, 0), (0.3, 0, 0), (0, 0.2, 0), (0, 0, 0.1)], dtype=float)
    faces = np.array([(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])
    shapes = [Box(size=(0.1, 0.2, 0.3)), Cylinder(radius=0.1, length=0.4), Capsule(radius=0.1, length=0.2)]
    shapes += [Sphere(radius=0.2), Mesh(vertices=corners, faces=faces)]
    solids = [Solid(shape=shape, pose=random_pose(rng)) for shape in shapes]
    link = attrs.evolve(small().links[0], solids=solids)
    arm = small(links=[link, small().links[1]], base_solids=solids[:1], base=random_pose(rng))

    again = back(arm, tmp_path)

    assert back(small(), tmp_path).links[0].solids == ()
    assert again.links[1].solids == ()
    # The frames may differ, so the solids are compared in the base frame, at zero positions.
    q = np.zeros(2)
    for before, after in (
        (placed(arm, link, q), placed(again, again.links[0], q)),
        (list(arm.base_solids), list(again.base_solids)),
    ):
        for one, other in zip(before, after, strict=True):
            assert type(one.shape) is type(other.shape)
            np.testing.assert_allclose(points(one), points(other), atol=1e-7)


def placed(arm: Arm, link: Link, q: Array) -> list[Solid]:
    from armwright.kinematics.forward_kinematics import link_poses

    return [solid.moved(link_poses(arm, q)[1]) for solid in link.solids]


def points(solid: Solid) -> Array:
    """Points that tell a solid: its vertices, or the ends of its axes."""
    match solid.shape:
        case Mesh(vertices=vertices):
            local = vertices
        case Box(size=size):
            local = np.diag(size)
        case Sphere(radius=radius):
            return np.append(solid.pose[:3, 3], radius)
        case Cylinder(radius=radius, length=length) | Capsule(radius=radius, length=length):
            local = np.array([(0, 0, length), (0, 0, -length), (0, 0, radius)])
    return np.asarray(local @ solid.pose[:3, :3].T + solid.pose[:3, 3])


def test_what_is_lost() -> None:
    """What MJCF cannot hold is said with its numbers, and by how much the mass matrix is off is measured."""
    motors = [Motor(coulomb_forward=2.5, coulomb_backward=1.5, gear_ratio=50), Motor()]
    limits = Limits(speed=2.0, acceleration=5.0)
    bare = Link(mass=1.0, inertia=np.diag((0.0, 0.0, 0.5)))
    arm = small(motors=motors, links=[bare, small().links[1]])
    arm = attrs.evolve(arm, joints=[attrs.evolve(arm.joints[0], limits=limits), arm.joints[1]])

    file = arm_mjcf(arm)

    padded = "they are 1 kg and 0.25, 0.25, 0.5 kg m²"
    assert impossible_moments(bare.mass, bare.com, bare.inertia) is None
    assert file.lost == (
        "joint 1: the gear ratio 50 is not in the file",
        "joint 1: Coulomb friction of 2.5 N m forward and 1.5 N m backward is 2 N m in both directions in the file",
        "joint 1: the maximum acceleration, 5 rad/s², is not in the file",
        "joint 1: the maximum speed, 2 rad/s, is not in the file",
        f"link1: no body has a mass of 1 kg and principal moments of 0, 0, 0.5 kg m²; in the file {padded}",
        # The first joint turns about the axis whose moment is right.
        file.lost[-1],
    )
    assert file.lost[-1].startswith("the mass matrix of the file differs by up to ")
    assert float(file.lost[-1].split()[10]) < 1e-9


def test_an_arm_without_masses() -> None:
    """An arm of which no masses are known is refused, and its link is named."""
    with pytest.raises(UnsupportedArmError, match="specify mass and inertia of link 3"):
        arm_mjcf(load_arm("ntu-3r"))


# What differs in a model that is read from text: names where the text has others, and labels of no meaning in motion.
LABELS = {"names_map", "names", "signature", "nbuffer", "nnames", "actuator_ctrlspec", "eq_objtype", "eq_data"}
GOODS = """
[scene]
table = { z = 0.0, from = [-1.0, -1.5], to = [2.0, 1.5] }
boxes = [{ name = "NEST", at = [1,0,0, 0,1,0, 0,0,1, 0.5,0.9,0.1], size_mm = [60, 60, 200] }]
cylinders = [{ name = "POST", at = [1,0,0, 0,1,0, 0,0,1, 0.8,0.9,0.2], diameter_mm = 60, length_mm = 400 }]
[parts.BLOCK]
mass_kg = 0.2
size_mm = [40, 50, 60]
friction = 0.6
at = [0,1,0, -1,0,0, 0,0,1, 0.5,-0.5,0.03]
[parts.BALL]
shape = "sphere"
mass_kg = 0.1
diameter_mm = 50
at = [1,0,0, 0,1,0, 0,0,1, 0.7,-0.5,0.025]
"""


@pytest.fixture(params=["two_arms.toml", "puma_cell.toml"])
def cell_path(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    text = (EXAMPLES / request.param).read_text(encoding="utf-8")
    (tmp_path / "cell.toml").write_text(text + ("" if "[scene]" in text else GOODS), encoding="utf-8")
    return tmp_path / "cell.toml"


def test_the_world_of_a_cell_is_in_the_file(cell_path: Path) -> None:
    """MuJoCo makes of the text, to the last bit, the model that it makes of the world of the cell itself."""
    cell = read_cell(cell_path)
    spec, _ = world_spec(attrs.evolve(cell, cameras={}), cell.parts)

    text = spec_text(spec, cell.name, [])

    one, other = spec.compile(), mujoco.MjModel.from_xml_string(text)
    for name in dir(one):
        value = getattr(one, name)
        if isinstance(value, int | float | np.ndarray) and name not in LABELS and not name.startswith(("_", "name_")):
            np.testing.assert_array_equal(getattr(other, name), value, err_msg=name)
    for name in dir(one.opt):
        value = getattr(one.opt, name)
        if isinstance(value, int | float | np.ndarray):
            np.testing.assert_array_equal(getattr(other.opt, name), value, err_msg=name)
    np.testing.assert_array_equal(other.eq_data[:, :5], one.eq_data[:, :5])


def test_a_cell_at_its_start(cell_path: Path) -> None:
    """In the keyframe of the file arms stand at their start, parts where they lie; with masses and friction."""
    cell = read_cell(cell_path)

    model = mujoco.MjModel.from_xml_string(cell_mjcf(cell).text)

    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("start").id)
    mujoco.mj_forward(model, data)
    for name, cell_arm in cell.arms.items():
        expected = cell_arm.base @ forward(cell_arm.arm, cell_arm.start)
        np.testing.assert_allclose(data.site(f"{name}/tool").xpos, expected[:3, 3], atol=EXACT)
    assert cell.parts
    for name, part in cell.parts.items():
        np.testing.assert_allclose(data.body(name).xpos, part.pose[:3, 3], atol=EXACT)
        assert model.body(name).mass[0] == part.mass
        assert model.geom(name).friction[0] == part.friction
    for name, fixture in cell.fixtures.items():
        np.testing.assert_allclose(data.geom(name).xpos, fixture.pose[:3, 3], atol=EXACT)


def test_a_cell_comes_back(cell_path: Path, rng: np.random.Generator) -> None:
    """Arms, grippers, fixtures and parts are read back from the file of a cell as they were written."""
    cell = read_cell(cell_path)
    (cell_path.parent / "cell.xml").write_text(cell_mjcf(cell).text, encoding="utf-8")

    reading = read_cell_mjcf(cell_path.parent / "cell.xml")

    again = reading.cell
    assert (again.name, [*again.arms], reading.notes) == (cell.name, [*cell.arms], ())
    np.testing.assert_array_equal(again.gravity, cell.gravity)
    assert again.contact == cell.contact
    for name, before in cell.arms.items():
        after = again.arms[name]
        np.testing.assert_allclose(after.base, before.base, atol=EXACT)
        np.testing.assert_array_equal(after.start, before.start)
        assert attrs.astuple(after.gripper or Gripper()) == pytest.approx(attrs.astuple(before.gripper or Gripper()))
        q, qd = (values[0] for values in states(before.arm, rng, 1))
        np.testing.assert_allclose(forward(after.arm, q), forward(before.arm, q), atol=EXACT)
        if holds_its_inertia(before.arm):
            one, other = (compile_arm(arm, quickly=True).mass_and_bias(q, qd) for arm in (before.arm, after.arm))
            np.testing.assert_allclose(other[0], one[0], rtol=0, atol=SAME * np.abs(one[0]).max())
            np.testing.assert_allclose(other[1], one[1], rtol=0, atol=SAME * np.abs(one[1]).max())
        # Guessed solids of an arm without any are written, since a world needs them.
        if before.arm.links[-1].solids:
            assert [len(link.solids) for link in after.arm.links] == [len(link.solids) for link in before.arm.links]
    for before_all, after_all in ((cell.fixtures, again.fixtures), (cell.parts, again.parts)):
        assert [*after_all] == [*before_all]
        for name, thing in before_all.items():
            after_thing = after_all[name]
            assert type(after_thing.shape) is type(thing.shape)
            np.testing.assert_allclose(after_thing.pose, thing.pose, atol=EXACT)
            np.testing.assert_allclose(volume(after_thing.shape), volume(thing.shape), rtol=SAME)
            assert after_thing.friction == thing.friction
    assert {name: part.mass for name, part in again.parts.items()} == {n: part.mass for n, part in cell.parts.items()}


def test_a_cup_comes_back(cell_path: Path) -> None:
    """A cell whose arm holds by suction is the same world in the file; of the cup only the force is lost."""
    cell = read_cell(cell_path)
    arms = {name: attrs.evolve(arm, gripper=Gripper(kind="suction", friction=0.7)) for name, arm in cell.arms.items()}
    cell = attrs.evolve(cell, arms=arms)
    file = cell_mjcf(cell)
    (cell_path.parent / "cell.xml").write_text(file.text, encoding="utf-8")

    again = read_cell_mjcf(cell_path.parent / "cell.xml").cell

    assert f"{next(iter(arms))}: the force of its suction is not in the file" in file.lost
    assert {arm.gripper for arm in again.arms.values()} == {Gripper(kind="suction", friction=0.7)}


def test_other_files_of_cells(tmp_path: Path) -> None:
    """A file without arms of our names is refused, and other bodies are told."""
    path = tmp_path / "cell.xml"
    path.write_text((EXAMPLES / "desk_arm.xml").read_text(encoding="utf-8"), encoding="utf-8")
    with pytest.raises(FileFormatError, match="expected a body of the name ARM_1/base, as armwright writes them"):
        read_cell_mjcf(path)
    text = arm_mjcf(small()).text.replace('"base"', '"ARM_1/base"').replace('"tool"', '"ARM_1/tool"')
    path.write_text(text.replace("<worldbody>", '<worldbody><body name="lamp"/>'), encoding="utf-8")

    assert read_cell_mjcf(path).notes == ("the body 'lamp' is not read",)
