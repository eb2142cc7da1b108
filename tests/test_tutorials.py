"""What the tutorials tell to type answers as they say."""

import contextlib
import io
import re
import runpy
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from cli_calls import armwright
from printed import agree, matches

pytestmark = pytest.mark.early

ROOT = Path(__file__).parents[1]
HOME = ROOT / "docs" / "index.md"
TUTORIALS = sorted(path for path in (ROOT / "docs" / "tutorials").glob("*.md") if path.stem != "index")
# The name of a file in front of what stands in it.
FILE = re.compile(r"^Write (?:this|it) into `([\w.]+)`:$")
# A command that serves a page; what stands below it, up to the next command, is done on the page.
STUDIO = "$ armwright studio "
# Blocks behind this remark take longer than a test may; what they show is tested elsewhere, as the remark says.
LONG = "<!-- not run here:"


class Block(NamedTuple):
    """Something to run, and what it answers."""

    kind: str
    lines: list[str]
    answer: list[str]


def blocks(page: Path) -> Iterator[Block]:
    """Give what a page tells to run, in order: Python with the text behind it, commands with their answers."""
    text = page.read_text(encoding="utf-8")
    found = list(re.finditer(r"^```(\w+)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL))
    on_the_page = 0
    for this, following in zip(found, [*found[1:], None], strict=True):
        if this.start() < on_the_page:
            continue
        before = text[: this.start()].rstrip().rpartition("\n")[2]
        lines = this[2].splitlines()
        if before.startswith(LONG):
            continue
        name = FILE.search(before)
        if name is not None:
            yield Block("file", [name[1], *lines], [])
        elif this[1] == "python":
            near = following is not None and not text[this.end() : following.start()].strip()
            answer = following[2].splitlines() if following is not None and near and following[1] == "text" else []
            yield Block("python", lines, answer)
        elif this[1] == "console" and lines[0].startswith(STUDIO):
            on_the_page = text.index("```console", this.end())
            yield Block("studio", [lines[0][2:], text[this.end() : on_the_page]], lines[1:])
        elif this[1] == "console":
            starts = [i for i, line in enumerate(lines) if line.startswith("$ ")]
            for start, end in zip(starts, [*starts[1:], len(lines)], strict=True):
                yield Block("command", [lines[start][2:]], lines[start + 1 : end])


def trimmed(text: str) -> list[str]:
    """Return the lines that are not blank."""
    return [line.rstrip() for line in text.splitlines() if line.strip()]


def answered(block: Block, scope: dict[str, Any], folder: Path) -> str:
    """Run a block and return what it prints."""
    if block.kind == "file":
        (folder / block.lines[0]).write_text("\n".join(block.lines[1:]) + "\n", encoding="utf-8")
        return ""
    if block.kind == "python":
        said = io.StringIO()
        with contextlib.redirect_stdout(said), contextlib.chdir(folder):
            exec("\n".join(block.lines), scope)
        return said.getvalue()
    program, *arguments = shlex.split(block.lines[0])
    assert program == "armwright", program
    done = armwright(*arguments, columns=100, cwd=folder)
    return done.stderr + done.stdout


def test_numbers_that_agree() -> None:
    """One unit in the last digit is rounding, two are another number; words and counts of numbers must be the same."""
    assert agree("q =  1.00 mm", "q = 1.01 mm")
    assert not agree("q = 1.00 mm", "q = 1.02 mm")
    assert not agree("q = 1.00 mm", "q = 1.00 m")
    assert agree("off by 2e-16", "off by 1e-16")
    assert matches(["a", "...", "c"], ["a", "b", "b", "c"])
    assert not matches(["a", "...", "d"], ["a", "b", "b", "c"])
    assert not matches(["a"], ["a", "b"])


def followed(block: Block, folder: Path, browser: Any) -> str:
    """Start a studio, do on its page what the tutorial says, and return what the command prints, without the secret."""
    session = runpy.run_path(str(ROOT / "docs" / "pictures" / "follow.py"))["Session"]
    with session(shlex.split(block.lines[0])[1:], folder, browser) as studio:
        assert studio.follow(block.lines[1]) > 50
        address: str = studio.address
    return re.sub(r":\d+/\?token=[\w-]{32}$", ":41231/?token=...", address)


@pytest.mark.parametrize("page", [HOME, *TUTORIALS], ids=lambda page: page.stem)
@pytest.mark.drawn(0.4)
def test_tutorial(page: Path, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    """Who types what a tutorial says, or the first page, in its order, gets the answers it shows."""
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    scope: dict[str, Any] = {}

    ran = list(blocks(page))

    assert {block.kind for block in ran} >= ({"python"} if page == HOME else {"python", "command"})
    for block in ran:
        if block.kind == "studio":
            got = trimmed(followed(block, tmp_path, request.getfixturevalue("browser")))
        else:
            got = trimmed(answered(block, scope, tmp_path))
        told = trimmed("\n".join(block.answer))
        assert matches(told, got), "\n".join([*block.lines, "-- the page:", *told, "-- said:", *got])


@pytest.mark.parametrize("page", TUTORIALS, ids=lambda page: page.stem)
def test_what_is_not_run_is_tested_elsewhere(page: Path) -> None:
    """Where a tutorial shows something that takes too long for a test, it names a test that is there."""
    for remark in re.findall(r"<!-- not run here: (.*?) -->", page.read_text(encoding="utf-8")):
        named = re.findall(r"tests/[\w/]+\.py", remark)
        assert named, remark
        assert all((ROOT / name).exists() for name in named), remark
