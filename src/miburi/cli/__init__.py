"""The command ``miburi``."""

import sys

__all__ = ["main"]


def main() -> None:
    """Run the command line; Ctrl-C while it still loads ends it with a word, too."""
    try:
        from miburi.cli.commands import main as run
    except KeyboardInterrupt:
        print("miburi: interrupted.", file=sys.stderr)
        sys.exit(130)
    run()
