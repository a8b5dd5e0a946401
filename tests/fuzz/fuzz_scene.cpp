// Everything the add-on can hand over: the bytes of an input become the values of a description,
// member by member, and the description is built and rendered. The first bytes say which parts are
// taken from the input; the others are those of a sound scene.
#include <array>
#include <cstring>
#include <iterator>
#include <limits>
#include <span>
#include <string>
#include <type_traits>

#include "render_tiny.h"
#include "scene/dump_fields.h"
#include "support/description_builders.h"

namespace {

using namespace pharos;

constexpr float kInfinite = std::numeric_limits<float>::infinity();
constexpr float kOddNumbers[] = {0.0f,
                                 -0.0f,
                                 1.0f,
                                 -1.0f,
                                 kInfinite,
                                 -kInfinite,
                                 std::numeric_limits<float>::quiet_NaN(),
                                 std::numeric_limits<float>::max(),
                                 std::numeric_limits<float>::min(),
                                 std::numeric_limits<float>::denorm_min(),
                                 1e-20f,
                                 1e20f,
                                 -1e20f,
                                 1e-6f,
                                 1e6f,
                                 3.14159265f};
constexpr const char* kNames[] = {"", "UVMap", "Col", "generated", "\xff\xfe", "a name, longer"};
constexpr std::size_t kMostElements = 9;

// An archive as dumps use it (scene/dump_archive.h), that makes values up from bytes. Zeros follow
// the end of the input.
class Maker {
  public:
    template <class T>
    using Value = T;

    explicit Maker(std::span<const std::uint8_t> bytes) : rest_(bytes) {}

    [[nodiscard]] static std::uint32_t version() { return dump::kVersion; }

    template <class... T>
    void operator()(T&... values) {
        (make(values), ...);
    }

    static ImageDescription& self_contained(ImageDescription& image, ImageDescription& /*copy*/) {
        return image;
    }

    [[nodiscard]] std::uint8_t byte() {
        std::uint8_t value = 0;
        raw(value);
        return value;
    }

  private:
    template <class T>
    void raw(T& value) {
        value = T{};
        const std::size_t size = std::min(sizeof(T), rest_.size());
        std::memcpy(static_cast<void*>(&value), rest_.data(), size);
        rest_ = rest_.subspan(size);
    }

    // Small numbers mostly, so that shapes meet and indices are in range.
    void make(float& value) {
        const std::uint8_t kind = byte();
        if (kind < 160) {
            value = (static_cast<float>(kind) - 80.0f) / 16.0f;
        } else if (kind < 240) {
            value = kOddNumbers[kind % std::size(kOddNumbers)];
        } else {
            raw(value);
        }
    }

    template <class T>
    void make(T& value) {
        if constexpr (std::is_same_v<T, bool>) {
            value = byte() % 2 != 0;
        } else if constexpr (std::is_integral_v<T>) {
            const std::uint8_t kind = byte();
            value = static_cast<T>(kind % 8);
            if (kind > 224) {
                raw(value);
            }
        } else if constexpr (std::is_same_v<T, NodeOpCode>) {
            value = static_cast<NodeOpCode>(byte());
        } else if constexpr (std::is_enum_v<T>) {
            value = static_cast<T>(byte() % (static_cast<unsigned>(last_enumerator(value)) + 1));
        } else if constexpr (std::is_same_v<T, Mat4>) {
            for (int column = 0; column < 4; ++column) {
                make(value[column]);
            }
        } else if constexpr (dump::kPlain<T>) {
            for (int i = 0; i < T::length(); ++i) {
                make(value[i]);
            }
        } else {
            fields(*this, value);
        }
    }

    void make(std::string& text) { text = kNames[byte() % std::size(kNames)]; }

    template <class T>
    void make(std::vector<T>& values) {
        values.clear();
        for (std::size_t left = byte() % kMostElements; left > 0 && !rest_.empty(); --left) {
            make(values.emplace_back());
        }
    }

    std::span<const std::uint8_t> rest_;
};

// Few triangles, so that most of the time goes into what the input says.
SceneDescription sound_scene() {
    testing::SceneBuilder builder;
    const auto white = builder.material("white", testing::diffuse_program(Rgb(0.8f)));
    const auto gloss = builder.material("gloss", testing::glossy_program(Rgb(0.8f), 0.2f));
    builder.object(testing::box_mesh("room", Vec3(-2, -2, 0), Vec3(2, 2, 2.5f), true), white);
    builder.object(testing::box_mesh("box", Vec3(-1, -1, 0), Vec3(0, 0, 1)), gloss);
    builder.lamp(testing::point_lamp(Vec3(0, 0, 2), Rgb(50.0f), 0.1f));
    builder.camera(Vec3(0, -1.9f, 1.2f), Vec3(0, 0, 1), 1.0f, 4, 4);
    SceneDescription description = builder.build();
    description.settings.samples = 2;
    return description;
}

// Numbers whose size is the time a render takes: large ones have tests of their own.
void limit(SceneDescription& d) {
    RenderSettings& settings = d.settings;
    for (std::uint32_t* bounces : {&settings.max_bounces,
                                   &settings.diffuse_bounces,
                                   &settings.glossy_bounces,
                                   &settings.transmission_bounces,
                                   &settings.transparent_bounces}) {
        *bounces = std::min(*bounces, 32u);
    }
    d.world.map_resolution = std::min(d.world.map_resolution, 64u);
    d.film.width = std::clamp(d.film.width, 1u, 64u);
    d.film.height = std::clamp(d.film.height, 1u, 64u);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const SceneDescription sound = sound_scene();
    Maker make(std::span(data, size));
    SceneDescription d = sound;
    const unsigned parts = make.byte() | static_cast<unsigned>(make.byte()) << 8;
    const auto take = [&](unsigned bit, auto& part) {
        if ((parts >> bit & 1) != 0) {
            make(part);
        }
    };
    take(0, d.meshes);
    take(1, d.materials);
    take(2, d.material_sets);
    take(3, d.instances);
    take(4, d.images);
    take(5, d.lights);
    take(6, d.light_programs);
    take(7, d.world);
    take(8, d.camera);
    take(9, d.film);
    take(10, d.settings);
    take(11, d.passes);
    take(12, d.instance_attributes);
    take(13, d.blender_version);
    take(14, d.has_camera);
    limit(d);
    fuzzing::render_tiny(std::move(d));
    return 0;
}
