"""Wear of pins against closed forms: volumes, a worn bush, a worn shaft, and numbers of an independent simulation."""

import numpy as np
import pytest
from scipy.optimize import minimize

from armwright.arrays import Array
from armwright.clearance.ideal import tip_position
from armwright.clearance.linkage import Body, BodyPoint, ClearancePin, Drive, Guide, Linkage, Load, Material, Pin
from armwright.clearance.paths import constant_speed_path, named_path
from armwright.clearance.reader import load_linkage
from armwright.clearance.scenario import prepare_scenario
from armwright.clearance.settings import Settings
from armwright.clearance.simulation import simulate
from armwright.clearance.static_equilibrium import find_static_equilibrium
from armwright.clearance.wear.assessment import assess_wear
from armwright.clearance.wear.contact_history import simulated_contact
from armwright.clearance.wear.foundation import bin_angles, foundation_modulus, rest_positions
from armwright.clearance.wear.life import WearLife, wear_life
from armwright.clearance.wear.worn_stroke import Stroke, tip_errors
from armwright.clearance.wear.worn_surfaces import WearLaw, WornSurfaces, mean_growth
from armwright.errors import InvalidValueError

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

RADIUS, CLEARANCE, FORCE, TURNS = 0.01, 2e-4, 25.0, 3
# Of sums in double precision.
ROUNDING = 1e-12


@pytest.fixture(scope="module")
def bushing() -> Stroke:
    """A shaft that turns three times in a sleeve, which hangs on it by a constant force and does not rotate."""
    shaft, carriage, sleeve = (Body(name=n, mass=1.0, inertia=1e-4, points={"O": (0, 0)}) for n in "abc")
    linkage = Linkage(
        name="bushing",
        ground=Body(name="ground", points={"O": (0, 0)}),
        bodies=[shaft, carriage, sleeve],
        joints=[
            Pin(body="a", point="O", on=BodyPoint("ground", "O")),
            Guide(body="b", point="O", on=BodyPoint("ground", "O")),
            Guide(body="c", point="O", on=BodyPoint("b", "O"), direction=np.pi / 2),
        ],
        pins=[
            ClearancePin(
                name="bush",
                bearing=BodyPoint("c", "O"),
                journal=BodyPoint("a", "O"),
                clearance=CLEARANCE,
                journal_radius=RADIUS,
            )
        ],
        drives=[Drive(body="a", kind="motion")],
        loads=[Load(point=BodyPoint("c", "O"), force=(0, -FORCE))],
        gravity=(0, 0),
        tip=BodyPoint("c", "O"),
    )
    return Stroke.of(linkage, constant_speed_path("turning", 0.1, TURNS * 2 * np.pi, 1.0), moments=46)


def worn(stroke: Stroke, *, steps: int = 5, max_step: float = 0.08, **law: object) -> WearLife:
    return wear_life(stroke, WearLaw(coefficient=1e-13, bins=180, **law), steps=steps, max_step=max_step)  # type: ignore[arg-type]


@pytest.mark.drawn(0.34)
@pytest.mark.parametrize("pressure", ["hertz", "winkler"])
@pytest.mark.parametrize("bins", [72, 180])
def test_volume_of_a_steady_load(bushing: Stroke, pressure: str, bins: int) -> None:
    """Under a constant force a shaft that turns by φ takes V = k F R φ, whatever the bins and the pressure."""
    law = WearLaw(coefficient=1e-13, bins=bins, pressure=pressure, layer_material=Material(young=2e9))  # type: ignore[arg-type]

    life = wear_life(bushing, law, steps=2, max_step=0.1)

    expected = 1e-13 * FORCE * RADIUS * TURNS * 2 * np.pi * life.strokes
    np.testing.assert_allclose(life.volumes[:, 0], expected, rtol=10 * ROUNDING)
    assert life.volume_imbalance < ROUNDING


def test_bush_wears_to_the_arc_of_its_shaft(bushing: Stroke) -> None:
    """A bush alone wears to the arc of the shaft, sunk by h: its volume is b times the lune between both circles."""
    life = worn(bushing, bearing_share=1.0)

    profile = life.surfaces[-1].bearing[0]
    h, bottom = profile.max(), int(profile.argmax())
    # The force on the sleeve points down, so that the shaft carries it at its top.
    assert bin_angles(180)[bottom] == pytest.approx(np.pi / 2)
    np.testing.assert_allclose(profile, np.roll(profile[::-1], 2 * bottom + 1), atol=1e-9 * h)
    d, shaft, bush = CLEARANCE + h, RADIUS, RADIUS + CLEARANCE
    inside = (d**2 + shaft**2 - bush**2) / (2 * d * shaft), (d**2 + bush**2 - shaft**2) / (2 * d * bush)
    lens = shaft**2 * np.arccos(inside[0]) + bush**2 * np.arccos(inside[1])
    lens -= 0.5 * np.sqrt((shaft + bush - d) * (d + shaft - bush) * (d - shaft + bush) * (d + shaft + bush))
    # To the part of the radius that the clearance is, which a profile over angles leaves out.
    assert 0.02 * (np.pi * shaft**2 - lens) == pytest.approx(life.volumes[-1, 0], rel=CLEARANCE / RADIUS)


