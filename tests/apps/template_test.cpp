// The stage `template` on a mannequin in tee and trousers: labelled scans of three frames in, one
// clean mesh for each garment out; what it refuses, and what it says where little was seen.
#if defined(ATELIER_HAS_CAPTURE_SURFACE) && defined(ATELIER_HAS_BODYMODEL)

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/label_taxonomy.h"
#include "core/garment_archive.h"
#include "core/io/file_bytes.h"
#include "core/io/mesh_file.h"
#include "core/io/mesh_obj.h"
#include "core/store/write_text.h"
#include "core/topology.h"
#include "tests/apps/dressed_workspace.h"
#include "tests/registration/mannequin.h"
#include "tests/support/child_process.h"
#include "tests/support/places.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::UnorderedElementsAre;

/// What a stage before saw, since a stage is a plain function.
struct Seen {
  std::function<bool(const Eigen::Vector3d&)> where;  ///< parts of the person that were seen
  std::function<bool(const Eigen::Vector3d&)> lost;   ///< cloth of the tee, which then flares
                                                      ///< from the waist on, that is labelled skin
  int without_scan = -1;                              ///< a frame, or all from -2 down
};
Seen seen;

/// Arms go up from frame to frame.
std::vector<Capsule> pose_of(int frame) {
  return capsules(0.6 + 0.1 * frame);
}

/// Tee over trousers over skin.
Mesh outfit_scan(int frame) {
  const std::vector<Capsule> pose = pose_of(frame);
  const double low = 0.012;
  const auto keep = [&](const Wears& wears) {
    return [&, wears](const Eigen::Vector3d& middle, int lump) {
      return wears(middle, lump) && (!seen.where || seen.where(middle));
    };
  };
  const auto is_trousers = [](const Eigen::Vector3d& m, int lump) {
    return wears_trousers(m, lump) && !wears_tee(m, lump);
  };
  const std::array<std::pair<Label, Mesh>, 3> parts = {
      {{Label::Upper, capsule_surface(pose, kGap + 0.006, low, keep(wears_tee))},
       {Label::Lower, capsule_surface(pose, kGap, low, keep(is_trousers))},
       {Label::Skin, capsule_surface(pose, 0, low, keep([&](const Eigen::Vector3d& m, int lump) {
                                       return !wears_tee(m, lump) && !wears_trousers(m, lump);
                                     }))}}};
  Mesh scan;
  for (auto [label, part] : parts) {
    if (label == Label::Upper && seen.lost) {
      for (Index v = 0; v < part.vertices.rows(); ++v) {
        const double flare = std::max(0.0, 1.25 - part.vertices(v, 1));
        part.vertices(v, 0) *= 1 + 3 * flare;
        part.vertices(v, 2) *= 1 + 3 * flare;
      }
    }
    const Index vertices = scan.vertices.rows();
    const Index faces = scan.faces.rows();
    scan.vertices.conservativeResize(vertices + part.vertices.rows(), 3);
    scan.vertices.bottomRows(part.vertices.rows()) = part.vertices;
    scan.faces.conservativeResize(faces + part.faces.rows(), 3);
    scan.faces.bottomRows(part.faces.rows()) = part.faces.array() + static_cast<int>(vertices);
    for (Index v = 0; v < part.vertices.rows(); ++v) {
      const bool lost = label == Label::Upper && seen.lost && seen.lost(part.vertices.row(v));
      scan.labels.push_back(static_cast<std::uint8_t>(lost ? Label::Skin : label));
    }
  }
  return scan;
}

/// The mannequin with a skeleton that says which lump is which limb.
BodyModel mannequin_body() {
  constexpr std::array kJoints = {0, 10, 12, 14, 15, 16, 18, 19, 20, 1, 2, 3, 5, 6, 7};
  BodyModel model;
  model.name = "mannequin";
  model.skeleton = person_skeleton();
  model.mesh = body_surface(pose_of(0));
  const Index count = model.mesh.vertices.rows();
  model.skin.joints.resize(count, 1);
  model.skin.weights = Eigen::MatrixXd::Ones(count, 1);
  for (Index v = 0; v < count; ++v) {
    model.skin.joints(v, 0) = kJoints[model.mesh.labels[static_cast<std::size_t>(v)]];
  }
  model.mesh.labels.clear();
  return model;
}

