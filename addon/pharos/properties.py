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


class PharosSceneSettings(bpy.types.PropertyGroup):
    """How Pharos renders a scene."""

    samples: IntProperty(
        name="Samples",
        description="Samples of each pixel in a final render",
        default=128,
        min=1,
        max=1 << 24,
        soft_max=65536,
    )
    preview_samples: IntProperty(
        name="Viewport Samples",
        description="Samples of each pixel in the viewport; 0 goes on without end",
        default=1024,
        min=0,
        max=1 << 24,
        soft_max=65536,
    )
    seed: IntProperty(
        name="Seed",
        description="Another seed gives other noise; the same seed gives the same picture",
        default=0,
        min=0,
        max=_MAX_SEED,
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
    )
    guiding: EnumProperty(
        name="Path Guiding",
        description="How the directions of light paths are led to where the light is",
        items=(
            ("OFF", "Off", "Directions follow the materials alone"),
            ("NEURAL", "Neural", "A small network learns while it renders"),
            ("SLIDES", "Single Lobe", "One lobe a point, for comparison"),
        ),
        default="OFF",
    )
    max_bounces: IntProperty(
        name="Total",
        description="Most bounces of a light path; 0 is direct light only",
        default=12,
        min=0,
        max=1024,
    )
    diffuse_bounces: IntProperty(
        name="Diffuse", description="Most diffuse reflections", default=12, min=0, max=1024
    )
    glossy_bounces: IntProperty(
        name="Glossy", description="Most glossy reflections", default=12, min=0, max=1024
    )
    transmission_bounces: IntProperty(
        name="Transmission",
        description="Most bounces through a surface",
        default=12,
        min=0,
        max=1024,
    )
    transparent_bounces: IntProperty(
        name="Transparent",
        description="Most transparent surfaces that a straight path crosses",
        default=8,
        min=0,
        max=1024,
    )
    caustics_reflective: BoolProperty(
        name="Reflective Caustics",
        description="Glossy reflections after diffuse ones",
        default=True,
    )
    caustics_refractive: BoolProperty(
        name="Refractive Caustics",
        description="Glossy transmission after diffuse reflections",
        default=True,
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
    )
    filter_width: FloatProperty(
        name="Width",
        description="Width of the pixel filter",
        default=1.5,
        min=0.01,
        max=10.0,
        subtype="PIXEL",
    )
    exposure: FloatProperty(
        name="Exposure",
        description="Brightness of the picture, before any view transform",
        default=1.0,
        min=0.0,
        soft_max=10.0,
    )
    follow_cycles: BoolProperty(
        name="Follow Cycles",
        description="Take samples, seed, bounces and film from the scene's Cycles settings",
        default=False,
    )
    report: CollectionProperty(
        name="Report",
        description="What the last render could not take as given (read only)",
        type=PharosReportEntry,
    )


class PharosViewLayerSettings(bpy.types.PropertyGroup):
    """Passes that Blender has no switches for."""

    use_pass_denoising: BoolProperty(
        name="Denoising Data",
        description="Deliver the normal and albedo passes that denoisers take",
        default=False,
    )
    use_pass_sample_count: BoolProperty(
        name="Sample Count",
        description="Deliver the number of samples of each pixel",
        default=False,
    )


_CLASSES = (PharosReportEntry, PharosSceneSettings, PharosViewLayerSettings)


def register():
    for cls in _CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Scene.pharos = PointerProperty(name="Pharos", type=PharosSceneSettings)
    bpy.types.ViewLayer.pharos = PointerProperty(name="Pharos", type=PharosViewLayerSettings)


def unregister():
    del bpy.types.ViewLayer.pharos
    del bpy.types.Scene.pharos
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
