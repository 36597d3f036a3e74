# SPDX-License-Identifier: BSD-3-Clause
"""The interactive page: its cells in this process, and the page in a browser."""

import importlib.util
import os
import shutil
import socket
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import filippov as fp

pytest.importorskip("marimo", reason="the page is a marimo app")
image = pytest.importorskip("matplotlib.image", reason="the page draws with matplotlib")

PAGE = Path(__file__).parents[2] / "examples" / "explore.py"
SOON = 60.0  # seconds; an idle machine takes five until the page is there, half a one for a move
BROWSER, DRIVER = shutil.which("chromium"), shutil.which("chromedriver")


@pytest.fixture(scope="module")
def page():
    spec = importlib.util.spec_from_file_location("explore", PAGE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def cells(page):
    _, names = page.app.run()
    return names


def shown(page, A, omega, V=1.0, start=(0.0, 0.0)):
    """Everything that the page says and draws."""
    block = fp.models.oscillator.with_params(A=A, omega=omega, V=V)
    orbit, run = page.settle(block, list(start))
    graph, basins = page.transition_map(block, 1), page.label_cells(block, 21)
    figures = page.draw_orbit(run), page.draw_map_and_basins(graph, basins, run, list(start))
    for figure in figures:
        figure.canvas.draw()
    said = page.say_orbit(orbit), page.say_map(graph), page.say_basins(basins, list(start))
    return said, figures


def test_the_cells_run_as_they_stand(cells):
    # figures 4.15 and 4.16: two orbits of the forcing's period attract, a saddle is between them
    assert cells["orbit"].word == "0-0+"
    assert cells["orbit"].period == pytest.approx(2 * np.pi / 1.067, rel=1e-12)
    assert [a.period for a in cells["basins"].attractors] == [1, 1]
    assert len(cells["basins"].saddles) == 1
    # an orbit of two sticks is two fixed points of the second iterate, its multiplier their slope
    slopes = [p.slope for p in cells["graph"].fixed_points()]
    multiplier = cells["orbit"].multipliers[0].real
    assert sum(abs(slope - multiplier) < 1e-6 for slope in slopes) == 2


@pytest.mark.slow
def test_every_place_has_its_words_and_pictures(page, cells):
    for A, omega, _ in cells["place"].options.values():
        said, _ = shown(page, A, omega)
        for what, words in zip(("Orbit", "Map", "Basins"), said, strict=True):
            assert words.startswith(f"**{what}**")


def test_sticking_is_drawn_apart_from_slipping(page):
    _, (figure, _) = shown(page, 3.6, 1.067)
    for ax in figure.axes:
        lines = {line.get_label(): line for line in ax.lines}
        stick, slip = lines["sliding (stick)"], lines["slip"]
        v = stick.get_ydata()
        assert (v[np.isfinite(v)] == 1).all()
        assert np.nanmin(slip.get_ydata()) < 0
        assert stick.get_linewidth() > slip.get_linewidth()


@pytest.mark.parametrize(
    ("A", "omega", "V", "says"),
    [
        (0.49, 3.464, 2.0, "**No orbit** from this start: no periodic orbit within"),
        (1.64, 0.326, 3.0, "**No map**: The map is defined nowhere that a slide ends."),
        (5.0, 1.6, 1.0, "fixed points of iterate 1: none. Gaps: no slide ends within"),
        (0.49, 3.464, 2.0, "(2) no cycle up to 64"),
    ],
)
def test_what_there_is_not_is_said(page, A, omega, V, says):
    said, _ = shown(page, A, omega, V)
    assert says in " ".join(said)


@pytest.fixture
def address(tmp_path):
    """Serve the page to this machine."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    serve = [sys.executable, "-m", "marimo", "run", str(PAGE), "--headless", "--show-tracebacks"]
    serve += ["--host", "127.0.0.1", "--port", str(port)]
    log = tmp_path / "server.txt"
    with log.open("w") as output, subprocess.Popen(serve, stdout=output, stderr=output) as server:
        try:
            yield f"http://127.0.0.1:{port}"
        finally:
            server.terminate()
            try:
                server.wait(timeout=10)
            except subprocess.TimeoutExpired:
                server.kill()
    assert "Traceback" not in log.read_text(), log.read_text()


@pytest.fixture
def browser():
    webdriver = pytest.importorskip("selenium.webdriver", reason="selenium drives the browser")
    if BROWSER is None or DRIVER is None:
        pytest.skip("needs the programs chromium and chromedriver")
    try:
        socket.getaddrinfo("localhost", None)
    except OSError:
        pytest.skip("needs a machine that knows the name localhost")
    options = webdriver.ChromeOptions()
    options.binary_location = BROWSER
    for argument in (
        "--headless=new",
        "--window-size=1440,1050",
        "--disable-background-networking",
        "--disable-dev-shm-usage",  # which containers have little of
    ):
        options.add_argument(argument)
    if hasattr(os, "getuid") and os.getuid() == 0:  # refused otherwise
        options.add_argument("--no-sandbox")
    driver = webdriver.Chrome(options, webdriver.ChromeService(DRIVER))
    try:
        driver.set_page_load_timeout(SOON)
        driver.set_script_timeout(SOON)
        yield driver
    finally:
        driver.quit()


def pictures(browser):
    """Sources of the pictures that are drawn, from the top."""
    return browser.execute_script("""
        return [...document.querySelectorAll("marimo-mime-renderer")]
            .map((each) => each.shadowRoot?.querySelector("img"))
            .filter((drawn) => drawn?.complete && drawn.naturalWidth > 500)
            .map((drawn) => drawn.src);
    """)


def knob(browser, label):
    """Find the handle of a slider; a copy of each is kept hidden for narrow windows."""
    for slider in browser.find_elements("css selector", "marimo-slider"):
        handle = slider.shadow_root.find_element("css selector", "[role=slider]")
        if label in slider.get_attribute("data-label") and handle.is_displayed():
            return handle
    raise AssertionError(f"no slider {label}")


@pytest.mark.slow
def test_the_page_follows_its_sliders_in_a_browser(browser, address, tmp_path):
    from selenium.webdriver import ActionChains, Keys
    from selenium.webdriver.support.ui import WebDriverWait

    def until(true, what):
        wait = WebDriverWait(browser, SOON, poll_frequency=0.05)
        wait.until(lambda _: true(), f"waited for {what}")

    def answers():
        with socket.socket() as probe:
            return probe.connect_ex(("127.0.0.1", int(address.rpartition(":")[2]))) == 0

    def says(words):
        """Wait until this is on the page, nothing there is old, and both pictures are new."""
        until(lambda: words in browser.find_element("tag name", "body").text, words)
        until(lambda: not browser.find_elements("css selector", ".marimo-output-stale"), "rest")
        until(lambda: len(set(pictures(browser)) - seen) == 2, "two new pictures")
        seen.update(pictures(browser))

    seen = set()
    until(answers, "the server")
    browser.get(address)
    says(f"Orbit 0-0+, stable: period {2 * np.pi / 1.067:.6g} s")
    knob(browser, "omega").send_keys(3 * Keys.ARROW_RIGHT)
    says(f"period {2 * np.pi / 1.070:.6g} s")
    browser.save_screenshot(tmp_path / "explore.png")
    handle = knob(browser, "(A")
    ActionChains(browser).drag_and_drop_by_offset(handle, -handle.rect["x"], 0).perform()
    says("No orbit from this start")  # unforced, it sticks and slips in its own time

    assert not browser.find_elements("css selector", ".has-error")
    assert not [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"]
    colours = image.imread(tmp_path / "explore.png").reshape(-1, 4)
    assert len(np.unique(colours, axis=0)) > 100
