// pharos-cli render: a dump file to an EXR, with the statistics benchmarks read.
#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <new>
#include <optional>

#include "cli/commands.h"
#include "cli/options.h"
#include "cli/picture.h"
#include "core/atomic_file.h"
#include "core/checksum.h"
#include "image/image_io.h"
#include "scene/dump.h"
#include "scene/scene_hash.h"
#include "session/render_session.h"

namespace pharos::cli {

namespace {

volatile std::sig_atomic_t received_signal = 0;

extern "C" void remember_signal(int signal) {
    received_signal = signal;
}

struct Options : CommonOptions {
    std::optional<float> time_limit;
    std::optional<std::uint32_t> passes;
    std::string field;       // to load
    std::string save_field;  // to write
    bool strict = false;
    SessionOptions session;
    bool stats = false;
    std::string stats_json;
};

void parse_option(const std::string& name, const std::string& value, Options& options) {
    if (options.take(name, value)) {
        return;
    }
    if (name == "--time-limit") {
        options.time_limit = parse_number<float>(name, value);
    } else if (name == "--snapshots") {
        options.session.snapshot_samples = parse_list(name, value);
    } else if (name == "--sample-offset") {
        options.session.sample_offset = parse_number<std::uint32_t>(name, value);
    } else if (name == "--sample-count") {
        options.samples = parse_number<std::uint32_t>(name, value);
    } else if (name == "--field") {
        options.field = value;
    } else if (name == "--save-field") {
        options.save_field = value;
    } else if (name == "--checkpoint") {
        options.session.checkpoint.path = value;
    } else if (name == "--checkpoint-interval") {
        options.session.checkpoint.interval = parse_number<double>(name, value);
    } else if (name == "--passes") {
        options.passes = parse_passes(value);
    } else if (name == "--pass-samples") {
        options.session.pass_samples = std::max(1u, parse_number<std::uint32_t>(name, value));
    } else if (name == "--stats-json") {
        options.stats_json = value;
    } else {
        throw UsageError("unknown option '" + name + "'");
    }
}

bool parse_flag(const std::string& word, Options& options) {
    if (word == "--stats") {
        options.stats = true;
    } else if (word == "--strict") {
        options.strict = true;
    } else if (word == "--resume") {
        options.session.checkpoint.resume = Resume::Must;
    } else {
        return false;
    }
    return true;
}

Options parse(const std::vector<std::string>& arguments) {
    Options options;
    options.input = walk_arguments(
        arguments,
        [&](const std::string& word) { return parse_flag(word, options); },
        [&](const std::string& name, const std::string& value) {
            parse_option(name, value, options);
        });
    if (options.input.empty() || options.output.empty()) {
        throw UsageError("render needs an input file and -o");
    }
    const CheckpointOptions& checkpoint = options.session.checkpoint;
    if (checkpoint.resume != Resume::Never && checkpoint.path.empty()) {
        throw UsageError("--resume needs --checkpoint");
    }
    if (!options.field.empty() && !options.save_field.empty()) {
        throw UsageError("--save-field has nothing to save: --field does not learn");
    }
    options.session.threads = options.threads;
    return options;
}

// OUT.exr -> OUT.64.exr
std::string snapshot_path(const std::string& output, std::uint32_t samples) {
    const std::size_t dot = output.ends_with(".exr") ? output.size() - 4 : output.size();
    return output.substr(0, dot) + "." + std::to_string(samples) + output.substr(dot);
}

void print_statistics(const RenderSession& session) {
    const SessionStatistics statistics = session.statistics();
    double total = 0.0;
    for (const StageStatistics& stage : statistics.stages) {
        total += stage.seconds;
    }
    std::printf("%-22s %14s %10s %7s\n", "stage", "items", "ns/item", "share");
    for (const StageStatistics& stage : statistics.stages) {
        const double items = static_cast<double>(stage.items);
        std::printf("%-22s %14llu %10.1f %6.2f%%\n",
                    stage.name.c_str(),
                    static_cast<unsigned long long>(stage.items),
                    stage.items > 0 ? 1e9 * stage.seconds / items : 0.0,
                    total > 0.0 ? 100.0 * stage.seconds / total : 0.0);
    }
    const double samples = static_cast<double>(statistics.camera_samples);
    const double cpu = statistics.render_cpu_seconds;
    std::printf("samples %.0f, vertices a sample %.2f, rays a sample %.2f\n",
                samples,
                static_cast<double>(statistics.vertices) / samples,
                static_cast<double>(statistics.rays) / samples);
    std::printf("build %.3f s, CPU %.3f s, %.3f M samples and %.3f M rays a CPU second\n",
                statistics.build_seconds,
                cpu,
                1e-6 * samples / cpu,
                1e-6 * static_cast<double>(statistics.rays) / cpu);
    const SessionProgress progress = session.progress();
    std::printf("memory %.1f MiB, dropped non-finite samples %llu\n",
                static_cast<double>(progress.memory_bytes) / 1048576.0,
                static_cast<unsigned long long>(progress.nonfinite_samples));
}

void print_guide(const GuideStatus& guide) {
    if (!guide.enabled) {
        return;
    }
    const std::string_view why = why_unguided(guide_state(guide));
    std::printf(
        "guide %.*s%s%.1f %% of the vertices, loss %.4f (held out %.4f), moment ratio %.3f\n",
        static_cast<int>(why.size()),
        why.data(),
        why.empty() ? "" : ", ",
        100.0 * guide.guided_share,
        static_cast<double>(guide.loss),
        static_cast<double>(guide.held_out_loss),
        guide.moment_ratio);
    std::printf("guide snapshots %llu, records %llu, skipped steps %llu\n",
                static_cast<unsigned long long>(guide.snapshots),
                static_cast<unsigned long long>(guide.records),
                static_cast<unsigned long long>(guide.skipped_steps));
}

// What made the picture slow, where its pass was asked for.
void print_effort(const RenderSession& session) {
    for (const EffortShare& row : session.effort()) {
        const char* kind = row.kind == EffortKind::Object ? "at" : "by";
        std::printf("effort %s %-32s %6.2f%%\n", kind, row.name.c_str(), 100.0 * row.share);
    }
}

void write_statistics_json(const RenderSession& session,
                           double read_seconds,
                           const std::string& path) {
    const SessionStatistics statistics = session.statistics();
    std::ofstream out(path);
    out.precision(9);
    const GuideStatus guide = session.progress().guiding;
    out << "{\n  \"camera_samples\": " << statistics.camera_samples
        << ",\n  \"vertices\": " << statistics.vertices << ",\n  \"rays\": " << statistics.rays
        << ",\n  \"read_seconds\": " << read_seconds
        << ",\n  \"build_seconds\": " << statistics.build_seconds
        << ",\n  \"render_cpu_seconds\": " << statistics.render_cpu_seconds
        << ",\n  \"nonfinite_samples\": " << session.progress().nonfinite_samples
        << ",\n  \"memory_bytes\": " << session.progress().memory_bytes
        << ",\n  \"guided_share\": " << guide.guided_share
        << ",\n  \"guide_loss\": " << guide.held_out_loss << ",\n  \"stages\": [";
    for (const StageStatistics& stage : statistics.stages) {
        out << (&stage == statistics.stages.data() ? "\n" : ",\n") << "    {\"name\": \""
            << stage.name << "\", \"items\": " << stage.items << ", \"seconds\": " << stage.seconds
            << "}";
    }
    out << "\n  ],\n  \"snapshots\": [";
    const auto snapshots = session.snapshots();
    for (const SessionSnapshot& snapshot : snapshots) {
        out << (&snapshot == snapshots.data() ? "\n" : ",\n")
            << "    {\"samples\": " << snapshot.samples
            << ", \"cpu_seconds\": " << snapshot.cpu_seconds
            << ", \"wall_seconds\": " << snapshot.wall_seconds << "}";
    }
    out << "\n  ]\n}\n";
    if (!out.flush()) {
        throw WriteError(path + ": cannot be written");
    }
}

void write_snapshots(const RenderSession& session, const std::string& output) {
    for (const SessionSnapshot& snapshot : session.snapshots()) {
        const ExrPass pass{"Combined", "RGBA", snapshot.combined};
        const std::string path = snapshot_path(output, snapshot.samples);
        const std::string error =
            write_exr(path, session.width(), session.height(), std::span(&pass, 1), {});
        if (!error.empty()) {
            throw WriteError(error);
        }
    }
}

void require_assets(const RenderSession& session) {
    for (const ReportEntry& entry : session.report()) {
        if (entry.missing) {
            throw MissingAsset(entry.object + ": " + entry.message);
        }
    }
}

// Waits for the end; a signal cancels. Returns the exit code of a render that has a picture.
int wait_for_end(RenderSession& session, bool strict) {
    while (!session.wait(std::chrono::milliseconds(50))) {
        if (received_signal != 0) {
            session.cancel();
        }
        if (strict) {
            require_assets(session);
        }
    }
    if (received_signal == SIGINT) {
        return 130;
    }
    return received_signal == SIGTERM ? 143 : 0;
}

// What tells the picture from others of the same scene.
ShardInfo shard_info(SceneDescription& description, const Options& options) {
    ShardInfo info;
    char digits[17];
    std::snprintf(digits,
                  sizeof(digits),
                  "%016llx",
                  static_cast<unsigned long long>(scene_hash(description)));
    info.scene = digits;
    info.guiding = guiding_name(description.settings.guiding);
    if (!options.session.field.empty()) {
        std::snprintf(digits,
                      sizeof(digits),
                      "%016llx",
                      static_cast<unsigned long long>(fnv1a(std::span(options.session.field))));
        info.guiding += std::string(" of ") + digits;
    }
    info.window = window_text(description.film);
    info.seed = description.settings.seed;
    return info;
}

SceneDescription load(const Options& options) {
    SceneDescription description = read_dump(options.input);
    options.apply(description.settings);
    description.settings.time_limit = options.time_limit.value_or(description.settings.time_limit);
    description.passes.wanted = options.passes.value_or(description.passes.wanted);
    return description;
}

void require_success(const RenderSession& session, const Options& options) {
    const SessionProgress progress = session.progress();
    if (progress.out_of_memory) {
        throw std::bad_alloc();
    }
    if (progress.state == SessionState::Failed) {
        throw std::runtime_error(progress.error);
    }
    if (options.strict) {
        require_assets(session);
    }
}

}  // namespace

int render(const std::vector<std::string>& arguments) {
    Options options = parse(arguments);
    std::signal(SIGINT, remember_signal);
    std::signal(SIGTERM, remember_signal);
    using Clock = std::chrono::steady_clock;
    const Clock::time_point begin = Clock::now();
    SceneDescription description = load(options);
    const double read_seconds = std::chrono::duration<double>(Clock::now() - begin).count();
    if (!options.field.empty()) {
        options.session.field = read_bytes(options.field);
    }
    if (!options.save_field.empty() && description.settings.guiding == GuidingMode::Off) {
        throw UsageError("--save-field has nothing to save: guiding is off");
    }
    if (options.save_field.empty()) {
        options.session.least_guided_samples = kLeastGuidedSamples;
    }
    const ShardInfo info = shard_info(description, options);
    RenderSession session(std::move(description), options.session);
    const int code = wait_for_end(session, options.strict);
    for (const ReportEntry& entry : session.report()) {
        std::fprintf(stderr, "pharos-cli: %s: %s\n", entry.object.c_str(), entry.message.c_str());
    }
    require_success(session, options);
    if (code != 0 && session.progress().serial == 0) {
        return code;  // before there was a picture
    }
    write_picture(session, info, options.session.sample_offset, options.output);
    write_snapshots(session, options.output);
    if (!options.save_field.empty()) {
        write_bytes(options.save_field, session.field());
    }
    if (options.stats) {
        print_statistics(session);
        print_guide(session.progress().guiding);
        print_effort(session);
    }
    if (!options.stats_json.empty()) {
        write_statistics_json(session, read_seconds, options.stats_json);
    }
    return code;
}

}  // namespace pharos::cli
