#include "image/image_io.h"

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <new>
#include <optional>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include "core/atomic_file.h"
#include "core/color.h"
#include "image/image_format.h"
#include "image/texel_read.h"

namespace pharos {

namespace {

// A header may claim this many bytes of pixels per byte of file (deflate reaches 1032) beyond the
// first kTrustedBytes.
constexpr std::uint64_t kMaxCompression = 4096;
constexpr std::uint64_t kTrustedBytes = std::uint64_t{64} << 20;

struct Depth {
    TexelType ours;
    OIIO::TypeDesc::BASETYPE theirs;
};

// The depth pixels are kept in: the file's own, or the next that holds it.
[[nodiscard]] Depth depth_of(const OIIO::TypeDesc& format) {
    switch (format.basetype) {
        case OIIO::TypeDesc::UINT8:
        case OIIO::TypeDesc::INT8:
            return {TexelType::U8, OIIO::TypeDesc::UINT8};
        case OIIO::TypeDesc::UINT16:
        case OIIO::TypeDesc::INT16:
            return {TexelType::U16, OIIO::TypeDesc::UINT16};
        case OIIO::TypeDesc::HALF:
            return {TexelType::Half, OIIO::TypeDesc::HALF};
        default:
            return {TexelType::Float, OIIO::TypeDesc::FLOAT};
    }
}

// Colour channels with their alpha, 1 ... 4, from the front of what the file has.
[[nodiscard]] std::uint32_t channels_to_read(const OIIO::ImageSpec& spec) {
    switch (spec.nchannels) {
        case 1:
            return 1;
        case 2:
            return spec.alpha_channel == 1 ? 2 : 1;
        case 3:
            return 3;
        default:
            return spec.alpha_channel == 3 ? 4 : 3;
    }
}

[[nodiscard]] std::string size_error(const OIIO::ImageSpec& spec, std::uint64_t file_bytes) {
    if (spec.width <= 0 || spec.height <= 0 || spec.nchannels <= 0 || spec.depth > 1) {
        return "The image has no pixels";
    }
    if (spec.width > static_cast<int>(kMaxImageSide) ||
        spec.height > static_cast<int>(kMaxImageSide)) {
        return "The image has " + std::to_string(spec.width) + " x " + std::to_string(spec.height) +
               " pixels, more than " + std::to_string(kMaxImageSide) + " a side";
    }
    const std::uint64_t bytes = std::uint64_t{static_cast<unsigned>(spec.width)} *
                                static_cast<unsigned>(spec.height) * channels_to_read(spec) *
                                texel_bytes(depth_of(spec.format).ours);
    if (bytes > kMaxImageBytes) {
        return "The image needs " + std::to_string(bytes >> 20) + " MB of memory";
    }
    if (bytes > kTrustedBytes && bytes / kMaxCompression > file_bytes) {
        return "The image claims more pixels than its file can hold";
    }
    return {};
}

[[nodiscard]] std::string reader_error(OIIO::ImageInput& input) {
    const std::string text = input.geterror();
    return "The image cannot be read" + (text.empty() ? std::string() : ": " + text);
}

// Rows read at a time: few enough to be soon through, whole blocks of what compresses by blocks.
[[nodiscard]] int rows_at_once(const OIIO::ImageSpec& spec, std::size_t row_bytes) {
    constexpr std::size_t kBytesAtOnce = std::size_t{2} << 20;
    constexpr std::size_t kBlock = 64;
    const std::size_t rows = std::max<std::size_t>(1, kBytesAtOnce / row_bytes);
    const std::size_t tile = spec.tile_height > 0 ? static_cast<std::size_t>(spec.tile_height) : 1;
    const std::size_t step = (kBlock + tile - 1) / tile * tile;
    return static_cast<int>((rows + step - 1) / step * step);
}

// Reads all pixels of an opened file, turned so that the bottom row comes first.
[[nodiscard]] std::string read_pixels(OIIO::ImageInput& input,
                                      const OIIO::ImageSpec& spec,
                                      const CancelFlag* cancel,
                                      TexturePixels& pixels) {
    const Depth depth = depth_of(spec.format);
    pixels.type = depth.ours;
    pixels.width = static_cast<std::uint32_t>(spec.width);
    pixels.height = static_cast<std::uint32_t>(spec.height);
    pixels.channels = channels_to_read(spec);
    const std::size_t texel = pixels.channels * texel_bytes(pixels.type);
    const std::size_t row = texel * pixels.width;
    pixels.data.reserve(row * pixels.height + detail::kTexelPadding);  // Texture will not copy them
    pixels.data.resize(row * pixels.height);
    std::uint8_t* top = pixels.data.data() + row * (pixels.height - 1);
    const auto x_stride = static_cast<OIIO::stride_t>(texel);
    const auto y_stride = -static_cast<OIIO::stride_t>(row);
    const auto channels = static_cast<int>(pixels.channels);
    const int step = rows_at_once(spec, row);
    for (int y = 0; y < spec.height; y += step) {
        if (cancel != nullptr) {
            throw_if_cancelled(*cancel);
        }
        const int begin = spec.y + y;
        const int end = spec.y + std::min(y + step, spec.height);
        std::uint8_t* to = top - row * static_cast<std::size_t>(y);
        const bool read =
            spec.tile_width > 0
                ? input.read_tiles(0,
                                   0,
                                   spec.x,
                                   spec.x + spec.width,
                                   begin,
                                   end,
                                   spec.z,
                                   spec.z + 1,
                                   0,
                                   channels,
                                   depth.theirs,
                                   to,
                                   x_stride,
                                   y_stride)
                : input.read_scanlines(
                      0, 0, begin, end, spec.z, 0, channels, depth.theirs, to, x_stride, y_stride);
        if (!read) {
            return reader_error(input);
        }
    }
    return {};
}

[[nodiscard]] DecodedImage decode(const char* format,
                                  const std::string& name,
                                  OIIO::Filesystem::IOProxy* proxy,
                                  std::uint64_t file_bytes,
                                  const CancelFlag* cancel) {
    DecodedImage image;
    const std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::create(format);
    if (!input) {
        static_cast<void>(OIIO::geterror());  // the library keeps it otherwise
        image.error = std::string("There is no reader for ") + format + " images";
        return image;
    }
    OIIO::ImageSpec config;
    config.attribute("oiio:UnassociatedAlpha", 1);  // hand alpha over as it is stored
    if (proxy != nullptr) {
        if (input->supports("ioproxy") == 0) {
            image.error = std::string("Packed ") + format + " images cannot be read";
            return image;
        }
        void* pointer = proxy;
        config.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &pointer);
    }
    OIIO::ImageSpec spec;
    if (!input->open(name, spec, config)) {
        image.error = reader_error(*input);
        return image;
    }
    image.error = size_error(spec, file_bytes);
    if (image.error.empty()) {
        image.error = read_pixels(*input, spec, cancel, image.pixels);
    }
    image.straight_alpha = spec.get_int_attribute("oiio:UnassociatedAlpha") != 0;
    input->close();
    return image;
}

// The libraries below throw what they like; the user gets a sentence.
template <class Function>
[[nodiscard]] auto guarded(const Function& function) {
    decltype(function()) image;
    try {
        image = function();
    } catch (const Cancelled&) {
        throw;
    } catch (const std::bad_alloc&) {
        image.error = "There is not enough memory for the image";
    } catch (const std::exception& error) {
        image.error = std::string("The image cannot be read: ") + error.what();
    }
    if (!image.error.empty()) {
        image.pixels = {};
    }
    return image;
}

[[nodiscard]] DecodedImage failed(std::string error) {
    DecodedImage image;
    image.error = std::move(error);
    return image;
}

constexpr const char* kUnknownFormat = "The file is not an image of a known format";

struct OpenedFile {
    std::ifstream stream;  // behind the header
    std::uint64_t bytes = 0;
    std::vector<std::uint8_t> header;
};

// Nothing for what is no regular file: to open a pipe is to wait for whoever writes to it.
[[nodiscard]] std::optional<OpenedFile> open_regular(const std::string& path) {
    std::error_code code;
    OpenedFile file;
    file.bytes = std::filesystem::file_size(path, code);
    if (code) {
        return std::nullopt;
    }
    file.stream.open(path, std::ios::binary);
    if (!file.stream) {
        return std::nullopt;
    }
    file.header.resize(std::min<std::uint64_t>(file.bytes, detail::kImageHeaderBytes));
    file.stream.read(reinterpret_cast<char*>(file.header.data()),
                     static_cast<std::streamsize>(file.header.size()));
    file.header.resize(static_cast<std::size_t>(file.stream.gcount()));
    return file;
}

}  // namespace

