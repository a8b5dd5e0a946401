"""Flattens the node trees of materials and worlds into node programs.

Value nodes become operations, shader nodes closures with weights: Mix Shader multiplies its factor
into the weights of what it mixes. What is not known is named in the report; its output takes the
socket's own value.
"""

from __future__ import annotations

from typing import NamedTuple

from .. import compat
from .lamp_nodes import LampSpace
from .node_closures import CLOSURES
from .node_values import VALUES, bumped_normal, displaced_height
from .program import ProgramBuilder, Value
from .tree import Scope, Source, Unlinked, input_by_identifier, resolve

_SCALARS = {"VALUE", "INT", "BOOLEAN"}


class Flattened(NamedTuple):
    """A node program and what the meshes that use it must bring along."""

    program: object
    uses_uv: bool
    mesh_attributes: frozenset = frozenset()
    instance_attributes: frozenset = frozenset()


NO_BUMP_BESIDE_DISPLACEMENT = (
    "Displacement moves the vertices; what lies between them is not shown as bumps."
)


class Flattener:
    """One node tree on its way to a program: the context that node handlers work in."""

    def __init__(self, native, images, report, owner: str, kind: str = "MATERIAL"):
        self.native = native
        self.images = images
        self.report = report
        self.owner = owner
        self.kind = kind  # of the owner, as in report.KINDS
        self.is_world = kind == "WORLD"
        self.version = compat.version_number()
        self.material_index = 0
        self.tilts_normal = True  # whether displacement does, as bump mapping
        self.lamp = None  # LampSpace of a lamp's tree
        self.aovs: dict[tuple[str, bool], int] = {}  # passes by name and whether they are colours
        self.program = ProgramBuilder(native)
        self.image_values: dict[tuple, Value] = {}  # image nodes: colour and alpha at once
        self._values: dict[tuple, Value] = {}
        self._under_way: set[tuple] = set()

    def _place(self, node) -> tuple:
        tree = node.id_data
        return self.kind, "" if tree.is_embedded_data else tree.name, node.name

    def warn(self, message: str) -> None:
        self.report.warn(self.owner, message, self.kind)

    def inform(self, node, message: str) -> None:
        self.report.info(self.owner, message, *self._place(node))

    def unsupported(self, node, what: str = "") -> None:
        name = node.label or node.name
        message = f"Node {name!r} ({node.bl_label}){what and ': ' + what} is not supported."
        self.report.warn(self.owner, message, *self._place(node))

    # Inputs.

    def input(self, node, scope: Scope, identifier: str, size: int) -> Value:
        """An input as a scalar (size 1) or a colour or vector (size 3)."""
        socket = input_by_identifier(node, identifier)
        if socket is None:
            return self.program.constant(*([0.0] * size))
        return self._socket_value(resolve(socket, scope), size)

    def linked(self, node, scope: Scope, identifier: str) -> bool:
        socket = input_by_identifier(node, identifier)
        return socket is not None and isinstance(resolve(socket, scope), Source)

    def normal(self, node, scope: Scope, identifier: str = "Normal") -> Value:
        """A normal or tangent; the surface's own where nothing is linked."""
        if self.linked(node, scope, identifier):
            return self.input(node, scope, identifier, 3)
        return self.program.default_normal

    def _socket_value(self, origin: Source | Unlinked, size: int) -> Value:
        if isinstance(origin, Unlinked):
            value = self._default(origin.socket)
            is_color = origin.socket.type == "RGBA"
        else:
            value = self._output(origin)
            is_color = origin.socket.type == "RGBA"
        if size == 1:
            return self.program.to_scalar(value, is_color)
        return self.program.to_vector(value)

    def _default(self, socket) -> Value:
        value = getattr(socket, "default_value", 0.0)
        if socket.type in _SCALARS:
            return self.program.constant(value)
        if socket.type in {"RGBA", "VECTOR"}:
            return self.program.constant(*value[:3])
        return self.program.constant(0.0)

    # Values.

    def _output(self, source: Source) -> Value:
        node, socket, scope = source
        key = (scope.path, node.name, socket.identifier, self.program.step)
        if key in self._values:
            return self._values[key]
        if key in self._under_way:
            self.unsupported(node, "a ring of links")
            return self._default(socket)
        self._under_way.add(key)
        handler = VALUES.get(node.bl_idname)
        value = handler(self, node, scope, socket) if handler is not None else None
        self._under_way.discard(key)
        if value is None:
            self.unsupported(node, "" if handler is None else f"output {socket.name!r}")
            value = self._default(socket)
        self._values[key] = value
        return value

    # Closures.

    def shader(self, node, scope: Scope, identifier: str, weight: Value) -> None:
        """Append the closures behind a shader socket; `weight` is a scalar."""
        socket = input_by_identifier(node, identifier)
        if socket is not None and weight.known != (0.0,):
            self.closures(resolve(socket, scope), weight)

    def closures(self, origin: Source | Unlinked, weight: Value) -> None:
        if isinstance(origin, Unlinked):
            return
        node, socket, scope = origin
        if socket.type != "SHADER":
            # A colour where a shader is expected emits.
            color = self._socket_value(origin, 3)
            self.closure("Emission", weight, [color, self.program.constant(1.0)])
            return
        handler = CLOSURES.get(node.bl_idname)
        if handler is not None:
            handler(self, node, scope, weight)
            return
        self.unsupported(node)
        color = input_by_identifier(node, "Color") or input_by_identifier(node, "Base Color")
        if color is not None:
            value = self._socket_value(resolve(color, scope), 3)
            roughness = self.program.constant(0.0)
            self.closure("Diffuse", weight, [value, roughness, self.program.default_normal])

    def closure(self, code: str, weight: Value, operands, mode: int = 0) -> None:
        if weight.known != (0.0,):
            self.program.closure(code, [self.program.to_vector(weight), *operands], mode)

    def flatten(self, tree, surface: str = "Surface") -> Flattened:
        """The closures behind the tree's active output."""
        output = tree.get_output_node("CYCLES")
        if output is not None:
            scope = Scope(tree)
            if self.linked(output, scope, "Volume"):
                self.warn("Volume is not supported.")
            if self.linked(output, scope, "Displacement"):
                self._displace(resolve(input_by_identifier(output, "Displacement"), scope))
            self.shader(output, scope, surface, self.program.constant(1.0))
        if self.aovs:
            self._write_aovs(Scope(tree))
        return self.result()

    def _write_aovs(self, scope: Scope) -> None:
        """What AOV Output nodes, in groups too, give to passes that are asked for."""
        for node in scope.tree.nodes:
            if node.mute:
                continue
            if node.bl_idname == "ShaderNodeGroup" and node.node_tree is not None:
                self._write_aovs(Scope(node.node_tree, node, scope))
            if node.bl_idname != "ShaderNodeOutputAOV":
                continue
            for code, socket, size in (("AovColor", "Color", 3), ("AovValue", "Value", 1)):
                place = self.aovs.get((compat.aov_name(node), size == 3))
                if place is not None:
                    value = self.input(node, scope, socket, size)
                    self.program.closure(code, [value], place)

    def _displace(self, source: Source) -> None:
        """Displacement tilts the normal that all closures start from."""
        if source.node.bl_idname == "ShaderNodeVectorDisplacement" and not self.tilts_normal:
            return
        if displaced_height(self, source) is None:
            self.unsupported(source.node, "displacement by it")
            return
        if not self.tilts_normal:
            return
        one = self.program.constant(1.0)
        width = 1.0 if self.version < 400 else 0.1
        self.program.default_normal = bumped_normal(
            self,
            [one, one, self.program.default_normal],
            width,
            lambda: displaced_height(self, source),
        )

    def result(self) -> Flattened:
        program = self.program
        return Flattened(
            program.build(),
            program.uses_uv,
            frozenset(program.mesh_attributes),
            frozenset(program.instance_attributes),
        )


