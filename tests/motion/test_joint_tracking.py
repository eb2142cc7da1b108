"""Measured motions beside planned ones: errors and delays that are known beforehand."""

import attrs
import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.arrays import Array
from armwright.errors import InvalidValueError, TooFewError
from armwright.files.logs.joint_log import JointStates
from armwright.kinematics.forward_kinematics import forward
from armwright.motion.joint_tracking import MotionPair, motion_pairs, track_joints
from samples import Sample

NAMES = ("a", "b", "c")


def smooth(t: Array, phases: Array, n: int = 3) -> Array:
    """Return positions (k, n) of joints that swing at different rates."""
    return np.stack([np.sin((0.6 + 0.5 * j) * t + phases[j]) / (1 + j) for j in range(n)], axis=1)


def states(t: Array, q: Array, topic: str = "/x", names: tuple[str, ...] = NAMES) -> JointStates:
    """Return joint states without speeds and efforts."""
    nothing = np.full_like(q, np.nan)
    return JointStates(topic=topic, names=names, t=t, q=q, qd=nothing, tau=nothing)


def test_delay(sample: Sample) -> None:
    """A motion that is late by some milliseconds, with noise and an offset, is found to be late by as much."""
    for rng in sample.cases(100):
        phases, late, offset = rng.uniform(0, 6, 3), rng.uniform(-0.05, 0.05), rng.uniform(-0.01, 0.01, 3)
        t = np.arange(0, 12, 0.004)
        seen = np.sort(rng.uniform(0.5, 11.5, 2000))
        noise = 1e-4 * rng.standard_normal((len(seen), 3))
        measured = smooth(seen - late, phases) + offset + noise

        found = track_joints(states(t, smooth(t, phases)), states(seen, measured))

        error = found.delay - late
        assert np.abs(error / found.delay_deviation).max() < 6
        assert np.abs(error).max() < 1e-4
        np.testing.assert_allclose(found.left, 1e-4, rtol=0.15)
        assert found.common_delay == pytest.approx(late, abs=5e-5)


def test_errors_without_noise() -> None:
    """A constant error of one joint is its largest, its mean and its rms, and nothing is left of it."""
    t = np.arange(0, 10, 0.002)
    q = smooth(t, np.zeros(3))
    found = track_joints(states(t, q), states(t, q + np.array([0, 0.02, 0])))

    joint = found.as_data()["joints"][1]
    for key in ("largest_error", "rms_error", "mean_error"):
        assert joint[key] == pytest.approx(0.02, abs=1e-12)
    assert joint["rms_without_delay"] == pytest.approx(0, abs=1e-6)
    assert joint["delay"] == pytest.approx(0, abs=1e-8)


def test_joint_at_rest() -> None:
    """A joint that does not move is late by nothing that could be known."""
    t = np.arange(0, 10, 0.002)
    q = smooth(t, np.zeros(3)) * (1, 1, 0)
    found = track_joints(states(t, q), states(t, q))

    assert np.isnan(found.delay).tolist() == [False, False, True]
    assert found.as_data()["joints"][2]["delay"] is None
    assert next(found.tables()).rows[2][6] == "at rest"


def test_clocks_of_two_logs(sample: Sample) -> None:
    """Two logs whose clocks differ by any time, and of which one is a part of the other, are laid over one another."""
    for rng in sample.cases(50):
        phases, apart = rng.uniform(0, 6, 3), rng.uniform(-50, 50)
        t = np.arange(0, 20, 0.01)
        begin = rng.uniform(0, 8)
        seen = np.arange(begin, begin + 11, 0.008)
        measured = smooth(seen, phases) + 1e-4 * rng.standard_normal((len(seen), 3))

        found = track_joints(states(t, smooth(t, phases)), states(seen + apart, measured), same_clock=False)

        assert found.offset == pytest.approx(apart, abs=1e-3)
        assert np.abs(found.error).max() < 2e-3
        assert found.t[0] == pytest.approx(begin + apart, abs=0.02)


