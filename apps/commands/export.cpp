#include <cerrno>
#include <cstdio>
#include <ctime>
#include <iostream>
#include <memory>
#include <set>
#include <system_error>

#include <unistd.h>

#include "apps/commands/opened_workspace.h"
#include "apps/console/arguments.h"
#include "apps/console/command.h"
#include "apps/console/option_flags.h"
#include "apps/console/stage_console.h"
#include "capture/layouts/open_dataset.h"
#include "capture/layouts/write_layout.h"
#include "core/archive.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/exit_code.h"
#include "core/io/mesh_file.h"
#include "core/io/mesh_gltf.h"
#include "core/io/one_file_sequence.h"
#include "core/io/usd_sequence.h"
#include "core/new_folders.h"
#include "core/normals.h"
#include "core/printable.h"
#include "core/regular_file.h"
#include "core/sequence_archive.h"
#include "core/store/consent_file.h"
#include "core/store/consent_refused.h"
#include "core/store/output_place.h"
#include "core/store/result.h"
#include "core/store/workspace_folder.h"
#include "core/store/workspace_status.h"
#include "core/system_reason.h"
#include "core/usage_error.h"
#include "core/writable_place.h"
#include "pipeline/animation/export_motion.h"
#include "pipeline/sealing/consent_check.h"
#include "pipeline/sealing/sealed_subject.h"
#include "pipeline/stages/stages.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

constexpr const char* kHeader = "sequence.h5";
constexpr const char* kMeshSchema = "atelier.mesh";
constexpr const char* kEveryStage = "all";
constexpr const char* kNone = "none";

enum class ExportFormat { Ply, Obj, Glb, Usda, Hdf5 };

struct ExportArguments {
  std::string workspace;
  std::string out;
  KeyArguments keys;
};

struct ExportOptions {
  std::string stage = kEveryStage;
  ExportFormat format = ExportFormat::Ply;
  std::string cameras = kNone;  ///< a layout of captures, or none
  bool ended_consent = false;   ///< export what is of people whose consent is over
  ConsentUse use;
};

/// Layouts that cameras are exported in.
std::vector<std::string> camera_layouts() {
  std::vector<std::string> layouts = {kNone};
  layouts.insert(layouts.end(), layout_names().begin(), layout_names().end());
  return layouts;
}

OptionTable describe(ExportOptions& options) {
  std::vector<std::string> stages = {kEveryStage};
  for (const Stage& stage : all_stages()) {
    stages.emplace_back(stage.name);
  }
  return OptionTable()
      .add("stage", options.stage, std::move(stages),
           "Stage whose results are exported; all: every stage with results")
      .add("format", options.format,
           {{"ply", ExportFormat::Ply},
            {"obj", ExportFormat::Obj},
            {"glb", ExportFormat::Glb},
            {"usda", ExportFormat::Usda},
            {"h5", ExportFormat::Hdf5}},
           "Format of meshes: ply and obj write a file for each frame; glb, usda and h5 write one "
           "file for a sequence of one topology (usda and h5 leave single meshes as ply)")
      .add("cameras", options.cameras, camera_layouts(),
           "Layout in which the capture's cameras and the images of one instant are exported too; "
           "the capture must still be at its place")
      .add("ended_consent", options.ended_consent,
           "Export of results whose consent has ended, which is refused otherwise")
      .add(describe(options.use));
}

/// Of single meshes, which USD files are not written of.
const char* mesh_extension(ExportFormat format) {
  switch (format) {
    case ExportFormat::Obj:
      return ".obj";
    case ExportFormat::Glb:
      return ".glb";
    case ExportFormat::Ply:
    case ExportFormat::Usda:
    case ExportFormat::Hdf5:
      break;
  }
  return ".ply";
}

/// What of a scene is not exact, a line each.
std::string notes_of(const GltfScene& scene) {
  std::string lines;
  for (const Finding& finding : scene.findings) {
    lines += "  " + printable(finding.place + ": " + finding.what + "; " + finding.advice) + "\n";
  }
  return lines;
}

/// How meshes are written, and whose consent goes with them.
struct MeshExport {
  ExportFormat format = ExportFormat::Ply;
  std::string consent;
};

