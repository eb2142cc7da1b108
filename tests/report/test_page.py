"""The page in a real browser, opened from the disk as a reader opens it."""

import math
import re
from typing import Any

import attrs
import numpy as np
import pytest

from armwright import Arm, load_arm
from armwright.kinematics.forward_kinematics import forward
from armwright.report.animation import Animation, FrameTrack
from armwright.report.arm_figure import Placed, arm_figure
from armwright.report.limit_spans import LimitSpan
from armwright.report.page import ArmRecord, Effect, JointInfo, Message, RunPage, StageBadge
from armwright.report.shape_table import ShapeTable
from armwright.report.stick_figure import arm_record
from armwright.spatial.poses import homogeneous, to_noap
from armwright.spatial.rotations import elementary_rotation

pytestmark = [pytest.mark.part(0.1), pytest.mark.browser, pytest.mark.early]

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


def heads(visit: Any) -> list[str]:
    return [str(head) for head in visit.page.locator(".chart:visible h3 span").all_inner_texts()]


def hues_in(visit: Any, chart: int) -> set[str]:
    """Which colours of joints are in a chart."""
    return set(
        visit.page.evaluate(
            """chart => {
              const canvas = document.querySelectorAll('.plot canvas')[chart];
              const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
              const style = getComputedStyle(document.documentElement);
              const seen = new Set();
              for (let i = 0; i < data.length; i += 4)
                seen.add('#' + [0, 1, 2].map((k) => data[i + k].toString(16).padStart(2, '0')).join(''));
              return [0, 1, 2, 3, 4, 5].map((i) => `--c${i}`).filter((n) => seen.has(style.getPropertyValue(n).trim()));
            }""",
            chart,
        )
    )


def test_the_limiting_joint_stands_out(visit, bench) -> None:
    """Of each chart the joint nearest to its limit is in colour and named, until others are chosen in the legend."""
    arm = bench.arms[0]
    opened = visit(bench)
    shares = np.abs(arm.qd).max(axis=0) / [joint.speed for joint in arm.joints]
    worst = int(shares.argmax())

    assert heads(opened)[1] == f"% of limit · {arm.joints[worst].name} {100 * shares[worst]:.0f} %"
    assert hues_in(opened, 1) == {f"--c{worst}"}
    whole = opened.page.evaluate("document.querySelectorAll('.plot canvas')[1].toDataURL()")
    for j in (0, 4):
        opened.page.locator("#legend button").nth(j).click()
    assert hues_in(opened, 1) == {"--c0", "--c4"}
    for j in (0, 4):
        opened.page.locator("#legend button").nth(j).click()
    assert opened.page.evaluate("document.querySelectorAll('.plot canvas')[1].toDataURL()") == whole


