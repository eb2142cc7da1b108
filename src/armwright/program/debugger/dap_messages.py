"""The outside of the Debug Adapter Protocol: messages on a stream, and what a request must bring with it.

Source:
    Debug Adapter Protocol, base protocol: a header with Content-Length, an empty line, JSON in UTF-8.
"""

import json
from collections.abc import Iterator, Mapping
from typing import Any, BinaryIO, NamedTuple, TypeVar

from armwright.errors import ArmwrightError
from armwright.files.message_stream import CONTENT_LENGTH, MessageStream

T = TypeVar("T")

# What people call the types of JSON.
_TYPES: Mapping[type, str] = {
    str: "a text",
    int: "an integer",
    bool: "true or false",
    list: "a list",
    dict: "an object",
}


class RequestError(ArmwrightError, ValueError):
    """A request cannot be answered; the text goes back to who sent it."""


class InvalidMessage(NamedTuple):
    """What came in and is no message."""

    text: str


def read_messages(stream: BinaryIO) -> Iterator[dict[str, Any] | InvalidMessage]:
    """Give what comes in, one after the other, until the stream ends or a message is larger than its limit."""
    incoming = MessageStream(stream)
    while True:
        header = b""
        while (line := incoming.readline()).strip():
            header += line
        length = CONTENT_LENGTH.search(header)
        if incoming.refused:
            yield InvalidMessage(f"{incoming.refused}; the connection ends")
        if not line:
            return
        if length is not None:
            body = incoming.read(int(length[1]))
            if len(body) < int(length[1]):
                return
            yield _message(body)
        elif header:
            yield InvalidMessage("a header without a valid Content-Length")


def _message(body: bytes) -> dict[str, Any] | InvalidMessage:
    try:
        message = json.loads(body.decode())
    except (ValueError, RecursionError):
        return InvalidMessage("a message that is not JSON")
    return message if isinstance(message, dict) else InvalidMessage("a message that is not a JSON object")


def frame_message(message: Mapping[str, Any]) -> bytes:
    """Return a message as it is sent."""
    body = json.dumps(message, ensure_ascii=False).encode("utf-8", "backslashreplace")
    return b"Content-Length: %d\r\n\r\n%s" % (len(body), body)


class Arguments:
    """What a request brings with it."""

    def __init__(self, body: object) -> None:
        """Take the arguments of a request.

        Raises:
            RequestError: they are no object.
        """
        self._values: dict[str, Any] = {} if body is None else _check_type(body, dict, "arguments")

    def __contains__(self, key: str) -> bool:
        """Whether something is given, and not null."""
        return self._values.get(key) is not None

    def get(self, kind: type[T], key: str, default: T | None = None) -> T:
        """Return an argument of some type.

        Raises:
            RequestError: it is missing, and there is no default, or it is of another type.
        """
        value = self._values.get(key, default)
        value = default if value is None else value
        if value is None:
            raise RequestError(f"{key}: missing, expected {_TYPES[kind]}")
        return _check_type(value, kind, key)

    def get_objects(self, key: str) -> "list[Arguments]":
        """Return a list of objects; an empty one where it is missing.

        Raises:
            RequestError: it is no list of objects.
        """
        return [Arguments(item) for item in self.get(list, key, [])]

    def get_object(self, key: str) -> "Arguments":
        """Return an object.

        Raises:
            RequestError: it is missing or none.
        """
        return Arguments(self.get(dict, key))


def _check_type(value: object, kind: type[T], key: str) -> T:
    # Of numbers only, true and false are none.
    if not isinstance(value, kind) or (isinstance(value, bool) and kind is int):
        raise RequestError(f"{key}: expected {_TYPES[kind]}, got {str(value)[:40]!r}")
    return value