/// Writes one sequence, `out` with an extension or as a folder; says what it wrote.
std::string export_sequence(const Sequence& sequence, const fs::path& out, const MeshExport& how) {
  const ExportFormat format = how.format;
  const Index count = frame_count(sequence);
  const bool one_topology = sequence.faces.rows() > 0;
  make_private_directory(out.parent_path());
  if (format == ExportFormat::Usda && one_topology) {
    write_usd_sequence(out.string() + ".usda", sequence, out.filename().string());
    return printable(out.string() + ".usda") + ", " + counted(count, "frame") + "\n";
  }
  if (format == ExportFormat::Hdf5 && one_topology) {
    write_one_file_sequence(out.string() + ".h5", sequence);
    return printable(out.string() + ".h5") + ", " + counted(count, "frame") + "\n";
  }
  if (format == ExportFormat::Glb && one_topology) {
    std::vector<Mesh> frames;
    for (Index i = 0; i < count; ++i) {
      frames.push_back(frame(sequence, i));
    }
    GltfScene scene = gltf_morph_sequence(frames, sequence.fps, out.filename().string());
    scene.consent = how.consent;
    write_gltf(out.string() + ".glb", scene);
    std::string said = printable(out.string() + ".glb") + ", " + counted(count, "frame") + "\n";
    return said + notes_of(scene);
  }
  const std::string extension = mesh_extension(format);
  make_private_directory(out);
  for (Index i = 0; i < count; ++i) {
    char name[32];
    std::snprintf(name, sizeof name, "%06d", sequence.frame_ids[static_cast<std::size_t>(i)]);
    write_mesh(out / (name + extension), frame(sequence, i));
  }
  return printable(out.string()) + ", " + counted(count, extension + " file") + "\n";
}

/// Writes a mesh that is no frame, `to` with an extension.
void export_mesh(Mesh mesh, fs::path to, const MeshExport& how) {
  to.replace_extension(mesh_extension(how.format));
  if (how.format != ExportFormat::Glb) {
    write_mesh(to, mesh);
    return;
  }
  if (mesh.normals.rows() == 0) {  // or programs show every triangle flat
    mesh.normals = vertex_normals(mesh.vertices, mesh.faces);
  }
  GltfScene scene = gltf_scene(mesh, to.stem().string());
  scene.consent = how.consent;
  write_gltf(to, scene);
}

/// Exports every sequence of a result, and takes its files from `rest`.
void export_sequences(const fs::path& result, const fs::path& place, const MeshExport& how,
                      std::set<fs::path>& rest) {
  const std::set<fs::path> all = rest;
  for (const fs::path& header : all) {
    if (header.filename() != kHeader) {
      continue;
    }
    const fs::path folder = header.parent_path();
    const Sequence sequence = open_sequence(result / folder);
    rest.erase(header);
    for (const int frame_id : sequence.frame_ids) {
      rest.erase(sequence_frame_path(folder, frame_id));
    }
    // One that lies at the result's root has no name of its own.
    const fs::path out = place / (folder.empty() ? fs::path("sequence") : folder);
    std::cout << export_sequence(sequence, out, how);
  }
}

bool is_mesh_archive(const fs::path& path) {
  return path.extension() == ".h5" && archive_contents(path).schema == kMeshSchema;
}

/// The same bytes under another name, a piece at a time: results may be larger than memory.
void copy_bytes(const fs::path& from, const fs::path& to) {
  constexpr std::size_t kPiece = std::size_t{1} << 20;
  const RegularFile source(from);
  AtomicFile copy(to);
  std::vector<std::byte> piece(kPiece);
  while (true) {
    const ssize_t got = read(source.descriptor(), piece.data(), piece.size());
    if (got == 0) {
      break;
    }
    if (got < 0 && errno != EINTR) {
      throw EnvironmentError(from.string(), "cannot read: " + system_reason(errno));
    }
    copy.write(std::span(piece).first(static_cast<std::size_t>(std::max<ssize_t>(got, 0))));
  }
  copy.commit();
}

/// Takes away again what an export has made that was refused on its way, so that the next one finds
/// the place free.
class ExportGuard {
 public:
  explicit ExportGuard(const fs::path& out) : above_(out) {}
  ~ExportGuard() {
    if (armed_) {
      std::error_code ignored;
      for (const fs::path& place : places_) {
        fs::remove_all(place, ignored);
      }
      above_.remove_empty();
    }
  }
  ExportGuard(const ExportGuard&) = delete;
  ExportGuard& operator=(const ExportGuard&) = delete;

  /// A folder that is not there yet.
  void add(const fs::path& place) { places_.push_back(place); }
  void release() { armed_ = false; }

 private:
  NewFolders above_;
  std::vector<fs::path> places_;
  bool armed_ = true;
};

/// "warning: ..." for each consent that has ended or changed since, a line each.
std::string consent_warnings(const StageStatus& status) {
  std::string lines;
  for (const Finding& finding : status.findings) {
    if (finding.code == "consent-ended" || finding.code == "consent-changed") {
      lines += "warning: " + finding.what + "; " + finding.advice + "\n";
    }
  }
  return lines;
}

