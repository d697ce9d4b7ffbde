#include "pipeline/garment/template_stage.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <vector>

#include "bodymodel/formats/personal_body.h"
#include "capture/ground_truth_scan.h"
#include "capture/label_taxonomy.h"
#include "core/error.h"
#include "core/file_kind.h"
#include "core/garment_archive.h"
#include "core/intersection.h"
#include "core/io/file_bytes.h"
#include "core/io/image_file.h"
#include "core/io/json.h"
#include "core/io/mesh_file.h"
#include "core/io/mesh_obj.h"
#include "core/normals.h"
#include "core/printable.h"
#include "core/sequence_archive.h"
#include "core/store/write_text.h"
#include "core/topology.h"
#include "core/unknown_value.h"
#include "pipeline/outfit/wearer_anatomy.h"
#include "pipeline/pictures/template_pictures.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

constexpr double kMinShare = 0.05;  // of all clothing that a frame shows: less is noise of labels

/// Where labelled surfaces and bodies come from.
struct Source {
  fs::path scans;
  fs::path capture;
  std::unique_ptr<GroundTruth> truth;
  Sequence bodies;

  Mesh scan(int id) const {
    return truth ? ground_truth_scan(*truth, read_ground_truth_frame(capture, *truth, id))
                 : read_mesh_archive(scans / (frame_name(id) + ".h5"));
  }
  bool has_scan(int id) const {
    return truth ? fs::exists(capture / "truth" / "frames" / (frame_name(id) + ".h5"))
                 : fs::exists(scans / (frame_name(id) + ".h5"));
  }
};

/// Frames that `body` does not trust.
std::set<int> untrusted_frames(const fs::path& bodies) {
  std::set<int> ids;
  const fs::path file = bodies / "certificates.json";
  if (!fs::exists(file)) {
    return ids;
  }
  const nlohmann::json all =
      parse_json(read_file_text(file, Limits().text_file_bytes), file.string());
  for (const auto& [name, frame] : all.items()) {
    if (frame.is_object() && frame.contains("trusted") && frame["trusted"] == false) {
      ids.insert(std::atoi(name.c_str()));
    }
  }
  return ids;
}

/// m2 of each label of clothing in a scan.
std::map<Label, double> cloth_areas(const Mesh& scan) {
  std::map<Label, double> areas;
  if (scan.labels.empty()) {
    return areas;
  }
  const Eigen::VectorXd face = face_areas(scan.vertices, scan.faces);
  for (Index f = 0; f < scan.faces.rows(); ++f) {
    const auto label = static_cast<Label>(scan.labels[static_cast<std::size_t>(scan.faces(f, 0))]);
    if (is_cloth(label)) {
      areas[label] += face[f];
    }
  }
  return areas;
}

/// The frames that show clothing, and how much of each label at most.
struct Wardrobe {
  std::vector<Index> rows;  // of the bodies
  std::map<Label, double> areas;
};

Wardrobe wardrobe_of(StageRun& run, const Source& source) {
  const std::set<int> untrusted = untrusted_frames(run.input("bodies"));
  Wardrobe worn;
  std::vector<Index> doubtful;
  const auto look = [&](Index row, std::vector<Index>& rows) {
    const std::map<Label, double> areas =
        cloth_areas(source.scan(source.bodies.frame_ids[static_cast<std::size_t>(row)]));
    double sum = 0;
    for (const auto& [label, area] : areas) {
      sum += area;
    }
    for (const auto& [label, area] : areas) {
      if (area > kMinShare * sum) {
        worn.areas[label] = std::max(worn.areas[label], area);
      }
    }
    if (sum > 0) {
      rows.push_back(row);
    }
  };
  for (Index row = 0; row < frame_count(source.bodies); ++row) {
    const int id = source.bodies.frame_ids[static_cast<std::size_t>(row)];
    if (run.stop_requested()) {
      break;
    }
    if (source.has_scan(id)) {
      look(row, untrusted.contains(id) ? doubtful : worn.rows);
    }
  }
  if (worn.rows.empty()) {
    worn.rows = doubtful;
  } else if (!doubtful.empty()) {
    run.warn(counted(static_cast<std::int64_t>(doubtful.size()), "frame") +
             " left out, whose body is not trusted: see the warnings of 'track' and 'body'");
  }
  return worn;
}

