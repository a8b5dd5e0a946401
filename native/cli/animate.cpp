// pharos-cli animate: what it is worth that the guide goes on from frame to frame.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "cli/commands.h"
#include "cli/options.h"
#include "session/animation.h"

namespace pharos::cli {

namespace {

struct Options : MeasureOptions {
    AnimationSettings animation;
};

void parse_option(const std::string& name, const std::string& value, Options& options) {
    AnimationSettings& a = options.animation;
    if (options.take(name, value)) {
        return;
    }
    if (name == "--lamp") {
        a.lamp = value;
    } else if (name == "--move") {
        a.offset = parse_vector(name, value);
    } else if (name == "--frames") {
        a.frames = std::max(parse_number<std::uint32_t>(name, value), 2u);
    } else if (name == "--reference") {
        a.reference = std::max(parse_number<std::uint32_t>(name, value), 1u);
    } else {
        throw UsageError("unknown option '" + name + "'");
    }
}

void print(const std::vector<AnimatedFrame>& frames) {
    std::printf("%5s %10s %8s %10s %8s %10s %8s  less error at equal time: over anew, unguided\n",
                "frame",
                "going on",
                "CPU s",
                "anew",
                "CPU s",
                "unguided",
                "CPU s");
    double going_on = 0.0;
    double anew = 0.0;
    double unguided = 0.0;
    double least = 1e30;
    for (std::size_t i = 0; i < frames.size(); ++i) {
        const AnimatedFrame& f = frames[i];
        const double over_anew = f.anew.work() / f.going_on.work();
        std::printf("%5zu %10.5f %8.3f %10.5f %8.3f %10.5f %8.3f  %.2fx %.2fx\n",
                    i,
                    f.going_on.error,
                    f.going_on.cpu_seconds,
                    f.anew.error,
                    f.anew.cpu_seconds,
                    f.unguided.error,
                    f.unguided.cpu_seconds,
                    over_anew,
                    f.unguided.work() / f.going_on.work());
        going_on += f.going_on.work();
        anew += f.anew.work();
        unguided += f.unguided.work();
        least = std::min(least, over_anew);
    }
    std::printf(
        "mean over frames: %.2fx less error than anew at equal time (least %.2fx), %.2fx "
        "less than unguided\n",
        anew / going_on,
        least,
        unguided / going_on);
}

}  // namespace

int animate(const std::vector<std::string>& arguments) {
    Options options;
    const auto flag = [&](const std::string& name) {
        options.animation.cut = options.animation.cut || name == "--cut";
        return name == "--cut";
    };
    options.input =
        walk_arguments(arguments, flag, [&](const std::string& name, const std::string& value) {
            parse_option(name, value, options);
        });
    options.animation.threads = options.threads;
    const SceneDescription description = options.load("animate");
    print(measure_animation(description, options.animation));
    return 0;
}

}  // namespace pharos::cli