DecodedImage read_image_file(const std::string& path, const CancelFlag* cancel) {
    return guarded([&]() -> DecodedImage {
        const std::optional<OpenedFile> file = open_regular(path);
        if (!file) {
            return failed("The file " + path + " cannot be opened");
        }
        const char* format = detail::identify_image(file->header);
        return format == nullptr ? failed(kUnknownFormat)
                                 : decode(format, path, nullptr, file->bytes, cancel);
    });
}

std::vector<std::uint8_t> image_file_bytes(const std::string& path) {
    std::optional<OpenedFile> file = open_regular(path);
    if (!file || detail::identify_image(file->header) == nullptr) {
        return {};
    }
    std::vector<std::uint8_t> bytes = std::move(file->header);
    const std::size_t read = bytes.size();
    bytes.resize(file->bytes);
    file->stream.read(reinterpret_cast<char*>(bytes.data() + read),
                      static_cast<std::streamsize>(bytes.size() - read));
    bytes.resize(read + static_cast<std::size_t>(file->stream.gcount()));
    return bytes;
}

ExrFile read_exr(const std::string& path, bool with_pixels) {
    return guarded([&] {
        ExrFile exr;
        std::error_code code;
        const std::uint64_t bytes = std::filesystem::file_size(path, code);
        const std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::create("openexr");
        OIIO::ImageSpec spec;
        if (code || !input || !input->open(path, spec)) {
            exr.error = "The file " + path + " cannot be read as an EXR";
            return exr;
        }
        exr.error = size_error(spec, bytes);
        const auto channels = static_cast<std::uint64_t>(spec.nchannels);
        const std::uint64_t floats = spec.image_pixels() * channels;
        if (exr.error.empty() &&
            (channels > kMaxExrChannels || floats * sizeof(float) / kMaxCompression >
                                               std::max(bytes, kTrustedBytes / kMaxCompression))) {
            exr.error = "The image claims more than its file can hold";
        }
        if (!exr.error.empty()) {
            return exr;
        }
        exr.width = static_cast<std::uint32_t>(spec.width);
        exr.height = static_cast<std::uint32_t>(spec.height);
        exr.channels = spec.channelnames;
        for (const OIIO::ParamValue& attribute : spec.extra_attribs) {
            if (attribute.type() == OIIO::TypeString) {
                exr.metadata.emplace_back(attribute.name().string(), attribute.get_string());
            }
        }
        if (!with_pixels) {
            return exr;
        }
        exr.pixels.resize(floats);
        const std::size_t row = channels * exr.width;
        float* top = exr.pixels.data() + row * (exr.height - 1);
        const auto stride = static_cast<OIIO::stride_t>(row * sizeof(float));
        if (!input->read_image(
                0, 0, 0, spec.nchannels, OIIO::TypeFloat, top, OIIO::AutoStride, -stride)) {
            exr.error = reader_error(*input);
        }
        return exr;
    });
}

