// Words of the command line to values; what does not fit throws UsageError naming the option.
#pragma once

#include <charconv>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "cli/commands.h"
#include "scene/scene_description.h"

namespace pharos::cli {

template <class T>
[[nodiscard]] T parse_number(const std::string& name, const std::string& text) {
    T value{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size()) {
        throw UsageError(name + ": '" + text + "' is not a number");
    }
    return value;
}

[[nodiscard]] std::vector<std::string> split(const std::string& text, char separator);
[[nodiscard]] std::vector<std::uint32_t> parse_list(const std::string& name,
                                                    const std::string& text);
[[nodiscard]] Vec3 parse_vector(const std::string& name, const std::string& text);  // X,Y,Z
[[nodiscard]] bool parse_switch(const std::string& name, const std::string& text);
[[nodiscard]] GuidingMode parse_guiding(const std::string& text);
[[nodiscard]] const char* guiding_name(GuidingMode mode);

// "Position,Guide Kappa" or one of the words all, guide, none: the bits of the passes.
[[nodiscard]] std::uint32_t parse_passes(const std::string& text);

// What every command that renders a dump takes.
struct CommonOptions {
    std::string input;
    std::string output;
    std::optional<std::uint32_t> samples;
    std::optional<std::uint32_t> seed;
    std::optional<bool> nee;
    std::optional<GuidingMode> guiding;
    unsigned threads = 0;

    // False for an option of another name.
    [[nodiscard]] bool take(const std::string& name, const std::string& value);
    void apply(RenderSettings& settings) const;
};

// What the commands that measure take as well: a size of their own.
struct MeasureOptions : CommonOptions {
    std::vector<std::uint32_t> size;  // width and height; empty: the file's

    [[nodiscard]] bool take(const std::string& name, const std::string& value);

    // The input with these options on it; UsageError naming the command where they do not fit.
    [[nodiscard]] SceneDescription load(const std::string& command) const;
};

// Throws std::runtime_error where there is nothing to read, and WriteError.
[[nodiscard]] std::vector<std::byte> read_bytes(const std::string& path);
void write_bytes(const std::string& path, std::span<const std::byte> bytes);

// The `flag` of a command that has none.
[[nodiscard]] inline bool no_flags(const std::string& /*name*/) {
    return false;
}

// Walks over the arguments: `flag` says whether a word stands alone, `option` takes a name and its
// value. Returns the one word that is neither, the input file.
[[nodiscard]] std::string walk_arguments(
    const std::vector<std::string>& arguments,
    const std::function<bool(const std::string&)>& flag,
    const std::function<void(const std::string&, const std::string&)>& option);

}  // namespace pharos::cli
