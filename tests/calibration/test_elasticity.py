"""Arms that yield about three axes of their joints: what is found, how well, and what the poses cannot tell apart."""

from pathlib import Path

import attrs
import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.arm.model import Arm, Link
from armwright.arrays import Array
from armwright.calibration import calibrate, inverse_calibrated, read_measurements
from armwright.calibration.chain import Chain, kinematic_chain
from armwright.calibration.iso9283 import repeatability
from armwright.calibration.joint_errors import (
    compliances,
    identified_compliance,
    largest_gravity_loads,
    lateral_compliances,
)
from armwright.calibration.nongeometric import calibrate_nongeometric
from armwright.calibration.readings import Readings, readings
from armwright.dynamics import static_deflection
from armwright.errors import FileFormatError, ShapeError
from calibration.simulated import LENGTH, configurations, random_arm, random_errors
from samples import Sample

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

NOISE = 3e-5
# Half of the readings are with this payload, off the axis of the last joint.
PAYLOAD = (3.0, 0.08, -0.03, 0.1)
# How far joints yield about each axis under the largest load of gravity [rad].
SAG = 1e-3


def heavy_arm(rng: np.random.Generator, n: int, *, slides: bool = False) -> Arm:
    """Return a random arm whose links weigh some kilograms."""
    links = [Link(mass=rng.uniform(2, 6), com=rng.uniform(-0.2, 0.2, 3), inertia=np.eye(3)) for _ in range(n)]
    return attrs.evolve(random_arm(rng, n, slides=slides), links=links)


def elastic_chain(arm: Arm) -> Chain:
    return kinematic_chain(arm, joint_errors=(*compliances(arm), *lateral_compliances(arm)))


def half_loaded(m: int) -> Array:
    return np.where(np.arange(m)[:, None] % 2, PAYLOAD, (0.0,) * 4)


def sags(chain: Chain) -> Array:
    """Return which errors of a chain are compliances, (k,)."""
    return np.array([".sag" in name for name in chain.names])


def test_statics_to_second_order(rng: np.random.Generator) -> None:
    """Where the model of a calibration has the tool, the equilibrium has it too, but for squares of the deflection."""
    arm = heavy_arm(rng, 4, slides=True)
    chain, q, held = elastic_chain(arm), configurations(rng, arm, 10), half_loaded(10)
    compliance = rng.uniform(0.5e-5, 1e-5, (4, 3))
    coefficients = np.array([compliance[e.joint, e.axis] for e in chain.joint_errors])
    largest = np.array([largest_gravity_loads(arm)[e.joint, e.axis] for e in chain.joint_errors])

    def difference(scale: float) -> tuple[float, float]:
        errors = np.zeros(len(chain.names))
        errors[sags(chain)] = scale * coefficients * largest
        at_rest = static_deflection(arm, scale * compliance, q, payload=held)
        predicted = chain.forward(q, errors, payload=held)
        assert np.abs(predicted.rotation - at_rest.tool[:, :3, :3]).max() < 1e-4
        off = np.linalg.norm(predicted.position - at_rest.tool[:, :3, 3], axis=1).max()
        return float(off), float(np.linalg.norm(at_rest.displacement, axis=1).max())

    (far, moved), (near, _) = difference(1.0), difference(0.5)

    assert len(chain.joint_errors) == 12
    assert moved > 5e-4
    assert far < 2 * moved**2
    assert far / near == pytest.approx(4, rel=0.05)


def truth_that_poses_identify(rng: np.random.Generator, arm: Arm, m: int) -> tuple[Chain, Array, Array, Array]:
    """Return a chain, configurations, payloads, and errors that are 0 but for those which these readings identify."""
    chain, q, held = elastic_chain(arm), configurations(rng, arm, m), half_loaded(m)
    points = chain.forward(q, payload=held).position + NOISE * rng.standard_normal((m, 3))
    fitted = calibrate(arm, readings(q, points, payload=held), joint_errors=chain.joint_errors).names
    errors = random_errors(rng, chain, 0.5)
    errors[sags(chain)] = SAG * rng.uniform(0.5, 1.0, sags(chain).sum())
    errors[[name not in fitted for name in chain.names]] = 0.0
    return chain, q, held, errors


@pytest.mark.share(0.02)
def test_intervals_cover(sample: Sample) -> None:
    """Of arms with random compliances about three axes, 90 % intervals have the truth in 85 to 95 % of the cases."""
    inside, count = 0, 0
    for rng in sample.cases(200):
        arm = heavy_arm(rng, 4)
        chain, q, held, errors = truth_that_poses_identify(rng, arm, 60)
        points = chain.forward(q, errors, payload=held).position + NOISE * rng.standard_normal((60, 3))
        found = calibrate(arm, readings(q, points, payload=held), joint_errors=chain.joint_errors)
        truth = dict(zip(chain.names, errors, strict=True))
        for name, (lower, upper) in zip(found.names, found.intervals(0.9), strict=True):
            if ".sag" in name and truth[name] != 0:
                inside, count = inside + (lower <= truth[name] <= upper), count + 1
    sample.record("compliances in their 90 % intervals", count, 0, coverage=float(inside / count))
    assert count > 3 * sample.count(200)
    # Three standard deviations of the share beside the band.
    slack = 0.0 if sample.whole else 3 * np.sqrt(0.09 / count)
    assert 0.85 - slack <= inside / count <= 0.95 + slack


