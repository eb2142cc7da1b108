"""Numbers as arguments: lists of numbers, named numbers, and bounds."""

import re
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from armwright.cli.options import usage_error

# Possessive quantifiers: a text that is not a number is refused in time linear in its length.
_NUMBER = r"[+-]?(?:[0-9]++\.?[0-9]*+|\.[0-9]++)(?:[eE][+-]?[0-9]++)?"
_RANGE = re.compile(rf"(?P<name>[^=]+)=(?P<low>{_NUMBER}):(?P<high>{_NUMBER})")
_NAMED = re.compile(rf"(?P<name>[^=]+)=(?P<number>{_NUMBER})(?P<unit>[a-zA-Z%/]*)")


def numbers(text: str, count: int, option: str) -> list[float]:
    """Read numbers that are separated by commas or blanks.

    Raises:
        BadParameter: the text is not ``count`` finite numbers, or a number is larger than any of a robot.
    """
    from armwright.arrays import LARGEST

    words = text.replace(",", " ").split()
    values = []
    for word in words:
        try:
            values.append(float(word))
        except ValueError:
            raise usage_error(option, f"expected {count} numbers, got '{word}'") from None
    if len(values) != count:
        raise usage_error(option, f"expected {count} finite numbers, got {len(values)}: {text}")
    for value, word in zip(values, words, strict=True):
        if not abs(value) <= LARGEST:  # not fulfilled by NaN
            raise usage_error(option, f"every number must be finite and no larger than {LARGEST:g}, got {word}")
    return values


def units_of(text: str | None) -> tuple[str, str] | None:
    """Read a unit of lengths and a unit of angles that are separated by a comma; None without a text.

    Raises:
        BadParameter: the text is not two units.
    """
    if text is None:
        return None
    parts = tuple(part.strip() for part in text.split(","))
    if len(parts) != 2:
        raise usage_error("--units", f"expected a length and an angle such as mm,deg, got {text}")
    return parts[0], parts[1]


class Named(NamedTuple):
    """A number with a name, such as ``RP=0.05mm``; the unit may be empty."""

    name: str
    value: float
    unit: str


def named_numbers(texts: Iterable[str], units: Sequence[str] | None, expected: str, option: str) -> dict[str, Named]:
    """Read numbers with names, each name once.

    Args:
        texts: such as ``J2=0.3`` or ``J2=1e-3mm``.
        units: valid units; None allows any.
        expected: description of a valid text, for the message.
        option: option of the texts, for the message.

    Returns:
        The numbers by name, in the order of the texts.

    Raises:
        BadParameter: a text is not a named number, or a name occurs twice.
    """
    named: dict[str, Named] = {}
    for text in texts:
        match = _NAMED.fullmatch(text.replace(" ", ""))
        if match is None or (units is not None and match["unit"] not in units):
            raise usage_error(option, f"expected {expected}, got {text}")
        name = match["name"]
        if name in named:
            raise usage_error(option, f"{name} occurs twice; expected each name once")
        named[name] = Named(name, float(match["number"]), match["unit"])
    return named


def named_ranges(texts: Iterable[str], option: str) -> dict[str, tuple[float, float]]:
    """Read ranges with names, such as ``payload=0:0.2``, each name once.

    Raises:
        BadParameter: a text is not a named range of finite numbers, the second above the first, or a name occurs twice.
    """
    named: dict[str, tuple[float, float]] = {}
    for text in texts:
        match = _RANGE.fullmatch(text.replace(" ", ""))
        if match is None:
            raise usage_error(option, f"expected a name and a range such as payload=0:0.2, got {text}")
        name, (low, high) = match["name"], numbers(f"{match['low']},{match['high']}", 2, option)
        if not low < high:
            raise usage_error(option, f"{name}: expected a range whose second number is larger, got {low:g}:{high:g}")
        if name in named:
            raise usage_error(option, f"{name} occurs twice; expected each name once")
        named[name] = (low, high)
    return named


def within(value: float, bounds: tuple[float, float], option: str) -> float:
    """Return a number that is within its bounds.

    Raises:
        BadParameter: the number is outside them.
    """
    lower, upper = bounds
    if not lower <= value <= upper:
        raise usage_error(option, f"expected {lower:g} to {upper:g}, got {value:g}")
    return value
