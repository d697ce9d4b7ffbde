#include "pipeline/detection/detect_capture.h"

#include <algorithm>

#include "capture/frame_reader.h"
#include "capture/image_turns.h"
#include "capture/keypoint_schema.h"
#include "capture/keypoints2d.h"
#include "capture/label_taxonomy.h"
#include "capture/people/second_look.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/image_file.h"
#include "core/plain_name.h"
#include "core/usage_error.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kMaxModelBytes = 2'000'000'000;  // protobuf holds no more

/// The order of that many points, unless the user says it.
std::string schema_of(const std::string& said, Index points, const std::string& model) {
  std::string schema = said != "auto" ? said : guess_keypoint_schema(points, {});
  if (schema.empty() || static_cast<Index>(keypoint_schema(schema).points.size()) != points) {
    throw DataError(model, "", std::to_string(points) + " points",
                    schema.empty() ? "as many as an order that is known; --schema says which"
                                   : std::to_string(keypoint_schema(schema).points.size()) +
                                         ", as " + schema + " has");
  }
  return schema;
}

std::string taxonomy_of(const std::string& said, int classes, const std::string& model) {
  if (said != "auto") {
    if (static_cast<int>(label_taxonomy(said).labels.size()) != classes) {
      throw DataError(model, "", std::to_string(classes) + " classes",
                      std::to_string(label_taxonomy(said).labels.size()) + ", as " + said + " has");
    }
    return said;
  }
  std::string found;
  for (const std::string& name : label_taxonomy_names()) {
    if (static_cast<int>(label_taxonomy(name).labels.size()) == classes) {
      if (!found.empty()) {
        throw UsageError(std::string("--taxonomy must say which: ")
                             .append(found)
                             .append(" and ")
                             .append(name)
                             .append(" both have ")
                             .append(std::to_string(classes))
                             .append(" classes"));
      }
      found = name;
    }
  }
  if (found.empty()) {
    throw DataError(model, "", std::to_string(classes) + " classes",
                    "as many as a taxonomy that is known has; --taxonomy lists them");
  }
  return found;
}

/// One part of an image that a network looks at: round the mask, or all of it.
/// @param quarters  by which the image was turned
DetectBox box_of(FrameReader& reader, Index camera, int frame, const ByteImage& image, int quarters,
                 const DetectOptions& options) {
  if (options.box != DetectArea::Mask) {
    return whole_box(image.width, image.height);
  }
  const auto mask = reader.mask(camera, frame);
  return mask ? mask_box(turned_image(*mask, quarters), options.padding)
              : whole_box(image.width, image.height);
}

/// Points of a turned image in the image as it is stored; what was not found stays 0.
/// @param width, height  px, as stored
DetectedPoints turned_points(DetectedPoints points, int quarters, int width, int height) {
  for (Index k = 0; quarters != 0 && k < points.rows(); ++k) {
    if (!points.row(k).isZero(0)) {
      points.row(k).head<2>() =
          turned_back(points.row(k).head<2>().transpose(), quarters, width, height).transpose();
    }
  }
  return points;
}

void write_keypoints(const fs::path& out, const std::string& camera, int frame,
                     const std::vector<PersonKeypoints>& people) {
  make_private_directory(out / "keypoints2d" / camera);
  write_file_atomically(out / "keypoints2d" / camera / (frame_name(frame) + ".json"),
                        openpose_json(people));
}

}  // namespace

void note_schema(const fs::path& capture, const std::string& schema) {
  CaptureInfo info = read_capture_info(capture);
  if (info.keypoint_schema != schema) {
    info.keypoint_schema = schema;
    write_file_atomically(capture / "capture.toml", capture_toml(info));
  }
}

DetectedCapture detect_by_own_network(const Dataset& dataset, const std::string& model_file,
                                      const CaptureDetectOptions& options, const fs::path& out) {
  const std::vector<std::byte> model = read_file_bytes(model_file, kMaxModelBytes);
  FrameReader reader(dataset);
  DetectedCapture all;
  for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
    const auto camera = static_cast<Index>(c);
    const std::string& id = dataset.cameras[c].id;
    const int quarters = quarters_upright(dataset.frames[c].image_orientation);
    std::vector<int> frames;
    for (const auto& [frame, place] : dataset.frames[c].images) {
      frames.push_back(frame);
    }
    for (std::size_t first = 0; first < frames.size();
         first += static_cast<std::size_t>(options.network.batch)) {
      const std::size_t last =
          std::min(frames.size(), first + static_cast<std::size_t>(options.network.batch));
      std::vector<DetectPicture> batch;
      for (std::size_t i = first; i < last; ++i) {
        DetectPicture picture;
        picture.image = turned_image(*reader.byte_image(camera, frames[i]), quarters);
        picture.box = box_of(reader, camera, frames[i], picture.image, quarters, options.network);
        batch.push_back(std::move(picture));
      }
      const std::vector<Detection> found = detect(model, batch, options.network, model_file);
      for (std::size_t i = 0; i < found.size(); ++i) {
        const Detection& one = found[i];
        if (!one.classes.data.empty()) {
          all.said = taxonomy_of(options.taxonomy, one.class_count, model_file);
          make_private_directory(out / "labels" / id);
          write_labels(out / "labels" / id / (frame_name(frames[first + i]) + ".png"),
                       to_atelier_labels(turned_image(one.classes, -quarters),
                                         label_taxonomy(all.said), model_file));
        } else {
          std::vector<PersonKeypoints> persons;
          for (const DetectedPoints& points : one.people) {
            all.said = schema_of(options.schema, points.rows(), model_file);
            PersonKeypoints person;
            const ByteImage& turned = batch[i].image;
            const bool side = quarters % 2 != 0;
            person.points = turned_points(points, quarters, side ? turned.height : turned.width,
                                          side ? turned.width : turned.height);
            persons.push_back(person);
          }
          all.people += static_cast<int>(persons.size());
          write_keypoints(out, id, frames[first + i], persons);
        }
        ++all.images;
      }
    }
  }
  return all;
}

PeopleCount detect_by_built_in(const Dataset& dataset, const PeopleNetworks& networks,
                               const CaptureDetectOptions& options, const fs::path& out) {
  DetectPeopleOptions how;
  how.find = options.people;
  how.threshold = options.network.threshold;
  how.views = options.views;
  how.memory = options.network.memory;
  return detect_people(
      dataset, networks, how,
      [&](Index camera, int frame, const PeopleInImage& people, const ByteImage& image) {
        std::vector<PersonKeypoints> persons;
        for (const PersonLandmarks& one : people) {
          persons.push_back({-1, found_points(one, image.width, image.height, how.threshold)});
        }
        const std::string& id = dataset.cameras[static_cast<std::size_t>(camera)].id;
        write_keypoints(out, id, frame, persons);
        if (options.masks) {
          make_private_directory(out / "labels" / id);
          write_labels(out / "labels" / id / (frame_name(frame) + ".png"),
                       people_mask(people, image, options.mask));
        }
      });
}

}  // namespace atelier
