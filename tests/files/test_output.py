"""Results are written whole or not at all."""

import errno
import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from armwright.errors import OutputError
from armwright.files import output
from armwright.files.inputs import forget_read_files, read_text
from armwright.files.output import descriptor, write_file, write_folder


def test_writes_and_replaces(tmp_path: Path) -> None:
    """A second run takes the place of the first, and leaves files of others alone."""
    folder = tmp_path / "a" / "b"
    write_folder(folder, {"figure-x.svg": "one", "figure-y.svg": ["t", "wo"]})
    (folder / "figure-mine.svg").write_text("keep")

    write_folder(folder, {"figure-x.svg": "three"})

    (folder / "run.json").unlink()
    assert {p.name: p.read_text() for p in folder.iterdir()} == {"figure-x.svg": "three", "figure-mine.svg": "keep"}
    assert [p.name for p in (tmp_path / "a").iterdir()] == ["b"]


def test_an_error_half_way_leaves_nothing(tmp_path: Path) -> None:
    """When the second file fails, the first does not exist either, nor the folders made for it."""

    def full_disk() -> Iterator[str]:
        yield "some"
        raise OSError(28, os.strerror(28))

    with pytest.raises(OutputError, match="No space left on device; nothing was written"):
        write_folder(tmp_path / "new" / "run", {"figure-x.svg": "one", "figure-y.svg": full_disk()})

    assert list(tmp_path.iterdir()) == []


def test_interruption_leaves_the_old_result(tmp_path: Path) -> None:
    """Ctrl-C while writing keeps the last run whole."""
    folder = tmp_path / "run"
    write_folder(folder, {"figure-x.svg": "old"})

    def interrupted() -> Iterator[str]:
        yield "new"
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_folder(folder, {"figure-x.svg": interrupted()})

    assert (folder / "figure-x.svg").read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["run"]


def test_a_file_in_the_way(tmp_path: Path) -> None:
    """A file where the folder should be is refused, and stays."""
    (tmp_path / "run").write_text("a file")

    with pytest.raises(OutputError, match=r"cannot write to '.*run': it is a file; expected a folder"):
        write_folder(tmp_path / "run", {"figure-x.svg": "one"})
    with pytest.raises(OutputError, match=r"cannot make '.*run': it is a file"):
        write_folder(tmp_path / "run" / "deeper", {"figure-x.svg": "one"})
    with pytest.raises(OutputError, match=r"cannot make '.*run/deeper/still': '.*run' is a file; nothing"):
        write_folder(tmp_path / "run" / "deeper" / "still" / "more", {"figure-x.svg": "one"})

    assert (tmp_path / "run").read_text() == "a file"


def test_a_folder_in_the_way_of_a_file(tmp_path: Path) -> None:
    """A folder named as one of the results stops the writing before any file is replaced."""
    (tmp_path / "run" / "figure-y.svg").mkdir(parents=True)

    with pytest.raises(OutputError, match=r"it contains a folder 'figure-y\.svg'"):
        write_folder(tmp_path / "run", {"figure-x.svg": "one", "figure-y.svg": "two"})

    assert [p.name for p in (tmp_path / "run").iterdir()] == ["figure-y.svg"]


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_no_permission(tmp_path: Path) -> None:
    """A folder that may not be written is reported."""
    tmp_path.chmod(0o500)
    with pytest.raises(OutputError, match="nothing was written"):
        write_folder(tmp_path / "run", {"figure-x.svg": "one"})
    tmp_path.chmod(0o700)


def test_one_file(tmp_path: Path) -> None:
    """One file is written into a folder that is made for it, and replaced; others stay."""
    path = tmp_path / "a" / "b" / "figure-x.svg"
    write_file(path, "one")
    (path.parent / "figure-mine.svg").write_text("keep")

    write_file(path, ["t", "wo"])

    assert {p.name: p.read_text() for p in path.parent.iterdir()} == {"figure-x.svg": "two", "figure-mine.svg": "keep"}


def test_one_file_half_written(tmp_path: Path) -> None:
    """A full disk leaves the old file as it was, and no folder that was made for a new one."""

    def full_disk() -> Iterator[str]:
        yield "some"
        raise OSError(28, os.strerror(28))

    write_file(tmp_path / "figure-old.svg", "old")
    for path in (tmp_path / "figure-old.svg", tmp_path / "new" / "figure-x.svg"):
        with pytest.raises(OutputError, match="No space left on device; nothing was written"):
            write_file(path, full_disk())

    assert {p.name: p.read_text() for p in tmp_path.iterdir()} == {"figure-old.svg": "old"}


