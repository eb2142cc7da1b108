"""What makes a calibration doubtful though its fit looks good: outliers that share a joint, errors beyond belief.

A joint whose encoder turns another one too (q3 = a2 q2 + q3, as on palletisers), one in other units or of the other
sign, makes readings outliers as soon as it moves. A robust fit then drops all of them and is sure of the rest.
"""

from collections.abc import Iterator

import numpy as np
from scipy.stats import mannwhitneyu

from armwright.calibration.fitting import BELIEVED_ANGLE, BELIEVED_LENGTH, Calibration
from armwright.calibration.readings import Readings

# Outliers share a joint when chance does it less often, and there are so many; so large a part of all is too many.
_CHANCE, _FEWEST, _MANY = 1e-4, 5, 0.2
# Errors of a link that are larger than what is believed by this factor are no errors of a link.
_BEYOND = 3.0
_CHECK = (
    "check the units, the sign and the zero of the joint, the order of the columns, and whether a joint is coupled to "
    "another (q3 = a2 q2 + q3, as on palletisers), which arm files cannot say"
)


def doubts(found: Calibration, seen: Readings) -> Iterator[str]:
    """Say what is doubtful of a calibration.

    Args:
        found: the calibration.
        seen: the readings that it was fitted to.
    """
    out = np.zeros(len(seen), dtype=np.bool_)
    out[list(found.outliers)] = True
    shared = [] if out.sum() < _FEWEST or (~out).sum() < _FEWEST else _shared(seen.q, out)
    if shared:
        names = " and ".join(f"joint {i + 1}" for i in shared)
        yield (
            f"DOUBTFUL: the {int(out.sum())} readings that do not count are those in which {names} is elsewhere "
            f"than in the {int((~out).sum())} that do; what is left says nothing of it: {_CHECK}"
        )
    elif out.mean() > _MANY:
        yield (
            f"DOUBTFUL: {int(out.sum())} of {len(seen)} readings do not count, and a fit that leaves out so many "
            f"praises the rest: {_CHECK}"
        )
    lengths = dict(zip(found.model.names, found.model.is_length, strict=True))
    far = [
        f"{name} {value * 1e3:+.3g} {'mm' if lengths[name] else 'mrad'}"
        for name, value in zip(found.names, found.values, strict=True)
        if name.startswith("joint") and abs(value) > _BEYOND * (BELIEVED_LENGTH if lengths[name] else BELIEVED_ANGLE)
    ]
    if far:
        yield f"DOUBTFUL: {', '.join(far)}: no link is made so badly; {_CHECK}"


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
