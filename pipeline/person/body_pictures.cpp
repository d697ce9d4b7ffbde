#include "pipeline/person/body_pictures.h"

#include <algorithm>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <vector>

#include "core/io/json.h"
#include "core/io/json_place.h"
#include "core/render/render.h"
#include "core/render/studio.h"
#include "core/sequence_archive.h"
#include "pipeline/pictures/report_drawings.h"
#include "pipeline/pictures/report_plots.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// The image of meshes in a camera, with coverage.
Image rendered(const std::vector<RenderMesh>& meshes, const Camera& camera) {
  Scene scene = studio_scene(meshes, 0);
  scene.ground.reset();
  RenderOptions options;
  options.alpha = true;
  options.samples = 4;
  options.ambient_samples = 4;
  return render(scene, camera, options);
}

Image over(const Image& picture, const Image& drawn, float opacity) {
  Image both = picture;
  for (int y = 0; y < both.height; ++y) {
    for (int x = 0; x < both.width; ++x) {
      const float cover = opacity * drawn.at(x, y, 3);
      for (int c = 0; c < 3; ++c) {
        both.at(x, y, c) = (1 - cover) * both.at(x, y, c) + opacity * drawn.at(x, y, c);
      }
    }
  }
  return both;
}

/// The body, as if clothes were glass.
std::string body_overlays(const fs::path& result, const ReportPlaces& places) {
  const Sequence bodies = open_sequence(result);
  return front_pictures(
      places, "The body under the clothes",
      [&](const Camera& camera, const TrackedMotion& /*motion*/, int id,
          const Image& picture) -> std::optional<Image> {
        const auto at = std::find(bodies.frame_ids.begin(), bodies.frame_ids.end(), id);
        if (at == bodies.frame_ids.end()) {
          return std::nullopt;
        }
        RenderMesh body{frame(bodies, at - bodies.frame_ids.begin()), clay_look()};
        body.look.color = {0.25F, 0.55F, 0.8F};
        return over(picture, rendered({body}, camera), 0.7F);
      });
}

/// How well each frame of the body is founded, from certificates.json.
std::string body_plots(const fs::path& result) {
  const fs::path file = result / "certificates.json";
  if (!fs::exists(file)) {
    return "";
  }
  const nlohmann::json certificates = read_json(file);
  constexpr std::pair<const char*, double> kNumbers[] = {{"outside_rate", 100},
                                                         {"outside_depth", 1e3},
                                                         {"skin_distance", 1e3},
                                                         {"proximity", 1e3},
                                                         {"seen_rate", 100}};
  std::vector<FramePlot> plots = {{"covered skin outside of the clothes, %",
                                   {},
                                   {},
                                   scaled_limit(kBodyFigures, "outside_rate", 100)},
                                  {"its depth, mm", {}, {}},
                                  {"seen skin off the body, mm", {}, {}},
                                  {"gap under clothes that are near, mm", {}, {}},
                                  {"seen, % of the body", {}, {}}};
  for (const auto& [frame, numbers] : certificates.items()) {
    for (std::size_t k = 0; k < plots.size(); ++k) {
      const auto value = JsonPlace(numbers, file.string(), frame).find(kNumbers[k].first);
      if (value) {
        plots[k].frame_ids.push_back(std::atoi(frame.c_str()));
        plots[k].values.push_back(kNumbers[k].second * value->number());
      }
    }
  }
  const std::string svg = plots_svg(plots);
  return svg.empty() ? "" : "<figure>" + svg + "<figcaption>Over frames</figcaption></figure>\n";
}

}  // namespace

std::string body_pictures(const StageStatus& own, const ReportPlaces& places) {
  const fs::path result = result_folder_of(own, places);
  return body_overlays(result, places) + body_plots(result);
}

}  // namespace atelier
