// All lights of a scene behind one interface: lamps, emissive triangles, world. Chooses a light for
// a point (by an estimate of each one's contribution there, of many along a tree), samples it, and
// returns the density of the same choice for a light that a ray met by chance.
//
// Built once per scene; const and thread-safe afterwards. Order is that of the description.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/cancel.h"
#include "core/math.h"
#include "geometry/accelerator.h"
#include "geometry/mesh.h"
#include "lights/environment_light.h"
#include "lights/light.h"
#include "lights/light_description.h"

namespace pharos {

// Triangles of one instance and material slot that emit.
struct EmissiveTriangle {
    std::uint32_t instance = 0;
    std::uint32_t triangle = 0;
    Rgb L_estimate{0.0f};  // radiance for choosing; the sampled radiance comes from the material
};

struct LightSamplerInput {
    std::span<const LightDescription> lamps;
    std::span<const float> lamp_scales;  // mean emission of the lamps' programs; empty: 1
    std::uint32_t blender_version = 304;
    std::span<const EmissiveTriangle> triangles;
    std::span<const Mesh> meshes;
    std::span<const Instance> instances;
    // Null, black, or constant without portals: not sampled.
    const EnvironmentLight* environment = nullptr;
    const CancelFlag* cancel = nullptr;  // polled where it is not null; Cancelled is thrown
};

// A sample on an emissive triangle or the world still needs its radiance from a node program.
struct LightSamplerSample {
    LightSample sample;  // L is 0 for an emissive triangle and for the world
    bool environment = false;
    std::uint32_t instance = 0xffffffffu;  // of the emissive triangle, else kNone
    std::uint32_t triangle = 0xffffffffu;
    std::uint32_t material = 0xffffffffu;  // its material
    float u = 0.0f;                        // barycentrics on it
    float v = 0.0f;
    std::uint32_t lamp = 0;               // for lamp_point()
    std::uint32_t light = 0;              // the lamp's place in the description
    std::uint32_t program = 0xffffffffu;  // of the lamp: what it emits multiplies L
};

// A ray that may meet lamps; `context` as in intersect_lamps().
struct LampRay {
    Ray ray;
    const LightSampleContext* context = nullptr;
};

class LightSampler {
  public:
    explicit LightSampler(const LightSamplerInput& input);
    ~LightSampler();
    LightSampler(LightSampler&&) noexcept;

    [[nodiscard]] bool empty() const;  // nothing to sample: next-event estimation is skipped

    // Chooses a light for each query; some receivers at once cost less than one by one.
    void choose(std::span<LightQuery> queries) const;

    // Samples the chosen light; nullopt where nothing arrives.
    [[nodiscard]] std::optional<LightSamplerSample> sample(const LightQuery& query) const;

    // Both for one receiver.
    [[nodiscard]] std::optional<LightSamplerSample> sample(const LightSampleContext& context,
                                                           float u_choice,
                                                           const Vec2& u) const;

    // Nearest lamp with a surface (area, sphere, spot with radius; not delta) in (t_min, t_max)
    // that a BSDF or camera ray may hit; `context` is null for camera rays (pdf 0).
    [[nodiscard]] std::optional<LightHit> intersect_lamps(const Ray& ray,
                                                          const LightSampleContext* context) const;

    // The same of several rays at once, which costs less.
    void intersect_lamps(std::span<const LampRay> rays,
                         std::span<std::optional<LightHit>> hits) const;
    [[nodiscard]] bool has_hittable_lamps() const;

    // Suns with an angle seen by an escaped ray (each one's radiance along wi and NEE density).
    [[nodiscard]] std::uint32_t sun_count() const;
    [[nodiscard]] std::optional<LightHit> sun_hit(std::uint32_t sun,
                                                  const Vec3& wi,
                                                  const LightSampleContext* context) const;

    // The point of a sampled or hit lamp that lies in direction wi from `from`.
    [[nodiscard]] LampPoint lamp_point(std::uint32_t lamp,
                                       const Vec3& from,
                                       const Vec3& wi,
                                       float distance) const;

    // Density of sampling the world along wi, choice included.
    [[nodiscard]] float pdf_environment(const LightSampleContext& context, const Vec3& wi) const;

    // Density of sampling the point of triangle (instance, triangle) seen from context along wi at
    // distance t with geometric normal ng; 0 when that triangle is not sampled.
    [[nodiscard]] float pdf_triangle(const LightSampleContext& context,
                                     std::uint32_t instance,
                                     std::uint32_t triangle,
                                     float t,
                                     float cos_light) const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace pharos
