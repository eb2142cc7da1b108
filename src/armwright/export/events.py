"""What of a run no trajectory carries: outputs that are switched, and texts, with their times."""

import json

from armwright.program.vm.recording import Effect, Recording

_SWITCHED = {"OPEN": False, "GRASP": True}


def events_file(recording: Recording) -> str:
    """Return the text of ``events.json``: what is switched and shown, when, and in which line of the program."""
    source = recording.code.source
    rows = []
    for effect in recording.effects:
        data = _event(effect)
        if data:
            rows.append({"time": effect.t0, "line": source.line(effect.span.start), **data})
    body = ",\n".join(json.dumps(row) for row in rows)
    return f"[\n{body}\n]\n" if rows else "[]\n"


def _event(effect: Effect) -> dict[str, object] | None:
    """Return what is switched or shown, as plain data."""
    words = effect.text.split()
    if effect.kind in _SWITCHED:
        width = {"width": float(words[-1])} if "TO" in words else {}
        return {"gripper": effect.arm, "closed": _SWITCHED[effect.kind], **width}
    if "seconds" in effect.data:
        return {"device": effect.data["device"], "pulse_s": effect.data["seconds"]}
    if "value" in effect.data:
        return {"device": effect.data["device"], "value": effect.data["value"]}
    if effect.kind == "OPERATE":
        return {"device": words[0].upper(), "on": words[1] == "ON"}
    return {"text": effect.data["printed"]} if effect.kind == "PRINT" else None
