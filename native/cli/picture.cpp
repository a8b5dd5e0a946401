#include "cli/picture.h"

#include <algorithm>

#include "core/atomic_file.h"

namespace pharos::cli {

namespace {

void require_written(const std::string& error) {
    if (!error.empty()) {
        throw WriteError(error);
    }
}

}  // namespace

void write_picture(const RenderSession& session,
                   ShardInfo info,
                   std::uint32_t offset,
                   const std::string& path) {
    const std::size_t pixels = std::size_t{session.width()} * session.height();
    std::vector<std::vector<float>> buffers;
    std::vector<ExrPass> passes;
    for (std::size_t i = 0; i < kFilmPasses; ++i) {
        const auto pass = static_cast<FilmPass>(i);
        if (!session.has(pass)) {
            continue;
        }
        auto& buffer =
            buffers.emplace_back(pixels * static_cast<std::size_t>(film_pass_channels(pass)));
        if (!session.read(pass, buffer)) {
            throw std::runtime_error("there is no picture to write");
        }
        passes.push_back({film_pass_info(pass).name, film_pass_info(pass).channels, buffer});
        if (pass == FilmPass::SampleCount) {
            const float most = *std::ranges::max_element(buffer);
            if (most > 0.0f) {
                info.ranges = {{offset, static_cast<std::uint32_t>(most)}};
            }
        }
    }
    for (std::size_t i = 0; i < session.aovs().size(); ++i) {
        const AovDescription& aov = session.aovs()[i];
        auto& buffer = buffers.emplace_back(pixels * (aov.color ? 4 : 1));
        if (session.read_aov(i, buffer)) {
            passes.push_back({aov.name, aov_channels(aov), buffer});
        }
    }
    const ExrOptions options{false, shard_metadata(info)};
    require_written(write_exr(path, session.width(), session.height(), passes, options));
}

void write_merged(const MergedPicture& picture, const std::string& path) {
    std::vector<ExrPass> passes;
    for (const MergedPicture::Pass& pass : picture.passes) {
        passes.push_back({pass.name, pass.channels, pass.pixels});
    }
    const ExrOptions options{false, shard_metadata(picture.info)};
    require_written(write_exr(path, picture.width, picture.height, passes, options));
}

}  // namespace pharos::cli
