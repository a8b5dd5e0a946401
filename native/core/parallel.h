// A small pool of real threads: thread counts are what they say, and nothing is shared with the
// host.
//
// Contract: run() calls body(worker) once on each of size() workers, worker 0 being the caller, and
// returns when all have. parallel_for() hands out [0, count) by an atomic counter. The first
// exception of any worker is rethrown in the caller; the others are dropped. Not reentrant.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace pharos {

class ThreadPool {
  public:
    // `threads` >= 1 counts the calling thread; 0 means one per core.
    explicit ThreadPool(unsigned threads = 0);
    ~ThreadPool();
    ThreadPool(const ThreadPool&) = delete;
    ThreadPool& operator=(const ThreadPool&) = delete;

    [[nodiscard]] unsigned size() const { return static_cast<unsigned>(workers_.size()) + 1; }

    void run(const std::function<void(unsigned worker)>& body);

    // body(index, worker) for every index; which worker gets which index is not determined.
    template <class Body>
    void parallel_for(std::size_t count, const Body& body) {
        std::atomic<std::size_t> next{0};
        run([&](unsigned worker) {
            for (std::size_t i = next.fetch_add(1); i < count; i = next.fetch_add(1)) {
                body(i, worker);
            }
        });
    }

  private:
    void work(unsigned worker);
    void call(unsigned worker);

    std::mutex mutex_;
    std::condition_variable wake_;
    std::condition_variable done_;
    const std::function<void(unsigned)>* body_ = nullptr;
    unsigned long generation_ = 0;
    unsigned running_ = 0;
    bool stop_ = false;
    std::exception_ptr error_;
    std::vector<std::jthread> workers_;
};

}  // namespace pharos
