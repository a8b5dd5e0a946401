// A file of state: magic, version, length, the state, and a checksum of all before it.
//
// Written by AtomicFile, piece by piece: no second copy of the state is held in memory. Reading
// first goes through the whole file for its checksum, then parses: a damaged file changes nothing.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "core/state_archive.h"

namespace pharos {

struct StateFileKind {
    std::uint64_t magic = 0;
    std::uint32_t version = 0;
    const char* name = "";  // for messages: "checkpoint"
};

// Throws WriteError.
void write_state_file(const std::string& path,
                      const StateFileKind& kind,
                      const std::function<void(StateWriter&)>& write);

// Throws StateError with the path and what is wrong: not there, foreign, newer, truncated, damaged,
// or whatever `read` throws as such. `read` has to take everything.
void read_state_file(const std::string& path,
                     const StateFileKind& kind,
                     const std::function<void(StateReader&)>& read);

// The same in memory.
[[nodiscard]] std::vector<std::byte> state_file_bytes(
    const StateFileKind& kind, const std::function<void(StateWriter&)>& write);
void parse_state_file(std::span<const std::byte> bytes,
                      const StateFileKind& kind,
                      const std::function<void(StateReader&)>& read);

}  // namespace pharos