constexpr std::array kBeforeTemplate = {
    Stage{.name = "reconstruct",
          .summary = "labelled scans",
          .inputs = {"capture"},
          .outputs = {"scans"},
          .options = option_set<NoOptions>,
          .run =
              [](StageRun& run) {
                run.output_text("scans/about.txt", "three frames");
                for (int id = 0; id < 3 && seen.without_scan > -2; ++id) {
                  if (id != seen.without_scan) {
                    run.output("scans/" + frame_name(id) + ".h5", [&](const auto& file) {
                      write_mesh_archive(file, outfit_scan(id));
                    });
                  }
                }
              }},
    Stage{.name = "personalize",
          .summary = "the mannequin",
          .inputs = {"capture"},
          .outputs = {"person"},
          .options = option_set<NoOptions>,
          .run =
              [](StageRun& run) {
                run.output("person.npz", [](const auto& file) {
                  write_personal_body(file, plain_person(mannequin_body()));
                });
              }},
    Stage{.name = "body",
          .summary = "the mannequin in every frame",
          .inputs = {"capture"},
          .outputs = {"bodies"},
          .options = option_set<NoOptions>,
          .run =
              [](StageRun& run) {
                std::vector<Points> bodies;
                for (int id = 0; id < 3; ++id) {
                  bodies.push_back(body_surface(pose_of(id)).vertices);
                }
                write_meshes(run, "", mannequin_body().mesh.faces, bodies);
              }},
};

class TemplateStage : public ::testing::Test {
 protected:
  void SetUp() override {
    seen = {};
    SmallCapture small;
    small.frames = {0, 1, 2};
    write_small_capture(capture(), small);
  }

  ChildResult made(const std::vector<std::string>& more = {}) const {
    for (const Stage& stage : kBeforeTemplate) {
      StageRequest request;
      request.input = capture();
      request.workspace = workspace();
      request.options = stage.options();
      run_stage(kBeforeTemplate, stage, request);
    }
    std::vector<std::string> all{program_path(),       "template",      capture().string(),
                                 workspace().string(), "--edge_length", "0.03"};
    all.insert(all.end(), more.begin(), more.end());
    return run_child(all);
  }
  fs::path result() const { return workspace() / "template" / "current"; }
  fs::path capture() const { return root_ / "capture"; }
  fs::path workspace() const { return root_ / "work"; }
  /// A mesh of an artist's, as a file.
  std::string saved(const Mesh& mesh) const {
    const fs::path file = root_ / "artist.obj";
    write_text(file, obj_text(polygons_of(mesh)));
    return file.string();
  }

  TemporaryDirectory root_;
};

TEST_F(TemplateStage, WornGarments_GiveOneCleanMeshEach) {
  const ChildResult done = made();
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const nlohmann::json said =
      nlohmann::json::parse(read_file_text(result() / "template.json", 1 << 24));
  ASSERT_EQ(said.at("garments").size(), 2U);
  const std::map<std::string, std::vector<std::string>> openings = {
      {"upper", {"neck", "cuff left", "cuff right", "hem"}},
      {"lower", {"waist", "ankle left", "ankle right"}}};
  for (const nlohmann::json& one : said.at("garments")) {
    const std::string label = one.at("label");
    SCOPED_TRACE(label);
    const Garment garment = read_garment_archive(result() / one.at("file").get<std::string>());
    const Topology topology = topology_of(garment.mesh.faces, garment.mesh.vertices.rows());
    EXPECT_TRUE(is_manifold(manifold_defects(topology)));
    EXPECT_EQ(connected_components(topology).count, 1);
    EXPECT_EQ(boundary_loops(topology).size(), openings.at(label).size());
    EXPECT_THAT(garment.boundary_names, ::testing::UnorderedElementsAreArray(openings.at(label)));
    EXPECT_EQ(garment.attachments.size(), static_cast<std::size_t>(garment.mesh.vertices.rows()));
    EXPECT_EQ(garment.mesh.uv_faces.rows(), garment.mesh.faces.rows());
    EXPECT_EQ(read_mesh(result() / "garments" / (label + ".obj")).faces, garment.mesh.faces);
    EXPECT_NEAR(one.at("facing").at(2).get<double>(), 1, 0.01);
    EXPECT_TRUE(one.at("whole"));
    EXPECT_EQ(one.at("frames").size(), 3U);
    if (label == "upper") {
      EXPECT_NE(one.at("frame"), 0);  // arms lowest
    }
  }
}

