"""The page of a studio in a browser: moved by hand, by key and by handle, taught, run, and left alone."""

import re
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from armwright.cell.reader import read_cell
from armwright.studio.page import studio_page
from armwright.studio.workbench import Workbench

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

pytest.importorskip("websockets")
CELL = """\
name = "bench"
[arms.ARM_1]
model = "puma560"
tool = [1, 0, 0,  0, 1, 0,  0, 0, 1,  0, 0, 0.12]
hand = [1, 0, 0,  0,-1, 0,  0, 0,-1,  0.45, -0.15, 0.25]

[frames]  # taught
HIGH = [1, 0, 0,  0,-1, 0,  0, 0,-1,  0.45, 0.1, 0.3]
"""
PROGRAM = (
    "VAR high : FRAME ;\nBEGIN\n  MOVE ARM_1 TO high ;\n  MOVE ARM_1 TO high * XYZ(0, 0, 0.05) STRAIGHTLY ;\nEND.\n"
)


class Opened:
    """A page that is open, and what it asked the network for."""

    def __init__(self, page: Any, address: str, folder: Path) -> None:
        """Open it."""
        self.page, self.folder = page, folder
        self.requests: list[str] = []
        self.errors: list[str] = []
        page.on("request", lambda request: self.requests.append(request.url))
        page.on("pageerror", lambda error: self.errors.append(str(error)))
        page.goto(address)
        self.until(lambda: page.evaluate("Boolean(window.studio?.live.state?.ready)"))

    def until(self, condition: Callable[[], bool]) -> None:
        """Wait for something."""
        for _ in range(300):
            if condition():
                return
            self.page.wait_for_timeout(50)
        raise AssertionError(f"it does not come: {self.state()}")

    def state(self) -> dict[str, Any]:
        """Return the latest state."""
        return self.page.evaluate("studio.live.state")  # type: ignore[no-any-return]

    @property
    def tool(self) -> np.ndarray:
        """The twelve numbers of the pose of the tool."""
        return np.array(self.state()["arms"]["ARM_1"]["tool"])


@pytest.fixture
def opened(browser: Any, tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Opened]:
    """Open the page of a cell, with what a test asks for behind it."""
    (tmp_path / "bench.toml").write_text(CELL + getattr(request, "param", ""))
    (tmp_path / "bench.rlo").write_text(PROGRAM)
    command = [sys.executable, "-m", "armwright", "studio", "bench.toml", "bench.rlo"]
    process = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    page = browser.new_page(viewport={"width": 1200, "height": 800})
    try:
        opened = Opened(page, process.stdout.readline().strip(), tmp_path)
        yield opened
        assert opened.errors == []
        assert all(url.startswith(("http://127.0.0.1:", "data:", "blob:")) for url in opened.requests)
    finally:
        page.close()
        process.terminate()
        process.wait(10)
        process.stdout.close()
    assert process.returncode == 0


def test_moved_by_hand(opened: Opened) -> None:
    """A slider, a number, a handle and a held key move the arm, each in its way; Ctrl Z takes it back."""
    page = opened.page
    first = opened.state()["arms"]["ARM_1"]["q"][0]
    step = float(page.locator("#joint-1").get_attribute("step"))
    page.locator("#joint-1").focus()
    for _ in range(10):
        page.keyboard.press("ArrowRight")
    # A slider stands on a whole number of its steps.
    opened.until(lambda: abs(opened.state()["arms"]["ARM_1"]["q"][0] - first - 10 * step) < step)

    number = page.get_by_role("textbox", name="Joint 2 in °")
    number.fill("-20,5")
    number.press("Enter")
    opened.until(lambda: abs(opened.state()["arms"]["ARM_1"]["q"][1] - np.radians(-20.5)) < 1e-6)

    handles = page.evaluate("studio.gizmo()")
    box = page.locator("#view").bounding_box()
    (start, tip) = next(it["points"] for it in handles if it["kind"] == "move" and it["k"] == 2)
    before = opened.tool
    page.mouse.move(box["x"] + tip["x"], box["y"] + tip["y"])
    page.mouse.down()
    for share in (0.1, 0.2, 0.3, 0.4):
        dx, dy = (share * (start[axis] - tip[axis]) for axis in ("x", "y"))
        page.mouse.move(box["x"] + tip["x"] + dx, box["y"] + tip["y"] + dy)
    page.mouse.up()
    opened.until(lambda: not np.allclose(opened.tool, before, atol=1e-4))
    page.wait_for_timeout(200)
    # Along the approach axis of the tool, and along no other.
    shift = opened.tool[9:] - before[9:]
    np.testing.assert_allclose(np.cross(shift, before[6:9]), 0, atol=1e-6)
    assert shift @ before[6:9] < -1e-3
    np.testing.assert_allclose(opened.tool[:9], before[:9], atol=1e-6)

    dragged = opened.tool
    page.keyboard.press("Control+z")
    opened.until(lambda: np.allclose(opened.tool, before, atol=1e-6))
    assert not np.allclose(dragged, before, atol=1e-6)


