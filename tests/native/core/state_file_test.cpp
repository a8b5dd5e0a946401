#include "core/state_file.h"

#include <fstream>
#include <iterator>

#include <gtest/gtest.h>

#include "core/atomic_file.h"
#include "core/checksum.h"
#include "support/scratch.h"

namespace pharos {
namespace {

using pharos::testing::ScratchFolder;

constexpr StateFileKind kKind{0x1122334455667788ull, 3, "test file"};

struct Inner {
    float x = 0.0f;
    bool on = false;
};

template <class Archive>
void state_fields(Archive& archive, Inner& inner) {
    archive(inner.x, inner.on);
}

struct Sample {
    std::uint32_t number = 0;
    std::vector<double> values;
    std::vector<Inner> inner;
    std::array<float, 2> pair{};
};

template <class Archive>
void state_fields(Archive& archive, Sample& s) {
    archive(s.number, s.values, s.inner, s.pair);
}

Sample sample() {
    return {7, {1.0, -2.5, 1e300}, {{0.5f, true}, {-1.0f, false}}, {3.0f, 4.0f}};
}

std::vector<std::byte> bytes_of(const Sample& s) {
    return state_file_bytes(kKind, [&](StateWriter& out) { out(s); });
}

Sample parse(std::span<const std::byte> bytes, const StateFileKind& kind = kKind) {
    Sample s;
    parse_state_file(bytes, kind, [&](StateReader& in) { in(s); });
    return s;
}

std::string contents(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

void write(const std::string& path, const std::string& text) {
    AtomicFile file(path);
    file.write(std::as_bytes(std::span(text)));
    file.commit();
}

TEST(StateFile, ComesBackAsItWas) {
    const ScratchFolder folder;
    const std::string path = folder.file("state");
    write_state_file(path, kKind, [](StateWriter& out) { out(sample()); });
    Sample back;
    read_state_file(path, kKind, [&](StateReader& in) { in(back); });
    for (const Sample& s : {back, parse(bytes_of(sample()))}) {
        EXPECT_EQ(s.number, 7u);
        EXPECT_EQ(s.values, sample().values);
        ASSERT_EQ(s.inner.size(), 2u);
        EXPECT_EQ(s.inner[0].x, 0.5f);
        EXPECT_TRUE(s.inner[0].on);
        EXPECT_EQ(s.pair, sample().pair);
    }
}

TEST(StateFile, DamageIsRefusedAtEveryByte) {
    const std::vector<std::byte> whole = bytes_of(sample());
    for (std::size_t i = 0; i < whole.size(); ++i) {
        std::vector<std::byte> damaged = whole;
        damaged[i] ^= std::byte{0x10};
        EXPECT_THROW(static_cast<void>(parse(damaged)), StateError) << "byte " << i;
        EXPECT_THROW(static_cast<void>(parse(std::span(whole).first(i))), StateError)
            << "cut at " << i;
    }
    EXPECT_THROW(static_cast<void>(parse(whole, {kKind.magic, 4, "newer"})), StateError);
    EXPECT_THROW(static_cast<void>(parse(whole, {1, 3, "foreign"})), StateError);
}

// With a checksum that fits: only the bounds stand between a count and memory.
TEST(StateFile, CountsAreHeldAgainstWhatIsThere) {
    for (const std::uint64_t count : {std::uint64_t{1} << 62, std::uint64_t{1000}}) {
        const auto bytes =
            state_file_bytes(kKind, [&](StateWriter& out) { out(std::uint32_t{1}, count, 1.0); });
        EXPECT_THROW(static_cast<void>(parse(bytes)), StateError);
    }
    const auto flag = state_file_bytes(kKind, [&](StateWriter& out) {
        out(std::uint32_t{1}, std::uint64_t{0}, std::uint64_t{1}, 1.0f, std::uint8_t{2}, 0.0, 0.0);
    });
    EXPECT_THROW(static_cast<void>(parse(flag)), StateError);
    const auto longer = state_file_bytes(kKind, [&](StateWriter& out) { out(sample(), 1.0); });
    EXPECT_THROW(static_cast<void>(parse(longer)), StateError);
}

TEST(StateFile, WhatIsNoFileIsRefused) {
    const ScratchFolder folder;
    const auto read = [](const std::string& path) {
        read_state_file(path, kKind, [](StateReader&) {});
    };
    EXPECT_THROW(read(folder.file("not there")), StateError);
    EXPECT_THROW(read(folder.file("")), StateError);
}

TEST(StreamChecksum, DoesNotDependOnThePieces) {
    std::vector<std::byte> data(1000);
    for (std::size_t i = 0; i < data.size(); ++i) {
        data[i] = static_cast<std::byte>(i * 37 + 11);
    }
    StreamChecksum whole;
    whole.add(data);
    for (const std::size_t piece : {1u, 3u, 7u, 8u, 100u}) {
        StreamChecksum parts;
        for (std::size_t i = 0; i < data.size(); i += piece) {
            parts.add(std::span(data).subspan(i, std::min(piece, data.size() - i)));
        }
        EXPECT_EQ(parts.value(), whole.value());
    }
}

TEST(AtomicFile, NothingHappensWithoutCommit) {
    const ScratchFolder folder;
    const std::string path = folder.file("file");
    write(path, "old");
    {
        AtomicFile file(path);
        const std::string text = "new";
        file.write(std::as_bytes(std::span(text)));
        EXPECT_EQ(contents(path), "old");
    }
    EXPECT_EQ(contents(path), "old");
    EXPECT_EQ(folder.files(), 1u);
}

TEST(AtomicFile, WhatAKilledWriterLeftIsUsedAgain) {
    const ScratchFolder folder;
    const std::string path = folder.file("file");
    std::ofstream(path + ".part") << "much more text than the next one has";
    write(path, "new");
    EXPECT_EQ(contents(path), "new");
    EXPECT_EQ(folder.files(), 1u);
}

TEST(AtomicFile, TwoWritersAreNotMixed) {
    const ScratchFolder folder;
    const AtomicFile first(folder.file("file"));
    EXPECT_THROW(AtomicFile(folder.file("file")), WriteError);
}

TEST(AtomicFile, SymbolicLinksAreNotFollowed) {
    const ScratchFolder folder;
    const std::string path = folder.file("file");
    write(folder.file("precious"), "precious");
    std::filesystem::create_symlink(folder.file("precious"), path + ".part");
    EXPECT_THROW(AtomicFile{path}, WriteError);
    // A link in the file's own place is replaced, what it points to stays.
    std::filesystem::remove(path + ".part");
    std::filesystem::create_symlink(folder.file("precious"), path);
    write(path, "new");
    EXPECT_EQ(contents(path), "new");
    EXPECT_EQ(contents(folder.file("precious")), "precious");
}

TEST(AtomicFile, AFolderThatIsNotThereIsAnError) {
    const ScratchFolder folder;
    EXPECT_THROW(AtomicFile(folder.file("no/folder/file")), WriteError);
}

}  // namespace
}  // namespace pharos
