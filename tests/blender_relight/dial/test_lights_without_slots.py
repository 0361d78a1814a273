# SPDX-License-Identifier: GPL-3.0-or-later
"""Apply to Lights where light comes from beside the slots of materials: it gives the dial's picture, or refuses."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")


def linked(name, data, place=(0.0, 0.0, 0.0)):
    made = bpy.data.objects.new(name, data)
    made.location = place
    bpy.context.scene.collection.objects.link(made)
    return made


def lit_material(strength):
    from tests.blender_relight.stage import _material

    return _material("Extra", "ShaderNodeEmission", Color=(1, 0.3, 0.2, 1), Strength=strength)


def set_by_geometry_nodes():
    """A quad without slots whose geometry nodes assign a material that emits light."""
    tree = bpy.data.node_groups.new("Assigned", "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    given, node, out = (
        tree.nodes.new(kind) for kind in ("NodeGroupInput", "GeometryNodeSetMaterial", "NodeGroupOutput")
    )
    node.inputs["Material"].default_value = lit_material(5.0)
    tree.links.new(given.outputs[0], node.inputs["Geometry"])
    tree.links.new(node.outputs[0], out.inputs[0])
    mesh = bpy.data.meshes.new("Quad")
    mesh.from_pydata([(-1, -1, 0), (0, -1, 0), (0, 0, 0), (-1, 0, 0)], [], [(0, 1, 2, 3)])
    made = linked("Quad", mesh, (1, -1, 0.5))
    made.modifiers.new("Assigned", "NODES").node_group = tree
    return made


def hair_curves():
    """Three strands that emit light."""
    curves = bpy.data.hair_curves.new("Hair")
    curves.add_curves([2, 2, 2])
    ends = [(x, -1.0, z) for x in (-0.5, 0.0, 0.5) for z in (0.3, 1.5)]
    curves.attributes["position"].data.foreach_set("vector", np.ravel(ends))
    curves.attributes.new("radius", "FLOAT", "POINT").data.foreach_set("value", np.full(6, 0.1))
    curves.materials.append(lit_material(30.0))
    return linked("Hair", curves)


def removing_light():
    """The ball, whose emission has a strength below 0."""
    tree = bpy.data.materials["Glow"].node_tree
    next(node for node in tree.nodes if node.type == "EMISSION").inputs["Strength"].default_value = -0.3
    return bpy.data.objects["Ball"]


def color_as_surface():
    """The ball, whose material has a color in the place of a shader."""
    tree = bpy.data.materials["Glow"].node_tree
    output = next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL")
    color = tree.nodes.new("ShaderNodeRGB")
    color.outputs[0].default_value = (2.0, 1.0, 0.5, 1.0)
    tree.links.new(color.outputs[0], output.inputs["Surface"])
    tree.nodes.remove(next(node for node in tree.nodes if node.type == "EMISSION"))
    return bpy.data.objects["Ball"]


def color_as_world():
    tree = bpy.context.scene.world.node_tree
    output = next(node for node in tree.nodes if node.type == "OUTPUT_WORLD")
    color = tree.nodes.new("ShaderNodeRGB")
    color.outputs[0].default_value = (0.2, 0.1, 0.05, 1.0)
    tree.links.new(color.outputs[0], output.inputs["Surface"])
    tree.nodes.remove(next(node for node in tree.nodes if node.type == "BACKGROUND"))
    return bpy.context.scene.world


def recorded_by_groups(scene, source):
    """The dial of a recording with the groups Mixed (the source and "Key") and Other ("Fill")."""
    for name in ("Mixed", "Other"):
        scene.view_layers[0].lightgroups.add(name=name)
    source.lightgroup = bpy.data.objects["Key"].lightgroup = "Mixed"
    bpy.data.objects["Fill"].lightgroup = "Other"
    dial = scene.spectral.dial
    dial.one_per_light = False
    assert bpy.ops.spectral.dial_record() == {"FINISHED"}
    dial.selector = (0.3, 0.2)
    return dial


@pytest.mark.parametrize("source", [hair_curves, removing_light])
def test_a_group_of_a_lamp_and_another_light_is_applied_whole(stage, picture, same_paths, source):
    recorded_by_groups(stage, source())
    shown = picture()[..., :3].copy()
    assert bpy.ops.spectral.dial_apply() == {"FINISHED"}
    assert np.abs(same_paths()[..., :3] - shown).max() < 1e-5 * shown.max()


@pytest.mark.usefixtures("without_rays")
@pytest.mark.parametrize(
    ("source", "named"),
    [(set_by_geometry_nodes, "'Extra'"), (color_as_surface, "'Glow'"), (color_as_world, "'World'")],
)
def test_light_that_has_no_strength_of_its_own_is_named(stage, source, named):
    recorded_by_groups(stage, source())
    with pytest.raises(RuntimeError, match=f"{named} emits light"):
        bpy.ops.spectral.dial_apply()
    assert bpy.data.lights["Key"].energy == 200.0


def test_such_light_stays_where_its_bulb_is_as_recorded(stage, picture, same_paths):
    dial = recorded_by_groups(stage, set_by_geometry_nodes())
    dial.selector, dial.intensity = (0.0, 0.0), float(len(dial.bulbs))
    shown = picture()[..., :3].copy()
    assert bpy.ops.spectral.dial_apply() == {"FINISHED"}
    assert np.abs(same_paths()[..., :3] - shown).max() < 1e-5 * shown.max()


@pytest.fixture
def instances(stage):
    """The names of the bulbs of a light that is shown twice by instances of its collection."""

    def of(name):
        shown = bpy.data.collections.new("Shown")
        stage.collection.objects.unlink(bpy.data.objects[name])
        shown.objects.link(bpy.data.objects[name])
        for number in range(2):
            place = linked(f"Place {number}", None, (number, 0, 0))
            place.instance_type, place.instance_collection = "COLLECTION", shown
        bpy.context.view_layer.update()
        assert bpy.ops.spectral.dial_record() == {"FINISHED"}
        assert {name, f"{name} #2"} <= {bulb.name for bulb in stage.spectral.dial.bulbs}
        return name, f"{name} #2"

    return of


@pytest.mark.parametrize("name", ["Key", "Ball"])
def test_an_instance_of_a_light_is_as_bright_as_the_light(stage, instances, picture, same_paths, name):
    """The selector on the bulb of the instance, which keeps its power, made the light and the instance dark."""
    dial = stage.spectral.dial
    light, instance = (dial.bulbs[each] for each in instances(name))
    energy = bpy.data.lights["Key"].energy
    for bulb in (light, instance):
        dial.selector, dial.intensity = bulb.place, 1.0
        with pytest.raises(RuntimeError, match="an instance of a light cannot be dimmed by itself"):
            bpy.ops.spectral.dial_apply()
        assert bpy.data.lights["Key"].energy == energy
    light.place = instance.place
    dial.selector, dial.intensity = (0.2, 0.1), len(dial.bulbs)
    assert bpy.ops.spectral.dial_apply() == {"FINISHED"}
    assert same_paths()[..., :3] == pytest.approx(picture()[..., :3], rel=1e-4, abs=1e-6)


@pytest.mark.usefixtures("without_rays")
def test_an_instance_of_a_lamp_that_apply_made_dark_is_no_change(stage, instances):
    instances("Key")
    dial = stage.spectral.dial
    dial.selector = dial.bulbs["Fill"].place
    assert bpy.ops.spectral.dial_apply() == {"FINISHED"}
    assert bpy.data.lights["Key"].energy == 0.0
    bpy.ops.spectral.dial_check()
    assert dial.changes == ""
    bpy.data.objects["Fill"].location.x += 1.0
    bpy.context.view_layer.update()
    bpy.ops.spectral.dial_check()
    assert dial.changes == "light 'Fill' was changed"


def test_an_instance_of_a_lamp_has_its_spectrum(stage, instances):
    dial = stage.spectral.dial
    dial.storage = "BANDS31"
    light, instance = (dial.bulbs[each] for each in instances("Key"))
    dial.selector, dial.intensity = (0.0, 0.0), len(dial.bulbs)
    light.lamp = "HP1"
    with pytest.raises(RuntimeError, match="Give both bulbs the same lamp"):
        bpy.ops.spectral.dial_apply()
    assert bpy.data.lights["Key"].spectral.catalogue_name != "HP1"
    instance.lamp = "HP1"
    assert bpy.ops.spectral.dial_apply() == {"FINISHED"}


@pytest.mark.usefixtures("without_rays")
def test_a_baked_lamp_is_where_the_instance_of_the_lamp_is(stage, instances):
    """A lamp that only instances of its collection show is not at the place of its own object."""
    light, instance = (stage.spectral.dial.bulbs[each] for each in instances("Key"))
    for bulb in stage.spectral.dial.bulbs:
        bulb.is_on = bulb.name in (light.name, instance.name)
    bpy.data.objects["Place 0"].location = (0.5, -1.0, 0.25)
    bpy.context.view_layer.update()
    assert bpy.ops.spectral.dial_bake() == {"FINISHED"}
    bpy.context.view_layer.update()
    made = bpy.data.objects["Dial Light"]
    assert tuple(made.matrix_world.translation) == pytest.approx((-1.5, -2.0, 3.25))
