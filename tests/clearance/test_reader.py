"""Linkages from files: the catalogue, and what is wrong with a file."""

import math
from pathlib import Path

import attrs
import numpy as np
import pytest

from armwright.clearance.ideal import close_pins
from armwright.clearance.linkage import Guide, Linkage, Pin
from armwright.clearance.reader import linkage_names, load_linkage, read_linkage
from armwright.clearance.scenario import assembly_guess
from armwright.errors import FileFormatError, InvalidValueError, UnknownNameError

SLIDER = Path(__file__).parents[2] / "src" / "armwright" / "clearance" / "catalogue" / "slider-crank.toml"


def rewritten(folder: Path, *changes: tuple[str, str]) -> Path:
    """The slider-crank's file with some words changed."""
    text = SLIDER.read_text(encoding="utf-8")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    path = folder / "mine.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_catalogue() -> None:
    """Five-bar, four-bar and slider-crank are there."""
    assert linkage_names() == ["five-bar", "four-bar", "slider-crank"]


@pytest.mark.parametrize("name", linkage_names())
def test_catalogue_can_be_put_together(name: str) -> None:
    """Every linkage of the catalogue closes within 90° of its assembly, and has a drive per freedom."""
    linkage = load_linkage(name)
    guess = assembly_guess(linkage)

    q = close_pins(linkage, guess, drives=guess[list(linkage.driven)])

    angles = [i for i, coordinate in enumerate(linkage.coordinates) if coordinate.kind == "angle"]
    assert np.abs(q - guess)[angles].max() < np.pi / 2
    assert len(linkage.coordinates) == len(linkage.drives) + 2 * len(linkage.pins)


def test_thesis_arm() -> None:
    """The five-bar has the thesis' cranks of 2.5 kg, rods of 0.8 kg and 650 mm, and 0.98 N at the tip."""
    linkage = load_linkage("five-bar")

    assert [body.mass for body in linkage.bodies] == [2.5, 0.8, 0.8, 2.5]
    assert [body.inertia for body in linkage.bodies] == [0.0233, 0.0282, 0.0282, 0.0233]
    np.testing.assert_array_equal(linkage.body("link2").points["J3"], (0.65, 0.0))
    np.testing.assert_array_equal(linkage.loads[0].force, (0.0, -0.98))
    assert linkage.zero == pytest.approx(-math.pi / 2)


def test_units(tmp_path: Path) -> None:
    """Millimetres and degrees of a file are metres and radians of the linkage."""
    linkage = read_linkage(
        rewritten(
            tmp_path,
            ("clearance_mm = 0.5", "clearance_mm = 0.25"),
            ("crank_deg = 0", "crank_deg = 45"),
            ('on = "ground:O"\n\n[[play]]', 'on = "ground:O"\ndirection_deg = 30\nangle_deg = -90\n\n[[play]]'),
        )
    )

    assert linkage.clearances == {"B": 0.25e-3}
    assert linkage.assembly["crank"] == pytest.approx(math.pi / 4)
    assert linkage.assembly["slider"] == pytest.approx(0.17)
    guide = linkage.joint("slider")
    assert isinstance(guide, Guide)
    assert (guide.direction, guide.angle) == pytest.approx((math.pi / 6, -math.pi / 2))
    assert isinstance(linkage.joint("rod"), Pin)


def test_a_path_is_a_file(tmp_path: Path) -> None:
    """What has a dot or a slash is looked for on the disk, and is called after its file if it gives itself no name."""
    path = rewritten(tmp_path, ('name = "slider-crank"', ""))

    assert load_linkage(str(path)).name == "mine"


def same(linkage: Linkage, other: Linkage) -> bool:
    return (
        linkage.coordinates == other.coordinates
        and linkage.clearances == other.clearances
        and linkage.joints == other.joints
    )


def test_name_or_path(tmp_path: Path) -> None:
    """By its name or by its path a linkage is the same."""
    assert same(load_linkage("slider-crank"), load_linkage(rewritten(tmp_path)))


def test_unknown_name() -> None:
    """A linkage that is not in the catalogue is refused with the nearest that is."""
    with pytest.raises(UnknownNameError, match=r"no linkage 'fivebar'. Did you mean 'five-bar'\?"):
        load_linkage("fivebar")


def test_no_file(tmp_path: Path) -> None:
    """A file that does not exist is named."""
    with pytest.raises(FileFormatError, match=r"nowhere\.toml"):
        load_linkage(tmp_path / "nowhere.toml")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("clearance_mm = 0.5", "clearance_mm = -0.5", r"clearance_mm.*-0\.5"),
        ("clearance_mm = 0.5", "clearance = 0.5", "clearance"),
        ("journal_radius_mm = 9.5", "journal_radius_mm = 0", "journal_radius_mm"),
        (
            'bearing = "slider:P"',
            'bearing = "slider.P"',
            "bearing.*expected a point of a body such as 'link1:J2', got 'slider.P'",
        ),
        ('journal = "rod:B"', 'journal = "rod:C"', r"no point of rod 'C'"),
        ('journal = "rod:B"', 'journal = "rot:B"', r"no body 'rot'. Did you mean 'rod'\?"),
        ('kind = "guide"', 'kind = "slot"', r"kind.*'slot'"),
        ('kind = "motion"', 'kind = "speed"', r"kind.*'speed'"),
        ("mass = 0.21", "mass = -0.21", r"mass.*-0\.21"),
        ("mass = 0.21", "mass = 'heavy'", "mass"),
        ("mass = 0.21", "mass = 0.21\nlength = 3", "length"),
        ("centre = [0.06, 0.0]", "centre = [0.06]", "centre"),
        ("slider_mm = 170", "slider_m = 0.17", "slider_m.*expected the name of a body with its unit"),
        ("slider_mm = 170", "sliver_mm = 170", r"no body 'sliver'"),
        ("friction = 0.0", "friction = -1", "friction"),
        ("friction = 0.0", "restitution = 1.5", r"restitution.*1\.5"),
        ('tip = "slider:P"', 'tipp = "slider:P"', "tip"),
        ("gravity = [0.0, -9.81]", "gravity = 9.81", "gravity"),
        ('on = "crank:A"', 'on = "slider:P"', "body rod is carried by slider, which must be named before it"),
    ],
)
def test_mistakes(tmp_path: Path, old: str, new: str, message: str) -> None:
    """A mistake is named with its file and what was expected."""
    path = rewritten(tmp_path, (old, new))
    with pytest.raises(FileFormatError, match=message) as refused:
        read_linkage(path)
    assert "mine.toml" in str(refused.value)


def test_no_toml(tmp_path: Path) -> None:
    """A file that is no TOML says in which line."""
    path = rewritten(tmp_path, ("[material]", "[material"))
    with pytest.raises(FileFormatError, match=r"mine\.toml:[0-9]+: not valid TOML"):
        read_linkage(path)


def test_free_body_that_nothing_holds() -> None:
    """A body that no pin joins to the rest cannot be put anywhere."""
    linkage = load_linkage("five-bar")
    adrift = attrs.evolve(linkage, pins=linkage.pins[:1], joints=linkage.joints)
    with pytest.raises(InvalidValueError, match="five-bar: no pin joins link3 to the other bodies"):
        assembly_guess(adrift)
