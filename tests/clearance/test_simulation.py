"""Linkages with play as they are simulated: against published numbers, beside those without play, and many at once."""

import json
from typing import Any

import attrs
import numpy as np
import pytest
from numpy.typing import ArrayLike

from armwright.clearance import simulation
from armwright.clearance.assessment import ClearanceRun
from armwright.clearance.contact import stiffness
from armwright.clearance.energy_balance import energy_balance
from armwright.clearance.equations import FrictionModel
from armwright.clearance.linkage import BodyPoint, Linkage
from armwright.clearance.paths import constant_speed_path, thesis_path
from armwright.clearance.reader import load_linkage
from armwright.clearance.scenario import Scenario, prepare_scenario
from armwright.clearance.settings import Settings, check_step, contact_stiffness
from armwright.clearance.simulation import Simulation, Status, simulate
from armwright.errors import InvalidValueError, ShapeError
from clearance.arms import beginning
from clearance.mechanisms import block, imbalance, left_alone, pendulum, still, thrown

# The issue asks for the converged values of y1 to this [m].
CONVERGED = 2e-6
# Of 15 J that the motors of y1 give, what RK4 at 10 µs may lose or gain in fifty blows [J].
LEAK = 2e-4


@pytest.fixture(scope="module")
def five_bar() -> Linkage:
    return load_linkage("five-bar")


@pytest.fixture(scope="module")
def y1(five_bar: Linkage) -> Scenario:
    return prepare_scenario(five_bar, thesis_path("y1"), Settings(sample=1e-3))


@pytest.fixture(scope="module")
def smooth(y1: Scenario) -> Simulation:
    """Without friction, with 1 mm down to 50 µm of play."""
    return simulate(y1, np.array((1e-3, 5e-4, 2e-4, 1e-4, 5e-5))[:, None] * np.ones(3), frictions=0.0)


@pytest.fixture(scope="module")
def many(y1: Scenario) -> Simulation:
    """Forty runs, with clearances and frictions by chance."""
    rng = np.random.default_rng(5)
    return simulate(y1, rng.uniform(1e-4, 5e-4, (40, 3)), frictions=rng.uniform(0.0, 0.2, 40), threads=2)


class TestFiveBar:
    """The thesis' arm on its path y1."""

    def test_converged(self, smooth: Simulation) -> None:
        """With half a millimetre of play, without friction, the tip has the error that an independent program gave."""
        wanted_mm = ((0.2672, -0.9250), (0.2306, -0.9535), (0.1977, -0.8913), (0.0745, -0.6729))
        np.testing.assert_allclose(
            smooth.error[1, [50, 100, 150, 200]], np.array(wanted_mm) * 1e-3, rtol=0, atol=CONVERGED
        )

    def test_less_play_less_error(self, smooth: Simulation) -> None:
        """The error falls with the play, in proportion: until the impacts it is 1.9 to 2 times the play in each pin."""
        play = smooth.clearances[:, 0]
        largest = smooth.distance[:, :151].max(axis=-1) / play

        assert np.all((largest > 1.9) & (largest < 2.0))
        # At the start, where nothing swings, to a thousandth; the walls give way by a thousandth of the play.
        np.testing.assert_allclose(smooth.distance[:, 0] / play, 1.9, rtol=3e-3)

    @pytest.mark.parametrize("friction", [0.0, 0.05])
    def test_ledger(self, y1: Scenario, friction: float) -> None:
        """What the motors give is in the arm, or lost in impacts and friction, at every moment."""
        run = simulate(y1, frictions=friction)

        assert run.works["driven"].max() > 10.0
        assert run.works["impact loss"][-1] > 1e-2
        assert (run.works["friction loss"][-1] > 1e-2) == (friction > 0)
        assert np.abs(imbalance(run)).max() < LEAK

    @pytest.mark.parametrize(("path", "thesis"), [("y1", 0.5504), ("y3", 0.5439), ("y7", 0.5187)])
    def test_intercepts_of_arm_a(self, five_bar: Linkage, path: str, thesis: float) -> None:
        """With friction of the centres' speed arm A's straight parts begin within 3 % of where the thesis' do."""
        settings = Settings(friction=FrictionModel(velocity="centre"), threshold=1e-2)
        run = simulate(prepare_scenario(five_bar, thesis_path(path), settings), np.array((0.328, 0.171, 0.483)) * 1e-3)

        part = (run.time > 0.07 - 1e-9) & (run.time < 0.12 + 1e-9)
        intercept = np.polyfit(run.time[part], run.distance[part] * 1e3, 1)[1]
        assert intercept == pytest.approx(thesis, rel=0.03)

    def test_journals_stay_in_their_bearings(self, smooth: Simulation) -> None:
        """No journal is deeper in its wall than a hundredth of a millimetre, where blows of a kilonewton put it."""
        assert 0 < smooth.depths.max() < 2e-5
        assert smooth.peaks.max() > 500.0

    def test_starts(self, five_bar: Linkage) -> None:
        """At the start journals lie on elastic walls, on rigid ones, or in the middle of their bearings."""
        for start, low, high in (("rest", 1e-8, 1e-6), ("rigid", -1e-12, 1e-12), ("centred", -5e-4, -5e-4)):
            settings = Settings(start=start, sample=1e-2)  # type: ignore[arg-type]
            task = prepare_scenario(five_bar, thesis_path("y1"), settings)
            depths = simulate(task).depths[0]
            assert np.all((depths >= low - 1e-15) & (depths <= high + 1e-15))


