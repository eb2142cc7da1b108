"""``python -m armwright`` is the command ``armwright``."""

import signal


def main() -> None:
    """Run the command line; who stops it while it is being imported sees no traceback."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from armwright.cli import app  # noqa: PLC0415 - takes a fifth of a second

    app.main()


if __name__ == "__main__":
    main()
