// What the guide did and whether it pays: for the statistics line and the panels.
#pragma once

#include <cstdint>
#include <string_view>

namespace pharos {

struct GuideStatus {
    bool enabled = false;        // guiding was asked for
    bool closed = false;         // it does not pay here: nothing is guided or recorded
    bool brief = false;          // it could not pay: the picture has too few samples
    double guided_share = 0.0;   // of the vertices judged last
    double moment_ratio = 1.0;   // second moment with the guide over that without
    float loss = 0.0f;           // of the last training
    float held_out_loss = 0.0f;  // of the snapshot in use, on records it has not learned from
    std::uint64_t snapshots = 0;
    std::uint64_t records = 0;
    std::uint64_t skipped_steps = 0;
    double fitting = 1.0;  // share of its work that fits into the budget of a frame
};

template <class Archive>
void state_fields(Archive& archive, GuideStatus& s) {
    archive(s.enabled, s.closed, s.guided_share, s.moment_ratio, s.loss, s.held_out_loss);
    archive(s.snapshots, s.records, s.skipped_steps);
}

enum class GuideState : std::uint8_t {
    Off,       // not asked for
    Learning,  // no snapshot is published yet
    Unproven,  // it has learned, but no region has shown yet that it gains
    Guiding,
    Closed,  // it does not pay in this scene: recording and training have stopped
    Brief    // the picture ends before learning could pay
};

[[nodiscard]] constexpr GuideState guide_state(const GuideStatus& status) {
    if (!status.enabled) {
        return GuideState::Off;
    }
    if (status.brief) {
        return GuideState::Brief;
    }
    if (status.closed) {
        return GuideState::Closed;
    }
    if (status.snapshots == 0) {
        return GuideState::Learning;
    }
    return status.guided_share > 0.0 ? GuideState::Guiding : GuideState::Unproven;
}

// Why nothing is guided; empty while something is.
[[nodiscard]] constexpr std::string_view why_unguided(GuideState state) {
    switch (state) {
        case GuideState::Off:
            return "off";
        case GuideState::Learning:
            return "off until something is learned";
        case GuideState::Unproven:
            return "off until it is proven to gain";
        case GuideState::Closed:
            return "off: it does not pay in this scene";
        case GuideState::Brief:
            return "off: too few samples to learn from";
        case GuideState::Guiding:
            break;
    }
    return {};
}

}  // namespace pharos
