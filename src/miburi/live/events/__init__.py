"""The events of a running partner: one model, one log and one file for all interfaces."""
