"""What a live partner offers to programs, over HTTP and WebSocket."""
