"""Reading pictures: PNG and JPEG as grey values, whose size is looked at before they are unpacked."""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
import numpy.typing as npt

from armwright.errors import FileFormatError
from armwright.files.inputs import read_bytes
from armwright.files.limits import limit, limit_message

if TYPE_CHECKING:
    from PIL import Image

GreyPicture: TypeAlias = npt.NDArray[np.uint8]

# Names of pictures by how they end.
ENDINGS = (".png", ".jpg", ".jpeg")
# The beginning of every PNG file.
_PNG = b"\x89PNG"
_MEGAPIXEL = 1_000_000


def read_grey_picture(path: Path | str) -> GreyPicture:
    """Return the grey values (height, width) of a picture, as it is stored: no mark of orientation turns it.

    Args:
        path: of a PNG or JPEG file.

    Raises:
        FileFormatError: the file is missing, larger than the limit, no such picture, or broken; or the picture has more
            pixels than the limit.
    """
    # They cost a tenth of a second, and only pictures need them. `Image.open` has a limit of its own.
    from PIL.JpegImagePlugin import JpegImageFile  # noqa: PLC0415
    from PIL.PngImagePlugin import PngImageFile  # noqa: PLC0415

    data = read_bytes(path, "picture_mb")
    try:
        picture = (PngImageFile if data.startswith(_PNG) else JpegImageFile)(io.BytesIO(data))
        width, height = picture.size
        too_large = width * height > limit("picture_megapixels") * _MEGAPIXEL
        grey = np.zeros((0, 0), dtype=np.uint8) if too_large else _grey(picture)
    except Exception as error:  # a decoder of broken data raises whatever it runs into
        message = "expected a picture as PNG or JPEG; this file is none, or broken"
        raise FileFormatError(path, None, "", message) from error
    if too_large:
        size = f"{width:,} x {height:,} pixels"
        raise FileFormatError(path, None, "", f"too large: {limit_message('picture_megapixels', size)}")
    return grey


def _grey(picture: Image.Image) -> GreyPicture:
    if picture.mode.startswith("I"):
        # Sixteen bits for each pixel, of which the upper eight are kept.
        return np.asarray(np.asarray(picture, dtype=np.uint32) >> 8, dtype=np.uint8)
    return np.array(picture.convert("L"))
