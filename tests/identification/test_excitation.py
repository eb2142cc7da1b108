"""Motions that excite: from rest to rest, within all limits, and as telling as said beforehand."""

import attrs
import numpy as np
import pytest
from scipy.optimize import check_grad

from armwright.arm.load import load_arm
from armwright.arm.model import Arm
from armwright.compiled.arm import compile_arm
from armwright.errors import IncapableArmError, InvalidValueError
from armwright.identification import DynamicModel, Excitation, MotionLimits, plan_excitation
from armwright.identification.equations import Equations
from armwright.identification.excitation import _Objective
from armwright.identification.fitting import robust
from armwright.identification.fourier import Fourier

TERMS = ("rotor", "viscous", "coulomb")


def _limits(arm: Arm) -> MotionLimits:
    n = arm.n
    return MotionLimits(
        lower=np.full(n, -2.8),
        upper=np.full(n, 2.8),
        speed=np.full(n, 2.0),
        acceleration=np.full(n, 4.0),
        effort=arm.limits.effort,
    )


@pytest.fixture(scope="module")
def planned() -> Excitation:
    """A motion of the UR5."""
    arm = load_arm("ur5")
    return plan_excitation(DynamicModel(arm=arm, terms=TERMS), limits=_limits(arm))


def test_series_starts_and_ends_at_rest(rng: np.random.Generator) -> None:
    """Whatever the free coefficients, velocity and acceleration are 0 at both ends, and derivatives are right."""
    series = Fourier.zero(3, 5, 10.0).with_coefficients(rng.normal(size=(8, 3)), np.array([0.1, 0.2, 0.3]))
    q, qd, qdd = series(np.array([0.0, 10.0]))
    np.testing.assert_allclose(qd, 0, atol=1e-12)
    np.testing.assert_allclose(qdd, 0, atol=1e-12)
    np.testing.assert_allclose(q[0], q[1])
    t = np.linspace(0, 10, 20_001)
    q, qd, qdd = series(t)
    np.testing.assert_allclose(np.gradient(q, t, axis=0)[5:-5], qd[5:-5], atol=1e-5)
    np.testing.assert_allclose(np.gradient(qd, t, axis=0)[5:-5], qdd[5:-5], atol=1e-5)


def test_limits_are_kept_everywhere(planned: Excitation) -> None:
    """At ten times as many moments as it was optimised at, no limit is exceeded, and most are nearly used."""
    t = np.linspace(0, planned.motion.period, 4001)
    q, qd, qdd = planned.motion(t)
    tau = compile_arm(planned.model.arm).inverse_dynamics(q, qd, qdd)
    limits = planned.limits
    assert (q > limits.lower - 1e-3).all()
    assert (q < limits.upper + 1e-3).all()
    assert (np.abs(qd) < limits.speed * 1.001).all()
    assert (np.abs(qdd) < limits.acceleration * 1.001).all()
    assert (np.abs(tau).max(axis=0) < limits.effort * 1.001).all()
    assert (np.abs(qd).max(axis=0) / limits.speed).max() > 0.9


def test_condition_is_far_better_than_of_random_motions(planned: Excitation) -> None:
    """The condition is less than half of the best of thirty random motions that use the limits as much."""
    rng = np.random.default_rng(1)
    arm = planned.model.arm
    objective = _Objective(planned.model, planned.limits, planned.noise, 20.0, 5, "condition")
    others = [
        objective.final(objective.fitted(np.vstack([rng.normal(size=(8, arm.n)), np.zeros(arm.n)]))) for _ in range(30)
    ]
    assert planned.condition < 0.5 * min(others)
    assert planned.condition < 45


@pytest.mark.parametrize("criterion", ["condition", "information"])
def test_gradient_is_that_of_differences(criterion: str, rng: np.random.Generator) -> None:
    """The gradient of the objective agrees with central differences in all directions."""
    arm = load_arm("ntu-3r")
    model = DynamicModel(arm=arm, terms=TERMS)
    objective = _Objective(model, MotionLimits.of(arm), np.array([1.0, 2.0, 3.0]), 10.0, 4, criterion)  # type: ignore[arg-type]
    x = rng.normal(size=3 * 7) * 0.4

    error = check_grad(lambda x: objective._value(x)[0], lambda x: objective._value(x)[1], x, epsilon=1e-6)

    assert error < 1e-4 * np.linalg.norm(objective._value(x)[1])


def test_errors_come_as_they_were_told(planned: Excitation) -> None:
    """Fits to the motion with such noise scatter as much as the errors that were told beforehand."""
    rng = np.random.default_rng(9)
    count = round(planned.rate * planned.motion.period)
    t = np.arange(count) / planned.rate
    columns = planned.model.base_columns(*planned.motion(t))
    usable = np.ones((count, 6), dtype=bool)
    values = [
        robust([Equations("log", t, columns, planned.noise * rng.normal(size=(count, 6)), usable)]).values
        for _ in range(20)
    ]
    ratio = np.std(values, axis=0) / planned.errors
    assert np.median(ratio) == pytest.approx(1.0, abs=0.15)


def test_motion_is_made_smaller_where_it_would_meet_something() -> None:
    """A check that allows small positions alone is obeyed; one that allows nothing is refused."""
    model = DynamicModel(arm=load_arm("ntu-3r"), terms=TERMS)
    allowed = plan_excitation(model, is_free=lambda q: bool(np.ptp(q, axis=0).max() < 0.8))
    assert np.ptp(allowed.motion(np.linspace(0, 20, 400))[0], axis=0).max() < 0.8
    with pytest.raises(IncapableArmError, match="meets nothing"):
        plan_excitation(model, is_free=lambda _: False)


def test_weak_drives_make_it_slower() -> None:
    """An arm that hardly carries itself gets a slower motion; one that does not is refused."""
    arm = load_arm("ur5")
    weak = attrs.evolve(arm, joints=[attrs.evolve(j, limits=attrs.evolve(j.limits, effort=1.0)) for j in arm.joints])
    with pytest.raises(IncapableArmError, match="efforts do not suffice"):
        plan_excitation(DynamicModel(arm=weak, terms=TERMS))


def test_cells_can_play_it(planned: Excitation) -> None:
    """The motion as polynomials is the series, to a micrometre's worth of angle."""
    t = np.linspace(0, 20, 777)
    for order in range(3):
        expected = planned.motion(t)[order]
        np.testing.assert_allclose(planned.trajectory(t, order), expected, atol=[1e-8, 1e-6, 1e-4][order])


def test_result_tells_limits_and_errors(planned: Excitation) -> None:
    """Tables and data tell the use of limits, the condition and an error for every base parameter."""
    data = planned.as_data()
    assert data["condition"] == planned.condition
    assert len(data["errors"]) == 52
    motion, errors = planned.tables()
    assert len(motion.rows) == 6
    assert len(errors.rows) == 52
    assert f"condition {planned.condition:.1f}" in planned.notes[0]


def test_refuses_what_makes_no_motion() -> None:
    """Too few harmonics, a period of nothing and an unknown criterion are refused."""
    model = DynamicModel(arm=load_arm("ntu-3r"), terms=TERMS)
    with pytest.raises(InvalidValueError, match="harmonics"):
        plan_excitation(model, harmonics=2)
    with pytest.raises(InvalidValueError, match="period"):
        plan_excitation(model, period=0.0)
    with pytest.raises(InvalidValueError, match="expected condition or information, got best"):
        plan_excitation(model, criterion="best")  # type: ignore[arg-type]
