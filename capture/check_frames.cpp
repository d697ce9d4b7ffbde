#include "capture/check_frames.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "capture/label_taxonomy.h"
#include "capture/mask_share.h"
#include "capture/sentence.h"
#include "core/error.h"
#include "core/median.h"
#include "core/quantity_text.h"
#include "core/sha256.h"

namespace atelier {
namespace {

/// The same finding of many frames of one camera becomes one.
class Gathered {
 public:
  void add(Severity severity, const std::string& code, const std::string& camera, int frame,
           const std::string& what, const std::string& advice, const std::string& setting = "") {
    Entry& entry = entries_[{camera, code}];
    if (entry.count++ == 0) {
      entry.finding = {severity, code,   camera + " frame " + std::to_string(frame),
                       what,     advice, setting};
    }
  }
  std::vector<Finding> findings() const {
    std::vector<Finding> all;
    for (const auto& [key, entry] : entries_) {
      all.push_back(entry.finding);
      if (entry.count > 1) {
        all.back().what += " (and " + std::to_string(entry.count - 1) + " more of its frames)";
      }
    }
    return all;
  }

 private:
  struct Entry {
    Finding finding;
    int count = 0;
  };
  std::map<std::pair<std::string, std::string>, Entry> entries_;
};

/// The first half of a SHA-256: no two images share it by chance.
using ShortDigest = std::array<std::uint8_t, 16>;

/// Kept of every image of every camera until cameras are compared: 48 bytes.
struct PictureFacts {
  ShortDigest digest{};
  int frame_id = 0;
  float mean = 0;                 ///< of sRGB in [0,1]
  float contrast = 0;             ///< standard deviation of sRGB
  float saturated = 0;            ///< share
  float sharpness = 0;            ///< variance of the Laplacian over the variance
  std::array<float, 3> person{};  ///< mean of red, green, blue on the mask
};

PictureFacts facts_of(const ByteImage& image, int frame_id) {
  PictureFacts facts;
  facts.frame_id = frame_id;
  const Digest digest =
      sha256(std::string_view(reinterpret_cast<const char*>(image.data.data()), image.data.size()));
  std::copy_n(digest.begin(), facts.digest.size(), facts.digest.begin());
  const int c = image.channels;
  double sum = 0;
  double squares = 0;
  double edges = 0;
  double top = 0;
  int count = 0;
  const auto value = [&](int x, int y) { return image.at(x, y, c > 1 ? 1 : 0) / 255.0; };
  for (int y = 1; y + 1 < image.height; y += 2) {
    for (int x = 1; x + 1 < image.width; x += 2) {
      const double v = value(x, y);
      const double laplacian =
          value(x - 1, y) + value(x + 1, y) + value(x, y - 1) + value(x, y + 1) - 4 * v;
      sum += v;
      squares += v * v;
      edges += laplacian * laplacian;
      top += image.at(x, y, c > 1 ? 1 : 0) >= 254 ? 1 : 0;
      ++count;
    }
  }
  if (count > 0) {
    const double mean = sum / count;
    const double variance = squares / count - mean * mean;
    facts.mean = static_cast<float>(mean);
    facts.contrast = static_cast<float>(std::sqrt(std::max(variance, 0.0)));
    facts.sharpness = static_cast<float>(edges / count / std::max(variance, 1e-6));
    facts.saturated = static_cast<float>(top / count);
  }
  return facts;
}

/// Of each picture the first with the same bytes, which may be itself.
std::vector<std::uint32_t> first_with_bytes(const std::vector<PictureFacts>& pictures) {
  std::vector<std::uint32_t> order(pictures.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return pictures[a].digest < pictures[b].digest;
  });
  std::vector<std::uint32_t> first(pictures.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool same = i > 0 && pictures[order[i]].digest == pictures[order[i - 1]].digest;
    first[order[i]] = same ? first[order[i - 1]] : order[i];
  }
  return first;
}

void judge_pictures(const std::string& camera, const std::vector<PictureFacts>& pictures,
                    const FrameCheckOptions& options, Gathered& gathered) {
  std::vector<double> sharpness;
  sharpness.reserve(pictures.size());
  for (const PictureFacts& picture : pictures) {
    sharpness.push_back(picture.sharpness);
  }
  const double usual = median(sharpness);
  const std::vector<std::uint32_t> first = first_with_bytes(pictures);
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const PictureFacts& picture = pictures[i];
    if (picture.mean < options.black) {
      gathered.add(Severity::Error, "image-black", camera, picture.frame_id, "the image is black",
                   "was the camera covered or off? leave the frame out");
      continue;
    }
    if (picture.saturated > options.saturated) {
      gathered.add(Severity::Warning, "image-saturated", camera, picture.frame_id,
                   percent(picture.saturated) + " of the pixels are at the top of their range",
                   "shorten the exposure");
    }
    if (pictures.size() >= 5 && picture.sharpness < options.blur * usual) {
      gathered.add(Severity::Warning, "image-blurred", camera, picture.frame_id,
                   "the image is less sharp than the camera's others",
                   "is it out of focus, moved, or scaled?");
    }
    if (i == 0) {
      continue;
    }
    const PictureFacts& before = pictures[i - 1];
    if (first[i] != i) {
      gathered.add(Severity::Warning, "frame-duplicate", camera, picture.frame_id,
                   "the image is that of frame " + std::to_string(pictures[first[i]].frame_id),
                   "did the recorder drop a frame? then later frames may be out of step");
    } else if (before.mean > options.black &&
               std::abs(picture.mean - before.mean) > options.jump * before.mean) {
      gathered.add(Severity::Warning, "exposure-jump", camera, picture.frame_id,
                   "the mean changes by " +
                       percent(std::abs(picture.mean - before.mean) / before.mean) +
                       " from the frame before",
                   "is automatic exposure off?");
    }
  }
}

