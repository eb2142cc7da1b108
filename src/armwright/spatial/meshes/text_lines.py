"""The lines of mesh files that are text, as words, with bounds on their length, and the numbers in them."""

from __future__ import annotations

import io
import math
from collections.abc import Iterator, Sequence
from pathlib import Path

from armwright.errors import FileFormatError, shown
from armwright.files.limits import limit, limit_message


def words_of_lines(path: Path, data: bytes) -> Iterator[tuple[int, list[bytes]]]:
    """Give the words of each line that has any, with its number from 1.

    Raises:
        FileFormatError: a line is longer than the limit.
    """
    longest = limit("line_characters")
    for number, line in enumerate(io.BytesIO(data), 1):
        if len(line) > longest:
            message = f"a line is too long: {limit_message('line_characters')}"
            raise FileFormatError(path, number, "", message)
        words = line.split()
        if words:
            yield number, words


def three_numbers(path: Path, line: int, key: str, words: Sequence[bytes]) -> list[float]:
    """Return the first three words as numbers.

    Raises:
        FileFormatError: they are fewer, no numbers, or not finite.
    """
    numbers = [number_of(path, line, key, word) for word in words[:3]]
    if len(numbers) < 3:
        raise FileFormatError(path, line, key, f"expected 3 numbers, got {len(numbers)}")
    return numbers


def number_of(path: Path, line: int, key: str, word: bytes) -> float:
    """Return a word as a finite number.

    Raises:
        FileFormatError: it is none.
    """
    try:
        number = float(word) if b"_" not in word else math.nan
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        text = word.decode("utf-8", "replace")
        raise FileFormatError(path, line, key, f"expected a finite number, got {shown(text)}")
    return number
