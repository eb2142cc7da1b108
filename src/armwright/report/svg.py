"""SVG text that does not depend on the machine: rounded coordinates and numbered identifiers."""

import re

# Decimals of a coordinate [pt]; a screen shows a single one.
_DECIMALS = 2
# Difference of coordinates of equal drawings at most [pt]: a number between two rounded values may fall to either.
_TOLERANCE = 0.025
_METADATA = re.compile(r"\s*<metadata>.*?</metadata>", re.DOTALL)
# Coordinates; not the factors of scales and matrices, nor widths, colours and texts.
_COORDINATES = re.compile(r'\b(?:d|x|y|x1|y1|x2|y2|width|height)="[^"]*"|translate\([^)]*\)')
_NUMBER = re.compile(r"-?\d+\.\d+")
# Identifiers that are hashes of coordinates.
_HASHED = re.compile(r'\bid="([A-Za-z]\w*?)([0-9a-f]{10})"')


def normalize_svg(text: str) -> str:
    """Return a drawing whose text does not depend on the last digits of its numbers, nor on its metadata.

    Args:
        text: text of an SVG file by Matplotlib.
    """
    text = _METADATA.sub("", text, count=1)
    text = _COORDINATES.sub(lambda match: _NUMBER.sub(_round_match, match.group()), text)
    names: dict[str, str] = {}
    for kind, code in _HASHED.findall(text):
        names.setdefault(kind + code, f"{kind}-{len(names) + 1}")
    if not names:
        return text
    return re.sub("|".join(map(re.escape, names)), lambda match: names[match.group()], text)


def alike(new: str, old: str) -> bool:
    """Whether two drawings are equal except for differently rounded coordinates."""
    (words, numbers), (others, before) = _split_coordinates(new), _split_coordinates(old)
    if words != others or len(numbers) != len(before):
        return False
    return all(abs(a - b) <= _TOLERANCE for a, b in zip(numbers, before, strict=True))


def _round_match(match: re.Match[str]) -> str:
    number = f"{round(float(match.group()), _DECIMALS) + 0.0:.{_DECIMALS}f}"
    return number.rstrip("0").rstrip(".")


def _split_coordinates(text: str) -> tuple[str, list[float]]:
    """Return a drawing without its coordinates, and the coordinates."""
    numbers: list[float] = []

    def take(match: re.Match[str]) -> str:
        numbers.append(float(match.group()))
        return "#"

    words = _COORDINATES.sub(lambda match: re.sub(r"-?\d+(?:\.\d+)?", take, match.group()), text)
    return words, numbers
