// Thin films: without one the dielectric is left, colours come and go with the thickness, nothing
// is made from nothing.
#include "materials/thin_film.h"

#include <gtest/gtest.h>

#include "core/color.h"
#include "materials/fresnel.h"

namespace pharos {
namespace {

TEST(ThinFilm, WithoutThicknessTheBaseReflects) {
    for (const float eta : {0.7f, 1.2f, 1.5f, 2.4f}) {
        for (const float cosine : {1.0f, 0.8f, 0.4f, 0.1f}) {
            const Rgb f = film_reflectance({1.0f + 0.3f * eta, eta, 0.0f}, cosine);
            const float expected = fresnel_dielectric(cosine, eta);
            for (int c = 0; c < 3; ++c) {
                // The series ends after three terms.
                EXPECT_NEAR(f[c], expected, 0.01f) << eta << ' ' << cosine;
            }
        }
    }
}

TEST(ThinFilm, AFilmLikeItsBaseIsNotSeen) {
    for (const float thickness : {100.0f, 400.0f, 900.0f}) {
        const Rgb f = film_reflectance({1.5f, 1.5f, thickness}, 0.7f);
        EXPECT_NEAR(f.x, fresnel_dielectric(0.7f, 1.5f), 1e-4f);
        EXPECT_NEAR(f.z, f.x, 1e-4f);
    }
}

// Far apart waves of a wide spectrum no longer interfere: powers add.
TEST(ThinFilm, ThickFilmsLoseTheirColour) {
    const float outer = fresnel_dielectric(1.0f, 1.33f);
    const float inner = fresnel_dielectric(1.0f, 1.5f / 1.33f);
    const float both = outer + sqr(1.0f - outer) * inner / (1.0f - outer * inner);
    const Rgb f = film_reflectance({1.33f, 1.5f, 50000.0f}, 1.0f);
    for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(f[c], both, 1e-3f);
    }
    const Rgb thin = film_reflectance({1.33f, 1.5f, 300.0f}, 1.0f);
    EXPECT_GT(std::abs(thin.x - thin.z), 3.0f * std::abs(f.x - f.z) + 0.003f);
}

TEST(ThinFilm, IsWithinBoundsEverywhere) {
    for (const float film : {1e-5f, 0.5f, 1.0f, 1.33f, 3.0f, 1e5f}) {
        for (const float base : {1e-5f, 0.6f, 1.0f, 1.5f, 1e5f}) {
            for (const float thickness : {0.0f, 1.0f, 555.0f, 1e6f}) {
                for (const float cosine : {0.0f, 1e-4f, 0.5f, 1.0f}) {
                    const Rgb f = film_reflectance({film, base, thickness}, cosine);
                    ASSERT_TRUE(is_finite(f)) << film << ' ' << base << ' ' << thickness;
                    for (int c = 0; c < 3; ++c) {
                        ASSERT_GE(f[c], 0.0f);
                        ASSERT_LE(f[c], 1.0f);
                    }
                }
            }
        }
    }
}

}  // namespace
}  // namespace pharos