def mounted(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    """Let a file be one that is mounted by itself: nothing takes its place, and it goes to no other."""
    replace = Path.replace

    def busy(self: Path, target: Path) -> Path:
        if name in (self.name, target.name) and target.exists():
            raise OSError(errno.EBUSY, os.strerror(errno.EBUSY))
        return replace(self, target)

    monkeypatch.setattr(Path, "replace", busy)


@pytest.mark.parametrize("links", [True, False], ids=["second names", "no second names"])
def test_a_file_that_cannot_be_replaced_stops_all(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, *, links: bool
) -> None:
    """Where the last of the files cannot be moved in, the older results are there again, and nothing else."""
    folder = tmp_path / "run"
    write_folder(folder, {"figure-w.svg": "old w", "figure-x.svg": "old x"})
    before = {path.name: path.read_text() for path in folder.iterdir()}
    if not links:
        monkeypatch.setattr(os, "link", lambda *_paths, **_how: (_ for _ in ()).throw(PermissionError(1, "no")))
    mounted(monkeypatch, "run.json")

    with pytest.raises(OutputError, match="nothing was written"):
        write_folder(folder, {"figure-x.svg": "new x", "figure-y.svg": "new y"})

    assert {path.name: path.read_text() for path in folder.iterdir()} == before
    assert [path.name for path in tmp_path.iterdir()] == ["run"]


def test_a_file_that_is_mounted_is_written_where_it_stands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file of a container that is one of the host can be written, but not replaced."""
    path = tmp_path / "arm.toml"
    path.write_text("old and longer")
    number = path.stat().st_ino
    mounted(monkeypatch, "arm.toml")

    write_file(path, ["n", "ew"])

    assert path.read_text() == "new"
    assert path.stat().st_ino == number
    assert [one.name for one in tmp_path.iterdir()] == ["arm.toml"]


def test_a_full_disk_leaves_a_mounted_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the new bytes have no room, the old ones come back."""
    path = tmp_path / "arm.toml"
    path.write_text("old")
    mounted(monkeypatch, "arm.toml")
    fsync, calls = os.fsync, iter([True, False])

    def full(file: int) -> None:
        if os.fstat(file).st_ino == path.stat().st_ino and next(calls):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        fsync(file)

    monkeypatch.setattr(os, "fsync", full)

    with pytest.raises(OutputError, match="No space left on device; nothing was written"):
        write_file(path, "new and longer")

    assert path.read_text() == "old"


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_file_in_a_folder_of_others(tmp_path: Path) -> None:
    """Who may write to a file and not to its folder can write it all the same."""
    path = tmp_path / "arm.toml"
    path.write_text("old")
    tmp_path.chmod(0o500)
    write_file(path, "new")
    tmp_path.chmod(0o700)

    assert path.read_text() == "new"


def test_what_was_read_stays(tmp_path: Path) -> None:
    """What results are made of is never replaced by them, by whatever name they are called."""
    source = tmp_path / "figure-x.svg"
    write_folder(tmp_path, {source.name: "mine"})
    assert read_text(source) == "mine"
    (tmp_path / "link.svg").symlink_to(source)
    (tmp_path / "second.svg").hardlink_to(source)

    for name in ("figure-x.svg", "link.svg", "second.svg", "../" + tmp_path.name + "/figure-x.svg"):
        with pytest.raises(
            OutputError, match="is an input of this command and would be overwritten; name another file"
        ):
            write_file(tmp_path / name, "other")
    for files in ({source.name: "other"}, {"figure-y.svg": "other"}):
        with pytest.raises(
            OutputError, match=r"it contains the input 'figure-x.svg', which would be overwritten: name another folder"
        ):
            write_folder(tmp_path, files)
    assert source.read_text() == "mine"

    write_file(source, "changed", back=True)
    assert source.read_text() == "changed"
    forget_read_files()
    write_file(source, "other")


def test_open_descriptors(tmp_path: Path) -> None:
    """What goes to /dev/stdout or another open descriptor goes on behind what is there; a link to it is one, too."""
    (tmp_path / "link").symlink_to("/dev/fd")
    with (tmp_path / "log").open("w+b", buffering=0) as log:
        log.write(b"kept ")
        write_file(Path(f"/dev/fd/{log.fileno()}"), ["o", "ne "])
        write_file(tmp_path / "link" / str(log.fileno()), "two")
        assert descriptor(Path("/dev/stdin")) == 0
    read, write = os.pipe()
    with os.fdopen(read, "rb") as reader:
        write_file(Path(f"/proc/self/fd/{write}"), "piped")
        os.close(write)
        assert reader.read() == b"piped"

    assert (tmp_path / "log").read_text() == "kept one two"
    assert [descriptor(tmp_path / name) for name in ("log", "1", "link", "none/1")] == [None] * 4
    with pytest.raises(OutputError, match="Bad file descriptor"):
        write_file(Path("/dev/fd/987"), "nowhere")


def test_several_names(tmp_path: Path) -> None:
    """A file of two names goes on to have them."""
    path, second = tmp_path / "figure-x.svg", tmp_path / "second.svg"
    path.write_text("one and more")
    second.hardlink_to(path)

    write_file(path, "two")

    assert second.read_text() == "two"
    assert path.samefile(second)


@pytest.mark.skipif(os.geteuid() != 0, reason="only root gives files away")
def test_owner(tmp_path: Path) -> None:
    """Who owns a file goes on to own it."""
    path = tmp_path / "figure-x.svg"
    path.write_text("one")
    os.chown(path, 1234, 4321)
    path.chmod(0o600)

    write_file(path, "two")

    assert (path.stat().st_uid, path.stat().st_gid, path.stat().st_mode & 0o777) == (1234, 4321, 0o600)
    assert path.read_text() == "two"


def test_owner_that_cannot_be_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file of somebody else, in a folder that both may write to, is written where it stands."""
    path = tmp_path / "figure-x.svg"
    path.write_text("one")
    number = path.stat().st_ino

    def refuse(*_: object) -> None:
        raise PermissionError(errno.EPERM, os.strerror(errno.EPERM))

    monkeypatch.setattr(output, "_copy_owner_and_mode", refuse)
    write_file(path, "two")

    assert path.read_text() == "two"
    assert path.stat().st_ino == number


def test_write_protected(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file that is protected against writing is not replaced, though its folder would allow it."""
    path = tmp_path / "figure-x.svg"
    path.write_text("one")
    allowed = os.access
    monkeypatch.setattr(os, "access", lambda at, mode: at != path and allowed(at, mode))

    with pytest.raises(OutputError, match="it is write-protected; nothing was written"):
        write_file(path, "two")

    assert path.read_text() == "one"
