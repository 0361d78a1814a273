# SPDX-License-Identifier: GPL-3.0-or-later
"""The web page: after a drag in a headless browser, its pixels equal those of the library."""

from __future__ import annotations

import base64
import html
import json
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.render.relight.dial import bulbs_on_polygon, dial_weights
from spectral_core.render.relight.mix import LiveMix, relight
from spectral_core.render.relight.page import write_page
from spectral_core.render.relight.storage import MixtureStorage
from spectral_core.render.relight.transport import Transport
from spectral_core.render.relight.view_transform import BELOW, ViewTransform, nodes
from spectral_core.spectra.color import display_rgb_from_linear

# Presses, drags and releases the selector, then switches the second bulb off, and records the shown values.
DRIVE = """
<script>
const box = dial.getBoundingClientRect(), R = 0.36;
const at = p => ({ clientX: box.left + box.width * (0.5 + R * p[0]), clientY: box.top + box.height * (0.5 - R * p[1]),
                   pointerId: 1, bubbles: true });
const send = (kind, p) => dial.dispatchEvent(new PointerEvent(kind, at(p)));
const seen = [];
function look() {
  window.spectral.draw();
  const rows = [];
  for (let y = 0; y < height; y++) for (let x = 0; x < width; x++) rows.push(window.spectral.pixel(x, y).slice(0, 3));
  seen.push({ selector: state.selector.slice(), weights: Array.from(window.spectral.weights()), pixels: rows });
}
look();
send("pointerdown", [0, 0]); send("pointermove", [0.2, 0.1]); send("pointermove", [0.35, 0.41]);
send("pointerup", [0.35, 0.41]);
look();
send("pointerdown", state.bulbs[1]); send("pointerup", state.bulbs[1]);
look();
const result = document.createElement("pre");
result.id = "result"; result.textContent = JSON.stringify(seen);
document.body.append(result);
</script>
"""


def transport_of(layers: np.ndarray) -> Transport:
    """A dial transport of given (groups, 3, height, width) layers."""
    count, _, height, width = layers.shape
    names = tuple(f"light {k}" for k in range(count))
    return Transport(MixtureStorage(), names, layers.astype(np.float32), np.ones((height, width), np.float32),
                     (None,) * count, 1.0, "0" * 64, 1, 0)  # fmt: skip


def browse(page: Path, *options: str) -> str:
    """The page's document after its scripts ran, or the output that ``options`` of the browser request."""
    program = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if program is None:
        pytest.skip("no Chromium on this machine")
    quiet = ("--no-first-run", "--disable-sync", "--disable-quic", "--disable-background-networking",
             "--disable-component-update", f"--user-data-dir={page.parent / 'profile'}")  # fmt: skip
    look = ("--headless", "--no-sandbox", "--disable-gpu", "--window-size=900,700", "--virtual-time-budget=4000")
    command = [program, *look, *quiet, *(options or ("--dump-dom",)), page.as_uri()]
    return subprocess.run(command, capture_output=True, text=True, timeout=120).stdout


def test_dragging_in_a_browser_shows_the_picture_of_the_library(tmp_path: Path, rng: np.random.Generator) -> None:
    transport = transport_of(rng.uniform(0, 1.2, (3, 3, 12, 16)))
    page = tmp_path / "dial.html"
    write_page(page, transport, title="Test <dial>")
    page.write_text(page.read_text("utf-8").replace("</html>", DRIVE + "</html>"), "utf-8")
    found = re.search(r'<pre id="result">(.*?)</pre>', browse(page), re.DOTALL)
    assert found, "the page's script did not run to its end"
    seen = json.loads(html.unescape(found[1]))

    live, bulbs = LiveMix(transport), bulbs_on_polygon(3)
    switches = ([True] * 3, [True] * 3, [True, False, True])
    for state, is_on in zip(seen, switches, strict=True):
        weights = dial_weights(state["selector"], bulbs, is_on)
        np.testing.assert_allclose(state["weights"], weights, atol=1e-12)
        expected = 255 * np.clip(display_rgb_from_linear(live.picture(3 * weights)[::-1, :, :3]), 0, 1)
        shown = np.array(state["pixels"]).reshape(expected.shape)
        assert np.abs(shown - expected).max() <= 1.0
    np.testing.assert_allclose(seen[1]["selector"], [0.35, 0.41], atol=0.02)


def test_impossible_pages_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidInputError, match="a dial needs at least 2"):
        write_page(tmp_path / "x.html", transport_of(np.ones((1, 3, 2, 2))))
    with pytest.raises(InvalidInputError, match="over 65504"):
        write_page(tmp_path / "x.html", transport_of(np.full((2, 3, 2, 2), 1e6)))


def steep() -> ViewTransform:
    """A transform that mixes channels, so that no curve per channel equals it: warm, and constant above 1."""
    light = nodes()
    red, green, blue = np.meshgrid(light, light, light, indexing="ij")
    mean = (red + green + blue) / 3
    shown = np.stack([0.7 * red + 0.3 * mean, green, 0.5 * blue + 0.2 * mean], axis=-1)
    return ViewTransform("Steep", 1 - np.exp(-shown))


