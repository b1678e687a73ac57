"""The page in a real browser with a reel unit in real mode; shared by all tests."""

import asyncio
import contextlib
import csv
import os
import shutil
import signal
import subprocess
import sys
import threading
import time

import matplotlib.pyplot as plt
import numpy as np
import pytest

from rtctl.config.errors import UserError
from rtctl.daemon.client import Client
from rtctl.daemon.server import default_endpoint
from rtctl.scope.feed import Feed
from rtctl.scope.guard import Guard
from rtctl.scope.server import Scope

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
pytestmark = [
    pytest.mark.realtime,
    pytest.mark.skipif(CHROMIUM is None, reason="no chromium here: apt-get install chromium"),
]
# Safety limits that do not trip on a busy machine.
PATIENT = ("loop.realtime=off", "safety.link_timeout=10", "safety.missed_ticks=0", "safety.following_error=0")
LONGEST = 60_000  # ms, for a busy machine


class Machine:
    """A daemon process that can be stopped and restarted."""

    def __init__(self, name, folder):
        self.name, self._folder, self._runs = name, folder, 0
        self._process = None

    def start(self):
        self._runs += 1
        changes = [word for change in (f"name={self.name}", *PATIENT) for word in ("--set", change)]
        words = ["run", "ivu", "--mode", "real", "--link", "shm", "--no-arm", "--no-plot", "--out"]
        command = [sys.executable, "-m", "rtctl.cli.main", *words, str(self._folder / f"b{self._runs}"), *changes]
        self._process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        deadline = time.monotonic() + 200
        while not self._ticks():
            assert self._process.poll() is None
            assert time.monotonic() < deadline

    def stop(self):
        if self._process is not None and self._process.poll() is None:
            self._process.send_signal(signal.SIGTERM)
            self._process.wait(60)

    def _ticks(self):
        with Client(default_endpoint(self.name, "command"), timeout=1.0) as client, contextlib.suppress(UserError):
            return client.call("status")["ticks"] > 0
        return False


class Server:
    """Server of the scope in a thread; can be stopped and restarted on the same port."""

    def __init__(self, name, folder):
        self._name, self._folder = name, folder
        self.port, self.url = 0, ""

    def start(self):
        ready = threading.Event()
        self._loop = asyncio.new_event_loop()

        async def serve():
            feed = Feed(self._name)
            self._task = asyncio.current_task()
            try:
                await Scope(feed, Guard(self._folder), control=True).serve(self.port, lambda scope: tell(scope))
            except asyncio.CancelledError:
                pass
            finally:
                feed.close()

        def tell(scope):
            self.port, self.url = scope.guard.port, scope.url
            ready.set()

        self._thread = threading.Thread(target=lambda: self._loop.run_until_complete(serve()))
        self._thread.start()
        assert ready.wait(60)

    def stop(self):
        self._loop.call_soon_threadsafe(self._task.cancel)
        self._thread.join()
        self._loop.close()


@pytest.fixture(scope="module")
def machine(runtime, tmp_path_factory):
    made = Machine(f"scope{os.getpid()}", tmp_path_factory.mktemp("scope"))
    try:
        made.start()
        yield made
    finally:
        made.stop()


@pytest.fixture(scope="module")
def server(machine, tmp_path_factory):
    made = Server(machine.name, tmp_path_factory.mktemp("token"))
    made.start()
    yield made
    made.stop()


@pytest.fixture(scope="module")
def browser():
    with playwright.sync_playwright() as started:
        made = started.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield made
        made.close()


@pytest.fixture
def open_page(browser, server):
    """`open_page()`: a page that shows traces. The consoles of all pages must stay empty."""
    said, contexts = [], []

    def make(**options):
        context = browser.new_context(viewport={"width": 900, "height": 500}, **options)
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(LONGEST)
        page.on("console", lambda message: said.append(message.text))
        page.on("pageerror", lambda error: said.append(str(error)))
        page.goto(server.url)
        until(page, "window.scope?.traces.x.length > 10")
        return page

    make.said = said
    yield make
    for context in contexts:
        context.close()
    assert not said


def until(page, expression):
    """Wait until a condition holds in the page. The wait of Playwright needs eval, which the page forbids."""
    deadline = time.monotonic() + LONGEST / 1000
    while not page.evaluate(f"() => Boolean({expression})"):
        assert time.monotonic() < deadline, f"{expression}; said: {page.inner_text('#said')}"
        page.wait_for_timeout(20)


def press(page, op):
    page.click(f"#switches button[data-op={op}]")
    until(page, f"document.getElementById('said').textContent.includes('{op.capitalize()}: from tick')")


def state(page, name):
    until(page, f"document.getElementById('lamp-state').textContent.includes('{name}')")


HIGHEST = "(name) => Math.max(...window.scope.traces.high[window.scope.traces.names.indexOf(name)])"


