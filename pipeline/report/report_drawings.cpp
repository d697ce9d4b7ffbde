#include "pipeline/report/report_drawings.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "bodymodel/formats/tracked_motion.h"
#include "capture/capture_info.h"
#include "capture/frame_reader.h"
#include "capture/layouts/open_dataset.h"
#include "core/error.h"
#include "core/io/child_program.h"
#include "core/io/ground_truth_archive.h"
#include "core/io/image_file.h"
#include "core/io/json.h"
#include "core/render/color_map.h"
#include "core/render/contact_sheet.h"
#include "core/render/drawing.h"
#include "core/render/render.h"
#include "core/render/studio.h"
#include "core/sequence_archive.h"
#include "core/tree.h"
#include "pipeline/cloth/simulation_scene.h"
#include "pipeline/outfit/worn_subject.h"
#include "pipeline/pictures/named_views.h"
#include "pipeline/pictures/report_page.h"
#include "pipeline/pictures/report_plots.h"
#include "pipeline/pictures/taken_and_drawn.h"
#include "pipeline/pictures/validate_drawings.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

constexpr int kPictureHeight = 460;
constexpr std::size_t kPictures = 4;
constexpr int kWide = 290;    // pixels: four beside each other
constexpr int kNarrow = 210;  // six
const Eigen::Vector3f kSkin{0.62F, 0.45F, 0.36F};
const Eigen::Vector3f kCloth{0.16F, 0.24F, 0.42F};

std::string figure(const Image& image, const std::string& caption) {
  const std::string jpeg = image_bytes(image, ImageFormat::Jpeg, {.quality = 88});
  return "<figure><img alt=\"" + html_text(caption) + "\" src=\"data:image/jpeg;base64," +
         base64_text(std::as_bytes(std::span(jpeg))) + "\"><figcaption>" + html_text(caption) +
         "</figcaption></figure>\n";
}

/// Meshes in the studio.
Image seen(const std::vector<RenderMesh>& meshes, const View& view, int width) {
  PictureOptions options;
  options.width = width;
  options.height = kPictureHeight;
  options.samples = 6;
  return picture_of(meshes, view, options);
}

const StageStatus* sound(const ReportPlaces& places, const std::string& stage) {
  const auto found = std::find_if(places.stages.begin(), places.stages.end(),
                                  [&](const StageStatus& status) { return status.stage == stage; });
  return found != places.stages.end() && found->manifest &&
                 found->state != StageStatus::State::Damaged
             ? &*found
             : nullptr;
}

/// The result's folder; one that is not there where there is no result.
fs::path result_of(const ReportPlaces& places, const std::string& stage) {
  const StageStatus* status = sound(places, stage);
  return places.workspace / stage /
         (status == nullptr ? "none" : folder_name(status->manifest->key));
}

/// The capture that the keypoints and scans came from, opened as then.
std::optional<Dataset> dataset_of(const ReportPlaces& places,
                                  const std::string& stage = "reconstruct") {
  const StageStatus* status = sound(places, stage);
  if (status == nullptr) {
    return std::nullopt;
  }
  DatasetOptions options;
  OptionTable table = describe(options);
  constexpr std::string_view kSection = "capture.";
  for (const ManifestOption& option : status->manifest->options) {
    if (option.name.starts_with(kSection)) {
      const nlohmann::json value = parse_json(option.json, "manifest.json");
      set_option(table, option.name.substr(kSection.size()),
                 value.is_string() ? value.get<std::string>() : option.json);
    }
  }
  return open_dataset(status->manifest->inputs.front().path, options);
}

Image scaled(const Image& image) {
  const int width = std::max(1, image.width * kPictureHeight / std::max(1, image.height));
  return resized(image, width, kPictureHeight);
}

/// With three channels.
Image coloured(Image image) {
  if (image.channels == 1) {
    Image colour(image.width, image.height, 3);
    for (std::size_t i = 0; i < colour.data.size(); ++i) {
      colour.data[i] = image.data[i / 3];
    }
    return colour;
  }
  return image;
}

/// The tracked sequence that is clothed, else the first; and the cameras that stages may open, who
/// sees the person's front best first.
struct Tracked {
  TrackedMotion motion;
  std::vector<Index> cameras;
};

