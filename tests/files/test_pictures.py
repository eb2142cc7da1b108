"""Pictures are read as they are stored, and never more of one than its limit allows."""

import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from armwright.errors import FileFormatError
from armwright.files.limits import raised
from armwright.files.pictures import read_grey_picture


@pytest.fixture
def grey(rng: np.random.Generator) -> np.ndarray:
    return rng.integers(0, 256, (24, 40), dtype=np.uint8)


def test_grey_values_come_back(grey: np.ndarray, tmp_path: Path) -> None:
    """A PNG of grey values is read without a change; of sixteen bits the upper eight are kept."""
    Image.fromarray(grey).save(tmp_path / "a.png")
    Image.fromarray(grey.astype(np.uint16) * 256 + 77).save(tmp_path / "b.png")

    np.testing.assert_array_equal(read_grey_picture(tmp_path / "a.png"), grey)
    np.testing.assert_array_equal(read_grey_picture(tmp_path / "b.png"), grey)


def test_colours_become_grey_and_no_mark_turns_a_picture(tmp_path: Path) -> None:
    """Green is brighter than blue; a JPEG that asks to be turned is read as the camera saw it."""
    colours = np.zeros((16, 32, 3), dtype=np.uint8)
    colours[:, :16, 1], colours[:, 16:, 2] = 200, 200
    turned = Image.Exif()
    turned[0x0112] = 6
    Image.fromarray(colours).save(tmp_path / "a.jpg", exif=turned, quality=95)

    picture = read_grey_picture(tmp_path / "a.jpg")

    assert picture.shape == (16, 32)
    assert picture[8, 4] > picture[8, 28] + 50


def test_a_picture_beyond_its_limits_is_not_unpacked(grey: np.ndarray, tmp_path: Path) -> None:
    """A small file that names a huge picture, and a large file, are refused by their limits."""
    Image.fromarray(grey).save(tmp_path / "a.png")
    data = bytearray((tmp_path / "a.png").read_bytes())
    data[16:24] = struct.pack(">II", 200_000, 200_000)
    data[29:33] = struct.pack(">I", zlib.crc32(data[12:29]))
    (tmp_path / "huge.png").write_bytes(data)

    with pytest.raises(FileFormatError, match=r"huge.png: too large: 200,000 x 200,000 pixels; the limit is 100 mega"):
        read_grey_picture(tmp_path / "huge.png")
    noise = np.frombuffer(np.random.default_rng(0).bytes(1200 * 1200), dtype=np.uint8).reshape(1200, 1200)
    Image.fromarray(noise).save(tmp_path / "large.png")
    with raised(picture_mb=1), pytest.raises(FileFormatError, match="picture_mb=NUMBER"):
        read_grey_picture(tmp_path / "large.png")


def test_what_is_no_picture_is_refused(grey: np.ndarray, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Texts, pictures that are cut off or changed, and other formats have one message, and no library prints."""
    Image.fromarray(grey).save(tmp_path / "good.png")
    Image.fromarray(grey).save(tmp_path / "good.jpg")
    Image.fromarray(grey).save(tmp_path / "other.bmp")
    png, jpeg = ((tmp_path / f"good.{kind}").read_bytes() for kind in ("png", "jpg"))
    changed = bytearray(png)
    changed[60] ^= 0xFF
    broken = {"text": b"no picture", "empty": b"", "cut": png[:200], "short": jpeg[:100], "changed": bytes(changed)}
    broken["bmp"] = (tmp_path / "other.bmp").read_bytes()

    for name, data in broken.items():
        (tmp_path / name).write_bytes(data)
        with pytest.raises(FileFormatError, match=f"{name}: expected a picture as PNG or JPEG"):
            read_grey_picture(tmp_path / name)
    assert capfd.readouterr() == ("", "")
