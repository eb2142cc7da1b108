"""Elastic rods at rest: closed forms of beams, balance of forces, and the rigid linkage that stiff rods make."""

import math
from pathlib import Path

import attrs
import numpy as np
import pytest
from scipy.optimize import brentq

from armwright.arrays import Array
from armwright.clearance.elastic_rod import MAX_MODES, Elasticity, Rod
from armwright.clearance.equations import Contact, ContactMemory, FrictionModel, State, rates
from armwright.clearance.ideal import close_pins
from armwright.clearance.linkage import Body, BodyPoint, Drive, Guide, Linkage, Pin
from armwright.clearance.maintenance.maintained_linkage import maintained_linkage
from armwright.clearance.natural_modes import natural_modes
from armwright.clearance.paths import thesis_path
from armwright.clearance.reader import load_linkage, read_linkage
from armwright.clearance.scenario import assembly_guess
from armwright.clearance.sensitivities import rest_sensitivities
from armwright.clearance.settings import Settings, check_step, contact_stiffness
from armwright.clearance.static_equilibrium import find_static_equilibrium
from armwright.clearance.vibration.contact_modes import contact_modes
from armwright.clearance.wear.assessment import assess_wear
from armwright.clearance.wear.worn_surfaces import WearLaw
from armwright.errors import FileFormatError, InvalidValueError, UnknownNameError
from clearance.elastic_bodies import AREA, EI, LENGTH, MASS, YOUNG, bar, cantilever, elastic_five_bar, on_rollers

FIRST_GOAL = (-0.18, -0.6)
WAVE = math.sqrt(EI / (MASS / LENGTH))


def rod(linkage: Linkage) -> Rod:
    (found,) = linkage.rods.values()
    return found


# ---- single rods ---------------------------------------------------------------------------------------------------


def test_rod_of_the_arm() -> None:
    """A steel bar of 0.8 kg and 650 mm has EI 424.04 N m², vibrates at 69.01 and 276.04 Hz on pins, clamped 24.58."""
    pinned, clamped = rod(on_rollers(bar())), rod(cantilever(bar()))

    assert round(EI, 2) == 424.04
    assert pinned.stiffness[-1] == pytest.approx(4.99e7, abs=5e4)
    np.testing.assert_allclose(pinned.frequencies[:2], (69.01, 276.04), rtol=0, atol=0.005)
    assert clamped.frequencies[0] == pytest.approx(24.58, abs=0.005)


@pytest.mark.parametrize("modes", range(1, MAX_MODES + 1))
def test_frequencies_on_pins(modes: int) -> None:
    """A rod on two pins vibrates in sines, at (iπ/L)² times the root of EI by its mass per length."""
    waves = np.arange(1, modes + 1) * math.pi / LENGTH
    expected = waves**2 * WAVE / (2 * math.pi)

    np.testing.assert_allclose(rod(on_rollers(bar(modes=modes))).frequencies, expected, rtol=1e-5)


@pytest.mark.parametrize("hub", [0.0, 0.1, 0.4])
def test_frequencies_of_a_clamped_rod_with_a_mass_at_its_tip(hub: float) -> None:
    """A clamped rod with a mass at its tip vibrates at the roots of its frequency equation."""
    ratio = hub / MASS

    def equation(x: float) -> float:
        c, s, ch, sh = math.cos(x), math.sin(x), math.cosh(x), math.sinh(x)
        return 1 + c * ch + ratio * x * (c * sh - s * ch)

    roots = np.array([brentq(equation, *bounds) for bounds in ((0.5, 2.0), (3.0, 4.8))])
    expected = roots**2 / LENGTH**2 * WAVE / (2 * math.pi)

    np.testing.assert_allclose(rod(cantilever(bar(hub=hub))).frequencies[:2], expected, rtol=2e-5)


def test_mass_of_a_rod() -> None:
    """Beam and masses at the ends have mass, centre and inertia of the body."""
    body = attrs.evolve(bar(hub=0.2), mass=1.3, centre=(0.33, 0), inertia=0.07)
    masses = np.array([(mass, section.along) for mass, section in rod(on_rollers(body)).masses])

    assert masses[:, 0].sum() == pytest.approx(1.3, rel=1e-14)
    assert masses[:, 0] @ masses[:, 1] == pytest.approx(1.3 * 0.33, rel=1e-14)
    assert masses[:, 0] @ (masses[:, 1] - 0.33) ** 2 == pytest.approx(0.07, rel=1e-13)


