"""Parts of the add-on's export that need neither Blender nor the native module."""

from __future__ import annotations

import importlib
import sys
import types
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

ADDON = Path(__file__).resolve().parents[2] / "addon" / "pharos"


@pytest.fixture(autouse=True)
def _package(monkeypatch):
    """The package without its __init__, which needs Blender."""
    package = types.ModuleType("pharos")
    package.__path__ = [str(ADDON)]
    for name in [name for name in sys.modules if name.split(".")[0] == "pharos"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "pharos", package)


def part(name: str):
    return importlib.import_module(f"pharos.{name}")


class Numbers(dict):
    """Numbers for any name, as the native enumerations have."""

    def __missing__(self, name):
        self[name] = len(self)
        return self[name]


def fake_native():
    tables = ("NodeOpCode", "MathMode", "VectorMathMode", "CoordinateOutput", "GeometryOutput")
    return SimpleNamespace(
        CLAMP_BIT=0x8000,
        DEFAULT_OPERAND=-(2**31),
        DEFAULT_NAME=0xFFFF,
        ImageUse=lambda **fields: fields,
        NodeProgram=lambda **fields: SimpleNamespace(**fields),
        **{name: Numbers() for name in tables},
    )


# Cameras.


@pytest.mark.parametrize(
    ("fit", "width", "height", "expected"),
    [
        ("AUTO", 200, 100, True),
        ("AUTO", 100, 200, False),
        ("HORIZONTAL", 100, 200, True),
        ("VERTICAL", 200, 100, False),
    ],
)
def test_fitted_axis(fit, width, height, expected):
    camera = part("export.camera")
    assert camera.fits_horizontally(fit, camera.Frame(width, height)) is expected


def test_window_of_a_plain_camera():
    camera = part("export.camera")
    window = camera.image_window(0.36, True, camera.Frame(200, 100), (0.0, 0.0))
    assert window.lower == pytest.approx((-0.36, -0.18))
    assert window.upper == pytest.approx((0.36, 0.18))


def test_shift_is_in_units_of_the_fitted_axis():
    camera = part("export.camera")
    frame = camera.Frame(100, 200)
    plain = camera.image_window(0.5, False, frame, (0.0, 0.0))
    moved = camera.image_window(0.5, False, frame, (0.1, -0.2))
    assert np.subtract(moved.lower, plain.lower) == pytest.approx((0.1, -0.2))
    assert np.subtract(moved.upper, plain.upper) == pytest.approx((0.1, -0.2))


def test_pixel_aspect_widens():
    camera = part("export.camera")
    window = camera.image_window(1.0, True, camera.Frame(100, 100, 1.0, 2.0), (0.0, 0.0))
    assert window.upper == pytest.approx((1.0, 2.0))


@pytest.mark.parametrize("perspective", [True, False])
def test_window_behind_a_projection(perspective):
    """A projection made of a window gives the window back."""
    camera = part("export.camera")
    left, right, bottom, top = -0.3, 0.5, -0.2, 0.4
    p = np.zeros((4, 4))
    p[0, 0], p[1, 1] = 2 / (right - left), 2 / (top - bottom)
    offset = ((right + left) / (right - left), (top + bottom) / (top - bottom))
    if perspective:
        p[:2, 2], p[3, 2] = offset, -1.0
    else:
        p[:2, 3], p[3, 3] = (-offset[0], -offset[1]), 1.0
    window = camera.projected_window(p)
    assert window.lower == pytest.approx((left, bottom))
    assert window.upper == pytest.approx((right, top))


def test_rigid_removes_scale_and_survives_zero():
    camera = part("export.camera")
    matrix = np.diag([2.0, 0.0, -3.0, 1.0])
    matrix[:3, 3] = (1, 2, 3)
    out = camera.rigid(matrix)
    assert np.allclose(np.linalg.norm(out[:3, :3], axis=0), 1.0)
    assert out[:3, 3].tolist() == [1, 2, 3] and out[2, 2] == -1.0


@pytest.mark.parametrize(
    ("border", "expected"),
    [
        ((0.0, 1.0, 0.0, 1.0), (0, 0, 100, 50)),
        ((0.25, 0.755, 0.5, 1.0), (25, 25, 50, 25)),
        ((0.5, 0.5, 0.5, 0.5), (50, 25, 1, 1)),
    ],
)
def test_border(border, expected):
    camera = part("export.camera")
    assert tuple(camera.border_crop(camera.Frame(100, 50), border)) == expected


# Programs.


def test_constants_are_shared_and_encoded():
    builder = part("export.program").ProgramBuilder(fake_native())
    a, b, again = builder.constant(1.0), builder.constant(1.0, 2.0, 3.0), builder.constant(1.0)
    assert (a.operand, b.operand, again.operand) == (~0, ~1, ~0)
    assert builder.component(b, 2).known == (3.0,)
    assert builder.build().constants[:4] == [1.0, 1.0, 2.0, 3.0]


def test_equal_operations_are_done_once():
    builder = part("export.program").ProgramBuilder(fake_native())
    x = builder.op("Uv", [], 3, 1)
    assert builder.op("Uv", [], 3, 1) == x and builder.op("Uv", [], 3, 2) != x
    program = builder.build()
    assert program.register_count == 6 and [op[2] for op in program.ops] == [0, 3]


