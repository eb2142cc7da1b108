"""The page in a real browser, opened from the disk as a reader opens it."""

import math
import re
from typing import Any

import attrs
import numpy as np
import pytest

from armwright.report.page import ArmRecord, JointInfo, RunPage, StageBadge

pytestmark = [pytest.mark.browser, pytest.mark.early]

# The page carries five significant digits.
DIGITS = 1e-4


def text(visit: Any, selector: str) -> str:
    return str(visit.page.locator(selector).inner_text())


def row_of_line(visit: Any, line: int) -> Any:
    return visit.page.locator(f"#program li:nth-child({line})")


def plain_run(bench: RunPage, **changes: Any) -> RunPage:
    """Leave out everything that can be left out."""
    nothing: dict[str, Any] = {
        "messages": (),
        "effects": (),
        "stages": (),
        "arms": (),
        "animation": None,
        "duration": 0.0,
    }
    return attrs.evolve(bench, **{**nothing, **changes})


def with_joints(record: ArmRecord, **limits: float) -> ArmRecord:
    return attrs.evolve(record, joints=tuple(attrs.evolve(joint, **limits) for joint in record.joints))


def test_quiet_and_alone(visit, bench) -> None:
    """The page says nothing to the console and asks for no file but itself."""
    opened = visit(bench)
    opened.seek(4.0)
    opened.page.locator(".plot").first.hover()

    assert opened.complaints == []
    assert opened.requests == [opened.url]


def test_slider_moves_the_arm(visit, bench) -> None:
    """Another instant is another picture, other joints and another place of the hand."""
    opened = visit(bench)
    opened.seek(0.0)
    before = opened.pixels(), text(opened, "#joints"), text(opened, "#hand")
    opened.seek(3.0)
    after = opened.pixels(), text(opened, "#joints"), text(opened, "#hand")

    assert all(one != other for one, other in zip(before, after, strict=True))


def test_state_is_the_record(visit, bench) -> None:
    """What the page says of an instant is what the record says of it."""
    opened = visit(bench)
    opened.seek(1.234)
    state, arm = opened.state(), bench.arms[0]

    q = [np.interp(1.234, arm.t, arm.q[:, j]) for j in range(6)]
    np.testing.assert_allclose(state["q"], q, atol=DIGITS)
    np.testing.assert_allclose(state["hand"], [np.interp(1.234, arm.t, arm.hand[:, k]) for k in range(3)], atol=DIGITS)
    assert (state["time"], state["line"], state["stage"]) == (1.234, 8, 0)


def test_degrees_and_millimetres(visit, bench) -> None:
    """A reader sees degrees and millimetres, whatever is stored."""
    opened = visit(bench)
    opened.seek(0.0)

    shoulder = math.degrees(bench.arms[0].q[0, 1])
    assert f"{shoulder:.1f}°" in text(opened, "#joints")
    assert "400.0, 0.0, 350.0 mm" in text(opened, "#hand")


def test_program_line_seeks(visit, bench) -> None:
    """A click on a statement goes to where it began, and the statement is marked."""
    opened = visit(bench)
    row_of_line(opened, 12).click()

    assert opened.state()["time"] == pytest.approx(5.1)
    assert "now" in row_of_line(opened, 12).get_attribute("class").split()
    assert text(opened, "#now").startswith("line 12")


def test_statement_without_duration(visit, bench) -> None:
    """A statement that takes no time can be the present one, though a motion begins at the same instant."""
    opened = visit(bench)
    row_of_line(opened, 10).click()

    assert opened.state()["line"] == 10
    opened.seek(2.5)
    assert opened.state()["line"] == 11


def test_lines_that_do_nothing(visit, bench) -> None:
    """A comment is no statement: a click on it goes nowhere."""
    opened = visit(bench)
    opened.seek(4.0)
    row_of_line(opened, 1).click()

    assert opened.state()["time"] == 4.0


def test_executed_lines_are_marked(visit, bench) -> None:
    """At any time exactly the statements begun so far carry the mark of the done."""
    opened = visit(bench)
    opened.seek(2.4)

    done = opened.page.eval_on_selector_all(
        "#program li", "rows => rows.flatMap((r, i) => r.classList.contains('done') ? [i + 1] : [])"
    )
    assert done == [6, 7, 8, 9]


def test_keys(visit, bench) -> None:
    """Arrows step by one picture, Home and End go to the ends, the space bar plays and pauses."""
    opened = visit(bench)
    keys = opened.page.keyboard
    keys.press("ArrowRight")
    keys.press("ArrowRight")
    keys.press("ArrowLeft")
    assert opened.state()["time"] == pytest.approx(1 / 25)
    keys.press("End")
    assert opened.state()["time"] == 9.0
    keys.press("Home")
    assert opened.state()["time"] == 0.0
    keys.press("Space")
    assert opened.state()["playing"]
    opened.until("armwright.state().time > 0.1")
    keys.press("Space")
    assert not opened.state()["playing"]