def test_sag() -> None:
    """The horizontal rod of the arm sags 0.0662 mm by its weight, 5 w L⁴ / (384 EI) but for what three sines lack."""
    linkage = on_rollers(bar())
    rest = find_static_equilibrium(linkage, [0.0, 0.0], [0.0])

    sag = 5 * MASS * 9.81 * LENGTH**3 / (384 * EI)
    assert -rest.tip[1] == pytest.approx(0.0662e-3, abs=5e-8)
    assert -rest.tip[1] == pytest.approx(sag, rel=1e-3)
    assert -rest.q[2 : 2 + 3] @ (1, 0, -1) == pytest.approx(-rest.tip[1], rel=1e-9)
    assert rest.forces[0] == pytest.approx(MASS * 9.81 / 2, rel=1e-6)


def test_force_at_the_tip_of_a_clamped_rod() -> None:
    """The clamped rod yields by F L³ / (3 EI), 4632 N/m, and stretches by F L / (EA)."""
    pulled = find_static_equilibrium(cantilever(bar(), force=(0.0, -1e-3)), [0.0], [])
    stretched = find_static_equilibrium(cantilever(bar(), force=(1.0, 0.0)), [0.0], [])

    assert 1e-3 / -pulled.tip[1] == pytest.approx(3 * EI / LENGTH**3, rel=1e-9)
    assert round(3 * EI / LENGTH**3) == 4632
    assert stretched.tip[0] - LENGTH == pytest.approx(LENGTH / (YOUNG * AREA), rel=1e-9)


def test_clamped_rod_under_its_weight() -> None:
    """Its tip sinks by w L⁴ / (8 EI)."""
    rest = find_static_equilibrium(cantilever(bar(), gravity=9.81), [0.0], [])

    assert -rest.tip[1] == pytest.approx(MASS * 9.81 * LENGTH**3 / (8 * EI), rel=2e-5)


@pytest.mark.parametrize("share", [-2.0, -0.5, 0.5, 0.9])
def test_tension_and_pressure(share: float) -> None:
    """Under a force P along it a rod vibrates with f² in proportion to 1 - P / P_Euler, π² EI / L²."""
    force = share * math.pi**2 * EI / LENGTH**2
    linkage = on_rollers(bar(), gravity=1e-9, push=force)

    slowest = natural_modes(linkage, find_static_equilibrium(linkage, [0.0, 0.0], [0.0]).q).frequencies[0]
    assert slowest == pytest.approx(math.pi / 2 * WAVE / LENGTH**2 * math.sqrt(1 - share), rel=2e-3)


def test_buckling() -> None:
    """Pushed with more than Euler's load, a straight rod is not stable."""
    linkage = on_rollers(bar(), gravity=0.0, push=1.02 * math.pi**2 * EI / LENGTH**2)
    with pytest.raises(InvalidValueError, match="not stable in this configuration: a rod buckles"):
        natural_modes(linkage, np.zeros(len(linkage.coordinates)))


# ---- the five-bar --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("bodies", [("link2", "link3"), ("link1", "link2", "link3", "link4")])
def test_nothing_moves(bodies: tuple[str, ...]) -> None:
    """With its drives held a five-bar of elastic rods that lies at rest is in balance: nothing begins to move."""
    linkage = elastic_five_bar(bodies=bodies, modes=2 if len(bodies) == 2 else 1)
    K = contact_stiffness(linkage, linkage.clearance_array(None))
    rest = find_static_equilibrium(linkage, close_pins(linkage, assembly_guess(linkage), tip=FIRST_GOAL), None, K)

    locked = attrs.evolve(linkage, drives=[attrs.evolve(drive, kind="motion") for drive in linkage.drives])
    contacts = [Contact(c, k, 0.15, 0.0, 1e-3) for c, k in zip(linkage.clearances.values(), K, strict=True)]
    state = State(list(rest.q), [0.0] * len(rest.q), [ContactMemory(1.0, 1e-3)] * 3)
    now = rates(locked, FrictionModel(), state, [0.0, 0.0], contacts)

    np.testing.assert_allclose([pin.normal for pin in now.pins], rest.forces, rtol=1e-7)
    # Of springs of 1e8 N/m rounding leaves some µN; a rod weighs 8 N.
    np.testing.assert_allclose(np.array(now.qdd) * 0.0282, 0.0, atol=2e-6)


def test_stiff_rods_are_rigid() -> None:
    """Ten times stiffer rods and cranks move the tip a tenth as far from where rigid ones hold it."""
    rigid = load_linkage("five-bar")
    ideal = close_pins(rigid, assembly_guess(rigid), tip=FIRST_GOAL)
    goal = find_static_equilibrium(rigid, ideal).tip

    def distance(stiffer: float) -> float:
        linkage = elastic_five_bar(stiffer=stiffer, modes=1, bodies=("link1", "link2", "link3", "link4"))
        return float(np.linalg.norm(find_static_equilibrium(linkage, ideal).tip - goal))

    near, far = distance(1e3), distance(1e2)
    assert far / near == pytest.approx(10, rel=5e-3)
    assert 1e-6 < far < 1e-5


