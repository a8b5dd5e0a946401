#include "geometry/embree_build.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <limits>
#include <mutex>
#include <new>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "core/fp_state.h"

namespace pharos {

namespace {

constexpr std::size_t kShortBuild = 100000;  // triangles or instances, tens of ms
constexpr std::chrono::milliseconds kPollInterval(5);
constexpr std::chrono::milliseconds kPatience(100);  // with a build that has been told to stop

bool on_memory(void* user, ssize_t change, bool post) {
    auto& device = *static_cast<EmbreeDevice*>(user);
    const std::int64_t bytes = device.bytes.fetch_add(change, std::memory_order_relaxed) + change;
    if (change <= 0) {
        return true;  // a release
    }
    if (bytes > device.most_bytes.load(std::memory_order_relaxed)) {
        device.full.store(true, std::memory_order_relaxed);
    }
    // A refused allocation ends a build early.
    const bool granted = !device.full.load(std::memory_order_relaxed) &&
                         !device.stop.load(std::memory_order_relaxed);
    if (!granted && !post) {
        device.bytes.fetch_sub(change, std::memory_order_relaxed);  // it is never made
    }
    return granted;
}

bool on_progress(void* user, double /*fraction*/) {
    const auto& device = *static_cast<const EmbreeDevice*>(user);
    return !device.full.load(std::memory_order_relaxed) &&
           !device.stop.load(std::memory_order_relaxed);
}

// A function of its own, which the suppressions of the thread sanitizer name: the exception of a
// build that on_memory or on_progress ends crosses threads inside TBB.
[[gnu::noinline]] RTCError commit_with_embree(const BuildTarget& target) {
    rtcCommitScene(target.scene);
    return rtcGetDeviceError(target.device->device.get());  // errors are kept by thread
}

struct Commit {
    BuildTarget target;
    std::mutex mutex;
    std::condition_variable changed;
    bool done = false;
    RTCError error = RTC_ERROR_NONE;
    std::shared_ptr<Commit> itself;  // see never_destroy
    const Commit* before = nullptr;

    void run() {
        const FloatStateGuard float_state;
        const RTCError ended_with = commit_with_embree(target);
        const std::lock_guard lock(mutex);
        error = ended_with;
        done = true;
        changed.notify_all();
    }

    // True when the build has ended within the time.
    bool wait(std::chrono::milliseconds time) {
        std::unique_lock lock(mutex);
        return changed.wait_for(lock, time, [this] { return done; });
    }
};

// Builds that were cancelled but still run: Embree asks its monitor only between stages, which take
// up to seconds for ten million triangles. They are joined when they have ended or, at the latest,
// when the process exits, because Embree must not be torn down under them.
class AbandonedBuilds {
  public:
    static AbandonedBuilds& instance() {
        static AbandonedBuilds builds;
        return builds;
    }

    void keep(std::jthread thread, std::shared_ptr<Commit> commit) {
        const std::lock_guard lock(mutex_);
        std::erase_if(builds_, [](const Build& build) {
            return build.commit->wait(std::chrono::milliseconds(0));
        });
        builds_.push_back({std::move(commit), std::move(thread)});
    }

  private:
    struct Build {
        std::shared_ptr<Commit> commit;
        std::jthread thread;  // joined before commit goes
    };

    std::mutex mutex_;
    std::vector<Build> builds_;
};

// Where TBB was refused memory or a thread it has lost a task of the build, and the end of the
// scene would wait for it for ever: such scenes are never destroyed. Nothing may be allocated here.
void never_destroy(const std::shared_ptr<Commit>& commit) {
    static std::mutex mutex;
    static constinit const Commit* newest = nullptr;  // reachable: no leak to a sanitizer
    const std::lock_guard lock(mutex);
    commit->before = newest;
    commit->itself = commit;
    newest = commit.get();
}

// The system's refusal, as opposed to that of on_memory and on_progress, which Embree expects.
bool is_refused_by_system(const EmbreeDevice& device, RTCError error) {
    return (error == RTC_ERROR_OUT_OF_MEMORY || error == RTC_ERROR_UNKNOWN) &&
           !device.full.load(std::memory_order_relaxed) &&
           !device.stop.load(std::memory_order_relaxed);
}

}  // namespace

// No threads= here: it would set the task scheduler's limit for the whole process, host included.
EmbreeDevice::EmbreeDevice() : device(rtcNewDevice(nullptr)) {
    if (device == nullptr) {
        // Its threads and their stacks are the first large things it asks for.
        if (const RTCError error = rtcGetDeviceError(nullptr);
            error == RTC_ERROR_OUT_OF_MEMORY || error == RTC_ERROR_UNKNOWN) {
            throw std::bad_alloc();
        }
        throw std::runtime_error("Embree cannot be started");
    }
    if (rtcGetDeviceProperty(device.get(), RTC_DEVICE_PROPERTY_VERSION) / 10000 != 3 ||
        rtcGetDeviceProperty(device.get(), RTC_DEVICE_PROPERTY_RAY_MASK_SUPPORTED) == 0) {
        throw std::runtime_error("Embree 3 with ray masks is needed");
    }
    rtcSetDeviceMemoryMonitorFunction(device.get(), on_memory, this);
}

void EmbreeDevice::allow(std::uint64_t more) {
    const std::int64_t used = bytes.load(std::memory_order_relaxed);
    const auto rest = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max() - used);
    most_bytes.store(used + static_cast<std::int64_t>(std::min(more, rest)),
                     std::memory_order_relaxed);
}

ScenePtr make_scene(EmbreeDevice& device) {
    ScenePtr scene(rtcNewScene(device.device.get()));
    if (scene == nullptr) {
        throw std::bad_alloc();
    }
    rtcSetSceneFlags(scene.get(), RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(scene.get(), RTC_BUILD_QUALITY_MEDIUM);
    rtcSetSceneProgressMonitorFunction(scene.get(), on_progress, &device);
    return scene;
}

void throw_if_failed(const EmbreeDevice& device, RTCError error) {
    switch (error) {
        case RTC_ERROR_NONE:
            return;
        case RTC_ERROR_OUT_OF_MEMORY:
        case RTC_ERROR_UNKNOWN:  // a thread that found no place for its stack
            throw std::bad_alloc();
        case RTC_ERROR_CANCELLED:
            if (device.full.load(std::memory_order_relaxed)) {
                throw std::bad_alloc();
            }
            throw Cancelled();
        default:
            throw std::runtime_error("Embree error " + std::to_string(error));
    }
}

void commit_scene(const BuildTarget& target, std::size_t primitives, const CancelFlag& cancel) {
    throw_if_cancelled(cancel);
    const auto commit = std::make_shared<Commit>();
    commit->target = target;
    if (primitives < kShortBuild) {
        commit->run();
    } else {
        std::jthread thread([commit] { commit->run(); });
        while (!commit->wait(kPollInterval)) {
            if (!cancel.cancelled()) {
                continue;
            }
            target.device->stop.store(true, std::memory_order_relaxed);
            if (!commit->wait(kPatience)) {
                AbandonedBuilds::instance().keep(std::move(thread), commit);
            }
            throw Cancelled();
        }
    }
    if (is_refused_by_system(*target.device, commit->error)) {
        never_destroy(commit);
    }
    throw_if_cancelled(cancel);
    throw_if_failed(*target.device, commit->error);
}

}  // namespace pharos
