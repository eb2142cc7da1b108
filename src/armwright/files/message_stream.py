"""What an editor sends to the language server or the debug adapter, read up to the limits of a message.

Source:
    Language Server Protocol and Debug Adapter Protocol, base protocol: a header with Content-Length, an empty line, a
    body of so many bytes.
"""

import re
from typing import BinaryIO

from armwright.files.limits import MEGABYTE, limit, limit_message

CONTENT_LENGTH = re.compile(rb"(?im)^content-length[ \t]*:[ \t]*([0-9]+)[ \t]*\r?\n")


class MessageStream:
    """A stream of messages that ends where a header or a message is larger than its limit.

    Attributes:
        refused: what was too large; empty while nothing was.
    """

    def __init__(self, stream: BinaryIO) -> None:
        """Read from a stream, such as the standard input."""
        self._stream = stream
        self._header = 0
        self.refused = ""

    def readline(self) -> bytes:
        """Return the next line of a header; nothing at the end, or where the header is too large."""
        if self.refused:
            return b""
        most = limit("header_bytes")
        line = self._stream.readline(most + 1)
        self._header = 0 if not line.strip() else self._header + len(line)
        if self._header > most:
            self.refused = f"the header of a message is too large: {limit_message('header_bytes')}"
            return b""
        length = CONTENT_LENGTH.fullmatch(line)
        most = limit("message_mb") * MEGABYTE
        # Of a length with more digits than the largest has, the number is of no interest.
        if length and (len(length[1].lstrip(b"0")) > len(str(most)) or int(length[1]) > most):
            self.refused = f"a message is too large: {limit_message('message_mb')}"
            return b""
        return line

    def read(self, size: int) -> bytes:
        """Return a message of that many bytes, or what is there before the end."""
        body = bytearray()
        while len(body) < size and (more := self._stream.read(size - len(body))):
            body += more
        return bytes(body)
