"""The limits of everything that reads: one table, each limit with what it bounds and how it is raised.

A file from elsewhere may be of any size and say anything. What is read stays bounded in memory and time, and whoever
really has more raises one limit by name: with ``armwright --raise NAME=NUMBER COMMAND``, with the environment variable
``ARMWRIGHT_LIMITS="NAME=NUMBER,..."``, or in Python with ``raised(NAME=NUMBER)``.
"""

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from typing import NamedTuple

from armwright.errors import InvalidValueError, UnknownNameError, shown

VARIABLE = "ARMWRIGHT_LIMITS"
MEGABYTE = 1_000_000


class Limit(NamedTuple):
    """How much of something is read.

    Attributes:
        usual: how much, unless it is raised.
        unit: what is counted.
        bounds: what the limit is about, for the documentation.
    """

    usual: int
    unit: str
    bounds: str


LIMITS: Mapping[str, Limit] = {
    "file_mb": Limit(4, "MB", "size of an arm, cell, linkage, URDF, MJCF, poses or estimate file"),
    "program_mb": Limit(
        1, "MB", "size of a program in RLO, or of its intermediate code, also from standard input (`-`)"
    ),
    "words": Limit(200_000, "words", "tokens of a program; comments do not count"),
    "table_mb": Limit(1000, "MB", "size of a CSV table"),
    "table_rows": Limit(1_000_000, "rows", "rows of a CSV table"),
    "table_columns": Limit(1000, "columns", "columns of a CSV table"),
    "line_characters": Limit(1_000_000, "characters", "length of a line of a CSV table"),
    "nesting": Limit(60, "levels", "depth of tables, lists and dotted keys in TOML and JSON, and of elements in XML"),
    "attributes": Limit(100, "attributes", "attributes of an element in XML"),
    "elements": Limit(100_000, "elements", "elements of an MJCF file, with the files that it includes"),
    "digits": Limit(1000, "digits", "digits of an integer in TOML and JSON"),
    "entries": Limit(
        10_000, "entries", "tables of a list such as `[[pose]]`, devices, answers of a camera, measured poses and runs"
    ),
    "joints": Limit(100, "joints", "joints of an arm, from the base to the tip"),
    "bodies": Limit(100, "bodies", "bodies of a linkage, and also its joints, pins with clearance, drives and loads"),
    "frames": Limit(10_000, "frames", "frames of a cell"),
    "imports": Limit(
        100,
        "files",
        "files that a program IMPORTs, the limit of frames applies to all of them together; files that an MJCF file "
        "includes",
    ),
    "hanging": Limit(1000, "frames", "depth of the frame tree of a cell, from a frame to WORLD"),
    "arms": Limit(20, "arms", "arms of a cell"),
    "parts": Limit(1000, "parts", "parts of a cell"),
    "fixtures": Limit(2000, "fixtures", "bodies of the scene of a cell"),
    "revolutions": Limit(1000, "revolutions", "limits of a revolute joint, as revolutions from zero"),
    "pictures": Limit(1000, "pictures", "pictures that a camera is calibrated with"),
    "picture_mb": Limit(50, "MB", "size of the file of a picture"),
    "picture_megapixels": Limit(100, "megapixels", "width times height of a picture, which its file names"),
    "mesh_mb": Limit(
        100,
        "MB",
        "size of an STL, OBJ, glTF or STEP file, with all buffers that a glTF file names; of all mesh files of an MJCF "
        "file together",
    ),
    "mesh_triangles": Limit(1_000_000, "triangles", "triangles of a mesh, its instances counted one by one"),
    "file_triangles": Limit(
        2_000_000, "triangles", "triangles of the meshes that an arm, cell or URDF file names, together"
    ),
    "mesh_m": Limit(20, "m", "length of a mesh along any axis; a longer one is probably in another unit"),
    "gltf_values": Limit(1_000_000, "values", "values in the JSON of a glTF file"),
    "step_s": Limit(60, "s", "computing time for the triangles of a STEP file"),
    "step_mb": Limit(4000, "MB", "memory of the process that reads a STEP file"),
    "log_mb": Limit(4000, "MB", "size of a file of a log, in MCAP or a bag of ROS 2"),
    "log_record_mb": Limit(256, "MB", "a record of such a file: a message, or the unpacked content of a chunk"),
    "log_unpacked_mb": Limit(16_000, "MB", "unpacked content of all chunks of such a file together"),
    "log_records": Limit(20_000_000, "records", "records of such a file, whatever they hold"),
    "log_rows": Limit(2_000_000, "joint states", "joint states of a log, of all its topics together"),
    "message_mb": Limit(16, "MB", "one message to the language server or the debug adapter"),
    "header_bytes": Limit(8192, "bytes", "the header of such a message"),
}

_raised: ContextVar[Mapping[str, int] | None] = ContextVar("raised", default=None)


def limit(name: str) -> int:
    """Return how much is read now: what was asked for in Python or on the command line, else what is usual.

    Raises:
        InvalidValueError: the environment variable says something else than names and numbers.
        UnknownNameError: it names a limit that there is not.
    """
    here = _raised.get()
    if here is not None and name in here:
        return here[name]
    told = os.environ.get(VARIABLE, "")
    return (parse_limits(told) if told else {}).get(name, LIMITS[name].usual)


@contextmanager
def raised(**limits: int) -> Iterator[None]:
    """Read more than is usual, or less, while this context lasts.

    Args:
        limits: new limits by their names.

    Raises:
        UnknownNameError: there is no such limit; the nearest is told.
        InvalidValueError: a limit is not a whole number of 1 or more.
    """
    for name, value in limits.items():
        _check(name, value)
    token = _raised.set({**(_raised.get() or {}), **limits})
    try:
        yield
    finally:
        _raised.reset(token)


def parse_limits(text: str) -> dict[str, int]:
    """Return limits from a text such as ``table_rows=10000000,table_mb=2000``.

    Raises:
        UnknownNameError: there is no such limit; the nearest is told.
        InvalidValueError: the text is something else.
    """
    found: dict[str, int] = {}
    for part in text.split(","):
        name, equals, number = (word.strip() for word in part.partition("="))
        if not equals or not (number.isascii() and number.isdigit() and len(number) < 16):
            raise InvalidValueError(f"expected limits such as table_rows=10000000, got {shown(part)}")
        _check(name, int(number))
        found[name] = int(number)
    return found


def limit_message(name: str, got: int | str | None = None) -> str:
    """Return the end of a message that something is beyond a limit: what was got, what is allowed, how to raise it."""
    one = LIMITS[name]
    amount = "" if got is None else f"{got:,}; " if isinstance(got, int) else f"{got}; "
    return f"{amount}the limit is {limit(name):,} {one.unit} (`armwright --raise {name}=NUMBER ...` raises it)"


def _check(name: str, value: int) -> None:
    if name not in LIMITS:
        raise UnknownNameError("limit", name, LIMITS)
    if isinstance(value, bool) or not isinstance(value, int) or value < 1:
        raise InvalidValueError(f"{name}: expected an integer of 1 or more, got {shown(value)}")