def test_commanded_step_is_shown_to_all_viewers(open_page):
    page, other = open_page(), open_page(color_scheme="dark")
    press(page, "arm")
    state(page, "running")
    before = page.evaluate(HIGHEST, "capstan")
    page.fill("#setpoint-step", "0.5")
    page.click("#setpoint-up")
    for viewer in (page, other):
        until(viewer, f"({HIGHEST})('ref') > {before} + 0.45")
        until(viewer, f"({HIGHEST})('capstan') > {before} + 0.3")
    assert other.evaluate("document.documentElement.dataset.theme") == "dark"
    canvas = page.locator("#plots canvas").first
    assert canvas.bounding_box()["width"] > 300
    press(page, "disarm")
    state(other, "idle")


def test_keyboard_controls_hold_zoom_and_cursors(open_page):
    page = open_page()
    page.keyboard.press(" ")
    until(page, "window.scope.traces.about.held")
    page.keyboard.press("a")
    page.keyboard.press("b")
    page.keyboard.press("Shift+ArrowRight")
    assert "capstan [" in page.inner_text("#readout")
    bucket = page.evaluate("window.scope.traces.bucket")
    for _ in range(6):
        page.keyboard.press("+")
    until(page, "window.scope.traces.range[1] - window.scope.traces.range[0] < 0.1")
    assert page.evaluate("window.scope.traces.bucket") == 1 < bucket
    page.keyboard.press("Escape")
    page.keyboard.press(" ")
    until(page, "window.scope.traces.rolling")
    for key, kind in (("2", "xy"), ("3", "spectrum"), ("1", "time")):
        page.keyboard.press(key)
        until(page, f"window.scope.traces.kind === '{kind}'")


def test_single_trigger_shows_one_sweep_with_its_pretrigger(open_page):
    page = open_page()
    press(page, "arm")
    state(page, "running")
    level = page.evaluate(HIGHEST, "ref") + 0.1
    page.select_option("#trigger-signal", "ref")
    page.fill("#trigger-level", str(level))
    page.press("#trigger-level", "Enter")
    page.select_option("#window", "0.5")
    page.select_option("#trigger-mode", "single")
    page.click("#setpoint-up")
    until(page, "document.getElementById('trigger-state').textContent.startsWith('one sweep')")
    # a fifth of its columns lies before the crossing. Not in seconds: where ticks were missed, as many rows take longer
    before, all_ = page.evaluate(
        "(() => { const x = window.scope.traces.x; return [x.filter(t => t < 0).length, x.length]; })()"
    )
    assert before / all_ == pytest.approx(0.2, abs=2 / all_)
    assert page.evaluate("window.scope.traces.range[1]") > 0.35  # s of the window's 0.5
    press(page, "disarm")


def test_refusal_message_of_the_daemon_and_a_trip_are_shown(open_page):
    page = open_page()
    page.click("#settings summary")
    limit = page.locator("input[data-path='safety.following_error']")
    limit.fill("-1")
    limit.press("Enter")
    until(page, "document.getElementById('said').textContent.includes('it must be at least 0')")
    assert limit.get_attribute("aria-invalid") == "true"
    press(page, "arm")
    state(page, "running")
    limit.fill("0.001")
    limit.press("Enter")
    until(page, "document.getElementById('said').textContent.includes('following_error 0.001: from tick')")
    page.click("#setpoint-up")
    page.wait_for_selector("#banner:has-text('following_error: the machine is too far from its reference')")
    state(page, "tripped")
    limit.fill("0")
    limit.press("Enter")
    press(page, "reset")
    state(page, "idle")
    page.wait_for_selector("#banner", state="hidden")


def test_page_reconnects_after_a_restart_of_daemon_and_server(open_page, machine, server):
    page = open_page()
    server.stop()
    page.wait_for_selector("#banner:has-text('server does not answer')")
    machine.stop()
    server.start()
    page.wait_for_selector("#banner:has-text('daemon does not answer')")
    machine.start()
    page.wait_for_selector("#banner", state="hidden")
    until(page, "window.scope.traces.rolling && window.scope.traces.x.length > 10")
    open_page.said[:] = [text for text in open_page.said if "ERR_CONNECTION_REFUSED" not in text]


