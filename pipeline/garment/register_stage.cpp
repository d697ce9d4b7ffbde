#include "pipeline/garment/register_stage.h"

#include <algorithm>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "capture/frame_reader.h"
#include "capture/ground_truth_scan.h"
#include "capture/label_taxonomy.h"
#include "core/error.h"
#include "core/garment_archive.h"
#include "core/io/file_bytes.h"
#include "core/io/image_file.h"
#include "core/io/json.h"
#include "core/io/json_place.h"
#include "core/io/mesh_obj.h"
#include "core/listed_frames.h"
#include "core/normals.h"
#include "core/printable.h"
#include "core/sequence_archive.h"
#include "core/store/digest_meter.h"
#include "core/store/frame_memory.h"
#include "core/store/output_sequences.h"
#include "core/store/result.h"
#include "pipeline/capture/reconstruct_stage.h"
#include "pipeline/garment/kept_frames.h"
#include "pipeline/garment/register_holding.h"
#include "pipeline/garment/simulated_prediction.h"
#include "registration/flattening/rest_surface.h"
#include "registration/tracking/holding_file.h"
#include "registration/tracking/tracking_failure.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// All of one instant that garments share.
struct Instant {
  Mesh scan;
  Points body;
  std::vector<InstantView> views;
};

/// One garment of the outfit.
struct Worn {
  std::string name;
  Label label = Label::Unknown;
  Garment garment;
  Index template_row = 0;
  std::unique_ptr<RegisteredSequence> sequence;
  Index first_vertex = 0;  ///< in the mesh of all
};

/// Frames of every sequence with clothes, increasing.
std::vector<int> clothed_frames(const CaptureInfo& info) {
  std::vector<int> ids;
  for (const CaptureSequence& sequence : info.sequences) {
    if (sequence.kind != "minimal") {
      ids.insert(ids.end(), sequence.frame_ids.begin(), sequence.frame_ids.end());
    }
  }
  std::sort(ids.begin(), ids.end());
  return ids;
}

std::vector<int> those_with_body(std::vector<int> ids, const Sequence& bodies) {
  std::erase_if(ids, [&](int id) {
    return !std::binary_search(bodies.frame_ids.begin(), bodies.frame_ids.end(), id);
  });
  return ids;
}

/// Every frame of an outfit, as the stage reads it. Instants are opened once for all garments.
class RegisteredOutfit {
 public:
  explicit RegisteredOutfit(StageRun& run)
      : run_(run),
        options_(run.options<RegisterStageOptions>()),
        dataset_(stage_dataset(run.input("capture"), options_.capture)),
        bodies_(open_sequence(run.input("bodies"))) {
    if (options_.ground_truth_scans) {
      truth_ = std::make_unique<GroundTruth>(read_ground_truth(run.input("capture")));
    }
    find_frames();
    if (options_.fit.fit.photometric) {
      tell_missing_pictures();
    }
    if (!truth_) {
      tell_missing_scans();
    }
    read_garments();
  }

  const std::vector<int>& frame_ids() const { return ids_; }
  double fps() const { return fps_; }
  std::vector<Worn>& garments() { return garments_; }
  bool has_truth() const { return truth_ != nullptr; }
  const Triangles& body_faces() const { return bodies_.faces; }
  Points body_in(Index row) const { return body(row); }

  /// Faces of all garments, one behind the other.
  Triangles faces() const {
    Triangles all;
    for (const Worn& worn : garments_) {
      const Index before = all.rows();
      all.conservativeResize(before + worn.garment.mesh.faces.rows(), 3);
      all.bottomRows(worn.garment.mesh.faces.rows()) =
          worn.garment.mesh.faces.array() + static_cast<int>(worn.first_vertex);
    }
    return all;
  }

 private:
  void find_frames() {
    for (const CaptureSequence& sequence : dataset_.info.sequences) {
      if (sequence.kind != "minimal" && !sequence.frame_ids.empty()) {
        fps_ = fps_ > 0 ? fps_ : sequence.fps;
        takes_.push_back(sequence.frame_ids.front());
      }
    }
    ids_ = clothed_frames(dataset_.info);
    const std::size_t clothed = ids_.size();
    ids_ = those_with_body(std::move(ids_), bodies_);
    if (const std::size_t without = clothed - ids_.size(); without > 0 && !ids_.empty()) {
      run_.warn(std::to_string(without) + " of " + std::to_string(clothed) + " clothed frames " +
                (without > 1 ? "have no body and are" : "has no body and is") + " left out");
    }
    if (ids_.empty()) {
      throw DataError(run_.input("bodies").string(), "frames", "none of the clothed ones",
                      "a body in every clothed frame of the capture; run body on this capture");
    }
    fps_ = fps_ > 0 ? fps_ : bodies_.fps;
  }

