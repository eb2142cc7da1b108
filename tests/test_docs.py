"""What the pages say is true."""

import operator
import re
import runpy
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import armwright
from armwright.arm.load import load_arm, read_arm, read_load
from armwright.cell.reader import read_cell
from armwright.clearance.estimation.measurement_file import RestMeasurement, read_clearance_measurements
from armwright.clearance.ideal import close_pins, tip_position
from armwright.clearance.reader import read_linkage
from armwright.clearance.scenario import assembly_guess
from armwright.compiled.quantities import emit_quantity, quantity_names
from armwright.errors import FileFormatError
from armwright.simulation.integrators import Adaptive
from armwright.simulation.result import JointState, Status
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import rotation_from_vector
from armwright.study.stanford_torque import joint_table, torques
from cli_calls import armwright as command
from printed import matches

DOCS = Path(__file__).parents[1] / "docs"
PAGES = sorted(DOCS.rglob("*.md"))
PLAY = (DOCS / "clearance.md").read_text(encoding="utf-8")
CELLS, ARMS = (DOCS / "cells.md").read_text(encoding="utf-8"), (DOCS / "arms.md").read_text(encoding="utf-8")


def example(page: str) -> str:
    """The TOML of a page."""
    return page.partition("```toml\n")[2].partition("```")[0]


def said(path: Path, text: str, read: Callable[[Path], object]) -> str:
    """What is said of a mistake in a file, without its folder."""
    path.write_text(text, encoding="utf-8")
    with pytest.raises(FileFormatError) as caught:
        read(path)
    return str(caught.value).replace(f"{path.parent}/", "")


def test_cell_of_the_page(tmp_path: Path) -> None:
    """The cell on the page is read: two arms, a nest that hangs on the station, a part that is found twice."""
    (tmp_path / "cell.toml").write_text(example(CELLS), encoding="utf-8")

    cell = read_cell(tmp_path / "cell.toml")

    assert {name: arm.arm.name for name, arm in cell.arms.items()} == {"ARM_1": "stanford", "ARM_2": "puma560"}
    np.testing.assert_allclose(cell.tree().world("NEST")[:3, 3], (0.55, 0.10, 0.05), atol=1e-12)
    # The camera hangs 1.5 m above the bench and looks down: what is 1.45 m away from it lies 50 mm high.
    seen = [cell.camera @ X for X in cell.visions["PART"]]
    np.testing.assert_allclose([X[:3, 3] for X in seen], [(0.40, 0.15, 0.05), (0.45, 0.15, 0.05)], atol=1e-12)
    assert (set(cell.devices or ()), cell.period, cell.deviation) == ({"PRESS", "LAMP"}, 0.002, 0.0005)


def test_arm_of_the_page(tmp_path: Path) -> None:
    """The arm on the page is read, every quantity in SI units."""
    (tmp_path / "lift.toml").write_text(example(ARMS), encoding="utf-8")

    arm = read_arm(tmp_path / "lift.toml")

    assert (arm.name, arm.n, arm.reach, arm.tool_speed) == ("lift", 2, 0.6, 0.5)
    np.testing.assert_array_equal(arm.tool, [[0, 0, 1, 0], [0, 1, 0, 0], [-1, 0, 0, 0.08], [0, 0, 0, 1]])
    np.testing.assert_allclose(arm.limits.upper, (0.9, np.radians(120)))
    np.testing.assert_allclose(arm.limits.acceleration, (2, 4))
    # A rotor of 2e-5 kg m² behind a gear of 100:1; 0.51 kg m² about the end of the rod are 0.51 - 4.2 * 0.3² about
    # its middle.
    np.testing.assert_allclose([motor.inertia for motor in arm.motors], (3.0, 0.2))
    np.testing.assert_allclose(np.diag(arm.links[1].inertia), (0.01, 0.132, 0.132))
    assert arm.links[1].inertia[0, 2] == pytest.approx(0.002)


