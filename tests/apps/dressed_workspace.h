#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <string>
#include <vector>

#include "bodymodel/formats/body_archive.h"
#include "bodymodel/formats/personal_body.h"
#include "bodymodel/formats/tracked_motion.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/skinning.h"
#include "core/garment_archive.h"
#include "core/sequence_archive.h"
#include "core/store/run_stage.h"
#include "tests/bodymodel/synthetic_person.h"
#include "tests/capture/small_capture.h"
#include "tests/support/shapes.h"

namespace atelier::fixtures {

/// A person whose skin is a trunk: an egg that follows the spine.
inline BodyModel trunk_body() {
  BodyModel model;
  model.name = "trunk";
  model.skeleton = person_skeleton();
  const Mesh egg = sphere(2);
  model.mesh.faces = egg.faces;
  model.mesh.vertices = egg.vertices * Eigen::Vector3d(0.18, 0.35, 0.13).asDiagonal();
  model.mesh.vertices.rowwise() += Eigen::RowVector3d(0, 1.2, 0);
  model.skin.joints = Eigen::MatrixXi::Constant(egg.vertices.rows(), 1, 9);
  model.skin.weights = Eigen::MatrixXd::Ones(egg.vertices.rows(), 1);
  return model;
}

/// A skirt: a tube that widens from the hips down, its waist and hem named.
inline Garment tube_skirt() {
  constexpr int kRound = 20;
  constexpr int kRings = 7;
  Garment garment;
  garment.name = "lower";
  Mesh& mesh = garment.mesh;
  mesh.vertices.resize(kRound * kRings, 3);
  mesh.faces.resize(2 * kRound * (kRings - 1), 3);
  garment.boundaries.resize(2);
  garment.boundary_names = {"waist", "hem"};
  Index face = 0;
  for (int r = 0; r < kRings; ++r) {
    for (int i = 0; i < kRound; ++i) {
      const double angle = 2 * std::numbers::pi * i / kRound;
      const double radius = 0.2 + 0.008 * r;
      mesh.vertices.row(r * kRound + i) << radius * std::sin(angle), 1.2 - 0.05 * r,
          radius * std::cos(angle);
      if (r + 1 < kRings) {
        const int a = r * kRound + i;
        const int b = r * kRound + (i + 1) % kRound;
        mesh.faces.row(face++) << a, a + kRound, b + kRound;
        mesh.faces.row(face++) << a, b + kRound, b;
      }
    }
  }
  for (int i = 0; i < kRound; ++i) {
    garment.boundaries[0].push_back(i);
    garment.boundaries[1].push_back((kRings - 1) * kRound + kRound - 1 - i);
  }
  return garment;
}

/// A short walk of the trunk: three frames.
inline TrackedMotion short_walk() {
  TrackedMotion tracked;
  tracked.skeleton = person_skeleton();
  tracked.motion.fps = 12;
  for (int i = 0; i < 3; ++i) {
    Pose pose = rest_pose(tracked.skeleton);
    pose.root_translation = {0, 0, 0.02 * i};
    pose.rotations.row(0) << 0, 0.05 * i, 0;
    tracked.motion.frame_ids.push_back(i);
    tracked.joints.push_back(forward_kinematics(tracked.skeleton, pose).positions);
    tracked.motion.poses.push_back(std::move(pose));
  }
  tracked.deviations = RowMatrix::Zero(3, tracked.joints[0].rows());
  tracked.trusted = {1, 1, 1};
  tracked.keypoint_rms = tracked.scan_rms = tracked.scan_share = Eigen::VectorXd::Zero(3);
  return tracked;
}

struct NoOptions {};
inline OptionTable describe(NoOptions&) {
  return {};
}

/// A sequence of meshes over one topology, as stages write it.
inline void write_meshes(StageRun& run, const std::string& folder, const Triangles& faces,
                         const std::vector<Points>& frames) {
  SequenceHeader header;
  header.fps = 12;
  header.shared.faces = faces;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    header.frame_ids.push_back(static_cast<int>(i));
  }
  run.output((std::filesystem::path(folder) / "sequence.h5").generic_string(),
             [&](const auto& file) { write_archive(file, archive_of(header)); });
  for (std::size_t i = 0; i < frames.size(); ++i) {
    Mesh mesh;
    mesh.vertices = frames[i];
    run.output(sequence_frame_path(folder, static_cast<int>(i)).generic_string(),
               [&](const auto& file) { write_mesh_archive(file, mesh); });
  }
}

