"""The commands ``armwright arms`` and ``armwright show``, as a user calls them."""

import json
import math
import re
from pathlib import Path

import attrs
import numpy as np
import pytest

from armwright.arm.load import arm_names, arm_summaries, load_arm
from armwright.arm.model import Motor
from cli_calls import armwright
from oracles.catalogue import FEW, NAMES

HEADINGS = ("Denavit-Hartenberg", "Limits", "Links", "Drives")
LIFT = """
title = "Lift [v2] [/] of 3 kg :smile:"
source = "[red]a drawing[/blue]"
[[joint]]
kind = "prismatic"
d_m = 0.123456
theta_deg = 33.3333
[joint.limits]
upper_m = 0.5
[joint.link]
mass_kg = 3
[joint.motor]
coulomb_backward_N = 4
"""

KNOWN = f"All {len(NAMES)}: armwright arms."


def test_the_catalogue() -> None:
    """Every arm of the catalogue is listed on a line of its own that fits 80 columns, with its title."""
    result = armwright("arms")

    table, _, below = result.stdout.partition("\n\n")
    head, *lines = table.splitlines()
    assert result.returncode == 0
    assert head.split() == ["name", "joints", "title"]
    assert tuple(line.split()[0] for line in lines) == arm_names()
    assert all(each.title in line for each, line in zip(arm_summaries(), lines, strict=True))
    assert max(map(len, result.stdout.splitlines())) <= 80
    confirmed = below.partition(".")[0].removeprefix("Geometry of two documents: ").replace("\n", " ").split(", ")
    assert {"panda", "ur5e"} <= set(confirmed) <= set(arm_names()) - {"ntu-3r", "ur5", "irb120"}


def test_the_catalogue_for_programs() -> None:
    """With --json the catalogue is a list of names, numbers of joints, titles, sources and documents."""
    rows = json.loads(armwright("arms", "--json").stdout)

    joints = {row["name"]: row["joints"] for row in rows}
    assert tuple(joints) == arm_names()
    some = {"ntu-3r": 3, "cobra600": 4, "m430ia-2f": 5, "puma560": 6, "ur5": 6, "panda": 7}
    assert some.items() <= joints.items()
    assert all(row["title"] and row["source"] for row in rows)
    gives = {quantity for row in rows for document in row["documents"] for quantity in document["gives"]}
    assert {"geometry", "speeds", "masses"} <= gives


def test_documents_of_the_catalogue() -> None:
    """With --sources every arm has lines of its documents: what each gives, its place, revision and licence."""
    lines = armwright("arms", "--sources").stdout.splitlines()

    at = lines.index("irb6700-200-260: ABB IRB 6700-200/2.60")
    assert lines[at + 1] == (
        "  geometry, positions, speeds: ABB IRB 6700-200/2.60 as URDF, ros-industrial/abb, "
        "abb_irb6700_support/urdf/irb6700_200_260_macro.xacro, revision 655ec59ec75a0a69333c6ce3c2af5c400c45bc7b, "
        "BSD-3-Clause"
    )
    assert sum(not line.startswith(" ") for line in lines) == len(NAMES)
    assert any(line.startswith("  confirms geometry: ") for line in lines)


@pytest.mark.drawn(FEW)
@pytest.mark.parametrize("name", NAMES)
def test_tables_fit_the_screen(name: str) -> None:
    """At 80 columns every table is whole: no number is cut off, no line is longer."""
    result = armwright("show", name)

    lines = result.stdout.splitlines()
    assert (result.returncode, result.stderr) == (0, "")
    assert lines[0].startswith(name)
    assert "…" not in result.stdout
    assert max(map(len, lines)) <= 80
    for heading in HEADINGS:
        assert sum(line.startswith(heading) for line in lines) == 1


def test_arm_without_a_title(tmp_path: Path) -> None:
    """An arm that nobody gave a title is called by its name alone."""
    (tmp_path / "plain.toml").write_text('[[joint]]\nkind = "revolute"\n', encoding="utf-8")

    assert armwright("show", tmp_path / "plain.toml").stdout.splitlines()[0] == "plain"


