"""What a planar linkage is, and which it cannot be."""

from typing import Any

import attrs
import numpy as np
import pytest

from armwright.clearance.linkage import (
    Body,
    BodyPoint,
    ClearancePin,
    Coordinate,
    Drive,
    Guide,
    Linkage,
    Load,
    Material,
    Pin,
    round_to_right_angle,
)
from armwright.clearance.reader import load_linkage
from armwright.errors import InvalidValueError, ShapeError, UnknownNameError


@pytest.fixture(scope="module")
def five_bar() -> Linkage:
    return load_linkage("five-bar")


class TestWhatItIs:
    """Coordinates, drives and pins."""

    def test_coordinates(self, five_bar: Linkage) -> None:
        """A crank has an angle, a free rod the position of its centre and an angle: eight for the five-bar."""
        names = [str(coordinate) for coordinate in five_bar.coordinates]

        assert names == [
            "link1.angle", "link2.x", "link2.y", "link2.angle", "link3.x", "link3.y", "link3.angle", "link4.angle",
        ]  # fmt: skip
        assert five_bar.driven == (0, 7)

    def test_slide(self) -> None:
        """What a guide holds has a slide."""
        assert load_linkage("slider-crank").coordinates == (
            Coordinate("crank", "angle"),
            Coordinate("rod", "angle"),
            Coordinate("slider", "slide"),
        )

    def test_other_clearances(self, five_bar: Linkage) -> None:
        """A linkage with other play is another linkage; the first stays as it was."""
        other = five_bar.with_clearances({"J3": 1e-4})

        assert other.clearances == {"J2": 5e-4, "J3": 1e-4, "J4": 5e-4}
        assert five_bar.clearances == {"J2": 5e-4, "J3": 5e-4, "J4": 5e-4}

    def test_never_changes(self, five_bar: Linkage) -> None:
        """Neither a linkage nor the numbers in it can be written to."""
        with pytest.raises(attrs.exceptions.FrozenInstanceError):
            five_bar.name = "other"  # type: ignore[misc]
        with pytest.raises(ValueError, match="read-only"):
            five_bar.bodies[0].centre[0] = 1.0

    def test_places_are_written_with_a_colon(self) -> None:
        """The end of link 1 is link1:J2."""
        assert str(BodyPoint("link1", "J2")) == "link1:J2"

    def test_right_angles_are_exact(self) -> None:
        """The cosine of a right angle is 0, not 6e-17."""
        assert [round_to_right_angle(float(np.cos(k * np.pi / 2))) for k in range(4)] == [1.0, 0.0, -1.0, 0.0]
        assert round_to_right_angle(0.5) == 0.5


def changed(linkage: Linkage, what: str, number: int, **changes: Any) -> Linkage:
    parts = list(getattr(linkage, what))
    parts[number] = attrs.evolve(parts[number], **changes)
    return attrs.evolve(linkage, **{what: parts})


