"""What stops a sweep."""

from armwright.errors import ArmwrightError


class SweepError(ArmwrightError, RuntimeError):
    """A sweep cannot begin or go on; the text says why. The blocks that are finished stay."""