inline std::vector<Points> walking_trunk() {
  std::vector<Points> bodies;
  for (const Pose& pose : short_walk().motion.poses) {
    bodies.push_back(skin_vertices(trunk_body(), pose));
  }
  return bodies;
}

/// The skirt as if it were registered: it turns and goes with the trunk.
inline std::vector<Points> walking_skirt() {
  std::vector<Points> skirts;
  for (int i = 0; i < 3; ++i) {
    const Eigen::AngleAxisd turn(0.05 * i, Eigen::Vector3d::UnitY());
    Points skirt = tube_skirt().mesh.vertices * turn.toRotationMatrix().transpose();
    skirt.rowwise() += Eigen::RowVector3d(0, 0, 0.02 * i);
    skirts.push_back(std::move(skirt));
  }
  return skirts;
}

/// What holds the skirt: its waist, which does not pull.
inline std::string skirt_holding() {
  const Garment skirt = tube_skirt();
  std::string vertices;
  for (const int v : skirt.boundaries[0]) {
    vertices += (vertices.empty() ? "" : ", ") + std::to_string(v);
  }
  return "[[held]]\ngarment = \"lower\"\nopening = \"waist\"\nkind = \"band\"\nvertices = [" +
         vertices + "]\n";
}

/// Results of the stages before `animate`, made in a moment.
inline constexpr std::array kDressedStages = {
    Stage{.name = "personalize",
          .summary = "a trunk",
          .inputs = {"capture"},
          .outputs = {"person"},
          .options = option_set<NoOptions>,
          .run =
              [](StageRun& run) {
                run.output("person.npz", [](const auto& file) {
                  write_personal_body(file, plain_person(trunk_body()));
                });
              }},
    Stage{.name = "track",
          .summary = "a walk",
          .inputs = {"capture"},
          .outputs = {"tracked"},
          .options = option_set<NoOptions>,
          .run =
              [](StageRun& run) {
                run.output("tracked/clothed.h5",
                           [](const auto& file) { write_tracked_motion(file, short_walk()); });
              }},
    Stage{
        .name = "body",
        .summary = "the trunk in every frame",
        .inputs = {"capture"},
        .outputs = {"bodies"},
        .options = option_set<NoOptions>,
        .run =
            [](StageRun& run) { write_meshes(run, "", trunk_body().mesh.faces, walking_trunk()); }},
    Stage{.name = "template",
          .summary = "a skirt",
          .inputs = {"capture"},
          .outputs = {"template"},
          .options = option_set<NoOptions>,
          .run =
              [](StageRun& run) {
                run.output("garments/lower.h5",
                           [](const auto& file) { write_garment_archive(file, tube_skirt()); });
                run.output_text("template.json",
                                R"({"garments": [{"label": "lower", "frame": 0}]})");
              }},
    Stage{.name = "register",
          .summary = "the skirt in every frame",
          .inputs = {"capture"},
          .outputs = {"registered"},
          .options = option_set<NoOptions>,
          .run =
              [](StageRun& run) {
                write_meshes(run, "registered/lower", tube_skirt().mesh.faces, walking_skirt());
                run.output_text("holding.toml", skirt_holding());
              }},
};

/// The small capture of three clothed frames, and a workspace of it up to `last`.
inline void write_dressed_workspace(const std::filesystem::path& capture,
                                    const std::filesystem::path& workspace,
                                    const std::string& last = "register") {
  if (!std::filesystem::exists(capture)) {
    SmallCapture small;
    small.frames = {0, 1, 2};
    write_small_capture(capture, small);
  }
  for (const Stage& stage : kDressedStages) {
    StageRequest request;
    request.input = capture;
    request.workspace = workspace;
    request.options = stage.options();
    run_stage(kDressedStages, stage, request);
    if (stage.name == last) {
      return;
    }
  }
}

}  // namespace atelier::fixtures
