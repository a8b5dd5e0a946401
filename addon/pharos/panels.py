"""Panels: our own, and Blender's usual ones that make sense with Pharos."""

import bpy

from . import compat, denoise, native

_ENGINE = "PHAROS"

# Blender's panels for its own engines that would show settings Pharos does not read.
_EXCLUDED = {
    "DATA_PT_area",
    "DATA_PT_camera_dof",
    "DATA_PT_falloff_curve",
    "DATA_PT_light",
    "DATA_PT_shadow",
    "DATA_PT_spot",
    "DATA_PT_sunsky",
    "MATERIAL_PT_diffuse",
    "MATERIAL_PT_flare",
    "MATERIAL_PT_halo",
    "MATERIAL_PT_mirror",
    "MATERIAL_PT_options",
    "MATERIAL_PT_pipeline",
    "MATERIAL_PT_preview",
    "MATERIAL_PT_shading",
    "MATERIAL_PT_shadow",
    "MATERIAL_PT_specular",
    "MATERIAL_PT_sss",
    "MATERIAL_PT_strand",
    "MATERIAL_PT_transp",
    "MATERIAL_PT_volume_density",
    "MATERIAL_PT_volume_integration",
    "MATERIAL_PT_volume_lighting",
    "MATERIAL_PT_volume_options",
    "MATERIAL_PT_volume_shading",
    "MATERIAL_PT_volume_transp",
    "RENDER_PT_freestyle",
    "RENDER_PT_gpencil",
    "RENDER_PT_simplify",
    "SCENE_PT_simplify",
    "TEXTURE_PT_envmap",
    "VIEWLAYER_PT_filter",
    "VIEWLAYER_PT_layer_passes",
    "VIEWLAYER_PT_freestyle",
    "VIEWLAYER_PT_freestyle_edge_detection",
    "VIEWLAYER_PT_freestyle_lineset",
    "VIEWLAYER_PT_freestyle_linestyle",
    "VIEWLAYER_PT_freestyle_style_modules",
    "WORLD_PT_ambient_occlusion",
    "WORLD_PT_environment_lighting",
    "WORLD_PT_gather",
    "WORLD_PT_indirect_lighting",
    "WORLD_PT_preview",
    "WORLD_PT_world",
}
# Panels of other engines that Pharos understands wholly.
_ADOPTED = {
    "DATA_PT_camera_dof",
    "DATA_PT_camera_dof_aperture",
    "DATA_PT_lens",
    "EEVEE_WORLD_PT_mist",
    "MATERIAL_PT_preview",
    "WORLD_PT_preview",
    "RENDER_PT_color_management",
}


class _PharosPanel:
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    COMPAT_ENGINES = {_ENGINE}
    owner_name = ""  # attribute of the context that has to be there

    @classmethod
    def poll(cls, context):
        if context.engine not in cls.COMPAT_ENGINES:
            return False
        return not cls.owner_name or getattr(context, cls.owner_name, None) is not None


class _RenderPanel(_PharosPanel):
    bl_context = "render"


def _settings_layout(panel):
    """A panel's layout as columns of names and values."""
    layout = panel.layout
    layout.use_property_split = True
    layout.use_property_decorate = False
    return layout


class PHAROS_RENDER_PT_problem(_RenderPanel, bpy.types.Panel):
    """Why nothing can be rendered."""

    bl_label = "Pharos cannot render"
    bl_order = 0

    @classmethod
    def poll(cls, context):
        return super().poll(context) and native.load().module is None

    def draw(self, context):
        column = self.layout.column(align=True)
        column.alert = True
        words = native.load().problem.split()
        line, icon = "", "ERROR"
        for word in [*words, None]:
            if word is None or len(line) + len(word) > 48:
                column.label(text=line, icon=icon)
                line, icon = "", "BLANK1"
            line = f"{line} {word}".strip()


class PHAROS_RENDER_PT_sampling(_RenderPanel, bpy.types.Panel):
    bl_label = "Sampling"

    def draw(self, context):
        layout = _settings_layout(self)
        settings = context.scene.pharos
        layout.prop(settings, "follow_cycles")
        own = layout.column()
        own.active = not settings.follow_cycles
        own.prop(settings, "samples")
        own.prop(settings, "preview_samples", text="Viewport")
        own.prop(settings, "seed")
        layout.prop(settings, "time_limit")
        layout.prop(settings, "use_guiding")
        problem = denoise.load().problem
        row = layout.row()
        row.enabled = not problem
        row.prop(settings, "use_preview_denoising")
        if problem:
            layout.label(text=problem, icon="INFO")