  /// Once for each camera: in every frame the same would be said again.
  void tell_missing_pictures() {
    for (std::size_t c = 0; c < dataset_.cameras.size(); ++c) {
      const CameraFrames& files = dataset_.frames[c];
      const auto without = std::count_if(ids_.begin(), ids_.end(), [&](int id) {
        return !files.images.contains(id) ||
               !(files.masks.contains(id) || files.labels.contains(id));
      });
      if (without > 0) {
        run_.warn("camera " + dataset_.cameras[c].id + ": no image with a mask in " +
                  std::to_string(without) + " of " + std::to_string(ids_.size()) +
                  " frames; the other cameras are used there");
      }
    }
  }

  fs::path scan_file(int id) const {
    return run_.input("scans") / "scans" / (frame_name(id) + ".h5");
  }

  /// Before there are frames: a run that goes on does not open those that were followed before.
  void tell_missing_scans() {
    std::vector<int> without = ids_;
    std::erase_if(without, [&](int id) { return fs::exists(scan_file(id)); });
    if (!without.empty()) {
      run_.warn("no-scan [frames " + listed_frames(without) +
                "]: the garment follows body and images alone there");
    }
  }

  /// Of what this run and others side by side have followed: the first frame that is finished may
  /// need all of its window.
  void tell_progress() {
    std::int64_t followed = 0;
    for (const Worn& worn : garments_) {
      followed += kept_count(run_, worn.name, ids_);
    }
    run_.progress(followed, std::ssize(garments_) * std::ssize(ids_), "frames followed");
  }

  Index row_of(int id) const {
    return std::lower_bound(ids_.begin(), ids_.end(), id) - ids_.begin();
  }

  Points body(Index row) const {
    const int id = ids_[static_cast<std::size_t>(row)];
    const auto at = std::lower_bound(bodies_.frame_ids.begin(), bodies_.frame_ids.end(), id);
    return frame(bodies_, at - bodies_.frame_ids.begin()).vertices;
  }

  /// 1 where a garment hangs free from the body, as `template` found it. Zeros where it says
  /// nothing, or of another mesh.
  std::vector<char> free_vertices(const Worn& worn) const {
    std::vector<char> free(static_cast<std::size_t>(worn.garment.mesh.vertices.rows()), 0);
    const fs::path file = run_.input("template") / "template.json";
    if (!fs::exists(file)) {
      return free;
    }
    const nlohmann::json all =
        parse_json(read_file_text(file, Limits().text_file_bytes), file.string());
    for (const JsonPlace& garment : JsonPlace(all, file.string()).items("garments")) {
      if (garment.at("label").text() == worn.name) {
        for (const JsonPlace& vertex : garment.items("dynamic")) {
          free[static_cast<std::size_t>(vertex.integer(0, std::ssize(free) - 1))] = 1;
        }
      }
    }
    return free;
  }