/// Mean colour of the person, as if the camera had no gain; nothing (0) of grey pictures.
std::array<float, 3> colour_on(const ByteImage& image, const ByteImage& mask,
                               const Camera& camera) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double count = 0;
  if (image.channels < 3 || mask.width != image.width || mask.height != image.height) {
    return {};
  }
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      if (mask.at(x, y) != 0) {
        for (int c = 0; c < 3; ++c) {
          sum[c] += std::pow(image.at(x, y, c) / 255.0, 2.2) / camera.gain[c];
        }
        count += 1;
      }
    }
  }
  constexpr double kFew = 50;
  if (count < kFew) {
    return {};
  }
  sum /= count;
  return {static_cast<float>(sum.x()), static_cast<float>(sum.y()), static_cast<float>(sum.z())};
}

/// Pairs of cameras that have one image of a frame, by the second camera.
void find_twins(const std::vector<Camera>& cameras,
                const std::vector<std::vector<PictureFacts>>& pictures,
                std::vector<Finding>& findings) {
  struct Twin {
    std::size_t camera = 0;
    int frame_id = 0;
    std::size_t other = 0;
  };
  std::vector<Twin> twins;
  std::set<std::pair<std::size_t, std::size_t>> told;
  std::vector<std::size_t> next(pictures.size());  // of each camera, whose pictures are by frame
  while (true) {
    std::optional<int> frame;
    for (std::size_t c = 0; c < pictures.size(); ++c) {
      if (next[c] < pictures[c].size()) {
        const int id = pictures[c][next[c]].frame_id;
        frame = frame ? std::min(*frame, id) : id;
      }
    }
    if (!frame) {
      break;
    }
    std::map<ShortDigest, std::size_t> first;
    for (std::size_t c = 0; c < pictures.size(); ++c) {
      if (next[c] == pictures[c].size() || pictures[c][next[c]].frame_id != *frame) {
        continue;
      }
      const PictureFacts& picture = pictures[c][next[c]++];
      constexpr float kBlank = 0.01F;  // images of nothing are alike, and no copies
      const auto [there, is_new] = first.emplace(picture.digest, c);
      if (picture.contrast >= kBlank && !is_new && told.emplace(there->second, c).second) {
        twins.push_back({c, *frame, there->second});
      }
    }
  }
  std::stable_sort(twins.begin(), twins.end(),
                   [](const Twin& a, const Twin& b) { return a.camera < b.camera; });
  for (const Twin& twin : twins) {
    findings.push_back({Severity::Error, "picture-twins",
                        cameras[twin.camera].id + " frame " + std::to_string(twin.frame_id),
                        "it has the very image of " + cameras[twin.other].id,
                        "was a camera's folder copied under another name?",
                        "--capture.leave-out " + cameras[twin.camera].id});
  }
}