std::optional<Tracked> tracked_of(const ReportPlaces& places, const Dataset& dataset) {
  const fs::path result = result_of(places, "track");
  fs::path file;
  for (const CaptureSequence& sequence : dataset.info.sequences) {
    const fs::path one = result / "tracked" / (sequence.name + ".h5");
    if (fs::exists(one) && (file.empty() || sequence.kind == "clothed")) {
      file = one;
    }
  }
  if (file.empty()) {
    return std::nullopt;
  }
  Tracked tracked{read_tracked_motion(file), {}};
  const int left = find_joint(tracked.motion.skeleton, "left_hip");
  const int right = find_joint(tracked.motion.skeleton, "right_hip");
  const std::vector<std::string>& held = dataset.info.held_out_cameras;
  std::vector<std::pair<double, Index>> facing_away;
  for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
    const Camera& camera = dataset.cameras[c];
    if (std::find(held.begin(), held.end(), camera.id) != held.end() ||
        dataset.frames[c].images.empty()) {
      continue;
    }
    double facing = 0;  // the left hip on the right of the image: the person looks here
    if (left >= 0 && right >= 0 && !tracked.motion.joints.empty()) {
      const Points& joints = tracked.motion.joints.front();
      const auto a = project(camera, joints.row(left).transpose());
      const auto b = project(camera, joints.row(right).transpose());
      facing = a && b ? (a->x() - b->x()) / camera.width : -1e6;
    }
    facing_away.emplace_back(-facing, static_cast<Index>(c));
  }
  std::sort(facing_away.begin(), facing_away.end());
  for (const auto& [away, camera] : facing_away) {
    tracked.cameras.push_back(camera);
  }
  return tracked;
}

/// Where the person looks in a frame: across the hips as they were tracked; zero where nobody
/// knows, and of somebody who lies, as body_facing has it.
Eigen::Vector3d tracked_facing(const std::optional<Tracked>& tracked, int frame_id) {
  if (!tracked) {
    return Eigen::Vector3d::Zero();
  }
  const TrackedMotion& motion = tracked->motion;
  const std::vector<int>& ids = motion.motion.frame_ids;
  const auto at = std::find(ids.begin(), ids.end(), frame_id);
  const int left = find_joint(motion.skeleton, "left_hip");
  const int right = find_joint(motion.skeleton, "right_hip");
  if (at == ids.end() || left < 0 || right < 0) {
    return Eigen::Vector3d::Zero();
  }
  constexpr double kLies = 0.2;  // of the hips' distance that goes along the ground
  const Points& joints = motion.joints[static_cast<std::size_t>(at - ids.begin())];
  const Eigen::Vector3d across = (joints.row(left) - joints.row(right)).transpose();
  const Eigen::Vector3d facing = across.cross(Eigen::Vector3d::UnitY());
  return facing.norm() > kLies * across.norm() ? facing : Eigen::Vector3d::Zero().eval();
}

std::string scan_pictures(const ReportPlaces& places) {
  std::string html;
  const std::optional<Dataset> dataset = dataset_of(places);
  if (dataset) {
    html = "<figure>" + camera_layout_svg(*dataset, {}, {}) +
           "<figcaption>Positions and directions of the cameras</figcaption></figure>\n";
  }
  std::vector<fs::path> scans;
  const fs::path folder = result_of(places, "reconstruct") / "scans";
  if (!fs::exists(folder)) {
    return html;
  }
  for (const auto& entry : fs::directory_iterator(folder)) {
    scans.push_back(entry.path());
  }
  std::sort(scans.begin(), scans.end());
  if (scans.empty()) {
    return html;
  }
  const fs::path& file = scans[scans.size() / 3];
  const Mesh scan = read_mesh_archive(file);
  Look plain;
  plain.roughness = 0.9F;
  plain.color = {0.9F, 0.9F, 0.9F};
  const std::optional<Tracked> tracked =
      dataset ? tracked_of(places, *dataset) : std::optional<Tracked>();
  const auto [front, back] = two_sides(tracked_facing(tracked, std::atoi(file.stem().c_str())));
  std::vector<CaptionedImage> cells = {{seen({{scan, plain}}, front.view, kWide), front.name},
                                       {seen({{scan, plain}}, back.view, kWide), back.name}};
  if (!scan.labels.empty()) {
    Mesh labelled = scan;
    labelled.colors.resize(scan.vertices.rows(), 3);
    for (Index v = 0; v < scan.vertices.rows(); ++v) {
      constexpr double kLabels = 9;
      labelled.colors.row(v) =
          map_color(ColorMap::Turbo, scan.labels[static_cast<std::size_t>(v)] / kLabels)
              .transpose();
    }
    cells.push_back({seen({{labelled, plain}}, front.view, kWide), "labels"});
    cells.push_back({seen({{labelled, plain}}, back.view, kWide), "labels"});
  }
  return html + figure(contact_sheet(cells, {.columns = 4}),
                       "The surface of frame " + file.stem().string());
}

