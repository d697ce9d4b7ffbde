#include "capture/layouts/posed_images.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "capture/layouts/frame_files.h"
#include "core/error.h"

namespace atelier {
namespace {

bool same_calibration(const Camera& a, const Camera& b) {
  constexpr double kSame = 1e-9;
  const auto near = [](double x, double y) {
    return std::abs(x - y) <= kSame * std::max({1.0, std::abs(x), std::abs(y)});
  };
  bool same = a.width == b.width && a.height == b.height &&
              a.distortion_model == b.distortion_model && near(a.fx, b.fx) && near(a.fy, b.fy) &&
              near(a.cx, b.cx) && near(a.cy, b.cy);
  for (std::size_t i = 0; i < a.distortion.size(); ++i) {
    same = same && near(a.distortion[i], b.distortion[i]);
  }
  for (Index i = 0; i < 9; ++i) {
    same = same &&
           near(a.camera_from_world_rotation.data()[i], b.camera_from_world_rotation.data()[i]);
  }
  for (Index i = 0; i < 3; ++i) {
    same = same && near(a.camera_from_world_translation[i], b.camera_from_world_translation[i]);
  }
  return same;
}

std::string without_extension(const std::string& name) {
  const std::size_t dot = name.rfind('.');
  const std::size_t slash = name.rfind('/');
  return dot == std::string::npos || (slash != std::string::npos && dot < slash)
             ? name
             : name.substr(0, dot);
}

/// A name without its last number and without what then ends it: "cam01/" of "cam01/000003.png".
std::string camera_part(const std::string& name) {
  std::string stem = without_extension(name);
  std::size_t end = stem.size();
  while (end > 0 && (stem[end - 1] < '0' || stem[end - 1] > '9') && stem[end - 1] != '/') {
    --end;
  }
  std::size_t begin = end;
  while (begin > 0 && stem[begin - 1] >= '0' && stem[begin - 1] <= '9') {
    --begin;
  }
  return begin == end ? stem : stem.substr(0, begin);
}

/// Bytes of the folders that all names begin with: "images/" of nerfstudio.
std::size_t common_folders(const std::set<std::string>& names) {
  if (names.empty()) {
    return 0;
  }
  // Sorted: what the first and the last share, all do.
  const std::string& first = *names.begin();
  const std::string& last = *names.rbegin();
  const auto differ = std::mismatch(first.begin(), first.end(), last.begin(), last.end()).first;
  const std::size_t slash = first.rfind(
      '/', static_cast<std::size_t>(std::max<std::ptrdiff_t>(0, differ - first.begin() - 1)));
  return slash == std::string::npos ? 0 : slash + 1;
}

std::string camera_id(const std::string& name, std::size_t common) {
  std::string part = name.size() > common ? name.substr(common) : name;
  while (!part.empty() &&
         (part.back() == '/' || part.back() == '_' || part.back() == '-' || part.back() == '.')) {
    part.pop_back();
  }
  return plain_name(part);
}

}  // namespace

Dataset dataset_of(const std::vector<PosedImage>& images, const std::string& file) {
  std::map<std::string, std::vector<const PosedImage*>> groups;
  std::set<std::string> names;
  for (const PosedImage& image : images) {
    if (!names.insert(image.name).second) {
      throw DataError(file, "image '" + plain_name(image.name) + "'", "a second time", "each once");
    }
    groups[camera_part(image.name)].push_back(&image);
  }
  const std::size_t common = common_folders(names);
  Dataset dataset;
  dataset.root = file;
  std::set<std::string> ids;
  const auto add = [&](std::string id, const Camera& camera) {
    while (!ids.insert(id).second) {
      id += "_";
    }
    dataset.cameras.push_back(camera);
    dataset.cameras.back().id = id;
    dataset.frames.emplace_back();
  };
  const auto put = [&](int frame, const PosedImage& image) {
    dataset.frames.back().images[frame] = image.image;
    if (!image.mask.file.empty()) {
      dataset.frames.back().masks[frame] = image.mask;
    }
  };
  for (const auto& [part, members] : groups) {
    const bool stem = !part.empty() && (part.back() == '/' || part.back() == '_');
    std::map<int, const PosedImage*> frames;
    bool one_camera = members.size() > 1 || stem;
    for (const PosedImage* image : members) {
      const std::optional<int> number = frame_number(image->name);
      one_camera = one_camera && number && frames.emplace(*number, image).second &&
                   same_calibration(image->camera, members.front()->camera);
    }
    if (one_camera) {
      add(camera_id(part, common), members.front()->camera);
      for (const auto& [number, image] : frames) {
        put(number, *image);
      }
      continue;
    }
    if (members.size() > 1) {
      dataset.findings.push_back(
          {Severity::Note, "pictures-are-cameras", part.empty() ? file : part,
           std::to_string(members.size()) +
               " images with calibrations of their own are taken as as many cameras of one "
               "instant",
           "a camera that moves while it takes frames cannot be used"});
    }
    for (const PosedImage* image : members) {
      add(camera_id(without_extension(image->name), common), image->camera);
      put(0, *image);
    }
  }
  return dataset;
}

}  // namespace atelier
