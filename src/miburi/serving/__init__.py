"""Connections: access control, encryption, and priority for Stop.

This package depends on nothing about robots.
"""
