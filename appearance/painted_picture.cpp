#include "appearance/painted_picture.h"

#include <algorithm>

#include "core/archive_arrays.h"
#include "core/error.h"

namespace atelier {
namespace {

constexpr const char* kColors = "colors";

}  // namespace

Archive archive_of_painted(const Image& picture) {
  ATELIER_CHECK(picture.channels == 4, "a painted image has colour and coverage");
  Archive archive;
  archive.schema = "atelier.painted_picture";
  put_array(archive, kColors, tensor_of(picture.data, {picture.height, picture.width, 4}));
  return archive;
}

Image painted_picture_of(const Archive& archive, int width, int height, const std::string& file) {
  check_units(archive, file);
  check_names(archive, file, [](const std::string& name) { return name == kColors; });
  const std::span<const float> values = floats_at(archive, kColors, {height, width, 4}, file);
  Image picture(width, height, 4);
  std::copy(values.begin(), values.end(), picture.data.begin());
  return picture;
}

}  // namespace atelier
