"""``armwright identify`` as a user calls it."""

import json
from pathlib import Path

import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.arm.write import toml_text
from armwright.dynamics.payloads import payload
from armwright.errors import ExitStatus
from armwright.identification.log import Log
from cli_calls import armwright
from identification.simulated import log, truth

pytest.importorskip("clarabel", reason="the extra identification is not installed")

GAINS = np.array([12.0, 10.0, 9.0, 5.0, 4.0, 3.0])
LOAD = 2.5


def _write(path: Path, readings: Log, gains: np.ndarray | None = None) -> Path:
    effort = "tau" if gains is None else "current"
    heads = ["time_s", *(f"joint_{i}_deg" for i in range(1, 7)), *(f"{effort}{i}" for i in range(1, 7))]
    rows = np.column_stack([readings.t, np.degrees(readings.q), readings.effort / (1 if gains is None else gains)])
    np.savetxt(path, rows, delimiter=",", header=",".join(heads), comments="", fmt="%.9g")
    return path


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Logs of efforts and of currents, without and with a load, and the arm as it is."""
    folder, rng = tmp_path_factory.mktemp("logs"), np.random.default_rng(3)
    arm = truth()
    loaded = payload(arm, LOAD, (0.0, 0.02, 0.1))
    (folder / "true.toml").write_text(toml_text(arm), encoding="utf-8")
    return {
        "efforts": _write(folder / "efforts.csv", log(arm, rng)),
        "check": _write(folder / "check.csv", log(arm, rng, seconds=8.0)),
        "loaded": _write(folder / "loaded.csv", log(loaded, rng)),
        "currents": _write(folder / "currents.csv", log(arm, rng, sigma=0.01), GAINS),
        "loaded_currents": _write(folder / "loaded_currents.csv", log(loaded, rng, sigma=0.01), GAINS),
        "arm": folder / "true.toml",
    }


def test_identify_writes_an_arm_that_can_be_used(logs: dict[str, Path], tmp_path: Path) -> None:
    """The arm, its URDF, all numbers and a page are written; the arm is read back, and moves as the true one."""
    done = armwright(
        "identify", "puma560", logs["efforts"], "--check", logs["check"], "-o", tmp_path / "out", columns=120
    )

    assert done.returncode == 0, done.stderr
    assert "held out, arm file   check.csv" in done.stdout
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert names == {
        "arm.toml", "arm.urdf", "parameters.json", "efforts.svg", "residuals.svg", "report.html", "run.json",
    }  # fmt: skip
    identified = load_arm(tmp_path / "out" / "arm.toml")
    assert identified.motors[1].viscous == pytest.approx(3.0, rel=0.2)
    data = json.loads((tmp_path / "out" / "parameters.json").read_text(encoding="utf-8"))
    assert len(data["covariance"]) == len(data["base_parameters"]) < len(data["standard_parameters"])
    assert max(data["validation"][0]["relative"]) < 0.1
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert page.count("<figure>") == 2
    assert "https://" not in page


def test_blocks_of_the_log_are_held_out(logs: dict[str, Path]) -> None:
    """With --hold-out blocks the log validates itself, as one row of the table."""
    done = armwright("identify", "puma560", logs["efforts"], "--hold-out", "blocks", "--json")

    assert done.returncode == 0, done.stderr
    data = json.loads(done.stdout)
    (held_out,) = data["validation"]
    assert max(held_out["relative"]) < 0.1


def test_payload_of_a_known_arm(logs: dict[str, Path], tmp_path: Path) -> None:
    """With --payload the load alone is identified, and the arm with it is written."""
    done = armwright("identify", logs["arm"], logs["loaded"], "--payload", "-o", tmp_path / "out", "--json")

    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["mass"] == pytest.approx(LOAD, rel=0.01)
    last = load_arm(tmp_path / "out" / "loaded_arm.toml").links[-1]
    assert last.mass == pytest.approx(truth().links[-1].mass + LOAD, rel=0.01)


def test_gains_of_a_known_load(logs: dict[str, Path]) -> None:
    """Currents without and with a load of known mass give the gains, and with them the arm."""
    done = armwright(
        "identify", "puma560", logs["currents"], "--loaded", logs["loaded_currents"], "--load-mass", LOAD, "--json"
    )

    assert done.returncode == 0, done.stderr
    told = done.stderr.partition("per ampere: ")[2].split(", ")
    values, errors = np.array([[float(x) for x in each.split("±")] for each in told[:6]]).T
    assert (np.abs(values - GAINS) < 5 * errors).all()
    assert (errors[1:5] < 0.1 * GAINS[1:5]).all()


def test_mistakes_get_one_clear_line(logs: dict[str, Path]) -> None:
    """Currents without gains, a load without its log, and gains of too few joints are errors of usage."""
    done = armwright("identify", "puma560", logs["currents"])
    assert done.returncode == ExitStatus.USAGE
    assert "currents need gains" in done.stderr
    done = armwright("identify", "puma560", logs["currents"], "--loaded", logs["loaded_currents"])
    assert done.returncode == ExitStatus.USAGE
    assert "expected the known load" in done.stderr
    done = armwright("identify", "puma560", logs["currents"], "--gains", "1,2,3")
    assert done.returncode == ExitStatus.USAGE
    assert "--gains" in done.stderr
    for output in (done.stdout, done.stderr):
        assert "Traceback" not in output
