"""Program texts and places in them: characters are counted in the text as it was written."""

import re
from bisect import bisect_left, bisect_right
from functools import cached_property
from pathlib import PurePosixPath
from typing import NamedTuple

import attrs

_BYTE_ORDER_MARK = "\ufeff"
_LINE_END = re.compile(r"\r\n?|\n")


# A tuple, as a long program has a hundred thousand of them: any other frozen thing costs more than twice as much.
class Span(NamedTuple):
    """A stretch of a text, in characters.

    Attributes:
        start: the first character.
        end: the one after the last; equal to ``start`` where something is missing.
    """

    start: int
    end: int

    def to(self, other: "Span") -> "Span":
        """Return the stretch from the start of this to the end of the other."""
        return Span(self.start, other.end)

    def moved(self, characters: int) -> "Span":
        """Return the stretch so many characters further on."""
        return Span(self.start + characters, self.end + characters)


@attrs.frozen
class ModuleText:
    """A module of a program, whose text stands behind that of the program.

    Attributes:
        path: of its file, relative to the folder of the program, with ``/``.
        start: where its text starts in that of the program.
    """

    path: str
    start: int


@attrs.frozen(slots=False)
class Source:
    """The text of a program: that of its file, and behind it those of the modules that it imports.

    A place is an offset into the whole, so a span tells by itself what file it is in. Lines and columns are those of
    the file.

    Attributes:
        name: of the program's file, as shown in messages, such as ``weld.rlo``.
        text: the characters of the file, untouched, and those of each module behind a line feed.
        modules: what follows the file, in order.
    """

    name: str
    text: str
    modules: tuple[ModuleText, ...] = ()

    def with_module(self, path: str, text: str) -> "Source":
        """Return the program with the text of one more module."""
        module = ModuleText(path, len(self.text) + 1)
        return Source(self.name, f"{self.text}\n{text}", (*self.modules, module))

    @cached_property
    def main(self) -> "Source":
        """The text of the program's own file."""
        return Source(self.name, self.text[: self._file_end(0)]) if self.modules else self

    @cached_property
    def _file_starts(self) -> tuple[int, ...]:
        """Where each file starts, that of the program first."""
        return (0, *(module.start for module in self.modules))

    def file_number(self, offset: int) -> int:
        """Return which file a character is in: 0 for the program itself, 1 for its first module."""
        return bisect_right(self._file_starts, offset) - 1 if self.modules else 0

    def file_start(self, offset: int) -> int:
        """Return where the file of a character starts."""
        return self._file_starts[self.file_number(offset)]

    def file_text(self, number: int) -> str:
        """Return the text of a file."""
        return self.text[self._file_starts[number] : self._file_end(number)]

    def _file_end(self, number: int) -> int:
        return self.modules[number].start - 1 if number < len(self.modules) else len(self.text)

    def file_path(self, number: int) -> str:
        """Return the path of a file: the name of the program, and of a module the path beside that."""
        return str(PurePosixPath(self.name).parent / self.modules[number - 1].path) if number else self.name

    def name_at(self, offset: int) -> str:
        """Return the name of the file that a character is in."""
        return self.file_path(self.file_number(offset))

    @cached_property
    def line_starts(self) -> tuple[int, ...]:
        """Where each line of all files starts.

        A line ends with a line feed, a carriage return or both; never elsewhere. A byte order mark is no part of one.
        """
        starts = [0, *(match.end() for match in _LINE_END.finditer(self.text))]
        for start in self._file_starts:
            if self.text.startswith(_BYTE_ORDER_MARK, start):
                starts[bisect_left(starts, start)] += 1
        return tuple(starts)

    @cached_property
    def _first_lines(self) -> tuple[int, ...]:
        """How many lines stand in front of each file."""
        return tuple(bisect_right(self.line_starts, start - 1) for start in self._file_starts)

    @cached_property
    def _line_counts(self) -> tuple[int, ...]:
        """How many lines stand up to the end of each file."""
        return (*self._first_lines[1:], len(self.line_starts))

    def line(self, offset: int) -> int:
        """Return the number of the line, from 1, that holds a character."""
        before = self._first_lines[self.file_number(offset)] if self.modules else 0
        return max(1, bisect_right(self.line_starts, offset) - before)

    def column(self, offset: int) -> int:
        """Return the place of a character in its line, from 1."""
        return max(0, offset - self._line_start(offset)) + 1

    def line_text(self, line: int, file: int = 0) -> str:
        """Return a line without its end.

        Args:
            line: its number, from 1.
            file: which file it is in, as ``file_number`` counts them.

        Raises:
            IndexError: the file has no such line.
        """
        index = self._first_lines[file] + line
        end = self.line_starts[index] if index < self._line_counts[file] else self._file_end(file)
        return self.text[self.line_start(line, file) : end].rstrip("\r\n")

    def line_start(self, line: int, file: int = 0) -> int:
        """Return where a line of a file starts; the arguments are those of ``line_text``."""
        return self.line_starts[self._first_lines[file] + line - 1]

    def line_at(self, offset: int) -> str:
        """Return the line that holds a character, without its end."""
        return self.line_text(self.line(offset), self.file_number(offset))

    def line_count(self, file: int = 0) -> int:
        """Return how many lines a file has."""
        return self._line_counts[file] - self._first_lines[file]

    def listing_line(self, offset: int) -> int:
        """Return the number of a line in a listing of all files, one behind the other."""
        return self.line(offset) + (self._first_lines[self.file_number(offset)] if self.modules else 0)

    def place(self, offset: int) -> str:
        """Return the number of the line that holds a character, with the name of the module that it is in."""
        line, module = self.line(offset), self.file_number(offset)
        return f"{line} of {self.file_path(module)}" if module else str(line)

    def slice(self, span: Span) -> str:
        """Return the characters of a span."""
        return self.text[span.start : span.end]

    def _line_start(self, offset: int) -> int:
        return self.line_starts[self.listing_line(offset) - 1]
