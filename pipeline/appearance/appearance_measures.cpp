#include "pipeline/appearance/appearance_measures.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>

#include "appearance/appearance_model.h"
#include "appearance/learnt_occlusion.h"
#include "appearance/psnr.h"
#include "appearance/train_options.h"
#include "capture/capture_info.h"
#include "capture/garment_fabric.h"
#include "core/archive.h"
#include "core/error.h"
#include "core/io/child_program.h"
#include "core/io/image_file.h"
#include "core/io/safetensors.h"
#include "core/io/temporary_folder.h"
#include "core/saturating_cast.h"
#include "core/sequence_archive.h"
#include "core/store/result.h"
#include "pipeline/appearance/appearance_judgement.h"
#include "pipeline/garment/register_measures.h"
#include "pipeline/synthesis/synthesis.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

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

/// Options that a result's networks were trained with; nothing is left to setting and device.
TrainOptions trained_with(const Manifest& manifest) {
  TrainOptions options;
  OptionTable table = describe(options);
  for (const ManifestOption& option : manifest.options) {
    const bool quoted = option.json.size() > 1 && option.json.front() == '"';
    // Names that are none of a training's change nothing.
    set_option(table, option.name,
               quoted ? option.json.substr(1, option.json.size() - 2) : option.json);
  }
  return resolved(options, manifest.device == "cuda" ? Device::Cuda : Device::Cpu);
}

std::string setting_of(const Manifest& manifest) {
  TrainOptions options = trained_with(manifest);
  return option_text(describe(options).fields.front());
}

/// The first option in which two results were not trained and prepared alike; "" if in none.
std::string unlike_option(const Manifest& one, const Manifest& other) {
  TrainOptions options = trained_with(one);
  TrainOptions others = trained_with(other);
  const OptionTable table = describe(options);
  const OptionTable other_table = describe(others);
  for (std::size_t i = 1; i < table.fields.size(); ++i) {  // the setting says nothing by itself
    const OptionField& field = table.fields[i];
    const std::string there = option_text(other_table.fields[i]);
    if (field.keyed && option_text(field) != there) {
      return field.name + " " + option_text(field) + " and " + there;
    }
  }
  for (const ManifestOption& option : one.options) {
    const bool of_pixels =
        option.name.starts_with("occlusion.") || option.name.starts_with("visible.");
    const auto there =
        std::find_if(other.options.begin(), other.options.end(),
                     [&](const ManifestOption& two) { return two.name == option.name; });
    if (of_pixels && there != other.options.end() && there->json != option.json) {
      return option.name + " " + option.json + " and " + there->json;
    }
  }
  return "";
}

