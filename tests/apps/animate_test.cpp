#if defined(ATELIER_HAS_CAPTURE_SURFACE) && defined(ATELIER_HAS_BODYMODEL)

#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/formats/gltf_body.h"
#include "bodymodel/formats/motion_bvh.h"
#include "bodymodel/formats/motion_file.h"
#include "bodymodel/formats/motion_trc.h"
#include "core/archive.h"
#include "core/io/file_bytes.h"
#include "core/io/image_file.h"
#include "core/io/mesh_file.h"
#include "core/io/mesh_gltf.h"
#include "core/sequence_archive.h"
#include "simulation/files/material_file.h"
#include "tests/apps/animate_fixture.h"
#include "tests/support/outside_judge.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

/// What a sequence in one file holds.
struct MeshSequenceShape {
  std::int64_t frames = 0;
  std::int64_t vertices = 0;
};

MeshSequenceShape shape_of(const fs::path& file) {
  const Archive archive = read_archive(file, "atelier.mesh_sequence", 1);
  const std::vector<std::int64_t>& shape = archive.datasets.at("vertices").shape;
  return {shape.at(0), shape.at(1)};
}

TEST_F(Animate, CaptureMotion_StartsFromTheRegisteredGarment) {
  write_dressed_workspace(capture(), workspace());
  const ChildResult done = animate();
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out + done.err, HasSubstr("no material was fitted"));
  const Sequence body = open_sequence(result() / "body");
  const Sequence skirt = open_sequence(result() / "garments" / "lower");
  EXPECT_THAT(body.frame_ids, ::testing::ElementsAre(0, 1, 2));
  for (Index i = 0; i < 3; ++i) {
    const auto k = static_cast<std::size_t>(i);
    EXPECT_LT((frame(body, i).vertices - walking_trunk()[k]).cwiseAbs().maxCoeff(), 1e-6);
    // It rides along by its waist and hangs down.
    const Points x = frame(skirt, i).vertices;
    EXPECT_LT((x - walking_skirt()[k]).rowwise().norm().head(20).maxCoeff(), 0.01) << i;
    EXPECT_LT((x - walking_skirt()[k]).rowwise().norm().maxCoeff(), 0.1) << i;
  }
  EXPECT_LT((frame(skirt, 0).vertices - walking_skirt()[0]).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_EQ(metrics()["frames"], 3);
  EXPECT_LT(metrics()["penetration_depth"], 1e-3);
  EXPECT_EQ(metrics()["self_intersections"], 0);
  EXPECT_LT(metrics()["registered_distance"], 0.05);
  const MotionClip played = read_motion_file(result() / "motion.npz");
  ASSERT_EQ(played.motion.poses.size(), 3u);
  EXPECT_NEAR(played.motion.poses[2].root_translation.z(), 0.04, 1e-9);
  EXPECT_THAT(animate().out, HasSubstr("is done already"));
}

TEST_F(Animate, SkirtThatNothingHolds_FallsAndIsSaidToHaveLeftItsPlace) {
  write_dressed_workspace(capture(), workspace());
  const ChildResult held = animate();
  ASSERT_EQ(held.exit_code, 0) << held.err;
  EXPECT_LT(metrics()["held_distance"], 0.01);
  EXPECT_THAT(held.err, Not(HasSubstr("left its place")));
  const ChildResult fell = animate({"--holding", "none"});
  ASSERT_EQ(fell.exit_code, 0) << fell.err;
  EXPECT_GT(metrics()["held_distance"], 0.1);
  EXPECT_THAT(fell.out + fell.err, HasSubstr("lower waist: "));
  EXPECT_THAT(fell.out + fell.err, HasSubstr("left its place"));
}

