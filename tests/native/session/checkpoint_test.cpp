#include "session/checkpoint.h"

#include <csignal>
#include <cstdlib>
#include <fstream>

#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "session/render_session.h"
#include "support/scratch.h"
#include "support/stress.h"
#include "support/test_scenes.h"
#include "support/timing.h"

namespace pharos {
namespace {

using namespace pharos::testing;

constexpr std::uint32_t kSize = 40;
constexpr std::uint32_t kSamples = 40;
constexpr std::uint64_t kStride = kSlowdown > 1.0 ? 14 : 7;  // batches between two cuts

SceneDescription scene(GuidingMode guiding) {
    SceneDescription d = two_rooms(kSize, kSize - 9, kSamples);
    d.settings.guiding = guiding;
    d.passes.wanted = ~0u;
    return d;
}

using Picture = std::vector<std::vector<float>>;

Picture all_passes(const RenderSession& session) {
    Picture picture;
    for (std::size_t i = 0; i < kFilmPasses; ++i) {
        const auto pass = static_cast<FilmPass>(i);
        auto& pixels = picture.emplace_back(std::size_t{session.width()} * session.height() *
                                            static_cast<std::size_t>(film_pass_channels(pass)));
        EXPECT_TRUE(session.read(pass, pixels));
    }
    return picture;
}

SessionOptions with_file(const std::string& path, Resume resume = Resume::Must) {
    SessionOptions options;
    options.threads = thread_count();
    options.checkpoint = {path, 1e9, resume};
    return options;
}

void wait(const RenderSession& session) {
    while (!session.wait(std::chrono::milliseconds(1000))) {
    }
}

// Renders until the film holds `batches` batches, then cancels. True when it came to its end.
bool render_a_part(const SceneDescription& d,
                   const SessionOptions& options,
                   std::uint64_t batches) {
    RenderSession session(d, options);
    while (!session.wait(std::chrono::milliseconds(1))) {
        if (session.progress().serial >= batches) {
            session.cancel();
        }
    }
    EXPECT_NE(session.progress().state, SessionState::Failed) << session.progress().error;
    return session.progress().state == SessionState::Finished;
}

struct Reference {
    Picture picture;
    SessionProgress progress;
};

Reference uninterrupted(const SceneDescription& d) {
    RenderSession session(d, thread_count());
    wait(session);
    return {all_passes(session), session.progress()};
}

// Cut off wherever the cancel came, often in the midst of a pass: film, weights, optimiser,
// selection and roulette all have to be as they were, or later passes differ.
TEST(Checkpoint, ResumedRenderIsBitEqual) {
    for (const GuidingMode mode : {GuidingMode::Off, GuidingMode::Neural, GuidingMode::Slides}) {
        SCOPED_TRACE(static_cast<int>(mode));
        const SceneDescription d = scene(mode);
        const Reference whole = uninterrupted(d);
        const ScratchFolder folder;
        const SessionOptions options = with_file(folder.file("checkpoint"));
        int parts = 0;
        for (std::uint64_t batches = 3; !render_a_part(d, options, batches); batches += kStride) {
            ASSERT_LT(++parts, 500);
        }
        EXPECT_GT(parts, 3);
        RenderSession last(d, options);  // finds the end, and only writes the picture
        wait(last);
        EXPECT_EQ(all_passes(last), whole.picture);
        EXPECT_EQ(last.progress().samples, kSamples);
        EXPECT_EQ(last.progress().guiding.records, whole.progress.guiding.records);
        EXPECT_EQ(last.progress().guiding.loss, whole.progress.guiding.loss);
        EXPECT_EQ(folder.files(), 1u);
    }
}

TEST(Checkpoint, IsWrittenAfterAnInterval) {
    const ScratchFolder folder;
    SessionOptions options = with_file(folder.file("checkpoint"));
    options.checkpoint.interval = 0.0;
    SceneDescription d = scene(GuidingMode::Off);
    d.settings.samples = 1u << 20;
    RenderSession session(d, options);
    while (!std::filesystem::exists(folder.file("checkpoint"))) {
        ASSERT_FALSE(session.wait(std::chrono::milliseconds(1)));
    }
    EXPECT_EQ(session.progress().state, SessionState::Rendering);
}

TEST(Checkpoint, NoFileIsANewRender) {
    const ScratchFolder folder;
    SceneDescription d = scene(GuidingMode::Off);
    d.settings.samples = 1;
    RenderSession session(d, with_file(folder.file("checkpoint")));
    wait(session);
    EXPECT_EQ(session.progress().state, SessionState::Finished);
    EXPECT_TRUE(std::filesystem::exists(folder.file("checkpoint")));
}

std::string error_with(SceneDescription d, const SessionOptions& options) {
    RenderSession session(std::move(d), options);
    wait(session);
    return session.progress().error;
}

TEST(Checkpoint, ThatOfAnotherRenderIsRefused) {
    const ScratchFolder folder;
    const SessionOptions options = with_file(folder.file("checkpoint"));
    SceneDescription d = scene(GuidingMode::Neural);
    d.settings.samples = 3;
    EXPECT_EQ(error_with(d, options), "");
    SceneDescription other = d;
    other.settings.seed = 1;
    EXPECT_NE(error_with(other, options).find("another seed"), std::string::npos);
    other = d;
    other.settings.guiding = GuidingMode::Off;
    EXPECT_NE(error_with(other, options).find("another guide"), std::string::npos);
    other = d;
    other.settings.max_bounces = 3;
    EXPECT_NE(error_with(other, options).find("other settings"), std::string::npos);
    other = d;
    other.meshes[0].positions[0].x += 0.001f;
    EXPECT_NE(error_with(other, options).find("another scene"), std::string::npos);
    other = d;
    other.film.crop_width -= 1;
    EXPECT_NE(error_with(other, options).find("another picture size"), std::string::npos);
    SessionOptions shard = options;
    shard.sample_offset = 8;
    EXPECT_NE(error_with(d, shard).find("other samples"), std::string::npos);
    // More samples go on from it.
    d.settings.samples = 5;
    EXPECT_EQ(error_with(d, options), "");
}

TEST(Checkpoint, DamagedOneIsRefusedOrRenderedAnew) {
    const ScratchFolder folder;
    const std::string path = folder.file("checkpoint");
    SceneDescription d = scene(GuidingMode::Neural);
    d.settings.samples = 3;
    EXPECT_EQ(error_with(d, with_file(path)), "");
    {
        std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
        file.seekp(5000);
        file.put('\x55');
        file.put('\x2a');
    }
    EXPECT_NE(error_with(d, with_file(path)).find("damaged"), std::string::npos);
    const Reference whole = uninterrupted(d);
    RenderSession anew(d, with_file(path, Resume::IfItFits));
    wait(anew);
    EXPECT_EQ(all_passes(anew), whole.picture);
    ASSERT_EQ(anew.report().size(), 1u);
    EXPECT_NE(anew.report()[0].message.find("Rendered anew"), std::string::npos);
}

TEST(Checkpoint, AFolderThatIsNotThereDoesNotEndTheRender) {
    SceneDescription d = scene(GuidingMode::Off);
    d.settings.samples = 2;
    RenderSession session(d, with_file("/nowhere/at/all/checkpoint"));
    wait(session);
    EXPECT_EQ(session.progress().state, SessionState::Finished);
    ASSERT_FALSE(session.report().empty());
    EXPECT_EQ(session.report().back().object, "Checkpoint");
}

// What the process that is killed does: PHAROS_KEEP_CHECKPOINT names the file, and it never ends.
SceneDescription endless() {
    SceneDescription d = scene(GuidingMode::Neural);
    d.settings.samples = 1u << 20;
    return d;
}

SessionOptions always_written(const std::string& path) {
    SessionOptions options = with_file(path);
    options.checkpoint.interval = 0.0;
    options.threads = 1;
    return options;
}

TEST(Scripts, KeepACheckpointUntilKilled) {
    const char* path = std::getenv("PHAROS_KEEP_CHECKPOINT");
    const ScratchFolder folder;
    SceneDescription d = endless();
    if (path == nullptr) {
        d.settings.samples = 2;
    }
    const SessionOptions options = always_written(path != nullptr ? path : folder.file("file"));
    RenderSession session(std::move(d), options);
    if (path != nullptr) {
        std::ofstream(std::string(path) + ".started");
    }
    wait(session);
    EXPECT_EQ(session.progress().state, SessionState::Finished) << session.progress().error;
    EXPECT_TRUE(std::filesystem::exists(options.checkpoint.path));
}

// This program again, with another test: a forked process could not start threads under the thread
// sanitizer.
pid_t start_keeping(const std::string& path) {
    std::vector<std::string> variables = {"PHAROS_KEEP_CHECKPOINT=" + path};
    for (char** variable = environ; *variable != nullptr; ++variable) {
        variables.emplace_back(*variable);
    }
    std::vector<char*> environment;
    for (std::string& variable : variables) {
        environment.push_back(variable.data());
    }
    environment.push_back(nullptr);
    std::string program = "/proc/self/exe";
    std::string filter = "--gtest_filter=Scripts.KeepACheckpointUntilKilled";
    std::string brief = "--gtest_brief=1";
    char* const arguments[] = {program.data(), filter.data(), brief.data(), nullptr};
    pid_t child = -1;
    EXPECT_EQ(
        ::posix_spawn(&child, program.c_str(), nullptr, nullptr, arguments, environment.data()), 0);
    return child;
}

// Waits until the file is there; false where the process has ended before.
bool appears(const std::string& file, pid_t writer) {
    while (!std::filesystem::exists(file)) {
        if (::waitpid(writer, nullptr, WNOHANG) != 0) {
            return false;
        }
        ::usleep(1000);
    }
    return true;
}

// A process of its own renders and writes without pause until it is killed: PHAROS_KILLS times,
// 100 in tests/stress. The file has to be whole each time, and the render has to end with the bits
// of an uninterrupted one.
TEST(Checkpoint, SurvivesKillsAtRandomMoments) {
    const char* wanted = std::getenv("PHAROS_KILLS");
    const int kills = wanted != nullptr ? std::atoi(wanted) : 5;
    const ScratchFolder folder;
    const SessionOptions options = always_written(folder.file("checkpoint"));
    const std::string started = options.checkpoint.path + ".started";
    SceneDescription d = endless();
    std::uint32_t random = 12345;
    std::uint32_t samples = 0;
    // A machine that is slow enough kills before there are two samples: once more then.
    for (int i = 0; i < kills || (samples < 2 && i < 20 * kills); ++i) {
        const pid_t child = start_keeping(options.checkpoint.path);
        ASSERT_TRUE(appears(started, child) && (i > 0 || appears(options.checkpoint.path, child)));
        random = random * 1664525u + 1013904223u;
        ::usleep(static_cast<useconds_t>(kSlowdown) * (random % 200000));
        ::kill(child, SIGKILL);
        int status = 0;
        ASSERT_EQ(::waitpid(child, &status, 0), child);
        ASSERT_TRUE(WIFSIGNALED(status)) << "kill " << i << ": the file was refused";
        std::filesystem::remove(started);
        SceneDescription nothing_more = d;
        nothing_more.settings.samples = 1;
        RenderSession session(nothing_more, options);
        wait(session);
        ASSERT_EQ(session.progress().state, SessionState::Finished) << session.progress().error;
        ASSERT_GE(session.progress().samples, samples) << "an older file";
        samples = session.progress().samples;
    }
    ASSERT_GT(samples, 1u);
    d.settings.samples = samples + 3;
    RenderSession resumed(d, options);
    wait(resumed);
    const Picture picture = all_passes(resumed);
    EXPECT_EQ(picture, uninterrupted(d).picture);
    say_stress("kill -9 while checkpoints are written: torn or lost files",
               static_cast<std::uint64_t>(kills),
               0.0,
               0.0);
}

}  // namespace
}  // namespace pharos
