"""Miburi's version. The build and every module that states it read it from here."""

__version__ = "0.2.0"
