"""Folders of results: a run replaces the older one whole, whatever strikes it."""

import contextlib
import fcntl
import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from armwright.errors import OutputError
from armwright.files.output import RECORD, is_stray, stray_files, write_folder
from armwright.files.result_folder import PREFIX, remove_abandoned_folders, staging_folder
from samples import Sample

OLD = {f"figure-old{i}.svg": "old" for i in range(20)} | {f"figure-both{i}.svg": "old" for i in range(20)}
NEW = {f"figure-new{i}.svg": "new" for i in range(20)} | {f"figure-both{i}.svg": "new" for i in range(20)}
# Writes the new results once its first line is read; the pieces come slowly, as those of a long run do.
WRITER = """
import sys, time
from pathlib import Path
from armwright.files.output import write_folder
def slowly(text):
    time.sleep(0.0005)
    yield text
files = {f"figure-{kind}{i}.svg": slowly("new") for kind in ("new", "both") for i in range(20)}
print("ready", flush=True)
write_folder(Path(sys.argv[1]), files)
print("done", flush=True)
"""


def held(folder: Path) -> dict[str, str]:
    """The files of a folder but for the record, with their texts."""
    return {path.name: path.read_text() for path in folder.iterdir() if path.name not in (RECORD, "figure-mine.svg")}


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
        (folder / "figure-mine.svg").write_text("mine")

        struck(folder, number, rng.uniform(0.0, 0.12))

        assert held(folder) in (OLD, NEW)
        assert stray_files(folder) == ()
        write_folder(folder, NEW)
        assert held(folder) == NEW
        assert (folder / "figure-mine.svg").read_text() == "mine"
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
        assert bool(stray_files(folder)) == is_mix
        write_folder(folder, NEW)
        assert held(folder) == NEW
        assert [path.name for path in folder.parent.iterdir()] == ["out"]
        tried, mixed = tried + 1, mixed + is_mix
    sample.record("SIGKILL while results are written", tried, 0, worst=f"{mixed} mixes, all named")


def killed_between(folder: Path, moves: int) -> None:
    """Let a process be killed after so many moves of new files; what goes has gone before."""
    code = (
        "import os, pathlib, sys\n"
        "from armwright.files.output import write_folder\n"
        "real, left = pathlib.Path.replace, [int(sys.argv[2])]\n"
        "def replace(path, to):\n"
        "    left[0] -= path.parent.name == 'new'\n"
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

    named = stray_files(folder)
    assert set(named) >= {f"figure-old{i}.svg" for i in range(20)}
    assert all(is_stray(folder / name) for name in named)
    assert len(list(tmp_path.iterdir())) == 2  # the results, and what the dead process has left

    write_folder(folder, {"figure-one.svg": "one"})
    assert held(folder) == {"figure-one.svg": "one"}
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


@pytest.mark.parametrize("removals", range(9))
def test_killed_while_clearing_up(tmp_path: Path, removals: int) -> None:
    """Killed after any number of removals, a staging folder is known for abandoned, however it is listed."""
    code = (
        "import os, pathlib, sys\n"
        "from armwright.files.result_folder import KEPT, staging\n"
        "class Listed(list):\n"
        "    def __enter__(self): return self\n"
        "    def __exit__(self, *_): pass\n"
        "read = os.scandir\n"
        "os.scandir = lambda place: Listed(sorted(read(place), key=lambda entry: entry.name != 'lock'))\n"
        "left = [int(sys.argv[2])]\n"
        "def counted(real):\n"
        "    def remove(*place, **more):\n"
        "        left[0] -= 1\n"
        "        if left[0] < 0: os.kill(os.getpid(), 9)\n"
        "        return real(*place, **more)\n"
        "    return remove\n"
        "with staging(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[1]) / 'out') as new:\n"
        "    new.with_name(KEPT).mkdir()\n"
        "    for name in ('new/a', 'new/b', 'kept/a'): (new.parent / name).touch()\n"
        "    os.unlink, os.rmdir = counted(os.unlink), counted(os.rmdir)\n"
    )
    subprocess.run([sys.executable, "-c", code, str(tmp_path), str(removals)], check=False, timeout=60)

    remove_abandoned_folders(tmp_path)

    assert not list(tmp_path.iterdir())


def test_a_file_that_is_in_no_record(tmp_path: Path) -> None:
    """A file that the record does not name is somebody's own, unless what it names does not exist as it was written."""
    write_folder(tmp_path, {"figure-a.svg": "a"})
    (tmp_path / "mine.csv").write_text("mine")
    assert not is_stray(tmp_path / "mine.csv")
    assert not is_stray(tmp_path / "nowhere.csv")

    (tmp_path / "figure-a.svg").unlink()

    assert is_stray(tmp_path / "mine.csv")
    assert not is_stray(tmp_path / "nowhere.csv")
    assert not is_stray(tmp_path / RECORD)


def test_record(tmp_path: Path) -> None:
    """The record says what it was given, and the SHA-256 hash of every file."""
    write_folder(tmp_path / "out", {"figure-a.svg": ["a", "b"], "b.bin": b"ab"}, {"command": "x"})

    said = json.loads((tmp_path / "out" / RECORD).read_text())
    digest = "fb8e20fc2e4c3f248c60c39bd652f3c1347298bb977b8b4d5903b85055620603"
    assert said == {"format": "armwright results 1", "command": "x", "files": {"figure-a.svg": digest, "b.bin": digest}}


def test_changed_files_are_the_users(tmp_path: Path) -> None:
    """A file of the old run that somebody has changed since is not removed; one as it was written is."""
    write_folder(tmp_path, {"figure-a.svg": "a", "figure-b.svg": "b"})
    (tmp_path / "figure-a.svg").write_text("mine")
    assert stray_files(tmp_path) == ("figure-a.svg",)

    write_folder(tmp_path, {"figure-c.svg": "c"})

    assert held(tmp_path) == {"figure-a.svg": "mine", "figure-c.svg": "c"}


A_TXT = "ca978112ca1bbdcafac231b39a23dc4da786eff8147c4e72b9807785afee48bb"


@pytest.mark.parametrize("name", ["a\0b", "\ud800", "", ".."])
def test_a_record_names_what_is_no_file(tmp_path: Path, name: str) -> None:
    """What cannot be the name of a file is passed over, in writing and in reading."""
    (tmp_path / RECORD).write_text(json.dumps({"format": "armwright results 1", "files": {name: A_TXT}}))
    (tmp_path / "figure-mine.svg").write_text("mine")
    assert not is_stray(tmp_path / "figure-mine.svg")

    write_folder(tmp_path, {"figure-c.svg": "c"})

    assert (tmp_path / "figure-c.svg").read_text() + (tmp_path / "figure-mine.svg").read_text() == "cmine"


def test_a_record_names_files_of_its_own_folder(tmp_path: Path) -> None:
    """A record that names files elsewhere removes nothing there."""
    (tmp_path / "figure-a.svg").write_text("a")
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / RECORD).write_text(
        json.dumps({"format": "armwright results 1", "files": {"../figure-a.svg": A_TXT}})
    )

    write_folder(tmp_path / "out", {"figure-c.svg": "c"})

    assert held(tmp_path / "out") == {"figure-c.svg": "c"}
    assert (tmp_path / "figure-a.svg").exists()


