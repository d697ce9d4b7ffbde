#include "appearance/body_surfaces.h"

#include "core/archive_arrays.h"
#include "core/error.h"
#include "core/quantity_text.h"

namespace atelier {
namespace {

constexpr const char* kRows = "frames/rows";

}  // namespace

Archive archive_of_surfaces(const std::vector<FloatRows>& surfaces) {
  ATELIER_CHECK(!surfaces.empty(), "there is a surface");
  const Index vertices = surfaces[0].rows();
  std::vector<float> rows;
  for (const FloatRows& surface : surfaces) {
    ATELIER_CHECK(surface.rows() == vertices, "surfaces have one number of vertices");
    rows.insert(rows.end(), surface.data(), surface.data() + surface.size());
  }
  Archive archive;
  archive.schema = kSurfacesSchema;
  put_array(archive, kRows,
            tensor_of(rows, {static_cast<std::int64_t>(surfaces.size()), vertices, 3}));
  return archive;
}

std::vector<FloatRows> surfaces_of(const Archive& archive, const std::string& file) {
  constexpr float kFarthest = 1e6F;  // m
  check_units(archive, file);
  check_names(archive, file, [](const std::string& name) { return name == kRows; });
  const Tensor& tensor = array_at(archive, kRows, file);
  const bool rows_of_three = tensor.shape.size() == 3 && tensor.shape[2] == 3;
  const std::span<const float> values = floats_at(
      archive, kRows, rows_of_three ? tensor.shape : std::vector<std::int64_t>{-1, -1, 3}, file);
  for (const float value : values) {
    if (!(value >= -kFarthest && value <= kFarthest)) {
      throw DataError(file, kRows, short_number(value), "metres, within 1000 km");
    }
  }
  std::vector<FloatRows> surfaces;
  for (std::int64_t i = 0; i < tensor.shape[0]; ++i) {
    surfaces.emplace_back(
        Eigen::Map<const FloatRows>(values.data() + 3 * i * tensor.shape[1], tensor.shape[1], 3));
  }
  return surfaces;
}

}  // namespace atelier