CELL_SLIPS = [
    ("grasp_s = ", "grasp_sec = "),
    ("[0.0, 0.5, 0.4", "[0.0, 3.0, 0.4"),
    ('on = "STATION"', 'on = "STATOIN"'),
]
ARM_SLIPS = [("mass_kg      =", "mass_gk      ="), ("= -120\nupper_deg               = 120", "= 120\nupper_deg = -120")]


@pytest.mark.parametrize("slip", range(len(CELL_SLIPS)))
def test_mistakes_in_a_cell(slip: int, tmp_path: Path) -> None:
    """The messages on the page are what these slips in its example are answered with."""
    text = example(CELLS).replace(*CELL_SLIPS[slip])

    assert f"    armwright: {said(tmp_path / 'cell.toml', text, read_cell)}\n" in CELLS


@pytest.mark.parametrize("slip", range(len(ARM_SLIPS)))
def test_mistakes_in_an_arm(slip: int, tmp_path: Path) -> None:
    """The messages on the page are what these slips in its example are answered with."""
    text = example(ARMS).replace(*ARM_SLIPS[slip])

    assert f"    armwright: {said(tmp_path / 'lift.toml', text, read_arm)}\n" in ARMS


LINKAGE_SLIPS = [
    ("clearance_mm", "clearance"),
    ('on = "ground:O"\ndirection', 'on = "ground"\ndirection'),
    ("restitution", "restitutoin"),
]


@pytest.mark.parametrize("slip", range(len(LINKAGE_SLIPS)))
def test_mistakes_in_a_linkage(slip: int, tmp_path: Path) -> None:
    """The messages on the page are what these slips in its example are answered with."""
    text = example(PLAY).replace(*LINKAGE_SLIPS[slip], 1)

    assert f"    armwright: {said(tmp_path / 'press.toml', text, read_linkage)}\n" in PLAY


def test_linkage_of_the_page(tmp_path: Path) -> None:
    """The press on the page is read and put together: its ram hangs below the crank, 0.05 mm loose at the wrist."""
    (tmp_path / "press.toml").write_text(example(PLAY), encoding="utf-8")

    press = read_linkage(tmp_path / "press.toml")

    guess = assembly_guess(press)
    q = close_pins(press, guess, drives=guess[list(press.driven)])
    # Crank and rod of 40 and 200 mm: 40 sin 60° + √(200² - (40 cos 60°)²) below, and the face 50 mm below that.
    height = -(0.04 * np.sin(np.pi / 3) + np.sqrt(0.2**2 - 0.02**2)) - 0.05
    np.testing.assert_allclose(tip_position(press, q), (0.0, height), atol=1e-12)
    assert press.clearances == {"wrist": pytest.approx(5e-5)}
    assert press.drives[0].kind == "motion"


@pytest.mark.parametrize("table", ["", "body", "joint", "play", "drive", "load", "material"])
def test_every_key_of_a_linkage_is_explained(table: str, tmp_path: Path) -> None:
    """What the reader of linkages knows in a table, the page explains outside of its example."""
    header = {"": "", "material": "[material]\n"}.get(table, f"[[{table}]]\n")
    start = example(PLAY) if table == "" else example(PLAY).partition(header)[2]
    text = example(PLAY).replace(start, f"qqqqqqqq = 1\n{start}", 1)

    for key in known_keys(said(tmp_path / "press.toml", text, read_linkage)):
        assert f"`{key}`" in PLAY.replace(example(PLAY), ""), key


@pytest.mark.parametrize("name", ["pose", "path"])
def test_measurements_of_the_page(name: str, tmp_path: Path) -> None:
    """The columns of both files on the page are those that are read, and the mistake is told as it says."""
    rows = [line.strip() for line in PLAY.partition(f"    {name},")[2].partition("\n\n")[0].split("\n")]
    head = f"{name},{rows[0]}"
    if name == "pose":
        (tmp_path / "today.csv").write_text("\n".join([head, *rows[1:]]), encoding="utf-8")
        found = read_clearance_measurements(tmp_path / "today.csv")
        assert isinstance(found, RestMeasurement)
        assert found.readings == (2, 1)
        mixed = "\n".join([head.replace(",x_mm,y_mm", ",x_m,y_m"), *rows[1:]])
        assert f"    armwright: {said(tmp_path / 'today.csv', mixed, read_clearance_measurements)}\n" in PLAY
    else:
        few = "\n".join([head, *rows[1:]])
        assert "expected 20 samples or more, got 2" in said(tmp_path / "today.csv", few, read_clearance_measurements)


