"""Walks node trees: through groups, reroutes and muted nodes to the output that feeds a socket."""

from __future__ import annotations

from typing import NamedTuple


class Scope(NamedTuple):
    """A tree and, for a group's tree, the group node and the scope that it stands in."""

    tree: object
    group: object | None = None
    parent: Scope | None = None

    @property
    def path(self) -> tuple:
        """Identifies the instance of a group."""
        return (*self.parent.path, self.group.name) if self.parent is not None else ()


class Source(NamedTuple):
    """An output socket of a node that computes something."""

    node: object
    socket: object
    scope: Scope


class Unlinked(NamedTuple):
    """The input socket whose own value counts."""

    socket: object
    scope: Scope


def input_by_identifier(node, identifier: str):
    return next((s for s in node.inputs if s.identifier == identifier), None)


def output_by_identifier(node, identifier: str):
    return next((s for s in node.outputs if s.identifier == identifier), None)


def _active_link(socket):
    for link in socket.links:
        if link.is_valid and not link.is_muted:
            return link
    return None


def _group_output(tree):
    outputs = [node for node in tree.nodes if node.bl_idname == "NodeGroupOutput"]
    return next(
        (node for node in outputs if node.is_active_output), outputs[0] if outputs else None
    )


def _muted_input(node, socket):
    """The input that a muted node passes on to `socket`."""
    for link in node.internal_links:
        if link.to_socket == socket:
            return link.from_socket
        if link.from_socket == socket:
            return link.to_socket
    return None


def _step(source: Source):
    """One step through a node that only passes on; None where the node computes."""
    node, socket, scope = source
    if node.mute:
        passed = _muted_input(node, socket)
        return Unlinked(socket, scope) if passed is None else Unlinked(passed, scope)
    if node.bl_idname == "NodeReroute":
        return Unlinked(node.inputs[0], scope)
    if node.bl_idname == "NodeGroupInput" and scope.parent is not None:
        outer = input_by_identifier(scope.group, socket.identifier)
        return Unlinked(outer, scope.parent) if outer is not None else Unlinked(socket, scope)
    if node.bl_idname == "ShaderNodeGroup" and node.node_tree is not None:
        output = _group_output(node.node_tree)
        inner = output and input_by_identifier(output, socket.identifier)
        if inner is None:
            return Unlinked(socket, scope)
        return Unlinked(inner, Scope(node.node_tree, node, scope))
    return None


def resolve(socket, scope: Scope) -> Source | Unlinked:
    """What feeds an input socket: a computing node's output, or the socket whose value counts."""
    for _ in range(10_000):  # a damaged file may hold a ring of links
        link = None if socket.is_output else _active_link(socket)
        if link is None:
            return Unlinked(socket, scope)
        source = Source(link.from_node, link.from_socket, scope)
        step = _step(source)
        if step is None:
            return source
        socket, scope = step
    return Unlinked(socket, scope)
