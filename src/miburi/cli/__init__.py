"""The command ``miburi``."""

import sys

__all__ = ["main"]


def main() -> None:
    """Run the command line; Ctrl-C ends it with a message even while it loads."""
    try:
        from miburi.cli.commands import main as run
    except KeyboardInterrupt:
        print("miburi: interrupted.", file=sys.stderr)
        sys.exit(130)
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] == "miburi":
            raise  # a bug in Miburi
        print(
            f"miburi: the command needs {error.name}, which is not installed. A small installation "
            "has the library alone. To get the rest, run `pip install FILE`, where FILE is the "
            "wheel or the folder that Miburi came from.",
            file=sys.stderr,
        )
        sys.exit(1)
    run()