def known_keys(message: str) -> list[str]:
    """The keys that the answer to an unknown one lists."""
    keys = message.split("known keys: ")[1].split(", ")
    assert keys
    return keys


HEAD = "[arms.ARM_1]\njoint_positions = [0, 0, 0.3, 0, 0, 0]\n"


@pytest.mark.parametrize(
    ("text", "table"),
    [
        (f"qqqqqqqq = 1\n{HEAD}", ""),
        (f"{HEAD}qqqqqqqq = 1\n", ""),
        (f"{HEAD}[frames.A]\nat = [1,0,0, 0,1,0, 0,0,1, 0,0,0]\nqqqqqqqq = 1\n", ""),
        (f"{HEAD}[camera]\nqqqqqqqq = 1\n", "camera."),
        (f"{HEAD}[contact]\nqqqqqqqq = 1\n", "contact."),
        (f"{HEAD}[motion]\nqqqqqqqq = 1\n", "motion."),
        (f"{HEAD}[limits]\nqqqqqqqq = 1\n", "limits."),
        (f"{HEAD}[arms.ARM_1.servo]\nqqqqqqqq = 1\n", "servo."),
        (f"{HEAD}[arms.ARM_1.plant]\nmodel = 'stanford'\nqqqqqqqq = 1\n", "plant."),
        (f"{HEAD}[arms.ARM_1.sensors]\nqqqqqqqq = 1\n", "sensors."),
        (f"{HEAD}[arms.ARM_1.force]\nqqqqqqqq = 1\n", "force."),
    ],
)
def test_every_key_of_a_cell_is_explained(text: str, table: str, tmp_path: Path) -> None:
    """What the reader of cells knows in a table, the page explains."""
    for key in known_keys(said(tmp_path / "cell.toml", text, read_cell)):
        assert re.search(rf"^\|.*`{table}{key}`.*\|", CELLS, re.MULTILINE), key


REVOLUTE, PRISMATIC = '[[joint]]\nkind = "revolute"\n', '[[joint]]\nkind = "prismatic"\n'
# Where a key may end in several units, the page names one of them in full and tells the others once.
UNITS = re.compile(r"_(rad|cm|mm|m|deg)(_per_s2?)?$")


@pytest.mark.parametrize("joint", [REVOLUTE, PRISMATIC])
@pytest.mark.parametrize("table", ["", "limits", "link", "motor"])
def test_every_key_of_a_joint_is_explained(joint: str, table: str, tmp_path: Path) -> None:
    """What the reader of arms knows below a joint, the page explains."""
    text = f"{joint}[joint.{table}]\nqqqqqqqq = 1\n" if table else f"{joint}qqqqqqqq = 1\n"

    check_explained(said(tmp_path / "arm.toml", text, read_arm))


def test_code_of_the_page(tmp_path: Path) -> None:
    """The program on the page on code becomes the code that stands below it, and that code is read."""
    program, code = re.findall(r"^```\n(.*?)^```$", (DOCS / "code.md").read_text(), re.MULTILINE | re.DOTALL)[:2]
    (tmp_path / "hop.rlo").write_text(program, encoding="utf-8")
    (tmp_path / "page.rlc").write_text(code, encoding="utf-8")

    made, read = (command("code", name, "--full", cwd=tmp_path) for name in ("hop.rlo", "page.rlc"))

    assert made.stdout.rstrip("|\n ") == code.rstrip()
    assert read.stdout.rstrip("|\n ") == re.sub(r" +; PTP home$", "", code, flags=re.MULTILINE).rstrip()


