// Node programs of any operations and operands: compiled, and evaluated over a few hits.
#include <cstring>

#include "core/check.h"
#include "materials/material.h"

namespace {

using namespace pharos;

// Takes values from the front of the input; zeros at its end.
class Input {
  public:
    Input(const std::uint8_t* data, std::size_t size) : rest_(data, size) {}

    template <class T>
    [[nodiscard]] T take() {
        T value{};
        const std::size_t n = std::min(sizeof(T), rest_.size());
        std::memcpy(&value, rest_.data(), n);
        rest_ = rest_.subspan(n);
        return value;
    }

    [[nodiscard]] bool empty() const { return rest_.empty(); }

  private:
    std::span<const std::uint8_t> rest_;
};

NodeProgram program_from(Input& in) {
    NodeProgram p;
    p.register_count = in.take<std::uint16_t>() % 600;
    for (std::size_t n = in.take<std::uint8_t>() % 32; n > 0; --n) {
        p.constants.push_back(in.take<float>());
    }
    while (!in.empty() && p.ops.size() < 64) {
        NodeOp op;
        op.code = static_cast<NodeOpCode>(in.take<std::uint8_t>());
        op.mode = in.take<std::uint8_t>();
        op.operand_count = in.take<std::uint8_t>() % 40;
        op.first_operand = static_cast<std::uint32_t>(p.operands.size());
        op.output = in.take<std::int16_t>();
        for (std::uint32_t k = 0; k < op.operand_count; ++k) {
            p.operands.push_back(in.take<std::int16_t>());
        }
        p.ops.push_back(op);
    }
    return p;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    Input in(data, size);
    const std::vector<Texture> textures(1);
    SceneReport report;
    const Material material = compile_material("fuzz", program_from(in), report, textures);
    ShadingContext context;
    context.textures = textures;
    std::vector<SurfaceInteraction> hits(3);
    hits[1].p = Vec3(1e30f, -1e-30f, 3.0f);
    hits[2].u = -7.5f;
    hits[2].v = 1e9f;
    for (SurfaceInteraction& hit : hits) {
        hit.ns = hit.ng = hit.wo = Vec3(0, 0, 1);
    }
    ShadingScratch scratch;
    std::vector<Rgb> values(hits.size());
    evaluate_emission(material, context, hits, scratch, values);
    evaluate_transparency(material, context, hits, scratch, values);
    const std::vector<Vec3> directions{Vec3(0, 0, 1), Vec3(1, 0, 0), Vec3(0.0f)};
    evaluate_world(material, context, directions, scratch, values);
    return 0;
}
