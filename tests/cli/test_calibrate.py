"""``armwright calibrate`` and ``armwright plan-poses`` as a user calls them."""

import json
from pathlib import Path

import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.calibration.chain import chain_of
from armwright.kinematics.forward import forward
from cli_calls import armwright

ARM = "puma560"


@pytest.fixture(scope="module")
def planned(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Poses as ``plan-poses`` writes them."""
    path = tmp_path_factory.mktemp("plan") / "poses.csv"
    done = armwright("plan-poses", ARM, "-n", "40", "-o", path)
    assert done.returncode == 0, done.stderr
    assert "40 poses of puma560 tell 21 errors" in done.stdout
    return path


@pytest.fixture(scope="module")
def measured(planned: Path) -> Path:
    """The poses with the points that an arm with errors has there."""
    rng = np.random.default_rng(3)
    chain = chain_of(load_arm(ARM))
    head, *rows = planned.read_text(encoding="utf-8").splitlines()
    q = np.radians([[float(x) for x in row.split(",")] for row in rows])
    errors = np.where(chain.is_length, 5e-4, 2e-3) * rng.standard_normal(len(chain.names))
    # Which a table cannot hold.
    errors[["beta" in name for name in chain.names]] = 0.0
    points = chain.reach(q, errors).position + 5e-5 * rng.standard_normal((len(q), 3))
    lines = [f"{row},{','.join(f'{x * 1e3:.5f}' for x in point)}" for row, point in zip(rows, points, strict=True)]
    path = planned.with_name("measured.csv")
    path.write_text("\n".join([f"{head},x_mm,y_mm,z_mm", *lines]) + "\n", encoding="utf-8")
    return path


def test_calibrate(measured: Path, tmp_path: Path) -> None:
    """Errors and what cannot be told are printed; the arm that is written has its tool where it was measured."""
    done = armwright("calibrate", ARM, measured, "-o", tmp_path / "out", columns=120)

    assert done.returncode == 0, done.stderr
    assert "it does just what base.rz does" in done.stdout
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
    assert page.count("<img ") == 2
    assert "http://" not in page
    assert "https://" not in page


def test_json(measured: Path) -> None:
    """The same as data: every error with its deviation, the covariance, why the others are held."""
    told = json.loads(armwright("calibrate", ARM, measured, "--json").stdout)

    assert set(told["errors"]) | set(told["held"]) == set(chain_of(load_arm(ARM)).names)
    deviations = [one["deviation"] for one in told["errors"].values()]
    np.testing.assert_allclose(np.sqrt(np.diag(told["covariance"])), deviations, rtol=1e-9)
    assert told["distances"]["calibrated, held out"]["mean"] < 3e-4


@pytest.mark.parametrize(
    ("arguments", "status", "says"),
    [
        (("calibrate", "pumma560", "MEASURED"), 2, "Did you mean 'puma560'?"),
        (("calibrate", "ur5", "MEASURED"), 2, "are these its joints"),
        (("calibrate", "ntu-3r", "MEASURED"), 4, "joint_4_deg"),
        (("calibrate", ARM, "nowhere.csv"), 4, "nowhere.csv"),
        (("calibrate", ARM, "MEASURED", "--tool-mm", "0,0"), 2, "expected 3 finite numbers, got 2: 0,0"),
        (("calibrate", ARM, "MEASURED", "--units", "mm"), 2, "such as mm,deg"),
        (("calibrate", ARM, "MEASURED", "--folds", "1"), 2, "folds: expected 2 to 40"),
        (("calibrate", ARM, "MEASURED", "--seed", "-1"), 2, "greater than or equal to 0"),
        (("plan-poses", ARM, "--seed", "-1"), 2, "greater than or equal to 0"),
        (("plan-poses", ARM, "-n", "4"), 2, "poses or more, got 4"),
        (("plan-poses", ARM, "--index", "O7"), 2, "no index 'O7'"),
    ],
)
def test_mistakes(measured: Path, arguments: tuple[str, ...], status: int, says: str) -> None:
    """A mistake is told in a line, without a traceback."""
    done = armwright(*(str(measured) if one == "MEASURED" else one for one in arguments), columns=200)

    assert done.returncode == status
    assert says in done.stderr
    assert "Traceback" not in done.stderr


def test_next_poses(measured: Path, tmp_path: Path) -> None:
    """Poses are planned beside those that were measured; with turns, fewer will do."""
    done = armwright("plan-poses", ARM, "-n", "2", "--after", measured, "-o", tmp_path / "more.csv")
    few = armwright("plan-poses", ARM, "-n", "6", "--turns")

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
    assert "or state the units" in refused.stderr
    assert done.returncode == 0, done.stderr


def test_a_frame_to_check_alone(measured: Path, tmp_path: Path) -> None:
    """Points to check with in a frame that no other point tells cannot be held against the arm; that is said."""
    head, *rows = measured.read_text(encoding="utf-8").splitlines()
    lines = [f"{row},{'b,check' if i < 10 else 'a,fit'}" for i, row in enumerate(rows)]
    path = tmp_path / "frames.csv"
    path.write_text("\n".join([f"{head},frame,set", *lines]) + "\n", encoding="utf-8")

    done = armwright("calibrate", ARM, path, columns=200)

    assert done.returncode == 2
    assert "frame b: no reading that is fitted tells where it is" in done.stderr


def test_beyond(measured: Path, tmp_path: Path) -> None:
    """What is tried beyond geometry is told with its numbers, kept or not, on the screen and on the page."""
    done = armwright("calibrate", ARM, measured, "--beyond", "-o", tmp_path / "out", columns=160)

    assert done.returncode == 0, done.stderr
    for words in ("joints that give under gravity", "gears, twice a turn", "what is left, learnt"):
        assert words in done.stdout
        assert words in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    tried = json.loads((tmp_path / "out" / "errors.json").read_text(encoding="utf-8"))["beyond"]["tried"]
    assert [one["kept"] for one in tried] == [True, False, False, False, False]
