#include "lights/light_sampler.h"

#include <algorithm>
#include <array>

#include "core/color.h"
#include "lights/emissive_triangles.h"
#include "lights/lamp.h"
#include "lights/lamp_tree.h"
#include "lights/light_bound.h"
#include "lights/light_selection.h"
#include "lights/portals.h"

namespace pharos {

namespace {

constexpr float kFaintest = 0.05f;
constexpr std::uint32_t kCancelPollInterval = 1u << 14;

// A constant world has nothing to aim at: scattered rays find it with the cosine in their density,
// and a second technique would only add its noise (MIS compensation, Karlik et al. 2019, gives it
// density 0). Portals are something to aim at.
bool is_worth_sampling(const EnvironmentLight* environment, bool has_portals) {
    return environment != nullptr && (has_portals || !environment->is_constant()) &&
           average(glm::abs(environment->mean_radiance())) > 0.0f;
}

void prefetch(const Lamp& lamp) {
    const auto* first = reinterpret_cast<const char*>(&lamp);
    for (std::size_t line = 0; line < sizeof(Lamp); line += 64) {
        __builtin_prefetch(first + line);
    }
}

LightBound bound_environment(const EnvironmentLight& environment) {
    LightBound bound;
    bound.distance = EmitterDistance::Ambient;
    bound.center = Vec3(0.0f, 0.0f, 1.0f);  // any unit direction: at distance 1, as a sun is
    bound.strength = kPi * average(glm::abs(environment.mean_radiance()));
    return bound;
}

}  // namespace

// Groups of the selection: lamps in their order, groups of emissive triangles, the world.
struct LightSampler::Impl {
    std::vector<Lamp> lamps;
    EmissiveTriangles triangles;
    const EnvironmentLight* environment = nullptr;
    Portals portals;
    LightSelection selection;
    LampTree tree;
    std::vector<std::uint32_t> suns;  // lamps that an escaped ray can see

    [[nodiscard]] std::uint32_t lamp_count() const {
        return static_cast<std::uint32_t>(lamps.size());
    }

    [[nodiscard]] std::uint32_t environment_group() const {
        return lamp_count() + triangles.group_count();
    }

