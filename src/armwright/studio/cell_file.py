"""The cell file of a studio: frames and joint targets taught into it, its comments kept, the change shown first."""

from __future__ import annotations

import difflib
import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from armwright.arrays import Array
from armwright.cell.entries import NAME
from armwright.cell.frames import WORLD
from armwright.cell.reader import parse_cell, read_cell
from armwright.errors import ArmwrightError, UnknownNameError
from armwright.files.inputs import read_text
from armwright.files.output import write_back
from armwright.files.toml_text import entries_of, value_spans, with_entry, with_name, without_entry
from armwright.program.language.words import VOCABULARIES, Standard
from armwright.spatial.poses import inverse, to_noap

# Decimals of rotations and of positions [m] of frames, and of joint positions [rad], [m].
_DECIMALS = np.repeat((9, 7), (9, 3))
_JOINT_DECIMALS = 7
# Changes that can be taken back at most.
_MOST_UNDONE = 200
# Tables of what is taught, and the parts of the path of an entry in one line.
_TABLES, _INLINE = ("frames", "joint_targets"), 2
# What pages call axes.
_AXES = frozenset(("BASE", "TOOL", "JOINT"))


class TeachingError(ArmwrightError, ValueError):
    """A change of a cell file that cannot be made; the file stays as it is."""


