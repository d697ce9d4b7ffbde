// Scenes that `simulate` refuses or speaks of.
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/device.h"
#include "core/garment_archive.h"
#include "core/io/mesh_file.h"
#include "tests/apps/simulate_fixture.h"

namespace atelier {
namespace {

using fixtures::ChildResult;
using fixtures::Simulate;
using fixtures::vertices_of;
using ::testing::HasSubstr;

TEST_F(Simulate, BadFlatRestShape_IsRefused) {
  ChildResult result = on_body({"--flat_rest"});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("texture coordinates"));
  {
    std::ofstream file(scene() / "garment.obj");
    file << "v 0 0.5 0\nv 1 0.5 0\nv 0 0.5 1\nvt 0 0\nvt 0.1 0\nvt 0 0.1\nf 1/1 3/3 2/2\n";
  }
  result = on_body({"--flat_rest"});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("edges 0.1 times as long"));
}

TEST_F(Simulate, OutputContradictingTheFormat_IsRefused) {
  const auto refused = [&](const std::vector<std::string>& more, const char* words) {
    std::vector<std::string> all{"simulate", "--garment", (scene() / "garment.obj").string(),
                                 "--settle", "1"};
    all.insert(all.end(), more.begin(), more.end());
    const ChildResult result = run(all);
    EXPECT_EQ(result.exit_code, 2) << result.err;
    EXPECT_THAT(result.err, HasSubstr(words));
  };
  refused({"--out", (root_.path() / "T.ply").string()}, "ply is one file a frame");
  refused({"--out", (root_.path() / "T.h5").string(), "--format", "obj"}, "contradict");
  refused({"--out", (root_.path() / "T.glb").string()}, "a file T.h5 or T.usda");
  std::filesystem::create_directories(root_.path() / "F.h5");
  refused({"--out", (root_.path() / "F.h5").string()}, "that is a folder");
  refused({"--out", scene().string()},
          "already exists, and no flag replaces it; choose another --out, or remove it first");
  refused({"--out", out().string(), "--body", scene().string(), "--motion", "walk.bvh"},
          "a folder of meshes");
}

TEST_F(Simulate, OutputOverAnInput_IsNotWritten) {
  const std::string body = (scene() / "body.obj").string();
  for (const std::string& input : {(scene() / "garment.obj").string(), body}) {
    const std::string before = read_file_text(input, 1 << 20);
    std::filesystem::copy_file(input, root_.path() / "in.h5",
                               std::filesystem::copy_options::overwrite_existing);
    const ChildResult result =
        run({"simulate", "--garment",
             input == body ? (scene() / "garment.obj").string() : (root_.path() / "in.h5").string(),
             "--body", input == body ? (root_.path() / "in.h5").string() : body, "--out",
             (root_.path() / "in.h5").string()});
    EXPECT_EQ(result.exit_code, 2) << result.err;
    EXPECT_THAT(result.err, HasSubstr("it is an input, which would be lost"));
    EXPECT_EQ(read_file_text(root_.path() / "in.h5", 1 << 20), before);
  }
}

TEST_F(Simulate, WorkspaceFlagsWithoutWorkspace_AreRefused) {
  for (const std::vector<std::string>& flag : std::vector<std::vector<std::string>>{
           {"--dry-run"}, {"--force"}, {"--frames", "1:2"}, {"--shard", "1/2"}}) {
    const ChildResult result = on_body(flag);
    EXPECT_EQ(result.exit_code, 2) << flag[0];
    EXPECT_THAT(result.err, HasSubstr(flag[0] + " goes with INPUT and WORKSPACE"));
    EXPECT_FALSE(std::filesystem::exists(out()));
  }
}

TEST_F(Simulate, BodiesWithoutSurface_AreRefused) {
  std::ofstream(scene() / "none.obj") << "v 0 0 0\nv 1 0 0\nv 0 0 1\n";
  std::ofstream(scene() / "thin.obj") << "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n";
  for (const char* body : {"none.obj", "thin.obj"}) {
    const ChildResult result = alone({"--body", (scene() / body).string()});
    EXPECT_EQ(result.exit_code, 3) << result.out;
    EXPECT_THAT(result.err, HasSubstr(body));
    EXPECT_THAT(result.err, HasSubstr("a body with a surface"));
  }
}