# Of the slider-crank: its speed [rad/s], and what play its pin has [m].
SPEED = 5000 * 2 * np.pi / 60
CLEARANCES = np.array((5e-4, 2e-4, 1e-4, 5e-5))


@pytest.fixture(scope="module")
def run() -> Simulation:
    """Two revolutions of the slider-crank."""
    settings = Settings(step=2e-6, sample=1e-5, start="centred")
    task = prepare_scenario(load_linkage("slider-crank"), constant_speed_path("round", 0.0, SPEED, 0.024), settings)
    return simulate(task, CLEARANCES[:, None])


class TestSliderCrank:
    """The slider-crank of the papers at 5000 revolutions a minute, two revolutions of it."""

    def test_crank_does_not_care(self, run: Simulation) -> None:
        """The crank rotates as commanded."""
        np.testing.assert_allclose(run.q[0, :, 0], SPEED * run.time, rtol=0, atol=1e-9)

    def test_slider_stays_near(self, run: Simulation) -> None:
        """The error of the slider is at most clearance and indentation along the leaning rod."""
        lean = np.sqrt(1 - (0.05 / 0.12) ** 2)
        reach = (CLEARANCES + run.depths.max(axis=(-1, -2))) / lean
        largest = np.abs(run.error[..., 0]).max(axis=-1)

        assert np.all(largest < reach)
        assert np.all(largest > 0.8 * CLEARANCES)

    def test_rattles(self, run: Simulation) -> None:
        """With half a millimetre the journal flies a good part of the time, and presses with many times the force."""
        flying = (run.depths[..., 0] <= 0).mean(axis=-1)
        ideal = 0.14 * 19419.36

        assert 0.1 < flying[0] < 0.6
        assert np.all(flying[1:] < flying[0])
        assert run.depths[0].max() < 0.2 * CLEARANCES[0]
        assert run.peaks[0, 0] > 3 * ideal

    def test_ledger(self, run: Simulation) -> None:
        """What the crank's drive gives is in the motion, or was lost in the impacts."""
        assert run.works["impact loss"][0, -1] > 1.0
        assert np.abs(imbalance(run)).max() < 1e-4 * run.works["driven"].max()

    def test_stiffness(self) -> None:
        """Its pin has the stiffness of the papers, 6.6102e10 N/m^1.5."""
        pin = load_linkage("slider-crank").pins[0]
        assert stiffness(pin.clearance, pin.journal_radius, 207e9, 0.3) == pytest.approx(6.6102e10, rel=5e-5)


def assert_same(run: Simulation, other: Simulation, index: Any = ...) -> None:
    for what in ("q", "qd", "forces", "impacts", "peaks", "status"):
        np.testing.assert_array_equal(getattr(run, what), getattr(other, what)[index])
    for name, work in run.works.items():
        np.testing.assert_array_equal(work, other.works[name][index])


