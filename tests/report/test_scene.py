"""The scene, the parts, the solids of arms, measured motions and pictures on the page of a run."""

import io
import json
import math
from pathlib import Path
from typing import Any

import attrs
import numpy as np
import pytest
from PIL import Image

from armwright.arm.load import arm_names, load_arm
from armwright.arrays import Array
from armwright.cell.observations import MeasuredStream, Picture
from armwright.cell.part_poses import PartTrack
from armwright.kinematics.forward_kinematics import forward, link_poses
from armwright.physics.cell_bodies import arm_bodies
from armwright.physics.collisions import StageClearance
from armwright.program.vm.recording import Recording, Stream
from armwright.report.animation import Animation, Body, MovedPart
from armwright.report.arm_figure import Placed, arm_figure
from armwright.report.markup import json_text
from armwright.report.page import RunPage, run_page
from armwright.report.run_data import run_page_data
from armwright.report.run_files import RunInputs, write_run
from armwright.report.run_scene import kept_poses, moved_parts
from armwright.report.shape_table import ShapeTable, coarse_mesh, shape_data
from armwright.report.tracking import measured_motion, seen_pictures
from armwright.spatial.poses import homogeneous, to_noap
from armwright.spatial.rotations import elementary_rotation
from armwright.spatial.shapes import Box, Mesh, Solid, Sphere, is_closed, volume
from oracles.stocked_cell import stocked_run, torus, with_solids

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

# The page carries five significant digits of joint positions, and six decimals of lengths.
DIGITS = 2e-4
NASTY = '</script><script>window.bitten = 1</script><b>"it\'s"</b> & $title ☃'


