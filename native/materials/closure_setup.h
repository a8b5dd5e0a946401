// From a shader node's plain inputs to scattering closures (cycles-parity 2.5 to 2.9).
//
// Contract: any input is safe. NaN counts as zero (a normal: as ctx.ns), negative weights and
// out-of-range values are clamped as the running Blender's version clamps them, and a closure whose
// |average weight| is below 1e-5 is dropped. Normals are world space on wo's side (an unconnected
// normal socket: pass ctx.ns); the correction that keeps mirror directions above the surface is
// applied here. Sample weights are average(weight) times an estimate of the lobe's albedo.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/math.h"
#include "materials/bsdf.h"
#include "materials/node_program.h"

namespace pharos {

// What set-up needs to know of the hit.
struct ClosureSetupContext {
    Vec3 wo;
    Vec3 ns;       // interpolated normal, on wo's side
    Vec3 ng;       // geometric normal, on wo's side
    Vec3 tangent;  // default tangent of anisotropic lobes; zero: none known
    std::uint32_t blender_version = 304;
    bool front_face = true;
};

// Appends closures to storage of fixed size. When it is full, the closure that matters least goes
// (smallest sample weight) and is counted. Transparent closures are merged into one.
class ClosureSink {
  public:
    // Uses at most kMaxClosures elements of `storage`.
    explicit ClosureSink(std::span<Closure> storage);

    void add(const Closure& closure);

    [[nodiscard]] std::size_t count() const { return count_; }

    [[nodiscard]] std::size_t dropped() const { return dropped_; }

    // Of the closures kept: Bsdf::total_sample_weight.
    [[nodiscard]] float total_sample_weight() const;

    [[nodiscard]] std::span<const Closure> closures() const { return storage_.first(count_); }

  private:
    std::span<Closure> storage_;
    std::size_t count_ = 0;
    std::size_t dropped_ = 0;
};

// Inputs of the plain shader nodes; a node ignores what it does not have.
struct ScatterInputs {
    Rgb weight{1.0f};  // of the closure in the tree (Mix and Add Shader)
    Rgb color{0.8f};
    float roughness = 0.0f;
    float ior = 1.45f;
    Vec3 normal;
    Distribution distribution = Distribution::Ggx;
    // Special nodes; toon's size and velvet's sigma are the roughness.
    float anisotropy = 0.0f;
    float rotation = 0.0f;  // turns
    Vec3 tangent;           // zero: ctx.tangent
    Rgb edge{1.0f};         // metallic: tint towards grazing, or extinction
    float smooth = 0.0f;    // toon
    bool physical = false;  // metallic: color and edge are complex indices
    bool glossy = false;    // toon
};

void setup_diffuse(const ScatterInputs& in, const ClosureSetupContext& ctx, ClosureSink& sink);
void setup_glossy(const ScatterInputs& in, const ClosureSetupContext& ctx, ClosureSink& sink);
void setup_glass(const ScatterInputs& in, const ClosureSetupContext& ctx, ClosureSink& sink);
void setup_refraction(const ScatterInputs& in, const ClosureSetupContext& ctx, ClosureSink& sink);
void setup_transparent(const ScatterInputs& in, const ClosureSetupContext& ctx, ClosureSink& sink);
void setup_translucent(const ScatterInputs& in, const ClosureSetupContext& ctx, ClosureSink& sink);

void setup_anisotropic(const ScatterInputs& in, const ClosureSetupContext& ctx, ClosureSink& sink);
void setup_metallic(const ScatterInputs& in, const ClosureSetupContext& ctx, ClosureSink& sink);
void setup_toon(const ScatterInputs& in, const ClosureSetupContext& ctx, ClosureSink& sink);
void setup_velvet(const ScatterInputs& in, const ClosureSetupContext& ctx, ClosureSink& sink);
void setup_sheen(const ScatterInputs& in, const ClosureSetupContext& ctx, ClosureSink& sink);

// Principled BSDF of Blender 3.x; fields in operand order.
struct PrincipledV1Inputs {
    Rgb weight{1.0f};
    Rgb base_color{0.8f};
    float subsurface = 0.0f;
    Rgb subsurface_color{0.8f};
    float metallic = 0.0f;
    float specular = 0.5f;
    float specular_tint = 0.0f;
    float roughness = 0.5f;
    float anisotropic = 0.0f;
    float anisotropic_rotation = 0.0f;
    float sheen = 0.0f;
    float sheen_tint = 0.5f;
    float clearcoat = 0.0f;
    float clearcoat_roughness = 0.03f;
    float ior = 1.45f;
    float transmission = 0.0f;
    float transmission_roughness = 0.0f;
    Vec3 normal;
    Vec3 clearcoat_normal;
    Vec3 tangent;  // zero: ctx.tangent
    Distribution distribution = Distribution::Ggx;
};

// Principled BSDF of Blender 4.x; fields in operand order.
struct PrincipledV2Inputs {
    Rgb weight{1.0f};
    Rgb base_color{0.8f};
    float metallic = 0.0f;
    float roughness = 0.5f;
    float ior = 1.5f;
    float diffuse_roughness = 0.0f;
    float subsurface_weight = 0.0f;
    float specular_ior_level = 0.5f;
    Rgb specular_tint{1.0f};
    float anisotropic = 0.0f;
    float anisotropic_rotation = 0.0f;
    float transmission_weight = 0.0f;
    float coat_weight = 0.0f;
    float coat_roughness = 0.03f;
    float coat_ior = 1.5f;
    Rgb coat_tint{1.0f};
    float sheen_weight = 0.0f;
    float sheen_roughness = 0.5f;
    Rgb sheen_tint{1.0f};
    Rgb emission_color{1.0f};
    float emission_strength = 0.0f;
    float thin_film_thickness = 0.0f;
    float thin_film_ior = 1.33f;
    float alpha = 1.0f;
    Vec3 normal;
    Vec3 coat_normal;
    Vec3 tangent;  // zero: ctx.tangent
    Distribution distribution = Distribution::MultiGgx;
};

void setup_principled_v1(const PrincipledV1Inputs& in,
                         const ClosureSetupContext& ctx,
                         ClosureSink& sink);

// Returns the weight of the emission (weight x alpha, attenuated by sheen and coat): the caller
// multiplies it by emission_color x emission_strength.
[[nodiscard]] Rgb setup_principled_v2(const PrincipledV2Inputs& in,
                                      const ClosureSetupContext& ctx,
                                      ClosureSink& sink);

// The same emission weight alone, without building closures.
[[nodiscard]] Rgb principled_v2_emission_weight(const PrincipledV2Inputs& in,
                                                const ClosureSetupContext& ctx);

// The shading normal tilted towards ng just as far as the mirror direction of wo needs to stay
// above the surface (cycles-parity 2.5, "reflection fix"); n itself where it already does.
[[nodiscard]] Vec3 ensure_valid_reflection(const Vec3& ng, const Vec3& wo, const Vec3& n);

}  // namespace pharos
