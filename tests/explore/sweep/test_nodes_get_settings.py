# SPDX-License-Identifier: GPL-3.0-or-later
"""Every entry of a scene's and a volume's compute table reaches what is rendered, without a ray."""

from __future__ import annotations

import json
import pickle
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError, RenderError
from spectral_core.explore.sweep.compute import rendering
from spectral_core.explore.sweep.compute.command import TIME_LIMIT_S
from spectral_core.explore.sweep.document import compute_node, sweep_of
from spectral_core.explore.sweep.outcome import Outcome
from spectral_core.scene import PointLight, RenderSettings, Scene
from spectral_core.volume.files import write_volume
from spectral_core.volume.samples import sample_volume
from tests.settings_walk import fingerprint

SCENE = """
import numpy as np
from spectral_core.scene import Camera, Film, PointLight, Scene, SunLight
def made():
    made = dict(world_from_light=np.eye(4))
    lights = PointLight(name="bulb", power_w=5.0, **made), SunLight(name="sun", irradiance=2.0, **made)
    return Scene(camera=Camera(world_from_camera=np.eye(4)), film=Film(width=8, height=6, samples=2), lights=lights)
"""
LIGHT = {"name": "watts", "low": 1.0, "high": 3.0, "path": "lights[0].power_w"}
SAMPLES = {"name": "paths", "low": 1, "high": 9, "kind": "integer", "path": "film.samples"}


def node_of(folder: Path, compute: dict[str, Any], *parameters: dict[str, Any]) -> Any:
    sweep = sweep_of({"compute": compute, "parameters": list(parameters)}, folder)
    return compute_node(sweep.compute, sweep.space, folder)


def scene_node(folder: Path, *parameters: dict[str, Any], **entries: Any) -> Any:
    (folder / "mine.py").write_text(SCENE)
    return node_of(folder, {"kind": "scene", "scene": "mine.py:made", **entries}, *parameters)


@pytest.fixture
def traced(monkeypatch) -> list[tuple[Scene, dict[str, Any]]]:
    """Scenes and options of every render."""
    import spectral_core.render as render

    calls: list[tuple[Scene, dict[str, Any]]] = []

    def trace(scene: Scene, **options: Any) -> Any:
        calls.append((scene, options))
        pixels = np.arange(8 * 6 * 4, dtype=np.float32).reshape(6, 8, 4)
        groups = {"left lamp": pixels, "2": 2 * pixels}
        return SimpleNamespace(
            status="done" if scene.film.samples > 1 else "cancelled",
            samples=scene.film.samples,
            pixels=pixels,
            group_pixels=groups,
        )

    monkeypatch.setattr(render, "render_scene", trace)
    return calls


def test_a_point_is_rendered_with_its_value_its_seed_and_the_settings(tmp_path, traced) -> None:
    node = scene_node(tmp_path, SAMPLES, settings={"lights[1].irradiance": 7.0})
    outcome = node({"paths": 5}, 41)
    ((scene, options),) = traced
    assert (scene.film.samples, scene.film.seed, scene.lights[1].irradiance) == (5, 41, 7.0)
    assert options == {"groups": False}
    assert outcome.values["samples"] == 5 and not any(name.startswith("left_lamp") for name in outcome.values)
    assert outcome.pictures[""][0, 0, 0] == 5 * 8 * 4  # the last row of a render is the top
    node({"paths": 5}, 42)
    assert traced[1][0].film.seed == 42


def test_light_groups_are_measured_by_themselves_on_request(tmp_path, traced) -> None:
    outcome = scene_node(tmp_path, LIGHT, per_light=True)({"watts": 2.0}, 0)
    assert traced[0][1] == {"groups": True} and traced[0][0].lights[0].power_w == 2.0
    assert {name.removesuffix("mean_red") for name in outcome.values if name.endswith("mean_red")} == {
        "", "left_lamp_", "light_2_",
    }  # fmt: skip
    assert outcome.values["light_2_mean_red"] == pytest.approx(2 * outcome.values["left_lamp_mean_red"])


def test_a_stopped_render_is_no_outcome(tmp_path, traced) -> None:
    with pytest.raises(RenderError, match="stopped"):
        scene_node(tmp_path, SAMPLES)({"paths": 1}, 0)


