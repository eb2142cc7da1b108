"""A message of a log before anybody knows what it says."""

from typing import NamedTuple


class Channel(NamedTuple):
    """Where messages of one kind are.

    Attributes:
        topic: its name; characters that cannot be printed are escaped.
        kind: the type of its messages, such as ``sensor_msgs/msg/JointState``; empty where there is none.
        encoding: of its messages: ``cdr``, ``json``, ``protobuf``, ``ros1``.
        schema: the definition of the type; empty where there is none.
    """

    topic: str
    kind: str
    encoding: str
    schema: bytes = b""


class RawMessage(NamedTuple):
    """A message.

    Attributes:
        channel: where it is.
        time: when it was logged [ns].
        data: its bytes.
    """

    channel: Channel
    time: int
    data: bytes


def printable(name: str) -> str:
    """Return the name of a topic or a type in one line, for messages and tables: escaped where it cannot be printed."""
    return name if name.isprintable() else name.encode("unicode_escape").decode("ascii")
