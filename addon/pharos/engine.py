"""The render engine as Blender sees it. Work is done in final.py and viewport.py."""

from __future__ import annotations

import traceback

import bpy

from . import final, native, write_flag
from .passes import wanted_passes
from .viewport import Viewport


class PharosRenderEngine(bpy.types.RenderEngine):
    """Blender makes one object a viewport and one a final render, and may do so twice."""

    bl_idname = "PHAROS"
    bl_label = "Pharos"
    bl_use_preview = True
    bl_use_postprocess = True
    bl_use_eevee_viewport = True
    bl_use_shading_nodes_custom = False

    def __init__(self, *args, **kwargs):
        super().__init__(*args, **kwargs)
        self._viewport = None

    def __del__(self):
        viewport = getattr(self, "_viewport", None)
        if viewport is not None:
            viewport.close()
        parent = super()
        if hasattr(parent, "__del__"):
            parent.__del__()

    def update_render_passes(self, scene=None, renderlayer=None):
        write_flag.enter()
        self.register_pass(scene, renderlayer, "Combined", 4, "RGBA", "COLOR")
        for entry in wanted_passes(renderlayer):
            channels = entry.channels
            self.register_pass(
                scene, renderlayer, entry.blender_name, len(channels), channels, entry.kind
            )

    def render(self, depsgraph):
        visit = write_flag.enter()
        module, problem = native.load()
        if module is None:
            self.report({"ERROR"}, f"Pharos: {problem}")
        else:
            self._render(depsgraph, module)
        write_flag.leave(visit, self)

    def _render(self, depsgraph, module):
        layer = depsgraph.view_layer_eval
        for entry in wanted_passes(layer):
            if not entry.built_in:
                self.add_pass(entry.name, len(entry.channels), entry.channels, layer=layer.name)
        try:
            final.render(self, depsgraph, module)
        except Exception as error:  # whatever it was, the user must see it
            traceback.print_exc()
            self.report({"ERROR"}, f"Pharos: {type(error).__name__}: {error}")

    def view_update(self, context, depsgraph):
        viewport = self._ensure_viewport(depsgraph.scene)
        if viewport is not None:
            viewport.scene_changed(context, depsgraph)

    def view_draw(self, context, depsgraph):
        viewport = self._ensure_viewport(depsgraph.scene)
        if viewport is not None:
            viewport.draw(self, context, depsgraph)

    def _ensure_viewport(self, scene):
        module, problem = native.load()
        if module is None:
            self.update_stats("Pharos", problem)
            return None
        if getattr(self, "_viewport", None) is None:
            render = scene.render
            threads = render.threads if render.threads_mode == "FIXED" else 0
            self._viewport = Viewport(module, threads)
        return self._viewport


def register():
    bpy.utils.register_class(PharosRenderEngine)


def unregister():
    bpy.utils.unregister_class(PharosRenderEngine)
