#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "apps/commands/opened_workspace.h"
#include "apps/commands/view_server.h"
#include "apps/console/arguments.h"
#include "apps/console/command.h"
#include "apps/console/interrupt.h"
#include "apps/console/option_flags.h"
#include "capture/layouts/open_dataset.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/exit_code.h"
#include "core/io/polygon_mesh.h"
#include "core/parallel.h"
#include "core/printable.h"
#include "core/seal/sealed_file.h"
#include "core/store/consent_file.h"
#include "core/store/output_place.h"
#include "core/store/unfinished_folder.h"
#include "core/store/workspace_status.h"
#include "core/usage_error.h"
#include "core/writable_place.h"
#include "pipeline/sealing/consent_check.h"
#include "pipeline/sealing/sealed_subject.h"
#include "pipeline/stages/stages.h"
#include "pipeline/view/view_beside.h"
#include "pipeline/view/view_meshes.h"
#include "pipeline/view/view_place.h"
#include "pipeline/view/view_sequences.h"
#include "pipeline/view/view_workspace.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

struct ViewArguments {
  std::string place;
  std::optional<std::string> beside;
  std::optional<std::string> out;
  KeyArguments keys;
};

struct ViewCommandOptions {
  int port = 0;
  ViewPageOptions page;
  DatasetOptions capture;
  MeshConvention input{.metres_per_unit = 1, .up = 'y'};  ///< of files that do not say
  ConsentUse use;
};

OptionTable describe(ViewCommandOptions& options) {
  OptionTable table;
  table.add("port", options.port, 0, 65535, "",
            "Port of the page's address on this machine; 0: any that is free");
  table.add(describe(options.page));
  table.add("capture", describe(options.capture));
  table.add("input", describe(options.input));
  table.add(describe(options.use));
  return table;
}

/// What somebody set of unit and axis of files that do not say them.
MeshConvention set_convention(const OptionTable& table, const MeshConvention& input) {
  MeshConvention set;
  for (const OptionField& field : table.fields) {
    if (field.source != "default" && field.name == "input.up") {
      set.up = input.up;
    } else if (field.source != "default" && field.name == "input.unit") {
      set.metres_per_unit = input.metres_per_unit;
    }
  }
  return set;
}

/// What is at one place, once those whom it shows have consented.
/// @param set  of options.input
ViewScene scene_of(const std::string& place, const ViewCommandOptions& options,
                   const MeshConvention& set) {
  std::vector<Consent> consent;
  std::function<ViewScene()> open;
  switch (view_kind(place, all_stages())) {
    case ViewKind::Workspace: {
      const auto stages =
          std::make_shared<std::vector<StageStatus>>(workspace_status(all_stages(), place));
      for (const StageStatus& status : *stages) {
        add_consent(consent, consent_of(status));
      }
      open = [place, stages] { return view_of_workspace(place, *stages); };
      break;
    }
    case ViewKind::Capture: {
      if (options.capture.layout == "auto") {
        require_capture(place);
      }
      Dataset dataset = open_dataset(place, options.capture);
      consent = dataset.info.consent;
      open = [dataset = std::move(dataset)] { return view_of_capture(dataset); };
      break;
    }
    case ViewKind::Sequences:
      consent = read_consent(place);
      open = [place] { return view_of_sequences(place); };
      break;
    case ViewKind::MeshFrames:
      consent = read_consent(place);
      open = [place, set, input = options.input] { return view_of_mesh_frames(place, input, set); };
      break;
    case ViewKind::Mesh:
      consent = read_consent(place);
      open = [place, set, input = options.input] { return view_of_mesh(place, input, set); };
      break;
  }
  for (const std::string& doubt : require_consent(consent, options.use)) {
    std::cout << "warning: " << printable(doubt) << std::endl;
  }
  ViewScene scene = open();
  for (const std::string& note : scene.notes) {
    std::cout << "note: " << printable(note) << std::endl;
  }
  return scene;
}

void write_page(const ViewPage& page, const fs::path& out) {
  const UnfinishedFolder folder(out);
  make_private_directory(folder.content());
  std::vector<const ViewPage::value_type*> files;
  for (const auto& file : page) {
    files.push_back(&file);
    make_private_directory((folder.content() / file.first).parent_path());
  }
  // By their numbers: the frames of a video are read one after the other.
  std::sort(files.begin(), files.end(), [](const auto* a, const auto* b) {
    return strverscmp(a->first.c_str(), b->first.c_str()) < 0;
  });
  parallel_for(static_cast<Index>(files.size()), 1, [&](Index begin, Index end) {
    for (Index i = begin; i < end && !interrupted(); ++i) {
      const auto& [name, file] = *files[static_cast<std::size_t>(i)];
      if (file.bytes) {
        write_file_atomically(folder.content() / name, file.bytes());
      } else {
        fs::copy_file(file.path, folder.content() / name);
      }
    }
  });
  if (!interrupted()) {
    folder.finish();
  }
}

void refuse_empty(const ViewArguments& arguments) {
  if (arguments.place.empty()) {
    throw UsageError(
        "view takes a WORKSPACE, a CAPTURE or a FILE: atelier view WORKSPACE, or, for a folder of "
        "files to be opened without Atelier, atelier view WORKSPACE --out FOLDER");
  }
  const auto refuse = [](const std::optional<std::string>& given, const std::string& flag) {
    if (given && given->empty()) {
      throw UsageError(flag + " is empty; name a place, or leave it out");
    }
  };
  refuse(arguments.beside, "--beside");
  refuse(arguments.out, "--out");
  if (arguments.beside && is_sealed_file(*arguments.beside)) {
    throw UsageError("--beside takes no sealed workspace: name the sealed one first, as PLACE");
  }
}

