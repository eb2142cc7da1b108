"""A new goal for a running motion: nothing jumps, no limit is passed, and Ruckig's own samples are met."""

import sys
from typing import Any

import attrs
import numpy as np
import pytest

from armwright.arm.limits import Limits
from armwright.arm.load import load_arm
from armwright.arm.model import Arm, Joint
from armwright.arrays import Array
from armwright.errors import ArmwrightError, InvalidValueError, KindError, MissingExtraError, ShapeError
from armwright.motion.online import JERK_TIME, OnlineError, replace_goal, retarget
from armwright.motion.polynomials import derivative, evaluate
from armwright.motion.quintic_polynomials import point_to_point, quintic
from armwright.motion.trajectory import Trajectory, join
from samples import Sample

ruckig = pytest.importorskip("ruckig")

PUMA = load_arm("puma560-seed")
# The same arm, whose joints may turn as far as they like.
FREE = attrs.evolve(
    PUMA,
    joints=[
        attrs.evolve(joint, limits=attrs.evolve(joint.limits, lower=-np.inf, upper=np.inf)) for joint in PUMA.joints
    ],
)
LOWER, UPPER = PUMA.limits.lower, PUMA.limits.upper
SPEED, ACCELERATION = PUMA.limits.speed, PUMA.limits.acceleration
# Position, speed and acceleration may jump by this much where the goal changes.
JUMP = 1e-9
# Limits may be passed by this part of them: rounding.
ROUNDING = 1e-9
# Ruckig meets its goals to this [rad].
MET = 1e-8
REST = np.zeros(6)


def slide(**limits: float) -> Arm:
    """One slide with limits, 2 m/s and 4 m/s² where nothing else is said."""
    return Arm(
        name="slide", joints=[Joint(kind="prismatic", limits=Limits(**{"speed": 2.0, "acceleration": 4.0, **limits}))]
    )


def jumps(trajectory: Trajectory) -> list[float]:
    """The largest jump at any knot of position, speed and acceleration."""
    lengths = np.diff(trajectory.times)[:, None]
    found = []
    for order in (0, 1, 2):
        terms = derivative(trajectory.coefficients, order)
        gaps = evaluate(terms, lengths)[:-1] - terms[1:, 0]
        found.append(float(np.abs(gaps).max(initial=0.0)))
    return found


def use(trajectory: Trajectory) -> float:
    """The largest part of a limit of speed or acceleration that a motion uses, by its exact extremes."""
    return float(max((trajectory.peaks(1) / SPEED).max(), (trajectory.peaks(2) / ACCELERATION).max()))


def state(rng: np.random.Generator, jerk: Array) -> tuple[Array, Array, Array]:
    """A random state of the PUMA from which the limits can be kept."""
    qdd = rng.uniform(-1, 1, 6) * ACCELERATION
    room = SPEED - qdd**2 / (2 * jerk)
    qd = rng.uniform(-1, 1, 6) * np.maximum(room, 0.0)
    return rng.uniform(LOWER, UPPER) / 4, qd, np.where(room > 0, qdd, 0.0)


@pytest.mark.share(0.25)
def test_thousands_of_states(sample: Sample) -> None:
    """From any state, all joints together or each by itself: the goal is met, and no limit passed in between."""
    for k, rng in enumerate(sample.cases(3000)):
        jerk = ACCELERATION * np.exp(rng.uniform(0, 4, 6))
        q, qd, qdd = state(rng, jerk)
        goal = rng.uniform(LOWER, UPPER) / 2

        move = retarget(FREE, q, qd, qdd, goal, jerk=jerk, synchronised=k % 2 == 0)

        assert max(jumps(move)) <= JUMP
        assert use(move) <= 1 + ROUNDING
        assert np.abs(move.coefficients[:, 3] * 6 / jerk).max() <= 1 + ROUNDING
        np.testing.assert_allclose(move(move.duration), goal, atol=MET)
        np.testing.assert_array_equal(move(0.0), q)
        np.testing.assert_array_equal(move(0.0, 1), qd)
        np.testing.assert_allclose(move(0.0, 2), qdd, rtol=ROUNDING)
    sample.record("goals from any state of motion, met within all limits", sample.count(3000), 0)


