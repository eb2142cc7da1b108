"""``armwright calibrate`` and ``armwright plan-poses`` as a user calls them."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.calibration.chain import kinematic_chain
from armwright.kinematics.forward_kinematics import forward
from armwright.report.elements import length_text
from cli_calls import armwright

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

ARM = "puma560"


@pytest.fixture(scope="module")
def planned(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Poses as ``plan-poses`` writes them."""
    path = tmp_path_factory.mktemp("plan") / "poses.csv"
    done = armwright("plan-poses", ARM, "-n", "40", "-o", path)
    assert done.returncode == 0, done.stderr
    assert "40 poses make 21 errors identifiable" in done.stdout
    return path


@pytest.fixture(scope="module")
def measured(planned: Path) -> Path:
    """The poses with the points that an arm with errors has there."""
    rng = np.random.default_rng(3)
    chain = kinematic_chain(load_arm(ARM))
    head, *rows = planned.read_text(encoding="utf-8").splitlines()
    q = np.radians([[float(x) for x in row.split(",")] for row in rows])
    errors = np.where(chain.is_length, 5e-4, 2e-3) * rng.standard_normal(len(chain.names))
    # Which a table cannot hold.
    errors[["beta" in name for name in chain.names]] = 0.0
    points = chain.forward(q, errors).position + 5e-5 * rng.standard_normal((len(q), 3))
    lines = [f"{row},{','.join(f'{x * 1e3:.5f}' for x in point)}" for row, point in zip(rows, points, strict=True)]
    path = planned.with_name("measured.csv")
    path.write_text("\n".join([f"{head},x_mm,y_mm,z_mm", *lines]) + "\n", encoding="utf-8")
    return path


def test_calibrate(measured: Path, tmp_path: Path) -> None:
    """Errors and what cannot be told are printed; the arm that is written has its tool where it was measured."""
    done = armwright("calibrate", ARM, measured, "-o", tmp_path / "out", "--folds", "4", columns=120)

    assert done.returncode == 0, done.stderr
    assert "redundant: it has the same effect as base.rz" in done.stdout
    files = {path.name for path in (tmp_path / "out").iterdir()}
    tables = {"dh_standard.csv", "dh_modified.csv", "dh_hayati.csv"}
    assert files == {
        "arm.toml",
        "arm.urdf",
        "errors.json",
        "report.html",
        "residuals.svg",
        "distances.svg",
        "run.json",
        *tables,
    }
    rows = np.loadtxt(measured, delimiter=",", skiprows=1)
    better = load_arm(tmp_path / "out" / "arm.toml")
    off = np.linalg.norm(forward(better, np.radians(rows[:, :6]))[:, :3, 3] * 1e3 - rows[:, 6:], axis=1)
    said = np.linalg.norm(forward(load_arm(ARM), np.radians(rows[:, :6]))[:, :3, 3] * 1e3 - rows[:, 6:], axis=1)
    assert off.mean() < 0.2
    assert said.mean() > 1.0
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert page.count("<figure>") == 2
    assert "http://" not in page
    assert "https://" not in page
    told = json.loads((tmp_path / "out" / "errors.json").read_text(encoding="utf-8"))
    before, after = (told["distances"][name]["mean"] for name in ("nominal, base best-fitted", "calibrated, held out"))
    tiles = re.findall(r'<li class="figure"><b>([^<]*)</b>', page)
    assert tiles[:2] == [length_text(before), f"→ {length_text(after)}"]
    assert before > 20 * after
    # A plain fact is no warning, and what lies beside the page is linked.
    assert '<li class="warning">' not in page
    assert f"<li>{len(told['errors'])} errors fitted to 40 readings" in page
    assert set(re.findall(r'<a href="([^"]*)" download>', page)) == files - {"report.html", "run.json"}
    # Errors that may be none are faded, and only those.
    faded = re.findall(r'<tr class="faded"><td>([^<]*)', page)
    errors = told["errors"].items()
    assert faded
    assert set(faded) == {name for name, error in errors if abs(error["value"]) < 2 * error["standard_error"]}


def test_a_reading_that_is_off(measured: Path, tmp_path: Path) -> None:
    """A reading whose residual stands out is named, in the terminal, in the data and as a warning on the page."""
    head, *rows = measured.read_text(encoding="utf-8").splitlines()
    *cells, z = rows[16].split(",")
    rows[16] = ",".join([*cells, f"{float(z) + 0.3:.5f}"])
    path = tmp_path / "off.csv"
    path.write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")

    done = armwright("calibrate", ARM, path, "-o", tmp_path / "out", columns=300)

    assert done.returncode == 0, done.stderr
    told = json.loads((tmp_path / "out" / "errors.json").read_text(encoding="utf-8"))
    assert (told["outliers"], told["remarkable"]) == ([], [16])
    (note,) = (note for note in told["notes"] if "noise explains" in note)
    assert ": 18 (0." in note
    assert note in done.stdout
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert re.findall(r'<li class="warning"><b>Note</b>([^<]*)', page) == [note]
    data = json.loads(re.search(r'id="data">(.*?)</script>', page)[1])
    assert data["marked"] == [16]
    assert data["said"][16].startswith("18: 0.")


