"""Let the partner notice what becomes of a file.

Start the partner with `miburi run --senses examples/own_sense.toml`, and then, in another terminal:

python examples/own_sense.py http://127.0.0.1:8080 notes.txt
"""

import sys
import time
from pathlib import Path

from miburi import connect


def watch(url: str, file: Path) -> None:
    """Report each time the file grows, more clearly the more it grows, until it is gone."""
    with connect(url) as partner:
        size = file.stat().st_size
        print(f"it has {size} bytes", flush=True)
        try:
            while True:
                grown = file.stat().st_size - size
                if grown > 0:
                    partner.sense("file_grew", min(1.0, grown / 1000))
                    print(f"it grew by {grown} bytes", flush=True)
                size += grown
                time.sleep(0.5)
        except FileNotFoundError:
            partner.sense("file_gone")
            print("it is gone", flush=True)


watch(sys.argv[1], Path(sys.argv[2]))