def test_numbers_of_the_puma() -> None:
    """People read degrees and millimetres: the second joint of the PUMA, row for row."""
    rows = [re.split(r"\s{2,}", line.strip()) for line in armwright("show", "puma560").stdout.splitlines()]

    assert ["2", "revolute", "q2", "0 mm", "432 mm", "0°"] in rows
    assert ["2", "-225°", "45°", "95°/s", "40°/s²", "186.4 N m"] in rows
    assert ["2", "17.4", "-364", "6", "227.5"] in rows
    assert ["2", "0.13", "0.524", "0.539", "0", "0", "0"] in rows
    assert ["2", "4.71 kg m²", "0 N m s", "5.5 N m", "107.82"] in rows


def test_numbers_of_a_slide() -> None:
    """A slide shows its position under d, and its limits in millimetres and newtons."""
    rows = [re.split(r"\s{2,}", line.strip()) for line in armwright("show", "stanford").stdout.splitlines()]

    assert ["3", "prismatic", "-90°", "q3", "0 mm", "0°"] in rows
    assert ["3", "140 mm", "1117.6 mm", "750 mm/s", "3000 mm/s²", "198 N"] in rows


@pytest.mark.drawn(FEW)
@pytest.mark.parametrize("name", NAMES)
def test_json_is_si(name: str) -> None:
    """The JSON of an arm has every number of the model, in SI units and radians, and null for what is not limited."""
    data, arm = json.loads(armwright("show", name, "--json").stdout), load_arm(name)

    assert len(data["joints"]) == len(data["links"]) == len(data["motors"]) == arm.n
    for row, joint in zip(data["joints"], arm.joints, strict=True):
        assert [row[key] for key in ("kind", "theta", "d", "a", "alpha")] == [
            joint.kind,
            joint.theta,
            joint.d,
            joint.a,
            joint.alpha,
        ]
        for key, value in row["limits"].items():
            limit = getattr(joint.limits, key)
            assert value == (None if math.isinf(limit) else limit)
    for row, link, motor in zip(data["links"], arm.links, data["motors"], strict=True):
        assert row["mass"] == link.mass
        np.testing.assert_array_equal(row["com"], link.com)
        np.testing.assert_array_equal(row["inertia"], link.inertia)
        assert set(motor) == {field.name for field in attrs.fields(Motor)}
    for key in ("base", "tool", "gravity"):
        np.testing.assert_array_equal(data[key], getattr(arm, key))
    if name == "puma560":
        assert data["joints"][1]["limits"]["upper"] == pytest.approx(math.radians(45))
        assert (data["joints"][1]["a"], data["reach"], data["tool_speed"]) == (0.432, 0.878, 0.5)


def test_an_arm_file(tmp_path: Path) -> None:
    """A file of one's own is shown as it is written: brackets and colons of its title mean nothing to the screen."""
    (tmp_path / "lift.toml").write_text(LIFT)

    result = armwright("show", tmp_path / "lift.toml")

    assert result.returncode == 0, result.stderr
    assert "lift: Lift [v2] [/] of 3 kg :smile:" in result.stdout
    assert "[red]a drawing[/blue]" in result.stdout
    assert "q1 +123.456 mm" in result.stdout
    assert "+0 / -4 N" in result.stdout


def rows_of(text: str) -> list[list[str]]:
    """The cells of the rows of tables."""
    return [re.split(r"\s{2,}", line.strip()) for line in text.splitlines()]


def test_collisions_of_the_ur5() -> None:
    """The solids of an arm are listed with their sizes, and every pair of its seven bodies once, with the reason."""
    result = armwright("show", "ur5", "--collisions")

    rows = rows_of(result.stdout)
    assert (result.returncode, result.stderr) == (0, "")
    assert ["link 2", "capsule", "radius 58 mm, length 365 mm", "arm file"] in rows
    assert ["link 4", "link 6"] in rows
    assert ["link 2", "link 3", "neighbours: joint 3 joins them"] in rows
    assert "guess" not in result.stdout

    data = json.loads(armwright("show", "ur5", "--collisions", "--json").stdout)

    bodies = ["base", *(f"link {i}" for i in range(1, 7))]
    assert [body["body"] for body in data["bodies"]] == bodies
    pairs = data["checked"] + [entry["bodies"] for entry in data["left_out"]]
    assert sorted(map(tuple, pairs)) == [(a, b) for i, a in enumerate(bodies) for b in bodies[i + 1 :]]
    (forearm,) = [solid for solid in data["bodies"][3]["solids"] if solid["length"] > 0.3]
    assert (forearm["kind"], forearm["radius"], forearm["guessed"]) == ("capsule", 0.039, False)
    # The upper arm lies 135.85 mm beside the plane of the frames, and the forearm 119.7 mm before it.
    assert forearm["pose"][2][3] == pytest.approx(0.13585 - 0.1197, abs=1e-4)


