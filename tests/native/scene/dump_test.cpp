#include "scene/dump.h"

#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <random>
#include <stdexcept>

#include <gtest/gtest.h>

#include "film/passes.h"
#include "scene/dump_fields.h"
#include "support/description_builders.h"

namespace pharos::testing {
namespace {

class TemporaryDirectory {
  public:
    TemporaryDirectory() {
        std::string name = (std::filesystem::temp_directory_path() / "pharos-XXXXXX").string();
        path_ = ::mkdtemp(name.data());
    }

    ~TemporaryDirectory() { std::filesystem::remove_all(path_); }

    [[nodiscard]] std::string file(const std::string& name) const {
        return (path_ / name).string();
    }

    [[nodiscard]] std::size_t files() const {
        return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(path_),
                                                      std::filesystem::directory_iterator()));
    }

  private:
    std::filesystem::path path_;
};

std::string message_of(const std::function<void()>& action) {
    try {
        action();
    } catch (const std::runtime_error& error) {
        return error.what();
    }
    return "nothing was thrown";
}

// Something in every member, and values that a text format would lose.
SceneDescription full_description() {
    SceneBuilder b;
    const float nan = std::numeric_limits<float>::quiet_NaN();
    ImageUse use;
    use.image = b.image({});
    use.extension = ImageExtension::Mirror;
    b.description().images[0].pixels.assign(4 * 6, 0.1f);
    b.description().images[0].width = 3;
    b.description().images[0].height = 2;
    b.description().images[0].color_space = ImageColorSpace::Data;
    const std::uint32_t material = b.material("photo", image_diffuse_program(use));
    b.material("lamp", emission_program(Rgb(1, 2, 3), 4.0f), false);
    b.description().materials[0].program.names.emplace_back("UVMap");
    b.description().materials[0].program.tables.push_back({0.0f, 1.0f, nan, -0.0f});
    Mesh sphere = sphere_mesh("Kugel \xc3\xa4", Vec3(1e-42f, 0, kInfinity), 2.0f, 4, 5);
    sphere.material_indices.assign(sphere.triangles.size(), 3);
    b.instance(b.mesh(std::move(sphere)), {material, kNone, 1}, look_at(Vec3(1, 2, 3), Vec3(0)), 7);
    b.object(quad_mesh("q", Vec3(0), Vec3(1, 0, 0), Vec3(0, nan, 0)), material);
    b.lamp(area_lamp(look_at(Vec3(1, 2, 3), Vec3(0)), Rgb(5), 1, 2, AreaShape::Ellipse));
    b.lamp(sun_lamp(Mat4(1.0f), Rgb(5), 0.01f));
    b.description().lights[0].cast_shadow = false;
    b.world(background_program(Rgb(0.1f), 2.0f));
    b.camera(Vec3(3, 2, 1), Vec3(0), 0.7f, 64, 48);
    b.settings().guiding = GuidingMode::Slides;
    b.settings().caustics_refractive = false;
    b.description().blender_version = 405;
    b.description().meshes[0].attributes = {
        {"tint", NormalDomain::Face, 4, {0.5f, nan, 1.0f, 2.0f}}};
    b.description().instance_attributes = {{"object:wear", {Vec4(0.25f), Vec4(1, 2, 3, 4)}}};
    b.description().materials[0].program.ops[0].step = Vec2(0.1f, 0.0f);
    b.description().lights[0].program = 0;
    b.description().lights[0].is_portal = true;
    b.description().light_programs = {emission_program(Rgb(0.5f), 2.0f)};
    b.description().materials[0].displacement = emission_program(Rgb(0.1f), 1.0f);
    b.description().materials[0].program.images.at(0).tiles = {{12, 3}};
    b.description().passes = {
        pass_bit(FilmPass::Mist), 1.0f, 2.0f, 0.5f, {7, 8}, {9}, {{"wear", false}}};
    return b.build();
}

