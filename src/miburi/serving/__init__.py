"""Connections: who may come in, how, and Stop before all else; it knows no robot."""
