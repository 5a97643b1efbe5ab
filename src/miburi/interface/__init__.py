"""How programs reach a live partner: HTTP, WebSocket and the Python clients."""
