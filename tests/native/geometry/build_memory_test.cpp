// Builds under a limit of address space (RLIMIT_AS): each ends soon, with a structure or an error.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <thread>

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include "core/memory.h"
#include "random_scene.h"

namespace pharos::testing {
namespace {

void leave_address_space(std::uint64_t bytes) {
    std::uint64_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    const rlim_t size = pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE)) + bytes;
    const rlimit limit{size, size};
    ::setrlimit(RLIMIT_AS, &limit);
}

// Exits with 4 after 20 seconds. Naps are counted: a machine that stands still must not count.
void end_if_it_hangs() {
    std::thread([] {
        for (int nap = 0; nap < 200; ++nap) {
            std::this_thread::sleep_for(std::chrono::milliseconds(100));
        }
        std::_Exit(4);
    }).detach();
}

// A process of its own: the threads of TBB start once.
[[noreturn]] void build_within(std::uint64_t bytes) {
    Random random(11);
    TestGeometry scene;
    scene.meshes.push_back(random_triangles(random, 120000, 10.0f, 0.1f));
    scene.instances.push_back(make_instance(0, Mat4(1.0f)));
    end_if_it_hangs();
    leave_address_space(bytes);
    int code = 0;
    try {
        scene.build();
    } catch (const std::exception& error) {
        code = is_out_of_memory(error) ? 0 : 1;
        std::fprintf(stderr, "%s\n", error.what());
    }
    scene.accelerator.reset();
    std::_Exit(code);
}

// Where TBB cannot start a thread its task is lost, and the end of Embree's scene waited for it.
TEST(BuildMemoryDeathTest, AThreadThatCannotStartIsNotWaitedFor) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    GTEST_SKIP() << "the sanitizer needs the address space";
#endif
    GTEST_FLAG_SET(death_test_style, "threadsafe");
    for (std::uint64_t megabytes = 0; megabytes <= 240; megabytes += 6) {
        EXPECT_EXIT(build_within(megabytes << 20), ::testing::ExitedWithCode(0), "")
            << megabytes << " MiB left";
    }
}

}  // namespace
}  // namespace pharos::testing
