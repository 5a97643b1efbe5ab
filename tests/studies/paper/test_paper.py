"""The paper, claim by claim: the page is whole, its table and its rule are right."""

import re
from pathlib import Path

import numpy as np
import pytest

from miburi.robot import Robot, forward, load_robot
from miburi.studies.paper.claim import ClaimVerdict
from miburi.studies.paper.claims import CLAIMS
from miburi.studies.paper.denavit import TABLES, frames
from miburi.studies.paper.page import write_paper
from miburi.studies.paper.rule import is_stopped, pass_map
from miburi.studies.paper.runs import Runs


def test_the_denavit_hartenberg_table_is_the_model(tall_file: Path) -> None:
    body = load_robot(tall_file)
    for pose in np.random.default_rng(0).uniform(body.lower, body.upper, (20, 8)):
        ends = [frames(body, extremity, pose)[-1][:3, 3] for extremity in TABLES]
        np.testing.assert_allclose(np.concatenate(ends), forward(body, pose), atol=1e-15)


@pytest.mark.parametrize(
    ("ramp", "lag", "stopped"),
    [
        (np.inf, 0.00627, False),
        (np.inf, 0.00629, True),
        (1000.0, 0.0057, False),  # v / 2a = 0.5 ms
        (1000.0, 0.0059, True),
        (40.0, 0.0, True),  # 12.5 ms
    ],
)
def test_the_printed_rule_passes_up_to_6_28_ms(ramp: float, lag: float, stopped: bool) -> None:
    """The move ends just after a window does, so that braking is not judged."""
    speed = 1.0
    distance = speed * 0.5 - (0 if np.isinf(ramp) else speed**2 / ramp)
    assert is_stopped(distance, speed, ramp, lag) == stopped


def test_no_move_passes_with_a_long_lag_and_all_do_with_none() -> None:
    moves = [(0.5, 1.0), (1.2, 3.0), (0.3, 0.7)]
    share = pass_map(moves, np.array([0.0, 0.02]), np.array([40.0, 1e9]))
    np.testing.assert_array_equal(share, [[0, 0], [1, 0]])


@pytest.fixture(scope="module")
def page(robot: Robot, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("paper")
    return write_paper(robot, folder, targets=5, seeds=1, trials=25)


@pytest.mark.proof("test_the_page_in_the_documents_has_the_numbers_of_today")
def test_every_claim_has_a_verdict_and_a_number(page: Path) -> None:
    rows = [line.split("|")[1:-1] for line in page.read_text(encoding="utf-8").splitlines()
            if re.match(r"\| \d", line)]  # fmt: skip
    assert {row[0].strip()[0] for row in rows} == {"2", "3", "4", "5", "6"}
    assert [row[5].strip(" `") for row in rows if "`" in row[5]] == list(CLAIMS)
    for _, sentence, verdict, number, _, _ in rows:
        assert sentence.strip()
        assert verdict.strip(" *") in list(ClaimVerdict)
        assert "nan" not in number
        if verdict.strip(" *") != ClaimVerdict.UNKNOWN:
            assert re.search(r"\d", number), sentence
    verdicts = {row[5].strip(" `"): row[2].strip(" *") for row in rows if "`" in row[5]}
    assert {name for name, verdict in verdicts.items() if verdict == "differs"} == {
        "period-and-limit", "upper-arms", "equations", "one-solution", "levenberg-marquardt",
        "promise",
    }  # fmt: skip
    pictures = re.findall(r"\]\((images/[a-z-]+\.png)\)", page.read_text(encoding="utf-8"))
    assert len(pictures) == 8
    for picture in pictures:
        assert (page.parent / picture).read_bytes().startswith(b"\x89PNG")


@pytest.fixture(scope="module")
def runs(robot: Robot) -> Runs:
    return Runs(robot)


@pytest.mark.parametrize(
    "name",
    [
        "always-active", "on-the-card", "one-motor-stops-all", "period-and-limit",
        "period-and-card", "upper-arms", "table-1", "equations", "eight-solutions",
        "one-solution", "emotion-before-mood", "repetition", "strongest-emotion",
        "mood-changes-no-gesture",
    ],
)  # fmt: skip
def test_the_page_in_the_documents_has_the_numbers_of_today(runs: Runs, name: str) -> None:
    """Of the claims that are quickly carried out; `make docs-check` looks at all."""
    claim = CLAIMS[name](runs)
    if claim.verdict is ClaimVerdict.UNKNOWN:
        pytest.skip("needs the emulated card: make firmware")
    page = (Path(__file__).parents[3] / "docs" / "paper.md").read_text(encoding="utf-8")
    [row] = [line for line in page.splitlines() if line.endswith(f"| `{name}` |")]
    assert f"| **{claim.verdict}** | {claim.number} |" in row
