"""The whole export: one pass over a depsgraph, one description."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from .. import compat
from ..passes import PassRequest
from .camera import View
from .images import ImageTable
from .instances import InstanceExporter
from .materials import MaterialTable
from .report import Report
from .settings import film_fields, name_ignored_settings, render_settings
from .world import export_world


@dataclass
class ExportContext:
    """What the parts of an export share."""

    native: Any
    depsgraph: Any
    scene: Any
    view_layer: Any
    description: Any
    report: Report
    should_stop: Callable[[], bool]
    progress: Callable[[str], None]
    passes: PassRequest
    library: Any = None  # of a live session: what it holds is not handed over again
    images: Any = None
    materials: Any = None


def set_view(native, description, scene, view: View) -> None:
    """Camera and film; a view without a camera leaves the description without one."""
    description.set_film(**film_fields(native, scene, view.frame, view.crop))
    if view.fields is not None:
        description.set_camera(**view.fields)


def export_scene(
    native,
    depsgraph,
    report: Report,
    should_stop: Callable[[], bool] = lambda: False,
    progress: Callable[[str], None] = lambda name: None,
    passes: PassRequest | None = None,
    library=None,
):
    """A description of everything but the view. Raises instances.Cancelled."""
    scene, view_layer = depsgraph.scene_eval, depsgraph.view_layer_eval
    description = native.SceneDescription(compat.version_number())
    context = ExportContext(
        native,
        depsgraph,
        scene,
        view_layer,
        description,
        report,
        should_stop,
        progress,
        passes or PassRequest(),
        library,
    )
    context.images = ImageTable(native, description, report, scene.frame_current, library)
    context.materials = MaterialTable(context)
    context.passes.material_indices = context.materials.pass_indices
    description.set_settings(**render_settings(native, scene, view_layer))
    InstanceExporter(context).run()
    export_world(context)
    description.set_passes(**context.passes.fields(native, scene.world))
    name_ignored_settings(scene, report)
    return description
