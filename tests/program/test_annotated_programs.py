"""Programs by feature, each carrying in comments what shall be said about it."""

from pathlib import Path

import pytest

from program.shelf import ACCEPTED, REJECTED, compile_file, expectations, said


@pytest.mark.parametrize("path", REJECTED, ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_rejected(path: Path) -> None:
    """A wrong program gets exactly the messages it expects, and no code."""
    compilation = compile_file(path)

    assert said(compilation) == expectations(compilation.source.text)
    assert compilation.code is None


@pytest.mark.parametrize("path", ACCEPTED, ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_accepted(path: Path) -> None:
    """A right program gets exactly the warnings it expects, and code."""
    compilation = compile_file(path)

    assert said(compilation) == expectations(compilation.source.text)
    assert compilation.code is not None


def test_enough_programs() -> None:
    """Every part of the language is covered by small programs."""
    assert len(ACCEPTED) >= 25
    assert len(REJECTED) >= 40
