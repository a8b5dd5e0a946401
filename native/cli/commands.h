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

int render(const std::vector<std::string>& arguments);
int field(const std::vector<std::string>& arguments);
int adapt(const std::vector<std::string>& arguments);

}  // namespace pharos::cli
