"""The rows of a table kept by columns: a number takes eight bytes, and a word is there once, however often written.

Objects of Python for every cell of a million rows would take a gigabyte.
"""

import math
from array import array
from collections.abc import Iterable, Mapping, Sequence

import attrs
import numpy as np

from armwright.arrays import Array


@attrs.frozen(eq=False)
class Columns:
    """Rows of a table, as many as were added; row numbers count from 0.

    Attributes:
        lines: of each row, its line in the file.
        numbers: by column; NaN where a row has none.
        words: by column; empty where a row has none.
    """

    lines: "array[int]"
    numbers: Mapping[str, "array[float]"]
    words: Mapping[str, list[str]]
    _known: dict[str, str] = attrs.field(factory=dict)

    @classmethod
    def of(cls, numbers: Iterable[str], words: Iterable[str]) -> "Columns":
        """Return columns without rows."""
        return cls(array("q"), {name: array("d") for name in numbers}, {name: [] for name in words})

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.lines)

    def add(self, line: int, numbers: Mapping[str, float | None], words: Mapping[str, str]) -> None:
        """Add a row.

        Args:
            line: of the file.
            numbers: those of the row.
            words: those of the row.
        """
        self.lines.append(line)
        for name, column in self.numbers.items():
            value = numbers[name]
            column.append(math.nan if value is None else value)
        for name, texts in self.words.items():
            text = words[name]
            texts.append(self._known.setdefault(text, text))

    def number(self, name: str, row: int) -> float | None:
        """Return a number of a row; None where it has none, or the table has no such column."""
        value = self.numbers[name][row] if name in self.numbers else math.nan
        return None if math.isnan(value) else value

    def word(self, name: str, row: int) -> str:
        """Return a word of a row; empty where it has none, or the table has no such column."""
        return self.words[name][row] if name in self.words else ""

    def stacked(self, names: Sequence[str]) -> Array:
        """Return (m, k) numbers of some columns."""
        return np.column_stack([np.frombuffer(self.numbers[name]) for name in names])