class TestManyAtOnce:
    """Runs side by side."""

    @pytest.mark.parametrize("number", [0, 7, 15, 16, 39])
    def test_alone(self, y1: Scenario, many: Simulation, number: int) -> None:
        """A run has the same bits alone as among forty."""
        alone = simulate(y1, many.clearances[number], frictions=many.frictions[number])

        assert_same(alone, many, number)

    def test_threads(self, y1: Scenario, many: Simulation) -> None:
        """One core gives the same bits as two."""
        assert_same(simulate(y1, many.clearances, frictions=many.frictions, threads=1), many)

    def test_order(self, y1: Scenario, many: Simulation) -> None:
        """In any order they are the same."""
        back = simulate(y1, many.clearances[::-1], frictions=many.frictions[::-1])

        assert_same(back, many, slice(None, None, -1))

    def test_leading_axes(self, y1: Scenario, many: Simulation) -> None:
        """Clearances and frictions make a table of runs."""
        run = simulate(y1, many.clearances[:2, None], frictions=[many.frictions[0], 0.3, 0.0])

        assert run.tip.shape == (2, 3, len(run.time), 2)
        assert run.impacts.shape == (2, 3, 3)
        np.testing.assert_array_equal(run.q[0, 0], many.q[0])

    def test_diverging_run_leaves_its_neighbours(self, y1: Scenario, many: Simulation) -> None:
        """A run whose friction no step can follow is a row that says so; those beside it do not know."""
        frictions = many.frictions[:5].copy()
        frictions[2] = 1e9
        run = simulate(y1, many.clearances[:5], frictions=frictions)

        assert run.status.tolist() == [Status.FINISHED] * 2 + [Status.DIVERGED] + [Status.FINISHED] * 2
        for i in (0, 1, 3, 4):
            np.testing.assert_array_equal(run.q[i], many.q[i])

    def test_none(self, y1: Scenario) -> None:
        """No clearances, no runs."""
        assert simulate(y1, np.zeros((0, 3)) + 1e-4).tip.shape == (0, 251, 2)


def test_runs_with_other_restitution_payload_and_efforts(five_bar: Linkage) -> None:
    """A run is that of a linkage of such material, with such a mass in its rod, and of such efforts of its drives."""
    task = prepare_scenario(five_bar, beginning(thesis_path("y1"), 0.1), Settings(step=2e-5, sample=1e-3))
    rod, mass = five_bar.body("link3"), 0.15
    end = rod.points["J3"][0]
    total = rod.mass + mass
    centre = (rod.mass * rod.centre[0] + mass * end) / total
    inertia = rod.inertia + rod.mass * (centre - rod.centre[0]) ** 2 + mass * (end - centre) ** 2
    heavier = attrs.evolve(rod, mass=total, inertia=inertia, centre=(centre, 0.0))
    others = attrs.evolve(
        five_bar,
        bodies=[heavier if body.name == "link3" else body for body in five_bar.bodies],
        material=attrs.evolve(five_bar.material, restitution=0.6),
    )

    runs = simulate(task, restitutions=[0.9, 0.6], payloads=[0.0, mass], torque_scales=[1.0, 1.02])

    plain = simulate(task)
    other = simulate(attrs.evolve(task, linkage=others, table=1.02 * task.table))
    # Coordinates of the rod are those of its own centre.
    np.testing.assert_allclose(runs.tip[0], plain.tip, rtol=0, atol=1e-11)
    np.testing.assert_allclose(runs.tip[1], other.tip, rtol=0, atol=1e-10)
    assert np.abs(runs.tip[1] - runs.tip[0]).max() > 1e-3
    assert np.abs(energy_balance(runs).imbalance).max() < LEAK


def test_samples() -> None:
    """Samples come at the multiples of their time, from the start to the end, whatever the step."""
    task = thrown(block(), Settings(step=1e-5, sample=2.5e-4, start="centred"), 0.01, (0.01, 0.02))
    run = simulate(task)

    np.testing.assert_allclose(run.time, np.arange(41) * 2.5e-4, atol=1e-15)
    flying = run.time < 0.02
    np.testing.assert_allclose(run.q[flying], run.time[:, None] * (0.01, 0.02), rtol=0, atol=1e-14)


