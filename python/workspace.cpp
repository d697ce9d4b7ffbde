#include <atomic>
#include <chrono>
#include <future>
#include <optional>

#include "core/error.h"
#include "core/io/child_program.h"
#include "core/store/digest_meter.h"
#include "core/store/options_file.h"
#include "core/store/result.h"
#include "core/store/run_stage.h"
#include "core/store/workspace_folder.h"
#include "core/store/workspace_status.h"
#include "core/usage_error.h"
#include "pipeline/chain/outdated_results.h"
#include "pipeline/stages/stages.h"
#include "python/arrays.h"
#include "python/bindings.h"
#include "python/device.h"
#include "python/options.h"
#include "python/signals.h"

namespace atelier::python {
namespace {

using namespace py::literals;
using Path = std::filesystem::path;

const Stage& stage_of(const std::string& name) {
  const Stage* stage = find_stage(all_stages(), name);
  if (stage == nullptr) {
    std::string names;
    for (const Stage& one : all_stages()) {
      names += (names.empty() ? "" : ", ") + std::string(one.name);
    }
    throw UsageError("there is no stage '" + name + "'; there are " + names);
  }
  return *stage;
}

/// "PersonalizeStageOptions".
std::string options_class_of(const Stage& stage) {
  std::string name;
  bool upper = true;
  for (const char c : stage.name) {
    if (c == '_' || c == '-') {
      upper = true;
      continue;
    }
    name += upper && c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
    upper = false;
  }
  return name + "StageOptions";
}

void bind_status(py::module_& module) {
  py::class_<ManifestOutput>(module, "ManifestOutput", "One file that a stage made.")
      .def_readonly("path", &ManifestOutput::path, "inside the result's folder")
      .def_readonly("size", &ManifestOutput::size, "bytes");
  py::class_<Manifest>(module, "Manifest", "Record of a finished stage.")
      .def_readonly("stage", &Manifest::stage)
      .def_readonly("stage_version", &Manifest::stage_version)
      .def_readonly("outputs", &Manifest::outputs)
      .def_readonly("consent", &Manifest::consent)
      .def_readonly("metrics", &Manifest::metrics, "numbers by name")
      .def_readonly("warnings", &Manifest::warnings)
      .def_readonly("started", &Manifest::started)
      .def_readonly("finished", &Manifest::finished)
      .def_readonly("work_seconds", &Manifest::work_seconds)
      .def_property_readonly(
          "options",
          [](const Manifest& self) {
            const py::object loads = py::module_::import("json").attr("loads");
            py::dict values;
            for (const ManifestOption& one : self.options) {
              values[py::str(one.name)] = loads(one.json);
            }
            return values;
          },
          "values by name (\"xpbd.substeps\")");
  py::class_<StageStatus>(module, "StageStatus", "How one stage stands in a workspace.")
      .def_readonly("stage", &StageStatus::stage)
      .def_property_readonly(
          "state", [](const StageStatus& self) -> std::string { return state_name(self.state); },
          "\"none\", \"unfinished\", \"done\", \"outdated\", \"newer\" or \"damaged\"")
      .def_readonly("manifest", &StageStatus::manifest)
      .def_readonly("reasons", &StageStatus::reasons, "why it is outdated")
      .def_readonly("findings", &StageStatus::findings, "how it is damaged")
      .def_readonly("running", &StageStatus::running)
      .def("__repr__", [](const StageStatus& self) {
        return "<StageStatus of " + self.stage + ": " + state_name(self.state) + ">";
      });
  module.def(
      "stage_names",
      [] {
        std::vector<std::string> names;
        for (const Stage& stage : all_stages()) {
          names.emplace_back(stage.name);
        }
        return names;
      },
      "Every stage, in the order of the pipeline.");
  module.def(
      "workspace_status",
      [](const Path& workspace, bool digests) {
        return workspace_status(all_stages(), workspace, digests ? Check::Digests : Check::Sizes);
      },
      "workspace"_a, "digests"_a = false, py::call_guard<LongCall>(),
      "Every stage of a workspace; with `digests` every byte is compared.");
  module.def(
      "result_folder",
      [](const Path& workspace, const std::string& stage) {
        const Path folder = results_of_stage(workspace, stage_of(stage).name);
        const std::optional<std::string> current = current_name(folder);
        if (!current) {
          throw DataError(workspace.string(), stage, "no result",
                          "one that the stage has made; run it");
        }
        return folder / *current;
      },
      "workspace"_a, "stage"_a, "Folder of a stage's current result; DataError if there is none.");
  module.def(
      "read_manifest",
      [](const Path& folder, const std::string& stage) {
        return read_manifest(folder, stage_of(stage).name);
      },
      "folder"_a, "stage"_a, py::call_guard<LongCall>(), "That of a result's folder.");
}

/// A StageReport without the locks of its plan.
struct RunReport {
  std::string end;
  Manifest manifest;
  bool input_errors = false;
  std::int64_t frames_done = 0;
  std::int64_t frames_total = 0;
  Path folder;
};

std::string end_name(StageReport::End end) {
  switch (end) {
    case StageReport::End::AlreadyDone:
      return "already_done";
    case StageReport::End::Done:
      return "done";
    case StageReport::End::Partial:
      return "partial";
    case StageReport::End::Stopped:
      break;
  }
  return "stopped";
}

/// What a run tells Python.
StageEvents events_of(const py::object& progress, const py::object& say,
                      const std::atomic<bool>& stop) {
  StageEvents events;
  events.stop = [&stop] { return stop.load(); };
  if (!progress.is_none()) {
    events.progress = [&progress](const StageProgress& now) {
      const py::gil_scoped_acquire lock;
      progress(now.done, now.total, now.unit);
    };
  }
  if (!say.is_none()) {
    events.say = [&say](const std::string& line) {
      const py::gil_scoped_acquire lock;
      say(line);
    };
  }
  return events;
}

/// Runs the stage in a thread of its own, so that this one hears of signals wherever the work is:
/// it then ends cleanly, and what the signal's handler raised is thrown.
RunReport run_interruptibly(const Stage& stage, const StageRequest& request,
                            const py::object& progress, const py::object& say) {
  std::atomic<bool> stop{false};
  std::optional<py::error_already_set> raised;
  auto report = std::async(std::launch::async, [&] {
    return run_stage(all_stages(), stage, request, events_of(progress, say, stop));
  });
  while (report.wait_for(std::chrono::milliseconds(50)) != std::future_status::ready) {
    const py::gil_scoped_acquire lock;
    if (PyErr_CheckSignals() != 0) {
      raised.emplace();
      stop = true;
    }
  }
  if (raised) {
    throw py::error_already_set(*raised);
  }
  StageReport done = report.get();
  return {end_name(done.end), std::move(done.manifest), done.input_errors,
          done.frames_done,   done.frames_total,        done.plan.result_folder};
}

RunReport run_one(const std::string& name, const Path& input, const Path& workspace,
                  const py::object& options, const std::string& frames, int jobs,
                  const std::string& device, bool force, const py::object& progress,
                  const py::object& say) {
  const Stage& stage = stage_of(name);
  StageRequest request;
  request.input = input;
  request.workspace = workspace;
  request.options = stage.options();
  set_options(request.options.table, options);
  request.jobs = jobs;
  request.device = device_of(device);
  request.force = force;
  if (request.device == Device::Cuda && !stage.has_cuda) {
    throw UsageError("device cannot be 'cuda': " + name + " works on the processor alone");
  }
  if (!frames.empty()) {
    if (const std::string problem = set_frames(request.selection, frames); !problem.empty()) {
      throw UsageError(problem);
    }
  }
  const py::gil_scoped_release released;
  request.workspace = workspace_place(request.workspace);
  if (is_inside_input(request)) {
    throw UsageError("workspace cannot be '" + workspace.string() +
                     "': a workspace inside its own input would change it");
  }
  if (const std::string problem = workspace_problem(all_stages(), request.workspace);
      !problem.empty()) {
    throw UsageError("workspace cannot be '" + workspace.string() + "': " + problem);
  }
  if (!say.is_none()) {
    for (const std::string& line : outdated_inputs(stage, request)) {
      const py::gil_scoped_acquire lock;
      say("warning: " + line);
    }
  }
  return run_interruptibly(stage, request, progress, say);
}

void bind_runs(py::module_& module) {
  py::class_<RunReport>(module, "StageReport", "Outcome of a run.")
      .def_readonly("end", &RunReport::end,
                    "\"already_done\", \"done\", \"partial\" or \"stopped\"")
      .def_readonly("manifest", &RunReport::manifest)
      .def_readonly("input_errors", &RunReport::input_errors, "the INPUT is no good")
      .def_readonly("frames_done", &RunReport::frames_done)
      .def_readonly("frames_total", &RunReport::frames_total)
      .def_readonly("folder", &RunReport::folder, "of the result");
  module.def(
      "run_stage", &run_one, "stage"_a, "input"_a, "workspace"_a, "options"_a = py::none(),
      "frames"_a = "", "jobs"_a = 0, "device"_a = "cpu", "force"_a = false,
      "progress"_a = py::none(), "say"_a = py::none(),
      "Does what is to be done so that a stage's result is there and current. `options`: the "
      "stage's dataclass or a dict; `frames`: \"a:b\"; `progress(done, total, unit)` and "
      "`say(line)` are called on the way. Ctrl-C ends it; finished frames are kept.");
}

}  // namespace

void bind_workspace(py::module_& module) {
  module.def(
      "set_program_folder", &set_program_folder, "folder"_a,
      "Where `atelier-appearance` lies, which trains and draws networks for some stages. Found by "
      "itself where it is on the PATH.");
  for (const Stage& stage : all_stages()) {
    add_options_class(options_class_of(stage), stage.options);
  }
  bind_status(module);
  bind_runs(module);
}

}  // namespace atelier::python
