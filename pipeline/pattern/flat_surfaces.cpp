#include "pipeline/pattern/flat_surfaces.h"

#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/json.h"
#include "core/store/derived_folder.h"
#include "core/store/result.h"
#include "pipeline/cloth/captured_scene.h"
#include "registration/flattening/rest_surface.h"

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

}  // namespace

fs::path flat_surfaces(const fs::path& workspace) {
  const fs::path made = required_result(workspace, "template");
  const bool followed = current_name(workspace / "register").has_value();
  std::vector<fs::path> results = {made};
  if (followed) {
    results.push_back(required_result(workspace, "register"));
  }
  return derived_folder(workspace, "surfaces", results, [&](const fs::path& folder) {
    if (followed) {
      for (const fs::path& garment : registered_folders(results.back())) {
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

}  // namespace atelier
