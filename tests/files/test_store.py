"""Bytes kept by key: what comes out is what went in, or nothing; only the user's own folder is trusted."""

import os
import signal
import stat
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from armwright.errors import CacheWarning
from armwright.files import store as store_module
from armwright.files.store import Store, cache_folder, make_private, reason_for_distrust, user_store
from samples import Sample

KEY, OTHER = "ab12", "cd34"
DATA = bytes(range(256)) * 40

needs_root = pytest.mark.skipif(os.geteuid() != 0, reason="only the administrator can give files away")


def get_or_make(store: Store, key: str, make: Callable[[], bytes]) -> bytes:
    """Use a store as the compiler of kernels does."""
    with store.locked(key):
        data = store.get(key)
        if data is None:
            data = make()
            store.put(key, data)
    return data


def truncated(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: len(DATA) // 2])


def emptied(path: Path) -> None:
    path.write_bytes(b"")


def foreign(path: Path) -> None:
    path.write_bytes(b"PK\x03\x04 something else entirely")


def longer(path: Path) -> None:
    path.write_bytes(path.read_bytes() + b"\0")


def without_mark(path: Path) -> None:
    path.write_bytes(path.read_bytes()[18:])


def of_another_key(path: Path) -> None:
    other = Store(path.parent)
    other.put(OTHER, DATA)
    (path.parent / OTHER).replace(path)


def a_folder(path: Path) -> None:
    path.unlink()
    path.mkdir()
    (path / "inside").touch()


def a_pipe(path: Path) -> None:
    path.unlink()
    os.mkfifo(path)


def a_link(path: Path) -> None:
    path.replace(path.parent / "elsewhere")
    path.symlink_to(path.parent / "elsewhere")


def a_broken_link(path: Path) -> None:
    path.unlink()
    path.symlink_to("nowhere")


def gone(path: Path) -> None:
    path.unlink()


def writable_by_others(path: Path) -> None:
    path.chmod(0o622)


DAMAGES: list[Callable[[Path], None]] = [
    truncated, emptied, foreign, longer, without_mark, of_another_key, a_folder, a_pipe, a_link, a_broken_link, gone,
    writable_by_others,
]  # fmt: skip


@pytest.fixture
def store(tmp_path: Path) -> Store:
    return Store(tmp_path / "cache" / "store")


@pytest.fixture
def no_mask() -> Iterator[None]:
    """Nothing is taken from the modes that files are made with."""
    before = os.umask(0)
    yield
    os.umask(before)


def test_what_went_in_comes_out(store: Store) -> None:
    """Bytes of any length come back under their own key alone, and later ones take their place."""
    assert store.get(KEY) is None
    for data in (DATA, b"", b"\n"):
        assert store.put(KEY, data)
        assert store.get(KEY) == data
        assert store.get(OTHER) is None


@pytest.mark.parametrize("damage", DAMAGES, ids=lambda one: one.__name__)
def test_damaged_entries_count_as_absent(store: Store, damage: Callable[[Path], None]) -> None:
    """Whatever has happened to an entry, it is not given out, and making it anew mends it."""
    assert store.folder is not None
    store.put(KEY, DATA)
    damage(store.folder / KEY)

    assert store.get(KEY) is None
    assert get_or_make(store, KEY, lambda: b"new") == b"new"
    assert store.get(KEY) == b"new"


def test_random_damage(store: Store, sample: Sample) -> None:
    """No bit of an entry can change, no part be lost or doubled, without its being noticed."""
    assert store.folder is not None
    store.put(KEY, DATA)
    path, tried = store.folder / KEY, 0
    sound = path.read_bytes()
    for rng in sample.cases(3000):
        damaged = bytearray(sound)
        match rng.integers(3):
            case 0:
                damaged[rng.integers(len(sound))] ^= 1 << int(rng.integers(8))
            case 1:
                del damaged[rng.integers(len(sound)) :]
            case _:
                first, last = sorted(rng.integers(len(sound) + 1, size=2))
                damaged[first:first] = sound[first : last + 1]
        path.write_bytes(damaged)
        assert store.get(KEY) is None
        tried += 1
    sample.record("entries of the store with a bit, a part or an end changed: given out", tried, 0)


def test_private_whatever_the_mask(store: Store, no_mask: None) -> None:  # noqa: ARG001
    """Folders are 0700 and files 0600, also where nothing is masked."""
    get_or_make(store, KEY, lambda: DATA)

    assert store.folder is not None
    modes = {path: stat.S_IMODE(path.stat().st_mode) for path in store.folder.parent.rglob("*")}
    assert {mode for path, mode in modes.items() if path.is_dir()} == {0o700}
    assert {mode for path, mode in modes.items() if path.is_file()} == {0o600}
    assert stat.S_IMODE(store.folder.parent.stat().st_mode) == 0o700


def test_parents_are_private_too(tmp_path: Path, no_mask: None) -> None:  # noqa: ARG001
    """Missing parents are made for the user alone: otherwise anybody could put another folder in place of the cache."""
    make_private(tmp_path / "home" / ".cache" / "armwright")

    assert [stat.S_IMODE((tmp_path / part).stat().st_mode) for part in ("home", "home/.cache")] == [0o700, 0o700]
    assert not reason_for_distrust(tmp_path / "home" / ".cache" / "armwright")


@pytest.mark.parametrize("mode", [0o777, 0o770, 0o707, 0o1777, 0o720])
@pytest.mark.parametrize("inner", [False, True], ids=["cache folder", "store"])
def test_folders_that_others_may_write_to(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, mode: int, *, inner: bool
) -> None:
    """A folder open to the writing of others is not used; the warning says which, how, and what to do."""
    monkeypatch.setenv("ARMWRIGHT_CACHE", str(tmp_path / "cache"))
    mine = tmp_path / "cache" / "things"
    mine.mkdir(parents=True)
    weak = mine if inner else mine.parent
    weak.chmod(mode)

    with pytest.warns(CacheWarning) as caught:
        opened = user_store("things")

    assert opened.folder is None
    assert str(caught[0].message) == (
        f"compiled code is not cached: other users may write to '{weak}' (mode {mode:o}). Make the folder private, or "
        "name another one in ARMWRIGHT_CACHE"
    )
    assert get_or_make(opened, KEY, lambda: DATA) == DATA
    assert not any(mine.iterdir())


def test_parent_that_others_may_write_to(tmp_path: Path) -> None:
    """A folder below one in which others can exchange it is not trusted; below a sticky one, such as /tmp, it is."""
    below = tmp_path / "open" / "cache" / "store"
    below.mkdir(parents=True)
    (tmp_path / "open").chmod(0o777)
    assert reason_for_distrust(below) == f"other users may write to '{tmp_path / 'open'}' (mode 777)"
    (tmp_path / "open").chmod(0o1777)
    assert not reason_for_distrust(below)


@needs_root
def test_folders_and_files_of_others(tmp_path: Path) -> None:
    """What belongs to another user is not trusted, be it a folder, a link or an entry in a folder of one's own."""
    mine = tmp_path / "cache" / "store"
    store = Store(mine)
    store.put(KEY, DATA)
    os.chown(mine / KEY, 4242, 4242)
    assert store.get(KEY) is None

    os.chown(mine, 4242, 4242)
    assert reason_for_distrust(mine) == f"'{mine}' belongs to another user"
    (tmp_path / "link").symlink_to(tmp_path / "cache")
    os.chown(tmp_path / "link", 4242, 4242, follow_symlinks=False)
    assert (
        reason_for_distrust(tmp_path / "link" / "elsewhere")
        == f"'{tmp_path / 'link'}' is a link that belongs to another user"
    )


def test_links_count_as_what_they_lead_to(tmp_path: Path) -> None:
    """A link of the user's own to a private folder is fine; one to an open folder is not; a ring leads nowhere."""
    for name, mode in (("private", 0o700), ("open", 0o777)):
        (tmp_path / name).mkdir(mode=0o700)
        (tmp_path / name).chmod(mode)
        (tmp_path / f"to_{name}").symlink_to(tmp_path / name)
    (tmp_path / "ring").symlink_to(tmp_path / "ring")

    assert not reason_for_distrust(tmp_path / "to_private" / "store")
    assert reason_for_distrust(tmp_path / "to_open" / "store").startswith("other users may write to")
    assert not reason_for_distrust(tmp_path / "ring" / "store")
    assert get_or_make(Store(tmp_path / "ring" / "store"), KEY, lambda: DATA) == DATA


def test_a_file_in_the_way(tmp_path: Path) -> None:
    """A file with the name of the store, or of a folder above it, stays, and nothing is kept."""
    (tmp_path / "file").write_text("in the way")

    for folder in (tmp_path / "file", tmp_path / "file" / "store"):
        assert get_or_make(Store(folder), KEY, lambda: DATA) == DATA
        assert not Store(folder).put(KEY, DATA)

    assert (tmp_path / "file").read_text() == "in the way"


@pytest.mark.parametrize(
    ("variables", "folder"),
    [
        ({"ARMWRIGHT_CACHE": "/a"}, "/a"),
        ({"XDG_CACHE_HOME": "/b", "HOME": "/c"}, "/b/armwright"),
        ({"XDG_CACHE_HOME": "relative", "HOME": "/c"}, "/c/.cache/armwright"),
        ({"ARMWRIGHT_CACHE": "", "HOME": "/c"}, "/c/.cache/armwright"),
        ({"HOME": "relative"}, None),
    ],
)
def test_where_the_cache_is(monkeypatch: pytest.MonkeyPatch, variables: dict[str, str], folder: str | None) -> None:
    """The folder that is named, or the system's for such things; a relative one of the system's counts as none."""
    for name in ("ARMWRIGHT_CACHE", "XDG_CACHE_HOME", "HOME"):
        monkeypatch.delenv(name, raising=False)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)

    assert cache_folder() == (None if folder is None else Path(folder))


