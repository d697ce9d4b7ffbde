#include "pipeline/avatar/avatar_drawing.h"

#include <string>

#include "core/archive.h"
#include "core/error.h"
#include "core/io/child_program.h"
#include "core/io/safetensors.h"
#include "core/io/temporary_folder.h"

namespace atelier {

namespace fs = std::filesystem;

AppearanceModel avatar_model_at(const fs::path& file) {
  try {
    const Safetensors found = read_safetensors(file);
    return appearance_model_of(found.tensors, found.metadata, file.string());
  } catch (const DataError& error) {
    if (error.expected.find(" again") != std::string::npos) {
      throw;
    }
    throw DataError(error.file, error.where, error.found,
                    error.expected + "; run 'atelier avatar' again");
  }
}

AppearanceColors avatar_colors(const fs::path& file, const AppearanceModel& model,
                               const AppearanceData& asked) {
  if (has_child_program("atelier-appearance") && !asked.views.empty()) {
    std::int64_t pixels = 0;
    for (const AppearanceView& view : asked.views) {
      pixels += static_cast<std::int64_t>(view.pixel.size());
    }
    const TemporaryFolder between;
    const fs::path data = between.path / "data.h5";
    const fs::path colors = between.path / "colors.h5";
    write_archive(data, archive_of(asked));
    run_child_program(
        "atelier-appearance", {"predict", file.string(), data.string(), colors.string()},
        "a build with libtorch (libtorch-dev)", [](const std::string&) {}, [] { return false; });
    return appearance_colors_of(read_archive(colors, "atelier.appearance_colors", 1), pixels,
                                colors.string());
  }
  AppearanceColors all;
  for (const AppearanceView& view : asked.views) {
    const std::vector<float> colors = sample_texture(model.static_texture, {view.u, view.v, {}});
    all.fixed.insert(all.fixed.end(), colors.begin(), colors.end());
  }
  all.drawn = all.fixed;
  return all;
}

DrawnViews drawn_views(const fs::path& file, const AppearanceModel& model,
                       const DressedSubject& subject, const std::vector<Camera>& cameras,
                       const std::vector<int>& frames, Device device) {
  DrawnSurface surface;
  surface.atlas = {model.uvs, model.uv_faces, {}};
  surface.trusted_only = false;
  surface.fewest_pixels = 0;
  PrepareAppearanceOptions options;
  options.occlusion = model.occlusion.value_or(options.occlusion);
  DrawnViews views;
  views.asked = prepare_appearance(subject, surface, {cameras, frames}, options, device);
  views.colors = avatar_colors(file, model, views.asked);
  return views;
}

Image with_drawn_pixels(Image picture, const AppearanceView& view, const std::vector<float>& colors,
                        std::size_t first, const Eigen::Vector3d& gain) {
  for (std::size_t p = 0; p < view.pixel.size(); ++p) {
    for (std::size_t c = 0; c < 3; ++c) {
      picture.data[3 * static_cast<std::size_t>(view.pixel[p]) + c] =
          colors[3 * (first + p) + c] * static_cast<float>(gain[static_cast<Index>(c)]);
    }
  }
  return picture;
}

}  // namespace atelier
