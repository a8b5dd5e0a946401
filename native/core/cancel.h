// A flag that long work polls: set once from any thread, never cleared.
#pragma once

#include <atomic>
#include <stdexcept>

namespace pharos {

class CancelFlag {
  public:
    void cancel() { flag_.store(true, std::memory_order_relaxed); }

    [[nodiscard]] bool cancelled() const { return flag_.load(std::memory_order_relaxed); }

  private:
    std::atomic<bool> flag_{false};
};

// Thrown by work that cannot return a partial result (scene building) when its flag is set.
class Cancelled : public std::runtime_error {
  public:
    Cancelled() : std::runtime_error("cancelled") {}
};

inline void throw_if_cancelled(const CancelFlag& cancel) {
    if (cancel.cancelled()) {
        throw Cancelled();
    }
}

// Null: nobody can cancel.
inline void throw_if_cancelled(const CancelFlag* cancel) {
    if (cancel != nullptr) {
        throw_if_cancelled(*cancel);
    }
}

}  // namespace pharos
