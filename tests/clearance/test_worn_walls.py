"""Worn walls in the dynamics: a wheel in a worn hole against closed forms, SciPy, and the leaning of the wear."""

from itertools import pairwise

import attrs
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from armwright.arrays import Array
from armwright.clearance.energy_balance import energy_balance
from armwright.clearance.ideal import tip_position
from armwright.clearance.linkage import Body, BodyPoint, ClearancePin, Drive, Guide, Linkage, Material, Pin
from armwright.clearance.paths import named_path
from armwright.clearance.reader import load_linkage
from armwright.clearance.scenario import prepare_scenario
from armwright.clearance.settings import Settings, contact_stiffness
from armwright.clearance.simulation import Simulation, simulate
from armwright.clearance.static_equilibrium import find_static_equilibrium
from armwright.clearance.wear.life import WearLife, wear_life
from armwright.clearance.wear.worn_stroke import Stroke, lean
from armwright.clearance.wear.worn_surfaces import WearLaw
from armwright.clearance.worn_walls import WornWalls
from clearance.mechanisms import GRAVITY, left_alone, still, thrown

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

CLEARANCE, DEPTH = 5e-4, 2e-5
ANGLES = np.arange(360) * (2 * np.pi / 360)
NOTHING = np.zeros((1, 360))


def wheel(*, restitution: float = 1.0, friction: float = 0.0, centre: float = 0.0, turned: bool = False) -> Linkage:
    """A wheel of 1 kg that moves and turns freely; its shaft is in a hole of the ground, or the other way round."""
    ends = BodyPoint("ground", "H"), BodyPoint("wheel", "P")
    return Linkage(
        name="wheel",
        ground=Body(name="ground", points={"O": (0, 0), "H": (centre, 0)}),
        bodies=[
            Body(name="cross", mass=0.5, points={"P": (0, 0)}),
            Body(name="block", mass=0.25, points={"P": (0, 0)}),
            Body(name="wheel", mass=0.75, inertia=1e-5, points={"P": (0, 0), "Q": (0.01, 0)}),
        ],
        joints=[
            Guide(body="cross", point="P", on=BodyPoint("ground", "O")),
            Guide(body="block", point="P", on=BodyPoint("cross", "P"), direction=np.pi / 2),
            Pin(body="wheel", point="P", on=BodyPoint("block", "P")),
        ],
        pins=[
            ClearancePin(
                name="hole",
                bearing=ends[turned],
                journal=ends[not turned],
                clearance=CLEARANCE,
                journal_radius=0.01,
            )
        ],
        drives=[Drive(body="wheel")],
        tip=BodyPoint("wheel", "P"),
        gravity=(0.0, -GRAVITY),
        material=Material(restitution=restitution, friction=friction),
    )


def profile(order: int, phase: float, depth: float = DEPTH) -> Array:
    return depth * (1 + np.cos(order * ANGLES - phase))[None]


BEARING, JOURNAL = profile(3, 0.4), profile(2, 1.0)


def rolled(
    linkage: Linkage,
    worn: WornWalls | None,
    *,
    duration: float = 0.004,
    step: float = 5e-6,
    speeds: tuple[float, float, float] = (0.3, -0.2, 30.0),
    clearance: float = CLEARANCE,
    place: tuple[float, float] = (0.0, 0.0),
    samples: int = 20,
) -> Simulation:
    """The wheel, thrown from a place in its hole."""
    # So that friction is no stiffer than the contacts.
    how = Settings(step=step, sample=duration / samples, start="centred", threshold=0.1)
    task = left_alone(thrown(linkage, how, duration, speeds))
    q = task.ideal.q.copy()
    q[0] = (*place, 0.0)
    return simulate(attrs.evolve(task, ideal=attrs.evolve(task.ideal, q=q)), [clearance], worn=worn)


def test_even_wear_is_a_wider_clearance() -> None:
    """Surfaces that have lost the same everywhere are those of a round pin with that much more clearance."""
    even = np.full((1, 360), DEPTH / 2)
    linkage = wheel(restitution=0.8, friction=0.1)

    worn = rolled(linkage, WornWalls.of(linkage, even, even), duration=0.012)

    round_pin = rolled(linkage, None, clearance=CLEARANCE + DEPTH, duration=0.012)
    assert worn.impacts[0] > 2
    np.testing.assert_allclose(worn.q, round_pin.q, rtol=0, atol=1e-12)
    np.testing.assert_allclose(worn.peaks, round_pin.peaks, rtol=1e-7)


