#include "core/atomic_file.h"

#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

namespace pharos {

namespace {

[[noreturn]] void fail_writing(const std::string& path, int error) {
    throw WriteError(path + ": cannot be written: " + std::generic_category().message(error));
}

// Opens the name for one writer: the lock goes with the file, so another may have moved it away
// between opening and locking.
int open_alone(const std::string& part) {
    for (;;) {
        const int descriptor =
            ::open(part.c_str(), O_WRONLY | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0666);
        if (descriptor < 0) {
            return -1;
        }

        struct stat opened {};

        struct stat named {};

        const bool locked = ::flock(descriptor, LOCK_EX | LOCK_NB) == 0;
        const int error = errno;
        if (locked && ::fstat(descriptor, &opened) == 0 && ::lstat(part.c_str(), &named) == 0 &&
            opened.st_ino == named.st_ino && opened.st_dev == named.st_dev) {
            if (::ftruncate(descriptor, 0) == 0) {
                return descriptor;
            }
        }
        ::close(descriptor);
        if (!locked) {
            errno = error;
            return -1;
        }
    }
}

// The new name survives a loss of power only when its folder is synced too. Where that cannot be
// done the file is still whole.
void sync_folder_of(const std::string& path) {
    const std::filesystem::path parent = std::filesystem::path(path).parent_path();
    const std::string folder = parent.empty() ? "." : parent.string();
    const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (descriptor >= 0) {
        ::fsync(descriptor);
        ::close(descriptor);
    }
}

}  // namespace

AtomicFile::AtomicFile(std::string path) : path_(std::move(path)), part_(path_ + ".part") {
    descriptor_ = open_alone(part_);
    if (descriptor_ < 0) {
        fail_writing(path_, errno);
    }
}

AtomicFile::~AtomicFile() {
    if (descriptor_ >= 0) {
        std::remove(part_.c_str());
        ::close(descriptor_);
    }
}

void AtomicFile::fail() {
    fail_writing(path_, errno);
}

void AtomicFile::write(std::span<const std::byte> bytes) {
    while (!bytes.empty()) {
        const ssize_t written = ::write(descriptor_, bytes.data(), bytes.size());
        if (written < 0 && errno != EINTR) {
            fail();
        }
        bytes = bytes.subspan(static_cast<std::size_t>(written < 0 ? 0 : written));
    }
}

void AtomicFile::commit() {
    if (::fsync(descriptor_) != 0 || ::rename(part_.c_str(), path_.c_str()) != 0) {
        fail();
    }
    ::close(std::exchange(descriptor_, -1));
    sync_folder_of(path_);
}

void move_into_place(const std::string& part, const std::string& path) {
    const int descriptor = ::open(part.c_str(), O_RDONLY | O_NOFOLLOW | O_CLOEXEC);
    const bool synced = descriptor >= 0 && ::fsync(descriptor) == 0;
    const int error = errno;
    if (descriptor >= 0) {
        ::close(descriptor);
    }
    if (!synced) {
        fail_writing(path, error);
    }
    if (::rename(part.c_str(), path.c_str()) != 0) {
        fail_writing(path, errno);
    }
    sync_folder_of(path);
}

}  // namespace pharos
