"""Two checks of a five-bar whose pins wear, written as a maintenance would keep them, from a life that is known here.

Run: python examples/five_bar_checks.py examples/five_bar_checks.csv
"""

import csv
import sys
from pathlib import Path

import numpy as np

from armwright.clearance import load_linkage, named_path
from armwright.clearance.maintenance.maintained_linkage import maintained_linkage
from armwright.clearance.maintenance.readings import tips_of
from armwright.clearance.maintenance.simulated_lives import SimulatedWear

STROKES = (2.6e6, 9.0e6)
NEW = np.array([0.108e-3, 0.095e-3, 0.102e-3])  # clearances of J2, J3 and J4 [m]
WEAR = np.array([1.4e-13, 0.9e-13, 0.8e-13])  # coefficients [m²/N]
READINGS, NOISE = 5, 10e-6

bar = load_linkage("five-bar")
bar = bar.with_clearances(dict.fromkeys(bar.clearances, 0.1e-3))
machine = maintained_linkage(bar, named_path("pick-and-place"), exposure=2e-6)
wear = SimulatedWear.of(machine, NEW, WEAR)
poses, rng = machine.poses, np.random.default_rng(3)
with Path(sys.argv[1]).open("w", encoding="utf-8", newline="") as file:
    rows = csv.writer(file, lineterminator="\n")
    rows.writerow(["strokes", "commanded_x_mm", "commanded_y_mm", "x_mm", "y_mm"])
    for strokes in STROKES:
        growths = wear.history.table.grown(np.zeros(3), strokes * WEAR)
        tilts = rng.uniform(-1.0, 1.0, (READINGS, len(poses.q), len(NEW)))
        tips = tips_of(bar, poses.q, wear.poses.at(NEW, growths, tilts))
        tips += NOISE * rng.standard_normal(tips.shape)
        for k, commanded in enumerate(poses.tip):
            for tip in tips[:, k]:
                rows.writerow([f"{strokes:g}", *(f"{x * 1e3:.4f}" for x in (*commanded, *tip))])
