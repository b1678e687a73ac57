# %% [markdown]
# # From a recording to a named effect
#
# This page is `docs/notebook.py`, executed: open that file in VS Code or Spyder, or make a notebook of it with
# `jupytext --to notebook`. It needs `pip install 'rtctl[notebook]'`, and nothing of the command line.
#
# ## A recording
#
# The bench here is emulated, so that the page runs anywhere. It has something that its owner does not know of: at a
# command of zero its drive gives 0.8 V. The recording says nothing of that.

# %%
import rtctl

there_and_back = [
    {"at": "0.5 s", "to": "50 mm", "ramp": "50 mm/s"},
    {"at": "2 s", "to": "-50 mm", "ramp": "80 mm/s"},
    {"at": "4.5 s", "to": 0, "ramp": "50 mm/s"},
]
bench = rtctl.load_config(
    "axis",
    {
        "loop.mode": "fused",
        "record.truth": False,
        "reference.steps": there_and_back,
        "reference.repeat": "6 s",
        "plant.physics": [{"term": "drive.offset", "node": "drive", "offset": "0.8 V"}],
    },
)
bundle = rtctl.record(bench, 12.0, "bench")
bundle

# %% [markdown]
# A recording of your own comes in by `rtctl.import_recording("log.csv", "bench", machine="machine.yaml",
# columns={"u": "volts"}, units={"x": "mm"})`, from csv, mat, parquet, mcap, mf4, tdms, hdf5 and more; see
# [recordings](traces.md). `rtctl.load_bundle("bench")` opens one that is there.
#
# ## Looking at it

# %%
bundle["x"].max(), bundle.units["x"]

# %%
bundle.plot("ref", "x", "position_error", "u")

# %%
bundle.to_pandas()[["ref", "x", "u"]].describe().round(4)

# %% [markdown]
# ## What its owner believes
#
# The model in the recording's `case.json`, run freely beside the recording:

# %%
believed = rtctl.simulate("case", bundle)
believed

# %% [markdown]
# ## What is missing
#
# `diagnose` shows a bar while it works. What it can name is the library of `rtctl.physics()`.

# %%
found = rtctl.diagnose(bundle)
found

# %%
found.to_pandas()

# %% [markdown]
# `found.report()` shows the whole report in a cell, with its figures; `found.report("report.html")` writes it as well.

# %%
found.report("report.html")

# %% [markdown]
# ## With the effect in the model
#
# `save` writes what `rtctl diagnose` writes: the verdict, the report, and the model with what was found. The model runs
# and simulates as any config does.

# %%
found.save("diagnosis")
rtctl.simulate("diagnosis/model.yaml", bundle)

# %%
rtctl.physics("drive.offset").check

# %% [markdown]
# ## For another program

# %%
rtctl.export(bundle, "mcap", "bench.mcap")[1:4]
