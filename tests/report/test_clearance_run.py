"""The report of a linkage with play: its numbers, its table, its figures, and its page in a real browser."""

import csv
from functools import cache
from pathlib import Path
from typing import Any

import attrs
import numpy as np
import pytest

from armwright.clearance.assessment import ClearanceRun
from armwright.clearance.five_bar import FiveBar
from armwright.clearance.ideal import tip_position
from armwright.clearance.linkage import BodyPoint, Pin
from armwright.clearance.paths import constant_speed_path, thesis_path
from armwright.clearance.reader import load_linkage
from armwright.clearance.scenario import Scenario, prepare_scenario
from armwright.clearance.settings import Settings
from armwright.clearance.simulation import Simulation, Status, simulate
from armwright.errors import ShapeError
from armwright.report.clearance_run_figures import clearance_run_figures, magnification, round_number
from armwright.report.clearance_run_files import samples_csv
from armwright.report.clearance_run_page import animation_data, clearance_run_page
from armwright.report.five_bar_figure import scenario_workspace, workspace_figure

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

# The page writes five significant digits.
FIVE_DIGITS = 0.5e-4
# The books of a run in steps of 1e-5 s close to this [J], with 11 J that go through them.
BOOKS = 2e-4
MEGABYTE = 1e6


@pytest.fixture(scope="module")
def task() -> Scenario:
    return prepare_scenario(load_linkage("five-bar"), thesis_path("y1"))


@pytest.fixture(scope="module")
def simulation(task: Scenario) -> Simulation:
    return simulate(task)


@pytest.fixture(scope="module")
def run(simulation: Simulation) -> ClearanceRun:
    return ClearanceRun.of(simulation)


@pytest.fixture(scope="module")
def cranked() -> dict[str, ClearanceRun]:
    """Return runs of the linkages of which one drive turns, half a turn each."""
    found = {}
    for name, speed in (("slider-crank", 60.0), ("four-bar", 12.0)):
        linkage = load_linkage(name)
        at = linkage.assembly[linkage.drives[0].body]
        path = constant_speed_path("half a turn", at, speed, np.pi / speed)
        found[name] = ClearanceRun.of(simulate(prepare_scenario(linkage, path, Settings(start="centred"))))
    return found


def diverged(simulation: Simulation) -> ClearanceRun:
    """Return a run whose numbers became infinite after 500 samples."""
    q = simulation.q.copy()
    q[500:] = np.nan
    error = np.where(np.isnan(q[:, :1]), np.nan, simulation.error)
    peaks = np.array([np.inf, *simulation.peaks[1:]])
    return ClearanceRun.of(attrs.evolve(simulation, q=q, error=error, peaks=peaks, status=np.array(Status.DIVERGED)))


@cache
def run_page_data(run: ClearanceRun) -> str:
    return clearance_run_page(
        run, clearance_run_figures(run), title="A & B", command="armwright clearance simulate <x>"
    )


# ---- numbers -------------------------------------------------------------------------------------------------------


def test_summary(run: ClearanceRun) -> None:
    """The summary has the error of the thesis' start, the peaks of the run, and books that close."""
    told = run.as_data()

    start = told["targets"][0]
    # Table of the thesis: 0.2893 mm to the side; straight down by statics.
    assert (start["error_x"] * 1e3, start["error_y"] * 1e3) == pytest.approx((0.2893, -0.9059), abs=5e-5)
    assert told["targets"][-1]["time"] == pytest.approx(0.25)
    assert [pin["peak_force"] for pin in told["pins"].values()] == run.simulation.peaks.tolist()
    assert all(pin["mean_force"] < pin["peak_force"] for pin in told["pins"].values())
    energy = told["energy"]
    held = energy["kinetic_change"] + energy["potential_change"] + energy["stored_change"]
    lost = energy["impact_loss"] + energy["friction_loss"]
    assert energy["driven"] == pytest.approx(held + lost, abs=BOOKS)
    assert energy["imbalance"] < BOOKS
    assert told["error"]["amp_dc"] == pytest.approx(2 * told["error"]["mean"], rel=1e-9)
    assert run.notes == []