def test_goals_that_change_again_and_again(rng: np.random.Generator) -> None:
    """From the fastest move there is, ten new goals one after the other, each in mid-motion: nothing ever jumps."""
    for _ in range(20):
        whole = point_to_point(PUMA, rng.uniform(LOWER, UPPER) / 3, rng.uniform(LOWER, UPPER) / 3, 120.0)
        t = 0.0
        for _ in range(10):
            t += rng.uniform(0, 1) * (whole.duration - t)
            goal = rng.uniform(LOWER, UPPER) / 2
            before = whole
            whole = replace_goal(FREE, before, t, goal)

            np.testing.assert_allclose(whole(np.linspace(0, t, 50)), before(np.linspace(0, t, 50)), atol=JUMP)
            np.testing.assert_allclose(whole(whole.duration), goal, atol=MET)
        assert max(jumps(whole)) <= JUMP
        assert (whole.peaks(1) <= SPEED * (1 + ROUNDING)).all()
        assert (whole.peaks(2) <= ACCELERATION * (1 + ROUNDING)).all()


@pytest.mark.parametrize("synchronised", [True, False], ids=["together", "alone"])
def test_ruckigs_own_samples(synchronised: Any, rng: np.random.Generator) -> None:
    """Ruckig, asked for the same, is at the same places at the same speeds all the way."""
    jerk = ACCELERATION / JERK_TIME
    q, qd, qdd = state(rng, jerk)
    goal = rng.uniform(LOWER, UPPER) / 2
    request, theirs = ruckig.InputParameter(6), ruckig.Trajectory(6)
    request.current_position, request.current_velocity, request.current_acceleration = list(q), list(qd), list(qdd)
    request.target_position = list(goal)
    request.max_velocity, request.max_acceleration, request.max_jerk = list(SPEED), list(ACCELERATION), list(jerk)
    request.synchronization = ruckig.Synchronization.Time if synchronised else ruckig.Synchronization.No
    ruckig.Ruckig(6).calculate(request, theirs)

    ours = retarget(FREE, q, qd, qdd, goal, jerk=jerk, synchronised=synchronised)

    assert ours.duration == pytest.approx(theirs.duration, abs=1e-12)
    for t in np.linspace(0, ours.duration, 400)[:-1]:
        for order, (got, expected) in enumerate(zip((ours(t, k) for k in range(3)), theirs.at_time(t), strict=True)):
            np.testing.assert_allclose(got, expected, atol=MET if order < 2 else 1e-7)


@pytest.mark.parametrize("way", [1e-4, 0.01, 0.3, 1.0, 5.0])
@pytest.mark.parametrize("jerk", [3.0, 40.0, 4000.0])
def test_from_rest_to_rest(way: float, jerk: float) -> None:
    """The time of a jerk-limited move from rest to rest is known in closed form: four cases by what is reached."""
    v, a = 2.0, 4.0
    rise = min(np.sqrt(v / jerk), a / jerk, np.cbrt(way / (2 * jerk)))
    # Where the full acceleration is reached, it is held until the top speed or half of the way.
    held = min(v / a - rise, np.sqrt(rise**2 / 4 + way / a) - 3 * rise / 2) if rise == a / jerk else 0.0
    top = jerk * rise * (rise + held)
    expected = 2 * (2 * rise + held) + (way - top * (2 * rise + held)) / top

    move = retarget(slide(), [0], [0], [0], [way], jerk=jerk)

    assert move.duration == pytest.approx(expected, rel=1e-9)


def test_each_by_itself_is_no_slower() -> None:
    """Alone each joint arrives when it would arrive as the only one; together all arrive with the last."""
    goal = np.array([1.0, 0.5, -0.2, 0.1, 0.05, 2.0])
    alone = retarget(PUMA, REST, REST, REST, goal, synchronised=False)
    together = retarget(PUMA, REST, REST, REST, goal)
    arrivals = [retarget(PUMA, REST, REST, REST, np.where(np.arange(6) == j, goal, 0)).duration for j in range(6)]

    assert together.duration == pytest.approx(max(arrivals))
    assert alone.duration == pytest.approx(max(arrivals))
    for j, arrival in enumerate(arrivals):
        assert alone(arrival + 1e-9)[j] == pytest.approx(goal[j], abs=MET)
        assert abs(alone(0.9 * arrival)[j] - goal[j]) > 1e-4


def test_whole_ticks() -> None:
    """With a servo period the motion lasts a whole number of them, never less than without."""
    q, qd, qdd = REST, SPEED / 3, ACCELERATION / 5
    goal = np.full(6, 0.7)

    free, ticked = (retarget(FREE, q, qd, qdd, goal, period=period) for period in (None, 0.01))

    assert ticked.duration / 0.01 == pytest.approx(round(ticked.duration / 0.01), abs=1e-9)
    assert free.duration <= ticked.duration
    assert use(ticked) <= 1 + ROUNDING


