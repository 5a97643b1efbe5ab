"""Miburi's version. The build reads it from here, and so does every module that states it."""

__version__ = "0.2.0"
