#include "core/color.h"
#include "integrator/stages.h"

namespace pharos {

namespace {

constexpr double kMaxRelativeSquare = 2000.0;

[[nodiscard]] std::uint64_t record_key(const RenderContext& context,
                                       const PathBatch& batch,
                                       const VertexRecord& record) {
    const FilmDescription& film = context.scene.description.film;
    const std::uint32_t pixel = batch.root_pixel[batch.root[record.path]];
    const std::uint64_t x = film.crop_x + pixel % film.crop_width;
    const std::uint64_t y = film.crop_y + pixel / film.crop_width;
    const std::uint64_t sample = batch.sample_index[record.path];
    return ((y * film.width + x) << 32) | ((sample & 0xfffffu) << 12) | (record.vertex & 0xfffu);
}

void finish_record(const RenderContext& context,
                   const PathBatch& batch,
                   VertexRecord& record,
                   RecordBuffer& buffer) {
    // All that reached the path after wi was sampled, seen back through the throughput. Copies made
    // since then carry a share of the weight each: the recorded one stands for all.
    const Rgb arrived = batch.recorded_radiance[record.path] - record.radiance_before;
    const Rgb L = divide_or_zero(arrived, record.beta);
    const float cos_i = std::abs(glm::dot(record.selection.normal, record.wi));
    const std::uint64_t key = record_key(context, batch, record);
    buffer.radiance.push_back({record.selection.position,
                               record.selection.normal,
                               record.wi,
                               std::max(luminance(L), 0.0f) * cos_i,
                               record.selection.pdf_used / record.smooth_probability,
                               key});
    if (record.judged && record.selection.weight > 0.0f) {
        const Rgb hit = divide_or_zero(record.hit_weighted, record.beta);
        record.selection.indirect = std::max(luminance(record.f_cos * (L - hit)), 0.0f);
        record.selection.key = key;
        buffer.selection.push_back(record.selection);
    }
}

}  // namespace

std::uint64_t record_radiance(const RenderContext& context,
                              PathBatch& batch,
                              RecordBuffer& buffer) {
    if (!context.guiding.record) {
        return 0;
    }
    for (VertexRecord& record : batch.records) {
        ++buffer.demand[record.rank];
        if (record.complete) {
            finish_record(context, batch, record, buffer);
        }
    }
    for (std::uint32_t path = 0; path < batch.roots; ++path) {
        if (batch.split_scale[path] == 0.0f) {
            continue;
        }
        ++buffer.recorded_paths;
        if (!context.guiding.pixel_estimate.empty()) {
            const double pixel =
                static_cast<double>(context.guiding.pixel_estimate[batch.root_pixel[path]]);
            const double relative =
                static_cast<double>(luminance(batch.recorded_radiance[path])) / pixel - 1.0;
            const double square = std::min(relative * relative, kMaxRelativeSquare);
            buffer.variance_sum += static_cast<std::uint64_t>(
                std::isfinite(square) ? square / RecordBuffer::kVarianceUnit : 0.0);
        }
    }
    return batch.records.size();
}

}  // namespace pharos
