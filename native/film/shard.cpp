#include "film/shard.h"

#include <algorithm>
#include <charconv>
#include <optional>
#include <stdexcept>

#include "film/passes.h"

namespace pharos {

namespace {

constexpr const char* kRanges = "pharos:ranges";
constexpr const char* kScene = "pharos:scene";
constexpr const char* kSeed = "pharos:seed";
constexpr const char* kGuiding = "pharos:guiding";
constexpr const char* kWindow = "pharos:window";

[[nodiscard]] std::uint32_t number_in(std::string_view text) {
    std::uint32_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size()) {
        throw std::runtime_error("its metadata is damaged");
    }
    return value;
}

// "0+16,20+4"
[[nodiscard]] std::string ranges_text(std::span<const SampleRange> ranges) {
    std::string text;
    for (const SampleRange& range : ranges) {
        if (!text.empty()) {
            text += ',';
        }
        text += std::to_string(range.first);
        text += '+';
        text += std::to_string(range.count);
    }
    return text;
}

[[nodiscard]] std::vector<SampleRange> ranges_in(std::string_view text) {
    std::vector<SampleRange> ranges;
    while (!text.empty()) {
        const std::string_view part = text.substr(0, text.find(','));
        text.remove_prefix(std::min(text.size(), part.size() + 1));
        const std::size_t plus = part.find('+');
        const SampleRange range{
            number_in(part.substr(0, plus)),
            plus == std::string_view::npos ? 0 : number_in(part.substr(plus + 1))};
        if (range.count == 0 || (!ranges.empty() && range.first < ranges.back().end())) {
            throw std::runtime_error("its metadata is damaged");
        }
        ranges.push_back(range);
    }
    return ranges;
}

// How a channel of several shards becomes one.
enum class Rule : std::uint8_t {
    Mean,   // weighted by the samples of the pixel
    Ratio,  // likewise, and by the colour that it has been divided by
    First,  // of the shard with the first samples
    Sum
};

struct Channel {
    Rule rule = Rule::Mean;
    std::size_t divisor = 0;  // Ratio: the channel of the colour
};

struct Layout {
    std::vector<Channel> channels;
    std::size_t count = 0;  // the channel of the number of samples
    std::vector<MergedPicture::Pass> passes;
};

[[nodiscard]] Rule rule_of(FilmPass pass) {
    if (pass == FilmPass::SampleCount) {
        return Rule::Sum;
    }
    if (pass == FilmPass::Depth) {
        return Rule::First;
    }
    const PassKind kind = film_pass_info(pass).kind;
    if (kind == PassKind::FirstSample || kind == PassKind::AtTheEnd) {
        return Rule::First;
    }
    return color_of(pass) == FilmPass::Count ? Rule::Mean : Rule::Ratio;
}

// Channels come in any order (OpenEXR sorts them): by their names.
[[nodiscard]] std::optional<std::size_t> find_channel(const ExrFile& exr, const std::string& name) {
    const auto found = std::ranges::find(exr.channels, name);
    if (found == exr.channels.end()) {
        return {};
    }
    return static_cast<std::size_t>(found - exr.channels.begin());
}

[[nodiscard]] std::string channel_name(FilmPass pass, std::size_t letter) {
    const FilmPassInfo& info = film_pass_info(pass);
    return std::string(info.name) + "." + info.channels[letter];
}

[[nodiscard]] bool is_film_pass(std::string_view name) {
    for (std::size_t i = 0; i < kFilmPasses; ++i) {
        if (name == film_pass_info(static_cast<FilmPass>(i)).name) {
            return true;
        }
    }
    return false;
}

// Passes that materials wrote, known by their channels' letters; the number of their channels.
std::size_t add_aovs(const ExrFile& exr, Layout& layout) {
    std::size_t known = 0;
    for (const bool color : {true, false}) {
        const std::string letters = aov_channels({"", color});
        for (const std::string& channel : exr.channels) {
            const std::string name = channel.substr(0, channel.rfind('.'));
            if (!channel.ends_with(std::string(".") + letters[0]) || is_film_pass(name)) {
                continue;
            }
            layout.passes.push_back({name, letters, {}});
            for (const char letter : letters) {
                const auto at = find_channel(exr, name + "." + letter);
                if (!at) {
                    throw std::runtime_error("a channel is missing");
                }
                layout.channels[*at] = {Rule::Mean, 0};
                ++known;
            }
        }
    }
    return known;
}

[[nodiscard]] Layout layout_of(const ExrFile& exr) {
    Layout layout;
    layout.channels.resize(exr.channels.size());
    std::size_t known = 0;
    bool counted = false;
    for (std::size_t i = 0; i < kFilmPasses; ++i) {
        const auto pass = static_cast<FilmPass>(i);
        const FilmPassInfo& info = film_pass_info(pass);
        const auto letters = static_cast<std::size_t>(film_pass_channels(pass));
        if (!find_channel(exr, channel_name(pass, 0))) {
            continue;
        }
        layout.passes.push_back({info.name, info.channels, {}});
        for (std::size_t letter = 0; letter < letters; ++letter) {
            const auto at = find_channel(exr, channel_name(pass, letter));
            const auto divisor = rule_of(pass) == Rule::Ratio
                                     ? find_channel(exr, channel_name(color_of(pass), letter))
                                     : std::optional<std::size_t>(0);
            if (!at || !divisor) {
                throw std::runtime_error("a channel is missing");
            }
            layout.channels[*at] = {rule_of(pass), *divisor};
            ++known;
            if (pass == FilmPass::SampleCount) {
                layout.count = *at;
                counted = true;
            }
        }
    }
    known += add_aovs(exr, layout);
    if (!counted || known != exr.channels.size()) {
        throw std::runtime_error("its channels are not those of a Pharos picture");
    }
    return layout;
}

struct Shard {
    std::string path;
    ShardInfo info;
};

class Merger {
  public:
    void add(const ExrFile& exr);
    void fill(MergedPicture& picture);

