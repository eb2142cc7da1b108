"""How a simulation may be asked for, and which steps are refused before it runs."""

import math

import attrs
import numpy as np
import pytest

from armwright.clearance.equations import FrictionModel
from armwright.clearance.paths import constant_speed_path
from armwright.clearance.reader import load_linkage
from armwright.clearance.scenario import prepare_scenario
from armwright.clearance.settings import Settings, check_step, contact_stiffness
from armwright.clearance.simulation import Status, simulate
from armwright.errors import InvalidValueError, UnknownNameError
from clearance.mechanisms import GRAVITY, block, thrown


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"integrator": "rk5"}, r"no integrator 'rk5'. Did you mean 'rk4'\?"),
        ({"control": "torque"}, "no control 'torque'"),
        ({"impact": "hunt"}, "no law of impact 'hunt'"),
        ({"friction": FrictionModel(law="coulomb")}, "no law of friction 'coulomb'"),  # type: ignore[arg-type]
        ({"friction": FrictionModel(velocity="center")}, r"no sliding speed 'center'. Did you mean 'centre'\?"),  # type: ignore[arg-type]
        ({"start": "rests"}, r"no start 'rests'. Did you mean 'rest'\?"),
    ],
)
def test_names(wrong: dict[str, object], message: str) -> None:
    """What nobody wrote is refused with what comes nearest."""
    with pytest.raises(UnknownNameError, match=message):
        Settings(**wrong)  # type: ignore[arg-type]


@pytest.mark.parametrize("what", ["step", "threshold", "sample"])
@pytest.mark.parametrize("value", [0.0, -1e-5, math.inf, math.nan])
def test_numbers(what: str, value: float) -> None:
    """Steps, thresholds and samples are above 0."""
    with pytest.raises(InvalidValueError, match=what):
        Settings(**{what: value})  # type: ignore[arg-type]


def test_gains() -> None:
    """A controller does not push away from its goal."""
    with pytest.raises(InvalidValueError, match="gains: expected 0 or more, got -1"):
        Settings(gains=(100.0, -1.0))


@pytest.mark.parametrize(("duration", "steps"), [(0.25, 25_000), (1e-5, 1), (1.04e-5, 2), (0.3, 30_000)])
def test_steps(duration: float, steps: int) -> None:
    """A path of 0.25 s takes 25,000 steps of 10 µs; the remainder is another step."""
    assert Settings(step=1e-5).steps(duration) == steps


def test_more_steps_than_anybody_means() -> None:
    """A quarter of an hour in steps of 10 µs was meant as a quarter of a second."""
    with pytest.raises(InvalidValueError, match=r"900 s would take 9e\+07 steps of 1e-05 s; at most 20,000,000"):
        Settings(step=1e-5).steps(900.0)


def test_thesis_step_is_fine() -> None:
    """10 µs follow what half a millimetre of play does in the five-bar."""
    linkage = load_linkage("five-bar")
    check_step(linkage, Settings(step=1e-5), contact_stiffness(linkage, np.full((7, 3), 5e-4)))


def test_long_steps_are_refused_before_the_run() -> None:
    """0.1 ms cannot follow contacts that swing in 0.6 ms; the message says how stiff they are and what would do."""
    linkage = load_linkage("five-bar")
    K = contact_stiffness(linkage, np.full(3, 5e-4))
    with pytest.raises(InvalidValueError, match=r"step: 0\.0001 s is too long for contacts of 6\.95e\+10 N/m\^1\.5"):
        check_step(linkage, Settings(step=1e-4), K)


def test_smaller_play_needs_smaller_steps() -> None:
    """Of many runs the stiffest contact decides."""
    linkage = load_linkage("five-bar")
    settings = Settings(step=2.5e-5)
    check_step(linkage, settings, contact_stiffness(linkage, np.full(3, 5e-4)))
    with pytest.raises(InvalidValueError, match="is too long for contacts of"):
        check_step(linkage, settings, contact_stiffness(linkage, np.array([[5e-4] * 3, [5e-4, 1e-9, 5e-4]])))


def test_nothing_to_follow() -> None:
    """Where nothing has play any step will do."""
    linkage = load_linkage("five-bar")
    check_step(attrs.evolve(linkage, pins=()), Settings(step=1.0), np.zeros((4, 0)))


def test_longest_step_is_stable() -> None:
    """A block that falls on its wall comes to rest on it at nearly the longest step that is allowed."""
    linkage = block(gravity=GRAVITY, restitution=0.6)
    K = contact_stiffness(linkage, np.array([5e-4]))
    with pytest.raises(InvalidValueError, match="expected at most") as refused:
        check_step(linkage, Settings(step=1.0), K)
    longest = float(str(refused.value).split("at most ")[1].split()[0])
    settings = Settings(step=0.9 * longest, start="centred", impact="exact")

    run = simulate(thrown(linkage, settings, 0.3, (0.0, 0.0)))

    assert run.status == Status.FINISHED
    assert run.impacts[0] > 5
    assert np.abs(run.qd[-1]).max() < 1e-3
    assert run.forces[-1, 0] == pytest.approx(GRAVITY, rel=0.02)


@pytest.mark.parametrize(("step", "duration"), [(5e-324, 1.0), (1e-5, 1e308), (1e-5, float("inf"))])
def test_steps_beyond_any_number(step: float, duration: float) -> None:
    """A step or a duration that makes the number of steps infinite is refused like any other that takes too many."""
    with pytest.raises(InvalidValueError, match="at most 20,000,000"):
        Settings(step=step).steps(duration)


@pytest.mark.parametrize("duration", [1e-320, 1e-10])
def test_paths_without_time(duration: float) -> None:
    """A path that takes next to no time is refused."""
    crank = load_linkage("slider-crank")
    with pytest.raises(InvalidValueError, match="expected a duration from 1e-09 s, got "):
        prepare_scenario(crank, constant_speed_path("short", 0.0, 30.0, duration))


def test_one_gain_is_refused() -> None:
    """A controller has two gains: a kernel that was handed one would read beside it."""
    with pytest.raises(InvalidValueError, match="gains: expected stiffness and damping, got 1"):
        Settings(control="pd+ff", gains=(200.0,))  # type: ignore[arg-type]
