"""Connections: access control, encryption, and priority for Stop."""
