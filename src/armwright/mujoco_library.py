"""MuJoCo, and which OpenGL draws its pictures without a screen."""

from __future__ import annotations

import ctypes
import importlib
import os
from typing import Any, NamedTuple

from armwright.errors import MissingExtraError
from armwright.extras import import_extra

# The environment variable that names one for MuJoCo.
VARIABLE = "MUJOCO_GL"


class Graphics(NamedTuple):
    """An OpenGL.

    Attributes:
        name: ``egl`` or ``osmesa``.
        context: class of its contexts.
    """

    name: str
    context: Any


# By name, the shared libraries that it needs, any of each group, and the Debian packages that bring them.
_LIBRARIES = {
    "egl": ((("libEGL.so.1",), ("libGL.so.1", "libOpenGL.so.0")), "libegl1 libgl1"),
    "osmesa": ((("libOSMesa.so.8", "libOSMesa.so.6"),), "libosmesa6"),
}


def load_mujoco() -> Any:
    """Return the module of MuJoCo, which loads the OpenGL that ``MUJOCO_GL`` names.

    Raises:
        MissingExtraError: that OpenGL is missing.
    """
    try:
        return importlib.import_module("mujoco")
    except (ImportError, AttributeError, RuntimeError) as error:
        requested = _requested()
        if requested and not _is_whole(requested):
            raise _missing(requested) from error
        raise MissingExtraError(f"MuJoCo cannot be loaded: {' '.join(str(error).split())}") from error


def graphics() -> Graphics:
    """Return the OpenGL that ``MUJOCO_GL`` names, or else EGL, or OSMesa where there is no EGL.

    Raises:
        MissingExtraError: a package or a library of the system is missing, or the variable names something else.
    """
    import_extra("OpenGL", "drawing pictures", "physics", "PyOpenGL")
    requested = _requested()
    for name in [requested] if requested else _LIBRARIES:
        if _is_whole(name):
            os.environ.setdefault(VARIABLE, name)
            return Graphics(name, _context(name))
    raise _missing(requested or "egl")


def _requested() -> str:
    """Return the OpenGL that the environment names; an empty text where it names none."""
    requested = os.environ.get(VARIABLE, "").strip().lower()
    if requested and requested not in _LIBRARIES:
        raise MissingExtraError(f"{VARIABLE}: expected egl or osmesa, which draw without a screen, got {requested!r}")
    return requested


def _missing(name: str) -> MissingExtraError:
    kind, packages = "OSMesa" if name == "osmesa" else "EGL", _LIBRARIES[name][1]
    return MissingExtraError(
        f"drawing pictures needs {kind}, which this system does not have; "
        f"on Debian and Ubuntu it is installed by: apt-get install {packages}"
    )


def _is_whole(name: str) -> bool:
    """Whether the system has all libraries of an OpenGL."""
    return all(any(_is_there(library) for library in group) for group in _LIBRARIES[name][0])


def _is_there(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def _context(name: str) -> Any:
    """Return the class of contexts of an OpenGL."""
    try:
        return importlib.import_module(f"mujoco.{name}").GLContext
    except (ImportError, AttributeError) as error:
        raise MissingExtraError(f"drawing pictures by {name} fails: {' '.join(str(error).split())}") from error
