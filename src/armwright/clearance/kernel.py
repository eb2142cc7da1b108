"""Compiled simulations: many runs of one linkage side by side in the lanes of a vector, step by step.

A run keeps its bits whatever runs beside it: no lane reads another.
"""

from __future__ import annotations

import ast
import hashlib
import inspect
import json
from collections.abc import Callable, Mapping, Sequence
from itertools import islice
from types import ModuleType
from typing import Literal, NamedTuple, TypeAlias

import attrs

from armwright.clearance import event_location, simulation_loop, wall_lookup
from armwright.clearance.equations import (
    ROD_WORKS,
    WORKS,
    Contact,
    ContactMemory,
    FrictionModel,
    State,
    Wall,
    pin_place,
    rates,
)
from armwright.clearance.lane_layout import LANES
from armwright.clearance.linkage import Linkage, Material
from armwright.clearance.placement import Placement
from armwright.tracing.emit import emit_lanes
from armwright.tracing.native import processor
from armwright.tracing.scalar import Scalar

Integrator: TypeAlias = Literal["rk4", "semi-implicit"]
Control: TypeAlias = Literal["effort", "pd+ff"]
INTEGRATORS: tuple[Integrator, ...] = ("rk4", "semi-implicit")
CONTROLS: tuple[Control, ...] = ("effort", "pd+ff")

# The arguments of ``simulation_loop.simulate``; arrays that are only read come first.
_SIGNATURE = """SIGNATURE = types.void(
    int64, int64, {matrix}, {matrix}, {matrix}, types.Array(float64, 3, "C", readonly=True),
    types.Array(float64, 1, "C", readonly=True), types.Array(int64, 1, "C", readonly=True),
    types.Array(float64, 3, "C", readonly=True), types.Array(float64, 3, "C"), types.Array(int64, 2, "C"),
    types.Array(float64, 2, "C"), types.Array(int64, 1, "C"),
)
"""
_COMPILED = '@njit(error_model="numpy")'
# Small parts of the loop, and its equations where they stand in one place, become part of it.
_INLINED = '@njit(error_model="numpy", forceinline=True)'


def _kernel_key(linkage: Linkage) -> str:
    """Return what the kernels of two linkages share, whatever their names, clearances and materials."""
    pins = [attrs.evolve(pin, clearance=0.0) for pin in linkage.pins]
    return json.dumps(attrs.evolve(linkage, name="", pins=pins, material=Material(), assembly={}).as_data())


class Inputs(NamedTuple):
    """What the equations of a linkage take.

    Attributes:
        state: of the linkage.
        drives: effort of each drive, or its acceleration where its motion is prescribed.
        contacts: parameters of the contact law of each pin.
        walls: of each pin; empty where they are round.
        payload: mass at the tip [kg]; None without one.
    """

    state: State
    drives: list[Scalar]
    contacts: list[Contact]
    walls: list[Wall]
    payload: Scalar | None


