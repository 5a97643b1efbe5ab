"""What happened to a running partner: one model, one log and one file for all interfaces."""
