"""Files of measurements: what was written is read, and whatever is wrong with a file is reported with its line."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from armwright.arrays import Array
from armwright.clearance.estimation import measurement_file
from armwright.clearance.estimation.measurement_file import (
    PathMeasurement,
    RestMeasurement,
    read_clearance_measurements,
)
from armwright.clearance.estimation.static_estimate import rest_offsets
from armwright.clearance.features import error_curve_features
from armwright.clearance.linkage import Linkage
from armwright.clearance.paths import named_path, thesis_path
from armwright.clearance.reader import load_linkage
from armwright.errors import FileFormatError, IncompleteRowsWarning
from clearance.arms import ARM_A, STARTS, accuracy

# Of a metre, written with nine digits.
WRITTEN = 1e-9


def rest_file(path: Path, unit: str, scale: float, offsets: Array, order: Callable[[list[str]], list[str]]) -> Path:
    """Readings (k, r, 2) of offsets at the three starts, with the columns in some order."""
    names = order(["pose", f"commanded_x_{unit}", f"commanded_y_{unit}", f"x_{unit}", f"y_{unit}"])
    rows = [",".join(names)]
    for i, (pose, own) in enumerate(zip(STARTS, offsets, strict=True)):
        for offset in own:
            cells = [f"P{i}", *(f"{x * scale:.9f}" for x in (*pose, *(pose + offset)))]
            rows.append(",".join(order(cells)))
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize(("unit", "scale"), [("m", 1.0), ("mm", 1e3), ("um", 1e6)])
def test_rest_in_any_unit(unit: str, scale: float, tmp_path: Path, five_bar: Linkage) -> None:
    """Readings in metres, millimetres or micrometres, with the columns in any order, yield the same clearances."""
    offsets = rest_offsets(five_bar, STARTS, ARM_A)
    path = rest_file(tmp_path / "rest.csv", unit, scale, offsets[:, None], lambda cells: cells[::-1])

    measurement = read_clearance_measurements(path)

    assert isinstance(measurement, RestMeasurement)
    assert (measurement.names, measurement.readings, measurement.noise) == (("P0", "P1", "P2"), (1, 1, 1), None)
    np.testing.assert_allclose(measurement.poses, STARTS, rtol=0, atol=WRITTEN)
    np.testing.assert_allclose(measurement.offsets, offsets, rtol=0, atol=2 * WRITTEN)
    assert accuracy(measurement.estimate(five_bar).values, ARM_A) > 99.99


def test_repeated_readings(tmp_path: Path, five_bar: Linkage, rng: np.random.Generator) -> None:
    """Of repeated readings the mean counts, and their scatter is its noise."""
    sigma, count = 10e-6, 400
    noise = rng.normal(0.0, sigma, (3, count, 2))
    offsets = rest_offsets(five_bar, STARTS, ARM_A)[:, None] + noise

    measurement = read_clearance_measurements(rest_file(tmp_path / "rest.csv", "mm", 1e3, offsets, list))

    assert isinstance(measurement, RestMeasurement)
    assert measurement.readings == (count,) * 3
    np.testing.assert_allclose(measurement.offsets, offsets.mean(axis=1), rtol=0, atol=WRITTEN)
    assert measurement.noise == pytest.approx(sigma, rel=0.1)
    own, wider = measurement.estimate(five_bar), measurement.estimate(five_bar, 4 * sigma)
    np.testing.assert_allclose(wider.deviations / own.deviations, 4.0, rtol=0.1)


def path_rows(noise: Array | None = None, name: str = "y1", unit: str = "mm", seconds: str = "s") -> list[str]:
    """A run along a path with an error of 0.3 and -0.4 mm, every millisecond."""
    path = named_path(name)
    t = np.linspace(0.0, path.duration, round(path.duration / 1e-3) + 1)
    scale, tick = {"m": 1.0, "mm": 1e3}[unit], {"s": 1.0, "ms": 1e3}[seconds]
    positions = path.evaluate(t).position + (3e-4, -4e-4) + (0.0 if noise is None else noise)
    head = f"path,t_{seconds},x_{unit},y_{unit}"
    return [
        head,
        *(f"{name},{a * tick:.9g},{x * scale:.12g},{y * scale:.12g}" for a, (x, y) in zip(t, positions, strict=True)),
    ]


def written(path: Path, rows: list[str]) -> Path:
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize(("unit", "seconds"), [("mm", "s"), ("m", "ms")])
def test_paths(unit: str, seconds: str, tmp_path: Path) -> None:
    """Samples on two paths, in whatever units, are errors of half a millimetre with neither slope nor wave."""
    rows = [
        *path_rows(name="y1", unit=unit, seconds=seconds),
        "",
        *path_rows(name="x2", unit=unit, seconds=seconds)[1:],
    ]

    measurement = read_clearance_measurements(written(tmp_path / "paths.csv", rows))

    assert isinstance(measurement, PathMeasurement)
    assert list(measurement.errors) == ["y1", "x2"]
    np.testing.assert_allclose(measurement.errors["x2"], np.broadcast_to((3e-4, -4e-4), (291, 2)), rtol=0, atol=WRITTEN)
    simulation_features = measurement.features()["y1"]
    assert simulation_features.intercept == pytest.approx(5e-4, abs=WRITTEN)
    assert simulation_features.amp_dc == pytest.approx(1e-3, abs=WRITTEN)
    assert abs(simulation_features.slope) < 1e-7


def test_pick_and_place(tmp_path: Path) -> None:
    """The pick-and-place path can be measured too."""
    measurement = read_clearance_measurements(written(tmp_path / "paths.csv", path_rows(name="pick-and-place")))

    assert isinstance(measurement, PathMeasurement)
    assert measurement.times["pick-and-place"][-1] == pytest.approx(0.5)


def test_noise_of_features(tmp_path: Path, rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch) -> None:
    """What noise of the samples does to the features is what many noisy runs show."""
    measurement = read_clearance_measurements(written(tmp_path / "paths.csv", path_rows()))
    assert isinstance(measurement, PathMeasurement)
    names, noise = ("y1_intercept", "y1_slope", "y1_offset_x"), 10e-6

    monkeypatch.setattr(measurement_file, "_DRAWS", 800)
    covariance = measurement.feature_covariance(names, noise)

    error = measurement.errors["y1"]
    many = error_curve_features(measurement.times["y1"], error + noise * rng.standard_normal((800, *error.shape)))
    table = np.stack([many.intercept, many.slope, many.offset_x], axis=-1)
    # The standard deviation of a variance of 800 draws is 5 %.
    np.testing.assert_allclose(np.diag(covariance), table.var(axis=0, ddof=1), rtol=0.3)
    assert np.sqrt(covariance[2, 2]) == pytest.approx(noise, rel=0.1)
    # A line that is tilted up begins lower.
    assert covariance[0, 1] < 0
    np.testing.assert_array_equal(covariance, covariance.T)


REST_ROWS = ["pose,commanded_x_mm,commanded_y_mm,x_mm,y_mm", "P1,-150,-700,-150.1,-700.5", "P2,150,-700,150.1,-700.5"]


def changed(row: int, old: str, new: str) -> list[str]:
    assert old in REST_ROWS[row]
    return [*REST_ROWS[:row], REST_ROWS[row].replace(old, new), *REST_ROWS[row + 1 :]]


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ([], "the file is empty; expected column names in its first line"),
        (["", "  "], "the file is empty"),
        (REST_ROWS[:1], ": no rows after the column names"),
        (
            changed(0, "x_mm,y_mm", "x_m,y_m"),
            ":1: x_m: lengths must have one unit in a file, but commanded",
        ),
        (changed(0, ",y_mm", ",y_m"), ":1: y_m: lengths must have one unit in a file, but commanded_x_mm has another"),
        (
            changed(0, "commanded_x_mm", "comanded_x_mm"),
            "no such column. Did you mean 'commanded_x_mm'? Known: ",
        ),
        (changed(0, ",x_mm", ",x_inch"), ":1: x_inch: unknown unit 'inch': expected x_mm or x_m or"),
        (changed(0, ",x_mm", ",x"), ":1: x: the name has no unit: expected x_mm or x_m or"),
        (changed(0, ",x_mm", ",y_mm"), ":1: y_mm: a second column for this quantity, after y_mm"),
        (["pose,x_mm,y_mm", "P1,0,0"], ":1: commanded_x_mm: no such column; there are pose, x_mm, y_mm"),
        (
            ["commanded_x_mm,commanded_y_mm,x_mm,y_mm", "0,0,0,0"],
            ":1: pose: expected a column pose or a column path",
        ),
        (["a,b", "1,2"], ":1: a: no such column. Known: pose, path, t_s, commanded_x_mm"),
        (changed(2, ",150.1", ""), ":3: expected 5 values, one per column, got 4"),
        (changed(1, "-150.1", "-150,1"), ":2: expected 5 values, one per column, got 6; does a number contain a comma"),
        (changed(2, "150.1", "nan"), ":3: x_mm: every number must be finite and no larger than 1e+100, got nan"),
        (changed(2, "150.1", "inf"), ":3: x_mm: every number must be finite and no larger than 1e+100, got inf"),
        (changed(2, "150.1", "-"), ":3: x_mm: expected a number, got '-'"),
        ([*REST_ROWS, "P1,-140,-700,-140.1,-700.5"], ":2: P1: this pose is commanded at different positions"),
        ([row.replace("_mm", "_m") for row in REST_ROWS], "is 509.9 m from its commanded position"),
        (changed(2, "150.1", "-150.1"), ":3: P2: the tip is 300.1 mm from its commanded position; are"),
        (changed(1, "P1", ""), ":2: pose: empty; expected a name"),
        ([*REST_ROWS, "P1," + "7" * 200_000 + ",0,0,0"], "not valid CSV: field larger than field limit"),
    ],
)
def test_mistakes_at_rest(rows: list[str], message: str, tmp_path: Path) -> None:
    """Every mistake in a file of readings is reported with its line and what is expected."""
    if message.startswith("is 509.9"):
        # Metres by their names, millimetres by their numbers: half a millimetre has become half a metre.
        message = "the tip is 509.9 mm from its commanded position; are the units right"
    with pytest.raises(FileFormatError) as caught:
        read_clearance_measurements(written(tmp_path / "rest.csv", rows))
    assert message in str(caught.value)
    assert str(caught.value).startswith(str(tmp_path / "rest.csv"))


def path_slip(change: Callable[[list[str]], list[str]]) -> list[str]:
    return change(path_rows())


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        (path_slip(lambda rows: [row.replace("y1,", "y15,") for row in rows]), ":2: path: no path 'y15'. Did you mean"),
        (path_slip(lambda rows: [*rows[:100], *rows[101:]]), ":101: t_s: samples must be equally spaced in time"),
        (path_slip(lambda rows: [*rows[:50], rows[50], *rows[50:]]), "t_s: samples must be equally spaced in time"),
        (path_slip(lambda rows: [rows[0], *rows[:0:-1]]), "t_s: samples must be equally spaced in time"),
        (path_slip(lambda rows: rows[:12]), ":2: y1: expected 20 samples or more, got 11"),
        (path_slip(lambda rows: rows[:150]), ":2: t_s: path y1 takes 0.25 s; got 0 to 0.148 s"),
        (path_slip(lambda rows: [rows[0], *rows[60:]]), ":2: t_s: path y1 takes 0.25 s; got 0.059 to 0.25 s"),
        (path_slip(lambda rows: [rows[0].replace("t_s", "t_ms"), *rows[1:]]), "path y1 takes 0.25 s; got 0 to "),
        (path_slip(lambda rows: [rows[0].replace("mm", "m"), *rows[1:]]), "are the units right"),
        (
            path_slip(lambda rows: [rows[0].replace("x_mm", "x_m"), *rows[1:]]),
            ":1: y_mm: lengths must have one unit",
        ),
        (
            path_slip(lambda rows: [rows[0].replace("t_s", "t_mm"), *rows[1:]]),
            "mm is a unit of length: expected t_s",
        ),
        (path_slip(lambda rows: [rows[0], "y1,nan,1,1", *rows[2:]]), ":2: t_s: every number must be finite"),
        (
            path_slip(lambda rows: [row.replace("path,", "").replace("y1,", "") for row in rows]),
            "a column path, but the file has neither: t_s, x_mm",
        ),
    ],
)
def test_mistakes_on_paths(rows: list[str], message: str, tmp_path: Path) -> None:
    """Every mistake in a file of runs is reported: gaps, repeats, wrong units, a part of a path, an unknown path."""
    with pytest.raises(FileFormatError) as caught:
        read_clearance_measurements(written(tmp_path / "paths.csv", rows))
    assert message in str(caught.value)


def test_no_such_file(tmp_path: Path) -> None:
    """A file that does not exist is said not to be."""
    with pytest.raises(FileFormatError, match="no such file"):
        read_clearance_measurements(tmp_path / "none.csv")


def test_bytes_that_are_no_text(tmp_path: Path) -> None:
    """A picture is no table."""
    (tmp_path / "rest.csv").write_bytes(b"\x89PNG\r\n\xff\xfe\x00")
    with pytest.raises(FileFormatError):
        read_clearance_measurements(tmp_path / "rest.csv")


def test_spreadsheets(tmp_path: Path) -> None:
    """A spreadsheet's mark at the start of a file, and capitals or blanks in the names, do no harm."""
    text = "\ufeff" + "\r\n".join(["Pose , Commanded_X_mm,commanded_y_mm, X_MM,y_mm", *REST_ROWS[1:]])
    (tmp_path / "rest.csv").write_text(text, encoding="utf-8", newline="")

    measurement = read_clearance_measurements(tmp_path / "rest.csv")

    assert isinstance(measurement, RestMeasurement)
    np.testing.assert_allclose(measurement.offsets, [(-1e-4, -5e-4), (1e-4, -5e-4)], rtol=0, atol=WRITTEN)


