// What every stage may look at: the scene and this pass, all const.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "camera/camera.h"
#include "core/work_counter.h"
#include "film/filter.h"
#include "film/passes.h"
#include "integrator/guiding_context.h"
#include "scene/scene.h"

namespace pharos {

// One pass: `samples` consecutive samples of every pixel, counted from 0 on an empty film.
struct PassSettings {
    std::uint32_t first_sample = 0;
    std::uint32_t samples = 1;
    // On the film, by the colour of the pixel on a checkerboard: (x + y) % 2 in the window.
    std::array<double, 2> weight{1.0, 1.0};
    std::uint32_t offset = 0;  // of the film's first sample in the pixel's sequence
};

struct RenderContext {
    const Scene& scene;
    const Camera& camera;
    const FilterSampler& filter;
    PassSettings pass;
    GuidingContext guiding;
    const PassLayout& passes;  // on request

    [[nodiscard]] const RenderSettings& settings() const { return scene.description.settings; }
};

// The stages in the order the light travels; each counts its items and time.
enum class Stage : std::uint8_t {
    GenerateCameraRays,
    IntersectClosest,
    AddLampRadiance,
    AddEscapedRadiance,
    EvaluateMaterials,
    EvaluateTextures,  // within other stages, whose time is without it
    AddEmittedRadiance,
    WritePasses,
    QueryGuidingField,
    SampleDirectLight,
    TraceShadowRays,
    TransmitShadowRays,  // the transparent surfaces on their way
    SampleScattering,
    RecordRadiance,
    AccumulateFilm,
    Train,
    Count
};

inline constexpr std::array<std::string_view, static_cast<std::size_t>(Stage::Count)> kStageNames{
    "generate_camera_rays",
    "intersect_closest",
    "add_lamp_radiance",
    "add_escaped_radiance",
    "evaluate_materials",
    "evaluate_textures",
    "add_emitted_radiance",
    "write_passes",
    "query_guiding_field",
    "sample_direct_light",
    "trace_shadow_rays",
    "transmit_shadow_rays",
    "sample_scattering",
    "record_radiance",
    "accumulate_film",
    "train"};

struct BatchStatistics {
    std::array<WorkCounter, static_cast<std::size_t>(Stage::Count)> stages{};
    std::uint64_t camera_samples = 0;
    std::uint64_t vertices = 0;
    std::uint64_t rays = 0;
    std::uint64_t nonfinite = 0;

    [[nodiscard]] WorkCounter& operator[](Stage stage) {
        return stages[static_cast<std::size_t>(stage)];
    }

    void add(const BatchStatistics& other);
};

}  // namespace pharos
