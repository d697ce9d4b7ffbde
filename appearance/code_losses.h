#pragma once

namespace atelier {

/// Weights of what a network with a code learns beside its texture, whose loss, a mean squared
/// difference of colours in [0,1], has weight 1 (goliath's losses, ours to scale).
struct CodeLosses {
  double divergence = 1e-4;  ///< of the latent codes from the standard normal distribution, nats
  double geometry = 0.002;   ///< of squared offsets off the registered surface, in units of 5 mm
  double bending = 0.002;    ///< of the squared difference of that error along edges
};

}  // namespace atelier
