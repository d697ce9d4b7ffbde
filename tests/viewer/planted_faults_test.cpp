// Faults that are planted in workspaces, and found with the page alone, by what it shows a user who
// looks.

#include <Eigen/Geometry>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/io/mesh_file.h"
#include "tests/apps/dressed_workspace.h"
#include "tests/support/temporary_directory.h"
#include "tests/viewer/look.h"
#include "tests/viewer/person_capture.h"

namespace atelier::fixtures {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::MatchesRegex;
using ::testing::Not;

namespace fs = std::filesystem;

TEST(PlantedFault, CameraThatWasTurned_IsRedAndNamed) {
  SKIP_WITHOUT_BROWSER();
  const TemporaryDirectory root;
  SmallCapture capture = person_capture();
  write_person(root.path() / "capture", capture);
  Camera& bad = capture.cameras[5];
  bad.camera_from_world_rotation =
      Eigen::AngleAxisd(0.05, Eigen::Vector3d::UnitY()) * bad.camera_from_world_rotation;
  write_file_atomically(root.path() / "capture/cameras.json", cameras_json(capture.cameras));
  ASSERT_EQ(view({(root.path() / "capture").string(), "--out", (root.path() / "page").string()})
                .exit_code,
            0);
  const Looked looked = look(
      "file://" + (root.path() / "page/index.html").string(),
      {"wait:document.querySelector('.bars')",
       "eval:[...document.querySelectorAll('.bars button')].filter((_, i) => "
       "document.querySelectorAll('.bar')[i].classList.contains('off')).map(b => b.textContent)",
       "eval:document.getElementById('side-body').textContent",
       "eval:[...document.querySelectorAll('.bar.off')].map(bar => "
       "getComputedStyle(bar).backgroundColor)",
       "eval:atelier.now.info.marks.filter(mark => mark.camera === '" + bad.id +
           "').map(mark => mark.text)"});
  EXPECT_EQ(looked.values.at(0), nlohmann::json({bad.id}));
  EXPECT_THAT(looked.values.at(1).get<std::string>(),
              HasSubstr("Camera " + bad.id + " is more than twice as far off"));
  EXPECT_EQ(looked.values.at(2), nlohmann::json({"rgb(179, 38, 30)"}));
  ASSERT_GE(looked.values.at(3).size(), 1);
  for (const nlohmann::json& text : looked.values.at(3)) {
    EXPECT_THAT(text.get<std::string>(),
                Not(MatchesRegex("((error|warning|note) |[a-z0-9]+-[a-z0-9-]+ \\[).*")));
  }
  EXPECT_THAT(looked.messages, IsEmpty());
}

/// A trunk that breathes.
std::vector<Points> breathing_trunk(int count) {
  std::vector<Points> bodies;
  for (int f = 0; f < count; ++f) {
    bodies.emplace_back(trunk_body().mesh.vertices *
                        Eigen::DiagonalMatrix<double, 3>(1, 1, 1 + 0.03 * std::sin(0.9 * f)));
  }
  return bodies;
}

/// The skirt in some frames, its rest shape in the result, and what is wrong with it.
template <class Fault>
fs::path faulty_workspace(const fs::path& root, Fault fault, bool with_body = false,
                          int count = 12) {
  static std::vector<Points> frames;
  frames.clear();
  for (int f = 0; f < count; ++f) {
    Points skirt =
        tube_skirt().mesh.vertices *
        Eigen::AngleAxisd(0.02 * f, Eigen::Vector3d::UnitY()).toRotationMatrix().transpose();
    fault(f, skirt);
    frames.push_back(skirt);
  }
  static constexpr std::array kStages = {
      Stage{.name = "body",
            .summary = "a body without a fault",
            .inputs = {"capture"},
            .outputs = {"bodies"},
            .options = option_set<NoOptions>,
            .run =
                [](StageRun& run) {
                  write_meshes(run, "", trunk_body().mesh.faces,
                               breathing_trunk(static_cast<int>(frames.size())));
                }},
      Stage{.name = "register",
            .summary = "a skirt with a fault",
            .inputs = {"capture"},
            .outputs = {"registered"},
            .options = option_set<NoOptions>,
            .run =
                [](StageRun& run) {
                  write_meshes(run, "registered/lower", tube_skirt().mesh.faces, frames);
                  run.output("registered/lower/rest.obj", [](const auto& file) {
                    const fs::path named = file.string() + ".obj";
                    write_mesh(named, tube_skirt().mesh);
                    fs::rename(named, file);
                  });
                }},
  };
  SmallCapture capture = person_capture();
  capture.frames.resize(static_cast<std::size_t>(count));
  std::iota(capture.frames.begin(), capture.frames.end(), 0);
  write_small_capture(root / "capture", capture);
  StageRequest request;
  request.input = root / "capture";
  request.workspace = root / "workspace";
  for (const Stage& stage : kStages) {
    if (stage.name == "register" || with_body) {
      request.options = stage.options();
      run_stage(kStages, stage, request);
    }
  }
  return root / "workspace";
}

TEST(PlantedFault, TornFrame_IsThePeakOfTheFigureAndAFinding) {
  SKIP_WITHOUT_BROWSER();
  const TemporaryDirectory root;
  const fs::path workspace = faulty_workspace(
      root.path(),
      [](int f, Points& skirt) {
        if (f == 7) {
          skirt.row(70) += Eigen::RowVector3d(0.4, 0.1, 0);
        }
      },
      true);
  ASSERT_EQ(view({workspace.string(), "--out", (root.path() / "page").string()}).exit_code, 0);
  const Looked looked =
      look("file://" + (root.path() / "page/index.html").string(),
           {"wait:atelier.now.surveyed",
            // The curve over the timeline that a user sees at first, and where its peak is.
            "eval:document.getElementById('series').selectedOptions[0].textContent",
            "eval:(() => { const one = atelier.timeline.seriesList[Number(document.getElementById("
            "'series').value)]; const v = one.values().map(x => x ?? 0); return "
            "[v.indexOf(Math.max(...v)), "
            "Math.max(...v) > 5 * [...v].sort((a, b) => a - b)[6]]; })()",
            // The finding, which leads there.
            "eval:[...document.querySelectorAll('#marks button')].map(mark => mark.ariaLabel)",
            "key:n", kSettled, "eval:document.documentElement.dataset.frame"});
  EXPECT_THAT(looked.values.at(0).get<std::string>(), HasSubstr("lower"));
  EXPECT_EQ(looked.values.at(1), nlohmann::json({7, true}));
  ASSERT_EQ(looked.values.at(2).size(), 1) << looked.values.at(2);
  EXPECT_THAT(looked.values.at(2).at(0).get<std::string>(),
              HasSubstr("Frame 7: lower: torn: edges are up to 4"));
  EXPECT_EQ(looked.values.at(3), "7");
  EXPECT_THAT(looked.messages, IsEmpty());
}

TEST(PlantedFault, TornFrameOfWhatIsNotShown_IsCountedOnItsTab) {
  SKIP_WITHOUT_BROWSER();
  const TemporaryDirectory root;
  const fs::path workspace = faulty_workspace(root.path(), [](int f, Points& skirt) {
    if (f == 7) {
      skirt.row(70) += Eigen::RowVector3d(0.4, 0.1, 0);
    }
  });
  ASSERT_EQ(view({(root.path() / "capture").string(), "--beside", workspace.string(), "--out",
                  (root.path() / "page").string()})
                .exit_code,
            0);
  const Looked looked = look(
      "file://" + (root.path() / "page/index.html").string(),
      {"wait:atelier.timelines[1].surveyed",
       "eval:[...document.querySelectorAll('#tabs button')].map(one => [one.className, "
       "/\\([0-9]+\\)$/.test(one.textContent), one.ariaSelected])",
       // The findings of what is shown lead to the others.
       "wait:([...document.querySelectorAll('#side-tabs button')].at(-1).click(), true)",
       "wait:([...document.querySelectorAll('.finding')].find(one => "
       "one.textContent.includes('torn')).click(), true)",
       "wait:atelier.now.number === 1", kSettled, "eval:document.documentElement.dataset.frame",
       "eval:document.getElementById('message').textContent"});
  ASSERT_EQ(looked.values.size(), 3) << looked.messages;
  EXPECT_EQ(looked.values[0][1], nlohmann::json({"warning", true, "false"}));
  EXPECT_EQ(looked.values[1], "7");
  EXPECT_THAT(looked.values[2].get<std::string>(), HasSubstr("torn"));
  EXPECT_THAT(looked.messages, IsEmpty());
}

TEST(PlantedFault, DamagedFrame_IsAFindingBeforeAnybodyComesUponIt) {
  SKIP_WITHOUT_BROWSER();
  const TemporaryDirectory root;
  const fs::path workspace = faulty_workspace(root.path(), [](int, Points&) {});
  const fs::path frame = workspace / "register/current/registered/lower/frames/000005.h5";
  std::fstream(frame).seekp(-50, std::ios::end) << "damage";
  ASSERT_EQ(view({workspace.string(), "--out", (root.path() / "page").string()}).exit_code, 0);
  const Looked looked =
      look("file://" + (root.path() / "page/index.html").string(),
           {"wait:atelier.now.surveyed", "key:n", kSettled,
            "eval:[...document.querySelectorAll('#marks button')].map(mark => mark.ariaLabel)",
            "eval:document.documentElement.dataset.frame"});
  ASSERT_EQ(looked.values.size(), 2) << looked.messages;
  ASSERT_EQ(looked.values[0].size(), 1) << looked.values[0];
  EXPECT_THAT(looked.values[0][0].get<std::string>(), HasSubstr("frame 5 cannot be read"));
  EXPECT_EQ(looked.values[1], "5");
}

TEST(PlantedFault, TornFrameOfFour_IsAFindingAndSoundOnesAreNone) {
  SKIP_WITHOUT_BROWSER();
  for (const int torn : {-1, 0, 1, 2, 3}) {
    const TemporaryDirectory root;
    const fs::path workspace = faulty_workspace(
        root.path(),
        [&](int f, Points& skirt) {
          // Cloth that swings: edges of one side are longer and shorter by some millimetres.
          skirt.col(0) *= 1 + 0.05 * std::sin(2.0 * f);
          if (f == torn) {
            skirt.topRows(3).array() += 0.15;
          }
        },
        true, 4);
    ASSERT_EQ(view({workspace.string(), "--out", (root.path() / "page").string()}).exit_code, 0);
    const Looked looked =
        look("file://" + (root.path() / "page/index.html").string(),
             {"wait:atelier.now.surveyed",
              "eval:[...document.querySelectorAll('#marks button')].map(mark => "
              "mark.ariaLabel).filter(text => text.includes('torn'))",
              "eval:document.getElementById('series').selectedOptions[0].textContent"});
    ASSERT_EQ(looked.values.size(), 2) << looked.messages;
    ASSERT_EQ(looked.values[0].size(), torn < 0 ? 0 : 1) << torn << ": " << looked.values[0];
    if (torn >= 0) {
      EXPECT_THAT(looked.values[0].at(0).get<std::string>(),
                  HasSubstr("Frame " + std::to_string(torn) + ": lower: torn"));
      EXPECT_THAT(looked.values[1].get<std::string>(), HasSubstr("lower: "));
    }
    EXPECT_THAT(looked.messages, IsEmpty());
  }
}

TEST(PlantedFault, ClothThatSlipsAlongASeam_IsYellowInTheStrainAndAFinding) {
  SKIP_WITHOUT_BROWSER();
  const TemporaryDirectory root;
  // From frame 6 on, the cloth on one side of the seam at the back of the garment's grid slides.
  const fs::path workspace = faulty_workspace(root.path(), [](int f, Points& skirt) {
    for (Index v = 0; f >= 6 && v < skirt.rows(); ++v) {
      if (v % 20 >= 1 && v % 20 < 4) {
        const Eigen::AngleAxisd slide(0.06, Eigen::Vector3d::UnitY());
        skirt.row(v) = (slide * skirt.row(v).transpose()).transpose();
      }
    }
  });
  ASSERT_EQ(view({workspace.string(), "--out", (root.path() / "page").string()}).exit_code, 0);
  const std::string strain =
      "eval:(document.querySelector('.layer select').value = 'strain', "
      "document.querySelector('.layer select').dispatchEvent(new Event('change')), 0)";
  const Looked looked =
      look("file://" + (root.path() / "page/index.html").string(),
           {kSettled, strain, kSettled, "eval:" + kCounts, "key:End", kSettled, "eval:" + kCounts,
            "eval:document.getElementById('legend').textContent", "wait:atelier.now.surveyed",
            "eval:[...document.querySelectorAll('#marks button')].map(mark => mark.ariaLabel)"});
  EXPECT_LT(looked.values.at(1)["yellow"], 0.0005) << "as it rests";
  EXPECT_GT(looked.values.at(2)["yellow"], 0.002) << "the line along the seam";
  EXPECT_THAT(looked.values.at(3).get<std::string>(),
              AllOf(HasSubstr("strain"), HasSubstr("10 % and more")));
  ASSERT_EQ(looked.values.at(4).size(), 1) << looked.values.at(4);
  EXPECT_THAT(looked.values.at(4).at(0).get<std::string>(),
              AllOf(HasSubstr("Frame 6: lower: the strain jumps from 0 % to"), HasSubstr("slips")));
  EXPECT_THAT(looked.messages, IsEmpty());
}

TEST(PlantedFault, OneSlackFrame_IsNoJumpOfTheStrain) {
  SKIP_WITHOUT_BROWSER();
  const TemporaryDirectory root;
  const fs::path workspace = faulty_workspace(
      root.path(), [](int f, Points& skirt) { skirt *= f == 5 ? 1 : 1.08; }, false);
  ASSERT_EQ(view({workspace.string(), "--out", (root.path() / "page").string()}).exit_code, 0);
  const Looked looked =
      look("file://" + (root.path() / "page/index.html").string(),
           {"wait:atelier.now.surveyed",
            "eval:atelier.now.layers[0].figures.strain.map(share => share > 0.05)",
            "eval:[...document.querySelectorAll('#marks button')].map(mark => "
            "mark.ariaLabel).filter(text => text.includes('strain'))"});
  ASSERT_EQ(looked.values.size(), 2) << looked.messages;
  EXPECT_EQ(looked.values[0][4], true);
  EXPECT_EQ(looked.values[0][5], false);
  EXPECT_EQ(looked.values[1].size(), 0) << looked.values[1];
}

TEST(PlantedFault, UserWhoReadsAndClicks_FindsAllThree) {
  SKIP_WITHOUT_BROWSER();
  const TemporaryDirectory root;
  const fs::path workspace = faulty_workspace(root.path(), [](int /*f*/, Points& /*skirt*/) {});
  write_person(root.path() / "person", person_capture());
  setenv("ATELIER", program_path().c_str(), 1);
  const ChildResult result = run_child(
      {"python3", (source_directory() / "tests/viewer/find_faults.py").string(),
       (root.path() / "person").string(), workspace.string(), (root.path() / "out").string(), "1"});
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_THAT(result.out, Not(HasSubstr("the browser says")));
}

}  // namespace
}  // namespace atelier::fixtures
