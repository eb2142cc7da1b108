"""SVG text that does not depend on the machine: coordinates to a hundredth of a point, names of parts by number."""

import re

# Places behind the point of a coordinate [pt]: a screen shows a tenth.
_PLACES = 2
# Two drawings are one if no coordinate differs by more [pt]: numbers on the edge between two roundings.
_HAIR = 0.025
_METADATA = re.compile(r"\s*<metadata>.*?</metadata>", re.DOTALL)
# Coordinates; not the factors of scales and matrices, nor widths, colours and what people read.
_COORDINATES = re.compile(r'\b(?:d|x|y|x1|y1|x2|y2|width|height)="[^"]*"|translate\([^)]*\)')
_NUMBER = re.compile(r"-?\d+\.\d+")
# Parts are called by a hash of their coordinates.
_HASHED = re.compile(r'\bid="([A-Za-z]\w*?)([0-9a-f]{10})"')


def steady(text: str) -> str:
    """Return a drawing whose text does not depend on the last digits of its numbers, nor on who wrote it.

    Args:
        text: of an SVG file, as Matplotlib writes it.
    """
    text = _METADATA.sub("", text, count=1)
    text = _COORDINATES.sub(lambda found: _NUMBER.sub(_rounded, found.group()), text)
    names: dict[str, str] = {}
    for kind, code in _HASHED.findall(text):
        names.setdefault(kind + code, f"{kind}-{len(names) + 1}")
    if not names:
        return text
    return re.sub("|".join(map(re.escape, names)), lambda found: names[found.group()], text)


def alike(new: str, old: str) -> bool:
    """Whether two drawings are one but for coordinates that were rounded otherwise."""
    (words, numbers), (others, before) = _parted(new), _parted(old)
    if words != others or len(numbers) != len(before):
        return False
    return all(abs(a - b) <= _HAIR for a, b in zip(numbers, before, strict=True))


def _rounded(found: re.Match[str]) -> str:
    number = f"{round(float(found.group()), _PLACES) + 0.0:.{_PLACES}f}"
    return number.rstrip("0").rstrip(".")


def _parted(text: str) -> tuple[str, list[float]]:
    """Return a drawing without its coordinates, and the coordinates."""
    numbers: list[float] = []

    def take(found: re.Match[str]) -> str:
        numbers.append(float(found.group()))
        return "#"

    words = _COORDINATES.sub(lambda one: re.sub(r"-?\d+(?:\.\d+)?", take, one.group()), text)
    return words, numbers