TEST_F(TemplateStage, FrameWithoutScan_IsSkipped) {
  seen.without_scan = 2;
  const ChildResult done = made({"--labels", "upper"});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const nlohmann::json said =
      nlohmann::json::parse(read_file_text(result() / "template.json", 1 << 24));
  ASSERT_EQ(said.at("garments").size(), 1U);
  EXPECT_EQ(said.at("garments")[0].at("frame"), 1);
}

TEST_F(TemplateStage, GarmentLeavingTheView_GivesAnUnnamedOpening) {
  seen.where = [](const Eigen::Vector3d& middle) { return middle.x() > -0.1; };
  const ChildResult done = made({"--labels", "upper"});
  ASSERT_EQ(done.exit_code, 3) << done.err;  // made, but no success
  EXPECT_THAT(done.out + done.err, AllOf(HasSubstr("opening-unnamed"), HasSubstr("not-whole")));
  const nlohmann::json said =
      nlohmann::json::parse(read_file_text(result() / "template.json", 1 << 24));
  EXPECT_FALSE(said.at("garments")[0].at("whole"));
  const Garment garment = read_garment_archive(result() / "garments" / "upper.h5");
  EXPECT_THAT(garment.boundary_names, Not(::testing::Contains("cuff right")));
}

/// Labels that are told by colour may lose a garment's sides in every frame.
TEST_F(TemplateStage, GarmentWithBitesAtBothSides_IsNoSuccess) {
  seen.lost = [](const Eigen::Vector3d& at) {
    return at.y() < 1.16 && std::abs(at.x()) > 0.6 * std::abs(at.z());
  };
  const ChildResult done = made({"--labels", "upper"});
  ASSERT_EQ(done.exit_code, 3) << done.out << done.err;
  EXPECT_THAT(done.out + done.err, HasSubstr("not-whole"));
  const nlohmann::json said =
      nlohmann::json::parse(read_file_text(result() / "template.json", 1 << 24));
  EXPECT_FALSE(said.at("garments")[0].at("whole"));
}

TEST_F(TemplateStage, GarmentMostlyOutsideTheView_IsReported) {
  seen.where = [](const Eigen::Vector3d& middle) { return middle.x() > 0.12; };
  const ChildResult done = made({"--labels", "upper"});
  ASSERT_EQ(done.exit_code, 3) << done.err;
  EXPECT_THAT(done.out + done.err, HasSubstr("much-unseen"));
}

TEST_F(TemplateStage, LabelsCoveringNothing_AreRefused) {
  const ChildResult done = made({"--labels", "dress"});
  EXPECT_EQ(done.exit_code, 3);
  EXPECT_THAT(done.err, HasSubstr("dress: 0 cm2 of its label"));
}

TEST_F(TemplateStage, ImportedMeshWithLabelCoveringNothing_IsRefused) {
  const std::string file = saved(cone(1.34, 0.17, 1.0, 0.17, 0.03));
  const ChildResult done = made({"--labels", "dress", "--import", "dress=" + file});
  EXPECT_EQ(done.exit_code, 3);
  EXPECT_THAT(done.err, HasSubstr("dress: 0 cm2 of its label"));
}

TEST_F(TemplateStage, EmptyOrRepeatedGarmentLists_AreRefusedAtOnce) {
  for (const char* flag : {"--force", "--dry-run"}) {
    const ChildResult twice = made({"--labels", "upper,upper", flag});
    EXPECT_EQ(twice.exit_code, 2);
    EXPECT_THAT(twice.err, HasSubstr("--labels cannot be 'upper': it takes each garment once"));
    const ChildResult none = made({"--labels", "", flag});
    EXPECT_EQ(none.exit_code, 2);
    EXPECT_THAT(none.err, HasSubstr("--labels cannot be '': it takes auto, or upper"));
    EXPECT_EQ(made({"--labels", ",", flag}).exit_code, 2);
  }
}

TEST_F(TemplateStage, MissingMeshesOrUnwornGarments_AreRefused) {
  const ChildResult gone = made({"--dry-run", "--import", "lower=/nonexist.obj"});
  EXPECT_EQ(gone.exit_code, 3);
  EXPECT_THAT(gone.err, HasSubstr("/nonexist.obj: No such file"));
  const ChildResult work = made({"--import", "lower=/nonexist.obj"});
  EXPECT_EQ(work.exit_code, 3);
  EXPECT_THAT(work.out, Not(HasSubstr("vertices, openings")));  // before the first garment
  const std::string file = saved(cone(1.34, 0.17, 1.0, 0.17, 0.03));
  const ChildResult twice = made({"--dry-run", "--import", "upper=" + file + ",upper=" + file});
  EXPECT_EQ(twice.exit_code, 2);
  EXPECT_THAT(twice.err, HasSubstr("it takes one mesh for each garment"));
  const ChildResult other = made({"--labels", "upper", "--import", "lower=" + file});
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_THAT(other.err, HasSubstr("it takes meshes of garments that are made, such as upper"));
}