DecodedImage read_image_bytes(std::span<const std::uint8_t> bytes, const CancelFlag* cancel) {
    return guarded([&]() -> DecodedImage {
        const auto header = bytes.first(std::min(bytes.size(), detail::kImageHeaderBytes));
        const char* format = detail::identify_image(header);
        if (format == nullptr) {
            return failed(kUnknownFormat);
        }
        OIIO::Filesystem::IOMemReader reader(bytes.data(), bytes.size());
        return decode(format, std::string("packed.") + format, &reader, bytes.size(), cancel);
    });
}

namespace {

// Writes `data` (top row first) beside `path` and moves it there.
[[nodiscard]] std::string write_beside(const std::string& path,
                                       const char* format,
                                       const OIIO::ImageSpec& spec,
                                       const OIIO::TypeDesc& type,
                                       const void* data) {
    const std::string part = path + ".part";
    std::remove(part.c_str());  // a link there would lead out of the folder
    const auto fail = [&](const std::string& reason) {
        std::remove(part.c_str());
        return "The file " + path + " cannot be written" + (reason.empty() ? "" : ": " + reason);
    };
    try {
        const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create(format);
        if (!output) {
            return fail(OIIO::geterror());
        }
        if (!output->open(part, spec) || !output->write_image(type, data) || !output->close()) {
            return fail(output->geterror());
        }
        move_into_place(part, path);
        return {};
    } catch (const std::exception& error) {
        return fail(error.what());
    }
}

}  // namespace

