#include "capture/detection/detect.h"

#include <algorithm>
#include <iostream>
#include <memory>

#include "apps/console/arguments.h"
#include "apps/console/command.h"
#include "apps/console/option_flags.h"
#include "apps/console/tell_consent.h"
#include "capture/frame_reader.h"
#include "capture/keypoint_schema.h"
#include "capture/label_taxonomy.h"
#include "capture/layouts/open_dataset.h"
#include "capture/people/detect_people.h"
#include "capture/people/person_mask.h"
#include "capture/people/second_look.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/exit_code.h"
#include "core/io/file_bytes.h"
#include "core/io/ground_truth_archive.h"
#include "core/io/image_file.h"
#include "core/printable.h"
#include "core/store/output_place.h"
#include "core/usage_error.h"
#include "core/writable_place.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kMaxModelBytes = 2'000'000'000;  // protobuf holds no more

struct DetectArguments {
  std::string capture;
  std::string model;
  std::string networks;
  std::string out;
};

struct DetectCommandOptions {
  DatasetOptions capture;
  std::string schema = "auto";
  std::string taxonomy = "auto";
  DetectOptions network;
  FindPeopleOptions people;
  bool views = true;   ///< look again where calibrated cameras disagree
  bool masks = false;  ///< of the built-in detector, as labels
  PeopleMaskOptions mask;
};

OptionTable describe(DetectCommandOptions& options) {
  OptionTable table;
  table.add("capture", describe(options.capture));
  std::vector<std::string> schemas = keypoint_schema_names();
  schemas.insert(schemas.begin(), "auto");
  table.add("schema", options.schema, schemas,
            "Order of the keypoints of the network; auto: recognised by their number");
  std::vector<std::string> taxonomies = label_taxonomy_names();
  taxonomies.insert(taxonomies.begin(), "auto");
  table.add("taxonomy", options.taxonomy, taxonomies,
            "Numbering of the classes of a parsing network; auto: recognised by their number");
  table.add(describe(options.network));
  table.add(describe(options.people));
  table.add("views", options.views,
            "Second look of the built-in detector where calibrated cameras disagree");
  table.add("masks", options.masks,
            "Masks of the people beside their keypoints, by the built-in detector");
  return table.add("mask", describe(options.mask));
}

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
DetectBox box_of(FrameReader& reader, Index camera, int frame, const ByteImage& image,
                 const DetectOptions& options) {
  if (options.box != DetectArea::Mask) {
    return whole_box(image.width, image.height);
  }
  const auto mask = reader.mask(camera, frame);
  return mask ? mask_box(*mask, options.padding) : whole_box(image.width, image.height);
}

/// Notes the order of points in capture.toml, where the results are the capture's own.
void note_schema(const fs::path& capture, const std::string& schema) {
  CaptureInfo info = read_capture_info(capture);
  if (info.keypoint_schema != schema) {
    info.keypoint_schema = schema;
    write_file_atomically(capture / "capture.toml", capture_toml(info));
  }
}

/// The folder that results are written to, of a capture that was opened. Throws UsageError where
/// something is in the way.
fs::path result_folder(const DetectArguments& arguments, const Dataset& dataset,
                       const std::vector<std::string>& parts) {
  const bool in_place = arguments.out.empty();
  if (in_place && dataset.layout != "native") {
    throw UsageError("CAPTURE has the layout " + dataset.layout +
                     ", which takes no detections: give --out FOLDER, or make it native with "
                     "atelier convert-capture");
  }
  std::error_code error;
  if (!in_place &&
      (!fs::equivalent(arguments.out, arguments.capture, error) || dataset.layout != "native")) {
    require_outside_input(arguments.out, arguments.capture, "--out", "CAPTURE");
    require_outside_captures(arguments.out, "--out");
  }
  fs::path out = in_place ? arguments.capture : arguments.out;
  require_folder_place(out);
  for (const std::string& part : parts) {
    require_new_place(out / part, "--out");
  }
  return out;
}

void write_keypoints(const fs::path& out, const std::string& camera, int frame,
                     const std::vector<PersonKeypoints>& people) {
  make_private_directory(out / "keypoints2d" / camera);
  write_file_atomically(out / "keypoints2d" / camera / (frame_name(frame) + ".json"),
                        openpose_json(people));
}

