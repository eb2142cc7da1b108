"""Linkages without play against published mechanisms, against mechanics by hand, and against their own energy."""

from collections.abc import Callable

import attrs
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from armwright.clearance.equations import kinetic_energy, potential_energy
from armwright.clearance.ideal import (
    IdealMotion,
    close_pins,
    ideal_motion,
    inverse_dynamics,
    pin_gaps,
    point_position,
    tip_position,
    tip_sensitivity,
)
from armwright.clearance.linkage import Body, BodyPoint, ClearancePin, Drive, Linkage, Pin
from armwright.clearance.paths import Path, constant_speed_path, hermite_path, thesis_path
from armwright.clearance.placement import Placement
from armwright.clearance.reader import load_linkage
from armwright.clearance.scenario import assembly_guess, prepare_scenario
from armwright.clearance.settings import Settings
from armwright.errors import InvalidValueError, ShapeError
from clearance.mechanisms import axes
from clearance.squeezer import (
    END,
    END_FORCES,
    END_SPEEDS,
    MOMENT,
    START,
    START_ACCELERATIONS,
    START_FORCES,
    TURNS,
    ours,
    squeezer,
)

ROUNDING = 1e-12
# Of numbers that are printed with six or seven digits.
PRINTED = 5.1e-7
# The published shifts are means over plays of some tenths of a millimetre, which bend the arm a little.
OVER_A_PLAY = 8e-4


@pytest.fixture(scope="module")
def linkage() -> Linkage:
    return load_linkage("five-bar")


def free_run(motion: Callable[[float], IdealMotion], effort: float = 0.0) -> IdealMotion:
    """The motion in which the one drive gives a certain effort: it is linear in the drive's acceleration."""
    low, high = (float(motion(pull).efforts[0]) for pull in (0.0, 1.0))
    return motion((effort - low) / (high - low))


class TestSqueezer:
    """Andrews' squeezing mechanism, of seven bodies and three loops, against its published solution."""

    # Its multipliers are given as an integrator left them.
    OF_MULTIPLIERS = 2e-7

    @pytest.mark.parametrize("theirs", [START, END])
    def test_loops_close(self, theirs: np.ndarray) -> None:
        """With the published angles all loops are closed, and from ten degrees beside Newton finds them."""
        linkage, q = squeezer(theirs[2]), ours(theirs)

        assert np.abs(pin_gaps(linkage, q)).max() < ROUNDING
        beside = q + np.radians(10.0) * np.array((0, 1, -1, 1, 1, -1, 1)) * 0.2
        np.testing.assert_allclose(close_pins(linkage, beside, drives=q[:1]), q, rtol=0, atol=ROUNDING)

    def test_start(self) -> None:
        """At the start the motor speeds β up with 14222.44 rad/s², and the first loop carries 98.57 N."""
        linkage, q = squeezer(START[2]), ours(START)

        fall = free_run(lambda pull: ideal_motion(linkage, q, [0.0], [pull], by_tip=False), MOMENT)

        np.testing.assert_allclose(fall.qdd, ours(START_ACCELERATIONS), rtol=1e-11, atol=1e-8)
        np.testing.assert_allclose(fall.reactions, START_FORCES, rtol=1e-11, atol=1e-8)

    def test_end(self) -> None:
        """After 0.03 s, at 1140 rad/s, all speeds follow from the motor's, and the loops carry the multipliers."""
        linkage, q, qd = squeezer(END[2]), ours(END), ours(END_SPEEDS)

        fall = free_run(lambda pull: ideal_motion(linkage, q, qd[:1], [pull], by_tip=False), MOMENT)

        np.testing.assert_allclose(fall.qd, qd, rtol=0, atol=1e-9 * np.abs(qd).max())
        np.testing.assert_allclose(fall.reactions, END_FORCES, rtol=0, atol=self.OF_MULTIPLIERS * 200)

    def test_turns_are_angles_against_the_ground(self) -> None:
        """Seven of theirs make seven of ours."""
        assert np.linalg.matrix_rank(TURNS) == 7


