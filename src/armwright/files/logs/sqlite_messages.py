"""The messages of a bag of ROS 2 that is an SQLite database, ``*.db3``: tables ``topics`` and ``messages``.

Source:
    rosbag2_storage_sqlite3 of ROS 2.
"""

from __future__ import annotations

import contextlib
import sqlite3
from collections.abc import Callable, Iterator
from pathlib import Path

from armwright.errors import FileFormatError
from armwright.files.limits import MEGABYTE, limit
from armwright.files.logs.raw_message import Channel, RawMessage, printable

MAGIC = b"SQLite format 3\0"


def sqlite_messages(path: Path, wanted: Callable[[Channel], bool]) -> Iterator[RawMessage]:
    """Give the messages of some topics of a database, one topic after the other.

    It is opened for reading alone; what it defines beside its tables, such as views, is not looked at.

    Args:
        path: of the database.
        wanted: whether the messages of a topic are.

    Raises:
        FileFormatError: it is damaged, lacks a table, or a message is beyond the limit.
    """
    try:
        with contextlib.closing(sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro&immutable=1", uri=True)) as base:
            base.text_factory = lambda text: text.decode("utf-8", "replace")
            base.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, limit("log_record_mb") * MEGABYTE)
            base.execute("PRAGMA trusted_schema = OFF")
            tables = {name for (name,) in base.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
            if missing := sorted({"topics", "messages"} - tables):
                raise FileFormatError(path, None, "", f"expected a bag of ROS 2; it has no table '{missing[0]}'")
            channels = {}
            for number, topic, kind, encoding in base.execute(
                "SELECT id, name, type, serialization_format FROM topics"
            ):
                channel = Channel(printable(str(topic)), printable(str(kind)), str(encoding))
                if wanted(channel):
                    channels[number] = channel
            for number, channel in channels.items():
                rows = base.execute("SELECT timestamp, data FROM messages WHERE topic_id = ?", (number,))
                for time, data in rows:
                    if not isinstance(time, int) or not isinstance(data, bytes):
                        raise FileFormatError(path, None, channel.topic, "expected a time and bytes in each message")
                    yield RawMessage(channel, time, data)
    except (sqlite3.Error, UnicodeDecodeError) as error:
        # What SQLite says quotes the file, which may be no text.
        raise FileFormatError(path, None, "", f"the database is damaged: {error}") from error
