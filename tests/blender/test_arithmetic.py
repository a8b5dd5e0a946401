"""Arithmetic and colour nodes against Cycles of the same host: every mode, random inputs with
negative, zero and large ones.
"""
# hosts: blender bpy

import harness
from node_sheet import Case, check, place

_NEW = harness.VERSION >= (4, 0, 0)


def _modes(kind: str, field: str) -> list[str]:
    node = harness.node(harness.material(), kind)
    return [item.identifier for item in node.bl_rna.properties[field].enum_items]


def _feed(owner, node, names=None) -> None:
    """Inputs of a node from the pixel's numbers: vectors as they come, numbers each another one."""
    vector, w = place(owner)
    split = harness.node(owner, "ShaderNodeSeparateXYZ")
    harness.connect(owner, vector, split.inputs[0])
    numbers = [split.outputs[0], split.outputs[1], split.outputs[2], w]
    turned = harness.node(owner, "ShaderNodeCombineXYZ")
    for i, source in enumerate((numbers[3], numbers[2], numbers[0])):
        harness.connect(owner, source, turned.inputs[i])
    vectors = [vector, turned.outputs[0]]
    for socket in node.inputs:
        if not socket.enabled or (names is not None and socket.identifier not in names):
            continue
        pool = numbers if socket.type == "VALUE" else vectors
        harness.connect(owner, pool[0], socket)
        pool.append(pool.pop(0))


def _case(kind: str, fields=None, output: int = 0, inputs: str = "NEAR", names=None, values=None):
    fields = fields or {}

    def build(owner):
        node = harness.node(owner, kind)
        for field, value in fields.items():
            setattr(node, field, value)
        _feed(owner, node, names)
        for socket in node.inputs:
            if values is not None and socket.identifier in values:
                socket.default_value = values[socket.identifier]
        enabled = [socket for socket in node.outputs if socket.enabled]
        return enabled[output]

    name = " ".join(str(value) for value in (kind[10:], *fields.values(), output, inputs))
    return Case(name, build, inputs)


def test_math():
    cases = []
    for operation in _modes("ShaderNodeMath", "operation"):
        for clamp in (False, True):
            fields = {"operation": operation, "use_clamp": clamp}
            cases.append(_case("ShaderNodeMath", fields))
        cases.append(_case("ShaderNodeMath", {"operation": operation}, 0, "UNIT"))
    check(cases)


def test_vector_math():
    cases = []
    for operation in _modes("ShaderNodeVectorMath", "operation"):
        kind, fields = "ShaderNodeVectorMath", {"operation": operation}
        cases += [_case(kind, fields, 0, inputs) for inputs in ("NEAR", "UNIT")]
    check(cases)


def test_mix():
    cases = []
    for blend in _modes("ShaderNodeMixRGB", "blend_type"):
        for clamp in (False, True):
            for inputs in ("NEAR", "UNIT"):
                fields = {"blend_type": blend, "use_clamp": clamp}
                cases.append(_case("ShaderNodeMixRGB", fields, 0, inputs))
                fields = {"data_type": "RGBA", "blend_type": blend, "clamp_result": clamp}
                cases.append(_case("ShaderNodeMix", fields, 0, inputs))
    for kind in ("FLOAT", "VECTOR"):
        for clamp in (False, True):
            fields = {"data_type": kind, "clamp_factor": clamp}
            cases.append(_case("ShaderNodeMix", fields))
            if kind == "VECTOR":
                cases.append(_case("ShaderNodeMix", fields | {"factor_mode": "NON_UNIFORM"}))
    check(cases)


def test_normal():
    def build(output):
        def make(owner):
            node = harness.node(owner, "ShaderNodeNormal")
            node.outputs[0].default_value = (0.6, -0.48, 0.64)
            _feed(owner, node)
            return node.outputs[output]

        return make

    check([Case(f"normal {output}", build(output)) for output in (0, 1)])


def test_map_range_and_clamp():
    cases = []
    for interpolation in _modes("ShaderNodeMapRange", "interpolation_type"):
        for data in ("FLOAT", "FLOAT_VECTOR"):
            for clamp in (False, True):
                fields = {"data_type": data, "interpolation_type": interpolation, "clamp": clamp}
                cases.append(_case("ShaderNodeMapRange", fields))
    cases += [_case("ShaderNodeClamp", {"clamp_type": kind}) for kind in ("MINMAX", "RANGE")]
    check(cases)


