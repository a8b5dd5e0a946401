#include "session/settling.h"

#include <algorithm>
#include <chrono>
#include <ctime>
#include <stdexcept>
#include <thread>

#include "core/parallel.h"
#include "session/live_session.h"
#include "session/picture_error.h"

namespace pharos {

namespace {

constexpr std::chrono::milliseconds kInterval(2);
constexpr std::uint32_t kReferenceSeed = 0x5eedu;
constexpr std::uint32_t kWithoutEnd = 1u << 20;

double process_seconds() {
    timespec time{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

std::vector<float> render_reference(SceneDescription description,
                                    const SettlingSettings& settings) {
    description.settings.seed ^= kReferenceSeed;
    description.settings.guiding = GuidingMode::Neural;
    description.settings.samples = settings.reference;
    description.settings.time_limit = 0.0f;
    RenderSession session(std::move(description), settings.threads);
    while (!session.wait(std::chrono::seconds(1))) {
    }
    std::vector<float> picture(std::size_t{4} * session.width() * session.height());
    if (!session.read(FilmPass::Combined, picture)) {
        throw std::runtime_error(session.progress().error);
    }
    return picture;
}

std::uint64_t items_of(const SessionStatistics& statistics, const char* name) {
    const auto found =
        std::ranges::find_if(statistics.stages, [&](const auto& s) { return s.name == name; });
    return found == statistics.stages.end() ? 0 : found->items;
}

// The error now; a picture that is not there yet, or only coarse, counts as black.
double error_now(const LiveSession& live, const std::vector<float>& reference) {
    LivePicture picture = live.picture();
    if (picture.pixels.size() != reference.size()) {
        picture.pixels.assign(reference.size(), 0.0f);
    }
    return trimmed_error(picture.pixels, reference);
}

// One live picture from the start; adds to the sums.
void take_turn(SceneDescription description,
               const SettlingSettings& settings,
               const std::vector<float>& reference,
               Settling& sum) {
    const bool guided = description.settings.guiding != GuidingMode::Off;
    std::vector<double>& errors = guided ? sum.guided : sum.unguided;
    const double threads = ThreadPool(settings.threads).size();
    LiveSession live(settings.threads, settings.budget);
    double begin = process_seconds();
    live.set_scene(std::move(description));
    for (std::size_t i = 0; i < settings.seconds.size(); ++i) {
        while (process_seconds() - begin < threads * settings.seconds[i]) {
            std::this_thread::sleep_for(kInterval);
        }
        const double looked = process_seconds();
        errors[i] += error_now(live, reference) / settings.turns;
        begin += process_seconds() - looked;
    }
    if (guided) {
        const SessionStatistics statistics = live.statistics();
        const double samples =
            std::max(1.0, static_cast<double>(statistics.camera_samples)) * settings.turns;
        sum.guided_vertices +=
            static_cast<double>(items_of(statistics, "query_guiding_field")) / samples;
        sum.records += static_cast<double>(items_of(statistics, "train")) / samples;
    }
}

}  // namespace

Settling measure_settling(const SceneDescription& description, const SettlingSettings& settings) {
    const std::vector<float> reference = render_reference(description, settings);
    Settling result;
    result.guided.resize(settings.seconds.size());
    result.unguided.resize(settings.seconds.size());
    for (std::uint32_t turn = 0; turn < settings.turns; ++turn) {
        for (const GuidingMode mode : {GuidingMode::Off, GuidingMode::Neural}) {
            SceneDescription next = description;
            next.settings.guiding = mode;
            next.settings.seed += turn;
            next.settings.samples = kWithoutEnd;
            next.settings.time_limit = 0.0f;
            take_turn(std::move(next), settings, reference, result);
        }
    }
    return result;
}

}  // namespace pharos
