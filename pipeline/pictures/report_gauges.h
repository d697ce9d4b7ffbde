#pragma once

#include <span>
#include <string>

namespace atelier {

/// A figure beside the range that it should lie in.
struct Gauge {
  std::string name;   ///< "track.mean_mm"
  std::string words;  ///< what it is; "" where the name says it
  std::string value;  ///< with its unit
  std::string range;  ///< "at most 6"
  double number = 0;  ///< the value, in the unit of `limit`
  double limit = 0;
  bool at_least = false;  ///< whether the range is above the limit, else below
  bool met = true;
};

/// The figures one below the other, each a mark on a bar of which the range is coloured, as a table
/// in HTML: long words wrap, and run over no bar. Marks beyond the bar lie at its end. "" for no
/// finite figure.
std::string gauges_table(std::span<const Gauge> gauges);

}  // namespace atelier
