#include "pipeline/chain/run_scene.h"

#include <algorithm>
#include <functional>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/json.h"
#include "core/io/mesh_file.h"
#include "core/limits.h"
#include "core/sequence_archive.h"
#include "core/store/commit.h"
#include "core/store/consent_file.h"
#include "core/store/input_digest.h"
#include "core/store/made_of.h"
#include "core/store/result.h"
#include "pipeline/animation/export_motion.h"
#include "registration/flattening/rest_surface.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

constexpr const char* kTemplateNote = "template.json";

fs::path result_of(const fs::path& workspace, const std::string& stage) {
  const auto name = current_name(workspace / stage);
  if (!name) {
    throw DataError((workspace / stage).string(), "", "no result", "run 'atelier " + stage + "'");
  }
  return workspace / stage / *name;
}

/// Which results, by the keys that their folders are named after, and what their people agreed to.
struct MadeOf {
  std::string text = "4\n";  // the version of this file: what it makes of the same results
  std::vector<Consent> consent;
};

MadeOf made_of(const std::vector<fs::path>& results) {
  MadeOf all;
  for (const fs::path& result : results) {
    const std::string stage = result.parent_path().filename().string();
    all.text += stage + " " + result.filename().string() + "\n";
    const Manifest manifest = read_manifest(result, stage);
    for (const Finding& finding : check_outputs(result, manifest, Check::Digests)) {
      if (finding.severity == Severity::Error) {
        throw DataError(finding.place, "", finding.what,
                        "a sound result; run 'atelier " + stage + "' again");
      }
    }
    add_consent(all.consent, manifest.consent);
  }
  all.text += consent_toml(all.consent);
  return all;
}

/// Every file below a folder but the note itself, with its digest, a line each.
std::string contents_of(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_directory() && entry.path() != folder / kMadeOfFile) {
      files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  std::string text;
  for (const fs::path& file : files) {
    text += file.lexically_relative(folder).generic_string() + " " +
            hex(digest_of_file(file).digest) + "\n";
  }
  return text;
}

/// Whether the folder is what was made of these results, byte for byte: nobody else looks whether
/// it is damaged, since it is the INPUT of the stage that reads it.
bool is_current(const fs::path& folder, const MadeOf& from) {
  const fs::path note = folder / kMadeOfFile;
  return fs::exists(note) &&
         read_file_text(note, Limits{}.text_file_bytes) == from.text + contents_of(folder);
}

/// Fills a new folder and puts it in the older one's place, unless that is what it would become.
fs::path renewed(const fs::path& workspace, const std::string& name, const MadeOf& from,
                 const std::function<void(const fs::path&)>& fill) {
  fs::path folder = workspace / name;
  if (is_current(folder, from)) {
    return folder;
  }
  const fs::path fresh = workspace / ("." + name + "-new");
  remove_folder(fresh);
  make_private_directory(fresh);
  fill(fresh);
  if (!from.consent.empty()) {
    write_file_atomically(fresh / kConsentFile, consent_toml(from.consent));
  }
  write_file_atomically(fresh / kMadeOfFile, from.text + contents_of(fresh));
  sync_directory(fresh);
  remove_folder(folder);
  fs::rename(fresh, folder);
  sync_directory(workspace);
  return folder;
}

void append(Mesh& all, const Mesh& mesh) {
  const Index v = all.vertices.rows();
  const Index f = all.faces.rows();
  all.vertices.conservativeResize(v + mesh.vertices.rows(), 3);
  all.vertices.bottomRows(mesh.vertices.rows()) = mesh.vertices;
  all.faces.conservativeResize(f + mesh.faces.rows(), 3);
  all.faces.bottomRows(mesh.faces.rows()) = mesh.faces.array() + static_cast<int>(v);
}

/// The registered garments, by name.
std::vector<fs::path> garment_folders(const fs::path& registered) {
  std::vector<fs::path> folders;
  for (const auto& entry : fs::directory_iterator(registered / "registered")) {
    folders.push_back(entry.path());
  }
  std::sort(folders.begin(), folders.end());
  if (folders.empty()) {
    throw DataError(registered.string(), "registered", "no garment", "at least one");
  }
  return folders;
}

