"""Print the contacts of a live partner. Start one with `make run`; end this with Ctrl-C.

python examples/listen_to_contacts.py http://127.0.0.1:8080
"""

import sys
from contextlib import suppress

from miburi import connect

with suppress(KeyboardInterrupt), connect(sys.argv[1]) as partner:
    for event in partner.events():
        if event.stop is not None and event.stop.reason == "contact":
            print(f"{event.time:.2f} s: the {event.stop.motor} met something", flush=True)
