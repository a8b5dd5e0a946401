// A render in a file between two passes, or in the midst of one: the film, the guide with its
// weights and optimiser, and what the pass under way has recorded. A render that goes on from it
// ends with the bits of one that was never interrupted.
//
// The file is written as AtomicFile does. All errors of reading are StateErrors that name the file.
#pragma once

#include <cstdint>
#include <string>

#include "film/film.h"
#include "integrator/guiding_context.h"
#include "scene/scene_description.h"
#include "session/guide_controller.h"

namespace pharos {

// What has to be equal for a render to go on.
struct RenderIdentity {
    std::uint64_t scene = 0;  // scene_hash()
    std::uint64_t field = 0;  // checksum of a frozen field; 0: none
    std::uint32_t seed = 0;
    std::uint32_t offset = 0;  // of the first sample
    GuidingMode guiding = GuidingMode::Off;
    std::uint32_t width = 0;
    std::uint32_t height = 0;
};

struct RenderPosition {
    std::uint32_t done = 0;  // samples of the whole frame
    std::uint64_t nonfinite = 0;
    // Of a pass that was cut short; which of its samples are done, the film knows.
    RecordBuffer records;
    std::uint64_t paths = 0;
    std::uint64_t vertices = 0;
};

// Throws WriteError.
void write_checkpoint(const std::string& path,
                      const RenderIdentity& identity,
                      const RenderPosition& position,
                      const Film& film,
                      const GuideController& guide);

// Film and guide are those of a render that has not begun; after an error they are to be thrown
// away.
[[nodiscard]] RenderPosition read_checkpoint(const std::string& path,
                                             const RenderIdentity& identity,
                                             Film& film,
                                             GuideController& guide);

}  // namespace pharos