TEST_F(Simulate, ImplausibleScenes_AreWarnedOf) {
  const auto said = [&](const std::vector<std::string>& more) {
    std::filesystem::remove_all(out());
    const ChildResult result = on_body(more);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.out;
  };
  EXPECT_THAT(said({"--settle", "1"}), ::testing::Not(HasSubstr("warning: ")));
  EXPECT_THAT(said({"--settle", "1", "--scale", "50"}), HasSubstr("--scale is the length"));
  EXPECT_THAT(said({"--settle", "1", "--move_x", "3"}), HasSubstr("--move-x"));
  EXPECT_THAT(said({"--settle", "1", "--move_y", "0.5"}), ::testing::Not(HasSubstr("warning: ")));
  EXPECT_THAT(said({"--settle", "1", "--move_y", "2"}), HasSubstr("far above"));
  for (const char* scale : {"1000", "0.001"}) {
    EXPECT_THAT(alone({"--settle", "1", "--scale", scale}).out,
                HasSubstr("is the unit another? --scale"));
  }
  EXPECT_THAT(said({"--settle", "1", "--scale", "0.1", "--move_y", "0.1"}),
              HasSubstr("49 of 49 vertices start deeper inside the body than"));
  // The same pyramid with its corners the other way round.
  std::ofstream(scene() / "body.obj")
      << "v 0 0.3 0\nv -0.3 0 -0.3\nv 0.3 0 -0.3\nv 0.3 0 0.3\nv -0.3 0 0.3\n"
         "f 1 2 3\nf 1 3 4\nf 1 4 5\nf 1 5 2\nf 2 4 3\nf 2 5 4\n";
  EXPECT_THAT(said({"--settle", "1"}), HasSubstr("faces are oriented inwards"));
}

TEST_F(Simulate, DryRun_RefusesWhatTheRunWouldRefuse) {
  for (const char* how : {"--dry-run", "--force"}) {
    const ChildResult result =
        run({"simulate", (scene() / "garment.obj").string(), (root_ / "fresh").string(), how});
    EXPECT_EQ(result.exit_code, 3) << result.out;
    EXPECT_THAT(result.err, HasSubstr("scene: no folder"));
    EXPECT_FALSE(std::filesystem::exists(root_ / "fresh"));
  }
}

TEST_F(Simulate, NonManifoldOrDegenerateGarment_IsRefused) {
  std::ofstream(scene() / "garment.obj", std::ios::app) << "f 1 8 20\nf 1 8 30\n";
  ChildResult result = on_body();
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("manifold"));
  std::ofstream(scene() / "garment.obj") << "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n";
  result = on_body();
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("degenerate"));
}

TEST_F(Simulate, SceneFileWithCapitals_IsNamed) {
  std::filesystem::rename(scene() / "body.obj", scene() / "Body.obj");
  const ChildResult result = stage("work");
  EXPECT_EQ(result.exit_code, 3) << result.out;
  EXPECT_THAT(result.err, HasSubstr("Body.obj: a name with capitals; expected body.obj"));
}

TEST_F(Simulate, MisspelledBody_IsRefusedWithASuggestion) {
  const ChildResult result = run({"simulate", "--garment", (scene() / "garment.obj").string(),
                                  "--body", "femal", "--out", out().string()});
  EXPECT_EQ(result.exit_code, 2) << result.out;
  EXPECT_THAT(result.err, HasSubstr("did you mean 'female'?"));
}

