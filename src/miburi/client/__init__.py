"""How programs elsewhere use a live partner: Python clients over HTTP and WebSocket.

remote        for ordinary programs, by :func:`miburi.connect`
asynchronous  for asyncio, by :func:`miburi.connect_async`
connection    requests, and streams that reconnect
asker         requests that do not block, for doors
trusting      certificates
"""
