"""Loads on a known arm, and gains of drives from a load that is known."""

import attrs
import numpy as np
import pytest

from armwright.arm.model import Link
from armwright.dynamics.payloads import payload
from armwright.errors import ContradictionError, InvalidValueError
from armwright.identification import DynamicModel, drive_gains, identify_payload
from armwright.identification.log import with_gains
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import rotation_from_vector
from identification.simulated import log, truth

pytest.importorskip("clarabel", reason="the extra identification is not installed")

LOAD = Link(mass=3.0, com=(0.03, -0.05, 0.12), inertia=np.diag([0.03, 0.025, 0.02]))


def test_load_is_found_in_the_tool_frame(rng: np.random.Generator) -> None:
    """Mass and centre of a load on a tool that is turned and shifted come out within one per cent and a millimetre."""
    arm = attrs.evolve(truth(), tool=homogeneous(rotation_from_vector([0.3, -0.4, 0.5]), (0.1, 0.0, 0.05)))
    loaded = payload(arm, LOAD.mass, LOAD.com, LOAD.inertia)

    found = identify_payload(arm, [log(loaded, rng)])

    assert found.load.mass == pytest.approx(LOAD.mass, rel=0.01)
    np.testing.assert_allclose(found.load.com, LOAD.com, atol=2e-3)
    np.testing.assert_allclose(found.load.inertia, LOAD.inertia, atol=0.02)
    assert abs(found.load.mass - LOAD.mass) < 4 * found.mass_error
    assert (np.abs(found.load.com - LOAD.com) < 4 * found.com_errors).all()
    assert np.linalg.eigvalsh(found.load.inertia)[0] > 0
    assert found.loaded.links[-1].mass == pytest.approx(arm.links[-1].mass + found.load.mass)


def test_friction_that_has_changed_is_no_load(rng: np.random.Generator) -> None:
    """Joints that have cooled down take more friction; the mass stays what it is, and the change is told."""
    arm = truth()
    cold = [attrs.evolve(m, viscous=m.viscous + 1.0, offset=m.offset - 0.2) for m in arm.motors]
    loaded = payload(attrs.evolve(arm, motors=cold), LOAD.mass, LOAD.com, LOAD.inertia)

    found = identify_payload(arm, [log(loaded, rng)])

    assert found.load.mass == pytest.approx(LOAD.mass, rel=0.01)
    np.testing.assert_allclose(found.changes[:, 0], 1.0, atol=0.4)
    titles = [table.title for table in found.tables()]
    assert titles == ["Load in the tool frame, inertia about its centre", "Friction, beyond that of the arm file"]
    assert found.as_data()["mass"] == found.load.mass


def test_swapped_efforts_are_refused(rng: np.random.Generator) -> None:
    """Efforts under the names of other joints, or counted the other way, are no load."""
    arm = truth()
    measured = log(payload(arm, LOAD.mass, LOAD.com, LOAD.inertia), rng)
    turned = measured.effort * np.where(np.arange(arm.n) == 1, -1.0, 1.0)

    with pytest.raises(ContradictionError, match="joint 2 and joint 3 look swapped"):
        identify_payload(arm, [attrs.evolve(measured, effort=measured.effort[:, [0, 2, 1, *range(3, arm.n)]])])
    with pytest.raises(ContradictionError, match="joint 2 look reversed"):
        identify_payload(arm, [attrs.evolve(measured, effort=turned)])


def test_no_load_is_said_to_be_none(rng: np.random.Generator) -> None:
    """Efforts of the arm alone, or of gains that are too small, show no load."""
    arm = truth()
    with pytest.raises(ContradictionError, match="no load is seen"):
        identify_payload(arm, [log(arm, rng)])


@pytest.mark.parametrize("mass_alone", [False, True])
def test_gains_follow_from_a_known_load(rng: np.random.Generator, *, mass_alone: bool) -> None:
    """With and without a load of which the mass is known, gains come out within their errors, or its centre as well."""
    arm = truth()
    gains = np.array([12.0, 10.0, -9.0, 5.0, 4.0, 3.0])
    loaded = payload(arm, LOAD.mass, LOAD.com, LOAD.inertia)
    without, with_load = (with_gains(log(each, rng, sigma=0.01), 1 / gains) for each in (arm, loaded))

    found = drive_gains(DynamicModel(arm=arm), [without], [with_load], LOAD, mass_alone=mass_alone)

    assert (np.abs(found.values - gains) < 5 * found.errors).all()
    assert (found.errors[1:5] < 0.05 * np.abs(gains[1:5])).all()


def test_a_load_of_nothing_is_refused(rng: np.random.Generator) -> None:
    """A load without mass sets no scale."""
    readings = log(truth(), rng)
    with pytest.raises(InvalidValueError, match="mass of the load"):
        drive_gains(DynamicModel(arm=truth()), [readings], [readings], Link())
