// `atelier run`: INPUTs that it makes of results (surfaces), their consent and damage.
#if defined(ATELIER_HAS_CAPTURE) && defined(ATELIER_HAS_CAPTURE_SURFACE) && \
    defined(ATELIER_HAS_BODYMODEL)

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/io/file_bytes.h"
#include "core/io/mesh_file.h"
#include "core/normals.h"
#include "core/sequence_archive.h"
#include "core/store/commit.h"
#include "core/store/input_digest.h"
#include "core/store/result.h"
#include "core/store/stage_plan.h"
#include "registration/flattening/rest_surface.h"
#include "tests/apps/run_fixture.h"
#include "tests/support/shapes.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

/// A patch of cloth of seven by seven vertices, which are `width` m apart across.
void write_patch(const fs::path& file, double width) {
  std::ofstream patch(file);
  constexpr int kSide = 6;
  for (int y = 0; y <= kSide; ++y) {
    for (int x = 0; x <= kSide; ++x) {
      patch << "v " << width * x << " " << 0.05 * y << " 0\n";
    }
  }
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const int v = y * (kSide + 1) + x + 1;
      patch << "f " << v << " " << v + 1 << " " << v + kSide + 2 << "\n";
      patch << "f " << v << " " << v + kSide + 2 << " " << v + kSide + 1 << "\n";
    }
  }
}

/// Commits what `write` puts into a folder as the result of a stage, of somebody who agreed to
/// something.
fs::path make_result(const fs::path& workspace, const std::string& stage,
                     const std::function<void(const fs::path&)>& write, int version = 1) {
  const fs::path staging = workspace / stage / ".staging-0";
  fs::create_directories(staging);
  write(staging);
  Manifest manifest;
  manifest.stage = stage;
  manifest.stage_version = version;
  manifest.canonical_options = "{}";
  manifest.key = stage_key(stage, version, "", "{}", {});
  manifest.started = manifest.finished = "2026-01-01T00:00:00Z";
  manifest.consent = {{"P. Doe", "research", "2999-12-31"}};
  for (const auto& entry : fs::recursive_directory_iterator(staging)) {
    if (!entry.is_directory()) {
      const FileDigest digest = digest_of_file(entry.path());
      manifest.outputs.push_back(
          {entry.path().lexically_relative(staging).generic_string(), digest.size, digest.digest});
    }
  }
  std::sort(manifest.outputs.begin(), manifest.outputs.end(),
            [](const auto& a, const auto& b) { return a.path < b.path; });
  const fs::path result = workspace / stage / folder_name(manifest.key);
  commit_result(staging, result, manifest);
  return result;
}

/// A result of `template`: a patch of cloth.
fs::path make_template(const fs::path& workspace, int version = 1) {
  return make_result(
      workspace, "template",
      [](const fs::path& folder) {
        fs::create_directory(folder / "garments");
        write_patch(folder / "garments" / "upper.obj", 0.05);
      },
      version);
}

TEST_F(Run, Consent_IsCarriedIntoDerivedResults) {
  write_small_capture(capture_, SmallCapture());  // with labels: there are clothes
  make_template(workspace_);
  for (const char* time : {"first", "done already"}) {
    const ChildResult result = run({"--from", "flatten", "--to", "flatten"});
    ASSERT_EQ(result.exit_code, 0) << time << result.err;
  }
  const Manifest made = manifest("flatten");
  ASSERT_EQ(made.consent.size(), 1U);
  EXPECT_EQ(made.consent.front().who, "P. Doe");
  EXPECT_GE(made.metrics.at("panels"), 1);
  EXPECT_TRUE(fs::exists(workspace_ / "flatten/current/upper/pattern.svg"));
}

TEST_F(Run, Status_TracesDerivedInputsBackToResults) {
  write_small_capture(capture_, SmallCapture());
  make_template(workspace_);
  ASSERT_EQ(run({"--from", "flatten", "--to", "flatten"}).exit_code, 0);
  const auto status = [&] {
    const std::string all = run_child({program_path(), "status", workspace_.string()}).out;
    return all.substr(all.find("\nflatten"));
  };
  EXPECT_THAT(status(), AllOf(HasSubstr("outdated"), HasSubstr("'template' before it is outdated")))
      << "a version of the stage that is no more";
  fs::remove(workspace_ / "template" / "current");
  EXPECT_THAT(status(),
              HasSubstr("its input surface is made from a result of 'template' that is no "
                        "longer the current one"));
  std::ofstream(workspace_ / "surfaces" / "made_of.txt") << "2\n../template 0123\n";
  EXPECT_THAT(status(), AllOf(HasSubstr("input surface changed"), Not(HasSubstr("is made of"))));
}