@pytest.mark.parametrize("end", ["key", "other window", "hidden"])
def test_a_held_key_is_let_go(opened: Opened, end: str) -> None:
    """A jog lasts as long as its key is held, and no longer than the page is looked at."""
    page = opened.page
    page.locator("#jog button").nth(8).focus()
    before = opened.tool
    page.keyboard.down("Space")
    opened.until(lambda: opened.tool[11] < before[11] - 1e-4 or opened.tool[11] > before[11] + 1e-4)
    if end == "key":
        page.keyboard.up("Space")
    elif end == "other window":
        page.evaluate("window.dispatchEvent(new Event('blur'))")
    else:
        page.evaluate(
            "Object.defineProperty(document, 'hidden', { value: true });"
            "document.dispatchEvent(new Event('visibilitychange'))"
        )
    page.wait_for_timeout(300)
    at = opened.tool
    page.wait_for_timeout(300)
    np.testing.assert_array_equal(opened.tool, at)


def test_teach_and_save(opened: Opened) -> None:
    """A frame is taught, its change shown, and written with the comments of the file when that is asked for."""
    page, file = opened.page, opened.folder / "bench.toml"
    page.get_by_role("tab", name="Teach").click()
    page.get_by_role("textbox", name="Name", exact=True).fill("pick")
    page.get_by_role("button", name="Teach and insert").click()
    opened.until(lambda: "PICK" in opened.state()["around"]["frames"])

    assert "+PICK" in page.locator("#change").inner_text()
    assert "MOVE ARM_1 TO PICK" in page.locator("#text").input_value()
    assert file.read_text() == CELL
    page.get_by_role("button", name="Save the cell file").click()
    opened.until(lambda: opened.state()["file"]["change"] == "")
    assert "[frames]  # taught" in file.read_text()
    np.testing.assert_allclose(read_cell(file).tree().world("PICK")[:3, 3], opened.tool[9:], atol=1e-6)
    page.locator("#save-program").click()
    opened.until(lambda: "PICK" in (opened.folder / "bench.rlo").read_text())


def test_run_to_a_breakpoint_and_back(opened: Opened) -> None:
    """A program runs to its breakpoint; after a step on and one back the arm stands as before, to the bit."""
    page = opened.page
    page.get_by_role("button", name="Breakpoint in line 4").click()
    page.locator("#pace").select_option("4")
    page.locator("#run").click()
    opened.until(lambda: (opened.state()["run"] or {}).get("reason") == "breakpoint")
    assert "breakpoint" in page.locator("#run-text").inner_text()
    assert page.locator("#gutter .now").inner_text() == "4"
    there = opened.state()["arms"]["ARM_1"]["q"]
    page.locator("#step").click()
    opened.until(lambda: opened.state()["arms"]["ARM_1"]["q"] != there and not opened.state()["run"]["playing"])
    page.locator("#back").click()
    opened.until(lambda: opened.state()["arms"]["ARM_1"]["q"] == there)
    assert page.locator("#text").get_attribute("readonly") is not None
    page.locator("#stop").click()
    opened.until(lambda: opened.state()["run"] is None)


def test_the_editor(opened: Opened) -> None:
    """What is typed is checked, underlined and explained; a fix is one click."""
    page = opened.page
    page.locator("#text").fill(PROGRAM.replace("high * XYZ", "hihg * XYZ"))
    opened.until(lambda: any(it["severity"] == "error" for it in opened.state()["program"]["diagnostics"]))
    opened.until(lambda: page.locator("#colours .wavy").count() > 0)
    assert page.locator("#colours .wavy.error").first.inner_text() == "hihg"
    assert page.locator("#run").is_disabled()
    page.locator("#text").fill(PROGRAM.replace("TO high ;", "TO high"))
    page.get_by_role("button", name="Fix").first.click()
    opened.until(lambda: not opened.state()["program"]["diagnostics"])
    assert page.locator("#text").input_value().replace(" ", "") == PROGRAM.replace(" ", "")
    see_modules(opened)


