#include "pipeline/synthesis/synthesis_stage.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "capture/garment_fabric.h"
#include "capture/stitching.h"
#include "capture/synthetic_studio.h"
#include "core/archive.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/image_file.h"
#include "core/parallel.h"
#include "core/render/interreflection.h"
#include "core/render/surface_maps.h"
#include "core/tree.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

constexpr int kAtOnce = 2;  // cameras whose images are in memory together

// Streams of random numbers, one per purpose.
constexpr std::uint64_t kCameras = 100;
constexpr std::uint64_t kCalibration = 101;
constexpr std::uint64_t kWrongCamera = 102;
constexpr std::uint64_t kFabric = 103;
constexpr std::uint64_t kDetections = 1000;
constexpr std::uint64_t kLabels = 1001;
constexpr std::uint64_t kNoise = 1002;

/// One stream for each purpose, frame and camera.
std::uint64_t stream_of(std::uint64_t purpose, int frame_id, std::size_t camera) {
  return purpose +
         4096 * (static_cast<std::uint64_t>(frame_id) * 2048 + static_cast<std::uint64_t>(camera));
}

std::vector<Camera> written_cameras(const std::vector<Camera>& cameras,
                                    const SynthesisOptions& options) {
  const auto seed = static_cast<std::uint64_t>(options.seed);
  const double rms = options.perfect ? 0 : options.calibration_error * options.dome.height / 1000;
  std::vector<Camera> written = calibrated_cameras(cameras, rms, {seed, kCalibration});
  Random random{seed, kWrongCamera};
  const std::size_t first = uniform_index(random, written.size());
  for (int i = 0; i < options.miscalibrated; ++i) {
    // Two degrees about its own centre: somebody leaned on it after the calibration.
    Camera& camera = written[(first + static_cast<std::size_t>(i)) % written.size()];
    const double angle = 2 * 3.14159265358979 * uniform(random);
    const Eigen::Vector3d axis(std::cos(angle), std::sin(angle), 0);
    const Eigen::Vector3d center = camera_center(camera);
    camera.camera_from_world_rotation =
        Eigen::AngleAxisd(0.035, axis).toRotationMatrix() * camera.camera_from_world_rotation;
    camera.camera_from_world_translation = -camera.camera_from_world_rotation * center;
  }
  return written;
}

/// Metres across the unit square of a garment's texture.
double texture_metres(const Mesh& mesh) {
  double length = 0;
  double uv_length = 0;
  for (Index f = 0; f < mesh.uv_faces.rows(); ++f) {
    for (int c = 0; c < 3; ++c) {
      length +=
          (mesh.vertices.row(mesh.faces(f, c)) - mesh.vertices.row(mesh.faces(f, (c + 1) % 3)))
              .norm();
      uv_length +=
          (mesh.uvs.row(mesh.uv_faces(f, c)) - mesh.uvs.row(mesh.uv_faces(f, (c + 1) % 3))).norm();
    }
  }
  return uv_length > 0 ? length / uv_length : 1;
}

Points moved(const Points& points, const Points& velocity, double seconds) {
  return velocity.rows() == points.rows() && seconds != 0 ? Points(points + seconds * velocity)
                                                          : points;
}

ByteImage seen_image(const std::vector<std::vector<bool>>& seen, Index vertices) {
  ByteImage image(static_cast<int>(vertices), static_cast<int>(seen.size()), 1);
  for (std::size_t c = 0; c < seen.size(); ++c) {
    std::copy(seen[c].begin(), seen[c].end(),
              image.data.begin() + static_cast<std::ptrdiff_t>(c) * vertices);
  }
  return image;
}

/// Points of the schema out of the ground truth's, by name; far behind every camera where it has
/// none.
Points schema_points(const KeypointSchema& schema, const std::vector<std::string>& names,
                     const Points& points) {
  Points result(static_cast<Index>(schema.points.size()), 3);
  for (std::size_t i = 0; i < schema.points.size(); ++i) {
    const auto found = std::find(names.begin(), names.end(), schema.points[i]);
    if (found == names.end()) {
      result.row(static_cast<Index>(i)) << 0, -1e6, 0;
    } else {
      result.row(static_cast<Index>(i)) = points.row(found - names.begin());
    }
  }
  return result;
}

/// How far under the skin a keypoint may lie and still be seen with its body part.
double depth_of(const std::string& name) {
  if (name.find("hip") != std::string::npos) {
    return 0.16;
  }
  if (name.starts_with("face") || name.ends_with("eye") || name == "nose") {
    return 0.012;
  }
  if (name == "neck" || name.ends_with("shoulder")) {
    return 0.11;
  }
  return name.ends_with("knee") || name.ends_with("elbow") ? 0.085 : 0.06;
}

