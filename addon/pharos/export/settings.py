"""Samples, bounces and film: ours, or those of Cycles where the scene asks for that."""

from __future__ import annotations

_GUIDING = {"OFF": "Off", "NEURAL": "Neural", "SLIDES": "Slides"}
_FILTERS = {"BOX": "Box", "GAUSSIAN": "Gaussian", "BLACKMAN_HARRIS": "BlackmanHarris"}


def _followed_cycles(scene):
    return getattr(scene, "cycles", None) if scene.pharos.follow_cycles else None


def _layer_samples(scene, view_layer, cycles) -> int:
    override = view_layer.samples if cycles.use_layer_samples != "IGNORE" else 0
    return override or cycles.samples


def _cycles_settings(scene, view_layer, cycles) -> dict:
    animated = scene.frame_current if cycles.use_animated_seed else 0
    return {
        "samples": _layer_samples(scene, view_layer, cycles),
        "seed": (cycles.seed + animated) & 0xFFFFFFFF,
        "time_limit": scene.pharos.time_limit or cycles.time_limit,
        "max_bounces": cycles.max_bounces,
        "diffuse_bounces": cycles.diffuse_bounces,
        "glossy_bounces": cycles.glossy_bounces,
        "transmission_bounces": cycles.transmission_bounces,
        "transparent_bounces": cycles.transparent_max_bounces,
        "caustics_reflective": cycles.caustics_reflective,
        "caustics_refractive": cycles.caustics_refractive,
    }


def _own_settings(scene) -> dict:
    own = scene.pharos
    return {
        "samples": own.samples,
        "seed": own.seed,
        "time_limit": own.time_limit,
        "max_bounces": own.max_bounces,
        "diffuse_bounces": own.diffuse_bounces,
        "glossy_bounces": own.glossy_bounces,
        "transmission_bounces": own.transmission_bounces,
        "transparent_bounces": own.transparent_bounces,
        "caustics_reflective": own.caustics_reflective,
        "caustics_refractive": own.caustics_refractive,
    }


def render_settings(native, scene, view_layer) -> dict:
    """Arguments of set_settings for a final render."""
    cycles = _followed_cycles(scene)
    if cycles is None:
        fields = _own_settings(scene)
    else:
        fields = _cycles_settings(scene, view_layer, cycles)
    fields["use_nee"] = scene.pharos.use_nee
    fields["guiding"] = getattr(native.GuidingMode, _GUIDING[scene.pharos.guiding])
    return fields


def viewport_samples(scene) -> int:
    """0 means without end."""
    cycles = _followed_cycles(scene)
    samples = scene.pharos.preview_samples if cycles is None else cycles.preview_samples
    return samples or 1 << 20


def film_fields(native, scene, frame, crop) -> dict:
    """Arguments of set_film."""
    cycles = _followed_cycles(scene)
    own = scene.pharos
    name = own.pixel_filter if cycles is None else cycles.pixel_filter_type
    return {
        "width": frame.width,
        "height": frame.height,
        "crop_x": crop.x,
        "crop_y": crop.y,
        "crop_width": crop.width,
        "crop_height": crop.height,
        "filter": getattr(native.PixelFilter, _FILTERS[name]),
        "filter_width": own.filter_width if cycles is None else cycles.filter_width,
        "exposure": own.exposure if cycles is None else cycles.film_exposure,
        "transparent": scene.render.film_transparent,
    }


def name_ignored_settings(scene, report) -> None:
    """Settings that change a picture in Cycles and do nothing here."""
    if scene.render.use_motion_blur:
        report.warn(scene.name, "Motion blur is not supported.", "SCENE")
    if scene.render.use_freestyle:
        report.warn(scene.name, "Freestyle is not supported.", "SCENE")
    name_light_linking(scene, report)
    cycles = _followed_cycles(scene)
    if cycles is None:
        return
    if cycles.use_denoising:
        report.info(scene.name, "The picture is not denoised.", "SCENE")
    if cycles.sample_clamp_direct > 0.0 or cycles.sample_clamp_indirect > 0.0:
        report.info(scene.name, "Clamping of samples is not used.", "SCENE")
    if cycles.use_fast_gi:
        report.warn(scene.name, "Fast GI approximation is not supported.", "SCENE")
    if scene.render.film_transparent and cycles.film_transparent_glass:
        report.warn(scene.name, "Transparent glass is not supported.", "SCENE")
    if cycles.blur_glossy > 0.0:
        report.info(scene.name, "Filter glossy is not used.", "SCENE")
    if cycles.min_light_bounces > 0:
        report.info(scene.name, "Minimum bounces are not used.", "SCENE")
    if scene.render.use_simplify and (cycles.use_camera_cull or cycles.use_distance_cull):
        report.info(scene.name, "Culling of objects is not used.", "SCENE")
    if scene.render.use_simplify and cycles.texture_limit_render != "OFF":
        report.info(scene.name, "Textures keep their size.", "SCENE")


def name_light_linking(scene, report) -> None:
    """Lights that should shine on some objects only, or throw no shadow of some (since 4.0)."""
    for obj in scene.objects:
        linking = getattr(obj, "light_linking", None)
        if linking is None:
            return
        if linking.receiver_collection is not None or linking.blocker_collection is not None:
            report.warn(obj.name, "Light linking is not supported.", "OBJECT")
