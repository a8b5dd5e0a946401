// A race that the thread sanitizer has to report under our suppressions: an exception is freed by a
// thread that never synchronised with the one that threw it. suite_tsan of tests/suites.sh.
#include <atomic>
#include <chrono>
#include <cstring>
#include <exception>
#include <thread>

int main() {
    std::atomic<void*> handed{nullptr};
    std::thread thrower([&] {
        try {
            throw 1;  // owns no other memory
        } catch (...) {
            // The pointer's bits without the pointer, whose own race would be reported too.
            auto* pointer = new std::exception_ptr(std::current_exception());
            void* bits = nullptr;
            std::memcpy(&bits, pointer, sizeof(bits));
            handed.store(bits, std::memory_order_relaxed);
        }
    });
    void* bits = nullptr;
    while (bits == nullptr) {
        bits = handed.load(std::memory_order_relaxed);
        std::this_thread::yield();
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(50));  // the thrower has let go by then
    {
        std::exception_ptr last;
        std::memcpy(static_cast<void*>(&last), &bits, sizeof(bits));
    }
    thrower.join();
}