TEST_F(Simulate, OptionsWithoutEffect_AreRefused) {
  const auto refused = [&](const std::vector<std::string>& more, const char* words) {
    const ChildResult result = on_body(more);
    EXPECT_EQ(result.exit_code, 2) << words << "\n" << result.out;
    EXPECT_THAT(result.err, HasSubstr(words));
    EXPECT_FALSE(std::filesystem::exists(out())) << words;
  };
  refused({"--material.shear", "5000"}, "material.shear does nothing with membrane springs");
  refused({"--material.stretch_warp", "500"}, "cannot differ without a flat rest shape");
  refused({"--material", "denim", "--material.stretch_weft", "500"}, "make them equal");
  refused({"--wind", "[0, 0, 5]", "--drag", "1", "--air_density", "0"},
          "--wind does nothing with --air_density 0");
  refused({"--pin_top", "0.5"}, "every vertex of the garment is attached");
  refused({"--pin_top", "0.5", "--relax"}, "every vertex of the garment is attached");
  refused({"--relax", "--material.stretch_warp", "500"}, "or --flat-rest, and no --relax");
  refused({"--relax", "--flat_rest"}, "--flat-rest does nothing with --relax");
  refused({"--relax", "--membrane", "strain"}, "--relax finds one in space");
  refused({"--sewn", "false"}, "the garment has no seams");
  refused({"--seam_stiffness", "100"}, "seam_stiffness does nothing with sewn true");
  refused({"--rest_angles", "flat", "--relax"}, "--rest_angles does nothing with --relax true");
  refused({"--body_fps", "30"}, "--body-fps is of meshes that move");
  refused({"--fall_in", "2"}, "--fall-in leads into a motion");
  refused({"--relaxing.rounds", "3"}, "relaxing.rounds does nothing with relax false");
  refused({"--xpbd.jacobi_radius", "0.5"}, "xpbd.sweep gauss-seidel");
  refused({"--xpbd.cuda_barrier", "grid"}, "--xpbd.cuda-barrier does nothing on the CPU");
  refused({"--xpbd.cuda_blocks", "4"}, "--xpbd.cuda-blocks does nothing on the CPU");
  refused({"--self_contact", "false", "--self_thickness", "0.002"},
          "--self_thickness does nothing with --self_contact false");
  refused({"--grid", "--format", "ply"}, "leave --format out");
  refused({"--grid", "--material.bending", "0"}, "--material.bending 0 has none");
  refused({"--grid", "--intersection_interval", "2"}, "does nothing with --grid");
  refused({"--air_density", "2"}, "--drag or --lift");
  for (const char* option : {"--friction", "--thickness", "--contact_reach"}) {
    const ChildResult alone_with = alone({option, "0.03"});
    EXPECT_EQ(alone_with.exit_code, 2) << option;
    EXPECT_THAT(alone_with.err, HasSubstr("are of contact with a body"));
  }
  const ChildResult hanging = alone({"--relax"});
  EXPECT_EQ(hanging.exit_code, 2) << hanging.out;
  EXPECT_THAT(hanging.err, HasSubstr("without a body it hangs on nothing"));
  // The same with a workspace.
  EXPECT_EQ(stage("work", {"--fall_in", "2"}).exit_code, 2);
  EXPECT_EQ(stage("work", {"--xpbd.jacobi_radius", "0.5"}).exit_code, 2);
  // What does something is taken.
  EXPECT_EQ(on_body({"--shear", "cross", "--material.shear", "50", "--settle", "1"}).exit_code, 0);
}

TEST_F(Simulate, BodyInMillimetres_IsWarnedOf) {
  const auto scaled = [&](const char* name, double factor) {
    std::ofstream file(root_.path() / name);
    for (const Eigen::Vector3d& v : vertices_of(scene() / "body.obj")) {
      file << "v " << factor * v.x() << " " << factor * v.y() << " " << factor * v.z() << "\n";
    }
    file << "f 1 3 2\nf 1 4 3\nf 1 5 4\nf 1 2 5\nf 2 3 4\nf 2 4 5\n";
    return (root_.path() / name).string();
  };
  // Garment and body alike, so that nothing else looks odd.
  ChildResult result =
      alone({"--body", scaled("large.obj", 1000), "--scale", "1000", "--settle", "1"});
  EXPECT_THAT(result.out, HasSubstr("warning: the body is 300 m high"));
  EXPECT_THAT(result.out, HasSubstr("the garment is 424 m across, as large as its body: files in "
                                    "millimetres?"));
  result = alone({"--body", scaled("small.obj", 0.01), "--scale", "0.01", "--settle", "1"});
  EXPECT_THAT(result.out, HasSubstr("warning: the body is 0.003 m high"));
}

