"""Identification from logs to arm: choices by held-out blocks, bad logs in a clear word, and what would tell more."""

import json

import attrs
import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.arm.model import Arm
from armwright.compiled.arm import compile_arm
from armwright.dynamics.regressors import dynamic_parameters
from armwright.errors import ContradictionError, FileFormatError, InvalidValueError, TooFewError
from armwright.identification import Identification, hold_out, identify
from armwright.identification.friction import LAWS
from armwright.identification.identifiability import UNKNOWN
from armwright.identification.log import Log
from identification.simulated import fourier, log, noise, truth

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

pytest.importorskip("clarabel", reason="the extra identification is not installed")


def _cube_root(arm: Arm) -> Arm:
    return attrs.evolve(arm, motors=[attrs.evolve(m, cube_root=4.0) for m in arm.motors])


@pytest.fixture(scope="module")
def truth_arm() -> Arm:
    """A PUMA whose friction grows with the cube root of the speed, drawn with other masses."""
    return _cube_root(truth())


@pytest.fixture(scope="module")
def found(truth_arm: Arm) -> Identification:
    """What two logs of it tell, and a third one checks."""
    rng = np.random.default_rng(12)
    drawn = attrs.evolve(
        load_arm("puma560"),
        links=[attrs.evolve(x, mass=0.8 * x.mass, inertia=0.8 * x.inertia) for x in truth_arm.links],
    )
    first, second, third = (log(truth_arm, rng, delay=0.002) for _ in range(3))
    return identify(drawn, [first, second], check=[third])


def test_law_of_friction_is_the_true_one(found: Identification) -> None:
    """Held-out blocks choose the friction that there is, and the delay comes out."""
    assert found.law == "with the cube root of the speed"
    assert found.preparation.delay == pytest.approx(0.002, abs=5e-4)
    assert {choice.what for choice in found.choices if choice.chosen} == {"filter", "friction", "drawing"}


def test_base_parameters_are_the_true_ones_within_their_errors(found: Identification, truth_arm: Arm) -> None:
    """Nearly all base parameters are within three standard errors of those of the arm."""
    drives = {
        term: [getattr(m, name) for m in truth_arm.motors]
        for term, name in (
            ("rotor", "inertia"), ("viscous", "viscous"), ("coulomb", "coulomb_forward"), ("offset", "offset"),
            ("cube_root", "cube_root"),
        )
    }  # fmt: skip
    own = [drives[term][i] for i in range(6) for term in found.model.terms]
    expected = found.model.base.combinations @ [*dynamic_parameters(attrs.evolve(truth_arm))[:60], *own]
    inside = np.abs(found.fit.values - expected) < 3 * found.fit.errors

    assert inside.mean() > 0.95


def test_held_out_efforts_are_predicted_to_the_noise(found: Identification) -> None:
    """A log that nothing was fitted to is predicted within four per cent, twice the noise."""
    (by_base,), (by_arm,) = found.validation, found.validation_of_arm
    assert (by_base.relative < 0.04).all()
    assert (by_arm.relative < 0.04).all()
    assert (by_base.correlation > 0.999).all()


def test_arm_moves_as_the_true_one(found: Identification, truth_arm: Arm) -> None:
    """The identified arm asks for the efforts of the true one, where it was excited: within a few per cent."""
    rng = np.random.default_rng(5)
    q, qd, qdd = rng.uniform(-1, 1, (3, 200, 6)) * np.array([1.0, 1.0, 2.0])[:, None, None]
    expected = compile_arm(truth_arm).inverse_dynamics(q, qd, qdd)
    drawn = compile_arm(found.model.arm).inverse_dynamics(q, qd, qdd)
    assert found.arm is not None

    errors = np.abs(compile_arm(found.arm).inverse_dynamics(q, qd, qdd) - expected).mean(axis=0)

    assert (errors < 0.05 * np.abs(expected).mean(axis=0)).all()
    assert (errors < 0.2 * np.abs(drawn - expected).mean(axis=0)).all()


