#if defined(ATELIER_HAS_CAPTURE) && defined(ATELIER_HAS_APPEARANCE)

#include "apps/appearance_measures.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "appearance/appearance_model.h"
#include "apps/child_program.h"
#include "apps/truth_subject.h"
#include "capture/capture_info.h"
#include "core/archive_arrays.h"
#include "core/error.h"
#include "core/io/image_file.h"
#include "core/io/safetensors.h"
#include "core/io/srgb.h"
#include "core/store/result.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// A folder for files between two programs.
struct BetweenPrograms {
  fs::path path;
  BetweenPrograms() {
    std::string name = (fs::temp_directory_path() / "atelier-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) {
      throw EnvironmentError(name, "cannot be made");
    }
    path = name;
  }
  ~BetweenPrograms() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
  BetweenPrograms(const BetweenPrograms&) = delete;
  BetweenPrograms& operator=(const BetweenPrograms&) = delete;
};

/// Squared differences of one kind of picture, and of how many numbers.
struct Error {
  double squares = 0;
  double count = 0;
  double shadow_squares = 0;  // of the darkest quarter
  double shadow_count = 0;
};

double psnr(double squares, double count) {
  constexpr double kLeast = 1e-9;  // of identical pictures
  return count > 0 ? -10 * std::log10(std::max(squares / count, kLeast)) : 0;
}

/// As an 8-bit picture holds it, in [0,1].
double stored(double linear) {
  return std::round(255.0F * srgb_from_linear(static_cast<float>(linear))) / 255.0;
}

/// Each camera's gain over the geometric mean of those that were trained with, [C] of three: what a
/// texture without gain is to be multiplied with.
std::vector<Eigen::Vector3d> gains_of(const std::vector<Camera>& wanted,
                                      const std::vector<Camera>& all,
                                      const std::vector<std::string>& trained) {
  Eigen::Array3d log_sum = Eigen::Array3d::Zero();
  double count = 0;
  for (const Camera& camera : all) {
    if (std::find(trained.begin(), trained.end(), camera.id) != trained.end()) {
      log_sum += camera.gain.array().log();
      count += 1;
    }
  }
  const Eigen::Array3d middle = (log_sum / std::max(count, 1.0)).exp();
  std::vector<Eigen::Vector3d> gains;
  gains.reserve(wanted.size());
  for (const Camera& camera : wanted) {
    gains.emplace_back(camera.gain.array() / middle);
  }
  return gains;
}

/// Ambient visibility at each pixel of a view.
std::vector<float> visibility_of(const AppearanceData& data, const TexelMap& texels,
                                 const AppearanceView& view) {
  const Image map = texture_of(
      texels, data.frames[static_cast<std::size_t>(view.frame_idx)].visibility.replicate(1, 3));
  const std::vector<float> colors = sample_texture(map, {view.u, view.v, {}});
  std::vector<float> values;
  for (std::size_t i = 0; i < colors.size(); i += 3) {
    values.push_back(colors[i]);
  }
  return values;
}

struct Compared {
  Error drawn, fixed;
};

Compared compare(const AppearanceData& data, const Archive& colors,
                 const std::vector<Eigen::Vector3d>& gains, const fs::path& capture) {
  const auto drawn = values_of<float>(array_at(colors, "drawn", "colors"));
  const auto fixed = values_of<float>(array_at(colors, "static", "colors"));
  const TexelMap texels = shadow_texels(data);
  std::vector<float> open;
  for (const AppearanceView& view : data.views) {
    const std::vector<float> one = visibility_of(data, texels, view);
    open.insert(open.end(), one.begin(), one.end());
  }
  std::vector<float> sorted = open;
  const auto quarter = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 4);
  std::nth_element(sorted.begin(), quarter, sorted.end());
  Compared result;
  std::size_t pixel = 0;
  for (const AppearanceView& view : data.views) {
    const auto camera = static_cast<std::size_t>(view.camera_idx);
    const int frame_id = data.frames[static_cast<std::size_t>(view.frame_idx)].frame_id;
    const ByteImage truth = read_byte_image(capture / "truth" / "images" / data.camera_ids[camera] /
                                            (frame_name(frame_id) + ".png"));
    for (const int place : view.pixel) {
      const bool in_shadow = open[pixel] <= *quarter;
      for (int c = 0; c < 3; ++c) {
        const double wanted =
            truth.data[3 * static_cast<std::size_t>(place) + static_cast<std::size_t>(c)] / 255.0;
        const auto add = [&](Error& error, float linear) {
          const double difference = stored(linear * gains[camera][c]) - wanted;
          error.squares += difference * difference;
          error.count += 1;
          error.shadow_squares += in_shadow ? difference * difference : 0;
          error.shadow_count += in_shadow ? 1 : 0;
        };
        add(result.drawn, drawn[3 * pixel + static_cast<std::size_t>(c)]);
        add(result.fixed, fixed[3 * pixel + static_cast<std::size_t>(c)]);
      }
      ++pixel;
    }
  }
  return result;
}

}  // namespace

