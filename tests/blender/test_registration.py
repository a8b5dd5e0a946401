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


def test_switch_for_guiding():
    """The panel's switch and its choice of a guide are two views of one setting."""
    own = harness.new_scene().pharos
    own.guiding_mode = "NEURAL"
    assert own.guiding == "OFF" and not own.use_guiding
    own.use_guiding = True
    assert own.guiding == "NEURAL"
    own.guiding_mode = "SLIDES"
    assert own.guiding == "SLIDES" and own.use_guiding
    own.use_guiding = False
    assert own.guiding == "OFF" and own.guiding_mode == "SLIDES"
    own.use_guiding = True
    assert own.guiding == "SLIDES"
    own.guiding = "NEURAL"
    assert own.guiding_mode == "NEURAL"
    own.guiding = "OFF"
    panel = bpy.types.PHAROS_RENDER_PT_advanced
    assert panel.bl_parent_id == "PHAROS_RENDER_PT_sampling"
    assert panel.bl_options == {"DEFAULT_CLOSED"}


def test_statistics_line_tells_of_the_guide():
    stats_line = importlib.import_module("pharos.final").stats_line
    harness.new_scene(16, 16, 4)
    harness.add_camera(location=(0.0, 0.0, 0.5))
    harness.add_object(harness.cube_mesh(), harness.emission())
    for guiding, words in (("OFF", ""), ("SLIDES", "Guiding ")):
        bpy.context.scene.pharos.guiding = guiding
        session = harness.native().RenderSession(harness.exported(), 1)
        assert session.wait(60.0)
        line = stats_line(session.progress())
        assert words in line and line.startswith("Sample 4/4"), line
        assert bool(words) == ("Guiding" in line), line


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