def test_shaft_wears_evenly(bushing: Stroke) -> None:
    """A shaft alone wears round, linearly in strokes: its mean depth is V / (2 π R b)."""
    life = worn(bushing, bearing_share=0.0)

    depths = np.array([surface.journal[0] for surface in life.surfaces])
    even = life.volumes[:, 0] / (2 * np.pi * RADIUS * 0.02)
    np.testing.assert_allclose(depths.mean(axis=1), even, rtol=ROUNDING)
    # The shaft stops at one angle more often than at others.
    assert np.ptp(depths[-1]) < 0.15 * even[-1]
    assert not life.surfaces[-1].bearing.any()


@pytest.fixture(scope="module")
def lives(bushing: Stroke) -> list[WearLife]:
    """The same strokes of a bush with steps of a depth, of half of it and of a quarter."""
    law = WearLaw(coefficient=1e-13, bins=120, bearing_share=1.0)
    first = wear_life(bushing, law, steps=2, max_step=0.08)
    until = float(first.strokes[-1])
    return [first, *(wear_life(bushing, law, steps=40, max_step=0.08 / k, until=until) for k in (2, 4))]


def test_half_the_steps_halve_the_change(lives: list[WearLife]) -> None:
    """Halving the strokes of a step at least about halves what it changes in the depth."""
    depths = np.array([life.surfaces[-1].deepest()[0] for life in lives])

    first, second = np.abs(np.diff(depths))

    assert second < 0.6 * first


@pytest.fixture(scope="module")
def five_bar_life() -> WearLife:
    stroke = Stroke.of(load_linkage("five-bar"), named_path("y1"), moments=31)
    return wear_life(stroke, WearLaw(coefficient=1e-14, bins=72), steps=2, max_step=0.08)


def test_profiles_only_grow_and_keep_the_balance(five_bar_life: WearLife) -> None:
    """Depths of bearings and journals never shrink, and their volume is k times the work of the forces."""
    assert five_bar_life.volume_imbalance < ROUNDING
    for name in ("bearing", "journal"):
        assert (np.diff([getattr(surface, name) for surface in five_bar_life.surfaces], axis=0) >= 0).all()


def test_new_pins_err_as_unworn_ones_at_rest(five_bar_life: WearLife) -> None:
    """Before any wear AP at the goals is the distance by which the arm hangs off, but for the scatter of friction."""
    stroke = five_bar_life.stroke
    rest = find_static_equilibrium(stroke.linkage, stroke.rest)

    off = np.linalg.norm(rest.tip - tip_position(stroke.linkage, stroke.rest), axis=-1)

    # Two micrometres: the mean of journals anywhere in their friction cones, and contacts as wide as four bins.
    errors = tip_errors(stroke, WearLaw(coefficient=1e-14), WornSurfaces.new(3, 360))
    np.testing.assert_allclose(errors.accuracy.mean(axis=0), off, atol=2e-6)


def test_life_is_inverse_to_the_wear_coefficient(five_bar_life: WearLife) -> None:
    """Ten times the wear coefficient leaves the same profiles after a tenth of the strokes."""
    first = five_bar_life

    fast = wear_life(first.stroke, WearLaw(coefficient=1e-13, bins=72), steps=2, max_step=0.08)

    np.testing.assert_allclose(10 * fast.strokes, first.strokes, rtol=1e-9)
    np.testing.assert_allclose(fast.surfaces[-1].bearing, first.surfaces[-1].bearing, atol=1e-12)


