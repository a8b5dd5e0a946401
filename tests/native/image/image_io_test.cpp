// Files written and read back, packed bytes, and everything a broken file can do.
#include "image/image_io.h"

#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "core/color.h"

namespace pharos {
namespace {

namespace fs = std::filesystem;

// A folder of the test's own, gone with it.
class ImageIo : public testing::Test {
  protected:
    void SetUp() override {
        const auto* test = testing::UnitTest::GetInstance()->current_test_info();
        folder_ = fs::temp_directory_path() /
                  ("pharos_image_" + std::to_string(std::random_device()()) + test->name());
        fs::create_directories(folder_);
    }

    void TearDown() override { fs::remove_all(folder_); }

    [[nodiscard]] std::string file(const std::string& name) const {
        return (folder_ / name).string();
    }

    fs::path folder_;
};

[[nodiscard]] std::vector<std::uint8_t> bytes_of(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

void write_bytes(const std::string& path, std::span<const std::uint8_t> bytes) {
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<long>(bytes.size()));
}

[[nodiscard]] std::vector<float> floats_of(const TexturePixels& pixels) {
    std::vector<float> values(pixels.data.size() / sizeof(float));
    std::memcpy(values.data(), pixels.data.data(), pixels.data.size());
    return values;
}

[[nodiscard]] std::vector<float> random_values(std::size_t count, float upper) {
    std::mt19937 random(7);
    std::uniform_real_distribution<float> value(0.0f, upper);
    std::vector<float> values(count);
    for (float& v : values) {
        v = value(random);
    }
    return values;
}

[[nodiscard]] ImageDescription described(const std::string& path) {
    ImageDescription description;
    description.name = "picture";
    description.path = path;
    return description;
}

TEST_F(ImageIo, ExrKeepsFloatsExactly) {
    const std::vector<float> rgba = random_values(7 * 5 * 4, 1000.0f);
    const ExrPass pass{"", "RGBA", rgba};
    ASSERT_EQ(write_exr(file("a.exr"), 7, 5, {&pass, 1}), "");
    const DecodedImage image = read_image_file(file("a.exr"));
    ASSERT_EQ(image.error, "");
    EXPECT_EQ(image.pixels.width, 7u);
    EXPECT_EQ(image.pixels.height, 5u);
    EXPECT_EQ(image.pixels.channels, 4u);
    EXPECT_EQ(image.pixels.type, TexelType::Float);
    EXPECT_FALSE(image.straight_alpha);
    EXPECT_EQ(floats_of(image.pixels), rgba);  // bottom row first on both sides
    EXPECT_FALSE(fs::exists(file("a.exr.part")));
}

// Large enough to be read in several parts, the last of them smaller; in tiles too.
TEST_F(ImageIo, LargeOnesAreReadInPartsAndWhole) {
    constexpr std::uint32_t kWidth = 600;
    constexpr std::uint32_t kHeight = 977;
    const std::vector<float> rgba = random_values(4 * kWidth * kHeight, 1000.0f);
    const ExrPass pass{"", "RGBA", rgba};
    const std::string exr = file("a.exr");
    ASSERT_EQ(write_exr(exr, kWidth, kHeight, {&pass, 1}), "");
    EXPECT_EQ(floats_of(read_image_file(exr).pixels), rgba);
    for (const char* name : {"tiled.exr", "strips.tif", "tiled.tif"}) {
        SCOPED_TRACE(name);
        const std::string tiles = name[0] == 't' ? " --tile 48 80" : "";
        const std::string command =
            "oiiotool " + exr + tiles + " --compression zip -o " + file(name);
        ASSERT_EQ(std::system(command.c_str()), 0);
        const DecodedImage image = read_image_file(file(name));
        ASSERT_EQ(image.error, "");
        EXPECT_EQ(floats_of(image.pixels), rgba);
    }
    constexpr std::uint32_t kGreyWidth = 4096;
    std::vector<float> grey(std::size_t{kGreyWidth} * kHeight);
    std::vector<std::uint8_t> bytes(grey.size());
    for (std::size_t i = 0; i < grey.size(); ++i) {
        bytes[i] = static_cast<std::uint8_t>(i * 7 + i / kGreyWidth);
        grey[i] = srgb_to_linear(static_cast<float>(bytes[i]) / 255.0f);
    }
    ASSERT_EQ(write_png(file("grey.png"), kGreyWidth, kHeight, grey), "");
    EXPECT_EQ(read_image_file(file("grey.png")).pixels.data, bytes);
}

TEST_F(ImageIo, ExrHoldsNamedPassesAndMetadata) {
    const std::vector<float> combined = random_values(6 * 4 * 4, 1.0f);
    const std::vector<float> depth = random_values(6 * 4, 50.0f);
    const std::array passes = {ExrPass{"Combined", "RGBA", combined}, ExrPass{"Depth", "Z", depth}};
    ExrOptions options;
    options.metadata = {{"pharos:seed", "17"}};
    ASSERT_EQ(write_exr(file("m.exr"), 6, 4, passes, options), "");
    const std::vector<std::uint8_t> bytes = bytes_of(file("m.exr"));
    const std::string text(bytes.begin(), bytes.end());
    for (const char* name :
         {"Combined.R", "Combined.G", "Combined.B", "Combined.A", "Depth.Z", "pharos:seed", "17"}) {
        EXPECT_NE(text.find(name), std::string::npos) << name;
    }
    const DecodedImage image = read_image_file(file("m.exr"));
    ASSERT_EQ(image.error, "");
    EXPECT_GE(image.pixels.channels, 3u);
}

TEST_F(ImageIo, ExrHalfIsKeptAsHalf) {
    const std::vector<float> rgb = {0.5f, 0.25f, 65504.0f};
    const ExrPass pass{"", "RGB", rgb};
    ExrOptions options;
    options.half = true;
    ASSERT_EQ(write_exr(file("h.exr"), 1, 1, {&pass, 1}, options), "");
    SceneReport report;
    ImageDescription description = described(file("h.exr"));
    description.color_space = ImageColorSpace::Linear;
    const Texture texture = load_texture(description, report);
    EXPECT_TRUE(report.entries().empty());
    EXPECT_EQ(texture.type(), TexelType::Half);
    const Vec4 c = texture.lookup(Vec2(0.5f), ImageInterpolation::Closest, ImageExtension::Clip);
    EXPECT_EQ(c, Vec4(0.5f, 0.25f, 65504.0f, 1.0f));
}

TEST_F(ImageIo, PngRoundTripIsWithinHalfAStep) {
    const std::vector<float> rgba = [] {
        std::vector<float> values = random_values(9 * 4 * 4, 1.0f);
        for (std::size_t i = 0; i < values.size(); i += 4) {  // multiplied by alpha
            values[i + 3] = 0.2f + 0.8f * values[i + 3];
            for (std::size_t k = 0; k < 3; ++k) {
                values[i + k] *= values[i + 3];
            }
        }
        return values;
    }();
    ASSERT_EQ(write_png(file("a.png"), 9, 4, rgba), "");
    const DecodedImage image = read_image_file(file("a.png"));
    ASSERT_EQ(image.error, "");
    EXPECT_EQ(image.pixels.type, TexelType::U8);
    EXPECT_TRUE(image.straight_alpha);
    ASSERT_EQ(image.pixels.data.size(), rgba.size());
    for (std::size_t i = 0; i < rgba.size(); i += 4) {
        const float alpha = rgba[i + 3];
        EXPECT_NEAR(image.pixels.data[i + 3], alpha * 255.0f, 0.501f);
        for (std::size_t k = 0; k < 3; ++k) {
            EXPECT_NEAR(
                image.pixels.data[i + k], linear_to_srgb(rgba[i + k] / alpha) * 255.0f, 0.502f);
        }
    }
}

TEST_F(ImageIo, PngOfEverythingOutOfRangeIsClamped) {
    const std::vector<float> grey = {-1.0f, 0.0f, 1e30f, INFINITY, NAN, 1.0f};
    ASSERT_EQ(write_png(file("g.png"), 6, 1, grey), "");
    const DecodedImage image = read_image_file(file("g.png"));
    ASSERT_EQ(image.error, "");
    const std::vector<std::uint8_t> want = {0, 0, 255, 255, 255, 255};
    EXPECT_TRUE(std::equal(want.begin(), want.end(), image.pixels.data.begin()));
}

TEST_F(ImageIo, PackedBytesReadAsTheFileDoes) {
    const std::vector<float> rgb = random_values(8 * 8 * 3, 1.0f);
    const ExrPass pass{"", "RGB", rgb};
    ASSERT_EQ(write_exr(file("p.exr"), 8, 8, {&pass, 1}), "");
    ASSERT_EQ(write_png(file("p.png"), 8, 8, rgb), "");
    for (const char* name : {"p.exr", "p.png"}) {
        const DecodedImage from_file = read_image_file(file(name));
        const DecodedImage from_bytes = read_image_bytes(bytes_of(file(name)));
        ASSERT_EQ(from_bytes.error, "");
        EXPECT_EQ(from_bytes.pixels.data, from_file.pixels.data);
        EXPECT_EQ(from_bytes.pixels.type, from_file.pixels.type);
    }
}

TEST_F(ImageIo, TheNameSaysNothing) {
    const std::vector<float> grey(16, 0.5f);
    ASSERT_EQ(write_png(file("a.png"), 4, 4, grey), "");
    fs::copy_file(file("a.png"), file("really.exr"));
    fs::copy_file(file("a.png"), file("no_extension"));
    EXPECT_EQ(read_image_file(file("really.exr")).error, "");
    EXPECT_EQ(read_image_file(file("no_extension")).error, "");
}

TEST_F(ImageIo, PixelsOfTheHostBecomeBytesWhereTheyWereBytes) {
    ImageDescription description;
    description.width = 2;
    description.height = 1;
    description.pixels = {0.0f, 128.0f / 255.0f, 1.0f, 1.0f, 64.0f / 255.0f, 0.2f, 0.4f, 1.0f};
    SceneReport report;
    EXPECT_EQ(load_texture(description, report).type(), TexelType::U8);
    description.pixels[0] = 0.1234f;
    EXPECT_EQ(load_texture(description, report).type(), TexelType::Float);
    EXPECT_TRUE(report.entries().empty());
    description.width = 3;
    EXPECT_TRUE(load_texture(description, report).missing());
    EXPECT_EQ(report.entries().size(), 1u);
}

TEST_F(ImageIo, MissingImagesAreReportedAndMagenta) {
    SceneReport report;
    EXPECT_TRUE(load_texture(described(file("nowhere.png")), report).missing());
    EXPECT_TRUE(load_texture(described(""), report).missing());
    EXPECT_TRUE(load_texture(described(folder_.string()), report).missing());
    ASSERT_EQ(report.entries().size(), 3u);
    for (const ReportEntry& entry : report.entries()) {
        EXPECT_EQ(entry.object, "picture");
        EXPECT_FALSE(entry.message.empty());
    }
}

TEST_F(ImageIo, CancelledLoadsThrow) {
    const std::vector<float> grey(64 * 64, 0.5f);
    ASSERT_EQ(write_png(file("a.png"), 64, 64, grey), "");
    CancelFlag cancel;
    cancel.cancel();
    EXPECT_THROW(static_cast<void>(read_image_file(file("a.png"), &cancel)), Cancelled);
}

TEST_F(ImageIo, UnwritablePathsGiveASentence) {
    const std::vector<float> grey(4, 0.5f);
    const ExrPass pass{"", "Y", grey};
    EXPECT_NE(write_png(file("no/such/folder/a.png"), 2, 2, grey), "");
    EXPECT_NE(write_exr(file("no/such/folder/a.exr"), 2, 2, {&pass, 1}), "");
    EXPECT_NE(write_exr(file("a.exr"), 3, 3, {&pass, 1}), "");  // pixels do not fit
    EXPECT_NE(write_png(file("a.png"), 0, 0, {}), "");
    EXPECT_TRUE(fs::is_empty(folder_));
}

// Links that wait where a picture is written are replaced, not followed.
TEST_F(ImageIo, WritingStaysInTheFolder) {
    const std::vector<float> grey(4, 0.5f);
    const ExrPass pass{"", "Y", grey};
    const std::string outside = file("outside");
    write_bytes(outside, std::vector<std::uint8_t>{1, 2, 3});
    for (const char* name : {"a.exr", "a.exr.part", "b.png", "b.png.part"}) {
        fs::create_symlink(outside, file(name));
    }
    EXPECT_EQ(write_exr(file("a.exr"), 2, 2, {&pass, 1}), "");
    EXPECT_EQ(write_png(file("b.png"), 2, 2, grey), "");
    EXPECT_EQ(bytes_of(outside), (std::vector<std::uint8_t>{1, 2, 3}));
    EXPECT_TRUE(fs::is_regular_file(fs::symlink_status(file("a.exr"))));
    EXPECT_TRUE(fs::is_regular_file(fs::symlink_status(file("b.png"))));
}

// A broken file gives a report or whatever could be decoded, never a crash.
void expect_survives(const std::vector<std::uint8_t>& bytes, const std::string& path) {
    const DecodedImage packed = read_image_bytes(bytes);
    EXPECT_EQ(packed.error.empty(), !packed.pixels.data.empty());
    write_bytes(path, bytes);
    SceneReport report;
    const Texture texture = load_texture(described(path), report);
    EXPECT_EQ(texture.missing(), report.entries().size() == 1);
}

TEST_F(ImageIo, TruncatedFilesNeverCrash) {
    const std::vector<float> rgb = random_values(33 * 21 * 3, 1.0f);
    const ExrPass pass{"", "RGB", rgb};
    ASSERT_EQ(write_exr(file("t.exr"), 33, 21, {&pass, 1}), "");
    ASSERT_EQ(write_png(file("t.png"), 33, 21, rgb), "");
    for (const char* name : {"t.exr", "t.png"}) {
        const std::vector<std::uint8_t> whole = bytes_of(file(name));
        for (std::size_t eighth = 0; eighth < 8; ++eighth) {
            std::vector<std::uint8_t> part(
                whole.begin(), whole.begin() + static_cast<long>(whole.size() * eighth / 8));
            expect_survives(part, file("part"));
            EXPECT_NE(read_image_bytes(part).error, "") << name << ' ' << eighth << "/8";
        }
    }
}

TEST_F(ImageIo, DamagedFilesNeverCrash) {
    const std::vector<float> rgb = random_values(17 * 13 * 3, 1.0f);
    const ExrPass pass{"", "RGB", rgb};
    ASSERT_EQ(write_exr(file("d.exr"), 17, 13, {&pass, 1}), "");
    ASSERT_EQ(write_png(file("d.png"), 17, 13, rgb), "");
    std::mt19937 random(5);
    for (const char* name : {"d.exr", "d.png"}) {
        const std::vector<std::uint8_t> whole = bytes_of(file(name));
        for (int i = 0; i < 100; ++i) {
            std::vector<std::uint8_t> damaged = whole;
            // Mostly in the header, where the damage is worst.
            const std::size_t range =
                i % 2 == 0 ? std::min<std::size_t>(300, whole.size()) : whole.size();
            for (int k = 0; k < 1 + i % 4; ++k) {
                damaged[random() % range] = static_cast<std::uint8_t>(random());
            }
            expect_survives(damaged, file("damaged"));
        }
    }
}

TEST_F(ImageIo, FilesThatAreNoImagesAreRefused) {
    std::mt19937 random(9);
    for (int i = 0; i < 200; ++i) {
        std::vector<std::uint8_t> noise(random() % 300);
        for (std::uint8_t& b : noise) {
            b = static_cast<std::uint8_t>(random());
        }
        // Half of them with a true beginning.
        constexpr std::array<std::string_view, 8> kHeads = {"\x89PNG\r\n\x1a\n",
                                                            "\xff\xd8\xff\xe0",
                                                            "v/1\x01",
                                                            "#?RADIANCE\n",
                                                            "II*\0",
                                                            "BM",
                                                            "RIFF\x10\x10\x10\x10WEBP",
                                                            "SDPX"};
        if (i % 2 == 0) {
            const std::string_view head = kHeads[static_cast<std::size_t>(i / 2) % kHeads.size()];
            noise.insert(noise.begin(), head.begin(), head.end());
        }
        expect_survives(noise, file("noise"));
    }
    const std::string text = "<svg xmlns='http://www.w3.org/2000/svg'/>";
    EXPECT_NE(
        read_image_bytes({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}).error,
        "");
}

// What is no regular file is not even opened: a pipe would be waited for, a device never ends.
TEST_F(ImageIo, PipesDevicesAndFoldersAreRefusedAtOnce) {
    const std::string pipe = file("pipe.png");
    ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
    for (const std::string& path : {pipe, folder_.string(), std::string("/dev/zero")}) {
        EXPECT_NE(read_image_file(path).error, "") << path;
        EXPECT_TRUE(image_file_bytes(path).empty()) << path;
    }
}

TEST_F(ImageIo, BytesAreThoseOfImagesOnly) {
    const std::vector<std::uint8_t> png = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n', 1, 2, 3};
    write_bytes(file("picture"), png);
    EXPECT_EQ(image_file_bytes(file("picture")), png);
    const std::vector<std::uint8_t> text = {'t', 'e', 'x', 't'};
    write_bytes(file("text.png"), text);
    EXPECT_TRUE(image_file_bytes(file("text.png")).empty());
    EXPECT_TRUE(image_file_bytes(file("missing")).empty());
}

void append_big_endian(std::vector<std::uint8_t>& bytes, std::uint32_t value) {
    for (int shift = 24; shift >= 0; shift -= 8) {
        bytes.push_back(static_cast<std::uint8_t>(value >> shift));
    }
}

// chunk: its four letters and its data.
void append_png_chunk(std::vector<std::uint8_t>& bytes, const std::vector<std::uint8_t>& chunk) {
    append_big_endian(bytes, static_cast<std::uint32_t>(chunk.size() - 4));
    bytes.insert(bytes.end(), chunk.begin(), chunk.end());
    std::uint32_t crc = 0xffffffffu;
    for (const std::uint8_t byte : chunk) {
        crc ^= byte;
        for (int k = 0; k < 8; ++k) {
            crc = (crc >> 1) ^ ((crc & 1) != 0 ? 0xedb88320u : 0u);
        }
    }
    append_big_endian(bytes, ~crc);
}

// A PNG that claims width x height texels, with next to nothing behind its header.
[[nodiscard]] std::vector<std::uint8_t> png_claiming(std::uint32_t width, std::uint32_t height) {
    std::vector<std::uint8_t> header = {'I', 'H', 'D', 'R'};
    append_big_endian(header, width);
    append_big_endian(header, height);
    header.insert(header.end(), {8, 6, 0, 0, 0});
    std::vector<std::uint8_t> bytes = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
    append_png_chunk(bytes, header);
    append_png_chunk(bytes, {'I', 'D', 'A', 'T', 0x78, 0x9c, 0x03, 0x00});
    append_png_chunk(bytes, {'I', 'E', 'N', 'D'});
    return bytes;
}

TEST_F(ImageIo, BombsAreRefusedBeforeMemoryIsTaken) {
    EXPECT_NE(read_image_bytes(png_claiming(40000, 2)).error.find("a side"), std::string::npos);
    EXPECT_NE(read_image_bytes(png_claiming(32000, 32000)).error.find("claims more"),
              std::string::npos);
    EXPECT_NE(read_image_bytes(png_claiming(100, 100)).error, "");
}

}  // namespace
}  // namespace pharos
