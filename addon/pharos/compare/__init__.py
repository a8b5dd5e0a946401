"""Compare with Cycles: one crop, one budget of CPU seconds, both pictures side by side.

Both engines render a copy of the scene in a background Blender, so that the interface stays free.
The result is an image and a text of this file, shown in an image editor where there is a window,
and files on disk.
"""

from __future__ import annotations

import time
from pathlib import Path

import bpy
import numpy as np
from bpy.props import FloatProperty, StringProperty

from .. import native
from .comparison import Comparison, ComparisonError
from .verdict import judge

NAME = "Compare with Cycles"
_POLL = 0.25  # seconds


class _State:
    """The comparison at work, and what the last one said."""

    def __init__(self):
        self.running = False
        self.lines: list[str] = []


_state = _State()


def is_at_work() -> bool:
    """A comparison is being made."""
    return _state.running


def last_lines() -> list[str]:
    """What the last comparison said."""
    return _state.lines


def output_folder(folder: str) -> Path:
    """Where files go: as asked, else beside the .blend file, else Blender's temporary folder."""
    if folder:
        return Path(bpy.path.abspath(folder))
    base = Path(bpy.data.filepath).parent if bpy.data.filepath else Path(bpy.app.tempdir)
    return base / "pharos_compare"


def _show_picture(pixels: np.ndarray):
    """The image of this file that holds the newest comparison."""
    height, width = pixels.shape[:2]
    image = bpy.data.images.get(NAME)
    if image is not None and tuple(image.size) != (width, height):
        bpy.data.images.remove(image)
        image = None
    if image is None:
        image = bpy.data.images.new(NAME, width, height, alpha=True, float_buffer=True)
    image.pixels.foreach_set(np.ascontiguousarray(pixels, np.float32).ravel())
    image.update()
    image.pack()
    return image


def _save_png(image, path: Path, scene) -> None:
    """As seen: with the scene's view transform."""
    settings = scene.render.image_settings
    names = ["file_format", "color_depth", "color_mode"]
    if hasattr(settings, "media_type"):
        names.insert(0, "media_type")
    before = {name: getattr(settings, name) for name in names}
    try:
        if "media_type" in before:
            settings.media_type = "IMAGE"
        settings.file_format, settings.color_mode, settings.color_depth = "PNG", "RGB", "8"
        image.save_render(str(path), scene=scene)
    finally:
        for name, value in before.items():
            setattr(settings, name, value)


def _write_text(lines: list[str]) -> None:
    text = bpy.data.texts.get(NAME) or bpy.data.texts.new(NAME)
    text.from_string("\n".join(lines) + "\n")


def _show_in_editor(image) -> None:
    """In an image editor of any window; in a new window where there is none."""
    manager = bpy.context.window_manager
    areas = [area for window in manager.windows for area in window.screen.areas]
    editor = next((area for area in areas if area.type == "IMAGE_EDITOR"), None)
    if editor is None and manager.windows:
        with bpy.context.temp_override(window=manager.windows[0]):
            bpy.ops.wm.window_new()
        editor = manager.windows[-1].screen.areas[0]
        editor.type = "IMAGE_EDITOR"
    if editor is not None:
        editor.spaces.active.image = image
        editor.tag_redraw()


