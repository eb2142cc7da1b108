"""Compiled simulations: many runs of one linkage side by side in the lanes of a vector, step by step.

A run keeps its bits whatever runs beside it: no lane reads another.
"""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import Literal, TypeAlias

import attrs

from armwright.clearance import event_location, simulation_loop
from armwright.clearance.equations import WORKS, Contact, ContactMemory, FrictionModel, State, rates
from armwright.clearance.linkage import Linkage
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
# What the loop calls; it is last itself.
_EVENTS = (
    event_location.set_drives,
    event_location.evaluate,
    event_location.add_part,
    event_location.make_part,
    event_location.crossing_fraction,
    event_location.find_impacts,
    event_location.correct,
    event_location.locate_impacts,
    event_location.come_down,
)
_PARTS = (
    simulation_loop.begin_lanes,
    simulation_loop.begin_stage,
    simulation_loop.remember,
    simulation_loop.take_sample,
    simulation_loop.add_stage,
    simulation_loop.add_step,
)


@attrs.frozen(kw_only=True)
class Layout:
    """How the numbers of a simulation are laid out.

    Attributes:
        linkage: what moves.
        rubbing: how friction is worked out.
        control: what the drives do.
        located: whether it is found where in a step a journal comes to its wall; see ``event_location``.
    """

    linkage: Linkage
    rubbing: FrictionModel
    control: Control
    located: bool = False

    @property
    def n(self) -> int:
        """The number of coordinates."""
        return len(self.linkage.coordinates)

    @property
    def pins(self) -> int:
        """The number of pins with play."""
        return len(self.linkage.pins)

    @property
    def bends(self) -> int:
        """The number of bends of bristles that are part of the state."""
        return self.pins if self.rubbing.law == "lugre" else 0

    @property
    def states(self) -> int:
        """Coordinates, speeds, bends of bristles, works."""
        return 2 * self.n + self.bends + len(WORKS)

    @property
    def columns(self) -> int:
        """Numbers of a table for one moment: of each drive an effort or acceleration; for a controller also a goal."""
        return len(self.linkage.drives) * (3 if self.control == "pd+ff" else 1)

    @property
    def gains(self) -> int:
        """Numbers of the controller: of each drive one for the place and one for the speed."""
        return 2 * len(self.linkage.drives) if self.control == "pd+ff" else 0

    @property
    def sampled(self) -> int:
        """Numbers of a sample: the state, and of each pin the force."""
        return self.states + self.pins

    def unpack(self, x: Sequence[Scalar]) -> tuple[State, list[Scalar], list[Contact]]:
        """Return state, drives and contacts of a row of numbers."""
        n, rest = self.n, iter(x)
        q, qd = ([next(rest) for _ in range(n)] for _ in range(2))
        bends = [next(rest) for _ in range(self.bends)] or [0.0] * self.pins
        for _ in WORKS:
            next(rest)
        kept = [(next(rest), next(rest)) for _ in range(self.pins)]
        contacts = [Contact(*(next(rest) for _ in Contact._fields)) for _ in range(self.pins)]
        gains = [next(rest) for _ in range(self.gains)]
        columns = [next(rest) for _ in range(self.columns)]
        touches = [ContactMemory(touching, speed, bend) for (touching, speed), bend in zip(kept, bends, strict=True)]
        return State(q, qd, touches), self._drives(q, qd, gains, columns), contacts

    def _drives(
        self, q: Sequence[Scalar], qd: Sequence[Scalar], gains: Sequence[Scalar], columns: Sequence[Scalar]
    ) -> list[Scalar]:
        """Return what the drives do: as in the table, or what brings them to the goal too."""
        if self.control == "effort":
            return list(columns)
        drives = []
        for k, i in enumerate(self.linkage.driven):
            effort, goal, speed = columns[3 * k : 3 * k + 3]
            drives.append(effort + gains[2 * k] * (goal - q[i]) + gains[2 * k + 1] * (speed - qd[i]))
        return drives

    def rates(self, x: Sequence[Scalar]) -> list[Scalar]:
        """Return the rates of the state, of each pin what is kept and its force; depths and their rates if located."""
        state, drives, contacts = self.unpack(x)
        found = rates(self.linkage, self.rubbing, state, drives, contacts)
        bending = [pin.bending for pin in found.pins][: self.bends]
        kept = [[pin.touch.touching, pin.touch.speed, pin.normal] for pin in found.pins]
        depths = [one for pin in found.pins for one in (pin.depth, pin.rate)] if self.located else []
        return [*state.qd, *found.qdd, *bending, *found.powers, *(one for pin in kept for one in pin), *depths]


def emit_simulation(layout: Layout, integrator: Integrator) -> str:
    """Write the source of a simulation: its sizes, its equations, and the functions of the loop as they stand."""
    sizes = _sizes(layout, integrator)
    body = kernel_body(layout.rates, sizes["INPUTS"])
    events = [function_source(function, _COMPILED) for function in _EVENTS] if layout.located else []
    equations = textwrap.indent(body.lines, " " * 8)
    return "\n\n".join(
        [
            head(sum(body.operations.values())) + body.helpers,
            "\n".join(f"{name} = {value!r}" for name, value in {**sizes, "OUTPUTS": body.outputs}.items()),
            f"{_COMPILED if layout.located else _INLINED}\ndef rates(x, y):\n    for k in range({LANES}):\n{equations}",
            *events,
            *(function_source(function, _INLINED) for function in _PARTS),
            _SIGNATURE.format(matrix='types.Array(float64, 2, "C", readonly=True)'),
            function_source(simulation_loop.simulate),
            "",
        ]
    )


def _sizes(layout: Layout, integrator: Integrator) -> dict[str, int]:
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
