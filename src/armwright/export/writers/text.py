"""Names, numbers and texts as the languages of controllers take them."""

import re
from collections.abc import Collection, Iterable

# What is no letter, digit or underscore in a name.
_OTHER = re.compile(r"[^A-Za-z0-9_]+")
# Characters of a text that operators see on one line at most.
LINE_OF_TEXT = 80


def identifier(name: str, limit: int, taken: Collection[str] = ()) -> str:
    """Return a name as an identifier: letters, digits and underscores, the first a letter; numbered where it is taken.

    Args:
        name: any text.
        limit: of its length.
        taken: identifiers and words that it must not be, in lower case.
    """
    plain = _OTHER.sub("_", name).strip("_")
    plain = plain if plain[:1].isalpha() else f"p_{plain}".rstrip("_")
    candidate, number = plain[:limit], 1
    while candidate.lower() in taken:
        number += 1
        suffix = f"_{number}"
        candidate = f"{plain[: limit - len(suffix)]}{suffix}"
    return candidate


def decimal(value: float, digits: int) -> str:
    """Return a number with so many digits behind the point; zero has no sign."""
    text = f"{value:.{digits}f}"
    return text[1:] if text[0] == "-" and not text.strip("-0.") else text


def decimals(values: Iterable[float], digits: int) -> list[str]:
    """Return numbers with so many digits behind the point."""
    return [decimal(value, digits) for value in values]


def plain_lines(text: str, replaced: str = "", longest: int = LINE_OF_TEXT) -> list[str]:
    """Return a text as lines of printable ASCII that operators can be shown.

    Args:
        text: any text.
        replaced: characters that become ' beside those that no controller shows, which become ?.
        longest: of a line.
    """
    plain = "".join(
        "'" if character in replaced else character if " " <= character <= "~" else "?" for character in text
    )
    return [plain[i : i + longest] for i in range(0, max(len(plain), 1), longest)]
