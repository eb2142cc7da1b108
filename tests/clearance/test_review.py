"""What a stranger tried: odd samples, singular positions, diverging runs, sweeps of other linkages."""

import json
from pathlib import Path

import attrs
import numpy as np
import pytest

from armwright.clearance import simulation
from armwright.clearance.assessment import ClearanceRun
from armwright.clearance.correction import correct_nodes, tip_positions
from armwright.clearance.estimation.measurement_file import (
    PathMeasurement,
    RestMeasurement,
    read_clearance_measurements,
)
from armwright.clearance.estimation.static_estimate import closed_at_poses, estimate_at_rest, rest_matrix
from armwright.clearance.feature_sweep import FeatureSweep, is_sweep_of
from armwright.clearance.features import spectrum
from armwright.clearance.ideal import tip_sensitivity
from armwright.clearance.linkage import Linkage
from armwright.clearance.paths import PickAndPlace, thesis_path
from armwright.clearance.reader import load_linkage
from armwright.clearance.scenario import prepare_scenario
from armwright.clearance.settings import Settings
from armwright.clearance.simulation import Status, simulate
from armwright.errors import FileFormatError, InvalidValueError

# Sums of a few doubles.
ROUNDING = 1e-12
POSES = ((-0.15, -0.7), (-0.05, -0.7), (0.15, -0.7))


class TestSamples:
    """Samples are as far apart as is asked for, in whole steps, and the last one is at the end."""

    @pytest.mark.parametrize("sample", [1e-4, 3.3e-4, 7e-3, 0.13, 10.0])
    def test_end(self, five_bar: Linkage, sample: float) -> None:
        """Whatever time lies between samples, the steps are no longer than asked for and the last ends the path."""
        task = prepare_scenario(five_bar, thesis_path("y1"), Settings(step=2e-5, sample=sample))

        assert task.steps % task.stride == 0
        assert task.h <= 2e-5 * (1 + ROUNDING)
        assert task.steps * task.h == pytest.approx(0.25, abs=ROUNDING)

    def test_seldom(self, five_bar: Linkage) -> None:
        """Two samples of a run are its first and its last: the tip ends where it does with many."""
        path = thesis_path("y1")
        often, seldom = (
            simulate(prepare_scenario(five_bar, path, Settings(step=2e-5, sample=target))) for target in (2e-5, 10.0)
        )

        np.testing.assert_array_equal(seldom.time, [0.0, often.time[-1]])
        np.testing.assert_array_equal(seldom.tip, often.tip[[0, -1]])
        np.testing.assert_allclose(tip_positions(seldom, np.array([0.0, 0.25])), seldom.tip, atol=ROUNDING)
        assert [target["time"] for target in ClearanceRun.of(seldom).as_data()["targets"]] == pytest.approx(
            [0.0, 0.25], abs=ROUNDING
        )


class TestDiverging:
    """A run that diverges is reported as such, in numbers that JSON knows."""

    def test_numbers(self, five_bar: Linkage, monkeypatch: pytest.MonkeyPatch) -> None:
        """With a step ten times too long a run diverges without a warning; what is shown of it is finite."""
        monkeypatch.setattr(simulation, "check_step", lambda *_: None)
        run = simulate(prepare_scenario(five_bar, thesis_path("y1"), Settings(step=2e-4, sample=2e-4)), [1e-4] * 3)
        data = ClearanceRun.of(run).as_data()

        assert run.status == Status.DIVERGED
        assert data["sound_until"] < 0.25
        json.dumps(data, allow_nan=False)

    def test_advice(self, five_bar: Linkage) -> None:
        """The step that is advised instead of one that is too long is one that is accepted."""
        for clearance in np.geomspace(1e-6, 1e-2, 9):
            task = prepare_scenario(five_bar, thesis_path("y1"), Settings(step=2e-4, sample=0.1))
            with pytest.raises(InvalidValueError, match="too long") as error:
                simulate(task, [clearance] * 3)
            advised = float(str(error.value).split("at most ")[1].split(" ")[0])

            simulation.check_step(
                five_bar, Settings(step=advised), simulation.contact_stiffness(five_bar, np.full(3, clearance))
            )