def test_first_wave_is_a_shifted_circle() -> None:
    """A bearing that has lost a cos φ is round with its centre at a: a journal goes as in a hole that is there.

    To second order, for depth is measured from the old centre; a wall of radius c + a cos θ is off by up to a² / 2 c.
    """
    shift = 4e-5
    linkage = wheel()
    waved = rolled(linkage, WornWalls.of(linkage, shift * np.cos(ANGLES)[None], NOTHING), duration=0.004)

    shifted = rolled(wheel(centre=shift), None, duration=0.004)

    assert waved.impacts == shifted.impacts == 1
    apart = np.abs(waved.q - shifted.q)[:, :2].max()
    assert apart < 0.5 * shift**2 / (2 * CLEARANCE)


@pytest.mark.parametrize("turned", [False, True])
def test_elastic_blows_keep_the_energy(*, turned: bool) -> None:
    """On a worn wall, without friction and loss, no energy goes; it passes between the spin and the blows."""
    linkage = wheel(turned=turned)
    run = rolled(linkage, WornWalls.of(linkage, BEARING, JOURNAL), duration=0.02, step=1e-6)

    assert run.impacts[0] > 5
    spin = run.qd[:, 2]
    exchanged = 0.5 * 1e-5 * float(np.ptp(spin**2))
    assert exchanged > 1e-3
    # What a blow leaks where it begins, as on a round wall.
    assert np.abs(energy_balance(run).imbalance).max() < 1e-3 * exchanged


def test_losses_balance() -> None:
    """With friction and losses the balance closes, as on a round wall."""
    linkage = wheel(restitution=0.7, friction=0.2)
    run = rolled(linkage, WornWalls.of(linkage, BEARING, JOURNAL), duration=0.02, step=1e-6)

    energy = energy_balance(run)
    assert energy.friction_loss[-1] > 1e-3
    assert np.abs(energy.imbalance).max() < 1e-4 * energy.friction_loss[-1]


def slid(step: float) -> Array:
    """(6,) state of a wheel that slides in its worn hole like a pendulum, pressed to the wall by its weight."""
    linkage = wheel()
    # A deeper wave than that of the wear, so that the slope of the wall matters on a short way.
    walls = WornWalls.of(linkage, profile(3, 0.4), profile(2, 1.0))
    place = (0.0, -CLEARANCE - float(walls.at(0, np.array(-np.pi / 2), np.array(0.0)).growth) - 3e-7)
    run = rolled(linkage, walls, duration=0.002, step=step, speeds=(0.01, 0.0, 3.0), place=place, samples=200)
    assert run.depths.min() > 0
    return np.concatenate([run.q[-1], run.qd[-1]])


def test_order_on_the_worn_wall() -> None:
    """On a worn wall that is never left Runge and Kutta's method keeps its order."""
    ends = [slid(1e-5 / 2**i) for i in range(4)]

    steps = np.array([np.linalg.norm(b - a) for a, b in pairwise(ends)])
    np.testing.assert_allclose(np.log2(steps[:-1] / steps[1:]), 4, atol=0.4)