@pytest.mark.drawn(0.34)
@pytest.mark.parametrize(
    ("path", "clearances", "friction", "works", "rotations"),
    [
        ("y1", (5e-4, 5e-4, 5e-4), 0.05, (0.1426, 0.0146, 0.0948), (1.060, 0.271, 0.939)),
        ("y5", (2.52e-4, 0.99e-4, 1e-4), 0.12, (0.1137, 0.0124, 0.1310), (1.004, 0.286, 1.058)),
    ],
)
def test_work_of_the_five_bar(
    path: str, clearances: tuple[float, ...], friction: float, works: tuple[float, ...], rotations: tuple[float, ...]
) -> None:
    """Force times sliding distance until 0.2 s, and the rotation of a stroke, are those of the page of the thesis' arm.

    They were computed with an independent simulator (spec of the life, 1), and are printed to four digits.
    """
    scenario = prepare_scenario(load_linkage("five-bar"), named_path(path), Settings(step=1e-5, sample=1e-5))
    run = simulate(scenario, clearances, frictions=friction)

    until = simulated_contact(run, 0.2)

    np.testing.assert_allclose(until.work, works, atol=0.51e-4)
    np.testing.assert_allclose(simulated_contact(run).rotated, rotations, atol=0.51e-3)
    # Hardly anywhere slower than the threshold, below which friction fades.
    lost = np.interp(0.2, run.time, run.works["friction loss"])
    assert friction * until.work.sum() == pytest.approx(lost, rel=4e-4)


def test_mean_growth_of_the_clearance() -> None:
    """0.185 N m per stroke on 10 mm by 20 mm and 1 rad, with 1e-5 mm³/(N m), widen a clearance by 9.25e-9 mm."""
    assert mean_growth(1e-14, 0.185, 0.01, 1.0, 0.02) == pytest.approx(9.25e-12)


def test_journal_rests_where_the_energy_is_least() -> None:
    """A journal on a worn wall rests where springs and force have the least energy, as a general minimiser finds it."""
    rng = np.random.default_rng(3)
    angles = bin_angles(90)
    u = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    walls = 5e-4 + 5e-5 * np.maximum(np.cos(angles - 1.0), 0.0) ** 8 + rng.uniform(0, 2e-6, (6, 90))
    forces, springs = 20 * rng.normal(size=(6, 2)), np.full(6, 1e6)

    places, shares = rest_positions(forces, walls, springs)

    np.testing.assert_allclose(shares.sum(axis=1), 1.0, rtol=ROUNDING)
    for force, wall, place in zip(forces, walls, places, strict=True):

        def energy(e: Array, force: Array = force, wall: Array = wall) -> float:
            # Micrometres and microjoules.
            depths = np.maximum(1e-6 * (u @ e) - wall, 0.0)
            return float(1e6 * (0.5e6 * (depths**2).sum() - 1e-6 * force @ e))

        found = minimize(energy, 1e6 * place + rng.normal(size=2), method="Nelder-Mead", options={"xatol": 1e-6})
        np.testing.assert_allclose(1e6 * place, found.x, atol=1e-3)


def test_foundation_has_the_half_angle_it_is_asked_for() -> None:
    """A foundation made for a half-angle touches its journal on that half-angle."""
    modulus = foundation_modulus(np.array([30.0]), np.array([0.3]), CLEARANCE, RADIUS, 0.02)

    e, shares = rest_positions(
        np.array([[30.0, 0.0]]), np.full((1, 3600), CLEARANCE), modulus * 0.02 * RADIUS * 2 * np.pi / 3600
    )

    assert np.arccos(CLEARANCE / e[0, 0]) == pytest.approx(0.3, rel=1e-4)
    assert (shares > 0).sum() * np.pi / 3600 == pytest.approx(0.3, abs=2 * np.pi / 3600)


def test_what_cannot_wear() -> None:
    """Wear needs clearances, a coefficient above 0, and shares within 0 and 1."""
    bar = load_linkage("five-bar")
    with pytest.raises(InvalidValueError, match=r"wear coefficient: expected 1e-15 to 1e\+09 mm³/\(N m\), got 0 "):
        WearLaw(coefficient=0.0)
    with pytest.raises(InvalidValueError, match=r"width: expected 0\.001 to 100000 mm, got 1e-305 mm"):
        WearLaw(coefficient=1e-14, width=1e-308)
    with pytest.raises(InvalidValueError, match="bearing share: expected 0 to 1"):
        WearLaw(coefficient=1e-14, bearing_share=1.5)
    with pytest.raises(InvalidValueError, match=r"spread of the wear coefficient: expected 0 to 5, got 1e\+06"):
        assess_wear(bar, named_path("y1"), WearLaw(coefficient=1e-14), spread=1e6)
    tight = Stroke.of(bar.with_clearances({"J2": 0.0}), named_path("y1"), moments=5)
    with pytest.raises(InvalidValueError, match="wear needs them at least 1e-06 mm, got 0 mm"):
        wear_life(tight, WearLaw(coefficient=1e-14))
