// One pass of training: batches of records through the network, Adam, and the gate that decides
// whether the averaged weights become the new snapshot. Results do not depend on the number of
// threads: tasks are fixed chunks of records, and their gradients are added in a fixed tree.
#pragma once

#include <vector>

#include "core/cancel.h"
#include "core/parallel.h"
#include "guiding/network_state.h"
#include "guiding/record_set.h"

namespace pharos {

struct TrainLimits {
    const CancelFlag* cancel = nullptr;
    std::size_t visits = kTrainingVisits;
};

class Trainer {
  public:
    explicit Trainer(const NetworkLayout& layout);

    TrainStatistics train(NetworkState& state,
                          std::span<const RadianceRecord> records,
                          ThreadPool& pool,
                          const TrainLimits& limits = {});

  private:
    class Team;

    [[nodiscard]] bool cancelled() const {
        return limits_.cancel != nullptr && limits_.cancel->cancelled();
    }

    void train_batches(NetworkState& state, Team& team, TrainStatistics& statistics);
    bool train_batch(NetworkState& state, Team& team, std::size_t first_chunk, double& loss);
    void add_chunk_gradients(std::size_t chunks);
    void add_grid_gradients(const NetworkState& state, std::size_t first_chunk, std::size_t chunks);
    void publish_if_better(NetworkState& state, Team& team, TrainStatistics& statistics);
    [[nodiscard]] NetworkView view(const NetworkState& state,
                                   const AlignedFloats& parameters) const;

    const NetworkLayout* layout_;
    TrainLimits limits_;  // of the call under way
    PreparedRecords records_;
    std::vector<AlignedFloats> workspace_;  // one per chunk of a batch
    std::vector<AlignedFloats> gradient_;
    std::vector<double> loss_;
    AlignedFloats grid_gradient_;
    AlignedFloats held_out_values_;
};

}  // namespace pharos
