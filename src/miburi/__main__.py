"""``python -m miburi`` is the command ``miburi``."""

from miburi.cli import main

main()