  void read_garments() {
    const fs::path folder = run_.input("template") / "garments";
    std::vector<fs::path> files;
    if (fs::is_directory(folder)) {
      for (const auto& entry : fs::directory_iterator(folder)) {
        if (entry.path().extension() == ".h5") {
          files.push_back(entry.path());
        }
      }
    }
    std::sort(files.begin(), files.end());
    if (files.empty()) {
      throw DataError(folder.string(), "", "no garment", "<label>.h5 of the stage template");
    }
    Index vertices = 0;
    for (const fs::path& file : files) {
      Worn worn;
      worn.name = file.stem().string();
      const auto label = label_of(worn.name);
      if (!label) {
        throw DataError(file.string(), "", "a garment whose name is no label",
                        "upper, lower, dress, outer, ...: what the scans call it");
      }
      worn.label = *label;
      worn.garment = read_garment_archive(file);
      RegistrationSource source;
      source.rows = static_cast<Index>(ids_.size());
      source.body_faces = bodies_.faces;
      source.body = [this](Index row) { return body(row); };
      source.load = [this, label](Index row) { return frame_of(*instant(row), *label); };
      if (options_.simulated_prediction && fps_ > 0) {
        source.simulate = [this, faces = worn.garment.mesh.faces,
                           free = free_vertices(worn)](const ClothStep& step) {
          return simulated_prediction(faces, free, step,
                                      {bodies_.faces, body(step.from), body(step.to)}, 1 / fps_);
        };
      }
      source.keeping = kept_frames(run_, worn.name, ids_);
      source.keeping.write = [this, keep = source.keeping.write](Index row,
                                                                 const FollowedFrame& frame) {
        keep(row, frame);
        tell_progress();
      };
      source.before_frame = [this] {
        if (run_.stop_requested()) {
          throw StopRequested();
        }
      };
      for (const int id : takes_) {
        const Index row = row_of(id);
        if (row < source.rows && (source.starts.empty() || source.starts.back() < row)) {
          source.starts.push_back(row);
        }
      }
      const Index found = template_row_of(worn.garment, source, file.string());
      if (found < 0) {
        run_.say(worn.name + ": no attachments to the body: assumed to be in the pose of frame " +
                 std::to_string(ids_.front()));
      }
      worn.template_row = std::max<Index>(found, 0);
      source.template_row = worn.template_row;
      worn.sequence = std::make_unique<RegisteredSequence>(worn.garment, std::move(source),
                                                           options_.fit, file.string());
      worn.first_vertex = vertices;
      vertices += worn.garment.mesh.vertices.rows();
      garments_.push_back(std::move(worn));
    }
  }

  /// The instant of a row; the last one is kept for the next garment.
  std::shared_ptr<const Instant> instant(Index row) {
    const std::lock_guard lock(mutex_);
    if (kept_ && kept_row_ == row) {
      return kept_;
    }
    const int id = ids_[static_cast<std::size_t>(row)];
    auto made = std::make_shared<Instant>();
    made->body = body(row);
    if (truth_) {
      made->scan =
          ground_truth_scan(*truth_, read_ground_truth_frame(run_.input("capture"), *truth_, id));
    } else if (fs::exists(scan_file(id))) {
      made->scan = read_mesh_archive(scan_file(id));
    }
    if (options_.fit.fit.photometric) {
      made->views = instant_of(dataset_, id);
    }
    kept_ = std::move(made);
    kept_row_ = row;
    return kept_;
  }

  RegistrationFrame frame_of(const Instant& instant, Label label) const {
    const auto number = static_cast<std::uint8_t>(label);
    RegistrationFrame frame;
    frame.scan = garment_scan(instant.scan, {number});
    frame.body = body_obstacle(instant.body, bodies_.faces);
    const Mesh& scan = instant.scan;
    for (const std::uint8_t other : std::set(scan.labels.begin(), scan.labels.end())) {
      if (other != number && is_cloth(static_cast<Label>(other))) {
        frame.scan = without_covered_border(std::move(frame.scan), garment_scan(scan, {other}),
                                            frame.body.tree);
      }
    }
    if (!scan.labels.empty()) {
      Triangles rest(scan.faces.rows(), 3);
      Index count = 0;
      for (Index f = 0; f < scan.faces.rows(); ++f) {
        const bool own = (scan.faces.row(f).array().unaryExpr([&](int v) {
                           return scan.labels[static_cast<std::size_t>(v)] == number ? 1 : 0;
                         })).any();
        if (!own) {
          rest.row(count++) = scan.faces.row(f);
        }
      }
      rest.conservativeResize(count, 3);
      frame.other = build_tree(scan.vertices, rest);
    }
    for (const InstantView& view : instant.views) {
      PhotoView photo{view.camera, view.image, view.mask};
      if (!view.labels.data.empty()) {
        photo.mask = view.labels;
        for (std::uint8_t& pixel : photo.mask.data) {
          pixel = pixel == number ? 1 : 0;
        }
      }
      frame.views.push_back(view_pyramid(photo, options_.fit.fit.photometric_levels));
    }
    return frame;
  }

