#include "film/shard.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "session/render_session.h"
#include "support/random.h"
#include "support/scratch.h"
#include "support/stress.h"
#include "support/test_scenes.h"

namespace pharos {
namespace {

using namespace pharos::testing;

constexpr double kTolerance = 1e-6;  // relative: the files hold floats

SceneDescription scene(std::uint32_t samples, GuidingMode guiding = GuidingMode::Off) {
    SceneDescription d = two_rooms(32, 27, samples);
    d.settings.guiding = guiding;
    d.passes.wanted = ~0u;
    return d;
}

// As pharos-cli writes it.
std::string render_to(const std::string& path,
                      const SceneDescription& d,
                      const SessionOptions& options = {}) {
    RenderSession session(d, options);
    while (!session.wait(std::chrono::milliseconds(1000))) {
    }
    EXPECT_EQ(session.progress().error, "");
    std::vector<std::vector<float>> buffers;
    std::vector<ExrPass> passes;
    for (std::size_t i = 0; i < kFilmPasses; ++i) {
        const auto pass = static_cast<FilmPass>(i);
        auto& pixels = buffers.emplace_back(std::size_t{session.width()} * session.height() *
                                            static_cast<std::size_t>(film_pass_channels(pass)));
        EXPECT_TRUE(session.read(pass, pixels));
        passes.push_back({film_pass_info(pass).name, film_pass_info(pass).channels, pixels});
    }
    const ShardInfo info{"1234",
                         "off",
                         window_text(d.film),
                         d.settings.seed,
                         {{options.sample_offset, d.settings.samples}}};
    const ExrOptions exr{false, shard_metadata(info)};
    EXPECT_EQ(write_exr(path, session.width(), session.height(), passes, exr), "");
    return path;
}

SessionOptions from(std::uint32_t offset, std::vector<std::byte> field = {}) {
    SessionOptions options;
    options.sample_offset = offset;
    options.field = std::move(field);
    return options;
}

// Largest difference of any channel of any pass, relative where values are over 1.
double largest_difference(const MergedPicture& a, const MergedPicture& b) {
    double largest = 0.0;
    EXPECT_EQ(a.passes.size(), kFilmPasses);
    EXPECT_EQ(b.passes.size(), kFilmPasses);
    for (std::size_t p = 0; p < a.passes.size(); ++p) {
        EXPECT_EQ(a.passes[p].name, b.passes[p].name);
        if (a.passes[p].name == film_pass_info(FilmPass::Effort).name) {
            continue;  // a sample's difference from those before it, which no other part has
        }
        for (std::size_t i = 0; i < a.passes[p].pixels.size(); ++i) {
            const auto x = static_cast<double>(a.passes[p].pixels[i]);
            const auto y = static_cast<double>(b.passes[p].pixels[i]);
            largest = std::max(largest, std::abs(x - y) / std::max(1.0, std::abs(y)));
        }
    }
    return largest;
}

MergedPicture merge(const std::vector<std::string>& paths) {
    return merge_shards(paths);
}

TEST(Shards, UnevenRangesMergeToTheSingleRun) {
    const ScratchFolder folder;
    const std::string whole = render_to(folder.file("whole.exr"), scene(16));
    const std::string a = render_to(folder.file("a.exr"), scene(4), from(0));
    const std::string b = render_to(folder.file("b.exr"), scene(11), from(4));
    const std::string c = render_to(folder.file("c.exr"), scene(1), from(15));
    const MergedPicture picture = merge({c, a, b});
    EXPECT_LE(largest_difference(picture, merge({whole})), kTolerance);
    ASSERT_EQ(picture.info.ranges.size(), 1u);
    EXPECT_EQ(picture.info.ranges[0].first, 0u);
    EXPECT_EQ(picture.info.ranges[0].count, 16u);
    EXPECT_TRUE(picture.missing.empty());
    // The test can fail: as Cycles' merge does, all files alike.
    const MergedPicture wrong = merge({whole, render_to(folder.file("d.exr"), scene(1), from(16))});
    EXPECT_GT(largest_difference(wrong, picture), 1e-3);
}

// Each machine trains nothing: all use what one has learned.
TEST(Shards, FrozenFieldMergesToTheSingleRun) {
    const ScratchFolder folder;
    const GuidingMode mode = GuidingMode::Neural;
    RenderSession training(scene(24, mode), SessionOptions{});
    while (!training.wait(std::chrono::milliseconds(1000))) {
    }
    const std::vector<std::byte> field = training.field();
    ASSERT_GT(training.progress().guiding.guided_share, 0.0);
    const std::string whole = render_to(folder.file("whole.exr"), scene(9, mode), from(0, field));
    const std::string a = render_to(folder.file("a.exr"), scene(2, mode), from(0, field));
    const std::string b = render_to(folder.file("b.exr"), scene(7, mode), from(2, field));
    EXPECT_LE(largest_difference(merge({a, b}), merge({whole})), kTolerance);
    const std::string off = render_to(folder.file("off.exr"), scene(9), from(0));
    EXPECT_GT(largest_difference(merge({off}), merge({whole})), 1e-3) << "it guided nothing";
}

// Cut anywhere, merged in any order: guided by a frozen field every other time.
TEST(Shards, AnyPartitionMergesToTheSingleRun) {
    constexpr std::uint32_t kSamples = 12;
    const GuidingMode modes[] = {GuidingMode::Off, GuidingMode::Neural};
    RenderSession training(scene(24, GuidingMode::Neural), SessionOptions{});
    while (!training.wait(std::chrono::milliseconds(1000))) {
    }
    const std::uint64_t partitions = case_count(2, 30);
    double worst = 0.0;
    test::Random random(8);
    for (std::uint64_t i = 0; i < partitions; ++i) {
        const ScratchFolder folder;
        const GuidingMode mode = modes[i % 2];
        const auto field = mode == GuidingMode::Off ? std::vector<std::byte>() : training.field();
        const auto part = [&](std::uint32_t first, std::uint32_t count) {
            return render_to(
                folder.file(std::to_string(first) + "+" + std::to_string(count) + ".exr"),
                scene(count, mode),
                from(first, field));
        };
        std::vector<std::string> paths;
        for (std::uint32_t first = 0; first < kSamples;) {
            const std::uint32_t count = 1 + random.index(kSamples - first);
            paths.insert(paths.begin() + random.index(static_cast<std::uint32_t>(paths.size()) + 1),
                         part(first, count));
            first += count;
        }
        const double difference = largest_difference(merge(paths), merge({part(0, kSamples)}));
        EXPECT_LE(difference, kTolerance) << paths.size() << " parts";
        worst = std::max(worst, difference);
    }
    say_stress("partitions of a frame's samples: difference when merged", partitions, worst, 1e-6);
}

TEST(Shards, AMergedPictureMergesOn) {
    const ScratchFolder folder;
    std::vector<std::string> paths;
    for (std::uint32_t i = 0; i < 3; ++i) {
        paths.push_back(
            render_to(folder.file(std::to_string(i) + ".exr"), scene(i + 1), from(4 * i)));
    }
    const MergedPicture picture = merge({paths[0], paths[2]});
    ASSERT_EQ(picture.info.ranges.size(), 2u);
    ASSERT_EQ(picture.missing.size(), 1u);
    EXPECT_EQ(picture.missing[0].first, 1u);
    EXPECT_EQ(picture.missing[0].count, 7u);
    std::vector<ExrPass> passes;
    for (const MergedPicture::Pass& pass : picture.passes) {
        passes.push_back({pass.name, pass.channels, pass.pixels});
    }
    const ExrOptions exr{false, shard_metadata(picture.info)};
    const std::string both = folder.file("both.exr");
    ASSERT_EQ(write_exr(both, picture.width, picture.height, passes, exr), "");
    EXPECT_LE(largest_difference(merge({both, paths[1]}), merge(paths)), kTolerance);
    EXPECT_THROW(static_cast<void>(merge({both, paths[2]})), std::runtime_error);
}

std::string refusal(const std::vector<std::string>& paths) {
    try {
        static_cast<void>(merge(paths));
    } catch (const std::runtime_error& error) {
        return error.what();
    }
    return {};
}

TEST(Shards, OverlappingAndForeignOnesAreRefused) {
    const ScratchFolder folder;
    const std::string a = render_to(folder.file("a.exr"), scene(4), from(0));
    const std::string b = render_to(folder.file("b.exr"), scene(4), from(3));
    EXPECT_NE(refusal({a, b}).find("b.exr: holds samples that"), std::string::npos);
    EXPECT_NE(refusal({a, a}).find("holds too"), std::string::npos);
    SceneDescription other = scene(4);
    other.settings.seed = 9;
    EXPECT_NE(refusal({a, render_to(folder.file("c.exr"), other, from(4))}).find("another seed"),
              std::string::npos);
    other = scene(4);
    other.film.crop_x = 1;
    other.film.crop_width -= 1;
    EXPECT_NE(refusal({a, render_to(folder.file("d.exr"), other, from(4))}).find("another part"),
              std::string::npos);
    const std::vector<float> grey(12, 0.5f);
    const ExrPass pass{"Combined", "RGB", grey};
    const std::string foreign = folder.file("foreign.exr");
    ASSERT_EQ(write_exr(foreign, 2, 2, std::span(&pass, 1)), "");
    EXPECT_NE(refusal({foreign}).find("does not say which samples"), std::string::npos);
    EXPECT_NE(refusal({folder.file("missing.exr")}).find("cannot be read"), std::string::npos);
}

TEST(Shards, DamagedMetadataIsRefused) {
    const ShardInfo info{"12", "off", "w", 3, {{0, 4}, {6, 2}}};
    EXPECT_EQ(parse_shard(shard_metadata(info)).ranges.size(), 2u);
    for (const char* text : {"4", "0+0", "0+4,2+9", "4+2,0+1", "a+b", "0+-1", ",", "0+4,,6+2"}) {
        ShardMetadata metadata = shard_metadata(info);
        for (auto& [key, value] : metadata) {
            value = key == "pharos:ranges" ? text : value;
        }
        EXPECT_THROW(static_cast<void>(parse_shard(metadata)), std::runtime_error) << text;
    }
}

TEST(Shards, AFieldOfAnotherGuideIsRefused) {
    RenderSession training(scene(3, GuidingMode::Slides), SessionOptions{});
    while (!training.wait(std::chrono::milliseconds(1000))) {
    }
    for (const GuidingMode mode : {GuidingMode::Neural, GuidingMode::Off}) {
        RenderSession session(scene(3, mode), from(0, training.field()));
        while (!session.wait(std::chrono::milliseconds(1000))) {
        }
        EXPECT_EQ(session.progress().state, SessionState::Failed);
        EXPECT_NE(session.progress().error.find("guid"), std::string::npos);
    }
}

}  // namespace
}  // namespace pharos
