#include "bodymodel/formats/skin_weights.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/quantity_text.h"

namespace atelier {
namespace {

std::vector<Influence> merged(const std::vector<Influence>& influences) {
  std::vector<Influence> sorted = influences;
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const Influence& a, const Influence& b) { return a.joint < b.joint; });
  std::vector<Influence> result;
  for (const Influence& influence : sorted) {
    if (!result.empty() && result.back().joint == influence.joint) {
      result.back().weight += influence.weight;
    } else {
      result.push_back(influence);
    }
  }
  return result;
}

}  // namespace

PackedSkin pack_skin_weights(const std::vector<std::vector<Influence>>& influences, Index joints,
                             const SkinPackOptions& options, const std::string& file) {
  ATELIER_CHECK(options.max_slots >= 1, "at least one slot");
  Index negative = 0;
  Index pruned = 0;
  Index scaled = 0;
  double low = 1;
  double high = 1;
  std::vector<std::vector<Influence>> rows(influences.size());
  std::size_t slots = 1;
  for (std::size_t v = 0; v < influences.size(); ++v) {
    const std::string where = "skin weights of vertex " + std::to_string(v);
    for (const Influence& influence : influences[v]) {
      if (!std::isfinite(influence.weight)) {
        throw DataError(file, where, "a weight that is not finite", "finite weights");
      }
      if (influence.joint < 0 || influence.joint >= joints) {
        throw DataError(file, where, "joint " + std::to_string(influence.joint),
                        "a joint in [0, " + std::to_string(joints) + ")");
      }
    }
    std::vector<Influence>& row = rows[v];
    double before = 0;
    bool had_negative = false;
    for (const Influence& influence : merged(influences[v])) {
      had_negative = had_negative || influence.weight < 0;
      before += influence.weight;
      if (influence.weight > options.smallest) {
        row.push_back(influence);
      }
    }
    negative += had_negative ? 1 : 0;
    std::stable_sort(row.begin(), row.end(),
                     [](const Influence& a, const Influence& b) { return a.weight > b.weight; });
    if (row.size() > static_cast<std::size_t>(options.max_slots)) {
      row.resize(static_cast<std::size_t>(options.max_slots));
      ++pruned;
    }
    double sum = 0;
    for (const Influence& influence : row) {
      sum += influence.weight;
    }
    if (row.empty() || !std::isfinite(sum)) {
      throw DataError(file, where, "no joint that moves it", "at least one positive weight");
    }
    for (Influence& influence : row) {
      influence.weight /= sum;
    }
    if (std::abs(before - 1) > options.tolerance) {
      ++scaled;
      low = std::min(low, before);
      high = std::max(high, before);
    }
    slots = std::max(slots, row.size());
  }

  PackedSkin packed;
  packed.skin.joints.setZero(static_cast<Index>(rows.size()), static_cast<Index>(slots));
  packed.skin.weights.setZero(static_cast<Index>(rows.size()), static_cast<Index>(slots));
  for (std::size_t v = 0; v < rows.size(); ++v) {
    for (std::size_t k = 0; k < rows[v].size(); ++k) {
      packed.skin.joints(static_cast<Index>(v), static_cast<Index>(k)) = rows[v][k].joint;
      packed.skin.weights(static_cast<Index>(v), static_cast<Index>(k)) = rows[v][k].weight;
    }
  }
  if (scaled > 0) {
    packed.findings.push_back({Severity::Warning, "skin-weights-sum", file,
                               std::to_string(scaled) + " vertices had weights that sum to " +
                                   short_number(low) + " to " + short_number(high),
                               "they were scaled to sum to 1"});
  }
  if (negative > 0) {
    packed.findings.push_back({Severity::Warning, "skin-weights-negative", file,
                               std::to_string(negative) + " vertices had negative weights",
                               "these were set to 0"});
  }
  if (pruned > 0) {
    packed.findings.push_back({Severity::Note, "skin-weights-pruned", file,
                               std::to_string(pruned) + " vertices had more than " +
                                   std::to_string(options.max_slots) + " joints",
                               "the lightest were dropped"});
  }
  return packed;
}

PackedSkin repair_skin_weights(const SkinWeights& skin, Index joints,
                               const SkinPackOptions& options, const std::string& file) {
  ATELIER_CHECK(
      skin.joints.rows() == skin.weights.rows() && skin.joints.cols() == skin.weights.cols(),
      "joints and weights of different size");
  std::vector<std::vector<Influence>> influences(static_cast<std::size_t>(skin.joints.rows()));
  for (Index v = 0; v < skin.joints.rows(); ++v) {
    for (Index k = 0; k < skin.joints.cols(); ++k) {
      if (skin.weights(v, k) != 0) {
        influences[static_cast<std::size_t>(v)].push_back({skin.joints(v, k), skin.weights(v, k)});
      }
    }
  }
  return pack_skin_weights(influences, joints, options, file);
}

}  // namespace atelier