std::vector<KeypointSight> sights_of(const Camera& camera, const KeypointSchema& schema,
                                     const Points& points, const TriangleTree& body,
                                     const Photograph& taken) {
  std::vector<KeypointSight> sights;
  const Eigen::Vector3d eye = camera_center(camera);
  for (std::size_t i = 0; i < schema.points.size(); ++i) {
    KeypointSight sight;
    const Eigen::Vector3d point = points.row(static_cast<Index>(i)).transpose();
    const Eigen::Vector3d ray = point - eye;
    const RayHit hit = first_hit(body, {eye, ray, 0, 1});
    const double buried = hit.face >= 0 ? (1 - hit.t) * ray.norm() : 0;
    sight.seen = buried < depth_of(schema.points[i]);
    const auto pixel = project(camera, point);
    if (pixel && pixel->x() >= 0 && pixel->y() >= 0 && pixel->x() < camera.width &&
        pixel->y() < camera.height) {
      const int x = static_cast<int>(pixel->x());
      const int y = static_cast<int>(pixel->y());
      const std::uint8_t label = taken.labels.at(x, y);
      sight.covered = sight.seen && is_cloth(static_cast<Label>(label));
      if (sight.covered) {
        const double cloth = taken.maps.depth.at(x, y);
        const double skin = (camera_from_world(camera, point).z()) - buried;
        sight.under_cloth = std::clamp((skin - cloth - 0.015) / 0.085, 0.0, 1.0);
        double sum = 0;
        int count = 0;
        for (int column = 0; column < camera.width; ++column) {
          if (taken.labels.at(column, y) == label) {
            sum += column + 0.5;
            ++count;
          }
        }
        sight.centre_x = count > 0 ? sum / count : pixel->x();
      }
    }
    sights.push_back(sight);
  }
  return sights;
}

Archive maps_archive(const SurfaceMaps& maps) {
  Archive archive;
  archive.schema = "atelier.truth.maps";
  const std::int64_t h = maps.depth.height;
  const std::int64_t w = maps.depth.width;
  archive.datasets["depth"] = tensor_of(maps.depth.data, {h, w});
  archive.datasets["uv"] = tensor_of(maps.uv.data, {h, w, 2});
  archive.datasets["normal"] = tensor_of(maps.normal.data, {h, w, 3});
  archive.datasets["mesh"] = tensor_of(maps.mesh.data, {h, w});
  archive.datasets["face"] = tensor_of(maps.face.data, {h, w});
  return archive;
}

Image mean_of(const std::vector<Image>& images) {
  Image mean = images.front();
  for (std::size_t i = 0; i < mean.data.size(); ++i) {
    float sum = 0;
    for (const Image& image : images) {
      sum += image.data[i];
    }
    mean.data[i] = sum / static_cast<float>(images.size());
  }
  return mean;
}

PreparedScene prepared(const Scene& scene, const SynthesisStage& stage,
                       const SynthesisOptions& options) {
  PrepareOptions prepare_options;
  prepare_options.ambient = Ambient::PerVertex;
  prepare_options.vertex_samples = options.light_samples;
  prepare_options.ground_reach = kStudioFloor;
  prepare_options.ground_shadow_rays = std::min(options.light_samples * 2 / 3, 1024);
  prepare_options.seed = options.seed;
  BounceOptions bounce;
  bounce.rays = options.light_samples / 3;
  return prepare_with_bounce(scene, prepare_options, bounce, stage.textures);
}

RenderOptions rays_of(const SynthesisOptions& options) {
  RenderOptions rays;
  rays.samples = options.samples;
  rays.penumbra_samples = 2;
  rays.seed = options.seed;
  return rays;
}

}  // namespace

