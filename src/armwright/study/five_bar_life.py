"""The life of the thesis' five-bar: what section 6.2 of the thesis leaves to future work, point by point.

The thesis proposes to check the model against another program (1), to look for paths with little vibration (2), to add
elastic rods and tolerances (3) and wear (4), and to derive rules of reliability (5) and a strategy for a long time at
high accuracy (6) from them. Its arms A and B have the same repeatability and different clearances; here they wear.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Any, ClassVar, NamedTuple

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.clearance.dimensions import dimensions_of
from armwright.clearance.elastic_rod import Elasticity
from armwright.clearance.linkage import Linkage
from armwright.clearance.maintenance.assessment import CheckPlan, plan_checks
from armwright.clearance.maintenance.belief import WearPrior
from armwright.clearance.maintenance.maintained_linkage import maintained_linkage
from armwright.clearance.maintenance.strategy import Strategy
from armwright.clearance.paths import TEST_PATHS, named_path
from armwright.clearance.poses import closed_at
from armwright.clearance.reader import load_linkage
from armwright.clearance.static_equilibrium import find_static_equilibrium
from armwright.clearance.vibration.assessment import RattlingAssessment, assess_rattling
from armwright.clearance.wear.worn_surfaces import WearLaw
from armwright.errors import counted
from armwright.files.result_table import ResultTable
from armwright.reliability.assessment import ToleranceAssessment
from armwright.reliability.linkage_assessment import LinkageReliability, WearStatement, assess_linkage
from armwright.reliability.linkage_errors import RandomClearances
from armwright.reliability.tip_errors import assess_linkage_tolerances
from armwright.reliability.tolerances import Tolerance
from armwright.report.elements import Tile
from armwright.report.figures import Drawing, bar_chart, empty_figure, plain_axes, svg_text
from armwright.study.five_bar_clearance import ARMS

# The three goals of the thesis' task [m].
GOALS = ((-0.18, -0.6), (0.0, -0.575), (0.18, -0.6))
# Rods of steel with a solid square section of their mass: area [m²] and second moment of area [m⁴].
RODS = {"link2": (1.5678e-4, 2.0483e-9), "link3": (1.5678e-4, 2.0483e-9)}
# Assumed tolerances by kind: of clearances, lengths and the place of the tip [m], of zeros of the drives [rad].
TOLERANCES = {"clearance": 0.03e-3, "length": 0.03e-3, "tool": 0.01e-3, "zero": np.radians(0.005)}
# Assumed wear: k of boundary lubricated steel differs by powers of ten; its median here, and the spread of its log.
COEFFICIENT, SPREAD = 1e-5 * 1e-9, 0.5
# A spread of the clearances of arms that are built alike [m], and what is asked of them: AP and RP [m].
CLEARANCE_SPREAD, LIMITS = 0.01e-3, (1.0e-3, 0.06e-3)
# The plan: error of the corrected path [m], probability at which a check is due, and strokes that are planned.
PLAN_LIMIT, ALPHA, HORIZON = 0.1e-3, 0.05, 1e8
_QUANTILES = (0.05, 0.1, 0.5)


class BudgetRow(NamedTuple):
    """One cause of error of arm A at the three goals.

    Attributes:
        cause: of the error.
        errors: (3,) of the tip [m].
    """

    cause: str
    errors: Array


@attrs.frozen(kw_only=True, eq=False)
class FiveBarLife:
    """A life of the thesis' arms.

    Attributes:
        rattling: on the paths, with the thesis' clearance of half a millimetre.
        budget: causes of error of arm A at the goals.
        tolerances: of arm A, its path corrected.
        arms: reliability of A and B, and their lives.
        plan: of the checks of arm A.
    """

    rattling: RattlingAssessment
    budget: list[BudgetRow]
    tolerances: ToleranceAssessment
    arms: dict[str, LinkageReliability]
    plan: CheckPlan

    title: ClassVar[str] = "wear, tolerances, elasticity, reliability and maintenance of a five-bar (thesis, 6.2)"

    @property
    def notes(self) -> tuple[str, ...]:
        """What is assumed."""
        k = (
            f"assumed: wear coefficient {COEFFICIENT * 1e9:g} mm³/(N m), sd of its logarithm {SPREAD:g}; strokes are "
            "inversely proportional to it"
        )
        return (
            "6.2-1, the model beside another program: armwright study linkage-simulators, armwright clearance export",
            k,
            "assumed: tolerances of 0.03 mm of clearances and lengths, 0.01 mm of the tip, 0.005 deg of zeros",
        )

    @classmethod
    def run(
        cls,
        progress: Callable[[str, float], None] | None = None,
        *,
        paths: Iterable[str] = TEST_PATHS,
        steps: int = 30,
        lives: int = 20,
        samples: int = 200,
    ) -> FiveBarLife:
        """Run the study, which takes two minutes.

        Args:
            progress: called with the current task and the finished part of it, 0 to 1.
            paths: that are ranked.
            steps: of the worn walls.
            lives: simulated, of each way of maintenance.
            samples: random linkages, in full equilibrium.
        """
        report = progress or (lambda _task, _part: None)
        linkage = load_linkage("five-bar")
        names = list(paths)
        task = f"rattling on {len(names)} paths"
        report(task, 0.0)
        rattling = assess_rattling(
            linkage,
            [named_path(name) for name in names],
            linkage.clearance_array(None),
            progress=lambda done, every: report(task, done / every),
        )
        arm = _arm(linkage, "A")
        report("tolerances", 0.0)
        tolerances = assess_linkage_tolerances(
            arm,
            GOALS,
            [
                Tolerance(name=each.name, half_width=TOLERANCES[each.kind], unit=each.unit)
                for each in dimensions_of(arm)
                if each.kind in TOLERANCES
            ],
            corrected=True,
            limit=PLAN_LIMIT,
            samples=samples,
        )
        budget = _budget(arm, tolerances)
        report("tolerances", 1.0)
        arms = {}
        for k, name in enumerate(ARMS):
            report("lives", k / len(ARMS))
            arms[name] = _reliability(_arm(linkage, name), steps, samples)
        report("lives", 1.0)
        plan = _plan(arm, lives, report)
        report("simulated lives", 1.0)
        return cls(rattling=rattling, budget=budget, tolerances=tolerances, arms=arms, plan=plan)

    def as_data(self) -> dict[str, Any]:
        """Return the points of section 6.2 as plain data in SI units."""
        return {
            "6.2-2": self.rattling.as_data(),
            "6.2-3": {
                "budget": {row.cause: row.errors.tolist() for row in self.budget},
                "tolerances": self.tolerances.as_data(),
            },
            "6.2-4 and 5": {name: arm.as_data() for name, arm in self.arms.items()},
            "6.2-6": self.plan.as_data(),
        }

    def tables(self) -> Iterator[ResultTable]:
        """Yield a table for each point."""
        yield self._path_table()
        yield ResultTable(
            title="6.2-3: causes of error of arm A at rest [mm]",
            heads=("cause", "Q1", "Q2", "Q3"),
            rows=[(row.cause, *(f"{x * 1e3:.4f}" for x in row.errors)) for row in self.budget],
            numbers=(1, 2, 3),
        )
        yield ResultTable(
            title="6.2-3: which tolerances count, path corrected for the mean clearances",
            heads=("dimension", "tolerance", "share of the variance, %"),
            rows=[
                (
                    self.tolerances.tolerances[i].name,
                    "±{:g} {}".format(*self.tolerances.tolerances[i].displayed),
                    f"{100 * self.tolerances.error.shares[self.tolerances.worst_pose, i]:.1f}",
                )
                for i in self.tolerances.ranking
            ],
            numbers=(2,),
        )
        yield self._wear_table()
        yield self._rule_table()
        yield self._plan_table()

    def _path_table(self) -> ResultTable:
        rows = []
        for number, ranked in enumerate(self.rattling.ranking(), 1):
            dwell = ranked.rattling.totals["dwell-rms"]
            rows.append(
                (
                    str(number),
                    ranked.rattling.path.name,
                    *(f"{x * 1e3:.2f}" for x in (ranked.mean, ranked.spread)),
                    *(f"{x:.1f}" for x in (dwell.mean(), dwell.std(ddof=1))),
                    ", ".join(ranked.alike),
                )
            )
        return ResultTable(
            title="6.2-2: paths by the energy that impacts take, clearances of 0.5 mm",
            heads=("", "path", "lost mJ", "±", "tip after it, RMS m/s²", "±", "cannot be told from"),
            rows=rows,
            numbers=(0, 2, 3, 4, 5),
        )

    def _wear_table(self) -> ResultTable:
        rows = []
        for name, arm in self.arms.items():
            ends = [life.quantile(0.5) for life in arm.lives]
            strokes = np.array([0.0, 0.5, 1.0]) * min(ends)
            for count, *values in zip(strokes, *(life.values(strokes)[1] for life in arm.lives), strict=True):
                rows.append((name, f"{count:.3g}", *(f"{x * 1e3:.4f}" for x in values)))
        return ResultTable(
            title="6.2-4: error and RP of the median arm over the strokes [mm]",
            heads=("arm", "strokes", "error at the worst goal", "RP"),
            rows=rows,
            numbers=(1, 2, 3),
            section_ends=(2,),
        )

    def _rule_table(self) -> ResultTable:
        rows = []
        for name, arm in self.arms.items():
            first = arm.linkage.pins[int(arm.lives[0].pin_parts().argmax())].name
            rows += [
                (
                    name,
                    f"{'AP' if life.measure == 'error' else 'RP'} ≤ {life.limit * 1e3:g} mm",
                    *(f"{life.quantile(part):.3g}" for part in _QUANTILES),
                    first if life is arm.lives[0] else "",
                )
                for life in arm.lives
            ]
        return ResultTable(
            title="6.2-5: strokes that 95, 90 (B10) and 50 % of the arms reach",
            heads=("arm", "rule", "95 %", "90 %", "50 %", "pin that counts most"),
            rows=rows,
            numbers=(2, 3, 4),
            section_ends=(1,),
        )

    def _plan_table(self) -> ResultTable:
        same = self.plan.equally_safe()
        rows = [
            (
                "checks when they are due"
                if one.checks is None
                else f"{counted(one.checks, 'check')} at equal distances",
                f"{one.stops.mean():.2f}",
                f"{one.changes.mean():.2f}",
                f"{100 * one.outside.mean():.3f}",
            )
            for one in (self.plan.planned, *self.plan.fixed)
            if one.checks is None or one is same or one in {self.plan.fixed[0], self.plan.fixed[-1]}
        ]
        return ResultTable(
            title=f"6.2-6: arm A, its path kept within {PLAN_LIMIT * 1e3:g} mm for {HORIZON:.3g} strokes",
            heads=("maintenance", "stops", "changed bearings", "strokes out of limit, %"),
            rows=rows,
            numbers=(1, 2, 3),
        )

    def headline(self) -> Iterator[Tile]:
        """Give the quietest path, the first dimension, the strokes of both arms, and the stops of the plan."""
        best = self.rattling.ranking()[0]
        yield Tile(best.rattling.path.name, f"path with the least loss in impacts, {best.mean * 1e3:.1f} mJ")
        first = self.tolerances.ranking[0]
        share = self.tolerances.error.shares[self.tolerances.worst_pose, first]
        yield Tile(f"{share:.0%}", f"of the variance of the tip from {self.tolerances.tolerances[first].name}")
        for name, arm in self.arms.items():
            life = arm.lives[0]
            yield Tile(f"{life.quantile(0.1):.2g}", f"strokes, B10 life of arm {name} until {life.limit * 1e3:g} mm")
        yield Tile(
            f"{self.plan.planned.stops.mean():.1f}", f"stops of arm A in {HORIZON:.2g} strokes, checked when due"
        )

    def figures(self) -> list[Drawing]:
        """Return the ranking of the paths, the budget of errors, and the lives of both arms."""
        ranking = self.rattling.ranking()
        paths = "Energy lost in impacts by path"
        causes = "Causes of error of arm A at its goals"
        return [
            Drawing(
                "paths",
                paths,
                bar_chart(
                    paths,
                    [one.rattling.path.name for one in ranking],
                    {"lost": [one.mean * 1e3 for one in ranking]},
                    y_label="mJ",
                ),
            ),
            Drawing(
                "budget",
                causes,
                bar_chart(
                    causes,
                    ["Q1", "Q2", "Q3"],
                    {row.cause: (row.errors * 1e3).tolist() for row in self.budget},
                    y_label="mm",
                    logarithmic=True,
                ),
            ),
            Drawing("lives", "Arms that have failed over the strokes: error beyond its limit", self._lives()),
        ]

    def _lives(self) -> str:
        figure = empty_figure((7.4, 4.2))
        axes = plain_axes(figure, "strokes", "probability")
        for k, (name, arm) in enumerate(self.arms.items()):
            strokes, probability, band = arm.lives[0].curve()
            axes.plot(strokes, probability, f"C{k}-", label=f"arm {name}")
            axes.fill_between(strokes, *band, color=f"C{k}", alpha=0.15)
        axes.set_xscale("log")
        axes.set_xlim(left=1e6)
        axes.legend()
        return svg_text(figure, "Probability of failure over the strokes")


def _arm(linkage: Linkage, name: str) -> Linkage:
    return linkage.with_clearances(dict(zip(linkage.clearances, ARMS[name], strict=True)))


def _budget(arm: Linkage, tolerances: ToleranceAssessment) -> list[BudgetRow]:
    """Return how far clearances, their tolerances, those of lengths and zeros, and the bending of rods move the tip."""
    q = closed_at(arm, GOALS)
    resting = find_static_equilibrium(arm, q).tip
    rows = [BudgetRow("mean clearances", np.linalg.norm(resting - np.array(GOALS), axis=-1))]
    error = tolerances.error
    kinds = {each.name: each.kind for each in dimensions_of(arm)}
    for label, kind in (
        ("tolerances of clearances, 3 sd", "clearance"),
        ("of lengths", "length"),
        ("of zeros of the drives", "zero"),
    ):
        mine = [i for i, name in enumerate(error.names) if kinds[name] == kind]
        spread = error.jacobian[..., mine] * error.deviations[mine]
        rows.append(BudgetRow(label, 3 * np.linalg.norm(spread, ord=2, axis=(-2, -1))))
    bodies = []
    for body in arm.bodies:
        section, ends = RODS.get(body.name), (*body.points,)
        elastic = (
            None if section is None else Elasticity(ends=(ends[0], ends[1]), area=section[0], second_moment=section[1])
        )
        bodies.append(attrs.evolve(body, elastic=elastic))
    bent = find_static_equilibrium(attrs.evolve(arm, bodies=bodies), q).tip
    rows.append(BudgetRow("elastic rods", np.linalg.norm(bent - resting, axis=-1)))
    return rows


def _reliability(arm: Linkage, steps: int, samples: int) -> LinkageReliability:
    error, repeatability = LIMITS
    return assess_linkage(
        arm,
        closed_at(arm, GOALS),
        RandomClearances(mean=arm.clearance_array(None), covariance=CLEARANCE_SPREAD**2 * np.eye(len(arm.pins))),
        limit=error,
        wear=WearStatement(
            path=named_path("pick-and-place"),
            law=WearLaw(coefficient=COEFFICIENT),
            spread=SPREAD,
            steps=steps,
            limits={"error": error, "RP": repeatability},
        ),
        samples=samples,
    )


def _plan(arm: Linkage, lives: int, report: Callable[[str, float], None]) -> CheckPlan:
    prior = WearPrior(
        clearances=arm.clearance_array(None),
        clearance_spread=CLEARANCE_SPREAD,
        coefficients=np.full(len(arm.pins), COEFFICIENT),
        spread=SPREAD,
        pin_spread=0.2,
        grain=1e-6,
    )
    machine = maintained_linkage(
        arm, named_path("pick-and-place"), WearLaw(coefficient=1.0), exposure=HORIZON * prior.fastest
    )
    strategy = Strategy(limit=PLAN_LIMIT, alpha=ALPHA, horizon=HORIZON, least_interval=HORIZON / 50)
    return plan_checks(
        machine,
        prior,
        strategy,
        lives=lives,
        progress=lambda done, every: report("simulated lives", done / every),
    )
