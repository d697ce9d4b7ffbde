// A workspace of a synthetic capture as if every stage up to `register` had found the ground truth,
// for judging the stages after it without the errors before it: `atelier material CAPTURE
// WORKSPACE` and `atelier animate` go on from here. `--noise` puts back what registration is off
// by: every vertex of every frame, redrawn, even over a few neighbours. docs/results/material.md
// has what came of it.
//
//   truth_workspace CAPTURE WORKSPACE [--noise 0.002] [--smooth 4] [--template-frame N] [--seed 1]

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "bodymodel/formats/personal_body.h"
#include "bodymodel/formats/tracked_motion.h"
#include "bodymodel/kinematics.h"
#include "capture/ground_truth_scan.h"
#include "capture/layouts/open_dataset.h"
#include "core/garment_archive.h"
#include "core/io/ground_truth_archive.h"
#include "core/random.h"
#include "core/sequence_archive.h"
#include "core/store/run_stage.h"
#include "core/topology.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

struct GroundTruthOptions {
  double noise = 0;         ///< m rms of each coordinate
  int smooth = 4;           ///< times that the noise is averaged over neighbours
  int template_frame = -1;  ///< below 0: the first
  int seed = 1;
};
OptionTable describe(GroundTruthOptions& options) {
  OptionTable table;
  table.add("noise", options.noise, 0, 1, "m", "Rms of each coordinate of a garment's vertices");
  table.add("smooth", options.smooth, 0, 100, "", "Times that it is averaged over neighbours");
  table.add("template_frame", options.template_frame, -1, 1000000, "", "Of the templates");
  table.add("seed", options.seed, 0, 1000000, "", "Of the noise");
  return table;
}

struct Truth {
  GroundTruth fixed;
  CaptureSequence sequence;  ///< the first clothed one
  std::vector<GroundTruthFrame> frames;
};

Truth read_truth(const fs::path& capture) {
  Truth truth;
  truth.fixed = read_ground_truth(capture);
  for (const CaptureSequence& sequence : open_dataset(capture).info.sequences) {
    if (sequence.kind != "minimal" && truth.frames.empty()) {
      truth.sequence = sequence;
      for (const int id : sequence.frame_ids) {
        truth.frames.push_back(read_ground_truth_frame(capture, truth.fixed, id));
      }
    }
  }
  return truth;
}

BodyModel body_of(const GroundTruth& truth) {
  BodyModel model;
  model.name = "truth";
  model.skeleton = truth.skeleton;
  model.mesh.vertices = truth.body.vertices;
  model.mesh.faces = truth.body.faces;
  model.skin.joints = truth.skin_joints;
  model.skin.weights = truth.skin_weights;
  return model;
}

TrackedMotion motion_of(const Truth& truth) {
  TrackedMotion tracked;
  tracked.skeleton = truth.fixed.skeleton;
  tracked.motion.fps = truth.sequence.fps;
  for (const GroundTruthFrame& frame : truth.frames) {
    tracked.motion.frame_ids.push_back(frame.frame_id);
    tracked.motion.poses.push_back(frame.pose);
    tracked.joints.push_back(frame.joints);
  }
  const auto count = static_cast<Index>(truth.frames.size());
  tracked.deviations = RowMatrix::Zero(count, truth.fixed.skeleton.offsets.rows());
  tracked.trusted.assign(truth.frames.size(), 1);
  tracked.keypoint_rms = tracked.scan_rms = tracked.scan_share = Eigen::VectorXd::Zero(count);
  return tracked;
}

/// Noise that neighbours share, its rms as asked for.
Points noise_of(const Triangles& faces, Index vertices, const GroundTruthOptions& options,
                int frame) {
  Random random{static_cast<std::uint64_t>(options.seed), static_cast<std::uint64_t>(frame)};
  Points noise(vertices, 3);
  for (Index i = 0; i < noise.size(); ++i) {
    noise.data()[i] = normal(random);
  }
  const Topology topology = topology_of(faces, vertices);
  for (int round = 0; round < options.smooth; ++round) {
    Points sum = noise;
    Eigen::VectorXd count = Eigen::VectorXd::Ones(vertices);
    for (Index e = 0; e < topology.edges.rows(); ++e) {
      const int a = topology.edges(e, 0);
      const int b = topology.edges(e, 1);
      sum.row(a) += noise.row(b);
      sum.row(b) += noise.row(a);
      count[a] += 1;
      count[b] += 1;
    }
    noise = sum.array().colwise() / count.array();
  }
  return noise *
         (options.noise / std::sqrt(noise.squaredNorm() / static_cast<double>(noise.size())));
}

void write_bodies(StageRun& run, const SequenceHeader& header, const std::string& folder,
                  const std::vector<Points>& frames) {
  run.output((fs::path(folder) / "sequence.h5").generic_string(),
             [&](const auto& file) { write_archive(file, archive_of(header)); });
  for (std::size_t i = 0; i < frames.size(); ++i) {
    Mesh mesh;
    mesh.vertices = frames[i];
    run.output(sequence_frame_path(folder, header.frame_ids[i]).generic_string(),
               [&](const auto& file) { write_mesh_archive(file, mesh); });
  }
}

SequenceHeader header_of(const Truth& truth, const Triangles& faces) {
  SequenceHeader header;
  header.fps = truth.sequence.fps;
  header.frame_ids = truth.sequence.frame_ids;
  header.shared.faces = faces;
  return header;
}