def test_lights_alone_are_re_lit_unless_it_is_switched_off(tmp_path, traced, monkeypatch) -> None:
    assert scene_node(tmp_path, LIGHT).relights
    assert not scene_node(tmp_path, LIGHT, SAMPLES).relights
    assert not scene_node(tmp_path, LIGHT, per_light=True).relights
    off = scene_node(tmp_path, LIGHT, relight=False)
    off({"watts": 3.0}, 0)
    assert not off.relights and len(traced) == 1
    recorded = []

    class Mix:
        transport = SimpleNamespace(groups=["bulb", "sun", "world"], samples=11)

        def __init__(self, given: Any) -> None:
            recorded.append(given)

        def picture(self, weights: list[float], *, signed: bool) -> Any:
            assert signed  # the power of a lamp may be negative
            return np.full((6, 8, 4), np.dot(weights, [1.0, 10.0, 100.0]), np.float32)

    from spectral_core.render.relight import mix, transport

    monkeypatch.setattr(mix, "LiveMix", Mix)
    monkeypatch.setattr(transport, "record_transport", lambda *given, **options: (*given, options))
    node = scene_node(tmp_path, LIGHT)
    outcomes = [node({"watts": watts}, 0) for watts in (1.0, 3.0)]
    ((scene, _, options),) = recorded
    assert options == {"one_per_light": True}
    assert [light.power_w if isinstance(light, PointLight) else light.irradiance for light in scene.lights] == [1, 1]
    assert [each.pictures[""][0, 0, 0] for each in outcomes] == [121.0, 123.0]
    assert outcomes[0].values["samples"] == 11 and len(traced) == 1
    assert "relighter" in node._kept and pickle.loads(pickle.dumps(node))._kept == {}


def test_a_scene_that_asks_for_an_error_is_rendered_where_lights_alone_are_swept(tmp_path, traced) -> None:
    """Its recording was refused at every point."""
    node = scene_node(tmp_path, LIGHT, settings={"settings.target_error": 2.0})
    assert not node.relights and any("every point is rendered" in line for line in node.describe())
    node({"watts": 3.0}, 0)
    assert traced[0][0].lights[0].power_w == 3.0 and len(traced) == 1
    asked = replace(_plain_scene(), settings=RenderSettings(time_budget_s=3.0))
    rendering.Relighter().picture(asked)
    assert len(traced) == 2


def test_unit_lights_have_power_1_and_suns_irradiance_1() -> None:
    scene = _plain_scene()
    found = rendering.with_unit_lights(scene).lights
    assert (found[0].power_w, found[1].irradiance) == (1.0, 1.0)  # type: ignore[union-attr]
    assert [rendering.light_amount(scene, name) for name in ("bulb", "sun", "world")] == [5.0, 2.0, 1.0]


def _plain_scene() -> Scene:
    space: dict[str, Any] = {}
    exec(SCENE, space)
    return space["made"]()


def test_every_entry_of_a_scene_changes_its_fingerprint(tmp_path) -> None:
    plain = scene_node(tmp_path, LIGHT).fingerprint
    others = [
        scene_node(tmp_path, LIGHT, **entries).fingerprint
        for entries in ({"per_light": True}, {"relight": False}, {"settings": {"film.samples": 9}})
    ]
    assert len({plain, *others}) == 4
    assert scene_node(tmp_path, LIGHT).fingerprint == plain


AZIMUTH = {"name": "turn", "low": 0.0, "high": 90.0, "path": "azimuth"}
OPACITY = {"name": "height", "low": 0.1, "high": 2.0, "path": "transfer.materials[0].knots[1][1]"}
VOLUME_SETTINGS = {
    "rule": "uniform", "quadrature": "preintegrated", "scale": 0.5, "azimuth": 70.0, "elevation": -10.0, "zoom": 2.0,
}  # fmt: skip


@pytest.fixture
def marched(monkeypatch) -> list[tuple[Any, ...]]:
    """(volume, view, transfer function, stepping, options) of every volume picture."""
    from spectral_core.volume import renderer

    calls: list[tuple[Any, ...]] = []

    class Renderer:
        def __init__(self, volume: Any, variant: str) -> None:
            self.volume = volume

        def render(self, view: Any, transfer: Any, way: Any, **options: Any) -> Any:
            calls.append((self.volume, view, transfer, way, options))
            amounts = np.ones((view.height, view.width, len(transfer.materials)), np.float32)
            return SimpleNamespace(amounts=amounts, samples=30, steps=20, seconds=0.5)

    monkeypatch.setattr(renderer, "VolumeRenderer", Renderer)
    return calls


def volume_node(folder: Path, *parameters: dict[str, Any], **entries: Any) -> Any:
    return node_of(folder, {"kind": "volume", "volume": "sample:gaussians:12", **entries}, *parameters)


def test_every_entry_of_a_volume_reaches_its_march(tmp_path, marched) -> None:
    def picture(parameter: dict[str, Any] = AZIMUTH, value: float = 30.0, **entries: Any) -> tuple[Any, ...]:
        marched.clear()
        outcome = volume_node(tmp_path, parameter, **entries)({parameter["name"]: value}, 0)
        assert isinstance(outcome, Outcome)
        assert [outcome.values[f"march_{name}"] for name in ("samples", "steps", "seconds")] == [30, 20, 0.5]
        assert outcome.values["mean_red"] > 0
        ((volume, view, transfer, way, options),) = marched
        assert options == {"counts": True}
        made = volume.data, view, transfer.materials, way
        assert outcome.pictures[""].shape[:2] == (view.height, view.width)
        return made

    plain = fingerprint(picture())
    zoomed = {"name": "near", "low": 1.0, "high": 3.0, "path": "zoom"}
    found = [fingerprint(picture(settings={name: value})) for name, value in VOLUME_SETTINGS.items()
             if name != "azimuth"]  # fmt: skip
    found += [fingerprint(picture(zoomed, settings={"azimuth": 70.0})), fingerprint(picture(zoomed))]
    found += [fingerprint(picture(**entry)) for entry in (
        {"size": [40, 24]}, {"transfer": "opaque"}, {"volume": "sample:gaussians:10"}, {"value": 31.0},
    )]  # fmt: skip
    assert len({plain, *found}) == len(found) + 1 and fingerprint(picture()) == plain
    others = {name: value for name, value in VOLUME_SETTINGS.items() if name != "azimuth"}
    _, view, _, way = picture(size=[40, 24], settings=others)
    assert (view.width, view.height) == (40, 24)
    assert (way.rule, way.quadrature, way.scale) == ("uniform", "preintegrated", 0.5)
    write_volume(sample_volume("gaussians", 9), tmp_path / "mine.nrrd")
    assert picture(volume="mine.nrrd")[0].shape == (9, 9, 9)


