"""The kind of an error, by the code of its message."""

_BY_CODE = {"R601": "CAMERA", "E507": "TIMEOUT", "E303": "VALUE"}
_BY_RANGE = {"E2": "VALUE", "E3": "FRAMES", "E4": "MOTION", "E5": "PROCESS", "R6": "DEVICE"}


def error_kind(code: str) -> str:
    """Return the kind of the errors of a code; empty where programs cannot recover from it by its kind."""
    return _BY_CODE.get(code) or _BY_RANGE.get(code[:2], "")
