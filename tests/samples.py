"""Random samples: a tenth of each in `make test`, all of it in `make proof`, drawn anew every time, the seed told."""

import json
import os
import secrets
from collections.abc import Iterator
from pathlib import Path

import attrs
import numpy as np

# What `make test` draws of a sample that `make proof` runs whole; `@pytest.mark.share(0.01)` names another part.
SHARE = 0.1
WHOLE = bool(os.environ.get("ARMWRIGHT_PROOF"))


def examples(full: int) -> int:
    """Return how many examples Hypothesis makes of a test: all in `make proof`, a third otherwise, as by default."""
    return full if WHOLE else round(full / 3)


@attrs.define
class Sample:
    """The cases that one test draws.

    Attributes:
        test: the test's id, as pytest writes it.
        seed: of all cases; ``ARMWRIGHT_SEED`` repeats one.
        whole: whether the full numbers are run.
        share: what is drawn of them otherwise.
        case: the number of the case under way; -1 before the first.
        rows: what was counted, for the table of `make proof`.
    """

    test: str
    seed: int
    whole: bool
    share: float = SHARE
    case: int = -1
    rows: list[dict[str, object]] = attrs.field(factory=list)

    def count(self, full: int) -> int:
        """Return how many cases to draw of ``full``: all in `make proof`, the test's share otherwise, never none."""
        return full if self.whole else max(1, round(full * self.share))

    def cases(self, full: int, *, stream: int = 0) -> Iterator[np.random.Generator]:
        """Draw the cases of a sample of ``full``, each with random numbers of its own.

        Args:
            full: how many `make proof` draws.
            stream: another number gives other cases, where one test draws several samples.
        """
        only = os.environ.get("ARMWRIGHT_CASE")
        numbers = range(self.count(full)) if only is None else [int(only)]
        for self.case in numbers:
            yield np.random.default_rng([self.seed, stream, self.case])

    def record(self, what: str, count: int, failures: int, **figures: object) -> None:
        """Put a row into the table of `make proof`: what was tried, how often, how often it failed, worst figures."""
        row = {"test": self.test, "what": what, "seed": self.seed, "count": count, "failures": failures, **figures}
        self.rows.append(row)

    def how_to_repeat(self) -> str:
        """Say how to run what failed once more."""
        case = f" ARMWRIGHT_CASE={self.case}" if self.case >= 0 else ""
        whole = " ARMWRIGHT_PROOF=out/proof" if self.whole else ""
        return f"ARMWRIGHT_SEED={self.seed}{case}{whole} pytest '{self.test}'"

    def keep(self, folder: Path) -> None:
        """Write the rows where `make proof` looks for them."""
        if self.rows:
            folder.mkdir(parents=True, exist_ok=True)
            name = "".join(letter if letter.isalnum() else "_" for letter in self.test)
            (folder / f"{name}.json").write_text(json.dumps(self.rows, indent=1))


def drawn(test: str, share: float = SHARE) -> Sample:
    """Return the sample of a test: a new seed unless ``ARMWRIGHT_SEED`` gives one, whole in `make proof`."""
    seed = os.environ.get("ARMWRIGHT_SEED")
    number = secrets.randbelow(10**9) if seed is None else int(seed)
    return Sample(test, number, WHOLE, share)
