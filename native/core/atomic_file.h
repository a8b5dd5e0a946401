// A file that is there whole or not at all: written beside its place, synced to the disk, renamed.
//
// Whoever is killed at any moment leaves the old file or the new one. The name beside it, with
// ".part", is taken by one writer at a time, belongs to no symbolic link, and is left behind only
// by a writer that was killed; the next one uses it again.
#pragma once

#include <cstddef>
#include <span>
#include <stdexcept>
#include <string>

namespace pharos {

// The disk is full, the folder is not there, ...: the message names the file.
class WriteError : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

class AtomicFile {
  public:
    // Throws WriteError, as all of its functions.
    explicit AtomicFile(std::string path);
    ~AtomicFile();  // without commit(): nothing has happened
    AtomicFile(const AtomicFile&) = delete;
    AtomicFile& operator=(const AtomicFile&) = delete;

    void write(std::span<const std::byte> bytes);
    void commit();

  private:
    [[noreturn]] void fail();

    std::string path_;
    std::string part_;
    int descriptor_ = -1;
};

// Makes what others have written to a file safe from a loss of power, then moves it to its place.
void move_into_place(const std::string& part, const std::string& path);

}  // namespace pharos
