"""Miburi's version: the build reads it from here, and every module that states it."""

__version__ = "0.2.0"