TEST_F(Animate, SkirtOfAnotherSolver_StaysHeldToo) {
  write_dressed_workspace(capture(), workspace());
  const std::vector<std::string> other = {"--pictures", "false", "--cloth.solver",
                                          "projective-friction"};
  ASSERT_EQ(stage("animate", other).exit_code, 0);
  EXPECT_LT(metrics()["held_distance"], 0.01);
  EXPECT_LT(metrics()["penetration_depth"], 1e-3);
  EXPECT_LT(metrics()["strain_p99"], 0.15);
  const Sequence skirt = open_sequence(result() / "garments" / "lower");
  for (Index i = 0; i < 3; ++i) {
    const Points x = frame(skirt, i).vertices;
    EXPECT_LT((x - walking_skirt()[static_cast<std::size_t>(i)]).rowwise().norm().mean(), 0.05);
  }
  const ChildResult both = stage("animate", with_usual({"--cloth.xpbd.substeps", "6"}, other));
  EXPECT_EQ(both.exit_code, 2);
  EXPECT_THAT(both.err, HasSubstr("does nothing with --cloth.solver projective-friction"));
}

TEST_F(Animate, MaterialOfAnotherSolver_IsFoundWithTheSkirtHeld) {
  write_dressed_workspace(capture(), workspace());
  const auto distance = [&](const char* solver) {
    const ChildResult fit =
        stage("material", {"--solver", solver, std::string("--") + solver + ".substeps", "20",
                           "--search.coarse", "2", "--search.fine", "0", "--edge-length", "0.06"});
    EXPECT_EQ(fit.exit_code, 0) << fit.err;
    EXPECT_EQ(metrics("material")["trials"], 4);
    return metrics("material")["distance"].get<double>();
  };
  const double first = distance("xpbd");
  const double other = distance("projective-friction");
  EXPECT_LT(other, 1.2 * first);
  EXPECT_LT(other, 0.05) << "a skirt that fell is 10 cm off";
}

TEST_F(Animate, MotionFile_IsPlayedAtItsRate) {
  write_dressed_workspace(capture(), workspace());
  const fs::path file = motion(person_clip());
  ASSERT_EQ(animate({"--motion", file.string(), "--fps", "15"}).exit_code, 0);
  EXPECT_EQ(metrics()["frames"], 3);  // 4/30 s
  EXPECT_FALSE(metrics().contains("registered_distance"));
  const MotionClip played = read_motion_file(result() / "motion.npz");
  EXPECT_EQ(played.motion.fps, 15);
  // Another content of the same file is another result.
  MotionClip longer = person_clip();
  for (int i = 5; i < 9; ++i) {
    longer.motion.poses.push_back(longer.motion.poses.back());
    longer.motion.frame_ids.push_back(i);
  }
  motion(longer);
  ASSERT_EQ(animate({"--motion", file.string(), "--fps", "15"}).exit_code, 0);
  EXPECT_EQ(metrics()["frames"], 5);
}

TEST_F(Animate, CaptureCamera_RendersImagesWithAlpha) {
  write_dressed_workspace(capture(), workspace());
  const ChildResult done =
      stage("animate", {"--camera", "01", "--background", "transparent", "--samples", "1",
                        "--seconds", "0.09", "--cloth.xpbd.substeps", "6"});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const ImageHeader picture = read_image_header(result() / "pictures" / "000001.png");
  EXPECT_EQ(picture.width, 64);
  EXPECT_EQ(picture.height, 80);
  EXPECT_EQ(picture.channels, 4);
  EXPECT_TRUE(fs::exists(result() / "strip.png"));
  EXPECT_TRUE(fs::exists(result() / "animation.mp4"));
}

TEST_F(Animate, ForeignCloth_IsTakenUnchanged) {
  write_dressed_workspace(capture(), workspace());
  const fs::path cloth = workspace() / "register" / "current" / "registered" / "lower";
  ASSERT_EQ(animate({"--cloth-sequence", cloth.string()}).exit_code, 0);
  const Sequence skirt = open_sequence(result() / "garments" / "lower");
  for (Index i = 0; i < 3; ++i) {
    EXPECT_LT((frame(skirt, i).vertices - walking_skirt()[static_cast<std::size_t>(i)])
                  .cwiseAbs()
                  .maxCoeff(),
              1e-6);
  }
  EXPECT_FALSE(metrics().contains("seconds_a_frame"));
}