def test_leading_axes() -> None:
    """Many poses and clearances are a table, each as it is alone."""
    linkage = elastic_five_bar(modes=1)
    ideal = close_pins(linkage, assembly_guess(linkage), tip=[[FIRST_GOAL], [(0.0, -0.575)]])
    c = np.array([[3e-4, 2e-4, 5e-4], [1e-4, 5e-4, 0.0]])

    table = find_static_equilibrium(linkage, ideal, c)
    modes = natural_modes(linkage, table.q)
    assert table.q.shape == (2, 2, 12)
    one = find_static_equilibrium(linkage, ideal[1, 0], c[0])
    np.testing.assert_array_equal(table.q[1, 0], one.q)
    np.testing.assert_allclose(modes.frequencies[1, 0], natural_modes(linkage, one.q).frequencies, rtol=1e-9)


def test_modes_of_the_five_bar() -> None:
    """Rods between closed pins vibrate as they do alone, but for the little tension and pressure in them."""
    linkage = elastic_five_bar()
    rest = find_static_equilibrium(linkage, close_pins(linkage, assembly_guess(linkage), tip=FIRST_GOAL))

    slowest = natural_modes(linkage, rest.q).frequencies[:2]
    np.testing.assert_allclose(slowest, linkage.rods["link2"].frequencies[0], rtol=1e-3)


def test_modes_on_contacts() -> None:
    """On its contacts a five-bar with stiff rods vibrates as with rigid ones, and with steel rods a little slower."""
    rigid = load_linkage("five-bar")
    closed = close_pins(rigid, assembly_guess(rigid), tip=[FIRST_GOAL])

    def slowest(linkage: Linkage) -> Array:
        return contact_modes(linkage, closed).frequencies[0, :6]

    expected = slowest(rigid)
    np.testing.assert_allclose(slowest(elastic_five_bar(stiffer=1e6, modes=1)), expected, rtol=2e-4)
    rolling = slowest(elastic_five_bar())[:3] / expected[:3]
    assert np.all((rolling > 0.9) & (rolling < 1))


def test_rigid_linkage_has_no_modes() -> None:
    """A linkage without elastic bodies has no natural frequencies."""
    with pytest.raises(InvalidValueError, match="five-bar has no elastic body"):
        natural_modes(load_linkage("five-bar"), np.zeros(8))


def test_long_steps() -> None:
    """A step in which the fastest shape of a rod passes its period is refused, and a shorter one named."""
    linkage = elastic_five_bar(modes=MAX_MODES)
    K = contact_stiffness(linkage, linkage.clearance_array(None))
    with pytest.raises(InvalidValueError, match=r"1e-05 s is too long for elastic body link2.*at most 8\.9e-06 s"):
        check_step(linkage, Settings(step=1e-5), K)
    check_step(linkage, Settings(step=8e-6), K)


# ---- what is refused -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"inertia": 0.02}, "got 0.02 kg m² and a centre at 325 of 650 mm"),
        ({"centre": (0.325, 0.01)}, "on the line from A to B, got its centre off it"),
        ({"points": {"A": (0, 0), "B": (0.6, 0), "M": (0.65, 0)}}, "on the line from A to B, got M off it"),
        ({"points": {"A": (0, 0), "M": (0, 0), "B": (0, 0)}}, "distance from A to B"),
    ],
)
def test_bodies_that_are_no_rods(changes: dict[str, object], message: str) -> None:
    """A body whose mass or points are not those of a straight rod is refused, and told why."""
    with pytest.raises(InvalidValueError, match=f"elastic body rod: .*{message}"):
        on_rollers(attrs.evolve(bar(), **changes))


def test_joints_that_are_refused() -> None:
    """An ideal joint is at an end of a rod, and nothing slides on one."""
    linkage = on_rollers(bar())
    middle = Pin(body="rod", point="M", on=BodyPoint("ground", "A"))
    with pytest.raises(InvalidValueError, match="expected its joint at one of its ends A and B, got M"):
        attrs.evolve(linkage, joints=[middle, linkage.joints[1]])
    slide = Guide(body="roller", point="P", on=BodyPoint("rod", "M"))
    with pytest.raises(InvalidValueError, match="guide of roller: expected rigid bodies on both sides"):
        attrs.evolve(linkage, joints=[linkage.joints[0], slide])
    lever = Body(name="lever", mass=1.0, inertia=1.0, points={"P": (0, 0)})
    held = attrs.evolve(
        cantilever(bar()),
        bodies=[bar(), lever],
        joints=[linkage.joints[0], Pin(body="lever", point="P", on=BodyPoint("rod", "B"))],
        drives=[],
    )
    both = [Drive(body="rod", kind="motion"), Drive(body="lever", kind="motion")]
    with pytest.raises(InvalidValueError, match="drive of lever: its motion cannot be given against an elastic body"):
        attrs.evolve(held, drives=both)


