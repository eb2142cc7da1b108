"""Chains of URDF files with branches: what hangs beside the chain, held where it is wanted, beside Pinocchio."""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from armwright.arm import Arm, load_urdf, urdf_text
from armwright.arm.mjcf.reader import read_mjcf
from armwright.arm.urdf.reader import read_urdf
from armwright.dynamics import inverse_dynamics, mass_matrix
from armwright.errors import FileFormatError
from armwright.kinematics import forward
from oracles.urdf import Oracle, joint, oracle, random_body, random_origin, written
from samples import Sample
from urdf_texts import ARM_WITH_GRIPPER, LIMIT, MASS, joint as plain_joint, link, robot

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

# Limits that have 0 among them, above them and below them, and where a joint rests in each.
LIMITS = (((-2.0, 1.5), 0.0), ((0.5, 1.5), 1.0), ((-0.9, -0.1), -0.5))


class RandomTree:
    """A chain from ``base`` to ``hand`` with branches, some of whose joints follow others beside the chain."""

    def __init__(self, rng: np.random.Generator, joints: int) -> None:
        self.rng = rng
        self.parts = ['<robot name="tree">', random_body(rng, "base")]
        # Of joints of branches: where each would rest if it followed none; what followers follow; and a place for the
        # others.
        self.rests: dict[str, float] = {}
        self.follows: dict[str, tuple[str, float, float]] = {}
        self.anywhere: dict[str, float] = {}
        last = "base"
        for i in range(1, joints + 1):
            self._add(f"joint_{i}", f"link_{i}", last, limits=(-2.5, 2.5))
            last = f"link_{i}"
            for k in range(int(rng.integers(0, 3))):
                self._add_branch(last, f"{i}_{k}")
        self._add_branch("base", "stand")
        self.parts += [random_body(rng, "hand"), joint("wrist", "fixed", (last, "hand"), random_origin(rng))]
        self.text = "\n".join([*self.parts, "</robot>"])

    def _add(self, name: str, child: str, parent: str, *, limits: tuple[float, float], inside: str = "") -> None:
        kind = str(self.rng.choice(("revolute", "prismatic")))
        axis = f'<axis xyz="{written(self.rng.normal(size=3))}"/>'
        ends = f'<limit lower="{limits[0]}" upper="{limits[1]}" effort="80" velocity="2"/>'
        self.parts += [random_body(self.rng, child)]
        self.parts += [joint(name, kind, (parent, child), random_origin(self.rng), axis + ends + inside)]

    def _add_branch(self, parent: str, number: str) -> None:
        for depth in range(int(self.rng.integers(1, 4))):
            name, child = f"side_{number}_{depth}", f"twig_{number}_{depth}"
            limits, rest = LIMITS[int(self.rng.integers(0, 3))]
            inside = ""
            if self.rests and self.rng.random() < 0.4:
                follows = str(self.rng.choice([*self.rests])), *self.rng.normal(size=2).tolist()
                self.follows[name] = follows
                inside = '<mimic joint="{}" multiplier="{!r}" offset="{!r}"/>'.format(*follows)
            else:
                self.anywhere[name] = float(self.rng.uniform(*limits))
            self._add(name, child, parent, limits=limits, inside=inside)
            self.rests[name] = rest
            if self.rng.random() < 0.6:
                parent = child

    def positions(self, held: Mapping[str, float]) -> dict[str, float]:
        """Where all joints of branches are if those that follow none are held."""
        positions: dict[str, float] = {}
        for name in self.rests:
            if name in self.follows:
                master, multiplier, offset = self.follows[name]
                positions[name] = multiplier * positions[master] + offset
            else:
                positions[name] = held[name]
        return positions


def reduced(text: str, held: Mapping[str, float]) -> Oracle:
    """The same file in Pinocchio, with joints held."""
    whole = oracle(text, "hand").model
    q = pin.neutral(whole)
    for name, position in held.items():
        q[whole.joints[whole.getJointId(name)].idx_q] = position
    model = pin.buildReducedModel(whole, [whole.getJointId(name) for name in held], q)
    return Oracle(model=model, data=model.createData(), tool=model.getFrameId("hand", pin.FrameType.BODY))


def deviation(arm: Arm, known: Oracle, rng: np.random.Generator) -> float:
    """How far poses, efforts and masses are from Pinocchio's, in parts of the largest number of each."""
    q, qd, qdd = rng.uniform(-2, 2, size=(3, arm.n))
    pairs = (
        (forward(arm, q), known.forward(q)),
        (inverse_dynamics(arm, q, qd, qdd), known.inverse_dynamics(q, qd, qdd)),
        (mass_matrix(arm, q), known.mass_matrix(q)),
    )
    return max(float(np.abs(ours - theirs).max() / max(1.0, np.abs(theirs).max())) for ours, theirs in pairs)


def test_random_trees(sample: Sample, tmp_path: Path) -> None:
    """Branches of any shape count with the masses they have at rest, or where they are locked, to 1e-12."""
    path, worst = tmp_path / "tree.urdf", 0.0
    for rng in sample.cases(100):
        tree = RandomTree(rng, int(rng.integers(1, 7)))
        path.write_text(tree.text)
        for held, lock in ((tree.rests, {}), (tree.anywhere, tree.anywhere)):
            arm = load_urdf(path, base="base", tip="hand", lock=lock)
            known = reduced(tree.text, tree.positions(held))
            worst = max(worst, deviation(arm, known, rng))
            masses = [inertia.mass for inertia in known.model.inertias][1:]
            np.testing.assert_allclose([each.mass for each in arm.links], masses, rtol=1e-12)
    assert worst < 1e-12
    sample.record("URDF trees with branches at rest and locked", sample.count(100), 0, worst=f"{worst:.1e}")


