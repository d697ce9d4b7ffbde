// atelier-appearance: the only program that loads libtorch. It trains and asks networks, on files
// that `atelier` has prepared, so that no other command waits for libtorch and a machine that
// trains needs neither images nor the capture.
#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include "appearance/appearance_colors.h"
#include "appearance/body_surfaces.h"
#include "appearance/learning_outcome.h"
#include "appearance/network/launch.h"
#include "appearance/network/network_files.h"
#include "appearance/network/painter.h"
#include "appearance/network/peers.h"
#include "appearance/network/train.h"
#include "appearance/painted_picture.h"
#include "appearance/static_fit.h"
#include "appearance/training_log.h"
#include "apps/console/device_advice.h"
#include "core/archive.h"
#include "core/atomic_file.h"
#include "core/device.h"
#include "core/error.h"
#include "core/exit_code.h"
#include "core/io/safetensors.h"
#include "core/not_converged.h"
#include "core/usage_error.h"

namespace {

using namespace atelier;
namespace fs = std::filesystem;

constexpr const char* kHelp =
    "atelier-appearance train DATA MODEL [--checkpoint FILE] [--log FILE] [--device cpu|cuda] "
    "[--OPTION VALUE ...]\n"
    "    Trains a garment's network on data that `atelier appearance` has prepared. Goes on where\n"
    "    FILE stands, if it is there. Prints 'begin DONE OF', then 'step DONE OF LOSS PSNR' "
    "lines.\n"
    "    --processes N trains on N GPUs of this machine; torchrun and srun start processes on\n"
    "    several, with --launcher: docs/guide/several_gpus.md.\n"
    "atelier-appearance predict MODEL DATA COLORS [--device cpu|cuda]\n"
    "    Draws every view of the data: linear colours of its pixels, without gain.\n"
    "atelier-appearance shape MODEL SURFACES OFFSETS [--device cpu|cuda]\n"
    "    By what the poses of a body's surfaces move its mean surface.\n"
    "atelier-appearance paint SCENE FOLDER [--device cpu|cuda] [--OPTION VALUE ...]\n"
    "    Draws every frame of a scene: FOLDER/000012.h5. Prints 'frame ID' lines.\n";

constexpr const char* kNoMemory =
    "memory: there is not enough; a network takes less with a smaller --resolution or --batch, a "
    "larger --shading, or fewer cameras and frames to learn from";

volatile std::sig_atomic_t stopping = 0;

/// The arguments on the command line.
struct Arguments {
  std::vector<std::string> places;
  std::string checkpoint;
  std::string log;
  Device device = Device::Cpu;
  TrainOptions options;
  PaintOptions paint;
  int ahead = 0;
  LaunchOptions launch;  ///< without what the fields above say
};

/// The options that a command takes: one of another command would do nothing.
OptionTable options_of(const std::string& command, Arguments& arguments) {
  OptionTable table;
  if (command == "train") {
    table.add("checkpoint", arguments.checkpoint, std::vector<std::string>{},
              "File of the checkpoint kept while training");
    table.add("log", arguments.log, std::vector<std::string>{},
              "CSV file with a line for every training step");
    table.add(
        "launcher", arguments.launch.launcher,
        {{"self", Launcher::Self}, {"torchrun", Launcher::Torchrun}, {"slurm", Launcher::Slurm}},
        "Program that starts the processes: this one, torchrun, or Slurm's srun");
    table.add("rank", arguments.launch.rank, -1, kMostProcesses - 1, "",
              "Number of this process among those that train together; below 0: it starts them");
    table.add("rendezvous", arguments.launch.rendezvous, std::vector<std::string>{},
              "File through which processes with a rank find each other");
  }
  table.add("device", arguments.device, {{"cpu", Device::Cpu}, {"cuda", Device::Cuda}},
            "Device of the networks");
  if (command == "train") {
    table.add(describe_with_code(arguments.options));
  } else if (command == "paint") {
    table.add(describe(arguments.paint));
    table.add("ahead", arguments.ahead, 0, 1000, "",
              "Maximum number of images that wait to be taken away; 0: no limit");
  }
  return table;
}

Arguments parsed(const std::vector<std::string>& words) {
  Arguments arguments;
  OptionTable table = options_of(words[0], arguments);
  std::set<std::string> given;
  for (std::size_t i = 1; i < words.size(); ++i) {
    if (!words[i].starts_with("--")) {
      arguments.places.push_back(words[i]);
      continue;
    }
    std::string name = words[i].substr(2);
    std::replace(name.begin(), name.end(), '-', '_');  // as flags of `atelier` are written
    if (++i == words.size()) {
      throw UsageError("--" + name + " needs a value");
    }
    const std::string wrong = set_option(table, name, words[i]);
    if (!wrong.empty()) {
      throw UsageError(wrong);
    }
    if (!given.insert(name).second) {  // nobody has to guess which of the two counts
      throw UsageError("--" + name + " is given twice; leave one of them out");
    }
  }
  return arguments;
}

void write_tensors(const fs::path& path, std::map<std::string, Tensor> tensors,
                   std::map<std::string, std::string> texts) {
  write_safetensors(path, {std::move(tensors), std::move(texts)});
}

/// Rows of a log may not be lost unsaid: what they say decides whether the network is a result.
void write_rows(std::ofstream& log, const std::string& path) {
  if (log.is_open() && !log.flush()) {
    throw EnvironmentError(path, "cannot be written any more; is the disk full?");
  }
}

/// Ends this process because another is lost, whatever it is at.
void end_lost(const std::string& message) {
  if (!message.empty()) {
    std::cerr << "atelier-appearance: " << message << std::endl;
  }
  std::_Exit(kExitEnvironment);
}

/// Refuses a process that would train something else than the first.
void require_alike(Peers& peers, const Training& training) {
  const auto begin = [&](const std::string& digest) {
    return static_cast<std::int64_t>(std::stoull(digest.substr(0, 12), nullptr, 16));
  };
  const bool same_step = peers.of_first(training.iteration) == training.iteration;
  const bool same_data = peers.of_first(begin(training.data)) == begin(training.data);
  if (!same_step || !same_data) {
    throw EnvironmentError("process " + std::to_string(peers.rank()),
                           std::string(same_data ? "its checkpoint" : "its data") +
                               " differs from the first process's; let all see the same files");
  }
}

int run_training(const Arguments& arguments, const std::vector<std::string>& words) {
  if (arguments.places.size() != 2) {
    throw UsageError("train takes DATA and MODEL");
  }
  // All that can be refused at once is, not after hours.
  require_different({{"DATA", arguments.places[0]},
                     {"MODEL", arguments.places[1]},
                     {"--checkpoint", arguments.checkpoint},
                     {"--log", arguments.log}});
  require_result_place(arguments.places[1]);
  require_own_file(arguments.places[1], begins_as_tensors(arguments.places[1]), "network");
  require_result_place(arguments.checkpoint);
  require_result_place(arguments.log);
  const std::string logged = log_at(arguments.log);
  const TrainOptions options = resolved(arguments.options, arguments.device);
  if (const std::string problem = training_problem(options, arguments.device); !problem.empty()) {
    throw UsageError(problem);
  }
  LaunchOptions launch = arguments.launch;
  launch.processes = arguments.options.processes;
  launch.device = arguments.device;
  const std::optional<PeerPlace> place = launched_place(launch);
  if (place) {
    take_place(*place, launch);
  }
  check_device(arguments.device);
  if (!place && arguments.options.processes > 1) {
    const auto say = [](const std::string& line) { std::cout << line << std::endl; };
    const bool whole =
        run_together(words, arguments.options.processes, say, [] { return stopping != 0; });
    return whole ? kExitDone : kExitNotConverged;
  }
  const AppearanceData data = read_appearance_data(arguments.places[0]);
  Training training;
  if (!arguments.checkpoint.empty() && fs::exists(arguments.checkpoint)) {
    training = checkpoint_at(arguments.checkpoint, data, options);
  } else {
    training = start_training(data, options);
  }
  std::optional<Peers> peers;
  if (place) {
    peers.emplace(*place, arguments.device, end_lost);
    require_alike(*peers, training);
  }
  const bool first = !place || place->rank == 0;
  const std::int64_t judged_from =
      judged_after(options.iterations, static_cast<int>(data.views.size()), options.batch);
  std::string rows = resumed_training_log(logged, training.iteration);  // with all that are judged
  std::ofstream log;
  if (first && !arguments.log.empty()) {
    write_file_atomically(arguments.log, rows);
    log.open(arguments.log, std::ios::app);
  }
  if (first) {
    std::cout << "begin " << training.iteration << " " << options.iterations << "\n" << std::flush;
  }
  TrainHooks hooks;
  hooks.step = [&](std::int64_t iteration, const NetworkLoss& loss, double learning_rate) {
    char text[160];
    const std::string row = training_log_row({iteration, loss.value, loss.psnr, learning_rate});
    if (log.is_open()) {
      log << row;
    }
    rows += iteration > judged_from ? row : "";
    std::snprintf(text, sizeof(text), "step %lld %d %.6g %.3f\n", static_cast<long long>(iteration),
                  options.iterations, loss.value, loss.psnr);
    std::cout << text << std::flush;
  };
  const pid_t starter = getppid();
  hooks.stop = [&] {
    return stopping != 0 || (arguments.launch.rank >= 0 && getppid() != starter);
  };
  hooks.checkpoint = [&](const Training& state) {
    write_rows(log, arguments.log);
    if (!arguments.checkpoint.empty()) {
      write_tensors(arguments.checkpoint, tensors_of(state), texts_of(state));
    }
  };
  const auto begin = std::chrono::steady_clock::now();
  const TrainResult result =
      train(std::move(training), data, options, arguments.device, hooks, peers ? &*peers : nullptr);
  if (peers) {
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
    const double sums = peers->seconds();
    peers->finish();
    if (!first) {
      return result.stopped ? kExitNotConverged : kExitDone;
    }
    std::cout << "sums " << sums << " s of " << took.count() << "\n" << std::flush;
  }
  if (result.stopped) {
    return kExitNotConverged;
  }
  if (!result.finite) {
    std::cerr << "atelier-appearance: the loss is no number any more after iteration "
              << result.training.iteration
              << (arguments.checkpoint.empty() ? "" : ", where the checkpoint stands")
              << "; a smaller --learning-rate may help\n";
    return kExitNotConverged;
  }
  write_rows(log, arguments.log);
  if (const auto psnr = mean_psnr_after(rows, judged_from)) {
    const double fixed = static_fit(data, std::min(options.resolution, kJudgedTexels)).psnr;
    if (learning_outcome(*psnr, fixed) == LearningOutcome::Diverged) {
      throw NotConverged(poor_outcome_text(*psnr, fixed));
    }
  }
  write_tensors(arguments.places[1], tensors_of(result.training.model),
                texts_of(result.training.model));
  return kExitDone;
}

int run_prediction(const Arguments& arguments) {
  if (arguments.places.size() != 3) {
    throw UsageError("predict takes MODEL, DATA and COLORS");
  }
  require_different({{"MODEL", arguments.places[0]},
                     {"DATA", arguments.places[1]},
                     {"COLORS", arguments.places[2]}});
  require_result_place(arguments.places[2]);
  require_own_file(arguments.places[2], file_begins_with(arguments.places[2], "ATELIER-ARCHIVE"),
                   "archive of colours");
  const AppearanceModel model = network_at(arguments.places[0]);
  const AppearanceData data = read_appearance_data(arguments.places[1]);
  if (!equal_arrays(data.faces, model.faces) || !equal_arrays(data.uvs, model.uvs) ||
      data.frames.front().position.rows() != model.mean_transfer.rows()) {
    throw DataError(arguments.places[1], "atlas", "another garment's", "data prepared for it");
  }
  if (data.occlusion) {
    drawn_occlusion(*data.occlusion, {{model.name, model.occlusion}});  // refuses other light
  }
  const AppearanceNetwork network(model, arguments.device);
  AppearanceColors all;
  for (std::size_t i = 0; i < data.views.size(); ++i) {
    const AppearanceView& view = data.views[i];
    const TexturePixels pixels{view.u, view.v, {}};
    const std::vector<float> colors =
        network.colors(data.frames[static_cast<std::size_t>(view.frame_idx)],
                       data.centers.row(view.camera_idx), pixels);
    const std::vector<float> still = sample_texture(model.static_texture, pixels);
    all.drawn.insert(all.drawn.end(), colors.begin(), colors.end());
    all.fixed.insert(all.fixed.end(), still.begin(), still.end());
    std::cout << "view " << i + 1 << " " << data.views.size() << "\n" << std::flush;
  }
  write_archive(arguments.places[2], archive_of(all));
  return kExitDone;
}

int run_shaping(const Arguments& arguments) {
  if (arguments.places.size() != 3) {
    throw UsageError("shape takes MODEL, SURFACES and OFFSETS");
  }
  require_different({{"MODEL", arguments.places[0]},
                     {"SURFACES", arguments.places[1]},
                     {"OFFSETS", arguments.places[2]}});
  require_result_place(arguments.places[2]);
  require_own_file(arguments.places[2], file_begins_with(arguments.places[2], "ATELIER-ARCHIVE"),
                   "archive of offsets");
  const AppearanceModel model = network_at(arguments.places[0]);
  const std::vector<FloatRows> surfaces =
      surfaces_of(read_archive(arguments.places[1], kSurfacesSchema, 1), arguments.places[1]);
  if (surfaces.empty() || surfaces[0].rows() != model.mean_transfer.rows()) {
    throw DataError(arguments.places[1], "frames/rows",
                    surfaces.empty() ? "none" : std::to_string(surfaces[0].rows()) + " vertices",
                    std::to_string(model.mean_transfer.rows()) + ", as the network's body has");
  }
  const AppearanceNetwork network(model, arguments.device);
  std::vector<FloatRows> offsets;
  for (const FloatRows& surface : surfaces) {
    offsets.push_back(network.offsets(surface).cast<float>());
  }
  write_archive(arguments.places[2], archive_of_surfaces(offsets));
  return kExitDone;
}

/// Waits until `asker`, who started this program, has taken an image away; not for one that ended.
void wait_until_taken(const fs::path& picture, pid_t asker) {
  constexpr std::chrono::milliseconds kLook{2};
  while (stopping == 0 && fs::exists(picture)) {
    if (getppid() != asker) {
      stopping = 1;
    }
    std::this_thread::sleep_for(kLook);
  }
}

int run_painting(const Arguments& arguments) {
  if (arguments.places.size() != 2) {
    throw UsageError("paint takes SCENE and FOLDER");
  }
  if (arguments.paint.background.size() != 3) {
    throw UsageError("--background takes three numbers: [0.9, 0.9, 0.9]");
  }
  const PaintedScene scene = painted_scene_of(
      read_archive(arguments.places[0], "atelier.painted_scene", 1), arguments.places[0]);
  std::vector<PaintedLayer> layers;
  for (const SceneLayer& layer : scene.layers) {
    PaintedLayer painted{layer.faces, nullptr, layer.color};
    if (!layer.model.empty()) {
      painted.model = std::make_shared<const AppearanceModel>(network_at(layer.model));
    }
    layers.push_back(std::move(painted));
  }
  Painter painter(std::move(layers), arguments.paint, arguments.device);
  const auto file_of = [&](std::size_t f) {
    char name[32];
    std::snprintf(name, sizeof(name), "%06d.h5", scene.frame_ids[f]);
    return fs::path(arguments.places[1]) / name;
  };
  const auto ahead = static_cast<std::size_t>(arguments.ahead);
  const pid_t asker = getppid();
  for (std::size_t f = 0; f < scene.frame_ids.size() && stopping == 0; ++f) {
    const Image picture =
        painter.paint(scene.vertices[f], scene.cameras[scene.cameras.size() == 1 ? 0 : f]);
    if (ahead > 0 && f >= ahead) {
      wait_until_taken(file_of(f - ahead), asker);
    }
    write_archive(file_of(f), archive_of_painted(picture));
    std::cout << "frame " << scene.frame_ids[f] << "\n" << std::flush;
  }
  return stopping == 0 ? kExitDone : kExitNotConverged;
}

int run(const std::vector<std::string>& words) {
  if (words.empty() || words[0] == "--help") {
    std::cout << kHelp;
    return words.empty() ? kExitUsage : kExitDone;
  }
  if (words[0] != "train" && words[0] != "predict" && words[0] != "shape" && words[0] != "paint") {
    throw UsageError("there are train, predict, shape and paint, not " + words[0]);
  }
  if (std::find(words.begin(), words.end(), "--help") != words.end()) {
    Arguments defaults;
    std::cout << kHelp << "Options of " << words[0] << ":\n"
              << options_help(options_of(words[0], defaults));
    return kExitDone;
  }
  if (words[0] == "train") {
    return run_training(parsed(words), words);
  }
  if (words[0] == "shape") {
    return run_shaping(parsed(words));
  }
  return words[0] == "predict" ? run_prediction(parsed(words)) : run_painting(parsed(words));
}

/// Whether libtorch found no memory, in its words for a GPU and for a processor.
bool lacks_memory(const std::exception& error) {
  const std::string what = error.what();
  return what.find("out of memory") != std::string::npos ||
         what.find("can't allocate memory") != std::string::npos;
}

/// Where whoever started this program may write no core dump, as one that has opened a sealed file,
/// no other process of the user may read this one's memory, either, and it ends with the other,
/// however that ends.
void share_parents_secrecy() {
  rlimit core{};
  if (getrlimit(RLIMIT_CORE, &core) == 0 && core.rlim_max == 0) {
    prctl(PR_SET_DUMPABLE, 0);
    prctl(PR_SET_PDEATHSIG, SIGKILL);
  }
}

int fail(int code, const char* what) {
  std::cerr << "atelier-appearance: " << what << std::endl;
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  share_parents_secrecy();
  std::signal(SIGTERM, [](int) { stopping = 1; });
  std::signal(SIGINT, [](int) { stopping = 1; });
  try {
    return run(std::vector<std::string>(argv + 1, argv + argc));
  } catch (const UsageError& error) {
    return fail(kExitUsage, error.what());
  } catch (const DataError& error) {
    return fail(kExitBadData, error.what());
  } catch (const NotConverged& error) {
    return fail(kExitNotConverged, error.what());
  } catch (const EnvironmentError& error) {
    return fail(kExitEnvironment, (error.place + ": " + with_device_advice(error)).c_str());
  } catch (const std::bad_alloc&) {
    return fail(kExitEnvironment, kNoMemory);
  } catch (const std::exception& error) {
    return lacks_memory(error) ? fail(kExitEnvironment, kNoMemory) : fail(kExitBug, error.what());
  }
}
