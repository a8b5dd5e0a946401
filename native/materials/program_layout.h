// What each operation reads and writes: the one table that compile_material() checks programs
// against (internal to materials/).
#pragma once

#include <cstdint>
#include <string_view>

#include "materials/node_program.h"

namespace pharos::detail {

// What an operation's value follows from.
enum class OpKind : std::uint8_t {
    Pure,     // operands alone: folded when they are constant
    Hit,      // the hit or an image too
    Closure,  // writes nothing
};

struct OpLayout {
    NodeOpCode code;
    OpKind kind;
    // One digit for each operand: its components; '*' behind it: may be kDefaultOperand.
    std::string_view operands;
    std::uint8_t outputs;
};

inline constexpr std::uint32_t kMaxOperands = 32;

// An operation as checked: sizes of the operands it really has.
struct OpShape {
    OpKind kind = OpKind::Pure;
    std::uint32_t operand_count = 0;
    std::uint32_t outputs = 0;
    std::uint8_t size[kMaxOperands] = {};
    bool may_default[kMaxOperands] = {};
};

// False when the code, the mode or the number of operands is none that exists.
[[nodiscard]] bool find_shape(const NodeProgram& program, const NodeOp& op, OpShape& shape);

}  // namespace pharos::detail