SynthesisStage set_stage(GroundTruth truth, const std::vector<WornLayer>& layers,
                         const SynthesisOptions& options) {
  const auto seed = static_cast<std::uint64_t>(options.seed);
  SynthesisStage stage;
  DomeOptions dome = options.dome;
  if (options.perfect) {
    dome.gain = 0;  // cameras.json has no gains: who wants no errors wants equal exposures
  }
  stage.cameras = dome_cameras(dome, {seed, kCameras});
  stage.written = written_cameras(stage.cameras, options);
  stage.surroundings = studio_surroundings(stage.cameras);
  truth.cameras = stage.cameras;
  truth.lights = stage.surroundings.area_lights;
  truth.environment = stage.surroundings.environment;
  BodyModel painted;
  painted.skeleton = truth.skeleton;
  painted.mesh = truth.body;
  painted.skin = {truth.skin_joints, truth.skin_weights};
  Mesh colored;
  if (truth.skin_weights.rows() == 0) {
    stage.skin.color = {0.5F, 0.32F, 0.24F};  // a body from a file: nothing says where its face is
    stage.skin.roughness = 0.48F;
  } else {
    stage.skin = skin_look(painted, colored, options.skin_resolution, seed);
  }
  stage.skin_colors = colored.colors;
  for (const WornLayer& layer : layers) {
    stage.layers.push_back(layer.look);
    stage.layer_labels.push_back(layer.label);
  }
  for (std::size_t g = 0; g < truth.garments.size(); ++g) {
    const Mesh& mesh = truth.garments[g].garment.mesh;
    if (mesh.uvs.rows() == 0) {
      Look plain;
      plain.color = {0.3F, 0.32F, 0.4F};
      stage.cloths.push_back(plain);
      continue;
    }
    const FabricOptions fabric = garment_fabric(options.fabric, truth.garments, g);
    const double metres = texture_metres(mesh);
    const Image cloth = fabric_image(metres, fabric, seed * 977 + kFabric + 7 * g);
    stage.cloths.push_back(cloth_look(with_stitching(cloth, mesh, metres), fabric.kind));
  }
  stage.truth = std::move(truth);
  std::vector<Look> looks = stage.layers;
  looks.push_back(stage.skin);
  looks.insert(looks.end(), stage.cloths.begin(), stage.cloths.end());
  stage.textures = prepare_textures(looks);
  return stage;
}

StageInstant instant_of(const SynthesisStage& stage, const PerformedFrame& frame, double shift) {
  StageInstant instant;
  instant.surroundings = stage.surroundings;
  const auto add = [&](const std::string& name, Mesh mesh, const Points& at, const Look& look,
                       Label label) {
    mesh.vertices = at;
    mesh.normals.resize(0, 3);
    instant.layers.push_back({name, {std::move(mesh), look}, label});
  };
  Mesh body = stage.truth.body;
  body.colors = stage.skin_colors;
  add("body", body, moved(frame.truth.body, frame.body_velocity, shift), stage.skin, Label::Skin);
  for (std::size_t i = 0; i < frame.truth.layers.size(); ++i) {
    if (frame.truth.layers[i].rows() > 0) {
      const Points velocity =
          i < frame.layer_velocities.size() ? frame.layer_velocities[i] : Points();
      add(stage.truth.layer_names[i], stage.truth.layers[i],
          moved(frame.truth.layers[i], velocity, shift), stage.layers[i], stage.layer_labels[i]);
    }
  }
  for (std::size_t i = 0; i < frame.truth.garments.size(); ++i) {
    if (frame.truth.garments[i].rows() > 0) {
      const GroundTruthGarment& garment = stage.truth.garments[i];
      const Points velocity =
          i < frame.garment_velocities.size() ? frame.garment_velocities[i] : Points();
      add(garment.garment.name, garment.garment.mesh,
          moved(frame.truth.garments[i], velocity, shift), stage.cloths[i], garment.label);
    }
  }
  return instant;
}

std::vector<Image> clean_pictures(const SynthesisStage& stage, const PerformedFrame& frame,
                                  const std::vector<Camera>& cameras,
                                  const SynthesisOptions& options) {
  const PreparedScene scene = prepared(scene_of(instant_of(stage, frame)), stage, options);
  std::vector<Image> pictures;
  pictures.reserve(cameras.size());
  for (const Camera& camera : cameras) {
    pictures.push_back(
        exposed(render(scene, camera, rays_of(options)), camera.gain, options.sensor));
  }
  return pictures;
}

void photograph_plates(const fs::path& folder, const SynthesisStage& stage,
                       const SynthesisOptions& options) {
  const PreparedScene scene = prepared(stage.surroundings, stage, options);
  const RenderOptions rays = rays_of(options);
  SensorOptions sensor = options.sensor;
  if (options.perfect) {
    sensor.shot_noise = sensor.read_noise = 0;
  }
  make_private_directory(folder / "plates");
  parallel_for(static_cast<Index>(stage.cameras.size()), 1, [&](Index first, Index last) {
    for (Index i = first; i < last; ++i) {
      const auto c = static_cast<std::size_t>(i);
      const Camera& camera = stage.cameras[c];
      constexpr int kNoFrame = 999'999;  // a number that no frame of a capture has
      write_image(folder / "plates" / (camera.id + ".png"),
                  noisy(exposed(render(scene, camera, rays), camera.gain, sensor), sensor,
                        static_cast<std::uint64_t>(options.seed), stream_of(kNoise, kNoFrame, c)));
    }
  });
}

