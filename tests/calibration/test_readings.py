"""What is measured of an arm other than points in one frame: poses, several frames, planes, anchors, ways."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import t as student

from armwright.arm.load import load_arm
from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.calibration.chain import Chain, JointErrorModel, kinematic_chain
from armwright.calibration.cross_validation import cross_validate
from armwright.calibration.fitting import Calibration, calibrate, calibrate_points
from armwright.calibration.nongeometric import calibrate_nongeometric
from armwright.calibration.readings import Readings, concatenate, readings, refuse_unlocated
from armwright.calibration.residuals import MeasurementModel, Plane
from armwright.errors import ContradictionError, InvalidValueError, ShapeError, TooFewError
from armwright.spatial.rotations import rotation_from_quaternion, rotation_from_vector
from calibration.simulated import configurations, random_arm, random_errors, random_pose, seen

# Standard deviations of a coordinate and of a turn [m], [rad].
NOISE, TURN = 3e-5, 1e-4
# What central differences of steps of 1e-6 leave of derivatives of about one.
DIFFERENCES = 1e-8
# What rounding leaves of an arm of a metre that is found from measurements without noise [m].
EXACT = 1e-8


class Truth:
    """A UR5 with errors, and what is measured of it."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.arm: Arm = load_arm("ur5")
        self.chain: Chain = kinematic_chain(self.arm)
        self.errors = random_errors(rng, self.chain)
        self.rng = rng

    def configurations(self, m: int) -> Array:
        """Return (m, 6) configurations."""
        return configurations(self.rng, self.arm, m)

    def points(self, q: Array, noise: float = NOISE) -> Array:
        """Return (m, 3) points seen."""
        return seen(self.chain, q, self.errors, noise, self.rng)

    def poses(self, q: Array, noise: float = NOISE, turn: float = TURN) -> Array:
        """Return (m, 4, 4) poses seen."""
        reached = self.chain.forward(q, self.errors)
        X = np.tile(np.eye(4), (len(q), 1, 1))
        X[:, :3, 3] = self.points(q, noise)
        X[:, :3, :3] = rotation_from_vector(turn * self.rng.standard_normal((len(q), 3))) @ reached.rotation
        return X

    def missed(self, found: Calibration, *, rigid: bool = False) -> Array:
        """Return (50,) by how much the corrected arm misses in configurations never measured [m].

        Args:
            found: the calibration.
            rigid: whether the measurements tell nothing of where the arm stands.
        """
        q = self.configurations(50)
        away, true = found.predict(q), self.points(q, 0.0)
        if rigid:
            a, b = away - away.mean(axis=0), true - true.mean(axis=0)
            U, _, Vt = np.linalg.svd(b.T @ a)
            away, true = a @ (U @ Vt).T, b
        return np.asarray(np.linalg.norm(away - true, axis=1))


@pytest.fixture
def truth(rng: np.random.Generator) -> Truth:
    return Truth(rng)


def test_derivatives(rng: np.random.Generator) -> None:
    """Equations of all kinds of readings have the derivatives that differences have."""
    arm = random_arm(rng, 5, slides=True)
    bends = (
        JointErrorModel("joint1.sin", 0, lambda q, _: np.sin(q[:, 0])),
        JointErrorModel("joint3.sag", 2, lambda q, _: np.cos(q[:, 1] + q[:, 2])),
        JointErrorModel("joint3.sag_y", 2, lambda q, _: np.sin(q[:, 1]), 1),
        JointErrorModel("joint3.sag_x", 2, lambda q, held: np.cos(q[:, 1]) + held[:, 0], 0),
    )
    chain = kinematic_chain(
        arm, base=random_pose(rng, 1.0), target_rotation=rotation_from_vector([0.1, 0.2, 0.3]), joint_errors=bends
    )
    model = MeasurementModel(
        chain=chain,
        frames={"a": np.eye(4), "b": random_pose(rng, 1.0)},
        planes={"table": Plane(rng.standard_normal(3), rotation_from_vector(rng.standard_normal(3)))},
        anchors={"wire": rng.standard_normal(3)},
    )
    q = configurations(rng, arm, 6)
    X = np.stack([random_pose(rng, 1.0) for _ in q])
    X[:, :3, :3] = rotation_from_vector(0.3 * rng.standard_normal((6, 3))) @ chain.forward(q).rotation
    given = concatenate(
        readings(q, X, frame=list("ababab")),
        readings(q, plane=["table"] * 6),
        readings(q, distances=rng.random(6), anchor=["wire"] * 6),
        readings(q, distances=rng.random(6), other=q[::-1] + 0.1),
    )
    x, h = 0.05 * rng.standard_normal(len(model.names)), 1e-6

    columns = [
        (model.residuals(given, x + h * e).values - model.residuals(given, x - h * e).values) / (2 * h)
        for e in np.eye(len(x))
    ]

    np.testing.assert_allclose(model.residuals(given, x).jacobian, np.stack(columns, axis=1), atol=DIFFERENCES)


