"""Tolerances of the dimensions of an arm, with the cost of keeping them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from pathlib import Path

import attrs

from armwright.arm.model import Arm
from armwright.calibration.chain import kinematic_chain
from armwright.errors import InvalidValueError
from armwright.files.document import Document, Table

# A normal deviation is within its tolerance with the probability of three standard deviations.
SIGMAS = 3.0
_ANGLES = ("theta", "alpha", "beta")
_LENGTHS = ("d", "a")
_ENDS = ("base", "tool")
# A tolerance is at most so large [mm] or [deg]; what is smaller than the least is rounding.
_LARGEST, _LEAST = {"mm": 1e6, "deg": 180.0}, 1e-9
# Bounds of the exponent of cost, and of factors.
_EXPONENTS, _FACTORS = (0.01, 10.0), (1e-9, 1e9)


@attrs.frozen(kw_only=True)
class Tolerance:
    """How far a dimension may be off to either side, and what that costs.

    Attributes:
        name: of the dimension, ``joint3.theta``, ``tool.x``.
        half_width: the dimension is within this of its nominal value [m] or [rad].
        is_length: whether it is a length.
        cost: of this tolerance; a tolerance t costs ``cost * (half_width / t)**exponent``.
        exponent: how fast the cost grows.
    """

    name: str
    half_width: float
    is_length: bool
    cost: float = 1.0
    exponent: float = 1.0

    @property
    def standard_deviation(self) -> float:
        """Of a normal deviation [m] or [rad]."""
        return self.half_width / SIGMAS

    @property
    def displayed(self) -> tuple[float, str]:
        """The half width as a user writes it, and its unit."""
        return (self.half_width * 1e3, "mm") if self.is_length else (math.degrees(self.half_width), "deg")


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
    exponent, factors = _costs(root.table("cost"))
    root.refuse_unknown_keys()
    known = dimensions(arm)
    for name in factors:
        if name not in known:
            raise root.table("cost").table("factors").error(name, f"{arm.name} has no such dimension")
    found = tuple(
        Tolerance(name=name, half_width=values[name], is_length=length, cost=factors.get(name, 1.0), exponent=exponent)
        for name, length in known.items()
        if values.get(name, 0.0) > 0
    )
    if not found:
        raise InvalidValueError(f"{path}: expected a tolerance above zero, such as theta_deg = 0.01 in [joints]")
    return found


def _joint_keys() -> Iterator[tuple[str, str, float]]:
    for name in _ANGLES:
        yield name, f"{name}_deg", math.radians(1)
    for name in _LENGTHS:
        yield name, f"{name}_mm", 1e-3


def _dimension_values(table: Table, keys: Iterator[tuple[str, str, float]]) -> dict[str, float]:
    values = {name: _half_width(table, key) * unit for name, key, unit in keys if key in table}
    table.allow(*(key for _, key, _ in _joint_keys()))
    table.refuse_unknown_keys()
    if "alpha" in values:
        values.setdefault("beta", values["alpha"])
    return values


def _half_width(table: Table, key: str) -> float:
    value = table.number(key, 0.0, lower=0.0, upper=_LARGEST[key.rpartition("_")[2]])
    if 0 < value < _LEAST:
        raise table.error(key, f"expected 0, or {_LEAST:g} or more, got {value:g}")
    return value


def _end_values(table: Table) -> dict[str, float]:
    position, rotation = (_half_width(table, key) for key in ("position_mm", "rotation_deg"))
    table.refuse_unknown_keys()
    lengths = dict.fromkeys("xyz", position * 0.001)
    return {**lengths, **{f"r{axis}": math.radians(rotation) for axis in "xyz"}}


def _costs(table: Table) -> tuple[float, Mapping[str, float]]:
    exponent = table.number("exponent", 1.0, lower=_EXPONENTS[0], upper=_EXPONENTS[1])
    own = table.table("factors")
    factors = {name: own.number(name, lower=_FACTORS[0], upper=_FACTORS[1]) for name in own}
    table.refuse_unknown_keys()
    return exponent, factors