def test_guesses_are_called_so() -> None:
    """A guessed capsule is called a guess, with its radius."""
    result = armwright("show", "ntu-3r", "--collisions")

    # 5 % of the length of the arm, whose steps are 76, 400, 12 and 354.3 mm, and a quarter less.
    assert ["link 2", "capsule", f"radius {0.75 * 0.05 * 842.3:.5g} mm, length 400 mm", "guess"] in rows_of(
        result.stdout
    )
    assert result.stdout.splitlines()[-2].startswith(
        "All solids are guesses; the keys base_solids and solids of an arm"
    )


def test_pairs_of_an_arm_file(tmp_path: Path) -> None:
    """What a file says of its pairs is told as such, and links are called by their names too."""
    joint = '[[joint]]\nkind = "revolute"\na_mm = 300\n[joint.link]\nsolids = [{kind = "sphere", diameter_mm = 90}]\n'
    pairs = '[collisions]\nleave_out = [["link 1", "fore"]]\ncheck = [["fore", "link 2"]]\n'
    (tmp_path / "three.toml").write_text(f'{pairs}{joint * 3}name = "fore"\n', encoding="utf-8")

    rows = rows_of(armwright("show", tmp_path / "three.toml", "--collisions").stdout)

    assert ["link 1", "link 3 ('fore')", "left out by the arm file"] in rows
    assert ["link 2", "link 3 ('fore')"] in rows
    assert ["link 3 ('fore')", "sphere", "radius 45 mm", "arm file"] in rows


def test_a_narrow_screen() -> None:
    """On 40 columns tables are wider than the screen, but every number is there."""
    wide, narrow = armwright("show", "ur5").stdout, armwright("show", "ur5", columns=40).stdout

    assert "…" not in narrow
    assert narrow.split() == wide.split()


@pytest.mark.parametrize(
    ("argument", "message"),
    [
        ("pumma560", "no arm 'pumma560'. Did you mean 'puma560'? " + KNOWN),
        ("", "no arm ''. " + KNOWN),
        ("yaskawa", "no arm 'yaskawa'. Similar: gp12, gp25, gp7, gp8, hc10, sia20d. " + KNOWN),
        ("nothing.toml", "nothing.toml: no such file"),
        ("lfit.toml", "lfit.toml: no such file; did you mean 'lift.toml'?"),
        ("./", ".: expected a file, got a folder"),
        ("bad.toml", "bad.toml:2: joint 1, kind: expected one of prismatic, revolute, got the text 'rotary'"),
        ("lines.toml", r"lines.toml:1: title: expected a text in quotes, got 3"),
        ("odd.toml", r"odd.toml:2: joint 1, kind: expected one of prismatic, revolute, got the text 'a\nb'"),
    ],
)
def test_mistakes(argument: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A mistake of the caller's ends with one line that says what to do: a name with status 2, a file with 4."""
    (tmp_path / "lift.toml").write_text(LIFT)
    (tmp_path / "bad.toml").write_text('[[joint]]\nkind = "rotary"\n')
    (tmp_path / "lines.toml").write_text('title = 3\n[[joint]]\nkind = "revolute"\n')
    (tmp_path / "odd.toml").write_text('[[joint]]\nkind = "a\\nb"\n')
    monkeypatch.chdir(tmp_path)

    result = armwright("show", argument)

    assert (result.returncode, result.stdout) == (2 if message.startswith("no arm") else 4, "")
    assert result.stderr == f"armwright: {message}\n"


@pytest.mark.parametrize("command", ["arms", "show"])
def test_help(command: str) -> None:
    """The help has an example in it."""
    result = armwright(command, "--help")

    assert result.returncode == 0
    assert re.search(rf"^ Example: armwright {command}", result.stdout, re.MULTILINE)


def test_show_without_an_arm() -> None:
    """Leaving out the arm is a mistake in the call: exit status 2."""
    result = armwright("show")

    assert result.returncode == 2
    assert "Traceback" not in result.stderr
