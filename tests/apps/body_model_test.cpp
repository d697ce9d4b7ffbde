#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/formats/body_file.h"
#include "bodymodel/formats/gltf_body.h"
#include "bodymodel/formats/motion_file.h"
#include "bodymodel/formats/motion_trc.h"
#include "core/io/mesh_fbx.h"
#include "tests/support/child_process.h"
#include "tests/support/places.h"
#include "tests/support/read_text.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/test_data.h"

namespace atelier::fixtures {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class BodyModelCommand : public ::testing::Test {
 protected:
  static ChildResult run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {program_path(), "body-model"});
    return run_child(arguments);
  }
  void refused(std::vector<std::string> arguments, int code, const char* words) {
    const ChildResult result = run(std::move(arguments));
    EXPECT_EQ(result.exit_code, code) << words;
    EXPECT_THAT(result.err, HasSubstr(words));
  }
  /// A person of 21 joints who stands still for three frames.
  std::string still_bvh() const {
    const std::filesystem::path path = folder_ / "still.bvh";
    std::ofstream file(path);
    file << "HIERARCHY\nROOT Hips\n{\nOFFSET 0 97 0\nCHANNELS 6 Xposition Yposition Zposition "
            "Zrotation Xrotation Yrotation\n";
    const auto joint = [&](const char* name, const char* offset) {
      file << "JOINT " << name << "\n{\nOFFSET " << offset
           << "\nCHANNELS 3 Zrotation Xrotation Yrotation\n";
    };
    const auto close = [&](int count) {
      file << "End Site\n{\nOFFSET 0 5 0\n}\n";
      for (int i = 0; i < count; ++i) {
        file << "}\n";
      }
    };
    for (const std::string side : {"Left", "Right"}) {
      joint((side + "UpLeg").c_str(), side == "Left" ? "9 -5 0" : "-9 -5 0");
      joint((side + "Leg").c_str(), "0 -42 0");
      joint((side + "Foot").c_str(), "0 -41 0");
      joint((side + "ToeBase").c_str(), "0 -7 13");
      close(4);
    }
    joint("Spine", "0 20 0");
    joint("Neck", "0 30 0");
    joint("Head", "0 10 0");
    close(2);
    for (const std::string side : {"Left", "Right"}) {
      const std::string sign = side == "Left" ? "" : "-";
      joint((side + "Arm").c_str(), (sign + "18 25 0").c_str());
      joint((side + "ForeArm").c_str(), (sign + "28 0 0").c_str());
      joint((side + "Hand").c_str(), (sign + "25 0 0").c_str());
      close(3);
    }
    file << "}\n}\nMOTION\nFrames: 3\nFrame Time: 0.0333333\n";
    for (int frame = 0; frame < 3; ++frame) {
      file << "0 97 0";
      for (int i = 0; i < 18 * 3; ++i) {
        file << " 0";
      }
      file << "\n";
    }
    return path.string();
  }

  TemporaryDirectory folder_;
};

TEST_F(BodyModelCommand, Motion_ConvertsToNpzAndBackToBvh) {
  const std::string npz = (folder_ / "still.npz").string();
  const ChildResult there = run({"convert", still_bvh(), "--out", npz});
  EXPECT_EQ(there.exit_code, 0) << there.err;
  EXPECT_THAT(there.out, HasSubstr("18 joints, 3 frames at 30 per second"));
  EXPECT_THAT(there.err, HasSubstr("one unit taken as 0.01 m"));
  const ChildResult back = run({"convert", npz, "--out", (folder_ / "back.bvh").string()});
  EXPECT_EQ(back.exit_code, 0) << back.err;
}

