"""The wear of a linkage as a result: what goes from its pins, what that does to the tip, and how long the tip is good.

Source:
    Spec of the life, 1; thesis, 6.2.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import attrs
import numpy as np
from scipy.special import ndtri

from armwright.arrays import Array, in_range, positive
from armwright.clearance.elastic_rod import refuse_rods
from armwright.clearance.linkage import Linkage
from armwright.clearance.paths import Path
from armwright.clearance.predictability import perturb_clearances, select_run
from armwright.clearance.scenario import prepare_scenario
from armwright.clearance.settings import Settings
from armwright.clearance.simulation import simulate
from armwright.clearance.wear.contact_history import simulated_contact
from armwright.clearance.wear.life import MAX_STEP, WearLife, wear_life
from armwright.clearance.wear.worn_stroke import Stroke, lean
from armwright.clearance.wear.worn_surfaces import WearLaw, mean_growth
from armwright.clearance.worn_walls import WornWalls
from armwright.errors import one_of
from armwright.files.result_table import ResultTable

# Of the steps of a simulation, so that no impact is missed [s]; and indistinguishable runs of it.
_SAMPLE, _RUNS = 1e-5, 8
# Quantiles of a normal deviate by name.
QUANTILES: Mapping[str, float] = {f"{100 * part:g} %": float(ndtri(part)) for part in (0.05, 0.5, 0.95)}
_DEPTHS = ("bearing_depth", "bearing_depth_error", "journal_depth", "journal_depth_error")
# Standard deviation of the logarithm of a wear coefficient of which something is known.
_WIDEST = 5.0
# Bins whose depth is less than this part of the deepest are not worn.
_WORN = 1e-3


class SimulatedWork(NamedTuple):
    """Force times sliding distance of a stroke, simulated with its impacts, beside that of the leaning stroke.

    Attributes:
        strokes: after which it was simulated.
        leaning: (p,) of the leaning stroke [N m].
        mean: (p,) over indistinguishable runs [N m].
        spread: (p,) their standard deviation [N m].
        impacts: (p,) mean number of impacts.
        peaks: (p,) mean of the largest forces [N].
    """

    strokes: float
    leaning: Array
    mean: Array
    spread: Array
    impacts: Array
    peaks: Array


@attrs.frozen(kw_only=True, eq=False)
class WearAssessment:
    """A life of a linkage, and how well it is known.

    Attributes:
        life: with the steps asked for.
        finer: the same strokes with steps of half the depth.
        simulated: strokes with their impacts, of the new linkage first.
        spread: standard deviation of the logarithm of the wear coefficient.
        limits: of ``AP``, ``RP`` and ``path`` [m].
    """

    life: WearLife
    finer: WearLife
    simulated: tuple[SimulatedWork, ...]
    spread: float
    limits: Mapping[str, float]

    @property
    def linkage(self) -> Linkage:
        """The new linkage."""
        return self.life.stroke.linkage

    def step_errors(self) -> dict[str, float]:
        """Return how far each measure at the end differs from that with half the steps [m]."""
        end = self.life.strokes[-1]
        finer = self.finer.measures()
        return {
            name: abs(float(values[-1] - np.interp(end, self.finer.strokes, finer[name][0])))
            for name, (values, _) in self.life.measures().items()
        }

    def lives(self) -> Iterator[tuple[str, float, dict[str, float], float]]:
        """Give for each limit its measure, the limit [m], strokes by quantile, and how far half the steps move them."""
        for name, limit in self.limits.items():
            middle, finer = self.life.strokes_to(name, limit), self.finer.strokes_to(name, limit)
            error = abs(middle - finer) if np.isfinite(middle) and np.isfinite(finer) else np.inf
            yield name, limit, {key: middle * float(np.exp(z * self.spread)) for key, z in QUANTILES.items()}, error

    def pins(self) -> Iterator[dict[str, Any]]:
        """Give what each pin carries and loses, in SI units."""
        last, finer, law = self.life.surfaces[-1], self.finer.surfaces[-1], self.life.law
        for i, pin in enumerate(self.linkage.pins):
            arc = 2 * np.pi * float((last.bearing[i] > _WORN * last.deepest()[i]).mean())
            work = self.life.work[0]
            yield {
                "pin": pin.name,
                "clearance": pin.clearance,
                "work": float(work[i]),
                "mean_growth": mean_growth(law.coefficient, float(work[i]), pin.journal_radius, arc, law.width)
                if arc
                else None,
                "bearing_depth": float(last.bearing[i].max()),
                "bearing_depth_error": abs(float(last.bearing[i].max() - finer.bearing[i].max())),
                "journal_depth": float(last.journal[i].max()),
                "journal_depth_error": abs(float(last.journal[i].max() - finer.journal[i].max())),
                "volume": float(self.life.volumes[-1, i]),
            }

    def impacts(self) -> Iterator[dict[str, Any]]:
        """Give each pin in each simulated stroke, beside the leaning stroke, in SI units."""
        for work in self.simulated:
            for i, pin in enumerate(self.linkage.pins):
                yield {
                    "strokes": work.strokes,
                    "pin": pin.name,
                    "leaning_work": float(work.leaning[i]),
                    "work": float(work.mean[i]),
                    "work_spread": float(work.spread[i]),
                    "impacts": float(work.impacts[i]),
                    "peak_force": float(work.peaks[i]),
                }

    def as_data(self) -> dict[str, Any]:
        """Return the life as plain data in SI units."""
        life, errors = self.life, self.step_errors()
        return {
            "linkage": self.linkage.name,
            "path": life.stroke.name,
            "wear_coefficient": life.law.coefficient,
            "wear_coefficient_spread": self.spread,
            "width": life.law.width,
            "bearing_share": life.law.bearing_share,
            "pressure": life.law.pressure,
            "pins": list(self.pins()),
            "simulated": list(self.impacts()),
            "strokes": life.strokes.tolist(),
            "errors": {
                name: {"values": values.tolist(), "test_spread": spread.tolist(), "step_error": errors[name]}
                for name, (values, spread) in life.measures().items()
            },
            "lives": [
                {
                    "measure": name,
                    "limit": limit,
                    "strokes": {key: n if np.isfinite(n) else None for key, n in quantiles.items()},
                    "step_error": error if np.isfinite(error) else None,
                }
                for name, limit, quantiles, error in self.lives()
            ],
            "volume_imbalance": life.volume_imbalance,
        }

    @property
    def notes(self) -> list[str]:
        """How the numbers are meant."""
        life = self.life
        last, law = life.strokes[-1], life.law
        notes = [
            f"AP and RP are those of the worst goal after {last:.4g} strokes, ± their scatter over tests of 30 visits",
            f"k = {law.coefficient * 1e9:.4g} mm³/(N m), its logarithm normal with standard deviation {self.spread:g}",
            "half steps: what a life with steps of half the depth changes; nothing worn is known better",
            f"volumes of the profiles are k times the work to {life.volume_imbalance:.1g}",
        ]
        notes += [
            f"{name} does not pass {limit * 1e3:g} mm within these strokes; take more --steps"
            for name, limit, quantiles, _ in self.lives()
            if not np.isfinite(quantiles["50 %"])
        ]
        return notes

    def tables(self) -> Iterator[ResultTable]:
        """Give the pins, their impacts, the errors of the tip, and the lives."""
        yield ResultTable(
            title="Pins",
            heads=(
                "pin", "F ds, leaning N m", "mean growth nm/stroke", "bearing mm", "± mm", "journal mm", "± mm",
            ),
            rows=[
                (
                    pin["pin"],
                    f"{pin['work']:.4f}",
                    f"{pin['mean_growth'] * 1e9:.3g}" if pin["mean_growth"] is not None else "",
                    *(f"{pin[name] * 1e3:.4f}" for name in _DEPTHS),
                )
                for pin in self.pins()
            ],
            numbers=range(1, 7),
        )  # fmt: skip
        yield ResultTable(
            title="Strokes with impacts",
            heads=("after strokes", "pin", "F ds, leaning N m", "simulated N m", "± N m", "impacts", "largest N"),
            rows=[
                (
                    f"{row['strokes']:.4g}",
                    row["pin"],
                    *(f"{row[name]:.4f}" for name in ("leaning_work", "work", "work_spread")),
                    f"{row['impacts']:.3g}",
                    f"{row['peak_force']:.4g}",
                )
                for row in self.impacts()
            ],
            numbers=(0, *range(2, 7)),
        )
        errors = self.step_errors()
        yield ResultTable(
            title="Tip",
            heads=("error", "new mm", "± mm", "worn mm", "± mm", "half steps mm"),
            rows=[
                (
                    name,
                    *(f"{x[k] * 1e3:.4f}" for k in (0, -1) for x in (values, spread)),
                    f"{errors[name] * 1e3:.4f}",
                )
                for name, (values, spread) in self.life.measures().items()
            ],
            numbers=range(1, 6),
        )
        yield ResultTable(
            title="Strokes to a limit",
            heads=("error", "limit mm", *QUANTILES, "half steps"),
            rows=[
                (name, f"{limit * 1e3:g}", *(f"{n:.3g}" for n in quantiles.values()), f"{error:.2g}")
                for name, limit, quantiles, error in self.lives()
            ],
            numbers=range(1, 6),
        )


def simulated_work(life: WearLife, path: Path, strokes: float) -> SimulatedWork:
    """Return force times sliding distance of a simulated stroke, over indistinguishable runs.

    Args:
        life: of the linkage.
        path: of its strokes.
        strokes: of the life that come before.

    Raises:
        InvalidValueError: see ``WearLife.surfaces_after``, ``simulate`` and ``simulated_contact``.
    """
    linkage, surfaces = life.stroke.linkage, life.surfaces_after(strokes)
    worn = WornWalls.of(linkage, surfaces.bearing, surfaces.journal) if strokes > 0 else None
    scenario = prepare_scenario(linkage, path, Settings(sample=min(_SAMPLE, path.duration / 100), step=_SAMPLE))
    runs = simulate(scenario, perturb_clearances(linkage.clearance_array(None), _RUNS - 1), worn=worn)
    works = np.array([simulated_contact(select_run(runs, k)).work for k in range(_RUNS)])
    return SimulatedWork(
        strokes=strokes,
        leaning=lean(life.stroke, life.law, surfaces).history.work,
        mean=works.mean(axis=0),
        spread=works.std(axis=0, ddof=1),
        impacts=runs.impacts.mean(axis=0),
        peaks=runs.peaks.mean(axis=0),
    )


def assess_wear(
    linkage: Linkage,
    path: Path,
    law: WearLaw,
    *,
    spread: float = 0.5,
    limits: Mapping[str, float] | None = None,
    steps: int = 20,
    max_step: float = MAX_STEP,
    simulate_after: Sequence[float] = (),
    progress: Callable[[int, int], None] | None = None,
) -> WearAssessment:
    """Wear a linkage along a path, with the errors of all numbers.

    Args:
        linkage: new.
        path: of a stroke.
        law: of the wear.
        spread: standard deviation of the logarithm of the wear coefficient.
        limits: of ``AP``, ``RP`` and ``path`` [m].
        steps: of the life.
        max_step: the largest depth of a step, as a part of the clearance of its pin.
        simulate_after: strokes of the life after which one is simulated with its impacts, beside the first and last.
        progress: called with the number of steps made, and of all.

    Raises:
        InvalidValueError: a body is elastic, or see ``wear_life`` and ``simulated_work``.
        UnknownNameError: there is no such measure.
    """
    refuse_rods("wear", linkage.rods)
    in_range(spread, (0.0, _WIDEST), "spread of the wear coefficient")
    for name, limit in (limits or {}).items():
        positive(limit, f"limit of {one_of('measure', name, ('AP', 'RP', 'path'))}", "m")
    stroke, total = Stroke.of(linkage, path), 3 * steps

    def after(done: int) -> Callable[[int, int], None] | None:
        return None if progress is None else lambda step, _: progress(min(done + step, total), total)

    life = wear_life(stroke, law, steps=steps, max_step=max_step, progress=after(0))
    end = float(life.strokes[-1])
    simulated = tuple(simulated_work(life, path, strokes) for strokes in sorted({0.0, *simulate_after, end}))
    finer = wear_life(stroke, law, steps=4 * steps, max_step=max_step / 2, until=end, progress=after(steps))
    return WearAssessment(life=life, finer=finer, simulated=simulated, spread=spread, limits=limits or {})
