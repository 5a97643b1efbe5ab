"""Each comparison, constant, sign and connective of the rule, changed: the traces must notice."""

import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
from toolchain import HERE, NATIVE, SKETCH
from traces import decide, random_traces

#: What a token may be changed into.
CHANGES = {
    "<": ("<=", ">"),
    ">": (">=", "<"),
    "<=": ("<", ">="),
    ">=": (">", "<="),
    "==": ("!=",),
    "!=": ("==",),
    "&&": ("||",),
    "||": ("&&",),
    "+": ("-",),
    "-": ("+",),
    "*": ("+",),
    "/": ("*",),
    "+=": ("-=",),
    "-=": ("+=",),
    ">>=": ("<<=",),
    "?": ("? 0 *",),
    "return true": ("return false",),
    "return false": ("return true",),
}
_TOKEN = re.compile(
    r"return true|return false|>>=|<<|>>|->|[<>=!]=|&&|\|\||[+-]=|\+\+|[<>?]|(?<= )[-+*/](?= )|"
    r"(?<![\w.])\d+(?=U?L*\b)"
)

#: Changes that change nothing, each with the reason.
EQUIVALENT = {
    # At the seam of two branches both give the same number.
    ("profile.h", "if (time < 0) {", "<="): "travel at time 0 is 0 either way",
    ("profile.h", "if (left < 0) {", "<="): "at the end, falling has come to the distance",
    ("profile.h", "if (short_ramp < full_ramp) {", "<="): "",
    ("contact.h", "inline int32_t distance_between(int32_t a, int32_t b) "
     "{ return a < b ? b - a : a - b; }", "<="): "of equals, both differences are 0",
}  # fmt: skip


def mutants() -> list[tuple[str, int, int, int, str]]:
    """File, line, columns and the new text of each change."""
    found = []
    for name in ("contact.h", "profile.h"):
        for number, line in enumerate((SKETCH / name).read_text().splitlines()):
            code = line.split("//")[0]
            if code.startswith(("#", "namespace", "}")) or "static_cast<" in code and False:
                continue
            for token in _TOKEN.finditer(code):
                text = token.group()
                # Angle brackets of a cast are no comparison.
                around = code[: token.start()].rstrip(), code[token.end() :]
                if text in "<>" and (around[0].endswith("static_cast") or "static_cast<" in
                                     code[max(0, token.start() - 25) : token.start()]):
                    continue
                if text.isdigit():
                    value = int(text)
                    changes: tuple[str, ...] = (str(value + 1), str(max(value - 1, 0)))
                else:
                    changes = CHANGES.get(text, ())
                for change in changes:
                    if change != text:
                        found.append((name, number, *token.span(), change))
    return found


def test_no_changed_rule_passes_for_the_rule(native: Path, tmp_path: Path) -> None:
    traces = random_traces(np.random.default_rng(11), 1500)
    data = np.int32(len(traces)).tobytes() + traces.tobytes()
    expected = decide(traces).tobytes()
    roots = np.array([0, 1, 3, 4, 15, 16, (1 << 62) - 1, 1 << 62, (1 << 64) - 1], dtype=np.uint64)
    ask_roots = np.int32(len(roots)).tobytes() + roots.tobytes()
    right_roots = subprocess.run([native, "roots"], input=ask_roots, capture_output=True).stdout
    flags = [flag for flag in NATIVE if not flag.startswith(("-W", f"-I{SKETCH}"))]
    survivors = []
    for name, number, start, end, change in mutants():
        folder = tmp_path / "mutant"
        folder.mkdir(exist_ok=True)
        for header in ("contact.h", "profile.h"):
            lines = (SKETCH / header).read_text().splitlines()
            if header == name:
                original = lines[number]
                lines[number] = original[:start] + change + original[end:]
            (folder / header).write_text("\n".join(lines) + "\n")
        program = tmp_path / "program"
        built = subprocess.run(
            [*flags, "-w", "-O0", f"-I{folder}", HERE / "traces_native.cpp", "-o", program],
            capture_output=True,
        )
        if built.returncode != 0:
            continue  # the compiler noticed
        if (name, original.strip(), change) in EQUIVALENT:
            continue
        try:
            said = subprocess.run([program], input=data, capture_output=True, timeout=20).stdout
            rooted = subprocess.run(
                [program, "roots"], input=ask_roots, capture_output=True, timeout=20
            ).stdout
        except subprocess.TimeoutExpired:
            continue
        if said == expected and rooted == right_roots:
            survivors.append(f"{name}:{number + 1}: {original.strip()}  [{original[start:end]} → {change}]")
    assert not survivors, "\n".join(survivors)


def test_with_the_limit_at_zero_nothing_is_slow(native: Path) -> None:
    """The mutation that shows that these tests can fail: at ratio 0 the rule is off."""
    traces = random_traces(np.random.default_rng(12), 300)
    assert np.any(decide(traces)["sign"] == 1)
    traces["rule"]["ratio"] = 0
    assert not np.any(decide(traces)["sign"] == 1)