def bars() -> Linkage:
    def bar(name: str) -> Body:
        return Body(name=name, mass=1.0, inertia=1 / 12, centre=(0.5, 0), points={"a": (0, 0), "b": (1, 0)})

    def eye(name: str, bearing: str, journal: str) -> ClearancePin:
        return ClearancePin(
            name=name,
            bearing=BodyPoint(bearing, "b"),
            journal=BodyPoint(journal, "b"),
            clearance=1e-4,
            journal_radius=0.01,
        )

    return Linkage(
        name="two four-bars",
        ground=Body(name="ground", points={"0": (0, 0), "1": (1, 0), "2": (2, 0)}),
        bodies=[bar(name) for name in ("first", "second", "third", "left", "right")],
        joints=[
            *(
                Pin(body=name, point="a", on=BodyPoint("ground", str(i)))
                for i, name in enumerate(("first", "second", "third"))
            ),
            Pin(body="left", point="a", on=BodyPoint("first", "b")),
            Pin(body="right", point="a", on=BodyPoint("second", "b")),
        ],
        pins=[eye("one", "second", "left"), eye("two", "third", "right")],
        drives=[Drive(body="first")],
        tip=BodyPoint("first", "b"),
    )


def falls(angle: float, spin: float) -> float:
    """How fast it speeds up when nothing drives it [rad/s²]."""
    linkage = bars()
    q = np.array((angle, angle, angle, 0.0, 0.0))
    fall = free_run(lambda pull: ideal_motion(linkage, q, [spin], [pull], by_tip=False))
    return float(fall.qdd[0])


class TestTwoFourBars:
    """Two parallelograms of five bars of 1 kg and 1 m, side by side (IFToMM benchmark A02)."""

    @pytest.mark.parametrize("angle", [0.1, 0.8, 1.5, 2.9, 4.0, 6.0])
    @pytest.mark.parametrize("spin", [0.0, -3.0])
    def test_falls_like_a_pendulum_on_its_head(self, angle: float, spin: float) -> None:
        """Three bars that rotate and two that circle fall with 7 g / 6 times the sine of the lean, fast or slow."""
        assert falls(angle, spin) == pytest.approx(-7 * 9.81 / 6 * np.cos(angle), rel=1e-11)

    def test_half_a_second(self) -> None:
        """Pushed with 1 m/s from the upright the first pin is at (0.695287, 0.718733) after half a second."""
        done = solve_ivp(
            lambda _t, y: (y[1], falls(y[0], y[1])),
            (0.0, 0.5),
            (np.pi / 2, -1.0),
            method="DOP853",
            rtol=1e-11,
            atol=1e-11,
        )

        tip = tip_position(bars(), np.array((*[done.y[0, -1]] * 3, 0.0, 0.0)))
        np.testing.assert_allclose(tip, (0.695287, 0.718733), rtol=0, atol=PRINTED)


class TestSliderCrank:
    """The slider-crank of the papers on clearance, at 5000 revolutions a minute."""

    SPEED = 5000 * 2 * np.pi / 60

    def test_dead_centres(self) -> None:
        """At the dead centres the slider is pulled back with r ω² (1 ± r/l): 19419.36 and 7996.21 m/s²."""
        linkage = load_linkage("slider-crank")
        crank = np.array((0.0, np.pi))
        q = np.stack([crank, 0 * crank, 0.12 + 0.05 * np.cos(crank)], axis=-1)

        motion = ideal_motion(linkage, q, [self.SPEED], [0.0], by_tip=False)

        np.testing.assert_allclose(motion.qdd[:, 2], (-19419.36, 7996.21), rtol=0, atol=5.1e-3)

    def test_all_round(self) -> None:
        """The slider is at r cos θ + √(l² - r² sin² θ), all round."""
        linkage = load_linkage("slider-crank")
        task = prepare_scenario(linkage, constant_speed_path("round", 0.0, self.SPEED, 0.012), Settings(step=1e-5))

        crank = task.ideal.q[:, 0]
        np.testing.assert_allclose(crank, self.SPEED * np.linspace(0.0, 0.012, len(crank)), rtol=0, atol=1e-11)
        by_hand = 0.05 * np.cos(crank) + np.sqrt(0.12**2 - (0.05 * np.sin(crank)) ** 2)
        np.testing.assert_allclose(task.ideal.q[:, 2], by_hand, rtol=0, atol=ROUNDING)