/// The parts between commas, without the blanks before them.
std::vector<std::string> parts_of(const std::string& text) {
  std::vector<std::string> parts;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t comma = std::min(text.find(',', begin), text.size());
    begin = std::min(text.find_first_not_of(' ', begin), comma);
    parts.push_back(text.substr(begin, comma - begin));
    begin = comma + 1;
  }
  return parts;
}

/// The label of clothing of that name.
std::optional<Label> cloth_label(const std::string& name) {
  const std::optional<Label> label = label_of(name);
  return label && is_cloth(*label) ? label : std::nullopt;
}

/// An artist's mesh.
struct Import {
  std::string text;            ///< as it was asked for
  std::optional<Label> label;  ///< none was said: the only garment
  fs::path file;
};

/// "upper=tee.obj, lower=trousers.obj", or one file.
std::vector<Import> imports_in(const std::string& text) {
  std::vector<Import> imports;
  for (const std::string& part : parts_of(text)) {
    const std::size_t equals = part.find('=');
    Import import{part, std::nullopt, part};
    if (equals != std::string::npos) {
      import.label = cloth_label(part.substr(0, equals));
    }
    if (import.label) {
      import.file = part.substr(equals + 1);
    }
    const bool again = std::any_of(imports.begin(), imports.end(), [&](const Import& other) {
      return other.label == import.label;
    });
    if (again) {
      throw UnknownValue("", "import", part,
                         "one mesh for each garment: upper=tee.obj,lower=trousers.obj");
    }
    imports.push_back(std::move(import));
  }
  return imports;
}

/// The meshes of garments that are made.
std::map<Label, fs::path> imports_of(const std::string& text, const std::vector<Label>& garments) {
  std::map<Label, fs::path> imports;
  for (const Import& import : imports_in(text)) {
    if (!import.label && garments.size() != 1) {
      throw UnknownValue("", "import", import.text,
                         "label=FILE, where several garments are worn: upper=tee.obj");
    }
    const Label label = import.label.value_or(garments.front());
    if (std::find(garments.begin(), garments.end(), label) == garments.end()) {
      throw UnknownValue(
          "", "import", import.text,
          std::string("meshes of garments that are made, such as ") + label_name(garments.front()));
    }
    if (!imports.emplace(label, import.file).second) {
      throw UnknownValue("", "import", import.text, "one mesh for each garment");
    }
  }
  return imports;
}

/// The garments that a text other than "auto" names.
std::vector<Label> labels_in(const std::string& text) {
  constexpr const char* kExpected = "upper, lower, dress or outer";
  std::vector<Label> labels;
  for (const std::string& part : parts_of(text)) {
    const std::optional<Label> label = cloth_label(part);
    if (!label) {
      throw UnknownValue("", "labels", part, kExpected);
    }
    if (std::find(labels.begin(), labels.end(), *label) != labels.end()) {
      throw UnknownValue("", "labels", part, "each garment once");
    }
    labels.push_back(*label);
  }
  if (labels.empty()) {
    throw UnknownValue("", "labels", text, std::string("auto, or ") + kExpected);
  }
  return labels;
}

std::vector<Label> wanted_garments(const std::string& text, const Wardrobe& worn,
                                   const fs::path& scans) {
  if (text != "auto") {
    return labels_in(text);
  }
  std::vector<Label> labels;
  for (const auto& [label, area] : worn.areas) {
    labels.push_back(label);
  }
  if (labels.empty()) {
    throw DataError(scans.string(), "labels", "no clothing in any frame",
                    "scans labelled upper, lower, dress or outer: label images in the capture, or "
                    "reconstruct --label-by-color");
  }
  return labels;
}

/// Sums for the metrics.
struct Sums {
  double vertices = 0, boundaries = 0, holes = 0, area = 0, unseen = 0, dynamic = 0, crossing = 0;
  double edges = 0, length = 0, squares = 0, stretch = 0;
  double carried = 0, beyond = 0, not_whole = 0;
};