/// Frames of the capture that nothing was learnt from.
JudgedScenes held_out_scenes(const WornSubject& in_truth, const WornSubject& worn,
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

constexpr std::size_t kBody = 0;  // of every WornSubject

/// Who looks: those that are judged, and all of the capture.
struct Lookers {
  const std::vector<Camera>& judged;
  const std::vector<Camera>& all;
};

/// Which of a capture's garments are printed. Without its options none is known to be.
std::vector<bool> printed_garments(const fs::path& capture, const GroundTruth& truth) {
  std::vector<bool> printed(truth.garments.size());
  if (const auto options = synthesis_options_of(capture)) {
    for (std::size_t g = 0; g < printed.size(); ++g) {
      printed[g] = garment_fabric(options->fabric, truth.garments, g).kind == FabricKind::Print;
    }
  }
  return printed;
}

fs::path network_of(const fs::path& result, const WornSubject& worn, std::size_t which) {
  return result / worn.subject.names[which] / "model.safetensors";
}

/// Draws one surface of some frames by its network and compares it with a true one.
/// @return texels a side of the network
int compare_surface(ComparedPictures& sum, const fs::path& file, const JudgedScenes& scenes,
                    std::size_t own, std::size_t in_truth, const Lookers& lookers) {
  const Safetensors found = read_safetensors(file);
  const AppearanceModel model = appearance_model_of(found.tensors, found.metadata, file.string());
  if (model.faces != scenes.own.templates[own].faces) {
    throw DataError(file.string(), "", "a network of a surface with other triangles",
                    "networks of the capture that --ground-truth names");
  }
  const std::vector<Camera>& cameras = lookers.judged;
  DrawnSurfaces drawn = asked_of(scenes, own, in_truth, cameras, {model.uvs, model.uv_faces, {}},
                                 drawn_occlusion(kOpenOcclusion, {{model.name, model.occlusion}}));
  if (drawn.truth.views.empty() || drawn.own.views.empty()) {
    return model.options.resolution;
  }
  const TemporaryFolder between;
  write_archive(between.path / "data.h5", archive_of(drawn.own));
  const fs::path colors = between.path / "colors.h5";
  run_child_program(
      "atelier-appearance",
      {"predict", file.string(), (between.path / "data.h5").string(), colors.string()},
      "a build with libtorch (libtorch-dev)", [](const std::string&) {}, [] { return false; });
  std::int64_t pixels = 0;
  for (const AppearanceView& view : drawn.own.views) {
    pixels += static_cast<std::int64_t>(view.pixel.size());
  }
  drawn.colors = appearance_colors_of(read_archive(colors, "atelier.appearance_colors", 1), pixels,
                                      colors.string());
  compare_pictures(sum, drawn, gains_of(cameras, lookers.all, model.camera_ids), scenes.picture);
  return model.options.resolution;
}

/// All garments of some frames.
std::vector<JudgedGarment> compare_garments(const fs::path& result, const JudgedScenes& scenes,
                                            bool own_is_truth, const Lookers& lookers,
                                            const std::vector<bool>& printed, int& resolution) {
  const WornSubject& worn = scenes.own;
  std::vector<JudgedGarment> garments;
  for (std::size_t s = worn.first_garment; s < worn.templates.size(); ++s) {
    const std::size_t g = own_is_truth ? s : same_garment(scenes.truth, worn.labels[s]);
    if (g < scenes.truth.templates.size()) {
      JudgedGarment& garment = garments.emplace_back();
      garment.name = worn.subject.names[s];
      garment.printed = printed[g - scenes.truth.first_garment];
      resolution =
          compare_surface(garment.compared, network_of(result, worn, s), scenes, s, g, lookers);
    }
  }
  return garments;
}

/// Templates of a workspace on the ground-truth garments that they are of.
std::vector<TemplateRider> riders_of(const WornSubject& worn, const fs::path& registered,
                                     const WornSubject& in_truth) {
  std::vector<TemplateRider> riders;
  for (std::size_t s = worn.first_garment; s < worn.templates.size(); ++s) {
    const std::size_t garment = same_garment(in_truth, worn.labels[s]);
    if (garment == in_truth.labels.size()) {
      continue;
    }
    const std::string& name = worn.subject.names[s];
    const Points there =
        in_truth.subject.load(registered_template_frame(registered, name))[garment];
    const Mesh shape = read_mesh_archive(registered / "registered" / name / "template.h5");
    riders.push_back(
        {s, garment, bind_to_truth(shape.vertices, there, in_truth.subject.faces[garment])});
  }
  return riders;
}

/// Everything that a result is judged by.
struct Judging {
  fs::path capture;
  CaptureInfo info;
  std::shared_ptr<const GroundTruth> truth;
  std::vector<Camera> cameras;  ///< that are held out
  std::optional<SimulatedMotion> motion;
};

std::optional<JudgedNetworks> judge(const fs::path& workspace, const std::string& stage,
                                    const Judging& by) {
  const fs::path results = results_of_stage(workspace, stage);
  const auto current = current_name(results);
  if (!current) {
    return std::nullopt;
  }
  const bool own_is_truth = stage == "oracle";
  const fs::path result = results / *current;
  const Manifest manifest = read_manifest(result, stage);
  const fs::path registered =
      own_is_truth ? fs::path() : input_of(workspace, manifest, "registered");
  const WornSubject in_truth = worn_in_truth(by.capture, by.truth);
  const WornSubject worn =
      own_is_truth ? in_truth
                   : worn_in_workspace(registered, input_of(workspace, manifest, "bodies"));
  JudgedNetworks judged;
  judged.setting = setting_of(manifest);
  const auto iterations = manifest.metrics.find("iterations");
  judged.iterations =
      iterations == manifest.metrics.end() ? 0 : saturating_cast<int>(iterations->second);
  const Lookers lookers{by.cameras, by.truth->cameras};
  const auto compared = [&](const JudgedScenes& scenes) {
    return compare_garments(result, scenes, own_is_truth, lookers,
                            printed_garments(by.capture, *by.truth), judged.resolution);
  };
  const JudgedScenes held_out =
      held_out_scenes(in_truth, worn, by.cameras, by.info.held_out_frames, by.capture);
  judged.garments = compared(held_out);
  if (const fs::path file = network_of(result, worn, kBody); fs::exists(file)) {
    compare_surface(judged.body, file, held_out, kBody, kBody, lookers);
  }
  if (by.motion) {
    const auto simulated =
        compared(own_is_truth ? simulated_scenes(*by.motion, *by.truth, in_truth, nullptr, {})
                              : simulated_scenes(*by.motion, *by.truth, in_truth, &worn,
                                                 riders_of(worn, registered, in_truth)));
    for (const JudgedGarment& garment : simulated) {
      judged.simulated += garment.compared;
    }
  }
  // Of what nothing is seen, or drawn, there are no figures.
  std::erase_if(judged.garments,
                [](const JudgedGarment& garment) { return garment.compared.covered == 0; });
  return judged.garments.empty() ? std::nullopt : std::optional(judged);
}

/// The figures of the result of one of the two stages.
std::vector<Measure> measure_networks(const fs::path& workspace, const fs::path& capture,
                                      const std::string& stage) {
  if (!current_name(results_of_stage(workspace, stage))) {
    return {};
  }
  Judging by{capture, read_capture_info(capture), nullptr, {}, {}};
  by.truth = std::make_shared<const GroundTruth>(read_ground_truth(capture));
  for (const Camera& camera : by.truth->cameras) {
    if (std::count(by.info.held_out_cameras.begin(), by.info.held_out_cameras.end(), camera.id) >
        0) {
      by.cameras.push_back(camera);
    }
  }
  if (by.cameras.empty() || by.info.held_out_frames.empty()) {
    return {};
  }
  by.motion = simulate_motion(capture, *by.truth, by.cameras);
  const auto judged = judge(workspace, stage, by);
  if (!judged) {
    return {};
  }
  return measures_of(stage, *judged, by.motion ? by.motion->motion : "");
}

}  // namespace