@pytest.mark.parametrize(
    "record", [{"files": {"figure-a.svg": A_TXT}}, {"format": "armwright results 1", "files": ["figure-a.svg"]}, []]
)
def test_records_of_others(tmp_path: Path, record: object) -> None:
    """A record that armwright has not written is the user's own file: nothing is written over it."""
    (tmp_path / "figure-a.svg").write_text("a")
    (tmp_path / RECORD).write_text(json.dumps(record))
    before = held(tmp_path)

    with pytest.raises(OutputError, match=r"it contains 'run\.json', which is not a result of armwright.* move it"):
        write_folder(tmp_path, {"figure-c.svg": "c"})

    assert held(tmp_path) == before
    assert json.loads((tmp_path / RECORD).read_text()) == record


@pytest.mark.parametrize("recorded", [False, True])
def test_a_file_of_the_user_with_the_name_of_a_result(tmp_path: Path, *, recorded: bool) -> None:
    """A file that no run has written is not written over, whether or not there are results of a run beside it."""
    if recorded:
        write_folder(tmp_path, {"figure-b.svg": "b"})
    (tmp_path / "figure-a.svg").write_text("mine")
    before = held(tmp_path)

    with pytest.raises(OutputError, match=r"it contains 'figure-a\.svg', which is not a result of armwright"):
        write_folder(tmp_path, {"figure-a.svg": "a", "figure-c.svg": "c"})

    assert held(tmp_path) == before


def test_folders_of_the_living_stay(tmp_path: Path) -> None:
    """A staging folder whose process lives stays, and so does one that somebody else has made."""
    (tmp_path / f"{PREFIX}foreign").mkdir()
    (tmp_path / f"{PREFIX}foreign" / "figure-precious.svg").write_text("x")
    (tmp_path / f"{PREFIX}link").symlink_to(tmp_path / f"{PREFIX}foreign")
    (tmp_path / f"{PREFIX}empty").mkdir()
    piped = tmp_path / f"{PREFIX}0123456789abcdef"
    (piped / "new").mkdir(parents=True)
    os.mkfifo(piped / "lock")
    dead = tmp_path / f"{PREFIX}0000000000000000"
    dead.mkdir()
    (dead / "lock").touch()
    with staging_folder(tmp_path, tmp_path / "out") as new:
        remove_abandoned_folders(tmp_path)
        assert new.is_dir()
        assert not dead.exists()
    left = {path.name for path in tmp_path.iterdir()}
    assert left == {f"{PREFIX}foreign", f"{PREFIX}link", f"{PREFIX}empty", piped.name}


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


@pytest.mark.skipif(os.geteuid() != 0, reason="only root mounts")
def test_full_disk(tmp_path: Path) -> None:
    """On a disk without a byte of room nothing is left behind, not even where nothing was made yet."""
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "none", str(tmp_path)], check=False).returncode:
        pytest.skip("this machine does not let us mount")
    try:
        with contextlib.suppress(OSError), (tmp_path / "mine").open("wb", buffering=0) as file:
            while file.write(b"0" * 512):
                pass

        with pytest.raises(OutputError, match="No space left on device; nothing was written"):
            write_folder(tmp_path / "out", NEW)

        assert [path.name for path in tmp_path.iterdir()] == ["mine"]
    finally:
        subprocess.run(["umount", str(tmp_path)], check=True)


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


@pytest.mark.parametrize("name", ["thesis.csv", "mine.svg", "arm.txt", "motion.csv.bak", "session.rlo"])
def test_a_foreign_record_removes_nothing(tmp_path: Path, name: str) -> None:
    """A record from elsewhere may name any file with its right hash: only what has the name of a result ever goes."""
    (tmp_path / name).write_text("a")
    (tmp_path / "motion.csv").write_text("a")
    files = {name: A_TXT, "motion.csv": A_TXT}
    (tmp_path / RECORD).write_text(json.dumps({"format": "armwright results 1", "files": files}))

    write_folder(tmp_path, {"report.html": "new"})

    assert held(tmp_path) == {name: "a", "report.html": "new"}
