"""A sweep that is stopped: by a kill, a full disk, a damaged file; and who else may use its folder."""

import contextlib
import errno
import json
import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import attrs
import numpy as np
import pytest

from armwright.errors import ExitStatus, FileFormatError, OutputError
from armwright.sweep import folder as folder_module
from armwright.sweep.designs import Design, full_factorial
from armwright.sweep.errors import SweepError
from armwright.sweep.folder import lock_folder
from armwright.sweep.progress import Progress
from armwright.sweep.results import load
from armwright.sweep.runner import run
from armwright.sweep.task import Status
from sweep_tasks import Fall, Stop, calls_of, stop_after

pytest.importorskip("xarray")

SCRIPT = """
import sys
from pathlib import Path
from armwright.sweep.designs import full_factorial
from armwright.sweep.runner import run
from sweep_tasks import Fall

if __name__ == "__main__":
    design = full_factorial({"speed": range(40)}, units={"speed": "m/s"})
    task = Fall(calls=Path(sys.argv[2]), seconds=0.4)
    run(task, design, sys.argv[1], block=2, workers=int(sys.argv[3]))
"""


def until(true: Callable[[], Any], seconds: float = 240.0) -> None:
    """Wait for something."""
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end, "it did not come about"
        time.sleep(0.01)


def runs_on(process: int) -> bool:
    """Whether a process is alive; one that ended and was not asked for is not."""
    with contextlib.suppress(OSError):
        return Path(f"/proc/{process}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()[0] != "Z"
    return False


def blocks(out: Path) -> list[Path]:
    return sorted((out / "blocks").glob("???????.npy"))


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="asks Linux which processes are alive")
@pytest.mark.drawn(0.34)
@pytest.mark.parametrize(
    ("how", "workers"), [(signal.SIGKILL, 1), (signal.SIGKILL, 2), (signal.SIGTERM, 2), (signal.SIGINT, 2)]
)
def test_kill(how: signal.Signals, workers: int, speeds: Design, tmp_path: Path) -> None:
    """A sweep killed half-way goes on: nothing finished is lost or done twice, and no worker stays behind."""
    out, calls = tmp_path / "out", tmp_path / "calls"
    (tmp_path / "script.py").write_text(SCRIPT, encoding="utf-8")
    with subprocess.Popen(
        [sys.executable, tmp_path / "script.py", out, calls, str(workers)],
        env={"PYTHONPATH": ":".join(sys.path)},
        stderr=subprocess.DEVNULL,  # Python counts what a killed process had
        # A shell makes what it starts in the background deaf to Ctrl-C.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # noqa: PLW1509 - it takes no lock
    ) as process:
        until(lambda: len(blocks(out)) >= 3)
        # Meanwhile nobody else may use the folder.
        with pytest.raises(SweepError, match=f"'{out}' is in use: process {process.pid} on .* works on it"):
            run(Fall(), speeds, out, workers=1)
        process.send_signal(how)
    kept = [int(path.stem) for path in blocks(out)]
    until(lambda: not any(runs_on(worker) for worker, _ in calls_of(calls)))

    told: list[Progress] = []
    results = run(Fall(calls=calls), speeds, out, block=40, workers=1, progress=told.append)

    assert 3 <= len(kept) < 20
    assert told[0].resumed == 2 * len(kept)
    rows = [row for _, row in calls_of(calls)]
    for number in range(20):
        times = rows.count((2.0 * number, 2.0 * number + 1))
        assert times == 1 if number in kept else times in (1, 2)
    np.testing.assert_allclose(results.depth, 4.905 - np.arange(40.0))


def test_finished_sweep(speeds: Design, tmp_path: Path) -> None:
    """A finished sweep is not done again."""
    first = run(Fall(), speeds, tmp_path / "out", workers=1).load()
    told: list[Progress] = []

    again = run(Fall(calls=tmp_path / "calls"), speeds, tmp_path / "out", workers=1, progress=told.append)

    assert again.identical(first)
    assert not (tmp_path / "calls").exists()
    assert [(now.done, now.resumed) for now in told] == [(40, 40)]


@pytest.fixture
def half(speeds: Design, tmp_path: Path) -> Path:
    """A folder with three of five blocks."""
    with pytest.raises(Stop):
        run(Fall(), speeds, tmp_path / "out", block=8, workers=1, progress=stop_after(24))
    assert len(blocks(tmp_path / "out")) == 3
    return tmp_path / "out"


def test_unfinished_results(half: Path, tmp_path: Path) -> None:
    """Results are had of a sweep that is finished."""
    with pytest.raises(SweepError, match="the sweep is not finished; run it again to resume"):
        load(half)
    with pytest.raises(SweepError, match="the sweep does not exist"):
        load(tmp_path / "nowhere")


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-30])