TEST_F(Animate, FittedOrNamedMaterial_IsUsed) {
  write_dressed_workspace(capture(), workspace());
  const ChildResult fit =
      stage("material", {"--search.coarse", "2", "--search.fine", "1", "--edge-length", "0.06"});
  ASSERT_EQ(fit.exit_code, 0) << fit.err;
  EXPECT_THAT(fit.out + fit.err, HasSubstr("lower: stretching"));
  EXPECT_EQ(metrics("material")["trials"], 5);
  EXPECT_EQ(metrics("material")["fitted"], 1);
  EXPECT_TRUE(fs::exists(workspace() / "material" / "current" / "grid.png"));
  const ChildResult done = animate();
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out + done.err, ::testing::Not(HasSubstr("no material was fitted")));
  // Three frames of a stiff tube say little: what was found is no edge of what was tried, but as
  // cloth is, and the range says how much is open.
  const nlohmann::json lower = nlohmann::json::parse(read_file_text(
      workspace() / "material" / "current" / "material.json", 1 << 20))["garments"]["lower"];
  for (const auto& [tried, found] :
       {std::pair{"stretch", "stretch_warp"}, {"bending", "bending"}}) {
    double low = 1e9;
    double high = 0;
    for (const nlohmann::json& trial : lower["trials"]) {
      low = std::min(low, trial[tried].get<double>());
      high = std::max(high, trial[tried].get<double>());
    }
    const double best = lower["material"][found].get<double>();
    EXPECT_GT(best, low);
    EXPECT_LT(best, high);
    EXPECT_LT(lower["credible_low"][tried].get<double>(), best);
    EXPECT_GT(lower["credible_high"][tried].get<double>(), best);
    const nlohmann::json& tenth = lower[std::string(tried) + "_within_tenth"];
    const nlohmann::json& range = lower[std::string(tried) + "_range"];  // within a fifth
    EXPECT_GE(tenth["low"].get<double>(), range["low"].get<double>());
    EXPECT_LE(tenth["high"].get<double>(), range["high"].get<double>());
  }
  ASSERT_EQ(stage("material", {"--material.name", "denim"}).exit_code, 0);
  const nlohmann::json json = nlohmann::json::parse(
      read_file_text(workspace() / "material" / "current" / "material.json", 1 << 20));
  EXPECT_NEAR(json["garments"]["lower"]["material"]["density"], 0.324, 1e-9);
  EXPECT_EQ(metrics("material")["fitted"], 0);
}

TEST(MaterialRange, Range_SpansTrialsWithinAShareOfTheBest) {
  const std::vector<StiffnessTrial> trials = {{{100, 1e-6}, 0.0105},  {{1000, 1e-6}, 0.0108},
                                              {{10000, 1e-6}, 0.01},  {{100, 1e-4}, 0.0111},
                                              {{1000, 1e-4}, 0.0115}, {{10000, 1e-4}, 0.02}};
  EXPECT_EQ(nearest_trial(trials).stiffness.stretch, 10000);
  EXPECT_EQ(range_text(range_within(trials, 0.06, &Stiffness::stretch)),
            "100 or less to 10000 or more");
  EXPECT_EQ(range_text(range_within(trials, 0, &Stiffness::stretch)), "10000 to 10000 or more");
  EXPECT_EQ(range_text(range_within(trials, 0.1, &Stiffness::bending)), "1e-06 or less to 1e-06");
  EXPECT_EQ(range_text(range_within(trials, 0.2, &Stiffness::bending)),
            "1e-06 or less to 0.0001 or more");
  EXPECT_EQ(range_within({}, 0.1, &Stiffness::stretch).high, 0);
}