@pytest.fixture(scope="module")
def stocked(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    return stocked_run(tmp_path_factory.mktemp("stocked"))


def page_of(recording: Recording) -> RunPage:
    return run_page_data(recording, (), "armwright run stocked.rlo --cell cell.toml")


def observed(recording: Recording, **changes: Any) -> Recording:
    """A recording of which the cell has left something else."""
    return attrs.evolve(recording, observations=attrs.evolve(recording.observations, **changes))


def png(width: int = 32, height: int = 24, rng: np.random.Generator | None = None) -> bytes:
    file = io.BytesIO()
    colours = np.zeros((height, width, 3), np.uint8) if rng is None else rng.integers(0, 256, (height, width, 3), "u1")
    Image.fromarray(colours).save(file, "PNG")
    return file.getvalue()


def picture(time: float, **changes: Any) -> Picture:
    return attrs.evolve(
        Picture(time=time, camera="CAMERA", frame="block", png=png(), found=True, text="seen"), **changes
    )


# ---- shapes ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("most", [300, 3000])
def test_coarse_mesh_is_the_same_solid(most: int) -> None:
    """A ring of 80,000 triangles becomes one of few: near its surface, and of its volume."""
    ring = torus(400, 100)
    vertices, faces = coarse_mesh(ring, most)

    assert most / 4 < len(faces) <= most
    off = np.abs(np.hypot(np.hypot(*vertices[:, :2].T) - 0.05, vertices[:, 2]) - 0.02)
    assert off.max() < 0.02 * math.sqrt(300 / most)
    exact = 2 * math.pi**2 * 0.05 * 0.02**2
    assert volume(Mesh(vertices=vertices, faces=faces)) == pytest.approx(exact, rel=0.4 * 300 / most)


def test_small_meshes_stay() -> None:
    """A mesh with fewer triangles than allowed is drawn as it is."""
    ring = torus(20, 10)
    vertices, faces = coarse_mesh(ring, 400)
    np.testing.assert_array_equal(vertices, ring.vertices)
    np.testing.assert_array_equal(faces, ring.faces)


def test_too_coarse_becomes_a_box() -> None:
    """Where no triangle may be left a mesh is its bounding box, closed and seen from outside."""
    ring = torus(30, 20)
    box = Mesh(vertices=(found := coarse_mesh(ring, 1))[0], faces=found[1])
    assert is_closed(box)
    assert volume(box) == pytest.approx(np.prod(np.ptp(ring.vertices, axis=0)))


def test_equal_shapes_are_listed_once() -> None:
    """Equal shapes have one number; a mesh is listed as often as there are different ones."""
    table, ring = ShapeTable(), torus(6, 5)
    shapes = [Box(size=[1, 2, 3]), Sphere(radius=1), Box(size=[1, 2, 3]), ring, ring, torus(6, 5)]
    assert [table.number(shape) for shape in shapes] == [0, 1, 0, 2, 2, 3]
    assert [row["kind"] for row in table.as_data()] == ["box", "sphere", "mesh", "mesh"]


def test_meshes_share_the_page() -> None:
    """However many fine meshes a cell has, their triangles together are bounded."""
    table = ShapeTable()
    for _ in range(12):
        table.number(torus(120, 60))
    assert sum(len(row["faces"]) for row in table.as_data()) <= 3 * 20_000


# ---- parts -----------------------------------------------------------------------------------------------------------


def track(poses: Array, arms: list[str | None]) -> PartTrack:
    times = tuple((np.arange(len(poses)) * 1e-3).tolist())
    return PartTrack(times=times, carriers=tuple(arms), poses=tuple(poses))


def test_poses_of_a_part_at_rest_are_left_out() -> None:
    """A part that does not move needs two poses, however often it was looked at."""
    assert kept_poses(track(np.tile(np.eye(4), (5000, 1, 1)), [None] * 5000), 1000) == [0, 4999]


def test_poses_of_a_falling_part_are_thinned(rng: np.random.Generator) -> None:
    """Of a part that moves all the time so many poses are kept, and every change of hands."""
    poses = homogeneous(np.eye(3), rng.normal(size=(20_000, 3)))
    arms: list[str | None] = [None if (i // 3000) % 2 else "ARM_1" for i in range(20_000)]
    kept = kept_poses(track(poses, arms), 500)

    changes = [i for i in range(1, 20_000) if arms[i] != arms[i - 1]]
    assert {0, 19_999, *changes} <= set(kept)
    assert len(kept) <= 500 + len(changes) + 2


def test_long_tracks_keep_the_page_small(stocked: Recording, rng: np.random.Generator) -> None:
    """A hundred thousand poses of three parts add less than three megabytes."""
    falls = track(homogeneous(np.eye(3), rng.normal(size=(100_000, 3))), [None] * 100_000)
    shown = moved_parts(observed(stocked, parts=dict.fromkeys(stocked.cell.parts, falls)), ShapeTable())
    assert len(json_text(shown)) < 3_000_000


def test_fingers_stop_at_the_part(stocked: Recording) -> None:
    """Fingers that open 90 mm hold a block of 40 mm with 40/90 of it, and are open when they let go."""
    animation = page_of(stocked).animation
    assert animation is not None
    figure = animation.arms["ARM_1"]
    held = (animation.t > 3.0) & (animation.t < 5.3)

    assert figure.opening == 0.09
    np.testing.assert_allclose(figure.grip[held], 40 / 90, atol=1e-9)
    assert figure.grip[-1] == 1.0


@pytest.mark.parametrize("name", arm_names())
def test_every_arm_is_drawn(name: str) -> None:
    """Every arm of the catalogue has a figure, one whose last link has no length too."""
    arm = load_arm(name)

    figure = arm_figure(name, Placed(arm), np.zeros((2, arm.n)), None, ShapeTable())

    assert {body.frame for body in figure.bodies} >= set(range(arm.n))


def test_a_column_below_a_raised_arm(tmp_path: Path) -> None:
    """A base above a table stands on a column from the top of the table; one on the floor has none."""
    recording = stocked_run(tmp_path)
    arm = recording.cell.arms["ARM_1"]
    base = arm.base.copy()
    base[:3, 3] = 0.5, 0.0, 0.3
    bare = attrs.evolve(arm.arm, base_solids=(), links=tuple(attrs.evolve(link, solids=()) for link in arm.arm.links))
    raised = attrs.evolve(arm, base=base, arm=bare)
    cell = attrs.evolve(recording.cell, arms={**recording.cell.arms, "ARM_1": raised})
    animation = page_of(attrs.evolve(recording, cell=cell)).animation
    assert animation is not None
    columns = {body.name: body for figure in animation.arms.values() for body in figure.bodies if "column" in body.name}

    # Frame 0 of the Stanford arm is its base frame, and the top of the table is the floor of the world.
    assert list(columns) == ["ARM_1 column"]
    assert animation.shapes[columns["ARM_1 column"].shape]["length"] == pytest.approx(0.3)
    np.testing.assert_allclose(columns["ARM_1 column"].pose[9:], (0, 0, -0.15), atol=1e-12)


def test_a_column_below_solids(tmp_path: Path) -> None:
    """Where the base has solids the column goes from the floor to the lowest of them; down on the floor is none."""
    recording = stocked_run(tmp_path)
    given = recording.cell.arms["ARM_1"]
    foot = Solid(shape=Box(size=[0.2, 0.2, 0.1]), pose=homogeneous(np.eye(3), [0.0, 0.0, 0.05]))
    heights = {}
    for height in (0.0, 0.3):
        base = given.base.copy()
        base[:3, 3] = 2.0, 0.0, height
        arm = attrs.evolve(given, base=base, arm=attrs.evolve(with_solids(given.arm), base_solids=(foot,)))
        cell = attrs.evolve(recording.cell, arms={**recording.cell.arms, "ARM_1": arm})
        animation = page_of(attrs.evolve(recording, cell=cell)).animation
        assert animation is not None
        columns = [body for body in animation.arms["ARM_1"].bodies if "column" in body.name]
        heights[height] = [animation.shapes[body.shape]["length"] for body in columns]

    assert heights == {0.0: [], 0.3: [pytest.approx(0.3)]}


# ---- files -----------------------------------------------------------------------------------------------------------


def test_record_has_scene_and_parts(stocked: Recording, tmp_path: Path) -> None:
    """The scene, the parts and their tracks stand in run.json as they are in the cell and the run."""
    inputs = RunInputs(program=tmp_path / "p.rlo", cell=None, command="armwright", options={}, text="BEGIN END.")
    write_run(tmp_path / "out", stocked, (), inputs)
    run = json.loads((tmp_path / "out/run.json").read_text())

    fixtures = stocked.cell.fixtures
    assert [one["name"] for one in run["scene"]] == list(fixtures)
    assert run["scene"][0]["shape"] == {"kind": "box", "size": [0.8, 0.9, 0.04]}
    for one in run["scene"]:
        np.testing.assert_allclose(one["pose"], to_noap(fixtures[one["name"]].pose), atol=1e-9)
    assert list(run["parts"]) == ["BLOCK", "ROD", "WEDGE"]
    wedge = stocked.cell.parts["WEDGE"].shape
    assert isinstance(wedge, Mesh)
    np.testing.assert_allclose(np.reshape(run["parts"]["WEDGE"]["shape"]["vertices"], (-1, 3)), wedge.vertices)
    moved = run["parts"]["BLOCK"]["track"]
    assert [one["arm"] for one in moved] == [None, "ARM_1", None]
    for one, pose in zip(moved, stocked.parts["BLOCK"].poses, strict=True):
        np.testing.assert_allclose(one["pose"], to_noap(pose), atol=1e-9)


def test_pictures_are_kept(stocked: Recording, tmp_path: Path, rng: np.random.Generator) -> None:
    """Pictures are among the results, byte by byte, listed in run.json; a run without any takes them away."""
    inputs = RunInputs(program=tmp_path / "p.rlo", cell=None, command="armwright", options={}, text="BEGIN END.")
    pictures = (picture(0.5, png=png(rng=rng)), picture(1.5, found=False, text="dark"))
    write_run(tmp_path / "out", observed(stocked, pictures=pictures), (), inputs)
    listed = json.loads((tmp_path / "out/run.json").read_text())["pictures"]

    assert [(one["time"], one["found"], one["text"]) for one in listed] == [(0.5, True, "seen"), (1.5, False, "dark")]
    assert [(tmp_path / "out" / one["file"]).read_bytes() for one in listed] == [one.png for one in pictures]
    write_run(tmp_path / "out", stocked, (), inputs)
    assert list((tmp_path / "out").glob("seen-*")) == []


def test_pictures_of_a_page_are_bounded(rng: np.random.Generator) -> None:
    """A page holds the first pictures, and says that there are more."""
    many, large = [picture(0.0)] * 200, [picture(0.0, png=png(1200, 900, rng))] * 5
    assert [len(seen_pictures(each)[0]) for each in (many, large)] == [60, 1]
    assert seen_pictures(many)[1] == ["this page shows the first 60 of 200 pictures; all in the files seen-*.png"]
    assert seen_pictures(many[:3])[1] == []


# ---- measured motions ------------------------------------------------------------------------------------------------


def planned_and_measured(error: Array) -> tuple[Stream, MeasuredStream]:
    """A joint that turns evenly and is measured at other instants, off by this much."""
    t = np.arange(len(error)) * 1e-3
    times, q = np.array([t[0], t[-1]]), np.array([[0.0], [2.0]])
    zeros = np.zeros_like(q)
    planned = Stream(arm="ARM_1", t=times, q=q, qd=zeros, qdd=zeros, tau=zeros)
    at = 2.0 * t / t[-1] + error
    zero = np.zeros((len(t), 1))
    return planned, MeasuredStream(
        arm="ARM_1", t=t, q=at[:, None], qd=zero, tau=zero, sent=zero, actual=zero, opening=zero[:, 0]
    )


def test_spikes_of_the_tracking_error_survive() -> None:
    """One tick in twenty thousand is off: the curve of the page, however thin, has it, and so has the worst value."""
    error = np.full(20_001, 1e-4)
    error[12_345] = -3e-3
    motion = measured_motion(*planned_and_measured(error))

    assert motion is not None
    assert len(motion.t) == len(motion.error) <= 1501
    assert motion.error.min() == pytest.approx(-3e-3)
    assert motion.error.max() == pytest.approx(1e-4)
    assert (motion.worst[0], motion.worst_t[0]) == (pytest.approx(3e-3), 12.345)


def test_nothing_measured() -> None:
    """A stream without an instant is none."""
    planned, measured = planned_and_measured(np.zeros(10))
    empty = attrs.evolve(measured, t=measured.t[:0], q=measured.q[:0], qd=measured.qd[:0], tau=measured.tau[:0])
    assert measured_motion(planned, empty) is None


# ---- in a browser ----------------------------------------------------------------------------------------------------


@pytest.mark.browser
def test_bodies_are_where_kinematics_puts_them(visit, stocked: Recording, rng: np.random.Generator) -> None:
    """At any time links, what stands, and parts, also one on the hand, are drawn where forward kinematics has them."""
    arms = {name: attrs.evolve(arm, arm=with_solids(arm.arm)) for name, arm in stocked.cell.arms.items()}
    recording = attrs.evolve(stocked, cell=attrs.evolve(stocked.cell, arms=arms))
    data = page_of(recording)
    opened = visit(data)
    assert data.animation is not None

    for row in rng.choice(len(data.animation.t), 12, replace=False):
        t = float(data.animation.t[row])
        opened.seek(t)
        drawn = opened.page.evaluate("armwright.bodies()")
        tick = round(t / recording.cell.period)
        hands = {}
        expected: list[tuple[str, Array]] = []
        for stream in recording.streams:
            arm, q = arms[stream.arm], stream.q[tick]
            hands[stream.arm] = arm.base @ forward(arm.arm, q)
            frames = arm.base @ link_poses(arm.arm, q)
            expected += [(body.name, frames[body.link] @ body.solid.pose) for body in arm_bodies(stream.arm, arm.arm)]
        expected += [(name, fixture.pose) for name, fixture in recording.cell.fixtures.items()]
        for name, moved in recording.parts.items():
            holder, pose = moved.at(t)
            expected.append((name, pose if holder is None else hands[holder] @ pose))
        for name, X in expected:
            found = [body["pose"] for body in drawn if body["name"] == name]
            assert min(np.abs(np.subtract(pose, to_noap(X))).max() for pose in found) < DIGITS, (name, t)
    assert opened.complaints == []


def two_parts(first: Array, second: Array, size: tuple[float, float, float]) -> RunPage:
    """A page on which two equal boxes stand and nothing else."""
    shapes = [{"kind": "box", "size": list(size)}]
    parts = [
        MovedPart(name=name, shape=0, times=[0.0], arms=[None], poses=[to_noap(X)])
        for name, X in (("A", first), ("B", second))
    ]
    animation = Animation(fps=25, t=np.zeros(1), shapes=shapes, parts=parts)
    return RunPage(
        title="two", program_name="p", program_text="x", cell_name="c", generated_by="", command="", duration=0.0,
        animation=animation,
    )  # fmt: skip


def hue_at(visit: Any, x: float) -> str:
    """Which part is seen at the middle of the view, so far to the right [px]."""
    red, _, blue, _ = visit.page.evaluate(
        """x => {
          const view = document.getElementById('view');
          const at = [view.width / 2 + x * devicePixelRatio, view.height / 2 + 20].map(Math.round);
          return [...view.getContext('2d').getImageData(...at, 1, 1).data];
        }""",
        x,
    )
    return "A" if blue > red else "B"


@pytest.mark.browser
@pytest.mark.parametrize("nearer", ["A", "B"])
def test_what_is_nearer_hides_what_is_behind(visit, nearer: str) -> None:
    """Of two plates one behind the other the one towards the reader is seen, whichever is painted first."""
    sides = (-0.3, 0.3) if nearer == "A" else (0.3, -0.3)
    opened = visit(two_parts(*(homogeneous(np.eye(3), [0, y, 0]) for y in sides), size=(0.5, 0.05, 0.5)))
    opened.page.click("[data-camera=front]")
    assert hue_at(opened, 0.0) == nearer


@pytest.mark.browser
def test_plates_that_cross(visit) -> None:
    """Two plates through each other, like an X from above: each is in front on one side, which no order can show."""
    plates = [homogeneous(elementary_rotation(2, angle), [0, 0, 0]) for angle in (0.5, -0.5)]
    opened = visit(two_parts(*plates, size=(0.8, 0.02, 0.5)))
    opened.page.click("[data-camera=front]")

    # Turned by +0.5 rad the left half of A is nearer to a reader at -y.
    assert (hue_at(opened, -60), hue_at(opened, 60)) == ("A", "B")


@pytest.mark.browser
def test_every_shape_is_drawn(visit) -> None:
    """A view with one more body of any kind is another picture; what is inside out or empty breaks nothing."""
    shapes: list[dict[str, Any]] = [
        {"kind": "box", "size": [0.2, 0.3, 0.1]},
        {"kind": "cylinder", "radius": 0.1, "length": 0.2},
        {"kind": "capsule", "radius": 0.1, "length": 0.2},
        {"kind": "sphere", "radius": 0.1},
        shape_data(torus(20, 10)),
    ]
    seen = []
    for count in range(len(shapes) + 1):
        fixtures = [
            Body(name=f"B{i}", shape=i, pose=to_noap(homogeneous(np.eye(3), [0.25 * (i - 2), 0, 0.3])))
            for i in range(count)
        ]
        page = two_parts(np.eye(4), np.eye(4), (0.01, 0.01, 0.01))
        assert page.animation is not None
        animation = attrs.evolve(page.animation, shapes=shapes, fixtures=fixtures, parts=())
        opened = visit(attrs.evolve(page, animation=animation))
        assert opened.complaints == []
        seen.append(opened.pixels())
    assert len(set(seen)) == len(seen)


@pytest.mark.browser
def test_the_contact_plane_is_drawn(visit) -> None:
    """The plane of contact of a cell is seen with its height; a cell without one has none."""
    page = two_parts(np.eye(4), homogeneous(np.eye(3), [0.3, 0, 0]), (0.1, 0.1, 0.1))
    assert page.animation is not None
    with_plane = attrs.evolve(page, animation=attrs.evolve(page.animation, contact_plane=0.045))
    without, seen = visit(page), visit(with_plane)

    assert seen.pixels() != without.pixels()
    count = [len(it.page.evaluate("armwright.labels()")) for it in (without, seen)]
    assert count[1] == count[0] + 1
    assert seen.complaints == []


@pytest.mark.browser
@pytest.mark.parametrize("width", [390, 1280])
def test_names_do_not_overprint(visit, stocked: Recording, width: int) -> None:
    """At no time and from no side two names of the view overlap."""
    opened = visit(page_of(stocked), viewport={"width": width, "height": 844})
    for look in ("reset", "top", "front", "side"):
        opened.page.click(f"[data-camera={look}]")
        for t in (0.0, 2.4, 4.8):
            opened.seek(t)
            boxes = opened.page.evaluate("armwright.labels()")
            assert len(boxes) > 6
            for i, a in enumerate(boxes):
                for b in boxes[:i]:
                    apart = a["x"] >= b["x"] + b["wide"] or b["x"] >= a["x"] + a["wide"]
                    assert apart or abs(a["y"] - b["y"]) >= a["high"], (look, t, a, b)
    assert opened.page.evaluate("document.documentElement.scrollWidth") == width


@pytest.mark.browser
def test_least_distances(visit, stocked: Recording) -> None:
    """The table says how near a stage came to what and when; too near is marked, and a click goes there."""
    given = (
        StageClearance(distance=0.0123, bound=0.012, bodies=("ARM_1 link 4", "POST"), time=0.25),
        StageClearance(distance=0.004, bound=0.0035, bodies=("ARM_1 palm", NASTY), time=0.1),
        StageClearance(distance=None, bound=0.05),
        *[None] * (len(stocked.stages) - 3),
    )
    stages = tuple(attrs.evolve(one, clearance=it) for one, it in zip(stocked.stages, given, strict=True))
    opened = visit(attrs.evolve(page_of(attrs.evolve(stocked, stages=stages)), clearance=0.005))
    cells = [opened.page.locator("#stages tr").nth(i).locator("td").nth(10) for i in range(4)]

    assert opened.page.locator("#clearance-head").is_visible()
    t = stocked.stages[0].t0 + 0.25
    assert cells[0].inner_text().split("\n") == ["12.3 mm", f"ARM_1 link 4 – POST, {t:.2f}\u00a0s"]
    assert NASTY in cells[1].inner_text()
    assert [cell.inner_text() for cell in cells[2:]] == ["above 50 mm", "–"]
    assert ["over" in (cell.get_attribute("class") or "") for cell in cells] == [False, True, False, False]
    cells[0].locator("button").click()
    assert opened.state()["time"] == pytest.approx(t)
    assert opened.page.evaluate("window.bitten") is None
    assert opened.complaints == []


@pytest.mark.browser
def test_no_column_without_distances(visit, bench: RunPage) -> None:
    """A run in which nothing can be met has no column of distances, no strip of pictures, and no tracking error."""
    opened = visit(bench)
    assert not opened.page.locator("#clearance-head").is_visible()
    assert not opened.page.locator("#pictures-card").is_visible()
    assert not opened.page.locator("#planned-and-measured").is_visible()
    assert opened.page.locator(".chart").count() == 4


@pytest.mark.browser
def test_errors_of_a_cell_with_physics(visit, stocked: Recording) -> None:
    """The head of the page has the engine, the seed and the largest errors; nothing of a run without physics."""
    facts = {
        "engine": "MuJoCo",
        "version": "4.0.1",
        "seed": 7,
        "tip": {"ARM_1": 5.36e-4, "ARM_2": 3e-16},
        "slip": {"ARM_1": 7.8e-5, "ARM_2": 0.0},
    }

    assert page_of(stocked).physics == ""
    text = visit(page_of(observed(stocked, facts=facts))).page.locator("header").inner_text()

    told = (
        "MuJoCo 4.0.1, seed 7; ARM_1: tip within 0.54 mm of where it was sent, parts within 0.078 mm in the hand; "
        "ARM_2: tip within 0.001 mm of where it was sent"
    )
    assert told in " ".join(text.split())


@pytest.mark.browser
def test_long_lists_on_paper(visit, stocked: Recording) -> None:
    """On paper the list of what happened is as long as it must be, and the frames are below it."""
    page = visit(page_of(stocked), viewport={"width": 700, "height": 900}).page
    page.emulate_media(media="print")
    rows = "[...document.querySelectorAll('#trace button')].map((row) => row.getBoundingClientRect().bottom)"
    below = "document.querySelector('#tree-card').getBoundingClientRect().top"

    assert len(page.evaluate(rows)) > 5
    assert max(page.evaluate(rows)) <= page.evaluate(below)


@pytest.mark.browser
def test_measured_beside_planned(visit, stocked: Recording) -> None:
    """Charts have a second curve and a row for the tracking error, its largest value named with its time."""
    stream = stocked.streams[0]
    off = np.zeros_like(stream.q)
    off[:, 0] = 2e-3 * np.sin(stream.t) * (stream.t < 3)
    measured = MeasuredStream(
        arm=stream.arm,
        t=stream.t,
        q=stream.q + off,
        qd=stream.qd,
        tau=stream.tau,
        sent=stream.q,
        actual=stream.q,
        opening=0 * stream.t,
    )
    opened = visit(page_of(observed(stocked, measured=(measured,))))
    plain = visit(page_of(stocked))
    chart = "document.querySelectorAll('.plot canvas')[0].toDataURL()"

    assert opened.page.evaluate(chart) != plain.page.evaluate(chart)
    assert opened.page.locator(".chart").nth(4).locator("h3").inner_text().split("\n") == ["Tracking error", "mrad, mm"]
    opened.page.select_option("#scale", "0")
    head = opened.page.locator(".chart").nth(4).locator("h3 span").last.inner_text()
    assert head == "mrad · largest 2.00 mrad at 1.57 s"
    opened.page.locator(".plot").first.hover()
    tip = opened.page.locator(".chart").first.locator(".tip").inner_text()
    assert "planned · measured" in tip
    # The other arm was not measured: it has its four charts, planned.
    opened.page.locator("#charts-card .arms button").nth(1).click()
    assert opened.page.locator(".chart:visible").count() == 4
    assert opened.complaints == []


@pytest.mark.browser
def test_the_measured_world_is_drawn(visit, stocked: Recording) -> None:
    """Arms are drawn as measured, fingers as far open as they were, parts on their way; planned arms can be hidden."""
    stream = stocked.streams[0]
    arm = stocked.cell.arms[stream.arm]
    off = np.zeros(stream.q.shape[1])
    off[0] = 0.2
    opening = np.linspace(0.01, 0.07, len(stream.t))
    measured = MeasuredStream(
        arm=stream.arm,
        t=stream.t,
        q=stream.q + off,
        actual=stream.q + off,
        qd=stream.qd,
        tau=stream.tau,
        sent=stream.q,
        opening=opening,
    )
    # It stands for 1 s, and then goes 0.3 m in 0.02 s.
    ends = homogeneous(np.eye(3), np.array([[0.5, 0, 0.1], [0.5, 0, 0.1], [0.5, 0.3, 0.1], [0.5, 0.3, 0.1]]))
    falls = PartTrack(times=(0.0, 1.0, 1.02, 2.0), carriers=(None,) * 4, poses=tuple(ends))
    opened = visit(page_of(observed(stocked, measured=(measured,), parts={"BLOCK": falls})))

    def drawn(name: str) -> list[Array]:
        return [np.array(it["pose"]) for it in opened.page.evaluate("armwright.bodies()") if it["name"] == name]

    for row in (0, len(stream.t) // 2, len(stream.t) - 1):
        opened.seek(float(stream.t[row]))
        hand = np.linalg.inv(arm.base @ forward(arm.arm, stream.q[row] + off))
        fingers = [hand @ np.array([*pose[9:], 1]) for pose in drawn(f"{stream.arm} finger")]
        # Each finger is as far aside as half the opening and half its own thickness.
        apart = abs(fingers[0][1] - fingers[1][1])
        assert apart == pytest.approx(opening[row] + 0.01, abs=1e-3)
        np.testing.assert_allclose(np.mean(fingers, axis=0)[:2], 0.0, atol=1e-3)
    for t, y in ((0.5, 0.0), (1.0, 0.0), (1.01, 0.15), (1.5, 0.3)):
        opened.seek(t)
        assert drawn("BLOCK")[0][10] == pytest.approx(y, abs=1e-3)
    joints = opened.page.locator("#readout")
    assert joints.locator("h2").inner_text() == f"Joints of {stream.arm}, measured"
    assert "mm open" in joints.inner_text()
    before = opened.pixels()
    opened.page.click("[data-layer=planned]")
    assert opened.pixels() != before
    opened.page.click("[data-layer=planned]")
    assert opened.pixels() == before
    assert not visit(page_of(stocked)).page.locator("[data-layer=planned]").is_visible()
    assert opened.complaints == []


@pytest.mark.browser
def test_strip_of_pictures(visit, stocked: Recording, rng: np.random.Generator) -> None:
    """Pictures are shown with time, camera and what was found, as plain text; a click goes to their time."""
    pictures = (picture(0.5, png=png(rng=rng)), picture(2.25, camera=NASTY, frame=NASTY, found=False, text=NASTY))
    opened = visit(page_of(observed(stocked, pictures=pictures)))
    items = opened.page.locator("#pictures li")
    items.last.scroll_into_view_if_needed()
    opened.until("[...document.querySelectorAll('#pictures img')].every((i) => i.complete && i.naturalWidth === 32)")

    assert items.count() == 2
    assert [items.nth(i).locator(".badge").inner_text() for i in range(2)] == ["found", "not found"]
    assert items.nth(1).inner_text().count(NASTY) == 3
    items.nth(1).locator("button").click()
    assert opened.state()["time"] == 2.25
    assert "now" in items.nth(1).get_attribute("class")
    assert opened.page.evaluate("window.bitten") is None
    assert opened.complaints == []
    assert opened.requests[1:] == [one for one in opened.requests[1:] if one.startswith("data:image/png")]


@pytest.mark.browser
def test_paper_is_white(visit, stocked: Recording) -> None:
    """A page that is dark on the screen is printed dark on light."""
    opened = visit(page_of(stocked), color_scheme="dark")
    lightness = """() => {
      const { width, height } = document.getElementById('view');
      const at = document.getElementById('view').getContext('2d').getImageData(width - 3, 3, 1, 1).data;
      const paper = getComputedStyle(document.querySelector('.card')).backgroundColor;
      return [Number(paper.match(/\\d+/)[0]), at[3]];
    }"""
    dark = opened.page.evaluate(lightness)[0]
    opened.page.emulate_media(media="print")
    light = opened.page.evaluate(lightness)[0]
    assert dark < 60
    assert light > 240
    assert not opened.page.locator("#dock").is_visible()


def test_page_has_no_other_files(stocked: Recording) -> None:
    """With scene, parts and pictures too the page names no file and no address but its own data."""
    text = run_page(page_of(observed(stocked, pictures=(picture(0.1),))))
    assert "http://" not in text
    assert "https://" not in text
    assert len(text) < 700_000