std::string write_exr(const std::string& path,
                      std::uint32_t width,
                      std::uint32_t height,
                      std::span<const ExrPass> passes,
                      const ExrOptions& options) {
    const std::size_t count = std::size_t{width} * height;
    std::vector<std::string> names;
    for (const ExrPass& pass : passes) {
        if (pass.channels.empty() || pass.pixels.size() != count * pass.channels.size()) {
            return "Pass " + pass.name + " does not have the image's size";
        }
        for (const char channel : pass.channels) {
            names.push_back((pass.name.empty() ? "" : pass.name + ".") + channel);
        }
    }
    if (count == 0 || names.empty()) {
        return "The image has no pixels";
    }
    // One interleaved buffer, top row first.
    const std::size_t channels = names.size();
    std::vector<float> pixels(count * channels);
    std::size_t first = 0;
    for (const ExrPass& pass : passes) {
        const std::size_t size = pass.channels.size();
        for (std::size_t i = 0; i < count; ++i) {
            const std::size_t source = (height - 1 - i / width) * width + i % width;
            std::copy_n(&pass.pixels[source * size], size, &pixels[i * channels + first]);
        }
        first += size;
    }
    OIIO::ImageSpec spec(static_cast<int>(width),
                         static_cast<int>(height),
                         static_cast<int>(channels),
                         options.half ? OIIO::TypeDesc::HALF : OIIO::TypeDesc::FLOAT);
    spec.channelnames = names;
    spec.attribute("compression", "zip");
    for (const auto& [key, value] : options.metadata) {
        spec.attribute(key, value);
    }
    return write_beside(path, "openexr", spec, OIIO::TypeDesc::FLOAT, pixels.data());
}

std::string write_png(const std::string& path,
                      std::uint32_t width,
                      std::uint32_t height,
                      std::span<const float> linear) {
    const std::size_t count = std::size_t{width} * height;
    const std::size_t channels = count == 0 ? 0 : linear.size() / count;
    if (linear.size() != count * channels || (channels != 1 && channels != 3 && channels != 4)) {
        return "The pixels do not have the image's size";
    }
    std::vector<std::uint8_t> bytes(count * channels);
    const std::size_t colors = channels == 4 ? 3 : channels;
    for (std::size_t i = 0; i < count; ++i) {
        const float* source = &linear[((height - 1 - i / width) * width + i % width) * channels];
        const float alpha = channels == 4 ? saturate(source[3]) : 1.0f;
        for (std::size_t k = 0; k < channels; ++k) {
            const float straight = alpha > 0.0f ? source[k] / alpha : source[k];
            const float encoded = k < colors ? linear_to_srgb(std::max(straight, 0.0f)) : alpha;
            const float limited =
                encoded < 1.0f ? encoded : 1.0f;  // NaN becomes white, and is seen
            bytes[i * channels + k] = static_cast<std::uint8_t>(limited * 255.0f + 0.5f);
        }
    }
    OIIO::ImageSpec spec(static_cast<int>(width),
                         static_cast<int>(height),
                         static_cast<int>(channels),
                         OIIO::TypeDesc::UINT8);
    spec.attribute("oiio:UnassociatedAlpha", 1);
    spec.attribute("oiio:ColorSpace", "sRGB");
    return write_beside(path, "png", spec, OIIO::TypeDesc::UINT8, bytes.data());
}

}  // namespace pharos