  private:
    ExrFile first_;  // its names and size
    Layout layout_;
    std::vector<double> sums_;  // by pixel and channel
};

void Merger::add(const ExrFile& exr) {
    const std::size_t channels = exr.channels.size();
    if (sums_.empty()) {
        layout_ = layout_of(exr);
        first_ = exr;
        first_.pixels = {};
        sums_.resize(exr.pixels.size());
    }
    if (exr.channels != first_.channels || exr.width != first_.width ||
        exr.height != first_.height) {
        throw std::runtime_error("its passes or its size are others");
    }
    for (std::size_t p = 0; p < exr.pixels.size(); p += channels) {
        const float* in = &exr.pixels[p];
        double* sum = &sums_[p];
        const auto count = static_cast<double>(in[layout_.count]);
        if (!(count > 0.0)) {
            continue;
        }
        const bool first = sum[layout_.count] == 0.0;
        for (std::size_t c = 0; c < channels; ++c) {
            const auto value = static_cast<double>(in[c]);
            switch (layout_.channels[c].rule) {
                case Rule::Mean:
                    sum[c] += count * value;
                    break;
                case Rule::Ratio:
                    sum[c] += count * value * static_cast<double>(in[layout_.channels[c].divisor]);
                    break;
                case Rule::First:
                    sum[c] = first ? value : sum[c];
                    break;
                case Rule::Sum:
                    break;
            }
        }
        sum[layout_.count] += count;
    }
}

void Merger::fill(MergedPicture& picture) {
    const std::size_t channels = first_.channels.size();
    const std::size_t pixels = sums_.size() / channels;
    picture.width = first_.width;
    picture.height = first_.height;
    picture.passes = layout_.passes;
    for (MergedPicture::Pass& pass : picture.passes) {
        pass.pixels.resize(pixels * pass.channels.size());
        for (std::size_t letter = 0; letter < pass.channels.size(); ++letter) {
            const std::size_t c = *find_channel(first_, pass.name + "." + pass.channels[letter]);
            const Channel& channel = layout_.channels[c];
            for (std::size_t i = 0; i < pixels; ++i) {
                const double* sum = &sums_[i * channels];
                double scale = 1.0;
                if (channel.rule == Rule::Mean || channel.rule == Rule::Ratio) {
                    const double divisor =
                        channel.rule == Rule::Mean ? sum[layout_.count] : sum[channel.divisor];
                    scale = divisor > 0.0 ? 1.0 / divisor : 0.0;
                }
                pass.pixels[i * pass.channels.size() + letter] = static_cast<float>(sum[c] * scale);
            }
        }
    }
}

// Both hold the same frame; says what differs otherwise.
void require_same_picture(const Shard& a, const Shard& b) {
    const auto require = [&](bool same, const char* what) {
        if (!same) {
            throw std::runtime_error(b.path + ": " + what + " than of " + a.path);
        }
    };
    require(a.info.scene == b.info.scene, "of another scene, or with other settings,");
    require(a.info.seed == b.info.seed, "of another seed");
    require(a.info.window == b.info.window, "of another part of the frame");
    require(a.info.guiding == b.info.guiding, "with another guide");
}

// Takes a shard's ranges into those of the picture.
void join_ranges(const std::vector<Shard>& shards, MergedPicture& picture) {
    struct Owned {
        SampleRange range;
        const Shard* shard = nullptr;
    };

    std::vector<Owned> all;
    for (const Shard& shard : shards) {
        for (const SampleRange& range : shard.info.ranges) {
            all.push_back({range, &shard});
        }
    }
    std::ranges::sort(all, {}, [](const Owned& owned) { return owned.range.first; });
    std::vector<SampleRange>& joined = picture.info.ranges;
    joined.clear();
    const Shard* before = nullptr;
    for (const auto& [range, shard] : all) {
        if (!joined.empty() && range.first < joined.back().end()) {
            throw std::runtime_error(shard->path + ": holds samples that " + before->path +
                                     " holds too");
        }
        if (!joined.empty() && range.first == joined.back().end()) {
            joined.back().count += range.count;
        } else {
            if (!joined.empty()) {
                const auto from = static_cast<std::uint32_t>(joined.back().end());
                picture.missing.push_back({from, range.first - from});
            }
            joined.push_back(range);
        }
        before = shard;
    }
}

[[nodiscard]] ExrFile read(const std::string& path, bool with_pixels) {
    ExrFile exr = read_exr(path, with_pixels);
    if (!exr.error.empty()) {
        throw std::runtime_error(path + ": " + exr.error);
    }
    return exr;
}

template <class Function>
auto naming(const std::string& path, const Function& function) {
    try {
        return function();
    } catch (const std::runtime_error& error) {
        throw std::runtime_error(path + ": " + error.what());
    }
}

}  // namespace

