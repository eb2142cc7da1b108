"""Accuracy of paths, speeds, corners, weaves, and coming to rest."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from hypothesis.extra.numpy import arrays

from armwright.accuracy.corner import corner_deviations
from armwright.accuracy.path import path_deviation, path_velocity
from armwright.accuracy.settling_time import posing_time, settling
from armwright.accuracy.trace import Trace
from armwright.accuracy.weaving import weaving_deviation
from armwright.errors import InvalidValueError, ShapeError, TooFewError
from armwright.spatial.rotations import rotation_from_vector

ROUNDING = 1e-12
LINE = Trace(positions=((0.0, 0.0), (1.0, 0.0)))
SQUARE = Trace(positions=((0, 0), (1, 0), (1, 1), (0, 1), (0, 0)))
BEND = Trace(positions=((0, 0), (1, 0), (1, 1)))


def along(path: Trace, parts: np.ndarray) -> np.ndarray:
    """Places at parts (n,) of a path whose legs are equally long."""
    legs = len(path.positions) - 1
    leg = np.minimum((parts * legs).astype(int), legs - 1)
    rest = (parts * legs - leg)[:, None]
    return (1 - rest) * path.positions[leg] + rest * path.positions[leg + 1]


def beside(offset: float, count: int = 301) -> Trace:
    """A run at a distance from the line, sampled closely at its start and widely at its end, with rests."""
    x = np.sort(np.append(np.linspace(0, 1, count) ** 3, np.full(20, 0.343)))
    return Trace(positions=np.stack([1.02 * x - 0.01, np.full(len(x), offset)], axis=1))


def test_parallel_runs() -> None:
    """Runs 1, 1, 3, 3 … mm beside a line: AT is 2 mm; all lie 1 mm from the mean, so RT is 1 mm."""
    result = path_deviation(LINE, [beside(1e-3 if j % 2 else 3e-3) for j in range(10)])

    assert result.accuracy == pytest.approx(2e-3, abs=ROUNDING)
    assert result.repeatability == pytest.approx(1e-3, abs=ROUNDING)
    np.testing.assert_allclose(result.offsets, 2e-3, atol=ROUNDING)
    np.testing.assert_allclose(result.stations, (np.arange(200) + 0.5) / 200)


def test_bulge() -> None:
    """A bulge in all runs is result where it is, however the runs are sampled."""
    runs = []
    for j in range(10):
        x = np.linspace(0, 1, 2001) ** (1 + j / 5)
        runs.append(Trace(positions=np.stack([x, 5e-3 * np.exp(-(((x - 0.6) / 0.1) ** 2))], axis=1)))

    result = path_deviation(LINE, runs)

    # The nearest plane is half a distance off the top; chords of samples 3 mm apart cut 6 um off at most.
    assert result.accuracy == pytest.approx(5e-3, abs=1e-5)
    assert result.accuracy_at == pytest.approx(0.6, abs=2.6e-3)
    assert result.repeatability < 2e-5


def test_closed_path_with_corners(rng: np.random.Generator) -> None:
    """Round a square that is 4 mm aside, AT is 4 mm on the legs along and nothing on the others; noise adds little."""

    def run() -> Trace:
        positions = along(SQUARE, np.sort(rng.uniform(0, 1, 3000)))
        return Trace(positions=positions + np.array((0.0, 4e-3)) + rng.normal(scale=1e-5, size=(3000, 2)))

    result = path_deviation(SQUARE, [run() for _ in range(10)], corners=0.01)

    leg = result.stations.astype(int)
    np.testing.assert_allclose(result.offsets[leg % 2 == 0], 4e-3, atol=5e-5)
    np.testing.assert_allclose(result.offsets[leg % 2 == 1], 0, atol=5e-5)


def test_circle() -> None:
    """On a circle of 1 m, runs of radii 1.000 to 1.009 m lie 4.5 mm outside on average, all around."""
    turn = np.linspace(0, 2 * np.pi, 721)
    circle = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    uneven = turn + 0.4 * np.sin(turn)
    runs = [
        Trace(positions=(1 + j * 1e-3) * np.stack([np.cos(uneven), np.sin(uneven), 0 * turn], axis=1))
        for j in range(10)
    ]

    result = path_deviation(Trace(positions=circle), runs)

    # Chords of a degree lie up to 40 um inside.
    np.testing.assert_allclose(result.offsets, 4.5e-3, atol=5e-5)
    assert len(result.stations) == 200


@settings(max_examples=25)
@given(
    turn=arrays(np.float64, 3, elements=st.floats(-3, 3)),
    shift=arrays(np.float64, 3, elements=st.floats(-3, 3)),
    seed=st.integers(0, 2**32 - 1),
)
def test_rigid_motion_of_paths(turn: np.ndarray, shift: np.ndarray, seed: int) -> None:
    """AT, RT, CR and CO do not depend on the frame in which path and runs are measured."""
    rng, R = np.random.default_rng(seed), rotation_from_vector(turn)
    path = Trace(positions=((0, 0, 0), (1, 0, 0), (1, 1, 0)))
    positions = [along(path, np.linspace(0, 1, 60)) + rng.normal(scale=1e-3, size=(60, 3)) for _ in range(3)]

    def measured(frame: Any) -> list[float]:
        command, runs = Trace(positions=frame(path.positions)), [Trace(positions=frame(one)) for one in positions]
        on_path = path_deviation(command, runs, planes=20, corners=0.06, few=True)
        (corner,) = corner_deviations(command, runs)
        return [on_path.accuracy, on_path.repeatability, corner.round_off, corner.overshoot]

    np.testing.assert_allclose(measured(lambda p: p @ R.T + shift), measured(lambda p: p), atol=1e-10)


def test_reorientation() -> None:
    """An angle commanded from 170 to 190 deg, attained 0.5 deg too large, as an instrument displays it: 180 is -180."""
    path = Trace(positions=LINE.positions, angles=np.radians(((170.0,), (-170.0,))))
    x = np.linspace(0, 1, 101)
    deg = (170.5 + 20 * x + 180) % 360 - 180
    runs = [Trace(positions=np.stack([x, 0 * x], axis=1), angles=np.radians(deg)[:, None]) for _ in range(10)]

    result = path_deviation(path, runs, kind="reorientation")

    assert np.degrees(result.accuracy_angles[0]) == pytest.approx(0.5)
    assert result.repeatability_angles[0] == pytest.approx(0, abs=ROUNDING)


def test_speeds() -> None:
    """Runs at 0.98 and 1.02 m/s for 1: AV 0, RV of three deviations; a run that changes speed has FV of the change."""
    x = np.linspace(0, 1, 401)
    steady = [Trace(positions=np.stack([x, 0 * x], axis=1), times=x / v) for v in (0.98, 1.02) * 5]
    changing = Trace(
        positions=np.stack([x, 0 * x], axis=1), times=np.where(x < 0.5, x / 1.5, 0.5 / 1.5 + (x - 0.5) / 0.5)
    )

    result = path_velocity(LINE, steady, 1.0)
    jump = path_velocity(LINE, [changing] * 10, 1.0)

    assert result.accuracy == pytest.approx(0, abs=1e-9)
    assert result.repeatability == pytest.approx(3 * 0.02 * np.sqrt(10 / 9))
    assert result.fluctuation == pytest.approx(0, abs=1e-9)
    assert jump.fluctuation == pytest.approx(1.0)
    assert jump.accuracy == pytest.approx(0, abs=1e-9)


def rounded(radius: float) -> Trace:
    """The bend with an arc in its corner."""
    turn = np.linspace(0, np.pi / 2, 181)
    arc = np.stack([1 - radius + radius * np.sin(turn), radius - radius * np.cos(turn)], axis=1)
    return Trace(positions=np.vstack([(0, 0), arc, (1, 1)]))


def test_rounded_corner() -> None:
    """An arc of radius r passes the corner at r (sqrt(2) - 1), overshoots nothing, and is on the leg after r."""
    (result,) = corner_deviations(BEND, [rounded(0.1), rounded(0.1), rounded(0.2)], band=1e-5)

    # Chords of half a degree.
    assert result.round_offs == pytest.approx((np.sqrt(2) - 1) * np.array((0.1, 0.1, 0.2)), abs=1e-5)
    assert result.round_off == pytest.approx(0.4 / 3 * (np.sqrt(2) - 1), abs=1e-5)
    assert result.overshoot == pytest.approx(0, abs=ROUNDING)
    # The arc is within 10 um of the leg for its last sqrt(2 r 10 um).
    early = np.sqrt(2 * np.array((0.1, 0.1, 0.2)) * 1e-5).mean()
    assert result.settling_length == pytest.approx(0.4 / 3 - early, abs=3e-4)


def test_overshot_corner() -> None:
    """A run going 30 mm beyond the corner before it follows the second leg has CO of 30 mm; only one side counts."""
    run = Trace(positions=((0, 0), (1, 0), (1.03, 0.02), (1.0, 0.1), (0.95, 0.2), (1.0, 0.3), (1, 1)))

    (result,) = corner_deviations(BEND, [run] * 3, band=1e-3)

    assert result.round_off == pytest.approx(0, abs=ROUNDING)
    assert result.overshoot == pytest.approx(0.03)
    # The way back from 50 mm at 0.2 m to 0 at 0.3 m is within 1 mm at 0.298 m.
    assert result.settling_length == pytest.approx(0.298)


def test_never_on_the_second_leg() -> None:
    """A run that stays beside the second leg has no stabilisation path length: it is infinite."""
    run = Trace(positions=((0, 0), (1.1, 0), (1.1, 0.5), (1.1, 1)))

    assert corner_deviations(BEND, [run] * 3, band=1e-3)[0].settling_length == np.inf


def test_two_corners() -> None:
    """Every corner of a path has its own numbers."""
    path = Trace(positions=((0, 0), (1, 0), (1, 1), (0, 1)))
    run = Trace(positions=((0, 0), (0.9, 0), (1, 0.1), (1, 1), (1, 1.02), (0, 1)))

    first, second = corner_deviations(path, [run] * 3)

    assert first.round_off == pytest.approx(0.1 / np.sqrt(2))
    assert second.round_off == pytest.approx(0, abs=ROUNDING)
    assert second.overshoot == pytest.approx(0.02)
    assert first.settling_length is None


def swing(t: np.ndarray) -> np.ndarray:
    """Distance from rest: 10 mm away, through it, back out to 2 mm, and in for good."""
    return np.interp(t, (0, 1, 2, 3, 9), (-10e-3, 0, 2e-3, 0, 0))


def test_settling() -> None:
    """With a band of 1 mm: in at 0.9 s, out to 2 mm, in for good at 2.5 s; overshoot 2 mm."""
    t = np.linspace(0, 9, 901)
    run = Trace(positions=np.stack([swing(t), 0 * t], axis=1), times=t)

    result = settling([run] * 3, 1e-3)

    assert result.entered == pytest.approx([0.9] * 3)
    assert result.time == pytest.approx(1.6)
    assert result.overshoot == pytest.approx(2e-3)
    assert settling([run] * 3, 2.5e-3).overshoot == 0.0
    assert settling([run] * 3, 2.5e-3).time == pytest.approx(0.0, abs=ROUNDING)


def test_through_the_band_between_samples() -> None:
    """A robot that flies through the band between two samples has entered it there."""
    run = Trace(positions=((-5, 0), (5, 0), (-3, 0), *[(0, 0)] * 20), times=np.arange(23.0))

    result = settling([run] * 3, 1.0)

    assert result.entered == pytest.approx([0.4] * 3)
    assert result.settled == pytest.approx([2 + 2 / 3] * 3)
    assert result.overshoot == pytest.approx(5.0)


def test_posing_time() -> None:
    """From leaving the first position by 1 mm to the band of the second: 100 mm in 1 s after half a second of rest."""
    t = np.linspace(0, 5, 501)
    x = 0.3 + np.clip(t - 0.5, 0, 1) * 0.1
    run = Trace(positions=np.stack([x, 0 * x, 0 * x + 0.2], axis=1), times=t)

    result = posing_time([run] * 3, 1e-3)

    assert result.time == pytest.approx(0.98)
    assert result.distance == pytest.approx(0.1)


@pytest.mark.parametrize("turn", [0.0, 0.7])
def test_weave(turn: float) -> None:
    """A weave 10 % too wide and 5 % too fast: WS 10 %, WF 5 %, in any direction."""
    R = rotation_from_vector((0, 0, turn))[:2, :2]
    corners = np.stack([np.arange(21) * 2.5e-3, 5e-3 * np.array((*(0, 1, 0, -1) * 5, 0))], axis=1)
    t = np.linspace(0, 5, 50_001)
    # At 10 mm/s a weave of 10 mm takes 1 s.
    side = 5.5e-3 * (2 / np.pi) * np.arcsin(np.sin(2 * np.pi * 1.05 * t))
    run = Trace(positions=np.stack([0.01 * t, side], axis=1) @ R.T, times=t)

    result = weaving_deviation(Trace(positions=corners @ R.T), [run] * 3, 0.01)

    assert result.commanded_stroke == pytest.approx(0.01)
    assert result.commanded_frequency == pytest.approx(1.0)
    # Samples miss the turning points by half a distance of samples.
    assert result.stroke == pytest.approx(0.10, abs=1e-3)
    assert result.frequency == pytest.approx(0.05, abs=1e-3)


RUN = beside(0.0)
TIMED = Trace(positions=((0, 0), (1, 0)), times=(0, 1))
STANDSTILL = Trace(positions=((0, 0), (1, 0), (1, 0)), times=(0, 1, 9))
MISTAKES: dict[str, tuple[Any, type[Exception], str]] = {
    "few": (lambda: path_deviation(LINE, [RUN] * 9), TooFewError, "path: ISO 9283 requires 10 cycles, got 9"),
    "few corners": (lambda: corner_deviations(BEND, [rounded(0.1)]), TooFewError, "requires 3 cycles, got 1"),
    "one": (lambda: path_deviation(LINE, [RUN], few=True), TooFewError, "expected at least 2 cycles"),
    "no length": (
        lambda: path_deviation(Trace(positions=((0, 0), (0, 0))), [RUN] * 10),
        InvalidValueError,
        "commanded path: all of its points coincide",
    ),
    "half a run": (
        lambda: path_deviation(LINE, [*[RUN] * 9, Trace(positions=((0, 0), (0.6, 0)))]),
        InvalidValueError,
        "path: run 10 does not go through the plane at 602.5 of 1000 mm of the commanded path",
    ),
    "backwards": (
        lambda: path_deviation(LINE, [Trace(positions=((1, 0), (0, 0)))] * 10),
        InvalidValueError,
        "run 1 does not go through the plane",
    ),
    "a cut corner": (
        lambda: path_deviation(BEND, [rounded(0.2)] * 10),
        InvalidValueError,
        "exclude the sections near corners",
    ),
    "all corner": (lambda: path_deviation(BEND, [BEND] * 10, corners=2), InvalidValueError, "within 2000 mm of a"),
    "angles": (
        lambda: path_deviation(LINE, [Trace(positions=LINE.positions, angles=((0,), (0,)))] * 10),
        ShapeError,
        "path and runs need the same angles, got 0 and 1",
    ),
    "space": (
        lambda: path_deviation(LINE, [Trace(positions=((0, 0, 0), (1, 0, 0)))] * 10),
        ShapeError,
        "the same columns, got 2 and 3",
    ),
    "no times": (lambda: path_velocity(LINE, [RUN] * 10, 1), InvalidValueError, "needs the time of every sample"),
    "no speed": (
        lambda: path_velocity(LINE, [TIMED] * 10, 0),
        InvalidValueError,
        "velocity: the commanded speed: expected more than 0 m/s, got 0",
    ),
    "part": (lambda: path_velocity(LINE, [TIMED] * 10, 1, part=(1, 0)), InvalidValueError, "a part within 0 to 1"),
    "no corner": (
        lambda: corner_deviations(LINE, [RUN] * 3),
        InvalidValueError,
        "has no change of direction by more than 20 deg",
    ),
    "before the corner": (
        lambda: corner_deviations(BEND, [Trace(positions=((0, 0), (0.9, -0.1)))] * 3),
        InvalidValueError,
        "run 1 has no sample on the leg after the corner at 1000 mm",
    ),
    "inside": (lambda: settling([TIMED] * 3, 5.0), InvalidValueError, "run 1 begins within 5000 mm of its end"),
    "no band": (
        lambda: settling([STANDSTILL] * 3, 0),
        InvalidValueError,
        "settling: band: expected more than 0 m, got 0",
    ),
    "no rest": (
        lambda: settling([Trace(positions=((0, 0), (5, 0), (0, 0), (1, 0)), times=(0, 1, 9.5, 10))] * 3, 0.1),
        InvalidValueError,
        "still more than 100 mm away in the last tenth",
    ),
    "time back": (
        lambda: Trace(positions=((0, 0), (1, 0)), times=(1, 1)),
        InvalidValueError,
        "each must be later than the one before, got 1 after 1",
    ),
    "one sample": (lambda: Trace(positions=((0, 0),)), ShapeError, "expected at least two samples, got 1"),
    "rows": (lambda: Trace(positions=((0, 0), (1, 0)), times=(1,)), ShapeError, "2 positions but 1 times"),
    "no weave": (lambda: weaving_deviation(LINE, [TIMED] * 3, 1), InvalidValueError, "a straight line, not a weave"),
    "back": (lambda: weaving_deviation(SQUARE, [TIMED] * 3, 1), InvalidValueError, "it has no centre line"),
    "no reversals": (
        lambda: weaving_deviation(BEND, [TIMED] * 3, 1),
        InvalidValueError,
        "the commanded path reverses 2 times; expected at least three reversals",
    ),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_mistakes(name: str) -> None:
    """What cannot be measured is refused, with the run and the position."""
    call, kind, message = MISTAKES[name]

    with pytest.raises(kind) as caught:
        call()

    assert message in str(caught.value)