def test_what_lies_has_not_struck(five_bar: Linkage) -> None:
    """Journals that lie on their walls from the start have not come down on them."""
    task = prepare_scenario(five_bar, thesis_path("y1"), Settings(sample=1e-2))
    short = attrs.evolve(task, steps=100, table=task.table[:100])

    assert simulate(attrs.evolve(short, settings=attrs.evolve(task.settings, sample=1e-3))).impacts.tolist() == [
        0,
        0,
        0,
    ]


def test_names_of_points_count() -> None:
    """A linkage whose journal lies where another's guide is, under each other's names, is another linkage."""
    linkage = block()
    cross, falling = linkage.bodies
    pin = attrs.evolve(linkage.pins[0], journal=BodyPoint("block", "Q"))
    settings = Settings(step=5e-5, sample=1e-3, start="centred")
    for first, second in (("P", "Q"), ("Q", "P")):
        body = attrs.evolve(falling, points={first: (0.0, 0.0), second: (0.0, 0.1)})
        named = attrs.evolve(linkage, name="named", bodies=[cross, body], pins=[pin])
        run = simulate(thrown(named, settings, 0.01, (0.0, 0.0)))

        # In the middle of its hole, without weight, nothing moves.
        np.testing.assert_array_equal(run.qd, 0.0)
        np.testing.assert_allclose(run.depths, -pin.clearance, rtol=1e-9)


def test_no_play_at_all() -> None:
    """A linkage without any pin that has play is simulated like any other; there is nothing in its pins."""
    run = simulate(
        left_alone(prepare_scenario(pendulum(), still(0.1, 0.0), Settings(step=1e-3, sample=1e-2))), frictions=[0, 1]
    )

    assert run.gaps.shape == (2, 11, 0, 2)
    assert run.forces.shape == (2, 11, 0)
    np.testing.assert_allclose(run.q[:, -1, 0], -9.81 * 0.1**2 / 2, rtol=1e-4)


class TestRefused:
    """What is said before anything runs."""

    @pytest.mark.parametrize("clearance", [0.0, -1e-4, np.nan])
    def test_no_clearance(self, y1: Scenario, clearance: float) -> None:
        """Contact needs play."""
        with pytest.raises(InvalidValueError, match="clearances"):
            simulate(y1, [5e-4, clearance, 5e-4])

    def test_clearances_per_pin(self, y1: Scenario) -> None:
        """There is one for each pin; the message names the pins."""
        with pytest.raises(
            ShapeError, match=r"clearances of J2, J3, J4: expected a shape ending in \(3,\), got \(2,\)"
        ):
            simulate(y1, [5e-4, 5e-4])

    def test_axes_that_do_not_fit(self, y1: Scenario) -> None:
        """Four clearances and three frictions make no table."""
        with pytest.raises(
            ShapeError, match=r"clearances and frictions: leading axes must broadcast together, got \(4, 3\), \(3,\)"
        ):
            simulate(y1, np.full((4, 3), 5e-4), frictions=np.zeros(3))

    def test_negative_friction(self, y1: Scenario) -> None:
        """Friction does not push."""
        with pytest.raises(InvalidValueError, match=r"frictions: expected none below 0, got -0\.1"):
            simulate(y1, frictions=-0.1)

    @pytest.mark.parametrize(
        ("numbers", "said"),
        [
            ({"restitutions": 0.0}, "restitutions: expected above 0, got 0"),
            ({"restitutions": [0.5, 1.5]}, r"restitutions: expected none above 1, got 1\.5"),
            ({"payloads": -0.1}, r"payloads: expected none below 0, got -0\.1"),
            ({"torque_scales": 0.0}, "torque_scales: expected above 0, got 0"),
        ],
    )
    def test_parameters_out_of_range(self, y1: Scenario, numbers: dict[str, ArrayLike], said: str) -> None:
        """What no linkage has is refused."""
        with pytest.raises(InvalidValueError, match=said):
            simulate(y1, **numbers)

    def test_scale_of_prescribed_motion(self) -> None:
        """Drives that follow a motion have no efforts to scale."""
        crank = load_linkage("slider-crank")
        turning = prepare_scenario(crank, constant_speed_path("round", 0.0, 1.0, 0.1))
        with pytest.raises(InvalidValueError, match="torque_scales: expected drives by effort"):
            simulate(turning, torque_scales=1.1)

    def test_step(self, five_bar: Linkage) -> None:
        """A step that cannot follow the contacts is refused before the run."""
        with pytest.raises(InvalidValueError, match=r"step: 0\.0001 s is too long for contacts"):
            simulate(prepare_scenario(five_bar, thesis_path("y1"), Settings(step=1e-4)))

    def test_path_for_other_axes(self, five_bar: Linkage) -> None:
        """A path for one drive does not lead an arm with two."""
        with pytest.raises(ShapeError, match="path round: expected 2 axes for the drives, got 1"):
            prepare_scenario(five_bar, constant_speed_path("round", 0.0, 1.0, 0.1))

    def test_path_out_of_reach(self, five_bar: Linkage) -> None:
        """A path in millimetres, read as metres, leads nowhere."""
        path = attrs.evolve(thesis_path("y1"), pieces=thesis_path("y1").pieces * 1e3)
        with pytest.raises(InvalidValueError, match=r"five-bar: the path cannot be followed.*out of reach"):
            prepare_scenario(five_bar, path)

    def test_no_assembly(self, five_bar: Linkage) -> None:
        """Where nothing says how the arm is put together, all its links hang down, and it may go to either side."""
        with pytest.raises(InvalidValueError, match="singular configuration"):
            prepare_scenario(attrs.evolve(five_bar, assembly={}), thesis_path("y1"), Settings(step=1e-3))