def test_tracker_export(tmp_path: Path) -> None:
    """Nominal and measured columns, semicolons, decimal commas, other names and a gap, as an instrument writes them."""
    rows = ["Pkt;X nominal [mm];Y nominal [mm];X measured [mm];Y measured [mm]"]
    rows += [row.replace(",", ";").replace(".", ",") for row in [*REST_ROWS[1:], "P2,150,-700,,-700.5"]]

    with pytest.warns(
        IncompleteRowsWarning, match=r"1 row omitted because of empty cells, 2 read: X measured \[mm\] in line 4"
    ):
        measurement = read_clearance_measurements(
            written(tmp_path / "rest.csv", rows), columns={"pkt": "pose"}, skip_incomplete=True
        )

    assert isinstance(measurement, RestMeasurement)
    assert measurement.names == ("P1", "P2")
    np.testing.assert_allclose(measurement.offsets, [(-1e-4, -5e-4), (1e-4, -5e-4)], rtol=0, atol=WRITTEN)


def test_few_readings_make_intervals_wider() -> None:
    """The noise of six readings is itself uncertain: Student's t of six numbers reaches 1.94 deviations, not 1.64."""
    linkage, poses = load_linkage("five-bar"), np.array([(-0.15, -0.7), (-0.05, -0.7), (0.15, -0.7)])
    readings = RestMeasurement(
        names=("P1", "P2", "P3"),
        poses=poses,
        offsets=rest_offsets(linkage, poses, np.full(3, 3e-4)),
        readings=(2, 2, 2),
        noise=1e-6,
    )

    few, known = readings.estimate(linkage), readings.estimate(linkage, noise=1e-6)

    np.testing.assert_allclose(np.ptp(few.interval(0.9), axis=-1) / few.deviations / 2, 1.943, atol=1e-3)
    np.testing.assert_allclose(np.ptp(known.interval(0.9), axis=-1) / known.deviations / 2, 1.645, atol=1e-3)