def test_nearest_approach(run: ClearanceRun) -> None:
    """No target is nearer at its time than at the nearest approach."""
    for one in run.as_data()["targets"]:
        assert one["nearest"] <= one["distance"] + 1e-12


def test_peak_lies_in_the_wall(run: ClearanceRun) -> None:
    """Where a journal presses it is in the wall, and where it flies it presses on nothing."""
    forces = run.simulation.forces

    assert np.all(run.depths[forces > 0] > 0)
    assert np.all(forces[run.depths < 0] == 0)


def test_samples_table(run: ClearanceRun) -> None:
    """The table has a row per sample, and every column but none of its numbers tells its unit."""
    rows = list(csv.reader(samples_csv(run)))

    assert len(rows) == 1 + len(run.time)
    table = {name: np.array([float(row[i]) for row in rows[1:]]) for i, name in enumerate(rows[0])}
    assert all(name.rpartition("_")[2] in {"s", "m", "rad", "m/s", "rad/s", "N", "J"} for name in table)
    np.testing.assert_allclose(table["error_m"], np.hypot(table["error_x_m"], table["error_y_m"]), rtol=1e-8)
    gap = np.hypot(table["J3.gap_x_m"], table["J3.gap_y_m"])
    np.testing.assert_allclose(gap - 0.5e-3, table["J3.depth_m"], atol=1e-12)
    np.testing.assert_allclose(table["tip_y_m"], run.simulation.tip[:, 1], rtol=1e-9)


def test_diverged_run(simulation: Simulation) -> None:
    """A run that diverged is told as far as it is sound, and the reader is told so."""
    run = diverged(simulation)

    assert run.as_data()["status"] == "diverged"
    assert run.as_data()["pins"]["J2"]["peak_force"] is None
    assert len(list(samples_csv(run))) == 1 + 500
    assert "shown until" in run.notes[0]
    assert "diverged" in run_page_data(run)
    assert len(clearance_run_figures(run)) == 6


def test_books_that_do_not_close(simulation: Simulation) -> None:
    """Of energy that nobody can explain the reader is told, with the step that lost it."""
    works = {
        **simulation.works,
        "impact loss": simulation.works["impact loss"] + np.linspace(0, 1, len(simulation.time)),
    }

    said = ClearanceRun.of(attrs.evolve(simulation, works=works)).notes

    assert len(said) == 1
    assert said[0].startswith("the energy balance lacks 1 J beside ")
    assert "1e-05 s" in said[0]


def test_many_runs_are_refused(task: Scenario) -> None:
    """A report is of one run: of several one is to be taken out."""
    both = simulate(task, [[5e-4] * 3, [4e-4] * 3])
    with pytest.raises(ShapeError, match=r"expected one run, got \(2,\)"):
        ClearanceRun.of(both)


# ---- figures -------------------------------------------------------------------------------------------------------


def test_figures(run: ClearanceRun) -> None:
    """Path, bearings, error, spectrum, forces and energy are drawn, the same for the same run."""
    drawn = clearance_run_figures(run)

    assert [one.name for one in drawn] == ["path", "bearings", "error", "spectrum", "forces", "energy"]
    assert all(one.svg.startswith("<?xml") and len(one.caption) > 20 for one in drawn)
    assert [one.svg for one in clearance_run_figures(run)] == [one.svg for one in drawn]


def test_magnification(run: ClearanceRun) -> None:
    """The error is magnified by a round number that keeps it below a fifth of the path."""
    times = magnification(run)

    assert times == round_number(times)
    assert times * run.distance.max() <= 0.2 * 0.3 < 2.5 * times * run.distance.max()


@pytest.mark.parametrize(("x", "round_one"), [(0.3, 1), (1, 1), (4.99, 2), (5, 5), (99, 50), (100, 100), (730, 500)])
def test_round_numbers(x: float, round_one: float) -> None:
    """1, 2, 5, 10 ... are round."""
    assert round_number(x) == round_one