@attrs.frozen(kw_only=True)
class Layout:
    """The layout of the numbers of a simulation; two are equal where their kernels are.

    Attributes:
        linkage: that moves.
        friction: the friction model.
        control: of the drives.
        located: whether impacts are located within a step; see ``event_location``.
        worn: whether the walls of the pins are worn; see ``worn_walls``.
        loaded: whether each run has a payload at the tip and a scale of its efforts.
    """

    linkage: Linkage = attrs.field(eq=_kernel_key)
    friction: FrictionModel
    control: Control
    located: bool = False
    worn: bool = False
    loaded: bool = False

    @property
    def n(self) -> int:
        """The number of coordinates."""
        return len(self.linkage.coordinates)

    @property
    def pins(self) -> int:
        """The number of pins with clearance."""
        return len(self.linkage.pins)

    @property
    def deflections(self) -> int:
        """The number of bristle deflections that are part of the state."""
        return self.pins if self.friction.law == "lugre" else 0

    @property
    def works(self) -> tuple[str, ...]:
        """The names of the works that are integrated along with the motion."""
        return (*WORKS, *ROD_WORKS) if self.linkage.rods else WORKS

    @property
    def states(self) -> int:
        """The number of coordinates, speeds, bristle deflections and works."""
        return 2 * self.n + self.deflections + len(self.works)

    @property
    def columns(self) -> int:
        """The length of a table row: an effort or acceleration per drive, for a controller also goal and speed."""
        return len(self.linkage.drives) * (3 if self.control == "pd+ff" else 1)

    @property
    def gains(self) -> int:
        """The number of controller gains, stiffness and damping of each drive, then payload and scale of efforts."""
        return (2 * len(self.linkage.drives) if self.control == "pd+ff" else 0) + (2 if self.loaded else 0)

    @property
    def sampled(self) -> int:
        """The length of a sample: the state, and the force of each pin."""
        return self.states + self.pins

    @property
    def wall_numbers(self) -> int:
        """The length of what is looked up of worn walls."""
        return len(Wall._fields) * self.pins if self.worn else 0

    def unpack(self, x: Sequence[Scalar]) -> Inputs:
        """Return what a row of numbers means."""
        numbers = iter(x)

        def take(count: int) -> list[Scalar]:
            return list(islice(numbers, count))

        q, qd = take(self.n), take(self.n)
        deflections = take(self.deflections) or [0.0] * self.pins
        take(len(self.works))
        impacts = [(take(1)[0], take(1)[0]) for _ in range(self.pins)]
        contacts = [Contact(*take(len(Contact._fields))) for _ in range(self.pins)]
        gains, columns, looked_up = take(self.gains), take(self.columns), take(self.wall_numbers)
        walls = [Wall(*looked_up[i : i + 3]) for i in range(0, len(looked_up), 3)]
        memories = [ContactMemory(*pair, bend) for pair, bend in zip(impacts, deflections, strict=True)]
        payload, scale = gains[-2:] if self.loaded else (None, None)
        drives = self._drives(q, qd, gains, columns)
        if scale is not None:
            kinds = [drive.kind for drive in self.linkage.drives]
            drives = [x * scale if kind == "effort" else x for x, kind in zip(drives, kinds, strict=True)]
        return Inputs(State(q, qd, memories), drives, contacts, walls, payload)

    def _drives(
        self, q: Sequence[Scalar], qd: Sequence[Scalar], gains: Sequence[Scalar], columns: Sequence[Scalar]
    ) -> list[Scalar]:
        """Return the efforts or accelerations of the drives: those of the table, plus the feedback of a controller."""
        if self.control == "effort":
            return list(columns)
        drives = []
        for k, i in enumerate(self.linkage.driven):
            effort, goal, speed = columns[3 * k : 3 * k + 3]
            drives.append(effort + gains[2 * k] * (goal - q[i]) + gains[2 * k + 1] * (speed - qd[i]))
        return drives

    def rates(self, x: Sequence[Scalar]) -> list[Scalar]:
        """Return the rates of the state, memory and force of each pin, and, where located, depths and their rates."""
        state, drives, contacts, walls, payload = self.unpack(x)
        linkage_rates = rates(self.linkage, self.friction, state, drives, contacts, walls=walls, payload=payload)
        pins = linkage_rates.pins
        bristles = [pin.deflection_rate for pin in pins][: self.deflections]
        impacts = [x for pin in pins for x in (pin.memory.touching, pin.memory.speed, pin.normal)]
        depths = [x for pin in pins for x in (pin.depth, pin.rate)] if self.located else []
        return [*state.qd, *linkage_rates.qdd, *bristles, *linkage_rates.powers, *impacts, *depths]

    def places(self, x: Sequence[Scalar]) -> list[Scalar]:
        """Return of each pin the direction of its gap and the rotation of its journal [rad]."""
        state = self.unpack(x).state
        placement = Placement(self.linkage, state.q, state.qd)
        return [angle for pin in self.linkage.pins for angle in pin_place(placement, pin)]


class SimulationCode(NamedTuple):
    """The code of a simulation.

    Attributes:
        source: of ``simulate``, Python for Numba.
        equations: LLVM IR of each ``lanes`` of the linkage, by the name under which the source finds it.
    """

    source: str
    equations: Mapping[str, str]


_HEAD = """from math import floor

import numpy as np
from numba import float64, int64, njit, types

"""
_LANES = """{name} = types.ExternalFunction("{symbol}", types.void(types.uintp, types.uintp))"""
_RATES = """@njit(error_model="numpy")
def rates(x, y, walls):
    lanes(x.ctypes.data, y.ctypes.data)"""
