#include "pipeline/appearance/appearance_judgement.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "appearance/picture_similarity.h"
#include "appearance/psnr.h"
#include "core/io/srgb.h"

namespace atelier {
namespace {

/// As an 8-bit image holds it, in [0,1].
float stored(double linear) {
  return std::round(255.0F * srgb_from_linear(static_cast<float>(linear))) / 255.0F;
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

void compare_view(ComparedPictures& sum, const AppearanceView& truth_view,
                  const std::vector<float>& open, float quarter, const Image& wanted,
                  const Image& drawn, const Image& fixed, const ByteImage& is_drawn) {
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
      const auto add = [&](PictureDifference& difference, const Image& picture) {
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

PictureDifference& operator+=(PictureDifference& sum, const PictureDifference& more) {
  sum.squares += more.squares;
  sum.count += more.count;
  sum.shadow_squares += more.shadow_squares;
  sum.shadow_count += more.shadow_count;
  sum.similarity += more.similarity;
  sum.shadow_similarity += more.shadow_similarity;
  return sum;
}

double decibels_of(const PictureDifference& difference) {
  return psnr_of(difference.squares / difference.count);
}

double psnr_target(bool printed) {
  return printed ? 30 : 34;
}

}  // namespace

ComparedPictures& operator+=(ComparedPictures& sum, const ComparedPictures& more) {
  sum.drawn += more.drawn;
  sum.fixed += more.fixed;
  sum.judged += more.judged;
  sum.covered += more.covered;
  return sum;
}

DrawnSurfaces asked_of(const JudgedScenes& scenes, std::size_t own, std::size_t in_truth,
                       const std::vector<Camera>& cameras, const PackedAtlas& atlas,
                       const OcclusionOptions& occlusion) {
  DrawnSurfaces drawn;
  DrawnSurface surface;
  surface.fewest_pixels = own == 0 ? 0 : surface.fewest_pixels;  // clothes may hide all of a body
  surface.which = in_truth;
  surface.atlas = pack_atlas(scenes.truth.templates[in_truth]);
  drawn.truth = prepare_appearance(scenes.truth.subject, surface, {cameras, scenes.frame_ids});
  surface.which = own;
  surface.atlas = atlas;
  surface.trusted_only = false;
  PrepareAppearanceOptions as_learnt;
  as_learnt.occlusion = occlusion;
  drawn.own =
      prepare_appearance(scenes.own.subject, surface, {cameras, scenes.frame_ids}, as_learnt);
  return drawn;
}

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

void compare_pictures(ComparedPictures& sum, const DrawnSurfaces& surface,
                      const std::vector<Eigen::Vector3d>& gains, const TruePicture& picture) {
  const std::vector<float>& drawn_colors = surface.colors.drawn;
  const std::vector<float>& fixed_colors = surface.colors.fixed;
  const AppearanceData& truth = surface.truth;
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
  for (const AppearanceView& view : surface.own.views) {
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

std::size_t same_garment(const WornSubject& in_truth, int label) {
  const auto found =
      std::find(in_truth.labels.begin() + static_cast<std::ptrdiff_t>(in_truth.first_garment),
                in_truth.labels.end(), label);
  return static_cast<std::size_t>(found - in_truth.labels.begin());
}

JudgedScenes simulated_scenes(const SimulatedMotion& motion, const GroundTruth& truth,
                              const WornSubject& in_truth, const WornSubject* worn,
                              const std::vector<TemplateRider>& riders) {
  JudgedScenes scenes{in_truth, in_truth, {}, {}};
  for (const GroundTruthFrame& frame : motion.frames) {
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
  if (worn == nullptr) {
    return scenes;
  }
  scenes.own = *worn;
  scenes.own.subject.faces[0] = in_truth.subject.faces[0];
  scenes.own.subject.load = [load, riders, count = worn->templates.size(),
                             faces = in_truth.subject.faces](int frame_id) {
    const std::vector<Points> surfaces = load(frame_id);
    std::vector<Points> own(count, Points(0, 3));
    own[0] = surfaces[0];
    for (const TemplateRider& rider : riders) {
      own[rider.own] = bound_points(rider.binding, surfaces[rider.garment], faces[rider.garment]);
    }
    return own;
  };
  return scenes;
}

std::vector<Measure> measures_of(const std::string& stage, const JudgedNetworks& judged,
                                 const std::string& motion) {
  std::vector<Measure> all;
  using Side = Measure::Side;
  ComparedPictures compared;
  bool printed = true;
  for (const JudgedGarment& garment : judged.garments) {
    compared += garment.compared;
    printed = printed && garment.printed;
  }
  const PictureDifference& drawn = compared.drawn;
  const PictureDifference& fixed = compared.fixed;
  const std::string setting = judged.setting + ": " + std::to_string(judged.resolution) +
                              " texels, " + std::to_string(judged.iterations) + " steps";
  const double reached = decibels_of(drawn);
  const double still = decibels_of(fixed);
  const bool small = judged.resolution < 512;
  const auto add = [&](const std::string& key, double value, const char* unit, double target,
                       Side side, const std::string& note) {
    all.push_back({stage + "." + key, value, unit, target, side, note});
  };
  add("psnr_db", reached, "dB", psnr_target(printed), small ? Side::None : Side::AtLeast,
      "eroded garment pixels, held-out cameras x held-out frames; " + setting);
  if (judged.garments.size() > 1) {
    for (const JudgedGarment& garment : judged.garments) {
      add(garment.name + "_psnr_db", decibels_of(garment.compared.drawn), "dB",
          psnr_target(garment.printed), small ? Side::None : Side::AtLeast,
          std::string("of this garment alone, ") + (garment.printed ? "printed" : "not printed"));
    }
  }
  add("static_psnr_db", still, "dB", 0, Side::None, "of the best static texture");
  add("gain_db", reached - still, "dB", small ? 2.0 : 4.0, Side::AtLeast,
      std::string("over that texture") +
          (small ? "; the target is 4 dB for the setting standard, 2 for small" : ""));
  if (drawn.shadow_count > 0) {
    add("shadow_psnr_db", psnr_of(drawn.shadow_squares / drawn.shadow_count), "dB", reached - 1,
        Side::AtLeast, "of the quarter of these pixels with the least ambient visibility");
    add("shadow_ssim", 3 * drawn.shadow_similarity / drawn.shadow_count, "", 0, Side::None,
        "structural similarity of that quarter");
  }
  add("ssim", drawn.similarity / compared.covered, "", 0, Side::None,
      "structural similarity of these pixels");
  add("static_ssim", fixed.similarity / compared.covered, "", 0, Side::None,
      "of the static texture");
  add("covered", compared.covered / compared.judged, "", 0.95, Side::AtLeast,
      "of the ground-truth garments' eroded pixels, rendered by a network; the others are not "
      "evaluated");
  add("pixels", compared.covered, "", 0, Side::None, "that were compared");
  if (const PictureDifference& body = judged.body.drawn; body.count > 0) {
    const PictureDifference& still_body = judged.body.fixed;
    add("body_psnr_db", decibels_of(body), "dB", 0, Side::None,
        "eroded pixels in which the ground-truth body is in front, same cameras and frames");
    add("body_static_psnr_db", decibels_of(still_body), "dB", 0, Side::None,
        "of the best static texture of the body");
    add("body_covered", judged.body.covered / judged.body.judged, "", 0, Side::None,
        "of the ground-truth body's eroded pixels, rendered by its network");
  }
  if (const PictureDifference& simulated = judged.simulated.drawn; simulated.count > 0) {
    add("simulated_psnr_db", decibels_of(simulated), "dB", 28, small ? Side::None : Side::AtLeast,
        "held-out cameras, a simulated motion that the capture does not show: " + motion);
    const PictureDifference& still_simulated = judged.simulated.fixed;
    add("simulated_static_psnr_db", decibels_of(still_simulated), "dB", 0, Side::None,
        "of the static texture, there");
  }
  return all;
}

}  // namespace atelier
