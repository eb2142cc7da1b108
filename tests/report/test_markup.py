"""What goes into the page, looked at without a browser."""

import json
import math

import attrs
import numpy as np
import pytest
from hypothesis import given, strategies as st

from armwright.report.animation import FrameTrack
from armwright.report.markup import json_text
from armwright.report.page import run_page

# Five significant digits: half a unit in the last of them.
LAST_DIGIT = 0.5e-4
MEGABYTE = 1e6


@given(st.text())
def test_text_survives(text: str) -> None:
    """Any text comes back from the page letter by letter, and cannot end the script element it stands in."""
    written = json_text([text])

    assert written.isascii()
    assert "<" not in written
    assert json.loads(written) == [text]


@given(st.floats(-1e6, 1e6))
def test_numbers_keep_five_digits(number: float) -> None:
    """A number of a track comes back to five significant digits, or to a ten-millionth where it is tiny."""
    (row,) = json.loads(json_text(np.array([[number]])))

    assert row[0] == pytest.approx(number, rel=LAST_DIGIT, abs=1e-7)


def test_infinity_is_null() -> None:
    """JSON knows no infinity: a missing limit is null."""
    assert json_text({"upper": math.inf, "lower": -math.inf}) == '{"upper":null,"lower":null}'


def test_rows_that_stay() -> None:
    """A row equal to the one before costs one letter."""
    rows = np.array([[1.0, 2.0], [1.0, 2.0], [1.0, 2.5], [1.0, 2.5], [0.0, 0.0]])

    assert json_text(rows) == "[[1,2],0,[1,2.5],0,[0,0]]"


def test_instants_of_a_long_run() -> None:
    """After a day the instants of a film still differ."""
    t = 86400 + np.arange(3) / 25

    assert json.loads(json_text(t)) == pytest.approx(t, abs=1e-3)


def test_no_address_in_the_page(bench) -> None:
    """The page names no address that a browser could fetch."""
    page = run_page(bench)

    assert "http://" not in page
    assert "https://" not in page
    assert "url(" not in page
    assert "@import" not in page


def test_page_is_repeatable(bench) -> None:
    """The same run gives the same page, byte by byte."""
    assert run_page(bench) == run_page(attrs.evolve(bench))


def test_size_of_half_a_minute(rng, bench) -> None:
    """Thirty seconds of an arm and ten frames, everything moving all the time, stay below three megabytes."""
    t, film = np.linspace(0, 30, 2000), np.arange(0, 30, 1 / 25)

    def noise(*shape: int) -> np.ndarray:
        return rng.normal(size=shape)

    arm = bench.arms[0]
    record = attrs.evolve(
        arm, t=t, q=noise(2000, 6), qd=noise(2000, 6), qdd=noise(2000, 6), tau=noise(2000, 6), hand=noise(2000, 3)
    )
    figure = attrs.evolve(bench.animation.arms[arm.name], q=noise(750, 6), grip=noise(750))
    frames = [FrameTrack(name=f"f{i}", poses=noise(750, 12)) for i in range(10)]
    run = attrs.evolve(
        bench,
        duration=30.0,
        stages=(),
        arms=(record,),
        animation=attrs.evolve(bench.animation, fps=25, t=film, arms={arm.name: figure}, frames=frames),
    )

    assert len(run_page(run)) < 3 * MEGABYTE
