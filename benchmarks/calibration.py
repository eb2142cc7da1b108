"""Calibration on public laser-tracker data: held-out error and time, beside pybotics with SciPy on the same points."""

from measure import in_turn, progress, section, table  # isort: skip - sets the threads first

import os
import time
from pathlib import Path

import attrs
import numpy as np
from pybotics.kinematic_chain import MDHKinematicChain
from pybotics.optimization import OptimizationHandler, optimize_accuracy
from pybotics.robot import Robot
from pybotics.tool import Tool
from scipy.optimize import least_squares

from armwright.arm.load import load_arm
from armwright.arm.model import Arm, Joint
from armwright.arrays import Flags
from armwright.calibration.cross_validation import cross_validate
from armwright.calibration.fitting import calibrate_points
from armwright.calibration.measurements import Measurements, read_measurements
from armwright.spatial.poses import homogeneous

FOLDER = Path(os.environ.get("ARMWRIGHT_DATA", Path(__file__).parents[2] / "shared" / "data"))
FILES = {"UR5": "3D_UR5_uncalibrated_grid_cleaned.csv", "WAM": "3D_WAM_uncalibrated_grid_cleaned.csv"}
TURN = np.pi / 2
FOLDS = 5
# pybotics has no derivatives, and goes through points one by one: it gets so many, and is judged on all others.
FITTED = 160
# Over numbers that points do not tell its fit wanders for minutes and gets no better.
STEPS = 100
WAM_TABLE = [(0.0, 0.0, -TURN), (0.0, 0.0, TURN), (0.55, 0.045, -TURN), (0.0, -0.045, TURN), (0.3, 0.0, -TURN),
             (0.0, 0.0, TURN), (0.06, 0.0, 0.0)]  # fmt: skip


def arms() -> dict[str, Arm]:
    """Return the two arms with the tools that were measured."""
    wam = [Joint(kind="revolute", d=d, a=a, alpha=alpha) for d, a, alpha in WAM_TABLE]
    return {
        "UR5": attrs.evolve(load_arm("ur5"), tool=homogeneous(np.eye(3), (0, 0, 0.031))),
        "WAM": Arm(name="wam", joints=tuple(wam), tool=homogeneous(np.eye(3), (0, 0, 0.044))),
    }


def theirs(arm: Arm, data: Measurements) -> float:
    """Calibrate by pybotics and SciPy, all of its numbers, to some points; return the mean error of the others."""
    rows, before = [], (0.0, 0.0)
    for joint in arm.joints:
        # Modified Denavit-Hartenberg: the twist and length of the link before.
        rows.append([before[0], before[1], joint.theta, joint.d])
        before = (joint.alpha, joint.a)
    robot = Robot(MDHKinematicChain.from_parameters(np.array(rows)), tool=Tool(arm.tool.copy()))
    robot.joint_limits = np.repeat([[-10.0], [10.0]], arm.n, axis=1)
    handler = OptimizationHandler(
        robot, kinematic_chain_mask=[True] * (4 * arm.n), tool_mask=[True] * 3 + [False] * 3, world_mask=[True] * 6
    )
    fit = some(data)
    start = handler.generate_optimization_vector()
    found = least_squares(optimize_accuracy, start, args=(handler, data.q[fit], data.points[fit]), max_nfev=STEPS)
    return float(optimize_accuracy(found.x, handler, data.q[~fit], data.points[~fit]).mean())


def ours(arm: Arm, data: Measurements) -> float:
    """Calibrate by armwright on the same points."""
    fit = some(data)
    found = calibrate_points(arm, data.q[fit], data.points[fit])
    return float(np.linalg.norm(found.predict(data.q[~fit]) - data.points[~fit], axis=1).mean())


def some(data: Measurements) -> Flags:
    """Return (m,) which points are fitted to."""
    return np.random.default_rng(0).permutation(len(data.q)) < FITTED


def main() -> None:
    """Measure both arms, if the data are there."""
    if not all((FOLDER / name).is_file() for name in FILES.values()):
        section("Calibration", "The public data are not here: set ARMWRIGHT_DATA to their folder.")
        return
    rows = []
    for name, arm in arms().items():
        progress(name)
        data = read_measurements(FOLDER / FILES[name], arm, units=("mm", "deg"))
        start = time.perf_counter()
        folds = cross_validate(arm, data.readings, folds=FOLDS).distance.mean()
        taken = time.perf_counter() - start
        errors: dict[str, float] = {}
        mine, other = in_turn(
            lambda a=arm, d=data, e=errors: e.update(ours=ours(a, d)),
            lambda a=arm, d=data, e=errors: e.update(theirs=theirs(a, d)),
            repeats=1,
        )
        lengths = [f"{x * 1e3:.3f}" for x in (folds, errors["ours"], errors["theirs"])]
        times = [f"{mine:.2f}", f"{other:.1f}", f"{other / mine:.0f}"]
        rows.append([name, len(data.q), lengths[0], f"{taken:.2f}", *lengths[1:], *times])
    section(
        "Calibration on public laser-tracker data",
        f"Mean distance of points held out: in five folds of all points, with the time of all five fits; and fitted to "
        f"{FITTED} points, on all others, beside pybotics. pybotics fits all its numbers by SciPy's least squares over "
        f"its own residual, without derivatives, {STEPS} evaluations at most; it has no turn about y for parallel axes "
        f"and no word on what cannot be told.",
        table(
            ["arm", "points", "5 folds mm", "s", f"{FITTED} points mm", "pybotics mm", "s", "pybotics s", "times"], rows
        ),
    )


if __name__ == "__main__":
    main()