def test_json(measured: Path) -> None:
    """The same as data: every error with its standard error, the covariance, why the others are fixed."""
    told = json.loads(armwright("calibrate", ARM, measured, "--json", "--folds", "3").stdout)

    assert set(told["errors"]) | set(told["fixed"]) == set(kinematic_chain(load_arm(ARM)).names)
    deviations = [one["standard_error"] for one in told["errors"].values()]
    np.testing.assert_allclose(np.sqrt(np.diag(told["covariance"])), deviations, rtol=1e-9)
    assert told["distances"]["calibrated, held out"]["mean"] < 3e-4


@pytest.mark.parametrize(
    ("arguments", "status", "says"),
    [
        (("calibrate", "pumma560", "MEASURED"), 2, "Did you mean 'puma560'?"),
        (("calibrate", "ur5", "MEASURED"), 3, "are these its joints"),
        (("calibrate", ARM, "MEASURED", "--noise-um", "0"), 2, "noise: expected more than 0 m"),
        (("calibrate", "ntu-3r", "MEASURED"), 4, "joint_4_deg"),
        (("calibrate", ARM, "nowhere.csv"), 4, "nowhere.csv"),
        (("calibrate", ARM, "MEASURED", "--tool-mm", "0,0"), 2, "expected 3 finite numbers, got 2: 0,0"),
        (("calibrate", ARM, "MEASURED", "--units", "mm"), 2, "such as mm,deg"),
        (("calibrate", ARM, "MEASURED", "--folds", "1"), 2, "folds: expected 2 to 40"),
        (("calibrate", ARM, "MEASURED", "--seed", "-1"), 2, "greater than or equal to 0"),
        (("plan-poses", ARM, "--seed", "-1"), 2, "greater than or equal to 0"),
        (("plan-poses", ARM, "-n", "4"), 2, "poses or more, got 4"),
        (("plan-poses", ARM, "--index", "O7"), 2, "'O7' is not one of 'O1', 'O2', 'O3', 'O4', 'O5'"),
    ],
)
def test_mistakes(measured: Path, arguments: tuple[str, ...], status: int, says: str) -> None:
    """A mistake is told in a line, without a traceback."""
    done = armwright(*(str(measured) if one == "MEASURED" else one for one in arguments), columns=200)

    assert done.returncode == status
    assert says in done.stderr
    assert "Traceback" not in done.stderr


def test_too_few_readings(measured: Path, tmp_path: Path) -> None:
    """Fewer readings than tell the errors are no wrong call: it cannot be done, status 3."""
    few = tmp_path / "few.csv"
    few.write_text("".join(measured.read_text(encoding="utf-8").splitlines(keepends=True)[:6]), encoding="utf-8")

    done = armwright("calibrate", ARM, few)

    assert done.returncode == 3
    assert "5 readings give 15 numbers" in done.stderr


def coupled(path: Path, share: float) -> Path:
    """Write readings of a ur5 whose joint 3 follows joint 2, which moves in this share of them."""
    rng = np.random.default_rng(8)
    arm, count = load_arm("ur5"), 90
    q = rng.uniform(-1.2, 1.2, (count, 6)) + np.array((0.0, -1.0, 0.8, 0.0, 0.6, 0.0))
    q[: round((1 - share) * count), 1] = -1.0
    true = q.copy()
    true[:, 2] += 0.5 * (q[:, 1] + 1.0)
    points = forward(arm, true)[:, :3, 3] + rng.normal(0.0, 5e-5, (count, 3))
    head = ",".join([*(f"joint_{i}_deg" for i in range(1, 7)), "x_mm", "y_mm", "z_mm"])
    lines = [",".join(f"{x:.6f}" for x in (*np.degrees(a), *(1e3 * b))) for a, b in zip(q, points, strict=True)]
    path.write_text("\n".join([head, *lines]) + "\n", encoding="utf-8")
    return path


def test_coupled_joints_are_doubtful(tmp_path: Path) -> None:
    """Of a palletiser, q3 = a2 q2 + q3, that hardly moved joint 2 all is told and written, with status 3 and why."""
    path = coupled(tmp_path / "coupled.csv", 0.3)
    data = armwright("calibrate", "ur5", path, "-o", tmp_path / "out", "--json", "--folds", "3", columns=200)

    assert data.returncode == 3
    assert "armwright: the measurements contradict the arm: " in data.stderr
    assert "coupled to another (q3 = a2 q2 + q3" in data.stderr
    assert (tmp_path / "out" / "errors.json").exists()
    told = json.loads(data.stdout)
    assert told["notes"][0] == f"DOUBTFUL: {told['contradictions'][0]}"
    assert (told["exit_status"], told["error"]["class"]) == (3, "DoubtfulError")
    assert told["error"]["message"] == data.stderr.removeprefix("armwright: ").rstrip("\n")
    assert "in the position of joint 2, so that the residuals of the others" in told["contradictions"][0]


