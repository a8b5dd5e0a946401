// What of the user's input could not be used as given, collected instead of thrown: a missing
// image, a broken index, a non-finite vertex. The host shows the list; rendering goes on around it.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace pharos {

enum class Severity { Info, Warning, Error };

struct ReportEntry {
    Severity severity = Severity::Warning;
    std::string object;    // the name of the user's object, image, material ...
    std::string message;   // one sentence
    bool missing = false;  // a file that the scene needs is not there or cannot be used
};

class SceneReport {
  public:
    void add(Severity severity, std::string object, std::string message) {
        entries_.push_back({severity, std::move(object), std::move(message)});
    }

    void add(ReportEntry entry) { entries_.push_back(std::move(entry)); }

    void add(const SceneReport& other) {
        entries_.insert(entries_.end(), other.entries_.begin(), other.entries_.end());
    }

    [[nodiscard]] const std::vector<ReportEntry>& entries() const { return entries_; }

  private:
    std::vector<ReportEntry> entries_;
};

}  // namespace pharos
