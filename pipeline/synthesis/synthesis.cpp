#include "pipeline/synthesis/synthesis.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

#include "capture/capture_info.h"
#include "core/archive.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/cameras_file.h"
#include "core/io/file_bytes.h"
#include "core/io/image_file.h"
#include "core/io/json.h"
#include "core/limits.h"
#include "core/new_folders.h"
#include "core/printable.h"
#include "core/renamed_options.h"
#include "core/saturating_cast.h"
#include "core/store/file_lock.h"
#include "core/usage_error.h"
#include "pipeline/synthesis/file_performance.h"
#include "pipeline/synthesis/performance.h"
#include "pipeline/synthesis/synthesis_stage.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

// Raised whenever the same options give other bytes.
constexpr int kSynthesisVersion = 6;
constexpr int kFilesVersion = 7;  // of sequences from files

std::string key_of(SynthesisOptions options) {
  const int version = options.body_sequence.empty() ? kSynthesisVersion : kFilesVersion;
  return "{\"synthesis\":" + std::to_string(version) +
         ",\"options\":" + canonical_json(describe(options)) + "}\n";
}

/// Content of a synthesis.json, with the present names of options that were renamed since.
nlohmann::json in_present_names(nlohmann::json said) {
  const auto options = said.find("options");
  if (options == said.end() || !options->is_object()) {
    return said;
  }
  SynthesisOptions any;
  std::vector<std::string> known;
  for (const OptionField& field : describe(any).fields) {
    known.push_back(field.name);
  }
  nlohmann::json present = nlohmann::json::object();
  for (const auto& [name, value] : options->items()) {
    const std::string now = renamed_option(name, known);
    present[now.empty() ? name : now] = value;
  }
  *options = std::move(present);
  return said;
}

constexpr const char* kUnfinished = ".unfinished";  // inside of the capture

/// The folder of a capture while it is being made.
struct Work {
  fs::path folder;
  fs::path hidden;  ///< what only an unfinished capture has

  fs::path frame(int id) const { return hidden / "frames" / (frame_name(id) + ".h5"); }
  fs::path speed(int id) const { return hidden / "speeds" / (frame_name(id) + ".h5"); }
  fs::path state() const { return hidden / "state.h5"; }
};

fs::path options_file(const Work& work) {
  return work.folder / "synthesis.json";
}

/// Refuses a folder that holds other things or a capture of other options.
void check_free(const Work& work, const std::string& key) {
  const fs::path options = options_file(work);
  if (fs::exists(options)) {
    if (read_file_text(options, Limits{}.text_file_bytes) != key) {
      throw UsageError("OUT cannot be '" + work.folder.string() +
                       "': it holds a capture of other options; name a new folder");
    }
    return;
  }
  for (const fs::directory_entry& entry : fs::directory_iterator(work.folder)) {
    const std::string name = entry.path().filename().string();
    if (name != ".lock" && !is_temporary_name(name)) {
      throw UsageError("OUT cannot be '" + work.folder.string() + "': it holds other things ('" +
                       name + "'); name a new folder");
    }
  }
}

/// From now on the folder belongs to these options: once it is known that they can be met.
void claim(const Work& work, const std::string& key) {
  if (!fs::exists(options_file(work))) {
    write_file_atomically(options_file(work), key);
  }
  make_private_directory(work.hidden / "frames");
  make_private_directory(work.hidden / "speeds");
}

struct Stopped {};

/// Keeps a frame until it is photographed.
void keep(const Work& work, const GroundTruth& truth, const SynthesisOptions& options, int id,
          PerformedFrame frame) {
  frame.truth.frame_id = id;
  if (options.shutter > 0) {
    GroundTruthFrame speed;
    speed.frame_id = id;
    speed.joints = frame.truth.joints;
    speed.keypoints = frame.truth.keypoints;
    speed.body = frame.body_velocity;
    speed.layers = frame.layer_velocities;
    speed.garments = frame.garment_velocities;
    write_archive(work.speed(id), archive_of(speed, truth));
  }
  write_archive(work.frame(id), archive_of(frame.truth, truth));
}