def flip(path: Path) -> None:
    """Change one digit of a number, and nothing else."""
    rows = np.load(path)
    checksum = path.read_bytes()[-32:]
    rows["depth"][3] += 1e-12
    with path.open("wb") as file:
        np.save(file, rows)
        file.write(checksum)


def swap(path: Path) -> None:
    """The wrong block."""
    path.write_bytes(path.with_name("0000002.npy").read_bytes())


def change(path: Path) -> None:
    """A dimension of an array, where what is read is checked."""
    data = path.read_bytes()
    assert b"'shape': (8,)" in data
    path.write_bytes(data.replace(b"'shape': (8,)", b"'shape': (9,)", 1))


@pytest.mark.parametrize("damage", [cut, flip, swap, change, lambda path: path.write_bytes(b"")])
def test_damaged_block(damage: Callable[[Path], Any], half: Path, speeds: Design, tmp_path: Path) -> None:
    """A block that was damaged on the disk is named and stays as it is; nothing is done before it has gone."""
    block = half / "blocks" / "0000001.npy"
    damage(block)
    broken = block.read_bytes()

    for _ in range(2):
        with pytest.raises(
            FileFormatError, match=r"0000001.npy: damaged: .*move or delete it .*its runs, 8 to 15,"
        ) as caught:
            run(Fall(calls=tmp_path / "calls"), speeds, half, workers=1)
        assert caught.value.exit_status == ExitStatus.FILE
    assert block.read_bytes() == broken
    assert not (tmp_path / "calls").exists()


def test_block_that_cannot_be_read(half: Path, speeds: Design) -> None:
    """A folder in the place of a block is named like any other damage."""
    (half / "blocks" / "0000001.npy").unlink()
    (half / "blocks" / "0000001.npy").mkdir()

    with pytest.raises(FileFormatError, match=r"0000001.npy: damaged: it is not a file"):
        run(Fall(), speeds, half, workers=1)


def test_block_that_was_moved_away(half: Path, speeds: Design, tmp_path: Path) -> None:
    """A block that has gone is done again, and only that."""
    (half / "blocks" / "0000001.npy").unlink()
    told: list[Progress] = []

    results = run(Fall(calls=tmp_path / "calls"), speeds, half, workers=1, progress=told.append)

    assert [row[0] for _, row in calls_of(tmp_path / "calls")] == [8.0, 24.0, 32.0]
    assert told[0].resumed == 16
    np.testing.assert_array_equal(results.depth, run(Fall(), speeds, tmp_path / "whole", workers=1).depth)


def test_halves_are_removed(half: Path, speeds: Design) -> None:
    """What a killed process had half written is gone after the next start."""
    for path in (half / "blocks" / "0000004.npy.tmp", half / "results.nc.tmp"):
        path.write_bytes(b"half")
    mine = half / "blocks" / "0000004-of-mine.npy.tmp"
    mine.write_bytes(b"half")

    run(Fall(), speeds, half, workers=1)

    assert [path for path in half.rglob("*") if ".tmp" in path.name] == [mine]


OTHER: list[tuple[Fall, Callable[[Design], Design], str]] = [
    (Fall(gravity=1.62), lambda design: design, "settings.gravity is 9.81 in the folder, 1.62 here"),
    (Fall(name="rise"), lambda design: design, "task is 'fall' in the folder, 'rise' here"),
    (
        Fall(),
        lambda design: attrs.evolve(design, units={"speed": "km/h"}),
        "design.units.speed is 'm/s' in the folder, 'km/h' here",
    ),
    (Fall(), lambda design: attrs.evolve(design, points=design.points + 1), r"design.points is \[40, 1, '"),
    (Fall(samples=9), lambda _: full_factorial({"v": [1]}), "; and 6 more. Use a separate folder for this one"),
]


@pytest.mark.parametrize("number", range(len(OTHER)))
def test_folder_of_another_sweep(number: int, half: Path, speeds: Design) -> None:
    """A folder of another sweep is refused with what differs, and stays as it is."""
    task, change, text = OTHER[number]

    with pytest.raises(SweepError, match=text):
        run(task, change(speeds), half, workers=1)
    assert len(blocks(half)) == 3


def test_another_version(half: Path, speeds: Design) -> None:
    """Blocks of another armwright are not mixed with those of this one."""
    path = half / "sweep.json"
    told = json.loads(path.read_text(encoding="utf-8"))
    told["sweep"]["armwright"] = "0.0.1"
    path.write_text(json.dumps(told), encoding="utf-8")

    with pytest.raises(SweepError, match=r"armwright is '0.0.1' in the folder"):
        run(Fall(), speeds, half, workers=1)


