"""Run the command ``miburi`` as ``python -m miburi``."""

from miburi.cli import main

main()
