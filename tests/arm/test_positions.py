"""Positions that look like degrees get a warning; all others, and all else, get none."""

import contextlib
import warnings

import numpy as np
import pytest

import armwright
import doors
from armwright.arm.limits import Limits
from armwright.arm.model import Arm, Joint, Link
from armwright.errors import ArmwrightError, UnitWarning
from armwright.simulation.controllers import gravity_compensation
from doors import DOORS, PUMA

DEGREES = (10.0, 90.0, 20.0, 30.0, 90.0, 0.0)

# Profiles know no arm, and so no angles from slides.
WITHOUT_ARM = ("bejczy", "quintic", "cubic", "trapezoid")
POSITIONS = [
    name
    for name in DOORS
    if name.endswith((": q", ": q_start", ": q_goal", ": near")) and not name.startswith(WITHOUT_ARM)
]


@pytest.mark.parametrize("door", POSITIONS)
def test_degrees_by_mistake(door: str) -> None:
    """Positions of many turns get one warning, at the line of the caller, with the joint and what it would be.

    They may be refused after that, as beyond a limit.
    """
    what = door.partition(": ")[2]

    with pytest.warns(UnitWarning) as caught, contextlib.suppress(ArmwrightError):
        DOORS[door](DEGREES)

    assert len(caught) == 1
    assert caught[0].filename == doors.__file__
    assert str(caught[0].message).startswith(
        f"{what}: joint 1 of 'puma560-seed' is at 10 rad, 1.6 revolutions. If degrees are meant, 10 degrees "
        "are 0.174533 rad: give numpy.deg2rad(...)."
    )


@pytest.mark.parametrize("door", [name for name in DOORS if name.endswith((": qd", ": qdd", ": tau", "twist"))])
def test_speeds_and_efforts_are_not_positions(door: str) -> None:
    """A speed of many turns per second, or an effort, is no position and gets no warning, even if it is refused."""
    with contextlib.suppress(ArmwrightError):
        DOORS[door](DEGREES)


def test_one_warning_for_many_configurations() -> None:
    """For any number of configurations there is one warning, of the first such joint and its farthest position."""
    rows = np.zeros((50, 4, 6))
    rows[:, 2, 3], rows[7, 2, 3], rows[:, :, 4] = 30.0, -170.0, 80.0

    with pytest.warns(UnitWarning, match="joint 4 of 'puma560-seed' is at -170 rad, 27.1 revolutions") as caught:
        armwright.kinematics.forward(PUMA, rows)

    assert len(caught) == 1


def test_joints_that_turn_so_far() -> None:
    """A joint whose limits admit several turns gets no warning inside them, and one without limits does."""
    turns = Joint(kind="revolute", limits=Limits(lower=-50.0, upper=50.0))
    winch = Arm(name="winch", joints=[turns])

    armwright.kinematics.forward(winch, [49.0])
    with pytest.warns(UnitWarning, match="is at 90 rad"):
        armwright.kinematics.forward(winch, [90.0])
    with pytest.warns(UnitWarning, match="is at 49 rad"):
        armwright.kinematics.forward(Arm(name="free", joints=[Joint(kind="revolute")]), [49.0])


def test_slides_are_no_angles() -> None:
    """A slide of many metres is long, and no angle; a whole turn, but for rounding, is none too many."""
    armwright.kinematics.forward(Arm(name="crane", joints=[Joint(kind="prismatic")]), [100.0])
    armwright.kinematics.forward(armwright.load_arm("ur5"), [2 * np.pi, -2 * np.pi * (1 + 1e-12), 0, 0, 0, 0])


def test_what_the_package_asks_itself() -> None:
    """A shaft that spins many turns is simulated, and followed by a controller of ours, without a warning."""
    shaft = Arm(name="shaft", joints=[Joint(kind="revolute", a=0.1)], links=[Link(mass=1.0)])

    found = armwright.simulation.simulate(shaft, [0.0], [100.0], duration=0.5, controller=gravity_compensation(shaft))

    assert found.q[-1, 0] > 2 * np.pi
    assert np.isfinite(found.energy).all()


def test_silenced(recwarn: pytest.WarningsRecorder) -> None:
    """The warning is of a category of its own, which can be silenced."""
    warnings.simplefilter("ignore", armwright.errors.UnitWarning)

    armwright.kinematics.forward(PUMA, DEGREES)

    assert not len(recwarn)