bool photograph_instant(const fs::path& folder, const SynthesisStage& stage,
                        const PerformedFrame& frame, const SynthesisOptions& options,
                        const std::function<bool()>& stop) {
  const auto seed = static_cast<std::uint64_t>(options.seed);
  const int id = frame.truth.frame_id;
  const std::string name = frame_name(id);
  const fs::path done = folder / "truth" / "frames" / (name + ".h5");
  if (fs::exists(done)) {
    return true;
  }
  const StageInstant instant = instant_of(stage, frame);
  const PreparedScene scene = prepared(scene_of(instant), stage, options);
  std::vector<PreparedScene> shutter;
  for (int i = 0; options.shutter > 0 && i < options.shutter_samples; ++i) {
    const double shift = options.shutter * ((i + 0.5) / options.shutter_samples - 0.5);
    shutter.push_back(prepared(scene_of(instant_of(stage, frame, shift)), stage, options));
  }
  const TriangleTree body = build_tree(frame.truth.body, stage.truth.body.faces);
  const KeypointSchema& schema = keypoint_schema(options.keypoints);
  const Points keypoints = schema_points(schema, stage.truth.keypoint_names, frame.truth.keypoints);
  SensorOptions sensor = options.sensor;
  DetectorOptions detector = options.detector;
  LabelNoiseOptions label_noise = options.labels;
  if (options.perfect) {
    sensor.shot_noise = sensor.read_noise = 0;
    detector.perfect = label_noise.perfect = true;
  }
  const RenderOptions rays = rays_of(options);

  const std::size_t count = stage.cameras.size();
  std::vector<std::vector<bool>> body_seen(count);
  std::vector<std::vector<std::vector<bool>>> cloth_seen(stage.truth.garments.size());
  for (auto& seen : cloth_seen) {
    seen.resize(count);
  }
  const auto take = [&](std::size_t c) {
    const Camera& camera = stage.cameras[c];
    const fs::path image = folder / "images" / camera.id / (name + "." + options.image_format);
    const fs::path labels = folder / "labels" / camera.id / (name + ".png");
    const fs::path points = folder / "keypoints2d" / camera.id / (name + ".json");
    const fs::path clean = folder / "truth" / "images" / camera.id / (name + ".png");
    const fs::path true_labels = folder / "truth" / "labels" / camera.id / (name + ".png");
    const fs::path maps = folder / "truth" / "maps" / camera.id / (name + ".h5");
    body_seen[c] = visible_points(scene, camera, frame.truth.body, 2e-3);
    for (std::size_t g = 0; g < cloth_seen.size(); ++g) {
      if (frame.truth.garments[g].rows() > 0) {
        cloth_seen[g][c] = visible_points(scene, camera, frame.truth.garments[g], 2e-3);
      }
    }
    if (fs::exists(image)) {
      return;  // the image is written last
    }
    Photograph taken = photograph(instant, scene, camera, rays);
    if (!shutter.empty()) {
      std::vector<Image> parts;
      parts.reserve(shutter.size());
      for (const PreparedScene& part : shutter) {
        parts.push_back(render(part, camera, rays));
      }
      taken.light = mean_of(parts);
    }
    const Image light = exposed(taken.light, camera.gain, sensor);
    if (options.ground_truth_images) {
      write_image(clean, light);
    }
    write_labels(true_labels, taken.labels);
    if (options.ground_truth_maps) {
      write_archive(maps, maps_archive(taken.maps));
    }
    write_labels(labels,
                 detected_labels(taken.labels, label_noise, {seed, stream_of(kLabels, id, c)}));
    const Keypoints2d found = detected_keypoints(camera, schema, keypoints,
                                                 sights_of(camera, schema, keypoints, body, taken),
                                                 detector, {seed, stream_of(kDetections, id, c)});
    write_file_atomically(points, keypoints_json(found));
    write_image(image, noisy(light, sensor, seed, stream_of(kNoise, id, c)));
  };
  for (std::size_t begin = 0; begin < count; begin += kAtOnce) {
    if (stop()) {
      return false;
    }
    const std::size_t end = std::min(count, begin + kAtOnce);
    parallel_for(static_cast<Index>(end - begin), 1, [&](Index first, Index last) {
      for (Index i = first; i < last; ++i) {
        take(begin + static_cast<std::size_t>(i));
      }
    });
  }
  GroundTruthFrame truth = frame.truth;
  truth.body_seen = seen_image(body_seen, truth.body.rows());
  truth.garments_seen.clear();  // a performed frame that was read back has empty ones
  for (std::size_t g = 0; g < cloth_seen.size(); ++g) {
    truth.garments_seen.push_back(truth.garments[g].rows() > 0
                                      ? seen_image(cloth_seen[g], truth.garments[g].rows())
                                      : ByteImage{});
  }
  write_archive(done, archive_of(truth, stage.truth));
  return true;
}

}  // namespace atelier
