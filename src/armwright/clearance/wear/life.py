"""The life of a linkage whose pins wear: profiles and errors of the tip over strokes, extrapolated with error control.

A stroke takes so little that many are alike: the growth of one is multiplied by A. A is as large as the depth of a step
may be a part of the clearance. Within a step a pressed bin gives way as it wears, which the foundation takes in as
additional compliance; without it the pressure would leap from bin to bin. Both errors are of first order in A: the same
life with steps of half the depth tells how large they are.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import islice
from typing import NamedTuple

import attrs
import numpy as np

from armwright.arrays import Array, integer, not_negative, positive
from armwright.clearance.wear.worn_stroke import Stroke, lean, lean_new, leaning_growth, peak_pressures, tip_errors
from armwright.clearance.wear.worn_surfaces import BROKEN, WearLaw, WornSurfaces, surfaces_between, wearing_clearances
from armwright.errors import InvalidValueError

# A step takes at most this part of the clearance of a pin.
MAX_STEP = 0.02
# Steps of a life at most; a step is made anew until the compliance of its wear is right to about this part.
_MAX_STEPS, _RIGHT, _ROUGHLY, _TRIES = 2000, 0.03, 0.15, 12


@attrs.frozen(kw_only=True, eq=False)
class WearLife:
    """A life in n steps, with n + 1 states from new on; the pins are p, the goals g.

    Attributes:
        stroke: of the linkage.
        law: of the wear.
        strokes: (n + 1,) done at each state.
        surfaces: (n + 1) worn.
        work: (n, p) force times sliding distance of a stroke in each step [N m].
        volumes: (n + 1, p) taken from both surfaces of each pin: k times the force times sliding distance [m³].
        accuracy: (n + 1, t, g) AP at each state, goal and test [m].
        repeatability: (n + 1, t, g) RP likewise [m].
        path: (n + 1, s) error of the tip along the path [m].
    """

    stroke: Stroke
    law: WearLaw
    strokes: Array
    surfaces: tuple[WornSurfaces, ...]
    work: Array
    volumes: Array
    accuracy: Array
    repeatability: Array
    path: Array

    @property
    def volume_imbalance(self) -> float:
        """Largest difference of the volume of the profiles from k times the work, as a part of it."""
        worst = 0.0
        for surface, volume in zip(self.surfaces[1:], self.volumes[1:], strict=True):
            for i, pin in enumerate(self.stroke.linkage.pins):
                area = self.law.bin_area(pin.journal_radius)
                taken = area * float(surface.bearing[i].sum() + surface.journal[i].sum())
                worst = max(worst, abs(taken - volume[i]) / max(float(volume[i]), np.finfo(float).tiny))
        return worst

    def measures(self) -> dict[str, tuple[Array, Array]]:
        """Return (n + 1,) the errors of the worst goal or moment [m], and their standard deviations over tests."""
        worst = {"AP": self.accuracy.max(axis=-1), "RP": self.repeatability.max(axis=-1)}
        tested = {name: (x.mean(axis=-1), x.std(axis=-1, ddof=1)) for name, x in worst.items()}
        return {**tested, "path": (self.path.max(axis=-1), np.zeros(len(self.path)))}

    def surfaces_after(self, strokes: float) -> WornSurfaces:
        """Return the surfaces after strokes of the life, between whose states depths grow evenly.

        Raises:
            InvalidValueError: the life does not last so long.
        """
        end = float(self.strokes[-1])
        if not_negative(strokes, "strokes") > end:
            raise InvalidValueError(f"strokes: expected at most {end:.4g}, which the life lasts, got {strokes:g}")
        return surfaces_between(self.strokes, self.surfaces, strokes)

    def strokes_to(self, measure: str, limit: float) -> float:
        """Return the strokes after which a measure passes a limit [m]; 0 for a new linkage beyond it, else infinite."""
        values = self.measures()[measure][0]
        over = np.flatnonzero(values > limit)
        if not len(over):
            return np.inf
        k = int(over[0])
        if k == 0:
            return 0.0
        part = (limit - values[k - 1]) / (values[k] - values[k - 1])
        return float(self.strokes[k - 1] + part * (self.strokes[k] - self.strokes[k - 1]))


def wear_life(
    stroke: Stroke,
    law: WearLaw,
    *,
    steps: int = 20,
    max_step: float = MAX_STEP,
    until: float = np.inf,
    progress: Callable[[int, int], None] | None = None,
) -> WearLife:
    """Wear a linkage stroke by stroke, many at a time.

    Args:
        stroke: of the linkage.
        law: of the wear.
        steps: how often the strokes of a step are added, at most.
        max_step: the largest depth of a step, as a part of the clearance of its pin.
        until: strokes after which the life ends.
        progress: called with the number of steps made, and of all.

    Raises:
        InvalidValueError: a number is out of its range, nothing slides, or the pins break.
    """
    if integer(steps, "steps", least=1) > _MAX_STEPS:
        raise InvalidValueError(f"steps: expected at most {_MAX_STEPS}, got {steps}")
    wearing_clearances(stroke.linkage)
    surfaces = WornSurfaces.new(len(stroke.linkage.pins), law.bins)
    states, strokes, works, volumes = [surfaces], [0.0], [], [np.zeros(len(stroke.linkage.pins))]
    errors = [tip_errors(stroke, law, surfaces)]
    for step, worn in enumerate(islice(worn_steps(stroke, law, max_step=max_step, until=until), steps), 1):
        works.append(worn.work)
        volumes.append(volumes[-1] + worn.made * law.coefficient * works[-1])
        strokes.append(worn.strokes)
        states.append(worn.surfaces)
        errors.append(tip_errors(stroke, law, worn.surfaces))
        if progress is not None:
            progress(step, steps)
    return WearLife(
        stroke=stroke,
        law=law,
        strokes=np.array(strokes),
        surfaces=tuple(states),
        work=np.array(works),
        volumes=np.array(volumes),
        accuracy=np.stack([x.accuracy for x in errors]),
        repeatability=np.stack([x.repeatability for x in errors]),
        path=np.stack([x.path for x in errors]),
    )


class WornStep(NamedTuple):
    """What a step of a life leaves.

    Attributes:
        strokes: done after it.
        made: number of its strokes.
        surfaces: worn.
        work: (p,) force times sliding distance of one of its strokes [N m].
    """

    strokes: float
    made: float
    surfaces: WornSurfaces
    work: Array


def worn_steps(
    stroke: Stroke,
    law: WearLaw,
    *,
    max_step: float = MAX_STEP,
    growing: float = 0.0,
    factors: Array | None = None,
    until: float = np.inf,
    rough: bool = False,
) -> Iterator[WornStep]:
    """Wear a linkage step by step.

    Args:
        stroke: of the linkage.
        law: of the wear.
        max_step: the largest depth of a step, as a part of the clearance of its pin.
        growing: part of the depth that is worn already, which a step may take if that is more.
        factors: (p,) of the wear coefficient of each pin; 1 when left out.
        until: strokes after which the last step ends.
        rough: forces are those without clearance, and the compliance of the wear of a step is right to a sixth; the
            growth of a clearance differs by about a hundredth, and takes a quarter of the time.

    Raises:
        InvalidValueError: a number is out of its range, nothing slides, or the pins break.
    """
    linkage = stroke.linkage
    least = positive(max_step, "max_step") * wearing_clearances(linkage)
    radii = np.array([pin.journal_radius for pin in linkage.pins])
    rates = np.ones(len(radii)) if factors is None else factors
    surfaces, strokes, depth = WornSurfaces.new(len(radii), law.bins), 0.0, least
    softening = depth / peak_pressures(law, linkage, lean_new(stroke, law))
    while strokes < until:
        before, depth = depth, np.maximum(least, growing * surfaces.deepest())
        softening *= depth / before
        count, growth, work, softening = _step(
            stroke, law, surfaces, depth, softening, rates=rates, remaining=until - strokes, rough=rough
        )
        surfaces = surfaces.plus(growth, count)
        if np.any(surfaces.deepest() > BROKEN * radii):
            raise InvalidValueError(f"{linkage.name}: after {strokes + count:.3g} strokes a pin is worn through")
        strokes += count
        yield WornStep(strokes, count, surfaces, work)


def _step(
    stroke: Stroke,
    law: WearLaw,
    surfaces: WornSurfaces,
    depth: Array,
    softening: Array,
    *,
    rates: Array,
    remaining: float,
    rough: bool,
) -> tuple[float, WornSurfaces, Array, Array]:
    """Return strokes, growth and work by stroke of a step, and the compliance of its wear.

    Args:
        stroke: of the linkage.
        law: of the wear.
        surfaces: before the step.
        depth: (p,) that the step may take [m].
        softening: (p,) a compliance to begin with [m³/N].
        rates: (p,) factors of the wear coefficient.
        remaining: strokes at most.
        rough: see ``worn_steps``.
    """
    right, rounds = (_ROUGHLY, {"rounds": 1}) if rough else (_RIGHT, {})
    for _ in range(_TRIES):
        leaning = lean(stroke, law, surfaces, softening=softening, **rounds)
        taken = leaning_growth(law, stroke.linkage, leaning)
        growth = WornSurfaces.new(len(rates), law.bins).plus(taken, rates[:, None])
        count = min(float((depth / growth.deepest()).min()), remaining)
        given_way = count * growth.deepest() / peak_pressures(law, stroke.linkage, leaning)
        if np.all(np.abs(np.log(given_way / softening)) < right):
            break
        # Pressure falls about with the root of the compliance; this finds the compliance soon.
        softening = given_way**1.5 / softening**0.5
    return count, growth, leaning.history.work, softening
