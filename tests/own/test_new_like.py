"""New configs and machines as copies of shipped ones."""

import pytest
from typer.testing import CliRunner

from rtctl.api import load_config
from rtctl.cli.main import app
from rtctl.config.errors import UserError
from rtctl.own.new_like import examples, write_like


@pytest.mark.parametrize("like", examples("config"))
def test_copy_of_each_shipped_config_is_valid_and_has_the_new_name(like, tmp_path):
    path = write_like("config", "bench.yaml", like, tmp_path)
    config = load_config(path)
    assert config.name == "bench" and config.machine == load_config(like).machine


def test_new_config_is_written_and_never_overwrites(tmp_path):
    words = ["new", "config", "bench", "--into", str(tmp_path)]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0 and "rtctl check" in done.output
    assert "law:" in (tmp_path / "bench.yaml").read_text()
    with pytest.raises(UserError, match="nothing is overwritten"):
        write_like("config", "bench", "ldu", tmp_path)


def test_machine_name_is_refused_as_a_config_with_a_hint(tmp_path):
    with pytest.raises(UserError, match="rtctl new machine starts from it"):
        write_like("config", "bench", "belt", tmp_path)
    with pytest.raises(UserError, match="did you mean 'ivu'"):
        write_like("config", "bench", "ivi", tmp_path)
