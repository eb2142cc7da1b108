"""Linkages with closed pins for MuJoCo, which moves them as our kinematics and dynamics without clearance say."""

import importlib.util
from pathlib import Path

import attrs
import mujoco
import numpy as np
import pytest

from armwright.clearance.ideal import ideal_motion, point_position
from armwright.clearance.linkage import Body, BodyPoint, ClearancePin, Drive, Linkage
from armwright.clearance.mjcf.export import joint_coordinates, linkage_mjcf, mjcf_files
from armwright.clearance.paths import Path as TipPath, constant_speed_path, thesis_path
from armwright.clearance.reader import load_linkage
from armwright.clearance.scenario import Scenario, prepare_scenario
from armwright.clearance.settings import Settings
from armwright.errors import InvalidValueError, ShapeError
from clearance.arms import beginning
from clearance.trees import tree
from samples import Sample

# Of a motion at 300 rev/min with steps of 0.1 ms: constraints give way, in proportion to the square of the step [m].
NEAR = 0.5e-6


def loop(rng: np.random.Generator) -> tuple[Linkage, np.ndarray]:
    """A tree of pins and guides whose free body hangs in two closed pins, with a drive for each freedom; and q."""
    open_one = tree(rng)
    q = rng.uniform(-0.5, 0.5, len(open_one.coordinates))
    end = point_position(open_one, BodyPoint("bolt", "c"), q)
    # Coordinates 5 and 6 are the centre of the free body.
    q[5:7] += end - point_position(open_one, BodyPoint("loose", "b"), q)
    anchor = point_position(open_one, BodyPoint("loose", "a"), q)
    second = ClearancePin(
        name="anchor",
        bearing=BodyPoint("ground", "G"),
        journal=BodyPoint("loose", "a"),
        clearance=1e-3,
        journal_radius=0.02,
    )
    ground = Body(name="ground", points={**open_one.ground.points, "G": anchor})
    drives = [Drive(body=body) for body in ("arm", "sledge", "lever", "finger")]
    return attrs.evolve(open_one, ground=ground, pins=[*open_one.pins, second], drives=drives), q


def followed(scenario: Scenario, folder: Path) -> tuple[float, float]:
    """How far the tip is from ours at most when the script that was written runs, and how far it goes [m]."""
    for file, text in mjcf_files(scenario).items():
        (folder / file).write_text(text)
    spec = importlib.util.spec_from_file_location("run_linkage", folder / "run_linkage.py")
    assert spec is not None
    assert spec.loader is not None
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    tip = script.simulate()
    reference = np.loadtxt(folder / "reference.csv", delimiter=",", skiprows=1)
    np.testing.assert_array_equal(tip, np.loadtxt(folder / "tip.csv", delimiter=",", skiprows=1))
    apart = np.linalg.norm(tip - reference, axis=-1).max()
    return float(apart), float(np.ptp(reference[:, 1:], axis=0).max())


@pytest.mark.drawn(0.34)
@pytest.mark.parametrize(
    ("name", "path"),
    [
        ("five-bar", thesis_path("y1")),
        ("slider-crank", constant_speed_path("turning", 0.0, 10 * np.pi, 0.2)),
        ("four-bar", constant_speed_path("turning", np.pi / 3, 10 * np.pi, 0.2)),
    ],
    ids=["five-bar", "slider-crank", "four-bar"],
)
def test_the_script_follows_the_ideal_motion(name: str, path: TipPath, tmp_path: Path) -> None:
    """The efforts of the linkage without clearance move its tip in MuJoCo along the same path."""
    apart, travel = followed(prepare_scenario(load_linkage(name), path, Settings(step=1e-4, sample=2e-3)), tmp_path)
    assert apart < NEAR
    assert travel > 0.05


