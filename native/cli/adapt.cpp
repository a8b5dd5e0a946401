// pharos-cli adapt: how fast the guide follows a lamp that moves.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "cli/commands.h"
#include "cli/options.h"
#include "session/adaptation.h"

namespace pharos::cli {

namespace {

constexpr double kNear = 1.2;  // of the settled error: the guide has followed

struct Options : MeasureOptions {
    AdaptationSettings adaptation;
};

void parse_option(const std::string& name, const std::string& value, Options& options) {
    AdaptationSettings& a = options.adaptation;
    if (options.take(name, value)) {
        return;
    }
    if (name == "--lamp") {
        a.lamp = value;
    } else if (name == "--move") {
        a.offset = parse_vector(name, value);
    } else if (name == "--frames") {
        a.frames = std::max(parse_number<std::uint32_t>(name, value), 2u);
    } else if (name == "--learned") {
        a.learned = parse_number<std::uint32_t>(name, value);
    } else if (name == "--reference") {
        a.reference = std::max(parse_number<std::uint32_t>(name, value), 1u);
    } else if (name == "--seeds") {
        a.seeds = std::max(parse_number<std::uint32_t>(name, value), 1u);
    } else {
        throw UsageError("unknown option '" + name + "'");
    }
}

// One frame's errors along a line, from the least to the largest of all by their logarithms.
class Plot {
  public:
    explicit Plot(const Adaptation& a) : limit_(kNear * a.settled), low_(limit_), high_(limit_) {
        for (const std::vector<double>* errors : {&a.kept, &a.fresh, &a.unguided}) {
            for (const double error : *errors) {
                low_ = std::min(low_, error);
                high_ = std::max(high_, error);
            }
        }
    }

    [[nodiscard]] std::string line(double kept, double fresh, double unguided) const {
        std::string out(kColumns, ' ');
        out[column(limit_)] = '|';
        out[column(unguided)] = 'u';
        out[column(fresh)] = 'f';
        out[column(kept)] = 'K';
        return out;
    }

  private:
    static constexpr std::size_t kColumns = 48;

    [[nodiscard]] std::size_t column(double error) const {
        const double place = std::log(error / low_) / std::max(std::log(high_ / low_), 1e-9);
        return static_cast<std::size_t>(std::clamp(place, 0.0, 1.0) * (kColumns - 1));
    }

    double limit_;
    double low_;
    double high_;
};

void print(const Adaptation& a) {
    std::printf("%5s %10s %10s %10s  kept / unguided, and by logarithm: Kept, fresh, unguided\n",
                "frame",
                "kept",
                "fresh",
                "unguided");
    const Plot plot(a);
    double worst = 0.0;
    for (std::size_t i = 0; i < a.kept.size(); ++i) {
        const double ratio = a.kept[i] / a.unguided[i];
        worst = std::max(worst, ratio);
        std::printf("%5zu %10.5f %10.5f %10.5f  %.3f %s\n",
                    i,
                    a.kept[i],
                    a.fresh[i],
                    a.unguided[i],
                    ratio,
                    plot.line(a.kept[i], a.fresh[i], a.unguided[i]).c_str());
    }
    std::printf(
        "settled %.5f; within %.1fx of it after %zu frames kept, %zu from nothing "
        "(of %zu); kept / unguided at most %.3f\n",
        a.settled,
        kNear,
        a.frames_until(a.kept, kNear),
        a.frames_until(a.fresh, kNear),
        a.kept.size(),
        worst);
}

}  // namespace

int adapt(const std::vector<std::string>& arguments) {
    Options options;
    options.input =
        walk_arguments(arguments, no_flags, [&](const std::string& name, const std::string& value) {
            parse_option(name, value, options);
        });
    options.adaptation.threads = options.threads;
    const SceneDescription description = options.load("adapt");
    print(measure_adaptation(description, options.adaptation));
    return 0;
}

}  // namespace pharos::cli
