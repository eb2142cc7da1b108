"""Data that contradict the model: what is refused, what is widened, and whether the intervals contain the truth."""

from collections.abc import Sequence

import attrs
import numpy as np
import pytest

from armwright.arrays import Array
from armwright.clearance.estimation.measurement_file import PathMeasurement, RestMeasurement
from armwright.clearance.estimation.misfit import CONTRADICTION, p_value, refuse_contradiction, widening
from armwright.clearance.estimation.posterior import sample_posterior
from armwright.clearance.estimation.static_estimate import estimate_at_rest, rest_offsets
from armwright.clearance.linkage import Linkage
from armwright.clearance.paths import named_path
from armwright.clearance.scenario import Scenario, prepare_scenario
from armwright.clearance.simulation import simulate
from armwright.errors import ContradictionError
from clearance.arms import ARM_A, CENTRE, PATHS, STARTS
from clearance.conftest import FEATURES, RANGE, Swept
from samples import Sample


def doubled(linkage: Linkage) -> Linkage:
    """The same with twice the payload."""
    return attrs.evolve(
        linkage, loads=tuple(attrs.evolve(load, force=2 * np.array(load.force)) for load in linkage.loads)
    )


def at_rest(poses: Array, offsets: Array) -> RestMeasurement:
    names = tuple(f"P{i}" for i in range(1, len(poses) + 1))
    return RestMeasurement(names=names, poses=poses, offsets=offsets, readings=(1,) * len(poses), noise=None)


def test_chance_and_widening() -> None:
    """Of three spare numbers 3 is as expected; 16.27 comes by chance once in a thousand, and widens by 2.33."""
    assert p_value(16.266, 3) == pytest.approx(1e-3, rel=1e-3)
    assert widening(16.266, 3) == pytest.approx(np.sqrt(16.266 / 3))
    assert widening(1.0, 3) == 1.0
    # Nothing to spare can contradict nothing; a noise of few numbers makes much likely.
    assert p_value(1e9, 0) == 1.0
    assert p_value(16.266, 3, 4) > 0.05


def test_refusal_names_what_is_far_off_and_what_is_at_a_bound() -> None:
    """Who is refused learns which numbers are off by how much, which parameters ran away, and what to check."""
    refuse_contradiction(CONTRADICTION, [], [])
    with pytest.raises(ContradictionError) as refused:
        refuse_contradiction(1e-9, [("a", 1.0), ("b", -7.0), ("c", 5.0), ("d", 0.1)], ["J2 at 0.5 mm"])

    message = str(refused.value)
    assert "the data contradict the model" in message
    assert "b by -7, c by +5, a by +1; at a bound: J2 at 0.5 mm; check the payload" in message


def test_bound_at_rest(five_bar: Linkage) -> None:
    """Offsets that would need a clearance below nothing leave it at nothing, and the others make up for it."""
    offsets = rest_offsets(five_bar, STARTS, (0.3e-3, 0.2e-3, 1e-7)) + np.array((2e-6, 0.0))

    estimate = estimate_at_rest(five_bar, STARTS, offsets, 2e-6)

    assert estimate.at_bound.tolist() == [False, False, True]
    assert estimate.identifiable(1e-3) == (True, True, False)
    # No other pair of the two that are left leaves less.
    for step in (1e-7, -1e-7):
        for pin in range(2):
            other = offsets - rest_offsets(five_bar, STARTS, estimate.values + step * np.eye(3)[pin])
            assert np.sum(other**2) > np.sum(estimate.residuals**2)


