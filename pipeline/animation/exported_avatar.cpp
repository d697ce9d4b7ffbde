#include "pipeline/animation/exported_avatar.h"

#include <vector>

#include "core/atomic_file.h"
#include "core/store/derived_folder.h"
#include "core/store/result.h"
#include "pipeline/animation/export_motion.h"

namespace atelier {

namespace fs = std::filesystem;

fs::path exported_avatar(const fs::path& workspace) {
  std::vector<fs::path> results = {required_result(workspace, "animate")};
  if (current_name(workspace / "flatten")) {
    results.push_back(required_result(workspace, "flatten"));
  }
  return derived_folder(workspace, "export", results, [&](const fs::path& folder) {
    const fs::path& animated = results.front();
    const Manifest manifest = read_manifest(animated, "animate");
    GltfScene avatar = avatar_scene(animated, looks_of(manifest, workspace));
    avatar.consent = to_string(manifest.consent);
    write_gltf(folder / "avatar.glb", avatar);
    export_bvh(animated / "motion.npz", folder / "motion.bvh");
    export_trc(animated / "motion.npz", folder / "motion.trc");
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
