#include "materials/cellular.h"

#include <algorithm>

#include "core/math.h"
#include "materials/procedural_hash.h"

namespace pharos::detail {

namespace {

template <std::size_t D>
[[nodiscard]] NoisePoint<D> difference(const NoisePoint<D>& a, const NoisePoint<D>& b) {
    NoisePoint<D> out{};
    for (std::size_t k = 0; k < D; ++k) {
        out[k] = a[k] - b[k];
    }
    return out;
}

template <std::size_t D>
[[nodiscard]] float dot(const NoisePoint<D>& a, const NoisePoint<D>& b) {
    float sum = 0.0f;
    for (std::size_t k = 0; k < D; ++k) {
        sum += a[k] * b[k];
    }
    return sum;
}

template <std::size_t D>
[[nodiscard]] float length(const NoisePoint<D>& a) {
    return std::sqrt(dot<D>(a, a));
}

template <std::size_t D>
[[nodiscard]] float measure(const NoisePoint<D>& d, const CellInputs& in) {
    if constexpr (D == 1) {
        return std::abs(d[0]);
    }
    switch (in.metric) {
        case CellMetric::Manhattan: {
            float sum = 0.0f;
            for (const float x : d) {
                sum += std::abs(x);
            }
            return sum;
        }
        case CellMetric::Chebychev: {
            float most = 0.0f;
            for (const float x : d) {
                most = std::fmax(most, std::abs(x));
            }
            return most;
        }
        case CellMetric::Minkowski: {
            float sum = 0.0f;
            for (const float x : d) {
                sum += std::pow(std::abs(x), in.exponent);
            }
            return std::pow(sum, 1.0f / in.exponent);
        }
        default:
            return length<D>(d);
    }
}

// The lattice around a point: `cell` is its own cube, `local` where it lies therein.
template <std::size_t D>
struct Lattice {
    NoisePoint<D> cell{};
    NoisePoint<D> local{};
    float randomness = 1.0f;

    Lattice(const NoisePoint<D>& p, float random) : randomness(random) {
        for (std::size_t k = 0; k < D; ++k) {
            cell[k] = std::floor(p[k]);
            local[k] = p[k] - cell[k];
        }
    }

    [[nodiscard]] NoisePoint<D> cube(const NoisePoint<D>& offset) const {
        NoisePoint<D> at{};
        for (std::size_t k = 0; k < D; ++k) {
            at[k] = cell[k] + offset[k];
        }
        return at;
    }

    // The random point of a cube, in the frame of `local`.
    [[nodiscard]] NoisePoint<D> point(const NoisePoint<D>& offset) const {
        NoisePoint<D> at = hash_floats_to_same(cube(offset));
        for (std::size_t k = 0; k < D; ++k) {
            at[k] = offset[k] + at[k] * randomness;
        }
        return at;
    }

