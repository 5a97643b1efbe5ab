"""How programs reach a live partner: HTTP, WebSocket, the Python client, and access control."""