/// How well each frame of each tracked sequence is founded.
std::string track_plots(const ReportPlaces& places) {
  const fs::path folder = result_of(places, "track") / "tracked";
  std::string html;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const TrackedMotion tracked = read_tracked_motion(entry.path());
    const auto series = [](const Eigen::VectorXd& values, double scale) {
      const Eigen::VectorXd scaled = scale * values;
      return std::vector<double>(scaled.data(), scaled.data() + scaled.size());
    };
    const std::vector<int>& ids = tracked.motion.frame_ids;
    const std::string svg =
        plots_svg({{"standard deviation of joints, mm", ids,
                    series(tracked.deviations.rowwise().mean(), 1e3)},
                   {"keypoints, mm rms", ids, series(tracked.keypoint_rms, 1e3)},
                   {"scan, mm rms", ids, series(tracked.scan_rms, 1e3)},
                   {"share of the scan that counted", ids, series(tracked.scan_share, 1)}});
    html += svg.empty()
                ? ""
                : "<figure>" + svg + "<figcaption>" + html_text(entry.path().stem().string()) +
                      " over frames</figcaption></figure>\n";
  }
  return html;
}

std::string size_text(int width, int height) {
  return std::to_string(width) + "x" + std::to_string(height);
}

/// Some frames' images of the front camera, each drawn over; an image that `draw` has nothing
/// for is left out. Of cameras whose images are as large as their calibration says: nobody knows
/// what of others was cut off. Where there are none, a sentence says so.
std::string front_pictures(
    const ReportPlaces& places, const std::string& what,
    const std::function<std::optional<Image>(const Camera&, const TrackedMotion&, int, Image)>&
        draw) {
  std::optional<Dataset> dataset = dataset_of(places);
  const std::optional<Tracked> tracked = dataset ? tracked_of(places, *dataset) : std::nullopt;
  if (!tracked) {
    return "";
  }
  const std::vector<Camera> cameras = dataset->cameras;
  FrameReader reader(std::move(*dataset));
  std::string other_size;
  for (const Index c : tracked->cameras) {
    const Camera& camera = cameras[static_cast<std::size_t>(c)];
    bool agree = true;
    std::vector<CaptionedImage> cells;
    for (const int id : spread(tracked->motion.motion.frame_ids, kPictures)) {
      const auto image = reader.image(c, id);
      if (!image) {
        continue;
      }
      agree = image->width == camera.width && image->height == camera.height;
      if (!agree) {
        other_size += (other_size.empty() ? "" : "; ") + camera.id + ": " +
                      size_text(image->width, image->height) + " pixels, calibrated for " +
                      size_text(camera.width, camera.height);
        break;
      }
      if (const auto drawn = draw(camera, tracked->motion, id, coloured(*image))) {
        cells.push_back({scaled(*drawn), "frame " + std::to_string(id)});
      }
    }
    if (agree && !cells.empty()) {
      return figure(contact_sheet(cells, {.columns = static_cast<int>(kPictures)}),
                    what + " over the images of camera " + camera.id);
    }
  }
  return other_size.empty() ? ""
                            : "<p class=\"warning\">" + what +
                                  " over images is left out: no camera's are as large as its "
                                  "calibration says (" +
                                  html_text(other_size) + ")</p>\n";
}

/// Bones, red in frames that are not trusted.
Image with_bones(const Camera& camera, const TrackedMotion& motion, int id, const Image& picture) {
  const auto row = static_cast<std::size_t>(
      std::find(motion.motion.frame_ids.begin(), motion.motion.frame_ids.end(), id) -
      motion.motion.frame_ids.begin());
  const double unit = camera.height / 480.0;
  std::vector<Mark> marks;
  for (std::size_t j = 1; j < motion.skeleton.parents.size(); ++j) {
    const auto a = project(camera, motion.joints[row].row(motion.skeleton.parents[j]).transpose());
    const auto b = project(camera, motion.joints[row].row(static_cast<Index>(j)).transpose());
    if (a && b) {
      marks.emplace_back(Polyline{.points = {*a, *b},
                                  .color = motion.trusted[row] != 0
                                               ? Eigen::Vector3f(0.1F, 0.9F, 0.2F)
                                               : Eigen::Vector3f(0.9F, 0.1F, 0.05F),
                                  .width = 2.2 * unit});
      marks.emplace_back(Circle{.center = *b, .radius = 2.6 * unit, .color = {1, 0.8F, 0}});
    }
  }
  return drawn(picture, marks);
}