// Garment and body are no files at all: nothing of them is looked at before.
TEST_F(Simulate, ConflictingOptions_AreRefusedBeforeReading) {
  const auto refused = [&](const std::vector<std::string>& more, const char* words) {
    std::vector<std::string> all{"simulate", "--garment", (root_.path() / "no.obj").string(),
                                 "--out", out().string()};
    all.insert(all.end(), more.begin(), more.end());
    const ChildResult result = run(all);
    EXPECT_EQ(result.exit_code, 2) << words << "\n" << result.err;
    EXPECT_THAT(result.err, HasSubstr(words));
  };
  const std::string body = (root_.path() / "no.h5").string();
  refused({"--settle", "0"}, "there are no frames to simulate");
  refused({"--body", body, "--relax", "--membrane", "strain"}, "leave one out");
  refused({"--body", body, "--relax", "--flat_rest"}, "leave one out");
  refused({"--relax"}, "give --body");
  refused({"--pin_top", "0.1"}, "give --body");
  refused({"--motion", "walk.bvh"}, "--motion takes a --body");
  refused({"--wind", "[0, 5]", "--drag", "1"}, "three numbers");
  refused({"--material.stretch_warp", "0"}, "nothing would hold the cloth together");
  refused({"--xpbd.vectors", "avx2", "--xpbd.precision", "double"}, "precision \"float\" alone");
  for (const char* name : {"--body", "--motion", "--format", "--material"}) {
    refused({name, ""}, "cannot be '': leave it out");
  }
  if (!cuda_available()) {
    const ChildResult result = run({"simulate", "--garment", (root_.path() / "no.obj").string(),
                                    "--out", out().string(), "--device", "cuda"});
    EXPECT_EQ(result.exit_code, 5) << result.err;
  }
}

// The place is taken, too: what can never be is said before what is in the way.
TEST_F(Simulate, ConflictingOptions_AreRefusedBeforeATakenPlace) {
  const auto refused = [&](const std::vector<std::string>& more, const char* words) {
    std::vector<std::string> all{"simulate", "--garment", (scene() / "garment.obj").string(),
                                 "--out", scene().string()};
    all.insert(all.end(), more.begin(), more.end());
    const ChildResult result = run(all);
    EXPECT_EQ(result.exit_code, 2) << words << "\n" << result.err;
    EXPECT_THAT(result.err, HasSubstr(words));
  };
  refused({"--relax"}, "give --body");
  refused({"--motion", "walk.bvh"}, "--motion takes a --body");
  refused({"--wind", "[0, 5]", "--drag", "1"}, "three numbers");
  refused({"--grid", "--format", "ply"}, "leave --format out");
  refused({}, "already exists");
}

