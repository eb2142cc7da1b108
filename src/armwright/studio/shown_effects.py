"""What has happened in a run up to the time that is shown, without looking through all of it for every picture."""

from __future__ import annotations

from collections.abc import Sequence

from armwright.program.vm.recording import Effect, sort_effects

# Times are the same within this [s].
_SAME = 1e-9


class ShownEffects:
    """The effects of a run that have begun by a time.

    Attributes:
        begun: in the order in which they were taken up.
        latest: the latest of each process, by its name.
        openings: how far the fingers of each arm are open, 0 to 1, by its name; those that have not moved are missing.
        devices: whether each device is on, by its name; those that have not been switched are missing.
    """

    def __init__(self) -> None:
        """Begin with nothing."""
        self._start()

    def _start(self) -> None:
        self.begun: list[Effect] = []
        self.latest: dict[str, Effect] = {}
        self.openings: dict[str, float] = {}
        self.devices: dict[str, bool] = {}
        self._waiting: list[Effect] = []
        self._taken, self._time = 0, 0.0
        self._source: Sequence[Effect] = ()

    def update(self, effects: Sequence[Effect], time: float) -> None:
        """Take what has begun by a time [s].

        Args:
            effects: of the run; those that were there before stay, unless the run has gone back.
            time: what is shown.
        """
        if effects is not self._source or len(effects) < self._taken or time < self._time - _SAME:
            self._start()
            self._source = effects
        self._waiting += effects[self._taken :]
        self._taken, self._time = len(effects), time
        begun = [effect for effect in self._waiting if effect.t0 <= time + _SAME]
        if not begun:
            return
        self._waiting = [effect for effect in self._waiting if effect.t0 > time + _SAME]
        begun = list(sort_effects(begun))
        self.begun += begun
        for effect in begun:
            self.latest[effect.process] = effect
            if effect.arm is not None and effect.kind in {"OPEN", "GRASP"}:
                self.openings[effect.arm] = 1.0 if effect.kind == "OPEN" else 0.0
            elif effect.kind == "OPERATE":
                device, _, state = effect.text.rpartition(" ")
                self.devices[device.upper()] = state == "ON"