std::vector<Measure> measure_appearance(const fs::path& workspace, const fs::path& capture) {
  const auto current = current_name(workspace / "appearance");
  if (!current) {
    return {};
  }
  const fs::path result = workspace / "appearance" / *current;
  const std::map<std::string, double> metrics = read_manifest(result, "appearance").metrics;
  const CaptureInfo info = read_capture_info(capture);
  const TruthSubject dressed = truth_subject(capture);
  std::vector<Camera> cameras;
  for (const Camera& camera : dressed.truth->cameras) {
    if (std::find(info.held_out_cameras.begin(), info.held_out_cameras.end(), camera.id) !=
        info.held_out_cameras.end()) {
      cameras.push_back(camera);
    }
  }
  if (cameras.empty() || info.held_out_frames.empty()) {
    return {};
  }
  const BetweenPrograms between;
  Compared all;
  int resolution = 0;
  for (std::size_t g = 0; g < dressed.truth->garments.size(); ++g) {
    const std::string& name = dressed.truth->garments[g].garment.name;
    const fs::path file = result / name / "model.safetensors";
    const Safetensors found = read_safetensors(file);
    const AppearanceModel model = appearance_model_of(found.tensors, found.metadata, file.string());
    resolution = model.options.resolution;
    DrawnSurface surface;
    surface.which = dressed.first_garment + g;
    surface.atlas = {model.uvs, model.uv_faces, {}};
    surface.resolution = resolution;
    surface.shadow_resolution = shadow_resolution_of(resolution);
    const AppearanceData data =
        prepare_appearance(dressed.subject, surface, cameras, info.held_out_frames);
    write_archive(between.path / "data.h5", archive_of(data));
    run_child_program(
        "atelier-appearance",
        {"predict", file.string(), (between.path / "data.h5").string(),
         (between.path / "colors.h5").string()},
        "it is built where libtorch is (libtorch-dev)", [](const std::string&) {},
        [] { return false; });
    const Archive colors = read_archive(between.path / "colors.h5", "atelier.appearance_colors", 1);
    const Compared one =
        compare(data, colors, gains_of(cameras, dressed.truth->cameras, model.camera_ids), capture);
    for (const auto& [sum, part] :
         {std::pair{&all.drawn, &one.drawn}, std::pair{&all.fixed, &one.fixed}}) {
      sum->squares += part->squares;
      sum->count += part->count;
      sum->shadow_squares += part->shadow_squares;
      sum->shadow_count += part->shadow_count;
    }
  }
  using Side = Measure::Side;
  const auto iterations = metrics.find("iterations");
  const std::string setting =
      std::to_string(resolution) + " texels, " +
      std::to_string(iterations == metrics.end() ? 0 : static_cast<int>(iterations->second)) +
      " steps, true geometry";
  const double drawn = psnr(all.drawn.squares, all.drawn.count);
  const double fixed = psnr(all.fixed.squares, all.fixed.count);
  const bool small = resolution < 512;
  const bool printed =
      dressed.truth->texts.count("fabric") > 0 && dressed.truth->texts.at("fabric") == "print";
  const Side judged = small ? Side::None : Side::AtLeast;
  return {
      {"appearance.psnr_db", drawn, "dB", printed ? 30.0 : 34.0, judged,
       "eroded garment pixels, held-out cameras x held-out frames; " + setting},
      {"appearance.static_psnr_db", fixed, "dB", 0, Side::None,
       "of the best texture that does not change"},
      {"appearance.gain_db", drawn - fixed, "dB", small ? 2.0 : 4.0, Side::AtLeast,
       "over that texture"},
      {"appearance.shadow_psnr_db", psnr(all.drawn.shadow_squares, all.drawn.shadow_count), "dB",
       drawn - 1, Side::AtLeast, "of the quarter of these pixels that sees least of its sky"},
      {"appearance.pixels", all.drawn.count / 3, "", 0, Side::None, "that were compared"},
  };
}

}  // namespace atelier

#endif
