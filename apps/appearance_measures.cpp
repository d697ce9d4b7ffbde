#if defined(ATELIER_HAS_CAPTURE) && defined(ATELIER_HAS_APPEARANCE) &&      \
    defined(ATELIER_HAS_REGISTRATION) && defined(ATELIER_HAS_SIMULATION) && \
    defined(ATELIER_HAS_BODYMODEL)

#include "apps/appearance_measures.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <optional>

#include "appearance/appearance_colors.h"
#include "appearance/appearance_model.h"
#include "appearance/picture_similarity.h"
#include "appearance/train_options.h"
#include "apps/child_program.h"
#include "apps/register_measures.h"
#include "apps/simulated_motion.h"
#include "apps/synthesis.h"
#include "apps/temporary_folder.h"
#include "apps/worn_subject.h"
#include "capture/capture_info.h"
#include "core/archive.h"
#include "core/error.h"
#include "core/io/image_file.h"
#include "core/io/safetensors.h"
#include "core/io/srgb.h"
#include "core/sequence_archive.h"
#include "core/store/result.h"
#include "registration/registration_error.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// How far one kind of picture is from the true ones.
struct Difference {
  double squares = 0;
  double count = 0;
  double shadow_squares = 0;  // of the quarter that sees least of the sky
  double shadow_count = 0;
  double similarity = 0;         // structural, times pixels
  double shadow_similarity = 0;  // the same of the quarter
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
  const Eigen::MatrixXf rows = texel_values(texels, data.faces, frame.transfer.col(0));
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

/// What a camera sees in a frame, [H,W,3] as 8-bit sRGB holds it, in [0,1].
using TruePicture = std::function<Image(std::size_t camera_idx, int frame_id)>;

void compare_view(Compared& sum, const AppearanceView& truth_view, const std::vector<float>& open,
                  float quarter, const Image& wanted, const Image& drawn, const Image& fixed,
                  const ByteImage& is_drawn) {
  ByteImage mask(wanted.width, wanted.height, 1);
  ByteImage shadow(wanted.width, wanted.height, 1);
  double pixels = 0;
  double shadow_pixels = 0;
  for (std::size_t i = 0; i < truth_view.pixel.size(); ++i) {
    const auto place = static_cast<std::size_t>(truth_view.pixel[i]);
    sum.judged += 1;
    if (is_drawn.data[place] == 0) {
      continue;
    }
    sum.covered += 1;
    mask.data[place] = 1;
    pixels += 1;
    if (open[i] <= quarter) {
      shadow.data[place] = 1;
      shadow_pixels += 1;
    }
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
  sum.drawn.shadow_similarity += shadow_pixels * structural_similarity(drawn, wanted, shadow);
}

void compare(Compared& sum, const Drawn& garment, const std::vector<Eigen::Vector3d>& gains,
             const TruePicture& picture) {
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
    const Image wanted = picture(camera, frame_id);
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
  Compared body;       ///< where it is in front, if it has a network
  Compared simulated;  ///< in a motion that the capture does not show
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

/// Frames that are judged: of a capture, or simulated.
struct Scenes {
  WornSubject truth;  ///< the true surfaces in them
  WornSubject own;    ///< what a result has instead
  std::vector<int> frame_ids;
  TruePicture picture;
};

/// Frames of the capture that nothing was learnt from.
Scenes held_out_scenes(const WornSubject& in_truth, const WornSubject& worn,
                       const std::vector<Camera>& cameras, const std::vector<int>& frame_ids,
                       const fs::path& capture) {
  return {in_truth, worn, frame_ids, [&cameras, capture](std::size_t camera, int frame_id) {
            const ByteImage bytes =
                read_byte_image(capture / "truth" / "images" / cameras[camera].id /
                                (frame_name(frame_id) + ".png"));
            Image picture(bytes.width, bytes.height, 3);
            for (std::size_t i = 0; i < picture.data.size(); ++i) {
              picture.data[i] = static_cast<float>(bytes.data[i]) / 255;
            }
            return picture;
          }};
}

/// Which garment of the truth one of a workspace is; as many as there are if none.
std::size_t same_garment(const WornSubject& in_truth, int label) {
  const auto found =
      std::find(in_truth.labels.begin() + static_cast<std::ptrdiff_t>(in_truth.first_garment),
                in_truth.labels.end(), label);
  return static_cast<std::size_t>(found - in_truth.labels.begin());
}

/// The same of a simulated motion. Templates ride on the true garments' triangles, each vertex on
/// the material point that it was nearest to in the template's frame: the network is judged, not
/// a simulation of the template.
/// @param registered  the result that has the templates; "": the true garments themselves
Scenes simulated_scenes(const SimulatedMotion& motion, const WornSubject& in_truth,
                        const WornSubject& worn, const fs::path& registered,
                        const CaptureTruth& truth) {
  Scenes scenes{in_truth, in_truth, {}, {}};
  for (const TruthFrame& frame : motion.frames) {
    scenes.frame_ids.push_back(frame.frame_id);
  }
  scenes.picture = [&motion](std::size_t camera, int frame_id) {
    Image picture = motion.pictures[static_cast<std::size_t>(frame_id)][camera];
    std::transform(picture.data.begin(), picture.data.end(), picture.data.begin(), stored);
    return picture;
  };
  const auto load = [&motion, &truth](int frame_id) {
    return surfaces_of(motion.frames[static_cast<std::size_t>(frame_id)], truth);
  };
  scenes.truth.subject.load = load;
  scenes.own.subject.load = load;
  if (registered.empty()) {
    return scenes;
  }
  struct Rider {
    std::size_t garment;  // of the truth
    TrueBinding binding;
  };
  scenes.own = worn;
  scenes.own.subject.faces[0] = in_truth.subject.faces[0];
  std::vector<std::optional<Rider>> riders;
  for (std::size_t s = worn.first_garment; s < worn.templates.size(); ++s) {
    const std::size_t garment = same_garment(in_truth, worn.labels[s]);
    if (garment == in_truth.labels.size()) {
      riders.emplace_back();
      continue;
    }
    const std::string& name = worn.subject.names[s];
    const Points there =
        in_truth.subject.load(registered_template_frame(registered, name))[garment];
    const Mesh shape = read_mesh_archive(registered / "registered" / name / "template.h5");
    riders.push_back(
        Rider{garment, bind_to_truth(shape.vertices, there, in_truth.subject.faces[garment])});
  }
  scenes.own.subject.load = [load, riders, faces = in_truth.subject.faces](int frame_id) {
    const std::vector<Points> surfaces = load(frame_id);
    std::vector<Points> own = {surfaces[0]};
    for (const std::optional<Rider>& rider : riders) {
      own.push_back(
          rider ? bound_points(rider->binding, surfaces[rider->garment], faces[rider->garment])
                : Points(0, 3));
    }
    return own;
  };
  return scenes;
}

constexpr std::size_t kBody = 0;  // of every WornSubject

/// Who looks: those that are judged, and all of the capture.
struct Lookers {
  const std::vector<Camera>& judged;
  const std::vector<Camera>& all;
};

fs::path network_of(const fs::path& result, const WornSubject& worn, std::size_t which) {
  return result / worn.subject.names[which] / "model.safetensors";
}

/// Draws one surface of some frames by its network and compares it with a true one.
/// @return texels a side of the network
int compare_surface(Compared& sum, const fs::path& file, const Scenes& scenes, std::size_t own,
                    std::size_t in_truth, const Lookers& lookers) {
  const WornSubject& truth = scenes.truth;
  const WornSubject& worn = scenes.own;
  const Safetensors found = read_safetensors(file);
  const AppearanceModel model = appearance_model_of(found.tensors, found.metadata, file.string());
  if (model.faces != worn.templates[own].faces) {
    throw DataError(file.string(), "", "a network of a surface with other triangles",
                    "networks of the capture that --truth names");
  }
  const std::vector<Camera>& cameras = lookers.judged;
  Drawn drawn;
  DrawnSurface surface;
  surface.fewest_pixels = own == kBody ? 0 : surface.fewest_pixels;  // clothes may hide it all
  surface.which = in_truth;
  surface.atlas = pack_atlas(truth.templates[in_truth]);
  drawn.truth = prepare_appearance(truth.subject, surface, cameras, scenes.frame_ids);
  surface.which = own;
  surface.atlas = {model.uvs, model.uv_faces, {}};
  surface.trusted_only = false;
  drawn.own = prepare_appearance(worn.subject, surface, cameras, scenes.frame_ids);
  if (drawn.truth.views.empty() || drawn.own.views.empty()) {
    return model.options.resolution;
  }
  const TemporaryFolder between;
  write_archive(between.path / "data.h5", archive_of(drawn.own));
  const fs::path colors = between.path / "colors.h5";
  run_child_program(
      "atelier-appearance",
      {"predict", file.string(), (between.path / "data.h5").string(), colors.string()},
      "it is built where libtorch is (libtorch-dev)", [](const std::string&) {},
      [] { return false; });
  std::int64_t pixels = 0;
  for (const AppearanceView& view : drawn.own.views) {
    pixels += static_cast<std::int64_t>(view.pixel.size());
  }
  drawn.colors = appearance_colors_of(read_archive(colors, "atelier.appearance_colors", 1), pixels,
                                      colors.string());
  compare(sum, drawn, gains_of(cameras, lookers.all, model.camera_ids), scenes.picture);
  return model.options.resolution;
}

/// All garments of some frames.
Compared compare_garments(const fs::path& result, const Scenes& scenes, bool own_is_truth,
                          const Lookers& lookers, int& resolution) {
  const WornSubject& worn = scenes.own;
  Compared compared;
  for (std::size_t s = worn.first_garment; s < worn.templates.size(); ++s) {
    const std::size_t g = own_is_truth ? s : same_garment(scenes.truth, worn.labels[s]);
    if (g < scenes.truth.templates.size()) {
      resolution = compare_surface(compared, network_of(result, worn, s), scenes, s, g, lookers);
    }
  }
  return compared;
}

/// What results are judged by, read and simulated once for all of them.
struct Judging {
  fs::path capture;
  CaptureInfo info;
  std::shared_ptr<const CaptureTruth> truth;
  std::vector<Camera> cameras;  ///< that are held out
  std::optional<SimulatedMotion> motion;
};

std::optional<Judged> judge(const fs::path& workspace, const std::string& stage,
                            const Judging& by) {
  const auto current = current_name(workspace / stage);
  if (!current) {
    return std::nullopt;
  }
  const bool own_is_truth = stage == "ceiling";
  const fs::path result = workspace / stage / *current;
  const Manifest manifest = read_manifest(result, stage);
  const fs::path registered =
      own_is_truth ? fs::path() : input_of(workspace, manifest, "registered");
  const WornSubject in_truth = worn_in_truth(by.capture, by.truth);
  const WornSubject worn =
      own_is_truth ? in_truth
                   : worn_in_workspace(registered, input_of(workspace, manifest, "bodies"));
  Judged judged;
  judged.setting = setting_of(manifest);
  const auto iterations = manifest.metrics.find("iterations");
  judged.iterations =
      iterations == manifest.metrics.end() ? 0 : static_cast<int>(iterations->second);
  const Lookers lookers{by.cameras, by.truth->cameras};
  const auto compared = [&](const Scenes& scenes) {
    return compare_garments(result, scenes, own_is_truth, lookers, judged.resolution);
  };
  const Scenes held_out =
      held_out_scenes(in_truth, worn, by.cameras, by.info.held_out_frames, by.capture);
  judged.compared = compared(held_out);
  if (const fs::path file = network_of(result, worn, kBody); fs::exists(file)) {
    compare_surface(judged.body, file, held_out, kBody, kBody, lookers);
  }
  if (by.motion) {
    judged.simulated =
        compared(simulated_scenes(*by.motion, in_truth, worn, registered, *by.truth));
  }
  return judged.compared.covered > 0 ? std::optional(judged) : std::nullopt;
}

void add_measures(std::vector<Measure>& all, const std::string& stage, const Judged& judged,
                  bool printed, const std::string& motion) {
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
  add("gain_db", reached - still, "dB", small ? 2.0 : 4.0, Side::AtLeast,
      std::string("over that texture") +
          (small ? "; of the setting standard 4 dB are wanted, of small 2" : ""));
  add("shadow_psnr_db", psnr(drawn.shadow_squares, drawn.shadow_count), "dB", reached - 1,
      Side::AtLeast, "of the quarter of these pixels that sees least of its sky");
  if (drawn.shadow_count > 0) {
    add("shadow_ssim", 3 * drawn.shadow_similarity / drawn.shadow_count, "", 0, Side::None,
        "structural similarity of that quarter");
  }
  add("ssim", drawn.similarity / judged.compared.covered, "", 0, Side::None,
      "structural similarity of these pixels");
  add("static_ssim", fixed.similarity / judged.compared.covered, "", 0, Side::None,
      "of the texture that does not change");
  add("covered", judged.compared.covered / judged.compared.judged, "", 0, Side::None,
      "of the true garments' eroded pixels, drawn by a network");
  add("pixels", judged.compared.covered, "", 0, Side::None, "that were compared");
  if (const Difference& body = judged.body.drawn; body.count > 0) {
    const Difference& still_body = judged.body.fixed;
    add("body_psnr_db", psnr(body.squares, body.count), "dB", 0, Side::None,
        "eroded pixels in which the true body is in front, same cameras and frames");
    add("body_static_psnr_db", psnr(still_body.squares, still_body.count), "dB", 0, Side::None,
        "of the best texture of the body that does not change");
    add("body_covered", judged.body.covered / judged.body.judged, "", 0, Side::None,
        "of the true body's eroded pixels, drawn by its network");
  }
  if (const Difference& simulated = judged.simulated.drawn; simulated.count > 0) {
    add("simulated_psnr_db", psnr(simulated.squares, simulated.count), "dB", 28,
        small ? Side::None : Side::AtLeast,
        "held-out cameras, a simulated motion that the capture does not show: " + motion);
    const Difference& still_simulated = judged.simulated.fixed;
    add("simulated_static_psnr_db", psnr(still_simulated.squares, still_simulated.count), "dB", 0,
        Side::None, "of the texture that does not change, there");
  }
}

}  // namespace

std::vector<Measure> measure_appearance(const fs::path& workspace, const fs::path& capture) {
  std::vector<Measure> all;
  if (!current_name(workspace / "ceiling") && !current_name(workspace / "appearance")) {
    return all;
  }
  Judging by{capture, read_capture_info(capture), nullptr, {}, {}};
  by.truth = std::make_shared<const CaptureTruth>(read_capture_truth(capture));
  for (const Camera& camera : by.truth->cameras) {
    if (std::count(by.info.held_out_cameras.begin(), by.info.held_out_cameras.end(), camera.id) >
        0) {
      by.cameras.push_back(camera);
    }
  }
  if (by.cameras.empty() || by.info.held_out_frames.empty()) {
    return all;
  }
  by.motion = simulate_motion(capture, *by.truth, by.cameras);
  const auto ceiling = judge(workspace, "ceiling", by);
  const auto reached = judge(workspace, "appearance", by);
  const auto options = synthesis_options_of(capture);
  const bool printed = options && options->fabric.kind == FabricKind::Print;
  const std::string motion = by.motion ? by.motion->motion : "";
  if (reached) {
    add_measures(all, "appearance", *reached, printed, motion);
  }
  if (ceiling) {
    add_measures(all, "ceiling", *ceiling, printed, motion);
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
