"""Other interfaces of a partner: for agents, homes and laboratories, and its voice."""