TEST_F(Animate, Exports_OpenWithTheSameContent) {
  write_dressed_workspace(capture(), workspace());
  ASSERT_EQ(animate().exit_code, 0);
  const fs::path out = root_ / "out";
  const ChildResult done = run(
      {"export", workspace().string(), out.string(), "--format", "h5", "--cameras", "easymocap"});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  // The avatar: a body with a skin that its joints move, and cloth as morph targets.
  const GltfScene avatar = read_gltf(out / "animate" / "avatar.glb");
  ASSERT_EQ(avatar.meshes.size(), 2u);
  EXPECT_EQ(avatar.skins.size(), 1u);
  EXPECT_EQ(avatar.meshes[0].primitives[0].material, "skin");
  EXPECT_EQ(avatar.meshes[1].primitives[0].material, "lower");
  EXPECT_EQ(avatar.meshes[1].primitives[0].targets.size(), 2u) << "beside the first frame";
  ASSERT_EQ(avatar.animations.size(), 1u);
  const auto last = [&](GltfPath path) {
    for (const GltfChannel& channel : avatar.animations[0].channels) {
      if (channel.path == path) {
        return channel.times.back();
      }
    }
    return -1.0;
  };
  EXPECT_NEAR(last(GltfPath::Weights), 2.0 / 12, 1e-6);
  EXPECT_NEAR(last(GltfPath::Rotation), 2.0 / 12, 1e-6);
  const GltfBody body = read_gltf_body(out / "animate" / "avatar.glb");
  EXPECT_EQ(vertex_count(body.model), vertex_count(trunk_body()));
  // Joints of both motions, read back from BVH.
  for (const fs::path& bvh :
       {out / "animate" / "motion.bvh", out / "track" / "tracked" / "clothed.bvh"}) {
    const MotionClip clip = read_motion_file(bvh);
    ASSERT_EQ(clip.motion.poses.size(), 3u) << bvh;
    for (std::size_t i = 0; i < 3; ++i) {
      const Points joints = forward_kinematics(clip.skeleton, clip.motion.poses[i]).positions;
      EXPECT_LT((joints - short_walk().joints[i]).cwiseAbs().maxCoeff(), 1e-4) << bvh << i;
    }
    // And as markers.
    const MarkerClip markers = read_trc(fs::path(bvh).replace_extension(".trc"));
    ASSERT_EQ(markers.positions.size(), 3u) << bvh;
    EXPECT_EQ(markers.markers.size(), clip.skeleton.names.size());
    EXPECT_EQ(markers.fps, clip.motion.fps);
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_LT((markers.positions[i] - short_walk().joints[i]).cwiseAbs().maxCoeff(), 1e-6);
    }
  }
  const MeshSequenceShape skirt = shape_of(out / "animate" / "garments" / "lower.h5");
  EXPECT_EQ(skirt.frames, 3);
  EXPECT_EQ(skirt.vertices, tube_skirt().mesh.vertices.rows());
  EXPECT_TRUE(fs::exists(out / "template" / "garments" / "lower.h5"));
  EXPECT_TRUE(fs::exists(out / "cameras" / "clothed" / "intri.yml"));
  // As text with time samples.
  ASSERT_EQ(run({"export", workspace().string(), (root_ / "usd").string(), "--format", "usda",
                 "--stage", "animate"})
                .exit_code,
            0);
  EXPECT_THAT(read_file_text(root_ / "usd" / "animate" / "garments" / "lower.usda", 1 << 20),
              HasSubstr("points.timeSamples"));
  EXPECT_THAT(read_file_text(root_ / "usd" / "animate" / "avatar.usda", 1 << 24),
              AllOf(HasSubstr("def Mesh \"body\""), HasSubstr("def Mesh \"lower\"")));
}

std::vector<double> box_of(const Points& points) {
  const Eigen::RowVector3d low = points.colwise().minCoeff();
  const Eigen::RowVector3d high = points.colwise().maxCoeff();
  return {low[0], low[1], low[2], high[0], high[1], high[2]};
}

void expect_box(const std::vector<double>& found, const Points& points) {
  const std::vector<double> box = box_of(points);
  ASSERT_EQ(found.size(), box.size());
  for (std::size_t k = 0; k < box.size(); ++k) {
    EXPECT_NEAR(found[k], box[k], 1e-5) << k;
  }
}