# First where the pins are, then how far their walls are there, then all else.
_WORN_RATES = """@njit(error_model="numpy")
def rates(x, y, walls):
    places(x.ctypes.data, y.ctypes.data)
    look_up_walls(x, y, walls)
    lanes(x.ctypes.data, y.ctypes.data)"""


def emit_simulation(layout: Layout, integrator: Integrator) -> SimulationCode:
    """Write the code of a simulation: its sizes, its equations, and the functions of the loop as they stand."""
    sizes = _layout_sizes(layout, integrator)
    functions = {"lanes": layout.rates, "places": layout.places} if layout.worn else {"lanes": layout.rates}
    emitted = {
        name: emit_lanes(function, sizes["INPUTS"], LANES, processor().target) for name, function in functions.items()
    }
    symbols = {name: f"armwright_{hashlib.sha256(one.ir.encode()).hexdigest()}" for name, one in emitted.items()}
    outputs = {"OUTPUTS": emitted["lanes"].outputs, "FARTHEST_CELL": wall_lookup.FARTHEST_CELL}
    rates_of_walls = [*_function_sources(wall_lookup, _COMPILED), _WORN_RATES] if layout.worn else [_RATES]
    events = _function_sources(event_location, _COMPILED) if layout.located else []
    source = "\n\n".join(
        [
            _HEAD,
            "\n".join(_LANES.format(name=name, symbol=symbol) for name, symbol in symbols.items()),
            "\n".join(f"{name} = {value!r}" for name, value in {**sizes, **outputs}.items()),
            *rates_of_walls,
            *events,
            *_function_sources(simulation_loop, _INLINED),
            _SIGNATURE.format(matrix='types.Array(float64, 2, "C", readonly=True)'),
            _function_source(simulation_loop.simulate),
            "",
        ]
    )
    return SimulationCode(source, {symbols[name]: one.ir for name, one in emitted.items()})


def _function_sources(module: ModuleType, decorator: str) -> list[str]:
    """Return the sources of the functions of a module in their order, but for the loop, which calls them."""
    functions = (x for x in vars(module).values() if inspect.isfunction(x) and x.__module__ == module.__name__)
    return [_function_source(x, decorator) for x in functions if x is not simulation_loop.simulate]


def _function_source(function: Callable[..., object], decorator: str = "") -> str:
    """Return the text of a function for an emitted source: its statements alone, whatever else they are read with.

    Args:
        function: one whose names all stand in the emitted source.
        decorator: a line to put above it.
    """
    (definition,) = ast.parse(inspect.getsource(function)).body
    assert isinstance(definition, ast.FunctionDef)  # noqa: S101 - what is emitted is ours
    if ast.get_docstring(definition) is not None:
        del definition.body[0]
    definition.returns = None
    for argument in definition.args.args:
        argument.annotation = None
    return f"{decorator}\n{ast.unparse(definition)}".lstrip("\n")


def _layout_sizes(layout: Layout, integrator: Integrator) -> dict[str, int]:
    """Return the sizes of a simulation, by their names in ``lane_layout``."""
    memory, parameters = 2 * layout.pins, len(Contact._fields) * layout.pins
    first_parameter = layout.states + memory
    first_gain = first_parameter + parameters
    first_drive = first_gain + layout.gains
    return {
        "LANES": LANES,
        "N": layout.n,
        "PINS": layout.pins,
        "STATES": layout.states,
        "MEMORY": memory,
        "PARAMETERS": parameters,
        "GAINS": layout.gains,
        "COLUMNS": layout.columns,
        "FIRST_MEMORY": layout.states,
        "FIRST_PARAMETER": first_parameter,
        "FIRST_GAIN": first_gain,
        "FIRST_DRIVE": first_drive,
        "FIRST_WALL": first_drive + layout.columns,
        "INPUTS": first_drive + layout.columns + layout.wall_numbers,
        "FIRST_DEPTH": layout.states + 3 * layout.pins,
        "RK4": integrator == "rk4",
        "STAGES": 4 if integrator == "rk4" else 1,
        "LOCATED": layout.located,
        "CHECK_EVERY": simulation_loop.CHECK_EVERY,
    }