class TestFiveBar:
    """The parallel arm of the thesis, on its path y1."""

    def test_start(self, linkage: Linkage) -> None:
        """At (-150, -700) mm its links stand at -1.252325, 0.369776, -0.756151 and 0.711901 rad, elbows out."""
        q = close_pins(linkage, assembly_guess(linkage), tip=[-0.15, -0.7])

        np.testing.assert_allclose(q[[0, 3, 6, 7]], (-1.252325, 0.369776, -0.756151, 0.711901), rtol=0, atol=PRINTED)

    def test_torques(self, linkage: Linkage) -> None:
        """On y1 its motors give -22.064347 and 15.470070 N m at the start, -8.049372 and 5.194691 N m at 0.1 s."""
        task = prepare_scenario(linkage, thesis_path("y1"), Settings(step=1e-4))

        np.testing.assert_allclose(task.table[0, 0], (-22.064347, 15.470070), rtol=0, atol=PRINTED)
        np.testing.assert_allclose(task.table[1000, 0], (-8.049372, 5.194691), rtol=0, atol=PRINTED)

    def test_shift_of_the_tip(self, linkage: Linkage) -> None:
        """At (-180, -600) mm play shifts the tip by 0.65, 0.62 and -0.87 of it in x, -0.82, -0.77, -0.31 in y."""
        q = close_pins(linkage, assembly_guess(linkage), tip=[-0.18, -0.6])
        still = np.zeros_like(q)
        _, reactions = inverse_dynamics(linkage, q, still, still)

        directions = reactions / np.linalg.norm(reactions, axis=-1, keepdims=True)
        B = np.einsum("apb,pb->ap", tip_sensitivity(linkage, q), directions)
        np.testing.assert_allclose(
            B, ((0.6545, 0.6187, -0.8721), (-0.8197, -0.7748, -0.3134)), rtol=0, atol=OVER_A_PLAY
        )

    def test_shift_is_the_slope_of_the_closure(self, linkage: Linkage) -> None:
        """Opening one pin by a micrometre shifts the tip as the sensitivity says, in every direction."""
        q = close_pins(linkage, assembly_guess(linkage), tip=[0.1, -0.55])
        slope, small = tip_sensitivity(linkage, q), 1e-6
        for pin, axis in np.ndindex(3, 2):
            gaps = np.zeros((2, 3, 2))
            gaps[:, pin, axis] = small, -small
            up, down = tip_position(linkage, close_pins(linkage, q, drives=q[[0, 7]], gaps=gaps))
            np.testing.assert_allclose((up - down) / (2 * small), slope[:, pin, axis], rtol=0, atol=1e-7)


def four_bar_path() -> Path:
    return constant_speed_path("round", np.radians(60.0), 7.0, 0.3)


def five_bar_path() -> Path:
    return hermite_path("bend", [0.0, 0.3], [(-0.1, -0.7), (0.1, -0.5)], [(1, 0), (0, 1)], [1])


