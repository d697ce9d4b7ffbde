#if defined(ATELIER_HAS_CAPTURE) && defined(ATELIER_HAS_APPEARANCE)

#include "apps/appearance_measures.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <optional>

#include "appearance/appearance_colors.h"
#include "appearance/appearance_model.h"
#include "appearance/picture_similarity.h"
#include "appearance/train_options.h"
#include "apps/child_program.h"
#include "apps/temporary_folder.h"
#include "apps/worn_subject.h"
#include "capture/capture_info.h"
#include "core/archive.h"
#include "core/error.h"
#include "core/io/image_file.h"
#include "core/io/safetensors.h"
#include "core/io/srgb.h"
#include "core/store/result.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// How far one kind of picture is from the true ones.
struct Difference {
  double squares = 0;
  double count = 0;
  double shadow_squares = 0;  // of the quarter that sees least of the sky
  double shadow_count = 0;
  double similarity = 0;  // structural, times pixels
};

double psnr(double squares, double count) {
  constexpr double kLeast = 1e-9;  // of identical pictures
  return count > 0 ? -10 * std::log10(std::max(squares / count, kLeast)) : 0;
}

/// As an 8-bit picture holds it, in [0,1].
float stored(double linear) {
  return std::round(255.0F * srgb_from_linear(static_cast<float>(linear))) / 255.0F;
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

/// Ambient visibility at each pixel of a view, of the outside.
std::vector<float> openness_of(const AppearanceData& data, const TexelMap& texels,
                               const AppearanceView& view) {
  const SurfaceFrame& frame = data.frames[static_cast<std::size_t>(view.frame_idx)];
  const Eigen::MatrixXf rows = texel_values(texels, data.faces, frame.visibility.col(0));
  const std::vector<float> colors =
      sample_texture(texture_of(texels, rows.replicate(1, 3)), {view.u, view.v, {}});
  std::vector<float> values;
  values.reserve(view.u.size());
  for (std::size_t i = 0; i < colors.size(); i += 3) {
    values.push_back(colors[i]);
  }
  return values;
}

/// What is drawn of one garment, and where the truth has it.
struct Drawn {
  AppearanceData truth;     ///< pixels to be judged: eroded, of the true garment
  AppearanceData own;       ///< pixels that the model's geometry covers
  AppearanceColors colors;  ///< of those
};

/// Sums of all garments of one result.
struct Compared {
  Difference drawn, fixed;
  double judged = 0;   // pixels of the true garments
  double covered = 0;  // of them, those that the model draws
};

/// A picture of one view, [H,W,3] as 8-bit sRGB holds it, black where nothing is known.
Image empty_picture(const AppearanceData& data, const AppearanceView& view) {
  const auto camera = static_cast<std::size_t>(view.camera_idx);
  return Image(data.widths[camera], data.heights[camera], 3);
}

void compare_view(Compared& sum, const AppearanceView& truth_view, const std::vector<float>& open,
                  float quarter, const Image& wanted, const Image& drawn, const Image& fixed,
                  const ByteImage& is_drawn) {
  ByteImage mask(wanted.width, wanted.height, 1);
  double pixels = 0;
  for (std::size_t i = 0; i < truth_view.pixel.size(); ++i) {
    const auto place = static_cast<std::size_t>(truth_view.pixel[i]);
    sum.judged += 1;
    if (is_drawn.data[place] == 0) {
      continue;
    }
    sum.covered += 1;
    mask.data[place] = 1;
    pixels += 1;
    for (std::size_t c = 0; c < 3; ++c) {
      const auto add = [&](Difference& difference, const Image& picture) {
        const double off = picture.data[3 * place + c] - wanted.data[3 * place + c];
        difference.squares += off * off;
        difference.count += 1;
        difference.shadow_squares += open[i] <= quarter ? off * off : 0;
        difference.shadow_count += open[i] <= quarter ? 1 : 0;
      };
      add(sum.drawn, drawn);
      add(sum.fixed, fixed);
    }
  }
  sum.drawn.similarity += pixels * structural_similarity(drawn, wanted, mask);
  sum.fixed.similarity += pixels * structural_similarity(fixed, wanted, mask);
}

void compare(Compared& sum, const Drawn& garment, const std::vector<Eigen::Vector3d>& gains,
             const fs::path& capture) {
  const std::vector<float>& drawn_colors = garment.colors.drawn;
  const std::vector<float>& fixed_colors = garment.colors.fixed;
  const AppearanceData& truth = garment.truth;
  constexpr int kTexels = 256;
  const TexelMap texels = texel_map(truth.faces, truth.uvs, truth.uv_faces, kTexels);
  std::vector<std::vector<float>> open;
  std::vector<float> sorted;
  for (const AppearanceView& view : truth.views) {
    open.push_back(openness_of(truth, texels, view));
    sorted.insert(sorted.end(), open.back().begin(), open.back().end());
  }
  const auto quarter = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 4);
  std::nth_element(sorted.begin(), quarter, sorted.end());
  // The same camera and frame in what was drawn, and where its colours begin.
  std::map<std::pair<int, int>, std::pair<const AppearanceView*, std::size_t>> own;
  std::size_t begin = 0;
  for (const AppearanceView& view : garment.own.views) {
    own[{view.camera_idx, view.frame_idx}] = {&view, begin};
    begin += view.pixel.size();
  }
  for (std::size_t v = 0; v < truth.views.size(); ++v) {
    const AppearanceView& view = truth.views[v];
    const auto camera = static_cast<std::size_t>(view.camera_idx);
    const int frame_id = truth.frames[static_cast<std::size_t>(view.frame_idx)].frame_id;
    const ByteImage bytes = read_byte_image(
        capture / "truth" / "images" / truth.camera_ids[camera] / (frame_name(frame_id) + ".png"));
    Image wanted = empty_picture(truth, view);
    for (std::size_t i = 0; i < wanted.data.size(); ++i) {
      wanted.data[i] = static_cast<float>(bytes.data[i]) / 255;
    }
    Image drawn = wanted;
    Image fixed = wanted;
    ByteImage is_drawn(wanted.width, wanted.height, 1);
    if (const auto found = own.find({view.camera_idx, view.frame_idx}); found != own.end()) {
      const auto& [seen, first] = found->second;
      for (std::size_t i = 0; i < seen->pixel.size(); ++i) {
        const auto place = static_cast<std::size_t>(seen->pixel[i]);
        is_drawn.data[place] = 1;
        for (std::size_t c = 0; c < 3; ++c) {
          const double gain = gains[camera][static_cast<Index>(c)];
          drawn.data[3 * place + c] = stored(drawn_colors[3 * (first + i) + c] * gain);
          fixed.data[3 * place + c] = stored(fixed_colors[3 * (first + i) + c] * gain);
        }
      }
    }
    compare_view(sum, view, open[v], *quarter, wanted, drawn, fixed, is_drawn);
  }
}

