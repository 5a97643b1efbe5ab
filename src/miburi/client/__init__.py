"""Python clients of a live partner, over HTTP and WebSocket.

remote        for ordinary programs, by :func:`miburi.connect`
asynchronous  for asyncio, by :func:`miburi.connect_async`
connection    requests, and streams that reconnect
sending       requests from a thread
answers       answers, also of a newer partner
asker         asynchronous requests, for doors
trusting      certificates
"""
