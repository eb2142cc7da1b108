"""How far a sweep is: told to who started it, who may show it."""

import time

import attrs


@attrs.frozen(kw_only=True)
class Progress:
    """How far a sweep is.

    Attributes:
        runs: of the whole sweep.
        done: runs that are finished, those that failed too.
        found: runs of these that an earlier start had finished.
        failed: runs of those finished that failed.
        seconds: since this start [s].
    """

    runs: int
    done: int
    found: int
    failed: int
    seconds: float

    @property
    def rate(self) -> float:
        """Runs per second of this start [1/s]."""
        return (self.done - self.found) / self.seconds if self.seconds > 0 else 0.0

    @property
    def left(self) -> float | None:
        """Time that the rest takes at this rate [s]; None before the first run is finished."""
        return (self.runs - self.done) / self.rate if self.rate > 0 else None


class Counter:
    """Counts finished runs; the only part of a sweep with a clock."""

    def __init__(self, runs: int, found: int, failed: int = 0) -> None:
        """Begin to count where an earlier start ended."""
        self._runs, self._found = runs, found
        self._done, self._failed = found, failed
        self._began = time.monotonic()

    def add(self, done: int, failed: int) -> None:
        """Count runs that were finished just now."""
        self._done += done
        self._failed += failed

    def now(self) -> Progress:
        """Return how far the sweep is."""
        return Progress(
            runs=self._runs,
            done=self._done,
            found=self._found,
            failed=self._failed,
            seconds=time.monotonic() - self._began,
        )