/// Images of two cameras that are one image, and cameras whose colours are not the others'.
void compare_cameras(const std::vector<Camera>& cameras,
                     const std::vector<std::vector<PictureFacts>>& pictures,
                     std::vector<Finding>& findings) {
  find_twins(cameras, pictures, findings);
  std::vector<Eigen::Vector3d> colours;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    std::array<std::vector<double>, 3> values;  // green; red and blue over green
    for (const PictureFacts& picture : pictures[c]) {
      const auto [red, green, blue] = picture.person;
      if (green > 0) {
        values[0].push_back(green);
        values[1].push_back(red / green);
        values[2].push_back(blue / green);
      }
    }
    colours.emplace_back(median(values[0]), median(values[1]), median(values[2]));
  }
  Eigen::Vector3d usual;
  for (int i = 0; i < 3; ++i) {
    std::vector<double> all;
    for (const Eigen::Vector3d& colour : colours) {
      if (colour.x() > 0) {
        all.push_back(colour[i]);
      }
    }
    if (all.size() < 3) {
      return;
    }
    usual[i] = median(all);
  }
  const auto off = [](double a, double b) {
    return std::max(a, b) / std::max(std::min(a, b), 1e-6);
  };
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const Eigen::Vector3d& colour = colours[c];
    if (colour.x() <= 0) {
      continue;
    }
    constexpr double kTint = 1.6;
    constexpr double kBright = 2;
    const double tint = std::max(off(colour.y(), usual.y()), off(colour.z(), usual.z()));
    if (tint > kTint) {
      findings.push_back(
          {Severity::Warning, "camera-colour", cameras[c].id,
           "red or blue of the person is " + percent(tint - 1) + " off what the other cameras see",
           "is its white balance automatic? atelier calibrate finds gains"});
    } else if (off(colour.x(), usual.x()) > kBright) {
      findings.push_back({Severity::Warning, "camera-exposure", cameras[c].id,
                          "the person is " +
                              std::string(colour.x() > usual.x() ? "brighter" : "darker") +
                              " by a factor of two and more than in the other cameras",
                          "is its exposure another? atelier calibrate finds gains"});
    }
  }
}

/// Advice on what is set where nobody is, with a setting of masks; that of labels is another.
std::pair<std::string, std::string> inverted_advice(const std::string& camera, bool of_labels) {
  if (of_labels) {
    return {"is their background another number? --capture.label-taxonomy says", ""};
  }
  return {"is it inverted? the person is what is not 0", "--capture.masks " + camera + "=inverted"};
}

/// @param of_labels  the mask is what labels call a person
void judge_mask(const std::string& camera, int frame, const ByteImage& mask, bool of_labels,
                Gathered& gathered) {
  const double inside = set_share(mask, false);
  const double rim = set_share(mask, true);
  if (inside == 0) {
    gathered.add(Severity::Warning, "mask-empty", camera, frame, "the mask shows nobody",
                 "if somebody is there, recompute it");
  } else if (inside > 0.98) {
    gathered.add(Severity::Warning, "mask-full", camera, frame, "the mask is set nearly everywhere",
                 "is it a mask? 0 is the background; of a view so close it may be");
  } else if (rim > 0.8 && inside > 0.4 && inside < rim) {  // of a close view the corners are free
    const auto [advice, setting] = inverted_advice(camera, of_labels);
    gathered.add(Severity::Error, "mask-inverted", camera, frame,
                 "the mask is set along " + percent(rim) + " of the image's rim", advice, setting);
  }
}