/// Refuses results of people who have not consented to the use, or whose consent is over unless
/// that is allowed. Throws ConsentRefused.
void require_consent_to(const std::vector<const StageStatus*>& chosen,
                        const ExportOptions& options) {
  std::vector<Consent> all;
  for (const StageStatus* status : chosen) {
    add_consent(all, consent_of(*status));
  }
  const double now = options.ended_consent ? 0 : static_cast<double>(std::time(nullptr));
  ConsentAnswer answer = ask_consent(all, options.use, now);
  if (!answer.refusals.empty()) {
    answer.refusals.emplace_back(
        "nothing is exported; what has ended only is, all the same, with --ended-consent");
    throw ConsentRefused(answer.refusals);
  }
  for (const std::string& doubt : answer.doubts) {
    std::cout << "warning: " << printable(doubt) << "\n";
  }
}

/// Motions as BVH and TRC too, and what `animate` made as one scene.
void export_motions(const fs::path& result, const Manifest& manifest, const fs::path& workspace,
                    const fs::path& place, ExportFormat format, const std::set<fs::path>& files) {
  std::set<fs::path> tracked;  // `track` keeps each motion as an .npz, too: one of both
  for (const fs::path& file : files) {
    if (file.extension() == ".h5" && is_motion_result(result / file)) {
      tracked.insert(file.stem());
    }
  }
  for (const fs::path& file : files) {
    if (is_motion_result(result / file) &&
        (file.extension() == ".h5" || !tracked.contains(file.stem()))) {
      fs::path motion = place / file;
      make_private_directory(motion.parent_path());
      export_bvh(result / file, motion.replace_extension(".bvh"));
      std::cout << printable(motion.string()) << "\n";
      export_trc(result / file, motion.replace_extension(".trc"));
      std::cout << printable(motion.string()) << "\n";
    }
  }
  if (is_animation_result(result)) {
    GltfScene avatar = avatar_scene(result, looks_of(manifest, workspace));
    avatar.consent = to_string(manifest.consent);
    write_gltf(place / "avatar.glb", avatar);
    std::cout << printable((place / "avatar.glb").string())
              << ", body with skin and garments, animated\n"
              << notes_of(avatar);
    if (format == ExportFormat::Usda) {
      write_usd_sequences(place / "avatar.usda", avatar_sequences(result));
      std::cout << printable((place / "avatar.usda").string()) << ", body and garments, animated\n";
    }
  }
}

/// The capture that a workspace is of. Throws DataError if it is gone.
fs::path capture_of(const std::vector<StageStatus>& all, const std::string& layout) {
  for (const StageStatus& status : all) {
    for (const ManifestInput& input :
         status.manifest ? status.manifest->inputs : std::vector<ManifestInput>{}) {
      if (input.kind == "capture" && fs::exists(input.path)) {
        return input.path;
      }
    }
  }
  throw DataError(
      "", "cameras", "no capture at the path that the workspace's results were made from",
      "the capture in its place, or atelier convert-capture CAPTURE OUT --to " + layout);
}

/// A capture's cameras, with the images of its first instant.
void export_cameras(const fs::path& capture, const fs::path& place, const std::string& layout,
                    ExportGuard& guard) {
  Dataset dataset = open_dataset(capture);
  CaptureSequence& first = dataset.info.sequences.front();
  first.frame_ids.resize(1);
  dataset.info.sequences.resize(1);
  guard.add(place);
  write_layout(dataset, layout, place);
  std::cout << printable(place.string()) << ", " << layout << ", "
            << counted(static_cast<std::int64_t>(dataset.cameras.size()), "camera") << "\n";
}

