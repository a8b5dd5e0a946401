"""The add-on registers, leaves nothing behind, and explains a module that does not work."""
# hosts: blender bpy

import importlib

import bpy
import harness


def test_engine_and_settings():
    scene = harness.new_scene()
    scene.render.engine = "PHAROS"
    assert scene.render.engine == "PHAROS"
    for name in ("samples", "seed", "time_limit", "use_nee", "guiding", "follow_cycles", "report"):
        assert hasattr(scene.pharos, name), name
    names = {item.identifier for item in scene.pharos.bl_rna.properties["guiding"].enum_items}
    assert names == {"OFF", "NEURAL", "SLIDES"}, names


def test_usual_panels_show():
    panels = {panel.__name__: panel for panel in bpy.types.Panel.__subclasses__()}
    for name in ("DATA_PT_lens", "DATA_PT_camera_dof", "RENDER_PT_format", "RENDER_PT_output"):
        assert "PHAROS" in panels[name].COMPAT_ENGINES, name
    assert "PHAROS_MATERIAL_PT_surface" in panels


def test_twice():
    pharos = importlib.import_module("pharos")
    pharos.unregister()
    assert not hasattr(bpy.types.Scene, "pharos")
    foreign = [p for p in bpy.types.Panel.__subclasses__() if not p.__name__.startswith("PHAROS_")]
    assert not any("PHAROS" in getattr(panel, "COMPAT_ENGINES", ()) for panel in foreign)
    pharos.register()
    bpy.context.scene.render.engine = "PHAROS"


def test_version():
    assert harness.native().__version__
    assert harness.native().self_test()


def test_processor_flags():
    missing = importlib.import_module("pharos.native")._missing_flags
    assert missing("flags\t\t: fpu sse2 avx2 fma bmi2\n") == []
    assert missing("flags\t\t: fpu sse2 avx2x fma\n") == ["avx2", "bmi2"]


def test_broken_module_is_explained():
    native = importlib.import_module("pharos.native")
    harness.new_scene()
    harness.add_camera()
    working = native.load
    native.load = lambda: native.Native(None, "it does not work")
    try:
        bpy.ops.render.render()
        raised = ""
    except RuntimeError as error:
        raised = str(error)
    finally:
        native.load = working
    assert "it does not work" in raised, raised


harness.main(globals())
