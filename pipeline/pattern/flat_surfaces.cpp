#include "pipeline/pattern/flat_surfaces.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/json.h"
#include "core/io/mesh_file.h"
#include "core/sequence_archive.h"
#include "core/store/derived_folder.h"
#include "core/store/result.h"
#include "pipeline/cloth/captured_scene.h"
#include "pipeline/pattern/sew_check.h"
#include "registration/flattening/flatten_surface.h"
#include "registration/flattening/rest_surface.h"
#include "simulation/material/hanging_acceleration.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

constexpr const char* kTemplateNote = "template.json";

/// Whether the registered garments have frames enough to tell what folds take of them.
bool is_followed_enough(const fs::path& registered) {
  const fs::path frames = registered_folders(registered).front() / "frames";
  return fs::exists(frames) &&
         std::distance(fs::directory_iterator(frames), {}) >= static_cast<int>(kRestFrames);
}

/// The label and frame of each garment that the note of a template names.
std::map<std::string, int> template_frames(const fs::path& made) {
  std::map<std::string, int> frames;
  for (const auto& entry : fs::directory_iterator(made / "garments")) {
    const std::string label = entry.path().stem().string();
    if (entry.path().extension() == ".obj") {
      if (const auto frame = template_note(made / kTemplateNote, label).frame) {
        frames[label] = *frame;
      }
    }
  }
  return frames;
}

std::optional<Mesh> body_in(const Sequence& bodies, int frame_id) {
  const auto at = std::find(bodies.frame_ids.begin(), bodies.frame_ids.end(), frame_id);
  return at == bodies.frame_ids.end() ? std::nullopt
                                      : std::optional(frame(bodies, at - bodies.frame_ids.begin()));
}

/// A garment as it was captured in the frame of its template; with its registered sequence, where
/// its motion held it up there, in the one in which it did least.
void write_captured_garment(const fs::path& folder, const fs::path& mesh, int frame_id,
                            const Sequence& bodies, const std::optional<Sequence>& registered) {
  const std::optional<Mesh> body = body_in(bodies, frame_id);
  if (!body) {
    return;
  }
  WornGarment worn{read_mesh(mesh), *body};
  if (!registered || !equal_arrays(registered->faces, worn.cloth.faces)) {
    write_worn(folder, worn, frame_id);
    return;
  }
  const auto held_up = [&](int id, const Mesh& on) {
    return hanging_acceleration(*registered, id, on.vertices, on.faces);
  };
  worn.acceleration = held_up(frame_id, *body).value_or(-1);
  if (worn.acceleration > kInMotion) {
    for (std::size_t i = 0; i < registered->frame_ids.size(); ++i) {
      const int id = registered->frame_ids[i];
      const std::optional<Mesh> there = body_in(bodies, id);
      const std::optional<double> acceleration =
          there ? held_up(id, *there) : std::optional<double>();
      if (acceleration && *acceleration < worn.acceleration) {
        worn.cloth.vertices = frame(*registered, static_cast<Index>(i)).vertices;
        worn.body = *there;
        worn.acceleration = *acceleration;
        frame_id = id;
      }
    }
  }
  write_worn(folder, worn, frame_id);
}

}  // namespace

fs::path flat_surfaces(const fs::path& workspace) {
  const fs::path made = required_result(workspace, "template");
  const bool followed = current_name(workspace / "register").has_value();
  std::vector<fs::path> results = {made};
  if (followed) {
    results.push_back(required_result(workspace, "register"));
  }
  const std::map<std::string, int> frames = template_frames(made);
  std::optional<fs::path> bodies;
  if (!frames.empty() && current_name(workspace / "body")) {
    bodies = required_result(workspace, "body");
  }
  const std::optional<fs::path> registered =
      followed ? std::optional(results.back()) : std::nullopt;
  if (bodies) {
    results.push_back(*bodies);
  }
  return derived_folder(workspace, "surfaces", results, [&](const fs::path& folder) {
    if (followed) {
      for (const fs::path& garment : registered_folders(*registered)) {
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
      if (followed && is_followed_enough(*registered) && note.contains("garments")) {
        for (nlohmann::json& garment : note["garments"]) {
          garment["rest"] = true;  // so in nobody's pose
          garment.erase("frame");
        }
      }
      write_file_atomically(folder / kTemplateNote, note.dump(1) + "\n");
    }
    if (bodies) {
      const Sequence of_bodies = open_sequence(*bodies);
      for (const auto& [label, frame_id] : frames) {
        std::optional<Sequence> sequence;
        if (registered && fs::exists(*registered / "registered" / label / "sequence.h5")) {
          sequence = open_sequence(*registered / "registered" / label);
        }
        write_captured_garment(folder / kCapturedFolder / label,
                               made / "garments" / (label + ".obj"), frame_id, of_bodies, sequence);
      }
    }
  });
}

}  // namespace atelier
