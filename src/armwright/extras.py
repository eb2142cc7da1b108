"""Libraries that the core does not install: they come with the extras of the package."""

from importlib import import_module
from importlib.util import find_spec
from types import ModuleType

from armwright.errors import MissingExtraError


def import_extra(module: str, purpose: str, extra: str, library: str = "") -> ModuleType:
    """Import a module of a library that an extra installs.

    Args:
        module: full name of the module.
        purpose: what needs it, for the message.
        extra: name of the extra.
        library: name of the library, where it is not the first part of the name of the module.

    Raises:
        MissingExtraError: the library is not installed.
    """
    try:
        return import_module(module)
    except ImportError as error:
        raise _missing(purpose, extra, library or module.partition(".")[0]) from error


def opencv(purpose: str) -> ModuleType:
    """Import OpenCV.

    Args:
        purpose: what needs it, for the message.

    Raises:
        MissingExtraError: it is not installed.
    """
    return import_extra("cv2", purpose, "physics", "opencv-python-headless")


def require_extra(module: str, purpose: str, extra: str) -> None:
    """Refuse to go on without a library that another process imports.

    Raises:
        MissingExtraError: the library is not installed.
    """
    if find_spec(module) is None:
        raise _missing(purpose, extra, module)


def _missing(purpose: str, extra: str, library: str) -> MissingExtraError:
    return MissingExtraError(f"{purpose} needs {library}; install it by: pip install 'armwright[{extra}]'")