class CellFile:
    """The text of a cell file, changed by teaching and written when that is asked for.

    Attributes:
        path: of the file.
        named: whether the file has a name; otherwise the path is a suggestion.
        text: with the changes.
        cell: as the text describes it.
    """

    def __init__(self, path: Path, text: str | None = None) -> None:
        """Read a file, or begin one.

        Args:
            path: of the file.
            text: of a file that is not there yet, and has no name.

        Raises:
            FileFormatError: it is no cell file.
        """
        self.path, self.named = path, text is None
        self.text = read_text(path) if text is None else text
        self._saved = self.text if text is None else ""
        self.cell = read_cell(path) if text is None else parse_cell(path, text)
        self._before: list[str] = []

    @property
    def changed(self) -> bool:
        """Whether the text differs from the file; of one that is not there, whether anything has been taught."""
        return self.text != self._saved if self.named else bool(self._before)

    # ---- changes -------------------------------------------------------------------------------------------------

    def teach(self, name: str, X_WF: Array, on: str = WORLD, X_WP: Array | None = None) -> None:
        """Add a frame, or give it another pose.

        Args:
            name: of the frame.
            X_WF: (4, 4) its pose in the world.
            on: the frame that it hangs on.
            X_WP: (4, 4) the pose of that frame in the world; the world itself when left out.

        Raises:
            TeachingError: the name is none, or the cell would be wrong.
        """
        self._check_name(name)
        frames = self._entries("frames")
        key = _key(frames, name) or name.upper()
        pose = _toml_pose(to_noap(X_WF if X_WP is None else inverse(X_WP) @ X_WF))
        entry = frames.get(key)
        if isinstance(entry, dict) and ("frames", key) not in dict(value_spans(self.text, "frames")):
            # It is a table of its own: what else stands in it stays.
            text = with_entry(self.text, ("frames", key), "at", pose)
            if str(entry.get("on", WORLD)).upper() != on:
                text = with_entry(text, ("frames", key), "on", json.dumps(on))
        else:
            others = {k: v for k, v in entry.items() if k not in {"at", "on"}} if isinstance(entry, dict) else {}
            if on == WORLD and not others:
                value = pose
            else:
                parent = [] if on == WORLD else [f"on = {json.dumps(on)}"]
                value = ", ".join([*parent, f"at = {pose}", *(f"{k} = {json.dumps(v)}" for k, v in others.items())])
                value = f"{{ {value} }}"
            text = with_entry(self.text, ("frames",), key, value)
        self._take(text)

    def teach_joints(self, name: str, arm: str, q: Array) -> None:
        """Add a joint target, or give it other joint positions.

        Args:
            name: of the target.
            arm: name of the arm.
            q: (n,) its joint positions.

        Raises:
            TeachingError: the name is none, or the cell would be wrong.
        """
        self._check_name(name)
        key = _key(self._entries("joint_targets"), name) or name.upper()
        limits = self.cell.arms[arm].arm.limits
        rounded = np.clip(np.round(q, _JOINT_DECIMALS), limits.lower, limits.upper)
        numbers = ", ".join(repr(float(value) + 0.0) for value in rounded)
        value = f'{{ arm = "{arm}", joint_positions = [{numbers}] }}'
        self._take(with_entry(self.text, ("joint_targets",), key, value))

    def rename(self, name: str, new: str) -> None:
        """Give a frame or a joint target another name; frames that hang on it follow.

        Raises:
            TeachingError: the name is none or taken, or the cell would be wrong.
        """
        self._check_name(new)
        table, key = self._entry(name)
        new = new.upper()
        if new != key.upper() and any(_key(self._entries(each), new) is not None for each in _TABLES):
            raise TeachingError(f"{new} is taken already")
        text = with_name(self.text, table, key, new)
        hangs = re.compile(rf"""(\bon[ \t]*=[ \t]*)?(["']){key}\2""", re.IGNORECASE)
        for path, (a, b) in reversed(value_spans(text, "frames")):
            if path[2:] == ("on",) or (len(path) == _INLINE and text[a] == "{"):
                text = text[:a] + hangs.sub(lambda match: f'{match[1] or ""}"{new}"', text[a:b]) + text[b:]
        self._take(text)

    def forget(self, name: str) -> None:
        """Take a frame or a joint target out.

        Raises:
            TeachingError: there is none, or another one hangs on it.
        """
        table, key = self._entry(name)
        self._take(without_entry(self.text, (table,), key))

    def undo(self) -> None:
        """Take back the latest change.

        Raises:
            TeachingError: there is none.
        """
        if not self._before:
            raise TeachingError("nothing has been taught that could be taken back")
        self.text = self._before.pop()
        self.cell = parse_cell(self.path, self.text)

    def difference(self) -> str:
        """Return what saving would change in the file, as a unified diff; empty where it is nothing."""
        if not self.changed:
            return ""
        before, after = (text.splitlines(keepends=True) for text in (self._saved, self.text))
        return "".join(difflib.unified_diff(before, after, self.path.name, f"{self.path.name}, taught"))

    def save(self, path: Path) -> None:
        """Write the text to a file, which is its own from then on.

        Raises:
            OutputError: it cannot be written, or somebody else has changed it meanwhile.
        """
        write_back(path, self._saved, self.text)
        self._saved, self.path, self.named = self.text, path, True

    # ---- the document --------------------------------------------------------------------------------------------

    def _entries(self, table: str) -> dict[str, Any]:
        """Return what stands in a table of the file."""
        if self.path.suffix.lower() == ".json":
            raise TeachingError(f"frames are taught into TOML files, and {self.path.name} is JSON")
        return entries_of(self.text, table)

    def _entry(self, name: str) -> tuple[str, str]:
        """Return the table in which something has been taught, and its key there."""
        for table in _TABLES:
            if (key := _key(self._entries(table), name)) is not None:
                return table, key
        raise UnknownNameError(
            "frame or joint target", name, [key for table in _TABLES for key in self._entries(table)]
        )

    @staticmethod
    def _check_name(name: str) -> None:
        if not NAME.fullmatch(name):
            raise TeachingError(f"a name has letters, digits and _, and begins with a letter, got {name!r}")
        vocabulary = VOCABULARIES[Standard.RLO_2]
        if name.upper() in vocabulary.reserved or name.upper() in _AXES:
            raise TeachingError(f"{name.upper()} has a meaning of its own and cannot be a name")
        if len(name) > vocabulary.longest_name:
            raise TeachingError(f"a name has at most {vocabulary.longest_name} characters, got {len(name)}")

    def _take(self, text: str) -> None:
        """Take a changed text, if it is that of a cell."""
        try:
            cell = parse_cell(self.path, text)
        except ArmwrightError as error:
            raise TeachingError(str(error)) from error
        self._before = [*self._before, self.text][-_MOST_UNDONE:]
        self.text, self.cell = text, cell


def _key(entries: Mapping[str, object], name: str) -> str | None:
    return next((key for key in entries if key.upper() == name.upper()), None)


def _toml_pose(noap: Array) -> str:
    """Return the text of a pose: twelve numbers, column by column."""
    numbers = [_number_text(value, int(digits)) for value, digits in zip(noap, _DECIMALS, strict=True)]
    return "[" + ",  ".join(", ".join(numbers[i : i + 3]) for i in range(0, 12, 3)) + "]"


def _number_text(value: float, digits: int) -> str:
    rounded = round(float(value), digits) + 0.0
    return str(int(rounded)) if rounded == int(rounded) else f"{rounded:.{digits}f}".rstrip("0")