std::string window_text(const FilmDescription& film) {
    const auto text = [](std::uint32_t value) { return std::to_string(value); };
    return text(film.crop_width) + "x" + text(film.crop_height) + "+" + text(film.crop_x) + "+" +
           text(film.crop_y) + " of " + text(film.width) + "x" + text(film.height);
}

ShardMetadata shard_metadata(const ShardInfo& info) {
    std::uint64_t samples = 0;
    for (const SampleRange& range : info.ranges) {
        samples += range.count;
    }
    return {{"Software", "Pharos " PHAROS_VERSION},
            {"pharos:samples", std::to_string(samples)},
            {kRanges, ranges_text(info.ranges)},
            {kScene, info.scene},
            {kSeed, std::to_string(info.seed)},
            {kGuiding, info.guiding},
            {kWindow, info.window}};
}

ShardInfo parse_shard(const ShardMetadata& metadata) {
    const auto value = [&](const char* key) -> const std::string& {
        const auto found = std::ranges::find(metadata, key, &ShardMetadata::value_type::first);
        if (found == metadata.end()) {
            throw std::runtime_error("it does not say which samples of which scene it holds");
        }
        return found->second;
    };
    ShardInfo info;
    info.scene = value(kScene);
    info.guiding = value(kGuiding);
    info.window = value(kWindow);
    info.seed = number_in(value(kSeed));
    info.ranges = ranges_in(value(kRanges));
    return info;
}

MergedPicture merge_shards(std::span<const std::string> paths) {
    std::vector<Shard> shards;
    for (const std::string& path : paths) {
        const ExrFile exr = read(path, false);
        shards.push_back({path, naming(path, [&] { return parse_shard(exr.metadata); })});
        require_same_picture(shards.front(), shards.back());
        if (shards.back().info.ranges.empty()) {
            throw std::runtime_error(path + ": holds no samples");
        }
    }
    if (shards.empty()) {
        throw std::runtime_error("there is nothing to merge");
    }
    std::ranges::sort(shards, {}, [](const Shard& s) { return s.info.ranges.front().first; });
    MergedPicture picture;
    picture.info = shards.front().info;
    join_ranges(shards, picture);
    Merger merger;
    for (const Shard& shard : shards) {
        const ExrFile exr = read(shard.path, true);
        naming(shard.path, [&] { merger.add(exr); });
    }
    merger.fill(picture);
    return picture;
}

}  // namespace pharos
