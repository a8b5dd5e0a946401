// What this process may still take.
#pragma once

#include <cstdint>
#include <exception>

namespace pharos {

// Bytes, by the process' own limit (RLIMIT_AS) and by what the machine has free. Of the limit, what
// the libraries' threads need is left to them.
[[nodiscard]] std::uint64_t available_memory();

// True for what is thrown where memory has run out: std::bad_alloc, and the error of a thread that
// found no place for its stack.
[[nodiscard]] bool is_out_of_memory(const std::exception& error);

}  // namespace pharos