def test_tool() -> None:
    """The distance of the tool is that of the forward kinematics, and units are those of the joints."""
    arm = load_arm("stanford")
    t = np.arange(0, 3, 0.01)
    q = np.linspace(0.2, 0.5, len(t))[:, None] * np.ones(6)
    off = np.array([0, 0, 0.004, 0, 0, 0])
    names = tuple(f"joint_{i}" for i in range(1, 7))

    found = track_joints(states(t, q, names=names), states(t, q + off, names=names), arm=arm)

    assert found.tool_error is not None
    np.testing.assert_allclose(found.tool_error, 0.004, atol=1e-12)
    expected = np.linalg.norm(forward(arm, q + off)[:, :3, 3] - forward(arm, q)[:, :3, 3], axis=1)
    np.testing.assert_allclose(found.tool_error, expected, atol=1e-15)
    assert [row[1] for row in next(found.tables()).rows] == ["mrad", "mrad", "mm", "mrad", "mrad", "mrad"]
    assert next(found.tables()).rows[2][2] == "4"


def test_joints_by_name() -> None:
    """Joints are told by their names, whatever their order and what else is measured; by order where all differ."""
    t = np.arange(0, 5, 0.01)
    q = smooth(t, np.zeros(3))
    more = states(t, np.column_stack([q[:, [2, 0, 1]], t]), names=("c", "a", "b", "gripper"))

    for measured in (more, states(t, q, names=("j1", "j2", "j3"))):
        assert np.abs(track_joints(states(t, q), measured).error).max() == 0.0
    with pytest.raises(InvalidValueError, match="the joints differ: c is not among those measured; planned a, b, c; "):
        track_joints(states(t, q), states(t, q[:, :2], names=("a", "b")))
    with pytest.raises(InvalidValueError, match="3 joints, but puma560 has 6"):
        track_joints(states(t, q), states(t, q), arm=load_arm("puma560"))


def test_missing_numbers() -> None:
    """Rows without a position, and rows of the same time, do not count; without any others there is nothing to say."""
    t = np.arange(0, 5, 0.01)
    q = smooth(t, np.zeros(3))
    holes = q.copy()
    holes[::3, 1] = np.nan
    doubled = states(np.sort(np.concatenate([t, t])), np.repeat(holes, 2, axis=0))

    assert np.abs(track_joints(states(t, q), doubled).error).max() < 1e-12
    with pytest.raises(TooFewError, match="0 instants with the positions of all joints"):
        track_joints(states(t, q), states(t, np.full_like(q, np.nan)))
    with pytest.raises(TooFewError, match="0 instants within the plan"):
        track_joints(states(t, q), attrs.evolve(states(t, q), t=t + 100))
    with pytest.raises(TooFewError, match="no joint moves, so that nothing brings the clocks"):
        track_joints(states(t, 0 * q), states(t, 0 * q), same_clock=False)


@pytest.mark.parametrize(
    ("topics", "pairs"),
    [
        (["/A/planned/joint_states", "/A/measured/joint_states"], [(1, 0)]),
        (["/joint_states", "/controller/reference_states"], [(0, 1)]),
        (["/a/measured/js", "/a/planned/js", "/b/planned/js", "/b/measured/js"], [(0, 1), (3, 2)]),
        (["/left/joint_states", "/left/joint_states_desired", "/right/joint_states"], [(0, 1), (2, None)]),
        (["/joint_states"], [(0, None)]),
        (["/plan/joint_states"], []),
        (["/airplane/joint_states"], [(0, None)]),
    ],
)
def test_pairs(topics: list[str], pairs: list[tuple[int, int | None]]) -> None:
    """The words of topics tell what is a plan, and of which measurements."""
    expected = [MotionPair(topics[i], None if j is None else topics[j]) for i, j in pairs]
    assert motion_pairs(topics) == expected