def test_workspace(task: Scenario, run: ClearanceRun, cranked: dict[str, ClearanceRun]) -> None:
    """The workspace of a five-bar is drawn in the mode in which it stands, of no other linkage at all."""
    assert run.simulation.scenario is task
    drawn = scenario_workspace(task)

    assert drawn is not None
    assert "elbows out" in drawn.caption
    assert scenario_workspace(cranked["four-bar"].simulation.scenario) is None
    for mode in ("left", "in"):
        assert (
            workspace_figure(FiveBar(motors=[[-0.45, 0], [0.45, 0]], cranks=[0.3, 0.3], rods=[0.4, 0.4]), mode).svg
            != drawn.svg
        )


# ---- the film ------------------------------------------------------------------------------------------------------


def test_film(run: ClearanceRun) -> None:
    """The film puts every point where the linkage has it: without play on the path, with play off by the error."""
    shown = animation_data(run)

    rows = len(shown["t"])
    tip = shown["points_m"].reshape(rows, -1, 2)[:, shown["tip"]]
    np.testing.assert_allclose(tip, shown["path_m"], atol=1e-12)
    shift = shown["shifts_um"].reshape(rows, -1, 2)[:, shown["tip"]]
    np.testing.assert_allclose(shift, shown["error_um"], atol=1e-6)
    for i, pin in enumerate(shown["pins"]):
        ends = [shown["shifts_um"].reshape(rows, -1, 2)[:, pin[name]] for name in ("journal", "bearing")]
        np.testing.assert_allclose(ends[0] - ends[1], shown["gaps_um"][:, 2 * i : 2 * i + 2], atol=1e-6)


def test_long_runs_are_thinned(simulation: Simulation) -> None:
    """A long run keeps few rows, but no blow is lost between two of them."""
    times = 5
    long = {
        name: np.concatenate([getattr(simulation, name)] * times)
        for name in ("q", "qd", "tip", "error", "forces")
    }  # fmt: skip
    works = {name: np.concatenate([track] * times) for name, track in simulation.works.items()}
    time = np.linspace(0, times * 0.25, len(long["q"]))
    ideal = attrs.evolve(simulation.scenario.ideal, q=np.concatenate([simulation.scenario.ideal.q] * (times + 1)))
    run = ClearanceRun.of(
        attrs.evolve(
            simulation, **long, works=works, time=time, scenario=attrs.evolve(simulation.scenario, ideal=ideal)
        )
    )

    shown = animation_data(run)

    assert len(shown["t"]) <= 2601
    assert shown["t"][-1] == time[-1]
    assert np.array_equal(shown["forces_N"].max(axis=0), simulation.forces.max(axis=0))


def test_page_carries_all(run: ClearanceRun) -> None:
    """The page names no address, no text on it is taken for HTML, and it stays below three megabytes."""
    page = run_page_data(run)

    assert len(page) < 3 * MEGABYTE
    assert "<x>" not in page
    assert "<h1>A &amp; B</h1>" in page
    for scheme in ("http://", "https://", "//cdn"):
        assert scheme not in page
    for name in run.simulation.scenario.linkage.clearances:
        assert f"<td>{name}</td>" in page


@pytest.mark.parametrize("name", ["slider-crank", "four-bar"])
def test_other_linkages(cranked: dict[str, ClearanceRun], name: str) -> None:
    """A slider-crank has a rail and a four-bar none; both have one motor on the ground and one bearing."""
    run = cranked[name]
    shown = animation_data(run)

    assert len(shown["rails"]) == (1 if name == "slider-crank" else 0)
    assert shown["motors"] == [[0.0, 0.0]]
    assert len(shown["pins"]) == 1
    task = run.simulation.scenario
    ideal = tip_position(task.linkage, task.ideal.q)[:: task.stride]
    np.testing.assert_allclose(shown["path_m"][[0, -1]], ideal[[0, -1]], atol=1e-12)
    # Its path has no goal of the tip but the start.
    assert [one["time"] for one in run.as_data()["targets"]] == [0.0]


