"""The messages that programs and a live partner exchange; no server and no client is in here."""
