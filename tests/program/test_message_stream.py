"""Messages to the language server and the debug adapter are read up to a limit; beyond it the connection ends."""

import io
import subprocess
import sys

import pytest

from armwright.files.message_stream import MessageStream
from armwright.program.debugger.dap_messages import InvalidMessage, read_messages

TOO_LARGE = "a message is too large: the limit is 16 MB (`armwright --raise message_mb=NUMBER ...`"
TOO_LONG = "the header of a message is too large: the limit is 8,192 bytes"


@pytest.mark.parametrize(
    ("header", "said"),
    [
        (b"Content-Length: 99999999999999\r\n\r\n", TOO_LARGE),
        (b"Content-Length: 16000001\r\n\r\n", TOO_LARGE),
        (b"Content-Length: " + b"9" * 6000 + b"\r\n\r\n", TOO_LARGE),
        (b"X" * 10_000_000, TOO_LONG),
        (b"X: y\r\n" * 10_000, TOO_LONG),
    ],
    ids=["a huge number", "a byte too many", "a number of a page", "a line without an end", "many lines"],
)
def test_message_beyond_the_limit(header: bytes, said: str) -> None:
    """A message or a header that claims to be larger than the limit is refused before it is read."""
    incoming = MessageStream(io.BytesIO(header))
    while incoming.readline():
        pass
    assert incoming.refused.startswith(said)
    assert incoming.readline() == b""

    *_, last = read_messages(io.BytesIO(header))
    assert isinstance(last, InvalidMessage)
    assert last.text.startswith(said)
    assert last.text.endswith("the connection ends")


@pytest.mark.parametrize("command", ["lsp", "debug"])
def test_commands_end_on_a_message_beyond_the_limit(command: str) -> None:
    """The commands say what was too large and end, without a traceback."""
    done = subprocess.run(
        [sys.executable, "-m", "armwright", command],
        input=b"Content-Length: 99999999999999\r\n\r\n{}",
        capture_output=True,
        check=False,
        timeout=60,
    )

    assert TOO_LARGE.encode() in done.stdout + done.stderr
    assert b"Traceback" not in done.stderr
