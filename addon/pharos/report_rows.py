"""Rows of the report: a click shows what a row is about, an object or a node of its tree."""

from __future__ import annotations

import bpy
from bpy.props import IntProperty

_ICONS = {"INFO": "INFO", "WARNING": "ERROR", "ERROR": "CANCEL"}
_COLLECTIONS = {
    "OBJECT": "objects",
    "MESH": "meshes",
    "MATERIAL": "materials",
    "IMAGE": "images",
    "LIGHT": "lights",
    "WORLD": "worlds",
}
_OF_SETTINGS = {"SCENE", "VIEW_LAYER"}


def _owner(entry):
    """The kind and the thing that an entry names; the first of that name where no kind is known."""
    for kind, collection in _COLLECTIONS.items():
        if entry.kind in {kind, ""}:
            found = getattr(bpy.data, collection).get(entry.object)
            if found is not None:
                return kind, found
    return "", None


# Objects.


def _slot_of(obj, material) -> int:
    """The slot that holds a material; -1 without."""
    slots = getattr(obj, "material_slots", ())
    return next((i for i, slot in enumerate(slots) if slot.material == material), -1)


def _users(context, kind: str, owner) -> list:
    """Objects of the view layer that show an object, mesh, lamp or material."""
    objects = context.view_layer.objects
    if kind == "OBJECT":
        return [obj for obj in objects if obj == owner]
    if kind == "MATERIAL":
        return [obj for obj in objects if _slot_of(obj, owner) >= 0]
    return [obj for obj in objects if obj.data == owner]


def _select_object(context, obj) -> None:
    for other in context.view_layer.objects:
        other.select_set(False)
    obj.select_set(True)
    context.view_layer.objects.active = obj


# Nodes.


def _groups_to(tree, name: str, visited: set) -> list | None:
    """The group nodes that lead from a tree to the group of that name; None: it is not in there."""
    if not name:
        return []
    for node in tree.nodes:
        inner = getattr(node, "node_tree", None)
        if inner is None or inner.name in visited:
            continue
        visited.add(inner.name)
        rest = [] if inner.name == name else _groups_to(inner, name, visited)
        if rest is not None:
            return [node, *rest]
    return None


def _activate(tree, node) -> None:
    for other in tree.nodes:
        other.select = False
    node.select = True
    tree.nodes.active = node


def _select_node(owner, tree_name: str, node_name: str) -> list | None:
    """Select a node, and the groups on the way to it; these are returned, None without the node."""
    tree = owner.node_tree
    groups = None if tree is None else _groups_to(tree, tree_name, set())
    if groups is None:
        return None
    for group in groups:
        _activate(tree, group)
        tree = group.node_tree
    node = tree.nodes.get(node_name)
    if node is None:
        return None
    _activate(tree, node)
    return groups


def _show_node(context, owner, groups: list) -> None:
    """In the node editors that are open: the owner's tree, down to the group."""
    is_world = isinstance(owner, bpy.types.World)
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            space = area.spaces.active
            if area.type != "NODE_EDITOR" or space.tree_type != "ShaderNodeTree" or space.pin:
                continue
            space.shader_type = "WORLD" if is_world else "OBJECT"
            if space.id == owner:
                space.path.start(owner.node_tree)
                for group in groups:
                    space.path.append(group.node_tree, node=group)
            area.tag_redraw()


def _image_user(image):
    """A tree's owner and a node that reads an image."""
    for collection in (bpy.data.materials, bpy.data.worlds, bpy.data.lights):
        for owner in collection:
            trees = [(owner.node_tree, "")] if owner.node_tree is not None else []
            trees += [(group, group.name) for group in bpy.data.node_groups]
            for tree, name in trees:
                for node in tree.nodes:
                    if getattr(node, "image", None) != image:
                        continue
                    if _groups_to(owner.node_tree, name, set()) is not None:
                        return owner, name, node.name
    return None


def select_entry(context, entry) -> bool:
    """Select what an entry of the report is about; False where it is not there any more."""
    kind, owner = _owner(entry)
    tree, node = entry.tree, entry.node
    if kind == "IMAGE":
        user = _image_user(owner)
        if user is None:
            return False
        owner, tree, node = user
        kind = {bpy.types.Material: "MATERIAL", bpy.types.World: "WORLD"}.get(type(owner), "LIGHT")
    if owner is None:
        return False
    users = _users(context, kind, owner) if kind != "WORLD" else []
    active = context.view_layer.objects.active
    if users:
        # The one at hand, where several would do.
        obj = active if active in users else users[0]
        _select_object(context, obj)
        if kind == "MATERIAL":
            obj.active_material_index = _slot_of(obj, owner)
    groups = None
    if node:
        groups = _select_node(owner, tree, node)
        if groups is not None:
            _show_node(context, owner, groups)
    return bool(users) or groups is not None or kind == "WORLD"


class PHAROS_OT_select_reported(bpy.types.Operator):
    """Select the object or the node that this is about"""

    bl_idname = "pharos.select_reported"
    bl_label = "Select What Is Reported"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}

    index: IntProperty(options={"HIDDEN"})

    def execute(self, context):
        report = context.scene.pharos.report
        if not 0 <= self.index < len(report):
            return {"CANCELLED"}
        entry = report[self.index]
        if not select_entry(context, entry):
            self.report({"INFO"}, f"{entry.object!r} is not in this view layer.")
            return {"CANCELLED"}
        context.scene.pharos.report_row = self.index
        return {"FINISHED"}


class PHAROS_UL_report(bpy.types.UIList):
    """One row an entry; what can be selected is a button."""

    def draw_item(self, context, layout, data, item, icon, active_data, active_property, index):
        text = f"{item.object}: {item.message}"
        if item.kind in _OF_SETTINGS:
            layout.label(text=text, icon=_ICONS[item.severity])
            return
        row = layout.row()
        row.alignment = "LEFT"
        select = row.operator(
            PHAROS_OT_select_reported.bl_idname,
            text=text,
            icon=_ICONS[item.severity],
            emboss=False,
        )
        select.index = index

    def draw_filter(self, context, layout):
        layout.row(align=True).prop(self, "filter_name", text="")

    def filter_items(self, context, data, property_name):
        words = self.filter_name.lower()
        shown = self.bitflag_filter_item
        return [
            shown if words in f"{entry.object}: {entry.message}".lower() else 0
            for entry in getattr(data, property_name)
        ], []


_CLASSES = (PHAROS_OT_select_reported, PHAROS_UL_report)

register, unregister = bpy.utils.register_classes_factory(_CLASSES)
