# %% [markdown]
# # From a recording to a named effect
#
# This page is the output of `docs/notebook.py`. Open the file in VS Code or Spyder, or make a notebook of it with
# `jupytext --to notebook`. It needs `pip install 'rtctl[notebook]'`, and no command line.
#
# ## A recording
#
# The bench is emulated, so the page runs anywhere. Its drive has an offset that the nominal model lacks: at a command
# of zero it gives 0.8 V. The recording does not mention the offset.

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
# Your own recording is imported with `rtctl.import_recording("log.csv", "bench", machine="machine.yaml",
# columns={"u": "volts"}, units={"x": "mm"})`, from csv, mat, parquet, mcap, mf4, tdms, hdf5 and more; see
# [recordings](traces.md). `rtctl.load_bundle("bench")` opens an existing bundle.
#
# ## Looking at it

# %%
bundle["x"].max(), bundle.units["x"]

# %%
bundle.plot("ref", "x", "position_error", "u")

# %%
bundle.to_pandas()[["ref", "x", "u"]].describe().round(4)

# %% [markdown]
# ## The nominal model
#
# The free run of the nominal model in `case.json`, compared with the recording:

# %%
believed = rtctl.simulate("case", bundle)
believed

# %% [markdown]
# ## What is missing
#
# `diagnose` shows its progress. `rtctl.physics()` lists the effects that it can name.

# %%
found = rtctl.diagnose(bundle)
found

# %%
found.to_pandas()

# %% [markdown]
# `found.report()` shows the whole report with its figures in a cell. `found.report("report.html")` also writes it to a
# file.

# %%
found.report("report.html")

# %% [markdown]
# ## With the effect in the model
#
# `save` writes the files of `rtctl diagnose`: the verdict, the report, and the model with the effect. The model is a
# config that can run and be simulated.

# %%
found.save("diagnosis")
rtctl.simulate("diagnosis/model.yaml", bundle)

# %%
rtctl.physics("drive.offset").check

# %% [markdown]
# ## For another program

# %%
rtctl.export(bundle, "mcap", "bench.mcap")[1:4]
