"""Results are written whole or not at all."""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from armwright.errors import OutputError
from armwright.files.output import write_file, write_folder


def test_writes_and_replaces(tmp_path: Path) -> None:
    """A second run takes the place of the first, and leaves files of others alone."""
    folder = tmp_path / "a" / "b"
    write_folder(folder, {"x.txt": "one", "y.txt": ["t", "wo"]})
    (folder / "mine.txt").write_text("keep")

    write_folder(folder, {"x.txt": "three"})

    (folder / "run.json").unlink()
    assert {p.name: p.read_text() for p in folder.iterdir()} == {"x.txt": "three", "mine.txt": "keep"}
    assert [p.name for p in (tmp_path / "a").iterdir()] == ["b"]


def test_an_error_half_way_leaves_nothing(tmp_path: Path) -> None:
    """When the second file fails, the first is not there either, nor the folders made for it."""

    def full_disk() -> Iterator[str]:
        yield "some"
        raise OSError(28, os.strerror(28))

    with pytest.raises(OutputError, match="No space left on device; nothing was written"):
        write_folder(tmp_path / "new" / "run", {"x.txt": "one", "y.txt": full_disk()})

    assert list(tmp_path.iterdir()) == []


def test_interruption_leaves_the_old_result(tmp_path: Path) -> None:
    """Ctrl-C while writing keeps the last run whole."""
    folder = tmp_path / "run"
    write_folder(folder, {"x.txt": "old"})

    def interrupted() -> Iterator[str]:
        yield "new"
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_folder(folder, {"x.txt": interrupted()})

    assert (folder / "x.txt").read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["run"]


def test_a_file_in_the_way(tmp_path: Path) -> None:
    """A file where the folder should be is refused, and stays."""
    (tmp_path / "run").write_text("a file")

    with pytest.raises(OutputError, match=r"cannot write to '.*run': it is a file, and a folder is needed"):
        write_folder(tmp_path / "run", {"x.txt": "one"})
    with pytest.raises(OutputError, match=r"cannot make '.*run': it is a file"):
        write_folder(tmp_path / "run" / "deeper", {"x.txt": "one"})
    with pytest.raises(OutputError, match=r"cannot make '.*run/deeper/still': '.*run' is a file; nothing"):
        write_folder(tmp_path / "run" / "deeper" / "still" / "more", {"x.txt": "one"})

    assert (tmp_path / "run").read_text() == "a file"


def test_a_folder_in_the_way_of_a_file(tmp_path: Path) -> None:
    """A folder named as one of the results stops the writing before any file is replaced."""
    (tmp_path / "run" / "y.txt").mkdir(parents=True)

    with pytest.raises(OutputError, match=r"'y\.txt' in it is a folder"):
        write_folder(tmp_path / "run", {"x.txt": "one", "y.txt": "two"})

    assert [p.name for p in (tmp_path / "run").iterdir()] == ["y.txt"]


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_no_permission(tmp_path: Path) -> None:
    """A folder that may not be written is reported."""
    tmp_path.chmod(0o500)
    with pytest.raises(OutputError, match="nothing was written"):
        write_folder(tmp_path / "run", {"x.txt": "one"})
    tmp_path.chmod(0o700)


def test_one_file(tmp_path: Path) -> None:
    """One file is written into a folder that is made for it, and replaced; others stay."""
    path = tmp_path / "a" / "b" / "x.txt"
    write_file(path, "one")
    (path.parent / "mine.txt").write_text("keep")

    write_file(path, ["t", "wo"])

    assert {p.name: p.read_text() for p in path.parent.iterdir()} == {"x.txt": "two", "mine.txt": "keep"}


def test_one_file_half_written(tmp_path: Path) -> None:
    """A full disk leaves the old file as it was, and no folder that was made for a new one."""

    def full_disk() -> Iterator[str]:
        yield "some"
        raise OSError(28, os.strerror(28))

    write_file(tmp_path / "old.txt", "old")
    for path in (tmp_path / "old.txt", tmp_path / "new" / "x.txt"):
        with pytest.raises(OutputError, match="No space left on device; nothing was written"):
            write_file(path, full_disk())

    assert {p.name: p.read_text() for p in tmp_path.iterdir()} == {"old.txt": "old"}
