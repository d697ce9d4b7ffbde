#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <iostream>
#include <memory>

#include "apps/command.h"
#include "apps/exit_code.h"
#include "apps/output_place.h"
#include "apps/printable.h"
#include "apps/stage_console.h"
#include "apps/stages.h"
#include "apps/usage_error.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/mesh_file.h"
#include "core/io/mesh_gltf.h"
#include "core/io/usd_sequence.h"
#include "core/sequence_archive.h"
#include "core/store/workspace_status.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

constexpr const char* kHeader = "sequence.h5";
constexpr std::int64_t kLargestCopy = std::int64_t{1} << 32;

struct ExportArguments {
  std::string workspace;
  std::string out;
  std::string stage;
  std::string format = "ply";
};

/// The folders of mesh sequences in a result, relative to it.
std::vector<fs::path> sequences_of(const Manifest& manifest) {
  std::vector<fs::path> folders;
  for (const ManifestOutput& output : manifest.outputs) {
    if (fs::path(output.path).filename() == kHeader) {
      folders.push_back(fs::path(output.path).parent_path());
    }
  }
  return folders;
}

bool is_below(const fs::path& path, const fs::path& folder) {
  const fs::path relative = path.lexically_relative(folder);
  return !relative.empty() && *relative.begin() != "..";
}

std::string export_sequence(const fs::path& folder, const fs::path& out,
                            const std::string& format) {
  const Sequence sequence = open_sequence(folder);
  const Index count = frame_count(sequence);
  if ((format == "glb" || format == "usda") && sequence.faces.rows() == 0) {
    throw UsageError("--format " + format +
                     " cannot hold frames that differ in topology; take ply or obj");
  }
  make_private_directory(out.parent_path());
  if (format == "usda") {
    write_usd_sequence(out.string() + ".usda", sequence, out.filename().string());
    return out.string() + ".usda, " + counted(count, "frame");
  }
  if (format == "glb") {
    std::vector<Mesh> frames;
    for (Index i = 0; i < count; ++i) {
      frames.push_back(frame(sequence, i));
    }
    write_gltf(out.string() + ".glb", gltf_morph_sequence(frames, sequence.fps));
    return out.string() + ".glb, " + counted(count, "frame");
  }
  make_private_directory(out);
  for (Index i = 0; i < count; ++i) {
    char name[32];
    std::snprintf(name, sizeof name, "%06d.", sequence.frame_ids[static_cast<std::size_t>(i)]);
    write_mesh(out / (name + format), frame(sequence, i));
  }
  return out.string() + ", " + counted(count, format + " file");
}

/// Exports one sound result; says what it wrote.
void export_result(const StageStatus& status, const fs::path& workspace, const fs::path& out,
                   const std::string& format) {
  const Manifest& manifest = *status.manifest;
  const fs::path result = workspace / status.stage / folder_name(manifest.key);
  const fs::path place = out / status.stage;
  if (fs::exists(place)) {
    throw UsageError(place.string() +
                     " is there already; remove it, or name another folder for the export");
  }
  const std::string consent = to_string(manifest.consent);
  make_private_directory(place);
  write_file_atomically(place / "consent.txt", "consent: " + consent + "\n");
  const std::vector<fs::path> sequences = sequences_of(manifest);
  for (const fs::path& folder : sequences) {
    std::cout << printable(export_sequence(result / folder, place / folder, format)) << "\n";
  }
  std::int64_t copied = 0;
  for (const ManifestOutput& output : manifest.outputs) {
    if (std::any_of(sequences.begin(), sequences.end(),
                    [&](const fs::path& folder) { return is_below(output.path, folder); })) {
      continue;
    }
    make_private_directory((place / output.path).parent_path());
    write_file_atomically(place / output.path, read_file_text(result / output.path, kLargestCopy));
    ++copied;
  }
  if (copied > 0) {
    std::cout << printable(place.string()) << ", " << counted(copied, "file") << " as they are\n";
  }
  std::cout << "  consent: " << printable(consent) << "\n";
}

/// Results are not written among results.
void refuse_inside(const fs::path& out, const fs::path& workspace) {
  const fs::path relative = fs::weakly_canonical(out).lexically_relative(fs::canonical(workspace));
  if (!relative.empty() && *relative.begin() != "..") {
    throw UsageError("OUT lies in the WORKSPACE; name a folder outside of it");
  }
}

int run(const ExportArguments& arguments) {
  if (arguments.workspace.empty() || arguments.out.empty()) {
    throw UsageError("it takes a WORKSPACE and a folder: atelier export WORKSPACE OUT");
  }
  constexpr std::array kFormats = {"ply", "obj", "glb", "usda"};
  if (std::find(kFormats.begin(), kFormats.end(), arguments.format) == kFormats.end()) {
    throw UsageError("--format is '" + arguments.format.substr(0, 40) +
                     "': it takes ply, obj, glb or usda");
  }
  if (!arguments.stage.empty() && find_stage(all_stages(), arguments.stage) == nullptr) {
    throw UsageError("--stage is '" + arguments.stage.substr(0, 40) +
                     "': there is no such stage; atelier --help lists them");
  }
  const std::vector<StageStatus> all =
      workspace_status(all_stages(), arguments.workspace, Check::Digests);
  require_folder_place(arguments.out);
  refuse_inside(arguments.out, arguments.workspace);
  int exported = 0;
  for (const StageStatus& status : all) {
    if (!arguments.stage.empty() && status.stage != arguments.stage) {
      continue;
    }
    if (status.state == StageStatus::State::Damaged) {
      throw DataError(
          arguments.workspace, status.stage, "a result that is damaged",
          "a sound one; atelier status says more, the stage with --force makes it anew");
    }
    if (!status.manifest) {
      continue;
    }
    for (const std::string& reason : status.reasons) {
      std::cout << status.stage << " is outdated: " << printable(reason) << "\n";
    }
    export_result(status, arguments.workspace, arguments.out, arguments.format);
    ++exported;
  }
  if (exported == 0) {
    throw DataError(arguments.workspace, arguments.stage, "no finished result",
                    "one; atelier status lists what there is");
  }
  return kExitDone;
}

}  // namespace

Action add_export(CLI::App& parser) {
  auto arguments = std::make_shared<ExportArguments>();
  parser.add_option("WORKSPACE", arguments->workspace, "Folder of results")->required();
  parser.add_option("OUT", arguments->out, "Folder to write to, one folder in it a stage")
      ->required();
  parser.add_option("--stage", arguments->stage, "Of this stage only [all that are done]");
  parser.add_option(
      "--format", arguments->format,
      "Of mesh sequences: ply, obj (a file a frame), glb (morph targets), usda [ply]");
  return [arguments] { return run(*arguments); };
}

}  // namespace atelier
