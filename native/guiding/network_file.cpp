// The field's file: header, the five arrays of floats without padding rows, checksum of all before
// it. Little endian, as the machine.
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string>

#include "core/checksum.h"
#include "guiding/network_state.h"

namespace pharos {
namespace {

inline constexpr std::uint32_t kVersion = 1;

struct FileHeader {
    char magic[8] = {'P', 'H', 'R', 'F', 'I', 'E', 'L', 'D'};
    std::uint32_t version = kVersion;
    std::uint32_t floats = 0;  // of one array
    // Architecture: must equal the field's own.
    std::uint32_t shape[12] = {};
    float kappa_max = 0.0f;
    float leaky_slope = 0.0f;
    float center[3] = {};
    float inverse_half_extent[3] = {};
    float radiance_scale = 0.0f;
    float published_scale = 0.0f;
    std::uint64_t step = 0;
    std::uint64_t generation = 0;
};

static_assert(sizeof(FileHeader) == 8 + 4 + 4 + 48 + 40 + 16);

[[noreturn]] void fail(const char* what) {
    throw std::invalid_argument(std::string("guiding field file: ") + what);
}

// Which parameters mean something: calls visit(offset, count) for each run without padding.
template <class Visit>
void for_each_run(const NetworkLayout& layout, const Visit& visit) {
    for (int l = 0; l < layout.layers; ++l) {
        const LayerShape& shape = layout.layer[static_cast<std::size_t>(l)];
        const auto outputs = static_cast<std::size_t>(shape.outputs);
        visit(shape.weights, outputs * static_cast<std::size_t>(shape.inputs));
        visit(shape.biases, outputs);
    }
    if (layout.grid_parameters > 0) {
        visit(layout.mlp_parameters, layout.grid_parameters);
    }
}

FileHeader make_header(const NetworkLayout& layout, const NetworkState& state) {
    const GuidingConfig& c = layout.config;
    FileHeader header;
    for_each_run(layout, [&](std::size_t, std::size_t count) {
        header.floats += static_cast<std::uint32_t>(count);
    });
    const std::uint32_t shape[12] = {static_cast<std::uint32_t>(c.encoding),
                                     static_cast<std::uint32_t>(c.octaves),
                                     c.use_normal ? 1u : 0u,
                                     static_cast<std::uint32_t>(c.grid_levels),
                                     static_cast<std::uint32_t>(c.grid_features),
                                     static_cast<std::uint32_t>(c.grid_log2_size),
                                     static_cast<std::uint32_t>(c.width),
                                     static_cast<std::uint32_t>(c.hidden_layers),
                                     static_cast<std::uint32_t>(c.lobes),
                                     static_cast<std::uint32_t>(c.mu),
                                     static_cast<std::uint32_t>(c.kappa),
                                     c.target_cosine ? 1u : 0u};
    std::memcpy(header.shape, shape, sizeof(shape));
    header.kappa_max = c.kappa_max;
    header.leaky_slope = c.leaky_slope;
    for (int axis = 0; axis < 3; ++axis) {
        header.center[axis] = state.center[axis];
        header.inverse_half_extent[axis] = state.inverse_half_extent[axis];
    }
    header.radiance_scale = state.radiance_scale;
    header.published_scale = state.published_scale;
    header.step = state.step;
    header.generation = state.generation;
    return header;
}

void append(std::vector<std::byte>& out, const void* data, std::size_t bytes) {
    const auto* p = static_cast<const std::byte*>(data);
    out.insert(out.end(), p, p + bytes);
}

void check_header(const FileHeader& header, const FileHeader& own) {
    if (std::memcmp(header.magic, own.magic, sizeof(own.magic)) != 0) {
        fail("not a guiding field");
    }
    if (header.version != own.version) {
        fail("version is not supported");
    }
    if (std::memcmp(header.shape, own.shape, sizeof(own.shape)) != 0 ||
        header.floats != own.floats || header.kappa_max != own.kappa_max ||
        header.leaky_slope != own.leaky_slope) {
        fail("made with other network settings");
    }
}

}  // namespace

std::vector<std::byte> save_state(const NetworkLayout& layout, const NetworkState& state) {
    const FileHeader header = make_header(layout, state);
    std::vector<std::byte> out;
    out.reserve(sizeof(header) + 5 * sizeof(float) * header.floats + sizeof(std::uint64_t));
    append(out, &header, sizeof(header));
    for (const AlignedFloats* array : {&state.published,
                                       &state.average,
                                       &state.parameters,
                                       &state.first_moment,
                                       &state.second_moment}) {
        for_each_run(layout, [&](std::size_t offset, std::size_t count) {
            append(out, array->data() + offset, count * sizeof(float));
        });
    }
    const std::uint64_t sum = fnv1a(std::span(out));
    append(out, &sum, sizeof(sum));
    return out;
}

void load_state(const NetworkLayout& layout, std::span<const std::byte> data, NetworkState& state) {
    const FileHeader own = make_header(layout, state);
    FileHeader header;
    if (data.size() < sizeof(header) + sizeof(std::uint64_t)) {
        fail("too short");
    }
    std::memcpy(&header, data.data(), sizeof(header));
    check_header(header, own);
    if (data.size() != sizeof(header) + 5 * sizeof(float) * own.floats + sizeof(std::uint64_t)) {
        fail("wrong length");
    }
    const std::span<const std::byte> body = data.first(data.size() - sizeof(std::uint64_t));
    std::uint64_t sum = 0;
    std::memcpy(&sum, data.data() + body.size(), sizeof(sum));
    if (sum != fnv1a(body)) {
        fail("checksum is wrong");
    }
    NetworkState loaded = state;
    const std::byte* next = body.data() + sizeof(header);
    for (AlignedFloats* array : {&loaded.published,
                                 &loaded.average,
                                 &loaded.parameters,
                                 &loaded.first_moment,
                                 &loaded.second_moment}) {
        for_each_run(layout, [&](std::size_t offset, std::size_t count) {
            std::memcpy(array->data() + offset, next, count * sizeof(float));
            next += count * sizeof(float);
        });
        if (!all_finite(*array)) {
            fail("holds values that are not finite");
        }
    }
    for (int axis = 0; axis < 3; ++axis) {
        loaded.center[axis] = header.center[axis];
        loaded.inverse_half_extent[axis] = header.inverse_half_extent[axis];
    }
    const auto usable = [](float x) { return x >= 0.0f && std::isfinite(x); };
    if (!is_finite(loaded.center) || !is_finite(loaded.inverse_half_extent) ||
        !usable(header.radiance_scale) || !usable(header.published_scale)) {
        fail("holds values that are not finite");
    }
    loaded.radiance_scale = header.radiance_scale;
    loaded.published_scale = header.published_scale;
    loaded.step = header.step;
    loaded.generation = header.generation;
    state = std::move(loaded);
}

}  // namespace pharos
