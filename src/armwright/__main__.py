"""``python -m armwright`` is the command ``armwright``."""

import os
import signal


def main() -> None:
    """Run the command line; who stops it while it is being imported sees no traceback."""
    # A closed stream is an empty one, before any file gets its number.
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from armwright.cli import app  # noqa: PLC0415 - takes a fifth of a second

    app.main()


if __name__ == "__main__":
    main()