def test_slider_keys(visit, bench) -> None:
    """An arrow steps one picture with the slider in focus too, not one picture and one step of the slider."""
    opened = visit(bench)
    opened.page.focus("#time")
    opened.page.keyboard.press("ArrowRight")

    assert opened.state()["time"] == pytest.approx(1 / 25)
    assert opened.page.get_attribute("#time", "aria-valuetext") == "0.04 seconds of 9.00, line 8"


def test_playing_ends(visit, bench) -> None:
    """Playing goes on to the last instant and stops there; the next start begins anew."""
    opened = visit(bench)
    opened.page.select_option("#rate", "4")
    opened.seek(8.5)
    opened.page.click("#play")
    opened.until("!armwright.state().playing")
    assert opened.state()["time"] == 9.0

    opened.page.click("#play")
    assert opened.state()["time"] < 5.0


def test_stage_row_seeks(visit, bench) -> None:
    """A click on a stage goes to its beginning and shows the arm that moves in it."""
    opened = visit(bench)
    opened.page.locator("#stages tr").nth(4).click()

    state = opened.state()
    assert (state["time"], state["arm"], state["stage"]) == (5.3, "ARM_2", 4)
    assert text(opened, "#readout-name") == "Joints of ARM_2"


def test_peaks_against_limits(visit, bench) -> None:
    """The table shows the share of the joint nearest to its limit, and marks what is beyond."""
    slow = attrs.evolve(bench, arms=(with_joints(bench.arms[0], speed=0.5), bench.arms[1]))
    opened = visit(slow)

    share = max(bench.stages[0].peak_speed) / 0.5
    cell = opened.page.locator("#stages tr").first.locator("td").nth(8)
    assert cell.inner_text().strip() == f"{100 * share:.0f} %"
    assert cell.get_attribute("class") == "over"
    assert opened.page.locator("#stages tr").nth(4).locator("td").nth(8).get_attribute("class") == ""


def test_chart_seeks(visit, bench) -> None:
    """A click in a chart goes to the instant under the pointer."""
    opened = visit(bench)
    plot = opened.page.locator(".plot").first
    plot.scroll_into_view_if_needed()
    box = plot.bounding_box()
    middle = (50 + box["width"] - 10) / 2
    plot.click(position={"x": middle, "y": box["height"] / 2})

    assert opened.state()["time"] == pytest.approx(4.5, abs=9.0 / box["width"])


def test_chart_tells_units(visit, bench) -> None:
    """Hovering tells every joint with its unit and its share of the limit."""
    opened = visit(bench)
    opened.page.locator(".plot").nth(3).hover()

    lines = text(opened, ".chart:nth-child(4) .tip")
    assert "shoulder" in lines
    assert re.search(r"−?\d+\.\d N m\s+−?\d+ %", lines)


def test_legend_hides_a_joint(visit, bench) -> None:
    """A joint switched off is no longer drawn, and comes back as it was."""
    opened = visit(bench)
    chart = "document.querySelector('.plot canvas').toDataURL()"
    whole = opened.page.evaluate(chart)
    opened.page.locator("#legend button").nth(1).click()
    without = opened.page.evaluate(chart)
    opened.page.locator("#legend button").nth(1).click()

    assert without != whole
    assert opened.page.evaluate(chart) == whole


def test_one_joint_in_its_units(visit, bench) -> None:
    """A single joint is drawn in its own unit, its limit named."""
    opened = visit(bench)
    opened.page.select_option("#scale", "2")

    assert text(opened, ".chart:nth-child(2) h3 span") == f"°/s · limit ±{math.degrees(1.7):.1f}°/s"
    assert opened.complaints == []


def test_tree_follows(visit, bench) -> None:
    """A grasped part hangs on the arm while it is held, and what hangs on the part goes along."""
    opened = visit(bench)
    node = "xpath=//li[div/span[1]='{}']/parent::ul/parent::li/div/span[1]"
    seen = []
    for t in (1.0, 3.0, 6.0):
        opened.seek(t)
        seen.append(tuple(opened.page.locator(node.format(name)).inner_text() for name in ("part", "above")))

    assert seen == [("WORLD", "part"), ("ARM_1", "part"), ("WORLD", "part")]


def test_camera(visit, bench) -> None:
    """Dragging, the wheel with Ctrl and the buttons change the view; Reset brings the first one back."""
    opened = visit(bench)
    pictures = [opened.pixels()]
    box = opened.page.locator("#view").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    opened.page.mouse.move(x, y)
    opened.page.mouse.down()
    opened.page.mouse.move(x + 80, y + 20)
    opened.page.mouse.up()
    pictures.append(opened.pixels())
    opened.page.evaluate("window.before = document.getElementById('view').toDataURL()")
    opened.page.keyboard.down("Control")
    opened.page.mouse.wheel(0, -300)
    opened.page.keyboard.up("Control")
    opened.until("document.getElementById('view').toDataURL() !== window.before")
    pictures.append(opened.pixels())
    for name in ("top", "front", "side"):
        opened.page.click(f"[data-camera={name}]")
        pictures.append(opened.pixels())
    opened.page.click("[data-camera=reset]")

    assert len(set(pictures)) == len(pictures)
    assert opened.pixels() == pictures[0]