def test_conversions_of_constants_need_no_operation():
    builder = part("export.program").ProgramBuilder(fake_native())
    color = builder.constant(1.0, 0.5, 0.25)
    luminance = builder.to_scalar(color, is_color=True).known[0]
    assert luminance == pytest.approx(0.2126 + 0.7152 * 0.5 + 0.0722 * 0.25)
    assert builder.to_scalar(color, is_color=False).known[0] == pytest.approx(1.75 / 3)
    assert builder.to_vector(builder.constant(2.0)).known == (2.0, 2.0, 2.0)
    assert builder.build().ops == []


def test_products_of_weights_fold():
    builder = part("export.program").ProgramBuilder(fake_native())
    one, zero, half = (builder.constant(v) for v in (1.0, 0.0, 0.5))
    x = builder.op("Fresnel", [], 1)
    assert builder.product(one, x) == x and builder.product(x, one) == x
    assert builder.product(zero, x).known == (0.0,)
    assert builder.product(half, half).known == (0.25,)
    assert builder.clamped(builder.constant(7.0)).known == (1.0,)
    assert builder.complement(half).known == (0.5,)
    assert builder.product(half, x).known is None


def test_uv_is_asked_for_only_where_read():
    native = fake_native()
    builder = part("export.program").ProgramBuilder(native)
    builder.op("Geometry", [], 3, native.GeometryOutput["Position"])
    assert not builder.uses_uv
    builder.op("Coordinate", [], 3, native.CoordinateOutput["Uv"])
    assert builder.uses_uv


# Trees.


def socket(identifier: str, *, output: bool = False, kind: str = "RGBA"):
    return SimpleNamespace(identifier=identifier, is_output=output, links=[], type=kind)


def node(kind: str, inputs=(), outputs=(), **fields):
    made = SimpleNamespace(
        bl_idname=kind,
        name=f"{kind}{len(inputs)}",
        inputs=[socket(name) for name in inputs],
        outputs=[socket(name, output=True) for name in outputs],
        mute=False,
        internal_links=[],
        node_tree=None,
    )
    made.__dict__.update(fields)
    return made


def join(source, place: int, target, target_place: int = 0, **state) -> None:
    link = SimpleNamespace(
        from_node=source,
        from_socket=source.outputs[place],
        is_valid=state.get("valid", True),
        is_muted=state.get("muted", False),
    )
    target.inputs[target_place].links.append(link)


def test_reroutes_are_passed():
    tree = part("export.tree")
    source, reroute = node("ShaderNodeRGB", (), ("Color",)), node("NodeReroute", ("In",), ("Out",))
    target = node("ShaderNodeBsdfDiffuse", ("Color",))
    join(source, 0, reroute)
    join(reroute, 0, target)
    found = tree.resolve(target.inputs[0], tree.Scope(None))
    assert found.node is source


def test_muted_and_invalid_links_do_not_count():
    tree = part("export.tree")
    source = node("ShaderNodeRGB", (), ("Color",))
    for state in ({"muted": True}, {"valid": False}):
        target = node("ShaderNodeBsdfDiffuse", ("Color",))
        join(source, 0, target, **state)
        found = tree.resolve(target.inputs[0], tree.Scope(None))
        assert isinstance(found, tree.Unlinked) and found.socket is target.inputs[0]


def test_a_ring_of_reroutes_ends():
    tree = part("export.tree")
    a, b = (node("NodeReroute", ("In",), ("Out",)) for _ in range(2))
    join(a, 0, b)
    join(b, 0, a)
    assert isinstance(tree.resolve(a.inputs[0], tree.Scope(None)), tree.Unlinked)


def test_groups_are_entered_and_left():
    tree = part("export.tree")
    entry = node("NodeGroupInput", (), ("Shade",))
    leave = node("NodeGroupOutput", ("Result",), is_active_output=True)
    join(entry, 0, leave)
    group = node("ShaderNodeGroup", ("Shade",), ("Result",))
    group.node_tree = SimpleNamespace(nodes=[entry, leave])
    source, target = node("ShaderNodeRGB", (), ("Color",)), node("Diffuse", ("Color",))
    join(source, 0, group)
    join(group, 0, target)
    assert tree.resolve(target.inputs[0], tree.Scope(None)).node is source


# Reports.


def test_report_says_everything_once():
    report = part("export.report").Report()
    for _ in range(2):
        report.warn("Cube", "odd")
    report.info("Cube", "odd", "OBJECT")
    report.add("WARNING", "Photo", "not there", missing=True)
    assert [tuple(entry) for entry in report.entries] == [
        ("WARNING", "Cube", "odd", "", "", "", False),
        ("INFO", "Cube", "odd", "OBJECT", "", "", False),
        ("WARNING", "Photo", "not there", "", "", "", True),
    ]


# Node tables.


def test_principled_tables_have_the_native_length():
    closures = part("export.node_closures")
    header = (ADDON.parents[1] / "native/materials/node_program.h").read_text(encoding="utf-8")
    for table, name in ((closures._PRINCIPLED_V1, "V1"), (closures._PRINCIPLED_V2, "V2")):
        (line,) = [x for x in header.splitlines() if f"kPrincipled{name}Operands =" in x]
        assert len(table) == int(line.split("=")[1].strip(" ;"))


def test_names_of_modes():
    camel = part("export.node_coordinates").camel
    assert camel("MULTIPLY_ADD") == "MultiplyAdd" and camel("ARCTAN2") == "Arctan2"
    assert camel("Linear") == "Linear"


def test_no_printing_in_the_addon():
    for path in ADDON.rglob("*.py"):
        assert "print(" not in path.read_text(encoding="utf-8"), path
