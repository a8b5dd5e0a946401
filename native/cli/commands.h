// The commands of pharos-cli: each takes its arguments and returns the process' exit code.
#pragma once

#include <stdexcept>
#include <string>
#include <vector>

namespace pharos::cli {

// Wrong arguments: the message names the argument.
class UsageError : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

// Something the scene needs is not there, and the user wants to be told.
class MissingAsset : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

// Numbers that scripts rely on.
inline constexpr int kExitError = 1;
inline constexpr int kExitUsage = 2;
inline constexpr int kExitMissingAsset = 3;
inline constexpr int kExitOutOfMemory = 4;
inline constexpr int kExitNotWritten = 5;

int render(const std::vector<std::string>& arguments);
int field(const std::vector<std::string>& arguments);
int settle(const std::vector<std::string>& arguments);
int adapt(const std::vector<std::string>& arguments);
int animate(const std::vector<std::string>& arguments);
int merge(const std::vector<std::string>& arguments);

}  // namespace pharos::cli