@pytest.mark.parametrize(
    ("name", "path"),
    [
        ("five-bar", five_bar_path()),
        ("four-bar", four_bar_path()),
        ("slider-crank", constant_speed_path("round", 0.3, 40.0, 0.3)),
    ],
    ids=lambda name: name if isinstance(name, str) else "",
)
def test_drives_give_the_energy(name: str, path: Path) -> None:
    """What the drives of a linkage give is what its energy grows by, to the last joule: reactions do no work."""
    linkage = load_linkage(name)
    task = prepare_scenario(linkage, path, Settings(step=1e-4))
    ideal = task.ideal

    placement = Placement(linkage, axes(ideal.q), axes(ideal.qd))
    energy = kinetic_energy(placement) + potential_energy(placement)
    power = np.sum(ideal.efforts * ideal.qd[:, list(linkage.driven)], axis=-1)
    # Simpson's rule over two steps; the paths are of one piece.
    work = (power[:-2:2] + 4 * power[1:-1:2] + power[2::2]) * task.h / 3
    assert np.ptp(energy) > 0.1
    np.testing.assert_allclose(np.diff(energy[::2]), work, rtol=0, atol=1e-9 * np.abs(work).max())


@pytest.mark.parametrize("name", ["five-bar", "four-bar", "slider-crank"])
def test_many_as_one(name: str, rng: np.random.Generator) -> None:
    """A batch of configurations gives what each of them gives alone, to rounding."""
    linkage = load_linkage(name)
    guess = assembly_guess(linkage)
    start = close_pins(linkage, guess, drives=guess[list(linkage.driven)])
    drives = start[list(linkage.driven)] + rng.uniform(-0.1, 0.1, (2, 3, len(linkage.drives)))
    speeds, pulls = rng.uniform(-1, 1, (2, *drives.shape))

    q = close_pins(linkage, start, drives=drives)
    many = ideal_motion(linkage, q, speeds, pulls, by_tip=False)

    assert many.reactions.shape == (2, 3, len(linkage.pins), 2)
    for index in np.ndindex(2, 3):
        single = ideal_motion(linkage, q[index], speeds[index], pulls[index], by_tip=False)
        np.testing.assert_allclose(single.efforts, many.efforts[index], rtol=1e-12)
        np.testing.assert_allclose(single.reactions, many.reactions[index], rtol=1e-12, atol=1e-12)


def test_tip_or_drives_lead_alike() -> None:
    """Led by its tip or by its drives the five-bar moves alike and needs the same torques."""
    linkage = load_linkage("five-bar")
    q = close_pins(linkage, assembly_guess(linkage), tip=[0.05, -0.62])

    by_tip = ideal_motion(linkage, q, [0.7, -0.4], [3.0, 20.0], by_tip=True)
    driven = list(linkage.driven)
    by_drives = ideal_motion(linkage, q, by_tip.qd[driven], by_tip.qdd[driven], by_tip=False)

    np.testing.assert_allclose(by_drives.qdd, by_tip.qdd, rtol=1e-11)
    np.testing.assert_allclose(by_drives.efforts, by_tip.efforts, rtol=1e-11)


def test_speeds_and_accelerations_are_slopes() -> None:
    """Speeds and accelerations along a path are the slopes of its coordinates in time."""
    linkage = load_linkage("four-bar")
    task = prepare_scenario(linkage, constant_speed_path("round", 1.0, 5.0, 0.02), Settings(step=1e-5))
    q, qd, qdd = task.ideal.q, task.ideal.qd, task.ideal.qdd

    np.testing.assert_allclose((q[2:] - q[:-2]) / (2 * task.h), qd[1:-1], rtol=0, atol=1e-7)
    np.testing.assert_allclose((qd[2:] - qd[:-2]) / (2 * task.h), qdd[1:-1], rtol=0, atol=1e-6)


def test_rocker_of_a_crank_rocker() -> None:
    """When crank and coupler lie in one line the rocker stands still: at √(OC² + …) from the law of cosines."""
    linkage = load_linkage("four-bar")
    guess = assembly_guess(linkage)

    def rocker_speed(crank: float) -> float:
        q = close_pins(linkage, guess, drives=[crank])
        return float(ideal_motion(linkage, q, [1.0], [0.0], by_tip=False).qd[2])

    crank = brentq(rocker_speed, 0.2, 1.2)
    # Stretched, the triangle has the sides 0.1 + 0.3, 0.3 and 0.25.
    assert np.cos(crank) == pytest.approx((0.4**2 + 0.3**2 - 0.25**2) / (2 * 0.4 * 0.3), rel=1e-9)