/// Exports one sound result; says what it wrote.
void export_result(const StageStatus& status, const fs::path& workspace, const fs::path& out,
                   ExportFormat format, ExportGuard& guard) {
  const Manifest& manifest = *status.manifest;
  const fs::path result = results_of_stage(workspace, status.stage) / folder_name(manifest.key);
  const fs::path place = out / status.stage;
  const std::string consent = to_string(manifest.consent);
  const std::string warnings = consent_warnings(status);
  guard.add(place);
  make_private_directory(place);
  write_file_atomically(place / "consent.txt", "consent: " + consent + "\n" + warnings);
  if (!manifest.consent.empty()) {
    write_file_atomically(place / kConsentFile, consent_toml(manifest.consent));
  }
  std::set<fs::path> rest;
  for (const ManifestOutput& output : manifest.outputs) {
    rest.insert(output.path);
  }
  export_motions(result, manifest, workspace, place, format, rest);
  export_sequences(result, place, {format, consent}, rest);
  std::int64_t meshes = 0;
  for (const fs::path& file : rest) {
    fs::path to = place / file;
    make_private_directory(to.parent_path());
    if (is_mesh_archive(result / file)) {
      export_mesh(read_mesh_archive(result / file), to, {format, consent});
      ++meshes;
    } else {
      copy_bytes(result / file, to);
    }
  }
  const std::int64_t copied = static_cast<std::int64_t>(rest.size()) - meshes;
  if (meshes > 0) {
    std::cout << printable(place.string()) << ", "
              << counted(meshes, std::string(mesh_extension(format)) + " file") << "\n";
  }
  if (copied > 0) {
    std::cout << printable(place.string()) << ", " << counted(copied, "file")
              << (copied == 1 ? " as it is\n" : " as they are\n");
  }
  std::cout << "  consent: " << printable(consent) << "\n" << printable(warnings, true);
}

/// Those results that are to be exported, of which there is one at least, none damaged.
std::vector<const StageStatus*> chosen_results(const std::vector<StageStatus>& all,
                                               const std::string& workspace,
                                               const std::string& stage) {
  std::vector<const StageStatus*> chosen;
  for (const StageStatus& status : all) {
    if (stage != kEveryStage && status.stage != stage) {
      continue;
    }
    if (status.state == StageStatus::State::Newer) {
      throw DataError(workspace, status.stage, "a result that a newer atelier wrote",
                      "one that this atelier can read: export it with the newer one");
    }
    if (status.state == StageStatus::State::Damaged) {
      throw DataError(workspace, status.stage, "a result that is damaged",
                      "a sound one: atelier status --digests says what is damaged, atelier " +
                          status.stage + " INPUT WORKSPACE, with the same arguments recomputes it");
    }
    if (status.manifest) {
      chosen.push_back(&status);
    }
  }
  if (chosen.empty()) {
    throw DataError(workspace, stage == kEveryStage ? "" : stage, "no finished result",
                    "one; atelier status lists what there is");
  }
  return chosen;
}

int run(ExportArguments arguments, const ExportOptions& options) {
  if (arguments.workspace.empty() || arguments.out.empty()) {
    throw UsageError("export takes a WORKSPACE and a folder: atelier export WORKSPACE OUT");
  }
  const OpenedWorkspace opened(arguments.workspace, arguments.keys);
  arguments.workspace = opened.path();
  const fs::path out = workspace_place(arguments.out);
  const std::vector<StageStatus> all =
      workspace_status(all_stages(), arguments.workspace, opened.check_needed());
  require_folder_place(out);
  if (is_inside(out, arguments.workspace)) {
    throw UsageError("OUT lies in the WORKSPACE; name a folder outside of it");
  }
  require_outside_inputs(out, all, "OUT");
  require_outside_captures(out, "OUT");
  const std::vector<const StageStatus*> chosen =
      chosen_results(all, arguments.workspace, options.stage);
  require_consent_to(chosen, options);
  // Whatever would be refused is, before any work.
  for (const StageStatus* status : chosen) {
    require_new_place(out / status->stage, "OUT");
  }
  const fs::path cameras = out / "cameras";
  fs::path capture;
  if (options.cameras != kNone) {
    require_new_place(cameras, "OUT");
    capture = capture_of(all, options.cameras);
  }
  ExportGuard guard(out);
  for (const StageStatus* status : chosen) {
    for (const std::string& reason : status->reasons) {
      std::cout << status->stage << " is outdated: " << printable(reason) << "\n";
    }
    export_result(*status, arguments.workspace, out, options.format, guard);
  }
  if (!capture.empty()) {
    export_cameras(capture, cameras, options.cameras, guard);
  }
  opened.log("export", out.string() + ", for " + options.use.purpose);
  guard.release();
  return kExitDone;
}

}  // namespace

OptionSet export_options() {
  return option_set<ExportOptions>();
}

Action add_export(CLI::App& parser) {
  auto arguments = std::make_shared<ExportArguments>();
  add_option(parser, "WORKSPACE", arguments->workspace, "Folder of results, or a sealed one")
      .required();
  add_option(parser, "OUT", arguments->out, "Folder to write to, with one folder for each stage")
      .required();
  add_key_arguments(parser, arguments->keys);
  const OptionReader options = add_option_flags(parser, export_options());
  return [arguments, options] { return run(*arguments, options_of<ExportOptions>(options())); };
}

}  // namespace atelier