    [[nodiscard]] std::optional<LightSamplerSample> sample_lamp_group(
        const LightSampleContext& context, std::uint32_t index, const Vec2& u) const;
    [[nodiscard]] LightHit finish_hit(const LampHit& hit,
                                      std::uint32_t lamp,
                                      const LightSampleContext* context) const;
};

std::optional<LightSamplerSample> LightSampler::Impl::sample_lamp_group(
    const LightSampleContext& context, std::uint32_t index, const Vec2& u) const {
    const Lamp& lamp = lamps[index];
    const std::optional<LampSample> sampled = sample_lamp(lamp, context, u);
    if (!sampled) {
        return std::nullopt;
    }
    LightSamplerSample result;
    result.sample.L = sampled->L;
    result.sample.wi = sampled->wi;
    result.sample.pdf = sampled->pdf;
    result.sample.distance = sampled->distance;
    // A lamp that rays never meet has no rival either: its samples keep their full weight.
    result.sample.delta = sampled->delta || !lamp.hittable;
    result.sample.cast_shadow = lamp.cast_shadow;
    result.sample.visibility = lamp.visibility;
    result.sample.max_bounces = lamp.max_bounces;
    result.lamp = index;
    result.light = lamp.index;
    result.program = lamp.program;
    return result;
}

LightHit LightSampler::Impl::finish_hit(const LampHit& hit,
                                        std::uint32_t lamp,
                                        const LightSampleContext* context) const {
    LightHit result;
    result.L = hit.L;
    result.distance = hit.t;
    result.light = lamps[lamp].index;
    result.lamp = lamp;
    result.program = lamps[lamp].program;
    result.visibility = lamps[lamp].visibility;
    if (context != nullptr && hit.pdf > 0.0f) {
        result.pdf = hit.pdf * selection.pmf(*context, lamp);
    }
    return result;
}

LightSampler::LightSampler(const LightSamplerInput& input) : impl_(std::make_unique<Impl>()) {
    const CancelFlag never;
    const CancelFlag& cancel = input.cancel != nullptr ? *input.cancel : never;
    std::vector<LightBound> bounds;
    for (std::uint32_t i = 0; i < input.lamps.size(); ++i) {
        if (i % kCancelPollInterval == 0) {
            throw_if_cancelled(cancel);
        }
        if (input.lamps[i].is_portal) {
            impl_->portals.add(input.lamps[i]);
            continue;
        }
        if (const auto lamp = make_lamp(input.lamps[i], input.blender_version, i)) {
            if (lamp->hittable && is_distant(*lamp)) {
                impl_->suns.push_back(impl_->lamp_count());
            }
            impl_->lamps.push_back(*lamp);
            bounds.push_back(bound_lamp(*lamp));
            if (!input.lamp_scales.empty()) {
                // Never zero: a mean may miss where the lamp shines.
                bounds.back().strength *= std::max(input.lamp_scales[i], kFaintest);
            }
        }
    }
    impl_->triangles = EmissiveTriangles(input, cancel);
    for (std::uint32_t group = 0; group < impl_->triangles.group_count(); ++group) {
        throw_if_cancelled(cancel);
        bounds.push_back(impl_->triangles.bound(group));
    }
    if (is_worth_sampling(input.environment, !impl_->portals.empty())) {
        impl_->environment = input.environment;
        bounds.push_back(bound_environment(*input.environment));
    }
    impl_->selection = LightSelection(bounds, cancel);
    impl_->tree = LampTree(impl_->lamps, cancel);
}

LightSampler::~LightSampler() = default;
LightSampler::LightSampler(LightSampler&&) noexcept = default;

bool LightSampler::empty() const {
    return impl_->selection.empty();
}

void LightSampler::choose(std::span<LightQuery> queries) const {
    const Impl& impl = *impl_;
    impl.selection.choose(queries);
    if (impl.selection.size() <= LightSelection::kMaxEstimated) {
        return;
    }
    for (const LightQuery& query : queries) {
        const LightChoice& choice = query.choice;
        if (choice.group < impl.lamp_count()) {
            prefetch(impl.lamps[choice.group]);
        } else if (choice.group < impl.environment_group()) {
            impl.triangles.prefetch(choice.group - impl.lamp_count(), choice.u);
        }
    }
}

std::optional<LightSamplerSample> LightSampler::sample(const LightSampleContext& context,
                                                       float u_choice,
                                                       const Vec2& u) const {
    if (impl_->selection.empty()) {
        return std::nullopt;
    }
    LightQuery query{context, widen_random(u_choice, u), u, {}};
    impl_->selection.choose(std::span(&query, 1));
    return sample(query);
}

std::optional<LightSamplerSample> LightSampler::sample(const LightQuery& query) const {
    const Impl& impl = *impl_;
    const auto& [context, u_choice, u, choice] = query;
    if (!(choice.pmf > 0.0f)) {
        return std::nullopt;
    }
    if (choice.group < impl.lamp_count()) {
        auto result = impl.sample_lamp_group(context, choice.group, u);
        if (result) {
            result->sample.pdf *= choice.pmf;
        }
        return result;
    }
    LightSamplerSample result;
    if (choice.group == impl.environment_group()) {
        const EnvironmentLight::Sample sample =
            impl.portals.empty() ? impl.environment->sample(u)
                                 : impl.portals.sample(*impl.environment, context, u);
        if (!(sample.pdf > 0.0f)) {
            return std::nullopt;
        }
        result.sample.wi = sample.wi;
        result.sample.pdf = sample.pdf * choice.pmf;
        result.sample.distance = kInfinity;
        result.environment = true;
        return result;
    }
    const auto sample =
        impl.triangles.sample(choice.group - impl.lamp_count(), context.p, choice.u, u);
    if (!sample) {
        return std::nullopt;
    }
    result.sample.wi = sample->wi;
    result.sample.pdf = sample->pdf * choice.pmf;
    result.sample.distance = sample->distance;
    result.material = sample->material;
    result.instance = sample->instance;
    result.triangle = sample->triangle;
    result.u = sample->u;
    result.v = sample->v;
    return result;
}

std::optional<LightHit> LightSampler::intersect_lamps(const Ray& ray,
                                                      const LightSampleContext* context) const {
    const auto nearest = impl_->tree.intersect(ray, context);
    if (!nearest) {
        return std::nullopt;
    }
    return impl_->finish_hit(nearest->hit, nearest->lamp, context);
}

void LightSampler::intersect_lamps(std::span<const LampRay> rays,
                                   std::span<std::optional<LightHit>> hits) const {
    std::array<std::optional<LampTree::Nearest>, LampTree::kTogether> nearest;
    for (std::size_t first = 0; first < rays.size(); first += nearest.size()) {
        const auto part = rays.subspan(first, std::min(nearest.size(), rays.size() - first));
        impl_->tree.intersect(part, nearest);
        for (std::size_t i = 0; i < part.size(); ++i) {
            hits[first + i].reset();
            if (nearest[i]) {
                hits[first + i] =
                    impl_->finish_hit(nearest[i]->hit, nearest[i]->lamp, part[i].context);
            }
        }
    }
}

bool LightSampler::has_hittable_lamps() const {
    return !impl_->tree.empty();
}

std::uint32_t LightSampler::sun_count() const {
    return static_cast<std::uint32_t>(impl_->suns.size());
}

std::optional<LightHit> LightSampler::sun_hit(std::uint32_t sun,
                                              const Vec3& wi,
                                              const LightSampleContext* context) const {
    const std::uint32_t lamp = impl_->suns[sun];
    const auto hit = hit_lamp(impl_->lamps[lamp], Ray{Vec3(0.0f), wi}, context);
    if (!hit) {
        return std::nullopt;
    }
    return impl_->finish_hit(*hit, lamp, context);
}

LampPoint LightSampler::lamp_point(std::uint32_t lamp,
                                   const Vec3& from,
                                   const Vec3& wi,
                                   float distance) const {
    return pharos::lamp_point(impl_->lamps[lamp], from, wi, distance);
}

float LightSampler::pdf_environment(const LightSampleContext& context, const Vec3& wi) const {
    if (impl_->environment == nullptr) {
        return 0.0f;
    }
    const float direction = impl_->portals.empty()
                                ? impl_->environment->pdf(wi)
                                : impl_->portals.pdf(*impl_->environment, context, wi);
    return direction * impl_->selection.pmf(context, impl_->environment_group());
}

float LightSampler::pdf_triangle(const LightSampleContext& context,
                                 std::uint32_t instance,
                                 std::uint32_t triangle,
                                 float t,
                                 float cos_light) const {
    const std::uint32_t group = impl_->triangles.find_group(instance, triangle);
    const float cosine = std::abs(cos_light);
    if (group == kNone || !(cosine > 0.0f)) {
        return 0.0f;
    }
    const float choice = impl_->selection.pmf(context, impl_->lamp_count() + group);
    return choice * impl_->triangles.pdf_area(instance, triangle, context.p) * t * t / cosine;
}

}  // namespace pharos
