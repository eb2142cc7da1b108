"""The cell of a run, around the machine that runs the exported program: its inputs, on the clock of the run."""

from collections.abc import Mapping

from armwright.arrays import Array
from armwright.cell.model import Cell
from armwright.cell.outputs import Output
from armwright.cell.signals import Signals
from armwright.export.checkers.actions import Action, OutputAction, PulseAction
from armwright.kinematics.forward_kinematics import forward


class CellWorld:
    """What a controller reads while it runs a program; what it has done tells what time it is.

    Attributes:
        step: the servo period of the cell [s].
    """

    def __init__(self, cell: Cell, ends: tuple[float, ...], configurations: Mapping[str, Array] | None = None) -> None:
        """Begin at time zero.

        Args:
            cell: of the run.
            ends: when each thing was over that the program did, texts left out [s].
            configurations: by arm, (k, n) at the servo ticks of the run, which zones of the cell look at.
        """
        self.step = cell.period
        self._ends, self._count = ends, 0
        self._signals = Signals(cell.inputs)
        known = configurations or {}
        for name, source in cell.inputs.items():
            if source.zone is not None and source.zone.arm in known:
                arm = cell.arms[source.zone.arm]
                tools = arm.base @ forward(arm.arm, known[source.zone.arm])
                self._signals.note_zone(name, source.zone.changes(tools[:, :3, 3], 0.0, cell.period))
        addressed = {name: source.address for name, source in cell.inputs.items()}
        self._inputs = _names(addressed)
        self._outputs = _names({name: device.output for name, device in (cell.devices or {}).items()})

    @property
    def now(self) -> float:
        """The time on the clock of the run [s]."""
        return self._signals.now

    def read(self, address: int | str, *, is_input: bool) -> bool:
        """Return whether an input or an output is on."""
        name = (self._inputs if is_input else self._outputs).get(address)
        if name is None:
            return False
        return bool(self._signals.input(name) if is_input else self._signals.output(name))

    def passed(self, action: Action) -> None:
        """Take note of what the controller has done: as late as in the run."""
        if self._count < len(self._ends):
            self._signals.now = self._ends[self._count]
            self._count += 1
        if isinstance(action, OutputAction | PulseAction) and (name := self._outputs.get(action.output)) is not None:
            if isinstance(action, PulseAction):
                self._signals.pulse(name, action.seconds)
            else:
                self._signals.write(name, float(action.on))

    def wait(self) -> None:
        """Let one servo period go by."""
        self._signals.now += self.step


def _names(addresses: Mapping[str, Output | None]) -> dict[int | str, str]:
    """Return names by the numbers and the names of signals of a controller."""
    found: dict[int | str, str] = {}
    for name, address in addresses.items():
        if address is not None:
            found |= {key: name for key in (address.number, address.signal) if key is not None}
    return found