def test_poses_tell_the_tool_frame(truth: Truth) -> None:
    """Poses tell how the tool is turned, which points do not; their two noises are found."""
    q = truth.configurations(60)

    found = calibrate_points(truth.arm, q, truth.poses(q))
    points = calibrate_points(truth.arm, q, truth.points(q))

    assert {"tool.rx", "tool.ry", "tool.rz"} <= set(found.names)
    assert not {"tool.rx", "tool.ry", "tool.rz"} & set(points.names)
    assert found.noise.length == pytest.approx(NOISE, rel=0.2)
    assert found.noise.angle == pytest.approx(TURN, rel=0.2)
    assert truth.missed(found).mean() < NOISE
    turned = found.chain.forward(q, found.arm_errors).rotation
    truly = truth.chain.forward(q, truth.errors).rotation
    assert np.abs(turned - truly).max() < TURN


def test_fewer_poses_than_points(truth: Truth) -> None:
    """Six poses give 36 numbers, more than the errors of a six-joint arm; six points do not."""
    q = truth.configurations(6)

    found = calibrate_points(truth.arm, q, truth.poses(q))

    assert len(found.names) >= 27
    with pytest.raises(InvalidValueError, match="measure more"):
        calibrate_points(truth.arm, q, truth.points(q))


def test_intervals_of_few_poses() -> None:
    """From eight poses, with eighteen numbers to spare, neither noise comes out as nothing, and intervals still hold.

    Of places predicted, those that should be within in nine of ten cases are in eight at least: what noise there is in
    lengths and in turns cannot be told apart from so few.
    """
    within, noises = [], []
    for seed in range(12):
        truth = Truth(np.random.default_rng(seed))
        q, elsewhere = truth.configurations(8), truth.configurations(30)
        found = calibrate_points(truth.arm, q, truth.poses(q))
        off = found.predict(elsewhere) - truth.points(elsewhere, 0.0)
        deviation = np.sqrt(np.diagonal(found.uncertainty(elsewhere), axis1=1, axis2=2))
        within.append(np.abs(off) < student.ppf(0.95, found.degrees_of_freedom) * deviation)
        noises.append(np.divide(found.noise, (NOISE, TURN)))

    assert np.mean(within) > 0.8
    assert np.all((np.array(noises) > 0.3) & (np.array(noises) < 3.0))


def test_poses_of_another_frame_of_the_hand(truth: Truth) -> None:
    """A reflector that is screwed on anyhow tells the arm as well as one that is turned as the tool is."""
    q = truth.configurations(60)
    X = truth.poses(q)
    X[:, :3, :3] = X[:, :3, :3] @ rotation_from_vector([2.0, -1.0, 0.4])

    found = calibrate_points(truth.arm, q, X)

    assert found.noise.angle == pytest.approx(TURN, rel=0.2)
    assert truth.missed(found).mean() < NOISE


def test_one_pose_that_is_turned(truth: Truth) -> None:
    """A pose whose place is right and whose turn is not is named and does not count."""
    q = truth.configurations(60)
    X = truth.poses(q)
    X[7, :3, :3] = X[7, :3, :3] @ rotation_from_vector([0.0, 0.05, 0.0])

    found = calibrate_points(truth.arm, q, X)

    assert found.outliers == (7,)
    assert truth.missed(found).mean() < NOISE


