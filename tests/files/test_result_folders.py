"""Folders of results: a run replaces the older one whole, whatever strikes it."""

import fcntl
import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from armwright.files.output import RECORD, is_stray, strays, write_folder
from armwright.files.staging import PREFIX, remove_abandoned, staging
from samples import Sample

OLD = {f"old{i}.txt": "old" for i in range(20)} | {f"both{i}.txt": "old" for i in range(20)}
NEW = {f"new{i}.txt": "new" for i in range(20)} | {f"both{i}.txt": "new" for i in range(20)}
# Writes the new results once its first line is read; the pieces come slowly, as those of a long run do.
WRITER = """
import sys, time
from pathlib import Path
from armwright.files.output import write_folder
def slowly(text):
    time.sleep(0.0005)
    yield text
files = {f"new{i}.txt": slowly("new") for i in range(20)} | {f"both{i}.txt": slowly("new") for i in range(20)}
print("ready", flush=True)
write_folder(Path(sys.argv[1]), files)
print("done", flush=True)
"""


def held(folder: Path) -> dict[str, str]:
    """The files of a folder but for the record, with their texts."""
    return {path.name: path.read_text() for path in folder.iterdir() if path.name not in (RECORD, "mine.txt")}


def struck(folder: Path, number: int, delay: float) -> None:
    """Let a process write the new results, and strike it after a while."""
    with subprocess.Popen(
        [sys.executable, "-c", WRITER, str(folder)], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    ) as writer:
        assert writer.stdout
        writer.stdout.readline()
        try:
            writer.wait(timeout=delay)
        except subprocess.TimeoutExpired:
            writer.send_signal(number)
            writer.wait(timeout=60)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_signals(sample: Sample, tmp_path: Path, number: signal.Signals) -> None:
    """Whenever a signal comes, the old results or the new ones stand there, whole; the next run clears up."""
    tried = 0
    for rng in sample.cases(50):
        folder = tmp_path / str(tried) / "out"
        write_folder(folder, OLD)
        (folder / "mine.txt").write_text("mine")

        struck(folder, number, rng.uniform(0.0, 0.12))

        assert held(folder) in (OLD, NEW)
        assert strays(folder) == ()
        write_folder(folder, NEW)
        assert held(folder) == NEW
        assert (folder / "mine.txt").read_text() == "mine"
        assert [path.name for path in folder.parent.iterdir()] == ["out"]
        tried += 1
    sample.record(f"{number.name} while results are written", tried, 0)


def test_kill(sample: Sample, tmp_path: Path) -> None:
    """After SIGKILL results are whole, or the files that do not belong together are named; the next run clears up."""
    tried = mixed = 0
    for rng in sample.cases(50):
        folder = tmp_path / str(tried) / "out"
        write_folder(folder, OLD)

        struck(folder, signal.SIGKILL, rng.uniform(0.0, 0.12))

        found = held(folder)
        is_mix = found not in (OLD, NEW)
        assert bool(strays(folder)) == is_mix
        write_folder(folder, NEW)
        assert held(folder) == NEW
        assert [path.name for path in folder.parent.iterdir()] == ["out"]
        tried, mixed = tried + 1, mixed + is_mix
    sample.record("SIGKILL while results are written", tried, 0, worst=f"{mixed} mixes, all named")


def killed_between(folder: Path, moves: int) -> None:
    """Let a process be killed after so many moves."""
    code = (
        "import os, pathlib, sys\n"
        "from armwright.files.output import write_folder\n"
        "real, left = pathlib.Path.replace, [int(sys.argv[2])]\n"
        "def replace(path, to):\n"
        "    left[0] -= 1\n"
        "    if left[0] < 0: os.kill(os.getpid(), 9)\n"
        "    return real(path, to)\n"
        "pathlib.Path.replace = replace\n"
        f"write_folder(pathlib.Path(sys.argv[1]), {NEW!r})\n"
    )
    done = subprocess.run([sys.executable, "-c", code, str(folder), str(moves)], check=False, timeout=60)
    assert done.returncode == -signal.SIGKILL


@pytest.mark.parametrize("moves", [0, 1, 25, 40])
def test_killed_between_two_moves(tmp_path: Path, moves: int) -> None:
    """Killed after any number of moves, the mix is named, and a run of fewer files leaves nothing of it."""
    folder = tmp_path / "out"
    write_folder(folder, OLD)
    killed_between(folder, moves)

    named = strays(folder)
    assert set(named) >= {f"old{i}.txt" for i in range(20)}
    assert all(is_stray(folder / name) for name in named)
    assert len(list(tmp_path.iterdir())) == 2  # the results, and what the dead process has left

    write_folder(folder, {"one.txt": "one"})
    assert held(folder) == {"one.txt": "one"}
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_record(tmp_path: Path) -> None:
    """The record says what it was given, and the SHA-256 hash of every file."""
    write_folder(tmp_path / "out", {"a.txt": ["a", "b"], "b.bin": b"ab"}, {"command": "x"})

    said = json.loads((tmp_path / "out" / RECORD).read_text())
    digest = "fb8e20fc2e4c3f248c60c39bd652f3c1347298bb977b8b4d5903b85055620603"
    assert said == {"format": "armwright results 1", "command": "x", "files": {"a.txt": digest, "b.bin": digest}}


