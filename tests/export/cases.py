"""Arms with the conventions of their controllers, and runs that are exported."""

import re
from functools import cache
from pathlib import Path

import attrs
import numpy as np

from armwright import Arm, load_arm
from armwright.arm.model import Joint, Limits
from armwright.arrays import Array
from armwright.export.conventions import ControllerArm, controller_arm, conventions
from armwright.export.plan_mode import plan_statements
from armwright.export.statements import ControllerProgram
from armwright.program import Recording, Source, run

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
EXAMPLES = ROOT / "examples"
# A cell for each target whose language has joints and frames.
CELLS = {
    "urscript": EXAMPLES / "ur5_cell.toml",
    "krl": HERE / "arms" / "kr6r900_cell.toml",
    "rapid": HERE / "arms" / "irb120_cell.toml",
    "fanuc": HERE / "arms" / "lrmate200id_cell.toml",
}
ARMS = {
    "urscript": ("ur5", "universal-robots"),
    "krl": ("kr6r900", "kuka"),
    "rapid": ("irb120", "abb"),
    "fanuc": ("lrmate200id", "fanuc"),
}


@cache
def mapped_arm(target: str) -> ControllerArm:
    """Return the arm of the cell of a target, with the convention of its controller."""
    name, convention = ARMS[target]
    arm = load_arm(
        name if name == "ur5" else str((HERE / "arms" if name == "lrmate200id" else EXAMPLES) / f"{name}.toml")
    )
    return controller_arm(arm, conventions()[convention])


@cache
def recorded(program: str, target: str) -> Recording:
    """Return the run of an example, or of a text, in the cell of a target."""
    text = EXAMPLES / program if program.endswith(".rlo") else Source("test.rlo", program)
    return run(text, CELLS[target])


def planned(program: str, target: str) -> ControllerProgram:
    """Return the plan of an example, or of a text, in the cell of a target, as that is exported."""
    return plan_statements(recorded(program, target), "x", zones=target != "fanuc")


def six_axes(rows: list[tuple[float, float, float, float]], name: str) -> Arm:
    """Return an arm of six revolute joints, by theta [deg], d [mm], a [mm] and alpha [deg]."""
    joints = [
        Joint(
            kind="revolute",
            theta=np.radians(theta),
            d=d / 1e3,
            a=a / 1e3,
            alpha=np.radians(alpha),
            limits=Limits(lower=-7.0, upper=7.0),
        )
        for theta, d, a, alpha in rows
    ]
    ur5 = load_arm("ur5")
    links = [attrs.evolve(link, solids=()) for link in ur5.links]
    return attrs.evolve(ur5, name=name, joints=joints, links=links, base_solids=())


def wrist_arm(lengths: tuple[float, float, float, float, float, float], name: str) -> Arm:
    """Return an arm with a spherical wrist: height, offset, upper arm, offset of the forearm, forearm, flange [mm]."""
    d1, a1, a2, a3, d4, d6 = lengths
    rows = [(0, d1, a1, -90), (-90, 0, a2, 0), (0, 0, a3, -90), (0, d4, 0, 90), (0, 0, 0, -90), (180, d6, 0, 0)]
    return six_axes(rows, name)


def with_number_changed(text: str, line: int, change: float) -> str:
    """Return a text with the last number that has decimals in one of its lines changed."""
    lines = text.splitlines(keepends=True)
    numbers = list(re.finditer(r"-?\d+\.\d{3,}", lines[line]))
    last = numbers[len(numbers) // 2]
    digits = len(last.group().partition(".")[2])
    changed = f"{float(last.group()) + change:.{digits}f}"
    lines[line] = lines[line][: last.start()] + changed + lines[line][last.end() :]
    return "".join(lines)


def random_joints(arm: Arm, rng: np.random.Generator) -> Array:
    """Return joint positions (n,) within the limits of an arm."""
    return rng.uniform(arm.limits.lower, arm.limits.upper)