MADE = '{"date": "", "armwright": ""}'


@pytest.mark.parametrize(
    "text",
    [
        *("", "{", "[]", '{"format": 3}', f'{{"format": 2, "sweep": {{}}, "made": {MADE}, "block": 1}}'),
        *(f'{{"format": 3, "sweep": {{}}, "made": {MADE}, "block": {block}}}' for block in ("0", "1.5", "true", "1e9")),
        *(f'{{"format": 3, "sweep": {{}}, "made": {made}, "block": 1}}' for made in ("{}", '{"date": 1}')),
    ],
)
def test_damaged_manifest(text: str, half: Path, speeds: Design) -> None:
    """A manifest that cannot be read is named; nothing is written over."""
    (half / "sweep.json").write_text(text, encoding="utf-8")

    with pytest.raises(FileFormatError, match=r"sweep.json: "):
        run(Fall(), speeds, half, workers=1)
    assert len(blocks(half)) == 3


@pytest.mark.parametrize(
    "damaged",
    [
        lambda _: b"",
        lambda _: b"no results",
        lambda whole: whole[:-100],
        lambda whole: whole[:-9] + bytes([whole[-9] ^ 1]) + whole[-8:],
    ],
)
def test_damaged_results(damaged: Callable[[bytes], bytes], speeds: Design, tmp_path: Path) -> None:
    """Results that are not as they were written are named and stay; they are made again of the blocks once removed."""
    whole = run(Fall(), speeds, tmp_path / "out", workers=1).load()
    path = tmp_path / "out" / "results.nc"
    broken = damaged(path.read_bytes())
    path.write_bytes(broken)

    for again in (lambda: run(Fall(), speeds, tmp_path / "out", workers=1), lambda: load(tmp_path / "out")):
        with pytest.raises(FileFormatError, match=r"results.nc: damaged: .*; it is not changed; move or delete it"):
            again()
    assert path.read_bytes() == broken
    path.unlink()
    again = run(Fall(calls=tmp_path / "calls"), speeds, tmp_path / "out", workers=1)

    assert again.identical(whole)
    assert not (tmp_path / "calls").exists()


def test_results_without_their_hash(speeds: Design, tmp_path: Path) -> None:
    """Results that nothing tells the hash of are not taken on trust; made again of the blocks they have one."""
    run(Fall(), speeds, tmp_path / "out", workers=1).close()
    record = tmp_path / "out" / "run.json"

    for damage in (lambda: record.write_text('{"files": {}}'), record.unlink):
        damage()
        with pytest.raises(FileFormatError, match=r"results.nc: it cannot be verified: its folder has no run.json"):
            load(tmp_path / "out")
    (tmp_path / "out" / "results.nc").unlink()

    run(Fall(), speeds, tmp_path / "out", workers=1).close()
    load(tmp_path / "out").close()


def test_folder_of_other_things(speeds: Design, tmp_path: Path) -> None:
    """A folder with other files in it is refused, and nothing is written there."""
    (tmp_path / "thesis.tex").touch()

    with pytest.raises(SweepError, match=r"contains files that are not of a sweep \('thesis.tex'\)"):
        run(Fall(), speeds, tmp_path, workers=1)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


@pytest.mark.parametrize("name", ["notes.tmp.txt", "draft.npy.tmp", "sweep.json.old"])
def test_files_with_names_like_ours(name: str, speeds: Design, tmp_path: Path) -> None:
    """A file whose name only resembles those of a sweep is somebody else's."""
    (tmp_path / name).write_text("draft")

    with pytest.raises(SweepError, match=f"contains files that are not of a sweep \\('{name}'\\)"):
        run(Fall(), speeds, tmp_path, workers=1)
    assert (tmp_path / name).read_text() == "draft"


def test_lock_of_others(speeds: Design, tmp_path: Path) -> None:
    """A file of the user's named lock is not written over, and neither is what a link of that name leads to."""
    (tmp_path / "mine").write_text("precious")
    for name, make in (
        ("text", lambda lock: lock.write_text("precious")),
        ("link", lambda lock: lock.symlink_to(tmp_path / "mine")),
        ("pipe", os.mkfifo),
    ):
        out = tmp_path / name
        out.mkdir()
        make(out / "lock")

        with pytest.raises((SweepError, OutputError)):
            run(Fall(), speeds, out, workers=1)

    assert (tmp_path / "text" / "lock").read_text() == "precious"
    assert (tmp_path / "mine").read_text() == "precious"