std::vector<Measure> measure_oracle(const fs::path& workspace, const fs::path& capture) {
  return measure_networks(workspace, capture, "oracle");
}

std::vector<Measure> measure_appearance(const fs::path& workspace, const fs::path& capture) {
  return measure_networks(workspace, capture, "appearance");
}

std::optional<Measure> below_oracle(const fs::path& workspace, std::span<const Measure> measures) {
  const auto find = [&](const char* key) {
    return std::find_if(measures.begin(), measures.end(),
                        [&](const Measure& one) { return one.key == key; });
  };
  const auto oracle = find("oracle.psnr_db");
  const auto reached = find("appearance.psnr_db");
  if (oracle == measures.end() || reached == measures.end()) {
    return std::nullopt;
  }
  const auto manifest = [&](const std::string& stage) {
    const fs::path results = results_of_stage(workspace, stage);
    return read_manifest(results / current_name(results).value(), stage);
  };
  const std::string unlike = unlike_option(manifest("appearance"), manifest("oracle"));
  Measure below{"appearance.below_oracle_db",
                oracle->value - reached->value,
                "dB",
                2,
                Measure::Side::AtMost,
                "below the same network on ground-truth geometry"};
  if (!unlike.empty()) {
    below.side = Measure::Side::None;
    below.note = "below another network on ground-truth geometry: " + unlike;
  }
  return below;
}

}  // namespace atelier