TEST_F(BodyModelCommand, Motion_ConvertsToTrc) {
  const std::filesystem::path trc = folder_ / "still.trc";
  const ChildResult there = run({"convert", still_bvh(), "--out", trc.string()});
  EXPECT_EQ(there.exit_code, 0) << there.err;
  const MarkerClip clip = read_trc(trc);
  EXPECT_EQ(clip.fps, 30);
  EXPECT_THAT(clip.markers, ::testing::SizeIs(18));
  EXPECT_EQ(clip.markers[1], "LeftUpLeg");
  EXPECT_LT((clip.positions[2].row(1) - Eigen::RowVector3d(0.09, 0.92, 0)).norm(), 1e-6);
  const std::filesystem::path posed = folder_ / "posed.trc";
  ASSERT_EQ(run({"pose", "female", still_bvh(), "--out", posed.string()}).exit_code, 0);
  EXPECT_EQ(read_trc(posed).positions.size(), 3u);
  refused({"convert", "default", "--out", "a.trc"}, 2, "--out a.trc writes a motion");
}

TEST_F(BodyModelCommand, Advice_NamesTheFlags) {
  const ChildResult result = run({"convert", still_bvh(), "--out", (folder_ / "a.npz").string()});
  EXPECT_THAT(result.err, HasSubstr("--motion.metres-per-unit sets another"));
  EXPECT_THAT(run({"--help"}).out, HasSubstr("motion.up"));
}

TEST_F(BodyModelCommand, Motion_ConvertsToGltfAndBack) {
  const std::string glb = (folder_ / "still.glb").string();
  ASSERT_EQ(run({"convert", still_bvh(), "--out", glb}).exit_code, 0);
  for (const char* name : {"back.bvh", "back.npz", "back.gltf"}) {
    const ChildResult back = run({"convert", glb, "--out", (folder_ / name).string()});
    EXPECT_EQ(back.exit_code, 0) << back.err;
    EXPECT_THAT(back.out, HasSubstr("18 joints, 3 frames at 30 per second")) << name;
  }
}

TEST_F(BodyModelCommand, Fbx_IsConvertedAsGltfIs) {
  const std::string fbx = (fixtures::source_directory() / "fuzz/corpus/fbx/blender.fbx").string();
  const ChildResult body = run({"convert", fbx, "--out", (folder_ / "body.npz").string()});
  if (!reads_fbx()) {
    EXPECT_EQ(body.exit_code, 3);
    EXPECT_THAT(body.err, HasSubstr("Blender imports FBX"));
    return;
  }
  EXPECT_THAT(body.out, HasSubstr("12 vertices, 3 joints")) << body.err;
  const ChildResult motion =
      run({"convert", fbx, "--as", "motion", "--out", (folder_ / "bend.bvh").string()});
  EXPECT_THAT(motion.out, HasSubstr("3 joints, 25 frames at 24 per second")) << motion.err;
}

TEST_F(BodyModelCommand, FileWithBodyAndMotion_IsReadAsEither) {
  const std::string glb = (folder_ / "posed.glb").string();
  ASSERT_EQ(run({"pose", "female", still_bvh(), "--out", glb}).exit_code, 0);
  const std::string npz = (folder_ / "taken.npz").string();
  const ChildResult body = run({"convert", glb, "--out", npz});
  EXPECT_THAT(body.out, HasSubstr("vertices, 55 joints"));
  const ChildResult motion = run({"convert", glb, "--as", "motion", "--out", npz});
  EXPECT_THAT(motion.out, HasSubstr("55 joints, 3 frames")) << motion.err;
  refused({"convert", glb, "--out", (folder_ / "a.bvh").string()}, 2, "--as motion takes");
  refused({"convert", glb, "--as", "dance", "--out", npz}, 2, "dance");
  refused({"measure", "female", "--as", "motion"}, 2, "it is for convert");
}

TEST_F(BodyModelCommand, AnimationThatAMotionDoesNotHave_IsRefusedByItsFlag) {
  refused({"pose", "female", still_bvh(), "--motion.animation", "Walk", "--out",
           (folder_ / "a.glb").string()},
          2, "--motion.animation cannot be 'Walk'");
  EXPECT_EQ(run({"convert", still_bvh(), "--motion.animation", "1", "--out",
                 (folder_ / "a.npz").string()})
                .exit_code,
            0);
}

