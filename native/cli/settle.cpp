// pharos-cli settle: how fast a live picture settles with and without the guide, and how large it
// may be for the guide to fit into a frame's budget.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "cli/commands.h"
#include "cli/options.h"
#include "core/parallel.h"
#include "session/guide_controller.h"
#include "session/guide_costs.h"
#include "session/settling.h"

namespace pharos::cli {

namespace {

constexpr double kBudget = FrameBudget{}.guide;

struct Options : MeasureOptions {
    SettlingSettings settling;
};

void parse_option(const std::string& name, const std::string& value, Options& options) {
    SettlingSettings& s = options.settling;
    if (options.take(name, value)) {
        return;
    }
    if (name == "--seconds") {
        s.seconds = parse_list(name, value);
        std::ranges::sort(s.seconds);
    } else if (name == "--turns") {
        s.turns = std::max(parse_number<std::uint32_t>(name, value), 1u);
    } else if (name == "--reference") {
        s.reference = std::max(parse_number<std::uint32_t>(name, value), 1u);
    } else if (name == "--frame") {
        s.budget.frame = 1e-3 * parse_number<double>(name, value);
    } else if (name == "--budget") {
        s.budget.guide = 1e-3 * parse_number<double>(name, value);
    } else {
        throw UsageError("unknown option '" + name + "'");
    }
}

void print(const Settling& settling, const SettlingSettings& settings) {
    std::printf("%8s %10s %10s  unguided / guided\n", "seconds", "guided", "unguided");
    for (std::size_t i = 0; i < settings.seconds.size(); ++i) {
        std::printf("%8u %10.5f %10.5f  %.2fx\n",
                    settings.seconds[i],
                    settling.guided[i],
                    settling.unguided[i],
                    settling.unguided[i] / settling.guided[i]);
    }
}

// A frame is one sample of each pixel.
void print_budget(const Settling& settling, const FilmDescription& film, unsigned threads) {
    const GuideCosts costs = measure_guide_costs(guiding_config(GuidingMode::Neural));
    const double sample = settling.guided_vertices * costs.vertex + settling.records * costs.record;
    const double workers = ThreadPool(threads).size();
    std::printf(
        "a guided vertex %.2f us, a record trained %.2f us; a sample has %.2f of these and %.2f of "
        "those: a frame of %u x %u takes %.1f ms of %.0f threads\n",
        1e6 * costs.vertex,
        1e6 * costs.record,
        settling.guided_vertices,
        settling.records,
        film.crop_width,
        film.crop_height,
        1e3 * sample * film.crop_width * film.crop_height / workers,
        workers);
    if (sample > 0.0) {
        const double aspect = static_cast<double>(film.crop_width) / film.crop_height;
        const double pixels = kBudget * workers / sample;
        std::printf("all of it fits into %.0f ms a frame up to %.0f x %.0f pixels\n",
                    1e3 * kBudget,
                    std::floor(std::sqrt(pixels * aspect)),
                    std::floor(std::sqrt(pixels / aspect)));
    }
}

}  // namespace

int settle(const std::vector<std::string>& arguments) {
    Options options;
    options.input =
        walk_arguments(arguments, no_flags, [&](const std::string& name, const std::string& value) {
            parse_option(name, value, options);
        });
    if (options.settling.seconds.empty()) {
        throw UsageError("--seconds is a list of numbers");
    }
    options.settling.threads = options.threads;
    const SceneDescription description = options.load("settle");
    const Settling settling = measure_settling(description, options.settling);
    print(settling, options.settling);
    print_budget(settling, description.film, options.threads);
    return 0;
}

}  // namespace pharos::cli
