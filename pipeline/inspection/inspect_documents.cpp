#include <algorithm>
#include <array>
#include <exception>
#include <iterator>
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "bodymodel/formats/makehuman_rig.h"
#include "capture/capture_info.h"
#include "capture/keypoints2d.h"
#include "capture/keypoints3d_file.h"
#include "capture/layouts/camera_toml.h"
#include "capture/layouts/goliath.h"
#include "capture/layouts/human36m.h"
#include "capture/layouts/nerfstudio.h"
#include "capture/layouts/open_dataset.h"
#include "capture/layouts/panoptic.h"
#include "core/error.h"
#include "core/file_kind.h"
#include "core/io/cameras_file.h"
#include "core/io/file_bytes.h"
#include "core/io/json.h"
#include "core/io/lower_extension.h"
#include "core/io/sequence_folder.h"
#include "core/limits.h"
#include "core/printable.h"
#include "core/sequence_archive.h"
#include "core/store/consent_file.h"
#include "core/store/manifest.h"
#include "core/store/manifest_limits.h"
#include "core/store/result.h"
#include "core/store/toml_entries.h"
#include "core/system_reason.h"
#include "pipeline/inspection/inspection.h"
#include "pipeline/pictures/run_account.h"
#include "registration/flattening/seam_input.h"
#include "registration/sewing/garment_pattern_json.h"
#include "registration/sewing/sewing_pattern.h"
#include "simulation/files/material_file.h"