class PHAROS_RENDER_PT_advanced(_RenderPanel, bpy.types.Panel):
    bl_label = "Advanced"
    bl_parent_id = "PHAROS_RENDER_PT_sampling"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = _settings_layout(self)
        settings = context.scene.pharos
        mode = layout.column()
        mode.active = settings.use_guiding
        mode.prop(settings, "guiding_mode")
        mode.prop(settings, "guide_memory")
        layout.prop(settings, "use_nee")


class PHAROS_RENDER_PT_bounces(_RenderPanel, bpy.types.Panel):
    bl_label = "Light Paths"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = _settings_layout(self)
        settings = context.scene.pharos
        layout.active = not settings.follow_cycles
        column = layout.column(align=True)
        for name in ("max", "diffuse", "glossy", "transmission", "transparent"):
            column.prop(settings, f"{name}_bounces")
        column = layout.column(heading="Caustics", align=True)
        column.prop(settings, "caustics_reflective", text="Reflective")
        column.prop(settings, "caustics_refractive", text="Refractive")


class PHAROS_RENDER_PT_film(_RenderPanel, bpy.types.Panel):
    bl_label = "Film"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = _settings_layout(self)
        settings = context.scene.pharos
        own = layout.column()
        own.active = not settings.follow_cycles
        own.prop(settings, "exposure")
        own.prop(settings, "pixel_filter", text="Filter")
        if settings.pixel_filter != "BOX":
            own.prop(settings, "filter_width")
        layout.prop(context.scene.render, "film_transparent", text="Transparent")


class PHAROS_RENDER_PT_performance(_RenderPanel, bpy.types.Panel):
    bl_label = "Performance"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = _settings_layout(self)
        render = context.scene.render
        layout.prop(render, "threads_mode")
        if render.threads_mode == "FIXED":
            layout.prop(render, "threads")
        settings = context.scene.pharos
        layout.prop(settings, "use_checkpoint")
        interval = layout.column()
        interval.active = settings.use_checkpoint
        interval.prop(settings, "checkpoint_interval", text="Minutes Between")


class PHAROS_RENDER_PT_report(_RenderPanel, bpy.types.Panel):
    """What of this scene is not rendered as given."""

    bl_label = "Report"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = self.layout
        settings = context.scene.pharos
        if settings.report:
            layout.template_list("PHAROS_UL_report", "", settings, "report", settings, "report_row")
        else:
            layout.label(text="Everything is rendered as given.", icon="CHECKMARK")
        layout.operator("pharos.dump", icon="EXPORT")


class PHAROS_VIEW_LAYER_PT_passes(_PharosPanel, bpy.types.Panel):
    bl_label = "Passes"
    bl_context = "view_layer"
    _SWITCHES = (
        (
            "Data",
            (
                ("use_pass_z", "Depth"),
                ("use_pass_mist", "Mist"),
                ("use_pass_position", "Position"),
                ("use_pass_normal", "Normal"),
                ("use_pass_uv", "UV"),
            ),
        ),
        ("Indexes", (("use_pass_object_index", "Object"), ("use_pass_material_index", "Material"))),
        *(
            (
                lobe,
                tuple((f"use_pass_{lobe}_{p}".lower(), p) for p in ("Direct", "Indirect", "Color")),
            )
            for lobe in ("Diffuse", "Glossy", "Transmission")
        ),
        ("Other", (("use_pass_emit", "Emission"), ("use_pass_environment", "Environment"))),
    )

    def draw(self, context):
        layout = _settings_layout(self)
        view_layer = context.view_layer
        for heading, switches in self._SWITCHES:
            column = layout.column(heading=heading, align=True)
            for switch, text in switches:
                column.prop(view_layer, switch, text=text)
        column = layout.column(heading="Sampling", align=True)
        column.prop(view_layer.pharos, "use_pass_denoising")
        column.prop(view_layer.pharos, "use_pass_sample_count")
        column.prop(view_layer.pharos, "use_pass_effort")
        column = layout.column(heading="Path Guiding", align=True)
        for name in ("direction", "kappa", "irradiance", "share"):
            column.prop(view_layer.pharos, f"use_pass_guide_{name}")


