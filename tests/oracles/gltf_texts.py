"""glTF files written by hand: arrays in one buffer, and nodes as they are asked for."""

import base64
import json
from typing import Any

from numpy.typing import NDArray

_CODES = {"uint8": 5121, "uint16": 5123, "uint32": 5125, "float32": 5126}


def gltf(
    arrays: list[NDArray[Any]], primitives: list[list[dict[str, Any]]], nodes: list[dict[str, Any]], **top: Any
) -> dict[str, Any]:
    """Return a glTF file as JSON data.

    Args:
        arrays: (k,) or (k, 3), each an accessor.
        primitives: of each mesh.
        nodes: as they stand in the file.
        top: other keys at the top, or others in place of these.
    """
    data, views, accessors = b"", [], []
    for number, array in enumerate(arrays):
        data += b"\x00" * (-len(data) % 4)
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": array.nbytes})
        kind = "SCALAR" if array.ndim == 1 else "VEC3"
        accessors.append(
            {"bufferView": number, "componentType": _CODES[str(array.dtype)], "count": len(array), "type": kind}
        )
        data += array.tobytes()
    uri = f"data:application/octet-stream;base64,{base64.b64encode(data).decode()}"
    return {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": len(data), "uri": uri}],
        "bufferViews": views,
        "accessors": accessors,
        "meshes": [{"primitives": row} for row in primitives],
        "nodes": nodes,
        **top,
    }


def glb(content: dict[str, Any], binary: bytes | None = None) -> bytes:
    """Return a binary glTF file."""
    text = json.dumps(content).encode()
    text += b" " * (-len(text) % 4)
    chunks = len(text).to_bytes(4, "little") + b"JSON" + text
    if binary is not None:
        chunks += len(binary).to_bytes(4, "little") + b"BIN\x00" + binary
    return b"glTF" + (2).to_bytes(4, "little") + (12 + len(chunks)).to_bytes(4, "little") + chunks