def see_modules(opened: Opened) -> None:
    """Modules are shown below the program, with colours and breakpoints, and open where a run stands in them."""
    page = opened.page
    (opened.folder / "lib").mkdir()
    module = "MODULE ways ;\nPROCEDURE up ;\nBEGIN\n  PAUSE 0.1 ;\nEND ;\nEND.\n"
    (opened.folder / "lib" / "ways.rlo").write_text(module)
    page.locator("#text").fill('IMPORT "lib/ways.rlo" ;\nCONST n = 1 ;\nBEGIN\n  PRINT(n) ; up() ;\nEND.\n')
    opened.until(lambda: page.locator("#modules summary").count() == 1)
    assert page.locator("#colours .declaration").all_inner_texts() == ["IMPORT", "CONST"]
    page.locator("#modules summary").click()
    opened.until(lambda: page.locator("#modules .declaration").all_inner_texts() == ["MODULE", "PROCEDURE"])
    page.get_by_role("button", name="Breakpoint in line 4 of lib/ways.rlo").click()
    opened.until(lambda: page.locator("#modules [aria-pressed=true]").count() == 1)
    page.locator("#modules summary").click()
    page.locator("#run").click()
    opened.until(lambda: (opened.state()["run"] or {}).get("reason") == "breakpoint")
    opened.until(lambda: page.locator("#modules .now").count() == 1)
    assert page.locator("#modules .now").inner_text() == "4"
    assert "in line 4 of lib/ways.rlo" in page.locator("#run-text").inner_text()
    page.locator("#stop").click()
    opened.until(lambda: opened.state()["run"] is None)


def test_a_lost_server(opened: Opened) -> None:
    """Without its connection the page says so, and nothing can be moved; when it is back the page goes on."""
    page = opened.page
    page.evaluate("studio.live.socket.close()")
    opened.until(lambda: "lost" in page.locator("#link").inner_text())
    opened.until(lambda: page.locator("#link").inner_text() == "")
    page.locator("#joint-1").focus()
    page.keyboard.press("End")
    opened.until(lambda: opened.state()["arms"]["ARM_1"]["q"][0] > 2.0)


def test_completion(opened: Opened) -> None:
    """While a word is typed the words that fit are listed; Enter takes one, Escape none; F1 tells what stands there."""
    page = opened.page
    text = page.locator("#text")
    text.click()
    page.keyboard.press("Control+Home")
    for _ in range(2):
        page.keyboard.press("ArrowDown")
    page.keyboard.press("Home")
    page.keyboard.type("  MOVE ARM_1 TO hi")
    page.locator("#completions li").first.wait_for()
    assert page.locator("#completions [aria-selected=true] b").inner_text() == "high"
    page.keyboard.press("Enter")
    assert "  MOVE ARM_1 TO high" in text.input_value()
    assert page.locator("#completions").is_hidden()
    page.keyboard.type(" ;\n")
    opened.until(lambda: not opened.state()["program"]["diagnostics"])
    page.keyboard.type("  MO")
    page.locator("#completions li").first.wait_for()
    page.keyboard.press("Escape")
    assert page.locator("#completions").is_hidden()
    page.keyboard.press("Backspace")
    page.keyboard.press("Backspace")
    opened.until(lambda: not opened.state()["program"]["diagnostics"])
    page.keyboard.press("ArrowDown")
    page.keyboard.press("Home")
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowRight")
    page.keyboard.press("F1")
    page.locator("#description").wait_for()
    assert "MOVE" in page.locator("#description").inner_text()


def test_what_is_kept(opened: Opened, tmp_path: Path) -> None:
    """The view is kept as a video, the run as a page that opens from the disk, a 3-D file and a film."""
    page = opened.page
    page.get_by_role("tab", name="Run").click()
    page.locator("#pace").select_option("4")
    page.locator("#run").click()
    page.locator("#video").click()
    opened.until(lambda: (opened.state()["run"] or {}).get("reason") == "end")
    beginnings = {"Page": b"<!DOCTYPE html>", "3-D file": b"glTF", "GIF": b"GIF8"}
    for name, beginning in beginnings.items():
        with page.expect_download() as kept:
            page.get_by_role("button", name=name, exact=True).click()
        kept.value.save_as(tmp_path / name)
        assert (tmp_path / name).read_bytes().startswith(beginning)
    with page.expect_download() as kept:
        page.get_by_role("button", name="End the video").click()
    kept.value.save_as(tmp_path / "video")
    assert (tmp_path / "video").stat().st_size > 10_000
    assert (tmp_path / "video").read_bytes()[:12].find(b"ftyp") == 4 or (tmp_path / "video").read_bytes()[
        :4
    ] == b"\x1aE\xdf\xa3"


