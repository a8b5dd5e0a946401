#include "core/parallel.h"

#include <utility>

#include "core/fp_state.h"

namespace pharos {

namespace {

// Tells the workers to end, and joins them while the members they use still live.
void end_workers(std::mutex& mutex,
                 bool& stop,
                 std::condition_variable& wake,
                 std::vector<std::jthread>& workers) {
    {
        const std::lock_guard lock(mutex);
        stop = true;
    }
    wake.notify_all();
    workers.clear();
}

}  // namespace

ThreadPool::ThreadPool(unsigned threads) {
    if (threads == 0) {
        threads = std::max(1u, std::thread::hardware_concurrency());
    }
    workers_.reserve(threads - 1);
    try {
        for (unsigned worker = 1; worker < threads; ++worker) {
            workers_.emplace_back([this, worker] { work(worker); });
        }
    } catch (...) {
        // Those that there are wait for work, and would be waited for.
        end_workers(mutex_, stop_, wake_, workers_);
        throw;
    }
}

ThreadPool::~ThreadPool() {
    end_workers(mutex_, stop_, wake_, workers_);
}

void ThreadPool::call(unsigned worker) {
    try {
        (*body_)(worker);
    } catch (...) {
        const std::lock_guard lock(mutex_);
        if (!error_) {
            error_ = std::current_exception();
        }
    }
}

void ThreadPool::work(unsigned worker) {
    const FloatStateGuard float_state;
    unsigned long seen = 0;
    while (true) {
        {
            std::unique_lock lock(mutex_);
            wake_.wait(lock, [&] { return stop_ || generation_ != seen; });
            if (stop_) {
                return;
            }
            seen = generation_;
        }
        call(worker);
        const std::lock_guard lock(mutex_);
        if (--running_ == 0) {
            done_.notify_one();
        }
    }
}

void ThreadPool::run(const std::function<void(unsigned)>& body) {
    {
        const std::lock_guard lock(mutex_);
        body_ = &body;
        running_ = static_cast<unsigned>(workers_.size());
        ++generation_;
        error_ = nullptr;
    }
    wake_.notify_all();
    call(0);
    std::unique_lock lock(mutex_);
    done_.wait(lock, [&] { return running_ == 0; });
    body_ = nullptr;
    if (error_) {
        std::rethrow_exception(std::exchange(error_, nullptr));
    }
}

}  // namespace pharos
