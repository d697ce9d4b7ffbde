#include <functional>
#include <map>
#include <optional>
#include <type_traits>

#include "capture/dataset.h"
#include "capture/detections.h"
#include "capture/frame_reader.h"
#include "capture/keypoint_schema.h"
#include "capture/layouts/open_dataset.h"
#include "capture/linear_triangulation.h"
#include "capture/triangulation.h"
#include "core/label.h"
#include "core/store/consent.h"
#include "python/arrays.h"
#include "python/bindings.h"
#include "python/checks.h"
#include "python/images.h"
#include "python/options.h"
#include "python/signals.h"

ATELIER_OPTIONS(DatasetOptions);
ATELIER_OPTIONS(TriangulationOptions);

namespace atelier::python {
namespace {

using namespace py::literals;
using Path = std::filesystem::path;

void bind_info(py::module_& module) {
  py::class_<Consent>(module, "Consent", "Consent of a recorded person.")
      .def_readonly("who", &Consent::who, "name or pseudonym")
      .def_readonly("scope", &Consent::scope, "what the recording may be used for")
      .def_readonly("until", &Consent::until, "last day, \"2030-12-31\", or \"\" for no end")
      .def_readonly("revocation", &Consent::revocation,
                    "list of revoked consents, a file or an address, or \"\"")
      .def_readonly("key", &Consent::key, "public key of who signed it, or \"\"")
      .def_readonly("signature", &Consent::signature)
      .def("__repr__",
           [](const Consent& self) { return "<Consent of " + to_string({self}) + ">"; });
  py::class_<CaptureSequence>(module, "CaptureSequence", "Frames that were taken in one go.")
      .def_readonly("name", &CaptureSequence::name)
      .def_readonly("kind", &CaptureSequence::kind, "\"minimal\" or \"clothed\"")
      .def_readonly("fps", &CaptureSequence::fps, "frames per second")
      .def_property_readonly(
          "frame_ids",
          [](py::object self) {
            return read_only(array_over(self.cast<CaptureSequence&>().frame_ids, self));
          },
          "[N] increasing");
  py::class_<CaptureInfo>(module, "CaptureInfo", "Metadata of a capture.")
      .def_readonly("subject", &CaptureInfo::subject, "name or pseudonym")
      .def_readonly("sequences", &CaptureInfo::sequences)
      .def_readonly("keypoint_schema", &CaptureInfo::keypoint_schema, "of the 2D detections")
      .def_readonly("label_taxonomy", &CaptureInfo::label_taxonomy,
                    "of the label images as they lie; FrameReader maps them to \"atelier\"")
      .def_readonly("held_out_cameras", &CaptureInfo::held_out_cameras,
                    "ids; no stage opens their images")
      .def_property_readonly(
          "held_out_frames",
          [](py::object self) {
            return read_only(array_over(self.cast<CaptureInfo&>().held_out_frames, self));
          },
          "[N] frame ids that no training sees")
      .def_readonly("synthetic", &CaptureInfo::synthetic, "there is a ground truth")
      .def_readonly("image_format", &CaptureInfo::image_format, "\"png\" or \"jpg\"")
      .def_readonly("consent", &CaptureInfo::consent)
      .def("__repr__", [](const CaptureInfo& self) {
        return "<CaptureInfo of '" + self.subject + "', " + std::to_string(self.sequences.size()) +
               (self.sequences.size() == 1 ? " sequence" : " sequences") +
               ", consent: " + to_string(self.consent) + ">";
      });
  py::class_<WorldConvention>(module, "WorldConvention",
                              "Unit and up axis of the files; a Dataset is in metres, Y up.")
      .def_readonly("metres_per_unit", &WorldConvention::metres_per_unit,
                    "0: the layout does not say")
      .def_readonly("up", &WorldConvention::up,
                    "\"y\", \"z\", \"-y\", ..., or \"\": it does not say")
      .def_readonly("up_guessed", &WorldConvention::up_guessed, "nobody says it; y is taken");
}

void bind_datasets(py::module_& module) {
  py::class_<Dataset> capture(module, "Dataset", "Index of a capture in any layout: metres, Y up.");
  list_of_copies<&Dataset::cameras>(capture, "cameras", "[C], copied");
  capture.def_readonly("layout", &Dataset::layout)
      .def_readonly("evidence", &Dataset::evidence, "how the layout was recognised")
      .def_readonly("root", &Dataset::root)
      .def_readonly("calibrated", &Dataset::calibrated)
      .def_readonly("findings", &Dataset::findings)
      .def_readonly("info", &Dataset::info, "subject, sequences, schemas, held-out data, consent")
      .def_readonly("keypoint_schema_3d", &Dataset::keypoint_schema_3d,
                    "of keypoints in space, or \"\"")
      .def_readonly("world_convention", &Dataset::world_convention, "unit and up axis of the files")
      .def_readonly("corrections", &Dataset::corrections,
                    "those that were asked for, by name, copied")
      .def("__repr__", [](const Dataset& self) {
        return "<Dataset '" + self.layout + "', " + std::to_string(self.cameras.size()) +
               " cameras, " + std::to_string(frame_ids(self).size()) + " frames>";
      });
  module.def(
      "open_dataset",
      [](const Path& path, const DatasetOptions& options) { return open_dataset(path, options); },
      "path"_a, "options"_a = py::none(), py::call_guard<LongCall>(),
      "A capture: a folder of any layout, or a calibration file with its folder around it.");
  module.def(
      "label_names",
      [] {
        std::map<int, std::string> names;
        for (const Label label : all_labels()) {
          names[static_cast<int>(label)] = label_name(label);
        }
        return names;
      },
      "Names of label images' numbers and of Mesh.labels: the taxonomy \"atelier\".");
  module.def("frame_ids", &frame_ids, "dataset"_a, "Every frame of every sequence, increasing.");
  module.def("camera_index", &camera_index, "dataset"_a, "id"_a, "-1 if there is none");
}

template <class T>
py::object optional_image(std::optional<ImageOf<T>> image) {
  return image ? py::object(image_array(*std::move(image))) : py::object(py::none());
}

/// Throws DataError for a camera that the data set does not have.
void require_camera(const FrameReader& reader, Index camera_idx) {
  const auto count = static_cast<Index>(reader.dataset().cameras.size());
  if (camera_idx < 0 || camera_idx >= count) {
    throw DataError("", "camera_idx", std::to_string(camera_idx),
                    "a camera, 0 to " + std::to_string(count - 1));
  }
}

/// What a camera has of a frame, read without the interpreter's lock.
template <class Read>
auto reading(Read read) {
  return [read](FrameReader& self, Index camera_idx, int frame_id) {
    require_camera(self, camera_idx);
    std::invoke_result_t<Read, FrameReader&, Index, int> image;
    {
      const LongCall released;
      image = std::invoke(read, self, camera_idx, frame_id);
    }
    return optional_image(std::move(image));
  };
}

void bind_reader(py::module_& module) {
  py::class_<PersonKeypoints>(module, "PersonKeypoints", "Detections of one person in one image.")
      .def_readonly("id", &PersonKeypoints::id)
      .def_property_readonly(
          "points",
          [](py::object self) { return array_over(self.cast<PersonKeypoints&>().points, self); },
          "[K,3] pixels and confidence; 0, 0, 0: not found");
  py::class_<PersonPoints>(module, "PersonPoints", "One person in space.")
      .def_readonly("id", &PersonPoints::id)
      .def_property_readonly(
          "points",
          [](py::object self) { return array_over(self.cast<PersonPoints&>().points, self); },
          "[K,4] metres and confidence");
  py::class_<FrameReader>(
      module, "FrameReader",
      "Opens the frames of a data set one at a time; for one thread. What is not "
      "there is None.")
      .def(py::init([](const Dataset& dataset) { return FrameReader(dataset); }), "dataset"_a)
      .def_property_readonly("dataset", [](const FrameReader& self) { return self.dataset(); })
      .def("image", reading(&FrameReader::image), "camera_idx"_a, "frame_id"_a,
           "Linear light, float32 [H,W,C].")
      .def("byte_image", reading(&FrameReader::byte_image), "camera_idx"_a, "frame_id"_a,
           "sRGB bytes, uint8 [H,W,C].")
      .def("mask", reading(&FrameReader::mask), "camera_idx"_a, "frame_id"_a,
           "255 on the person, uint8 [H,W].")
      .def("labels", reading(&FrameReader::labels), "camera_idx"_a, "frame_id"_a,
           "uint8 [H,W] of the taxonomy \"atelier\".")
      .def(
          "keypoints",
          [](FrameReader& self, Index camera_idx, int frame_id) {
            require_camera(self, camera_idx);
            return self.keypoints(camera_idx, frame_id);
          },
          "camera_idx"_a, "frame_id"_a, "Everybody who was found.")
      .def("keypoints3d", &FrameReader::keypoints3d, "frame_id"_a, "Everybody in space.");
}

void bind_keypoints(py::module_& module) {
  py::class_<KeypointSchema> schema(module, "KeypointSchema", "An order of 2D keypoints.");
  schema.def_readonly("name", &KeypointSchema::name);
  schema.def_readonly("points", &KeypointSchema::points);
  module.def("keypoint_schema_names", &keypoint_schema_names,
             "Names of the orders of keypoints that are known.");
  module.def(
      "keypoint_schema", [](const std::string& name) { return keypoint_schema(name); }, "name"_a,
      "\"body_25\", \"coco_17\", ...: raises DataError for an unknown one.");

  py::class_<Detections>(module, "Detections", "Everybody who was found in some frames.")
      .def_property_readonly(
          "frame_ids",
          [](py::object self) { return array_over(self.cast<Detections&>().frame_ids, self); })
      .def_readonly("people", &Detections::people, "[F][camera][person], copied")
      .def_readonly("findings", &Detections::findings);
  module.def("read_detections", &read_detections, "reader"_a, "frames"_a,
             py::call_guard<LongCall>(),
             "Detections of every person in frames [F], of every camera; a damaged file is one of "
             "`findings` and counts as nobody there.");
  module.def(
      "main_person", &main_person, "detections"_a,
      "[frame][camera] of [K,3]: who has the most confident points; no rows where nobody is.");
}

/// One member of every point of every frame, as an array [F,K], or [F,K] and `shape` behind it.
template <class Number, class Read>
py::array gathered(const Triangulation& all, const std::vector<std::size_t>& shape,
                   const Read& read) {
  std::vector<std::size_t> sizes = {all.frames.size(),
                                    all.frames.empty() ? 0 : all.frames.front().points.size()};
  sizes.insert(sizes.end(), shape.begin(), shape.end());
  std::vector<Number> numbers;
  for (const SpacePose& pose : all.frames) {
    for (const SpacePoint& point : pose.points) {
      read(point, numbers);
    }
  }
  return array_of(std::move(numbers)).reshape(sizes);
}

/// Throws DataError unless every frame has the keypoints of every camera, or none.
void require_detections(const std::vector<Camera>& cameras,
                        const std::vector<std::vector<Keypoints2d>>& detections,
                        const KeypointSchema& schema) {
  for (std::size_t f = 0; f < detections.size(); ++f) {
    const std::string frame = "detections, frame " + std::to_string(f);
    require_rows(frame, static_cast<Index>(detections[f].size()),
                 static_cast<Index>(cameras.size()), "cameras");
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      if (detections[f][c].rows() > 0) {
        require_rows(frame + ", camera " + std::to_string(c), detections[f][c].rows(),
                     static_cast<Index>(schema.points.size()), "keypoints of the schema");
      }
    }
  }
}

void bind_triangulation(py::module_& module) {
  using Numbers = std::vector<double>;
  py::class_<Triangulation>(module, "Triangulation", "A person's sequence in space.")
      .def("__len__", [](const Triangulation& self) { return self.frames.size(); })
      .def_property_readonly(
          "points",
          [](const Triangulation& self) {
            return gathered<double>(self, {3}, [](const SpacePoint& point, Numbers& numbers) {
              numbers.insert(numbers.end(), point.place.data(), point.place.data() + 3);
            });
          },
          "[F,K,3] metres, copied; where confidence is 0 nothing was found")
      .def_property_readonly(
          "covariance",
          [](const Triangulation& self) {
            return gathered<double>(self, {3, 3}, [](const SpacePoint& point, Numbers& numbers) {
              numbers.insert(numbers.end(), point.covariance.data(), point.covariance.data() + 9);
            });
          },
          "[F,K,3,3] square metres, copied")
      .def_property_readonly(
          "confidence",
          [](const Triangulation& self) {
            return gathered<double>(self, {}, [](const SpacePoint& point, Numbers& numbers) {
              numbers.push_back(point.confidence);
            });
          },
          "[F,K] 0 to 1, copied")
      .def_property_readonly(
          "error",
          [](const Triangulation& self) {
            return gathered<double>(self, {}, [](const SpacePoint& point, Numbers& numbers) {
              numbers.push_back(point.error);
            });
          },
          "[F,K] pixels, root mean square over the views that support a point, copied")
      .def_property_readonly(
          "views",
          [](const Triangulation& self) {
            return gathered<int>(self, {}, [](const SpacePoint& point, std::vector<int>& numbers) {
              numbers.push_back(point.views);
            });
          },
          "[F,K] views that support a point, copied")
      .def_property_readonly(
          "camera_error",
          [](py::object self) {
            return array_over(self.cast<Triangulation&>().camera_error, self);
          },
          "[C] pixels, median over what each camera saw")
      .def_readonly("findings", &Triangulation::findings);
  module.def(
      "linear_points",
      [](const std::vector<Camera>& cameras, const std::vector<Keypoints2d>& detections) {
        require_rows("detections", static_cast<Index>(detections.size()),
                     static_cast<Index>(cameras.size()), "cameras");
        for (std::size_t c = 1; c < detections.size(); ++c) {
          require_rows("detections, camera " + std::to_string(c), detections[c].rows(),
                       detections[0].rows(), "points of camera 0");
        }
        return linear_points(cameras, detections);
      },
      "cameras"_a, "detections"_a, py::call_guard<LongCall>(),
      "Points [N,3] in metres from one detection of each in every camera, `detections` [C] of "
      "[N,3], "
      "pixels and confidence: least squares in the images, in which every detection counts. NaN "
      "where fewer than two cameras have a confidence above 0. Raises DataError for sizes that "
      "differ.");
  module.def(
      "triangulate",
      [](const std::vector<Camera>& cameras,
         const std::vector<std::vector<Keypoints2d>>& detections, const KeypointSchema& schema,
         double fps, const TriangulationOptions& options) {
        require_detections(cameras, detections, schema);
        return triangulate(cameras, detections, schema, fps, options);
      },
      "cameras"_a, "detections"_a, "schema"_a, "fps"_a, "options"_a = py::none(),
      py::call_guard<LongCall>(),
      "All keypoints of one person over a sequence of F frames from C cameras: robust to "
      "outliers, swaps of left and right, and jumps in time. `detections` [frame][camera] of "
      "[K,3], pixels and confidence in [0,1], or no rows; `schema` has K points; `fps` frames "
      "per second. Raises DataError for sizes that differ.");
}

}  // namespace

void bind_capture(py::module_& module) {
  ATELIER_OPTIONS_CLASS(DatasetOptions);
  ATELIER_OPTIONS_CLASS(TriangulationOptions);
  bind_info(module);
  bind_datasets(module);
  bind_reader(module);
  bind_keypoints(module);
  bind_triangulation(module);
}

}  // namespace atelier::python
