"""STEP files, by Open CASCADE in a process of its own, which makes triangles of their surfaces."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from armwright.errors import FileFormatError
from armwright.extras import require_extra
from armwright.files.limits import MEGABYTE, limit, limit_message
from armwright.spatial.meshes import step_process
from armwright.spatial.meshes.gltf import Assembly, read_gltf

_MAGIC = b"ISO-10303-21;"
# Distance of the triangles from a curved surface [µm].
_TOLERANCE = 20
# Other files that a file names are not read; it would lack parts.
_REFERENCES = (b"DOCUMENT_FILE", b"APPLIED_EXTERNAL_IDENTIFICATION_ASSIGNMENT")
# A process that computes for its whole time may have waited for as long.
_WAITING = 5


def read_step(path: Path, data: bytes) -> Assembly:
    """Return the parts of a STEP file, in metres: the file has its unit.

    Args:
        path: of the file, for messages.
        data: what the file holds.

    Raises:
        MissingExtraError: cascadio is not installed.
        FileFormatError: the file is no STEP, has no surfaces, names other files, or needs too much memory or time.
    """
    require_extra("cascadio", "reading STEP", "cad")
    if not data.lstrip().startswith(_MAGIC):
        raise FileFormatError(path, None, "", f"no STEP: expected {_MAGIC.decode()} at its beginning")
    for word in _REFERENCES:
        if word in data:
            message = f"names other files ({word.decode()}), which are not read; export the assembly as one file"
            raise FileFormatError(path, None, "", message)
    return read_gltf(path, _converted(path, data))


def _converted(path: Path, data: bytes) -> bytes:
    """Return the parts of a STEP file as binary glTF."""
    seconds = limit("step_s")
    numbers = limit("step_mb") * MEGABYTE, seconds, limit("mesh_mb") * MEGABYTE, _TOLERANCE
    # -P: no module beside the script takes the place of another.
    command = [sys.executable, "-P", step_process.__file__, *map(str, numbers)]
    try:
        # Only the file goes in, and nothing of it is part of the command.
        done = subprocess.run(  # noqa: S603
            command,
            input=data,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            timeout=_WAITING * seconds,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise FileFormatError(path, None, "", f"takes too long: {limit_message('step_s')}") from None
    except OSError as error:
        raise FileFormatError(path, None, "", f"the process that reads STEP did not start: {error.strerror}") from error
    if done.returncode == 0:
        return done.stdout
    if done.returncode == step_process.NOTHING:
        raise FileFormatError(path, None, "", "no surfaces could be read from it; it may be broken or empty")
    if done.returncode == step_process.TOO_LARGE:
        raise FileFormatError(path, None, "", f"needs too much memory: {limit_message('step_mb')}")
    raise FileFormatError(
        path,
        None,
        "",
        f"the process that reads STEP died; the file is broken, or needs more than {seconds} s or "
        f"{limit('step_mb'):,} MB (`armwright --raise step_s=NUMBER,step_mb=NUMBER ...` allows more)",
    )
