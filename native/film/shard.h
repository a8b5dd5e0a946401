// Pictures of one frame taken apart: each holds some of every pixel's samples and says which in its
// metadata; together they are the single run, within the rounding of the files.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "film/film_description.h"
#include "image/image_io.h"

namespace pharos {

struct SampleRange {
    std::uint32_t first = 0;
    std::uint32_t count = 0;

    [[nodiscard]] std::uint64_t end() const { return std::uint64_t{first} + count; }
};

// What of a picture has to be equal for another to be part of the same.
struct ShardInfo {
    std::string scene;    // scene_hash() in hexadecimal digits
    std::string guiding;  // "off", a mode's name, or that of the frozen field
    std::string window;   // of the frame that was rendered
    std::uint32_t seed = 0;
    std::vector<SampleRange> ranges;  // true ones: of samples in the picture. Ascending.
};

[[nodiscard]] std::string window_text(const FilmDescription& film);

using ShardMetadata = std::vector<std::pair<std::string, std::string>>;

[[nodiscard]] ShardMetadata shard_metadata(const ShardInfo& info);

// Throws std::runtime_error where it is not that of a Pharos picture.
[[nodiscard]] ShardInfo parse_shard(const ShardMetadata& metadata);

struct MergedPicture {
    ShardInfo info;
    std::uint32_t width = 0;
    std::uint32_t height = 0;

    struct Pass {
        std::string name;
        std::string channels;
        std::vector<float> pixels;
    };

    std::vector<Pass> passes;
    std::vector<SampleRange> missing;  // between the ranges
};

// Each pixel by its own number of samples, in double. Throws std::runtime_error naming the file
// that cannot be read, is of another picture, or holds samples that another holds too.
[[nodiscard]] MergedPicture merge_shards(std::span<const std::string> paths);

}  // namespace pharos
