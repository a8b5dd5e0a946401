// Devices, scenes and builds of Embree that end when they are told to (internal to geometry/: only
// accelerator.cpp and this pair of files know Embree).
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>

#include <embree3/rtcore.h>

#include "core/cancel.h"

namespace pharos {

struct DeviceRelease {
    void operator()(RTCDeviceTy* device) const { rtcReleaseDevice(device); }
};

struct SceneRelease {
    void operator()(RTCSceneTy* scene) const { rtcReleaseScene(scene); }
};

struct GeometryRelease {
    void operator()(RTCGeometryTy* geometry) const { rtcReleaseGeometry(geometry); }
};

using DevicePtr = std::unique_ptr<RTCDeviceTy, DeviceRelease>;
using ScenePtr = std::unique_ptr<RTCSceneTy, SceneRelease>;
using GeometryPtr = std::unique_ptr<RTCGeometryTy, GeometryRelease>;

// A device and what its callbacks see while it builds, on any of Embree's threads. Once a build was
// cancelled, or took more than it may, the device builds nothing more. Throws std::runtime_error
// without Embree 3.
struct EmbreeDevice {
    EmbreeDevice();
    EmbreeDevice(const EmbreeDevice&) = delete;
    EmbreeDevice& operator=(const EmbreeDevice&) = delete;

    // The device may take so many bytes more than it has.
    void allow(std::uint64_t more);

    std::atomic<bool> stop{false};
    std::atomic<bool> full{false};
    std::atomic<std::int64_t> bytes{0};
    std::atomic<std::int64_t> most_bytes{std::numeric_limits<std::int64_t>::max()};
    DevicePtr device;  // last: its end is still counted
};

[[nodiscard]] ScenePtr make_scene(EmbreeDevice& device);

// Throws what an error of Embree means to a build: std::bad_alloc where the memory was refused.
void throw_if_failed(const EmbreeDevice& device, RTCError error);

// What is built, and what has to stay alive until the build has ended.
struct BuildTarget {
    std::shared_ptr<const void> owner;
    std::shared_ptr<EmbreeDevice> device;
    RTCScene scene = nullptr;
};

// Builds a scene of so many triangles or instances. Throws Cancelled soon after `cancel`: a long
// build runs on a thread of its own, and is left behind there when it does not end at once.
void commit_scene(const BuildTarget& target, std::size_t primitives, const CancelFlag& cancel);

}  // namespace pharos
