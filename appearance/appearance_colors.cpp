#include "appearance/appearance_colors.h"

#include <algorithm>

#include "core/archive_arrays.h"
#include "core/error.h"

namespace atelier {
namespace {

constexpr const char* kDrawn = "drawn";
constexpr const char* kFixed = "static";

std::vector<float> colors_at(const Archive& archive, const std::string& name, std::int64_t pixels,
                             const std::string& file) {
  if (pixels == 0 && find_array(archive, name) == nullptr) {
    return {};  // an array without elements is left out
  }
  const std::span<const float> values = floats_at(archive, name, {pixels, 3}, file);
  return {values.begin(), values.end()};
}

/// The number that this share of all is below. Reorders them.
double at_share(std::vector<float>& values, double share) {
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

}  // namespace

DrawnRange drawn_range(const AppearanceColors& colors) {
  constexpr float kDark = 0.02F;
  constexpr double kShare = 0.001;
  std::vector<float> ratios;
  for (std::size_t i = 0; i < colors.drawn.size(); ++i) {
    if (colors.fixed[i] > kDark) {
      ratios.push_back(colors.drawn[i] / colors.fixed[i]);
    }
  }
  if (ratios.empty()) {
    return {};
  }
  const double low = at_share(ratios, kShare);
  return {low, at_share(ratios, 1 - kShare)};
}

Archive archive_of(const AppearanceColors& colors) {
  ATELIER_CHECK(colors.drawn.size() == colors.fixed.size() && colors.drawn.size() % 3 == 0,
                "both colours of every pixel");
  const auto pixels = static_cast<std::int64_t>(colors.drawn.size() / 3);
  Archive archive;
  archive.schema = "atelier.appearance_colors";
  put_array(archive, kDrawn, tensor_of(colors.drawn, {pixels, 3}));
  put_array(archive, kFixed, tensor_of(colors.fixed, {pixels, 3}));
  return archive;
}

AppearanceColors appearance_colors_of(const Archive& archive, std::int64_t pixels,
                                      const std::string& file) {
  check_units(archive, file);
  check_names(archive, file,
              [](const std::string& name) { return name == kDrawn || name == kFixed; });
  return {colors_at(archive, kDrawn, pixels, file), colors_at(archive, kFixed, pixels, file)};
}

}  // namespace atelier
