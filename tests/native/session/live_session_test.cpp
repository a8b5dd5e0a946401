// Live sessions: pictures after edits are those of a fresh start, the guide lives on.
#include "session/live_session.h"

#include <functional>

#include <gtest/gtest.h>

#include "support/stress.h"
#include "support/test_scenes.h"
#include "support/timing.h"

namespace pharos {
namespace {

using namespace pharos::testing;

constexpr std::uint32_t kWidth = 40;
constexpr std::uint32_t kHeight = 30;
constexpr std::chrono::seconds kPatience(static_cast<int>(60 * kSlowdown));

// Two rooms as a host describes them to a live session: every mesh has a version.
SceneDescription versioned_rooms(std::uint32_t samples) {
    SceneDescription description = two_rooms(kWidth, kHeight, samples);
    for (std::size_t i = 0; i < description.meshes.size(); ++i) {
        description.meshes[i].version = i + 1;
    }
    return description;
}

// As a host describes it again: without the content of what the session holds.
SceneDescription without_content(SceneDescription description, std::uint64_t known) {
    for (Mesh& mesh : description.meshes) {
        if (mesh.version <= known) {
            Mesh kept;
            kept.name = mesh.name;
            kept.version = mesh.version;
            mesh = std::move(kept);
        }
    }
    return description;
}

LivePicture finished(LiveSession& session) {
    EXPECT_TRUE(session.wait(kPatience));
    EXPECT_EQ(session.progress().render.state, SessionState::Finished)
        << session.progress().render.error;
    return session.picture();
}

LivePicture fresh(SceneDescription description) {
    LiveSession session(thread_count());
    session.set_scene(std::move(description));
    return finished(session);
}

struct Edit {
    const char* name;
    std::function<void(SceneDescription&)> apply;
};

std::vector<Edit> edits() {
    return {
        {"move",
         [](SceneDescription& d) { d.instances[2].to_world[3] += Vec4(0.3f, 0.1f, 0.2f, 0.0f); }},
        {"material",
         [](SceneDescription& d) {
             d.materials[0].program = diffuse_program(Rgb(0.8f, 0.3f, 0.1f));
         }},
        {"lamp", [](SceneDescription& d) { d.lights[0].to_world[3].x += 0.4f; }},
        {"mesh",
         [](SceneDescription& d) {
             d.meshes[3] = sphere_mesh("other", Vec3(0.6f, -0.8f, 0.4f), 0.3f);
             d.meshes[3].version = 77;
         }},
        {"remove", [](SceneDescription& d) { d.instances.erase(d.instances.begin() + 1); }},
        {"duplicate",
         [](SceneDescription& d) {
             InstanceDescription copy = d.instances[2];
             copy.to_world[3].x += 1.1f;
             d.instances.push_back(copy);
         }},
        {"world",
         [](SceneDescription& d) {
             d.world.program = background_program(Rgb(0.3f, 0.4f, 0.6f), 1.0f);
             d.instances.erase(d.instances.begin());
         }},
        {"hide", [](SceneDescription& d) { d.instances[1].visibility = kVisibleShadow; }},
    };
}

TEST(LiveSession, EveryEditShowsWhatAFreshStartShows) {
    LiveSession session(thread_count());
    session.set_scene(versioned_rooms(3));
    const LivePicture before = finished(session);
    EXPECT_EQ(before.width, kWidth);
    EXPECT_EQ(before.pixels, fresh(versioned_rooms(3)).pixels);
    for (const Edit& edit : edits()) {
        SceneDescription description = versioned_rooms(3);
        edit.apply(description);
        session.set_scene(without_content(description, 70));
        const LivePicture after = finished(session);
        EXPECT_NE(after.pixels, before.pixels) << edit.name;
        EXPECT_EQ(after.pixels, fresh(std::move(description)).pixels) << edit.name;
        // And back: what was dropped meanwhile comes in full.
        session.set_scene(versioned_rooms(3));
        EXPECT_EQ(finished(session).pixels, before.pixels) << edit.name;
    }
}

// An image as texture and one as the world; each pixel of both is `value`.
SceneDescription textured_scene(float value, std::uint64_t version) {
    SceneBuilder b;
    for (std::uint64_t i = 0; i < 2; ++i) {
        ImageDescription image;
        image.name = "image " + std::to_string(i);
        image.version = version == 0 ? 0 : version + i;
        image.width = 8;
        image.height = 4;
        for (std::size_t k = 0; k < 4 * 32; ++k) {
            image.pixels.push_back(value * static_cast<float>(k % 7));
        }
        b.image(std::move(image));
    }
    const auto textured = b.material("textured", image_diffuse_program({.image = 0}));
    Mesh floor = quad_mesh("floor", Vec3(-1, -1, 0), Vec3(2, 0, 0), Vec3(0, 2, 0));
    floor.version = 1;
    b.object(std::move(floor), textured);
    b.world(environment_image_program(1, 1.0f));
    b.camera(Vec3(0, -3, 2), Vec3(0), 1.0f, kWidth, kHeight);
    b.settings().samples = 2;
    return b.build();
}

TEST(LiveSession, ImagesAndTheWorldsMapAreKept) {
    LiveSession session(thread_count());
    session.set_scene(textured_scene(0.1f, 10));
    const LivePicture first = finished(session);
    EXPECT_EQ(first.pixels, fresh(textured_scene(0.1f, 0)).pixels);
    const auto handed_over = [](SceneDescription description, std::uint64_t known) {
        description = without_content(std::move(description), 70);
        for (ImageDescription& image : description.images) {
            if (image.version <= known) {
                image.pixels.clear();
            }
        }
        return description;
    };
    SceneDescription moved = textured_scene(0.1f, 10);
    moved.instances[0].to_world[3].x = 0.4f;
    session.set_scene(handed_over(moved, 11));
    EXPECT_EQ(finished(session).pixels, fresh(std::move(moved)).pixels);
    // One image changes, the other is kept.
    for (const std::size_t changed : {0u, 1u}) {
        SceneDescription description = textured_scene(0.1f, 10);
        description.images[changed] = textured_scene(0.3f, 20).images[changed];
        session.set_scene(handed_over(description, 11));
        const LivePicture picture = finished(session);
        EXPECT_NE(picture.pixels, first.pixels);
        EXPECT_EQ(picture.pixels, fresh(std::move(description)).pixels);
        session.set_scene(textured_scene(0.1f, 10));
        EXPECT_EQ(finished(session).pixels, first.pixels);
    }
}

TEST(LiveSession, AViewNeedsNoScene) {
    LiveSession session(thread_count());
    session.set_scene(versioned_rooms(2));
    const LivePicture first = finished(session);
    SceneDescription moved = versioned_rooms(2);
    moved.camera.to_world[3].x += 0.4f;
    session.set_view(view_of(moved));
    const LivePicture second = finished(session);
    EXPECT_GT(second.serial, first.serial);
    EXPECT_EQ(second.pixels, fresh(std::move(moved)).pixels);
    session.set_view(view_of(versioned_rooms(2)));
    EXPECT_EQ(finished(session).pixels, first.pixels);
}

TEST(LiveSession, APictureCanBeWaitedFor) {
    LiveSession session(2);
    EXPECT_FALSE(session.wait_picture(kPatience));  // at once: nothing was asked for
    session.set_scene(versioned_rooms(1 << 20));
    ASSERT_TRUE(session.wait_picture(kPatience));
    EXPECT_TRUE(session.progress().has_picture);
    EXPECT_FALSE(session.picture().pixels.empty());
    SceneDescription moved = versioned_rooms(1 << 20);
    moved.camera.to_world[3].x += 0.4f;
    EXPECT_TRUE(session.set_view(view_of(moved)));
    EXPECT_FALSE(session.set_view(view_of(moved)));
    ASSERT_TRUE(session.wait_picture(kPatience));
    EXPECT_EQ(session.progress().pictures, 2u);
    session.set_paused(true);
    EXPECT_TRUE(session.wait(kPatience));
    session.set_view(view_of(versioned_rooms(1 << 20)));
    EXPECT_FALSE(session.wait_picture(kPatience));  // at once: it will not be rendered
}

TEST(LiveSession, NothingStartsAgainWhereNothingChanged) {
    LiveSession session(thread_count());
    session.set_scene(versioned_rooms(2));
    static_cast<void>(finished(session));
    const std::uint64_t pictures = session.progress().pictures;
    session.set_scene(without_content(versioned_rooms(2), 70));
    session.set_view(view_of(versioned_rooms(2)));
    static_cast<void>(finished(session));
    EXPECT_EQ(session.progress().pictures, pictures);
}

TEST(LiveSession, TheGuideLivesOnUntilItIsForgotten) {
    LiveSession session(thread_count());
    SceneDescription description = versioned_rooms(8);
    description.settings.guiding = GuidingMode::Neural;
    session.set_scene(description);
    static_cast<void>(finished(session));
    EXPECT_FALSE(session.progress().guide_kept);
    const std::uint64_t snapshots = session.progress().render.guiding.snapshots;
    EXPECT_GT(snapshots, 0u);
    description.camera.to_world[3].x += 0.2f;
    session.set_view(view_of(description));
    static_cast<void>(finished(session));
    EXPECT_TRUE(session.progress().guide_kept);
    // Where all is ten times slower a frame's budget may be too small to learn anything.
    EXPECT_GE(session.progress().render.guiding.snapshots, snapshots + (kSlowdown > 1.0 ? 0 : 1));
    description.lights[0].to_world[3].y += 0.2f;
    session.set_scene(without_content(description, 70));
    static_cast<void>(finished(session));
    EXPECT_TRUE(session.progress().guide_kept);
    session.forget_guide();
    description.lights[0].to_world[3].y += 0.2f;
    session.set_scene(without_content(description, 70));
    static_cast<void>(finished(session));
    EXPECT_FALSE(session.progress().guide_kept);
}

TEST(LiveSession, LobesAreToldWhileItRendersAndAfterwards) {
    LiveSession session(thread_count());
    SceneDescription description = versioned_rooms(6);
    description.settings.guiding = GuidingMode::Neural;
    session.set_scene(std::move(description));
    const std::uint64_t early = session.ask_lobes(Vec2(0.5f, 0.2f));
    static_cast<void>(finished(session));
    EXPECT_EQ(session.lobes().question, early);
    const std::uint64_t late = session.ask_lobes(Vec2(0.5f, 0.2f));
    while (session.lobes().question != late) {
        session.wait(std::chrono::milliseconds(1));
    }
    const LobeProbe probe = session.lobes();
    ASSERT_TRUE(probe.hit);
    ASSERT_FALSE(probe.lobes.empty());
    float weight = 0.0f;
    for (const GuideLobe& lobe : probe.lobes) {
        EXPECT_NEAR(glm::length(lobe.direction), 1.0f, 1e-4f);
        EXPECT_LE(lobe.weight, probe.lobes.front().weight);
        weight += lobe.weight;
    }
    EXPECT_NEAR(weight, 1.0f, 1e-4f);
    EXPECT_GT(probe.irradiance, 0.0f);
}

TEST(LiveSession, ChangesInARushShowTheLast) {
    const LivePicture expected = fresh(versioned_rooms(2));
    LiveSession session(thread_count());
    for (int i = 0; i < 40; ++i) {
        SceneDescription description = versioned_rooms(2);
        description.instances[2].to_world[3].x += 0.01f * static_cast<float>(39 - i);
        if (i > 0) {
            description = without_content(std::move(description), 70);
        }
        session.set_scene(std::move(description));
        session.set_paused(i % 7 == 3);
    }
    session.set_paused(false);
    EXPECT_EQ(finished(session).pixels, expected.pixels);
}

TEST(LiveSession, MissingContentIsAnErrorThatPasses) {
    LiveSession session(thread_count());
    session.set_scene(without_content(versioned_rooms(2), 70));
    ASSERT_TRUE(session.wait(kPatience));
    EXPECT_EQ(session.progress().render.state, SessionState::Failed);
    EXPECT_TRUE(session.progress().lost_scene);
    session.set_scene(versioned_rooms(2));
    EXPECT_EQ(finished(session).pixels, fresh(versioned_rooms(2)).pixels);
    EXPECT_FALSE(session.progress().lost_scene);
}

TEST(LiveSession, ALargeViewShowsACoarsePictureFirst) {
    SceneDescription description = versioned_rooms(1);
    FilmDescription& film = description.film;
    film.width = film.crop_width = 640;
    film.height = film.crop_height = 480;
    LiveSession session(thread_count());
    session.set_scene(description);
    LivePicture first;
    while (first.pixels.empty() && !session.wait(std::chrono::milliseconds(1))) {
        first = session.picture();
    }
    ASSERT_FALSE(first.pixels.empty());
    EXPECT_LT(session.progress().render.samples, 1u);
    EXPECT_EQ(finished(session).pixels, fresh(std::move(description)).pixels);
}

TEST(LiveSession, PausedItRendersNothing) {
    LiveSession session(thread_count());
    session.set_paused(true);
    session.set_scene(versioned_rooms(1));
    ASSERT_TRUE(session.wait(kPatience));
    EXPECT_TRUE(session.picture().pixels.empty());
    session.set_paused(false);
    EXPECT_FALSE(finished(session).pixels.empty());
}

TEST(LiveSession, ItMayEndAtAnyMoment) {
    for (int i = 0; i < 20; ++i) {
        LiveSession session(thread_count());
        session.set_scene(versioned_rooms(1u << 20));
        session.wait(std::chrono::milliseconds(i));
    }
}

}  // namespace
}  // namespace pharos