class TestWhatItCannotBe:
    """Mistakes, each with a message that names what is wrong."""

    def test_unknown_body(self, five_bar: Linkage) -> None:
        """A joint of a body that does not exist is refused with the nearest name."""
        with pytest.raises(UnknownNameError, match=r"no body 'link11'. Did you mean 'link1'\?"):
            changed(five_bar, "joints", 0, body="link11")

    def test_unknown_point(self, five_bar: Linkage) -> None:
        """A journal at a point that its body does not have is refused with those that it has."""
        with pytest.raises(UnknownNameError, match=r"no point of link2 'J4'.*J2, J3"):
            changed(five_bar, "pins", 0, journal=BodyPoint("link2", "J4"))

    @pytest.mark.parametrize("what", ["tip", "loads"])
    def test_loads_and_tip_have_a_place(self, five_bar: Linkage, what: str) -> None:
        """Tip and loads are at points of bodies."""
        nowhere = BodyPoint("link3", "end")
        wrong: Any = nowhere if what == "tip" else [Load(point=nowhere, force=(0, -1))]
        with pytest.raises(UnknownNameError, match="no point of link3 'end'"):
            attrs.evolve(five_bar, **{what: wrong})

    def test_order(self, five_bar: Linkage) -> None:
        """A body cannot hang on one that comes later: so there are no rings of ideal joints."""
        joints = [Pin(body="link1", point="J1", on=BodyPoint("link2", "J2")), *five_bar.joints[1:]]
        with pytest.raises(InvalidValueError, match="body link1 is carried by link2, which must be named before it"):
            attrs.evolve(five_bar, joints=joints)

    def test_twins(self, five_bar: Linkage) -> None:
        """Names are given once; a body hangs on one ideal joint and has one drive."""
        with pytest.raises(InvalidValueError, match="body 'link1' is defined twice"):
            attrs.evolve(five_bar, bodies=[*five_bar.bodies, five_bar.bodies[0]])
        with pytest.raises(InvalidValueError, match="pin 'J2' is defined twice"):
            attrs.evolve(five_bar, pins=[*five_bar.pins, five_bar.pins[0]])
        with pytest.raises(InvalidValueError, match="joint of body 'link1' is defined twice"):
            attrs.evolve(five_bar, joints=[*five_bar.joints, five_bar.joints[0]])
        with pytest.raises(InvalidValueError, match="drive of body 'link4' is defined twice"):
            attrs.evolve(five_bar, drives=[*five_bar.drives, Drive(body="link4")])

    def test_ground_is_no_body(self, five_bar: Linkage) -> None:
        """The ground does not move."""
        with pytest.raises(InvalidValueError, match="body 'ground' is defined twice"):
            attrs.evolve(five_bar, bodies=[*five_bar.bodies, Body(name="ground", mass=1.0, inertia=1.0)])

    def test_without_mass(self, five_bar: Linkage) -> None:
        """Without mass a body has no motion that follows from forces; on a guide it needs no inertia."""
        with pytest.raises(InvalidValueError, match="body link2: mass and inertia must be above 0"):
            changed(five_bar, "bodies", 1, mass=0.0)
        with pytest.raises(InvalidValueError, match="body link1: mass and inertia must be above 0"):
            changed(five_bar, "bodies", 0, inertia=0.0)
        assert load_linkage("slider-crank").body("slider").inertia == 0.0

    def test_drive_of_what_flies(self, five_bar: Linkage) -> None:
        """A motor sits at an ideal joint."""
        with pytest.raises(InvalidValueError, match="drive of link2: the body has no ideal joint"):
            attrs.evolve(five_bar, drives=[Drive(body="link2")])

    def test_kind_of_drive(self, five_bar: Linkage) -> None:
        """Of a drive the effort is given or the motion."""
        with pytest.raises(UnknownNameError, match=r"no kind of drive 'force'"):
            attrs.evolve(five_bar, drives=[Drive(body="link1", kind="force")])  # type: ignore[arg-type]

    def test_motion_of_what_is_carried(self) -> None:
        """The motion of a rod cannot be given against a crank that rotates freely."""
        linkage = load_linkage("four-bar")
        with pytest.raises(InvalidValueError, match=r"drive of coupler: its motion .* only if that of crank"):
            attrs.evolve(linkage, drives=[Drive(body="coupler", kind="motion")])
        both = attrs.evolve(linkage, drives=[Drive(body=name, kind="motion") for name in ("coupler", "crank")])
        assert both.driven == (1, 0)

    def test_assembly(self, five_bar: Linkage) -> None:
        """An assembly speaks of bodies that are there."""
        with pytest.raises(UnknownNameError, match=r"no body 'link5'"):
            attrs.evolve(five_bar, assembly={"link5": 1.0})

    @pytest.mark.parametrize(
        ("wrong", "message"),
        [
            ({"clearance": -1e-4}, "pin J2: clearance: expected 0 or more, got -0.0001"),
            ({"clearance": np.nan}, "pin J2: clearance"),
            ({"journal_radius": 0.0}, "pin J2: journal radius: expected more than 0, got 0"),
            ({"journal_radius": 1e-308}, "pin J2: journal radius: expected 0.001 to 100000 mm, got 1e-305 mm"),
        ],
    )
    def test_radii(self, five_bar: Linkage, wrong: dict[str, float], message: str) -> None:
        """A journal is smaller than its bearing, and thicker than nothing."""
        with pytest.raises(InvalidValueError, match=message):
            changed(five_bar, "pins", 0, **wrong)

    def test_clearance_of_a_pin_that_is_not_there(self, five_bar: Linkage) -> None:
        """Play is in pins that there are."""
        with pytest.raises(UnknownNameError, match=r"no pin 'J5'"):
            five_bar.with_clearances({"J5": 1e-4})
        with pytest.raises(InvalidValueError, match="pin J2: clearance: expected 0 or more"):
            five_bar.with_clearances({"J2": -1e-4})

    @pytest.mark.parametrize(
        ("wrong", "message"),
        [
            ({"young": 0.0}, "young: expected more than 0"),
            ({"poisson": 0.6}, "poisson: expected a ratio above -1, at most 0.5, got 0.6"),
            ({"poisson": -1.0}, "poisson"),
            ({"restitution": 0.0}, "restitution: expected a number above 0, at most 1, got 0"),
            ({"restitution": 1.2}, "restitution"),
            ({"friction": -0.1}, "friction: expected 0 or more, got -0.1"),
        ],
    )
    def test_material(self, wrong: dict[str, float], message: str) -> None:
        """Materials are as matter is."""
        with pytest.raises(InvalidValueError, match=message):
            Material(**wrong)

    def test_shapes(self) -> None:
        """Points lie in the plane."""
        with pytest.raises(ShapeError, match="point end"):
            Body(name="bar", mass=1.0, points={"end": (1.0, 0.0, 0.0)})
        with pytest.raises(InvalidValueError, match="body bar: mass: expected 0 or more, got -1"):
            Body(name="bar", mass=-1.0)


def test_guides_may_turn(five_bar: Linkage) -> None:
    """A guide has a direction, and the body on it an angle of its own; both are along the axis when left out."""
    guide = Guide(body="link2", point="J2", on=BodyPoint("link1", "J2"))
    play = ClearancePin(
        name="eye", bearing=guide.on, journal=BodyPoint("link2", "J3"), clearance=0.0, journal_radius=1e-3
    )

    assert (guide.direction, guide.angle) == (0.0, 0.0)
    assert attrs.evolve(five_bar, joints=[five_bar.joints[0], guide], pins=[play], drives=[]).driven == ()
