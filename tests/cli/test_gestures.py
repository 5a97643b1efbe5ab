import json
from importlib import resources

import pytest
from typer.testing import CliRunner

from miburi.cli.gestures import gesture_app
from miburi.errors import InputError


def run(*arguments):
    return CliRunner().invoke(gesture_app, arguments)


@pytest.fixture
def file(tmp_path):
    source = resources.files("miburi.gestures") / "surprise.toml"
    path = tmp_path / "mine.toml"
    path.write_text(source.read_text())
    return path


def test_measures_answers_with_a_line_for_each_mood():
    lines = run("measures", "sadness", "--step", "0.5", "--json").stdout.splitlines()
    assert [json.loads(line)["mood"] for line in lines] == [0.0, 0.5, 1.0]
    assert "contact stops 0" in run("measures", "sadness", "--step", "1").stdout


def test_check_says_that_all_is_well(file):
    result = run("check", str(file), "--step", "0.5")
    assert result.exit_code == 0
    assert "all is well" in result.stdout


def test_check_says_what_is_wrong_and_fails(file):
    file.write_text(file.read_text().replace("space = 1.0", "space = 0.0"))
    result = run("check", str(file), "--step", "0.5")
    assert result.exit_code == 1
    assert f"{file}: from mood 0.0 to 0.5 it does not use more space." in result.stdout


def test_a_step_that_is_no_step_is_refused():
    assert isinstance(run("measures", "--step", "0").exception, InputError)


def test_the_schema_is_that_of_a_gesture_file():
    schema = json.loads(run("schema").stdout)
    assert {"name", "feeling", "duration", "effort", "pose"} == set(schema["required"])
