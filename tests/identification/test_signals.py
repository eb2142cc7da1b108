"""Signals: filters without lag, equations that averages leave exact, folds that share nothing, and delays."""

import attrs
import numpy as np
import pytest
from scipy.signal import butter, sosfilt

from armwright.arrays import Array
from armwright.errors import InvalidValueError, ShapeError
from armwright.identification.delay import with_delay
from armwright.identification.equations import equations
from armwright.identification.log import Log, with_gains
from armwright.identification.model import DynamicModel
from armwright.identification.signals import Preparation, cut, low_pass, motions, preparation_of, white_cutoff
from identification.simulated import fourier, log, truth


def _readings(t: Array, q: Array) -> Log:
    return Log(name="log", t=t, q=q, effort=np.cos(q))


def test_filter_has_no_lag_and_a_quarter_of_the_power_at_its_cutoff() -> None:
    """A sine at the cut-off comes out with half its amplitude, at the same time; one far below is left as it is."""
    t = np.arange(0, 20, 0.01)
    for frequency, amplitude in ((0.5, 1.0), (5.0, 0.5)):
        wave = np.sin(2 * np.pi * frequency * t)[:, None]
        inside = slice(200, -200)
        np.testing.assert_allclose(low_pass(wave, 5.0, 100.0)[inside], amplitude * wave[inside], atol=2e-3)


def test_motion_has_the_derivatives_of_what_was_read(rng: np.random.Generator) -> None:
    """Velocities and accelerations of a smooth motion are exact to a thousandth, whatever the delay."""
    t = np.arange(0, 20, 0.004)
    q, _, _ = fourier(rng, 3, t)
    preparation = Preparation(cutoff=20.0, decimation=1, delay=0.0123, border=0.5, slow=np.zeros(3))

    (motion,) = motions([_readings(t, q)], preparation)

    rng = np.random.default_rng(83008)
    for values, expected in zip(motion[2:5], fourier(rng, 3, motion.t + 0.0123), strict=True):
        np.testing.assert_allclose(values, expected, atol=1e-3 * np.abs(expected).max())


def test_whiteness_finds_where_motion_ends_and_noise_begins(rng: np.random.Generator) -> None:
    """Of motion below 4 Hz in white noise, the cut-off is above the motion and far below half the sampling rate."""
    t = np.arange(0, 40, 0.005)
    band = sosfilt(butter(6, 4.0, fs=200.0, output="sos"), rng.normal(size=(len(t), 2)), axis=0)
    readings = band + 0.02 * band.std() * rng.normal(size=band.shape)

    assert 4.0 < white_cutoff([_readings(t, readings)]) < 20.0


def test_averages_of_equations_are_equations(rng: np.random.Generator) -> None:
    """Without noise the true parameters solve the averaged equations, also where friction reverses."""
    arm = truth()
    model = DynamicModel(arm=arm)
    perfect = log(arm, rng, sigma=0.0, resolution=1e-12)
    preparation = attrs.evolve(preparation_of([perfect], cutoff=30.0, decimation=10))
    blocks = list(equations(model, motions([perfect], preparation), 10))
    theta = _theta(model)

    for block in blocks:
        error = np.where(block.usable, block.tau - block.columns @ (model.base.combinations @ theta), 0.0)
        assert np.abs(error).max() < 2e-3 * np.abs(block.tau).max()
        assert block.usable.mean() > 0.8


def test_delay_is_found(rng: np.random.Generator) -> None:
    """Positions that are read 3 ms late are moved by 3 ms, to a tenth of the period of the readings."""
    arm = truth()
    late = log(arm, rng, delay=0.003, sigma=0.01)

    found = with_delay(DynamicModel(arm=arm), [late], preparation_of([late], cutoff=20.0, decimation=5))

    assert found.delay == pytest.approx(0.003, abs=0.1 * late.period)


def test_blocks_share_no_reading_and_know_nothing_of_each_other(rng: np.random.Generator) -> None:
    """Readings of one block may be anything without changing the motion of another by a bit."""
    t = np.arange(0, 20, 0.01)
    readings = _readings(t, fourier(rng, 2, t)[0])
    spoilt = attrs.evolve(readings, q=np.where((t > 10)[:, None], 7.0 * readings.q, readings.q))
    preparation = Preparation(cutoff=5.0, decimation=1, border=0.2, slow=np.zeros(2))

    blocks, others = cut(readings, 5.0), cut(spoilt, 5.0)

    assert sum(len(block.t) for block in blocks) == len(t)
    for one, other in zip(list(motions(blocks, preparation))[:2], list(motions(others, preparation))[:2], strict=True):
        np.testing.assert_array_equal(one.qdd, other.qdd)
    assert not np.array_equal(*(next(motions([each], preparation)).qdd[:1000] for each in (readings, spoilt)))


