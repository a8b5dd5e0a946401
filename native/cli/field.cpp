// pharos-cli field: what the guide has learned at a pixel beside the light that is there.
#include <algorithm>
#include <cstdio>

#include "cli/commands.h"
#include "cli/options.h"
#include "image/image_io.h"
#include "scene/dump.h"
#include "session/field_probe.h"

namespace pharos::cli {

namespace {

struct Options : CommonOptions {
    std::string load;
    std::string save;
    std::vector<std::uint32_t> pixel;
    ProbeSettings probe;
};

void parse_option(const std::string& name, const std::string& value, Options& options) {
    if (options.take(name, value)) {
        return;
    }
    if (name == "--pixel") {
        options.pixel = parse_list(name, value);
    } else if (name == "--load") {
        options.load = value;
    } else if (name == "--save") {
        options.save = value;
    } else if (name == "--height") {
        options.probe.height = std::min(parse_number<std::uint32_t>(name, value), 4096u);
    } else if (name == "--rays") {
        options.probe.rays = parse_number<std::uint32_t>(name, value);
    } else {
        throw UsageError("unknown option '" + name + "'");
    }
}

Options parse(const std::vector<std::string>& arguments) {
    Options options;
    options.input =
        walk_arguments(arguments, no_flags, [&](const std::string& name, const std::string& value) {
            parse_option(name, value, options);
        });
    if (options.input.empty() || options.output.empty() || options.pixel.size() != 2) {
        throw UsageError("field needs an input file, --pixel X,Y and -o");
    }
    options.probe.x = options.pixel[0];
    options.probe.y = options.pixel[1];
    options.probe.threads = options.threads;
    options.probe.train = options.load.empty() || options.samples.has_value();
    return options;
}

// Both pictures side by side, what was learned on the left.
std::vector<float> side_by_side(const FieldProbe& probe) {
    std::vector<float> out;
    for (std::uint32_t y = 0; y < probe.height; ++y) {
        for (const auto* picture : {&probe.learned, &probe.truth}) {
            const auto row = picture->begin() + static_cast<std::ptrdiff_t>(y) * probe.width;
            out.insert(out.end(), row, row + probe.width);
        }
    }
    return out;
}

// One scale for both, so that all but the brightest hundredth of the truth can be told apart.
std::vector<float> exposed(std::vector<float> pixels, std::vector<float> truth) {
    const auto place = truth.begin() + static_cast<std::ptrdiff_t>(truth.size() * 99 / 100);
    std::nth_element(truth.begin(), place, truth.end());
    const float scale = *place > 0.0f ? 1.0f / *place : 1.0f;
    for (float& value : pixels) {
        value *= scale;
    }
    return pixels;
}

void require_written(const std::string& error) {
    if (!error.empty()) {
        throw std::runtime_error(error);
    }
}

void write_pictures(const FieldProbe& probe, const std::string& output) {
    const std::vector<float> both = side_by_side(probe);
    const ExrPass pass{"", "Y", both};
    require_written(write_exr(output, 2 * probe.width, probe.height, std::span(&pass, 1)));
    const std::string stem =
        output.ends_with(".exr") ? output.substr(0, output.size() - 4) : output;
    require_written(
        write_png(stem + ".png", 2 * probe.width, probe.height, exposed(both, probe.truth)));
}

void print_probe(const FieldProbe& probe) {
    const auto wide = [](float value) { return static_cast<double>(value); };
    const Vec3& p = probe.position;
    const Vec3& n = probe.normal;
    std::printf("position %.5g %.5g %.5g, normal %.4f %.4f %.4f\n",
                wide(p.x),
                wide(p.y),
                wide(p.z),
                wide(n.x),
                wide(n.y),
                wide(n.z));
    std::printf(
        "A %.6g\n%4s %8s %10s %27s\n", wide(probe.mixture.A), "lobe", "weight", "kappa", "mu");
    for (int k = 0; k < probe.mixture.lobe_count; ++k) {
        const VmfLobe lobe = probe.mixture.lobe(k);
        std::printf("%4d %8.4f %10.4g %9.4f %8.4f %8.4f\n",
                    k,
                    wide(probe.mixture.weight[k]),
                    wide(lobe.kappa),
                    wide(lobe.mu.x),
                    wide(lobe.mu.y),
                    wide(lobe.mu.z));
    }
    std::printf("divergence %.4f nats\n", probe.divergence);
}

}  // namespace

int field(const std::vector<std::string>& arguments) {
    Options options = parse(arguments);
    std::vector<std::byte> weights;
    if (!options.load.empty()) {
        weights = read_bytes(options.load);
        options.probe.weights = weights;
    }
    SceneDescription description = read_dump(options.input);
    options.apply(description.settings);
    SceneReport report;
    const FieldProbe probe = probe_field(std::move(description), options.probe, report);
    for (const ReportEntry& entry : report.entries()) {
        std::fprintf(stderr, "pharos-cli: %s: %s\n", entry.object.c_str(), entry.message.c_str());
    }
    print_probe(probe);
    write_pictures(probe, options.output);
    if (!options.save.empty()) {
        write_bytes(options.save, probe.weights);
    }
    return 0;
}

}  // namespace pharos::cli