def test_shown_traces_are_saved_as_numbers_and_as_a_picture(open_page, tmp_path):
    page = open_page()
    page.keyboard.press(" ")
    until(page, "window.scope.traces.about.held")
    with page.expect_download() as numbers:
        page.click("#csv")
    with page.expect_download() as picture:
        page.click("#png")
    numbers.value.save_as(tmp_path / "shown.csv")
    picture.value.save_as(tmp_path / "shown.png")
    assert numbers.value.suggested_filename.endswith(".csv")
    with (tmp_path / "shown.csv").open(newline="") as file:
        head, *rows = csv.reader(file)
    x, high = page.evaluate("[window.scope.traces.x, window.scope.traces.high]")
    names = page.evaluate("window.scope.traces.names")
    assert head[0] == "t [s]"
    assert [float(row[0]) for row in rows] == pytest.approx(list(x), rel=1e-11)
    column = next(i for i, text in enumerate(head) if text in ("capstan [rad]", "capstan highest [rad]"))
    assert [float(row[column]) for row in rows] == pytest.approx(list(high[names.index("capstan")]), rel=1e-11)
    image = plt.imread(tmp_path / "shown.png")
    assert image.shape[1] > page.locator("#plots canvas").first.bounding_box()["width"]
    assert len(np.unique(image.reshape(-1, image.shape[2]), axis=0)) > 5


def test_scale_of_a_lane_is_held_and_set(open_page):
    page = open_page()
    lane = page.locator(".lane").first
    lane.locator(".scale button").click()
    held = page.evaluate("window.scope.plots.lanes[0].yRange")
    assert page.evaluate("window.scope.plots.scales.fixed.get(window.scope.plots.lanes[0].key)") == held
    upper = lane.locator(".scale input").nth(1)
    upper.fill("-1e9")
    upper.press("Enter")
    assert upper.get_attribute("aria-invalid") == "true"
    upper.fill("2000")
    upper.press("Enter")
    factor = page.evaluate("window.scope.plots.lanes[0].scale.factor")
    until(page, "window.scope.plots.lanes[0].plot.scales.y.max > 1")
    assert page.evaluate("window.scope.plots.lanes[0].yRange")[0] == pytest.approx(held[0])
    page.reload()
    until(page, "window.scope?.traces.x.length > 10")
    assert page.evaluate("window.scope.plots.lanes[0].yRange[1]") >= 2000 * min(factor, 1e-6)
    assert lane.locator(".scale button").inner_text() == "scale fixed"
    lane.locator(".scale button").click()
    until(page, "window.scope.plots.scales.fixed.size === 0")


LABELS = """async ([ticks, factor]) => {
    const { Labels } = await import('./static/labels.js');
    const made = new Labels();
    return [made.of(ticks, factor), made.offset];
}"""


@pytest.mark.parametrize(
    ("ticks", "factor"),
    [
        ([0.1, 0.2, 0.30000000000000004], 1.0),
        ([12345.678901, 12345.678902, 12345.678903], 1.0),
        ([-3.1415926501, -3.1415926500, -3.1415926499], 1e-3),
        ([1e9, 2e9, 3e9], 1.0),
        ([None, 1e-9, 2e-9], 1.0),
    ],
)
def test_tick_labels_are_distinct_and_do_not_overlap(open_page, ticks, factor):
    words, offset = open_page().evaluate(LABELS, [ticks, factor])
    known = [word for word, tick in zip(words, ticks, strict=True) if tick is not None]
    assert len(set(known)) == len(known)
    assert max(map(len, known)) <= 9
    for word, tick in zip(words, ticks, strict=True):
        if tick is not None:
            assert float(word) + offset == pytest.approx(tick / factor, rel=1e-12)


@pytest.mark.parametrize("size", [(1100, 760), (800, 600), (390, 844)])
def test_trace_names_are_next_to_their_traces(open_page, size):
    page = open_page()
    page.set_viewport_size({"width": size[0], "height": size[1]})
    until(page, "window.scope.plots.lanes.every(l => Math.abs(l.plot.width - l.graph.clientWidth) < 2)")
    for lane in page.locator(".lane").all():
        graph, legend = (lane.locator(part).bounding_box() for part in ("canvas", ".legend"))
        beside = graph["x"] + graph["width"] <= legend["x"] + 1
        above = legend["y"] + legend["height"] <= graph["y"] + 1
        assert beside or above
        assert graph["height"] > 60
    assert page.evaluate("document.documentElement.scrollWidth") <= size[0]


def test_narrow_screen_needs_no_horizontal_scrolling(open_page):
    page = open_page()
    page.set_viewport_size({"width": 360, "height": 740})
    assert page.evaluate("document.documentElement.scrollWidth") <= 360


def test_page_opened_before_the_machine_runs(browser, runtime, tmp_path):
    machine, server = Machine(f"late{os.getpid()}", tmp_path), Server(f"late{os.getpid()}", tmp_path)
    server.start()
    page, said = browser.new_page(), []
    page.set_default_timeout(LONGEST)
    page.on("console", lambda message: said.append(message.text))
    page.on("pageerror", lambda error: said.append(str(error)))
    try:
        page.goto(server.url)
        page.wait_for_selector("#banner:has-text('it does not run')")
        machine.start()
        until(page, "window.scope?.traces.x.length > 10")
        page.wait_for_selector("#banner", state="hidden")
    finally:
        page.close()
        server.stop()
        machine.stop()
    assert not said
