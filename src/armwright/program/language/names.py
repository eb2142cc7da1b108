"""What names tell by their form."""

import re

# What a log may be called: its file has this name.
LOG_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,40}")


# Suffix of the files of programs and modules.
MODULE_SUFFIX = ".rlo"


def is_module(path: str) -> bool:
    """Whether an IMPORT of this file brings a module, and not the frames of a cell."""
    return path.lower().endswith(MODULE_SUFFIX)


def is_arm(name: str) -> bool:
    """Whether a canonical name is that of an arm; no other name has its form."""
    return name.startswith("ARM_") and name[4:].isdecimal()


def is_any_element(name: str) -> bool:
    """Whether a name stands for some element of an array, nobody knows which."""
    return name.endswith("[]")


def array_name(name: str) -> str:
    """Return the array of an element; the name itself where it is no element."""
    return name.partition("[")[0]
