"""Keep what happens to a partner in a file of your own; end this with Ctrl-C, begin it again later.

python examples/log_to_sqlite.py http://127.0.0.1:8080 events.db
"""

import sqlite3
import sys
from contextlib import closing, suppress

from miburi import connect

TABLE = "CREATE TABLE IF NOT EXISTS events (id TEXT PRIMARY KEY, wall TEXT, kind TEXT, json TEXT)"
LATEST = "SELECT id FROM events ORDER BY rowid DESC LIMIT 1"

with (
    suppress(KeyboardInterrupt),
    closing(sqlite3.connect(sys.argv[2])) as file,
    connect(sys.argv[1]) as partner,
):
    file.execute(TABLE)
    latest = file.execute(LATEST).fetchone()
    for event in partner.events(after=latest[0] if latest else "0", patience=float("inf")):
        row = (event.id, event.wall.isoformat(), event.kind, event.model_dump_json())
        with file:
            file.execute("INSERT OR IGNORE INTO events VALUES (?, ?, ?, ?)", row)
        print(event.id, event.kind, flush=True)
