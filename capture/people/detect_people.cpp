#include "capture/people/detect_people.h"

#include <algorithm>
#include <cmath>
#include <exception>

#include "capture/camera_conventions.h"
#include "capture/frame_reader.h"
#include "capture/image_turns.h"
#include "capture/people/second_look.h"
#include "core/error.h"
#include "core/parallel.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

constexpr int kFramesAtOnce = 16;
constexpr double kImageBytesAtOnce = 1e9;
constexpr std::int64_t kSecondsOfImage = 5;  ///< processor time, far above what one takes
constexpr double kQuarterTurn = 1.57079632679489661923;  ///< rad

/// Every frame that some camera has an image of.
std::vector<int> frames_with_images(const Dataset& dataset) {
  std::vector<int> frames;
  for (const CameraFrames& camera : dataset.frames) {
    std::vector<int> of_camera;
    for (const auto& [frame, place] : camera.images) {
      of_camera.push_back(frame);
    }
    add_frames(frames, of_camera);
  }
  return frames;
}

std::size_t frames_at_once(const Dataset& dataset) {
  double bytes = 1;
  for (const CameraFrames& camera : dataset.frames) {
    bytes += 3.0 * camera.image_width * camera.image_height;
  }
  return static_cast<std::size_t>(
      std::clamp(saturating_cast<int>(kImageBytesAtOnce / bytes), 1, kFramesAtOnce));
}

/// Clockwise quarters by which each camera's images are turned for the detector.
std::vector<int> turns_of(const Dataset& dataset) {
  std::vector<int> turns;
  turns.reserve(dataset.frames.size());
  for (const CameraFrames& camera : dataset.frames) {
    turns.push_back(quarters_upright(camera.image_orientation));
  }
  return turns;
}

std::vector<Camera> shown_cameras(const Dataset& dataset, const std::vector<int>& turns) {
  std::vector<Camera> cameras;
  cameras.reserve(dataset.cameras.size());
  for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
    cameras.push_back(turned_camera(dataset.cameras[c], turns[c]));
  }
  return cameras;
}

/// A person of a turned image in the image as it is stored.
/// @param width, height  px, as stored
PersonLandmarks stored_person(PersonLandmarks person, int quarters, int width, int height) {
  const auto turn_crop = [&](PersonCrop& crop) {
    crop.center = turned_back(crop.center, quarters, width, height);
    crop.turn -= quarters * kQuarterTurn;
  };
  for (Index k = 0; k < person.points.rows(); ++k) {
    person.points.row(k).head<2>() =
        turned_back(person.points.row(k).head<2>().transpose(), quarters, width, height)
            .transpose();
  }
  turn_crop(person.crop);
  turn_crop(person.next);
  return person;
}

/// Some frames of every camera; an image without pixels where there is none.
using ImagesInViews = std::vector<std::vector<ByteImage>>;

ImagesInViews read_images(std::vector<FrameReader>& readers, const std::vector<int>& frames,
                          const std::vector<int>& turns, std::vector<Finding>& findings) {
  ImagesInViews images(readers.size(), std::vector<ByteImage>(frames.size()));
  std::vector<std::vector<Finding>> damaged(readers.size());
  parallel_for(static_cast<Index>(readers.size()), 1, [&](Index begin, Index end) {
    for (Index c = begin; c < end; ++c) {
      const auto camera = static_cast<std::size_t>(c);
      const std::string& id = readers[camera].dataset().cameras[camera].id;
      for (std::size_t f = 0; f < frames.size(); ++f) {
        try {
          if (auto image = readers[camera].byte_image(c, frames[f])) {
            images[camera][f] =
                turns[camera] == 0 ? std::move(*image) : turned_image(*image, turns[camera]);
          }
        } catch (const DataError& error) {
          damaged[camera].push_back({Severity::Warning, "image-broken",
                                     id + " frame " + std::to_string(frames[f]), error.what(),
                                     "replace the file; nobody was looked for in it"});
        }
      }
    }
  });
  for (const auto& some : damaged) {
    findings.insert(findings.end(), some.begin(), some.end());
  }
  return images;
}