@pytest.mark.parametrize("table", ["base", "tool", "hand", "gravity", ""])
def test_every_key_of_an_arm_is_explained(table: str, tmp_path: Path) -> None:
    """What the reader of arms knows of the whole arm, the page explains."""
    text = f"{REVOLUTE}[{table}]\nqqqqqqqq = 1\n" if table else f"qqqqqqqq = 1\n{REVOLUTE}"

    check_explained(said(tmp_path / "arm.toml", text, read_arm))


def check_explained(message: str) -> None:
    """Every key stands on the page outside the example, in this unit or in another."""
    explained = re.findall(r"`(?:\w+\.)?(\w+)`", ARMS.replace(example(ARMS), ""))
    stems = {UNITS.sub("", key) for key in explained}
    for key in known_keys(message):
        assert UNITS.sub("", key) in stems or re.search(rf"`\[\[{key}\]\]`|`\[(joint\.)?{key}\]`|`{key}\.", ARMS), key
        for unit in UNITS.findall(key):
            assert f"_{''.join(unit)}`" in ARMS, key


def test_load_of_the_page(tmp_path: Path) -> None:
    """The load on the page on arms is read, every quantity in SI units."""
    (tmp_path / "part.toml").write_text(example(ARMS.partition("## A load at the tool")[2]), encoding="utf-8")

    load = read_load(tmp_path / "part.toml")

    assert load.mass == 1.8
    np.testing.assert_allclose(load.com, (0, 0, 0.05))
    np.testing.assert_array_equal(load.inertia, 0.003 * np.eye(3))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(DOCS)))
