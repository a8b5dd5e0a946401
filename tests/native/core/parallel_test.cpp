#include "core/parallel.h"

#include <atomic>
#include <cstdint>
#include <fstream>
#include <set>
#include <stdexcept>

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>
#include <xmmintrin.h>

#include "core/fp_state.h"
#include "core/memory.h"
#include "support/timing.h"

namespace pharos {
namespace {

TEST(ThreadPool, RunsEveryWorkerOnAThreadOfItsOwn) {
    for (unsigned threads : {1u, 2u, 8u}) {
        ThreadPool pool(threads);
        ASSERT_EQ(pool.size(), threads);
        std::mutex mutex;
        std::set<std::thread::id> ids;
        std::set<unsigned> workers;
        pool.run([&](unsigned worker) {
            const std::lock_guard lock(mutex);
            ids.insert(std::this_thread::get_id());
            workers.insert(worker);
        });
        EXPECT_EQ(ids.size(), threads);
        EXPECT_EQ(workers.size(), threads);
    }
}

TEST(ThreadPool, HandsOutEveryIndexOnce) {
    ThreadPool pool(8);
    for (int round = 0; round < 50; ++round) {
        std::vector<std::atomic<int>> seen(1000);
        pool.parallel_for(seen.size(), [&](std::size_t i, unsigned) { ++seen[i]; });
        for (const auto& count : seen) {
            EXPECT_EQ(count.load(), 1);
        }
    }
}

TEST(ThreadPool, RethrowsAWorkersException) {
    ThreadPool pool(4);
    for (int round = 0; round < 20; ++round) {
        EXPECT_THROW(pool.parallel_for(100,
                                       [&](std::size_t i, unsigned) {
                                           if (i == 37) {
                                               throw std::runtime_error("37");
                                           }
                                       }),
                     std::runtime_error);
        std::atomic<int> ran{0};
        pool.run([&](unsigned) { ++ran; });  // the pool is whole afterwards
        EXPECT_EQ(ran.load(), 4);
    }
}

// A pool that gets some of its threads and no more ends those and says so.
TEST(ThreadPool, EndsWhereThereIsNoMemoryForItsThreads) {
    if (testing::kSlowdown > 1.0) {
        GTEST_SKIP() << "a sanitizer needs the address space";
    }
    rlimit before{};
    ASSERT_EQ(::getrlimit(RLIMIT_AS, &before), 0);
    std::uint64_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    rlimit low = before;
    low.rlim_cur = pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE)) + (64u << 20);
    ASSERT_EQ(::setrlimit(RLIMIT_AS, &low), 0);
    bool out_of_memory = false;
    try {
        const ThreadPool pool(64);
    } catch (const std::exception& error) {
        out_of_memory = is_out_of_memory(error);
    }
    ASSERT_EQ(::setrlimit(RLIMIT_AS, &before), 0);
    EXPECT_TRUE(out_of_memory);
    EXPECT_EQ(ThreadPool(8).size(), 8u);
}

TEST(FloatStateGuard, RestoresTheHostsMode) {
    const unsigned before = _mm_getcsr();
    _mm_setcsr(before | 0x8040u);  // a host with flush-to-zero and denormals-are-zero
    const unsigned host = _mm_getcsr() & ~0x3fu;
    try {
        const FloatStateGuard guard;
        volatile float tiny = 1e-40f;
        EXPECT_GT(tiny * 1.0f, 0.0f);
        throw std::runtime_error("out");
    } catch (const std::runtime_error&) {
        EXPECT_EQ(_mm_getcsr() & ~0x3fu, host);
    }
    _mm_setcsr(before);
}

}  // namespace
}  // namespace pharos
