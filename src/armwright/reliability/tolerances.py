"""Tolerances of dimensions, with the cost of keeping them, and those of an arm."""

from __future__ import annotations

import math
from collections.abc import Container, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Literal, TypeAlias

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array, integer
from armwright.calibration.chain import kinematic_chain
from armwright.errors import InvalidValueError
from armwright.files.document import Document, Table

Unit: TypeAlias = Literal["m", "rad", "kg", "N"]

# What a user writes for a unit, and its SI value.
SHOWN: Mapping[Unit, tuple[float, str]] = {
    "m": (1e-3, "mm"),
    "rad": (math.radians(1), "deg"),
    "kg": (1.0, "kg"),
    "N": (1.0, "N"),
}
# A normal deviation is within its tolerance with the probability of three standard deviations.
SIGMAS = 3.0
_ANGLES = ("theta", "alpha", "beta")
_LENGTHS = ("d", "a")
_ENDS = ("base", "tool")
_END_KEYS = (("position", "mm"), ("rotation", "deg"))
# A tolerance is at most so large [mm], [deg], [kg] or [N]; what is smaller than the least is rounding.
_LARGEST, _LEAST = {"mm": 1e6, "deg": 180.0, "kg": 1e6, "N": 1e6}, 1e-9
# Bounds of the exponent of cost, and of factors.
_EXPONENTS, _FACTORS = (0.01, 10.0), (1e-9, 1e9)


@attrs.frozen(kw_only=True)
class Tolerance:
    """How far a dimension may be off to either side, and what that costs.

    Attributes:
        name: of the dimension, ``joint3.theta``, ``tool.x``, ``J2.clearance``.
        half_width: the dimension is within this of its nominal value [m, rad, kg, N].
        unit: of the dimension.
        cost: of this tolerance; a tolerance t costs ``cost * (half_width / t)**exponent``.
        exponent: how fast the cost grows.
        most: the nominal value, of a dimension that cannot be below zero; its tolerance is at most that.
    """

    name: str
    half_width: float
    unit: Unit = "m"
    cost: float = 1.0
    exponent: float = 1.0
    most: float = math.inf

    @property
    def standard_deviation(self) -> float:
        """Of a normal deviation [m, rad, kg, N]."""
        return self.half_width / SIGMAS

    @property
    def displayed(self) -> tuple[float, str]:
        """The half width as a user writes it, and its unit."""
        scale, unit = SHOWN[self.unit]
        return self.half_width / scale, unit


def sampled_deviations(tolerances: Sequence[Tolerance], *, samples: int, seed: int = 0, uniform: bool = False) -> Array:
    """Return random deviations within tolerances.

    Args:
        tolerances: k of them.
        samples: how many are drawn.
        seed: of the sample.
        uniform: whether deviations are uniform within their tolerances, not normal with a third as standard deviation.

    Returns:
        (samples, k) [m, rad, kg, N]; no dimension that cannot be below zero is.
    """
    widths = np.array([tolerance.half_width for tolerance in tolerances])
    shape = (integer(samples, "samples", least=1), len(widths))
    rng = np.random.default_rng(seed)
    drawn = widths * (rng.uniform(-1, 1, shape) if uniform else rng.normal(scale=1 / SIGMAS, size=shape))
    return np.maximum(drawn, [-tolerance.most for tolerance in tolerances])


def dimensions(arm: Arm) -> dict[str, bool]:
    """Return the names of the dimensions that an arm can be off in, each with whether it is a length."""
    chain = kinematic_chain(arm)
    return dict(zip(chain.names, map(bool, chain.is_length), strict=True))


def read_tolerances(path: Path | str, arm: Arm) -> tuple[Tolerance, ...]:
    """Read a file of tolerances (docs/reliability.md): those of all joints, of single ones, of base and tool.

    Args:
        path: a TOML file.
        arm: whose dimensions they are.

    Returns:
        The tolerances above zero, in the order of the dimensions.

    Raises:
        FileFormatError: the file is missing or malformed, or names something that the arm has not.
        InvalidValueError: no tolerance is above zero.
    """
    root = Document.read(Path(path)).root
    every = _dimension_values(root.table("joints"), _joint_keys())
    single = root.table("joint")
    values: dict[str, float] = {}
    for i in range(1, arm.n + 1):
        own = _dimension_values(single.table(str(i)), _joint_keys())
        values |= {f"joint{i}.{name}": value for name, value in {**every, **own}.items()}
    single.refuse_unknown_keys()
    for end in _ENDS:
        values |= {f"{end}.{name}": value for name, value in _end_values(root.table(end)).items()}
    known = dimensions(arm)
    exponent, factors = read_costs(root.table("cost"), arm.name, known)
    root.refuse_unknown_keys()
    found = tuple(
        Tolerance(
            name=name,
            half_width=values[name],
            unit="m" if length else "rad",
            cost=factors.get(name, 1.0),
            exponent=exponent,
        )
        for name, length in known.items()
        if values.get(name, 0.0) > 0
    )
    if not found:
        raise InvalidValueError(f"{path}: expected a tolerance above zero, such as theta_deg = 0.01 in [joints]")
    return found


def read_half_width(table: Table, key: str, unit: str, default: float = 0.0) -> float:
    """Return a tolerance of a file.

    Args:
        table: that has it.
        key: of it.
        unit: in which it is written: ``mm``, ``deg``, ``kg`` or ``N``.
        default: where it is missing.

    Raises:
        FileFormatError: it is no number, or out of range.
    """
    value = table.number(key, default, lower=0.0, upper=_LARGEST[unit])
    if 0 < value < _LEAST:
        raise table.error(key, f"expected 0, or {_LEAST:g} or more, got {value:g}")
    return value


def read_costs(table: Table, owner: str, known: Container[str]) -> tuple[float, Mapping[str, float]]:
    """Return the exponent of cost, and the factors of dimensions by name.

    Args:
        table: ``[cost]`` of a file of tolerances.
        owner: the name of what has the dimensions.
        known: the names of these.

    Raises:
        FileFormatError: a number is out of range, or a factor is of no dimension.
    """
    exponent = table.number("exponent", 1.0, lower=_EXPONENTS[0], upper=_EXPONENTS[1])
    own = table.table("factors")
    for name in own:
        if name not in known:
            raise own.error(name, f"{owner} has no such dimension")
    factors = {name: own.number(name, lower=_FACTORS[0], upper=_FACTORS[1]) for name in own}
    table.refuse_unknown_keys()
    return exponent, factors


def _joint_keys() -> Iterator[tuple[str, str, float]]:
    for name in _ANGLES:
        yield name, "deg", math.radians(1)
    for name in _LENGTHS:
        yield name, "mm", 1e-3


def _dimension_values(table: Table, keys: Iterator[tuple[str, str, float]]) -> dict[str, float]:
    values = {
        name: read_half_width(table, f"{name}_{unit}", unit) * si
        for name, unit, si in keys
        if f"{name}_{unit}" in table
    }
    table.allow(*(f"{name}_{unit}" for name, unit, _ in _joint_keys()))
    table.refuse_unknown_keys()
    if "alpha" in values:
        values.setdefault("beta", values["alpha"])
    return values


def _end_values(table: Table) -> dict[str, float]:
    position, rotation = (read_half_width(table, f"{what}_{unit}", unit) for what, unit in _END_KEYS)
    table.refuse_unknown_keys()
    lengths = dict.fromkeys("xyz", position * 0.001)
    return {**lengths, **{f"r{axis}": math.radians(rotation) for axis in "xyz"}}