def test_lateral_springs_are_found(rng: np.random.Generator) -> None:
    """Joints that yield sideways at rest are told from geometry by held-out points, with their compliance."""
    arm = heavy_arm(rng, 3)
    q, held = configurations(rng, arm, 50), half_loaded(50)
    compliance = SAG / largest_gravity_loads(arm).max() * np.ones((3, 3))
    at_rest = static_deflection(arm, compliance, q, payload=held)
    seen = readings(q, at_rest.tool[:, :3, 3] + NOISE * rng.standard_normal((50, 3)), payload=held)

    found = calibrate_nongeometric(arm, seen, folds=2)

    accepted = {one.name for one in found.comparisons if one.accepted}
    assert "lateral compliance under gravity" in accepted
    assert found.held_out.distance.mean() < 3 * NOISE < found.geometry.distance.mean()
    fitted = identified_compliance(found.calibration)
    sure = [(e.joint, e.axis) for e in found.calibration.chain.joint_errors if e.name in found.calibration.names]
    assert len(sure) >= 5
    near = configurations(rng, arm, 5)
    goals = static_deflection(arm, np.zeros((3, 3)), near).tool[:, :3, 3]
    there = inverse_calibrated(found.calibration, goals, near, payload=PAYLOAD)
    reached = static_deflection(arm, compliance, there.q, payload=PAYLOAD).tool[:, :3, 3]
    assert np.linalg.norm(reached - goals, axis=1).max() < 8 * NOISE
    assert fitted.max() == pytest.approx(compliance.max(), rel=0.5)


def test_told_apart_by_no_pose(rng: np.random.Generator) -> None:
    """A shoulder that tilts about both lateral axes alike looks like the elbow above it that yields: that is said."""
    arm = load_arm("puma560")
    chain, q = elastic_chain(arm), configurations(rng, arm, 80)

    points = chain.forward(q).position + NOISE * rng.standard_normal((80, 3))
    found = calibrate(arm, readings(q, points), joint_errors=chain.joint_errors)

    reasons = {parameter.name: parameter.reason for parameter in found.fixed}
    assert "joint1.sag_x" in reasons["joint1.sag_y"]
    assert "joint2.sag" in reasons["joint1.sag_y"]


def test_payload_of_a_table(tmp_path: Path) -> None:
    """A table says what the tool held; an empty cell is nothing, a centre needs a mass, and no mass is negative."""
    arm = load_arm("puma560")
    head, path = ",".join(f"joint_{i}_deg" for i in range(1, 7)), tmp_path / "points.csv"
    text = f"{head},x_mm,y_mm,z_mm,payload_kg,payload_z_mm\n1,2,3,4,5,6,400,10,20,2.5,100\n7,2,3,4,5,6,410,30,20,,\n"
    path.write_text(text, encoding="utf-8")

    measured: Readings = read_measurements(path, arm).readings

    np.testing.assert_allclose(measured.payload, [[2.5, 0, 0, 0.1], [0, 0, 0, 0]])
    for old, new, said in (
        ("2.5", "-1", "payload.*expected a mass of 0 kg or more, got -1 kg"),
        (",payload_kg", ",name", "payload_z is of the centre of mass of a payload"),
    ):
        path.write_text(text.replace(old, new), encoding="utf-8")
        with pytest.raises(FileFormatError, match=said):
            read_measurements(path, arm)


def test_repeatability_under_equal_payload(rng: np.random.Generator) -> None:
    """An arm that yields under a payload is no less repeatable for that."""
    q, held = np.tile(rng.uniform(-1, 1, 3), (20, 1)), half_loaded(20)
    points = np.outer(held[:, 0], (0, 0, -1e-3)) + 1e-5 * rng.standard_normal((20, 3))
    found = repeatability(readings(q, points, payload=held))
    assert found is not None
    assert found.configurations == 2
    assert found.floor < LENGTH / 10


def test_payloads_fit_the_readings(rng: np.random.Generator) -> None:
    """A payload is one for all readings or one for each."""
    q, points = rng.uniform(-1, 1, (5, 6)), rng.uniform(-1, 1, (5, 3))
    np.testing.assert_array_equal(readings(q, points, payload=PAYLOAD).payload, [PAYLOAD] * 5)
    with pytest.raises(ShapeError, match=r"payload: expected shape \(4,\) or \(5, 4\), got \(3,\)"):
        readings(q, points, payload=(1, 2, 3))
    with pytest.raises(ShapeError, match=r"payload: expected shape \(4,\) or \(5, 4\), got \(2, 4\)"):
        elastic_chain(load_arm("puma560")).forward(q, payload=np.zeros((2, 4)))