TEST(Dump, RoundTripIsBitEqual) {
    const SceneDescription description = full_description();
    const std::vector<std::uint8_t> bytes = dump_to_bytes(description);
    const SceneDescription back = dump_from_bytes(bytes);
    EXPECT_EQ(dump_to_bytes(back), bytes);
    // The comparison of bytes would miss a member that neither side handles.
    EXPECT_EQ(back.blender_version, 405u);
    EXPECT_EQ(back.meshes.at(0).name, "Kugel \xc3\xa4");
    EXPECT_EQ(back.meshes.at(0).material_indices.back(), 3u);
    EXPECT_EQ(back.meshes.at(0).normals, description.meshes.at(0).normals);
    EXPECT_EQ(back.meshes.at(0).positions.at(0).z, kInfinity);
    EXPECT_TRUE(std::isnan(back.meshes.at(1).positions.at(2).y));
    EXPECT_EQ(back.material_sets.at(0), (std::vector<std::uint32_t>{0, kNone, 1}));
    EXPECT_EQ(back.instances.at(0).visibility, 7u);
    EXPECT_EQ(back.instances.at(0).to_world, description.instances.at(0).to_world);
    EXPECT_EQ(back.images.at(0).pixels.size(), 24u);
    EXPECT_EQ(back.images.at(0).color_space, ImageColorSpace::Data);
    EXPECT_EQ(back.materials.at(0).program.images.at(0).extension, ImageExtension::Mirror);
    EXPECT_TRUE(std::signbit(back.materials.at(0).program.tables.at(0).at(3)));
    EXPECT_FALSE(back.materials.at(1).emission_sampling);
    EXPECT_EQ(back.lights.at(0).shape, AreaShape::Ellipse);
    EXPECT_FALSE(back.lights.at(0).cast_shadow);
    EXPECT_EQ(back.lights.at(1).type, LightType::Sun);
    EXPECT_EQ(back.world.program.ops.at(0).code, NodeOpCode::Background);
    EXPECT_TRUE(back.has_camera);
    EXPECT_EQ(back.camera.window_upper, description.camera.window_upper);
    EXPECT_EQ(back.film.crop_height, 48u);
    EXPECT_EQ(back.settings.guiding, GuidingMode::Slides);
    EXPECT_FALSE(back.settings.caustics_refractive);
    EXPECT_EQ(back.meshes.at(0).attributes.at(0).components, 4u);
    EXPECT_EQ(back.meshes.at(0).attributes.at(0).values.at(3), 2.0f);
    EXPECT_EQ(back.instance_attributes.at(0).name, "object:wear");
    EXPECT_EQ(back.instance_attributes.at(0).values.at(1).w, 4.0f);
    EXPECT_EQ(back.materials.at(0).program.ops.at(0).step.x, 0.1f);
    EXPECT_EQ(back.passes.wanted, pass_bit(FilmPass::Mist));
    EXPECT_EQ(back.passes.mist_falloff, 0.5f);
    EXPECT_EQ(back.passes.object_indices, (std::vector<std::uint32_t>{7, 8}));
    EXPECT_EQ(back.lights.at(0).program, 0u);
    EXPECT_TRUE(back.lights.at(0).is_portal);
    EXPECT_EQ(back.lights.at(1).program, kNone);
    EXPECT_EQ(back.light_programs.at(0).ops.at(0).code, NodeOpCode::Emission);
    EXPECT_EQ(back.materials.at(0).displacement.ops.size(), 1u);
    EXPECT_EQ(back.materials.at(0).program.images.at(0).tiles.at(0).number, 12u);
    EXPECT_EQ(back.passes.aovs.at(0).name, "wear");
    EXPECT_FALSE(back.passes.aovs.at(0).color);
}

void forget_attributes(SceneDescription& description) {
    description.instance_attributes.clear();
    for (Mesh& mesh : description.meshes) {
        mesh.attributes.clear();
    }
    for (MaterialDescription& material : description.materials) {
        for (NodeOp& op : material.program.ops) {
            op.step = Vec2(0.0f);
        }
    }
}

void forget_version_4(SceneDescription& description) {
    description.passes.aovs.clear();
    description.light_programs.clear();
    for (LightDescription& light : description.lights) {
        light.program = kNone;
    }
    for (MaterialDescription& material : description.materials) {
        material.displacement = {};
        for (ImageUse& use : material.program.images) {
            use.tiles.clear();
        }
    }
}

