"""Compiled simulations: many runs of one linkage side by side in the lanes of a vector, step by step.

A run keeps its bits whatever runs beside it: no lane reads another.
"""

from __future__ import annotations

import json
import textwrap
from collections.abc import Sequence
from inspect import isfunction
from itertools import islice
from types import ModuleType
from typing import Literal, TypeAlias

import attrs

from armwright.clearance import event_location, simulation_loop
from armwright.clearance.equations import WORKS, Contact, ContactMemory, FrictionModel, State, rates
from armwright.clearance.linkage import Linkage, Material
from armwright.tracing.emit import LANES, function_source, head, kernel_body
from armwright.tracing.scalar import Scalar

Integrator: TypeAlias = Literal["rk4", "semi-implicit"]
Control: TypeAlias = Literal["effort", "pd+ff"]
INTEGRATORS: tuple[Integrator, ...] = ("rk4", "semi-implicit")
CONTROLS: tuple[Control, ...] = ("effort", "pd+ff")

# The arguments of ``simulation_loop.simulate``; arrays that are only read come first.
_SIGNATURE = """SIGNATURE = types.void(
    int64, int64, {matrix}, {matrix}, {matrix}, types.Array(float64, 3, "C", readonly=True),
    types.Array(float64, 1, "C", readonly=True), types.Array(int64, 1, "C", readonly=True),
    types.Array(float64, 3, "C"), types.Array(int64, 2, "C"), types.Array(float64, 2, "C"),
    types.Array(int64, 1, "C"),
)
"""
_COMPILED = '@njit(error_model="numpy")'
# Small parts of the loop, and its equations where they stand in one place, become part of it.
_INLINED = '@njit(error_model="numpy", forceinline=True)'


def _kernel_key(linkage: Linkage) -> str:
    """Return what the kernels of two linkages share, whatever their names, clearances and materials."""
    pins = [attrs.evolve(pin, clearance=0.0) for pin in linkage.pins]
    return json.dumps(attrs.evolve(linkage, name="", pins=pins, material=Material(), assembly={}).as_data())


@attrs.frozen(kw_only=True)
class Layout:
    """The layout of the numbers of a simulation; two are equal where their kernels are.

    Attributes:
        linkage: that moves.
        friction: the friction model.
        control: of the drives.
        located: whether impacts are located within a step; see ``event_location``.
    """

    linkage: Linkage = attrs.field(eq=_kernel_key)
    friction: FrictionModel
    control: Control
    located: bool = False

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
    def states(self) -> int:
        """The number of coordinates, speeds, bristle deflections and works."""
        return 2 * self.n + self.deflections + len(WORKS)

    @property
    def columns(self) -> int:
        """The length of a table row: an effort or acceleration per drive, for a controller also goal and speed."""
        return len(self.linkage.drives) * (3 if self.control == "pd+ff" else 1)

    @property
    def gains(self) -> int:
        """The number of controller gains: stiffness and damping of each drive."""
        return 2 * len(self.linkage.drives) if self.control == "pd+ff" else 0

    @property
    def sampled(self) -> int:
        """The length of a sample: the state, and the force of each pin."""
        return self.states + self.pins

    def unpack(self, x: Sequence[Scalar]) -> tuple[State, list[Scalar], list[Contact]]:
        """Return state, drives and contacts of a row of numbers."""
        numbers = iter(x)

        def take(count: int) -> list[Scalar]:
            return list(islice(numbers, count))

        q, qd = take(self.n), take(self.n)
        deflections = take(self.deflections) or [0.0] * self.pins
        take(len(WORKS))
        impacts = [(take(1)[0], take(1)[0]) for _ in range(self.pins)]
        contacts = [Contact(*take(len(Contact._fields))) for _ in range(self.pins)]
        gains, columns = take(self.gains), take(self.columns)
        memories = [ContactMemory(*pair, bend) for pair, bend in zip(impacts, deflections, strict=True)]
        return State(q, qd, memories), self._drives(q, qd, gains, columns), contacts

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
        state, drives, contacts = self.unpack(x)
        linkage_rates = rates(self.linkage, self.friction, state, drives, contacts)
        pins = linkage_rates.pins
        bristles = [pin.deflection_rate for pin in pins][: self.deflections]
        impacts = [x for pin in pins for x in (pin.memory.touching, pin.memory.speed, pin.normal)]
        depths = [x for pin in pins for x in (pin.depth, pin.rate)] if self.located else []
        return [*state.qd, *linkage_rates.qdd, *bristles, *linkage_rates.powers, *impacts, *depths]


def emit_simulation(layout: Layout, integrator: Integrator) -> str:
    """Write the source of a simulation: its sizes, its equations, and the functions of the loop as they stand."""
    sizes = _layout_sizes(layout, integrator)
    body = kernel_body(layout.rates, sizes["INPUTS"])
    events = _function_sources(event_location, _COMPILED) if layout.located else []
    equations = textwrap.indent(body.lines, " " * 8)
    return "\n\n".join(
        [
            head(body.operations),
            "\n".join(f"{name} = {value!r}" for name, value in {**sizes, "OUTPUTS": body.outputs}.items()),
            f"{_COMPILED if layout.located else _INLINED}\ndef rates(x, y):\n    for k in range({LANES}):\n{equations}",
            *events,
            *_function_sources(simulation_loop, _INLINED),
            _SIGNATURE.format(matrix='types.Array(float64, 2, "C", readonly=True)'),
            function_source(simulation_loop.simulate),
            "",
        ]
    )


def _function_sources(module: ModuleType, decorator: str) -> list[str]:
    """Return the sources of the functions of a module in their order, but for the loop, which calls them."""
    functions = (x for x in vars(module).values() if isfunction(x) and x.__module__ == module.__name__)
    return [function_source(x, decorator) for x in functions if x is not simulation_loop.simulate]


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
        "INPUTS": first_drive + layout.columns,
        "FIRST_DEPTH": layout.states + 3 * layout.pins,
        "RK4": integrator == "rk4",
        "STAGES": 4 if integrator == "rk4" else 1,
        "LOCATED": layout.located,
        "CHECK_EVERY": simulation_loop.CHECK_EVERY,
    }
