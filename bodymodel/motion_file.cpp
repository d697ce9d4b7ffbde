#include "bodymodel/motion_file.h"

#include <algorithm>
#include <cctype>

#include "bodymodel/body_archive.h"
#include "bodymodel/gltf_body.h"
#include "bodymodel/motion_amass.h"
#include "bodymodel/motion_amc.h"
#include "bodymodel/motion_bvh.h"
#include "core/error.h"
#include "core/io/npz.h"

namespace atelier {
namespace {

std::string extension_of(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) {
    c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return extension;
}

std::filesystem::path skeleton_of(const std::filesystem::path& amc) {
  std::vector<std::filesystem::path> all;
  std::filesystem::path best;
  const std::string stem = amc.stem().string();
  const std::filesystem::path folder = amc.has_parent_path() ? amc.parent_path() : ".";
  if (std::filesystem::is_directory(folder)) {
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
      if (extension_of(entry.path()) == ".asf") {
        all.push_back(entry.path());
        const std::string name = entry.path().stem().string();
        if (stem.starts_with(name) && name.size() > best.stem().string().size()) {
          best = entry.path();
        }
      }
    }
  }
  if (best.empty() && all.size() == 1) {
    best = all[0];
  }
  if (best.empty()) {
    throw DataError(amc.string(), "skeleton", "no .asf of that name beside it",
                    "the ASF file of this motion");
  }
  return best;
}

}  // namespace

MotionClip read_motion_file(const std::filesystem::path& path, const MotionOptions& options,
                            const std::filesystem::path& asf, const MarkerFitOptions& markers,
                            const Limits& limits) {
  const std::string extension = extension_of(path);
  if (extension == ".bvh") {
    return read_bvh(path, options, limits);
  }
  if (extension == ".amc") {
    return read_amc(asf.empty() ? skeleton_of(path) : asf, path, options, limits);
  }
  if (extension == ".glb" || extension == ".gltf") {
    return read_gltf_motion(path, options, limits);
  }
  if (extension == ".trc") {
    return fit_markers(read_trc(path, limits), options, markers).clip;
  }
  if (extension == ".npz") {
    const Npz npz(path, limits);
    return archive_schema(npz).empty() ? read_amass(path, nullptr, limits)
                                       : motion_of_arrays(npz, limits);
  }
  throw DataError(path.string(), "file name", "extension '" + extension.substr(0, 20) + "'",
                  "a motion: .bvh, .amc, .trc, .npz, .glb or .gltf");
}

void write_motion_file(const std::filesystem::path& path, const MotionClip& clip) {
  const std::string extension = extension_of(path);
  ATELIER_CHECK(extension == ".bvh" || extension == ".npz", "motions are written as .bvh or .npz");
  if (extension == ".bvh") {
    write_bvh(path, clip);
  } else {
    write_motion(path, clip);
  }
}

}  // namespace atelier
