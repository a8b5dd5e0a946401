// Which members the dump format holds, in order: one list for writing and reading.
//
// Structured bindings name every member, so that a structure that gains one does not compile until
// it is listed here (and kVersion raised, dump_archive.h).
#pragma once

#include "scene/dump_archive.h"
#include "scene/scene_description.h"

namespace pharos {

constexpr NormalDomain last_enumerator(NormalDomain) {
    return NormalDomain::Corner;
}

constexpr ImageColorSpace last_enumerator(ImageColorSpace) {
    return ImageColorSpace::Data;
}

constexpr ImageAlpha last_enumerator(ImageAlpha) {
    return ImageAlpha::None;
}

constexpr ImageInterpolation last_enumerator(ImageInterpolation) {
    return ImageInterpolation::Smart;
}

constexpr ImageExtension last_enumerator(ImageExtension) {
    return ImageExtension::Mirror;
}

constexpr ImageProjection last_enumerator(ImageProjection) {
    return ImageProjection::MirrorBall;
}

constexpr LightType last_enumerator(LightType) {
    return LightType::Sun;
}

constexpr AreaShape last_enumerator(AreaShape) {
    return AreaShape::Ellipse;
}

constexpr CameraType last_enumerator(CameraType) {
    return CameraType::Orthographic;
}

constexpr PixelFilter last_enumerator(PixelFilter) {
    return PixelFilter::BlackmanHarris;
}

constexpr GuidingMode last_enumerator(GuidingMode) {
    return GuidingMode::NeuralRadiance;
}

// Unknown operations are the business of compile_material(), which reports them.
constexpr NodeOpCode last_enumerator(NodeOpCode) {
    return static_cast<NodeOpCode>(0xffff);
}

template <class Archive, class T>
using DumpValue = typename Archive::template Value<T>;

template <class Archive>
void fields(Archive& archive, DumpValue<Archive, UvMap>& value) {
    auto& [name, uv] = value;
    archive(name, uv);
}

template <class Archive>
void fields(Archive& archive, DumpValue<Archive, MeshAttribute>& value) {
    auto& [name, domain, components, values] = value;
    archive(name, domain, components, values);
}

template <class Archive>
void fields(Archive& archive, DumpValue<Archive, InstanceAttribute>& value) {
    auto& [name, values] = value;
    archive(name, values);
}

template <class Archive>
void fields(Archive& archive, DumpValue<Archive, Mesh>& value) {
    auto& [name,
           version,
           positions,
           triangles,
           normal_domain,
           normals,
           material_indices,
           uv_maps,
           attributes] = value;
    archive(name, positions, triangles, normal_domain, normals, material_indices, uv_maps);
    static_cast<void>(version);  // of a running program only
    if (archive.version() >= 3) {
        archive(attributes);
    }
}

template <class Archive>
void fields(Archive& archive, DumpValue<Archive, NodeOp>& value) {
    auto& [code, mode, output, first_operand, operand_count, step] = value;
    archive(code, mode, output, first_operand, operand_count);
    if (archive.version() >= 3) {
        archive(step);
    }
}

template <class Archive>
void fields(Archive& archive, DumpValue<Archive, ImageTile>& value) {
    auto& [number, image] = value;
    archive(number, image);
}

template <class Archive>
void fields(Archive& archive, DumpValue<Archive, ImageUse>& value) {
    auto& [image, interpolation, extension, projection, projection_blend, tiles] = value;
    archive(image, interpolation, extension, projection, projection_blend);
    if (archive.version() >= 4) {
        archive(tiles);
    }
}

template <class Archive>
void fields(Archive& archive, DumpValue<Archive, NodeProgram>& value) {
    auto& [ops, operands, constants, images, names, tables, register_count] = value;
    archive(ops, operands, constants, images, names, tables, register_count);
}

template <class Archive>
void fields(Archive& archive, DumpValue<Archive, MaterialDescription>& value) {
    auto& [name, program, emission_sampling, displacement] = value;
    archive(name, program, emission_sampling);
    if (archive.version() >= 4) {
        archive(displacement);
    }
}

template <class Archive>
void fields(Archive& archive, DumpValue<Archive, InstanceDescription>& value) {
    auto& [name, mesh, material_set, to_world, visibility] = value;
    archive(name, mesh, material_set, to_world, visibility);
}

template <class Archive>
void fields(Archive& archive, DumpValue<Archive, ImageDescription>& value) {
    ImageDescription copy;
    auto& [name, version, path, bytes, pixels, width, height, color_space, alpha] =
        Archive::self_contained(value, copy);
    archive(name, path, bytes, pixels, width, height, color_space, alpha);
    static_cast<void>(version);  // of a running program only
}

template <class Archive>
void fields(Archive& archive, DumpValue<Archive, LightDescription>& value) {
    auto& [name,
           type,
           to_world,
           strength,
           radius,
           spot_angle,
           spot_blend,
           shape,
           size_u,
           size_v,
           spread,
           angle,
           soft_falloff,
           normalize,
           cast_shadow,
           use_mis,
           visibility,
           max_bounces,
           program,
           is_portal] = value;
    archive(name, type, to_world, strength, radius, spot_angle, spot_blend, shape, size_u, size_v);
    archive(spread, angle, soft_falloff, normalize, cast_shadow, use_mis, visibility, max_bounces);
    if (archive.version() >= 4) {
        archive(program);
    }
    if (archive.version() >= 5) {
        archive(is_portal);
    }
}

template <class Archive>
void fields(Archive& archive, DumpValue<Archive, WorldDescription>& value) {
    auto& [program, map_resolution, use_mis, visibility] = value;
    archive(program, map_resolution, use_mis, visibility);
}

template <class Archive>
void fields(Archive& archive, DumpValue<Archive, CameraDescription>& value) {
    auto& [type,
           to_world,
           window_lower,
           window_upper,
           near_clip,
           far_clip,
           lens_radius,
           focus_distance,
           aperture_ratio,
           aperture_blades,
           aperture_rotation] = value;
    archive(type, to_world, window_lower, window_upper, near_clip, far_clip, lens_radius);
    archive(focus_distance, aperture_ratio, aperture_blades, aperture_rotation);
}

template <class Archive>
void fields(Archive& archive, DumpValue<Archive, FilmDescription>& value) {
    auto& [width,
           height,
           crop_x,
           crop_y,
           crop_width,
           crop_height,
           filter,
           filter_width,
           exposure,
           transparent] = value;
    archive(width, height, crop_x, crop_y, crop_width, crop_height);
    archive(filter, filter_width, exposure, transparent);
}

template <class Archive>
void fields(Archive& archive, DumpValue<Archive, RenderSettings>& value) {
    auto& [samples,
           seed,
           time_limit,
           use_nee,
           guiding,
           max_bounces,
           diffuse_bounces,
           glossy_bounces,
           transmission_bounces,
           transparent_bounces,
           caustics_reflective,
           caustics_refractive] = value;
    archive(samples, seed, time_limit, use_nee, guiding, max_bounces, diffuse_bounces);
    archive(glossy_bounces, transmission_bounces, transparent_bounces);
    archive(caustics_reflective, caustics_refractive);
}

template <class Archive>
void fields(Archive& archive, DumpValue<Archive, AovDescription>& value) {
    auto& [name, color] = value;
    archive(name, color);
}

template <class Archive>
void fields(Archive& archive, DumpValue<Archive, PassesDescription>& value) {
    auto& [wanted, mist_start, mist_depth, mist_falloff, object_indices, material_indices, aovs] =
        value;
    archive(wanted, mist_start, mist_depth, mist_falloff, object_indices, material_indices);
    if (archive.version() >= 4) {
        archive(aovs);
    }
}

template <class Archive>
void fields(Archive& archive, DumpValue<Archive, SceneDescription>& value) {
    auto& [blender_version,
           meshes,
           materials,
           material_sets,
           instances,
           images,
           lights,
           light_programs,
           world,
           has_camera,
           camera,
           film,
           settings,
           passes,
           instance_attributes] = value;
    archive(blender_version, meshes, materials, material_sets, instances, images, lights, world);
    archive(has_camera, camera, film, settings);
    if (archive.version() >= 2) {
        archive(passes);
    }
    if (archive.version() >= 3) {
        archive(instance_attributes);
    }
    if (archive.version() >= 4) {
        archive(light_programs);
    }
}

}  // namespace pharos