def flatten_material(native, images, report, material, aovs=()) -> Flattened:
    flattener = Flattener(native, images, report, material.name)
    flattener.aovs = dict(aovs)
    flattener.material_index = material.pass_index
    flattener.tilts_normal = compat.displacement_method(material) == "BUMP"
    if material.use_nodes and material.node_tree is not None:
        return flattener.flatten(material.node_tree)
    program = flattener.program
    flattener.closure(
        "Diffuse",
        program.constant(1.0),
        [
            program.constant(*material.diffuse_color[:3]),
            program.constant(0.0),
            program.default_normal,
        ],
    )
    return flattener.result()


def _vector_moved(f, node, scope):
    """The vector of a Vector Displacement node; None in tangent space."""
    if node.space == "TANGENT":
        f.unsupported(node, "displacement in tangent space")
        return None
    program = f.program
    middle = program.to_vector(f.input(node, scope, "Midlevel", 1))
    above = program.vector_math("Subtract", f.input(node, scope, "Vector", 3), middle)
    scale = program.to_vector(f.input(node, scope, "Scale", 1))
    return program.vector_math("Multiply", above, scale)


def flatten_displacement(native, images, report, material) -> Flattened | None:
    """How a material moves vertices; None where it does not."""
    moves = compat.displacement_method(material) != "BUMP"
    if not moves or not material.use_nodes or material.node_tree is None:
        return None
    output = material.node_tree.get_output_node("CYCLES")
    scope = Scope(material.node_tree)
    flattener = Flattener(native, images, report, material.name)
    if output is None or not flattener.linked(output, scope, "Displacement"):
        return None
    source = resolve(input_by_identifier(output, "Displacement"), scope)
    node = source.node
    if node.bl_idname == "ShaderNodeDisplacement":
        if flattener.linked(node, source.scope, "Normal"):
            flattener.unsupported(node, "a normal of its own")
        code, value = "AovValue", displaced_height(flattener, source)
    elif node.bl_idname == "ShaderNodeVectorDisplacement":
        code, value = "AovColor", _vector_moved(flattener, node, source.scope)
    else:
        return None  # flatten_material() names it
    if value is None:
        return None
    if compat.displacement_method(material) == "BOTH":
        flattener.warn(NO_BUMP_BESIDE_DISPLACEMENT)
    mode = native.DISPLACE_IN_WORLD if node.space == "WORLD" else 0
    flattener.program.closure(code, [value], mode)
    return flattener.result()


def flatten_light(native, images, report, light, matrix) -> Flattened:
    flattener = Flattener(native, images, report, light.name, "LIGHT")
    flattener.lamp = LampSpace(light, matrix)
    return flattener.flatten(light.node_tree)


def flatten_world(native, images, report, world, aovs=()) -> Flattened:
    flattener = Flattener(native, images, report, world.name, "WORLD")
    flattener.aovs = dict(aovs)
    if world.use_nodes and world.node_tree is not None:
        return flattener.flatten(world.node_tree)
    program = flattener.program
    flattener.closure(
        "Background",
        program.constant(1.0),
        [program.constant(*world.color[:3]), program.constant(1.0)],
    )
    return flattener.result()