def test_result_tells_what_it_is(found: Identification) -> None:
    """Tables and data hold every base parameter with its error, and the notes what was left out."""
    data = found.as_data()
    assert len(data["base_parameters"]) == len(found.fit.values)
    assert all(row["low"] < row["value"] < row["high"] for row in data["base_parameters"])
    titles = [table.title for table in found.tables()]
    assert titles[:2] == ["Root mean square of what is not predicted, N m", titles[1]]
    assert any("base parameters of" in note for note in found.notes)


def test_what_was_not_moved_is_hardly_known_and_what_would_tell_is_said(truth_arm: Arm) -> None:
    """A joint that hardly swings leaves its inertia unknown; the motion that would tell it is one of that joint."""
    rng = np.random.default_rng(4)
    readings = log(truth_arm, rng, sigma=0.05)
    still = log(truth_arm, np.random.default_rng(4), sigma=0.0)
    q, qd, qdd = _still(still, joint=4)
    tau = compile_arm(truth_arm).inverse_dynamics(q, qd, qdd)
    tau = tau + (readings.effort - still.effort)
    few = Log(name="still", t=readings.t, q=q, effort=tau)

    found = identify(truth_arm, [few], laws=LAWS[:1])

    weak = {each.name: each for each in found.weak}
    assert {"Izz5", "Ixx5"} & {name for name in weak if name.endswith("5")} or "rotor5" in weak
    assert any("joint" in each.motion for each in found.weak)
    assert all(each.error_after <= each.error for each in found.weak)


