"""Writes five_bar_rest.csv and five_bar_paths.csv into a folder: what a tracker would see of a five-bar with play.

The arm has 0.328, 0.171 and 0.483 mm of play in the pins J2, J3 and J4. Its tip is read ten times at each of four
poses, with 10 µm of noise, and 250 times on the way along each of three paths, with 2 µm.
Run it to see how such files are made, with the name of the folder or in it; its numbers are the same in every run, but
for the last digit of some on other processors.
"""

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from armwright.clearance.equations import FrictionModel
from armwright.clearance.estimation.static_estimate import rest_offsets
from armwright.clearance.paths import named_path
from armwright.clearance.reader import load_linkage
from armwright.clearance.scenario import prepare_scenario
from armwright.clearance.settings import Settings
from armwright.clearance.simulation import simulate

PLAY = np.array((0.328, 0.171, 0.483)) * 1e-3  # m
POSES = np.array(((-0.15, -0.7), (-0.05, -0.7), (0.15, -0.7), (0.0, -0.55)))  # m
READINGS, READ_NOISE = 10, 10e-6  # m
PATHS, TRACK_NOISE = ("y1", "y3", "y7"), 2e-6  # m
SETTINGS = Settings(friction=FrictionModel(velocity="centre"), threshold=1e-2, sample=1e-3)


def rest_rows(rng: np.random.Generator) -> Iterator[str]:
    """Give the rows of the resting tip."""
    yield "pose,commanded_x_mm,commanded_y_mm,x_mm,y_mm"
    for number, (pose, off) in enumerate(zip(POSES, rest_offsets(load_linkage("five-bar"), POSES, PLAY), strict=True)):
        for place in pose + off + rng.normal(scale=READ_NOISE, size=(READINGS, 2)):
            yield f"P{number + 1}," + ",".join(f"{x * 1e3:.4f}" for x in (*pose, *place))


def path_rows(rng: np.random.Generator) -> Iterator[str]:
    """Give the rows of the tip on its paths, one every millisecond."""
    yield "path,t_s,x_mm,y_mm"
    for name in PATHS:
        run = simulate(prepare_scenario(load_linkage("five-bar"), named_path(name), SETTINGS), PLAY)
        places = run.tip + rng.normal(scale=TRACK_NOISE, size=run.tip.shape)
        for moment, (x, y) in zip(run.time, places, strict=True):
            yield f"{name},{moment:.4f},{x * 1e3:.5f},{y * 1e3:.5f}"


def texts() -> dict[str, str]:
    """Return both files by name."""
    rng = np.random.default_rng(483)
    return {
        "five_bar_rest.csv": "\n".join(rest_rows(rng)) + "\n",
        "five_bar_paths.csv": "\n".join(path_rows(rng)) + "\n",
    }


if __name__ == "__main__":
    for name, text in texts().items():
        Path(*sys.argv[1:2], name).write_text(text, encoding="utf-8")
