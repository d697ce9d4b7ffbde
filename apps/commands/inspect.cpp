#include <iostream>
#include <memory>

#include "apps/console/arguments.h"
#include "apps/console/command.h"
#include "core/exit_code.h"
#include "core/io/json_text.h"
#include "core/usage_error.h"
#include "pipeline/inspection/inspection.h"
#include "pipeline/stages/stages.h"

namespace atelier {
namespace {

int run(const std::string& file, bool as_json) {
  if (file.empty()) {
    throw UsageError("inspect takes a FILE: atelier inspect FILE");
  }
  const Inspection inspection = inspect_path(file, all_stages());
  const int code = has_errors(inspection.findings) ? kExitBadData : kExitDone;
  std::cout << (as_json ? json_text(json_of(inspection), 1) + "\n" : text_of(inspection));
  return code;
}

}  // namespace

Action add_inspect(CLI::App& parser) {
  auto file = std::make_shared<std::string>();
  auto json = std::make_shared<bool>(false);
  add_option(
      parser, "FILE", *file,
      "Mesh, image, video, drawing, npy, npz, safetensors, HDF5, JSON, TOML, body, motion, or "
      "a folder of a result, sequence, capture or meshes")
      .required();
  add_flag(parser, "--json", *json, "Output as JSON, for programs");
  return [file, json] { return run(*file, *json); };
}

}  // namespace atelier
