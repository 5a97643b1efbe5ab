"""Other ways to reach a partner: by agents, homes and laboratories, and its voice."""
