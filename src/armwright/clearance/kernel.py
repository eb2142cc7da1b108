"""Compiled simulations: many runs of one linkage side by side in the lanes of a vector, step by step.

A run keeps its bits whatever runs beside it: no lane reads another.
"""

import textwrap
from collections.abc import Mapping, Sequence
from typing import Literal, TypeAlias

import attrs

from armwright.clearance import event_location
from armwright.clearance.equations import WORKS, Contact, ContactMemory, FrictionModel, State, rates
from armwright.clearance.linkage import Linkage
from armwright.tracing.emit import LANES, head, kernel_body
from armwright.tracing.scalar import Scalar

Integrator: TypeAlias = Literal["rk4", "semi-implicit"]
Control: TypeAlias = Literal["effort", "pd+ff"]
INTEGRATORS: tuple[Integrator, ...] = ("rk4", "semi-implicit")
CONTROLS: tuple[Control, ...] = ("effort", "pd+ff")

# After so many steps a simulation looks whether it is called off.
_LOOK = 1024

_SOURCE = """{head}{helpers}
{functions}
SIGNATURE = types.void(
    int64, int64, {matrix}, {matrix}, {matrix}, types.Array(float64, 3, "C", readonly=True),
    types.Array(float64, 1, "C", readonly=True), types.Array(int64, 1, "C", readonly=True),
    types.Array(float64, 3, "C"), types.Array(int64, 2, "C"), types.Array(float64, 2, "C"),
    types.Array(int64, 1, "C"),
)

def simulate(first, last, start, contacts, gains, table, lengths, kept, samples, counts, peaks, called_off):
    steps = table.shape[0]
    x = np.zeros({inputs} * {lanes})
    y = np.zeros({outputs} * {lanes})
    state = np.zeros({states} * {lanes})
    change = np.zeros({states} * {lanes})
    row = np.zeros({lanes}, dtype=np.int64)
{arrays}
    for begin in range(first, last, {lanes}):
        # Lanes that are left over run the last run once more.
        for k in range({lanes}):
            row[k] = min(begin + k, last - 1)
            for i in range({states}):
                state[i * {lanes} + k] = start[row[k], i]
            for i in range({parameters}):
                x[({first_contact} + i) * {lanes} + k] = contacts[row[k], i]
            for i in range({gains}):
                x[({first_gain} + i) * {lanes} + k] = gains[row[k], i]
            for i in range({kept}):
                x[({first_kept} + i) * {lanes} + k] = 0.0
            for i in range({pins}):
                peaks[row[k], i] = 0.0
                counts[row[k], i] = 0
        y[:] = 0.0
        for step in range(steps + 1):
            if step % {look} == 0 and called_off[0] != 0:
                return
            now = min(step, steps - 1)
            h = lengths[now]
            for stage in range({stages}):
                moment = 2 if step == steps else (stage + 1) // 2
                ahead = 0.0 if stage == 0 else (h if stage == 3 else 0.5 * h)
                for k in range({lanes}):
                    for i in range({columns}):
                        x[({first_drive} + i) * {lanes} + k] = table[now, moment, i]
                for j in range({states} * {lanes}):
                    x[j] = state[j] + ahead * y[j]
{body}
{again}
                if stage == 0:
                    for i in range({pins}):
                        for k in range({lanes}):
                            touching = y[({states} + 3 * i) * {lanes} + k]
                            # What touches at the start has not come with a blow.
                            if step > 0 and touching > x[({first_kept} + 2 * i) * {lanes} + k] and begin + k < last:
                                counts[row[k], i] += 1
                            x[({first_kept} + 2 * i) * {lanes} + k] = touching
                            x[({first_kept} + 2 * i + 1) * {lanes} + k] = y[({states} + 3 * i + 1) * {lanes} + k]
                            normal = y[({states} + 3 * i + 2) * {lanes} + k]
                            if normal > peaks[row[k], i]:
                                peaks[row[k], i] = normal
                    if kept[step] >= 0:
                        for k in range(min({lanes}, last - begin)):
                            for i in range({states}):
                                samples[row[k], kept[step], i] = state[i * {lanes} + k]
                            for i in range({pins}):
                                samples[row[k], kept[step], {states} + i] = y[({states} + 3 * i + 2) * {lanes} + k]
                    if step == steps:
                        break
{advance}
"""

_RK4 = """
                weight = 1.0 if stage == 0 or stage == 3 else 2.0
                if stage == 0:
                    for j in range({states} * {lanes}):
                        change[j] = y[j]
                else:
                    for j in range({states} * {lanes}):
                        change[j] += weight * y[j]
            if step < steps:
                sixth = h / 6.0
                for j in range({states} * {lanes}):
                    state[j] += sixth * change[j]
"""

# The new speeds move the coordinates.
_SEMI_IMPLICIT = """
            if step < steps:
                for j in range({n} * {lanes}, {states} * {lanes}):
                    state[j] += h * y[j]
                for j in range({n} * {lanes}):
                    state[j] += h * state[{n} * {lanes} + j]
"""


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
        """The number of bends of brushes that are part of the state."""
        return self.pins if self.rubbing.law == "lugre" else 0

    @property
    def states(self) -> int:
        """Coordinates, speeds, bends of brushes, works."""
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
    """Write the source of a simulation."""
    places = _places(layout)
    body = kernel_body(layout.rates, places["inputs"])
    sizes = {**places, "lanes": LANES, "stages": 4 if integrator == "rk4" else 1}
    loop = f"for k in range({LANES}):\n" + textwrap.indent(body.lines, " " * 4)
    parts = {"functions": "", "arrays": "", "again": "", "body": textwrap.indent(loop, " " * 16)}
    if layout.located:
        part = event_location.RK4 if integrator == "rk4" else event_location.SEMI_IMPLICIT
        lines = {"body": textwrap.indent(body.lines, " " * 8), "advance": _filled(part, sizes)}
        parts = {
            "functions": _filled(event_location.FUNCTIONS, {**sizes, **lines}),
            "arrays": _filled(event_location.ARRAYS, sizes),
            "again": _filled(event_location.AGAIN, sizes),
            "body": " " * 16 + "rates(x, y)",
        }
    return _SOURCE.format(
        head=head(sum(body.operations.values())),
        helpers=body.helpers,
        outputs=body.outputs,
        advance=_filled(_RK4 if integrator == "rk4" else _SEMI_IMPLICIT, sizes),
        look=_LOOK,
        matrix='types.Array(float64, 2, "C", readonly=True)',
        **parts,
        **sizes,
    )


def _filled(template: str, sizes: Mapping[str, object]) -> str:
    return template.format(**sizes).strip("\n")


def _places(layout: Layout) -> dict[str, int]:
    """Return where the rows of a simulation begin, and how many there are."""
    kept, parameters = 2 * layout.pins, len(Contact._fields) * layout.pins
    places = {"n": layout.n, "pins": layout.pins, "states": layout.states}
    places |= {"kept": kept, "parameters": parameters, "gains": layout.gains, "columns": layout.columns}
    places["first_depth"] = layout.states + 3 * layout.pins
    row = layout.states
    for name, count in (("kept", kept), ("contact", parameters), ("gain", layout.gains), ("drive", layout.columns)):
        places[f"first_{name}"] = row
        row += count
    return {**places, "inputs": row}