def test_a_goal_that_moves() -> None:
    """The goal may be met at a speed, as a conveyor has it."""
    move = retarget(slide(), [0], [0], [0], [1.0], qd_goal=[0.5])

    assert move(move.duration)[0] == pytest.approx(1.0, abs=MET)
    assert move(move.duration, 1)[0] == pytest.approx(0.5, abs=MET)


def test_nothing_to_do() -> None:
    """An arm that stands at its new goal stays there."""
    assert retarget(PUMA, REST, REST, REST, REST).duration == 0


def test_a_state_beyond_the_limits() -> None:
    """It is refused with joint, number and limit; told to brake, the arm comes back inside and stays there."""
    arm = slide()
    with pytest.raises(OnlineError, match=r"joint 1 of 'slide' moves at 3 m/s, its limit is 2 m/s; brake=True"):
        retarget(arm, [0], [3], [0], [5.0])
    with pytest.raises(OnlineError, match=r"accelerates by -5 m/s², its limit is 4 m/s²"):
        retarget(arm, [0], [1], [-5], [5.0])

    move = retarget(arm, [0], [3], [5], [20.0], jerk=40.0, brake=True)

    assert move(0.0, 1)[0] == 3
    # The acceleration falls from 5 to -4 at 40 m/s³; on the way the speed gains 5²/80 and then loses 4²/80.
    assert move.extremes(1)[1][0] == pytest.approx(3 + 25 / 80, abs=1e-9)
    inside = 9 / 40 + (3 + 25 / 80 - 16 / 80 - 16 / 80 - 2) / 4 + 4 / 40
    t = np.linspace(inside, move.duration, 500)
    assert np.abs(move(t, 1)).max() <= 2 + 1e-9
    assert np.abs(move(t, 2)).max() <= 4 + 1e-9
    assert max(jumps(move)) <= JUMP


def test_a_speed_that_must_be_passed() -> None:
    """Full acceleration next to the top speed: with a given jerk it is refused and the jerk that helps is named."""
    arm = slide()
    with pytest.raises(OnlineError, match=r"come to 2\.2 m/s while its acceleration of 4 m/s² dies away.*jerk of 80 "):
        retarget(arm, [0], [1.9], [4], [5.0], jerk=80 / 3)

    move = retarget(arm, [0], [1.9], [4], [5.0])

    assert move.extremes(1)[1][0] <= 2 * (1 + 2e-9)
    assert np.abs(move.coefficients[0, 3, 0] * 6) == pytest.approx(80)


def test_no_room_to_turn_back() -> None:
    """At 1 m/s a tenth of a metre before its end a slide cannot stop; where it just can is known to the micrometre."""
    arm = slide(lower=-1.0, upper=2.0)
    with pytest.raises(
        OnlineError, match=r"on its motion to the new goal joint 1 would be at .* beyond its limit 2000"
    ):
        retarget(arm, [1.9], [1], [0], [0.0], jerk=1000.0)

    # The acceleration falls to -4 in 4 ms and stays until the slide turns back.
    ramp = 4 / 1000
    way = ramp - 1000 * ramp**3 / 6 + (1 - 1000 * ramp**2 / 2) ** 2 / (2 * 4)
    assert retarget(arm, [2 - way - 1e-6], [1], [0], [0.0], jerk=1000.0).extremes(0)[1][0] <= 2
    with pytest.raises(OnlineError, match="moves too fast to stop before"):
        retarget(arm, [2 - way + 1e-6], [1], [0], [0.0], jerk=1000.0)


def test_from_beyond_a_limit_back() -> None:
    """An arm that has been pushed beyond its range may come back, but not go farther."""
    arm = slide(lower=0.0, upper=1.0)

    assert retarget(arm, [1.1], [0], [0], [0.5]).extremes(0)[1][0] == pytest.approx(1.1)
    with pytest.raises(OnlineError, match="would be at"):
        retarget(arm, [1.1], [0.1], [0], [0.5])


