"""Each comparison, constant, sign and connective of the rule, changed: the traces must notice."""

import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
from tests.firmware.toolchain import HERE, SKETCH, run
from tests.firmware.traces import LOOKS, Records, decide, random_traces

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
_CLAMPED = "return value > most ? most : value < -most ? -most : value;"
_LOST = "const int32_t lost = (servo.lost * (motor < 0 ? -motor : motor)) >> 8;"
_SHARE = "return static_cast<int16_t>((fine + fine * (top < FAST ? top : FAST) / FAST) / 2);"
_SPEED = "const int32_t own = distance_between(velocity, 0);"
_TOP = "const int32_t top = fastest(profile) < own ? own : fastest(profile);"
_LATER = "watch.share[motor] = granted(watch.profile[motor], 0);"
_CLIPPED = "return value > most ? most : value;"
_SHARED = "watch.early[motor] = share > watch.early[motor] ? share : watch.early[motor];"
_DOUBTED = (
    "watch.early_doubt[motor] = "
    "doubt > watch.early_doubt[motor] ? doubt : watch.early_doubt[motor];"
)
_SIZE = "inline int32_t size_of(int32_t speed) { return speed < 0 ? -speed : speed; }"
_FASTEST = "return tip < initial ? initial : tip;"
_ROOT = "square > 0 ? static_cast<int64_t>(square_root(static_cast<uint64_t>(square))) : 0;"
_WAY = "return way < 0 ? -over_two_seconds(static_cast<uint64_t>(-way))"
_PART = "const int32_t share = small_quotient(gone, profile.distance, 9);"
_DIGIT = "const int32_t digit = small_quotient(high, odd, 8);"
_REST = "return (digit << 16) + small_quotient((rest << 16) | static_cast<uint16_t>(n), odd, 16);"
#: Changes that change nothing: at a seam, both sides give the same number.
EQUIVALENT = {
    (_CLAMPED, ">="),  # of equals, either is the same
    (_CLAMPED, "<="),
    (_LOST, "<="),  # 0 has no sign
    (_LOST, "1"),
    (_SHARE, "<="),
    (_TOP, "<="),  # of equals, either is the same
    (_SPEED, "1"),  # 1/256 step/s is less than a share can show
    (_LATER, "1"),
    ("if (speed > 0) {", ">="),  # friction leaves a motor that stands where it is
    ("motion.v = speed > taken ? speed - taken : 0;", ">="),
    ("motion.v = speed < -taken ? speed + taken : 0;", "<="),
    ("if (steps > 0) {", ">="),  # no step is nothing to follow
    ("if (time < 0) {", "<="),  # at time 0, rising has made 0
    ("if (time < 0) {", "1"),
    ("if (left < 0) {", "<="),  # with nothing left, falling has made the distance
    ("if (left < 0) {", "1"),
    (_CLIPPED, ">="),  # of equals, either is the same
    ("if (value < 0) {", "<="),
    ("if (value < 0) {", "1"),
    (_SIZE, "<="),  # 0 has no sign
    (_SIZE, "1"),
    (_FASTEST, "<="),  # of equals, either is the same
    (_ROOT, ">="),  # the root of 0 is 0
    (_ROOT, "1"),  # and 1 µs more or less of a ramp that is none moves nothing
    ("p.ramp = tip > halt ? tip - halt : 0;", ">="),  # of equals, either is 0
    ("p.ramp = full > halt ? full - halt : halt - full;", ">="),
    ("p.slows = initial > tip_of(p) ? -1 : 1;", ">="),  # a ramp between equal speeds is none
    (_WAY, "<="),  # 0 has no sign
    (_WAY, "1"),
    (_PART, "10"),  # a quotient may have more bits than it needs
    (_DIGIT, "9"),
    (_REST, "17"),
    (_DIGIT, "7"),  # only a way of more than 2^15 steps needs the eighth; none of a trace has it
    (_SHARED, ">="),  # of equals, either is the same
    (_DOUBTED, ">="),
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


#: What the rule's program stands on; everything else of it is written anew for each change.
_LIBRARIES = "".join(
    f"#include <{name}>\n"
    for name in ("cstdint", "cstdio", "cstdlib", "cstring", "stdint.h", "sys/resource.h")
)
_INCLUDE = re.compile(r'^#include (?:"(.+)"|<.+>)$')
#: Most changes are seen in a few traces already.
FEW, ALL = 100, 4000
#: s of the processor's time for one change, some of which run for ever; the rule takes 0.5 to 1.
LONGEST = 3


def inline(path: Path, changed: str, text: str, seen: set[Path]) -> str:
    """Return a file with all that it includes, each once; ``text`` is that of ``changed``."""
    seen.add(path)
    lines = []
    for line in (text if path.name == changed else path.read_text(encoding="utf-8")).splitlines():
        include = _INCLUDE.match(line)
        if include and include[1]:
            near = path.parent / include[1]
            found = near if near.exists() else SKETCH / include[1]
            if found not in seen:
                lines.append(inline(found, changed, text, seen))
        elif not include and line != "#pragma once":
            lines.append(line)
    return "\n".join(lines)


def build(name: str, texts: list[str], folder: Path) -> Path:
    """Build one program of all changed rules; its first word says which is to run.

    A change that g++ refuses fails here.
    """
    programs = [
        f"namespace change{k} {{\n{inline(HERE / 'traces_native.cpp', name, text, set())}\n}}\n"
        for k, text in enumerate(texts)
    ]
    calls = "".join(f"change{k}::main, " for k in range(len(texts)))
    choice = f"int (*const changes[])(int, char**) = {{{calls}}};\n"
    main = f"""int main(int n, char** words) {{
      const rlimit longest = {{{LONGEST}, {LONGEST}}};
      setrlimit(RLIMIT_CPU, &longest);
      return changes[std::atoi(words[1])](n - 1, words + 1);
    }}
    """
    source, program = folder / "changes.cpp", folder / "changes"
    source.write_text("".join([_LIBRARIES, *programs, choice, main]))
    run("g++", "-std=gnu++11", "-w", "-O0", source, "-o", program)
    return program


def answer(program: Path, *words: str, data: bytes) -> bytes:
    """Return what a program says, be it cut short by its time limit or a crash."""
    return subprocess.run([program, *words], input=data, capture_output=True, check=False).stdout


def numbered(records: Records) -> bytes:
    return np.int32(len(records)).tobytes() + records.tobytes()


@pytest.fixture(scope="module")
def judged() -> tuple[Records, Records]:
    """Traces, and what the reference decides of them."""
    traces = random_traces(np.random.default_rng(11), ALL)
    return traces, decide(traces)


@pytest.mark.proof("test_native_rule_equals_the_reference")
@pytest.mark.parametrize("name", ["contact.h", "free.h", "profile.h"])
def test_no_changed_rule_passes_for_the_rule(
    native: Path, tmp_path: Path, judged: tuple[Records, Records], name: str
) -> None:
    roots = np.array([0, 1, 3, 4, 15, 16, (1 << 62) - 1, 1 << 62, (1 << 64) - 1], dtype=np.uint64)
    ask_roots = np.int32(len(roots)).tobytes() + roots.tobytes()
    right_roots = answer(native, "roots", data=ask_roots)
    lines = (SKETCH / name).read_text().splitlines()
    changed = [one for one in mutants(name) if (lines[one[0]].strip(), one[3]) not in EQUIVALENT]
    assert len(changed) > 30

    def text(number: int, start: int, end: int, change: str) -> str:
        line = lines[number][:start] + change + lines[number][end:]
        return "\n".join([*lines[:number], line, *lines[number + 1 :]])

    program = build(name, ["\n".join(lines), *(text(*one) for one in changed)], tmp_path)
    parts = [(numbered(traces[:n]), decisions[:n].tobytes())
             for traces, decisions in [judged] for n in (FEW, ALL)]  # fmt: skip

    def passes(k: int) -> bool:
        """Whether the rule with change k does as the rule does; the first is without a change."""
        return all(answer(program, str(k), data=data) == right for data, right in parts) and (
            answer(program, str(k), "roots", data=ask_roots) == right_roots
        )

    assert passes(0)
    survivors = [
        f"{name}:{number + 1}: {lines[number].strip()}  [{lines[number][start:end]} → {change}]"
        for k, (number, start, end, change) in enumerate(changed, 1)
        if passes(k)
    ]
    assert not survivors, "\n".join(survivors)


def test_with_the_limit_at_zero_nothing_is_slow(native: Path) -> None:
    """The mutation that shows that these tests can fail: at ratio 0 a blocked motor is fine."""
    traces = random_traces(np.random.default_rng(12), 300)
    traces["looks"]["positions"] = traces["motion"]["start"][:, None, :]
    # Nothing replaces these moves.
    traces["again"], traces["looks"]["time"] = LOOKS, np.sort(traces["looks"]["time"], axis=1)
    assert np.mean(decide(traces)["sign"] == 1) > 0.1
    traces["rule"]["ratio"] = 0
    assert not np.any(decide(traces)["sign"] == 1)
    count = np.int32(len(traces)).tobytes()
    assert run(native, data=count + traces.tobytes()) == decide(traces).tobytes()
