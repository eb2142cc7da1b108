"""``python -m armwright`` is the command ``armwright``."""

from armwright.cli.app import main

main()
