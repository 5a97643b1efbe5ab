"""Helpers for every subpackage: compiled code, TOML files, safe writing, templates."""