void add(Sums& sums, const GarmentTemplate& made) {
  const Mesh& mesh = made.garment.mesh;
  sums.vertices += static_cast<double>(mesh.vertices.rows());
  sums.boundaries += static_cast<double>(made.garment.boundaries.size());
  sums.holes += made.holes_closed;
  sums.area += face_areas(mesh.vertices, mesh.faces).sum();
  sums.unseen += made.area_unseen;
  sums.carried += made.area_carried;
  sums.beyond = std::max(sums.beyond, made.beyond);
  sums.not_whole += made.whole ? 0 : 1;
  sums.dynamic += static_cast<double>(std::count(made.dynamic.begin(), made.dynamic.end(), 1));
  sums.crossing += static_cast<double>(self_intersections(mesh.vertices, mesh.faces).size());
  const Topology topology = topology_of(mesh.faces, mesh.vertices.rows());
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    const double length =
        (mesh.vertices.row(topology.edges(e, 0)) - mesh.vertices.row(topology.edges(e, 1))).norm();
    sums.edges += 1;
    sums.length += length;
    sums.squares += length * length;
  }
  sums.stretch = std::max(sums.stretch, measure_atlas(mesh).stretch_p99);
}

void give_metrics(StageRun& run, const Sums& sums, std::size_t garments, bool truth) {
  const double mean = sums.length / std::max(1.0, sums.edges);
  const double variance = std::max(0.0, sums.squares / std::max(1.0, sums.edges) - mean * mean);
  run.metric("garments", static_cast<double>(garments));
  run.metric("vertices", sums.vertices);
  run.metric("boundaries", sums.boundaries);
  run.metric("holes_closed", sums.holes);
  run.metric("area", sums.area);
  run.metric("unseen_share", sums.unseen / std::max(1e-9, sums.area));
  run.metric("carried_share", sums.carried / std::max(1e-9, sums.area));
  run.metric("beyond_share", sums.beyond);
  run.metric("not_whole", sums.not_whole);
  run.metric("edge_length", mean);
  run.metric("edge_deviation", std::sqrt(variance) / std::max(1e-9, mean));
  run.metric("dynamic_share", sums.dynamic / std::max(1.0, sums.vertices));
  run.metric("self_intersections", sums.crossing);
  run.metric("atlas_stretch", sums.stretch);
  run.metric("ground_truth_scans", truth ? 1 : 0);
}

nlohmann::ordered_json json_of(const GarmentTemplate& made, const std::string& label,
                               const std::vector<int>& frame_ids) {
  nlohmann::ordered_json dynamic = nlohmann::ordered_json::array();
  for (std::size_t v = 0; v < made.dynamic.size(); ++v) {
    if (made.dynamic[v] != 0) {
      dynamic.push_back(v);
    }
  }
  nlohmann::ordered_json boundaries = nlohmann::ordered_json::object();
  for (std::size_t b = 0; b < made.garment.boundaries.size(); ++b) {
    boundaries[made.garment.boundary_names[b]] = made.garment.boundaries[b].size();
  }
  nlohmann::ordered_json scores = nlohmann::ordered_json::array();
  for (const FrameScore& score : made.scores) {
    scores.push_back({{"frame", frame_ids[static_cast<std::size_t>(score.row)]},
                      {"score", score.score},
                      {"shown", score.shown},
                      {"at_hands", score.at_hands},
                      {"folded", score.folded},
                      {"facing", score.facing}});
  }
  return {{"label", label},
          {"file", "garments/" + label + ".h5"},
          {"frame", made.frame_id},
          {"facing", {made.facing.x(), made.facing.y(), made.facing.z()}},
          {"vertices", made.garment.mesh.vertices.rows()},
          {"boundaries", std::move(boundaries)},
          {"holes_closed", made.holes_closed},
          {"whole", made.whole},
          {"beyond", made.beyond},
          {"observed_rims", made.observed_rims},
          {"area_carried", made.area_carried},
          {"area_unseen", made.area_unseen},
          {"frames", std::move(scores)},
          {"dynamic", std::move(dynamic)}};
}

}  // namespace

OptionTable describe(TemplateStageOptions& options) {
  OptionTable table;
  table.add(describe(options.fit));
  table.add("labels", options.labels, std::vector<std::string>{},
            "Garments: auto (every label of clothing that is seen) or labels separated by commas, "
            "such as upper,lower");
  table.add("import", options.import, std::vector<std::string>{},
            "Artist's mesh used instead, on the body of --template.frame: FILE or label=FILE");
  table.add("imported", describe(options.imported));
  table.add("ground_truth_scans", options.ground_truth_scans,
            "Ground-truth surfaces of a synthetic capture instead of scans, for comparison");
  return table;
}