@pytest.mark.parametrize("width", [390, 820, 1280])
def test_no_sideways_scrolling(visit, bench, width: int) -> None:
    """On a phone, a tablet and a desk the page is as wide as its window, even with a long command."""
    wordy = attrs.evolve(bench, command="armwright " + "x" * 300, title="t" * 120, status="stopped: " + "y" * 200)
    opened = visit(wordy, viewport={"width": width, "height": 844})

    assert opened.page.evaluate("document.documentElement.scrollWidth") == width


def test_dark_scheme(visit, bench) -> None:
    """Who likes it dark gets another picture, without being asked."""
    light, dark = visit(bench), visit(bench, color_scheme="dark")

    paper = "getComputedStyle(document.body).backgroundColor"
    assert light.page.evaluate(paper) != dark.page.evaluate(paper)
    assert light.pixels() != dark.pixels()
    assert dark.complaints == []


def test_nothing_moved(visit, bench) -> None:
    """A run that takes no time and moves no arm still has a page, without empty charts and tables."""
    opened = visit(plain_run(bench))
    opened.page.click("#play")
    opened.page.keyboard.press("End")

    assert opened.complaints == []
    assert opened.page.is_visible("#view-empty")
    for hidden in ("#charts-card", "#stages-card", "#trace-card", "#tree-card", "#readout"):
        assert not opened.page.is_visible(hidden)
    assert opened.state() == {
        "time": 0,
        "playing": False,
        "arm": None,
        "q": [],
        "hand": None,
        "jog": False,
        "line": None,
        "stage": -1,
    }


def test_empty_program(visit, bench) -> None:
    """A program without a line is said to be empty."""
    opened = visit(plain_run(bench, program_text="\n"))

    assert text(opened, "#program-empty") == "The program is empty."
    assert opened.complaints == []


def test_standing_arm(visit, bench) -> None:
    """An arm with a single instant is shown where it stands."""
    arm = bench.arms[0]
    first = attrs.evolve(arm, t=arm.t[:1], q=arm.q[:1], qd=arm.qd[:1], qdd=arm.qdd[:1], tau=None, hand=arm.hand[:1])
    opened = visit(plain_run(bench, arms=(first,)))

    assert opened.complaints == []
    np.testing.assert_allclose(opened.state()["q"], arm.q[0], atol=DIGITS)
    assert opened.page.locator(".chart:visible").count() == 3  # no effort without dynamics


def test_arm_never_recorded(visit, bench) -> None:
    """An arm without a single instant breaks nothing: it is named, and has no joints to show."""
    arm = bench.arms[0]
    blank = attrs.evolve(
        arm, t=arm.t[:0], q=arm.q[:0], qd=arm.qd[:0], qdd=arm.qdd[:0], tau=arm.tau[:0], hand=arm.hand[:0]
    )
    opened = visit(plain_run(bench, arms=(blank,), duration=1.0))
    opened.page.locator(".plot").first.hover()
    opened.seek(0.5)

    assert opened.complaints == []
    assert opened.state()["q"] == []
    assert text(opened, "#readout-name") == "Joints of ARM_1"


def test_names_are_text(visit, bench) -> None:
    """Whatever stands in a name is shown letter by letter and never obeyed."""
    nasty = '</script><script>window.bitten = 1</script><b>"it\'s"</b> & $title {x} 機械手 ☃'
    frames = tuple(attrs.evolve(frame, name=nasty) for frame in bench.animation.frames)
    run = attrs.evolve(
        bench,
        title=nasty,
        program_text=f"{nasty}\n<!-- <script>",
        status=nasty,
        cell_name=nasty,
        effects=tuple(attrs.evolve(effect, text=nasty) for effect in bench.effects),
        stages=tuple(attrs.evolve(stage, to=(nasty,), badges=(StageBadge(text=nasty, title=nasty),)) for stage in bench.stages),
        animation=attrs.evolve(bench.animation, frames=frames),
    )
    opened = visit(run)

    assert opened.complaints == []
    assert opened.page.evaluate("window.bitten") is None
    assert opened.page.title() == nasty
    for selector in ("h1", "#status", "#program li:first-child .text", "#trace li:first-child .text"):
        assert opened.page.locator(selector).text_content() == nasty
    assert opened.page.locator("b", has_text="it's").count() == 0


def test_joint_without_limits(visit, bench) -> None:
    """Where nothing limits a joint the page says so, and draws the joint against its own largest value."""
    free = tuple(
        JointInfo(name=joint.name, kind="prismatic" if j == 2 else "revolute")
        for j, joint in enumerate(bench.arms[0].joints)
    )
    opened = visit(attrs.evolve(bench, arms=(attrs.evolve(bench.arms[0], joints=free), bench.arms[1])))
    opened.page.locator(".plot").nth(1).hover()

    assert opened.complaints == []
    assert opened.page.locator("#stages tr").first.locator("td").nth(8).inner_text() == "–"
    lines = text(opened, ".chart:nth-child(2) .tip")
    assert lines.count("no limit") == 6
    assert "mm/s" in lines
