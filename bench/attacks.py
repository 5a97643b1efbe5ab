"""Attack a partner in every way that we know, one after the other; about 50 minutes.

    python bench/attacks.py [NAME …]

Each attack is a program of its own, whose result stands beside it as a .txt file. Without names all
are made. Ctrl-C ends it; what was measured by then is kept.
"""

import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).parent
#: Programs and what they are given.
ATTACKS = {
    "studio/attack": ["--minutes", "4", "--stops", "1000"],
    "studio/crowded": ["--stops", "1000"],
    "studio/deaf": [],
    "studio/half_closed": ["--connections", "1000"],
    "studio/kept": ["--tries", "10000"],
    "studio/pages": [],
    "studio/names": [],
    "studio/undo": ["--stops", "1000"],
}


def main() -> None:
    for name in sys.argv[1:] or ATTACKS:
        command = [f"bench/{name}.py", *ATTACKS[name]]
        print("$ python", *command, flush=True)
        done = subprocess.run(
            [sys.executable, HERE / f"{name}.py", *ATTACKS[name]],
            stdout=subprocess.PIPE, text=True, check=False,
        )  # fmt: skip
        if done.returncode == 0:
            (HERE / f"{name}.txt").write_text(done.stdout, encoding="utf-8")
        print(done.stdout or f"it ended with {done.returncode}", flush=True)


if __name__ == "__main__":
    main()