def _still(readings: Log, joint: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The motion with one joint nearly at rest."""
    q = readings.q.copy()
    q[:, joint] = 0.3 + 0.01 * (q[:, joint] - q[0, joint])
    qd = np.gradient(q, readings.period, axis=0)
    return q, qd, np.gradient(qd, readings.period, axis=0)


# ---- bad logs ------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def good(truth_arm: Arm) -> Log:
    """A log with nothing wrong."""
    return log(truth_arm, np.random.default_rng(8))


def _changed(good: Log, **changes: object) -> Log:
    return Log(**({"name": "log.csv", "t": good.t, "q": good.q, "effort": good.effort} | changes))  # type: ignore[arg-type]


def test_swapped_efforts_are_refused(truth_arm: Arm, good: Log) -> None:
    """Efforts of joints 2 and 3 in each other's columns are named."""
    with pytest.raises(ContradictionError, match="efforts of joint 2 and joint 3 look swapped"):
        identify(truth_arm, [_changed(good, effort=good.effort[:, [0, 2, 1, 3, 4, 5]])])


def test_reversed_efforts_are_refused(truth_arm: Arm, good: Log) -> None:
    """Efforts of joint 4 that count the other way are named by their friction."""
    with pytest.raises(ContradictionError, match="friction of joint 4 comes out negative"):
        identify(truth_arm, [_changed(good, effort=good.effort * [1, 1, 1, -1, 1, 1])])


def test_degrees_are_refused(truth_arm: Arm, good: Log) -> None:
    """Positions in degrees where radians are expected are told from the size of their numbers."""
    with pytest.raises(FileFormatError, match="are the units right"):
        identify(truth_arm, [_changed(good, q=np.degrees(good.q))])


def test_other_velocities_are_refused(truth_arm: Arm, good: Log) -> None:
    """Velocities in degrees per second beside positions in radians are told by their ratio."""
    rate = np.gradient(good.q, good.t, axis=0)
    with pytest.raises(InvalidValueError, match=r"57\.3 times the derivative of its positions: they look like degrees"):
        identify(truth_arm, [_changed(good, qd=np.degrees(rate))])


def test_milliseconds_are_refused(truth_arm: Arm, good: Log) -> None:
    """Times in milliseconds that are read as seconds, or the other way round, make speeds that no joint has."""
    limited = attrs.evolve(
        truth_arm,
        joints=[attrs.evolve(j, limits=attrs.evolve(j.limits, speed=3.0)) for j in truth_arm.joints],
    )
    with pytest.raises(InvalidValueError, match="are the units of positions and times right"):
        identify(limited, [_changed(good, t=good.t * 1e-3)])


def test_efforts_in_other_units_are_said(truth_arm: Arm, good: Log) -> None:
    """Efforts a thousand times too large are said to have nothing to do with the drawing."""
    found = identify(truth_arm, [_changed(good, effort=1000 * good.effort)], laws=LAWS[:1])
    assert any("times as much as the masses of the drawing ask for" in warning for warning in found.warnings)


def test_gaps_and_clipped_efforts_are_said_and_left_out(truth_arm: Arm, good: Log) -> None:
    """A gap parts the log, and clipped efforts of joint 1 do no harm to its friction."""
    keep = (good.t < 8) | (good.t > 9)
    limit = 0.9 * np.abs(good.effort[:, 0]).max()
    effort = good.effort.copy()
    effort[:, 0] = np.clip(effort[:, 0], -limit, limit)
    bad = _changed(good, t=good.t[keep], q=good.q[keep], effort=effort[keep])

    found = identify(truth_arm, [bad], laws=LAWS[:1])

    assert any("log.csv: 1 gap (1.00" in warning or "log.csv: 1 gap (1.01 s" in warning for warning in found.warnings)
    assert any("the effort of joint 1 stays at" in warning for warning in found.warnings)


def test_too_little_motion_is_said(truth_arm: Arm, good: Log) -> None:
    """A log in which nothing moves is refused; a joint that stands still all the time is named."""
    still = good.q.copy()
    still[:, 2] = 0.4
    found = identify(truth_arm, [_changed(good, q=still)], laws=LAWS[:1])
    assert any("joint 3 does not move in any log" in warning for warning in found.warnings)
    with pytest.raises(TooFewError):
        identify(truth_arm, [_changed(good, q=np.zeros_like(good.q))])


@pytest.mark.parametrize("stands", [[2], [4, 5], [0], [1, 2, 3, 4, 5]], ids=str)
def test_joints_that_never_move_leave_their_parameters_unknown(rng: np.random.Generator, stands: list[int]) -> None:
    """What no joint tells is said to be unknown, with the motion that would tell it; no other number suffers."""
    plain, t = truth(), np.arange(0, 20, 1 / 250)
    motion = fourier(rng, plain.n, t)
    for state, value in zip(motion, (0.3, 0.0, 0.0), strict=True):
        state[:, stands] = value
    tau = compile_arm(plain).inverse_dynamics(*motion)
    reading = Log(name="log.csv", t=t, q=motion[0], effort=tau + 0.05 * noise(rng, tau.shape, 0.9))

    found = identify(plain, [reading], laws=LAWS[1:2])

    unknown = {each.name: each for each in found.weak if each.error >= UNKNOWN}
    for joint in stands:
        for term in ("viscous", "coulomb", "offset"):
            name = f"{term}{joint + 1}"
            assert name in unknown
            assert unknown[name].motion.startswith("swing joint")
            assert unknown[name].error_after < 0.3
    assert np.isfinite(found.fit.errors).all()
    json.dumps(found.as_data(), allow_nan=False)
    moving = [joint for joint in range(plain.n) if joint not in stands]
    names = found.model.base.names
    for joint in moving:
        k = names.index(f"viscous{joint + 1}")
        assert abs(found.fit.values[k] - plain.motors[joint].viscous) < 4 * found.fit.errors[k]
    assert found.arm is not None


def test_no_log_is_refused(truth_arm: Arm) -> None:
    """Without a log there is nothing to identify."""
    with pytest.raises(TooFewError, match="at least one log"):
        identify(truth_arm, [])


@pytest.mark.parametrize("how", ["blocks", "last"])
def test_held_out_part_is_a_quarter(good: Log, how: str) -> None:
    """A quarter of a log is held out, and nothing of it is among what is trained on."""
    kept, held = hold_out(good, how)
    times = [np.concatenate([part.t for part in parts]) for parts in (kept, held)]
    assert len(times[1]) / len(good.t) == pytest.approx(0.25, abs=0.02)
    assert not np.intersect1d(*times).size
    assert len(times[0]) + len(times[1]) == len(good.t)


def test_single_wild_readings_do_no_harm(truth_arm: Arm, good: Log, rng: np.random.Generator) -> None:
    """Spikes of positions and efforts are told, and what is identified is what is identified without them."""
    q, effort = good.q.copy(), good.effort.copy()
    rows, joints = rng.choice(np.arange(100, len(q) - 100, 20), 30, replace=False), rng.integers(0, 6, 30)
    q[rows[:10], joints[:10]] += 0.5
    effort[rows[10:], joints[10:]] += 300.0

    found = identify(truth_arm, [_changed(good, q=q, effort=effort)], laws=LAWS[2:3])
    plain = identify(truth_arm, [good], laws=LAWS[2:3])

    told = [warning for warning in found.warnings if "stand far out from their neighbours" in warning]
    assert [each.split(": ")[1].split(" stand")[0] for each in told] == [
        "10 readings of positions",
        "20 readings of efforts",
    ]
    assert np.abs(found.fit.values - plain.fit.values).max() < 2 * plain.fit.errors.max()
    assert found.preparation.delay == pytest.approx(plain.preparation.delay, abs=5e-4)


def test_steps_at_gaps_are_no_spikes(good: Log) -> None:
    """What differs on both sides of a gap stays as it was read."""
    kept = np.ones(len(good.t), dtype=bool)
    kept[1000:1500] = False
    cut = Log(name="log.csv", t=good.t[kept], q=good.q[kept], effort=good.effort[kept])
    np.testing.assert_array_equal(cut.without_spikes().q, cut.q)


@pytest.mark.parametrize("late", [-0.16, 0.12])
def test_long_delays_are_found(truth_arm: Arm, good: Log, late: float) -> None:
    """Efforts that come a tenth of a second before or after the positions are brought together with them."""
    shift = round(late / good.period)
    rows = slice(max(shift, 0), len(good.t) + min(shift, 0))
    efforts = slice(max(-shift, 0), len(good.t) + min(-shift, 0))
    moved = Log(name="log.csv", t=good.t[: len(good.q[rows])], q=good.q[rows], effort=good.effort[efforts])
    before = identify(truth_arm, [good], laws=LAWS[2:3]).preparation.delay
    assert identify(truth_arm, [moved], laws=LAWS[2:3]).preparation.delay == pytest.approx(before - late, abs=2e-3)


def test_joint_that_counts_the_other_way_is_named(truth_arm: Arm, good: Log) -> None:
    """A reversed effort of a joint that gravity loads does not make its link heavy: it is refused."""
    with pytest.raises(ContradictionError, match="the efforts of joint 2 look reversed"):
        identify(truth_arm, [_changed(good, effort=good.effort * [1, -1, 1, 1, 1, 1])])


def test_efforts_that_tell_nothing_are_said(truth_arm: Arm, good: Log, rng: np.random.Generator) -> None:
    """Noise, a joint without efforts, times in milliseconds, and efforts that never change are told apart."""
    noisy = identify(truth_arm, [_changed(good, effort=rng.normal(size=good.effort.shape))], laws=LAWS[:1])
    assert any("explains hardly anything of the efforts of joints 1, 2, 3" in warning for warning in noisy.warnings)
    silent = identify(truth_arm, [_changed(good, effort=good.effort * [1, 1, 1, 1, 1, 0])], laws=LAWS[:1])
    assert any("the effort of joint 6 never changes while it moves" in warning for warning in silent.warnings)
    json.dumps(silent.as_data(), allow_nan=False)
    slow = identify(truth_arm, [Log(name="log.csv", t=1000 * good.t, q=good.q, effort=good.effort)], laws=LAWS[:1])
    assert any("are the times in seconds" in warning for warning in slow.warnings)
    with pytest.raises(InvalidValueError, match="no effort ever changes"):
        identify(truth_arm, [_changed(good, effort=np.ones_like(good.effort))])
