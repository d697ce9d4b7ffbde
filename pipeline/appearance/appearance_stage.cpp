#include "pipeline/appearance/appearance_stage.h"

#include <algorithm>
#include <cstdio>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "appearance/static_fit.h"
#include "capture/capture_info.h"
#include "capture/frame_reader.h"
#include "capture/layouts/open_dataset.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/file_kind.h"
#include "core/io/image_file.h"
#include "core/three_channels.h"
#include "core/usage_error.h"
#include "pipeline/appearance/tell_contradictions.h"
#include "pipeline/appearance/train_network.h"
#include "pipeline/outfit/worn_subject.h"
#include "pipeline/pictures/taken_and_drawn.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// Cameras and frames that a training may see: none that is held out.
struct Seen {
  std::vector<Camera> cameras;
  std::vector<Index> camera_idx;  // of the data set
  std::vector<int> clothed;       // frames
  std::vector<int> all;           // with the minimally clothed ones
};

Seen what_training_sees(const Dataset& dataset, const fs::path& capture) {
  const std::set<std::string> held_cameras(dataset.info.held_out_cameras.begin(),
                                           dataset.info.held_out_cameras.end());
  const std::set<int> held_frames(dataset.info.held_out_frames.begin(),
                                  dataset.info.held_out_frames.end());
  Seen seen;
  for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
    if (!held_cameras.contains(dataset.cameras[c].id)) {
      seen.cameras.push_back(dataset.cameras[c]);
      seen.camera_idx.push_back(static_cast<Index>(c));
    }
  }
  for (const CaptureSequence& sequence : dataset.info.sequences) {
    for (const int frame_id : sequence.frame_ids) {
      if (!held_frames.contains(frame_id)) {
        seen.all.push_back(frame_id);
        if (sequence.kind != "minimal") {
          seen.clothed.push_back(frame_id);
        }
      }
    }
  }
  std::sort(seen.clothed.begin(), seen.clothed.end());
  std::sort(seen.all.begin(), seen.all.end());
  if (seen.cameras.empty() || seen.clothed.empty()) {
    throw DataError(capture.string(), "cameras and frames", "none that is not held out",
                    "a clothed sequence that cameras took");
  }
  return seen;
}

/// Says which cameras have no image of some frames: a training on fewer looks like any other.
void tell_missing(StageRun& run, const Dataset& dataset, const Seen& seen) {
  for (std::size_t c = 0; c < seen.cameras.size(); ++c) {
    const auto& images = dataset.frames[static_cast<std::size_t>(seen.camera_idx[c])].images;
    const auto missing = std::count_if(seen.clothed.begin(), seen.clothed.end(),
                                       [&](int frame_id) { return !images.contains(frame_id); });
    if (missing > 0) {
      run.warn("camera " + seen.cameras[c].id + " has no image of " + std::to_string(missing) +
               " of " + std::to_string(seen.clothed.size()) +
               " frames; they are not used for training");
    }
  }
}

/// Warns of cameras whose label images do not have the garment where the geometry has it.
void tell_strange_labels(StageRun& run, const AppearanceData& data,
                         const std::vector<LabelAgreement>& agreement) {
  constexpr double kShare = 0.8;  // of what is registered as it should be labels have 0.95 and more
  for (std::size_t c = 0; c < agreement.size(); ++c) {
    const auto [judged, agreed] = agreement[c];
    if (static_cast<double>(agreed) < kShare * static_cast<double>(judged)) {
      char text[260];
      std::snprintf(
          text, sizeof(text),
          "%s: label images of camera %s have the garment in only %.0f%% of the pixels where its "
          "registered surface lies; check that they are of this camera, and the garment of "
          "'register' in the report",
          data.name.c_str(), data.camera_ids[c].c_str(),
          100 * static_cast<double>(agreed) / static_cast<double>(judged));
      run.warn(text);
    }
  }
}

/// Label images tell whether images and geometry belong together; this does where there are none.
/// Throws DataError where most cameras contradict the geometry, warns of single ones.
void judge_pictures(StageRun& run, const AppearanceData& data) {
  const StaticFit fit = static_fit(data, judged_texels(data));
  if (max_contradict(fit)) {
    char found[120];
    std::snprintf(found, sizeof(found), "no texture explains them: the best one reaches %.1f dB",
                  fit.psnr);
    throw DataError("", "images of " + data.name, found,
                    "images, calibration and geometry of one capture");
  }
  tell_contradictions(run, data, fit);
}