    [[nodiscard]] std::array<float, 3> color(const NoisePoint<D>& offset) const {
        return hash_floats_to_3(cube(offset));
    }
};

// Calls visit(offset) for all cubes at most `reach` away; the first axis runs fastest.
template <std::size_t D, class Visit>
void for_each_cube(int reach, const Visit& visit) {
    const int side = 2 * reach + 1;
    int count = 1;
    for (std::size_t k = 0; k < D; ++k) {
        count *= side;
    }
    for (int i = 0; i < count; ++i) {
        NoisePoint<D> offset{};
        for (int k = 0, rest = i; k < static_cast<int>(D); ++k, rest /= side) {
            offset[static_cast<std::size_t>(k)] = static_cast<float>(rest % side - reach);
        }
        visit(offset);
    }
}

template <std::size_t D>
[[nodiscard]] CellResult<D> result_at(const Lattice<D>& lattice,
                                      const NoisePoint<D>& offset,
                                      float distance) {
    CellResult<D> out;
    out.distance = distance;
    out.color = lattice.color(offset);
    out.position = lattice.point(offset);
    for (std::size_t k = 0; k < D; ++k) {
        out.position[k] += lattice.cell[k];
    }
    return out;
}

template <std::size_t D>
[[nodiscard]] CellResult<D> nearest(const NoisePoint<D>& p, const CellInputs& in, bool second) {
    const Lattice<D> lattice(p, in.randomness);
    float distance[2] = {kInfinity, kInfinity};
    NoisePoint<D> offset[2] = {};
    for_each_cube<D>(1, [&](const NoisePoint<D>& cube) {
        const float d = measure<D>(difference<D>(lattice.point(cube), lattice.local), in);
        if (d < distance[0]) {
            distance[1] = distance[0];
            offset[1] = offset[0];
            distance[0] = d;
            offset[0] = cube;
        } else if (d < distance[1]) {
            distance[1] = d;
            offset[1] = cube;
        }
    });
    const int which = second ? 1 : 0;
    return result_at<D>(
        lattice, offset[which], std::isfinite(distance[which]) ? distance[which] : 0.0f);
}

// A soft minimum over the cubes in a fixed order; colour and position follow its weights.
template <std::size_t D>
[[nodiscard]] CellResult<D> smooth_nearest(const NoisePoint<D>& p, const CellInputs& in) {
    const Lattice<D> lattice(p, in.randomness);
    CellResult<D> out;
    bool first = true;
    for_each_cube<D>(2, [&](const NoisePoint<D>& cube) {
        const NoisePoint<D> point = lattice.point(cube);
        const float d = measure<D>(difference<D>(point, lattice.local), in);
        float h = 1.0f;
        if (!first) {
            const float t = saturate(0.5f + 0.5f * (out.distance - d) / in.smoothness);
            h = t * t * (3.0f - 2.0f * t);
        }
        first = false;
        float correction = in.smoothness * h * (1.0f - h);
        out.distance = lerp(out.distance, d, h) - correction;
        correction /= 1.0f + 3.0f * in.smoothness;
        const std::array<float, 3> color = lattice.color(cube);
        for (std::size_t k = 0; k < 3; ++k) {
            out.color[k] = lerp(out.color[k], color[k], h) - correction;
        }
        for (std::size_t k = 0; k < D; ++k) {
            out.position[k] = lerp(out.position[k], point[k], h) - correction;
        }
    });
    for (std::size_t k = 0; k < D; ++k) {
        out.position[k] += lattice.cell[k];
    }
    return out;
}

// From here to the plane half-way between the nearest point and any other.
template <std::size_t D>
[[nodiscard]] float edge_distance(const NoisePoint<D>& p, const CellInputs& in) {
    const Lattice<D> lattice(p, in.randomness);
    NoisePoint<D> closest{};
    float smallest = kInfinity;
    for_each_cube<D>(1, [&](const NoisePoint<D>& cube) {
        const NoisePoint<D> to_point = difference<D>(lattice.point(cube), lattice.local);
        const float squared = dot<D>(to_point, to_point);
        if (squared < smallest) {
            smallest = squared;
            closest = to_point;
        }
    });
    float distance = 8.0f;
    for_each_cube<D>(1, [&](const NoisePoint<D>& cube) {
        const NoisePoint<D> to_point = difference<D>(lattice.point(cube), lattice.local);
        const NoisePoint<D> across = difference<D>(to_point, closest);
        const float squared = dot<D>(across, across);
        if (squared > 0.0001f) {
            NoisePoint<D> middle{};
            for (std::size_t k = 0; k < D; ++k) {
                middle[k] = 0.5f * (to_point[k] + closest[k]);
            }
            distance = std::fmin(distance, dot<D>(middle, across) / std::sqrt(squared));
        }
    });
    return distance;
}

// On a line the cell's ends lie half-way to its two neighbours.
[[nodiscard]] float line_edge_distance(const NoisePoint<1>& p, const CellInputs& in) {
    const Lattice<1> lattice(p, in.randomness);
    const float here = lattice.point({0.0f})[0];
    const float before = lattice.point({-1.0f})[0];
    const float after = lattice.point({1.0f})[0];
    return std::fmin(std::abs(0.5f * (here + before) - lattice.local[0]),
                     std::abs(0.5f * (here + after) - lattice.local[0]));
}

// Half the way from the nearest point to that one's nearest.
template <std::size_t D>
[[nodiscard]] float sphere_radius(const NoisePoint<D>& p, const CellInputs& in) {
    const Lattice<D> lattice(p, in.randomness);
    NoisePoint<D> closest{};
    NoisePoint<D> closest_cube{};
    float smallest = kInfinity;
    for_each_cube<D>(1, [&](const NoisePoint<D>& cube) {
        const NoisePoint<D> point = lattice.point(cube);
        const float d = length<D>(difference<D>(point, lattice.local));
        if (d < smallest) {
            smallest = d;
            closest = point;
            closest_cube = cube;
        }
    });
    float gap = kInfinity;
    for_each_cube<D>(1, [&](const NoisePoint<D>& step) {
        NoisePoint<D> cube = closest_cube;
        bool own = true;
        for (std::size_t k = 0; k < D; ++k) {
            own = own && step[k] == 0.0f;
            cube[k] += step[k];
        }
        if (!own) {
            gap = std::fmin(gap, length<D>(difference<D>(lattice.point(cube), closest)));
        }
    });
    return std::isfinite(gap) ? 0.5f * gap : 0.0f;
}

template <std::size_t D>
[[nodiscard]] CellResult<D> one_octave(const NoisePoint<D>& p, const CellInputs& in) {
    switch (in.feature) {
        case CellFeature::F2:
            return nearest<D>(p, in, true);
        case CellFeature::SmoothF1:
            return in.smoothness != 0.0f ? smooth_nearest<D>(p, in) : nearest<D>(p, in, false);
        default:
            return nearest<D>(p, in, false);
    }
}

// `a` moved towards a + b by the share.
template <std::size_t D>
void add_share(
    CellResult<D>& a, const CellResult<D>& octave, float scale, float amplitude, float share) {
    a.distance = lerp(a.distance, a.distance + octave.distance * amplitude, share);
    for (std::size_t k = 0; k < 3; ++k) {
        a.color[k] = lerp(a.color[k], a.color[k] + octave.color[k] * amplitude, share);
    }
    for (std::size_t k = 0; k < D; ++k) {
        const float mixed = lerp(a.position[k], octave.position[k] / scale, amplitude);
        a.position[k] = lerp(a.position[k], mixed, share);
    }
}

template <std::size_t D>
[[nodiscard]] CellResult<D> fractal_cells(const NoisePoint<D>& p, const CellInputs& in) {
    CellResult<D> out;
    float range = 0.0f;
    if (in.octaves == 0.0f || in.roughness == 0.0f) {
        out = one_octave<D>(p, in);
        range = 1.0f;
    } else {
        float scale = 1.0f;
        float amplitude = 1.0f;
        const int whole = static_cast<int>(in.octaves);
        for (int i = 0; i <= whole; ++i) {
            add_share<D>(out, one_octave<D>(scaled<D>(p, scale), in), scale, amplitude, 1.0f);
            range += amplitude;
            scale *= in.lacunarity;
            amplitude *= in.roughness;
        }
        const float rest = in.octaves - std::floor(in.octaves);
        if (rest != 0.0f) {
            add_share<D>(out, one_octave<D>(scaled<D>(p, scale), in), scale, amplitude, rest);
            range = lerp(range, range + amplitude, rest);
        }
    }
    if (in.normalize) {
        NoisePoint<D> corner{};
        corner.fill(0.5f + 0.5f * in.randomness);
        const float most = measure<D>(corner, in) * (in.feature == CellFeature::F2 ? 2.0f : 1.0f);
        out.distance /= range * most;
        for (float& c : out.color) {
            c /= range;
        }
    }
    return out;
}

template <std::size_t D>
[[nodiscard]] float one_edge(const NoisePoint<D>& p, const CellInputs& in) {
    if constexpr (D == 1) {
        return line_edge_distance(p, in);
    } else {
        return edge_distance<D>(p, in);
    }
}

template <std::size_t D>
[[nodiscard]] float fractal_edges(const NoisePoint<D>& p, const CellInputs& in) {
    const float most = 0.5f + 0.5f * in.randomness;
    float distance = 8.0f;
    float range = most;
    if (in.octaves == 0.0f || in.roughness == 0.0f) {
        distance = one_edge<D>(p, in);
    } else {
        float scale = 1.0f;
        float amplitude = 1.0f;
        const auto add = [&](float share) {
            const float octave = one_edge<D>(scaled<D>(p, scale), in) / scale;
            const float nearer = lerp(distance, std::fmin(distance, octave), amplitude);
            const float shorter = lerp(range, most / scale, amplitude);
            distance = share == 1.0f ? nearer : lerp(distance, std::fmin(distance, nearer), share);
            range = lerp(range, shorter, share);
            scale *= in.lacunarity;
            amplitude *= in.roughness;
        };
        for (int i = 0; i <= static_cast<int>(in.octaves); ++i) {
            add(1.0f);
        }
        if (const float rest = in.octaves - std::floor(in.octaves); rest != 0.0f) {
            add(rest);
        }
    }
    return in.normalize ? distance / range : distance;
}

}  // namespace

template <std::size_t D>
CellResult<D> cellular(const NoisePoint<D>& p, const CellInputs& in) {
    switch (in.feature) {
        case CellFeature::DistanceToEdge: {
            CellResult<D> out;
            out.distance = fractal_edges<D>(p, in);
            return out;
        }
        case CellFeature::NSphereRadius: {
            CellResult<D> out;
            out.distance = sphere_radius<D>(p, in);
            return out;
        }
        default:
            return fractal_cells<D>(p, in);
    }
}

template CellResult<1> cellular<1>(const NoisePoint<1>&, const CellInputs&);
template CellResult<2> cellular<2>(const NoisePoint<2>&, const CellInputs&);
template CellResult<3> cellular<3>(const NoisePoint<3>&, const CellInputs&);
template CellResult<4> cellular<4>(const NoisePoint<4>&, const CellInputs&);

}  // namespace pharos::detail
