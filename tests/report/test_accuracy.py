"""The page and the figures of an assessment by ISO 9283."""

import html
from pathlib import Path
from typing import Any

import attrs
import numpy as np
import pytest

from armwright.accuracy.assessment import Assessment, assess
from armwright.accuracy.measurement_file import read_measurements
from armwright.report import accuracy_figures
from armwright.report.accuracy_figures import accuracy_drawings
from armwright.report.accuracy_files import accuracy_files

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

NAME = r"P<1>&$\x$"


@pytest.fixture
def everything(tmp_path: Path, rng: np.random.Generator) -> Assessment:
    """One test of every kind, in a plane and in space; the name of the pose is fit neither for HTML nor for figures."""
    noise = iter(rng.normal(scale=0.02, size=10_000))

    def place(x: float, y: float) -> str:
        return f"{x + next(noise):.5f},{y + next(noise):.5f},{next(noise):.5f}"

    poses = ["test,pose,direction,robot,t_h,load_n,cycle,x_mm,y_mm,z_mm"]
    for kind, name in (("pose", NAME), ("distance", "A"), ("distance", "B"), ("drift", NAME)):
        x = 400 if name == "B" else 300
        poses.append(f"{kind},{name},,,,,commanded,{x},0,0")
        for t in (0, 1, 8) if kind == "drift" else ("",):
            poses += [f"{kind},{name},,,{t},,{c},{place(x + 0.1 * (t or 0), 0)}" for c in range(1, 11)]
    poses += [f"multidirectional,{NAME},{d},,,,{c},{place(300, d / 10)}" for d in (1, 2, 3) for c in range(1, 11)]
    poses += [f"exchangeability,{NAME},,r{r},,,{c},{place(300, r / 5)}" for r in range(5) for c in range(1, 11)]
    poses += [
        f"compliance,{NAME},+y,,,{load},{c},{place(300, load / 50)}" for load in range(0, 110, 10) for c in (1, 2)
    ]
    paths = ["test,path,cycle,t_s,speed_mm_per_s,x_mm,y_mm"]
    corners = {"path": ((0, 0), (200, 0)), "cornering": ((0, 0), (200, 0), (200, 200))}
    zigzag = [(2.5 * k, (0, 5, 0, -5)[k % 4]) for k in range(41)]
    for kind, path in (*corners.items(), ("weaving", zigzag)):
        paths += [f"{kind},L,commanded,,{'' if kind == 'cornering' else 100},{x},{y}" for x, y in path]
        for c in (1, 2, 3):
            parts = np.linspace(0, len(path) - 1, 161)
            x, y = (np.interp(parts, range(len(path)), axis) + 0.1 * c for axis in np.array(path).T)
            paths += [f"{kind},L,{c},{k / 80},,{x[k]:.4f},{y[k]:.4f}" for k in range(161)]
    for kind in ("settling", "posing"):
        for c in (1, 2, 3):
            t = np.linspace(0, 1, 101)
            x = 300 - 100 * np.exp(-15 * t) * np.cos(30 * t + 0.1 * c) * (t > 0.02) - 100 * (t <= 0.02)
            paths += [f"{kind},{NAME},{c},{t[k]},,{x[k]:.4f},0" for k in range(101)]
    files = [tmp_path / "poses.csv", tmp_path / "paths.csv"]
    for file, lines in zip(files, (poses, paths), strict=True):
        file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return assess(read_measurements(files), few=True, band=0.5e-3)


def test_every_measure_is_drawn(everything: Assessment) -> None:
    """Every kind of test has its figure, each with words about it; a distance is numbers only."""
    drawn = accuracy_drawings(everything)

    kinds = {one.name.partition("-")[2] for one in drawn}
    assert kinds == {test.kind for test in everything.tests} - {"distance"} | {"velocity"}
    assert len({one.name for one in drawn}) == len(drawn)
    assert all(one.svg.startswith("<?xml") and len(one.caption) > 20 for one in drawn)


