"""Page from a script with cells; docs/notebook.md is up to date with docs/notebook.py."""

from pathlib import Path

from rtctl.manual.notebook import cells, page

DOCS = Path(__file__).parents[2] / "docs"
SCRIPT = """# %% [markdown]
# # A title
#
# Words.

# %%
x = 2
print("said")
x + 1

# %%
from matplotlib.figure import Figure

figure = Figure()
figure.subplots().plot([1, 2])
figure

# %%
open("left.txt", "w").close()
"""


def test_cells_become_text_code_and_output(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    script, out, pictures = tmp_path / "made.py", tmp_path / "made.md", tmp_path / "images"
    script.write_text(SCRIPT)
    pictures.mkdir()
    text = page(script, out, pictures)
    assert text.startswith("# A title\n\nWords.\n\n```python\nx = 2")
    assert "```text\nsaid\n```\n\n```text\n3\n```" in text
    assert "![made 1](images/made_1.png)" in text and (pictures / "made_1.png").stat().st_size > 1000
    assert not (tmp_path / "left.txt").exists()  # the script runs in a temporary folder


def test_notebook_page_agrees_with_its_script():
    """After a failure run `python -m rtctl.manual.notebook docs/notebook.py docs/notebook.md` (one minute)."""
    text = (DOCS / "notebook.md").read_text("utf-8")
    for cell in cells((DOCS / "notebook.py").read_text("utf-8")):
        assert (cell.text if cell.words else f"```python\n{cell.text}\n```") in text


def test_notebook_page_leads_from_a_recording_to_a_named_effect_and_its_size():
    text = (DOCS / "notebook.md").read_text("utf-8")
    hidden = '"term": "drive.offset", "node": "drive", "offset": "0.8 V"'
    assert hidden in text and "<Diagnosis: named, drive.offset at drive" in text
    low, high = map(float, text.split("drive.offset  drive")[1].split()[3:5])
    assert low < 0.8 + 5e-3 and high > 0.8 - 5e-3
