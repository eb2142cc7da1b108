"""The progress of a sweep."""

import attrs
import numpy as np
import numpy.typing as npt


@attrs.frozen(kw_only=True)
class Progress:
    """The progress of a sweep.

    Attributes:
        runs: of the whole sweep.
        done: finished runs, failed ones included.
        resumed: runs of these that an earlier start finished.
        failed: finished runs that failed.
        seconds: since this start [s].
    """

    runs: int
    done: int = 0
    resumed: int = 0
    failed: int = 0
    seconds: float = 0.0

    def with_runs(self, status: npt.NDArray[np.int8]) -> "Progress":
        """Return the progress after some more runs, of each of which the status is given."""
        return attrs.evolve(self, done=self.done + len(status), failed=self.failed + int(np.count_nonzero(status)))

    @property
    def rate(self) -> float:
        """Runs per second of this start [1/s]."""
        return (self.done - self.resumed) / self.seconds if self.seconds > 0 else 0.0

    @property
    def remaining(self) -> float | None:
        """Time that the other runs take at this rate [s]; None before the first run is finished."""
        return (self.runs - self.done) / self.rate if self.rate > 0 else None