def test_two_pages(opened: Opened, browser: Any) -> None:
    """Two pages show one state; the second may command when the first hands over, and goes on when that is closed."""
    first, other = opened.page, browser.new_page()
    try:
        second = Opened(other, first.url, opened.folder)
        assert "has control" in other.locator("#link").inner_text()
        assert other.locator("#joint-1").is_disabled()
        first.locator("#joint-1").focus()
        first.keyboard.press("End")
        second.until(lambda: second.state()["arms"]["ARM_1"]["q"][0] > 2.0)
        other.get_by_role("button", name="Ask for control").click()
        first.get_by_role("button", name="Hand over").click()
        second.until(lambda: not other.locator("#joint-1").is_disabled())
        opened.until(lambda: first.locator("#joint-1").is_disabled())
    finally:
        other.close()
    opened.until(lambda: not first.locator("#joint-1").is_disabled())


def test_compared(opened: Opened) -> None:
    """Two motions of a program stand beside one another, each with its chart."""
    page = opened.page
    page.get_by_role("tab", name="Run").click()
    page.locator("#pace").select_option("4")
    for speed in (100, 50):
        page.locator("#text").fill(PROGRAM.replace("TO high ;", f"TO high WITH SPEED = {speed} ;"))
        opened.until(lambda: page.evaluate("!studio.live.awaiting && !studio.live.queue.size"))
        opened.until(lambda: not page.locator("#run").is_disabled())
        page.locator("#run").click()
        opened.until(lambda: (opened.state()["run"] or {}).get("reason") == "end")
        page.locator("#keep-motion").click()
        opened.until(lambda: not page.locator("#keep-motion").is_disabled())
        page.locator("#stop").click()
        opened.until(lambda: opened.state()["run"] is None)
    heads = page.locator("#compare-figures thead th").all_inner_texts()
    assert [head[:2] for head in heads] == ["", "A:", "B:", "B "]
    drawn = """(id) => {
        const field = document.getElementById(id);
        const pixels = field.getContext("2d").getImageData(0, 0, field.width, field.height).data;
        return new Set(new Uint32Array(pixels.buffer)).size;
    }"""
    assert min(page.evaluate(drawn, f"compare-chart-{k}") for k in (0, 1)) > 20
    durations = page.locator("#compare-figures tbody tr").first.locator("td").all_inner_texts()
    assert float(durations[0].split()[0]) < float(durations[1].split()[0])


_UNNAMED = """() => [...document.querySelectorAll("button, input, select, textarea, canvas, [role=tab], [role=switch]")]
    .filter((it) => it.checkVisibility() && !(it.ariaLabel || it.textContent.trim() || it.labels?.length || it.title))
    .map((it) => it.outerHTML.slice(0, 120))"""


@pytest.mark.parametrize(("width", "height"), [(1024, 768), (390, 844), (1280, 800)])
def test_small_screens_and_names(opened: Opened, width: int, height: int) -> None:
    """On every screen nothing sticks out to the side, and every control has a name for screen readers."""
    page = opened.page
    page.set_viewport_size({"width": width, "height": height})
    for panel in ("Move", "Teach", "Cell", "Run"):
        page.get_by_role("tab", name=panel).click()
        page.wait_for_timeout(50)
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth"), panel
        assert page.evaluate(_UNNAMED) == [], panel


