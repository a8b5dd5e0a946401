// Weights, guide files and checkpoints of any contents: as they are, and with a checksum that fits,
// so that only the bounds stand between them and the render that goes on from them.
#include <cstring>
#include <stdexcept>

#include "core/checksum.h"
#include "core/parallel.h"
#include "film/film.h"
#include "session/checkpoint.h"
#include "session/field_file.h"

namespace {

using namespace pharos;

constexpr std::uint32_t kSize = 4;
constexpr GuidingMode kMode = GuidingMode::Neural;

Bounds3 box() {
    Bounds3 bounds;
    bounds.lower = Vec3(-1.0f);
    bounds.upper = Vec3(1.0f);
    return bounds;
}

FilmDescription frame() {
    FilmDescription film;
    film.width = film.height = film.crop_width = film.crop_height = kSize;
    return film;
}

GuideController new_guide() {
    return GuideController(kMode, box(), kSize * kSize);
}

// A sound file with some of its bytes replaced: five bytes of input say where and what.
std::vector<std::byte> forged(std::vector<std::byte> whole, std::span<const std::uint8_t> input) {
    for (std::size_t i = 0; i + 5 <= input.size(); i += 5) {
        std::uint32_t at = 0;
        std::memcpy(&at, &input[i], sizeof(at));
        whole[at % whole.size()] = static_cast<std::byte>(input[i + 4]);
    }
    return whole;
}

// The checksum of state files at the end becomes that of what is before it.
void make_sound(std::vector<std::byte>& bytes) {
    StreamChecksum checksum;
    checksum.add(std::span(bytes).first(bytes.size() - sizeof(std::uint64_t)));
    const std::uint64_t sum = checksum.value();
    std::memcpy(&bytes[bytes.size() - sizeof(sum)], &sum, sizeof(sum));
}

// What was taken has to be usable: asked, learned on, and saved again.
void use(GuideController& guide) {
    const GuidingContext context = guide.next_pass();
    if (context.selection != nullptr) {
        static_cast<void>(context.selection->alpha(Vec3(0.3f), Vec3(0, 0, 1), true));
    }
    if (context.field != nullptr) {
        const std::vector<float> x(32, 0.4f);
        std::vector<VmfMixture> mixtures(x.size());
        context.field->evaluate({x, x, x, x, x, x}, mixtures);
    }
    ThreadPool pool(1);
    const Film film(frame());
    guide.learn({}, {1.0, 1.0, 1.0}, film, pool);
    static_cast<void>(field_to_bytes(guide, kMode));
}

void read_field(std::span<const std::byte> bytes) {
    try {
        GuideController guide = new_guide();
        freeze_field(bytes, kMode, guide);
        use(guide);
        GuideController learning = continue_field(bytes, {kMode, box(), kSize * kSize});
        use(learning);
    } catch (const StateError&) {
        return;
    }
}

void read_controller(std::span<const std::byte> bytes) {
    try {
        GuideController guide = new_guide();
        Film film(frame());
        StateReader in(bytes);
        film.load(in);
        guide.load(in);
        use(guide);
        std::vector<float> pixels(kSize * kSize * 4);
        film.read(FilmPass::Combined, pixels);
    } catch (const StateError&) {
        return;
    }
}

void read_weights(std::span<const std::byte> bytes) {
    try {
        GuidingField field(guiding_config(kMode), box());
        field.load(bytes);
    } catch (const std::invalid_argument&) {
        return;
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const std::vector<std::byte> field = field_to_bytes(new_guide(), kMode);
    static const std::vector<std::byte> checkpoint = state_bytes([](StateWriter& out) {
        Film(frame()).save(out);
        new_guide().save(out);
    });
    static const std::vector<std::byte> weights = GuidingField(guiding_config(kMode), box()).save();
    if (size == 0) {
        return 0;
    }
    const std::span<const std::uint8_t> input(data + 1, size - 1);
    switch (data[0] % 4) {
        case 0:
            read_field(std::as_bytes(input));
            break;
        case 1: {
            std::vector<std::byte> bytes = forged(field, input);
            make_sound(bytes);
            read_field(bytes);
            break;
        }
        case 2:
            read_controller(forged(checkpoint, input));
            break;
        default:
            read_weights(forged(weights, input));
            break;
    }
    return 0;
}