namespace atelier {
namespace {

bool is_there(const std::filesystem::path& path) {
  return file_kind(path) != std::filesystem::file_type::not_found;
}

void inspect_manifest(const std::filesystem::path& path, Inspection& inspection) {
  const std::filesystem::path folder = path.parent_path().empty() ? "." : path.parent_path();
  // Its own digest is of the content, not the layout.
  const Limits limits = manifest_limits();
  const Manifest manifest = parse_manifest(read_json(path, limits).dump(), path.string(), limits);
  inspection.add("kind", "manifest of a result of '" + manifest.stage + "', version " +
                             std::to_string(manifest.stage_version));
  inspection.add("key", hex(manifest.key));
  inspection.add("finished", manifest.finished);
  inspection.add("build", manifest.build);
  inspection.add("work", manifest.work_seconds, "s");
  inspection.add("peak memory", manifest.peak_memory_bytes, "bytes");
  inspection.add("consent", to_string(manifest.consent));
  inspection.add("outputs", manifest.outputs.size());
  for (const ManifestInput& input : manifest.inputs) {
    inspection.add_member("input " + input.kind,
                          {{"path", input.path}, {"files", input.files}, {"bytes", input.bytes}});
  }
  for (const ManifestOption& option : manifest.options) {
    inspection.add_member("option " + option.name,
                          {{"value", nlohmann::ordered_json::parse(option.json, nullptr, false)},
                           {"source", option.source}});
  }
  for (const auto& [name, value] : manifest.metrics) {
    const Stage* stage = find_stage(inspection.stages, manifest.stage);
    const StageMetric* metric = stage == nullptr ? nullptr : find_metric(*stage, name);
    inspection.add_member("metric " + name, value,
                          metric == nullptr ? "" : std::string(metric->unit));
  }
  inspection.findings = check_outputs(folder, manifest, Check::Digests);
}

/// A mark that no other kind of document has; the first that fits tells the kind.
struct DocumentMark {
  std::vector<const char*> keys;  ///< of the outermost object
  const char* kind;
  /// The function that a stage reads it with, which throws where it refuses it; none for documents
  /// that are read with others.
  void (*read)(const std::string& text, const std::string& file) = nullptr;
  const char* file_name = "";  ///< that it has, where keys do not tell
  bool in_list = false;        ///< keys of the first object in a list
  /// Reads it as well, and adds what its kind alone has.
  void (*add)(const std::string& text, const std::string& file, Inspection& inspection) = nullptr;
  bool of_python = false;  ///< may hold NaN, as Python writes it
};

void add_pattern(const std::string& text, const std::string& file, Inspection& inspection) {
  const SewingPattern pattern = garment_pattern_from_json(text, file);
  double area = 0;
  std::size_t edges = 0;
  double lowest = std::numeric_limits<double>::infinity();
  double highest = -lowest;
  for (const Panel& panel : pattern.panels) {
    area += panel_area(panel);
    edges += panel.edges.size();
    for (Index i = 0; i < panel.corners.rows(); ++i) {
      const double height = place(panel.placement, panel.corners.row(i).transpose()).y();
      lowest = std::min(lowest, height);
      highest = std::max(highest, height);
    }
  }
  inspection.add("panels", pattern.panels.size());
  inspection.add("edges", edges);
  inspection.add("seams", pattern.seams.size());
  inspection.add("area", area, "m2");
  inspection.add("lowest", lowest, "m");
  inspection.add("highest", highest, "m");
  for (const Panel& panel : pattern.panels) {
    inspection.add_member(panel.name, panel_area(panel), "m2");
  }
}

void check_detections(const std::string& text, const std::string& file) {
  parse_detection_frames(text, file);
}

const std::vector<DocumentMark>& document_marks() {
  static const std::vector<DocumentMark> marks = {
      {{"cameras", "pixel_origin"},
       "cameras of a capture",
       [](const std::string& text, const std::string& file) { parse_cameras_json(text, file); }},
      {{"people", "version"},
       "keypoints in an image, OpenPose",
       [](const std::string& text, const std::string& file) { parse_openpose(text, file); },
       "",
       false,
       nullptr,
       true},
      {{"instance_info"},
       "keypoints in images, MMPose",
       check_detections,
       "",
       false,
       nullptr,
       true},
      {{"annotations", "images"},
       "keypoints in images, COCO",
       check_detections,
       "",
       false,
       nullptr,
       true},
      {{"image_id", "keypoints"},
       "keypoints in images, AlphaPose or COCO's results",
       check_detections,
       "",
       true,
       nullptr,
       true},
      {{"annots"},
       "keypoints in an image, EasyMocap",
       [](const std::string& text, const std::string& file) {
         parse_easymocap_annotation(text, file);
       },
       "",
       false,
       nullptr,
       true},
      {{"id", "keypoints3d"},
       "keypoints in space",
       [](const std::string& text, const std::string& file) {
         parse_keypoints3d(text, file);
         parse_keypoint_deviations(text, file);
         parse_bridged_keypoints(text, file);
       },
       "",
       true},
      {{"bodies"},
       "keypoints in space, Panoptic",
       [](const std::string& text, const std::string& file) { parse_keypoints3d(text, file); }},
      {{"calibDataSource", "cameras"},
       "cameras, Panoptic",
       [](const std::string& text, const std::string& file) {
         parse_panoptic_cameras(text, file);
       }},
      {{"intrinsics", "extrinsics"},
       "cameras, Human3.6M",
       [](const std::string& text, const std::string& file) {
         parse_human36m_cameras(text, "auto", file);
       }},
      {{"KRT"},
       "cameras, Goliath",
       [](const std::string& text, const std::string& file) { parse_goliath_cameras(text, file); }},
      {{"frames", "camera_model"},
       "cameras, nerfstudio",
       [](const std::string& text, const std::string& file) { parse_transforms(text, file); }},
      {{"frames", "fl_x"},
       "cameras, nerfstudio",
       [](const std::string& text, const std::string& file) { parse_transforms(text, file); }},
      {{"frames", "camera_angle_x"},
       "cameras, NeRF",
       [](const std::string& text, const std::string& file) { parse_transforms(text, file); }},
      {{"pattern", "properties"},
       "sewing pattern, Garment-Pattern-Generator or GarmentCode",
       nullptr,
       "",
       false,
       add_pattern},
      {{},
       "materials of garments",
       [](const std::string& text, const std::string& file) { parse_materials(text, file); },
       "material.json"},
      {{"started", "stages"},
       "account of a run",
       [](const std::string& text, const std::string& file) { parse_run_account(text, file); }},
      {{"started", "capture"},
       "account of a run",
       [](const std::string& text, const std::string& file) { parse_run_account(text, file); }},
      {{"bones", "joints"},
       "rig, MakeHuman",
       [](const std::string& text, const std::string& file) {  // its base mesh is not at hand
         parse_rig(parse_json(text, file), {}, static_cast<Index>(Limits{}.mesh_vertices), file);
       }},
      {{"weights", "version"}, "weights of a rig, MakeHuman"},
      {{"asset", "scenes"}, "scene, glTF; .gltf is its extension"},
      {{"seams"}, "seams, for flatten", check_seams},  // the mesh is not at hand
      {{"panels"}, "panels, for flatten", check_seams},
  };
  return marks;
}

/// Null where none fits.
const DocumentMark* mark_of(const nlohmann::json& json, const std::filesystem::path& path) {
  for (const DocumentMark& mark : document_marks()) {
    const bool listed = mark.in_list && json.is_array() && !json.empty();
    const nlohmann::json& object = listed ? json.front() : json;
    const bool named = path.filename() == mark.file_name;
    const bool keyed = !mark.keys.empty() && object.is_object() &&
                       std::all_of(mark.keys.begin(), mark.keys.end(),
                                   [&](const char* key) { return object.contains(key); });
    if (named || keyed) {
      return &mark;
    }
  }
  return nullptr;
}

/// A JSON file; of the kinds that Python's programs write with NaN in it, too.
nlohmann::json read_document(const std::filesystem::path& path, const Limits& limits) {
  try {
    return read_json(path, limits);
  } catch (const DataError&) {
    nlohmann::json json =
        parse_python_json(read_file_text(path, limits.text_file_bytes), path.string(), limits);
    const DocumentMark* mark = mark_of(json, path);
    if (mark == nullptr || !mark->of_python) {
      throw;
    }
    return json;
  }
}

}  // namespace

void inspect_json(const std::filesystem::path& path, Inspection& inspection) {
  const bool manifest = path.filename() == "manifest.json";
  const nlohmann::json json = read_document(path, manifest ? manifest_limits() : Limits());
  if (json.is_object() && json.value("schema", nlohmann::json()) == "atelier-manifest") {
    inspect_manifest(path, inspection);
    return;
  }
  const DocumentMark* mark = mark_of(json, path);
  if (mark != nullptr && mark->read != nullptr) {
    mark->read(read_file_text(path, Limits{}.text_file_bytes), path.string());
  }
  inspection.add("kind", mark != nullptr ? std::string(mark->kind) + " (JSON)"
                                         : std::string("JSON, ") + json.type_name());
  if (json.is_object() && json.contains("schema") && json["schema"].is_string()) {
    inspection.add("schema", json["schema"].get<std::string>());
  }
  if (mark != nullptr && mark->add != nullptr) {
    mark->add(read_file_text(path, Limits{}.text_file_bytes), path.string(), inspection);
  } else if (json.is_structured()) {
    inspection.add("entries", json.size());
  }
}

namespace {

/// Without one, a capture.toml may hold consent alone.
bool has_schema(const std::vector<TomlEntry>& entries) {
  return std::any_of(entries.begin(), entries.end(),
                     [](const TomlEntry& entry) { return entry.name == "schema"; });
}

void judge_description([[maybe_unused]] const std::string& text,
                       [[maybe_unused]] const std::vector<TomlEntry>& entries,
                       [[maybe_unused]] const std::filesystem::path& path) {
  if (has_schema(entries)) {
    parse_capture_toml(text, path.string());
  }
}

void add_entries(const std::vector<TomlEntry>& entries, Inspection& inspection) {
  inspection.add("entries", entries.size());
  for (const TomlEntry& entry : entries) {
    inspection.add_member(entry.name, entry.text.substr(0, 80));
  }
}

}  // namespace

void inspect_toml(const std::filesystem::path& path, Inspection& inspection) {
  const std::string text = read_file_text(path, Limits{}.text_file_bytes);
  const std::vector<TomlEntry> entries = read_toml_entries(text, path.string());
  const bool cameras = std::any_of(entries.begin(), entries.end(), [](const TomlEntry& entry) {
    return entry.name.ends_with(".matrix");  // of Pose2Sim, Caliscope and Anipose
  });
  inspection.add("kind", path.filename() == "capture.toml" ? "a capture's description"
                         : path.filename() == kConsentFile ? "consent to a capture"
                         : cameras                         ? "cameras in TOML"
                                                           : "TOML");
  if (path.filename() == "capture.toml") {
    judge_description(text, entries, path);
  }
  if (cameras) {
    inspection.findings = parse_camera_toml(text, path.string()).findings;
  }
  if (path.filename() == "capture.toml") {
    const std::filesystem::path folder = path.parent_path().empty() ? "." : path.parent_path();
    add_stated_consent(read_consent(folder), path, inspection);
  } else if (path.filename() == kConsentFile) {
    add_stated_consent(parse_consent_file(text, path.string()), path, inspection);
  }
  add_entries(entries, inspection);
}

namespace {

/// Finds frames of a sequence's header without a file, as a run that was killed leaves them.
void compare_files(const std::filesystem::path& folder, const std::vector<int>& frame_ids,
                   Inspection& inspection) {
  std::vector<int> missing;
  std::copy_if(frame_ids.begin(), frame_ids.end(), std::back_inserter(missing),
               [&](int id) { return !is_there(sequence_frame_path(folder, id)); });
  if (!missing.empty()) {
    inspection.findings.push_back(
        {Severity::Error, "frames-missing", "sequence.h5",
         std::to_string(missing.size()) + " of its " + std::to_string(frame_ids.size()) +
             " frames have no file, the first of them " + std::to_string(missing.front()),
         "make the sequence again, or take the frames that are there"});
  }
}

/// Meshes as a folder of frames holds them, in the order of their names.
std::vector<std::filesystem::path> meshes_in(const std::filesystem::path& folder) {
  constexpr std::array<std::string_view, 4> kExtensions = {".obj", ".ply", ".glb", ".gltf"};
  std::vector<std::filesystem::path> meshes;
  std::error_code error;
  auto walk = std::filesystem::directory_iterator(folder, error);
  for (; !error && walk != std::filesystem::directory_iterator(); walk.increment(error)) {
    if (std::ranges::find(kExtensions, lower_extension(walk->path())) != kExtensions.end()) {
      meshes.push_back(walk->path());
    }
  }
  if (error) {
    throw EnvironmentError(folder.string(), system_reason(error.value()));
  }
  std::ranges::sort(meshes);
  return meshes;
}

/// Numbered meshes. Of many the first, a middle and the last are read: a scan takes a second.
void inspect_frames(const std::filesystem::path& folder, const Sequence& sequence,
                    Inspection& inspection) {
  constexpr Index kMaxRead = 16;
  const Index frames = frame_count(sequence);
  inspection.add("kind", "meshes, one a frame");
  inspection.add("frames", frames);
  inspection.add("first frame", sequence.frame_ids.front());
  inspection.add("last frame", sequence.frame_ids.back());
  std::set<Index> read = {0, frames / 2, frames - 1};
  for (Index i = 0; i < frames && frames <= kMaxRead; ++i) {
    read.insert(i);
  }
  for (const Index i : read) {
    frame(sequence, i);
  }
  if (std::ssize(read) < frames) {
    inspection.findings.push_back(
        {Severity::Note, "frames-not-read", folder.string(),
         "of " + std::to_string(frames) + " frames the first, a middle and the last are read",
         "atelier statistics reads them all"});
  }
  if (auto finding = unit_finding(read_first_mesh(folder), folder.string())) {
    finding->advice = "the stage's " + finding->advice;
    inspection.findings.push_back(std::move(*finding));
  }
  if (auto finding = gap_finding(sequence.frame_ids, folder.string())) {
    inspection.findings.push_back(std::move(*finding));
  }
  add_stated_consent(read_consent(folder), folder, inspection);
}

/// A folder with a capture.toml: a capture in whatever layout, whose files are held against it, or
/// the description of one that is not there.
void inspect_described_folder(const std::filesystem::path& path, Inspection& inspection) {
  const std::filesystem::path toml = path / "capture.toml";
  const std::string text = read_file_text(toml, Limits{}.text_file_bytes);
  const std::vector<TomlEntry> entries = read_toml_entries(text, toml.string());
  judge_description(text, entries, toml);  // of other layouts, which read its consent alone, too
  bool capture = false;
  capture = inspect_capture_folder(path, inspection);
  if (capture) {
    add_entries(entries, inspection);
  } else {
    inspect_toml(toml, inspection);
    if (has_schema(entries) && !is_there(path / "cameras.json")) {
      inspection.findings.push_back({Severity::Error, "cameras-missing", path.string(),
                                     "there is no cameras.json, without which no stage reads it",
                                     "copy it from where the capture was made; atelier calibrate "
                                     "makes one of images"});
    }
  }
  for (const char* part : {"cameras.json", "images", "labels", "keypoints2d", "truth"}) {
    inspection.add(part, is_there(path / part) ? "there" : "none");
  }
}

}  // namespace

void inspect_folder(const std::filesystem::path& path, Inspection& inspection) {
  if (is_there(path / "manifest.json")) {
    inspect_manifest(path / "manifest.json", inspection);
    return;
  }
  if (is_there(path / "sequence.h5")) {
    const SequenceHeader header = read_sequence_header(path);
    inspection.add("kind", "sequence of meshes");
    inspection.add("frames", header.frame_ids.size());
    inspection.add("fps", header.fps, "1/s");
    inspection.add("triangles", header.shared.faces.rows());
    compare_files(path, header.frame_ids, inspection);
    add_stated_consent(read_consent(path), path, inspection);
    return;
  }
  if (is_there(path / "capture.toml")) {
    inspect_described_folder(path, inspection);
    return;
  }
  if (inspect_capture_folder(path, inspection, Evidence::MoreThanPictures)) {
    return;  // one mesh beside a capture's files is no sequence
  }
  std::optional<Sequence> sequence;
  std::exception_ptr refusal;  // why its meshes are no frames
  if (!meshes_in(path).empty()) {
    try {
      sequence = read_sequence_folder(path);
    } catch (const DataError&) {
      refusal = std::current_exception();
    }
  }
  if (sequence) {
    inspect_frames(path, *sequence, inspection);
    return;
  }
  if (inspect_capture_folder(path, inspection)) {
    return;
  }
  if (refusal) {
    std::rethrow_exception(refusal);
  }
  require_finished(path);
  require_no_folder_above(path);
  throw DataError(path.string(), "", "a folder of none of these",
                  "a result, a sequence, a capture or meshes that are numbered; atelier status "
                  "shows what a workspace holds");
}

}  // namespace atelier