TEST_F(TemplateStage, UnreadableMeshes_AreRefusedWhilePlanning) {
  fs::create_directory(root_ / "artists");
  const auto refused = [&](const std::string& name, const std::string& content,
                           const std::string& words) {
    const std::string file = (root_ / name).string();
    std::ofstream(file) << content;
    for (const char* flag : {"--dry-run", "--force"}) {
      const ChildResult done = made({"--labels", "upper", "--import", "upper=" + file, flag});
      EXPECT_EQ(done.exit_code, 3) << name;
      EXPECT_THAT(done.err, HasSubstr(words));
    }
  };
  refused("artist.blend", "BLENDER-v300", "extension '.blend'; expected .obj, .ply, .stl, .glb");
  refused("artist", "v 0 0 0\n", "a name without an extension");
  refused("artist.ply", "#usda 1.0\n", "artist.ply");
  refused("artist.obj", "v 0 0 0\nf 1 2 3\n", "artist.obj");
  write_text(root_ / "artists" / "tee.obj", "v 0 0 0\n");
  const ChildResult folder =
      made({"--labels", "upper", "--import", "upper=" + (root_ / "artists").string(), "--dry-run"});
  EXPECT_EQ(folder.exit_code, 3);
  EXPECT_THAT(folder.err, HasSubstr("a folder; expected a mesh file"));
}

TEST_F(TemplateStage, FolderAboveACapture_IsRefused) {
  fs::create_directory(root_ / "link");
  fs::create_symlink("nowhere", root_ / "link" / "current");  // as workspaces beside have
  const TemporaryDirectory other;
  const ChildResult above = run_child(
      {program_path(), "template", root_.path().string(), (other / "work").string(), "--dry-run"});
  EXPECT_EQ(above.exit_code, 3);
  EXPECT_THAT(above.err, HasSubstr("did you mean " + capture().string() + "?"));
}

TEST_F(TemplateStage, MissingScans_AreRefused) {
  seen.without_scan = -2;
  const ChildResult done = made();
  EXPECT_EQ(done.exit_code, 3);
  EXPECT_THAT(done.err, HasSubstr("no clothing in any frame"));
}

TEST_F(TemplateStage, ImportedMesh_BecomesTheTemplate) {
  const Mesh top = cone(1.34, 0.17, 1.0, 0.17, 0.03);
  const ChildResult done = made({"--labels", "upper", "--import", "upper=" + saved(top)});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const Garment garment = read_garment_archive(result() / "garments" / "upper.h5");
  EXPECT_EQ(garment.mesh.faces, top.faces);
  EXPECT_THAT(garment.boundary_names, UnorderedElementsAre("neck", "hem"));
  const std::string other = saved(cone(1.34, 0.18, 1.0, 0.18, 0.03));
  const ChildResult again = made({"--labels", "upper", "--import", "upper=" + other, "--dry-run"});
  EXPECT_THAT(again.out, HasSubstr("input --import changed"));  // under the same name
}

TEST_F(TemplateStage, ImportedNonManifoldMesh_IsRefused) {
  Mesh top = cone(1.34, 0.17, 1.0, 0.17, 0.03);
  top.faces.conservativeResize(top.faces.rows() + 1, 3);
  top.faces.bottomRows(1) << top.faces(0, 0), top.faces(0, 1), top.faces(top.faces.rows() / 2, 2);
  const ChildResult done = made({"--import", "upper=" + saved(top)});
  EXPECT_EQ(done.exit_code, 3);
  EXPECT_THAT(done.err, AllOf(HasSubstr("artist.obj: vertex"), HasSubstr("three faces")));
}

TEST_F(TemplateStage, ImportedMeshWithoutLabel_IsRefused) {
  const std::string file = saved(cone(1.34, 0.17, 1.0, 0.17, 0.03));
  const ChildResult done = made({"--import", file});
  EXPECT_EQ(done.exit_code, 2);
  EXPECT_THAT(done.err, HasSubstr("label=FILE, where several garments are worn"));
}

}  // namespace
}  // namespace atelier::fixtures

#endif