/// Plays both sequences into hidden frames, as far as they are not there.
void perform(const Work& work, const Performance& performance, const GroundTruth& truth,
             const SynthesisOptions& options, const SynthesisEvents& events) {
  const auto stop_if_asked = [&] {
    if (events.stop()) {
      throw Stopped{};
    }
  };
  const auto missing = [&](int first, int count) {
    for (int id = first; id < first + count; ++id) {
      if (!fs::exists(work.frame(id))) {
        return true;
      }
    }
    return false;
  };
  if (missing(options.frames, options.minimal_frames)) {
    perform_minimal(performance, options, [&](int i, const PerformedFrame& frame) {
      keep(work, truth, options, options.frames + i, frame);
      stop_if_asked();
    });
  }
  if (missing(0, options.frames)) {
    PerformanceState state;
    bool resumed = fs::exists(work.state());
    if (resumed) {
      state = performance_state_of(read_archive(work.state(), "atelier.synthesis.state", 1),
                                   performance.outfit.cloth.rest_positions.rows(),
                                   performance.subject.model.mesh.vertices.rows(),
                                   work.state().string());
      resumed = !missing(0, state.next_frame);
    }
    if (resumed) {
      events.say("simulation: continuing after frame " + std::to_string(state.next_frame - 1));
    }
    perform_clothed(performance, options, resumed ? &state : nullptr,
                    [&](int i, const PerformedFrame& frame, const PerformanceState& after) {
                      keep(work, truth, options, i, frame);
                      write_archive(work.state(), archive_of(after));
                      stop_if_asked();
                    });
  }
}

PerformedFrame read_performed(const Work& work, const GroundTruth& truth, int id,
                              const SynthesisOptions& options) {
  PerformedFrame frame;
  frame.truth = ground_truth_frame_of(read_archive(work.frame(id), "atelier.truth.frame", 1), truth,
                                      work.frame(id).string());
  if (options.shutter > 0) {
    GroundTruthFrame speed = ground_truth_frame_of(
        read_archive(work.speed(id), "atelier.truth.frame", 1), truth, work.speed(id).string());
    frame.body_velocity = std::move(speed.body);
    frame.layer_velocities = std::move(speed.layers);
    frame.garment_velocities = std::move(speed.garments);
  }
  return frame;
}

CaptureInfo info_of(const SynthesisOptions& options, const GroundTruth& truth) {
  CaptureInfo info;
  const auto subject = truth.texts.find("subject");
  info.subject = subject == truth.texts.end() ? "synthetic" : "synthetic: " + subject->second;
  info.synthetic = true;
  info.keypoint_schema = options.keypoints;
  info.image_format = options.image_format;
  const auto ids = [](int first, int count) {
    std::vector<int> result(static_cast<std::size_t>(count));
    std::iota(result.begin(), result.end(), first);
    return result;
  };
  if (options.frames > 0) {
    info.sequences.push_back({"clothed", "clothed", options.fps, ids(0, options.frames)});
    const int held = saturating_cast<int>(std::floor(options.held_out_share * options.frames));
    info.held_out_frames = ids(options.frames - held, held);
  }
  if (options.minimal_frames > 0) {
    info.sequences.push_back({"minimal", "minimal", options.minimal_frames / 4.0,
                              ids(options.frames, options.minimal_frames)});
  }
  for (int i = 0; i < options.held_out_cameras; ++i) {
    const auto camera = static_cast<std::size_t>((2 * i + 1) * options.dome.cameras /
                                                 (2 * options.held_out_cameras));
    info.held_out_cameras.push_back(truth.cameras[camera].id);
  }
  info.consent = {{"nobody: a synthetic person", "any use", ""}};
  return info;
}

/// Casts, dresses and plays a performance of our own.
SynthesisStage played(const Work& work, const SynthesisOptions& options,
                      const SynthesisEvents& events) {
  if (options.frames > 0) {
    events.say("dressing the subject");
  }
  const Performance performance = cast_performance(options);
  claim(work, key_of(options));
  events.say("subject: " + performance.subject.description);
  for (const Finding& finding : performance.clothed.findings) {
    events.say(to_string(finding));
  }
  for (const GroundTruthGarment& garment : performance.outfit.garments) {
    events.say("worn: " + garment.garment.name + ", " +
               std::to_string(garment.garment.mesh.vertices.rows()) + " vertices");
  }
  SynthesisStage stage = set_stage(truth_of(performance, options), performance.layers, options);
  perform(work, performance, stage.truth, options, events);
  return stage;
}

/// Reads a performance that another program made.
SynthesisStage taken_from_files(const Work& work, const SynthesisOptions& options,
                                const SynthesisEvents& events) {
  const FilePerformance performance = read_performance(options);
  claim(work, key_of(options));
  for (const std::string& line : sequence_person_lines(performance.person, options.keypoints)) {
    events.say(line);
  }
  if (const GroundTruthGarment& cloth = performance.garment.truth;
      !performance.cloth.sequence.frame_ids.empty()) {
    events.say(cloth.seams.empty()
                   ? "the cloth's texture tells no sewn panels: flatten cannot be judged by them"
                   : "panels: " + counted(std::ssize(cloth.garment.panel_names), "panel") + ", " +
                         counted(std::ssize(cloth.seams), "seam"));
  }
  SynthesisStage stage = set_stage(truth_of(performance, options), {}, options);
  for (int id = 0; id < options.frames + options.minimal_frames; ++id) {
    const bool clothed = id < options.frames;
    keep(work, stage.truth, options, id,
         performed_frame(performance, options, clothed ? id : id - options.frames, clothed));
  }
  return stage;
}

