"""Connections: access, encryption, and Stop before all else. This room knows no robot."""
