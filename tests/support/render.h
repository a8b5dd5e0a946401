// Renders a description to its end through a RenderSession, for tests.
#pragma once

#include <chrono>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "session/render_session.h"

namespace pharos::testing {

struct Rendered {
    SessionProgress progress;
    SessionStatistics statistics;
    std::vector<ReportEntry> report;
    std::vector<float> combined;  // RGBA, bottom row first; empty when the render failed

    // Mean of all pixels, in double.
    [[nodiscard]] double mean(std::size_t channel) const {
        double sum = 0.0;
        for (std::size_t i = channel; i < combined.size(); i += 4) {
            sum += static_cast<double>(combined[i]);
        }
        return sum / (static_cast<double>(combined.size()) / 4.0);
    }

    [[nodiscard]] std::uint64_t items(const std::string& stage) const {
        for (const StageStatistics& s : statistics.stages) {
            if (s.name == stage) {
                return s.items;
            }
        }
        ADD_FAILURE() << "no stage " << stage;
        return 0;
    }
};

[[nodiscard]] inline Rendered render(SceneDescription description, SessionOptions options) {
    RenderSession session(std::move(description), std::move(options));
    while (!session.wait(std::chrono::milliseconds(1000))) {
    }
    Rendered result{session.progress(), session.statistics(), session.report(), {}};
    if (result.progress.state != SessionState::Failed) {
        result.combined.resize(std::size_t{session.width()} * session.height() * 4);
        if (!session.read(FilmPass::Combined, result.combined)) {
            result.combined.clear();
        }
    }
    return result;
}

[[nodiscard]] inline Rendered render(SceneDescription description, unsigned threads = 0) {
    SessionOptions options;
    options.threads = threads;
    return render(std::move(description), std::move(options));
}

}  // namespace pharos::testing
