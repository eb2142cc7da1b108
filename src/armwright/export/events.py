"""What of a run no trajectory carries: outputs that are switched, and texts, with their times."""

import json
from collections.abc import Iterator

from armwright.program.language.source import Source, Span
from armwright.program.vm.recording import Effect, Recording

_SWITCHED = {"OPEN": False, "GRASP": True}


def events_file(recording: Recording) -> str:
    """Return the text of ``events.json``: what is switched and shown, when, and in which line of which file."""
    rows = [
        {"time": effect.t0, **_place(recording.code.source, effect.span), **data}
        for effect in recording.effects
        for data in _events(effect)
    ]
    body = ",\n".join(json.dumps(row) for row in rows)
    return f"[\n{body}\n]\n" if rows else "[]\n"


def _place(source: Source, span: Span) -> dict[str, object]:
    """Return the line of a statement, and in a module the file."""
    line: dict[str, object] = {"line": source.line(span.start)}
    return {**line, "file": source.name_at(span.start)} if source.file_number(span.start) else line


def _events(effect: Effect) -> Iterator[dict[str, object]]:
    """Give what is switched or shown, as plain data."""
    words = effect.text.split()
    if effect.kind in _SWITCHED:
        width = {"width": float(words[-1])} if "TO" in words else {}
        yield {"gripper": effect.arm, "closed": _SWITCHED[effect.kind], **width}
    elif effect.kind == "OPERATE":
        # The number that a device is set to, or the length of a pulse, is in the data.
        yield {"device": words[0].upper(), **(effect.data or {"on": words[1] == "ON"})}
    elif effect.kind == "PRINT":
        yield {"text": effect.data["printed"]}
    elif effect.kind == "END":
        yield from ({"device": device, "on": False} for device in effect.data["switched_off"])