/// By a network of the user's.
int run_own_network(const DetectArguments& arguments, const DetectCommandOptions& options,
                    const Dataset& dataset, const fs::path& out) {
  const std::vector<std::byte> model = read_file_bytes(arguments.model, kMaxModelBytes);
  FrameReader reader(dataset);
  std::string said;  // schema or taxonomy
  int pictures = 0;
  int people = 0;
  for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
    const auto camera = static_cast<Index>(c);
    const std::string& id = dataset.cameras[c].id;
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
        picture.image = *reader.byte_image(camera, frames[i]);
        picture.box = box_of(reader, camera, frames[i], picture.image, options.network);
        batch.push_back(std::move(picture));
      }
      const std::vector<Detection> found = detect(model, batch, options.network, arguments.model);
      for (std::size_t i = 0; i < found.size(); ++i) {
        const Detection& one = found[i];
        if (!one.classes.data.empty()) {
          said = taxonomy_of(options.taxonomy, one.class_count, arguments.model);
          make_private_directory(out / "labels" / id);
          write_labels(out / "labels" / id / (frame_name(frames[first + i]) + ".png"),
                       to_atelier_labels(one.classes, label_taxonomy(said), arguments.model));
        } else {
          std::vector<PersonKeypoints> persons;
          for (const DetectedPoints& points : one.people) {
            said = schema_of(options.schema, points.rows(), arguments.model);
            PersonKeypoints person;
            person.points = points;
            persons.push_back(person);
          }
          people += static_cast<int>(persons.size());
          write_keypoints(out, id, frames[first + i], persons);
        }
        ++pictures;
      }
    }
  }
  if (pictures == 0) {
    throw DataError(arguments.capture, "", "no images", "some");
  }
  if (options.network.kind == NetworkKind::Parsing) {
    std::cout << pictures << " images, classes of " << said
              << " as labels of atelier: " << (out / "labels").string() << "\n";
    return kExitDone;
  }
  if (arguments.out.empty() && !said.empty()) {
    note_schema(out, said);
  }
  std::cout << pictures << " images, " << people << " people, points in the order "
            << (said.empty() ? "(nobody was found)" : said) << ": "
            << (out / "keypoints2d").string() << "\n";
  return kExitDone;
}

/// By the built-in detector.
int run_built_in(const DetectArguments& arguments, const DetectCommandOptions& options,
                 const Dataset& dataset, const fs::path& out, const PeopleNetworks& networks) {
  DetectPeopleOptions how;
  how.find = options.people;
  how.threshold = options.network.threshold;
  how.views = options.views;
  how.memory = options.network.memory;
  const PeopleCount count = detect_people(
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
  for (const Finding& finding : count.findings) {
    std::cerr << "warning: " << finding.place << ": " << finding.what << "; " << finding.advice
              << "\n";
  }
  if (count.images == 0) {
    throw DataError(arguments.capture, "", "no images that can be read", "some");
  }
  if (arguments.out.empty()) {
    note_schema(out, kBuiltInSchema);
  }
  std::cout << count.images << " images, " << count.people << " people, points in the order "
            << kBuiltInSchema << ": " << (out / "keypoints2d").string() << "\n";
  if (options.masks) {
    std::cout << "masks of the people: " << (out / "labels").string() << "\n";
  }
  if (count.looked_again + count.mirrored > 0) {
    std::cout << "views that disagreed with the others: " << count.looked_again << ", of which "
              << count.settled
              << " agree after a second look; left and right exchanged: " << count.mirrored << "\n";
  }
  return kExitDone;
}

int run(const DetectArguments& arguments, const DetectCommandOptions& options) {
  if (arguments.capture.empty()) {
    throw UsageError("detect takes a CAPTURE: atelier detect CAPTURE");
  }
  const bool built_in = arguments.model.empty();
  if (built_in && options.schema != "auto" && options.schema != kBuiltInSchema) {
    throw UsageError("the built-in detector's points are in the order " +
                     std::string(kBuiltInSchema) + "; --schema is for a --model of yours");
  }
  if (built_in && options.network.kind == NetworkKind::Parsing) {
    throw UsageError(
        "--kind parsing takes --model FILE.onnx; the built-in detector finds "
        "keypoints");
  }
  if (!built_in && options.masks) {
    throw UsageError("--masks is for the built-in detector; atelier masks makes them otherwise");
  }
  if (!built_in && !arguments.networks.empty()) {
    throw UsageError("--networks is for the built-in detector, --model for a network of yours");
  }
  if (options.network.mean.size() != 3 || options.network.standard_deviation.size() != 3) {
    throw UsageError(
        "--mean and --standard-deviation take three numbers each, as in [124, 116, 104]");
  }
  const Dataset dataset = open_dataset(arguments.capture, options.capture);
  tell_ended_consent(dataset);
  const bool parsing = options.network.kind == NetworkKind::Parsing;
  std::vector<std::string> parts = {parsing ? "labels" : "keypoints2d"};
  if (options.masks) {
    parts.emplace_back("labels");
  }
  const fs::path out = result_folder(arguments, dataset, parts);
  if (!built_in) {
    return run_own_network(arguments, options, dataset, out);
  }
  return run_built_in(arguments, options, dataset, out,
                      read_people_networks(arguments.networks.empty() ? default_network_folder()
                                                                      : arguments.networks,
                                           options.people.network));
}

}  // namespace

OptionSet detect_options() {
  return option_set<DetectCommandOptions>();
}

Action add_detect(CLI::App& parser) {
  auto arguments = std::make_shared<DetectArguments>();
  add_option(parser, "CAPTURE", arguments->capture, "Capture of any layout").required();
  add_option(parser, "--model", arguments->model,
             "ONNX network of your own, instead of the built-in detector")
      .type_name("FILE.onnx");
  add_option(parser, "--networks", arguments->networks,
             "Folder of the built-in detector's networks, as scripts/detector-networks writes them")
      .type_name("FOLDER");
  add_option(parser, "--out", arguments->out,
             "Folder for keypoints2d/ or labels/; a native CAPTURE itself by default")
      .type_name("FOLDER");
  const OptionReader options = add_option_flags(parser, detect_options());
  return
      [arguments, options] { return run(*arguments, options_of<DetectCommandOptions>(options())); };
}

}  // namespace atelier
