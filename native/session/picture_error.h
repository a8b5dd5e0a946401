// The error of a picture, as all measurements here take it.
#pragma once

#include <span>

namespace pharos {

// relMSE of RGBA pixels, the mean of (I-R)^2 / (R^2 + 0.01), without the worst thousandth of them.
[[nodiscard]] double trimmed_error(std::span<const float> picture,
                                   std::span<const float> reference);

}  // namespace pharos
