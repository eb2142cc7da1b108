"""Samples of random linkages: the same bits in this process, on workers, and after an interruption."""

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import attrs
import numpy as np
import pytest

from armwright.arrays import Array
from armwright.clearance.poses import closed_at_tips
from armwright.clearance.reader import load_linkage
from armwright.errors import InvalidValueError
from armwright.reliability.linkage_errors import RandomClearances, RandomLinkage
from armwright.reliability.tip_errors import sampled_tip_errors
from armwright.reliability.tip_samples import TipErrorTask, tip_samples
from armwright.sweep.machines import Machines
from armwright.sweep.progress import Progress
from armwright.sweep.results import load
from cli_calls import armwright, check_mistake
from samples import WHOLE
from sweep_tasks import Stop, stop_after

pytest.importorskip("xarray")

TIPS = [(-0.18, -0.6), (0.1, -0.5)]


def five_bar(**others: object) -> RandomLinkage:
    """Five-bars with random clearances at two poses."""
    clearances = RandomClearances(mean=np.array([0.328, 0.171, 0.483]) * 1e-3, covariance=np.eye(3) * 4e-10)
    linkage = load_linkage("five-bar")
    return RandomLinkage.at(linkage, closed_at_tips(linkage, TIPS), clearances, **others)  # type: ignore[arg-type]


def test_workers_and_interruptions_change_no_bit(tmp_path: Path) -> None:
    """A sample is the same in this process, on one worker, and begun on one and resumed on two."""
    random = five_bar(friction=True)
    task = attrs.evolve(random.task, block=16)
    z = np.random.default_rng(22).normal(size=(60, random.size))
    told: list[Progress] = []

    alone = tip_samples(task, z, seed=22)
    one = tip_samples(task, z, seed=22, machines=Machines(workers=1))
    with pytest.raises(Stop):
        tip_samples(task, z, seed=22, machines=Machines(workers=1, folder=tmp_path / "out", progress=stop_after(32)))
    two = tip_samples(task, z, seed=22, machines=Machines(workers=2, folder=tmp_path / "out", progress=told.append))

    assert told[0].resumed == 32
    for other in (one, two, random.equilibria(z), np.concatenate([random.equilibria(row[None]) for row in z])):
        np.testing.assert_array_equal(other, alone)
    with load(tmp_path / "out") as results:
        np.testing.assert_array_equal(results["error_y"], alone[..., 1])
        np.testing.assert_array_equal(results["x3"], z[:, 2])


def test_clearances_side_by_side_and_one_by_one() -> None:
    """Linkages that are solved together rest where each of them does by itself."""
    random = five_bar()
    z = np.random.default_rng(5).normal(size=(4, random.size))
    names = [f"{pin}.clearance" for pin in random.linkage.clearances]
    mean = random.linkage.with_clearances(
        dict(zip(random.linkage.clearances, random.clearances.mean.tolist(), strict=True))
    )

    single = sampled_tip_errors(mean, random.q, names, random.clearances.values(z) - random.clearances.mean)

    np.testing.assert_allclose(tip_samples(random.task, z, seed=5), single, rtol=0, atol=1e-12)


def test_linkage_without_equilibrium(tmp_path: Path) -> None:
    """A linkage without equilibrium is named by its number, and its neighbours keep their results."""

    def errors(numbers: Array) -> Array:
        if (numbers > 2.5).any():
            raise InvalidValueError("the loops do not close")
        return np.repeat(numbers[:, None], 2, axis=2)

    task = TipErrorTask(linkage="two bars", poses=1, errors=errors, settings={})
    numbers = np.arange(4.0)[:, None]
    with pytest.raises(InvalidValueError, match="loops do not close"):
        tip_samples(task, numbers, seed=0)
    with pytest.raises(InvalidValueError, match="random linkage 4 of 4: the loops do not close"):
        tip_samples(task, numbers, seed=0, machines=Machines(workers=1, folder=tmp_path / "out"))
    with load(tmp_path / "out") as results:
        assert results["error_x"].to_numpy()[:3, 0].tolist() == [0.0, 1.0, 2.0]


AT = ("--pose", "-180,-600", "--samples", "5")
TOLERANCES = Path(__file__).parents[2] / "examples" / "five_bar_tolerances.toml"


@pytest.mark.parametrize(
    "call", [("reliability", "five-bar", *AT, "--limit", "0.9"), ("tolerance", "five-bar", str(TOLERANCES), *AT)]
)
def test_commands(call: tuple[str, ...], tmp_path: Path) -> None:
    """Both commands print the same with workers, keep the samples for the next call, and mix them with no others."""
    sweep = ("--workers", "1", "-o", tmp_path / "out", "--json")
    alone, first = armwright("clearance", *call, "--json"), armwright("clearance", *call, *sweep)
    (block,) = (tmp_path / "out" / "samples" / "blocks").iterdir()
    written = block.stat().st_mtime_ns
    again = armwright("clearance", *call, *sweep)
    other = armwright("clearance", *call, *sweep, "--seed", "1")

    assert json.loads(again.stdout) == json.loads(first.stdout) == json.loads(alone.stdout)
    assert block.stat().st_mtime_ns == written
    assert other.returncode == 3
    assert "contains another sweep" in other.stdout


def test_missing_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the extra the command works in one process, and with workers it says what to install."""
    monkeypatch.setitem(sys.modules, "xarray", None)
    call = ("clearance", "reliability", "five-bar", *AT, "--limit", "0.9")

    assert armwright(*call).returncode == 0
    check_mistake(*call, "--workers", "2", said="pip install 'armwright[sweep]'", folder=tmp_path)


@pytest.mark.proof
@pytest.mark.skipif(not WHOLE, reason="takes ten seconds; `make proof` runs it")
def test_killed_command(tmp_path: Path) -> None:
    """A command that was killed goes on with the samples that it has finished."""
    call = ("clearance", "reliability", "five-bar", "--pose", "-180,-600", "--limit", "0.9", "--json")
    call = (*call, "--sd", "link2.length=0.01", "--samples", "300", "--workers", "2")
    blocks = tmp_path / "out" / "samples" / "blocks"
    command = [sys.executable, "-m", "armwright", *call, "-o", str(tmp_path / "out")]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL) as process:
        while not list(blocks.glob("*.npy")) and process.poll() is None:
            time.sleep(0.01)
        process.send_signal(signal.SIGKILL)
    kept = {path.name: path.stat().st_mtime_ns for path in blocks.glob("*.npy")}

    done = armwright(*call, "-o", tmp_path / "out")

    assert 1 <= len(kept) < 5
    assert {name: (blocks / name).stat().st_mtime_ns for name in kept} == kept
    assert json.loads(done.stdout) == json.loads(armwright(*call).stdout)
