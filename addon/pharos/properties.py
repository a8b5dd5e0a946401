"""Settings of a scene: scene.pharos."""

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

_MAX_SEED = 2**31 - 1
_GUIDING_DEFAULT = "NEURAL"
_GUIDING_MODES = (
    ("NEURAL", "Neural", "A small network learns while it renders"),
    ("SLIDES", "Single Lobe", "One lobe a point, for comparison"),
)


class PharosReportEntry(bpy.types.PropertyGroup):
    """Something of this scene that is not rendered as given."""

    severity: EnumProperty(
        items=(
            ("INFO", "Info", "Good to know"),
            ("WARNING", "Warning", "The picture differs from what was asked for"),
            ("ERROR", "Error", "Data had to be mended or left out"),
        ),
        default="WARNING",
    )
    object: StringProperty(name="Name", description="What it is about")
    message: StringProperty(name="Message")
    kind: StringProperty(name="Kind", description="What the name is one of")
    tree: StringProperty(name="Group", description="The group that the node is in")
    node: StringProperty(name="Node")
    missing: BoolProperty(name="Missing", description="A file is not there or cannot be used")


class PharosEffortRow(bpy.types.PropertyGroup):
    """Something that makes the picture slow; its name is that of the object or light."""

    kind: EnumProperty(
        items=(
            ("OBJECT", "Object", "Where the camera sees it"),
            ("LIGHT", "Light", "What lights it"),
            ("WORLD", "World", "The world's light"),
        )
    )
    share: FloatProperty(
        name="Share",
        description="Of the effort of all objects, or of all lights",
        subtype="FACTOR",
        min=0.0,
        max=1.0,
    )


def _setting_changed(settings, _context) -> None:
    """Viewports follow a script as they follow the panel, which Blender tells them by itself."""
    settings.id_data.update_tag()


def _bounces(name: str, description: str, default: int = 12):
    return IntProperty(
        name=name,
        description=description,
        default=default,
        min=0,
        max=1024,
        update=_setting_changed,
    )


def _samples(name: str, description: str, default: int, least: int):
    return IntProperty(
        name=name,
        description=description,
        default=default,
        min=least,
        max=1 << 24,
        soft_max=65536,
        update=_setting_changed,
    )


def _pass_switch(name: str, description: str):
    return BoolProperty(name=name, description=description, default=False)


def _guiding_changed(settings, context) -> None:
    """The switch remembers how it was on."""
    _setting_changed(settings, context)
    if settings.guiding not in {"OFF", settings.guiding_mode}:
        settings.guiding_mode = settings.guiding


def _guiding_mode_changed(settings, _context) -> None:
    if settings.guiding not in {"OFF", settings.guiding_mode}:
        settings.guiding = settings.guiding_mode


def _switch_guiding(settings, on: bool) -> None:
    settings.guiding = settings.guiding_mode if on else "OFF"