TEST_F(Animate, AvatarAtRest_IsTheFirstFrameOfBodyAndGarments) {
  write_dressed_workspace(capture(), workspace());
  ASSERT_EQ(animate().exit_code, 0);
  const fs::path out = root_ / "out";
  ASSERT_EQ(run({"export", workspace().string(), out.string(), "--stage", "animate"}).exit_code, 0);
  const fs::path file = out / "animate" / "avatar.glb";
  const std::map<std::string, Sequence> shown = {
      {"body", open_sequence(result() / "body")},
      {"lower", open_sequence(result() / "garments" / "lower")}};
  const Points rest = rest_mesh(read_gltf(file)).vertices;
  Points first(0, 3);
  for (const auto& [name, sequence] : shown) {
    const Points there = frame(sequence, 0).vertices;
    first.conservativeResize(first.rows() + there.rows(), 3);
    first.bottomRows(there.rows()) = there;
  }
  expect_box(box_of(rest), first);
  const GltfScene scene = read_gltf(file);
  for (const GltfNode& node : scene.nodes) {  // some programs count what a skin passes over
    if (node.skin >= 0) {
      EXPECT_TRUE(parent_from_node(node).isIdentity(0)) << node.name;
      EXPECT_LT(node.parent, 0) << node.name;
    }
  }
  EXPECT_THAT(read_file_text(file, 1 << 26),
              AllOf(HasSubstr("\"copyright\":\"Consent: "), HasSubstr("\"consent\":")));
  ATELIER_NEEDS_JUDGE("gltf-validator");
  const Judgement valid = judged("gltf_validator.mjs", {file.string()});
  EXPECT_EQ(valid.at("errors")[0], 0) << ::testing::PrintToString(valid);
  EXPECT_EQ(valid.at("warnings")[0], 0) << ::testing::PrintToString(valid);
  ATELIER_NEEDS_JUDGE("three");
  const Judgement three = judged("three.mjs", {"gltf", file.string(), "0", "0.16666667"});
  for (const auto& [name, sequence] : shown) {
    EXPECT_EQ(three.at("mesh:" + name)[0], 0) << "no metal";
    EXPECT_EQ(three.at("mesh:" + name)[1], 2) << "both sides";
    EXPECT_EQ(three.at("mesh:" + name)[5], name == "body" ? 4 : 0) << "influences";
    expect_box(three.at(name + "@rest"), frame(sequence, 0).vertices);
    expect_box(three.at(name + "@0"), frame(sequence, 0).vertices);
    expect_box(three.at(name + "@0.16666667"), frame(sequence, 2).vertices);
  }
}

TEST_F(Animate, Run_ExportsTheAvatarAndRemakesADamagedOne) {
  write_dressed_workspace(capture(), workspace());
  const std::vector<std::string> command = {
      "run",  capture().string(), workspace().string(), "--from", "animate",
      "--to", "animate",          "--animate.pictures", "false",  "--animate.cloth.xpbd.substeps",
      "6"};
  const ChildResult done = run(command);
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out, HasSubstr("export is done: "));
  const fs::path avatar = workspace() / "export" / "avatar.glb";
  const std::string sound = read_file_text(avatar, 1 << 26);
  EXPECT_EQ(read_gltf(avatar).meshes.size(), 2u);
  EXPECT_EQ(read_motion_file(workspace() / "export" / "motion.bvh").motion.poses.size(), 3u);
  fs::resize_file(avatar, 100);
  ASSERT_EQ(run(command).exit_code, 0);
  EXPECT_EQ(read_file_text(avatar, 1 << 26), sound);
}

TEST_F(Animate, ExportToATakenPlace_IsRefusedBeforeAnyWork) {
  write_dressed_workspace(capture(), workspace());
  for (const char* taken : {"register", "cameras"}) {
    const fs::path out = root_ / taken;
    fs::create_directories(out / taken);
    const ChildResult refused =
        run({"export", workspace().string(), out.string(), "--cameras", "colmap"});
    EXPECT_EQ(refused.exit_code, 2) << refused.out;
    EXPECT_THAT(refused.err, HasSubstr("already exists"));
    EXPECT_EQ(refused.out, "");
    EXPECT_TRUE(fs::exists(out / taken));
    EXPECT_FALSE(fs::exists(out / "personalize"));
  }
}

