"""The debug adapter: what editors ask of a debugger, over the Debug Adapter Protocol.

One thread reads what comes in; another answers it and, while the program runs, lets it run in slices in between. So
a program that never ends can be paused, and nothing else has to be guarded.

Source:
    Debug Adapter Protocol, specification 1.68.
"""

import queue
import threading
from collections.abc import Mapping
from contextlib import suppress
from typing import Any, BinaryIO

from armwright.errors import ArmwrightError
from armwright.program.debugger.dap_messages import (
    Arguments,
    InvalidMessage,
    frame_message,
    read_messages,
)
from armwright.program.debugger.dap_requests import REQUESTS
from armwright.program.debugger.dap_session import EditorSession, Load, Save

# How long the program runs before the next request is looked for [s].
_SLICE = 0.02


def serve(incoming: BinaryIO, outgoing: BinaryIO, load: Load, save: Save) -> None:
    """Answer an editor until it disconnects or its stream ends.

    Args:
        incoming: where requests come from; its ``read`` returns what there is.
        outgoing: where answers go.
        load: reads and translates a program.
        save: writes what a run leaves.
    """
    Adapter(outgoing, load, save).run(incoming)


class Adapter:
    """A connection to an editor."""

    def __init__(self, outgoing: BinaryIO, load: Load, save: Save) -> None:
        """Wait for the first request."""
        self._outgoing, self._sent = outgoing, 0
        self._session = EditorSession(load, save, lambda event, body: self._send("event", event=event, body=body))
        self._incoming: queue.SimpleQueue[dict[str, Any] | InvalidMessage | None] = queue.SimpleQueue()

    def run(self, incoming: BinaryIO) -> None:
        """Answer what comes in, and let the program run in between."""
        threading.Thread(target=self._listen, args=(incoming,), daemon=True).start()
        # The editor may go at any time.
        with suppress(BrokenPipeError):
            while self._session.connected:
                self._serve_next()

    def _serve_next(self) -> None:
        session = self._session
        try:
            message = self._incoming.get(block=session.debugger is None or not session.debugger.running)
        except queue.Empty:
            session.run_slice(_SLICE)
            return
        if message is None:
            session.connected = False
        elif isinstance(message, InvalidMessage):
            self._refuse(0, "", message.text)
        elif message.get("type") in {"request", None}:
            self._handle(message)

    def _listen(self, incoming: BinaryIO) -> None:
        try:
            for message in read_messages(incoming):
                self._incoming.put(message)
        finally:
            self._incoming.put(None)

    def _handle(self, request: Mapping[str, Any]) -> None:
        sequence, command, session = request.get("seq"), request.get("command"), self._session
        number = sequence if isinstance(sequence, int) else 0
        if not isinstance(command, str):
            self._refuse(number, "", "a request without a command")
            return
        if command not in REQUESTS:
            self._refuse(number, command, f"this debugger does not support the request `{command}`")
            return
        try:
            body = REQUESTS[command](session, Arguments(request.get("arguments")))
        except ArmwrightError as error:
            self._refuse(number, command, str(error))
        except Exception as error:  # noqa: BLE001 - a slip of ours must not take the session with it
            self._refuse(number, command, f"{type(error).__name__} in the debugger: {error}")
        else:
            result = {} if body is None else {"body": body}
            self._send("response", request_seq=number, command=command, success=True, **result)
        actions, session.after_response = session.after_response, []
        for action in actions:
            action()

    def _refuse(self, number: int, command: str, text: str) -> None:
        # In a format, braces would ask for values.
        error = {"id": 1, "format": text.replace("{", "(").replace("}", ")"), "showUser": True}
        self._send("response", request_seq=number, command=command, success=False, message=text, body={"error": error})

    def _send(self, kind: str, **message: object) -> None:
        self._sent += 1
        self._outgoing.write(frame_message({"seq": self._sent, "type": kind, **message}))
        self._outgoing.flush()