/// One result of `appearance` or `ceiling`, over all its garments.
struct Judged {
  Compared compared;
  std::string setting;
  int resolution = 0;
  int iterations = 0;
};

/// The folder of an input of a result, in the same workspace.
fs::path input_of(const fs::path& workspace, const Manifest& manifest, const std::string& kind) {
  for (const ManifestInput& input : manifest.inputs) {
    if (input.kind == kind) {
      return workspace / input.stage / fs::path(input.path).filename();
    }
  }
  throw DataError(workspace.string(), "manifest of " + manifest.stage, "no input " + kind,
                  "what the stage reads");
}

/// What a result's networks were trained with: "small", "standard" or "full".
std::string setting_of(const Manifest& manifest) {
  TrainOptions options;
  OptionTable table = describe(options);
  for (const ManifestOption& option : manifest.options) {
    if (option.name == "setting" && option.json.size() > 2) {
      set_option(table, option.name, option.json.substr(1, option.json.size() - 2));
    }
  }
  options = resolved(options, manifest.device == "cuda" ? Device::Cuda : Device::Cpu);
  return option_text(table.fields.front());
}

std::optional<Judged> judge(const fs::path& workspace, const std::string& stage,
                            const fs::path& capture) {
  const auto current = current_name(workspace / stage);
  const CaptureInfo info = read_capture_info(capture);
  const auto truth = std::make_shared<const CaptureTruth>(read_capture_truth(capture));
  std::vector<Camera> cameras;
  for (const Camera& camera : truth->cameras) {
    if (std::count(info.held_out_cameras.begin(), info.held_out_cameras.end(), camera.id) > 0) {
      cameras.push_back(camera);
    }
  }
  if (!current || cameras.empty() || info.held_out_frames.empty()) {
    return std::nullopt;
  }
  const fs::path result = workspace / stage / *current;
  const Manifest manifest = read_manifest(result, stage);
  const WornSubject in_truth = worn_in_truth(capture, truth);
  const WornSubject worn = stage == "ceiling"
                               ? in_truth
                               : worn_in_workspace(input_of(workspace, manifest, "registered"),
                                                   input_of(workspace, manifest, "bodies"));
  const auto iterations = manifest.metrics.find("iterations");
  Judged judged;
  judged.setting = setting_of(manifest);
  judged.iterations =
      iterations == manifest.metrics.end() ? 0 : static_cast<int>(iterations->second);
  const TemporaryFolder between;
  for (std::size_t g = in_truth.first_garment; g < in_truth.templates.size(); ++g) {
    const auto same =
        std::find(worn.labels.begin() + static_cast<std::ptrdiff_t>(worn.first_garment),
                  worn.labels.end(), in_truth.labels[g]);
    const auto which = static_cast<std::size_t>(same - worn.labels.begin());
    const std::size_t own = stage == "ceiling" ? g : which;
    if (own >= worn.templates.size()) {
      continue;
    }
    const fs::path file = result / worn.subject.names[own] / "model.safetensors";
    const Safetensors found = read_safetensors(file);
    const AppearanceModel model = appearance_model_of(found.tensors, found.metadata, file.string());
    judged.resolution = model.options.resolution;
    Drawn garment;
    DrawnSurface surface;
    surface.which = g;
    surface.atlas = pack_atlas(in_truth.templates[g]);
    garment.truth = prepare_appearance(in_truth.subject, surface, cameras, info.held_out_frames);
    surface.which = own;
    surface.atlas = {model.uvs, model.uv_faces, {}};
    surface.trusted_only = false;
    garment.own = prepare_appearance(worn.subject, surface, cameras, info.held_out_frames);
    write_archive(between.path / "data.h5", archive_of(garment.own));
    const fs::path drawn = between.path / "colors.h5";
    run_child_program(
        "atelier-appearance",
        {"predict", file.string(), (between.path / "data.h5").string(), drawn.string()},
        "it is built where libtorch is (libtorch-dev)", [](const std::string&) {},
        [] { return false; });
    std::int64_t pixels = 0;
    for (const AppearanceView& view : garment.own.views) {
      pixels += static_cast<std::int64_t>(view.pixel.size());
    }
    garment.colors = appearance_colors_of(read_archive(drawn, "atelier.appearance_colors", 1),
                                          pixels, drawn.string());
    compare(judged.compared, garment, gains_of(cameras, truth->cameras, model.camera_ids), capture);
  }
  return judged.compared.covered > 0 ? std::optional(judged) : std::nullopt;
}

