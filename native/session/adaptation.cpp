#include "session/adaptation.h"

#include <algorithm>
#include <functional>
#include <numeric>
#include <stdexcept>

#include "core/cancel.h"
#include "integrator/integrator.h"
#include "scene/scene.h"
#include "session/guide_controller.h"
#include "session/picture_error.h"

namespace pharos {

namespace {

constexpr std::uint32_t kSettledFrames = 8;  // averaged
constexpr std::uint32_t kReferenceSeed = 0x5eedu;

std::unique_ptr<const Scene> build(SceneDescription description) {
    const CancelFlag never;
    SceneReport report;
    return build_scene(std::move(description), never, report);
}

// One picture that grows frame by frame, as a viewport's does.
class Frames {
  public:
    Frames(const Scene& scene, ThreadPool& pool)
        : pool_(pool), integrator_(scene, pool), film_(scene.description.film) {}

    // The next frame by itself, RGBA; the guide learns from it.
    std::vector<float> next(GuideController& guide) {
        const CancelFlag never;
        const BatchStatistics before = integrator_.statistics();
        integrator_.render_pass({count_, 1}, guide.next_pass(), film_, {never, {}});
        ++count_;
        guide.see(film_.film, count_);
        if (guide.learning()) {
            const BatchStatistics& after = integrator_.statistics();
            SelectionPass work;
            work.paths = static_cast<double>(after.camera_samples - before.camera_samples);
            work.vertices = static_cast<double>(after.vertices - before.vertices);
            guide.learn(integrator_.take_records(), work, film_.film, pool_);
        } else {
            guide.rest();
        }
        std::vector<float> mean(std::size_t{4} * film_.film.width() * film_.film.height());
        film_.film.read(FilmPass::Combined, mean);
        std::vector<float> frame(mean.size());
        sum_.resize(mean.size());
        for (std::size_t i = 0; i < mean.size(); ++i) {
            const double sum = static_cast<double>(mean[i]) * count_;
            frame[i] = static_cast<float>(sum - sum_[i]);
            sum_[i] = sum;
        }
        return frame;
    }

  private:
    ThreadPool& pool_;
    Integrator integrator_;
    SharedFilm film_;
    std::vector<double> sum_;
    std::uint32_t count_ = 0;
};

std::vector<float> render_reference(SceneDescription description,
                                    std::uint32_t samples,
                                    ThreadPool& pool) {
    description.settings.seed ^= kReferenceSeed;
    const auto scene = build(std::move(description));
    GuideController guide(
        GuidingMode::Neural,
        scene->bounds,
        std::uint64_t{scene->description.film.crop_width} * scene->description.film.crop_height);
    Frames frames(*scene, pool);
    std::vector<double> sum;
    std::vector<float> frame;
    for (std::uint32_t i = 0; i < samples; ++i) {
        frame = frames.next(guide);
        sum.resize(frame.size());
        std::ranges::transform(frame, sum, sum.begin(), [](float value, double total) {
            return total + static_cast<double>(value);
        });
    }
    std::ranges::transform(
        sum, frame.begin(), [&](double total) { return static_cast<float>(total / samples); });
    return frame;
}

void add_to(std::vector<double>& sum, const std::vector<double>& values) {
    sum.resize(values.size());
    std::ranges::transform(sum, values, sum.begin(), std::plus());
}

// What all seeds have in common.
struct Move {
    const AdaptationSettings& settings;
    const std::vector<float>& reference;
    ThreadPool& pool;
};

// Adds the errors of one seed to `sum`.
void measure_seed(const Scene& before, const Scene& after, const Move& move, Adaptation& sum) {
    const AdaptationSettings& settings = move.settings;
    const FilmDescription& film = after.description.film;
    const std::uint64_t pixels = std::uint64_t{film.crop_width} * film.crop_height;
    const auto errors = [&](GuideController& guide, std::uint32_t count) {
        Frames frames(after, move.pool);
        std::vector<double> out;
        for (std::uint32_t i = 0; i < count; ++i) {
            out.push_back(trimmed_error(frames.next(guide), move.reference));
        }
        return out;
    };
    GuideController none(GuidingMode::Off, after.bounds, pixels);
    add_to(sum.unguided, errors(none, settings.frames));
    GuideController fresh(GuidingMode::Neural, after.bounds, pixels);
    const std::vector<double> all = errors(fresh, std::max(settings.frames, settings.learned));
    add_to(sum.fresh, {all.begin(), all.begin() + settings.frames});
    fresh.begin_picture(after.bounds, pixels, false);
    const std::vector<double> trained = errors(fresh, settings.frames);
    const std::uint32_t last = std::min(kSettledFrames, settings.frames);
    sum.settled += std::accumulate(trained.end() - last, trained.end(), 0.0) / last;
    GuideController kept(GuidingMode::Neural, before.bounds, pixels);
    Frames earlier(before, move.pool);
    for (std::uint32_t i = 0; i < settings.learned; ++i) {
        static_cast<void>(earlier.next(kept));
    }
    kept.begin_picture(after.bounds, pixels, true);
    add_to(sum.kept, errors(kept, settings.frames));
}

}  // namespace

LightDescription& find_lamp(SceneDescription& description, const std::string& name) {
    const auto found = std::ranges::find_if(description.lights, [&](const LightDescription& lamp) {
        return name.empty() || lamp.name == name;
    });
    if (found == description.lights.end()) {
        throw std::invalid_argument("no lamp '" + name + "' in the scene");
    }
    return *found;
}

std::size_t Adaptation::frames_until(const std::vector<double>& errors, double factor) const {
    for (std::size_t i = 0; i + 1 < errors.size(); ++i) {
        if (std::max(errors[i], errors[i + 1]) <= factor * settled) {
            return i;
        }
    }
    return errors.size();
}

Adaptation measure_adaptation(const SceneDescription& description,
                              const AdaptationSettings& settings) {
    SceneDescription moved = description;
    find_lamp(moved, settings.lamp).to_world[3] += Vec4(settings.offset, 0.0f);
    ThreadPool pool(settings.threads);
    const std::vector<float> reference = render_reference(moved, settings.reference, pool);
    const Move move{settings, reference, pool};
    Adaptation result;
    const double part = 1.0 / std::max(1u, settings.seeds);
    for (std::uint32_t seed = 0; seed < std::max(1u, settings.seeds); ++seed) {
        SceneDescription from = description;
        SceneDescription to = moved;
        from.settings.seed += seed;
        to.settings.seed += seed;
        measure_seed(*build(std::move(from)), *build(std::move(to)), move, result);
    }
    for (std::vector<double>* errors : {&result.kept, &result.fresh, &result.unguided}) {
        for (double& error : *errors) {
            error *= part;
        }
    }
    result.settled *= part;
    return result;
}

}  // namespace pharos