def test_unknown_noise_is_what_is_left(rng: np.random.Generator) -> None:
    """Of single readings without --noise-um the residual is the noise: intervals hold the truth."""
    linkage, true = load_linkage("five-bar"), np.array((3e-4, 2e-4, 4e-4))
    poses = np.column_stack([rng.uniform(-0.18, 0.18, 12), rng.uniform(-0.7, -0.5, 12)])
    offsets = rest_offsets(linkage, poses, true) + rng.normal(0.0, 2e-5, poses.shape)
    names = tuple(map(str, range(12)))

    result = RestMeasurement(names=names, poses=poses, offsets=offsets, readings=(1,) * 12, noise=None).estimate(
        linkage
    )

    assert result.noise == pytest.approx(2e-5, rel=0.5)
    assert result.noise_freedom == 21
    low, high = result.interval(0.999).T
    assert np.all((low <= true) & (true <= high))


def test_rest_behind_the_path_changes_no_feature(tmp_path: Path) -> None:
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


def test_number_too_large_to_square(tmp_path: Path) -> None:
    """A number whose square no computer holds is no play, and no warning either."""
    file = tmp_path / "rest.csv"
    file.write_text("pose,commanded_x_mm,commanded_y_mm,x_mm,y_mm\na,0,-700,1e307,-700\n", encoding="utf-8")

    with pytest.raises(FileFormatError, match="every number must be finite and no larger than"):
        read_clearance_measurements(file)


def test_noise_of_uneven_readings(tmp_path: Path) -> None:
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