def test_a_stage_fills_the_charts(visit, bench) -> None:
    """A chosen stage zooms the time axis to it; a button and Escape show the whole run again."""
    opened = visit(bench)
    whole = heads(opened), opened.page.evaluate("document.querySelector('.plot canvas').toDataURL()")
    plot = opened.page.locator(".plot").first
    assert not opened.page.is_visible("#whole")
    for back in (lambda: opened.page.click("#whole"), lambda: opened.page.keyboard.press("Escape")):
        opened.page.locator("#stages tr").nth(2).click()
        stage = bench.stages[2]
        width = plot.bounding_box()["width"]
        plot.click(position={"x": (50 + width - 10) / 2, "y": 60})
        lasts = stage.t1 - stage.t0
        assert opened.state()["time"] == pytest.approx((stage.t0 + stage.t1) / 2, abs=2 * lasts / width)
        assert heads(opened) != whole[0]
        back()
        assert not opened.page.is_visible("#whole")
        assert heads(opened) == whole[0]
        opened.seek(0.0)
        assert opened.page.evaluate("document.querySelector('.plot canvas').toDataURL()") == whole[1]


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
        "tool": None,
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
    remark = StageBadge(text=nasty, title=nasty)
    run = attrs.evolve(
        bench,
        title=nasty,
        program_text=f"{nasty}\n<!-- <script>",
        status=nasty,
        cell_name=nasty,
        effects=tuple(attrs.evolve(effect, text=nasty) for effect in bench.effects),
        stages=tuple(attrs.evolve(stage, to=(nasty,), badges=(remark,)) for stage in bench.stages),
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


# ---- arms moved by hand ----------------------------------------------------------------------------------------------


def arm_run(arm: Arm, base: np.ndarray, grip: np.ndarray | None = None) -> RunPage:
    """A run of one arm that goes from one configuration to another in two seconds."""
    t = np.linspace(0.0, 2.0, 61)
    q = np.linspace(np.full(arm.n, 0.1), np.full(arm.n, 0.3), 61)
    shapes, zero = ShapeTable(), np.zeros_like(q)
    figure = arm_figure("ARM_1", Placed(arm, base), q, grip, shapes)
    return RunPage(
        title="by hand",
        program_name="p.rlo",
        program_text="BEGIN END.",
        cell_name="c",
        generated_by="armwright",
        command="armwright run p.rlo",
        duration=2.0,
        arms=[arm_record("ARM_1", arm, (t, q, zero, zero, zero), base)],
        animation=Animation(fps=30.0, t=t, arms={"ARM_1": figure}, shapes=shapes.as_data()),
    )


def set_joint(visit: Any, j: int, value: float) -> None:
    visit.page.evaluate(
        """([j, value]) => {
          const slider = document.querySelectorAll('#joints input')[j];
          slider.value = value;
          slider.dispatchEvent(new Event('input'));
        }""",
        [j, value],
    )


@pytest.mark.parametrize("name", ["puma560", "stanford", "ur5"])
def test_sliders_are_forward_kinematics(visit, rng: np.random.Generator, name: str) -> None:
    """An arm moved by its sliders has its tool where forward kinematics has it, to a nanometre."""
    arm = load_arm(name)
    base = homogeneous(elementary_rotation(2, 0.7), [0.3, -0.2, 0.4])
    opened = visit(arm_run(arm, base))
    for _ in range(3):
        q = rng.uniform(np.maximum(arm.limits.lower, -3.0), np.minimum(arm.limits.upper, 3.0))
        for j, value in enumerate(q):
            set_joint(opened, j, float(value))
        state = opened.state()
        np.testing.assert_allclose(state["q"], q, atol=1e-12)
        np.testing.assert_allclose(state["tool"], to_noap(base @ forward(arm, q)), atol=1e-9)
    assert opened.complaints == []


def test_back_to_the_run(visit, bench) -> None:
    """An arm moved by hand is another picture; any way back to the time of the player shows the run as it was."""
    opened = visit(bench)
    opened.seek(1.0)
    run = opened.pixels(), opened.state(), text(opened, "#joints")
    ways = (
        lambda: opened.page.click("#by-hand-end"),
        lambda: opened.seek(1.0),
        lambda: row_of_line(opened, 8).click(),
    )
    for back in ways:
        set_joint(opened, 1, 0.4)
        assert opened.state()["jog"]
        assert opened.page.is_visible("#by-hand")
        assert opened.pixels() != run[0]
        back()
        assert not opened.page.is_visible("#by-hand")
        opened.seek(1.0)
        assert (opened.pixels(), opened.state(), text(opened, "#joints")) == run


def test_joints_by_key(visit, bench) -> None:
    """Keys of a joint's slider move the joint, not the time."""
    opened = visit(bench)
    opened.seek(1.0)
    opened.page.locator("#joints input").nth(0).focus()
    before = opened.state()["q"]
    opened.page.keyboard.press("PageUp")
    after = opened.state()

    assert after["time"] == 1.0
    assert after["q"][0] > before[0]
    assert after["q"][1:] == before[1:]


def test_no_gripper_where_there_is_none(visit) -> None:
    """An arm without a gripper has no fingers, and nothing is said of a gripper."""
    arm = load_arm("ur5")
    with_one, without = visit(arm_run(arm, np.eye(4), np.ones(61))), visit(arm_run(arm, np.eye(4)))
    names = [{body["name"] for body in it.page.evaluate("armwright.bodies()")} for it in (with_one, without)]

    assert names[0] - names[1] == {"ARM_1 palm", "ARM_1 finger"}
    assert "gripper" in text(with_one, "#hand")
    assert "gripper" not in text(without, "#hand")


# ---- what is seen at first, tracks, lines, passes --------------------------------------------------------------------


def test_first_screen(visit, bench) -> None:
    """At 1280 x 800 the numbers, the whole view, the program and the player are seen without scrolling."""
    opened = visit(bench)
    dock = opened.page.locator("#dock").bounding_box()
    boxes = {name: opened.page.locator(name).bounding_box() for name in (".headline", "#view", "#source-card")}

    for name, box in boxes.items():
        assert box["y"] >= 0, name
        assert box["y"] + box["height"] <= dock["y"] + 1, name
    assert boxes["#view"]["width"] > 0.6 * 1280
    assert boxes["#view"]["height"] > 300
    opened.page.click("#drawer")
    assert opened.page.locator("#view").bounding_box()["width"] > 0.9 * 1280


def test_a_track_for_each_arm(visit, bench) -> None:
    """Under the player every arm has a track with its name, its own stages, and marks where a limit binds."""
    span = LimitSpan(t0=4.5, t1=5.4, joint=1, limit="effort", share=1.0)
    first, second = bench.arms
    opened = visit(attrs.evolve(bench, arms=(first, attrs.evolve(second, at_limits=[span]))))
    rows = opened.page.locator("#strip .track-row")

    assert rows.locator("button").all_inner_texts() == ["ARM_1", "ARM_2"]
    assert [rows.nth(i).locator("i").count() for i in range(2)] == [4, 1]
    assert [rows.nth(i).locator("b").count() for i in range(2)] == [0, 1]
    mark, track = rows.nth(1).locator("b").bounding_box(), rows.nth(1).locator(".track").bounding_box()
    assert (mark["x"] - track["x"]) / track["width"] == pytest.approx(0.5, abs=0.01)
    assert mark["width"] / track["width"] == pytest.approx(0.1, abs=0.01)
    assert rows.nth(1).locator("b").get_attribute("title").startswith("shoulder: 100 % of its effort")
    rows.nth(1).locator("button").click()
    assert opened.state()["arm"] == "ARM_2"


def test_a_line_for_each_process(visit, bench) -> None:
    """Every process that goes on has its line marked in the colour of its arm; one that waits or has ended has none."""
    effects = (
        Effect(t0=0.0, t1=0.0, line=6, text="COBEGIN", process="program"),
        Effect(t0=0.0, t1=5.0, line=8, text="ARM_1 MOVE", process="branch 1", arm="ARM_1"),
        Effect(t0=0.0, t1=2.0, line=9, text="ARM_2 MOVE", process="branch 2", arm="ARM_2"),
        Effect(t0=2.0, t1=9.0, line=10, text="WAIT", process="branch 2"),
        Effect(t0=9.0, t1=9.0, line=14, text="END", process="program"),
    )
    opened = visit(attrs.evolve(bench, effects=effects))
    marked = """[...document.querySelectorAll('#program li')].flatMap((row, i) =>
      row.classList.contains('now') ? [[i + 1, getComputedStyle(row).boxShadow.match(/rgb.*?\\)/)[0]]] : [])"""
    arms = [tuple(int(colour[i : i + 2], 16) for i in (1, 3, 5)) for colour in ("#e08a2e", "#2f93a6")]
    colours = [f"rgb({r}, {g}, {b})" for r, g, b in arms]
    seen = {}
    for t in (1.0, 3.0, 6.0):
        opened.seek(t)
        seen[t] = opened.page.evaluate(marked)

    assert seen[1.0] == [[8, colours[0]], [9, colours[1]]]
    assert seen[3.0] == [[8, colours[0]], [10, colours[1]]]
    assert seen[6.0] == [[10, colours[1]]]


def looped(bench: RunPage, passes: int) -> RunPage:
    """The first MOVE of a run, two stages long, again and again: at line 8, slower and slower."""
    one, two = bench.stages[:2]
    stages, effects = [], []
    for k in range(passes):
        t0 = 2.5 * k
        badge = StageBadge(text="acc j4", title=f"{1 + k / 10} times slower", mark="warn", factor=1 + k / 10)
        stages += [
            attrs.evolve(one, t0=t0, t1=t0 + 1.0 + k / 10),
            attrs.evolve(two, t0=t0 + 1.0 + k / 10, t1=t0 + 2.0, to=(f"slot[{k}]",), badges=(badge,)),
        ]
        effects.append(Effect(t0=t0, t1=t0 + 2.0, line=8, text="MOVE", arm="ARM_1"))
    return attrs.evolve(bench, stages=stages, effects=effects)


def test_passes_of_a_loop_are_one_row(visit, bench) -> None:
    """A MOVE in a loop has a row for each of its stages, with the number of passes, which can be unfolded."""
    opened = visit(looped(bench, 3))
    rows = opened.page.locator("#stages tr:visible")

    assert rows.count() == 2
    assert opened.page.locator(".times").all_inner_texts() == ["×3", "×3"]
    assert rows.nth(0).locator(".lasts").inner_text() == "1.00 – 1.20"
    assert rows.nth(1).locator(".goal").inner_text() == "slot[0] … slot[2]"
    assert rows.nth(1).locator(".badge").all_inner_texts() == ["acc j4 ×1.20"]
    assert rows.nth(1).locator(".badge").get_attribute("title") == "1.2 times slower"
    opened.seek(6.5)
    assert ["now" in (rows.nth(i).get_attribute("class") or "") for i in range(2)] == [False, True]
    opened.page.locator(".times").nth(1).click()
    assert rows.count() == 5
    assert rows.nth(4).locator(".lasts").inner_text() == "0.80"
    rows.nth(4).click()
    assert opened.state()["time"] == pytest.approx(6.2)
    opened.page.locator(".times").nth(1).click()
    assert rows.count() == 2


def test_messages_are_folded(visit, bench) -> None:
    """Of many messages the first are shown, and the others when they are asked for."""
    many = tuple(Message(severity="note", text=f"note {i}") for i in range(7))
    opened = visit(attrs.evolve(bench, messages=many))
    shown = opened.page.locator("#messages li:visible")

    assert shown.count() == 2
    opened.page.get_by_role("button", name="5 more").click()
    assert shown.count() == 7


def test_footer_has_the_command(visit, bench) -> None:
    """The foot of the page says what made it."""
    assert text(visit(bench), "footer") == f"armwright 0.1.0: {bench.command}"


# ---- names, layers, gestures, paper, phones --------------------------------------------------------------------------


def crowded(bench: RunPage, count: int) -> RunPage:
    """A run with many frames within a few centimetres."""
    t = bench.animation.t
    frames = [
        FrameTrack(
            name=f"slot[{i // 6},{i % 6}]",
            poses=np.tile(to_noap(homogeneous(np.eye(3), [0.4 + 0.02 * (i // 6), 0.02 * (i % 6), 0.05])), (len(t), 1)),
        )
        for i in range(count)
    ]
    return attrs.evolve(bench, animation=attrs.evolve(bench.animation, frames=frames))


@pytest.mark.parametrize("width", [390, 1280])
def test_names_in_a_crowd(visit, bench, width: int) -> None:
    """Of forty frames within a few centimetres no two names overprint each other, and none is outside the view."""
    opened = visit(crowded(bench, 40), viewport={"width": width, "height": 844})
    view = opened.page.locator("#view").bounding_box()
    for look in ("reset", "top", "side"):
        opened.page.click(f"[data-camera={look}]")
        boxes = opened.page.evaluate("armwright.labels()")
        assert len(boxes) > 5
        for i, a in enumerate(boxes):
            assert 0 <= a["x"] <= view["width"] - a["wide"]
            for b in boxes[:i]:
                apart = a["x"] >= b["x"] + b["wide"] or b["x"] >= a["x"] + a["wide"]
                assert apart or abs(a["y"] - b["y"]) >= a["high"], (look, a, b)


def test_layers(visit, bench) -> None:
    """Frames, paths and labels can be left out, each for itself, and come back as they were."""
    opened = visit(bench)
    whole = opened.pixels()
    seen = []
    for layer in ("frames", "paths", "labels"):
        opened.page.click(f"[data-layer={layer}]")
        seen.append(opened.pixels())
        assert opened.page.get_attribute(f"[data-layer={layer}]", "aria-pressed") == "false"
        if layer == "labels":
            assert len(opened.page.evaluate("armwright.labels()")) == 1  # the scale of the grid stays
        opened.page.click(f"[data-layer={layer}]")
        assert opened.pixels() == whole
    assert len({whole, *seen}) == 4


def test_the_page_scrolls_over_the_view(visit, bench) -> None:
    """The wheel without Ctrl and one finger leave the view as it is, and say what changes it; two fingers turn it."""
    opened = visit(bench)
    before = opened.pixels()
    opened.page.locator("#view").hover()
    opened.page.mouse.wheel(0, 200)
    opened.until("window.scrollY > 0")
    assert opened.pixels() == before
    assert "Ctrl" in text(opened, "#view-hint")
    touch = """([kind, id, x, y]) => document.getElementById('view').dispatchEvent(new PointerEvent(kind,
      { pointerId: id, pointerType: 'touch', clientX: x, clientY: y, bubbles: true }))"""
    for event in (["pointerdown", 1, 300, 300], ["pointermove", 1, 340, 320]):
        opened.page.evaluate(touch, event)
    assert opened.pixels() == before
    assert "Two fingers" in text(opened, "#view-hint")
    for event in (["pointerdown", 2, 400, 300], ["pointermove", 2, 460, 320]):
        opened.page.evaluate(touch, event)
    assert opened.pixels() != before


def test_paper_has_no_controls(visit, bench) -> None:
    """On paper there are no player, buttons and sliders, but all numbers, the view, the program and the table."""
    opened = visit(bench)
    opened.page.emulate_media(media="print")
    for gone in ("#dock", "#drawer", "[data-camera]", "[data-layer]", "#joints input", ".arms", "#scale", "#whole"):
        assert not opened.page.locator(gone).first.is_visible(), gone
    for kept in (".headline", "#view", "#program", "#joints .value", "#stages", "#charts", "#trace", "footer"):
        assert opened.page.locator(kept).first.is_visible(), kept
    for uncut in ("#program", "#trace"):
        assert opened.page.eval_on_selector(uncut, "list => list.scrollHeight - list.clientHeight") == 0


def test_a_row_is_a_card_on_a_phone(visit, bench) -> None:
    """At 390 px every number of a stage that counts is in sight, in two lines or three, without scrolling sideways."""
    opened = visit(bench, viewport={"width": 390, "height": 844})
    assert opened.page.evaluate("document.documentElement.scrollWidth") == 390
    assert opened.page.evaluate(
        "[...document.querySelectorAll('.scroll-x')].every((e) => e.scrollWidth <= e.clientWidth)"
    )
    rows = opened.page.locator("#stages tr")
    for i in range(rows.count()):
        # A remark that finds no room in the first line takes one more.
        assert rows.nth(i).bounding_box()["height"] < (80 if bench.stages[i].badges else 62)
        assert bench.stages[i].to[-1] in rows.nth(i).inner_text()
        for name in ("speed", "effort"):
            box = rows.nth(i).locator(f"td[data-name={name}]").bounding_box()
            assert box["x"] + box["width"] <= 390
    for card in opened.page.locator(".card:visible").all():
        box = card.bounding_box()
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= 390


def test_processor_and_painter_agree(visit, bench, browser) -> None:
    """What the graphics processor draws is what the painter draws: arm by arm in the same places."""
    painted = visit(bench)
    fake = """
      const extension = WebGL2RenderingContext.prototype.getExtension;
      WebGL2RenderingContext.prototype.getExtension = function (name) {
        return name.includes('debug') ? null : extension.call(this, name);
      };
    """
    context = browser.new_context(viewport={"width": 1280, "height": 800})
    context.add_init_script(fake)
    page = context.new_page()
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto(painted.url)
    pixels = """() => {
      const small = document.createElement('canvas');
      Object.assign(small, { width: 160, height: 90 });
      const ink = small.getContext('2d');
      ink.fillStyle = 'white';
      ink.fillRect(0, 0, 160, 90);
      ink.drawImage(document.getElementById('view'), 0, 0, 160, 90);
      return [...ink.getImageData(0, 0, 160, 90).data];
    }"""
    drawn = page.evaluate("armwright.drawnBy()")
    both = [np.array(it.evaluate(pixels)).reshape(-1, 4) / 255 for it in (page, painted.page)]
    context.close()

    assert errors == []
    if drawn != "processor":
        pytest.skip("this browser has no WebGL 2")
    assert painted.page.evaluate("armwright.drawnBy()") == "painter"
    # Where the one draws something, so does the other, and of about the same colour; shadows have other edges.
    apart = np.abs(both[0] - both[1]).max(axis=1)
    assert (both[1].min(axis=1) < 0.8).sum() > 500
    assert (apart > 0.25).mean() < 0.02
    assert apart.mean() < 0.02
