"""Motions of the joints that no program made, for controllers that keep to times."""

import json
import re

import attrs
import numpy as np
import pytest
from scipy.interpolate import BPoly

from armwright.arm.load import load_arm
from armwright.cell.model import CellArm
from armwright.cell.outputs import Controller, Encoders
from armwright.errors import InvalidValueError
from armwright.export import ExportError, export_motion
from armwright.identification import DynamicModel, plan_excitation
from armwright.identification.excitation import Excitation

COUNTS = (2**20, 2**20, 2**19, 2**19, 2**18, 2**18)
OFFSET = (0, 5, 0, -7, 0, 0)
SIGNS = (1, -1, 1, 1, -1, 1)


@pytest.fixture(scope="module")
def plan() -> Excitation:
    """An excitation of a UR5 of six seconds."""
    return plan_excitation(DynamicModel(arm=load_arm("ur5"), terms=("rotor", "viscous")), period=6.0, harmonics=3)


def _placed(plan: Excitation, controller: Controller | None = None) -> CellArm:
    return CellArm(arm=plan.model.arm, start=np.zeros(6), controller=controller or Controller())


def test_ros2_has_the_series_between_its_points_too(plan: Excitation) -> None:
    """Quintic splines through the points of the trajectory, by SciPy, are the Fourier series; it ends at rest."""
    exported = export_motion("ros2", plan.trajectory, _placed(plan), "excitation")

    points = json.loads(exported.files["ARM_1.trajectory.yaml"])["points"]
    t = np.array([p["time_from_start"]["sec"] + 1e-9 * p["time_from_start"]["nanosec"] for p in points])
    states = np.array([[p["positions"], p["velocities"], p["accelerations"]] for p in points])
    spline = BPoly.from_derivatives(t, states)
    fine = np.linspace(0, 6, 5000)
    np.testing.assert_allclose(spline(fine), plan.motion(fine)[0], atol=2e-6)
    np.testing.assert_allclose(states[[0, -1], 1:], 0, atol=1e-6)
    assert t[-1] == 6.0


def test_counts_are_the_series_at_each_period(plan: Excitation) -> None:
    """Counts of drives, with their signs and offsets, are the series to half a count."""
    encoders = Encoders(counts=COUNTS, offset=OFFSET, signs=SIGNS, period=4e-3)

    exported = export_motion("csv", plan.trajectory, _placed(plan, Controller(encoders=encoders)), "excitation")

    rows = np.loadtxt(exported.files["ARM_1.csv"].splitlines(), delimiter=",", skiprows=2)
    expected = np.array(OFFSET) + SIGNS * plan.motion(np.arange(1501) * 4e-3)[0] / (2 * np.pi) * COUNTS
    assert len(rows) == 1501
    assert np.abs(rows - expected).max() < 0.51


def test_urscript_streams_the_series(plan: Excitation) -> None:
    """A line of servoj every eight milliseconds has the series, in the joints of the controller, to 1e-7 rad."""
    exported = export_motion("urscript", plan.trajectory, _placed(plan), "excitation")

    (script,) = [text for name, text in exported.files.items() if name.endswith(".script")]
    streamed = np.array(
        [[float(x) for x in found.split(",")] for found in re.findall(r"servoj\(\[(.*?)\], 0, 0, t=0\.008", script)]
    )
    expected = plan.motion(np.arange(1, 751) * 8e-3)[0]
    assert streamed.shape == (750, 6)
    # The zero of a joint, and its direction, are those of the convention: differences from the first are of one sign.
    moved, wanted = np.abs(streamed - streamed[0]), np.abs(expected - expected[0])
    np.testing.assert_allclose(moved, wanted, atol=3e-7)


@pytest.mark.parametrize("target", ["krl", "rapid", "fanuc"])
def test_languages_without_times_are_refused(plan: Excitation, target: str) -> None:
    """What gives no times to points cannot hold the motion, and the message says what can."""
    with pytest.raises(InvalidValueError, match=f"expected ros2, csv, urscript, got {target}, which does not hold"):
        export_motion(target, plan.trajectory, _placed(plan), "excitation")


def test_says_what_is_not_known(plan: Excitation) -> None:
    """Without encoders there are no counts, and without a convention no joints of a controller."""
    with pytest.raises(ExportError, match="E618: the cell file does not say how the drives of ARM_1 count"):
        export_motion("csv", plan.trajectory, _placed(plan), "excitation")
    unknown = attrs.evolve(_placed(plan), arm=attrs.evolve(plan.model.arm, name="mine"))
    with pytest.raises(ExportError, match="E614: no source that was read says how the controller of 'mine'"):
        export_motion("urscript", plan.trajectory, unknown, "excitation")
