"""The world: its node tree, and how it is sampled."""

from __future__ import annotations

from .nodes import flatten_world

_VISIBILITY = (
    ("camera", "VISIBLE_CAMERA"),
    ("diffuse", "VISIBLE_DIFFUSE"),
    ("glossy", "VISIBLE_GLOSSY"),
    ("transmission", "VISIBLE_TRANSMISSION"),
    ("shadow", "VISIBLE_SHADOW"),
)


def _visibility_bits(native, world) -> int:
    settings = getattr(world, "cycles_visibility", None)
    return sum(getattr(native, bit) for name, bit in _VISIBILITY if getattr(settings, name, True))


def export_world(context) -> None:
    world = context.scene.world
    if world is None or not context.view_layer.use_sky:
        return
    aovs = context.passes.aovs
    flat = flatten_world(context.native, context.images, context.report, world, aovs)
    cycles = getattr(world, "cycles", None)
    method = getattr(cycles, "sampling_method", "AUTOMATIC")
    manual = method == "MANUAL"
    if getattr(cycles, "max_bounces", 1024) < 1024:
        context.report.info(world.name, "Maximum bounces of a world are not used.", "WORLD")
    context.description.set_world(
        program=flat.program,
        map_resolution=getattr(cycles, "sample_map_resolution", 0) if manual else 0,
        use_mis=method != "NONE",
        visibility=_visibility_bits(context.native, world),
    )
