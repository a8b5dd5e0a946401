"""Dumps: the exact scene that would be rendered, written to a file for pharos-cli."""

from __future__ import annotations

from pathlib import Path

import bpy
from bpy.props import StringProperty
from bpy_extras.io_utils import ExportHelper

from . import handlers, native


class _DumpRequest:
    """A dump that the next render call writes instead of rendering."""

    def __init__(self):
        self.path = ""
        self.error = ""


_request = _DumpRequest()


def dump_path(template: str, frame: int, layer: str) -> str:
    """#### is the frame; the layer's name is added where a scene renders several."""
    path = bpy.path.abspath(template)
    hashes = path.count("#")
    if hashes and "#" * hashes in path:
        path = path.replace("#" * hashes, f"{frame:0{hashes}d}")
    if layer:
        parts = Path(path)
        path = str(parts.with_name(f"{parts.stem}.{bpy.path.clean_name(layer)}{parts.suffix}"))
    return path


def take_dump(module, description, scene, view_layer) -> bool:
    """Write the dumps that were asked for; True if this render was only for that."""
    only = bool(_request.path)
    template = _request.path or handlers.dump_argument()
    if template:
        # An evaluated scene may hold but the layer that is rendered.
        several = sum(layer.use for layer in scene.original.view_layers) > 1
        path = dump_path(template, scene.frame_current, view_layer.name if several else "")
        try:
            module.write_dump(description, path)
        except RuntimeError as error:
            _request.error = str(error)
            if not only:
                raise
    return only


class PHAROS_OT_dump(bpy.types.Operator, ExportHelper):
    """Write the scene as Pharos renders it to a file that pharos-cli renders without Blender"""

    bl_idname = "pharos.dump"
    bl_label = "Dump Scene for pharos-cli"
    filename_ext = ".pharos"
    check_extension = None
    filter_glob: StringProperty(default="*.pharos", options={"HIDDEN"})

    @classmethod
    def poll(cls, context):
        return native.load().module is not None

    def execute(self, context):
        scene = context.scene
        engine = scene.render.engine
        _request.path, _request.error = self.filepath, ""
        try:
            scene.render.engine = "PHAROS"
            # Only a render evaluates the scene as a render sees it.
            bpy.ops.render.render("EXEC_DEFAULT", scene=scene.name)
        except RuntimeError as error:
            _request.error = _request.error or str(error)
        finally:
            _request.path = ""
            scene.render.engine = engine
        if _request.error:
            self.report({"ERROR"}, _request.error)
            return {"CANCELLED"}
        return {"FINISHED"}


def register():
    bpy.utils.register_class(PHAROS_OT_dump)


def unregister():
    bpy.utils.unregister_class(PHAROS_OT_dump)
