"""Linkages with play: steps per second beside Exudyn on the same model, the thesis' design, memory."""

from measure import in_turn, progress, section, table  # isort: skip - sets the threads first

import resource
import time
from itertools import product

import numpy as np

from armwright.clearance.contact import stiffness
from armwright.clearance.feature_sweep import FeatureSweep
from armwright.clearance.paths import TEST_PATHS, thesis_path
from armwright.clearance.reader import load_linkage
from armwright.clearance.scenario import prepare_scenario
from armwright.clearance.settings import Settings, contact_stiffness
from armwright.clearance.simulation import simulate
from armwright.clearance.static_equilibrium import find_static_equilibrium
from clearance.exudyn_five_bar import simulated

STEP = 1e-5
SHORT = 0.05  # s of the path, for the peer
SIDE_BY_SIDE = 64
LEVELS = np.linspace(0.1e-3, 0.5e-3, 9)
BLOCK = 96


def steps_per_second() -> None:
    """Measure Runge-Kutta and the semi-implicit rule with three contacts, and Exudyn's Runge-Kutta."""
    progress("steps per second")
    linkage = load_linkage("five-bar")
    tasks = {
        kind: prepare_scenario(linkage, thesis_path("y1"), Settings(step=STEP, integrator=kind, sample=0.01))
        for kind in ("rk4", "semi-implicit")
    }
    clearances = np.linspace(0.1e-3, 0.5e-3, SIDE_BY_SIDE)[:, None] * np.ones(3)
    rk4, euler = tasks["rk4"], tasks["semi-implicit"]
    pin = linkage.pins[0]
    K = float(stiffness(pin.clearance, pin.journal_radius, linkage.material.young, linkage.material.poisson))
    own = np.array([pin.clearance] * 3)
    start = find_static_equilibrium(linkage, rk4.ideal.q[0], own, contact_stiffness(linkage, own)).q
    torque = rk4.table[0, 0]

    def peer() -> object:
        return simulated(linkage, start, lambda _: torque, K, duration=SHORT, step=STEP, every=0.01)

    many, alone, fast, theirs = in_turn(
        lambda: simulate(rk4, clearances, threads=1),
        lambda: simulate(rk4, own, threads=1),
        lambda: simulate(euler, clearances, threads=1),
        peer,
        repeats=5,
    )
    rate = round(SHORT / STEP) / theirs
    rows = [["Exudyn 1.13, RK44, one run", f"{rate:.3g}", "1"]]
    for name, seconds, task, runs in (
        (f"armwright, RK4, {SIDE_BY_SIDE} runs side by side", many, rk4, SIDE_BY_SIDE),
        ("armwright, RK4, one run", alone, rk4, 1),
        (f"armwright, semi-implicit, {SIDE_BY_SIDE} runs", fast, euler, SIDE_BY_SIDE),
    ):
        ours = task.steps * runs / seconds
        rows.append([name, f"{ours:.3g}", f"{ours / rate:.0f}"])
    section(
        "Play in three pins: steps per second and core",
        "The five-bar of the thesis: eight coordinates, three Hertz contacts with friction, steps of 10 µs. Ours is "
        "the whole call, with the start at rest and what is told of the run afterwards; the peer's is its solver, "
        "with a function of Python for the two torques.",
        table(["simulation", "steps per second", "times Exudyn"], rows),
    )


def designs() -> None:
    """Measure the thesis' sweeps on one core, from the linkage to the features."""
    linkage = load_linkage("five-bar")
    points = np.array(list(product(LEVELS, repeat=3)))
    rows = []
    for title, paths in (
        ("729 linkages, 3 paths", ("y1", "y3", "y7")),
        ("729 linkages, all 24 paths", tuple(TEST_PATHS)),
    ):
        progress(title)
        before = _peak()
        begin = time.perf_counter()
        # One path after the other: the torques of one are as large as a hundred runs.
        for path in paths:
            _swept(FeatureSweep(linkage=linkage, paths=(path,), replicates=0), points)
        seconds = time.perf_counter() - begin
        runs = len(points) * len(paths)
        rows.append([title, f"{runs:,}", f"{seconds:.1f}", f"{runs / seconds:.0f}", f"{_peak() - before:.0f}"])
    section(
        "The thesis' designs",
        "Torques by inverse dynamics, simulation, features of the error curves; one core. Memory is what the process "
        "grew by at most.",
        table(["design", "simulations", "s", "per second", "MB more"], rows),
    )


def _swept(task: FeatureSweep, points: np.ndarray) -> None:
    for first in range(0, len(points), BLOCK):
        task(points[first : first + BLOCK])


def _peak() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


if __name__ == "__main__":
    steps_per_second()
    designs()
