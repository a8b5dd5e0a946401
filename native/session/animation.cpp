#include "session/animation.h"

#include <stdexcept>

#include "session/adaptation.h"
#include "session/picture_error.h"
#include "session/render_session.h"

namespace pharos {

namespace {

constexpr std::uint32_t kReferenceSeed = 0x5eedu;

struct Shot {
    std::vector<float> picture;
    std::vector<std::byte> field;
    double cpu_seconds = 0.0;
};

Shot render(SceneDescription description, SessionOptions options) {
    const RenderSession session(std::move(description), std::move(options));
    while (!session.wait(std::chrono::milliseconds(1000))) {
    }
    const SessionProgress progress = session.progress();
    if (progress.state != SessionState::Finished) {
        throw std::runtime_error(progress.error);
    }
    Shot frame;
    frame.picture.resize(std::size_t{4} * session.width() * session.height());
    session.read(FilmPass::Combined, frame.picture);
    frame.field = session.field();
    frame.cpu_seconds = session.statistics().render_cpu_seconds;
    return frame;
}

SessionOptions with_threads(const AnimationSettings& settings) {
    SessionOptions options;
    options.threads = settings.threads;
    return options;
}

SceneDescription at_frame(SceneDescription description,
                          const AnimationSettings& settings,
                          std::uint32_t frame) {
    const std::uint32_t last = std::max(settings.frames, 2u) - 1;
    const float part = settings.cut ? (2 * frame > last ? 1.0f : 0.0f)
                                    : static_cast<float>(frame) / static_cast<float>(last);
    find_lamp(description, settings.lamp).to_world[3] += Vec4(part * settings.offset, 0.0f);
    return description;
}

}  // namespace

std::vector<AnimatedFrame> measure_animation(const SceneDescription& description,
                                             const AnimationSettings& settings) {
    std::vector<AnimatedFrame> frames;
    std::vector<std::byte> field;
    for (std::uint32_t i = 0; i < settings.frames; ++i) {
        SceneDescription scene = at_frame(description, settings, i);
        scene.settings.guiding = GuidingMode::Neural;
        SceneDescription exact = scene;
        exact.settings.samples = settings.reference;
        exact.settings.seed ^= kReferenceSeed;
        SessionOptions options = with_threads(settings);
        const std::vector<float> reference = render(std::move(exact), options).picture;
        const auto figures = [&](const Shot& frame) {
            return FrameFigures{trimmed_error(frame.picture, reference), frame.cpu_seconds};
        };
        AnimatedFrame& measured = frames.emplace_back();
        measured.anew = figures(render(scene, options));
        options.field = std::move(field);
        options.field_learns = true;
        Shot going_on = render(scene, options);
        measured.going_on = figures(going_on);
        field = std::move(going_on.field);
        scene.settings.guiding = GuidingMode::Off;
        measured.unguided = figures(render(std::move(scene), with_threads(settings)));
    }
    return frames;
}

}  // namespace pharos