def scipy_wheel(duration: float, speeds: tuple[float, float, float]) -> Array:
    """(6,) state of the wheel after a time, by an integration of SciPy and a contact of its own."""
    gone = [
        (lambda x, n=n, p=p: DEPTH * (1 + np.cos(n * x - p)), lambda x, n=n, p=p: -n * DEPTH * np.sin(n * x - p))
        for n, p in ((3, 0.4), (2, 1.0))
    ]
    linkage = wheel()
    K = float(contact_stiffness(linkage, np.array([CLEARANCE + 2 * DEPTH]))[0])

    def depth(q: Array) -> tuple[float, Array]:
        """How far the wheel is in the wall, and the derivatives of that by its coordinates."""
        r, theta = np.hypot(q[0], q[1]), np.arctan2(q[1], q[0])
        phi = theta
        # Where the wall is nearest: c'(φ) = -c(φ) tan(φ - θ).
        for _ in range(40):
            c = CLEARANCE + gone[0][0](phi) + gone[1][0](phi - q[2])
            phi = theta - np.arctan((gone[0][1](phi) + gone[1][1](phi - q[2])) / c)
        c = CLEARANCE + gone[0][0](phi) + gone[1][0](phi - q[2])
        lean = phi - theta
        by_theta = -c * np.sin(lean) / np.cos(lean) ** 2
        by_turn = -gone[1][1](phi - q[2]) / np.cos(lean)
        x, y = np.cos(theta), np.sin(theta)
        slopes = np.array([x + y * by_theta / r, y - x * by_theta / r, -by_turn])
        return float(r - c / np.cos(lean)), slopes

    def rates(_: float, state: Array) -> Array:
        d, slopes = depth(state[:3])
        push = -K * max(d, 0.0) ** 1.5 * slopes
        return np.concatenate([state[3:], push / (1.5, 1.0, 1e-5) - (0, GRAVITY, 0)])

    start = np.array([1e-9, 0, 0, *speeds])
    done = solve_ivp(rates, (0, duration), start, method="DOP853", rtol=1e-9, atol=1e-12, max_step=1e-4)
    return np.asarray(done.y[:, -1])


def test_wheel_of_scipy() -> None:
    """A wheel that rattles in a worn hole is where an integration of SciPy has it, whose wall is no table."""
    speeds, duration = (0.2, -0.3, 40.0), 0.006
    linkage = wheel()
    settings = {"duration": duration, "step": 2e-6, "speeds": speeds}
    run = rolled(linkage, WornWalls.of(linkage, BEARING, JOURNAL), **settings)  # type: ignore[arg-type]

    theirs = scipy_wheel(duration, speeds)

    assert run.impacts[0] == 2
    # A second blow magnifies what the spline took before the first.
    apart = np.abs(run.q[-1] - theirs[:3])
    np.testing.assert_array_less(apart[:2], 1e-6)
    even = rolled(linkage, WornWalls.of(linkage, BEARING, np.full((1, 360), DEPTH)), **settings)  # type: ignore[arg-type]
    assert np.all(np.abs(even.q[-1] - theirs[:3]) > 20 * apart)


@pytest.fixture(scope="module")
def worn_bar() -> tuple[Stroke, WearLaw, WearLife]:
    stroke = Stroke.of(load_linkage("five-bar"), named_path("y1"), moments=31)
    law = WearLaw(coefficient=1e-14, bins=180)
    return stroke, law, wear_life(stroke, law, steps=2, max_step=0.08)


def test_at_rest_it_leans_as_the_worn_stroke_does(worn_bar: tuple[Stroke, WearLaw, WearLife]) -> None:
    """The equilibrium on worn walls is that of the wear's foundation, but for what the spline takes off corners."""
    stroke, law, life = worn_bar
    linkage, surfaces, q = stroke.linkage, life.surfaces[-1], stroke.motion.q
    c = linkage.clearance_array(None)
    worn = WornWalls.of(linkage, surfaces.bearing, surfaces.journal)
    still_stroke = attrs.evolve(stroke, motion=attrs.evolve(stroke.motion, qd=np.zeros_like(q), qdd=np.zeros_like(q)))
    leaning = tip_position(linkage, lean(still_stroke, law, surfaces).q)

    rest = find_static_equilibrium(linkage, q, c, contact_stiffness(linkage, c + worn.means), worn)

    new = find_static_equilibrium(linkage, q, c).tip
    apart, moved = (np.linalg.norm(rest.tip - other, axis=-1) for other in (leaning, new))
    np.testing.assert_array_less(apart, 2 * worn.smoothing.sum())
    assert moved.min() > 4 * apart.max()


def test_what_begins_at_rest_stays() -> None:
    """A wheel laid into its worn hole as the equilibrium has it stays there, on a slope beside the lowest place."""
    linkage = wheel()
    walls = WornWalls.of(linkage, BEARING, NOTHING)
    scenario = prepare_scenario(linkage, still(0.005, 0.0), Settings(step=5e-6, sample=2.5e-4))

    run = simulate(scenario, worn=walls)

    assert abs(run.q[0, 0]) > DEPTH / 2
    np.testing.assert_allclose(run.q, np.broadcast_to(run.q[0], run.q.shape), rtol=0, atol=1e-10)
    np.testing.assert_allclose(run.forces, 1.0 * GRAVITY, rtol=1e-4)