/// Whether the registered garments have frames enough to tell what folds take of them.
bool is_followed_enough(const fs::path& registered) {
  const fs::path frames = garment_folders(registered).front() / "frames";
  return fs::exists(frames) &&
         std::distance(fs::directory_iterator(frames), {}) >= static_cast<int>(kRestFrames);
}

}  // namespace

fs::path flat_surfaces(const fs::path& workspace) {
  const fs::path made = result_of(workspace, "template");
  const bool followed = current_name(workspace / "register").has_value();
  std::vector<fs::path> results = {made};
  if (followed) {
    results.push_back(result_of(workspace, "register"));
  }
  return renewed(workspace, "surfaces", made_of(results), [&](const fs::path& folder) {
    if (followed) {
      for (const fs::path& garment : garment_folders(results.back())) {
        const char* name = fs::exists(garment / kFormerRestFile) ? kFormerRestFile : kRestFile;
        if (!fs::exists(garment / name)) {  // of an earlier version
          throw DataError(garment.string(), name, "not there", "run 'atelier register' again");
        }
        fs::copy_file(garment / name, folder / (garment.filename().string() + ".obj"));
      }
    } else {
      for (const auto& entry : fs::directory_iterator(made / "garments")) {
        if (entry.path().extension() == ".obj") {
          fs::copy_file(entry.path(), folder / entry.path().filename());
        }
      }
    }
    if (fs::exists(made / kTemplateNote)) {  // where wearers look
      nlohmann::json note = read_json(made / kTemplateNote);
      if (followed && is_followed_enough(results.back()) && note.contains("garments")) {
        for (nlohmann::json& garment : note["garments"]) {
          garment["rest"] = true;  // so in nobody's pose
          garment.erase("frame");
        }
      }
      write_file_atomically(folder / kTemplateNote, note.dump(1) + "\n");
    }
  });
}

fs::path captured_scene(const fs::path& workspace) {
  const fs::path registered = result_of(workspace, "register");
  const fs::path bodies = result_of(workspace, "body");
  return renewed(workspace, "scene", made_of({registered, bodies}), [&](const fs::path& folder) {
    Mesh garments;
    std::vector<int> ids;
    for (const fs::path& one : garment_folders(registered)) {
      const Sequence sequence = open_sequence(one);
      ids = sequence.frame_ids;
      append(garments, frame(sequence, 0));
    }
    write_mesh(folder / "garment.obj", garments);
    const Sequence all = open_sequence(bodies);
    SequenceHeader header;
    header.fps = all.fps;
    header.shared.faces = all.faces;
    std::vector<Index> rows;
    for (Index i = 0; i < frame_count(all); ++i) {
      const int id = all.frame_ids[static_cast<std::size_t>(i)];
      if (std::find(ids.begin(), ids.end(), id) != ids.end()) {
        header.frame_ids.push_back(id);
        rows.push_back(i);
      }
    }
    if (rows.empty() || header.frame_ids.front() != ids.front()) {
      throw DataError(bodies.string(), "frames", "not those of the registered garments",
                      "a body in every frame that a garment was registered to");
    }
    write_sequence_header(folder / "body", header);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      Mesh body;
      body.vertices = frame(all, rows[i]).vertices;
      body.faces = all.faces;
      write_sequence_frame(folder / "body", header, header.frame_ids[i], body);
    }
  });
}

fs::path exported_avatar(const fs::path& workspace) {
  std::vector<fs::path> results = {result_of(workspace, "animate")};
  if (current_name(workspace / "flatten")) {
    results.push_back(result_of(workspace, "flatten"));
  }
  return renewed(workspace, "export", made_of(results), [&](const fs::path& folder) {
    const fs::path& animated = results.front();
    write_gltf(folder / "avatar.glb",
               avatar_scene(animated, networks_of(read_manifest(animated, "animate"), workspace)));
    export_bvh(animated / "motion.npz", folder / "motion.bvh");
    for (std::size_t i = 1; i < results.size(); ++i) {
      for (const auto& entry : fs::recursive_directory_iterator(results[i])) {
        const fs::path extension = entry.path().extension();
        if (extension == ".svg" || extension == ".dxf") {
          const fs::path to = folder / entry.path().lexically_relative(results[i]);
          make_private_directory(to.parent_path());
          fs::copy_file(entry.path(), to);
        }
      }
    }
  });
}

}  // namespace atelier