/// Refuses a folder for the page in what the page shows.
void require_outside(const std::string& out, const std::string& place) {
  require_outside_results(out, place, all_stages(), "--out");
  switch (view_kind(place, all_stages())) {
    case ViewKind::Capture:
      require_outside_input(out, place, "--out", "the capture");
      break;
    case ViewKind::Sequences:
      require_outside_input(out, place, "--out", "the sequence");
      break;
    case ViewKind::MeshFrames:
      if (fs::is_directory(place)) {
        require_outside_input(out, place, "--out", "the sequence");
      }
      break;
    case ViewKind::Workspace:
    case ViewKind::Mesh:
      break;
  }
}

/// Refuses options that were said and do nothing to what is shown.
void require_used(const OptionTable& table, const ViewArguments& arguments) {
  std::vector<ViewKind> kinds = {view_kind(arguments.place, all_stages())};
  if (arguments.beside) {
    kinds.push_back(view_kind(*arguments.beside, all_stages()));
  }
  const auto shows = [&](ViewKind kind) {
    return std::find(kinds.begin(), kinds.end(), kind) != kinds.end();
  };
  for (const OptionField& field : table.fields) {
    if (field.source == "default") {
      continue;
    }
    if (field.name.starts_with("capture.") && !shows(ViewKind::Capture)) {
      throw UsageError(with_typed_flags(
          field.name +
          " does nothing: it says how a capture is read, and none is shown; leave it out"));
    }
    if (field.name.starts_with("input.") && !shows(ViewKind::Mesh) &&
        !shows(ViewKind::MeshFrames)) {
      throw UsageError(with_typed_flags(
          field.name +
          " does nothing: it is for files of other programs, and none is shown; leave "
          "it out"));
    }
    if (field.name == "image_width" && !shows(ViewKind::Capture) && !shows(ViewKind::Workspace)) {
      throw UsageError("--image-width does nothing: meshes have no cameras; leave it out");
    }
  }
}

int run(ViewArguments arguments, const OptionSet& set) {
  const auto& options = options_of<ViewCommandOptions>(set);
  refuse_empty(arguments);
  const std::string named = arguments.place;
  std::optional<OpenedWorkspace> opened;
  if (is_sealed_file(arguments.place) || arguments.keys.any() ||
      view_kind(arguments.place, all_stages()) == ViewKind::Workspace) {
    opened.emplace(arguments.place, arguments.keys);
    arguments.place = opened->path();
  }
  require_used(set.table, arguments);
  if (arguments.out) {
    require_new_place(*arguments.out, "--out");
    require_outside(*arguments.out, arguments.place);
    if (arguments.beside) {
      require_outside(*arguments.out, *arguments.beside);
    }
    if (options.port != 0) {
      throw UsageError(
          "--port does nothing with --out, which serves nothing; leave one of them out");
    }
    require_folder_place(*arguments.out);
  }
  catch_interrupts();
  ViewScene scene = scene_of(arguments.place, options, set_convention(set.table, options.input));
  if (arguments.place != named) {  // what is sealed lies in a folder without a name of its own
    scene.title = fs::path(named).filename().string();
  }
  if (arguments.beside) {
    ViewScene other =
        scene_of(*arguments.beside, options, set_convention(set.table, options.input));
    const std::array<std::string, 2> names = scene.title == other.title
                                                 ? names_apart(named, *arguments.beside)
                                                 : std::array{scene.title, other.title};
    put_beside(scene, std::move(other), names);
  }
  ViewPage page = view_page(std::move(scene), options.page);
  if (opened) {
    opened->log("view", arguments.out.value_or("in a browser") + ", for " + options.use.purpose);
  }
  if (arguments.out) {
    write_page(page, *arguments.out);
    if (interrupted()) {
      end_by_signal();
    }
    std::cout << printable((fs::path(*arguments.out) / "index.html").string()) << ": "
              << counted(static_cast<std::int64_t>(page.size()), "file")
              << "; a browser opens it from the disk or from any web server\n";
    return kExitDone;
  }
  const ViewServer server(std::move(page), options.port);
  std::cout << server.address() << std::endl
            << "Open this address in a browser on this machine; Ctrl-C ends." << std::endl;
  constexpr auto kPause = std::chrono::milliseconds(100);
  while (!interrupted()) {
    std::this_thread::sleep_for(kPause);
  }
  return kExitDone;
}

}  // namespace

OptionSet view_options() {
  return option_set<ViewCommandOptions>();
}

Action add_view(CLI::App& parser) {
  auto arguments = std::make_shared<ViewArguments>();
  add_option(parser, "PLACE", arguments->place,
             "Workspace, capture, sequence of meshes, mesh, or sealed workspace")
      .required()
      .type_name("WORKSPACE|CAPTURE|FILE");
  add_option(
      parser, "--beside", [arguments](const std::string& place) { arguments->beside = place; },
      "Another one, shown beside it with one camera")
      .type_name("WORKSPACE|CAPTURE|FILE");
  add_option(
      parser, "--out", [arguments](const std::string& folder) { arguments->out = folder; },
      "New folder for the page as files that a browser opens without Atelier [served at an "
      "address of this machine]")
      .type_name("FOLDER");
  add_key_arguments(parser, arguments->keys);
  const OptionReader options = add_option_flags(parser, view_options());
  return [arguments, options] { return run(*arguments, options()); };
}

}  // namespace atelier
