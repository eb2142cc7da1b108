"""SVG text that does not depend on the machine: rounded coordinates and numbered identifiers; and drawings of pages."""

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
# What a drawing has beside its shapes: names of shapes for those who read the text, and a style for all of the file.
_COMMENT, _STYLE_SHEET = re.compile(r"\s*<!--.*?-->", re.DOTALL), re.compile(r"\s*<style\b.*?</style>", re.DOTALL)
_ROOT, _VIEW_BOX = re.compile(r"<svg\b[^>]*>"), re.compile(r'\bviewBox="[^"]*"')
_IDENTIFIER = re.compile(r' ?\bid="([^"]*)"')
_REFERENCE = re.compile(r'(\b(?:xlink:)?href="|url\()#([^")]*)')
_STYLED, _COLOUR = re.compile(r'\bstyle="[^"]*"'), re.compile(r"#([0-9a-f]{6})\b")
# Matplotlib's series in the colours of the pages; red marks what is commanded or bounds.
_SERIES = {
    "1f77b4": "--c0",
    "ff7f0e": "--c1",
    "2ca02c": "--c2",
    "d62728": "--red",
    "ff0000": "--red",
    "9467bd": "--c3",
    "8c564b": "--c4",
    "e377c2": "--c5",
    "bcbd22": "--arm3",
    "17becf": "--c6",
}


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


def inline_svg(text: str, name: str) -> str:
    """Return a drawing as an element of a page, in the colours of the page, which follow light and dark.

    Black and white become ink and paper, greys mixtures of both, and series colours variables of ``page.css``; colours
    of maps stay. Several drawings of a page share no identifiers.

    Args:
        text: text of an SVG file.
        name: name of the drawing, unique on the page; its identifiers begin with it.
    """
    text = _STYLE_SHEET.sub("", _COMMENT.sub("", text[text.index("<svg") :]))
    text = _STYLED.sub(lambda match: _COLOUR.sub(_page_colour, match.group()), text)
    known = {identifier for _, identifier in _REFERENCE.findall(text)}
    text = _REFERENCE.sub(lambda match: f"{match[1].removeprefix('xlink:')}#{name}.{match[2]}", text)
    text = _IDENTIFIER.sub(lambda match: f' id="{name}.{match[1]}"' if match[1] in known else "", text)
    return _ROOT.sub(lambda match: f"<svg {' '.join(_VIEW_BOX.findall(match.group()))}>", text, count=1).rstrip()


def alike(new: str, old: str) -> bool:
    """Whether two drawings are equal except for differently rounded coordinates."""
    (words, numbers), (others, before) = _split_coordinates(new), _split_coordinates(old)
    if words != others or len(numbers) != len(before):
        return False
    return all(abs(a - b) <= _TOLERANCE for a, b in zip(numbers, before, strict=True))


def _page_colour(match: re.Match[str]) -> str:
    code = match[1]
    if code in _SERIES:
        return f"var({_SERIES[code]})"
    red, green, blue = (int(code[i : i + 2], 16) for i in (0, 2, 4))
    if not red == green == blue:
        return match.group()
    ink = round(100 * (1 - red / 255))
    if ink in {0, 100}:
        return "currentColor" if ink else "var(--card)"
    return f"color-mix(in srgb, currentColor {ink}%, var(--card))"


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
