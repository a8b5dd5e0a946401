"""Builds node programs: registers, constants, operations. Knows neither Blender nor node trees.

A Value is where a number lives: a constant (then its components are known here, and operations on
it may be done at once), a register, or the node's own default.
"""

from __future__ import annotations

from typing import NamedTuple

# Operations that say where a hit is.
_PLACES = {"Uv", "Geometry", "Coordinate", "Attribute"}
_LUMINANCE = (0.2126, 0.7152, 0.0722)


class Value(NamedTuple):
    """`operand` as the native side encodes it; `known` holds the components of a constant."""

    operand: int
    size: int
    known: tuple | None = None


class ProgramBuilder:
    """One program in the making; `native` gives names their numbers."""

    def __init__(self, native):
        self._native = native
        self._ops: list[tuple] = []
        self._constants: list[float] = []
        self._constant_index: dict[tuple, int] = {}
        self._registers = 0
        self._images: list = []
        self._names: list[str] = []
        self._tables: list[list[float]] = []
        self._memo: dict[tuple, Value] = {}
        self.step = (0.0, 0.0)  # where operations look that say where a hit is (bump mapping)
        self.mesh_attributes: set[str] = set()
        self.reads_uv = False  # beside the operations that always do
        self.instance_attributes: set[str] = set()
        self.default_normal = Value(native.DEFAULT_OPERAND, 3)

    @property
    def closure_count(self) -> int:
        return sum(1 for op in self._ops if op[2] < 0)

    def constant(self, *components: float) -> Value:
        known = tuple(float(component) for component in components)
        if known not in self._constant_index:
            self._constant_index[known] = len(self._constants)
            self._constants.extend(known)
        return Value(~self._constant_index[known], len(known), known)

    def op(self, code: str, operands, size: int, mode: int = 0) -> Value:
        """Append a value operation (once: equal ones share their registers)."""
        operands = [value.operand for value in operands]
        step = self.step if code in _PLACES else (0.0, 0.0)
        key = (code, mode, step, *operands)
        if key not in self._memo:
            output = self._registers
            self._registers += size
            self._ops.append((self._native.NodeOpCode[code], mode, output, operands, step))
            self._memo[key] = Value(output, size)
        return self._memo[key]

    def closure(self, code: str, operands, mode: int = 0) -> None:
        operands = [value.operand for value in operands]
        self._ops.append((self._native.NodeOpCode[code], mode, -1, operands, (0.0, 0.0)))

    def component(self, value: Value, index: int) -> Value:
        """One component of a wider value."""
        if value.known is not None:
            return self.constant(value.known[index])
        return Value(value.operand + index, 1)

    def slice(self, value: Value, size: int) -> Value:
        """The first components of a wider value."""
        if value.known is not None:
            return self.constant(*value.known[:size])
        return Value(value.operand, size)

    def part(self, value: Value, first: int, size: int) -> Value:
        """Components of a wider value that begin somewhere in it."""
        if value.known is not None:
            return self.constant(*value.known[first : first + size])
        return Value(value.operand + first, size)

    def to_scalar(self, value: Value, is_color: bool) -> Value:
        """A colour becomes its luminance, a vector the mean of its components."""
        if value.size == 1:
            return value
        if value.known is not None:
            weights = _LUMINANCE if is_color else (1 / 3, 1 / 3, 1 / 3)
            return self.constant(sum(w * c for w, c in zip(weights, value.known)))
        return self.op("Luminance" if is_color else "VectorAverage", [value], 1)

    def to_vector(self, value: Value) -> Value:
        if value.size >= 3:
            return self.slice(value, 3)
        if value.known is not None:
            return self.constant(*(value.known * 3))
        return self.op("ScalarToVector", [value], 3)

    def math(self, operation: str, a: Value, b: Value, clamp: bool = False) -> Value:
        mode = self._native.MathMode[operation] | (self._native.CLAMP_BIT if clamp else 0)
        return self.op("Math", [a, b, self.constant(0.0)], 1, mode)

    def vector_math(self, operation: str, a: Value, b: Value) -> Value:
        mode = self._native.VectorMathMode[operation]
        zero = self.constant(0.0, 0.0, 0.0)
        return self.op("VectorMath", [a, b, zero, self.constant(1.0)], 3, mode)

    def product(self, a: Value, b: Value) -> Value:
        """Product of two scalars; factors of one and zero vanish."""
        for one, other in ((a, b), (b, a)):
            if one.known == (1.0,):
                return other
            if one.known == (0.0,):
                return one
        if a.known is not None and b.known is not None:
            return self.constant(a.known[0] * b.known[0])
        return self.math("Multiply", a, b)

    def clamped(self, value: Value) -> Value:
        if value.known is not None:
            return self.constant(min(max(value.known[0], 0.0), 1.0))
        return self.math("Add", value, self.constant(0.0), clamp=True)

    def complement(self, value: Value) -> Value:
        if value.known is not None:
            return self.constant(1.0 - value.known[0])
        return self.math("Subtract", self.constant(1.0), value)

    def name_index(self, name: str) -> int:
        """Of a UV map; without a name the first one's."""
        return self.name_of(name) if name else self._native.DEFAULT_NAME

    def name_of(self, name: str) -> int:
        if name not in self._names:
            self._names.append(name)
        return self._names.index(name)

    def add_image_use(self, **fields) -> int:
        self._images.append(self._native.ImageUse(**fields))
        return len(self._images) - 1

    def add_table(self, rows) -> int:
        self._tables.append([float(v) for row in rows for v in row])
        return len(self._tables) - 1

    @property
    def uses_uv(self) -> bool:
        """Whether some operation needs UV maps of meshes."""
        codes = self._native.NodeOpCode
        wanted = {codes["Uv"], codes["NormalMap"]}
        coordinate = (codes["Coordinate"], self._native.CoordinateOutput["Uv"])
        tangent = (codes["Geometry"], self._native.GeometryOutput["Tangent"])
        return self.reads_uv or any(
            op[0] in wanted or op[:2] in {coordinate, tangent} for op in self._ops
        )

    def build(self):
        program = self._native.NodeProgram(
            ops=self._ops, constants=self._constants, register_count=self._registers
        )
        program.images = self._images
        program.names = self._names
        program.tables = self._tables
        return program