// Older versions lack what came later: passes on request, attributes and steps, AOVs.
TEST(Dump, FilesOfOlderVersionsAreRead) {
    for (std::uint32_t version = 1; version < dump::kVersion; ++version) {
        constexpr std::size_t kHeader = 32;
        SceneDescription description = full_description();
        dump::Writer writer(version);
        writer.bytes() = dump_to_bytes(description);
        writer.bytes().resize(kHeader);
        writer(description);
        std::vector<std::uint8_t> bytes = std::move(writer.bytes());
        const std::uint64_t size = bytes.size() - kHeader;
        std::uint64_t checksum = 0xcbf29ce484222325u;
        for (std::size_t i = kHeader; i < bytes.size(); ++i) {
            checksum = (checksum ^ bytes[i]) * 0x100000001b3u;
        }
        bytes[8] = static_cast<std::uint8_t>(version);
        std::memcpy(&bytes[16], &size, sizeof(size));
        std::memcpy(&bytes[24], &checksum, sizeof(checksum));
        description.passes = version < 2 ? PassesDescription() : description.passes;
        for (LightDescription& light : description.lights) {
            light.is_portal = false;
        }
        if (version < 4) {
            forget_version_4(description);
        }
        if (version < 3) {
            forget_attributes(description);
        }
        EXPECT_EQ(dump_to_bytes(dump_from_bytes(bytes)), dump_to_bytes(description)) << version;
    }
}

TEST(Dump, EmptyDescription) {
    const std::vector<std::uint8_t> bytes = dump_to_bytes({});
    EXPECT_EQ(dump_to_bytes(dump_from_bytes(bytes)), bytes);
}

TEST(Dump, FilesHoldTheImagesTheyRefer) {
    const TemporaryDirectory directory;
    const std::string picture = "\x89PNG\r\n\x1a\n and so on";
    const std::string image = directory.file("image.png");
    std::ofstream(image, std::ios::binary) << picture;
    SceneDescription description = full_description();
    description.images.resize(3);
    description.images[1].path = image;
    description.images[2].path = directory.file("missing.png");
    const std::string path = directory.file("scene.pharos");
    write_dump(description, path);
    std::filesystem::remove(image);
    const SceneDescription back = read_dump(path);
    const std::vector<std::uint8_t>& bytes = back.images.at(1).bytes;
    EXPECT_EQ(std::string(bytes.begin(), bytes.end()), picture);
    EXPECT_TRUE(back.images.at(1).path.empty());
    EXPECT_TRUE(back.images.at(2).bytes.empty());
    EXPECT_EQ(back.images.at(2).path, directory.file("missing.png"));
}

// A scene may name any file of its reader's: nothing but pictures gets into a dump.
TEST(Dump, FilesThatAreNoImagesStayOutside) {
    const TemporaryDirectory directory;
    const std::string secret = "a key that belongs to nobody else";
    const std::string name = directory.file("secret.png");
    std::ofstream(name, std::ios::binary) << secret;
    SceneDescription description;
    description.images.resize(1);
    description.images[0].path = name;
    const std::vector<std::uint8_t> bytes = dump_to_bytes(description);
    EXPECT_EQ(std::string(bytes.begin(), bytes.end()).find(secret), std::string::npos);
    EXPECT_EQ(dump_from_bytes(bytes).images.at(0).path, name);
}

TEST(Dump, WritingReplacesAndLeavesNothingBehind) {
    const TemporaryDirectory directory;
    const std::string path = directory.file("scene.pharos");
    std::ofstream(path) << "old";
    write_dump(full_description(), path);
    EXPECT_EQ(dump_to_bytes(read_dump(path)), dump_to_bytes(full_description()));
    EXPECT_EQ(directory.files(), 1u);

    const std::string nowhere = directory.file("no/such/scene.pharos");
    EXPECT_NE(message_of([&] { write_dump({}, nowhere); }).find(nowhere), std::string::npos);
    std::filesystem::create_directory(directory.file("folder"));
    EXPECT_THROW(write_dump({}, directory.file("folder")), std::runtime_error);
    EXPECT_EQ(directory.files(), 2u);
}