std::string skeleton_pictures(const ReportPlaces& places) {
  return front_pictures(places, "The skeleton", with_bones);
}

/// What a camera sees of meshes, with coverage.
Image rendered(const std::vector<RenderMesh>& meshes, const Camera& camera) {
  Scene scene = studio_scene(meshes, 0);
  scene.ground.reset();
  RenderOptions options;
  options.alpha = true;
  options.samples = 4;
  options.ambient_samples = 4;
  return render(scene, camera, options);
}

Image over(const Image& picture, const Image& drawn, float opacity) {
  Image both = picture;
  for (int y = 0; y < both.height; ++y) {
    for (int x = 0; x < both.width; ++x) {
      const float cover = opacity * drawn.at(x, y, 3);
      for (int c = 0; c < 3; ++c) {
        both.at(x, y, c) = (1 - cover) * both.at(x, y, c) + opacity * drawn.at(x, y, c);
      }
    }
  }
  return both;
}

/// The body, as if clothes were glass.
std::string body_pictures(const ReportPlaces& places) {
  const Sequence bodies = open_sequence(result_of(places, "body"));
  return front_pictures(
      places, "The body under the clothes",
      [&](const Camera& camera, const TrackedMotion& /*motion*/, int id,
          const Image& picture) -> std::optional<Image> {
        const auto at = std::find(bodies.frame_ids.begin(), bodies.frame_ids.end(), id);
        if (at == bodies.frame_ids.end()) {
          return std::nullopt;
        }
        RenderMesh body{frame(bodies, at - bodies.frame_ids.begin()), clay_look()};
        body.look.color = {0.25F, 0.55F, 0.8F};
        return over(picture, rendered({body}, camera), 0.7F);
      });
}

/// How far each vertex is from the frame's scan, in colours.
std::string register_pictures(const ReportPlaces& places) {
  const fs::path scans = result_of(places, "reconstruct") / "scans";
  const fs::path registered = result_of(places, "register") / "registered";
  if (!fs::exists(registered)) {
    return "";
  }
  constexpr double kMost = 0.01;  // m
  std::string html;
  std::vector<fs::path> garments;
  for (const auto& entry : fs::directory_iterator(registered)) {
    garments.push_back(entry.path());
  }
  std::sort(garments.begin(), garments.end());
  for (const fs::path& garment : garments) {
    const Sequence sequence = open_sequence(garment);
    std::vector<CaptionedImage> cells;
    for (const int id : spread(sequence.frame_ids, kPictures)) {
      const fs::path file = scans / (frame_name(id) + ".h5");
      if (!fs::exists(file)) {
        continue;
      }
      const Mesh scan = read_mesh_archive(file);
      const auto at = std::find(sequence.frame_ids.begin(), sequence.frame_ids.end(), id);
      RenderMesh cloth{frame(sequence, at - sequence.frame_ids.begin()), {}};
      Eigen::VectorXd off(cloth.mesh.vertices.rows());
      const std::vector<ClosestPoint> nearest =
          closest_points(build_tree(scan.vertices, scan.faces), cloth.mesh.vertices);
      for (Index v = 0; v < off.size(); ++v) {
        off[v] = std::sqrt(nearest[static_cast<std::size_t>(v)].squared_distance);
      }
      cloth.mesh.colors = map_colors(ColorMap::Viridis, off, 0, kMost);
      cloth.mesh.normals.resize(0, 3);
      cloth.look.color = {1, 1, 1};
      cloth.look.roughness = 1;
      cells.push_back({seen({cloth}, kThreeQuarter, kWide), "frame " + std::to_string(id)});
    }
    if (!cells.empty()) {
      cells.push_back({color_bar(ColorMap::Viridis, 0, 1e3 * kMost, "mm", kPictureHeight), ""});
      html += figure(contact_sheet(cells, {.columns = static_cast<int>(cells.size())}),
                     garment.filename().string() + ": distance of each place from the scan");
    }
  }
  return html;
}