void require_named(const TemplateStageOptions& options) {
  for (const Import& import : imports_in(options.import)) {
    read_mesh(import.file, options.imported);  // refused as the run would
  }
  if (options.labels != "auto") {
    labels_in(options.labels);
  }
}

void run_template(StageRun& run) {
  const auto& options = run.options<TemplateStageOptions>();
  require_named(options);  // refused now rather than behind a look at every scan
  require_template_frame(options, run.input("capture"));
  Source source;
  source.scans = run.input("scans") / "scans";
  source.bodies = open_sequence(run.input("bodies"));
  if (options.ground_truth_scans) {
    source.capture = run.input("capture");
    source.truth = std::make_unique<GroundTruth>(read_ground_truth(source.capture));
  }
  const PersonalBody person = read_personal_body(run.input("person") / "person.npz");
  if (!equal_arrays(person.model.mesh.faces, source.bodies.faces)) {
    throw DataError(run.input("bodies").string(), "faces", "another body than the person's",
                    "bodies of this person; run body again");
  }
  const Wardrobe worn = wardrobe_of(run, source);
  const std::vector<Label> labels = wanted_garments(options.labels, worn, source.scans);
  const std::map<Label, fs::path> imports = imports_of(options.import, labels);
  ClothedFrames frames;
  frames.body_faces = source.bodies.faces;
  frames.anatomy = anatomy_of(person.model);
  for (const Index row : worn.rows) {
    frames.frame_ids.push_back(source.bodies.frame_ids[static_cast<std::size_t>(row)]);
  }
  frames.load = [&](Index i) {
    const Index row = worn.rows[static_cast<std::size_t>(i)];
    return ClothedFrame{source.scan(source.bodies.frame_ids[static_cast<std::size_t>(row)]),
                        frame(source.bodies, row).vertices};
  };
  std::vector<GarmentTemplate> made;
  nlohmann::ordered_json all = nlohmann::ordered_json::array();
  Sums sums;
  run.progress(0, static_cast<std::int64_t>(labels.size()), "garments");
  for (const Label label : labels) {
    if (run.stop_requested()) {
      return;
    }
    const std::string name = label_name(label);
    const auto import = imports.find(label);
    const auto id = static_cast<std::uint8_t>(label);
    made.push_back(import == imports.end()
                       ? garment_template(frames, id, name, options.fit)
                       : imported_template(read_mesh(import->second, options.imported), frames, id,
                                           name, options.fit, import->second.string()));
    const GarmentTemplate& one = made.back();
    tell(run, one.findings);
    run.output("garments/" + name + ".h5",
               [&](const fs::path& file) { write_garment_archive(file, one.garment); });
    run.output("garments/" + name + ".obj", [&](const fs::path& file) {
      write_text(file, obj_text(polygons_of(one.garment.mesh)));
    });
    add(sums, one);
    all.push_back(json_of(one, name, frames.frame_ids));
    std::string openings;
    for (const std::string& opening : one.garment.boundary_names) {
      openings += openings.empty() ? "" : ", ";
      openings += opening;
    }
    std::string said = name;
    said += ": frame " + std::to_string(one.frame_id);
    for (const FrameScore& score : one.scores) {
      if (frames.frame_ids[static_cast<std::size_t>(score.row)] == one.frame_id) {
        said += " (" + score_text(score, one.scores) + ")";
      }
    }
    said += ", " + std::to_string(one.garment.mesh.vertices.rows()) + " vertices";
    said += ", openings: " + openings;
    run.say(said);
    run.progress(static_cast<std::int64_t>(made.size()), static_cast<std::int64_t>(labels.size()),
                 "garments");
  }
  run.output_text("template.json", nlohmann::ordered_json{{"garments", std::move(all)}}.dump(1));
  run.output("template.png", [&](const fs::path& file) {
    write_text(file, image_bytes(template_picture(made, frames), ImageFormat::Png));
  });
  give_metrics(run, sums, made.size(), options.ground_truth_scans);
}

}  // namespace atelier