def test_poses_that_are_turned_over(truth: Truth) -> None:
    """Poses that stand the other way round, where the sine of the turn is 0 again, are half a turn off, and named."""
    q = truth.configurations(60)
    X = truth.poses(q)
    X[:6, :3, :3] = X[:6, :3, :3] @ rotation_from_vector([np.pi, 0.0, 0.0])

    found = calibrate_points(truth.arm, q, X)

    assert found.outliers == (0, 1, 2, 3, 4, 5)
    np.testing.assert_allclose(found.after.angle[:6], np.pi, atol=10 * TURN)
    assert truth.missed(found).mean() < NOISE


@pytest.mark.parametrize("angle", [0.5, 2.0, 3.0])
def test_derivatives_of_large_turns(angle: float, rng: np.random.Generator) -> None:
    """Turns that are far off have the derivatives that differences have, too."""
    arm = random_arm(rng, 4)
    chain = kinematic_chain(arm)
    model = MeasurementModel(chain=chain, frames={"a": np.eye(4), "b": random_pose(rng, 1.0)})
    q = configurations(rng, arm, 4)
    X, axes = np.tile(np.eye(4), (4, 1, 1)), rng.standard_normal((4, 3))
    axes *= angle / np.linalg.norm(axes, axis=1)[:, None]
    X[:, :3, :3] = rotation_from_vector(axes) @ chain.forward(q).rotation
    X[2:, :3, :3] = model.frames["b"][:3, :3].T @ X[2:, :3, :3]
    given, h = readings(q, X, frame=list("aabb")), 1e-6
    x = 0.01 * rng.standard_normal(len(model.names))

    columns = [
        (model.residuals(given, x + h * e).values - model.residuals(given, x - h * e).values) / (2 * h)
        for e in np.eye(len(x))
    ]

    np.testing.assert_allclose(model.residuals(given, x).jacobian, np.stack(columns, axis=1), atol=DIFFERENCES)
    np.testing.assert_allclose(model.pose_errors(given).angle, angle, rtol=1e-9)


def test_a_board_set_up_three_times(truth: Truth) -> None:
    """Points told in frames that stand anywhere tell the arm as points in one frame do."""
    q = truth.configurations(90)
    points, frame = truth.points(q), np.repeat(["flat", "roll", "pitch"], 30)
    for name in ("roll", "pitch"):
        X = random_pose(truth.rng, 1.0)
        which = frame == name
        points[which] = (points[which] - X[:3, 3]) @ X[:3, :3]

    found = calibrate(truth.arm, readings(q, points, frame=frame))

    assert {f"frame.{name}.{six}" for name in ("roll", "pitch") for six in ("x", "rz")} <= set(found.names)
    assert found.noise.length == pytest.approx(NOISE, rel=0.2)
    assert truth.missed(found).mean() < 2 * NOISE


def test_touched_planes(truth: Truth) -> None:
    """Three planes touched in a hundred configurations each, and no point measured, tell all but where the arm stands.

    Planes tell no scale: an arm that is larger all over touches planes as well. One length is held for that.
    """
    planes = [(random_pose(truth.rng, 0.4), name) for name in ("floor", "wall", "door")]
    parts = [readings(_on(truth, X, 100), plane=[name] * 100) for X, name in planes]

    found = calibrate(truth.arm, concatenate(*parts))

    assert not [name for name in found.names if name.startswith("base")]
    assert {"plane.floor.z", "plane.wall.rx", "plane.door.ry"} <= set(found.names)
    assert found.after.distance.mean() < 1e-7
    held = {one.name for one in found.fixed}
    assert held >= {"base.x", "base.y", "base.z", "base.rx", "base.ry", "base.rz"}
    q = truth.configurations(100)
    lengths = [one.name for one in found.fixed if one.name in calibrate_points(truth.arm, q, truth.points(q)).names]
    assert [name for name in lengths if not name.startswith("base")] == ["joint5.d"]


def _on(truth: Truth, X: Array, m: int) -> Array:
    """Return (m, 6) configurations in which the true tool is on the plane z = 0 of a frame."""
    taken: list[Array] = []
    while len(taken) < m:
        q = truth.configurations(200)
        for _ in range(30):
            reached = truth.chain.forward(q, truth.errors)
            height = (reached.position - X[:3, 3]) @ X[:3, 2]
            theta = [truth.chain.names.index(f"joint{i + 1}.theta") for i in range(6)]
            slope = np.einsum("i,mik->mk", X[:3, 2], reached.position_jacobian[:, :, theta])
            q = q - slope * (height / np.maximum((slope**2).sum(axis=1), 1e-3))[:, None]
        good = (np.abs(height) < 1e-12) & (np.abs(q).max(axis=1) < 3.0)
        taken.extend(q[good])
    return np.array(taken[:m])