class PharosSceneSettings(bpy.types.PropertyGroup):
    """How Pharos renders a scene."""

    samples: _samples("Samples", "Samples of each pixel in a final render", 128, 1)
    preview_samples: _samples(
        "Viewport Samples", "Samples of each pixel in the viewport; 0 goes on without end", 1024, 0
    )
    use_preview_denoising: BoolProperty(
        name="Denoise Viewport",
        description="Show the viewport's picture without its noise, by the library that comes with "
        "Blender. The samples stay as they are",
        default=False,
        update=_setting_changed,
    )
    seed: IntProperty(
        name="Seed",
        description="Another seed gives other noise; the same seed gives the same picture",
        default=0,
        min=0,
        max=_MAX_SEED,
        update=_setting_changed,
    )
    time_limit: FloatProperty(
        name="Time Limit",
        description="Stop after this many seconds of rendering; 0 renders all samples",
        default=0.0,
        min=0.0,
        step=100,
        subtype="TIME_ABSOLUTE",
        unit="TIME_ABSOLUTE",
    )
    use_nee: BoolProperty(
        name="Sample Lights",
        description="Send a ray to a light from every surface point. Without it, light is only "
        "found by chance",
        default=True,
        update=_setting_changed,
    )
    guiding: EnumProperty(
        name="Path Guiding",
        description="How the directions of light paths are led to where the light is",
        items=(("OFF", "Off", "Directions follow the materials alone"), *_GUIDING_MODES),
        default=_GUIDING_DEFAULT,
        update=_guiding_changed,
    )
    use_guiding: BoolProperty(
        name="Path Guiding",
        description="Learn where the light is while rendering and send paths there, wherever that "
        "gains. Scenes lit indirectly or through small openings come out clean much sooner",
        get=lambda settings: settings.guiding != "OFF",
        set=_switch_guiding,
    )
    guiding_mode: EnumProperty(
        name="Guide",
        description="What learns where the light is",
        items=_GUIDING_MODES,
        default="NEURAL",
        update=_guiding_mode_changed,
    )
    guide_memory: EnumProperty(
        name="Memory",
        description="What the network starts from. The noise of a picture depends on it, its light "
        "does not",
        items=(
            ("NONE", "None", "Every picture starts from nothing"),
            ("ANIMATION", "Animation", "Each frame of an animation starts from the one before"),
            (
                "FILE",
                "File",
                "Final renders start from what earlier ones have left in a file beside the .blend, "
                "on other machines too",
            ),
        ),
        default="ANIMATION",
    )
    max_bounces: _bounces("Total", "Most bounces of a light path; 0 is direct light only")
    diffuse_bounces: _bounces("Diffuse", "Most diffuse reflections")
    glossy_bounces: _bounces("Glossy", "Most glossy reflections")
    transmission_bounces: _bounces("Transmission", "Most bounces through a surface")
    transparent_bounces: _bounces(
        "Transparent", "Most transparent surfaces that a straight path crosses", 8
    )
    caustics_reflective: BoolProperty(
        name="Reflective Caustics",
        description="Glossy reflections after diffuse ones",
        default=True,
        update=_setting_changed,
    )
    caustics_refractive: BoolProperty(
        name="Refractive Caustics",
        description="Glossy transmission after diffuse reflections",
        default=True,
        update=_setting_changed,
    )
    pixel_filter: EnumProperty(
        name="Pixel Filter",
        description="Shape of the filter that joins samples to pixels",
        items=(
            ("BLACKMAN_HARRIS", "Blackman-Harris", "Smooth, without ringing"),
            ("GAUSSIAN", "Gaussian", "Soft"),
            ("BOX", "Box", "The pixel's own square"),
        ),
        default="BLACKMAN_HARRIS",
        update=_setting_changed,
    )
    filter_width: FloatProperty(
        name="Width",
        description="Width of the pixel filter",
        default=1.5,
        min=0.01,
        max=10.0,
        subtype="PIXEL",
        update=_setting_changed,
    )
    exposure: FloatProperty(
        name="Exposure",
        description="Brightness of the picture, before any view transform",
        default=1.0,
        min=0.0,
        soft_max=10.0,
        update=_setting_changed,
    )
    follow_cycles: BoolProperty(
        name="Follow Cycles",
        description="Take samples, seed, bounces and film from the scene's Cycles settings",
        default=False,
        update=_setting_changed,
    )
    use_checkpoint: BoolProperty(
        name="Checkpoints",
        description="Keep a final render beside its picture while it is under way. When Blender is "
        "stopped, rendering the frame again goes on where it was, to the same picture",
        default=False,
    )
    checkpoint_interval: FloatProperty(
        name="Interval",
        description="Minutes between two checkpoints; one more is written when a render is stopped",
        default=5.0,
        min=0.05,
        soft_max=60.0,
    )
    compare_seconds: FloatProperty(
        name="CPU Seconds",
        description="CPU time of each picture when Pharos is compared with Cycles, all threads "
        "together; about five times as much is spent in all",
        default=20.0,
        min=0.1,
        soft_max=600.0,
        step=100,
    )
    report: CollectionProperty(
        name="Report",
        description="What the last render could not take as given (read only)",
        type=PharosReportEntry,
    )
    slow: CollectionProperty(
        name="What Is Slow",
        description="Objects and lights that made the last picture with the pass of that name "
        "slow: variance times cost (read only)",
        type=PharosEffortRow,
    )
    report_row: IntProperty(name="Report Row", options={"HIDDEN", "SKIP_SAVE"})


class PharosViewLayerSettings(bpy.types.PropertyGroup):
    """Passes that Blender has no switches for."""

    use_pass_denoising: _pass_switch(
        "Denoising Data", "Deliver the normal and albedo passes that denoisers take"
    )
    use_pass_sample_count: _pass_switch(
        "Sample Count", "Deliver the number of samples of each pixel"
    )
    use_pass_effort: _pass_switch(
        "What Is Slow",
        "Deliver how much noise a pixel makes and what its samples cost, and list the objects and "
        "lights that make the picture slow",
    )
    use_pass_guide_direction: _pass_switch(
        "Direction", "Deliver the mean direction of the light that the guide has learned"
    )
    use_pass_guide_kappa: _pass_switch(
        "Kappa", "Deliver how concentrated the learned light is: 0 comes from everywhere alike"
    )
    use_pass_guide_irradiance: _pass_switch(
        "Irradiance", "Deliver A, the learned light of all directions together"
    )
    use_pass_guide_share: _pass_switch(
        "Share",
        "Deliver the share of directions that follows the guide; the rest, the BSDF's share, "
        "follows the material",
    )


_CLASSES = (PharosReportEntry, PharosEffortRow, PharosSceneSettings, PharosViewLayerSettings)


_register_classes, _unregister_classes = bpy.utils.register_classes_factory(_CLASSES)


def register():
    _register_classes()
    bpy.types.Scene.pharos = PointerProperty(name="Pharos", type=PharosSceneSettings)
    bpy.types.ViewLayer.pharos = PointerProperty(name="Pharos", type=PharosViewLayerSettings)


def unregister():
    del bpy.types.ViewLayer.pharos
    del bpy.types.Scene.pharos
    _unregister_classes()