def test_links_and_pictures_are_there(page: Path) -> None:
    """Every file that a page links to, or shows as a picture, is there."""
    for target in re.findall(r"\]\(([^)#:\s]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
        assert (page.parent / target).exists(), target


def test_pictures_are_shown_and_small() -> None:
    """Every drawing is on some page, which says in words what it shows, and takes less than 200 kB."""
    shown = {
        (page.parent / target).resolve()
        for page in PAGES
        for target in re.findall(r"!\[[^\]]{40,}\]\(([^)]+)\)", page.read_text(encoding="utf-8"))
    }
    drawings = set((DOCS / "pictures").resolve().glob("*.svg"))

    assert len(drawings) >= 2
    assert drawings <= shown
    assert all(drawing.stat().st_size < 200_000 for drawing in drawings)


def test_tests_that_the_physics_pages_name() -> None:
    """Who follows a page to a test finds it."""
    tests = Path(__file__).parent
    modules = {path.name for path in tests.rglob("test_*.py")}
    functions = {name for path in tests.rglob("test_*.py") for name in re.findall(r"def (test_\w+)", path.read_text())}
    for page in (DOCS / "physics").glob("*.md"):
        text = page.read_text(encoding="utf-8")
        for path in re.findall(r"`tests/([\w/]+\.py)`", text):
            assert (tests / path).exists(), path
        for name in re.findall(r"`(test_\w+)(?:\.py)?`", text):
            assert f"{name}.py" in modules or name in functions, name


def test_names_of_the_translation() -> None:
    """Every function in our column of the table can be had from the package."""
    rows = re.findall(r"^\|[^|]+\|([^|]+)\|", (DOCS / "translation.md").read_text(encoding="utf-8"), re.MULTILINE)
    names = {name for row in rows for name in re.findall(r"(?<![\w.])([a-z][\w.]*)\(", row)}

    assert len(names) > 12
    for name in names:
        assert callable(operator.attrgetter(name)(armwright)), name


def test_configurations_of_the_picture() -> None:
    """The pose on the page on kinematics has eight configurations; of each pair of wrists joint 4 allows one."""
    text = (DOCS / "physics" / "kinematics.md").read_text(encoding="utf-8")
    found = re.search(r"inverse puma560-seed --xyz (\S+) --rpy ([^`]+)`", text)
    assert found is not None
    place, turn = (np.array([float(x) for x in numbers.split(",")]) for numbers in found.groups())
    roll, pitch, yaw = (
        rotation_from_vector(angle * axis) for angle, axis in zip(np.radians(turn), np.eye(3), strict=True)
    )

    solution = armwright.kinematics.inverse(
        armwright.load_arm("puma560-seed"), homogeneous(yaw @ pitch @ roll, place / 1e3)
    )

    assert len(solution.branches) == 8
    assert len({branch.label.rpartition(",")[0] for branch in solution.allowed}) == len(solution.allowed) == 4
    assert {violation.joint for branch in solution for violation in branch.violations} == {4}


def test_energy_of_the_picture() -> None:
    """The numbers below the picture of the released arm are those of the motion, and the account balances."""
    text = (DOCS / "physics" / "dynamics.md").read_text(encoding="utf-8")
    found = armwright.simulation.simulate(
        armwright.load_arm("puma560-seed"),
        np.radians((0, -60, 60, 0, 30, 0)),
        duration=6.0,
        integrator=Adaptive(rtol=1e-9, atol=1e-11),
        period=0.01,
    )

    assert found.status is Status.FINISHED
    assert found.at_rest()
    assert np.abs(found.energy_imbalance).max() < 2e-10
    height = found.energy[0] - found.potential.min()
    heat, impact = found.heat[-1].sum(), found.impact[-1]
    assert f"Of its {height:.1f} J of potential energy" in text
    assert f"Coulomb friction dissipates {heat:.1f} J and the two stops {impact:.1f} J" in text
    moves = {joint: [e.t for e in found.events if e.joint == joint and e.after == JointState.MOVES] for joint in (0, 2)}
    assert f"Joint 3 starts to move after {moves[2][0]:.2f} s and joint 1 after {moves[0][0]:.2f} s" in text
    assert f"at {found.events[-1].t:.2f} s all joints are at rest" in text


def test_numbers_of_the_study() -> None:
    """What the page on dynamics says of Bejczy's model and of the load is what the study finds."""
    text = (DOCS / "physics" / "dynamics.md").read_text(encoding="utf-8")
    rows = joint_table(torques())

    *most, last = [f"{100 * row.bejczy:.0f}" for row in rows]
    load = [f"{100 * row.load:.0f}" for row in rows]
    assert f"{', '.join(most)} and {last} %" in text
    assert f"joints 4 and 5 by {load[3]} and {load[4]} %, those of the others by {load[2]} % at most" in text
    assert max((rows[i] for i in (0, 1, 2, 5)), key=lambda row: row.load).joint == 3
    assert f"Joint 5 then needs {rows[4].peak_loaded:.1f} N m, and its motor has {rows[4].limit:g}" in text


def test_every_page_is_on_the_site() -> None:
    """Every page stands in the navigation of the site, alone, or in a folder all of which does."""
    settings = (DOCS.parent / "mkdocs.yml").read_text(encoding="utf-8")
    whole = ("decisions/",)

    for page in PAGES:
        place = page.relative_to(DOCS).as_posix()
        assert place.startswith(whole) or re.search(rf"[ ]{re.escape(place)}$", settings, re.MULTILINE), place


def test_decisions_are_listed() -> None:
    """The list of decisions has every one of them, under its own title and number."""
    listed = (DOCS / "decisions" / "README.md").read_text(encoding="utf-8")

    decisions = sorted((DOCS / "decisions").glob("0*.md"))

    for number, page in enumerate(decisions, 1):
        title = page.read_text(encoding="utf-8").partition("\n")[0].removeprefix("# ")
        assert title.startswith(f"{number}. ")
        assert f"{number}. [{title.removeprefix(f'{number}. ')}]({page.name})\n" in listed


def test_site_fetches_nothing() -> None:
    """What the site is set up with names nothing on the net: no fonts, no scripts, no styles."""
    settings = (DOCS.parent / "mkdocs.yml").read_text(encoding="utf-8")

    assert not re.findall(r"https?:", settings)
    assert "font: false" in settings
    assert "iframe-worker" in settings  # without one of ours the plugin "offline" names one on the net
    assert (DOCS / "site" / "iframe-worker.js").exists()


def test_gallery_of_the_page() -> None:
    """The page of the gallery is the one that its script writes, and shows every picture that was taken."""
    made = runpy.run_path(str(DOCS / "make_gallery.py"))

    assert made["text"]() == (DOCS / "gallery.md").read_text(encoding="utf-8")
    assert {exhibit.picture for exhibit in made["EXHIBITS"]} == set((DOCS / "gallery").iterdir())
    assert sum(exhibit.picture.stat().st_size for exhibit in made["EXHIBITS"]) < 1_500_000


@pytest.mark.drawn(0.34)
@pytest.mark.parametrize("name", ["stanford-torque", "puma-moves", "dh-calibration"])
def test_studies_of_the_page(name: str) -> None:
    """The page of the studies tells what the studies find; the long one is told by a run of its own."""
    made = runpy.run_path(str(DOCS / "make_studies.py"))

    assert name in made["QUICK"]
    page = (DOCS / "studies.md").read_text(encoding="utf-8")
    told = re.search(rf"^## {name}\n.*?(?=^## |\Z)", page, re.MULTILINE | re.DOTALL)
    assert told is not None
    assert matches(told[0].rstrip().splitlines(), made["section"](name).rstrip().splitlines())


def test_first_page_has_a_page_of_a_run() -> None:
    """On the site the picture of the first page is a page of a run, which needs no network and begins with the view."""
    pytest.importorskip("mkdocs", reason="the extra docs is not installed")
    made = runpy.run_path(str(DOCS / "make_site.py"))

    shown = made["with_live_page"]((DOCS / "index.md").read_text(encoding="utf-8"), "index.md")

    frame = re.search(r"<iframe [^>]*>", shown)
    assert frame is not None
    assert {f'src="{made["FRAMED"]}"', 'loading="lazy"'} <= set(frame[0].removesuffix(">").split())
    assert re.search(r' title="[^"]{20,}"', frame[0])
    assert f"]({made['LIVE']})" in shown
    assert "![" not in shown
    page = made["live_page"]()
    assert "default-src 'none'" in page
    assert not re.findall(r"(?:src|href)=\"https?:", page)
    # What the frame leaves out is there.
    assert "<header>" in page
    assert 'class="headline"' in page


def test_reference_has_every_module() -> None:
    """Each folder of the house has its page in the reference, and each module stands on one page, a new one too."""
    pytest.importorskip("mkdocs", reason="the extra docs is not installed")
    made = runpy.run_path(str(DOCS / "make_site.py"))
    package = Path(armwright.__file__).parent

    pages = made["api_pages"]()

    shown = [name for page in pages.values() for name in re.findall(r"^::: armwright\.(\S+)$", page, re.MULTILINE)]
    assert len(shown) == len(set(shown))
    modules = {".".join(path.relative_to(package).with_suffix("").parts) for path in package.rglob("*.py")}
    kept = {name for name in modules if not name.endswith("__init__") and name.partition(".")[0] not in made["NO_API"]}
    assert kept <= set(shown)


def test_operations_of_compiled_equations() -> None:
    """The page on compiled equations says of each quantity how many operations it takes."""
    page = (DOCS / "physics" / "compiled-equations.md").read_text(encoding="utf-8")
    head, _, *rows = re.search(r"\| operations per configuration.*?\n\n", page, re.DOTALL)[0].strip().splitlines()  # type: ignore[index]
    names = re.findall(r"`(.+?)`", head)
    printed = [re.findall(r"[\w-]+", row) for row in rows]

    assert [row[0] for row in printed] == list(quantity_names())
    for name, *counts in printed:
        for arm, count in zip(names, counts, strict=True):
            assert sum(emit_quantity(load_arm(arm), name).operations.values()) == int(count), (name, arm)