def test_link_in_the_place_of_a_half(speeds: Design, tmp_path: Path) -> None:
    """What a link leads to is not written through it."""
    (tmp_path / "mine").write_text("precious")
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "sweep.json.tmp").symlink_to(tmp_path / "mine")

    run(Fall(), speeds, tmp_path / "out", workers=1)

    assert (tmp_path / "mine").read_text() == "precious"


def test_manifest_that_never_ends(speeds: Design, tmp_path: Path) -> None:
    """A manifest is a file: a pipe is not waited for."""
    os.mkfifo(tmp_path / "sweep.json")

    with pytest.raises(FileFormatError, match="expected a file, got a pipe"):
        run(Fall(), speeds, tmp_path, workers=1)


def test_compressed_block(half: Path, speeds: Design) -> None:
    """A compressed block, which may be huge once it is unpacked, is not unpacked."""
    block = half / "blocks" / "0000001.npy"
    rows = np.load(block)
    with block.open("wb") as file:
        np.savez_compressed(file, rows=rows)

    with pytest.raises(FileFormatError, match=r"damaged: its checksum does not match its numbers"):
        run(Fall(), speeds, half, workers=1)


def test_folder_that_is_a_file(speeds: Design, tmp_path: Path) -> None:
    """Where a file stands there can be no folder."""
    (tmp_path / "out").touch()

    with pytest.raises(OutputError, match=r"cannot write to '.*out': it is a file; expected a folder"):
        run(Fall(), speeds, tmp_path / "out", workers=1)


def test_two_in_one_process(speeds: Design, tmp_path: Path) -> None:
    """Two threads of one process are kept apart too."""
    with (
        lock_folder(tmp_path / "out", Fall(), speeds, 8),
        pytest.raises(SweepError, match=f"in use: process {os.getpid()} on"),
    ):
        run(Fall(), speeds, tmp_path / "out", workers=1)


@pytest.mark.parametrize(("writes", "workers"), [(1, 1), (2, 1), (3, 1), (4, 1), (4, 2), (12, 1), (13, 1)])
def test_full_disk(writes: int, workers: int, speeds: Design, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """On a full disk the sweep says so; nothing half written stays, and with room it goes on."""
    out, calls = tmp_path / "out", tmp_path / "calls"
    real, count = os.fsync, iter(range(1000))

    def full(handle: int) -> None:
        if next(count) >= writes - 1:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        real(handle)

    with monkeypatch.context() as room:
        room.setattr(folder_module.os, "fsync", full)
        with pytest.raises(
            OutputError,
            match=r"No space left on device; finished blocks are kept. Free some disk space and start again",
        ):
            run(Fall(calls=calls), speeds, out, block=8, workers=workers)

    assert not [path for path in out.rglob("*") if ".tmp" in path.name]
    kept = len(blocks(out))
    done = len(calls_of(calls))
    results = run(Fall(calls=calls), speeds, out, block=8, workers=1)
    assert len(calls_of(calls)) - done == 5 - kept
    np.testing.assert_allclose(results.depth, 4.905 - np.arange(40.0))


@pytest.fixture
def small_files() -> Iterator[None]:
    """No file may be longer than 60 kB, which the system enforces."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, hard))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.usefixtures("small_files")
def test_results_that_do_not_fit(tmp_path: Path) -> None:
    """Where the blocks fit but not the results, the blocks stay and nothing half written does."""
    design = full_factorial({"speed": np.arange(40.0)})
    out = tmp_path / "out"

    with pytest.raises(OutputError, match=r"cannot write '.*results.nc': .*; finished blocks are kept"):
        run(Fall(samples=1000), design, out, block=4, workers=1)

    assert len(blocks(out)) == 10
    assert sorted(path.name for path in out.iterdir()) == ["blocks", "lock", "sweep.json"]


def test_worker_killed_once(speeds: Design, tmp_path: Path) -> None:
    """A worker that is killed from outside costs nothing but time."""
    task = Fall(kills_above=20.0, unless=tmp_path / "killed")

    results = run(task, speeds, tmp_path / "out", block=8, workers=2)

    assert (tmp_path / "killed").exists()
    assert (results.status == Status.DONE).all()
    np.testing.assert_allclose(results.depth, 4.905 - np.arange(40.0))


def test_row_that_kills_its_worker(tmp_path: Path) -> None:
    """A row that kills whoever does it is a row with a status; its neighbours have their numbers."""
    design = full_factorial({"speed": np.arange(12.0)})

    results = run(Fall(kills_above=10.5), design, tmp_path / "out", block=2, workers=2)

    assert results.status.values.tolist() == [Status.DONE] * 11 + [Status.KILLED]
    assert results.message.values[-1] == "the worker process died each time it was tried"
    np.testing.assert_allclose(results.depth[:11], 4.905 - np.arange(11.0))
    assert np.isnan(results.depth[11])
