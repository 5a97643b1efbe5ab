"""The bill: what to buy, what to print, and what it weighs.

``bill.toml`` and the printed parts become rows for a table or a CSV file. Grams and hours come from
PrusaSlicer where it is installed; otherwise grams are estimated and hours are left out.
"""

import csv
import io
import re
import shutil
import subprocess
import tempfile
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, fields
from importlib import resources
from pathlib import Path

from miburi.errors import MiburiError
from miburi.hardware.balance import ballast
from miburi.hardware.build import PrintedPart, printed_mass
from miburi.hardware.dimensions import dimensions
from miburi.hardware.exports import stl
from miburi.hardware.screws import screw_counts
from miburi.robot import Robot


@dataclass(frozen=True)
class BillRow:
    """A line of the bill.

    Attributes
    ----------
    name, count
        The item, and how many of it.
    number
        The supplier's part number.
    price, currency, source
        The price of one piece, and where and when it was seen; None and empty if nobody looked it
        up.
    grams
        The mass of a printed part's filament, or of the ballast; None for other items.
    time
        How long a printed part takes, by the slicer.
    remark
        A note for the buyer.
    """

    name: str
    count: int
    number: str = ""
    price: float | None = None
    currency: str = ""
    source: str = ""
    grams: int | None = None
    time: str = ""
    remark: str = ""


def slicer() -> str | None:
    """Return PrusaSlicer's path, or None (Debian: prusa-slicer)."""
    return shutil.which("prusa-slicer")


def slice_part(program: str, part: PrintedPart, *, supports: bool = True) -> tuple[float, str]:
    """Return a slicer's estimate for a part: grams of filament, and the time, such as ``2h 3m``.

    The settings are those of ``dimensions.toml``.

    Raises
    ------
    MiburiError
        The slicer cannot slice the part.
    """
    settings = dimensions().printing
    with tempfile.TemporaryDirectory() as folder:
        model, code = Path(folder) / f"{part.name}.stl", Path(folder) / "part.gcode"
        model.write_bytes(stl(part.on_the_bed))
        # S603: the program's path comes from a search for its fixed name.
        done = subprocess.run(  # noqa: S603
            [
                program, "--export-gcode", "--layer-height", f"{settings.layer}",
                "--perimeters", f"{settings.perimeters}", "--fill-density", f"{settings.infill}%",
                "--filament-density", f"{settings.density}",
                *(["--support-material"] if supports else []),
                "--output", str(code), str(model),
            ],
            check=False, capture_output=True, text=True,
        )  # fmt: skip
        if done.returncode:
            raise MiburiError(f"PrusaSlicer could not slice {part.name}: {done.stderr.strip()}")
        said = code.read_text(encoding="utf-8", errors="replace")
    grams = re.search(r"filament used \[g\] = ([\d.]+)", said)
    time = re.search(r"estimated printing time \(normal mode\) = (.+)", said)
    return float(grams[1]) if grams else 0.0, time[1] if time else ""


def bill(
    robot: Robot, parts: Sequence[PrintedPart], program: str | None = None
) -> Iterator[BillRow]:
    """Yield what to buy, then what to print.

    ``program`` is the slicer's path; the slicer takes a few seconds per part.
    """
    counts = screw_counts(robot)
    text = (resources.files(__package__) / "bill.toml").read_text(encoding="utf-8")
    for item in tomllib.loads(text)["item"]:
        if screw := item.pop("screw", ""):
            item["count"] = counts[screw]
        yield BillRow(**item)
    yield BillRow(
        "ballast: loose steel, such as nuts", 1, grams=round(1000 * ballast(robot)),
        remark="in the foot's two chambers, in bags",
    )  # fmt: skip
    printed, whole = list[BillRow](), 0.0
    for part in parts:
        if program is None:
            grams, time, remark = 1000 * printed_mass(part), "", ""
        else:
            grams, time = slice_part(program, part)
            remark = "with supports"
        whole += grams
        name = f"printed: {part.name}"
        printed.append(BillRow(name, 1, grams=round(grams), time=time, remark=remark))
    told = "with supports" if program else "without supports (--slice tells more)"
    # Its grams are those of the parts, so a sum over the rows counts them once.
    yield BillRow("filament PETG", 1, remark=f"{whole:.0f} g {told}; and the gauge")
    yield from printed


def priced(rows: Sequence[BillRow]) -> str:
    """Return the total of the lines that have a price, in words, and how many have none."""
    totals: dict[str, float] = {}
    bought = [row for row in rows if not row.name.startswith("printed: ")]
    for row in bought:
        if row.price is not None:
            totals[row.currency] = totals.get(row.currency, 0.0) + row.count * row.price
    told = " + ".join(f"{total:.2f} {currency}" for currency, total in totals.items())
    without = sum(row.price is None for row in bought)
    return f"The lines with a price come to {told}; {without} others have none."


def to_csv(rows: Sequence[BillRow]) -> str:
    """Return the rows as CSV, with a header line."""
    held = io.StringIO(newline="")
    writer = csv.DictWriter(held, [field.name for field in fields(BillRow)], lineterminator="\n")
    writer.writeheader()
    writer.writerows(map(asdict, rows))
    return held.getvalue()
