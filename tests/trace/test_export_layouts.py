"""PlotJuggler layouts in docs: every curve exists in an exported file."""

import csv
import json
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pyarrow as pa
import pytest

from rtctl import machines
from rtctl.trace.bundle import save_case, write_parquet
from rtctl.trace.export import export

LAYOUTS = Path(__file__).parents[2] / "docs" / "plotjuggler"


@pytest.fixture(scope="module", params=["ivu", "ldu"])
def recording(request, tmp_path_factory):
    """(kind, bundle) with every column of the machine."""
    folder = tmp_path_factory.mktemp(request.param)
    columns = machines.MODULES[request.param].COLUMNS
    fields = [pa.field(c.name, pa.float64(), metadata={"unit": c.unit, "help": c.help}) for c in columns]
    batch = pa.record_batch([np.arange(3.0)] * len(fields), schema=pa.schema(fields))
    write_parquet(folder, [batch], batch.schema)
    save_case(folder, {"format": 1, "plant": request.param, "sample_rate": 1.0})
    return request.param, folder


def layout(name):
    return ElementTree.parse(LAYOUTS / f"{name}.xml").getroot()


def curves(root):
    return [curve.get("name") for curve in root.iter("curve")]


def test_csv_layout_names_exported_columns(recording):
    kind, folder = recording
    with export(folder, "csv").path.open(newline="") as file:
        header = next(csv.reader(file))
    root = layout(f"{kind}_csv")
    assert set(curves(root)) <= set(header)
    assert root.find("Plugins/plugin/parameters").get("time_axis") == header[0]  # 3.x
    assert root.find("Plugins/plugin/default").get("time_axis") == header[0]  # before


def test_mcap_layout_names_exported_topics(recording):
    decoder = pytest.importorskip("mcap_protobuf.decoder")
    from mcap.reader import make_reader

    kind, folder = recording
    with export(folder, "mcap").path.open("rb") as file:
        opened = make_reader(file, decoder_factories=[decoder.DecoderFactory()])
        _, channel, _, row = next(iter(opened.iter_decoded_messages()))
    assert set(curves(layout(kind))) <= {f"{channel.topic}/{field.name}" for field in row.DESCRIPTOR.fields}


def test_mcap_json_layout_names_exported_topics(recording):
    reader = pytest.importorskip("mcap.reader")
    kind, folder = recording
    with export(folder, "mcap-json").path.open("rb") as file:
        _, channel, message = next(iter(reader.make_reader(file).iter_messages()))
    assert set(curves(layout(kind))) <= {f"{channel.topic}/{name}" for name in json.loads(message.data)}


# What PlotJuggler 3.17 reads of a layout: mainwindow.cpp, tabbedplotwidget.cpp, plot_docker.cpp, plotwidget.cpp and
# dataload_csv.cpp. Element -> attributes.
READ = {
    "root": set(),
    "tabbed_widget": {"name", "parent"},
    "Tab": {"tab_name", "containers"},
    "Container": set(),
    "DockSplitter": {"orientation", "count", "sizes"},
    "DockArea": {"name"},
    "plot": {"style", "mode", "line_width", "flip_x", "flip_y"},
    "range": {"left", "right", "top", "bottom"},
    "limitY": {"min", "max"},
    "curve": {"name", "color"},
    "currentTabIndex": {"index"},
    "use_relative_time_offset": {"enabled"},
    "Plugins": set(),
    "plugin": {"ID"},
    "parameters": {"time_axis", "delimiter", "skip_rows", "date_format"},
    "default": {"time_axis", "delimiter"},
    "previouslyLoaded_Datafiles": set(),
    "customMathEquations": set(),
    "snippets": set(),
}
VALUES = {
    ("tabbed_widget", "parent"): {"main_window"},
    ("DockSplitter", "orientation"): {"-", "|"},
    ("plot", "style"): {"Lines", "Dots", "LinesAndDots", "Sticks", "Steps", "StepsInv"},
    ("plot", "mode"): {"TimeSeries", "XYPlot"},
    ("plot", "line_width"): {"1.0", "1.5", "2.0", "3.0"},
    ("plugin", "ID"): {"DataLoad CSV", "DataLoad MCAP"},
}


@pytest.mark.parametrize("name", ["ivu", "ivu_csv", "ldu", "ldu_csv"])
def test_plotjuggler_knows_every_element_and_value(name):
    for element in layout(name).iter():
        if not isinstance(element.tag, str):  # a comment
            continue
        assert set(element.attrib) <= READ[element.tag], element.tag
        for key, value in element.attrib.items():
            assert value in VALUES.get((element.tag, key), {value}), (element.tag, key, value)


@pytest.mark.parametrize("name", ["ivu", "ivu_csv", "ldu", "ldu_csv"])
def test_layouts_have_the_documented_panes(name):
    root = layout(name)
    titles = [area.get("name") for area in root.iter("DockArea")]
    assert {"Position and reference", "Error", "Outputs", "Speed", "State and trip", "Period and lateness"} <= set(
        titles
    )
    assert ("Tension" in titles) == name.startswith("ivu")
    for splitter in root.iter("DockSplitter"):
        areas = splitter.findall("DockArea")
        shares = [float(share) for share in splitter.get("sizes").split(";")]
        assert len(areas) == len(shares) == int(splitter.get("count")) and sum(shares) == pytest.approx(1, abs=1e-4)
        assert all(len(area.findall("plot/curve")) > 0 for area in areas)
    assert len(curves(root)) == len(set(curves(root)))
