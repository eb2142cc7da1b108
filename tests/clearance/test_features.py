"""Features of error curves whose numbers one knows beforehand."""

import numpy as np
import pytest

from armwright.arrays import Array
from armwright.clearance.features import Features, error_curve_features, simulation_features, spectrum
from armwright.clearance.linkage import Linkage
from armwright.clearance.paths import named_path
from armwright.clearance.scenario import prepare_scenario
from armwright.clearance.simulation import simulate
from armwright.errors import InvalidValueError
from clearance.arms import ARM_A, CENTRE

# A quarter of a second at 10 kHz.
TIME = np.arange(2501) * 1e-4
# Of a few millimetres [m].
ROUNDING = 1e-15


def along(size: Array, direction: tuple[float, float] = (0.6, 0.8)) -> Array:
    """An error of this size, in one direction."""
    return np.asarray(size[:, None] * np.array(direction))


def test_straight_line() -> None:
    """A curve that begins with 0.55 mm and falls by 0.08 mm/s has that intercept and that slope."""
    curve_features = error_curve_features(TIME, along(0.55e-3 - 0.08e-3 * TIME))

    assert curve_features.slope == pytest.approx(-0.08e-3, rel=1e-9)
    assert curve_features.intercept == pytest.approx(0.55e-3, rel=1e-12)


def test_only_the_window_counts() -> None:
    """What the curve does outside of its straight part changes neither slope nor intercept."""
    inside = (TIME > 0.07 - 1e-9) & (TIME < 0.12 + 1e-9)
    wild = np.where(inside, 0.5e-3 + 1e-3 * TIME, 0.5e-3 * (2 + np.sin(900 * TIME)))

    curve_features = error_curve_features(TIME, along(wild))

    assert curve_features.slope == pytest.approx(1e-3, rel=1e-9)
    assert curve_features.intercept == pytest.approx(0.5e-3, rel=1e-11)


def test_another_window() -> None:
    """A curve of two straight parts has the slope of the one that is asked for."""
    bent = np.where(TIME < 0.1, 1e-3 + 2e-3 * TIME, 1.2e-3 - 4e-3 * (TIME - 0.1))

    early, late = (
        error_curve_features(TIME, along(bent), (0.01, 0.09)),
        error_curve_features(TIME, along(bent), (0.11, 0.2)),
    )

    assert (early.slope, early.intercept) == (pytest.approx(2e-3), pytest.approx(1e-3))
    assert (late.slope, late.intercept) == (pytest.approx(-4e-3), pytest.approx(1.6e-3))


@pytest.mark.parametrize(("mean", "wave", "turns"), [(0.45e-3, 0.1e-3, 3), (1e-3, 0.25e-3, 40)])
def test_mean_and_wave(mean: float, wave: float, turns: int) -> None:
    """A wave of 0.1 mm about 0.45 mm has an amplitude of 0.1 mm; the thesis' one is twice the mean, 0.9 mm."""
    time = TIME[:-1]
    curve_features = error_curve_features(time, along(mean + wave * np.sin(2 * np.pi * turns * time / 0.25 + 0.3)))

    assert curve_features.amp_dc == pytest.approx(2 * mean, rel=1e-12)
    assert curve_features.amp_ac == pytest.approx(wave, rel=1e-9)


def test_spectrum_of_waves() -> None:
    """A spectrum has the amplitude of each wave at the number of its periods, and twice the mean in front."""
    part = np.arange(1000) / 1000
    amplitudes = spectrum(0.7 + 0.2 * np.cos(2 * np.pi * 5 * part) + 0.03 * np.sin(2 * np.pi * 80 * part))

    expected = np.zeros(501)
    expected[[0, 5, 80]] = 1.4, 0.2, 0.03
    np.testing.assert_allclose(amplitudes, expected, rtol=0, atol=1e-13)


def test_offset_at_the_start() -> None:
    """The offsets are the error of the first sample, with its signs."""
    error = np.full((2501, 2), 1e-3)
    error[0] = 0.2e-3, -0.9e-3

    curve_features = error_curve_features(TIME, error)

    assert (curve_features.offset_x, curve_features.offset_y) == (0.2e-3, -0.9e-3)


def test_size_not_direction(rng: np.random.Generator) -> None:
    """An error that rotates while its size stays has neither slope nor wave."""
    angle = np.cumsum(rng.normal(0.0, 0.1, len(TIME)))

    curve_features = error_curve_features(TIME, 0.4e-3 * np.stack([np.cos(angle), np.sin(angle)], axis=-1))

    assert curve_features.intercept == pytest.approx(0.4e-3)
    assert abs(curve_features.slope) < 1e3 * ROUNDING
    assert curve_features.amp_ac < ROUNDING


def test_many_curves(rng: np.random.Generator) -> None:
    """Features of a table of curves are those of each curve."""
    curves = rng.normal(0.0, 1e-3, (2, 3, len(TIME), 2))

    together = error_curve_features(TIME, curves)

    for name in Features._fields:
        assert getattr(together, name).shape == (2, 3)
        alone = getattr(error_curve_features(TIME, curves[1, 2]), name)
        assert getattr(together, name)[1, 2] == pytest.approx(alone, rel=1e-12)


def test_simulation_starts_where_it_rests(five_bar: Linkage) -> None:
    """A simulated arm A starts y1 at its resting position, and follows it with 0.537 mm off (spec of the clearance)."""
    curve_features = simulation_features(simulate(prepare_scenario(five_bar, named_path("y1"), CENTRE), ARM_A))

    # 0.01 mm between steps of 10 and of 2 µs.
    assert curve_features.intercept == pytest.approx(0.5370e-3, abs=0.01e-3)
    assert curve_features.offset_y < 0
    assert np.hypot(curve_features.offset_x, curve_features.offset_y) == pytest.approx(0.5e-3, rel=0.2)


@pytest.mark.parametrize("window", [(0.3, 0.4), (0.1, 0.1), (0.2, 0.1)])
def test_empty_windows_are_refused(window: tuple[float, float]) -> None:
    """A line needs two samples, and the message states their number."""
    with pytest.raises(InvalidValueError, match=r"window: expected two samples or more from .* of 2501 up to 0.25 s"):
        error_curve_features(TIME, along(TIME), window)


def test_spectrum_of_the_fastest_wave() -> None:
    """A curve that goes up and down by a from one sample to the next is a wave of amplitude a."""
    curve = 0.3 * (-1.0) ** np.arange(64) + 2.0

    np.testing.assert_allclose(spectrum(curve)[[0, -1]], [4.0, 0.3], atol=1e3 * ROUNDING)
