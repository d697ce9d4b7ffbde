#pragma once

#include <span>
#include <string>

namespace atelier {

/// A figure beside the range that it should lie in.
struct Gauge {
  std::string name;   ///< "track.mean_mm"
  std::string words;  ///< what it is, a noun phrase; "" where the name says it
  std::string value;  ///< with its unit
  std::string range;  ///< "at most 6"
  double number = 0;  ///< the value, in the unit of `limit`
  double limit = 0;
  bool at_least = false;  ///< whether the range is above the limit, else below
  bool met = true;
  bool first = true;  ///< drawn at once; else in what is folded
};

/// The error as a share of what the target allows: above 1 it is missed. Of a share that should be
/// large, the error is what is missing to 1; decibels are ratios of errors. Infinite for an error
/// where none is allowed.
double share_of_allowed(const Gauge& gauge);

/// The figures that are drawn at once, then the others folded; one below the other, each a mark on
/// a bar of which the range is coloured, as a table in HTML: long words wrap, and run over no bar.
/// Marks beyond the bar lie at its end. "" for no finite figure.
std::string gauges_html(std::span<const Gauge> gauges);

}  // namespace atelier