TEST_F(BodyModelCommand, ShowAndPose_WriteImages) {
  const auto png = [&](const char* name) { return (folder_ / name).string(); };
  const std::vector<std::string> small = {"--width", "64", "--height", "96", "--samples", "1"};
  const auto with_small = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), small.begin(), small.end());
    return run(std::move(arguments));
  };
  const ChildResult shown = with_small({"show", "female", "--out", png("body.png")});
  ASSERT_EQ(shown.exit_code, 0) << shown.err;
  EXPECT_THAT(shown.out, HasSubstr("55 joints, 13 shape parameters"));
  const ChildResult posed =
      with_small({"pose", "female", still_bvh(), "--pictures", "3", "--out", png("still.png")});
  ASSERT_EQ(posed.exit_code, 0) << posed.err;
  EXPECT_THAT(posed.out, HasSubstr("3 frames at 30 per second, steps scaled by 0."));
  for (const char* name : {"body.png", "still.png"}) {
    const ChildResult picture = run_child({program_path(), "inspect", png(name), "--json"});
    ASSERT_EQ(picture.exit_code, 0) << picture.err;
    const auto json = nlohmann::json::parse(picture.out);
    EXPECT_GE(json["width"], 3 * 64) << name;
    EXPECT_GE(json["height"], 96) << name;
  }
  const ChildResult video = with_small({"pose", "female", still_bvh(), "--out", png("still.mp4")});
  ASSERT_EQ(video.exit_code, 0) << video.err;
  EXPECT_GT(std::filesystem::file_size(png("still.mp4")), 500u);
}

TEST_F(BodyModelCommand, MeasurementsOfValentina_ShapeTheGeneratedBody) {
  const std::string file = (folder_ / "client.vit").string();
  std::ofstream(file) << "<vit><unit>cm</unit><body-measurements><m name=\"height\" value=\"172\"/>"
                         "<m name=\"waist_circ\" value=\"78 + 2\"/></body-measurements></vit>";
  const ChildResult found =
      run({"measure", "female", "--shape", file + ",hip_girth=1.04", "--json"});
  ASSERT_EQ(found.exit_code, 0) << found.err;
  EXPECT_THAT(found.err, HasSubstr("the body takes height, waist_circ"));
  const nlohmann::json body = nlohmann::json::parse(found.out);
  EXPECT_NEAR(body["stature"]["value"].get<double>(), 1.72, 0.004);
  EXPECT_NEAR(body["waist_girth"]["value"].get<double>(), 0.80, 0.002);
  EXPECT_NEAR(body["hip_girth"]["value"].get<double>(), 1.04, 0.003);
  const std::string npz = (folder_ / "client.npz").string();
  ASSERT_EQ(run({"convert", "female", "--out", npz}).exit_code, 0);
  refused({"measure", npz, "--shape", file}, 2, "measurements shape default, female and male");
  refused({"measure", "female", "--shape", (folder_ / "none.vit").string()}, 3, "none.vit");
  std::ofstream(folder_ / "sizes.vst") << "<vst><unit>cm</unit></vst>";
  refused({"measure", "female", "--shape", (folder_ / "sizes.vst").string()}, 3,
          "a table of sizes");
}

TEST_F(BodyModelCommand, ConvertedBody_KeepsItsShape) {
  const std::string body = (folder_ / "body.npz").string();
  const std::string tall = (folder_ / "tall.npz").string();
  ASSERT_EQ(run({"convert", "female", "--out", body}).exit_code, 0);
  const ChildResult made = run({"convert", body, "--shape", "stature=1.66", "--out", tall});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const ChildResult measured = run({"measure", tall, "--json"});
  ASSERT_EQ(measured.exit_code, 0) << measured.err;
  EXPECT_NEAR(nlohmann::json::parse(measured.out)["stature"]["value"].get<double>(), 1.66, 0.002);
}