def test_the_center_shows_the_recorded_scene_through_its_view_transform(tmp_path: Path, rng) -> None:
    """The center of 4 lights has full brightness, not a quarter; the page uses --mix and the scene's view transform."""
    transport = replace(transport_of(rng.uniform(0, 1.2, (4, 3, 6, 8))), view=steep())
    page = tmp_path / "dial.html"
    write_page(page, transport, title="@TRANSPORT@", mix={"light 0": 0.0})
    text = page.read_text("utf-8")
    assert text.count("@TRANSPORT@") == 2 and text.count('"half"') == 1
    page.write_text(text.replace("</html>", DRIVE + "</html>"), "utf-8")
    found = re.search(r'<pre id="result">(.*?)</pre>', browse(page), re.DOTALL)
    assert found, "the page's script did not run to its end"
    shown = np.array(json.loads(html.unescape(found[1]))[0]["pixels"]).reshape(6, 8, 3)

    linear = relight(transport, mix={"light 0": 0.0})[::-1, :, :3].astype(float)
    assert np.abs(shown - 255 * steep().shown(linear)).max() <= 1.5


def test_the_page_shows_colors_outside_of_srgb_through_the_view_transform(tmp_path: Path, rng) -> None:
    """The light of a laser is below 0 in a channel of sRGB: the page took it as 0, off by up to 150 of 255 in AgX."""
    light = nodes(below=BELOW)
    red, green, blue = np.meshgrid(light, light, light, indexing="ij")
    wide = np.stack([0.6 * red + 0.4 * green, 0.1 * red + 0.9 * green, 0.1 * green + 0.9 * blue], axis=-1)
    view = ViewTransform("Wide", 1 - np.exp(-np.maximum(wide, 0)), BELOW, 0.4)
    transport = replace(transport_of(rng.uniform(-0.7, 1.5, (2, 3, 6, 8))), view=view)
    page = tmp_path / "dial.html"
    write_page(page, transport)
    page.write_text(page.read_text("utf-8").replace("</html>", DRIVE + "</html>"), "utf-8")
    found = re.search(r'<pre id="result">(.*?)</pre>', browse(page), re.DOTALL)
    assert found, "the page's script did not run to its end"
    shown = np.array(json.loads(html.unescape(found[1]))[0]["pixels"]).reshape(6, 8, 3)
    linear = relight(transport)[::-1, :, :3].astype(float)
    assert linear.min() < -0.5
    assert np.abs(shown - 255 * view.shown(linear)).max() <= 1.5
    assert np.abs(view.shown(linear) - view.shown(np.maximum(linear, 0))).max() > 0.1


def test_a_view_transform_is_its_table_between_the_nodes(rng: np.random.Generator) -> None:
    light = rng.uniform(0, 1, (500, 3)) ** 3 * 8
    red, green, blue = np.moveaxis(light, -1, 0)
    mean = light.mean(axis=-1)
    exact = 1 - np.exp(-np.stack([0.7 * red + 0.3 * mean, green, 0.5 * blue + 0.2 * mean], axis=-1))
    assert np.abs(steep().shown(light) - exact).max() < 0.02
    back = ViewTransform.of_document(steep().document())
    np.testing.assert_allclose(back.table, steep().table, atol=1e-5)
    with pytest.raises(InvalidInputError, match="20 nodes has 107811 values"):
        ViewTransform.of_document({**steep().document(), "size": 20})


def test_a_view_transform_of_two_nodes_has_its_nodes_and_one_node_is_refused() -> None:
    corners = np.stack(np.meshgrid([0.0, 1.0], [0.0, 1.0], [0.0, 1.0], indexing="ij"), axis=-1)
    found = ViewTransform("Least", corners[..., ::-1])
    # At its nodes the table returns its entries, here with red and blue exchanged.
    least, most = nodes(2)
    np.testing.assert_allclose(found.shown(np.array([[most, least, least]])), [[0.0, 0.0, 1.0]], atol=1e-6)
    with pytest.raises(InvalidInputError, match="has 1 node per axis"):
        ViewTransform("One", np.zeros((1, 1, 1, 3)))


