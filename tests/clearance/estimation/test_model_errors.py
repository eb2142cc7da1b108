"""Which wrong models a resting tip contradicts: those that are said to be seen are refused, the others are not."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binom

from armwright.arrays import Array
from armwright.clearance.estimation.measurement_file import RestMeasurement
from armwright.clearance.estimation.model_errors import POWER, error_kinds, model_errors, resting_tips
from armwright.clearance.estimation.static_estimate import estimate_at_rest, rest_offsets
from armwright.clearance.linkage import Linkage
from armwright.clearance.poses import closed_at_tips
from armwright.errors import ContradictionError
from clearance.arms import ARM_A, STARTS
from clearance.conftest import RANGE
from cli_calls import armwright
from samples import Sample

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

EXAMPLE = Path(__file__).parents[3] / "examples" / "five_bar_rest.csv"
# Up to here a fault is small enough that its shift of the tip is proportional to it.
SMALL = {"1": 0.5, "m": 2e-3, "rad": 5e-3}
NOISE = 1e-6


def offsets_of_wrong_model(linkage: Linkage, poses: Array, c: Array, name: str, amount: float) -> Array:
    """The offsets (k, 2) of the resting tip of an arm that exceeds its model by an amount of a model error."""
    kind = next(kind for kind in error_kinds(linkage) if kind.name == name)
    change = amount / kind.size
    tips = resting_tips(kind.changed(change), linkage, closed_at_tips(linkage, poses), change * kind.zeros, c)
    return tips - poses


def is_refused(linkage: Linkage, poses: Array, offsets: Array, noise: float) -> bool:
    """Whether readings with this noise contradict the model."""
    names = tuple(f"P{i}" for i in range(len(poses)))
    try:
        RestMeasurement(names=names, poses=poses, offsets=offsets, readings=(1,) * len(poses), noise=None).estimate(
            linkage, noise
        )
    except ContradictionError:
        return True
    return False


@pytest.mark.share(0.014)
def test_what_is_said_to_be_seen_is_refused(five_bar: Linkage, sample: Sample) -> None:
    """Readings of an arm whose model has the detectable error are refused nine times of ten, a fifth of it hardly."""
    count, refused, little = 0, 0, 0
    for rng in sample.cases(300):
        c, k = rng.uniform(*RANGE, 3), int(rng.integers(4, 9))
        poses = np.column_stack([rng.uniform(-0.18, 0.18, k), rng.uniform(-0.7, -0.45, k)])
        estimate = estimate_at_rest(five_bar, poses, rest_offsets(five_bar, poses, c), NOISE)
        detectable = [
            error for error in model_errors(five_bar, poses, estimate) if error.detectable_from < SMALL[error.unit]
        ]
        # Load and masses, lengths, zeros: none is left out because others are more.
        kind = rng.choice(sorted({error.unit for error in detectable}))
        error = rng.choice(np.array([i for i, fault in enumerate(detectable) if fault.unit == kind]))
        noise = rng.normal(0.0, NOISE, poses.shape)
        offsets = [
            offsets_of_wrong_model(five_bar, poses, c, detectable[error].name, part * detectable[error].detectable_from)
            for part in (1.0, 0.2)
        ]
        count += 1
        refused += is_refused(five_bar, poses, offsets[0] + noise, NOISE)
        little += is_refused(five_bar, poses, offsets[1] + noise, NOISE)
    sample.record("wrong models at rest of the size told as seen that are not refused", count, count - refused)

    # Once in a million samples by chance; a fifth is refused in less than one of a hundred.
    assert binom.cdf(refused, count, POWER) > 1e-6
    assert binom.sf(refused - 1, count, POWER) > 1e-6
    assert binom.sf(little - 1, count, 0.01) > 1e-6


def test_shifts_of_clearances(five_bar: Linkage) -> None:
    """A model that is wrong by a little shifts the clearances by the reported amount."""
    estimate = estimate_at_rest(five_bar, STARTS, rest_offsets(five_bar, STARTS, ARM_A), NOISE)
    usual = {"1": 0.05, "m": 5e-5, "rad": 2e-4}

    for error in model_errors(five_bar, STARTS, estimate):
        amount = usual[error.unit]
        offsets = offsets_of_wrong_model(five_bar, STARTS, ARM_A, error.name, amount)
        shifted = estimate_at_rest(five_bar, STARTS, offsets, NOISE).values - ARM_A
        np.testing.assert_allclose(shifted, amount * error.shifts, rtol=0.1, atol=2e-7, err_msg=error.name)


def test_play_and_length_look_alike(five_bar: Linkage) -> None:
    """A rod that is too long has the effect of clearance in its pin: it is hardly detectable, and shifts J2 as much."""
    estimate = estimate_at_rest(five_bar, STARTS, rest_offsets(five_bar, STARTS, ARM_A), NOISE)
    by_name = {error.name: error for error in model_errors(five_bar, STARTS, estimate)}

    rod, crank = by_name["length of link2"], by_name["length of link1"]
    assert 0.9 < abs(rod.shifts[0]) < 1.3
    assert crank.detectable_from < 0.1 * rod.detectable_from
    # The cranks are held: their masses press on no pin with play.
    assert not {"mass of link1", "mass of link4"} & set(by_name)


def test_nothing_contradicts(five_bar: Linkage) -> None:
    """Without numbers to spare, or without a known noise, no wrong model is ever seen."""
    for poses, known in ((STARTS[:2], True), (STARTS, False)):
        estimate = estimate_at_rest(five_bar, poses, rest_offsets(five_bar, poses, ARM_A), NOISE)
        errors = model_errors(five_bar, poses, estimate, noise_is_known=known)
        assert all(np.isinf(error.detectable_from) for error in errors) == (
            not known or estimate.degrees_of_freedom < 1
        )


def test_told_by_the_command() -> None:
    """An estimate at rest says what its readings would contradict, as a table and as data."""
    text = armwright("clearance", "estimate", "five-bar", EXAMPLE, "--friction", "0", columns=120).stdout
    errors = json.loads(armwright("clearance", "estimate", "five-bar", EXAMPLE, "--json").stdout)["model_errors"]

    lines = {line.split("  ")[0].strip(): line for line in text.splitlines()}
    assert "beyond 100 %" in lines["load at link3:J3"]
    assert "0.1 mm" in lines["length of link2"]
    assert "Smaller errors are taken for clearance: they shift the estimates in proportion" in " ".join(text.split())
    assert "friction, which may hold journals beside their assumed positions, is left out" in " ".join(text.split())
    by_name = {error["name"]: error for error in errors}
    assert by_name["load at link3:J3"]["unit"] == "1"
    assert set(by_name["zero of link1"]["shifts"]) == {"J2", "J3", "J4"}
