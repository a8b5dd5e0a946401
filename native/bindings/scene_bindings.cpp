// Scene descriptions but for their meshes: one call per thing, arrays copied once; read back by
// tests and panels.
#include <algorithm>
#include <cstring>
#include <optional>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "bindings/casters.h"
#include "scene/dump.h"
#include "scene/scene_description.h"

namespace py = pybind11;

namespace pharos {
namespace {

struct InstanceArrays {
    Array<float> matrices;            // n x 16, column-major as Blender stores them
    Array<std::uint32_t> surface_of;  // n: which row of `surfaces`
    Array<std::uint32_t> surfaces;    // rows of mesh, material set, visibility
};

void add_instances(SceneDescription& scene,
                   const std::vector<std::string>& names,
                   const InstanceArrays& arrays) {
    const auto count = static_cast<std::size_t>(arrays.surface_of.size());
    require(static_cast<std::size_t>(arrays.matrices.size()) == 16 * count &&
                static_cast<std::size_t>(arrays.surfaces.size()) == 3 * names.size(),
            "add_instances",
            "arrays of different lengths");
    const float* matrices = arrays.matrices.data();
    const std::uint32_t* surface_of = arrays.surface_of.data();
    const std::uint32_t* surfaces = arrays.surfaces.data();
    const py::gil_scoped_release release;
    require(std::all_of(surface_of,
                        surface_of + count,
                        [&](std::uint32_t surface) { return surface < names.size(); }),
            "add_instances",
            "a surface is beyond the end");
    scene.instances.reserve(scene.instances.size() + count);
    for (std::size_t i = 0; i < count; ++i) {
        const std::size_t surface = surface_of[i];
        InstanceDescription& instance = scene.instances.emplace_back();
        instance.name = names[surface];
        instance.mesh = surfaces[3 * surface];
        instance.material_set = surfaces[3 * surface + 1];
        instance.visibility = surfaces[3 * surface + 2];
        std::memcpy(static_cast<void*>(&instance.to_world), matrices + 16 * i, 16 * sizeof(float));
    }
}

struct ImageSource {
    std::string path;
    py::bytes data;
    std::optional<Array<float>> pixels;  // height x width x 4, bottom row first
};

std::uint32_t add_image(SceneDescription& scene,
                        ImageDescription image,
                        const ImageSource& source) {
    image.path = source.path;
    const std::string_view bytes = source.data;
    image.bytes.assign(bytes.begin(), bytes.end());
    if (source.pixels) {
        require(source.pixels->ndim() == 3 && source.pixels->shape(2) == 4,
                image.name,
                "pixels are not height x width x 4");
        image.height = static_cast<std::uint32_t>(source.pixels->shape(0));
        image.width = static_cast<std::uint32_t>(source.pixels->shape(1));
        image.pixels = copy_rows<float>(*source.pixels, image.name, "pixels");
    }
    scene.images.push_back(std::move(image));
    return index_of_last(scene.images.size());
}

void bind_parts(py::module_& m) {
    py::class_<InstanceDescription>(m, "InstanceDescription", py::module_local())
        .def_readonly("name", &InstanceDescription::name)
        .def_readonly("mesh", &InstanceDescription::mesh)
        .def_readonly("material_set", &InstanceDescription::material_set)
        .def_readonly("to_world", &InstanceDescription::to_world)
        .def_readonly("visibility", &InstanceDescription::visibility);
    py::class_<MaterialDescription>(m, "MaterialDescription", py::module_local())
        .def_readonly("name", &MaterialDescription::name)
        .def_readonly("program", &MaterialDescription::program)
        .def_readonly("emission_sampling", &MaterialDescription::emission_sampling)
        .def_readonly("displacement", &MaterialDescription::displacement);
    py::class_<ImageDescription>(m, "ImageDescription", py::module_local())
        .def_readonly("name", &ImageDescription::name)
        .def_readonly("path", &ImageDescription::path)
        .def_property_readonly("byte_count",
                               [](const ImageDescription& i) { return i.bytes.size(); })
        .def_property_readonly("pixels",
                               [](const ImageDescription& i) { return to_array<float>(i.pixels); })
        .def_readonly("width", &ImageDescription::width)
        .def_readonly("height", &ImageDescription::height)
        .def_readonly("color_space", &ImageDescription::color_space)
        .def_readonly("alpha", &ImageDescription::alpha);
    py::class_<LightDescription>(m, "LightDescription", py::module_local())
        .def_readwrite("name", &LightDescription::name)
        .def_readwrite("type", &LightDescription::type)
        .def_readwrite("to_world", &LightDescription::to_world)
        .def_readwrite("strength", &LightDescription::strength)
        .def_readwrite("radius", &LightDescription::radius)
        .def_readwrite("spot_angle", &LightDescription::spot_angle)
        .def_readwrite("spot_blend", &LightDescription::spot_blend)
        .def_readwrite("shape", &LightDescription::shape)
        .def_readwrite("size_u", &LightDescription::size_u)
        .def_readwrite("size_v", &LightDescription::size_v)
        .def_readwrite("spread", &LightDescription::spread)
        .def_readwrite("angle", &LightDescription::angle)
        .def_readwrite("soft_falloff", &LightDescription::soft_falloff)
        .def_readwrite("normalize", &LightDescription::normalize)
        .def_readwrite("cast_shadow", &LightDescription::cast_shadow)
        .def_readwrite("use_mis", &LightDescription::use_mis)
        .def_readwrite("visibility", &LightDescription::visibility)
        .def_readwrite("max_bounces", &LightDescription::max_bounces)
        .def_readwrite("program", &LightDescription::program)
        .def_readwrite("is_portal", &LightDescription::is_portal);
    py::class_<WorldDescription>(m, "WorldDescription", py::module_local())
        .def_readwrite("program", &WorldDescription::program)
        .def_readwrite("map_resolution", &WorldDescription::map_resolution)
        .def_readwrite("use_mis", &WorldDescription::use_mis)
        .def_readwrite("visibility", &WorldDescription::visibility);
}

void bind_views(py::module_& m) {
    py::class_<CameraDescription>(m, "CameraDescription", py::module_local())
        .def_readwrite("type", &CameraDescription::type)
        .def_readwrite("to_world", &CameraDescription::to_world)
        .def_readwrite("window_lower", &CameraDescription::window_lower)
        .def_readwrite("window_upper", &CameraDescription::window_upper)
        .def_readwrite("near_clip", &CameraDescription::near_clip)
        .def_readwrite("far_clip", &CameraDescription::far_clip)
        .def_readwrite("lens_radius", &CameraDescription::lens_radius)
        .def_readwrite("focus_distance", &CameraDescription::focus_distance)
        .def_readwrite("aperture_ratio", &CameraDescription::aperture_ratio)
        .def_readwrite("aperture_blades", &CameraDescription::aperture_blades)
        .def_readwrite("aperture_rotation", &CameraDescription::aperture_rotation);
    py::class_<FilmDescription>(m, "FilmDescription", py::module_local())
        .def_readwrite("width", &FilmDescription::width)
        .def_readwrite("height", &FilmDescription::height)
        .def_readwrite("crop_x", &FilmDescription::crop_x)
        .def_readwrite("crop_y", &FilmDescription::crop_y)
        .def_readwrite("crop_width", &FilmDescription::crop_width)
        .def_readwrite("crop_height", &FilmDescription::crop_height)
        .def_readwrite("filter", &FilmDescription::filter)
        .def_readwrite("filter_width", &FilmDescription::filter_width)
        .def_readwrite("exposure", &FilmDescription::exposure)
        .def_readwrite("transparent", &FilmDescription::transparent);
    py::class_<RenderSettings>(m, "RenderSettings", py::module_local())
        .def_readwrite("samples", &RenderSettings::samples)
        .def_readwrite("seed", &RenderSettings::seed)
        .def_readwrite("time_limit", &RenderSettings::time_limit)
        .def_readwrite("use_nee", &RenderSettings::use_nee)
        .def_readwrite("guiding", &RenderSettings::guiding)
        .def_readwrite("max_bounces", &RenderSettings::max_bounces)
        .def_readwrite("diffuse_bounces", &RenderSettings::diffuse_bounces)
        .def_readwrite("glossy_bounces", &RenderSettings::glossy_bounces)
        .def_readwrite("transmission_bounces", &RenderSettings::transmission_bounces)
        .def_readwrite("transparent_bounces", &RenderSettings::transparent_bounces)
        .def_readwrite("caustics_reflective", &RenderSettings::caustics_reflective)
        .def_readwrite("caustics_refractive", &RenderSettings::caustics_refractive);
    py::class_<AovDescription>(m, "AovDescription", py::module_local())
        .def(py::init([](std::string name, bool color) {
                 return AovDescription{std::move(name), color};
             }),
             py::arg("name"),
             py::arg("color"))
        .def_readonly("name", &AovDescription::name)
        .def_readonly("color", &AovDescription::color);
    py::class_<PassesDescription>(m, "PassesDescription", py::module_local())
        .def_readwrite("wanted", &PassesDescription::wanted)
        .def_readwrite("mist_start", &PassesDescription::mist_start)
        .def_readwrite("mist_depth", &PassesDescription::mist_depth)
        .def_readwrite("mist_falloff", &PassesDescription::mist_falloff)
        .def_readwrite("object_indices", &PassesDescription::object_indices)
        .def_readwrite("material_indices", &PassesDescription::material_indices)
        .def_readwrite("aovs", &PassesDescription::aovs);
}

void bind_material_adders(py::class_<SceneDescription>& scene) {
    scene
        .def(
            "add_material",
            [](SceneDescription& s,
               std::string name,
               NodeProgram program,
               bool emission_sampling,
               std::optional<NodeProgram> displacement) {
                s.materials.push_back({std::move(name),
                                       std::move(program),
                                       emission_sampling,
                                       std::move(displacement).value_or(NodeProgram())});
                return index_of_last(s.materials.size());
            },
            FloatGuard(),
            py::arg("name"),
            py::arg("program"),
            py::arg("emission_sampling") = true,
            py::arg("displacement") = py::none())
        .def(
            "add_material_set",
            [](SceneDescription& s, std::vector<std::uint32_t> slots) {
                s.material_sets.push_back(std::move(slots));
                return index_of_last(s.material_sets.size());
            },
            FloatGuard(),
            py::arg("slots"))
        .def(
            "add_instances",
            [](SceneDescription& s,
               const std::vector<std::string>& names,
               Array<std::uint32_t> surfaces,
               Array<std::uint32_t> surface_of,
               Array<float> matrices) {
                add_instances(
                    s, names, {std::move(matrices), std::move(surface_of), std::move(surfaces)});
            },
            FloatGuard(),
            py::arg("names"),
            py::arg("surfaces"),
            py::arg("surface_of"),
            py::arg("matrices"),
            "Instances of surfaces: name and row (mesh, material set, visibility) of each surface, "
            "its number and 16 floats by column of each instance.");
}

void bind_image_adders(py::class_<SceneDescription>& scene) {
    scene
        .def(
            "add_image",
            [](SceneDescription& s,
               std::string name,
               std::string path,
               py::bytes data,
               std::optional<Array<float>> pixels,
               ImageColorSpace color_space,
               ImageAlpha alpha,
               std::uint64_t version) {
                ImageDescription image;
                image.name = std::move(name);
                image.version = version;
                image.color_space = color_space;
                image.alpha = alpha;
                return add_image(
                    s, std::move(image), {std::move(path), std::move(data), std::move(pixels)});
            },
            FloatGuard(),
            py::arg("name"),
            py::arg("path") = "",
            py::arg("data") = py::bytes(),
            py::arg("pixels") = py::none(),
            py::arg("color_space") = ImageColorSpace::Srgb,
            py::arg("alpha") = ImageAlpha::Straight,
            py::arg("version") = 0)
        .def(
            "add_kept_image",
            [](SceneDescription& s, const std::string& name, std::uint64_t version) {
                return add_kept(s.images, name, version);
            },
            FloatGuard(),
            py::arg("name"),
            py::arg("version"));
}

void bind_light_adders_and_setters(py::class_<SceneDescription>& scene) {
    scene
        .def(
            "add_light_program",
            [](SceneDescription& s, const NodeProgram& program) {
                s.light_programs.push_back(program);
                return index_of_last(s.light_programs.size());
            },
            FloatGuard(),
            py::arg("program"),
            "What a light refers to as its program.")
        .def(
            "add_light",
            [](SceneDescription& s, const py::kwargs& fields) {
                assign_fields(s.lights.emplace_back(), fields);
            },
            FloatGuard())
        .def(
            "set_world",
            [](SceneDescription& s, const py::kwargs& fields) { assign_fields(s.world, fields); },
            FloatGuard())
        .def(
            "set_camera",
            [](SceneDescription& s, const py::kwargs& fields) {
                assign_fields(s.camera, fields);
                s.has_camera = true;
            },
            FloatGuard())
        .def(
            "set_film",
            [](SceneDescription& s, const py::kwargs& fields) { assign_fields(s.film, fields); },
            FloatGuard())
        .def(
            "set_settings",
            [](SceneDescription& s, const py::kwargs& fields) {
                assign_fields(s.settings, fields);
            },
            FloatGuard())
        .def(
            "set_passes",
            [](SceneDescription& s, const py::kwargs& fields) { assign_fields(s.passes, fields); },
            FloatGuard());
}

}  // namespace

void bind_scene(py::module_& m) {
    bind_parts(m);
    bind_views(m);
    py::class_<SceneDescription> scene(m, "SceneDescription", py::module_local());
    scene.def(py::init([](std::uint32_t blender_version) {
                  SceneDescription description;
                  description.blender_version = blender_version;
                  return description;
              }),
              FloatGuard(),
              py::arg("blender_version") = 304);
    bind_meshes(m, scene);
    bind_material_adders(scene);
    bind_image_adders(scene);
    bind_light_adders_and_setters(scene);
    scene.def_readonly("blender_version", &SceneDescription::blender_version)
        .def_readonly("has_camera", &SceneDescription::has_camera)
        .def_readonly("camera", &SceneDescription::camera)
        .def_readonly("film", &SceneDescription::film)
        .def_readonly("settings", &SceneDescription::settings)
        .def_readonly("passes", &SceneDescription::passes)
        .def_readonly("world", &SceneDescription::world)
        .def_readonly("lights", &SceneDescription::lights)
        .def_readonly("images", &SceneDescription::images)
        .def_readonly("instances", &SceneDescription::instances)
        .def_readonly("materials", &SceneDescription::materials)
        .def_readonly("material_sets", &SceneDescription::material_sets)
        .def_property_readonly("mesh_count",
                               [](const SceneDescription& s) { return s.meshes.size(); })
        .def(
            "copy", [](const SceneDescription& s) { return SceneDescription(s); }, FreeGuard());

    m.attr("DISPLACE_IN_WORLD") = static_cast<int>(kDisplaceInWorld);
    m.def("write_dump", &write_dump, FreeGuard(), py::arg("description"), py::arg("path"));
    m.def("read_dump", &read_dump, FreeGuard(), py::arg("path"));
}

}  // namespace pharos