def test_every_entry_of_a_volume_changes_its_fingerprint(tmp_path) -> None:
    write_volume(sample_volume("gaussians", 9), tmp_path / "mine.nrrd")
    entries: list[dict[str, Any]] = [
        {}, {"size": [40, 24]}, {"transfer": "opaque"}, {"settings": {"zoom": 2.0}}, {"volume": "mine.nrrd"},
    ]  # fmt: skip
    assert len({volume_node(tmp_path, AZIMUTH, **each).fingerprint for each in entries}) == len(entries)
    node = volume_node(tmp_path, AZIMUTH)
    node._kept["renderer"] = 1
    assert pickle.loads(pickle.dumps(node))._kept == {}


def test_a_command_gets_its_time_limit(tmp_path) -> None:
    def limit(**entries: Any) -> float:
        compute = {"kind": "command", "command": ["true", "{watts}"], **entries}
        return float(node_of(tmp_path, compute, {"name": "watts", "low": 0.0, "high": 1.0}).limit_s)

    assert (limit(), limit(limit_s=7)) == (TIME_LIMIT_S, 7.0)


def test_the_entries_of_this_test_are_all_that_the_tables_have() -> None:
    from spectral_core.explore.sweep.compute.volume import SETTINGS

    assert set(SETTINGS) == set(VOLUME_SETTINGS) and json.dumps(VOLUME_SETTINGS)


@pytest.mark.parametrize(
    ("parameter", "entries", "message"),
    [
        (AZIMUTH, {"volume": "none.nrrd"}, "there is no file .*none.nrrd"),
        (AZIMUTH, {"volume": "sample:gaussians:12k"}, "'sample:gaussians:12k' names no sample"),
        (AZIMUTH, {"transfer": "wid"}, "did you mean 'wide'"),
        (AZIMUTH, {"size": [0, 16]}, r"the size of the pictures is \[0, 16\]"),
        (AZIMUTH, {"size": "16"}, "the size of the pictures is '16'"),
        (AZIMUTH, {"size": [16, 16.5]}, r"the size of the pictures is \[16, 16.5\]"),
        (AZIMUTH, {"settings": {"rule": "best"}}, "no step rule is named 'best'"),
        ({"name": "way", "path": "rule", "choices": ["error", "auto"]}, {}, "no step rule is named 'auto'"),
        ({"name": "scale", "low": 0.0, "high": 2.0}, {}, "the scale of the steps is 0.0; expected a value from"),
        ({"name": "way", "path": "quadrature", "choices": ["midpoint", "exact"]}, {}, "no quadrature is named 'exact'"),
    ],
)
def test_a_volume_that_cannot_be_rendered_is_refused_before_the_first_point(
    tmp_path: Path, parameter: dict[str, Any], entries: dict[str, Any], message: str
) -> None:
    with pytest.raises(InvalidInputError, match=message):
        volume_node(tmp_path, parameter, **entries)


def test_numbers_beside_their_header_change_the_fingerprint(tmp_path: Path) -> None:
    header = "NDims = 3\nDimSize = 2 3 4\nElementType = MET_UCHAR\nElementDataFile = a.raw\n"
    (tmp_path / "a.mhd").write_text(header)
    found = []
    for first in (0, 0, 7):
        (tmp_path / "a.raw").write_bytes(bytes([first, *range(23)]))
        found.append(volume_node(tmp_path, AZIMUTH, volume="a.mhd").fingerprint)
    assert found[0] == found[1] != found[2]


def test_stepping_refuses_what_no_march_has() -> None:
    from spectral_core.volume.image import Stepping

    for wrong in ({"rule": "auto"}, {"quadrature": "auto"}):
        with pytest.raises(InvalidInputError, match="is named 'auto'"):
            Stepping(**wrong)  # type: ignore[arg-type]


@pytest.mark.parametrize("name", ["per_light", "relight"])
def test_a_switch_of_a_scene_is_true_or_false(tmp_path: Path, name: str) -> None:
    """Python takes the text "no" for true."""
    with pytest.raises(InvalidInputError, match=f"{name} = 'no'; expected true or false"):
        scene_node(tmp_path, LIGHT, **{name: "no"})