def test_commands_for_rigid_bodies() -> None:
    """Wear, plans of checks, sensitivities and payloads of runs take rigid bodies, and name the elastic ones."""
    linkage = elastic_five_bar(modes=1)
    with pytest.raises(InvalidValueError, match="wear: expected rigid bodies, got elastic link2, link3"):
        assess_wear(linkage, thesis_path("y1"), WearLaw(coefficient=1e-14))
    with pytest.raises(InvalidValueError, match="plan of checks: expected rigid bodies, got elastic link2, link3"):
        maintained_linkage(linkage, thesis_path("y1"), exposure=1e-6)
    with pytest.raises(InvalidValueError, match="sensitivities of the tip: expected rigid bodies, got elastic link2"):
        rest_sensitivities(linkage, np.zeros(8))
    with pytest.raises(InvalidValueError, match="payloads: expected rigid bodies, got elastic link2, link3"):
        find_static_equilibrium(linkage, np.zeros(8), payload=0.1)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"modes": 7}, "modes: expected 1 to 6, got 7"),
        ({"damping": 1.0}, "damping: expected a part of critical damping"),
        ({"area": 0.0}, "area"),
        ({"ends": ("A", "A")}, "ends: expected the names of two points"),
    ],
)
def test_elasticity_out_of_range(changes: dict[str, object], message: str) -> None:
    """Numbers of an elastic body are bounded."""
    with pytest.raises(InvalidValueError, match=message):
        attrs.evolve(bar().elastic, **changes)


def test_ends_that_are_not_there() -> None:
    """An end that the body does not have is told, with the nearest."""
    elastic = Elasticity(ends=("A", "Bb"), area=AREA, second_moment=1e-9)
    with pytest.raises((UnknownNameError, InvalidValueError), match="no point 'Bb'"):
        on_rollers(attrs.evolve(bar(), elastic=elastic))


# ---- files ---------------------------------------------------------------------------------------------------------

SLIDER = Path(__file__).parents[2] / "src" / "armwright" / "clearance" / "catalogue" / "slider-crank.toml"


def with_elastic_rod(folder: Path, elastic: str) -> Path:
    """The slider-crank with an elastic rod."""
    points = "points = { A = [0.0, 0.0], B = [0.12, 0.0] }"
    text = SLIDER.read_text(encoding="utf-8")
    assert points in text
    path = folder / "mine.toml"
    path.write_text(text.replace(points, f"{points}\nelastic = {{ {elastic} }}"), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("section", "area", "second_moment"),
    [
        ("square_mm = 10", 1e-4, 1e-8 / 12),
        ("round_mm = 10", math.pi * 25e-6, math.pi / 64 * 1e-8),
        ("rectangle_mm = [20, 5]", 1e-4, 0.02**3 * 0.005 / 12),
        ("tube_mm = [10, 8]", math.pi * 9e-6, math.pi / 64 * (1e-8 - 0.008**4)),
        ("area_mm2 = 100, second_moment_mm4 = 833", 1e-4, 833e-12),
    ],
)
def test_sections(tmp_path: Path, section: str, area: float, second_moment: float) -> None:
    """A section is a square, a circle, a rectangle, a tube, or area and second moment."""
    elastic = read_linkage(with_elastic_rod(tmp_path, section)).body("rod").elastic

    assert elastic is not None
    assert (elastic.area, elastic.second_moment) == pytest.approx((area, second_moment))
    assert (elastic.ends, elastic.young, elastic.modes, elastic.damping) == (("A", "B"), 207e9, 3, 0.01)


@pytest.mark.parametrize(
    ("elastic", "message"),
    [
        ("young = 1e9", "body 2, elastic: expected one section, of square_mm, .*, got none"),
        ("square_mm = 5, round_mm = 5", "got square_mm and round_mm"),
        ("square_mm = -5", "square_mm"),
        ("square_mm = 1e200", "square_mm"),
        ("tube_mm = [8, 10]", "expected an outer diameter to 10000 and a smaller inner one"),
        ("rectangle_mm = [0, 10]", "expected height in the plane and width"),
        ("area_mm2 = 5", "second_moment_mm4: missing"),
        ("square_mm = 5, modes = 9", "modes: expected 1 to 6, got 9"),
        ("square_mm = 5, dampin = 0.1", "unknown key; did you mean 'damping'"),
        ('square_mm = 5, ends = ["A"]', "expected the names of two points between which the body is a beam, got 1"),
        ('square_mm = 5, ends = ["A", "C"]', "elastic body rod: no point 'C'"),
    ],
)
def test_files_with_mistakes(tmp_path: Path, elastic: str, message: str) -> None:
    """What is wrong with an elastic body of a file is told with its line and key."""
    with pytest.raises(FileFormatError, match=message):
        read_linkage(with_elastic_rod(tmp_path, elastic))