// What is registered is laid flat without what folds took; where its wearer looks is kept, but it
// is in nobody's pose, and so has no weight that could be taken out.
TEST_F(Run, RegisteredGarment_IsFlattenedFromItsRestSurface) {
  write_small_capture(capture_, SmallCapture());
  make_result(workspace_, "template", [](const fs::path& folder) {
    fs::create_directory(folder / "garments");
    write_patch(folder / "garments" / "upper.obj", 0.05);
    std::ofstream(folder / "template.json")
        << R"({"garments": [{"label": "upper", "frame": 3, "facing": [0.6, 0, 0.8]}]})";
  });
  make_result(workspace_, "register", [](const fs::path& folder) {
    fs::create_directories(folder / "registered" / "upper");
    write_patch(folder / "registered" / "upper" / "rest.obj", 0.06);
    fs::create_directory(folder / "registered" / "upper" / "frames");
    for (std::size_t i = 0; i < kRestFrames; ++i) {
      std::ofstream(folder / "registered" / "upper" / "frames" / std::to_string(i)) << i;
    }
  });
  const ChildResult result = run({"--from", "flatten", "--to", "flatten"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Mesh flat = read_mesh(workspace_ / "flatten/current/upper/garment.obj");
  EXPECT_NEAR(face_areas(flat.vertices, flat.faces).sum(), 0.36 * 0.3, 1e-3);
  EXPECT_LT(manifest("flatten").metrics.at("deviation_max"), 1e-3);  // it lies flat already
  const auto note = nlohmann::json::parse(
      read_file_text(workspace_ / "surfaces" / "template.json", 1 << 16))["garments"][0];
  EXPECT_EQ(note["facing"], nlohmann::json({0.6, 0, 0.8}));
  EXPECT_EQ(note["rest"], true);
  EXPECT_FALSE(note.contains("frame"));

  const ChildResult relaxed =
      run_child({program_path(), "flatten", (workspace_ / "surfaces").string(), workspace_.string(),
                 "--relax.body", (workspace_ / "surfaces" / "upper.obj").string(), "--dry-run"});
  if (relaxed.err.find("unknown") == std::string::npos) {  // built with simulation
    EXPECT_EQ(relaxed.exit_code, 3);
    EXPECT_THAT(relaxed.err, AllOf(HasSubstr("upper.obj: a rest surface"),
                                   HasSubstr("WORKSPACE/template/current")));
  }
}

// So that the pattern can be sewn anew and held against it: the body of another frame is nobody's.
TEST_F(Run, BodyOfTheTemplatesFrame_IsKeptBesideTheSurfaces) {
  write_small_capture(capture_, SmallCapture());
  make_result(workspace_, "template", [](const fs::path& folder) {
    fs::create_directory(folder / "garments");
    write_patch(folder / "garments" / "upper.obj", 0.05);
    std::ofstream(folder / "template.json")
        << R"({"garments": [{"label": "upper", "frame": 3, "facing": [0, 0, 1]}]})";
  });
  Mesh ball = sphere(2);
  ball.vertices *= 0.1;
  Mesh other = ball;
  other.vertices.array() += 5;
  make_result(workspace_, "body", [&](const fs::path& folder) {
    write_sequence(folder, sequence_of({other, ball}, 10, {2, 3}));
  });
  const ChildResult result = run({"--from", "flatten", "--to", "flatten"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const fs::path captured = workspace_ / "surfaces" / "captured" / "upper";
  EXPECT_EQ(read_mesh(captured / "body.obj").vertices, ball.vertices);
  EXPECT_EQ(read_mesh(captured / "garment.obj").faces.rows(),
            read_mesh(workspace_ / "surfaces" / "upper.obj").faces.rows());
  EXPECT_EQ(nlohmann::json::parse(read_file_text(captured / "captured.json", 1 << 10)),
            (nlohmann::json{{"frame", 3}}));
  EXPECT_TRUE(manifest("flatten").metrics.contains("sewn_mean"));
  const ChildResult again = run({"--from", "flatten", "--to", "flatten"});
  EXPECT_THAT(again.out, HasSubstr("flatten is done already"));
}

TEST_F(Run, RegistrationOfAnEarlierVersion_IsNamed) {
  write_small_capture(capture_, SmallCapture());
  make_template(workspace_);
  const fs::path registered = make_result(workspace_, "register", [](const fs::path& folder) {
    fs::create_directories(folder / "registered" / "upper");
    write_patch(folder / "registered" / "upper" / "template.obj", 0.05);
  });
  const ChildResult result = run({"--from", "flatten", "--to", "flatten"});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, AllOf(HasSubstr((registered / "registered/upper: rest.obj").string()),
                                HasSubstr("run 'atelier register' again")));
}

TEST_F(Run, SurfacesOfAnEarlierTemplate_AreWarnedOf) {
  write_small_capture(capture_, SmallCapture());
  make_template(workspace_);
  ASSERT_EQ(run({"--from", "flatten", "--to", "flatten"}).exit_code, 0);
  const auto flatten = [&](std::vector<std::string> more) {
    std::vector<std::string> all = {program_path(), "flatten", (workspace_ / "surfaces").string(),
                                    workspace_.string()};
    all.insert(all.end(), more.begin(), more.end());
    const ChildResult result = run_child(all);
    return result.out + result.err;
  };
  EXPECT_THAT(flatten({"--dry-run"}), Not(HasSubstr("no longer the current one")));
  // Another result takes its place, as where a template is recomputed.
  make_template(workspace_, 2);
  for (const std::string& said : {flatten({"--dry-run"}), flatten({})}) {
    EXPECT_THAT(said,
                HasSubstr("surfaces is made from a result of 'template' that is no longer the "
                          "current one; run 'atelier run CAPTURE " +
                          workspace_.string() + " --from flatten --to flatten' to recompute it"));
  }
}

TEST_F(Run, SurfacesOfAnEarlierTemplate_AreFoundByAnyPath) {
  const fs::path made = make_template(workspace_);
  const fs::path surfaces = workspace_ / "surfaces";
  fs::create_directory(surfaces);
  for (const char* name : {"upper.obj", "mine.obj"}) {
    fs::copy_file(made / "garments" / "upper.obj", surfaces / name);
  }
  std::ofstream(surfaces / "made_of.txt") << "3\ntemplate 0000000000000000\nupper.obj 01\n";
  const auto planned = [&](const std::string& input) {
    const ChildResult result =
        run_child({program_path(), "flatten", input, workspace_.string(), "--dry-run"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.out + result.err;
  };
  const std::string place = workspace_.string();
  for (const std::string& input :
       {place + "/surfaces", place + "/surfaces/", place + "/surfaces/.",
        place + "/template/../surfaces", fs::relative(surfaces).string(),
        fs::relative(surfaces).string() + "/", place + "/surfaces/upper.obj",
        fs::relative(surfaces / "upper.obj").string()}) {
    EXPECT_THAT(planned(input), HasSubstr("is made from a result of 'template' that is no longer"))
        << input;
  }
  EXPECT_THAT(planned(place + "/surfaces/mine.obj"), Not(HasSubstr("no longer the current")))
      << "somebody put it there";
}

TEST_F(Run, DamagedDerivedInputs_AreRecomputed) {
  write_small_capture(capture_, SmallCapture());
  make_template(workspace_);
  const std::vector<std::string> flatten = {"--from", "flatten", "--to", "flatten"};
  ASSERT_EQ(run(flatten).exit_code, 0);
  const Digest expected = outputs_digest(manifest("flatten"));
  const fs::path file = workspace_ / "surfaces" / "upper.obj";
  const std::string sound = read_file_text(file, 1 << 20);
  std::string bit = sound;
  bit[sound.find("0.05")] = '1';
  for (const std::string& damaged : {bit, sound.substr(0, sound.size() / 2), std::string()}) {
    std::ofstream(file) << damaged;
    const ChildResult result = run(flatten);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.out, HasSubstr("flatten is done already"));
    EXPECT_EQ(read_file_text(file, 1 << 20), sound);
  }
  fs::remove(file);
  EXPECT_THAT(run(flatten).out, HasSubstr("flatten is done already"));
  EXPECT_EQ(outputs_digest(manifest("flatten")), expected);
}

TEST_F(Run, DamagedResult_IsNotBuiltUpon) {
  write_small_capture(capture_, SmallCapture());
  std::ofstream(make_template(workspace_) / "garments" / "upper.obj", std::ios::app) << "v 9 9 9\n";
  const ChildResult result = run({"--from", "flatten", "--to", "flatten"});
  EXPECT_EQ(result.exit_code, 3) << result.out;
  EXPECT_THAT(result.err, HasSubstr("run 'atelier template' again"));
  EXPECT_FALSE(has_result("flatten"));
}

}  // namespace
}  // namespace atelier::fixtures

#endif