  StageRun& run_;
  const RegisterStageOptions& options_;
  Dataset dataset_;
  Sequence bodies_;
  std::unique_ptr<GroundTruth> truth_;
  std::vector<int> ids_;
  std::vector<int> takes_;  // first frames
  double fps_ = 0;
  std::vector<Worn> garments_;
  std::mutex mutex_;
  std::shared_ptr<const Instant> kept_;
  Index kept_row_ = -1;
};

constexpr std::array kFigures = {
    "scan_rms", "support",      "seen",           "correlation", "strain_p95",       "inverted",
    "inside",   "inside_depth", "body_crossings", "code_read",   "code_contradicted"};

std::array<double, kFigures.size()> figures_of(const RegisteredGarment& garment) {
  return {garment.scan_rms,
          garment.support,
          garment.seen,
          garment.correlation,
          garment.strain_p95,
          static_cast<double>(garment.inverted),
          garment.contact.inside,
          garment.contact.depth,
          static_cast<double>(garment.contact.crossings),
          static_cast<double>(garment.code_read),
          static_cast<double>(garment.code_contradicted)};
}

/// All garments of a frame, one behind the other, with each one's figures.
struct JoinedFrame {
  Mesh mesh;                              ///< vertices and confidence
  std::map<std::string, double> figures;  ///< by "<garment>.<figure>"
};

JoinedFrame joined_frame(const std::vector<Worn>& garments, Index row) {
  JoinedFrame joined;
  Mesh& all = joined.mesh;
  for (const Worn& worn : garments) {
    const RegisteredGarment& garment = worn.sequence->at(row);
    const Index before = all.vertices.rows();
    const Index count = garment.vertices.rows();
    all.vertices.conservativeResize(before + count, 3);
    all.vertices.bottomRows(count) = garment.vertices;
    all.confidence.conservativeResize(before + count);
    all.confidence.tail(count) = garment.confidence;
    const auto figures = figures_of(garment);
    for (std::size_t i = 0; i < kFigures.size(); ++i) {
      joined.figures[worn.name + "." + kFigures[i]] = figures[i];
    }
  }
  return joined;
}

Archive archive_of(const JoinedFrame& joined) {
  Archive archive = archive_of(joined.mesh);
  archive.numbers.insert(joined.figures.begin(), joined.figures.end());
  return archive;
}

JoinedFrame read_joined_frame(const fs::path& file) {
  Archive archive = read_archive(file, "atelier.mesh", 1);
  return {mesh_of(archive, file.string()), std::move(archive.numbers)};
}

/// Every frame of the result, by its number.
using JoinedFrames = std::map<int, JoinedFrame>;

/// The part of a joined mesh that is one garment.
Mesh part_of(const Mesh& all, const Worn& worn) {
  Mesh part;
  const Index count = worn.garment.mesh.vertices.rows();
  part.vertices = all.vertices.middleRows(worn.first_vertex, count);
  part.confidence = all.confidence.segment(worn.first_vertex, count);
  return part;
}

/// Median distance along the surface between two places of a garment, of vertices that are known.
double slide(const Mesh& a, const Points& b, const Triangles& faces) {
  const Points normals = vertex_normals(a.vertices, faces);
  std::vector<double> slides;
  for (Index v = 0; v < b.rows(); ++v) {
    if (a.confidence[v] > 0.5F) {
      const Eigen::Vector3d off = (a.vertices.row(v) - b.row(v)).transpose();
      const Eigen::Vector3d normal = normals.row(v).transpose();
      slides.push_back((off - off.dot(normal) * normal).norm());
    }
  }
  if (slides.empty()) {
    return 0;
  }
  const auto middle = slides.begin() + static_cast<std::ptrdiff_t>(slides.size() / 2);
  std::nth_element(slides.begin(), middle, slides.end());
  return *middle;
}

/// The files written for every frame: all garments as one mesh, and each one alone.
std::vector<OutputSequence> registered_sequences(const RegisteredOutfit& outfit,
                                                 const std::vector<Worn>& garments) {
  SequenceHeader header;
  header.fps = outfit.fps();
  header.frame_ids = outfit.frame_ids();
  header.shared.faces = outfit.faces();
  std::vector<OutputSequence> sequences = {{"frames", header}};
  for (const Worn& worn : garments) {
    header.shared.faces = worn.garment.mesh.faces;
    header.shared.uvs = worn.garment.mesh.uvs;
    header.shared.uv_faces = worn.garment.mesh.uv_faces;
    sequences.push_back({"registered/" + worn.name + "/frames", header});
  }
  return sequences;
}

