"""Normal forms of names in cell files and programs."""


def arm_name(number: str) -> str:
    """Return the normal form of the name of an arm, without leading zeros.

    Args:
        number: decimal digits as written, such as ``01`` of ``arm-01``.

    Returns:
        Its name, such as ``ARM_1``.
    """
    return f"ARM_{number.lstrip('0') or '0'}"
