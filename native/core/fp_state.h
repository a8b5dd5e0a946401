// Floating-point state of a host's thread: saved on entry, restored on every path out.
#pragma once

#include <xmmintrin.h>

namespace pharos {

// Sets round-to-nearest, all exceptions masked, denormals kept; restores the caller's MXCSR at the
// end of the scope (sticky exception flags excepted: those six bits say nothing about the mode).
class FloatStateGuard {
  public:
    FloatStateGuard() : saved_(_mm_getcsr()) { _mm_setcsr(kDefault); }

    ~FloatStateGuard() { _mm_setcsr(saved_); }

    FloatStateGuard(const FloatStateGuard&) = delete;
    FloatStateGuard& operator=(const FloatStateGuard&) = delete;

  private:
    static constexpr unsigned kDefault = 0x1f80;
    unsigned saved_;
};

}  // namespace pharos