class PHAROS_OT_compare(bpy.types.Operator):
    """Render this frame with Pharos and with Cycles, each for the same CPU time, and show both"""

    bl_idname = "pharos.compare"
    bl_label = "Compare with Cycles"

    seconds: FloatProperty(
        name="CPU Seconds",
        description="CPU time of each picture, over all threads; 0 takes the scene's setting",
        default=0.0,
        min=0.0,
    )
    folder: StringProperty(
        name="Folder",
        description="Where the pictures are written; beside the .blend file when empty",
        subtype="DIR_PATH",
    )

    _comparison: Comparison | None = None
    _timer = None

    @classmethod
    def poll(cls, context):
        return (
            native.load().module is not None
            and bool(bpy.app.binary_path)
            and hasattr(context.scene, "cycles")
            and not _state.running
        )

    def _begin(self, context) -> bool:
        scene = context.scene
        if scene.camera is None:
            self.report({"ERROR"}, "The scene has no camera.")
            return False
        try:
            seconds = self.seconds or scene.pharos.compare_seconds
            self._comparison = Comparison(scene, seconds, bpy.app.binary_path)
        except (OSError, RuntimeError) as error:
            self.report({"ERROR"}, f"No comparison: {error}")
            return False
        self._scene_name = scene.name
        _state.running = True
        return True

    def _end(self) -> None:
        _state.running = False
        if self._comparison is not None:
            self._comparison.close()
            self._comparison = None

    def _finish(self) -> set[str]:
        """Show and write what both engines made."""
        verdict = judge(self._comparison.results)
        scene = bpy.data.scenes.get(self._scene_name) or bpy.context.scene
        folder = output_folder(self.folder)
        folder.mkdir(parents=True, exist_ok=True)
        for result in self._comparison.results:
            target = folder / f"{result.engine.lower()}.exr"
            target.write_bytes(result.pictures[0].read_bytes())
        image = _show_picture(verdict.side_by_side)
        _save_png(image, folder / "compare.png", scene)
        (folder / "compare.txt").write_text("\n".join(verdict.lines) + "\n", encoding="utf-8")
        _write_text(verdict.lines)
        _state.lines = verdict.lines
        if not bpy.app.background:
            _show_in_editor(image)
        self.report({"INFO"}, f"{verdict.lines[2]} Pictures are in {folder}")
        return {"FINISHED"}

    def _step(self) -> set[str] | None:
        """None while there is something to wait for."""
        try:
            return self._finish() if self._comparison.poll() else None
        except (ComparisonError, OSError, ValueError, RuntimeError) as error:
            self.report({"ERROR"}, f"No comparison: {error}")
            return {"CANCELLED"}

    def execute(self, context):
        """Waits for the end: for scripts and background mode."""
        if not self._begin(context):
            return {"CANCELLED"}
        try:
            while (result := self._step()) is None:
                time.sleep(_POLL)
            return result
        finally:
            self._end()

    def invoke(self, context, event):
        if bpy.app.background:
            return self.execute(context)
        if not self._begin(context):
            return {"CANCELLED"}
        self._timer = context.window_manager.event_timer_add(_POLL, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type == "ESC":
            self.cancel(context)
            self.report({"INFO"}, "The comparison was cancelled.")
            return {"CANCELLED"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        context.workspace.status_text_set(f"{NAME}: {self._comparison.state}, Esc cancels")
        result = self._step()
        if result is None:
            return {"PASS_THROUGH"}
        self.cancel(context)
        return result

    def cancel(self, context):
        """Also called by Blender when another file is opened."""
        if self._timer is not None:
            context.window_manager.event_timer_remove(self._timer)
            self._timer = None
        if context.workspace is not None:
            context.workspace.status_text_set(None)
        self._end()


class PHAROS_RENDER_PT_compare(bpy.types.Panel):
    """The button, and what it said last."""

    bl_label = NAME
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"
    bl_options = {"DEFAULT_CLOSED"}
    COMPAT_ENGINES = {"PHAROS"}

    @classmethod
    def poll(cls, context):
        return context.engine in cls.COMPAT_ENGINES

    def draw(self, context):
        layout = self.layout
        column = layout.column()
        column.use_property_split = True
        column.use_property_decorate = False
        column.prop(context.scene.pharos, "compare_seconds")
        layout.operator("pharos.compare", icon="RENDER_RESULT")
        lines = layout.column(align=True)
        for line in _state.lines[:12]:
            lines.label(text=line)


_CLASSES = (PHAROS_OT_compare, PHAROS_RENDER_PT_compare)

register, unregister = bpy.utils.register_classes_factory(_CLASSES)
