#include "session/checkpoint_keeper.h"

#include <filesystem>
#include <system_error>

#include "core/atomic_file.h"

namespace pharos {

bool CheckpointKeeper::finds() const {
    std::error_code error;
    return !options_.path.empty() && options_.resume != Resume::Never &&
           std::filesystem::exists(options_.path, error);
}

RenderPosition CheckpointKeeper::read(Film& film, GuideController& guide) const {
    return read_checkpoint(options_.path, identity_, film, guide);
}

bool CheckpointKeeper::due() const {
    return !options_.path.empty() &&
           std::chrono::duration<double>(Clock::now() - last_).count() >= options_.interval;
}

std::string CheckpointKeeper::write(const RenderPosition& position,
                                    const Film& film,
                                    const GuideController& guide) {
    if (options_.path.empty()) {
        return {};
    }
    last_ = Clock::now();
    try {
        write_checkpoint(options_.path, identity_, position, film, guide);
    } catch (const WriteError& error) {
        return error.what();
    }
    return {};
}

}  // namespace pharos