def test_gaps_part_a_log_and_uneven_times_are_made_even(rng: np.random.Generator) -> None:
    """A log with a gap is two motions; times that jitter give the same motion as even ones."""
    t = np.arange(0, 10, 0.01)
    jitter = t + rng.uniform(-0.002, 0.002, len(t))
    even, uneven = (_readings(times, fourier(np.random.default_rng(5), 2, times)[0]) for times in (t, jitter))
    keep = (t < 4) | (t > 5)
    parted = attrs.evolve(even, t=t[keep], q=even.q[keep], effort=even.effort[keep], clipped=even.clipped[keep])
    preparation = Preparation(cutoff=10.0, decimation=1, border=0.2, slow=np.zeros(2))

    assert len(list(motions([parted], preparation))) == 2
    assert parted.gaps() == [(pytest.approx(3.99), pytest.approx(1.02))]
    one, other = (next(motions([each], preparation)) for each in (even, uneven))
    at = np.interp(one.t[50:-50], other.t, other.q[:, 0])
    np.testing.assert_allclose(at, one.q[50:-50, 0], atol=1e-3)


def test_slow_joints_have_no_equation(rng: np.random.Generator) -> None:
    """An equation of a joint is usable where it moves one way all the time, and only there."""
    arm = truth("ntu-3r")
    readings = log(arm, rng)
    preparation = preparation_of([readings], cutoff=20.0, decimation=5)
    (motion,) = motions([readings], preparation)
    (block,) = equations(DynamicModel(arm=arm), [motion], 5)
    speeds = motion.qd[: 5 * len(block.t)].reshape(-1, 5, 3)

    moving = (np.abs(speeds) > preparation.slow).all(axis=1) & (np.abs(np.sign(speeds).sum(axis=1)) == 5)
    np.testing.assert_array_equal(block.usable, moving)
    assert 0.5 < block.usable.mean() < 1


def test_clipped_efforts_are_found() -> None:
    """Efforts that stay at the largest value for several readings are clipped; a single largest one is not."""
    t = np.linspace(0, 10, 501)
    wave = np.stack([np.clip(np.sin(t), -1, 0.8), np.sin(t)], axis=1)
    readings = Log(name="log", t=t, q=wave, effort=wave)

    assert readings.clipped[:, 0].sum() == (np.sin(t) >= 0.8).sum()
    assert not readings.clipped[:, 1].any()


def test_gains_make_efforts_of_currents() -> None:
    """A current times the gain of its joint is its effort."""
    t = np.linspace(0, 1, 60)
    readings = Log(name="log", t=t, q=np.zeros((60, 2)), effort=np.ones((60, 2)))

    np.testing.assert_array_equal(with_gains(readings, [2.0, -3.0]).effort[0], [2.0, -3.0])


def test_refuses_readings_that_do_not_fit() -> None:
    """Too few readings, other shapes, and times that go back are refused with what was wrong."""
    t = np.linspace(0, 1, 60)
    with pytest.raises(InvalidValueError, match="at least 50 readings, got 10"):
        Log(name="log", t=t[:10], q=np.zeros((10, 2)), effort=np.zeros((10, 2)))
    with pytest.raises(ShapeError, match="effort"):
        Log(name="log", t=t, q=np.zeros((60, 2)), effort=np.zeros((60, 3)))
    with pytest.raises(InvalidValueError, match="increase, got 1 s and then 0"):
        Log(name="log", t=np.concatenate([t, t]), q=np.zeros((120, 2)), effort=np.zeros((120, 2)))


def _theta(model: DynamicModel) -> Array:
    from armwright.dynamics.regressors import dynamic_parameters

    of_links = dynamic_parameters(model.arm)[: 10 * model.arm.n]
    drives = [(m.inertia, m.viscous, m.coulomb_forward, m.offset) for m in model.arm.motors]
    return np.concatenate([of_links, np.ravel(drives)])
