#include "guiding/guiding_field.h"

#include "core/check.h"
#include "guiding/mlp.h"
#include "guiding/network_state.h"
#include "guiding/trainer.h"

namespace pharos {

struct GuidingField::Impl {
    Impl(const GuidingConfig& config, const Bounds3& scene_box)
        : layout(make_network_layout(config)),
          state(make_network_state(layout, scene_box)),
          trainer(layout) {}

    NetworkLayout layout;
    NetworkState state;
    Trainer trainer;
};

GuidingField::GuidingField(const GuidingConfig& config, const Bounds3& scene_box)
    : impl_(std::make_unique<Impl>(config, scene_box)) {}

GuidingField::~GuidingField() = default;
GuidingField::GuidingField(GuidingField&&) noexcept = default;
GuidingField& GuidingField::operator=(GuidingField&&) noexcept = default;

void GuidingField::evaluate(const FieldQuery& query, std::span<VmfMixture> mixtures) const {
    CHECK_EQ(query.px.size(), mixtures.size());
    CHECK_EQ(query.py.size(), mixtures.size());
    CHECK_EQ(query.pz.size(), mixtures.size());
    CHECK_EQ(query.nx.size(), mixtures.size());
    CHECK_EQ(query.ny.size(), mixtures.size());
    CHECK_EQ(query.nz.size(), mixtures.size());
    evaluate_network(published_view(impl_->layout, impl_->state), query, mixtures);
}

TrainStatistics GuidingField::train(std::span<const RadianceRecord> records,
                                    ThreadPool& pool,
                                    const CancelFlag* cancel,
                                    std::size_t visits) {
    return impl_->trainer.train(impl_->state, records, pool, {cancel, visits});
}

void GuidingField::restart_optimizer() {
    pharos::restart_optimizer(impl_->state);
    impl_->state.goes_on = impl_->state.generation > 0;
}

std::uint64_t GuidingField::generation() const {
    return impl_->state.generation;
}

const GuidingConfig& GuidingField::config() const {
    return impl_->layout.config;
}

Bounds3 GuidingField::box() const {
    Bounds3 box;
    const Vec3 half = 1.0f / impl_->state.inverse_half_extent;
    box.extend(impl_->state.center - half);
    box.extend(impl_->state.center + half);
    return box;
}

std::vector<std::byte> GuidingField::save() const {
    return save_state(impl_->layout, impl_->state);
}

void GuidingField::load(std::span<const std::byte> data) {
    load_state(impl_->layout, data, impl_->state);
}

}  // namespace pharos
