"""Put the tables beside this file into ``docs/inverse-kinematics.md``, where it names them."""

import re
from pathlib import Path

HERE = Path(__file__).parent
PAGE = HERE.parents[1] / "docs" / "inverse-kinematics.md"


def main():
    text = PAGE.read_text()
    for name in ("reach", "reproduction", "comparison", "functions"):
        table = HERE / f"{name}.md"
        if table.exists():
            mark = f"<!-- {name}.md -->"
            table_before = r"(?:(?:(?!<!-- ).)*<!-- end -->\n)?"  # up to its own end, no other's
            old = re.compile(re.escape(mark) + r"\n" + table_before, re.DOTALL)
            new = f"{mark}\n\n{table.read_text()}\n<!-- end -->\n"
            text = old.sub(lambda _, new=new: new, text)
    PAGE.write_text(text)


if __name__ == "__main__":
    main()