class TestNothingToLean:
    """Where a pin carries no force, or a linkage is singular, no number comes out, and no traceback."""

    def test_weightless(self, five_bar: Linkage) -> None:
        """Without gravity and load nothing presses a journal to its wall: the tip at rest determines nothing."""
        floating = attrs.evolve(five_bar, gravity=(0.0, 0.0), loads=())

        with pytest.raises(InvalidValueError, match="pin J2 of five-bar carries no force at rest"):
            rest_matrix(floating, closed_at_poses(floating, POSES))
        with pytest.raises(InvalidValueError, match="carries no force"):
            estimate_at_rest(floating, POSES, np.zeros((3, 2)))

    def test_singular(self, five_bar: Linkage) -> None:
        """Both rods in one line hold the tip nowhere: how it shifts with the gaps is not told."""
        q = np.zeros(len(five_bar.coordinates))

        with pytest.raises(InvalidValueError, match="singular"):
            tip_sensitivity(five_bar, q)

    @pytest.mark.parametrize(("name", "freedoms"), [("four-bar", "1 freedom,"), ("slider-crank", "1 freedom,")])
    def test_freedoms(self, name: str, freedoms: str) -> None:
        """A linkage of one freedom cannot follow a position in the plane, and hears how many freedoms it has."""
        with pytest.raises(InvalidValueError, match=f"with its pins closed it has {freedoms}"):
            rest_matrix(load_linkage(name), closed_at_poses(load_linkage(name), POSES))

    @pytest.mark.parametrize("noise", [0.0, -1e-6, np.inf, np.nan])
    def test_noise(self, five_bar: Linkage, noise: float) -> None:
        """A measurement has a noise above 0 that is a number."""
        with pytest.raises(InvalidValueError, match="noise"):
            estimate_at_rest(five_bar, POSES, np.zeros((3, 2)), noise)


def test_rounds(five_bar: Linkage) -> None:
    """A path cannot be moved fewer than no times."""
    with pytest.raises(InvalidValueError, match="rounds: expected 0 to 100, got -1"):
        correct_nodes(five_bar, PickAndPlace(), [5e-4] * 3, rounds=-1)


def test_dwell(tmp_path: Path) -> None:
    """How long a tip rests after its path changes no feature, and half of a path is none."""
    way, file = thesis_path("y1"), tmp_path / "paths.csv"

    def written(end: float) -> Path:
        times = np.arange(0.0, end, 1e-3)
        positions = way.evaluate(times).position * 1e3 + times[:, None]
        rows = (f"y1,{t:.4f},{x:.9f},{y:.9f}" for t, (x, y) in zip(times, positions, strict=True))
        file.write_text("\n".join(["path,t_s,x_mm,y_mm", *rows]), encoding="utf-8")
        return file

    short, long = (read_clearance_measurements(written(end)) for end in (0.2505, 2.0))
    assert isinstance(short, PathMeasurement)
    assert isinstance(long, PathMeasurement)
    assert len(short.times["y1"]) == 251
    np.testing.assert_array_equal(long.features()["y1"], short.features()["y1"])
    with pytest.raises(FileFormatError, match=r"path y1 takes 0\.25 s; got 0 to 0\.229 s"):
        read_clearance_measurements(written(0.23))


def test_absurd_reading(tmp_path: Path) -> None:
    """A number whose square no computer holds is no play, and no warning either."""
    file = tmp_path / "rest.csv"
    file.write_text("pose,commanded_x_mm,commanded_y_mm,x_mm,y_mm\na,0,-700,1e307,-700\n", encoding="utf-8")

    with pytest.raises(FileFormatError, match="every number must be finite and no larger than"):
        read_clearance_measurements(file)


def test_gains() -> None:
    """A controller has two gains: a kernel that was handed one would read beside it."""
    with pytest.raises(InvalidValueError, match="gains: expected stiffness and damping, got 1"):
        Settings(control="pd+ff", gains=(200.0,))  # type: ignore[arg-type]


def test_other_linkage(five_bar: Linkage) -> None:
    """A sweep is one of the linkage it was made of, whatever its own clearances, and of no other."""
    stored = json.loads(json.dumps(FeatureSweep(linkage=five_bar, paths=("y1",)).settings))

    assert is_sweep_of(stored, five_bar)
    assert is_sweep_of(stored, five_bar.with_clearances({"J2": 0.1e-3}))
    assert not is_sweep_of(stored, load_linkage("four-bar"))
    assert not is_sweep_of(stored, attrs.evolve(five_bar, loads=()))
    assert not is_sweep_of({}, five_bar)


def test_fastest_wave() -> None:
    """A curve that goes up and down by a from one sample to the next is a wave of amplitude a."""
    curve = 0.3 * (-1.0) ** np.arange(64) + 2.0

    np.testing.assert_allclose(spectrum(curve)[[0, -1]], [4.0, 0.3], atol=ROUNDING)


def test_uneven_readings(tmp_path: Path) -> None:
    """The means of poses are as sure as that of the pose with the fewest readings: of one, no surer than a reading."""
    rng = np.random.default_rng(3)
    lines = ["pose,commanded_x_mm,commanded_y_mm,x_mm,y_mm"]
    for name, count in (("a", 1), ("b", 2000), ("c", 2000)):
        lines += [f"{name},0,-700,{x:.9f},{y:.9f}" for x, y in (0.01 * rng.standard_normal((count, 2)) + (0, -700))]
    file = tmp_path / "rest.csv"
    file.write_text("\n".join(lines), encoding="utf-8")
    measurement = read_clearance_measurements(file)

    assert isinstance(measurement, RestMeasurement)
    # The deviation of 8000 numbers is told to about a hundredth.
    assert measurement.noise == pytest.approx(1e-5, rel=0.05)