TEST_F(Simulate, LengthEndingBeforeTheBodyMoves_IsWarnedOf) {
  std::filesystem::create_directories(scene() / "moves");
  write_body(scene() / "moves" / "b_0.obj", 0);
  write_body(scene() / "moves" / "b_1.obj", 0.01);
  const auto said = [&](const std::string& body, const char* settle, const char* length) {
    const ChildResult result =
        alone({"--body", body, "--settle", settle, "--length", length, "--format", "ply"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.out;
  };
  const std::string moving = (scene() / "moves").string();
  const std::string still = (scene() / "body.obj").string();
  EXPECT_THAT(said(moving, "3", "2"),
              HasSubstr("warning: --length 2 ends before --settle 3 is over, so that the body does "
                        "not move"));
  EXPECT_THAT(said(moving, "2", "2"), HasSubstr("the body does not move"));
  EXPECT_THAT(said(moving, "2", "3"), ::testing::Not(HasSubstr("warning: ")));
  EXPECT_THAT(said(still, "3", "2"),
              HasSubstr("warning: --length 2 ends before --settle 3 is over"));
  EXPECT_THAT(said(still, "2", "2"), ::testing::Not(HasSubstr("warning: ")));
  EXPECT_THAT(said(still, "60", "2"), ::testing::Not(HasSubstr("warning: "))) << "as it comes";
}

TEST_F(Simulate, UnloadedGarmentHangingElsewhere_IsWarnedOf) {
  write_hanging(scene() / "garment.obj");
  const std::vector<std::string> few{"--relax", "--relaxing.rounds",    "1",   "--pin_top",
                                     "0.01",    "--relaxing.tolerance", "1e-9"};
  ChildResult result = on_body(few);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("warning: unloaded shape: after 2 s it hangs"));
  EXPECT_THAT(result.out, HasSubstr("above the tolerance: more --relaxing.rounds"));
  result = on_body({"--relax", "--pin_top", "0.01"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("unloaded shape: after 2 s it hangs"));
  EXPECT_THAT(result.out, ::testing::Not(HasSubstr("warning: without")));
  // In a workspace the manifest keeps it.
  ASSERT_EQ(stage("work", few).exit_code, 0);
  EXPECT_THAT(nlohmann::json::parse(bytes("work", "manifest.json"))["warnings"].dump(),
              HasSubstr("\"unloaded shape"));
}

TEST_F(Simulate, WarningAmongSeveralGarments_NamesTheOneMeant) {
  write_cloth(scene() / "small.obj", 6, 0.05);
  write_cloth(scene() / "large.obj", 6, 50);
  write_cloth(scene() / "other.obj", 6, 60);
  const auto worn = [&](const std::string& one, const std::string& other,
                        const std::vector<std::string>& more = {}) {
    std::filesystem::remove_all(out());
    std::vector<std::string> all{"simulate",
                                 "--garment",
                                 (scene() / one).string() + "+" + (scene() / other).string(),
                                 "--body",
                                 (scene() / "body.obj").string(),
                                 "--out",
                                 out().string(),
                                 "--settle",
                                 "1",
                                 "--format",
                                 "ply",
                                 "--no-pictures"};
    all.insert(all.end(), more.begin(), more.end());
    return run(all);
  };
  ChildResult result = worn("small.obj", "large.obj");
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("as edges of 56.2 m of large need"));
  EXPECT_THAT(result.out, HasSubstr("warning: large: the garment is 424 m across"));
  EXPECT_THAT(result.out, ::testing::Not(HasSubstr("small: the garment")));
  result = worn("large.obj", "other.obj", {"--move_x", "900"});
  const std::string beside = "warning: the garment lies beside, below";
  EXPECT_NE(result.out.find(beside), std::string::npos) << result.out;
  EXPECT_EQ(result.out.find(beside), result.out.rfind(beside)) << "of both alike: once";
  result = worn("small.obj", "other.obj", {"--pin_top", "0.5"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("small: every vertex of the garment is attached"));
  result = worn("small.obj", "other.obj", {"--sewn", "false"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("small: --sewn false does nothing"));
  // Scale and way are those of all.
  ASSERT_EQ(worn("small.obj", "large.obj", {"--scale", "2", "--move_x", "7"}).exit_code, 0);
  EXPECT_NEAR(read_mesh(out() / "small_000001.ply").vertices.col(0).mean(), 7, 0.01);
  EXPECT_NEAR(read_mesh(out() / "large_000001.ply").vertices.col(0).maxCoeff(), 7 + 300, 0.01);
}

// Of two garments one has seams: those left open are its own.
TEST_F(Simulate, SeamsOfOneGarment_MayBeLeftOpen) {
  Garment sewn;
  sewn.mesh = read_mesh(scene() / "garment.obj");
  sewn.seams.push_back({"side", {0, 7}, {6, 13}});
  write_garment_archive(root_.path() / "sewn.h5", sewn);
  const ChildResult result =
      run({"simulate", "--garment",
           (root_.path() / "sewn.h5").string() + "+" + (scene() / "garment.obj").string(), "--out",
           out().string(), "--settle", "1", "--format", "ply", "--no-pictures", "--sewn", "false"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
}

TEST_F(Simulate, DegenerateTriangle_IsReportedWithItsAngle) {
  std::ofstream(scene() / "garment.obj") << "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n";
  EXPECT_THAT(on_body().err, HasSubstr("corners above 0.5 degrees"));
}

TEST_F(Simulate, SingleGarmentOptionsForSeveral_AreRefused) {
  const std::string one = (scene() / "garment.obj").string();
  const auto refused = [&](const std::string& garments, const std::vector<std::string>& more,
                           int code, const char* words) {
    std::vector<std::string> all{"simulate", "--garment", garments, "--settle", "1"};
    all.insert(all.end(), more.begin(), more.end());
    const ChildResult result = run(all);
    EXPECT_EQ(result.exit_code, code) << words << "\n" << result.err;
    EXPECT_THAT(result.err, HasSubstr(words));
  };
  const std::string body = (scene() / "body.obj").string();
  refused(one + "+" + one, {"--out", (root_.path() / "T.h5").string()}, 2,
          "name a folder for several");
  refused(one + "+" + one, {"--out", out().string(), "--body", body, "--relax"}, 2,
          "--relax takes one garment");
  refused(one + "+", {"--out", out().string()}, 2, "a garment without a name");
  refused(one + "+none.obj", {"--out", out().string()}, 3, "none.obj");
}

TEST_F(Simulate, GarmentAttachedToOtherBody_IsRefusedOrWarnedOf) {
  Garment garment;
  garment.mesh = read_mesh(scene() / "garment.obj");
  garment.attachments.push_back({3, 40, {0.2, 0.3, 0.5}, 0.01});
  const std::string worn = (root_.path() / "worn.h5").string();
  const auto simulated = [&] {
    write_garment_archive(worn, garment);
    std::filesystem::remove_all(out());
    return run({"simulate", "--garment", worn, "--body", (scene() / "body.obj").string(), "--out",
                out().string(), "--settle", "1", "--no-pictures"});
  };
  ChildResult result = simulated();
  EXPECT_EQ(result.exit_code, 3) << result.out;
  EXPECT_THAT(result.err, HasSubstr("worn.h5: attachments: vertex 3 on triangle 40 of a body, and "
                                    "this one has 6"));
  garment.attachments[0].triangle = 2;
  result = simulated();
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("they were attached to another body"));
}

// A larger garment is larger at rest, too, so that nothing draws it together.
TEST_F(Simulate, ScaledArchive_ScalesItsFlatShape) {
  Garment garment;
  garment.mesh = read_mesh(scene() / "garment.obj");
  garment.rest.resize(garment.mesh.vertices.rows(), 2);
  garment.rest << garment.mesh.vertices.col(0), garment.mesh.vertices.col(2);
  garment.rest_faces = garment.mesh.faces;
  write_garment_archive(root_.path() / "flat.h5", garment);
  const ChildResult result =
      run({"simulate", "--garment", (root_.path() / "flat.h5").string(), "--scale", "2", "--out",
           out().string(), "--settle", "1", "--no-pictures", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const nlohmann::json json = nlohmann::json::parse(result.out.substr(result.out.find("\n{") + 1));
  EXPECT_LT(json["strain"]["max"].get<double>(), 1e-4);
}

TEST_F(Simulate, Messages_NameARemedy) {
  std::ofstream(root_.path() / "dress.json") << "{}";
  ChildResult result = run(
      {"simulate", "--garment", (root_.path() / "dress.json").string(), "--out", out().string()});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("atelier drape --garment dress.json --out FOLDER"));
  result = on_body({"--material.density", "-0.5"});
  EXPECT_THAT(result.err, HasSubstr("it takes a number in ["));
  std::ofstream(root_.path() / "walk.bvh") << "HIERARCHY\n";
  result = on_body({"--motion", (root_.path() / "walk.bvh").string()});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("a mesh without a rig cannot be posed"));
}

TEST_F(Simulate, BadMaterialsAndOptions_AreRefused) {
  const auto refused = [&](const std::vector<std::string>& more, const char* words, int code = 2) {
    const ChildResult result = on_body(more);
    EXPECT_EQ(result.exit_code, code) << words << "\n" << result.err;
    EXPECT_THAT(result.err, HasSubstr(words));
  };
  refused({"--material.density", "0"}, "density");
  refused({"--material.stretch_warp", "0", "--material.stretch_weft", "0"},
          "nothing would hold the cloth together");
  refused({"--material.stretch_warp", "-5"}, "stretch_warp");
  refused({"--material.stretch_warp", "-0.5"}, "material.stretch_warp cannot be -0.5");
  refused({"--material", "cheese"}, "cheese");
  refused({"--material", "silk", "--material.name", "denim"}, "choose one fabric");
  refused({"--xpbd.vectors", "avx2", "--xpbd.precision", "double"}, "precision \"float\" alone");
  refused({"--format", "fbx"}, "fbx");
  refused({"--wind", "[1, 2]"}, "three numbers");
  refused({"--wind", "[nan, 0, 0]"}, "wind");
  refused({"--wind", "[0, 0, 5]"}, "--drag");
  refused({"--membrane", "strain"}, "rest shape", 3);
  refused({"--shear", "sideways"}, "sideways");
  refused({"--max_hinge_weight", "1"}, "max_hinge_weight");
  refused({"--membrane", "strain", "--shear", "cross"}, "have their shear already", 3);
  refused({"--tether_stretch", "1.1"}, "no fixed vertex", 3);
  refused({"--tether_stretch", "0.5"}, "0 for no tethers", 3);
  const ChildResult free = alone({"--pin_top", "0.1", "--settle", "1"});
  EXPECT_EQ(free.exit_code, 2);
  EXPECT_THAT(free.err, HasSubstr("give --body"));
  EXPECT_EQ(run({"simulate"}).exit_code, 2);
  EXPECT_EQ(alone({"--motion", "walk.bvh"}).exit_code, 2);
  if (!cuda_available()) {
    refused({"--device", "cuda"}, "; use --device cpu", 5);
  }
  std::filesystem::remove(scene() / "garment.obj");
  EXPECT_EQ(stage("none").exit_code, 3);
}

}  // namespace
}  // namespace atelier
