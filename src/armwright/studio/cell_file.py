"""The cell file of a studio: frames and joint targets taught into it, its comments kept, the change shown first."""

from __future__ import annotations

import difflib
import re
from pathlib import Path
from typing import Any

import numpy as np

from armwright.arrays import Array
from armwright.cell.frames import WORLD
from armwright.cell.reader import parse_cell, read_cell
from armwright.errors import ArmwrightError, UnknownNameError
from armwright.extras import import_extra
from armwright.files.inputs import read_text
from armwright.files.output import write_back
from armwright.program.language.words import VOCABULARIES, Standard
from armwright.spatial.poses import inverse, to_noap

# Decimals of rotations and of positions [m] of frames, and of joint positions [rad], [m].
_DECIMALS = np.repeat((9, 7), (9, 3))
_JOINT_DECIMALS = 7
# Changes that can be taken back at most.
_MOST_UNDONE = 200
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*\Z")


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
        document = self._parsed()
        frames = self._table(document, "frames")
        key = self._key(frames, name) or name.upper()
        pose = _toml_pose(to_noap(X_WF if X_WP is None else inverse(X_WP) @ X_WF))
        frames[key] = _value(pose if on == WORLD else f'{{ on = "{on}", at = {pose} }}')
        self._take(document)

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
        document = self._parsed()
        targets = self._table(document, "joint_targets")
        key = self._key(targets, name) or name.upper()
        limits = self.cell.arms[arm].arm.limits
        rounded = np.clip(np.round(q, _JOINT_DECIMALS), limits.lower, limits.upper)
        numbers = ", ".join(repr(float(value) + 0.0) for value in rounded)
        targets[key] = _value(f'{{ arm = "{arm}", joint_positions = [{numbers}] }}')
        self._take(document)

    def rename(self, name: str, new: str) -> None:
        """Give a frame or a joint target another name; frames that hang on it follow.

        Raises:
            TeachingError: the name is none or taken, or the cell would be wrong.
        """
        self._check_name(new)
        document = self._parsed()
        table, key = self._entry(document, name)
        if new.upper() != key.upper() and any(self._key(each, new) is not None for each in self._tables(document)):
            raise TeachingError(f"{new.upper()} is taken already")
        items = [(new.upper() if old == key else old, table[old]) for old in list(table)]
        for old in list(table):
            del table[old]
        for old, value in items:
            if hasattr(value, "get") and str(value.get("on", "")).upper() == key.upper():
                value["on"] = new.upper()
            table[old] = value
        self._take(document)

    def forget(self, name: str) -> None:
        """Take a frame or a joint target out.

        Raises:
            TeachingError: there is none, or another one hangs on it.
        """
        document = self._parsed()
        table, key = self._entry(document, name)
        del table[key]
        self._take(document)

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

    def save(self) -> None:
        """Write the text to the file.

        Raises:
            OutputError: it cannot be written, or somebody else has changed it meanwhile.
        """
        write_back(self.path, self._saved, self.text)
        self._saved = self.text

    # ---- the document --------------------------------------------------------------------------------------------

    def _parsed(self) -> Any:
        if self.path.suffix.lower() == ".json":
            raise TeachingError(f"frames are taught into TOML files, and {self.path.name} is JSON")
        return import_extra("tomlkit", "teaching", "studio").parse(self.text)

    @staticmethod
    def _table(document: Any, name: str) -> Any:
        if name not in document:
            document[name] = import_extra("tomlkit", "teaching", "studio").table()
        return document[name]

    @staticmethod
    def _tables(document: Any) -> list[Any]:
        """Return the tables with what has been taught."""
        return [document[name] for name in ("frames", "joint_targets") if name in document]

    @staticmethod
    def _key(table: Any, name: str) -> str | None:
        return next((key for key in table if key.upper() == name.upper()), None)

    def _entry(self, document: Any, name: str) -> tuple[Any, str]:
        """Return the table in which something has been taught, and its key there."""
        tables = self._tables(document)
        for table in tables:
            if (key := self._key(table, name)) is not None:
                return table, key
        raise UnknownNameError("frame or joint target", name, [key for table in tables for key in table])

    @staticmethod
    def _check_name(name: str) -> None:
        if not _NAME.match(name):
            raise TeachingError(f"a name has letters, digits and _, and begins with a letter, got {name!r}")
        if name.upper() in VOCABULARIES[Standard.RLO_2].reserved:
            raise TeachingError(f"{name.upper()} is a word of the language and cannot be a name")

    def _take(self, document: Any) -> None:
        """Take a changed document, if it is a cell."""
        text = document.as_string()
        try:
            cell = parse_cell(self.path, text)
        except ArmwrightError as error:
            raise TeachingError(str(error)) from error
        self._before = [*self._before, self.text][-_MOST_UNDONE:]
        self.text, self.cell = text, cell


def _toml_pose(noap: Array) -> str:
    """Return the text of a pose: twelve numbers, column by column."""
    numbers = [_number_text(value, int(digits)) for value, digits in zip(noap, _DECIMALS, strict=True)]
    return "[" + ",  ".join(", ".join(numbers[i : i + 3]) for i in range(0, 12, 3)) + "]"


def _number_text(value: float, digits: int) -> str:
    rounded = round(float(value), digits) + 0.0
    return str(int(rounded)) if rounded == int(rounded) else f"{rounded:.{digits}f}".rstrip("0")


def _value(text: str) -> Any:
    """Return a value of TOML from its text."""
    return import_extra("tomlkit", "teaching", "studio").value(text)
