"""The command ``miburi``."""

from miburi.cli.main import main

__all__ = ["main"]