TEST_F(BodyModelCommand, MakeHumanTargets_ShapeTheBody) {
  ATELIER_TEST_FILE(base, "makehuman/base/base.obj");
  const std::string longer =
      (fixtures::test_data_root() / "makehuman/targets/measure/measure-neck-circ-incr.target")
          .string();
  const auto neck = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"measure", base.string(), "--json"});
    const ChildResult result = run(std::move(more));
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return nlohmann::json::parse(result.out)["neck_girth"]["value"].get<double>();
  };
  const double plain = neck({});
  EXPECT_GT(neck({"--target", longer + "=1"}), plain + 0.02);
  EXPECT_NEAR(neck({"--target", longer + "=0"}), plain, 1e-9);
  refused({"measure", base.string(), "--target", longer + "=2"}, 2,
          "measure-neck-circ-incr cannot be 2: it is in [0, 1]");
  refused({"measure", base.string(), "--target", longer}, 2, "FILE=WEIGHT");
  refused({"measure", base.string(), "--target", longer + "=1", "--target", longer + "=0.5"}, 2,
          "is given twice");
  refused({"measure", base.string(), "--target", "none.target=1"}, 3, "none.target");
  refused({"measure", "female", "--target", longer + "=1"}, 2, "it is for MakeHuman's base.obj");
}

TEST_F(BodyModelCommand, BodyInCentimetres_IsRefusedUntilUnitIsGiven) {
  ATELIER_TEST_FILE(fox, "gltf_skinned/bevy_fox/Fox.glb");
  refused({"measure", fox.string()}, 3, "set metres_per_unit = 0.01");
  EXPECT_EQ(run({"convert", fox.string(), "--metres_per_unit", "0.01", "--out",
                 (folder_ / "fox.npz").string()})
                .exit_code,
            0);
  refused({"measure", "female", "--metres_per_unit", "0.01"}, 2, "is for bodies in .glb");
  const std::string npz = (folder_ / "still.npz").string();
  ASSERT_EQ(run({"convert", still_bvh(), "--out", npz}).exit_code, 0);
  refused({"convert", npz, "--metres_per_unit", "0.01", "--out", npz}, 2,
          "motions have --motion.metres_per_unit");
}

TEST_F(BodyModelCommand, DressedFigure_IsMeasuredWithAWarning) {
  ATELIER_TEST_FILE(figure, "gltf_skinned/mesh2motion/human-sophia.glb");
  const ChildResult result = run({"measure", figure.string()});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("warning measure-pieces"));
  EXPECT_THAT(result.out, ::testing::Not(HasSubstr("mass")));   // of clothes over skin: nobody's
  const std::string naked = (folder_ / "female.glb").string();  // split at the seams of its atlas
  ASSERT_EQ(run({"convert", "female", "--out", naked}).exit_code, 0);
  EXPECT_THAT(run({"measure", naked}).err, ::testing::IsEmpty());
}