@pytest.fixture
def read(tmp_path: Path) -> Callable[..., Arm]:
    def write(text: str, **options: object) -> Arm:
        (tmp_path / "arm.urdf").write_text(text)
        return load_urdf(tmp_path / "arm.urdf", **options)

    return write


def test_a_gripper_at_rest(read: Callable[..., Arm], tmp_path: Path) -> None:
    """A gripper beside the chain is a load; where its fingers are held is said, and its follower follows."""
    arm = read(ARM_WITH_GRIPPER, tip="camera")
    reading = read_urdf(tmp_path / "arm.urdf", tip="camera")
    opened = read(ARM_WITH_GRIPPER, tip="camera", lock={"left_slide": 0.5})

    assert arm.links[0].mass == 8
    (note,) = reading.notes
    assert note.endswith("with what they carry: 'left_slide' at 0, 'right_slide' at 0 rad or m (--lock)")
    np.testing.assert_allclose(opened.links[0].com - arm.links[0].com, opened.base[:3, :3].T @ (0, 2 * 2 * 0.5 / 8, 0))
    assert [each.name for each in (*opened.joints, *opened.links)] == ["turn", "arm"]
    (tmp_path / "again.urdf").write_text(urdf_text(opened))
    again = load_urdf(tmp_path / "again.urdf")
    assert [each.name for each in (*again.joints, *again.links)] == ["turn", "arm"]
    assert (again.base_link, again.tool_link) == ("base", "camera")


def test_a_follower_on_the_chain(read: Callable[..., Arm]) -> None:
    """A joint of the chain that follows another is refused with the way out: with that one held it is held, too."""
    with pytest.raises(FileFormatError) as caught:
        read(ARM_WITH_GRIPPER, tip="right")
    assert str(caught.value).endswith(
        "joint 'right_slide', mimic: the joint mimics 'left_slide'; an arm can only have independent joints: choose a "
        "tip before it, or lock 'left_slide', which holds this one where it follows to: lock=['left_slide'] (--lock "
        "left_slide)"
    )
    arm = read(ARM_WITH_GRIPPER, tip="right", lock={"left_slide": 0.3})
    assert arm.n == 1
    np.testing.assert_allclose(forward(arm, [0.0])[:3, 3], (0.5, 0.3, 0.0), atol=1e-15)


def test_long_chains_of_followers(read: Callable[..., Arm]) -> None:
    """Thousands of joints that follow one another are held where they follow to; where that is nowhere they are not."""
    count, axis = 3000, '<axis xyz="0 1 0"/>'

    def text(multiplier: float) -> str:
        fingers = [link(f"finger_{i}", MASS) for i in range(count)]
        slides = [
            plain_joint(
                f"slide_{i}", "prismatic", "arm", f"finger_{i}",
                f'{axis}{LIMIT}<mimic joint="slide_{i - 1}" multiplier="{multiplier}"/>' if i else axis + LIMIT,
            )
            for i in range(count)
        ]  # fmt: skip
        ends = link("base"), link("arm", MASS), link("hand")
        turn, weld = plain_joint("turn", "continuous", "base", "arm"), plain_joint("weld", "fixed", "arm", "hand")
        return robot(*ends, turn, weld, *fingers[::-1], *slides[::-1])

    arm = read(text(-1.0), tip="hand", lock={"slide_0": 1.5})
    assert arm.links[0].mass == 2 * (count + 1)
    np.testing.assert_allclose(arm.links[0].com, 0.0, atol=1e-12)
    with pytest.raises(
        FileFormatError, match=r"joint 'slide_40': it would be held at 1\.09951e\+12 .rad or m.; expected"
    ):
        read(text(2.0), tip="hand", lock={"slide_0": 1.0})


def test_two_arms(read: Callable[..., Arm]) -> None:
    """Of two arms on a torso that turns each can be taken; the other one is a load, but none where the torso stands."""
    side = "".join(
        link(f"{s}_arm", MASS) + plain_joint(f"{s}_shoulder", "revolute", "torso", f"{s}_arm", f"{origin}{LIMIT}")
        for s, origin in (("left", '<origin xyz="0 0.3 1"/>'), ("right", '<origin xyz="0 -0.3 1"/>'))
    )
    text = robot(link("floor"), link("torso", MASS), plain_joint("hips", "continuous", "floor", "torso"), side)

    assert [each.mass for each in read(text, tip="left_arm").links] == [4, 2]
    assert [each.mass for each in read(text, base="torso", tip="left_arm").links] == [2]


def test_mjcf_branches(tmp_path: Path) -> None:
    """Fingers of an MJCF file are held in the same way; one that a tendon moves is not."""
    finger = '<body name="{0}"><joint name="{0}" type="slide" axis="0 1 0" range="0.01 0.03"/><geom size="0.1"/></body>'
    text = f"""<mujoco><compiler autolimits="true"/><worldbody><body name="stand"><body name="arm"><joint name="turn"/>
      <geom size="0.1"/><site name="tool"/>{finger.format("left")}{finger.format("right")}</body></body></worldbody>
      {{}}</mujoco>"""
    path = tmp_path / "arm.xml"
    path.write_text(text.format(""))
    reading = read_mjcf(path, base="stand", tip="tool")
    assert reading.notes[0].endswith("'left' at 0.02, 'right' at 0.02 rad or m (--lock)")

    path.write_text(text.format('<tendon><fixed><joint joint="left" coef="1"/></fixed></tendon>'))
    with pytest.raises(FileFormatError, match="joint 'left': 1 joint lies beside the chain, has mass to carry and mov"):
        read_mjcf(path, base="stand", tip="tool")
