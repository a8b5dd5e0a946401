#include "scene/scene_hash.h"

#include "core/checksum.h"
#include "scene/dump_fields.h"

namespace pharos {

namespace {

// Neutral settings for a while, without a copy of the scene.
class NeutralSettings {
  public:
    explicit NeutralSettings(RenderSettings& settings) : settings_(settings), kept_(settings) {
        settings_.samples = 0;
        settings_.seed = 0;
        settings_.time_limit = 0.0f;
        settings_.guiding = GuidingMode::Off;
    }

    ~NeutralSettings() { settings_ = kept_; }

    NeutralSettings(const NeutralSettings&) = delete;
    NeutralSettings& operator=(const NeutralSettings&) = delete;

  private:
    RenderSettings& settings_;
    RenderSettings kept_;
};

}  // namespace

std::uint64_t scene_hash(SceneDescription& description) {
    const NeutralSettings neutral(description.settings);
    StreamChecksum checksum;
    dump::Writer writer(checksum);
    writer(description);
    return checksum.value();
}

}  // namespace pharos
