#include "session/lobe_probe.h"

#include <algorithm>
#include <array>
#include <span>

#include "camera/camera.h"
#include "scene/scene.h"
#include "session/guide_controller.h"

namespace pharos {

namespace {

VmfMixture ask(const GuidingField& field, const SurfaceInteraction& surface) {
    const std::array<float, 6> at{
        surface.p.x, surface.p.y, surface.p.z, surface.ns.x, surface.ns.y, surface.ns.z};
    const auto one = [&](std::size_t i) { return std::span<const float>(&at[i], 1); };
    VmfMixture mixture;
    field.evaluate({one(0), one(1), one(2), one(3), one(4), one(5)}, std::span(&mixture, 1));
    return mixture;
}

Hit first_hit(const Scene& scene, const Ray& ray) {
    const std::uint32_t visibility = kVisibleCamera;
    Hit hit;
    scene.accelerator->intersect(std::span(&ray, 1), std::span(&visibility, 1), std::span(&hit, 1));
    return hit;
}

}  // namespace

LobeProbe probe_lobes(const Scene& scene, const GuideController& guide, const Vec2& place) {
    LobeProbe probe;
    probe.state = guide_state(guide.status());
    const SceneDescription& d = scene.description;
    if (!d.has_camera) {
        return probe;
    }
    const Vec2 corner(static_cast<float>(d.film.crop_x), static_cast<float>(d.film.crop_y));
    const Vec2 size(static_cast<float>(d.film.crop_width), static_cast<float>(d.film.crop_height));
    const Camera camera(scene.camera(), d.film.width, d.film.height);
    const Ray ray = camera.generate_ray(corner + place * size, Vec2(0.5f));
    const Hit hit = first_hit(scene, ray);
    if (hit.instance == kNone) {
        return probe;
    }
    const SurfaceInteraction surface = scene.interaction(ray, hit);
    probe.hit = true;
    probe.position = surface.p + scene.shading.origin;
    probe.normal = surface.ns;
    if (guide.learned() == nullptr) {
        return probe;
    }
    const GuidingContext context = guide.next_pass();
    const auto share = [&](bool glossy) {
        const float proven = context.selection != nullptr
                                 ? context.selection->alpha(surface.p, surface.ns, glossy)
                                 : 0.0f;
        return std::max(proven, context.fixed_share[glossy ? 1 : 0]);
    };
    probe.diffuse_share = share(false);
    probe.glossy_share = share(true);
    const VmfMixture mixture = ask(*guide.learned(), surface);
    probe.irradiance = mixture.A;
    for (int k = 0; k < mixture.lobe_count; ++k) {
        const VmfLobe lobe = mixture.lobe(k);
        probe.lobes.push_back({lobe.mu, lobe.kappa, mixture.weight[k]});
    }
    std::ranges::sort(probe.lobes, std::ranges::greater(), &GuideLobe::weight);
    return probe;
}

}  // namespace pharos