/// Where the garment is seen in each frame.
std::vector<Points> seen_garment(const Truth& truth, std::size_t g,
                                 const GroundTruthOptions& options) {
  std::vector<Points> seen;
  for (const GroundTruthFrame& frame : truth.frames) {
    seen.push_back(frame.garments[g]);
    if (options.noise > 0) {
      seen.back() += noise_of(truth.fixed.garments[g].garment.mesh.faces, seen.back().rows(),
                              options, frame.frame_id);
    }
  }
  return seen;
}

void run_template(StageRun& run) {
  const auto& options = run.options<GroundTruthOptions>();
  const Truth truth = read_truth(run.input("capture"));
  std::size_t frame = 0;
  while (options.template_frame >= 0 &&
         truth.sequence.frame_ids.at(frame) != options.template_frame) {
    ++frame;
  }
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (std::size_t g = 0; g < truth.fixed.garments.size(); ++g) {
    const GroundTruthGarment& real = truth.fixed.garments[g];
    Garment garment;
    garment.name = label_name(real.label);
    garment.mesh.vertices = seen_garment(truth, g, options)[frame];
    garment.mesh.faces = real.garment.mesh.faces;
    garment.boundaries =
        boundary_loops(topology_of(garment.mesh.faces, garment.mesh.vertices.rows()));
    for (std::size_t i = 0; i < garment.boundaries.size(); ++i) {
      garment.boundary_names.push_back("opening_" + std::to_string(i));
    }
    run.output("garments/" + garment.name + ".h5",
               [&](const auto& file) { write_garment_archive(file, garment); });
    list.push_back({{"label", garment.name}, {"frame", truth.sequence.frame_ids[frame]}});
  }
  run.output_text("template.json", nlohmann::ordered_json{{"garments", list}}.dump(1));
}

void run_register(StageRun& run) {
  const auto& options = run.options<GroundTruthOptions>();
  const Truth truth = read_truth(run.input("capture"));
  for (std::size_t g = 0; g < truth.fixed.garments.size(); ++g) {
    const GroundTruthGarment& real = truth.fixed.garments[g];
    write_bodies(run, header_of(truth, real.garment.mesh.faces),
                 "registered/" + std::string(label_name(real.label)),
                 seen_garment(truth, g, options));
  }
}

constexpr std::array kTruthStages = {
    Stage{.name = "reconstruct",
          .summary = "the ground-truth surfaces",
          .inputs = {"capture"},
          .outputs = {"scans"},
          .options = option_set<GroundTruthOptions>,
          .run =
              [](StageRun& run) {
                const Truth truth = read_truth(run.input("capture"));
                for (const GroundTruthFrame& frame : truth.frames) {
                  const Mesh scan = ground_truth_scan(truth.fixed, frame);
                  run.output("scans/" + frame_name(frame.frame_id) + ".h5",
                             [&](const auto& file) { write_mesh_archive(file, scan); });
                }
              }},
    Stage{.name = "personalize",
          .summary = "the true body",
          .inputs = {"capture"},
          .outputs = {"person"},
          .options = option_set<GroundTruthOptions>,
          .run =
              [](StageRun& run) {
                const Truth truth = read_truth(run.input("capture"));
                run.output("person.npz", [&](const auto& file) {
                  write_personal_body(file, plain_person(body_of(truth.fixed)));
                });
              }},
    Stage{.name = "track",
          .summary = "its true poses",
          .inputs = {"capture"},
          .outputs = {"tracked"},
          .options = option_set<GroundTruthOptions>,
          .run =
              [](StageRun& run) {
                const Truth truth = read_truth(run.input("capture"));
                run.output("tracked/" + truth.sequence.name + ".h5",
                           [&](const auto& file) { write_tracked_motion(file, motion_of(truth)); });
              }},
    Stage{.name = "body",
          .summary = "its true surface in every frame",
          .inputs = {"capture"},
          .outputs = {"bodies"},
          .options = option_set<GroundTruthOptions>,
          .run =
              [](StageRun& run) {
                const Truth truth = read_truth(run.input("capture"));
                std::vector<Points> bodies;
                for (const GroundTruthFrame& frame : truth.frames) {
                  bodies.push_back(frame.body);
                }
                write_bodies(run, header_of(truth, truth.fixed.body.faces), "", bodies);
              }},
    Stage{.name = "template",
          .summary = "the ground-truth garments in one frame",
          .inputs = {"capture"},
          .outputs = {"template"},
          .options = option_set<GroundTruthOptions>,
          .run = run_template},
    Stage{.name = "register",
          .summary = "the ground-truth garments in every frame",
          .inputs = {"capture"},
          .outputs = {"registered"},
          .options = option_set<GroundTruthOptions>,
          .run = run_register},
};

}  // namespace
}  // namespace atelier

int main(int argc, char** argv) {
  std::string capture;
  std::string workspace;
  atelier::GroundTruthOptions options;
  CLI::App app("A workspace of a synthetic capture's ground truth");
  app.add_option("CAPTURE", capture)->required();
  app.add_option("WORKSPACE", workspace)->required();
  app.add_option("--noise", options.noise);
  app.add_option("--smooth", options.smooth);
  app.add_option("--template-frame", options.template_frame);
  app.add_option("--seed", options.seed);
  CLI11_PARSE(app, argc, argv);
  try {
    for (const atelier::Stage& stage : atelier::kTruthStages) {
      atelier::StageRequest request;
      request.input = capture;
      request.workspace = workspace;
      request.options = stage.options();
      *static_cast<atelier::GroundTruthOptions*>(request.options.values.get()) = options;
      run_stage(atelier::kTruthStages, stage, request);
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