void add_measures(std::vector<Measure>& all, const std::string& stage, const Judged& judged,
                  bool printed) {
  using Side = Measure::Side;
  const Difference& drawn = judged.compared.drawn;
  const Difference& fixed = judged.compared.fixed;
  const std::string setting = judged.setting + ": " + std::to_string(judged.resolution) +
                              " texels, " + std::to_string(judged.iterations) + " steps";
  const double reached = psnr(drawn.squares, drawn.count);
  const double still = psnr(fixed.squares, fixed.count);
  const bool small = judged.resolution < 512;
  const auto add = [&](const char* key, double value, const char* unit, double target, Side side,
                       const std::string& note) {
    all.push_back({stage + "." + key, value, unit, target, side, note});
  };
  add("psnr_db", reached, "dB", printed ? 30.0 : 34.0, small ? Side::None : Side::AtLeast,
      "eroded garment pixels, held-out cameras x held-out frames; " + setting);
  add("static_psnr_db", still, "dB", 0, Side::None, "of the best texture that does not change");
  add("gain_db", reached - still, "dB", small ? 2.0 : 4.0, Side::AtLeast, "over that texture");
  add("shadow_psnr_db", psnr(drawn.shadow_squares, drawn.shadow_count), "dB", reached - 1,
      Side::AtLeast, "of the quarter of these pixels that sees least of its sky");
  add("ssim", drawn.similarity / judged.compared.covered, "", 0, Side::None,
      "structural similarity of these pixels");
  add("static_ssim", fixed.similarity / judged.compared.covered, "", 0, Side::None,
      "of the texture that does not change");
  add("covered", judged.compared.covered / judged.compared.judged, "", 0, Side::None,
      "of the true garments' eroded pixels, drawn by a network");
  add("pixels", judged.compared.covered, "", 0, Side::None, "that were compared");
}

}  // namespace

std::vector<Measure> measure_appearance(const fs::path& workspace, const fs::path& capture) {
  const auto ceiling = judge(workspace, "ceiling", capture);
  const auto reached = judge(workspace, "appearance", capture);
  std::vector<Measure> all;
  if (!ceiling && !reached) {
    return all;
  }
  const CaptureTruth truth = read_capture_truth(capture);
  const auto fabric = truth.texts.find("fabric");
  const bool printed = fabric != truth.texts.end() && fabric->second == "print";
  if (reached) {
    add_measures(all, "appearance", *reached, printed);
  }
  if (ceiling) {
    add_measures(all, "ceiling", *ceiling, printed);
  }
  if (reached && ceiling) {
    const auto db = [](const Judged& judged) {
      return psnr(judged.compared.drawn.squares, judged.compared.drawn.count);
    };
    all.push_back({"appearance.below_ceiling_db", db(*ceiling) - db(*reached), "dB", 2,
                   Measure::Side::AtMost, "less than the same network on true geometry"});
  }
  return all;
}

}  // namespace atelier

#endif
