#include "lights/portals.h"

#include <algorithm>

#include "lights/area_light.h"

namespace pharos {

namespace {

bool faces(const Lamp& opening, const Vec3& p) {
    return glm::dot(p - opening.center, opening.frame.z) > 0.0f;
}

float share_of_openings(const EnvironmentLight& world) {
    return world.is_constant() ? 1.0f : 0.5f;
}

}  // namespace

void Portals::add(const LightDescription& description) {
    LightDescription opening = description;
    opening.type = LightType::Area;
    opening.strength = Rgb(1.0f);
    opening.spread = kPi;
    opening.program = kNone;
    if (const auto lamp = make_lamp(opening, 0, 0)) {
        openings_.push_back(*lamp);
    }
}

std::size_t Portals::facing(const Vec3& p) const {
    return static_cast<std::size_t>(
        std::ranges::count_if(openings_, [&](const Lamp& opening) { return faces(opening, p); }));
}

const Lamp& Portals::nth_facing(const Vec3& p, std::size_t n) const {
    const Lamp* found = nullptr;
    for (const Lamp& opening : openings_) {
        if (!faces(opening, p)) {
            continue;
        }
        found = &opening;
        if (n-- == 0) {
            break;
        }
    }
    return *found;
}

EnvironmentLight::Sample Portals::sample(const EnvironmentLight& world,
                                         const LightSampleContext& context,
                                         const Vec2& u) const {
    const std::size_t count = facing(context.p);
    if (count == 0) {
        return world.sample(u);
    }
    const float share = share_of_openings(world);
    EnvironmentLight::Sample result;
    if (u.x >= share) {
        const float rest = (u.x - share) / (1.0f - share);
        result = world.sample(Vec2(std::min(rest, kOneMinusEpsilon), u.y));
    } else {
        const float scaled = u.x / share * static_cast<float>(count);
        const std::size_t n = std::min(static_cast<std::size_t>(scaled), count - 1);
        const float rest = std::min(scaled - static_cast<float>(n), kOneMinusEpsilon);
        const auto through =
            sample_area_light(nth_facing(context.p, n), context.p, Vec2(rest, u.y));
        if (!through) {
            return {Vec3(0.0f), 0.0f};
        }
        result.wi = through->wi;
    }
    result.pdf = pdf(world, context, result.wi);
    return result;
}

float Portals::pdf(const EnvironmentLight& world,
                   const LightSampleContext& context,
                   const Vec3& wi) const {
    std::size_t count = 0;
    float through = 0.0f;
    for (const Lamp& opening : openings_) {
        if (!faces(opening, context.p)) {
            continue;
        }
        ++count;
        if (const auto hit = hit_area_light(opening, Ray{context.p, wi}, &context)) {
            through += hit->pdf;
        }
    }
    if (count == 0) {
        return world.pdf(wi);
    }
    const float share = share_of_openings(world);
    return share * through / static_cast<float>(count) +
           (share < 1.0f ? (1.0f - share) * world.pdf(wi) : 0.0f);
}

}  // namespace pharos