def test_bearing_in_the_ground() -> None:
    """A bearing in the ground has a place on it, and moves with no body."""
    linkage = load_linkage("four-bar")
    joints = [*linkage.joints[:2], Pin(body="rocker", point="B", on=BodyPoint("coupler", "B"))]
    pin = attrs.evolve(linkage.pins[0], name="C$", bearing=BodyPoint("ground", "C"), journal=BodyPoint("rocker", "C"))
    other = attrs.evolve(linkage, joints=joints, pins=[pin])
    path = constant_speed_path("a little", linkage.assembly["crank"], 12.0, 0.05)

    run = ClearanceRun.of(simulate(prepare_scenario(other, path, Settings(start="centred"))))

    (shown,) = animation_data(run)["pins"]
    assert shown["bearing"] == [0.3, 0.0]
    assert isinstance(shown["journal"], int)
    assert all(one.svg for one in clearance_run_figures(run))


# ---- in a browser --------------------------------------------------------------------------------------------------


class Opened:
    """An opened page, and everything it complained about or asked the network for."""

    def __init__(self, browser: Any, file: Path) -> None:
        self.said: list[str] = []
        self.page = browser.new_page(viewport={"width": 1280, "height": 900})
        self.page.on("console", lambda message: self.said.append(message.text))
        self.page.on("pageerror", lambda error: self.said.append(str(error)))
        self.page.on("request", lambda request: self.said.append(request.url) if request.url != file.as_uri() else None)
        self.page.goto(file.as_uri())

    def state(self) -> dict[str, Any]:
        """Ask the page where it stands."""
        return dict(self.page.evaluate("armwright.state()"))

    def seek(self, t: float) -> None:
        """Move the slider as a hand does."""
        self.page.evaluate(
            "t => { const s = document.getElementById('time'); s.value = t; s.dispatchEvent(new Event('input')); }", t
        )

    def pixels(self, selector: str) -> str:
        """Return what a canvas shows, as the text of a picture."""
        return str(self.page.evaluate("s => document.querySelector(s).toDataURL()", selector))


def written(file: Path, run: ClearanceRun) -> Path:
    """Write the page of a run."""
    file.write_text(run_page_data(run), encoding="utf-8")
    return file


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory, run: ClearanceRun) -> Path:
    return written(tmp_path_factory.mktemp("page") / "report.html", run)


@pytest.fixture
def opened(browser: Any, report: Path) -> Any:
    shown = Opened(browser, report)
    yield shown
    shown.page.close()


@pytest.mark.browser
def test_opens_from_the_disk(opened: Opened) -> None:
    """The page opens without a complaint and asks the network for nothing but pictures that it carries itself."""
    assert [text for text in opened.said if not text.startswith("data:image/svg+xml")] == []
    assert opened.page.locator(".bearing").count() == 3
    assert opened.page.locator(".chart").count() == 4


@pytest.mark.browser
@pytest.mark.parametrize("t", [0.0, 0.1, 0.2213, 0.25])
@pytest.mark.drawn(0.34)
def test_shows_the_moment(opened: Opened, run: ClearanceRun, t: float) -> None:
    """At every moment the page shows the error, the gaps and what flies as the simulation has it."""
    opened.seek(t)
    seen = opened.state()

    row = round(t / 1e-4)
    assert seen["time"] == pytest.approx(t, abs=1e-6)
    np.testing.assert_allclose(seen["error"], run.error[row], atol=FIVE_DIGITS * 1e-3)
    np.testing.assert_allclose(seen["gaps"], run.gaps[row].ravel(), atol=FIVE_DIGITS * 1e-3)
    assert seen["flies"] == (run.depths[row] < 0).tolist()
    text = opened.page.locator("#now").inner_text()
    assert f"{run.distance[row] * 1e3:.3f} mm" in text
    assert text.count("flies") == np.count_nonzero(run.depths[row] < 0)


