#include "scene/dump.h"

#include <array>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string_view>
#include <system_error>

#include "core/atomic_file.h"
#include "core/checksum.h"
#include "image/image_io.h"
#include "scene/dump_fields.h"

namespace pharos {

namespace {

constexpr std::array<char, 8> kMagic = {'P', 'H', 'A', 'R', 'O', 'S', '\x1a', '\n'};
constexpr std::uint32_t kByteOrder = 0x01020304;

struct Header {
    std::array<char, 8> magic = kMagic;
    std::uint32_t version = dump::kVersion;
    std::uint32_t byte_order = kByteOrder;
    std::uint64_t payload_size = 0;
    std::uint64_t checksum = 0;  // of the payload
};

static_assert(sizeof(Header) == 32);

std::vector<std::uint8_t> read_bytes(std::ifstream& file, std::size_t size) {
    std::vector<std::uint8_t> bytes(size);
    file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
    bytes.resize(static_cast<std::size_t>(std::max<std::streamsize>(file.gcount(), 0)));
    return bytes;
}

// True for an image that is a file elsewhere.
bool is_external(const ImageDescription& image) {
    return !image.path.empty() && image.bytes.empty() && image.pixels.empty();
}

void check_header(const Header& header, std::uint64_t payload_size) {
    if (header.magic != kMagic || header.byte_order != kByteOrder) {
        throw std::runtime_error("not a Pharos scene dump");
    }
    if (header.version < dump::kOldestVersion || header.version > dump::kVersion) {
        throw std::runtime_error("version " + std::to_string(header.version) +
                                 " of the format is not supported");
    }
    if (header.payload_size != payload_size) {
        throw std::runtime_error(payload_size < header.payload_size ? "truncated"
                                                                    : "damaged: too long");
    }
}

SceneDescription parse(const Header& header, std::span<const std::uint8_t> payload) {
    check_header(header, payload.size());
    if (fnv1a(payload) != header.checksum) {
        throw std::runtime_error("damaged: the checksum does not fit");
    }
    SceneDescription description;
    dump::Reader reader(payload, header.version);
    reader(description);
    if (reader.remaining() != 0) {
        throw std::runtime_error("damaged: too long");
    }
    return description;
}

[[noreturn]] void fail(const std::string& path, const std::string& message) {
    throw std::runtime_error(path + ": " + message);
}

}  // namespace

const ImageDescription& dump::Writer::self_contained(const ImageDescription& image,
                                                     ImageDescription& copy) {
    if (!is_external(image)) {
        return image;
    }
    copy = image;
    copy.bytes = image_file_bytes(image.path);
    if (!copy.bytes.empty()) {
        copy.path.clear();
    }
    return copy;
}

std::vector<std::uint8_t> dump_to_bytes(const SceneDescription& description) {
    dump::Writer writer;
    writer.bytes().resize(sizeof(Header));
    writer(description);
    std::vector<std::uint8_t> bytes = std::move(writer.bytes());
    const std::span<const std::uint8_t> payload = std::span(bytes).subspan(sizeof(Header));
    Header header;
    header.payload_size = payload.size();
    header.checksum = fnv1a(payload);
    std::memcpy(bytes.data(), &header, sizeof(Header));
    return bytes;
}

SceneDescription dump_from_bytes(std::span<const std::uint8_t> bytes) {
    if (bytes.size() < sizeof(Header)) {
        throw std::runtime_error("not a Pharos scene dump");
    }
    Header header;
    std::memcpy(&header, bytes.data(), sizeof(Header));
    return parse(header, bytes.subspan(sizeof(Header)));
}

void write_dump(const SceneDescription& description, const std::string& path) {
    const std::vector<std::uint8_t> bytes = dump_to_bytes(description);
    AtomicFile file(path);
    file.write(std::as_bytes(std::span(bytes)));
    file.commit();
}

SceneDescription read_dump(const std::string& path) {
    std::error_code error;
    const std::uintmax_t size = std::filesystem::file_size(path, error);
    std::ifstream file(path, std::ios::binary);
    if (error || !file) {
        fail(path, "cannot be read");
    }
    // The header is checked before memory is taken for the rest.
    const std::vector<std::uint8_t> head = read_bytes(file, sizeof(Header));
    if (head.size() < sizeof(Header)) {
        fail(path, "not a Pharos scene dump");
    }
    Header header;
    std::memcpy(&header, head.data(), sizeof(Header));
    try {
        check_header(header, size - sizeof(Header));
        return parse(header, read_bytes(file, static_cast<std::size_t>(header.payload_size)));
    } catch (const std::runtime_error& problem) {
        fail(path, problem.what());
    }
}

}  // namespace pharos
