#include "materials/sheen_fit.h"

namespace pharos {

SheenLtc sheen_ltc(float mu, float roughness) {
    const float grazing = sqr(1.0f - mu);
    SheenLtc ltc;
    // Rough fibres scatter widely, smooth ones towards grazing directions.
    ltc.a = lerp(0.25f, 0.8f, roughness) * lerp(1.0f, 0.6f, grazing);
    ltc.b = lerp(-0.8f, -0.1f, roughness) * (1.0f - mu);
    ltc.albedo = saturate(lerp(0.02f, 0.25f, roughness) + 0.6f * grazing * (1.0f - mu));
    return ltc;
}

}  // namespace pharos
