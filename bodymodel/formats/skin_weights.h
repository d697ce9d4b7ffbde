#pragma once

#include <string>
#include <vector>

#include "bodymodel/body_model.h"
#include "core/finding.h"

namespace atelier {

/// A joint that moves a vertex, and its share.
struct Influence {
  int joint = 0;
  double weight = 0;
};

struct SkinPackOptions {
  int max_slots = 8;        ///< influences kept per vertex, the heaviest first; 4 for game engines
  double smallest = 1e-6;   ///< weights below this share are dropped
  double tolerance = 1e-6;  ///< sums nearer to 1 than this are not worth a finding
};

/// Weights that `check_body_model` accepts, and what had to be done to them.
struct PackedSkin {
  SkinWeights skin;               ///< slots sorted by weight, rows sum to 1
  std::vector<Finding> findings;  ///< "skin-weights-sum", "skin-weights-negative",
                                  ///< "skin-weights-pruned"; one of each kind, with counts
};

/// Packs lists of influences, one list per vertex, into slots: repeated joints are added up,
/// negative weights become 0, the heaviest `max_slots` stay, and rows are scaled to sum 1. Throws
/// DataError (file, vertex) for a weight that is not finite, a joint out of range, or a vertex
/// that no joint moves.
PackedSkin pack_skin_weights(const std::vector<std::vector<Influence>>& influences, Index joints,
                             const SkinPackOptions& options = {}, const std::string& file = "");

/// The same for weights that are already in slots: the stated repair of a model whose weights do
/// not sum to 1.
PackedSkin repair_skin_weights(const SkinWeights& skin, Index joints,
                               const SkinPackOptions& options = {}, const std::string& file = "");

}  // namespace atelier