TEST(Dump, ErrorsNameFileAndReason) {
    const TemporaryDirectory directory;
    const std::string path = directory.file("x.pharos");
    const auto message = [&] { return message_of([&] { static_cast<void>(read_dump(path)); }); };
    EXPECT_NE(message().find(path), std::string::npos);
    EXPECT_NE(message().find("cannot be read"), std::string::npos);
    std::ofstream(path).close();
    EXPECT_NE(message().find("not a Pharos"), std::string::npos);
    std::ofstream(path) << std::string(1000, 'x');
    EXPECT_NE(message().find("not a Pharos"), std::string::npos);

    const auto store = [&](const std::vector<std::uint8_t>& bytes) {
        std::ofstream(path, std::ios::binary)
            .write(reinterpret_cast<const char*>(bytes.data()),
                   static_cast<std::streamsize>(bytes.size()));
    };
    std::vector<std::uint8_t> bytes = dump_to_bytes(full_description());
    store({bytes.begin(), bytes.end() - 1});
    EXPECT_NE(message().find("truncated"), std::string::npos);
    bytes[100] ^= 1u;
    store(bytes);
    EXPECT_NE(message().find("checksum"), std::string::npos);
    bytes[8] = 77;  // version
    store(bytes);
    EXPECT_NE(message().find("version 77"), std::string::npos);
    EXPECT_THROW(static_cast<void>(read_dump(directory.file("."))), std::runtime_error);
}

TEST(Dump, EveryTruncationAndEveryFlippedBitIsRefused) {
    std::vector<std::uint8_t> bytes = dump_to_bytes(full_description());
    for (std::size_t size = 0; size < bytes.size(); ++size) {
        EXPECT_THROW(static_cast<void>(dump_from_bytes(std::span(bytes).first(size))),
                     std::runtime_error);
    }
    for (std::size_t i = 0; i < bytes.size(); ++i) {
        for (unsigned bit = 0; bit < 8; ++bit) {
            bytes[i] ^= static_cast<std::uint8_t>(1u << bit);
            ASSERT_THROW(static_cast<void>(dump_from_bytes(bytes)), std::runtime_error) << i;
            bytes[i] ^= static_cast<std::uint8_t>(1u << bit);
        }
    }
    EXPECT_NO_THROW(static_cast<void>(dump_from_bytes(bytes)));
}

std::uint64_t checksum(std::span<const std::uint8_t> payload) {
    std::uint64_t hash = 14695981039346656037u;
    for (const std::uint8_t byte : payload) {
        hash ^= byte;
        hash *= 1099511628211u;
    }
    return hash;
}

// Damage under a checksum that fits, as a fuzzer makes it: read or refused, never worse.
TEST(Dump, ForgedContentsAreBoundsChecked) {
    const std::vector<std::uint8_t> sound = dump_to_bytes(full_description());
    constexpr std::size_t kHeader = 32;
    std::mt19937 random(9);
    std::size_t refused = 0;
    for (int round = 0; round < 20000; ++round) {
        std::vector<std::uint8_t> bytes = sound;
        for (unsigned change = 0; change <= random() % 4; ++change) {
            const std::size_t at = kHeader + random() % (bytes.size() - kHeader);
            bytes[at] = static_cast<std::uint8_t>(random() % 3 == 0 ? 0xff : random());
        }
        if (round % 8 == 0) {
            bytes.resize(kHeader + random() % (bytes.size() - kHeader));
        }
        const std::uint64_t size = bytes.size() - kHeader;
        const std::uint64_t hash = checksum(std::span(bytes).subspan(kHeader));
        std::memcpy(bytes.data() + 16, &size, sizeof size);
        std::memcpy(bytes.data() + 24, &hash, sizeof hash);
        try {
            const SceneDescription description = dump_from_bytes(bytes);
            ASSERT_LT(description.meshes.size(), bytes.size());
        } catch (const std::runtime_error&) {
            ++refused;
        }
    }
    EXPECT_GT(refused, 1000u);
    EXPECT_LT(refused, 19999u);
}

}  // namespace
}  // namespace pharos::testing
