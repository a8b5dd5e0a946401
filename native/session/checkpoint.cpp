#include "session/checkpoint.h"

#include "core/state_file.h"

namespace pharos {

namespace {

constexpr StateFileKind kCheckpoint{0x54504b4352484850ull, 2, "checkpoint"};  // "PHHRCKPT"

struct StoredIdentity {
    RenderIdentity value;
    std::uint32_t guiding = 0;
};

template <class Archive>
void state_fields(Archive& archive, StoredIdentity& identity) {
    RenderIdentity& v = identity.value;
    archive(v.scene, v.field, v.seed, v.offset, identity.guiding, v.width, v.height);
}

[[nodiscard]] StoredIdentity stored(const RenderIdentity& identity) {
    return {identity, static_cast<std::uint32_t>(identity.guiding)};
}

void require_same(const StoredIdentity& file, const StoredIdentity& own) {
    const RenderIdentity& a = file.value;
    const RenderIdentity& b = own.value;
    const auto require = [](bool same, const char* what) {
        if (!same) {
            throw StateError(std::string("it was made with ") + what);
        }
    };
    require(a.width == b.width && a.height == b.height, "another picture size");
    require(a.scene == b.scene, "another scene, or other settings");
    require(a.seed == b.seed, "another seed");
    require(a.offset == b.offset, "other samples");
    require(file.guiding == own.guiding && a.field == b.field, "another guide");
}

}  // namespace

template <class Archive>
void state_fields(Archive& archive, RenderPosition& p) {
    archive(p.done, p.nonfinite, p.records, p.paths, p.vertices);
}

void write_checkpoint(const std::string& path,
                      const RenderIdentity& identity,
                      const RenderPosition& position,
                      const Film& film,
                      const GuideController& guide) {
    write_state_file(path, kCheckpoint, [&](StateWriter& out) {
        out(stored(identity), position);
        film.save(out);
        guide.save(out);
    });
}

RenderPosition read_checkpoint(const std::string& path,
                               const RenderIdentity& identity,
                               Film& film,
                               GuideController& guide) {
    RenderPosition position;
    read_state_file(path, kCheckpoint, [&](StateReader& in) {
        StoredIdentity file;
        in(file);
        require_same(file, stored(identity));
        in(position);
        film.load(in);
        guide.load(in);
    });
    return position;
}

}  // namespace pharos