def test_without_a_home(monkeypatch: pytest.MonkeyPatch) -> None:
    """A user whom the system does not know, without a home, has no cache folder, and a store that keeps nothing."""

    def nobody() -> Path:
        raise RuntimeError("Could not determine home directory.")

    for name in ("ARMWRIGHT_CACHE", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(Path, "home", nobody)

    assert cache_folder() is None
    assert get_or_make(user_store("things"), KEY, lambda: DATA) == DATA


def test_half_written_files_are_cleared(store: Store) -> None:
    """What a process left that was killed while writing goes when it is an hour old; a fresh one may be in work."""
    assert store.folder is not None
    make_private(store.folder)
    old, fresh = store.folder / "ab12.x.tmp", store.folder / "ab12.y.tmp"
    for half in (old, fresh):
        half.write_bytes(b"half")
    os.utime(old, (time.time() - 7200,) * 2)

    store.put(KEY, DATA)

    assert (old.exists(), fresh.exists()) == (False, True)


def test_who_holds_a_lock_for_ever_costs_time_only(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    """A process that was stopped while it made an entry does not stop the others."""
    monkeypatch.setattr(store_module, "_LOCK_TIMEOUT", 0.1)
    with store.locked(KEY):
        assert get_or_make(store, KEY, lambda: DATA) == DATA


_FILL = """
import sys
from pathlib import Path
from armwright.files.store import Store
store = Store(Path(sys.argv[1]))
data = bytes(range(256)) * 40
while True:
    store.put("ab12", data)
    if store.get("ab12") != data:
        print("torn", flush=True)
"""


def test_killed_while_writing(store: Store, sample: Sample) -> None:
    """However often writers are killed, a reader finds the whole entry or none."""
    assert store.folder is not None
    killed = 0
    for rng in sample.cases(60):
        with subprocess.Popen([sys.executable, "-c", _FILL, str(store.folder)], stdout=subprocess.PIPE) as writer:
            time.sleep(float(rng.uniform(0.15, 0.4)))
            writer.send_signal(signal.SIGKILL)
            assert writer.communicate()[0] == b""
        assert store.get(KEY) in (DATA, None)
        killed += 1
    sample.record("processes killed while they wrote one entry again and again: torn entries", killed, 0)


def test_full_disk(store: Store) -> None:
    """What cannot be written is not kept, is no error, and leaves nothing behind."""
    code = (
        "import resource, sys; from pathlib import Path; from armwright.files.store import Store\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))\n"
        "store = Store(Path(sys.argv[1]))\n"
        f"with store.locked('{KEY}'): print(store.put('{KEY}', bytes(100000)), store.get('{KEY}'))"
    )
    done = subprocess.run([sys.executable, "-c", code, str(store.folder)], capture_output=True, text=True, check=False)

    assert (done.stdout, done.stderr) == ("False None\n", "")
    assert store.folder is not None
    assert sorted(path.name for path in store.folder.iterdir()) == ["ab.lock"]
    assert get_or_make(store, KEY, lambda: DATA) == DATA == store.get(KEY)
    np.testing.assert_equal(store.get(KEY), DATA)


@pytest.mark.skipif(sys.platform != "linux", reason="open files are counted where Linux lists them")
def test_folder_in_place_of_an_entry_leaves_no_file_open(tmp_path: Path) -> None:
    """A folder where an entry should be counts as absent, and no file stays open."""
    (tmp_path / KEY).mkdir()
    before = len(list(Path("/proc/self/fd").iterdir()))

    assert all(Store(tmp_path).get(KEY) is None for _ in range(5))
    assert len(list(Path("/proc/self/fd").iterdir())) == before