/// Those of some frames in which a surface is worn.
std::vector<int> frames_of(const WornSubject& worn, std::size_t which,
                           const std::vector<int>& candidates) {
  std::vector<int> frames;
  for (const int frame_id : candidates) {
    if (worn.subject.load(frame_id)[which].rows() > 0) {
      frames.push_back(frame_id);
    }
  }
  return frames;
}

/// pictures.png: three images of the training, each as it was taken and as it is drawn. False if
/// the run was told to stop.
bool show(StageRun& run, const WornSubject& worn, const Seen& seen, const ReadPicture& picture,
          const std::map<std::size_t, std::string>& models) {
  constexpr std::size_t kShown = 3;
  std::vector<TakenView> views;
  std::set<std::pair<std::size_t, int>> shown;
  for (std::size_t i = 0; i < kShown; ++i) {
    const std::size_t camera = i * seen.cameras.size() / kShown;
    const int frame_id = seen.clothed[i * (seen.clothed.size() - 1) / (kShown - 1)];
    if (!shown.insert({camera, frame_id}).second) {
      continue;  // fewer than three images are there
    }
    const TakenPicture one = picture(camera, frame_id);
    if (!one.colors.data.empty()) {
      views.push_back({seen.cameras[camera], frame_id, linear_from_srgb(one.colors)});
    }
  }
  if (views.empty()) {
    return true;
  }
  const std::optional<Image> sheet =
      taken_and_drawn(worn, models, views, run.device(), [&] { return run.stop_requested(); });
  if (sheet) {
    run.output_text("pictures.png", image_bytes(*sheet, ImageFormat::Png));
  }
  return sheet.has_value();
}

/// Data that an interrupted run of the same request had prepared whole; nothing else is there.
std::optional<AppearanceData> prepared_before(const fs::path& file) {
  if (file_kind(file) == fs::file_type::not_found) {
    return std::nullopt;
  }
  try {
    return read_appearance_data(file);
  } catch (const DataError&) {  // damaged meanwhile: prepared again
    return std::nullopt;
  }
}