void make_folders(const Work& work, const std::vector<Camera>& cameras,
                  const SynthesisOptions& options) {
  std::vector<std::string> folders = {"images", "labels", "keypoints2d", "truth/labels"};
  if (options.ground_truth_images) {
    folders.emplace_back("truth/images");
  }
  if (options.ground_truth_maps) {
    folders.emplace_back("truth/maps");
  }
  make_private_directory(work.folder / "truth" / "frames");
  for (const std::string& folder : folders) {
    for (const Camera& camera : cameras) {
      make_private_directory(work.folder / folder / camera.id);
    }
  }
}

}  // namespace

std::vector<Finding> require_synthesis(const fs::path& folder, const SynthesisOptions& options) {
  if (fs::is_directory(folder)) {
    check_free({folder, folder / kUnfinished}, key_of(options));
  }
  if (options.body_sequence.empty()) {
    return require_cast(options);
  }
  read_performance(options);
  return {};
}

bool synthesize_capture(const fs::path& folder, const SynthesisOptions& options,
                        const SynthesisEvents& events) {
  const Work work{folder, folder / kUnfinished};
  const NewFolders made(folder);
  make_private_directory(folder);
  const fs::path lock_file = folder / ".lock";
  const auto lock = FileLock::try_lock(lock_file, FileLock::Mode::Exclusive);
  if (!lock) {
    throw EnvironmentError(folder.string(), "another run is writing this capture");
  }
  try {
    check_free(work, key_of(options));
    if (fs::exists(folder / "capture.toml")) {
      events.say("this capture is complete");
      fs::remove(lock_file);
      return true;
    }
    const SynthesisStage stage = options.body_sequence.empty()
                                     ? played(work, options, events)
                                     : taken_from_files(work, options, events);
    events.say("performed " + counted(options.frames + options.minimal_frames, "frame"));
    make_folders(work, stage.cameras, options);
    write_archive(folder / "truth" / "truth.h5", archive_of(stage.truth));
    for (std::size_t g = 0; g < stage.cloths.size(); ++g) {
      if (stage.cloths[g].texture) {
        make_private_directory(folder / "truth" / "albedo");
        write_image(folder / "truth" / "albedo" / (stage.truth.garments[g].garment.name + ".png"),
                    *stage.cloths[g].texture);
      }
    }
    if (stage.skin.texture) {
      make_private_directory(folder / "truth" / "albedo");
      write_image(folder / "truth" / "albedo" / "body.png", *stage.skin.texture);
    }
    for (int id = 0; id < options.frames + options.minimal_frames; ++id) {
      if (!photograph_instant(folder, stage, read_performed(work, stage.truth, id, options),
                              options, events.stop)) {
        return false;
      }
      events.say("frame " + std::to_string(id) + ": " + std::to_string(stage.cameras.size()) +
                 " images");
    }
    if (options.plates) {
      photograph_plates(folder, stage, options);
    }
    write_file_atomically(folder / "cameras.json", cameras_json(stage.written));
    fs::remove(work.state());  // first: what it counts as done is about to go
    fs::remove_all(work.hidden);
    write_file_atomically(folder / "capture.toml", capture_toml(info_of(options, stage.truth)));
    fs::remove(lock_file);
    sync_directory(folder);
  } catch (const Stopped&) {
    return false;
  } catch (const std::exception&) {
    // A request that was refused before anything was made leaves nothing.
    if (!fs::exists(folder / "synthesis.json") || fs::exists(folder / "capture.toml")) {
      fs::remove(lock_file);
      made.remove_empty();
    }
    throw;
  }
  return true;
}

std::optional<SynthesisOptions> synthesis_options_of(const fs::path& capture) {
  const fs::path file = capture / "synthesis.json";
  if (!fs::exists(file)) {
    return std::nullopt;
  }
  const std::string text = read_file_text(file, Limits{}.text_file_bytes);
  const nlohmann::json json = parse_json(text, file.string());
  SynthesisOptions options;
  OptionTable table = describe(options);
  const auto said = json.find("options");
  if (said != json.end() && said->is_object()) {
    for (const auto& [name, value] : said->items()) {
      set_option(table, name, value.is_string() ? value.get<std::string>() : value.dump());
    }
  }
  return parse_json(key_of(options), file.string()) == in_present_names(json)
             ? std::optional(options)
             : std::nullopt;
}

}  // namespace atelier