def test_other_assembly(five_bar: Linkage) -> None:
    """With the left elbow inside, the same path needs other angles on the left, and the same on the right."""
    settings = Settings(step=1e-3)
    inside = attrs.evolve(five_bar, assembly={"link1": 0.9, "link2": -1.0, "link3": -0.75, "link4": 0.7})

    own, other = (prepare_scenario(linkage, thesis_path("y1"), settings).ideal.q for linkage in (five_bar, inside))

    assert np.abs(other[:, 0] - own[:, 0]).min() > 1.0
    np.testing.assert_allclose(other[:, 4:], own[:, 4:], rtol=0, atol=1e-10)


def test_called_off(five_bar: Linkage, monkeypatch: pytest.MonkeyPatch) -> None:
    """A simulation that is called off comes back from compiled code without a result."""
    task = prepare_scenario(five_bar, thesis_path("y1"), Settings(sample=1e-3))
    monkeypatch.setattr(
        simulation, "on_cores_for_long", lambda work, runs, _threads: work(0, runs, np.ones(1, dtype=np.int64))
    )

    assert simulate(task).status == Status.DIVERGED


class TestDiverging:
    """A run that diverges is reported as such, in numbers that JSON knows."""

    def test_numbers(self, five_bar: Linkage, monkeypatch: pytest.MonkeyPatch) -> None:
        """With a step ten times too long a run diverges without a warning; what is shown of it is finite."""
        monkeypatch.setattr(simulation, "check_step", lambda *_: None)
        run = simulate(prepare_scenario(five_bar, thesis_path("y1"), Settings(step=2e-4, sample=2e-4)), [1e-4] * 3)
        data = ClearanceRun.of(run).as_data()

        assert run.status == Status.DIVERGED
        assert data["sound_until"] < 0.25
        json.dumps(data, allow_nan=False)

    def test_advice(self, five_bar: Linkage) -> None:
        """The step that is advised instead of one that is too long is one that is accepted."""
        for clearance in np.geomspace(1e-6, 1e-2, 9):
            task = prepare_scenario(five_bar, thesis_path("y1"), Settings(step=2e-4, sample=0.1))
            with pytest.raises(InvalidValueError, match="too long") as error:
                simulate(task, [clearance] * 3)
            advised = float(str(error.value).split("at most ")[1].split(" ")[0])

            check_step(five_bar, Settings(step=advised), contact_stiffness(five_bar, np.full(3, clearance)))