void learn(StageRun& run, const Dataset& dataset, const WornSubject& worn) {
  const auto& options = run.options<AppearanceStageOptions>();
  const TrainOptions known = resolved(options.train, run.device());
  const Seen seen = what_training_sees(dataset, run.input("capture"));
  tell_missing(run, dataset, seen);
  FrameReader reader(dataset);
  const NetworkOptions network = network_options(known);
  const ReadPicture picture = [&](std::size_t camera, int frame_id) {
    const Index idx = seen.camera_idx[camera];
    const ByteImage mask = reader.mask(idx, frame_id).value_or(ByteImage());
    if (!mask.data.empty() && std::none_of(mask.data.begin(), mask.data.end(),
                                           [](std::uint8_t pixel) { return pixel != 0; })) {
      return TakenPicture{};  // nobody is in it: what the geometry has there is background
    }
    return TakenPicture{in_three_channels(reader.byte_image(idx, frame_id).value_or(ByteImage())),
                        reader.labels(idx, frame_id).value_or(ByteImage())};
  };
  double views = 0;
  double pixels = 0;
  double psnr = 0;
  double known_ends = 0;
  double seconds = 0;
  double steps = 0;
  std::map<std::size_t, std::string> models;
  std::vector<std::size_t> drawn;
  for (std::size_t s = worn.first_garment; s < worn.templates.size(); ++s) {
    drawn.push_back(s);
  }
  if (options.body) {
    drawn.push_back(0);
  }
  for (const std::size_t which : drawn) {
    const std::string& name = worn.subject.names[which];
    const std::vector<int> frames =
        frames_of(worn, which, which < worn.first_garment ? seen.all : seen.clothed);
    run.say(name + ": " + std::to_string(frames.size()) + " frames of " +
            std::to_string(seen.cameras.size()) + " cameras");
    DrawnSurface surface;
    surface.which = which;
    surface.label = worn.labels[which];
    surface.atlas = pack_atlas(worn.templates[which], {.resolution = network.resolution});
    const fs::path scratch = run.scratch_folder() / name;
    make_private_directory(scratch);
    const fs::path data_file = scratch / "data.h5";
    std::optional<AppearanceData> prepared = prepared_before(data_file);
    if (prepared) {
      run.say(name + ": continuing with the data prepared before");
    } else {
      std::vector<LabelAgreement> agreement;
      const AppearanceData fresh =
          prepare_appearance(worn.subject, surface, {seen.cameras, frames, picture},
                             options.prepare, run.device(), &agreement);
      if (which >= worn.first_garment) {  // hair and shoes hide a body, and no result has them
        tell_strange_labels(run, fresh, agreement);
      }
      write_archive(data_file, archive_of(fresh));
      // As the next run finds it: coordinates are rounded there.
      prepared = read_appearance_data(data_file);
    }
    const AppearanceData& data = *prepared;
    views += static_cast<double>(data.views.size());
    for (const AppearanceView& view : data.views) {
      pixels += static_cast<double>(view.pixel.size());
    }
    if (run.stop_requested()) {
      return;
    }
    judge_pictures(run, data);
    const Trained trained =
        train_network(run, name, known, static_cast<int>(data.views.size()),
                      {data_file, scratch / "model.safetensors", scratch / "training.csv",
                       scratch / "checkpoint.safetensors"});
    if (!trained.done) {
      return;
    }
    require_learnt(run, name, trained.psnr,
                   static_fit(data, std::min(network.resolution, kJudgedTexels)).psnr);
    models[which] = (scratch / "model.safetensors").string();
    for (const char* kept : {"model.safetensors", "training.csv", "data.h5"}) {
      run.output(name + "/" + kept, [&](const fs::path& file) {
        fs::copy_file(scratch / kept, file, fs::copy_options::overwrite_existing);
      });
    }
    psnr += trained.psnr.value_or(0);
    known_ends += trained.psnr ? 1 : 0;
    seconds += trained.seconds;
    steps += trained.steps;
  }
  if (!show(run, worn, seen, picture, models)) {
    return;
  }
  const auto surfaces = static_cast<double>(drawn.size());
  const double iterations = known.iterations;
  run.metric("surfaces", surfaces);
  run.metric("frames", static_cast<double>(seen.clothed.size()));
  run.metric("views", views);
  run.metric("pixels", pixels);
  run.metric("iterations", iterations);
  if (known_ends > 0) {
    run.metric("training_psnr_db", psnr / known_ends);
  }
  if (steps > 0) {
    run.metric("seconds_a_step", seconds / steps);
  }
}

}  // namespace

OptionTable describe(AppearanceStageOptions& options) {
  OptionTable table;
  table.add(describe(options.train));
  table.add(describe(options.prepare));
  table.add("body", options.body,
            "Training of the body under the clothes too, with the same kind of network");
  table.add("capture", describe(options.capture));
  return table;
}

void require_trainable(const AppearanceStageOptions& options, Device device) {
  const std::string problem = training_problem(resolved(options.train, device), device);
  if (!problem.empty()) {
    throw UsageError(problem);
  }
  check_device(device);
}

void require_cameras(const AppearanceStageOptions& options, const fs::path& capture) {
  what_training_sees(open_dataset(capture, options.capture), capture);
}

void run_appearance(StageRun& run) {
  const auto& options = run.options<AppearanceStageOptions>();
  require_trainable(options, run.device());  // not after minutes of preparing its data
  learn(run, open_dataset(run.input("capture"), options.capture),
        worn_in_workspace(run.input("registered"), run.input("bodies")));
}

void run_oracle(StageRun& run) {
  const auto& options = run.options<AppearanceStageOptions>();
  require_trainable(options, run.device());  // not after minutes of preparing its data
  const fs::path& capture = run.input("capture");
  const auto truth = std::make_shared<const GroundTruth>(read_ground_truth(capture));
  learn(run, open_dataset(capture, options.capture), worn_in_truth(capture, truth));
}

}  // namespace atelier
