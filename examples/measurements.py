"""Writes measured_poses.csv and measured_paths.csv into a folder: what an imaginary robot would give a laser tracker.

The robot misses its poses by a fixed offset and Gaussian noise, swings when it stops, and rounds its corners.
Run it to see how such files are made, with the name of the folder or in it; its numbers are the same in every run, but
for the last digit of some on other processors.
"""

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

POSES = {"P1": (400.0, 0.0, 300.0), "P2": (600.0, 200.0, 500.0)}  # mm
OFFSET = np.array((0.12, -0.05, 0.08))  # mm
NOISE = 0.02  # mm in each direction
TURN = (0.0, 90.0, 180.0)  # deg; c stands where angles jump by a turn
TURN_NOISE = 0.01  # deg
SPEED = 250.0  # mm/s


def pose_rows(rng: np.random.Generator) -> Iterator[str]:
    """Give the rows of pose tests: two poses, their distance, and three directions of approach to the first."""
    yield "test,pose,direction,cycle,x_mm,y_mm,z_mm,a_deg,b_deg,c_deg"
    clouds = {name: place + OFFSET + rng.normal(scale=NOISE, size=(30, 3)) for name, place in POSES.items()}
    for test in ("pose", "distance"):
        for name, place in POSES.items():
            yield row(f"{test},{name},,commanded", place, TURN)
            for cycle, attained in enumerate(clouds[name], 1):
                yield row(f"{test},{name},,{cycle}", attained, turned(rng))
    for number, direction in enumerate("xyz"):
        play = 0.06 * np.eye(3)[number]
        for cycle in range(1, 31):
            attained = POSES["P1"] + OFFSET + play + rng.normal(scale=NOISE, size=3)
            yield row(f"multidirectional,P1,{direction},{cycle}", attained, turned(rng))


def path_rows(rng: np.random.Generator) -> Iterator[str]:
    """Give the rows of path tests: coming to rest, a straight line at steady speed, and a corner."""
    yield "test,path,cycle,t_s,speed_mm_per_s,x_mm,y_mm"
    for cycle in range(1, 4):
        t = np.linspace(0, 0.8, 161)
        way = 40.0 * np.exp(-14 * t) * np.cos((43 + 2 * cycle) * t)
        for moment, off in zip(t, way, strict=True):
            yield f"settling,P1,{cycle},{moment:.4f},,{400 - off:.4f},0.0000"
    line = np.array(((200.0, -150.0), (500.0, 150.0)))
    yield from commanded("path,line", line, f"{SPEED:g}")
    yield from runs(rng, "path,line", line, 10, 0.0)
    corner = np.array(((300.0, 0.0), (500.0, 0.0), (500.0, 200.0)))
    yield from commanded("cornering,square", corner, "")
    yield from runs(rng, "cornering,square", corner, 3, 20.0)


def commanded(of: str, points: np.ndarray, speed: str) -> Iterator[str]:
    """Give the rows of a commanded path."""
    for x, y in points:
        yield f"{of},commanded,,{speed},{x:.4f},{y:.4f}"


def runs(rng: np.random.Generator, of: str, points: np.ndarray, cycles: int, lag: float) -> Iterator[str]:
    """Give the rows of runs along straight legs, each point the mean of the way `lag` mm before and behind it."""
    ends = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    for cycle in range(1, cycles + 1):
        speed = SPEED * (1 + rng.normal(scale=0.002))
        s = np.linspace(0.0, ends[-1], 81)
        near = s[:, None] + np.linspace(-lag, lag, 41)
        places = np.stack([np.interp(near, ends, axis).mean(axis=1) for axis in points.T], axis=1)
        places += OFFSET[:2] + rng.normal(scale=NOISE, size=places.shape)
        for moment, (x, y) in zip(s / speed, places, strict=True):
            yield f"{of},{cycle},{moment:.5f},,{x:.4f},{y:.4f}"


def turned(rng: np.random.Generator) -> np.ndarray:
    """Return attained angles as an instrument gives them, between -180 and 180 deg."""
    return (TURN + rng.normal(scale=TURN_NOISE, size=3) + 180) % 360 - 180


def row(of: str, place: np.ndarray, turn: np.ndarray) -> str:
    """Write one pose."""
    return ",".join([of, *(f"{x:.4f}" for x in place), *(f"{x:.4f}" for x in turn)])


def texts() -> dict[str, str]:
    """Return both files by name."""
    rng = np.random.default_rng(9283)
    return {
        "measured_poses.csv": "\n".join(pose_rows(rng)) + "\n",
        "measured_paths.csv": "\n".join(path_rows(rng)) + "\n",
    }


if __name__ == "__main__":
    for name, text in texts().items():
        Path(*sys.argv[1:2], name).write_text(text, encoding="utf-8")
