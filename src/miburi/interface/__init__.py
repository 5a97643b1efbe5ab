"""The doors for programs: HTTP, WebSocket, client, and who may use them."""
