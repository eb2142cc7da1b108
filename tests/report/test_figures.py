"""Texts of a user's in figures: letters, and never a formula."""

import warnings

import numpy as np
import pytest

from armwright.report import clearance_figures, move_figures
from armwright.report.figures import bar_chart, curves, empty_figure, figure_title, plain_label

# What is no formula, with a tab and an end of line, what a terminal obeys, half a letter, and a page of letters.
STRANGE = "$x_{$\t$\\frac\n\x1b[31m\ud800" + "a" * 100_000


def test_literal() -> None:
    """Dollars stay dollars, blanks blanks; what is no letter becomes a mark, and a page is cut."""
    assert plain_label("a $ b") == r"a \$ b"
    assert plain_label("a\tb\nc") == "a b c"
    assert plain_label("\x1b\ud800") == "\N{REPLACEMENT CHARACTER}" * 2
    assert len(plain_label("a" * 1000)) < 200


def test_long_title() -> None:
    """A title longer than a figure is wide stands in lines, none of which is cut before the third."""
    figure, title = empty_figure((6.4, 4.0)), "five-bar, y1: path of the tool, approach vectors, with joint clearance"

    assert figure_title(figure, title).replace("\n", " ") == title
    assert max(map(len, figure_title(figure, title).split("\n"))) < len(title)
    assert figure_title(figure, "short $1") == r"short \$1"
    assert len(figure_title(figure, "a " * 10_000)) < 200


@pytest.mark.parametrize("what", ["curves", "bars", "panels", "path", "surface", "lines", "paths"])
def test_strange_texts(what: str) -> None:
    """No title and no name of a user's is taken for a formula, and none has a character that no font has."""
    x = np.linspace(0, 1, 5)
    X = np.tile(np.eye(4), (5, 1, 1))
    X[:, 0, 3] = x
    plane = np.stack([x, x], axis=1)
    draw = {
        "curves": lambda: curves(STRANGE, x, {STRANGE: x, "b": x}, x_label="s", y_label="m"),
        "bars": lambda: bar_chart(STRANGE, ["a"], {STRANGE: [1.0]}, y_label="m"),
        "panels": lambda: move_figures.panels(
            STRANGE, x, [move_figures.Panel(STRANGE, "m", {STRANGE: x})], marks={STRANGE: 0.5}
        ),
        "path": lambda: move_figures.path_figure(STRANGE, X, {STRANGE: np.zeros(3)}),
        "surface": lambda: clearance_figures.surface(STRANGE, x, x, np.outer(x, x), ("a", "b", "c")),
        "lines": lambda: clearance_figures.spectrum_figure(STRANGE, x, {STRANGE: x}, "mm"),
        "paths": lambda: clearance_figures.paths(STRANGE, {STRANGE: {STRANGE: plane}}, np.zeros((1, 2))),
    }[what]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert "<svg" in draw()