def test_distances_from_anchors(truth: Truth) -> None:
    """Three wires whose ends hang anywhere tell the arm's links, and where the ends are."""
    q, ends = truth.configurations(120), truth.rng.uniform(-2, 2, (3, 3))
    true = truth.points(q, 0.0)
    parts = [
        readings(
            q,
            distances=np.linalg.norm(true - end, axis=1) + NOISE * truth.rng.standard_normal(120),
            anchor=[name] * 120,
        )
        for name, end in zip("abc", ends, strict=True)
    ]

    found = calibrate(truth.arm, concatenate(*parts))

    assert not [name for name in found.names if name.startswith("base")]
    assert found.noise.length == pytest.approx(NOISE, rel=0.2)
    assert truth.missed(found, rigid=True).mean() < 3 * NOISE


def test_distances_between_configurations(truth: Truth) -> None:
    """How far the tool goes between configurations tells the arm's links, whoever measures from wherever."""
    q, other = truth.configurations(150), truth.configurations(150)
    apart = np.linalg.norm(truth.points(q, 0.0) - truth.points(other, 0.0), axis=1)

    found = calibrate(truth.arm, readings(q, distances=apart + NOISE * truth.rng.standard_normal(150), other=other))

    assert not [name for name in found.names if name.startswith("base")]
    assert truth.missed(found, rigid=True).mean() < 3 * NOISE


def test_points_with_distances(truth: Truth) -> None:
    """Points and distances together tell no less than points alone."""
    q, more = truth.configurations(30), truth.configurations(100)
    away = np.linalg.norm(truth.points(more, 0.0), axis=1) + NOISE * truth.rng.standard_normal(100)
    points = readings(q, truth.points(q))

    alone = calibrate(truth.arm, points, without=("joint6.theta",))
    both = calibrate(truth.arm, concatenate(points, readings(more, distances=away, anchor=["wire"] * 100)))

    assert truth.missed(both).mean() < truth.missed(alone).mean()


def test_no_noise(truth: Truth) -> None:
    """From poses without noise an arm is found to rounding."""
    q = truth.configurations(30)

    found = calibrate_points(truth.arm, q, truth.poses(q, 0.0, 0.0))

    assert truth.missed(found).max() < EXACT


# ---- bad input -----------------------------------------------------------------------------------------------------


def test_a_frame_on_a_line(truth: Truth) -> None:
    """Two points of a frame do not tell where it stands."""
    q = truth.configurations(42)
    given = readings(q, truth.points(q), frame=["one"] * 40 + ["other"] * 2)

    with pytest.raises(TooFewError, match="frame other: 2 points do not determine its pose; measure 3 or more"):
        calibrate(truth.arm, given)


@pytest.mark.parametrize("what", ["plane", "anchor"])
def test_few_touches(what: str, truth: Truth) -> None:
    """Three touches only tell where a plane is, three distances where an anchor is."""
    q = truth.configurations(40)
    more = readings(q[:3], plane=["a"] * 3) if what == "plane" else readings(q[:3], distances=[1] * 3, anchor=["a"] * 3)

    with pytest.raises(TooFewError, match=f"{what} a: 3 .* do not determine its position; measure 4 or more"):
        calibrate(truth.arm, concatenate(readings(q, truth.points(q)), more))


def test_ways_in_millimetres(truth: Truth) -> None:
    """Distances in another unit are refused with a question."""
    q, other = truth.configurations(40), truth.configurations(40)
    apart = 1e3 * np.linalg.norm(truth.points(q) - truth.points(other), axis=1)

    with pytest.raises(ContradictionError, match=r"distances are .* are they millimetres read as metres"):
        calibrate(truth.arm, readings(q, distances=apart, other=other))