/// Cameras without an image, which serve keypoints alone; an error where others have some.
Finding without_pictures_finding(const std::vector<std::string>& ids, bool others_have) {
  std::string list;
  for (const std::string& id : ids) {
    list += (list.empty() ? "" : ",") + id;
  }
  if (!others_have) {
    return {Severity::Warning, "camera-without-pictures", list, "no camera has an image",
            "where are the images? without them cameras serve keypoints alone"};
  }
  return {Severity::Error,
          "camera-without-pictures",
          list,
          (ids.size() == 1 ? std::string("it has no image")
                           : std::to_string(ids.size()) + " cameras have no image"),
          "where are the images? without them cameras serve keypoints alone; leave these out if "
          "they were not recorded",
          "--capture.leave-out " + list};
}

/// Says once how masks of another size than the images are read.
void judge_mask_size(FrameReader& reader, Index camera_idx, int frame, const ByteImage& mask,
                     Gathered& gathered) {
  const Camera& camera = reader.dataset().cameras[static_cast<std::size_t>(camera_idx)];
  const std::optional<ImageHeader> stored = reader.mask_header(camera_idx, frame);
  if (!stored || (stored->width == mask.width && stored->height == mask.height)) {
    return;
  }
  gathered.add(Severity::Note, "mask-scaled", camera.id, frame,
               "its mask has " + std::to_string(stored->width) + " x " +
                   std::to_string(stored->height) + " px and is read at the images' " +
                   std::to_string(mask.width) + " x " + std::to_string(mask.height),
               "nothing, if the masks were scaled");
}

/// Calls `read` and turns what cannot be read into a finding.
template <class Read>
auto guarded(const Read& read, const char* code, const std::string& camera, int frame,
             Gathered& gathered) -> decltype(read()) {
  try {
    return read();
  } catch (const DataError& error) {
    // A number that no label has is not damage.
    const bool unknown = error.expected.find("taxonomy") != std::string::npos ||
                         error.expected.find("0 to") != std::string::npos;
    gathered.add(Severity::Error, unknown ? "label-unknown" : code, camera, frame, error.what(),
                 unknown ? "which taxonomy are they of? --capture.label-taxonomy says"
                         : "write it again, or leave the frame out");
    return {};
  }
}

}  // namespace

OptionTable describe(FrameCheckOptions& options) {
  OptionTable table;
  table.add("every", options.every, 1, 1000000, "", "Interval between the frames that are decoded");
  table.add("black", options.black, 0, 1, "", "Mean value below which an image is black");
  table.add("saturated", options.saturated, 0, 1, "",
            "Fraction of saturated pixels above which an image is saturated");
  table.add("jump", options.jump, 0, 10, "",
            "Change of the mean value from frame to frame above which exposure jumps");
  table.add("blur", options.blur, 0, 1, "",
            "Sharpness relative to the camera's median below which an image is blurred");
  return table;
}

Dataset without_held_out_pictures(Dataset dataset) {
  for (const std::string& id : dataset.info.held_out_cameras) {
    if (const Index c = camera_index(dataset, id); c >= 0) {
      CameraFrames& frames = dataset.frames[static_cast<std::size_t>(c)];
      frames.images.clear();
      frames.masks.clear();
      frames.labels.clear();
    }
  }
  return dataset;
}