TEST_F(Animate, CamerasOfAMissingCapture_AreRefused) {
  write_dressed_workspace(capture(), workspace(), "track");
  fs::remove_all(capture());
  const ChildResult refused =
      run({"export", workspace().string(), (root_ / "out").string(), "--cameras", "colmap"});
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_THAT(refused.err, HasSubstr("no capture at the path"));
  EXPECT_EQ(refused.out, "");
  EXPECT_FALSE(fs::exists(root_ / "out"));
}

TEST_F(Animate, MissingResults_AreRefusedWithTheirStage) {
  write_dressed_workspace(capture(), workspace(), "personalize");
  expect_refused(animate(), "run 'atelier track' first");
  write_dressed_workspace(capture(), workspace(), "body");
  expect_refused(animate(), "'atelier register' first");
  EXPECT_THAT(stage("material").err, HasSubstr("run 'atelier template' first"));
  // A body alone needs none of them.
  ASSERT_EQ(animate({"--garment", "none"}).exit_code, 0);
  EXPECT_EQ(metrics()["garments"], 0);
}

TEST_F(Animate, Run_PassesTheFabricToAnimateUnlessFitted) {
  write_dressed_workspace(capture(), workspace());
  ASSERT_EQ(animate().exit_code, 0);
  const auto plan = [&](const std::vector<std::string>& more) {
    std::vector<std::string> all = {"--animate.pictures", "false", "--animate.cloth.xpbd.substeps",
                                    "6", "--dry-run"};
    all.insert(all.end(), more.begin(), more.end());
    return stage("run", all).out;
  };
  EXPECT_THAT(plan({"--from", "animate"}), HasSubstr("animate      would do nothing"));
  EXPECT_THAT(plan({"--from", "animate", "--material", "denim"}),
              HasSubstr(R"(animate      would run: option material.name: "fitted" -> "denim")"));
  EXPECT_THAT(plan({"--from", "material", "--material", "denim"}),
              HasSubstr("animate      would run: after material"));
}

TEST_F(Animate, RunWithoutVideo_ShowsNoneOfEarlierRun) {
  write_dressed_workspace(capture(), workspace());
  const auto animated = [&](const std::string& start) {
    return stage(
        "run", {"--from", "animate", "--animate.cloth.xpbd.substeps", "6", "--animate.width", "64",
                "--animate.height", "64", "--animate.start", start});
  };
  const ChildResult done = animated("0");
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out, HasSubstr("animation.mp4"));
  const ChildResult failed = animated("1000");
  EXPECT_EQ(failed.exit_code, 2) << failed.err;
  EXPECT_THAT(failed.out,
              ::testing::AllOf(HasSubstr("report: "), ::testing::Not(HasSubstr("animation.mp4"))));
}

TEST_F(Animate, BadMotions_AreRefused) {
  write_dressed_workspace(capture(), workspace());
  expect_refused(animate({"--motion", (root_ / "none.bvh").string()}), "no such file");
  expect_refused(animate({"--motion", (root_ / "none.bvh").string(), "--dry-run"}), "no such file");
  std::filesystem::create_directory(root_ / "motions");
  std::ofstream(root_ / "motions" / "walk.bvh") << "HIERARCHY";
  expect_refused(animate({"--motion", (root_ / "motions").string(), "--dry-run"}),
                 "it takes a motion file (.bvh, ", 2);
  expect_refused(animate({"--material", "denim"}), "did you mean '--material.name'?", 2);
  expect_refused(stage("material", {"--material.name", "denim", "--search.coarse", "4"}),
                 "--search.coarse does nothing with --material.name denim", 2);
  expect_refused(animate({"--motion", "twits"}), "did you mean 'twist'?", 2);
  MotionClip stranger = person_clip();
  for (std::size_t j = 0; j < stranger.skeleton.names.size(); ++j) {
    stranger.skeleton.names[j] = "bone" + std::to_string(j);
  }
  stranger.skeleton.parents.assign(21, 0);
  stranger.skeleton.parents[0] = -1;
  expect_refused(animate({"--motion", motion(stranger).string()}), "person");
  std::string text = read_file_text(motion(person_clip()), 1 << 20);
  const std::size_t at = text.rfind("0");
  std::ofstream(root_ / "motion.bvh") << text.replace(at, 1, "nan");
  expect_refused(animate({"--motion", (root_ / "motion.bvh").string()}), "motion.bvh");
  std::ofstream(root_ / "empty.bvh") << "";
  expect_refused(animate({"--motion", (root_ / "empty.bvh").string()}), "empty.bvh");
  expect_refused(animate({"--start", "10"}), "--start cannot be '10'", 2);
  expect_refused(animate({"--sequence", "other"}), "--sequence cannot be 'other'", 2);
}

