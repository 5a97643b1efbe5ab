"""Each comparison, constant, sign and connective of the rule, changed: the traces must notice."""

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from tests.firmware.toolchain import HERE, NATIVE, SKETCH, run
from tests.firmware.traces import decide, random_traces

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

_DISTANCE = (
    "inline int32_t distance_between(int32_t a, int32_t b) { return a < b ? b - a : a - b; }"
)
_ERROR = "error = error > most ? most : error < -most ? -most : error;"
_LOST = "const int32_t lost = (servo.lost * (motor < 0 ? -motor : motor)) >> 8;"
_SHARE = "return static_cast<int16_t>((fine + fine * (top < FAST ? top : FAST) / FAST) / 2);"
#: Changes that change nothing: at a seam, both sides give the same number.
EQUIVALENT = {
    (_ERROR, ">="),  # of equals, either is the same
    (_ERROR, "<="),
    (_LOST, "<="),  # 0 has no sign
    (_LOST, "1"),
    (_SHARE, "<="),
    ("if (speed > 0) {", ">="),  # friction leaves a motor that stands where it is
    ("motion.v = speed > taken ? speed - taken : 0;", ">="),
    ("motion.v = speed < -taken ? speed + taken : 0;", "<="),
    ("if (steps > 0) {", ">="),  # no step is nothing to follow
    ("if (time < 0) {", "<="),  # at time 0, rising has made 0
    ("if (time < 0) {", "1"),
    ("if (left < 0) {", "<="),  # with nothing left, falling has made the distance
    ("if (left < 0) {", "1"),
    (_DISTANCE, "<="),  # of equals, either difference is 0
    ("return tip < p.speed ? tip : p.speed;", "<="),  # of equals, either is the same
}


def mutants(name: str) -> list[tuple[int, int, int, str]]:
    """Line, columns and the new text of each change."""
    found = []
    for number, line in enumerate((SKETCH / name).read_text().splitlines()):
        code = line.split("//")[0]
        if code.startswith(("#", "namespace", "}")):
            continue
        for token in _TOKEN.finditer(code):
            text = token.group()
            # Angle brackets of a cast are no comparison.
            if text in "<>" and re.search(r"static_cast(<\w+)?$", code[: token.start()]):
                continue
            if text.isdigit():
                changes: tuple[str, ...] = (str(int(text) + 1), str(max(int(text) - 1, 0)))
            else:
                changes = CHANGES.get(text, ())
            found += [(number, *token.span(), change) for change in changes if change != text]
    return found


@pytest.mark.parametrize("name", ["contact.h", "free.h", "profile.h"])
def test_no_changed_rule_passes_for_the_rule(native: Path, tmp_path: Path, name: str) -> None:
    traces = random_traces(np.random.default_rng(11), 1500)
    data = np.int32(len(traces)).tobytes() + traces.tobytes()
    expected = decide(traces).tobytes()
    roots = np.array([0, 1, 3, 4, 15, 16, (1 << 62) - 1, 1 << 62, (1 << 64) - 1], dtype=np.uint64)
    ask_roots = np.int32(len(roots)).tobytes() + roots.tobytes()
    right_roots = subprocess.run(
        [native, "roots"], input=ask_roots, capture_output=True, check=False
    ).stdout
    flags = [flag for flag in NATIVE if not flag.startswith(("-W", f"-I{SKETCH}"))]
    survivors = []
    folder, program = tmp_path / "mutant", tmp_path / "program"
    shutil.copytree(SKETCH, folder)
    changed = mutants(name)
    assert len(changed) > 30
    for number, start, end, change in changed:
        lines = (SKETCH / name).read_text().splitlines()
        original = lines[number]
        lines[number] = original[:start] + change + original[end:]
        (folder / name).write_text("\n".join(lines) + "\n")
        built = subprocess.run(
            [*flags, "-w", "-O0", f"-I{folder}", HERE / "traces_native.cpp", "-o", program],
            capture_output=True,
            check=False,
        )
        if built.returncode != 0:
            continue  # the compiler noticed
        if (original.strip(), change) in EQUIVALENT:
            continue
        try:
            said = subprocess.run(
                [program], input=data, capture_output=True, check=False, timeout=20
            ).stdout
            rooted = subprocess.run(
                [program, "roots"], input=ask_roots, capture_output=True, check=False, timeout=20
            ).stdout
        except subprocess.TimeoutExpired:
            continue
        if said == expected and rooted == right_roots:
            was = original[start:end]
            survivors.append(f"{name}:{number + 1}: {original.strip()}  [{was} → {change}]")
    assert not survivors, "\n".join(survivors)


def test_with_the_limit_at_zero_nothing_is_slow(native: Path) -> None:
    """The mutation that shows that these tests can fail: at ratio 0 a blocked motor is fine."""
    traces = random_traces(np.random.default_rng(12), 300)
    traces["looks"]["positions"] = traces["motion"]["start"][:, None, :]
    assert np.mean(decide(traces)["sign"] == 1) > 0.1
    traces["rule"]["ratio"] = 0
    assert not np.any(decide(traces)["sign"] == 1)
    count = np.int32(len(traces)).tobytes()
    assert run(native, data=count + traces.tobytes()) == decide(traces).tobytes()