def test_what_does_not_fit(truth: Truth) -> None:
    """As many names as configurations; distances from something; something measured; arms of as many joints."""
    q = truth.configurations(4)

    with pytest.raises(ShapeError, match="plane: expected 4 names for as many q, got 2"):
        readings(q, plane=["a", "b"])
    with pytest.raises(InvalidValueError, match="expected an anchor or another configuration for each"):
        readings(q, distances=[1.0] * 4)
    with pytest.raises(InvalidValueError, match="expected points, poses, planes or distances, got none"):
        readings(q)
    with pytest.raises(ShapeError, match=r"other: expected a shape ending in \(4, 6\), got \(3, 6\)"):
        readings(q, distances=[1.0] * 4, other=q[:3])
    with pytest.raises(ShapeError, match=r"readings of arms with \[3, 6\] joints are not of one arm"):
        concatenate(readings(q, plane=["a"] * 4), readings(q[:, :3], plane=["a"] * 4))


@pytest.mark.parametrize("how", ["never turned", "x, y, z, w for w, x, y, z"])
def test_turns_told_another_way(how: str, truth: Truth) -> None:
    """Turns that the arm cannot have, however what is measured is fixed to the hand, are refused with a question."""
    q = truth.configurations(40)
    X = truth.poses(q)
    if how == "never turned":
        X[:, :3, :3] = np.eye(3)
    else:
        X[:, :3, :3] = rotation_from_quaternion(Rotation.from_matrix(X[:, :3, :3]).as_quat())

    with pytest.raises(
        ContradictionError,
        match=r"the median rotation of the poses from the tool of ur5 is \d+ degrees .* are these its rotations, in",
    ):
        calibrate_points(truth.arm, q, X)


@pytest.mark.parametrize("by", [(2.0, 2.0, 2.0), (1.0, 1.0, -1.0)])
def test_no_poses(by: tuple[float, ...], truth: Truth) -> None:
    """What is scaled or mirrored is no rotation, and no pose."""
    q = truth.configurations(4)
    X = truth.poses(q)
    X[2, :3, :3] *= by

    with pytest.raises(
        InvalidValueError, match=r"points: expected a rotation, a position .* in every pose.* as number 3"
    ):
        readings(q, X)


def test_nothing_told(truth: Truth) -> None:
    """Configurations all over the room do not touch one plane; that nothing is told is said, and soon."""
    with pytest.raises(ContradictionError, match=r"the residuals of .* mm, are too large for any of its errors"):
        calibrate(load_arm("puma560"), readings(truth.configurations(40), plane=["table"] * 40))


def test_nothing_fitted(truth: Truth) -> None:
    """An arm of which nothing may be fitted that its readings tell stays as it is."""
    q = truth.configurations(40)

    found = calibrate_points(truth.arm, q, truth.points(q), only=["tool.rx"])

    assert found.names == ()
    assert not found.errors.any()


def test_nothing_to_hold_against(truth: Truth) -> None:
    """Points in a frame of which all are held out, or a plane that is touched at the check alone, say nothing."""
    q = truth.configurations(44)
    given = concatenate(readings(q[:40], truth.points(q[:40])), readings(q[40:], plane=["table"] * 4))

    with pytest.raises(InvalidValueError, match=r"plane table: no fitted reading locates it, so that the 4 other"):
        refuse_unlocated(given.take(np.arange(40)), given.take(np.arange(40, 44)))
    refuse_unlocated(given, given.take(np.arange(40, 44)))


def test_too_few_to_hold_out(truth: Truth) -> None:
    """Where a fit without the part that is held out cannot be, the text says that it is of that part."""
    q = truth.configurations(44)
    given = concatenate(readings(q[:40], truth.points(q[:40])), readings(q[40:], plane=["table"] * 4))

    for held_out in (cross_validate, calibrate_nongeometric):
        with pytest.raises(InvalidValueError, match=r"with part \d of 5 held out: plane table"):
            held_out(truth.arm, given)


def test_taken(truth: Truth) -> None:
    """Some of many readings keep the names of all frames."""
    q = truth.configurations(4)
    given: Readings = readings(q, truth.points(q), frame=["a", "b", "a", "b"])

    some = given.take(np.array([True, False, True, False]))

    assert len(some) == 2
    assert some.frames == ("a", "b")
    np.testing.assert_array_equal(some.q, q[[0, 2]])
