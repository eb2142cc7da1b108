"""A process of its own that converts a STEP file to glTF: limits on its memory and time cannot harm another then.

It is started as a script and knows nothing of armwright. The file comes in by the standard input, binary glTF goes out
by the standard output.
"""

import os
import resource
import sys

# Exit statuses: there are no triangles; they need more memory or more bytes than allowed.
NOTHING, TOO_LARGE = 3, 4


def main(memory: int, seconds: int, largest: int, tolerance: int) -> int:
    """Convert the standard input.

    Args:
        memory: bytes of memory at most.
        seconds: of computing at most.
        largest: bytes of the result at most.
        tolerance: distance of triangles from the surface [µm].

    Returns:
        the exit status.
    """
    resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_FSIZE, (largest, largest))
    # The library reports on the standard output, which is for the result.
    result = os.dup(1)
    os.dup2(2, 1)
    try:
        import cascadio  # noqa: PLC0415 - within the limits

        data = sys.stdin.buffer.read()
        glb = cascadio.to_glb_bytes(data, cascadio.FileType.STEP, tol_linear=tolerance * 1e-3, use_parallel=False)
    except (ImportError, MemoryError, OSError, RuntimeError):
        return TOO_LARGE
    if not glb:
        return NOTHING
    if len(glb) > largest:
        return TOO_LARGE
    with os.fdopen(result, "wb") as stream:
        stream.write(glb)
    return 0


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
