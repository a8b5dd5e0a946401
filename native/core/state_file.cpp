#include "core/state_file.h"

#include <fstream>
#include <limits>

#include "core/atomic_file.h"
#include "core/checksum.h"

namespace pharos {

namespace {

struct Header {
    std::uint64_t magic = 0;
    std::uint32_t version = 0;
    std::uint32_t byte_order = 0x01020304;
};

static_assert(sizeof(Header) == 16);

constexpr std::uint64_t kChecksumBytes = sizeof(std::uint64_t);
constexpr std::size_t kPiece = std::size_t{1} << 20;

void write_through(const StateFileKind& kind,
                   const std::function<void(StateWriter&)>& write,
                   const StateWriter::Sink& sink) {
    StreamChecksum checksum;
    StateWriter writer([&](std::span<const std::byte> piece) {
        checksum.add(piece);
        sink(piece);
    });
    writer(kind.magic, kind.version, Header{}.byte_order);
    write(writer);
    const std::uint64_t sum = checksum.value();
    sink(std::as_bytes(std::span(&sum, 1)));
}

// `rewind` starts the source from the first byte again.
void read_through(std::uint64_t size,
                  const StateFileKind& kind,
                  const std::function<StateReader::Source()>& rewind,
                  const std::function<void(StateReader&)>& read) {
    const auto fail = [&](const std::string& what) { throw StateError(what); };
    if (size < sizeof(Header) + kChecksumBytes) {
        fail(std::string("not a ") + kind.name);
    }
    Header header;
    {
        StateReader reader(rewind(), size);
        reader(header.magic, header.version, header.byte_order);
    }
    if (header.magic != kind.magic || header.byte_order != Header{}.byte_order) {
        fail(std::string("not a ") + kind.name);
    }
    if (header.version != kind.version) {
        fail("version " + std::to_string(header.version) + " of the format is not supported");
    }
    const StateReader::Source source = rewind();
    StreamChecksum checksum;
    std::vector<std::byte> piece;
    for (std::uint64_t left = size - kChecksumBytes; left > 0; left -= piece.size()) {
        piece.resize(static_cast<std::size_t>(std::min<std::uint64_t>(left, kPiece)));
        source(piece);
        checksum.add(piece);
    }
    std::uint64_t sum = 0;
    source(std::as_writable_bytes(std::span(&sum, 1)));
    if (sum != checksum.value()) {
        fail("truncated or damaged: the checksum does not fit");
    }
    StateReader reader(rewind(), size - kChecksumBytes);
    reader(header.magic, header.version, header.byte_order);
    read(reader);
    if (reader.remaining() != 0) {
        fail("damaged: too long");
    }
}

}  // namespace

void write_state_file(const std::string& path,
                      const StateFileKind& kind,
                      const std::function<void(StateWriter&)>& write) {
    AtomicFile file(path);
    std::vector<std::byte> pending;  // small values are joined to large writes
    write_through(kind, write, [&](std::span<const std::byte> bytes) {
        if (bytes.size() + pending.size() >= kPiece) {
            file.write(pending);
            pending.clear();
        }
        if (bytes.size() >= kPiece) {
            file.write(bytes);
        } else {
            pending.insert(pending.end(), bytes.begin(), bytes.end());
        }
    });
    file.write(pending);
    file.commit();
}

void read_state_file(const std::string& path,
                     const StateFileKind& kind,
                     const std::function<void(StateReader&)>& read) {
    std::ifstream file(path, std::ios::binary | std::ios::ate);
    const std::streamoff size = file ? static_cast<std::streamoff>(file.tellg()) : -1;
    if (size < 0 || size == std::numeric_limits<std::streamoff>::max()) {
        throw StateError(path + ": cannot be read");
    }
    const auto rewind = [&]() -> StateReader::Source {
        file.clear();
        file.seekg(0);
        return [&file](std::span<std::byte> out) {
            if (!file.read(reinterpret_cast<char*>(out.data()),
                           static_cast<std::streamsize>(out.size()))) {
                throw StateError("truncated");
            }
        };
    };
    try {
        read_through(static_cast<std::uint64_t>(size), kind, rewind, read);
    } catch (const StateError& error) {
        throw StateError(path + ": " + error.what());
    }
}

std::vector<std::byte> state_file_bytes(const StateFileKind& kind,
                                        const std::function<void(StateWriter&)>& write) {
    std::vector<std::byte> bytes;
    write_through(kind, write, [&](std::span<const std::byte> piece) {
        bytes.insert(bytes.end(), piece.begin(), piece.end());
    });
    return bytes;
}

void parse_state_file(std::span<const std::byte> bytes,
                      const StateFileKind& kind,
                      const std::function<void(StateReader&)>& read) {
    const auto rewind = [&]() -> StateReader::Source {
        return [rest = bytes](std::span<std::byte> out) mutable {
            std::memcpy(out.data(), rest.data(), out.size());
            rest = rest.subspan(out.size());
        };
    };
    read_through(bytes.size(), kind, rewind, read);
}

}  // namespace pharos
