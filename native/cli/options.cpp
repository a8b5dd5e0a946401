#include "cli/options.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <fstream>
#include <iterator>

#include "core/atomic_file.h"
#include "film/passes.h"
#include "scene/dump.h"

namespace pharos::cli {

namespace {

// In the order of GuidingMode.
constexpr std::array<const char*, 7> kGuidingNames{"off",
                                                   "neural",
                                                   "slides",
                                                   "slides-position",
                                                   "slides-mixture",
                                                   "neural-reflection",
                                                   "neural-radiance"};

}  // namespace

std::vector<std::string> split(const std::string& text, char separator) {
    std::vector<std::string> parts;
    for (std::size_t begin = 0; begin <= text.size();) {
        const std::size_t end = std::min(text.find(separator, begin), text.size());
        parts.push_back(text.substr(begin, end - begin));
        begin = end + 1;
    }
    return parts;
}

std::vector<std::uint32_t> parse_list(const std::string& name, const std::string& text) {
    std::vector<std::uint32_t> values;
    for (const std::string& part : split(text, ',')) {
        values.push_back(parse_number<std::uint32_t>(name, part));
    }
    return values;
}

Vec3 parse_vector(const std::string& name, const std::string& text) {
    const std::vector<std::string> parts = split(text, ',');
    if (parts.size() != 3) {
        throw UsageError(name + ": '" + text + "' is not X,Y,Z");
    }
    Vec3 value;
    for (int axis = 0; axis < 3; ++axis) {
        value[axis] = parse_number<float>(name, parts[static_cast<std::size_t>(axis)]);
    }
    return value;
}

bool parse_switch(const std::string& name, const std::string& text) {
    if (text != "on" && text != "off") {
        throw UsageError(name + ": '" + text + "' is neither on nor off");
    }
    return text == "on";
}

GuidingMode parse_guiding(const std::string& text) {
    std::string lower = text;
    for (char& c : lower) {
        c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
    for (std::size_t i = 0; i < kGuidingNames.size(); ++i) {
        if (lower == kGuidingNames[i]) {
            return static_cast<GuidingMode>(i);
        }
    }
    std::string known;
    for (const char* name : kGuidingNames) {
        known += (known.empty() ? "" : ", ") + std::string(name);
    }
    throw UsageError("--guiding: '" + text + "' is none of " + known);
}

const char* guiding_name(GuidingMode mode) {
    return kGuidingNames[static_cast<std::size_t>(mode)];
}

bool MeasureOptions::take(const std::string& name, const std::string& value) {
    if (name == "--size") {
        size = parse_list(name, value);
        return true;
    }
    return CommonOptions::take(name, value);
}

SceneDescription MeasureOptions::load(const std::string& command) const {
    if (input.empty() || (!size.empty() && size.size() != 2)) {
        throw UsageError(command + " needs an input file; --size is W,H");
    }
    SceneDescription description = read_dump(input);
    apply(description.settings);
    if (!size.empty()) {
        FilmDescription& film = description.film;
        film.width = film.crop_width = size[0];
        film.height = film.crop_height = size[1];
        film.crop_x = film.crop_y = 0;
    }
    return description;
}

std::vector<std::byte> read_bytes(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    const std::vector<char> bytes{std::istreambuf_iterator<char>(file), {}};
    if (!file || bytes.empty()) {
        throw std::runtime_error(path + ": cannot be read");
    }
    const auto* first = reinterpret_cast<const std::byte*>(bytes.data());
    return {first, first + bytes.size()};
}

void write_bytes(const std::string& path, std::span<const std::byte> bytes) {
    AtomicFile file(path);
    file.write(bytes);
    file.commit();
}

std::uint32_t parse_passes(const std::string& text) {
    if (text == "none") {
        return 0;
    }
    if (text == "guide") {
        return kGuidePasses;
    }
    std::uint32_t bits = 0;
    for (const std::string& name : split(text, ',')) {
        std::uint32_t found = 0;
        for (std::size_t i = 0; i < kFilmPasses; ++i) {
            const auto pass = static_cast<FilmPass>(i);
            found |= text == "all" || name == film_pass_info(pass).name ? pass_bit(pass) : 0u;
        }
        if (found == 0) {
            throw UsageError("--passes: there is no pass '" + name + "'");
        }
        bits |= found;
    }
    return bits;
}

bool CommonOptions::take(const std::string& name, const std::string& value) {
    if (name == "-o" || name == "--output") {
        output = value;
    } else if (name == "--samples") {
        samples = parse_number<std::uint32_t>(name, value);
    } else if (name == "--seed") {
        seed = parse_number<std::uint32_t>(name, value);
    } else if (name == "--threads") {
        threads = parse_number<unsigned>(name, value);
    } else if (name == "--guiding") {
        guiding = parse_guiding(value);
    } else if (name == "--nee") {
        nee = parse_switch(name, value);
    } else {
        return false;
    }
    return true;
}

void CommonOptions::apply(RenderSettings& settings) const {
    settings.samples = samples.value_or(settings.samples);
    settings.seed = seed.value_or(settings.seed);
    settings.use_nee = nee.value_or(settings.use_nee);
    settings.guiding = guiding.value_or(settings.guiding);
}

std::string walk_arguments(
    const std::vector<std::string>& arguments,
    const std::function<bool(const std::string&)>& flag,
    const std::function<void(const std::string&, const std::string&)>& option) {
    std::string input;
    for (std::size_t i = 0; i < arguments.size(); ++i) {
        const std::string& argument = arguments[i];
        if (flag(argument)) {
            continue;
        }
        if (argument.starts_with("-")) {
            if (i + 1 == arguments.size()) {
                throw UsageError(argument + " needs a value");
            }
            option(argument, arguments[++i]);
        } else if (input.empty()) {
            input = argument;
        } else {
            throw UsageError("one input file only, not also '" + argument + "'");
        }
    }
    return input;
}

}  // namespace pharos::cli