def test_inverse_dynamics_of_random_linkages(sample: Sample) -> None:
    """Pins are closed, and the mass matrix and forces of MuJoCo need the efforts of the drives that ours need."""
    worst = 0.0
    for rng in sample.cases(200):
        linkage, q = loop(rng)
        motion = ideal_motion(linkage, q, *rng.uniform(-2, 2, (2, 4)), by_tip=False)

        model = mujoco.MjModel.from_xml_string(linkage_mjcf(linkage, q, motion.qd, step=1e-3))
        data = mujoco.MjData(model)
        mujoco.mj_resetDataKeyframe(model, data, 0)
        mujoco.mj_forward(model, data)
        np.testing.assert_allclose(data.site("tip").xpos[:2], point_position(linkage, linkage.tip, q), atol=1e-13)
        np.testing.assert_allclose(data.efc_pos, 0.0, atol=1e-13)
        np.testing.assert_allclose(data.efc_vel, 0.0, atol=1e-12 * (1 + np.abs(motion.qd).max()))

        closure = data.efc_J.reshape(data.nefc, model.nv).copy()
        moments = np.zeros((model.nu, model.nv))
        mujoco.mju_sparse2dense(
            moments, data.actuator_moment, data.moment_rownnz, data.moment_rowadr, data.moment_colind
        )
        # What is left without the constraints is due to drives, load, and forces in the pins.
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_EQUALITY
        data.qacc[:] = joint_coordinates(linkage, motion.qdd, at_rest=True)
        mujoco.mj_inverse(model, data)
        need = data.qfrc_inverse - moments[4]
        efforts = np.linalg.lstsq(np.vstack([moments[:4], closure]).T, need)[0][:4]
        worst = max(worst, float(np.abs(efforts - motion.efforts).max() / np.abs(motion.efforts).max()))
    assert worst < 1e-9
    sample.record("efforts of linkages in MuJoCo", sample.count(200), 0, worst=worst)


def test_random_linkages_follow_their_motion(sample: Sample, tmp_path: Path) -> None:
    """The script moves the tip of any linkage along its path, to a hundred thousandth of the way."""
    followed_ones, worst = 0, 0.0
    for rng in sample.cases(20):
        linkage, q = loop(rng)
        pieces = np.stack([q[list(linkage.driven)], *rng.uniform(-0.5, 0.5, (2, 4))], axis=-1)[None]
        path = TipPath(name="random", knots=np.array((0.0, 0.05)), pieces=pieces, follower="drives")
        try:
            scenario = prepare_scenario(linkage, path, Settings(step=1e-4, sample=1e-3), guess=q)
        except InvalidValueError:
            continue
        # Near a singular configuration a linkage amplifies what constraints give way.
        if np.abs(scenario.ideal.qdd).max() < 100:
            apart, travel = followed(scenario, tmp_path)
            followed_ones, worst = followed_ones + 1, max(worst, apart / travel)
    assert worst < 1e-5
    sample.record("linkages that follow their motion in MuJoCo", followed_ones, 0, worst=worst)


def hostile(name: str) -> Linkage:
    """A four-bar whose crank has a name."""
    arm = load_linkage("four-bar")
    first, carried, other = arm.joints
    return attrs.evolve(
        arm,
        name=name,
        bodies=[attrs.evolve(arm.bodies[0], name=name), *arm.bodies[1:]],
        joints=[attrs.evolve(first, body=name), attrs.evolve(carried, on=BodyPoint(name, "A")), other],
        drives=[attrs.evolve(arm.drives[0], body=name)],
        assembly={},
    )


@pytest.mark.parametrize("name", ['"/></body><body name="x', "<!-- &amp; ]]>", "../crank,'", "Kurbel µ"])
def test_names_are_data(name: str) -> None:
    """A name is in the model what it is in the linkage, whatever it says."""
    model = mujoco.MjModel.from_xml_string(linkage_mjcf(hostile(name), np.zeros(3), np.zeros(3), step=1e-3))
    assert model.nbody == 4
    assert model.body(1).name == model.actuator(0).name == name


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("world", "body 'world': expected a name other than 'world' and without a colon"),
        ("a:b", "body 'a:b': expected a name other"),
        ("a\x00b", r"name 'a\\x00b': expected characters that can be printed"),
    ],
)
def test_names_that_no_model_holds(name: str, message: str) -> None:
    """Names that MuJoCo has for something else, or that XML cannot hold, are refused."""
    with pytest.raises(InvalidValueError, match=message):
        linkage_mjcf(hostile(name), np.zeros(3), np.zeros(3), step=1e-3)


def test_a_controller_has_no_counterpart() -> None:
    """Drives with a controller are refused."""
    path = beginning(thesis_path("y1"), 0.01)
    with pytest.raises(InvalidValueError, match="MuJoCo has no counterpart for a controller"):
        mjcf_files(prepare_scenario(load_linkage("five-bar"), path, Settings(step=1e-3, control="pd+ff")))


def test_a_joint_for_each_coordinate() -> None:
    """Coordinates that are not those of the joints are refused, rather than a model written that does not load."""
    with pytest.raises(ShapeError, match=r"coordinates of rigid bodies: expected a shape ending in \(3,\), got \(5,\)"):
        linkage_mjcf(load_linkage("four-bar"), np.zeros(5), np.zeros(5), step=1e-3)