def test_vectors():
    cases = []
    for kind in _modes("ShaderNodeMapping", "vector_type"):
        values = {"Location": (0.3, -0.2, 0.7), "Rotation": (0.4, 1.2, -2.0)}
        values["Scale"] = (1.5, -0.5, 2.0)
        fields = {"vector_type": kind}
        cases.append(_case("ShaderNodeMapping", fields, names={"Vector"}, values=values))
    for kind in _modes("ShaderNodeVectorRotate", "rotation_type"):
        for invert in (False, True):
            fields = {"rotation_type": kind, "invert": invert}
            cases.append(_case("ShaderNodeVectorRotate", fields))
    check(cases)


def test_colors():
    cases = []
    for mode in _modes("ShaderNodeSeparateColor", "mode"):
        for output in range(3):
            kind, fields = "ShaderNodeSeparateColor", {"mode": mode}
            cases += [_case(kind, fields, output, inputs) for inputs in ("NEAR", "UNIT")]
        cases.append(_case("ShaderNodeCombineColor", {"mode": mode}, 0, "UNIT"))
    for kind in ("Invert", "Gamma", "BrightContrast", "HueSaturation", "RGBToBW"):
        # 3.x has no rule for hues below zero.
        near = _NEW or kind != "HueSaturation"
        ranges = ("NEAR", "UNIT") if near else ("UNIT",)
        cases += [_case(f"ShaderNode{kind}", {}, 0, inputs) for inputs in ranges]
    check(cases)


def _scaled(kind: str, factor: float, offset: float):
    """A node fed with one number over a wide range."""

    def build(owner):
        _, w = place(owner)
        scale = harness.node(owner, "ShaderNodeMath")
        scale.operation = "MULTIPLY_ADD"
        scale.inputs[1].default_value, scale.inputs[2].default_value = factor, offset
        harness.connect(owner, w, scale.inputs[0])
        node = harness.node(owner, kind)
        harness.connect(owner, scale.outputs[0], node.inputs[0])
        return node.outputs[0]

    return Case(f"{kind} {factor}", build)


def test_blackbody():
    """From below zero to far beyond the hottest that is told apart."""
    ranges = ((1000.0, 1500.0), (1000.0, 7000.0), (5000.0, 10000.0))
    check([_scaled("ShaderNodeBlackbody", *values) for values in ranges])


def _ramp(interpolation: str, mode: str = "RGB"):
    def build(owner):
        _, w = place(owner)
        node = harness.node(owner, "ShaderNodeValToRGB")
        ramp = node.color_ramp
        ramp.color_mode, ramp.interpolation = mode, interpolation
        middle = ramp.elements.new(0.4)
        middle.color = (0.9, 0.2, 0.1, 0.5)
        ramp.elements[0].position = 0.1
        harness.connect(owner, w, node.inputs[0])
        return node.outputs[0]

    return Case(f"ramp {mode} {interpolation}", build, "UNIT")


def test_ramps():
    kinds = ("LINEAR", "CONSTANT", "EASE", "CARDINAL", "B_SPLINE")
    cases = [_ramp(kind) for kind in kinds]
    cases += [_ramp("LINEAR", "HSV"), _ramp("LINEAR", "HSL")]
    check(cases)


def _curve(kind: str, clip: bool):
    def build(owner):
        node = harness.node(owner, kind)
        mapping = node.mapping
        for i, curve in enumerate(mapping.curves):
            curve.points.new(0.4, 0.2 + 0.15 * i)
        mapping.use_clip = clip
        mapping.update()
        _feed(owner, node, {"Color", "Vector", "Value"})
        return node.outputs[0]

    return Case(f"{kind} {clip}", build, "UNIT")


def test_curves():
    kinds = ["ShaderNodeRGBCurve", "ShaderNodeVectorCurve", "ShaderNodeFloatCurve"]
    check([_curve(kind, clip) for kind in kinds for clip in (True, False)])


harness.main(globals())
