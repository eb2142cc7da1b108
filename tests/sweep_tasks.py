"""Tasks for sweeps, in a module of their own: worker processes import it; and a person who interrupts one."""

import os
import signal
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from armwright.sweep.progress import Progress
from armwright.sweep.task import Axis, Output

TIMES = np.linspace(0.0, 1.0, 5)


@attrs.frozen(kw_only=True)
class Fall:
    """A stone falls with a start speed: where it is over time, and how far it came. Mishaps are on request."""

    name: str = "fall"
    gravity: float = 9.81
    samples: int = TIMES.size
    calls: Path | None = None
    """Every call appends the process and the speeds to this file."""
    seconds: float = 0.0
    """A call takes so long [s]."""
    company: int = 1
    """A call waits until so many processes have called, five minutes at most."""
    raises_above: float = np.inf
    kills_above: float = np.inf
    unless: Path | None = None
    """No worker is killed where this file is; the first to be killed makes it."""

    @property
    def settings(self) -> Mapping[str, Any]:
        """What the results depend on."""
        return {"gravity": self.gravity, "samples": self.samples}

    @property
    def outputs(self) -> Mapping[str, Output]:
        """What comes out."""
        return {
            "height": Output(description="height over the start", units="m", dims=("time",)),
            "depth": Output(description="how far below the start it ends", units="m"),
        }

    @property
    def axes(self) -> Mapping[str, Axis]:
        """When the stone is looked at."""
        return {"time": Axis(values=np.linspace(0.0, 1.0, self.samples), units="s", description="since the start")}

    def __call__(self, points: np.ndarray) -> dict[str, Any]:
        """Throw some stones upwards."""
        speed = points[:, :1]
        if self.calls is not None:
            handle = os.open(self.calls, os.O_WRONLY | os.O_APPEND | os.O_CREAT)
            os.write(handle, f"{os.getpid()} {' '.join(map(repr, speed[:, 0].tolist()))}\n".encode())
            os.close(handle)
        time.sleep(self.seconds)
        late = time.monotonic() + 300
        while self.calls is not None and self.company > len({process for process, _ in calls_of(self.calls)}):
            assert time.monotonic() < late
            time.sleep(0.01)
        if (speed > self.kills_above).any() and not (self.unless and self.unless.exists()):
            if self.unless:
                self.unless.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        if (speed > self.raises_above).any():
            raise FloatingPointError("it left the atmosphere")
        height = speed * self.axes["time"].values - 0.5 * self.gravity * self.axes["time"].values ** 2
        return {"height": height, "depth": -height[:, -1]}


def calls_of(path: Path) -> list[tuple[int, tuple[float, ...]]]:
    """The calls of a task: process and speeds."""
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    return [(int(line.split()[0]), tuple(map(float, line.split()[1:]))) for line in lines]


@attrs.frozen(kw_only=True)
class Threads:
    """Asks how many threads linear algebra has."""

    name: str = "threads"
    settings: Mapping[str, Any] = attrs.field(factory=dict)
    outputs: Mapping[str, Output] = attrs.field(factory=lambda: {"threads": Output()})
    axes: Mapping[str, Axis] = attrs.field(factory=dict)

    def most(self) -> int:
        """The most threads that any library has."""
        from threadpoolctl import threadpool_info

        return max(one["num_threads"] for one in threadpool_info())

    def __call__(self, points: np.ndarray) -> dict[str, Any]:
        """The same for all points."""
        return {"threads": np.full(len(points), self.most())}


class Stop(Exception):  # noqa: N818 - it is no error
    """The person has seen enough."""


def stop_after(runs: int) -> Callable[[Progress], None]:
    """Interrupt a sweep after some runs."""

    def progress(now: Progress) -> None:
        if now.done >= runs:
            raise Stop

    return progress