@pytest.mark.parametrize(
    ("changed", "kind", "said"),
    [
        ({"q": [0, 0]}, ShapeError, r"q: expected 6 numbers"),
        ({"qd": np.zeros((2, 6))}, ShapeError, r"qd: expected shape \(6,\)"),
        ({"qdd": "fast"}, KindError, "qdd: expected numbers"),
        ({"q_goal": [np.nan] * 6}, InvalidValueError, "q_goal: every number must be finite"),
        ({"q_goal": [3, 0, 0, 0, 0, 0]}, InvalidValueError, r"q_goal: joint 1 would be at 171\.9 deg.*160\.0 deg"),
        ({"qd_goal": [9, 0, 0, 0, 0, 0]}, InvalidValueError, r"qd_goal: the velocity of joint 1 would be 9.* 1\.74533"),
        ({"jerk": 0}, InvalidValueError, "jerk: expected more than 0, got 0"),
        ({"jerk": 1e9}, InvalidValueError, r"jerk: joint 1 .* at most 7\.85e\+05 rad/s³, got 1e\+09"),
        ({"jerk": 1e-90}, OnlineError, "Ruckig found no motion .* check their units"),
        ({"jerk": [1, 2]}, ShapeError, "jerk: expected one number, or 6, one per joint"),
        ({"period": -1.0}, InvalidValueError, "period: expected more than 0 s, got -1"),
        ({"period": 0.01, "synchronised": False}, InvalidValueError, "synchronised=False: joints that arrive"),
        ({"arm": "puma560-seed"}, KindError, "arm: expected an Arm"),
        ({"arm": load_arm("ntu-3r"), **{name: [0] * 3 for name in ("q", "qd", "qdd", "q_goal")}}, InvalidValueError,
         "arm 'ntu-3r': joint 1 has no limit of acceleration"),
    ],
)  # fmt: skip
def test_bad_input(changed: dict[str, Any], kind: type[ArmwrightError], said: str) -> None:
    """What has no meaning is refused by name."""
    arguments = {"arm": PUMA, "q": REST, "qd": REST, "qdd": REST, "q_goal": np.ones(6) / 2, **changed}
    with pytest.raises(kind, match=said):
        retarget(**arguments)


def test_when_a_goal_can_change() -> None:
    """Not before the start; not after the end of a motion that is still moving then; after one at rest it stands."""
    move = quintic(REST, np.ones(6) / 2, 2.0)
    running = Trajectory(times=(0.0, 1.0), coefficients=np.array([[np.zeros(6), np.ones(6) / 10]]))
    with pytest.raises(InvalidValueError, match="t: expected 0 s or more, got -1"):
        replace_goal(PUMA, move, -1.0, REST)
    with pytest.raises(InvalidValueError, match="ends at 1 s and not at rest, so its state at 2 s is undefined"):
        replace_goal(PUMA, running, 2.0, REST)
    with pytest.raises(ShapeError, match="running: expected one of 6 joints, as 'puma560-seed' has, got one of 1"):
        replace_goal(PUMA, quintic([0], [1], 1.0), 0.5, REST)
    with pytest.raises(KindError, match="running: expected a Trajectory, got None"):
        replace_goal(PUMA, None, 0.5, REST)  # type: ignore[arg-type]

    late = replace_goal(PUMA, move, 3.0, REST)
    np.testing.assert_allclose(late([2.0, 2.5, 3.0]), np.full((3, 6), 0.5), atol=JUMP)
    np.testing.assert_allclose(late(late.duration), REST, atol=MET)
    at_start = replace_goal(PUMA, move, 0.0, REST)
    assert at_start.duration == 0


def test_where_the_running_motion_jumps() -> None:
    """Where the acceleration of the running motion jumps at the very moment, the one before it goes on."""
    there = Trajectory(times=(0.0, 1.0), coefficients=np.array([[[0.0], [0.0], [1.0]]]))
    back = Trajectory(times=(0.0, 1.0), coefficients=np.array([[[1.0], [2.0], [-1.0]]]))

    changed = replace_goal(slide(acceleration=4.0, speed=4.0), join([there, back]), 1.0, [5.0])

    assert changed(1.0 - 1e-9, 2)[0] == pytest.approx(2)
    assert changed(1.0, 2)[0] == pytest.approx(2)
    assert max(jumps(changed)) <= JUMP


def test_an_arm_without_speed_limit() -> None:
    """Where no limit of speed is known, accelerations alone decide: twice the root of way by acceleration."""
    arm = attrs.evolve(slide(), joints=[Joint(kind="prismatic", limits=Limits(acceleration=4.0))])

    move = retarget(arm, [0], [0], [0], [100.0], jerk=1e6)

    assert move.duration == pytest.approx(2 * np.sqrt(100 / 4), rel=1e-5)


def test_without_ruckig(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where Ruckig is missing, the message says what to install."""
    monkeypatch.setitem(sys.modules, "ruckig", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'armwright\[online\]'"):
        retarget(PUMA, REST, REST, REST, np.ones(6) / 2)