@pytest.mark.browser
def test_plays(opened: Opened) -> None:
    """Play moves everything, slowly enough to see a quarter of a second; the space bar stops it."""
    before = [opened.pixels("#view"), opened.pixels(".bearing canvas")]
    assert opened.state()["rate"] < 0.1

    opened.page.locator("#play").click()
    for _ in range(500):
        if opened.state()["time"] > 0.002:
            break
        opened.page.wait_for_timeout(20)
    opened.page.locator("#play").blur()
    opened.page.keyboard.press(" ")

    assert opened.state()["playing"] is False
    assert opened.state()["time"] > 0.002
    assert [opened.pixels("#view"), opened.pixels(".bearing canvas")] != before


@pytest.mark.browser
def test_magnifies(opened: Opened) -> None:
    """Another magnification draws the linkage otherwise, and the bearings as before."""
    view, bearing = opened.pixels("#view"), opened.pixels(".bearing canvas")

    opened.page.locator("#magnify").select_option("1")

    assert opened.state()["magnification"] == 1
    assert opened.pixels("#view") != view
    assert opened.pixels(".bearing canvas") == bearing


@pytest.mark.browser
def test_charts_lead(opened: Opened) -> None:
    """A click into the middle of a chart goes to the middle of the run, and the cursor of each chart is there."""
    chart = opened.page.locator(".plot").nth(1)
    chart.scroll_into_view_if_needed()
    box = chart.bounding_box()

    opened.page.mouse.click(box["x"] + (50 + box["width"] - 10) / 2, box["y"] + 40)

    assert opened.state()["time"] == pytest.approx(0.125, abs=0.002)
    places = opened.page.evaluate(
        "[...document.querySelectorAll('.plot > .cursor:first-of-type')].map(c => c.style.left)"
    )
    assert len(set(places)) == 1
    assert opened.page.locator(".tip:visible").inner_text().count(" N") == 3


@pytest.mark.browser
@pytest.mark.parametrize("name", ["slider-crank", "four-bar"])
@pytest.mark.drawn(0.34)
def test_other_pages(browser: Any, tmp_path: Path, cranked: dict[str, ClearanceRun], name: str) -> None:
    """The pages of slider-crank and four-bar open, and end where their runs end."""
    shown = Opened(browser, written(tmp_path / f"{name}.html", cranked[name]))
    shown.page.keyboard.press("End")

    assert shown.state()["time"] == pytest.approx(cranked[name].time[-1], rel=1e-6)
    assert [text for text in shown.said if not text.startswith("data:image/svg+xml")] == []
    shown.page.close()


@pytest.mark.browser
def test_diverged_page(browser: Any, tmp_path: Path, simulation: Simulation) -> None:
    """The page of a run that diverged ends where it was last sound, and says so."""
    shown = Opened(browser, written(tmp_path / "diverged.html", diverged(simulation)))

    shown.page.keyboard.press("End")

    assert shown.state()["time"] == pytest.approx(0.0499, abs=1e-6)
    assert shown.page.locator("#status").inner_text() == "diverged"
    assert [text for text in shown.said if not text.startswith("data:image/svg+xml")] == []
    shown.page.close()


@pytest.mark.browser
def test_page_on_a_phone(opened: Opened, run: ClearanceRun) -> None:
    """On a phone nothing is wider than the screen, and all bearings are seen at once; wide, they share one column."""
    shown = opened.page
    shown.set_viewport_size({"width": 390, "height": 800})
    assert shown.evaluate("document.documentElement.scrollWidth <= innerWidth")
    assert shown.locator("#bearings").bounding_box()["height"] < 450

    shown.set_viewport_size({"width": 1280, "height": 900})
    boxes = [shown.locator(".bearing").nth(i).bounding_box() for i in range(3)]
    assert len({(box["x"], box["width"]) for box in boxes}) == 1
    data = run.as_data()
    tiles = shown.locator(".headline b").all_inner_texts()
    assert tiles[0] == f"{data['error']['largest'] * 1e3:.4g} mm"
    assert f"{max(pin['peak_force'] for pin in data['pins'].values()):.4g} N" in tiles
    assert "explained" not in shown.content()