TEST_F(BodyModelCommand, ShapeOptions_DoNotSwallowLaterArguments) {
  const ChildResult result =
      run({"--shape", "stature=1.6,weight=0.1", "--shape", "mass=70", "measure", "female"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("no shape parameter 'weight'"));
  const ChildResult measured = run({"--shape", "stature=1.7", "measure", "female", "--json"});
  EXPECT_EQ(measured.exit_code, 0) << measured.err;
  EXPECT_NEAR(nlohmann::json::parse(measured.out)["stature"]["value"].get<double>(), 1.7, 0.01);
}

TEST_F(BodyModelCommand, Switches_DoNotSwallowLaterArguments) {
  EXPECT_EQ(run({"--four_influences", "measure", "female"}).exit_code, 0);
  EXPECT_EQ(run({"--four_influences", "false", "measure", "female"}).exit_code, 0);
  EXPECT_EQ(run({"measure", "female", "--four_influences=true"}).exit_code, 0);
  refused({"measure", "female", "--four_influences=maybe"}, 2, "it takes true or false");
}

TEST_F(BodyModelCommand, Inspect_ShowsMotionsAndBodies) {
  const ChildResult motion = run_child({program_path(), "inspect", still_bvh(), "--json"});
  ASSERT_EQ(motion.exit_code, 0) << motion.err;
  const auto json = nlohmann::json::parse(motion.out);
  EXPECT_EQ(json["kind"], "motion");
  EXPECT_EQ(json["joints"], 18);
  EXPECT_EQ(json["frames"], 3);
  const std::string npz = (folder_ / "body.npz").string();
  ASSERT_EQ(run({"convert", "female", "--out", npz}).exit_code, 0);
  EXPECT_THAT(run_child({program_path(), "inspect", npz}).out, HasSubstr("holds             body"));
  std::ofstream(folder_ / "cut.bvh") << "HIERARCHY\n";
  const ChildResult cut = run_child({program_path(), "inspect", (folder_ / "cut.bvh").string()});
  EXPECT_EQ(cut.exit_code, 3);
  EXPECT_THAT(cut.err, HasSubstr("cut.bvh"));
}

TEST_F(BodyModelCommand, WrittenMotions_AreReadableByOwnerOnly) {
  for (const char* name : {"a.bvh", "a.npz"}) {
    const std::filesystem::path out = folder_ / name;
    ASSERT_EQ(run({"convert", still_bvh(), "--out", out.string()}).exit_code, 0);
    EXPECT_EQ(static_cast<unsigned>(std::filesystem::status(out).permissions()), 0600u) << name;
  }
}

TEST_F(BodyModelCommand, WrongArguments_AreRefused) {
  refused({}, 2, "body-model takes an ACTION");
  refused({"dance", "default"}, 2, "dance");
  refused({"show", "default"}, 2, "--out FILE");
  refused({"show", "default", "--out", "a.gif"}, 2, ".png");
  refused({"pose", "default", "--out", "a.png"}, 2, "body-model pose takes a MOTION");
  refused({"show", "default", "walk.bvh", "--out", "a.png"}, 2,
          "body-model show takes no MOTION: only pose takes a motion");
  refused({"pose", "default", "walk.bvh", "--out", "a.txt"}, 2, "contact sheet");
  refused({"show", "base.obj", "--macros.wings", "1", "--out", "a.png"}, 2, "no option");
  refused({"show", "base.obj", "--macros.gender", "2", "--out", "a.png"}, 2, "[0, 1]");
  refused({"show", "base.obj", "--macros.gender", "x", "--out", "a.png"}, 2, "cannot be 'x'");
  refused({"show", "base.obj", "--macros.asian", "1", "--out", "a.png"}, 2, "add up to 1.667");
  refused({"show", "female", "--out", "a.png", "--width", "nan"}, 2, "width cannot be 'nan'");
  refused({"measure", "female", "--shape", "stature"}, 2, "NAME=NUMBER");
  refused({"measure", "female", "--shape", "stature=nan"}, 2, "stature cannot be 'nan'");
  refused(
      {"measure", "female", "--shape", "wings=1"}, 2,
      "--shape cannot be 'wings=1': the body has no shape parameter 'wings'; it has male, stature");
  refused({"pose", "female", "a.bvh", "--motion.up", "x", "--out", "a.png"}, 2, "auto, y, z");
  refused({"convert", still_bvh(), "--out", "a.obj"}, 2, "a motion becomes .bvh, .trc, .npz, .glb");
  refused({"convert", "default", "--out", "a.bvh"}, 2, "default is a body: it becomes .npz");
  refused({"convert", "default", "--out", "a.xyz"}, 2, ".obj or .ply for a body");
  refused({"measure", "female", "--shape", "stature=1.7", "--shape", "stature=1.8"}, 2,
          "stature is given twice");
  refused({"measure", "female", "--shape", "stature=1.2"}, 2,
          "stature cannot be 1.2: it is in [1.4, 2.15] m");
  refused({"measure", "female", "--shape", "stature=180"}, 2,
          "--shape cannot be 'stature=180': stature cannot be 180: it is in [1.4, 2.15] m");
  refused({"measure", "female", "--shape", "stature=1.9,mass=40"}, 2,
          "--shape cannot be 'stature=1.9,mass=40': mass");
}

TEST_F(BodyModelCommand, CopyrightAndConsentOfFiles_GoWithWhatIsMadeOfThem) {
  GltfScene scene = gltf_body(read_body_file("female").model);
  scene.copyright = "2026 Ada";
  scene.consent = "Ada: research until 2030-01-01";
  const std::string body = (folder_ / "ada.glb").string();
  write_gltf(body, scene);
  const std::string again = (folder_ / "again.glb").string();
  const std::string posed = (folder_ / "posed.glb").string();
  const std::string mesh = (folder_ / "mesh.glb").string();
  ASSERT_EQ(run({"convert", body, "--out", again}).exit_code, 0);
  ASSERT_EQ(run({"pose", body, still_bvh(), "--out", posed}).exit_code, 0);
  ASSERT_EQ(run_child({program_path(), "convert", body, mesh}).exit_code, 0);
  for (const std::string& file : {again, posed, mesh}) {
    const GltfScene back = read_gltf(file);
    EXPECT_EQ(back.copyright, "2026 Ada") << file;
    EXPECT_EQ(back.consent, "Ada: research until 2030-01-01") << file;
  }
  // A motion beside a consent file.
  const std::filesystem::path capture = folder_ / "capture";
  std::filesystem::create_directories(capture);
  std::filesystem::copy_file(still_bvh(), capture / "walk.bvh");
  std::ofstream(capture / "consent.toml")
      << "[[consent]]\nwho = \"Ben\"\nscope = \"research\"\nuntil = \"2030-01-01\"\n";
  ASSERT_EQ(run({"pose", body, (capture / "walk.bvh").string(), "--out", posed}).exit_code, 0);
  EXPECT_THAT(read_gltf(posed).consent, AllOf(HasSubstr("Ada"), HasSubstr("Ben")));
}

TEST_F(BodyModelCommand, UnitOfABodyThatMakesNoPerson_NamesTheFlagAsTyped) {
  const std::string npz = (folder_ / "female.npz").string();
  const std::string glb = (folder_ / "female.glb").string();
  ASSERT_EQ(run({"convert", "female", "--out", npz}).exit_code, 0);
  ASSERT_EQ(run({"convert", "female", "--out", glb}).exit_code, 0);
  refused(
      {"measure", npz, "--metres-per-unit", "0.01"}, 2,
      ("--metres-per-unit cannot be '0.01': of " + npz + " it takes 1: an archive says its unit")
          .c_str());
  refused({"measure", glb, "--metres_per_unit", "5"}, 2, "--metres_per_unit cannot be '5'");
  refused({"measure", glb, "--metres-per-unit", "0"}, 2, "--metres-per-unit cannot be '0'");
}

TEST_F(BodyModelCommand, FlagsWithoutEffect_AreRefused) {
  refused({"measure", "default", "--macros.gender", "1"}, 2,
          "--macros.gender has no effect here: it is for MakeHuman's base.obj; default takes "
          "--shape stature=1.8");
  refused({"measure", "female", "--rig", "a.mhskel"}, 2, "--rig has no effect");
  refused({"measure", "body.npz", "--weights", "a.mhw"}, 2, "for MakeHuman's base.obj");
  refused({"measure", "female", "--motion.up", "z"}, 2, "it is for a motion");
  refused({"measure", "female", "--retarget.fps", "30"}, 2, "it is for pose");
  refused({"measure", "female", "--width", "100"}, 2, "it is for images and videos");
  refused({"measure", "female", "--out", "a.json"}, 2, "measure prints");
  refused({"show", "female", "--json", "--out", "a.png"}, 2, "it is for measure");
  refused({"show", "female", "--pictures", "4", "--out", "a.png"}, 2, "for pose with a contact");
  refused({"pose", "female", still_bvh(), "--asf", "a.asf", "--out", "a.png"}, 2, "in an .amc");
  refused({"convert", still_bvh(), "--shape", "stature=1.8", "--out", "a.npz"}, 2, "is a motion");
}

TEST_F(BodyModelCommand, FrameRateOutOfRange_IsRefused) {
  const std::string video = (folder_ / "a.mp4").string();
  refused({"pose", "female", still_bvh(), "--retarget.fps", "0.001", "--out", video}, 2,
          "retarget.fps cannot be 0.001: it takes 0 or 0.1 to 1000");
  refused({"convert", still_bvh(), "--motion.fps", "0.01", "--out", "a.npz"}, 2,
          "motion.fps cannot be 0.01");
}

TEST_F(BodyModelCommand, BodyAndMotion_AreToldApart) {
  const std::string png = (folder_ / "a.png").string();
  refused({"measure", still_bvh()}, 3, "this is a motion, not a body");
  refused({"pose", "female", "male", "--out", png}, 3, "this is a body, not a motion");
  refused({"pose", "female", folder_.path().string(), "--out", png}, 2, "it takes a motion: .bvh");
  const std::string glb = (folder_ / "female.glb").string();
  const ChildResult written = run({"convert", "female", "--out", glb});
  EXPECT_THAT(written.out, HasSubstr(" vertices, 55 joints"));
  const ChildResult whole = run({"convert", "female", "--out", (folder_ / "f.npz").string()});
  const auto vertices = [](const std::string& said) {
    return std::atoi(said.c_str() + said.find(": ") + 2);
  };
  EXPECT_GT(vertices(written.out), vertices(whole.out)) << "seams of the atlas split vertices";
  EXPECT_THAT(written.err, HasSubstr("note gltf-left-out"));
  EXPECT_THAT(written.err, HasSubstr("glTF has no place for 13 shape parameters and"));
  refused({"pose", "female", glb, "--out", png}, 3, "this is a body, not a motion");
  const ChildResult mesh = run({"convert", "female", "--out", (folder_ / "f.obj").string()});
  EXPECT_THAT(mesh.out, HasSubstr("triangles"));
  EXPECT_THAT(mesh.out, ::testing::Not(HasSubstr("joints")));
}

TEST_F(BodyModelCommand, UnmeasurableBody_IsRefusedByName) {
  ATELIER_TEST_FILE(fox, "gltf_skinned/bevy_fox/Fox.glb");
  const ChildResult result = run({"measure", fox.string(), "--metres_per_unit", "0.01"});
  EXPECT_EQ(result.exit_code, 3) << result.out;
  EXPECT_THAT(result.err, HasSubstr("Fox.glb: "));
  EXPECT_THAT(result.err, HasSubstr("do not stand upright"));
  EXPECT_THAT(result.out, ::testing::IsEmpty());
}

TEST_F(BodyModelCommand, FourLeggedMotion_IsWarnedOf) {
  ATELIER_TEST_FILE(fox, "gltf_skinned/bevy_fox/Fox.glb");
  const ChildResult result =
      run({"pose", "female", fox.string(), "--out", (folder_ / "a.bvh").string()});
  EXPECT_THAT(result.err, HasSubstr("retarget-posture")) << result.exit_code;
  const ChildResult person =
      run({"pose", "female", still_bvh(), "--out", (folder_ / "b.bvh").string()});
  EXPECT_THAT(person.err, ::testing::Not(HasSubstr("retarget-posture")));
}

TEST_F(BodyModelCommand, MeasuresOfNoAdult_AreRefused) {
  refused({"measure", "female", "--shape", "mass=90,waist_girth=0.5"}, 2,
          "0.5 m at a stature of 1.63 m and a mass of 90 kg");
  refused({"measure", "female", "--shape", "stature=2.1,mass=35"}, 2, "a body mass index of 7.94");
  const ChildResult legs = run({"measure", "female", "--shape", "stature=1.8,leg_length=1.05"});
  EXPECT_EQ(legs.exit_code, 2);
  EXPECT_THAT(legs.err, HasSubstr("--shape cannot be 'stature=1.8,leg_length=1.05': "));
  EXPECT_THAT(legs.err, HasSubstr("together with"));
  EXPECT_THAT(legs.err, ::testing::Not(HasSubstr("girths that are given")));
}

TEST_F(BodyModelCommand, BonesBeyondAnyPerson_AreRefusedByPose) {
  const std::string sound = read_text(still_bvh());
  const auto posed = [&](const std::string& from, const std::string& to, const char* words) {
    std::string text = sound;
    ASSERT_NE(text.find(from), std::string::npos);
    for (std::size_t at = text.find(from); at != std::string::npos;
         at = text.find(from, at + to.size())) {
      text.replace(at, from.size(), to);
    }
    const std::string file = (folder_ / "moved.bvh").string();
    std::ofstream(file) << text;
    refused({"pose", "default", file, "--out", (folder_ / "a.npz").string()}, 3, words);
    EXPECT_FALSE(std::filesystem::exists(folder_ / "a.npz"));
  };
  posed("OFFSET 0 -42 0", "OFFSET 0 -1e308 0", "OFFSET -1e+308");
  posed("OFFSET 0 -42 0", "OFFSET 0 -1e30 0", "");
  posed("0 97 0 0", "0 1e308 0 0", "frame 1");
  const std::regex number("OFFSET [-0-9. ]+");
  std::ofstream(folder_ / "flat.bvh") << std::regex_replace(sound, number, "OFFSET 0 0 0");
  refused(
      {"pose", "default", (folder_ / "flat.bvh").string(), "--out", (folder_ / "a.npz").string()},
      3, "every OFFSET 0");
}

TEST_F(BodyModelCommand, AmassOnItsOwnBody_KeepsRotationsAndPath) {
  const std::filesystem::path files = source_directory() / "tests/bodymodel/files";
  const std::filesystem::path out = folder_ / "walk.npz";
  const ChildResult done = run({"pose", (files / "smplx_like.npz").string(),
                                (files / "walk_stageii.npz").string(), "--out", out.string()});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out + done.err, ::testing::Not(HasSubstr("motion-skeleton")));
  const Motion moved = read_motion_file(out).motion;
  ASSERT_EQ(moved.poses.size(), 20U);
  EXPECT_NEAR((moved.poses[19].root_translation - moved.poses[0].root_translation).norm(), 1.5,
              1e-6);
}

TEST_F(BodyModelCommand, WrongFiles_AreRefused) {
  refused({"measure", "nobody.xyz"}, 3, "default, female, male");
  refused({"show", "nobody", "--out", (folder_ / "a.png").string()}, 2, "body cannot be 'nobody'");
  refused({"show", "femal", "--out", (folder_ / "a.png").string()}, 2, ", did you mean 'female'?");
  refused({"measure", (folder_ / "none.npz").string()}, 3, "none.npz");
  const std::filesystem::path cut = folder_ / "cut.bvh";
  std::ofstream(cut) << "HIERARCHY\nROOT hips\n{\nOFFSET 0 0 0\n";
  refused({"convert", cut.string(), "--out", (folder_ / "a.npz").string()}, 3, "cut.bvh: line");
  std::ofstream(folder_ / "a.amc") << "1\n";
  refused({"convert", (folder_ / "a.amc").string(), "--out", (folder_ / "a.npz").string()}, 3,
          "the ASF file of this motion");
}

}  // namespace
}  // namespace atelier::fixtures