class PHAROS_VIEW_LAYER_PT_slow(_PharosPanel, bpy.types.Panel):
    """Where the time of the last render went."""

    bl_label = "What Is Slow"
    bl_context = "view_layer"
    bl_parent_id = "PHAROS_VIEW_LAYER_PT_passes"
    _ICONS = {"OBJECT": "OBJECT_DATA", "LIGHT": "LIGHT", "WORLD": "WORLD"}
    _MOST_ROWS = 8  # of each kind

    @classmethod
    def poll(cls, context):
        return super().poll(context) and context.view_layer.pharos.use_pass_effort

    def draw(self, context):
        layout = self.layout
        rows = context.scene.pharos.slow
        if not rows:
            layout.label(text="Render to see what takes the time.", icon="INFO")
        for heading, kinds in (("Seen on", {"OBJECT"}), ("Lit by", {"LIGHT", "WORLD"})):
            column = layout.column(align=True)
            shown = [row for row in rows if row.kind in kinds][: self._MOST_ROWS]
            if shown:
                column.label(text=heading)
            for row in shown:
                line = column.split(factor=0.75)
                line.label(text=row.name, icon=self._ICONS[row.kind])
                line.label(text=f"{100.0 * row.share:.1f} %")


def draw_node_socket(layout, owner, output_type: str, socket: str) -> None:
    """The tree behind an output's socket, as a list of nested settings."""
    layout.use_property_split = True
    output = owner.node_tree.get_output_node("CYCLES")
    if output is None:
        layout.label(text=f"No {output_type} node")
    else:
        layout.template_node_view(owner.node_tree, output, output.inputs[socket])


class PHAROS_MATERIAL_PT_slots(_PharosPanel, bpy.types.Panel):
    bl_label = ""
    bl_context = "material"
    bl_options = {"HIDE_HEADER"}

    @classmethod
    def poll(cls, context):
        return super().poll(context) and (context.object or context.material)

    def draw(self, context):
        layout = self.layout
        obj, slot, space = context.object, context.material_slot, context.space_data
        if obj is None:
            layout.template_ID(space, "pin_id")
            return
        if len(obj.material_slots) > 0:
            row = layout.row()
            row.template_list(
                "MATERIAL_UL_matslots", "", obj, "material_slots", obj, "active_material_index"
            )
            column = row.column(align=True)
            column.operator("object.material_slot_add", icon="ADD", text="")
            column.operator("object.material_slot_remove", icon="REMOVE", text="")
        if obj.mode == "EDIT":
            row = layout.row(align=True)
            row.operator("object.material_slot_assign", text="Assign")
            row.operator("object.material_slot_select", text="Select")
            row.operator("object.material_slot_deselect", text="Deselect")
        row = layout.row()
        row.template_ID(obj, "active_material", new="material.new")
        if slot is not None:
            row.prop(slot, "link", text="")


class _TreePanel(_PharosPanel):
    """The node tree behind an output, or what stands for it without nodes."""

    bl_label = "Surface"
    output_type = ""
    plain = ("", {})  # property shown without nodes

    def draw(self, context):
        layout, owner = self.layout, getattr(context, self.owner_name)
        if not compat.always_uses_nodes(owner):
            layout.prop(owner, "use_nodes", icon="NODETREE")
            layout.separator()
        name, options = self.plain
        if owner.use_nodes:
            draw_node_socket(layout, owner, self.output_type, "Surface")
        elif name:
            layout.use_property_split = True
            layout.prop(owner, name, **options)


class PHAROS_MATERIAL_PT_surface(_TreePanel, bpy.types.Panel):
    bl_context = "material"
    owner_name, output_type = "material", "Material Output"
    plain = ("diffuse_color", {"text": "Base Color"})


class PHAROS_MATERIAL_PT_settings(_PharosPanel, bpy.types.Panel):
    bl_label = "Settings"
    bl_context = "material"
    bl_options = {"DEFAULT_CLOSED"}
    owner_name = "material"

    def draw(self, context):
        _settings_layout(self).prop(context.material, "pass_index")