/// find_people over what is there, and where the people of the next frames are expected.
PeopleInViews look_once(const PeopleNetworks& networks, ImagesInViews& images,
                        const std::vector<std::vector<PersonCrop>>& expected,
                        const FindPeopleOptions& options, const Limits& limits) {
  std::vector<ImageSequence> sequences(images.size());
  for (std::size_t c = 0; c < images.size(); ++c) {
    sequences[c].expected = expected[c];
    for (ByteImage& image : images[c]) {
      if (!image.data.empty()) {
        sequences[c].images.push_back(std::move(image));
      }
    }
  }
  const auto found = find_people(networks, sequences, options, limits);
  PeopleInViews people(images.size());
  for (std::size_t c = 0; c < images.size(); ++c) {
    people[c].resize(images[c].size());
    std::size_t next = 0;
    for (std::size_t f = 0; f < images[c].size(); ++f) {
      if (images[c][f].width > 0) {  // pixels were lent to the sequence
        images[c][f] = std::move(sequences[c].images[next]);
        people[c][f] = found[c][next++];
      }
    }
  }
  return people;
}

void look_again(const std::vector<Camera>& cameras, const PeopleNetworks& networks,
                const ImagesInViews& images, const DetectPeopleOptions& options,
                const Limits& limits, PeopleInViews& people, PeopleCount& count) {
  SecondLookOptions how;
  how.threshold = options.threshold;
  std::vector<SecondLook> looks = second_looks(cameras, people, how, count.mirrored);
  std::erase_if(looks, [&](const SecondLook& look) {
    return images[static_cast<std::size_t>(look.camera)][look.frame].data.empty();
  });
  std::vector<CropOfImage> crops;
  crops.reserve(looks.size());
  for (const SecondLook& look : looks) {
    crops.push_back({&images[static_cast<std::size_t>(look.camera)][look.frame], look.crop});
  }
  const std::vector<PersonLandmarks> found = landmarks_of_crops(networks, crops, limits);
  for (std::size_t i = 0; i < looks.size(); ++i) {
    const Camera& camera = cameras[static_cast<std::size_t>(looks[i].camera)];
    ++count.looked_again;
    count.settled +=
        take_second_look(looks[i], found[i], camera, how, options.find.min_presence, people) ? 1
                                                                                             : 0;
  }
}

}  // namespace

PeopleCount detect_people(
    const Dataset& dataset, const PeopleNetworks& networks, const DetectPeopleOptions& options,
    const std::function<void(Index camera, int frame, const PeopleInImage& people,
                             const ByteImage& image)>& each) {
  const std::vector<int> frames = frames_with_images(dataset);
  const std::size_t at_once = frames_at_once(dataset);
  std::vector<FrameReader> readers;
  readers.reserve(dataset.cameras.size());
  for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
    readers.emplace_back(dataset);
  }
  Limits limits;
  limits.worker_memory_bytes = static_cast<std::int64_t>(options.memory) << 20;
  limits.worker_cpu_seconds =
      kSecondsOfImage *
      static_cast<std::int64_t>(at_once * std::max<std::size_t>(1, readers.size()));
  const std::vector<int> turns = turns_of(dataset);
  const std::vector<Camera> cameras = shown_cameras(dataset, turns);
  PeopleCount count;
  std::vector<std::vector<PersonCrop>> expected(readers.size());
  for (std::size_t first = 0; first < frames.size(); first += at_once) {
    const std::vector<int> some(
        frames.begin() + static_cast<std::ptrdiff_t>(first),
        frames.begin() + static_cast<std::ptrdiff_t>(std::min(frames.size(), first + at_once)));
    ImagesInViews images = read_images(readers, some, turns, count.findings);
    PeopleInViews people = look_once(networks, images, expected, options.find, limits);
    if (options.views && dataset.calibrated && dataset.cameras.size() > 1) {
      look_again(cameras, networks, images, options, limits, people, count);
    }
    for (std::size_t f = 0; f < some.size(); ++f) {
      for (std::size_t c = 0; c < readers.size(); ++c) {
        if (images[c][f].data.empty()) {
          continue;
        }
        expected[c].clear();
        for (const PersonLandmarks& one : people[c][f]) {
          expected[c].push_back(one.next);
        }
        ++count.images;
        count.people += static_cast<int>(people[c][f].size());
        if (turns[c] != 0) {
          images[c][f] = turned_image(images[c][f], -turns[c]);
          for (PersonLandmarks& one : people[c][f]) {
            one = stored_person(std::move(one), turns[c], images[c][f].width, images[c][f].height);
          }
        }
        each(static_cast<Index>(c), some[f], people[c][f], images[c][f]);
      }
    }
  }
  return count;
}

}  // namespace atelier
