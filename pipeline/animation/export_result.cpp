#include "pipeline/animation/export_result.h"

#include <cstdio>
#include <set>
#include <system_error>

#include "capture/layouts/open_dataset.h"
#include "capture/layouts/write_layout.h"
#include "core/archive.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/mesh_file.h"
#include "core/io/mesh_gltf.h"
#include "core/io/one_file_sequence.h"
#include "core/io/usd_sequence.h"
#include "core/normals.h"
#include "core/printable.h"
#include "core/regular_file.h"
#include "core/sequence_archive.h"
#include "core/store/consent_file.h"
#include "core/store/result.h"
#include "pipeline/animation/export_motion.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

constexpr const char* kHeader = "sequence.h5";
constexpr const char* kMeshSchema = "atelier.mesh";

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
                      std::set<fs::path>& rest, const SayLines& say) {
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
    say(export_sequence(sequence, out, how));
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
    const std::size_t got = source.read_on(piece, from);
    if (got == 0) {
      break;
    }
    copy.write(std::span(piece).first(got));
  }
  copy.commit();
}

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

/// Motions as BVH and TRC too, and what `animate` made as one scene.
void export_motions(const fs::path& result, const Manifest& manifest, const fs::path& workspace,
                    const fs::path& place, ExportFormat format, const std::set<fs::path>& files,
                    const SayLines& say) {
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
      say(printable(motion.string()) + "\n");
      export_trc(result / file, motion.replace_extension(".trc"));
      say(printable(motion.string()) + "\n");
    }
  }
  if (is_animation_result(result)) {
    GltfScene avatar = avatar_scene(result, looks_of(manifest, workspace));
    avatar.consent = to_string(manifest.consent);
    write_gltf(place / "avatar.glb", avatar);
    say(printable((place / "avatar.glb").string()) + ", body with skin and garments, animated\n" +
        notes_of(avatar));
    if (format == ExportFormat::Usda) {
      write_usd_sequences(place / "avatar.usda", avatar_sequences(result));
      say(printable((place / "avatar.usda").string()) + ", body and garments, animated\n");
    }
  }
}

}  // namespace

ExportGuard::~ExportGuard() {
  if (armed_) {
    std::error_code ignored;
    for (const fs::path& place : places_) {
      fs::remove_all(place, ignored);
    }
    above_.remove_empty();
  }
}

void export_cameras(const fs::path& capture, const fs::path& place, const std::string& layout,
                    ExportGuard& guard, const SayLines& say) {
  Dataset dataset = open_dataset(capture);
  CaptureSequence& first = dataset.info.sequences.front();
  first.frame_ids.resize(1);
  dataset.info.sequences.resize(1);
  guard.add(place);
  write_layout(dataset, layout, place);
  say(printable(place.string()) + ", " + layout + ", " +
      counted(static_cast<std::int64_t>(dataset.cameras.size()), "camera") + "\n");
}

void export_result(const StageStatus& status, const fs::path& workspace, const fs::path& out,
                   ExportFormat format, ExportGuard& guard, const SayLines& say) {
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
  export_motions(result, manifest, workspace, place, format, rest, say);
  export_sequences(result, place, {format, consent}, rest, say);
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
    say(printable(place.string()) + ", " +
        counted(meshes, std::string(mesh_extension(format)) + " file") + "\n");
  }
  if (copied > 0) {
    say(printable(place.string()) + ", " + counted(copied, "file") +
        (copied == 1 ? " as it is\n" : " as they are\n"));
  }
  say("  consent: " + printable(consent) + "\n" + printable(warnings, true));
}

}  // namespace atelier