def test_changed_files_are_the_users(tmp_path: Path) -> None:
    """A file of the old run that somebody has changed since is not removed; one as it was written is."""
    write_folder(tmp_path, {"a.txt": "a", "b.txt": "b"})
    (tmp_path / "a.txt").write_text("mine")
    assert strays(tmp_path) == ("a.txt",)

    write_folder(tmp_path, {"c.txt": "c"})

    assert held(tmp_path) == {"a.txt": "mine", "c.txt": "c"}


@pytest.mark.parametrize(
    "record",
    [
        {"files": {"a.txt": "ca978112ca1bbdcafac231b39a23dc4da786eff8147c4e72b9807785afee48bb"}},
        {
            "format": "armwright results 1",
            "files": {"../a.txt": "ca978112ca1bbdcafac231b39a23dc4da786eff8147c4e72b980"},
        },
        {"format": "armwright results 1", "files": ["a.txt"]},
        [],
    ],
)
def test_records_of_others(tmp_path: Path, record: object) -> None:
    """A record that armwright has not written, or that names files elsewhere, removes nothing."""
    (tmp_path / "a.txt").write_text("a")
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "a.txt").write_text("a")
    (tmp_path / "out" / RECORD).write_text(json.dumps(record))

    write_folder(tmp_path / "out", {"c.txt": "c"})

    assert held(tmp_path / "out") == {"a.txt": "a", "c.txt": "c"}
    assert (tmp_path / "a.txt").exists()


def test_folders_of_the_living_stay(tmp_path: Path) -> None:
    """A staging folder whose process lives stays, and so does one that somebody else has made."""
    (tmp_path / f"{PREFIX}foreign").mkdir()
    (tmp_path / f"{PREFIX}foreign" / "precious.txt").write_text("x")
    (tmp_path / f"{PREFIX}link").symlink_to(tmp_path / f"{PREFIX}foreign")
    dead = tmp_path / f"{PREFIX}dead"
    dead.mkdir()
    (dead / "lock").touch()
    with staging(tmp_path, tmp_path / "out") as new:
        remove_abandoned(tmp_path)
        assert new.is_dir()
        assert not dead.exists()
    left = {path.name for path in tmp_path.iterdir()}
    assert left == {f"{PREFIX}foreign", f"{PREFIX}link"}


def test_two_at_once(tmp_path: Path) -> None:
    """Who moves results in waits for another who does."""
    folder = tmp_path / "out"
    write_folder(folder, OLD)
    lock = os.open(folder, os.O_RDONLY)
    fcntl.flock(lock, fcntl.LOCK_EX)
    imports = "from pathlib import Path\nfrom armwright.files.output import write_folder\n"
    code = f"{imports}write_folder(Path({str(folder)!r}), {NEW!r})\n"
    with subprocess.Popen([sys.executable, "-c", code]) as writer:
        with pytest.raises(subprocess.TimeoutExpired):
            writer.wait(timeout=1.0)
        assert held(folder) == OLD
        os.close(lock)
        assert writer.wait(timeout=60) == 0
    assert held(folder) == NEW


@pytest.mark.skipif(os.geteuid() != 0, reason="only root mounts")
def test_mount_point(tmp_path: Path) -> None:
    """Into a folder that is a mount point results come as into any other."""
    folder = tmp_path / "out"
    folder.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "none", str(folder)], check=False, capture_output=True).returncode:
        pytest.skip("this machine does not let us mount")
    try:
        write_folder(folder, OLD)
        write_folder(folder, NEW)
        assert held(folder) == NEW
        assert [path.name for path in tmp_path.iterdir()] == ["out"]
    finally:
        subprocess.run(["umount", str(folder)], check=True)


def test_nothing_can_be_made_beside(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where nothing can be made beside a folder, its results are staged in it."""
    folder = tmp_path / "out"
    write_folder(folder, OLD)
    may = os.access
    monkeypatch.setattr(os, "access", lambda path, mode: Path(path) != tmp_path and may(path, mode))
    beside = os.mkdir

    def mkdir(path: str, *mode: int) -> None:
        assert Path(path).parent != tmp_path
        beside(path, *mode)

    monkeypatch.setattr(os, "mkdir", mkdir)

    write_folder(folder, NEW)

    assert held(folder) == NEW