/// Writes the parts of a garment that belong to no frame: its template, and the surface that its
/// frames come from.
void write_garments(StageRun& run, const std::vector<Worn>& garments, const JoinedFrames& joined) {
  for (const Worn& worn : garments) {
    const std::string folder = "registered/" + worn.name;
    run.output(folder + "/template.h5",
               [&](const fs::path& file) { write_mesh_archive(file, worn.garment.mesh); });
    std::vector<Points> frames;
    for (const auto& [id, frame] : joined) {
      frames.push_back(part_of(frame.mesh, worn).vertices);
    }
    if (frames.size() < kRestFrames) {
      run.say(worn.name + ": " + counted(static_cast<Index>(frames.size()), "frame") +
              ", too few to estimate the rest surface: the template's is used for flattening");
    }
    Mesh rest = worn.garment.mesh;
    rest.vertices = rest_surface(rest, frames);
    rest.normals.resize(0, 3);
    run.output(folder + "/" + kRestFile, [&](const fs::path& file) { write_obj(file, rest); });
  }
}

/// Writes what holds the garments, and its picture.
void write_holding(StageRun& run, const RegisteredOutfit& outfit, const std::vector<Worn>& garments,
                   const JoinedFrames& joined) {
  const std::vector<int>& ids = outfit.frame_ids();
  const Index shown = garments.front().template_row;
  std::vector<HeldRing> all;
  std::vector<ShownGarment> pictured;
  for (const Worn& worn : garments) {
    const auto part = [&](Index row) {
      return part_of(joined.at(ids[static_cast<std::size_t>(row)]).mesh, worn).vertices;
    };
    const std::vector<HeldRing> rings = tell_holding(
        run, {worn.name, worn.garment.mesh.faces, worn.garment.boundaries,
              worn.garment.boundary_names, outfit.body_faces(), static_cast<Index>(ids.size()),
              part, [&](Index row) { return outfit.body_in(row); }});
    all.insert(all.end(), rings.begin(), rings.end());
    ShownGarment& one = pictured.emplace_back();
    one.mesh.vertices = part(shown);
    one.mesh.faces = worn.garment.mesh.faces;
    one.rings = rings;
  }
  run.output_text(kHoldingFile, holding_text(all));
  Mesh body;
  body.vertices = outfit.body_in(shown);
  body.faces = outfit.body_faces();
  run.output_text(kHoldingPicture, image_bytes(holding_picture(pictured, body), ImageFormat::Png));
}

/// How far two ways to the same frame come out apart, m.
struct Drift {
  double forward_backward = 0;
  double closure = 0;
};

Drift drift_of(const RegisteredOutfit& outfit, const Worn& worn, const JoinedFrames& joined) {
  Drift drift;
  const auto rows = static_cast<Index>(outfit.frame_ids().size());
  const auto part = [&](Index row) {
    return part_of(joined.at(outfit.frame_ids()[static_cast<std::size_t>(row)]).mesh, worn);
  };
  const Index last = worn.template_row == rows - 1 ? 0 : rows - 1;
  if (last == worn.template_row) {
    return drift;
  }
  const Index before = last + (last > worn.template_row ? -1 : 1);
  const Triangles& faces = worn.garment.mesh.faces;
  const Mesh end = part(last);
  drift.forward_backward =
      slide(part(before), worn.sequence->again(before, last, end.vertices).vertices, faces);
  drift.closure = slide(end, worn.sequence->from_template(last).vertices, faces);
  return drift;
}

