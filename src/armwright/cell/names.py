"""How the names of a cell are compared, in its file and in the programs for it."""


def arm_name(number: str) -> str:
    """Return the one name of an arm: leading zeros make no other arm.

    Args:
        number: decimal digits as written, such as ``01`` of ``arm-01``.

    Returns:
        Its name, such as ``ARM_1``.
    """
    return f"ARM_{number.lstrip('0') or '0'}"