@pytest.mark.parametrize("fault", ["none", "noise understated", "sign", "swapped"])
@pytest.mark.drawn(0.34)
def test_attacked_at_rest(five_bar: Linkage, fault: str, sample: Sample) -> None:
    """Resting tips with a fault are refused, or their intervals grow; swapped columns yield no clearances."""
    identified = covered = refused = 0
    count = sample.count(300)
    for rng in sample.cases(300):
        c, k = rng.uniform(*RANGE, 3), int(rng.integers(3, 8))
        poses = np.column_stack([rng.uniform(-0.18, 0.18, k), rng.uniform(-0.7, -0.45, k)])
        noise = 10 ** rng.uniform(-6.0, -5.0)
        offsets = rest_offsets(five_bar, poses, c) + rng.normal(0.0, noise, poses.shape)
        offsets = {"sign": -offsets, "swapped": offsets[:, ::-1]}.get(fault, offsets)
        try:
            result = at_rest(poses, offsets).estimate(five_bar, noise / 3 if fault == "noise understated" else noise)
        except ContradictionError:
            refused += 1
            continue
        low, high = result.interval(0.9).T
        sure = np.array(result.identifiable(float(result.values.max())))
        identified, covered = identified + int(sure.sum()), covered + int((sure & (low <= c) & (c <= high)).sum())
    sample.record(
        f"resting tips, fault: {fault}", count, identified - covered, refused=refused, told=identified, held=covered
    )

    if fault in {"sign", "swapped"}:
        assert refused == count
    elif fault == "none":
        assert refused <= 1
        # Nine in ten; correlated within one arm.
        assert covered >= 0.8 * identified
    else:
        assert refused > 0.4 * count
        # Intervals that do not grow would hold the truth in less than half of all cases.
        assert identified < 60 or covered >= 0.5 * identified


def measured_on_paths(tasks: Sequence[Scenario], c: Array, noise: float, rng: np.random.Generator) -> PathMeasurement:
    times, errors = {}, {}
    for path, task in zip(PATHS, tasks, strict=True):
        run = simulate(task, c)
        times[path], errors[path] = run.time, run.error + noise * rng.standard_normal(run.error.shape)
    return PathMeasurement(times=times, errors=errors)


@pytest.mark.share(0.05)
@pytest.mark.parametrize("fault", ["payload", "sign", "swapped"])
@pytest.mark.drawn(0.25)
def test_attacked_on_paths(swept: Swept, five_bar: Linkage, fault: str, sample: Sample) -> None:
    """An arm whose columns are reversed is refused, one with twice the payload nearly always.

    Where chance lets it fit, no clearance at the end of the sweep is identified. Clearances that are fitted all the
    same lie there with no deviation at all.
    """
    count, refused = sample.count(20), 0
    heavy = doubled(five_bar)
    paths = PATHS if fault == "payload" else ()
    tasks = [prepare_scenario(heavy, named_path(path), CENTRE) for path in paths] or swept.task.tasks
    for rng in sample.cases(20):
        measured = measured_on_paths(tasks, rng.uniform(*RANGE, 3), 2e-6, rng)
        turned = {"sign": lambda x: -x, "swapped": lambda x: x[:, ::-1]}.get(fault, lambda x: x)
        measured = attrs.evolve(measured, errors={name: turned(curve) for name, curve in measured.errors.items()})
        features = measured.features()
        values = [float(getattr(features[path], feature)) for path in PATHS for feature in FEATURES]
        distribution = sample_posterior(
            swept.surrogate, values, measured.feature_covariance(swept.surrogate.features, 2e-6)
        )
        try:
            distribution.checked()
        except ContradictionError as error:
            refused += "the data contradict the model" in str(error)
        assert not any(distribution.identifiable[name] for name in distribution.bounds)
    assert refused == count or (fault == "payload" and (refused >= 0.5 * count or not sample.whole))
    sample.record(f"tips on paths, fault: {fault}", count, 0, refused=refused)


def test_beyond_the_sweep(swept: Swept, rng: np.random.Generator) -> None:
    """A clearance beyond the end of the sweep is not told with the deviation that the end makes small."""
    measured = measured_on_paths(swept.task.tasks, np.array((0.3e-3, 0.2e-3, 0.503e-3)), 2e-6, rng)
    features = measured.features()
    values = [float(getattr(features[path], feature)) for path in PATHS for feature in FEATURES]

    distribution = sample_posterior(
        swept.surrogate, values, measured.feature_covariance(swept.surrogate.features, 2e-6)
    )

    assert distribution.bounds == {"c_J4": 0.5e-3}
    assert distribution.identifiable["c_J4"] is False


def test_arm_of_the_model_is_not_refused(swept: Swept, rng: np.random.Generator) -> None:
    """Arm A on the paths of the sweep is explained, and its clearances lie within their intervals."""
    measured = measured_on_paths(swept.task.tasks, ARM_A, 2e-6, rng)
    features = measured.features()
    values = [float(getattr(features[path], feature)) for path in PATHS for feature in FEATURES]

    distribution = sample_posterior(
        swept.surrogate, values, measured.feature_covariance(swept.surrogate.features, 2e-6)
    ).checked()

    assert np.all(np.abs(distribution.mean - ARM_A) < 4 * distribution.deviations)