def test_symbols(everything: Assessment) -> None:
    """All measures of the standard are there."""
    symbols = {one.symbol for one in everything.measures}

    expected = "AP RP vAP AD RD t OV TP dAP dRP E AT RT AV RV FV CR CO SPL C WS WF"
    assert set(expected.split()) <= symbols


def test_page(everything: Assessment) -> None:
    """The page has a table per test, a row per measure, and what was reduced; no name on it can be taken for HTML."""
    page = accuracy_files(everything, title="A & B", command="armwright iso9283 <x>")["report.html"]

    assert page.count("<tr") == len(list(everything.tables())) + len(everything.measures)
    assert "<1>" not in page
    assert r"P&lt;1&gt;&amp;$\x$" in page
    assert "A &amp; B" in page
    assert "armwright iso9283 &lt;x&gt;" in page
    assert all(html.escape(note) in page for note in everything.notes)
    assert everything.notes[0].startswith("planar reduction: path L, cornering L, weaving L, settling P<1>&")


def test_units_for_people(everything: Assessment) -> None:
    """People read millimetres, degrees and percent, plus and minus where it is one, and how many cycles were asked."""
    by_symbol = {one.symbol: one for one in everything.with_limits({"RV": 0.5, "RD": 1e-9}).measures}

    assert by_symbol["C"].displayed_unit == "mm/N"
    assert float(by_symbol["C"].displayed_value) == pytest.approx(0.02, rel=0.02)
    assert by_symbol["RV"].displayed_value.startswith("± ")
    assert (by_symbol["RV"].displayed_limit, by_symbol["RV"].verdict) == ("50", "holds")
    assert by_symbol["RD"].verdict == "exceeds"
    assert by_symbol["RP"].displayed_cycles == "10 of 30"
    assert by_symbol["t"].displayed_cycles == "3"


def test_poses_are_drawn_on_one_scale(everything: Assessment, monkeypatch: pytest.MonkeyPatch) -> None:
    """The cloud of one pose and one ten times as wide are drawn with axes of one width, equal along x, y and z."""
    pose = everything.tests[0]
    cloud = pose.clouds[0]
    wide = attrs.evolve(cloud, positions=cloud.commanded + 10 * (cloud.positions - cloud.commanded))
    both = assess([pose, attrs.evolve(pose, name="wide", clouds=(wide,))], few=True)
    drawn = []
    monkeypatch.setattr(accuracy_figures, "svg_text", lambda figure, _: drawn.append(figure) or "")

    accuracy_drawings(both)

    planes = [axis for figure in drawn for axis in figure.axes[:2]]
    assert len(planes) == 4
    limits = [limit for axis in planes for limit in (axis.get_xlim(), axis.get_ylim())]
    np.testing.assert_allclose(np.ptp(limits, axis=1), np.ptp(limits[0]))
    assert all(axis.get_aspect() == 1 for axis in planes)
    for axis in planes:
        for line in axis.lines:
            assert np.all((line.get_xdata() > axis.get_xlim()[0]) & (line.get_xdata() < axis.get_xlim()[1]))
    # Below, each cycle has its distance, and the bars count all of them.
    trend, histogram = drawn[0].axes[2:]
    assert len(trend.lines[0].get_ydata()) == len(cloud.positions)
    assert sum(bar.get_width() for bar in histogram.patches) == len(cloud.positions)


@pytest.mark.browser
def test_page_on_a_phone(browser: Any, everything: Assessment, tmp_path: Path) -> None:
    """On a phone nothing is wider than the screen, and the values of all measures are seen without scrolling."""
    file = tmp_path / "report.html"
    files = accuracy_files(everything.with_limits({"AP": 1e-3}), title="A", command="a")
    file.write_text(files["report.html"], encoding="utf-8")
    page = browser.new_page(viewport={"width": 390, "height": 800})
    page.goto(file.as_uri())

    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    rights = page.evaluate(
        "[...document.querySelectorAll('td:nth-child(3)')].map(td => td.getBoundingClientRect().right)"
    )
    assert len(rights) == len(everything.measures)
    assert max(rights) <= 390
    page.close()
