#pragma once

namespace atelier {

/// Numbers of the light transfer of one side of a point: spherical harmonics of degree 0 to 2.
constexpr int kTransferTerms = 9;
constexpr int kLargestTransferDegree = 2;

/// How many of them there are up to a degree, 0..2.
constexpr int transfer_terms(int degree) {
  return (degree + 1) * (degree + 1);
}

}  // namespace atelier
