#if defined(ATELIER_HAS_CAPTURE) && defined(ATELIER_HAS_APPEARANCE)

#include "apps/appearance_stage.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <set>

#include "apps/child_program.h"
#include "apps/truth_subject.h"
#include "capture/capture_info.h"
#include "capture/frame_reader.h"
#include "capture/layouts/open_dataset.h"
#include "core/atomic_file.h"
#include "core/error.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// What a training may see: no camera and no frame that is held out.
struct Seen {
  std::vector<Camera> cameras;
  std::vector<Index> camera_idx;  // of the data set
  std::vector<int> frame_ids;
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
      if (sequence.kind == "clothed" && !held_frames.contains(frame_id)) {
        seen.frame_ids.push_back(frame_id);
      }
    }
  }
  if (seen.cameras.empty() || seen.frame_ids.empty()) {
    throw DataError(capture.string(), "cameras and frames", "none that is not held out",
                    "a clothed sequence that cameras took");
  }
  return seen;
}

/// The training's options as the words of the other program.
std::vector<std::string> words_of(const TrainOptions& options) {
  TrainOptions known = resolved(options);
  std::vector<std::string> words;
  for (const OptionField& field : describe(known).fields) {
    std::string text = option_text(field);
    if (text.size() >= 2 && text.front() == '"') {
      text = text.substr(1, text.size() - 2);
    }
    words.push_back("--" + field.name);
    words.push_back(text);
  }
  return words;
}

struct Trained {
  double psnr = 0;     // dB, mean over the last twentieth of the steps
  double seconds = 0;  // of all steps
  bool done = false;
};

Trained train_network(StageRun& run, const TrainOptions& options, const fs::path& data,
                      const fs::path& model, const fs::path& log, const fs::path& checkpoint) {
  std::vector<std::string> words = {"train",
                                    data.string(),
                                    model.string(),
                                    "--log",
                                    log.string(),
                                    "--checkpoint",
                                    checkpoint.string(),
                                    "--device",
                                    device_name(run.device())};
  const std::vector<std::string> more = words_of(options);
  words.insert(words.end(), more.begin(), more.end());
  const int iterations = resolved(options).iterations;
  const int last = std::max(1, iterations / 20);
  Trained result;
  int counted = 0;
  const auto start = std::chrono::steady_clock::now();
  result.done = run_child_program(
      "atelier-appearance", words, "it is built where libtorch is (libtorch-dev)",
      [&](const std::string& line) {
        long long step = 0;
        int of = 0;
        double loss = 0;
        double psnr = 0;
        if (std::sscanf(line.c_str(), "step %lld %d %lf %lf", &step, &of, &loss, &psnr) == 4) {
          run.progress(step, of, "steps");
          if (step > iterations - last) {
            result.psnr += psnr;
            ++counted;
          }
        }
      },
      [&] { return run.stop_requested(); });
  result.psnr /= std::max(counted, 1);
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

}  // namespace

OptionTable describe(AppearanceStageOptions& options) {
  OptionTable table;
  table.add(describe(options.train));
  table.add(describe(options.prepare));
  table.add("body", options.body, "Also the body under the clothes, with the same kind of network");
  table.add("truth_geometry", options.truth_geometry,
            "Garments and body of a synthetic capture's truth instead of the workspace's");
  return table;
}

void run_appearance(StageRun& run) {
  const auto& options = run.options<AppearanceStageOptions>();
  const fs::path& capture = run.input("capture");
  if (!options.truth_geometry) {
    throw DataError(capture.string(), "registered garments", "none in the workspace",
                    "--truth_geometry true, on a synthetic capture");
  }
  const Dataset dataset = open_dataset(capture);
  const Seen seen = what_training_sees(dataset, capture);
  FrameReader reader(dataset);
  const TruthSubject dressed = truth_subject(capture);
  const NetworkOptions network = network_options(options.train);
  const ReadPicture picture = [&](std::size_t camera, int frame_id) {
    return reader.byte_image(seen.camera_idx[camera], frame_id).value_or(ByteImage());
  };
  double views = 0;
  double pixels = 0;
  Trained all;
  std::vector<std::size_t> drawn;
  if (options.body) {
    drawn.push_back(0);
  }
  for (std::size_t s = dressed.first_garment; s < dressed.templates.size(); ++s) {
    drawn.push_back(s);
  }
  for (const std::size_t which : drawn) {
    const std::string& name = dressed.subject.names[which];
    run.say(name + ": maps of " + std::to_string(seen.frame_ids.size()) + " frames");
    DrawnSurface surface;
    surface.which = which;
    surface.resolution = network.resolution;
    surface.shadow_resolution = shadow_resolution_of(network.resolution);
    surface.atlas = pack_atlas(dressed.templates[which], {.resolution = network.resolution});
    const AppearanceData data =
        prepare_appearance(dressed.subject, surface, seen.cameras, seen.frame_ids, picture,
                           options.prepare, run.device());
    views += static_cast<double>(data.views.size());
    for (const AppearanceView& view : data.views) {
      pixels += static_cast<double>(view.pixel.size());
    }
    if (run.stop_requested()) {
      return;
    }
    const fs::path scratch = run.scratch_folder() / name;
    make_private_directory(scratch);
    const fs::path data_file = scratch / "data.h5";
    write_archive(data_file, archive_of(data));
    Trained trained;
    run.output(name + "/model.safetensors", [&](const fs::path& file) {
      trained = train_network(run, options.train, data_file, file, scratch / "training.csv",
                              scratch / "checkpoint.safetensors");
    });
    if (!trained.done) {
      return;
    }
    for (const char* kept : {"training.csv", "data.h5"}) {
      run.output(name + "/" + kept, [&](const fs::path& file) {
        fs::copy_file(scratch / kept, file, fs::copy_options::overwrite_existing);
      });
    }
    all.psnr += trained.psnr;
    all.seconds += trained.seconds;
  }
  const auto surfaces = static_cast<double>(drawn.size());
  const double iterations = resolved(options.train).iterations;
  run.metric("surfaces", surfaces);
  run.metric("frames", static_cast<double>(seen.frame_ids.size()));
  run.metric("views", views);
  run.metric("pixels", pixels);
  run.metric("iterations", iterations);
  run.metric("training_psnr_db", surfaces > 0 ? all.psnr / surfaces : 0);
  run.metric("seconds_a_step", surfaces > 0 ? all.seconds / (surfaces * iterations) : 0);
  run.metric("truth_geometry", options.truth_geometry ? 1 : 0);
}

}  // namespace atelier

#endif
