"""Comparing what a page shows with what is printed."""

import re

# A line of a page that stands for any number of lines.
ANY = "..."
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")


def agree(told: str, got: str) -> bool:
    """Whether two lines are the same but for blanks and one unit in the last digit of a number."""
    if NUMBER.sub("#", told).split() != NUMBER.sub("#", got).split():
        return False
    for one, other in zip(NUMBER.findall(told), NUMBER.findall(got), strict=True):
        if one != other:
            digits = len(one.lower().partition("e")[0].partition(".")[2])
            power = int(one.lower().partition("e")[2] or 0)
            if abs(float(one) - float(other)) > 1.01 * 10.0 ** (power - digits):
                return False
    return True


def matches(told: list[str], got: list[str]) -> bool:
    """Whether an answer is what the page shows, where ``...`` stands for lines left out."""
    if not told:
        return not got
    if told[0].strip() == ANY:
        return any(matches(told[1:], got[i:]) for i in range(len(got) + 1))
    return bool(got) and agree(told[0], got[0]) and matches(told[1:], got[1:])