def test_the_page_supports_screen_readers_and_keeps_the_selector_in_the_dial(tmp_path: Path, rng) -> None:
    page = tmp_path / "dial.html"
    write_page(page, transport_of(rng.uniform(0, 1, (3, 3, 4, 4))))
    script = """
<script>
const press = key => dial.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true }));
for (let n = 0; n < 60; n++) press("ArrowRight");
const far = state.selector.slice();
const box = dial.getBoundingClientRect();
const send = (kind, x, y) => dial.dispatchEvent(new PointerEvent(kind, { clientX: box.left + x * box.width,
  clientY: box.top + y * box.height, pointerId: 1, bubbles: true }));
press("0"); send("pointerdown", 0.5, 0.5); send("pointermove", 0.6, 0.5); send("pointercancel", 0.6, 0.5);
const dropped = state.selector.slice(); send("pointermove", 0.2, 0.2);
const still = state.selector.slice();
press("1"); window.spectral.draw();
const out = document.createElement("pre");
out.id = "result"; out.textContent = JSON.stringify({ far, dropped, still, after: state.selector,
  now: dial.getAttribute("aria-valuenow"), text: dial.getAttribute("aria-valuetext"),
  buttons: document.querySelectorAll("#lights button").length });
document.body.append(out);
</script>
"""
    page.write_text(page.read_text("utf-8").replace("</html>", script + "</html>"), "utf-8")
    found = re.search(r'<pre id="result">(.*?)</pre>', browse(page), re.DOTALL)
    assert found, "the page's script did not run to its end"
    seen = json.loads(html.unescape(found[1]))
    assert seen["far"][0] == 1.35 and seen["buttons"] == 3
    assert seen["dropped"][0] > 0.1 and seen["still"] == seen["dropped"]
    np.testing.assert_allclose(seen["after"], bulbs_on_polygon(3)[0], atol=1e-12)
    assert seen["now"] == "100" and seen["text"].startswith("light 0 100 %")


def test_the_page_leaves_menus_second_fingers_and_keys_of_the_browser_alone(tmp_path: Path, rng) -> None:
    """A press of the right button switched lights off, a second finger took the selector, Ctrl 0 moved it."""
    page = tmp_path / "dial.html"
    write_page(page, transport_of(rng.uniform(0, 1, (3, 3, 4, 4))))
    script = """
<script>
const box = dial.getBoundingClientRect();
const send = (kind, p, more) => dial.dispatchEvent(new PointerEvent(kind, { pointerId: 1, bubbles: true, ...more,
  clientX: box.left + box.width * (0.5 + 0.36 * p[0]), clientY: box.top + box.height * (0.5 - 0.36 * p[1]) }));
const seen = [];
for (const button of [1, 2]) for (const place of [state.bulbs[1], [0.4, -0.3]]) {
  send("pointerdown", place, { button }); send("pointermove", [0.1, 0.5]); send("pointerup", [0.1, 0.5], { button });
  seen.push([...state.selector, ...state.on]);
}
for (const held of ["ctrlKey", "altKey", "metaKey"]) for (const key of ["2", "ArrowUp"]) {
  const event = new KeyboardEvent("keydown", { key, [held]: true, bubbles: true, cancelable: true });
  dial.dispatchEvent(event);
  seen.push([...state.selector, ...state.on, event.defaultPrevented]);
}
send("pointerdown", [0, 0]); send("pointermove", [0.3, 0.2]);
send("pointerdown", [-0.8, -0.3], { pointerId: 2 }); send("pointermove", [-0.9, -0.5], { pointerId: 2 });
send("pointerup", [-0.9, -0.5], { pointerId: 2 }); send("pointermove", [0.1, 0.2]); send("pointerup", [0.1, 0.2]);
const out = document.createElement("pre");
out.id = "result"; out.textContent = JSON.stringify({ seen, last: state.selector });
document.body.append(out);
</script>
"""
    page.write_text(page.read_text("utf-8").replace("</html>", script + "</html>"), "utf-8")
    found = re.search(r'<pre id="result">(.*?)</pre>', browse(page), re.DOTALL)
    assert found, "the page's script did not run to its end"
    said = json.loads(html.unescape(found[1]))
    assert said["seen"] == 4 * [[0, 0, True, True, True]] + 6 * [[0, 0, True, True, True, False]]
    np.testing.assert_allclose(said["last"], [0.1, 0.2], atol=0.02)


def test_the_command_uses_the_brightness_of_the_dial(tmp_path: Path, rng: np.random.Generator) -> None:
    """The center of the dial has the recorded brightness, also with four lights; the page starts from --mix."""
    from spectral_core.cli import main
    from spectral_core.render.relight.transport_file import read_transport, write_transport

    transport = replace(transport_of(rng.uniform(0, 1, (4, 3, 5, 6))), view=steep())
    file = tmp_path / "t.exr"
    write_transport(file, transport)
    back = read_transport(file)
    assert back.view is not None and back.view.name == "Steep"
    np.testing.assert_allclose(back.view.table, steep().table, atol=1e-5)

    out, page = tmp_path / "middle.npy", tmp_path / "dial.html"
    assert main(["relight", str(file), "--dial", "0,0", "--mix", "light 2=0.5", "--out", str(out)]) == 0
    expected = relight(transport, mix={"light 2": 0.5})[::-1, :, :3]
    np.testing.assert_allclose(np.load(out), expected, rtol=1e-5)
    assert main(["relight", str(file), "--mix", "light 2=0", "--html", str(page)]) == 0
    found = re.search(r'"half": "([^"]*)"', page.read_text("utf-8"))
    assert found
    layers = np.frombuffer(base64.b64decode(found[1]), np.float16).reshape(4, 5, 6, 3)
    assert not layers[2].any() and layers[1].any()