def test_coupled_joints_are_refused(tmp_path: Path) -> None:
    """Of a palletiser that moved joint 2 in all readings nothing is told but what to check; the status is 3."""
    done = armwright("calibrate", "ur5", coupled(tmp_path / "coupled.csv", 1.0), "-o", tmp_path / "out")

    assert done.returncode == 3
    assert "too large for any of its errors to be identifiable: are these its readings?" in done.stderr
    assert "coupled to another (q3 = a2 q2 + q3" in done.stderr
    assert not (tmp_path / "out").exists()


def test_stated_noise(measured: Path) -> None:
    """Readings with 50 µm of noise contradict an arm at once that is said to be read to 20 µm, and not to 50."""
    honest = armwright("calibrate", ARM, measured, "--noise-um", "50", "--folds", "2")
    sharp = armwright("calibrate", ARM, measured, "--noise-um", "20", "--folds", "2", columns=400)

    assert honest.returncode == 0, honest.stderr
    assert sharp.returncode == 3
    assert "times the stated 0.02 mm" in sharp.stderr
    assert "DOUBTFUL: the residuals have a standard deviation of" in sharp.stdout


def test_next_poses(measured: Path, tmp_path: Path) -> None:
    """Poses are planned beside those that were measured; with turns, fewer will do."""
    done = armwright("plan-poses", ARM, "-n", "2", "--after", measured, "-o", tmp_path / "more.csv")
    few = armwright("plan-poses", ARM, "-n", "8", "--orientations")

    assert done.returncode == 0, done.stderr
    assert len((tmp_path / "more.csv").read_text(encoding="utf-8").splitlines()) == 3
    assert few.returncode == 0, few.stderr
    assert "tool.rx" in few.stdout


def test_next_poses_without_units(measured: Path, tmp_path: Path) -> None:
    """What was measured already may lie in a file whose units are stated."""
    path = tmp_path / "bare.csv"
    text = measured.read_text(encoding="utf-8")
    path.write_text(text.replace("_deg", "").replace("_mm", ""), encoding="utf-8")

    refused = armwright("plan-poses", ARM, "-n", "2", "--after", path, columns=200)
    done = armwright("plan-poses", ARM, "-n", "2", "--after", path, "--units", "mm,deg")

    assert refused.returncode == 4
    assert "in the file or by --columns or --units" in refused.stderr
    assert done.returncode == 0, done.stderr


def test_a_frame_to_check_alone(measured: Path, tmp_path: Path) -> None:
    """Points to check with in a frame that no other point tells cannot be held against the arm; that is said."""
    head, *rows = measured.read_text(encoding="utf-8").splitlines()
    lines = [f"{row},{'b,check' if i < 10 else 'a,fit'}" for i, row in enumerate(rows)]
    path = tmp_path / "frames.csv"
    path.write_text("\n".join([f"{head},frame,set", *lines]) + "\n", encoding="utf-8")

    done = armwright("calibrate", ARM, path, columns=200)

    assert done.returncode == 2
    assert "frame b: no fitted reading locates it" in done.stderr


def test_beyond(measured: Path, tmp_path: Path) -> None:
    """What is tried beyond geometry is told with its numbers, kept or not, on the screen and on the page."""
    head, *rows = measured.read_text(encoding="utf-8").splitlines()
    some = tmp_path / "some.csv"
    marked = [f"{row},{'check' if i % 8 == 0 else 'fit'}" for i, row in enumerate(rows)]
    some.write_text("\n".join([f"{head},set", *marked, ""]), encoding="utf-8")
    done = armwright("calibrate", ARM, some, "--beyond", "--folds", "3", "-o", tmp_path / "out", columns=160)

    assert done.returncode == 0, done.stderr
    for words in (
        "joint compliance under gravity",
        "transmission error, second harmonic",
        "Gaussian process of the residuals",
    ):
        assert words in done.stdout
        assert words in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    told = json.loads((tmp_path / "out" / "errors.json").read_text(encoding="utf-8"))
    candidates = told["nongeometric"]["candidates"]
    assert {"non-geometric, held out", "non-geometric, check readings"} <= set(told["distances"])
    assert "neither the fit nor the selection of the model has used these points" in done.stdout
    assert [candidate["accepted"] for candidate in candidates] == [True, *[False] * 5]