TEST_F(Animate, DryRun_SaysOfAMotionWhatTheRunWould) {
  write_dressed_workspace(capture(), workspace());
  const auto planned = [&](const std::string& file, std::vector<std::string> more = {}) {
    more.insert(more.begin(), {"--motion", (root_ / file).string(), "--dry-run"});
    return animate(more);
  };
  std::ofstream(root_ / "empty.bvh") << "";
  expect_refused(planned("empty.bvh"), "empty.bvh");
  std::ofstream(root_ / "text.c3d") << "no C3D";
  expect_refused(planned("text.c3d"), "text.c3d");
  MotionClip clip = person_clip();
  clip.motion.fps = 1 / 33.3;
  motion(clip);
  const ChildResult odd = planned("motion.bvh", {"--seconds", "1"});
  EXPECT_EQ(odd.exit_code, 0) << odd.err;
  EXPECT_THAT(odd.out, AllOf(HasSubstr("it looks like milliseconds"),
                             HasSubstr("--motion.fps 30 of body-model")));
  EXPECT_THAT(planned("motion.bvh", {"--json"}).out, HasSubstr("it looks like milliseconds"));
  expect_refused(planned("motion.bvh", {"--start", "4000"}), "--start cannot be '4000'", 2);
  clip.motion.fps = 1e-9;
  motion(clip);
  expect_refused(planned("motion.bvh"), "1e-09 frames a second");
  const ChildResult chain =
      stage("run", {"--from", "animate", "--animate.pictures", "false", "--animate.motion",
                    (root_ / "motion.bvh").string(), "--dry-run"});
  EXPECT_EQ(chain.exit_code, 3);
  EXPECT_THAT(chain.err, HasSubstr("1e-09 frames a second"));
  EXPECT_FALSE(std::filesystem::exists(workspace() / "animate" / "current"));
}

TEST_F(Animate, RootFarFromTheStage_IsRefusedBeforeAnyWork) {
  write_dressed_workspace(capture(), workspace());
  const auto moved = [](double metres, std::size_t first) {
    MotionClip clip = person_clip();
    for (std::size_t i = first; i < clip.motion.poses.size(); ++i) {
      clip.motion.poses[i].root_translation.x() += metres;
    }
    return clip;
  };
  // 1e7 units: a BVH's are centimetres.
  for (const auto& [name, metres] :
       {std::pair("far.bvh", 1e5), std::pair("far.npz", 1e7), std::pair("far.glb", 1e7)}) {
    write_motion_file(root_ / name, moved(metres, 0));
    expect_refused(animate({"--motion", (root_ / name).string()}), "m from the origin");
  }
  expect_refused(animate({"--motion", motion(moved(1e5, 4)).string()}), "m from the origin");
}

