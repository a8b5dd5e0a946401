#include "session/field_probe.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "core/cancel.h"
#include "core/color.h"
#include "core/fp_state.h"
#include "geometry/ray_offset.h"
#include "integrator/integrator.h"
#include "sampling/sampler.h"
#include "scene/scene.h"
#include "session/guide_controller.h"

namespace pharos {

namespace {

constexpr double kRecordsPerPass = 32768.0;
constexpr float kShare = 0.5f;             // of the guide while it learns
constexpr std::uint32_t kSubdivision = 4;  // points of the learned picture along a pixel's sides
constexpr std::uint32_t kJitterSet = 0x20000u;

// Learns from whole passes; the field serves as soon as it has learned anything.
void train(const Scene& scene, Integrator& integrator, ThreadPool& pool, GuidingField& field) {
    const FilmDescription& film = scene.description.film;
    SharedFilm picture(film);
    const CancelFlag never;
    GuidingContext context;
    context.record = true;
    context.record_probability = 1.0f;
    for (std::uint32_t sample = 0; sample < scene.description.settings.samples; ++sample) {
        if (field.generation() > 0) {
            context.field = &field;
            context.fixed_share = {kShare, kShare};
        }
        integrator.render_pass({sample, 1}, context, picture, {never, {}});
        const RecordBuffer records = integrator.take_records();
        field.train(records.radiance, pool);
        const double recorded = static_cast<double>(records.radiance.size());
        if (recorded > 0.0) {
            const double share =
                kRecordsPerPass * static_cast<double>(context.record_probability) / recorded;
            context.record_probability = static_cast<float>(std::clamp(share, 0.005, 1.0));
        }
    }
}

[[nodiscard]] SurfaceInteraction first_hit(const Scene& scene, const ProbeSettings& settings) {
    const SceneDescription& d = scene.description;
    const Camera camera(scene.camera(), d.film.width, d.film.height);
    const Vec2 pixel(static_cast<float>(settings.x) + 0.5f, static_cast<float>(settings.y) + 0.5f);
    const Ray ray = camera.generate_ray(pixel, Vec2(0.5f));
    const std::uint32_t visibility = kVisibleCamera;
    Hit hit;
    scene.accelerator->intersect(std::span(&ray, 1), std::span(&visibility, 1), std::span(&hit, 1));
    if (hit.instance == kNone) {
        throw std::invalid_argument("field: the camera sees no surface at pixel " +
                                    std::to_string(settings.x) + "," + std::to_string(settings.y));
    }
    return scene.interaction(ray, hit);
}

[[nodiscard]] VmfMixture ask(const GuidingField& field, const SurfaceInteraction& surface) {
    std::array<float, 6> at{};
    for (int axis = 0; axis < 3; ++axis) {
        at[static_cast<std::size_t>(axis)] = surface.p[axis];
        at[static_cast<std::size_t>(axis) + 3] = surface.ns[axis];
    }
    const auto one = [&](std::size_t i) { return std::span<const float>(&at[i], 1); };
    VmfMixture mixture;
    field.evaluate({one(0), one(1), one(2), one(3), one(4), one(5)}, std::span(&mixture, 1));
    return mixture;
}

void draw_learned(FieldProbe& probe) {
    const auto width = static_cast<float>(probe.width * kSubdivision);
    const auto height = static_cast<float>(probe.height * kSubdivision);
    for (std::uint32_t y = 0; y < probe.height; ++y) {
        for (std::uint32_t x = 0; x < probe.width; ++x) {
            double sum = 0.0;
            for (std::uint32_t i = 0; i < kSubdivision * kSubdivision; ++i) {
                const std::uint32_t row = y * kSubdivision + i / kSubdivision;
                const auto u = static_cast<float>(x * kSubdivision + i % kSubdivision);
                const auto v = static_cast<float>(row);
                const Vec3 w = latlong_direction((u + 0.5f) / width, (v + 0.5f) / height);
                sum += static_cast<double>(mixture_pdf(probe.mixture, w));
            }
            probe.learned[std::size_t{y} * probe.width + x] =
                probe.mixture.A * static_cast<float>(sum / (kSubdivision * kSubdivision));
        }
    }
}

// Paths from the surface into every cell of the grid, jittered within it. Opaque surfaces have no
// light from behind.
void draw_truth(const Scene& scene,
                const SurfaceInteraction& surface,
                const ProbeSettings& settings,
                Integrator& integrator,
                FieldProbe& probe) {
    const bool both_sides = scene.materials[surface.material].transmits;
    const bool cosine = guiding_config(scene.description.settings.guiding).target_cosine;
    const std::size_t cells = probe.truth.size();
    std::vector<Ray> rays(cells);
    std::vector<float> weights(cells);
    std::vector<Rgb> radiance(cells);
    std::vector<double> sums(cells);
    for (std::uint32_t sample = 0; sample < settings.rays; ++sample) {
        for (std::uint32_t i = 0; i < cells; ++i) {
            const Vec4 u =
                sobol_4d(pixel_hash(scene.description.settings.seed, i, 1), sample, kJitterSet);
            const std::uint32_t row = i / probe.width;
            const auto x = static_cast<float>(i % probe.width);
            const auto y = static_cast<float>(row);
            const Vec3 w = latlong_direction((x + u.x) / static_cast<float>(probe.width),
                                             (y + u.y) / static_cast<float>(probe.height));
            const float cos_i = glm::dot(surface.ns, w);
            const bool inside = glm::dot(surface.ng, w) <= 0.0f || cos_i <= 0.0f;
            weights[i] = inside && !both_sides ? 0.0f : cosine ? std::abs(cos_i) : 1.0f;
            rays[i] = Ray{};
            rays[i].origin = offset_ray_origin(surface.p, surface.ng, surface.p_error, w);
            rays[i].direction = w;
        }
        integrator.trace_incident(rays, sample, radiance);
        for (std::size_t i = 0; i < cells; ++i) {
            sums[i] += static_cast<double>(luminance(radiance[i]) * weights[i]);
        }
    }
    for (std::size_t i = 0; i < cells; ++i) {
        probe.truth[i] = static_cast<float>(sums[i] / settings.rays);
    }
}

}  // namespace

Vec3 latlong_direction(float u, float v) {
    const float phi = (2.0f * u - 1.0f) * kPi;
    const float theta = (1.0f - v) * kPi;
    return {std::cos(phi) * std::sin(theta), std::sin(phi) * std::sin(theta), std::cos(theta)};
}

double latlong_divergence(std::span<const float> truth,
                          std::span<const float> learned,
                          std::uint32_t height) {
    constexpr double kFloor = 1e-6;  // of the mean: what was left out counts, but not infinitely
    const std::size_t width = truth.size() / height;
    std::vector<double> solid_angle(truth.size());
    double total[2] = {};
    double sphere = 0.0;
    for (std::size_t i = 0; i < truth.size(); ++i) {
        const std::size_t row = i / width;
        const double v = (static_cast<double>(row) + 0.5) / height;
        solid_angle[i] = std::sin(v * std::numbers::pi);
        total[0] += static_cast<double>(truth[i]) * solid_angle[i];
        total[1] += static_cast<double>(learned[i]) * solid_angle[i];
        sphere += solid_angle[i];
    }
    double divergence = 0.0;
    for (std::size_t i = 0; i < truth.size(); ++i) {
        const double p = static_cast<double>(truth[i]) / total[0];
        const double q = static_cast<double>(learned[i]) / total[1];
        if (p > 0.0) {
            divergence += solid_angle[i] * p * std::log(p / std::max(q, kFloor / sphere));
        }
    }
    return divergence;
}

FieldProbe probe_field(SceneDescription description,
                       const ProbeSettings& settings,
                       SceneReport& report) {
    const FloatStateGuard float_state;
    if (!description.has_camera) {
        throw std::invalid_argument("field: the scene has no camera");
    }
    if (settings.height == 0 || settings.rays == 0) {
        throw std::invalid_argument("field: the grid or the number of rays is zero");
    }
    const CancelFlag never;
    // The truth is the same with light sampling, and far less noisy.
    std::unique_ptr<const Scene> lit;
    if (!description.settings.use_nee) {
        SceneDescription sampled = description;
        sampled.settings.use_nee = true;
        SceneReport again;
        lit = build_scene(std::move(sampled), never, again);
    }
    const auto scene = build_scene(std::move(description), never, report);
    const SurfaceInteraction surface = first_hit(*scene, settings);
    GuidingField field(guiding_config(scene->description.settings.guiding), scene->bounds);
    if (!settings.weights.empty()) {
        field.load(settings.weights);
    }
    ThreadPool pool(settings.threads);
    Integrator integrator(*scene, pool);
    if (settings.train) {
        train(*scene, integrator, pool, field);
    }
    FieldProbe probe;
    probe.position = surface.p + scene->shading.origin;
    probe.normal = surface.ns;
    probe.mixture = ask(field, surface);
    probe.width = 2 * settings.height;
    probe.height = settings.height;
    probe.learned.resize(std::size_t{probe.width} * probe.height);
    probe.truth.resize(probe.learned.size());
    draw_learned(probe);
    if (lit) {
        Integrator with_lights(*lit, pool);
        draw_truth(*lit, surface, settings, with_lights, probe);
    } else {
        draw_truth(*scene, surface, settings, integrator, probe);
    }
    probe.divergence = latlong_divergence(probe.truth, probe.learned, probe.height);
    probe.weights = field.save();
    return probe;
}

}  // namespace pharos
