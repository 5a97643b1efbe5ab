"""Helpers for every room: compiled code, TOML files, safe writing, templates."""
