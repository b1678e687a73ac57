import pytest

from rtctl.config.schema import settings_table
from rtctl.machines import CONFIGS
from rtctl.manual.config_pages import config_pages, parts
from rtctl.plants.physics import TERMS

PAGES = config_pages()


@pytest.mark.parametrize("kind", CONFIGS)
def test_every_key_is_described(kind):
    assert [row.path for row in settings_table(CONFIGS[kind]) if not row.help] == []


@pytest.mark.parametrize("kind", CONFIGS)
def test_every_key_is_on_a_page(kind):
    there = {path: part for part in parts(CONFIGS[kind]) for path in part.paths}
    text = PAGES["config.md"] + PAGES[f"config_{kind}.md"] + PAGES["config_physics.md"]
    for row in settings_table(CONFIGS[kind]):
        if row.type != "keys" and not row.path.startswith("plant.physics[]["):
            section, _, key = row.path.rpartition(".")
            assert key in [r.path.rpartition(".")[2] for r in there[section].rows]
            assert not section or f"`{section}`" in text
            assert f"| `{key}` |" in text


def test_row_of_a_setting_has_type_unit_default_and_help():
    line = next(line for line in PAGES["config_ivu.md"].splitlines() if line.startswith("| `tau_d` |"))
    row = next(row for row in settings_table(CONFIGS["ivu"]) if row.path == "law.position.tau_d")
    cells = [part.strip() for part in line.strip("|").split("|")]
    assert cells == ["`tau_d`", "number", "s", f"`{row.default}`", row.bounds, row.help]


def test_every_term_is_on_its_page():
    text = PAGES["config_physics.md"]
    for name, term in TERMS.items():
        section = text[text.index(f"## {name} ") :].split("\n## ")[0]
        assert term.equation in section
        for key, field in term.settings.model_fields.items():
            if key not in ("term", "node"):
                assert f"| `{key}` |" in section and field.description


def test_equal_parts_share_a_section():
    paths = [part.paths for part in parts(CONFIGS["ivu"])]
    assert ("sensors.reel1", "sensors.reel2") in paths
