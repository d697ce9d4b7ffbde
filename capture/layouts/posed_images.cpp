#include "capture/layouts/posed_images.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <set>
#include <utility>

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
/// With `run` 1 without the number before: "f_cam01" of "f000003_cam01.png".
std::string camera_part(const std::string& name, std::size_t run) {
  const std::string stem = without_extension(name);
  const std::vector<std::string_view> runs = digit_runs(name);
  if (runs.size() <= run) {
    return stem;
  }
  const std::string_view file = name;
  const std::string_view digits = runs[runs.size() - 1 - run];
  const auto begin = static_cast<std::size_t>(digits.data() - file.data());
  return run == 0 ? stem.substr(0, begin)
                  : stem.substr(0, begin) + stem.substr(begin + digits.size());
}

using Groups = std::map<std::string, std::vector<const PosedImage*>>;

Groups grouped(const std::vector<PosedImage>& images, std::size_t run) {
  Groups groups;
  for (const PosedImage& image : images) {
    groups[camera_part(image.name, run)].push_back(&image);
  }
  return groups;
}

/// Whether every group is one camera: frames with numbers of their own, and one calibration.
bool are_cameras(const Groups& groups, std::size_t run) {
  return std::all_of(groups.begin(), groups.end(), [&](const auto& group) {
    std::set<int> numbers;
    return std::all_of(group.second.begin(), group.second.end(), [&](const PosedImage* image) {
      const std::optional<int> number = frame_number(image->name, run);
      return number && numbers.insert(*number).second &&
             same_calibration(image->camera, group.second.front()->camera);
    });
  });
}

/// Which number of the names is the frame's (frame_run counts so too): the last, unless only an
/// earlier one leaves cameras that stand still, as where a camera's number comes last.
std::size_t run_of(const std::vector<PosedImage>& images) {
  constexpr std::size_t kRuns = 3;
  for (std::size_t run = 0; run < kRuns; ++run) {
    const Groups groups = grouped(images, run);
    if (groups.size() < images.size() && are_cameras(groups, run)) {
      return run;
    }
  }
  return 0;
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

/// (frame, place in `images`) of one camera, its counter counted on.
std::vector<std::pair<int, std::uint32_t>> counted_on(const std::map<int, std::uint32_t>& frames,
                                                      const std::vector<const PosedImage*>& images,
                                                      std::size_t run) {
  std::vector<std::pair<int, std::uint32_t>> numbers(frames.begin(), frames.end());
  std::size_t digits = 0;
  for (const PosedImage* image : images) {
    digits = std::max(digits, number_digits(image->name, run));
  }
  continue_counter(numbers, digits);
  return numbers;
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
  std::set<std::string> names;
  for (const PosedImage& image : images) {
    if (!names.insert(image.name).second) {
      throw DataError(file, "image '" + plain_name(image.name) + "'", "a second time", "each once");
    }
  }
  const std::size_t run = run_of(images);
  const Groups groups = grouped(images, run);
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
    dataset.frames.back().images.set(frame, image.image);
    if (!image.mask.file.empty()) {
      dataset.frames.back().masks.set(frame, image.mask);
    }
  };
  for (const auto& [part, members] : groups) {
    const bool stem = !part.empty() && (part.back() == '/' || part.back() == '_' || run > 0);
    std::map<int, std::uint32_t> frames;
    bool one_camera = members.size() > 1 || stem;
    for (std::size_t i = 0; i < members.size(); ++i) {
      const PosedImage* image = members[i];
      const std::optional<int> number = frame_number(image->name, run);
      one_camera = one_camera && number &&
                   frames.emplace(*number, static_cast<std::uint32_t>(i)).second &&
                   same_calibration(image->camera, members.front()->camera);
    }
    if (one_camera) {
      add(camera_id(part, common), members.front()->camera);
      for (const auto& [number, i] : counted_on(frames, members, run)) {
        put(number, *members[i]);
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