TEST_F(Animate, MismatchedClothOrBodies_AreRefused) {
  write_dressed_workspace(capture(), workspace());
  const ChildResult conflict =
      animate({"--cloth.xpbd.vectors", "avx2", "--cloth.xpbd.precision", "double"});
  EXPECT_EQ(conflict.exit_code, 2);
  EXPECT_THAT(conflict.err, HasSubstr("precision \"float\" alone"));
  fs::create_directories(root_ / "cloth");
  for (int i = 0; i < 3; ++i) {
    write_mesh(root_ / "cloth" / ("cloth_" + std::to_string(i) + ".obj"), grid(3, 3));
  }
  expect_refused(animate({"--cloth-sequence", (root_ / "cloth").string()}), "another topology");
  fs::remove_all(root_ / "cloth");
  fs::create_directories(root_ / "cloth");
  Mesh skirt = tube_skirt().mesh;
  write_mesh(root_ / "cloth" / "cloth_0.obj", skirt);
  write_mesh(root_ / "cloth" / "cloth_1.obj", skirt);
  expect_refused(animate({"--cloth-sequence", (root_ / "cloth").string()}),
                 "as long as the motion");
  expect_refused(animate({"--cloth-sequence", (root_ / "nothing").string()}), "nothing");
  write_body(root_ / "other.npz", person_body(person_skeleton()));
  expect_refused(animate({"--body", (root_ / "other.npz").string()}), "another topology");
  // Before anything is simulated: a frame that is done would be kept.
  expect_refused(stage("animate", {"--camera", "09"}), "one of the capture's: 00, 01, 02", 2);
  expect_refused(stage("animate", {"--camera", "fornt"}), "did you mean 'front'?", 2);
  EXPECT_FALSE(fs::exists(workspace() / "animate"));
  expect_refused(animate({"--material.stretch-warp", "-0.5"}), "--material.stretch-warp cannot be",
                 2);
  expect_refused(animate({"--garment", "cape"}), "--garment cannot be 'cape'", 2);
}

TEST_F(Animate, ConflictingOptions_AreRefusedAtTheStart) {
  const std::vector<std::pair<std::vector<std::string>, std::string>> refused = {
      {{"material", "--search.stretch-low", "1000", "--search.stretch-high", "100"},
       "--search.stretch-low cannot be 1000 with --search.stretch-high 100: it takes less"},
      {{"material", "--search.bending-low", "1e-5", "--search.bending-high", "1e-5"},
       "--search.bending-low cannot be 1e-05 with --search.bending-high 1e-05: it takes less"},
      {{"run", "--material.search.stretch-low", "2e4"},
       "--material.search.stretch-low cannot be 20000 with material.search.stretch_high"},
      {{"reconstruct", "--hull.voxel_size", "0.5", "--hull.half_extent", "0.1"},
       "with --hull.half_extent 0.1: it takes less"},
      {{"track", "--window", "3", "--overlap", "2"},
       "--overlap cannot be 2 with --window 3: it takes at most half"},
      {{"appearance", "--resolution", "100"}, "resolution cannot be 100"},
      {{"appearance", "--shading", "3"}, "shading cannot be 3: it takes powers of 2"},
      {{"animate", "--camera", "01", "--width", "64"},
       "--width does nothing with --camera 01, which is the capture's"},
      {{"animate", "--camera", "01", "--framing.margin", "0.1"}, "framing.margin does nothing"},
      {{"animate", "--pictures", "false", "--background", "white"},
       "--background does nothing with --pictures false: leave it out, or say --pictures"},
      {{"run", "--animate.pictures", "false", "--animate.camera", "orbit"},
       "--animate.camera does nothing with --animate.pictures false"}};
  write_dressed_workspace(capture(), workspace());
  for (const auto& [arguments, words] : refused) {
    if (run({arguments[0], "--help"}).exit_code != 0) {
      continue;  // built without it
    }
    const ChildResult result = stage(arguments[0], {arguments.begin() + 1, arguments.end()});
    EXPECT_EQ(result.exit_code, 2) << result.err;
    EXPECT_THAT(result.err, HasSubstr(words));
  }
}

TEST_F(Animate, DamagedResults_AreRefused) {
  write_dressed_workspace(capture(), workspace());
  const fs::path archive = workspace() / "template" / "current" / "garments" / "lower.h5";
  std::string bytes = read_file_text(archive, 1 << 24);
  bytes[bytes.size() / 2] ^= 1;
  fs::permissions(archive, fs::perms::owner_all);
  std::ofstream(archive, std::ios::binary) << bytes;
  expect_refused(animate(), "run 'atelier template' first");
}

}  // namespace
}  // namespace atelier::fixtures

#endif