def test_places_of_points() -> None:
    """A point is where its body is: the elbow of a crank that hangs down is 0.3 m below its pin."""
    linkage = load_linkage("five-bar")

    np.testing.assert_allclose(
        point_position(linkage, BodyPoint("link1", "J2"), np.zeros(8)), (-0.1, -0.3), atol=ROUNDING
    )


class TestRefused:
    """What cannot be."""

    def test_out_of_reach(self) -> None:
        """A point two metres away cannot be reached by arms of a metre."""
        linkage = load_linkage("five-bar")
        with pytest.raises(InvalidValueError, match=r"five-bar: the path cannot be followed.*out of reach"):
            close_pins(linkage, assembly_guess(linkage), tip=[0.0, -2.0])

    def test_path_that_leaves(self) -> None:
        """Of a path that leaves the reach halfway the message says where it is lost."""
        linkage = load_linkage("five-bar")
        path = hermite_path("away", [0.0, 1.0], [(0.0, -0.7), (0.0, -1.4)], [(0, 0), (0, 0)], [1])
        with pytest.raises(InvalidValueError, match="five-bar: the path cannot be followed"):
            prepare_scenario(linkage, path, Settings(step=1e-4))

    def test_crank_that_cannot_turn(self) -> None:
        """A rod shorter than the crank locks it."""
        linkage = load_linkage("four-bar")
        long = [
            attrs.evolve(body, points={"O": (0, 0), "A": (0.6, 0)}) if body.name == "crank" else body
            for body in linkage.bodies
        ]
        with pytest.raises(InvalidValueError, match="four-bar: the drives cannot be followed"):
            prepare_scenario(
                attrs.evolve(linkage, bodies=long), constant_speed_path("round", 1.0, 20.0, 0.3), Settings(step=1e-3)
            )

    def test_two_goals(self) -> None:
        """Either the tip has a goal or the drives have."""
        linkage = load_linkage("five-bar")
        for goals in ({}, {"tip": [0.0, -0.6], "drives": [0.0, 0.0]}):
            with pytest.raises(ShapeError, match="expected either the position of the tip, or the driven coordinates"):
                close_pins(linkage, assembly_guess(linkage), **goals)

    def test_wrong_number_of_drives(self) -> None:
        """The five-bar has two drives."""
        linkage = load_linkage("five-bar")
        with pytest.raises(ShapeError, match=r"drives: expected a shape ending in \(2,\), got \(3,\)"):
            close_pins(linkage, assembly_guess(linkage), drives=[0.0, 0.0, 0.0])

    def test_too_few_drives(self) -> None:
        """With one motor the five-bar's two freedoms are not determined."""
        linkage = load_linkage("five-bar")
        lame = attrs.evolve(linkage, drives=linkage.drives[:1])
        q = close_pins(linkage, assembly_guess(linkage), tip=[0.0, -0.6])
        with pytest.raises(InvalidValueError, match="one drive for each freedom, got 1 drives for 2 freedoms"):
            inverse_dynamics(lame, q, np.zeros(8), np.zeros(8))
        with pytest.raises(InvalidValueError, match="it has 2 freedoms, and its drives fix 1; expected as many"):
            close_pins(lame, q, drives=[0.0])

    def test_tip_of_one_drive(self) -> None:
        """A slider-crank cannot lead its tip through the plane."""
        linkage = load_linkage("slider-crank")
        with pytest.raises(InvalidValueError, match="it has 1 freedom, and a position of the tip fixes 2"):
            close_pins(linkage, assembly_guess(linkage), tip=[0.17, 0.0])

    def test_singular(self) -> None:
        """A parallelogram that lies flat can continue in two assemblies."""
        linkage = bars()
        with pytest.raises(InvalidValueError, match="singular configuration"):
            ideal_motion(linkage, np.zeros(5), [1.0], [0.0], by_tip=False)
