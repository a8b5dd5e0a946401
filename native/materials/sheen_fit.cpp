#include "materials/sheen_fit.h"

#include <array>
#include <cmath>
#include <cstddef>

namespace pharos {

namespace {

// Coefficients of sqrt(mu)^i log(roughness)^j, fitted by least squares to what Blender 4.5 renders:
// directional albedo (furnace, within 0.004) and A, B of the transformed cosine recovered from the
// radiance under a sun in nine directions (A within 1.5 %, B within 0.006, where the albedo
// counts).
using Polynomial = std::array<std::array<float, 6>, 4>;

constexpr Polynomial kLogAlbedo{
    {{-0.3175298f, 0.106225f, 0.3689278f, 0.5546577f, 0.3863829f, 0.100808f},
     {0.2888726f, 1.186492f, -2.809416f, -7.55803f, -5.622026f, -1.362651f},
     {-1.408003f, -1.583203f, 10.90996f, 27.42702f, 20.03925f, 4.82109f},
     {0.3551659f, 2.572517f, -12.28721f, -23.36014f, -17.06897f, -3.462246f}}};
constexpr Polynomial kLogA{
    {{-0.4257283f, 0.7435948f, -2.726001f, -2.271624f, -0.709387f, -0.07998604f},
     {0.8732736f, 2.945135f, 12.10357f, 10.96554f, 4.400278f, 0.698524f},
     {-0.8664118f, -9.511309f, -34.08701f, -43.61859f, -23.63554f, -4.444754f},
     {0.31141f, 7.045899f, 28.53029f, 41.8132f, 24.2092f, 4.734063f}}};
constexpr Polynomial kB{
    {{-0.004889348f, 0.5629832f, 0.7876086f, 0.6834466f, 0.2728688f, 0.03734861f},
     {-0.01492234f, -0.1044914f, -1.673696f, -2.930237f, -1.211873f, -0.1434381f},
     {0.08908272f, 1.24239f, 6.752239f, 6.499534f, 1.502229f, 0.05732845f},
     {-0.06851174f, -1.639376f, -5.833637f, -4.584501f, -1.227384f, -0.2063131f}}};

constexpr float kMinRoughness = 0.05f;  // of the fit; smoother fibres show at grazing view only

[[nodiscard]] float evaluate(const Polynomial& p, float x, float y) {
    float sum = 0.0f;
    for (std::size_t i = p.size(); i-- > 0;) {
        float row = 0.0f;
        for (std::size_t j = p[i].size(); j-- > 0;) {
            row = row * y + p[i][j];
        }
        sum = sum * x + row;
    }
    return sum;
}

}  // namespace

SheenLtc sheen_ltc(float mu, float roughness) {
    const float x = std::sqrt(saturate(mu));
    const float y = std::log(std::clamp(roughness, kMinRoughness, 1.0f));
    SheenLtc ltc;
    ltc.a = std::exp(std::clamp(evaluate(kLogA, x, y), -4.6f, 0.0f));
    ltc.b = std::clamp(evaluate(kB, x, y), -0.3f, 0.05f);
    ltc.albedo = std::exp(std::clamp(evaluate(kLogAlbedo, x, y), -20.0f, 0.0f));
    return ltc;
}

}  // namespace pharos
