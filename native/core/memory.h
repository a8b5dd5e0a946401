// What this process may still take.
#pragma once

#include <cstdint>

namespace pharos {

// Bytes, by the process' own limit (RLIMIT_AS) and by what the machine has free.
[[nodiscard]] std::uint64_t available_memory();

}  // namespace pharos