std::vector<Finding> check_frames(FrameReader& reader, const FrameCheckOptions& options,
                                  const std::function<void(int done, int total)>& told) {
  const Dataset& dataset = reader.dataset();
  Gathered gathered;
  std::vector<Finding> camera_findings;
  std::vector<std::string> without_pictures;
  std::vector<int> all_frames = frame_ids(dataset);
  bool any_picture = false;
  for (const CameraFrames& frames : dataset.frames) {
    add_frames(all_frames, frames.images.frames());
    any_picture = any_picture || !frames.images.empty();
  }
  const auto lacks = [](const CameraFrames& frames, int frame) {
    return !frames.images.empty() && !frames.images.contains(frame);
  };
  int total = 0;
  for (const CameraFrames& frames : dataset.frames) {
    const auto there = std::count_if(all_frames.begin(), all_frames.end(),
                                     [&](int frame) { return !lacks(frames, frame); });
    total += (static_cast<int>(there) + options.every - 1) / options.every;
  }
  int done = 0;
  std::vector<std::vector<PictureFacts>> all_pictures(dataset.cameras.size());
  for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
    const Camera& camera = dataset.cameras[c];
    const CameraFrames& frames = dataset.frames[c];
    const auto index = static_cast<Index>(c);
    std::vector<PictureFacts> pictures;
    pictures.reserve(frames.images.size() / static_cast<std::size_t>(options.every) + 1);
    const auto& held_out = dataset.info.held_out_cameras;
    const bool held = std::find(held_out.begin(), held_out.end(), camera.id) != held_out.end();
    if (frames.images.empty() && !all_frames.empty() && !held) {
      without_pictures.push_back(camera.id);
    }
    int turn = 0;
    for (const int frame : all_frames) {
      if (lacks(frames, frame)) {
        gathered.add(Severity::Warning, "frame-missing", camera.id, frame,
                     "other cameras have an image of this frame",
                     "did the recorder drop it? then later frames may be out of step");
        continue;
      }
      if (turn++ % options.every != 0) {
        continue;
      }
      const auto image = guarded([&] { return reader.byte_image(index, frame); }, "image-damaged",
                                 camera.id, frame, gathered);
      if (image) {
        // The first picture's size against the calibration's is told where the data set is opened.
        if (frames.image_width > 0 &&
            (image->width != frames.image_width || image->height != frames.image_height)) {
          gathered.add(Severity::Error, "frame-size", camera.id, frame,
                       std::to_string(image->width) + " x " + std::to_string(image->height) +
                           " px, the camera's first readable image has " +
                           std::to_string(frames.image_width) + " x " +
                           std::to_string(frames.image_height),
                       "take images of one size");
        }
        pictures.push_back(facts_of(*image, frame));
      }
      if (frames.masks.contains(frame) || frames.labels.contains(frame)) {
        const auto mask = guarded([&] { return reader.mask(index, frame); }, "mask-damaged",
                                  camera.id, frame, gathered);
        if (mask) {
          judge_mask(camera.id, frame, *mask, !frames.masks.contains(frame), gathered);
          if ((frames.masks.empty() ? frames.labels : frames.masks).begin()->first == frame) {
            judge_mask_size(reader, index, frame, *mask, gathered);
          }
        }
        if (mask && image) {
          pictures.back().person = colour_on(*image, *mask, camera);
          if (mask->width != image->width || mask->height != image->height) {
            gathered.add(Severity::Error, "mask-size", camera.id, frame,
                         std::to_string(mask->width) + " x " + std::to_string(mask->height) +
                             " px, the image has " + std::to_string(image->width) + " x " +
                             std::to_string(image->height),
                         "make masks of the images' size");
          }
        }
      }
      if (frames.masks.contains(frame) && frames.labels.contains(frame)) {
        guarded([&] { return reader.labels(index, frame); }, "labels-damaged", camera.id, frame,
                gathered);
      }
      if (told) {
        told(++done, total);
      }
    }
    judge_pictures(camera.id, pictures, options, gathered);
    all_pictures[c] = std::move(pictures);
  }
  if (!without_pictures.empty()) {
    camera_findings.push_back(without_pictures_finding(without_pictures, any_picture));
  }
  std::vector<Finding> findings = gathered.findings();
  compare_cameras(dataset.cameras, all_pictures, findings);
  findings.insert(findings.begin(), camera_findings.begin(), camera_findings.end());
  return findings;
}

}  // namespace atelier
