"""docs/campaigns.md agrees with the code."""

import re
from pathlib import Path

import pytest

from rtctl.campaign.conditions import COUNTS, STATISTICS
from rtctl.campaign.metrics import METRICS
from rtctl.campaign.plan import load_plan
from rtctl.campaign.settings import AxisSettings, CampaignSettings
from rtctl.cli.common import load_config

DOC = Path(__file__).parents[2] / "docs" / "campaigns.md"


@pytest.fixture(scope="module")
def text() -> str:
    return DOC.read_text(encoding="utf-8")


def test_documented_file_is_a_campaign(text: str, tmp_path: Path) -> None:
    block = re.search(r"```yaml\n(.*?)```", text, re.S)
    assert block is not None
    path = tmp_path / "gains.yaml"
    path.write_text(block[1])
    made = load_plan(str(path), load_config)
    assert made.runs == 30 and made.config(29).law.position.gain == 40
    assert set(re.findall(r"^(\w+):", block[1], re.M)) == set(CampaignSettings.model_fields)


def test_every_metric_statistic_and_kind_of_axis_is_documented(text: str) -> None:
    words = set(re.findall(r"[\w.]+", text))
    assert {*METRICS, *STATISTICS, *COUNTS, *AxisSettings.model_fields} <= words
