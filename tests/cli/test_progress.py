"""What a person sees who waits."""

import pytest

from armwright.cli.progress import counting, parts, progress_text, sample_bar, sweep_bar, waiting
from armwright.sweep.progress import Progress


def progress(**changes: float) -> Progress:
    told = {"runs": 729, "done": 129, "resumed": 29, "failed": 0, "seconds": 50.0}
    return Progress(**{**told, **changes})


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        # 100 runs in 50 s; the 600 that are left take 300 s.
        ({}, "2 runs/s, 0:05:00 left"),
        ({"done": 29}, ""),
        ({"done": 729}, "14 runs/s"),
        ({"runs": 20129}, "2 runs/s, 2:46:40 left"),
        ({"failed": 3}, "2 runs/s, 0:05:00 left, 3 failed"),
    ],
)
def test_words(changes: dict[str, float], text: str) -> None:
    """Rate and time left count what this start did, not what it found."""
    assert progress_text(progress(**changes)) == text


def test_nobody_watches(capfd: pytest.CaptureFixture[str]) -> None:
    """Where the error output is no terminal there is no bar."""
    with sweep_bar("sweep") as bar, sample_bar("samples") as pair:
        assert bar is None
        assert pair == (None, None)

    assert capfd.readouterr() == ("", "")


def test_person_watches(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """On a terminal the bar shows title, runs and failures on the error output; quiet, it shows nothing."""
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "120")
    with sweep_bar("five-bar") as bar:
        assert bar is not None
        bar(progress(failed=3))
    with sweep_bar("slider-crank", quiet=True) as none:
        assert none is None
    with sample_bar("four-bar") as (words, bar):
        assert words is not None
        assert bar is not None
        bar(progress(done=429))
        words("probabilities")

    out, shown = capsys.readouterr()
    assert out == ""
    assert "five-bar" in shown
    assert "129/729" in shown
    assert "3 failed" in shown
    assert "slider-crank" not in shown
    for text in ("four-bar", "429/729", "probabilities"):
        assert text in shown


def test_nobody_waits(capfd: pytest.CaptureFixture[str]) -> None:
    """Where nobody watches, no word and no bar is shown."""
    with waiting("compiling") as words, counting("drawing") as count, parts() as pieces:
        assert (words, count, pieces) == (None, None, None)

    assert capfd.readouterr() == ("", "")


def test_person_waits(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """On a terminal a person sees what is going on, and how much of it is done, on the error output."""
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "120")
    with waiting("compiling"):
        pass
    with waiting("line 1") as words:
        assert words is not None
        words("line 7")
    with counting("drawing the film") as count:
        assert count is not None
        count(30, 90)
    with parts() as pieces:
        assert pieces is not None
        pieces("simulating", 0.25)
        pieces("learning", 0.0)

    out, shown = capsys.readouterr()
    assert out == ""
    for text in ("compiling", "line 7", "drawing the film", "30/90", "simulating", "25%", "learning"):
        assert text in shown
