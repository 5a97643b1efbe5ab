"""Print the contacts of a live partner. Start one with `make run`; end this with Ctrl-C.

python examples/listen_to_contacts.py http://127.0.0.1:8080
"""

import sys
from contextlib import suppress

from miburi import connect

latest = None
with suppress(KeyboardInterrupt), connect(sys.argv[1]) as partner:
    for state in partner.watch(rate=20):
        stop = state.stop
        if stop is not None and stop.reason == "contact" and stop.time != latest:
            latest = stop.time
            print(f"{stop.time:.2f} s: the {stop.motor} met something", flush=True)