/// Frames of the simulated garment, on the body where it can be read.
std::string strip_pictures(const ReportPlaces& places) {
  const fs::path result = result_of(places, "simulate");
  if (!fs::exists(result / "garment" / "sequence.h5")) {
    return "";
  }
  const Sequence garment = open_sequence(result / "garment");
  std::function<Points(Index)> body;
  Triangles body_faces;
  // Where the scene is gone, or was another, the garment is shown alone.
  const StageStatus* status = sound(places, "simulate");
  const fs::path folder = status->manifest->inputs.front().path;
  if (status->state == StageStatus::State::Done && fs::is_directory(folder)) {
    OptionSet set = option_set<SimulateOptions>();
    for (const ManifestOption& option : status->manifest->options) {
      const nlohmann::json value = parse_json(option.json, "manifest.json");
      set_option(set.table, option.name,
                 value.is_string() ? value.get<std::string>() : option.json);
    }
    const SimulationScene scene =
        read_scene_body(scene_in(folder), options_of<SimulateOptions>(set));
    body = scene.body;
    body_faces = scene.body_faces;
  }
  std::vector<CaptionedImage> cells;
  constexpr std::size_t kStrip = 6;
  for (const int id : spread(garment.frame_ids, kStrip)) {
    const auto at = std::find(garment.frame_ids.begin(), garment.frame_ids.end(), id);
    RenderMesh cloth{frame(garment, at - garment.frame_ids.begin()), clay_look()};
    cloth.look.color = kCloth;
    std::vector<RenderMesh> scene = {cloth};
    if (body) {
      RenderMesh wearer;
      wearer.mesh.vertices = body(id);
      wearer.mesh.faces = body_faces;
      wearer.look.color = kSkin;
      scene.push_back(std::move(wearer));
    }
    cells.push_back({seen(scene, kThreeQuarter, kNarrow), "frame " + std::to_string(id)});
  }
  // `simulate` reads no result of `material`.
  const StageStatus* material = sound(places, "material");
  const bool fitted = material != nullptr && material->manifest->metrics.contains("fitted") &&
                      material->manifest->metrics.at("fitted") > 0;
  return figure(contact_sheet(cells, {.columns = static_cast<int>(kStrip)}),
                std::string("The simulated garment") +
                    (fitted ? ", of the fabric that this stage's options say: animate takes the "
                              "one that material fitted"
                            : ""));
}

/// Cameras and frames that nothing was learnt from, as they were taken and as networks draw them.
std::string held_out_pictures(const ReportPlaces& places) {
  const StageStatus* status = sound(places, "appearance");
  const std::optional<Dataset> dataset = dataset_of(places, "appearance");
  if (status == nullptr || status->state != StageStatus::State::Done || !dataset ||
      !has_child_program("atelier-appearance")) {
    return "";
  }
  std::map<std::string, fs::path> inputs;
  for (const ManifestInput& input : status->manifest->inputs) {
    inputs[input.kind] = places.workspace / input.stage / fs::path(input.path).filename();
  }
  const WornSubject worn = worn_in_workspace(inputs.at("registered"), inputs.at("bodies"));
  std::map<std::size_t, std::string> models;
  for (std::size_t s = 0; s < worn.templates.size(); ++s) {
    const fs::path model =
        result_of(places, "appearance") / worn.subject.names[s] / "model.safetensors";
    if (fs::exists(model)) {
      models[s] = model.string();
    }
  }
  constexpr std::size_t kShown = 3;
  const std::vector<int> frame_ids = spread(dataset->info.held_out_frames, kShown);
  const std::vector<std::string>& held = dataset->info.held_out_cameras;
  FrameReader reader(*dataset);
  std::vector<TakenView> views;
  for (std::size_t i = 0; i < frame_ids.size() && !held.empty(); ++i) {
    const auto camera =
        std::find_if(dataset->cameras.begin(), dataset->cameras.end(),
                     [&](const Camera& one) { return one.id == held[i % held.size()]; });
    if (camera == dataset->cameras.end()) {
      continue;
    }
    const auto picture = reader.image(camera - dataset->cameras.begin(), frame_ids[i]);
    if (picture && picture->width == camera->width && picture->height == camera->height) {
      views.push_back({*camera, frame_ids[i], coloured(*picture)});
    }
  }
  if (views.empty()) {
    return "";
  }
  return figure(*taken_and_drawn(worn, models, views, Device::Cpu),
                "Held-out cameras in held-out frames, which were not used for training: images as "
                "taken and as rendered by the networks");
}

}  // namespace

std::string drawings_of(const std::string& stage, const ReportPlaces& places) {
  return stage == "reconstruct"  ? scan_pictures(places)
         : stage == "track"      ? skeleton_pictures(places) + track_plots(places)
         : stage == "body"       ? body_pictures(places)
         : stage == "register"   ? register_pictures(places)
         : stage == "simulate"   ? strip_pictures(places)
         : stage == "appearance" ? held_out_pictures(places)
                                 : "";
}

}  // namespace atelier
