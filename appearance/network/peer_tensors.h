#pragma once

#include <torch/torch.h>

#include "appearance/network/peers.h"

namespace atelier {

// Private to appearance/network.

/// Of all: each number becomes its sum over the processes, the same bits in each. On a GPU in order
/// with its other work, without waiting for it.
void sum_over(Peers& peers, torch::Tensor& numbers);

/// Of all: [P,...] the numbers of each process, by their ranks.
torch::Tensor gathered(Peers& peers, const torch::Tensor& numbers);

}  // namespace atelier