class PHAROS_WORLD_PT_surface(_TreePanel, bpy.types.Panel):
    bl_context = "world"
    owner_name, output_type = "world", "World Output"
    plain = ("color", {})


class PHAROS_LIGHT_PT_light(_PharosPanel, bpy.types.Panel):
    bl_label = "Light"
    bl_context = "data"
    owner_name = "light"

    def draw(self, context):
        layout, light = self.layout, context.light
        layout.row().prop(light, "type", expand=True)
        layout.use_property_split = True
        column = layout.column()
        for name in ("color", "use_temperature", "temperature", "energy", "exposure"):
            if hasattr(light, name) and (name != "temperature" or light.use_temperature):
                column.prop(light, name)
        if hasattr(light, "normalize"):
            column.prop(light, "normalize")
        self._draw_shape(layout.column(), light)
        self._draw_flags(layout.column(), light)

    @staticmethod
    def _draw_shape(column, light):
        if light.type in {"POINT", "SPOT"}:
            if hasattr(light, "use_soft_falloff"):
                column.prop(light, "use_soft_falloff")
            column.prop(light, "shadow_soft_size", text="Radius")
        if light.type == "SPOT":
            column.prop(light, "spot_size", text="Spot Size")
            column.prop(light, "spot_blend", text="Blend", slider=True)
        if light.type == "SUN":
            column.prop(light, "angle")
        if light.type == "AREA":
            column.prop(light, "shape")
            two_sizes = light.shape in {"RECTANGLE", "ELLIPSE"}
            column.prop(light, "size", text="Size X" if two_sizes else "Size")
            if two_sizes:
                column.prop(light, "size_y", text="Y")
            column.prop(light, "spread")

    @staticmethod
    def _draw_flags(column, light):
        settings = getattr(light, "cycles", None)
        if hasattr(settings, "cast_shadow"):
            column.prop(settings, "cast_shadow")
        else:
            column.prop(light, "use_shadow", text="Cast Shadow")
        if hasattr(settings, "use_multiple_importance_sampling"):
            column.prop(settings, "use_multiple_importance_sampling", text="Multiple Importance")


class PHAROS_LIGHT_PT_nodes(_TreePanel, bpy.types.Panel):
    bl_label = "Nodes"
    bl_context = "data"
    owner_name, output_type = "light", "Light Output"


class PHAROS_OBJECT_PT_visibility(_PharosPanel, bpy.types.Panel):
    bl_label = "Ray Visibility"
    bl_context = "object"
    bl_options = {"DEFAULT_CLOSED"}
    owner_name = "object"

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        column = layout.column()
        for name in ("camera", "diffuse", "glossy", "transmission", "shadow"):
            column.prop(context.object, f"visible_{name}", text=name.capitalize())


_CLASSES = (
    PHAROS_RENDER_PT_problem,
    PHAROS_RENDER_PT_sampling,
    PHAROS_RENDER_PT_advanced,
    PHAROS_RENDER_PT_bounces,
    PHAROS_RENDER_PT_film,
    PHAROS_RENDER_PT_performance,
    PHAROS_RENDER_PT_report,
    PHAROS_VIEW_LAYER_PT_passes,
    PHAROS_VIEW_LAYER_PT_slow,
    PHAROS_MATERIAL_PT_slots,
    PHAROS_MATERIAL_PT_surface,
    PHAROS_MATERIAL_PT_settings,
    PHAROS_WORLD_PT_surface,
    PHAROS_LIGHT_PT_light,
    PHAROS_LIGHT_PT_nodes,
    PHAROS_OBJECT_PT_visibility,
)


def compatible_panels():
    """Panels of Blender that also show for Pharos."""
    for panel in bpy.types.Panel.__subclasses__():
        engines = getattr(panel, "COMPAT_ENGINES", None)
        if engines is None:
            continue
        name = panel.__name__
        usual = "BLENDER_RENDER" in engines and name not in _EXCLUDED
        if usual or name in _ADOPTED:
            yield panel


_register_classes, _unregister_classes = bpy.utils.register_classes_factory(_CLASSES)


def register():
    _register_classes()
    for panel in compatible_panels():
        panel.COMPAT_ENGINES.add(_ENGINE)


def unregister():
    for panel in compatible_panels():
        panel.COMPAT_ENGINES.discard(_ENGINE)
    _unregister_classes()
