#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "apps/console/arguments.h"
#include "apps/console/stand_alone.h"
#include "apps/console/standard_streams.h"
#include "core/atomic_file.h"
#include "core/exit_code.h"
#include "core/io/json_text.h"
#include "core/printable.h"
#include "core/store/output_place.h"
#include "core/usage_error.h"
#include "core/writable_place.h"
#include "pipeline/pattern/flatten_files.h"
#include "pipeline/pattern/flatten_relax.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// Values of the flags; a text that was not given is none.
struct FlattenFlags {
  std::optional<std::string> mesh, out;
  bool no_pictures = false;
};

std::string first_flatten_flag(const FlattenFlags& flags) {
  return flags.mesh ? "--mesh" : flags.no_pictures ? "--no-pictures" : flags.out ? "--out" : "";
}

int flatten_alone(const FlattenFlags& flags, const StandAloneRequest& request) {
  const auto& options = options_of<FlattenStageOptions>(request.options);
  if (flags.mesh.value_or("").empty() || flags.out.value_or("").empty()) {
    throw UsageError(
        "flatten without a workspace takes --mesh and --out: atelier flatten --mesh MESH --out "
        "FOLDER");
  }
  const fs::path out = *flags.out;
  require_new_place(out, "--out");
  require_folder_place(out);
  FlattenWatcher watcher;
  watcher.say = [&](const std::string& line) {
    (request.json ? standard_error() : std::cout) << printable(line) << std::endl;
  };
  watcher.warn = [&](const Finding& finding) { watcher.say(to_string(finding)); };
  watcher.relaxed = [&](int round, int rounds, double error) {
    char text[100];
    std::snprintf(text, sizeof text,
                  "round %d of at most %d: hangs %.2f mm from the captured shape", round, rounds,
                  1000 * error);
    watcher.say(text);
  };
  watcher.stopped = [] { return false; };
  const fs::path mesh = *flags.mesh;
  const FlattenGarment garment{mesh, template_note(template_file(mesh), mesh.stem().string()),
                               worn_folder(mesh.parent_path(), mesh)};
  require_relaxable(options, {garment});
  require_sewable(options, {garment});
  const FlattenedGarment flat = flatten_garment(garment, options, watcher);
  make_private_directory(out);
  const std::string title = fs::path(*flags.mesh).stem().string();
  for (const FlattenFile& file : flatten_files(flat, title, options, !flags.no_pictures)) {
    write_file_atomically(out / file.name, file.bytes);
  }
  if (request.json) {
    std::cout << json_text(json_of(flat)) << "\n";
  } else {
    std::cout << summary_of(flat) << "\n" << out.string() << "\n";
  }
  const bool as_asked =
      flat.reached && flat.relaxed && flat.equal && flat.sewable && flat.measures.overlaps == 0;
  return as_asked ? kExitDone : kExitNotConverged;
}

}  // namespace

StandAloneWork add_flatten_alone(CLI::App& parser) {
  auto flags = std::make_shared<FlattenFlags>();
  add_option(
      parser, "--mesh", [flags](const std::string& text) { flags->mesh = text; },
      "Without a workspace: surface of the garment")
      .type_name("MESH");
  add_option(
      parser, "--out", [flags](const std::string& text) { flags->out = text; },
      "New folder for pattern.svg, pattern.dxf, its dialects, pattern.val, pattern.json, "
      "garment.obj, "
      "stretch.png and, of a pattern sewn anew, sewn.obj and sewn.png")
      .type_name("FOLDER");
  add_flag(parser, "--no-pictures", flags->no_pictures, "No stretch.png and sewn.png");
  return {[flags] { return first_flatten_flag(*flags); },
          [flags](const StandAloneRequest& request) { return flatten_alone(*flags, request); }};
}

}  // namespace atelier
