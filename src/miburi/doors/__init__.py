"""Other protocols by which a partner is met: agents, homes, laboratories, a voice."""