def test_by_keyboard_alone(opened: Opened) -> None:
    """A frame is jogged to, taught, put into a program and driven to without a pointer."""
    page = opened.page

    def tab_to(name: str) -> None:
        for _ in range(120):
            page.keyboard.press("Tab")
            focused = (
                "document.activeElement.ariaLabel || document.activeElement.textContent || document.activeElement.id"
            )
            if page.evaluate(focused) == name:
                return
        raise AssertionError(f"Tab does not come to {name}")

    before = opened.tool
    tab_to("Joint 1 up")
    page.keyboard.down("Enter")
    opened.until(lambda: np.linalg.norm(opened.tool - before) > 1e-2)
    page.keyboard.up("Enter")
    page.get_by_role("tab", name="Move").focus()
    page.keyboard.press("ArrowRight")
    tab_to("teach-name")
    page.keyboard.press("Control+a")
    page.keyboard.type("corner")
    tab_to("Teach and insert")
    page.keyboard.press("Enter")
    opened.until(lambda: "CORNER" in opened.state()["around"]["frames"])
    assert "TO CORNER" in page.locator("#text").input_value()
    page.keyboard.press("F5")
    opened.until(lambda: opened.state()["run"] is not None)
    page.keyboard.press("Shift+F5")
    opened.until(lambda: opened.state()["run"] is None)


def test_view_from_above(opened: Opened) -> None:
    """The buttons of the view turn the camera and bring the arm into the picture, and say nothing else."""
    page, points = opened.page, lambda: [it["points"][0] for it in page.evaluate("studio.gizmo()")]
    first = points()
    page.get_by_role("button", name="Top", exact=True).click()
    opened.until(lambda: points() != first)
    number = page.get_by_role("textbox", name="Joint 1 in °")
    number.fill("150")
    number.press("Enter")
    opened.until(lambda: abs(opened.state()["arms"]["ARM_1"]["q"][0] - np.radians(150)) < 1e-6)
    page.get_by_role("button", name="Front", exact=True).click()
    page.wait_for_timeout(200)
    box = page.locator("#view").bounding_box()
    assert all(0 < it["x"] < box["width"] and 0 < it["y"] < box["height"] for it in points())
    # The handles are drawn with the view, whatever has it drawn: nothing but the tip of an arrow is blue there.
    tip = next(it["points"][1] for it in page.evaluate("studio.gizmo()") if (it["kind"], it["k"]) == ("move", 2))
    shade = "([x, y]) => [...document.getElementById('view').getContext('2d').getImageData(x, y, 1, 1).data]"
    red, _, blue, _ = page.evaluate(shade, [tip["x"] + 5, tip["y"]])
    assert blue > red + 60
    assert page.locator("#warnings .error").count() == 0


def test_names_of_the_script() -> None:
    """All scripts of the page are one: a function that has the name of another would take its place."""
    cell = read_cell(Path(__file__).parents[2] / "examples" / "vision_cell.toml")
    page = studio_page(Workbench(cell), token="t", policy="p")
    names = re.findall(r"^(?:async )?function (\w+)", page, re.MULTILINE)
    assert len(names) > 100
    assert [name for name, count in Counter(names).items() if count > 1] == []


def test_the_page_is_small(tmp_path: Path) -> None:
    """Without meshes the page has less than 150 kB, scripts, style and data of two arms together."""
    second = CELL[CELL.index("[arms.ARM_1]") : CELL.index("[frames]")].replace("ARM_1", "ARM_2")
    base = "base = [1, 0, 0,  0, 1, 0,  0, 0, 1,  2, 0, 0]\n"
    (tmp_path / "bench.toml").write_text(CELL + second.replace("hand = ", base + "hand = ").replace("0.45,", "2.45,"))
    page = studio_page(Workbench(read_cell(tmp_path / "bench.toml")), token="t", policy="p")
    assert len(page.encode()) < 150_000


@pytest.mark.parametrize("opened", ["[inputs]\nDOOR = {}\nLEVEL = { analogue = true, start = 2 }\n"], indirect=True)
def test_inputs_are_set_on_the_page(opened: Opened) -> None:
    """A digital input has a switch, an analogue one a number; both have names, and the keyboard sets them."""
    page = opened.page
    page.get_by_role("tab", name="Cell").click()
    switch, number = page.get_by_role("switch", name="DOOR"), page.get_by_label("LEVEL")
    assert (switch.get_attribute("aria-checked"), number.input_value()) == ("false", "2")
    switch.focus()
    page.keyboard.press("Space")
    opened.until(lambda: opened.state()["inputs"]["DOOR"]["value"] == 1.0)
    assert switch.get_attribute("aria-checked") == "true"
    page.keyboard.press("Tab")
    page.keyboard.type("7.5")
    page.keyboard.press("Enter")
    opened.until(lambda: opened.state()["inputs"]["LEVEL"]["value"] == 7.5)
    assert page.locator("#inputs-card").get_attribute("aria-label") == "Inputs"