/// figures.json and the metrics.
void write_figures(StageRun& run, const RegisteredOutfit& outfit, const std::vector<Worn>& garments,
                   const JoinedFrames& joined) {
  nlohmann::json all = nlohmann::json::object();
  std::map<std::string, double> sums;
  double count = 0;
  Drift most;
  for (const Worn& worn : garments) {
    nlohmann::json& of = all[worn.name];
    of["template_frame"] = outfit.frame_ids()[static_cast<std::size_t>(worn.template_row)];
    std::vector<TrackedFrameFigures> followed;
    for (const auto& [id, registered] : joined) {
      nlohmann::json& frame = of["frames"][frame_name(id)];
      for (const char* figure : kFigures) {
        const double value = registered.figures.at(worn.name + "." + figure);
        frame[figure] = value;
        sums[figure] += value;
      }
      followed.push_back({id, frame["support"], frame["correlation"], frame["inside"]});
      count += 1;
    }
    if (const auto lost = tracking_failure(worn.name, followed)) {
      tell(run, {*lost});
    }
    if (const auto inside = inside_body(worn.name, followed)) {
      tell(run, {*inside});
    }
    const Drift drift = drift_of(outfit, worn, joined);
    of["forward_backward"] = drift.forward_backward;
    of["closure"] = drift.closure;
    most.forward_backward = std::max(most.forward_backward, drift.forward_backward);
    most.closure = std::max(most.closure, drift.closure);
  }
  run.output_text("figures.json", all.dump(1));
  run.metric("frames", static_cast<double>(outfit.frame_ids().size()));
  run.metric("garments", static_cast<double>(garments.size()));
  run.metric("ground_truth_scans", outfit.has_truth() ? 1 : 0);
  for (const char* figure : {"scan_rms", "support", "seen", "correlation", "inside"}) {
    run.metric(figure, sums[figure] / count);
  }
  for (const char* figure : {"inverted", "body_crossings", "code_read", "code_contradicted"}) {
    run.metric(figure, sums[figure]);
  }
  run.metric("forward_backward", most.forward_backward);
  run.metric("closure", most.closure);
}

/// Says how much a stop leaves for the next run: more than the finished frames, of which each needs
/// all garments, and those of its window on the way to it.
void tell_followed(StageRun& run, RegisteredOutfit& outfit) {
  for (const Worn& worn : outfit.garments()) {
    run.say(worn.name + ": " + std::to_string(kept_count(run, worn.name, outfit.frame_ids())) +
            " of " + std::to_string(outfit.frame_ids().size()) + " frames are followed and kept");
  }
}

}  // namespace

OptionTable describe(RegisterStageOptions& options) {
  OptionTable table;
  table.add("capture", describe(options.capture));
  table.add(describe(options.fit));
  table.add("simulated_prediction", options.simulated_prediction,
            "Prediction of cloth that hangs free from the body by simulating it from the frames "
            "before, for fast motion");
  table.add("ground_truth_scans", options.ground_truth_scans,
            "Ground-truth surfaces of a synthetic capture instead of scans, for comparison");
  return table;
}

void require_registered_frames(const RegisterStageOptions& options, const FrameSelection& selection,
                               const fs::path& capture, const fs::path& workspace) {
  const std::optional<std::string> bodies = current_name(workspace / "body");
  if (selection.everything() || !bodies) {
    return;
  }
  some_selected_frames(selection,
                       those_with_body(clothed_frames(stage_dataset(capture, options.capture).info),
                                       open_sequence(workspace / "body" / *bodies)),
                       capture.string());
}

void run_register(StageRun& run) {
  RegisteredOutfit outfit(run);
  const std::vector<int>& ids = outfit.frame_ids();
  const std::vector<Worn>& garments = outfit.garments();
  FrameMemory<JoinedFrame> memory;
  bool all = false;
  try {
    all = output_sequences(run, registered_sequences(outfit, garments), ids, [&](int id) {
      JoinedFrame joined =
          joined_frame(garments, std::lower_bound(ids.begin(), ids.end(), id) - ids.begin());
      std::vector<Archive> archives{archive_of(joined)};
      for (const Worn& worn : garments) {
        archives.push_back(archive_of(part_of(joined.mesh, worn)));
      }
      memory.keep(id, std::move(joined));
      return archives;
    });
  } catch (const StopRequested&) {  // within a frame's chain: what was followed is kept
  }
  if (!all) {
    if (run.stop_requested()) {
      tell_followed(run, outfit);
    }
    return;
  }
  JoinedFrames joined;
  for (const int id : ids) {
    joined[id] = memory.take(id, [&] { return read_joined_frame(run.frame_file(id)); });
  }
  write_garments(run, garments, joined);
  write_holding(run, outfit, garments, joined);
  write_figures(run, outfit, garments, joined);
}

}  // namespace atelier
