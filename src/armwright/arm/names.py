"""Names of an arm, its links and its joints in files of XML."""

from __future__ import annotations

from collections.abc import Sequence

from armwright.arm.model import Arm
from armwright.errors import InvalidValueError


def distinct_names(own: Sequence[str], defaults: Sequence[str]) -> list[str]:
    """Return names that differ: the own ones, and defaults where there is none, or it is taken already."""
    taken: list[str] = []
    for name, default in zip(own, defaults, strict=True):
        chosen = name if name and name not in taken else default
        while chosen in taken or (chosen != name and chosen in own):
            chosen += "_"
        taken.append(chosen)
    return taken


def refuse_names_beyond_xml(arm: Arm) -> None:
    """Refuse an arm whose names XML cannot hold.

    Raises:
        InvalidValueError: a name has such characters.
    """
    parts = [*(joint.name for joint in arm.joints), *(link.name for link in arm.links)]
    for name in (arm.name, arm.base_link, arm.tool_link, *parts):
        if not all(_in_xml(character) for character in name):
            raise InvalidValueError(
                f"arm {arm.name!r}: XML cannot represent every character of this name: {name!r}; choose another"
            )


def _in_xml(character: str) -> bool:
    code = ord(character)
    return code in {0x9, 0xA, 0xD} or 0x20 <= code <= 0xD7FF or 0xE000 <= code <= 0xFFFD or code >= 0x10000
