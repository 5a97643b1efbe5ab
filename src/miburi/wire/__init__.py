"""The messages between programs and a running partner, without a server or a client."""
