"""What makes a calibration doubtful though its fit looks good: outliers that share a joint, errors beyond belief.

A joint whose encoder turns another one too (q3 = a2 q2 + q3, as on palletisers), one in other units or of the other
sign, makes readings outliers as soon as it moves. A robust fit then drops all of them and is sure of the rest.
"""

from collections.abc import Iterator

import numpy as np
from scipy.stats import chi2, mannwhitneyu

from armwright.calibration.fitting import CHECK, PRIOR_SIGMA_ANGLE, PRIOR_SIGMA_LENGTH, Calibration
from armwright.calibration.readings import Readings
from armwright.errors import InvalidValueError

# Outliers share a joint, or readings are too far off, when chance does it less often; so many outliers are looked at,
# and so large a part of all is too many.
_CHANCE, _FEWEST, _MANY = 1e-4, 5, 0.2
# Errors of a link that are larger than what is believed by this factor are no errors of a link.
_BEYOND = 3.0


def contradictions(found: Calibration, seen: Readings, noise: float | None = None) -> Iterator[str]:
    """Say what is doubtful of a calibration.

    Args:
        found: the calibration.
        seen: the readings that it was fitted to.
        noise: standard deviation of a measured coordinate or distance, if it is stated [m].

    Raises:
        InvalidValueError: the noise is not above 0.
    """
    out = np.zeros(len(seen), dtype=np.bool_)
    out[list(found.outliers)] = True
    shared = [] if out.sum() < _FEWEST or (~out).sum() < _FEWEST else _shared(seen.q, out)
    if shared:
        names = " and ".join(f"joint {i + 1}" for i in shared)
        yield (
            f"the {int(out.sum())} readings that do not count are those in which {names} is elsewhere "
            f"than in the {int((~out).sum())} that do; what is left says nothing of it: {CHECK}"
        )
    elif out.mean() > _MANY:
        yield (
            f"{int(out.sum())} of {len(seen)} readings do not count, and a fit that leaves out so many "
            f"praises the rest: {CHECK}"
        )
    lengths = dict(zip(found.model.names, found.model.is_length, strict=True))
    far = [
        f"{name} {value * 1e3:+.3g} {'mm' if lengths[name] else 'mrad'}"
        for name, value in zip(found.names, found.values, strict=True)
        if name.startswith("joint")
        and abs(value) > _BEYOND * (PRIOR_SIGMA_LENGTH if lengths[name] else PRIOR_SIGMA_ANGLE)
    ]
    if far:
        yield f"{', '.join(far)}: no link is made so badly; {CHECK}"

    if noise is not None:
        yield from _too_far(found, seen, noise)


def refuse_noise(noise: float) -> None:
    """Refuse a noise that no instrument has.

    Raises:
        InvalidValueError: it is not a finite number above 0.
    """
    if not 0 < noise < np.inf:
        raise InvalidValueError(f"noise: expected a standard deviation above 0, got {noise:g}")


def _too_far(found: Calibration, seen: Readings, noise: float) -> Iterator[str]:
    """Say if what is left is more than the noise that is stated makes of it."""
    refuse_noise(noise)
    rows = found.model.rows(seen, found.errors)
    # Of the numbers that are to spare lengths have their share.
    freedom = max(1.0, found.freedom * float(np.mean(~rows.turning)))
    by_chance = float(chi2.sf(freedom * (found.noise.length / noise) ** 2, freedom))
    if by_chance < _CHANCE:
        yield (
            f"what is left is {found.noise.length * 1e3:.3g} mm per coordinate, {found.noise.length / noise:.3g} times "
            f"the {noise * 1e3:.3g} mm that are stated, which comes by chance in {100 * by_chance:.2g} % of cases: the "
            f"geometry of this arm does not explain the readings; --beyond tries what else may"
        )


def _shared(q: np.ndarray, out: np.ndarray) -> list[int]:
    """Return the joint, from 0, by which outliers differ most from the others, if chance does not do that."""
    joints = [i for i in range(q.shape[1]) if np.ptp(q[:, i]) > 0]
    by_chance = []
    for i in joints:
        away = np.abs(q[:, i] - np.median(q[~out, i]))
        by_chance.append(float(mannwhitneyu(away[out], away[~out], alternative="greater").pvalue))
    if not joints or min(by_chance) * len(joints) > _CHANCE:
        return []
    return [joints[int(np.argmin(by_chance))]]
