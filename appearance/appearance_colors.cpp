#include "appearance/appearance_colors.h"

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

}  // namespace

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
