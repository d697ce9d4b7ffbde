// Figures of networks with known answers: images, motion and what networks draw are made by hand.
#include "pipeline/appearance/appearance_judgement.h"

#include <Eigen/Geometry>
#include <cmath>
#include <map>
#include <memory>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/io/srgb.h"
#include "core/raster.h"
#include "tests/pipeline/appearance/waving_capture.h"

namespace atelier::fixtures {
namespace {

/// A flat sheet of cloth under two cameras, in two frames of a motion: it turns and slides.
struct JudgedSheet {
  GroundTruth truth;
  std::vector<Camera> cameras = {WavingCapture::camera_of(3), WavingCapture::camera_of(7)};
  SimulatedMotion motion;
  WornSubject in_truth;

  JudgedSheet() {
    truth.body = WavingCapture::ball();
    GroundTruthGarment garment;
    garment.garment.name = "cloth";
    garment.garment.mesh = sheet(8);
    garment.label = Label::Dress;
    truth.garments = {garment};
    in_truth = worn_in_truth("", std::make_shared<const GroundTruth>(truth));
    motion.motion = "slide";
    for (int f = 0; f < 2; ++f) {
      GroundTruthFrame frame;
      frame.frame_id = f;
      frame.body = truth.body.vertices;
      frame.garments = {moved(truth.garments[0].garment.mesh.vertices, f)};
      motion.frames.push_back(frame);
      motion.pictures.emplace_back();
    }
  }

  static Mesh sheet(int cells) {
    Mesh mesh = grid(cells, cells);
    mesh.uvs.resize(mesh.vertices.rows(), 2);
    mesh.uvs.col(0) = mesh.vertices.col(0);
    mesh.uvs.col(1) = 1 - mesh.vertices.col(2).array();
    mesh.uv_faces = mesh.faces;
    mesh.vertices.col(1).setConstant(1);
    return mesh;
  }
  static Points moved(const Points& vertices, int frame) {
    const Eigen::RowVector3d middle(0.5, 1, 0.5);
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(0.4 - 1.1 * frame, Eigen::Vector3d::UnitY()).toRotationMatrix();
    Points all = (vertices.rowwise() - middle) * turn.transpose();
    all.rowwise() += middle + Eigen::RowVector3d(0.05 * frame, 0.1, 0);
    return all;
  }
  /// Images in which every pixel of the sheet has the byte that its u says, as the camera's gain
  /// makes it; grey round it.
  void take_pictures(const std::function<double(double u)>& byte) {
    const Mesh& mesh = truth.garments[0].garment.mesh;
    for (std::size_t f = 0; f < motion.frames.size(); ++f) {
      motion.pictures[f].clear();
      for (const Camera& camera : cameras) {
        const Raster raster = rasterize(motion.frames[f].garments[0], mesh.faces, camera);
        Image picture(camera.width, camera.height, 3);
        for (std::size_t i = 0; i < raster.face.data.size(); ++i) {
          const int face = raster.face.data[i];
          double u = 0;
          for (Index k = 0; face >= 0 && k < 3; ++k) {
            u += raster.barycentric.data[3 * i + static_cast<std::size_t>(k)] *
                 mesh.uvs(mesh.faces(face, k), 0);
          }
          for (std::size_t c = 0; c < 3; ++c) {
            picture.data[3 * i + c] = static_cast<float>(camera.gain[static_cast<Index>(c)] *
                                                         (face < 0 ? 0.2 : light_of(byte(u))));
          }
        }
        motion.pictures[f].push_back(std::move(picture));
      }
    }
  }
  static double light_of(double byte) {
    return linear_from_srgb(static_cast<float>(std::round(byte)) / 255);
  }

  /// Figures of a network and a still texture that have these bytes at u.
  std::map<std::string, Measure> figures(const JudgedScenes& scenes, std::size_t own,
                                         const Mesh& drawn_mesh,
                                         const std::function<double(double u)>& network,
                                         const std::function<double(double u)>& still) const {
    DrawnSurfaces drawn =
        asked_of(scenes, own, 1, cameras, {drawn_mesh.uvs, drawn_mesh.uv_faces, {}}, {});
    for (const AppearanceView& view : drawn.own.views) {
      for (const float u : view.u) {
        drawn.colors.drawn.insert(drawn.colors.drawn.end(), 3,
                                  static_cast<float>(light_of(network(u))));
        drawn.colors.fixed.insert(drawn.colors.fixed.end(), 3,
                                  static_cast<float>(light_of(still(u))));
      }
    }
    JudgedNetworks judged;
    judged.resolution = 512;
    judged.setting = "standard";
    std::vector<Camera> trained = cameras;
    for (Camera& camera : trained) {
      camera.gain = Eigen::Vector3d::Ones();
      camera.id += "_trained";
    }
    std::vector<std::string> names;
    std::vector<Camera> all = cameras;
    for (const Camera& camera : trained) {
      names.push_back(camera.id);
      all.push_back(camera);
    }
    compare_pictures(judged.simulated, drawn, gains_of(cameras, all, names), scenes.picture);
    judged.garments = {{"dress", false, judged.simulated}};
    std::map<std::string, Measure> measures;
    for (const Measure& measure : measures_of("appearance", judged, motion.motion)) {
      measures[measure.key] = measure;
    }
    return measures;
  }
};

TEST(AppearanceJudgement, KnownDifference_GivesTheExpectedPsnr) {
  JudgedSheet sheet;
  const auto all = [](double byte) { return [byte](double) { return byte; }; };
  sheet.take_pictures(all(100));
  const JudgedScenes scenes =
      simulated_scenes(sheet.motion, sheet.truth, sheet.in_truth, nullptr, {});
  const auto figures =
      sheet.figures(scenes, 1, sheet.truth.garments[0].garment.mesh, all(90), all(120));
  // Ten and twenty steps of 255 everywhere.
  const Measure& drawn = figures.at("appearance.simulated_psnr_db");
  EXPECT_NEAR(drawn.value, 20 * std::log10(25.5), 1e-4);
  EXPECT_NEAR(figures.at("appearance.simulated_static_psnr_db").value, 20 * std::log10(12.75),
              1e-4);
  EXPECT_EQ(drawn.target, 28);
  EXPECT_TRUE(is_met(drawn));
  EXPECT_THAT(drawn.note, ::testing::HasSubstr("does not show: slide"));
  EXPECT_EQ(figures.at("appearance.covered").value, 1);
}

TEST(AppearanceJudgement, GroundTruthCameraGain_IsApplied) {
  JudgedSheet sheet;
  for (Camera& camera : sheet.cameras) {
    camera.gain = {1.3, 1, 0.7};
  }
  const auto byte = [](double) { return 120.0; };
  sheet.take_pictures(byte);
  const JudgedScenes scenes =
      simulated_scenes(sheet.motion, sheet.truth, sheet.in_truth, nullptr, {});
  const auto figures = sheet.figures(scenes, 1, sheet.truth.garments[0].garment.mesh, byte, byte);
  EXPECT_EQ(figures.at("appearance.simulated_psnr_db").value, 90) << "the same bytes";
}

TEST(AppearanceJudgement, Templates_FollowTheGroundTruthTriangles) {
  JudgedSheet sheet;
  const auto ramp = [](double u) { return 40 + 150 * u; };
  sheet.take_pictures(ramp);
  // The same sheet in other triangles, as registration might have found it.
  const Mesh own = JudgedSheet::sheet(5);
  WornSubject worn;
  worn.subject.names = {"body", "dress"};
  worn.subject.faces = {sheet.truth.body.faces, own.faces};
  worn.templates = {sheet.truth.body, own};
  worn.labels = {static_cast<int>(Label::Skin), static_cast<int>(Label::Dress)};
  worn.first_garment = 1;
  ASSERT_EQ(same_garment(sheet.in_truth, worn.labels[1]), 1U);
  const Mesh& there = sheet.truth.garments[0].garment.mesh;
  const JudgedScenes scenes =
      simulated_scenes(sheet.motion, sheet.truth, sheet.in_truth, &worn,
                       {{1, 1, bind_to_truth(own.vertices, there.vertices, there.faces)}});
  for (int f = 0; f < 2; ++f) {
    const std::vector<Points> surfaces = scenes.own.subject.load(f);
    ASSERT_EQ(surfaces.size(), 2U);
    EXPECT_LT((surfaces[1] - JudgedSheet::moved(own.vertices, f)).cwiseAbs().maxCoeff(), 1e-9);
  }
  // A network that knows the ramp draws it wherever the cloth goes, but for the rounding of bytes.
  const auto flat = [](double) { return 115.0; };
  const auto figures = sheet.figures(scenes, 1, own, ramp, flat);
  EXPECT_GT(figures.at("appearance.simulated_psnr_db").value, 50);
  EXPECT_LT(figures.at("appearance.simulated_static_psnr_db").value, 25);
  EXPECT_GT(figures.at("appearance.covered").value, 0.99);
  // Images of the other moment are none of it.
  std::swap(sheet.motion.pictures[0], sheet.motion.pictures[1]);
  EXPECT_LT(sheet.figures(scenes, 1, own, ramp, flat).at("appearance.simulated_psnr_db").value, 25);
}

TEST(AppearanceJudgement, UncoveredPixels_AreCountedButNotCompared) {
  JudgedSheet sheet;
  const auto byte = [](double) { return 100.0; };
  sheet.take_pictures(byte);
  // A template that ends at half of the sheet.
  Mesh own = JudgedSheet::sheet(8);
  own.vertices.col(0) *= 0.5;
  own.uvs.col(0) *= 0.5;
  WornSubject worn = sheet.in_truth;
  worn.subject.faces[1] = own.faces;
  worn.templates[1] = own;
  const Mesh& there = sheet.truth.garments[0].garment.mesh;
  const JudgedScenes scenes =
      simulated_scenes(sheet.motion, sheet.truth, sheet.in_truth, &worn,
                       {{1, 1, bind_to_truth(own.vertices, there.vertices, there.faces)}});
  const auto figures = sheet.figures(scenes, 1, own, byte, byte);
  EXPECT_EQ(figures.at("appearance.simulated_psnr_db").value, 90);
  EXPECT_NEAR(figures.at("appearance.covered").value, 0.5, 0.06);
}

TEST(AppearanceJudgement, EachGarment_HasTheTargetOfItsCloth) {
  // Of as many pixels each, one is 0.01 off in each channel and one 0.03: 40 dB and 30.5.
  const auto judged = [](const std::string& name, bool printed, double off, double covered) {
    JudgedGarment garment{name, printed, {}};
    garment.compared.drawn = {300 * off * off, 300, 0, 0, 100 * covered, 0};
    garment.compared.fixed = garment.compared.drawn;
    garment.compared.judged = 100;
    garment.compared.covered = covered;
    return garment;
  };
  JudgedNetworks networks;
  networks.resolution = 512;
  networks.garments = {judged("tee", true, 0.03, 90), judged("trousers", false, 0.01, 100)};
  std::map<std::string, Measure> measures;
  for (const Measure& measure : measures_of("appearance", networks, "")) {
    measures[measure.key] = measure;
  }
  EXPECT_NEAR(measures.at("appearance.tee_psnr_db").value, -20 * std::log10(0.03), 1e-9);
  EXPECT_EQ(measures.at("appearance.tee_psnr_db").target, 30);
  EXPECT_EQ(measures.at("appearance.trousers_psnr_db").target, 34);
  EXPECT_NEAR(measures.at("appearance.psnr_db").value, -10 * std::log10(0.0005), 1e-9);
  EXPECT_EQ(measures.at("appearance.psnr_db").target, 34) << "one of them is not printed";
  EXPECT_NEAR(measures.at("appearance.covered").value, 0.95, 1e-12);
  EXPECT_TRUE(is_met(measures.at("appearance.covered")));
  // A garment alone has no figure beside the whole one.
  networks.garments = {judged("dress", true, 0.03, 90)};
  const std::vector<Measure> alone = measures_of("appearance", networks, "");
  EXPECT_EQ(alone[0].target, 30);
  for (const Measure& measure : alone) {
    EXPECT_THAT(measure.key, ::testing::Not(::testing::HasSubstr("dress")));
    if (measure.key == "appearance.covered") {
      EXPECT_FALSE(is_met(measure)) << "a tenth is in no figure";
    }
  }
}

TEST(AppearanceJudgement, Shadow_IsTheQuarterSeeingLeastOfTheSky) {
  JudgedSheet sheet;
  // A wall along u = 0, which goes with the sheet and hides the sky from what is near to it.
  sheet.truth.body = mesh_of({{-0.01, 1, -1}, {-0.01, 1, 2}, {-0.01, 1.4, 2}, {-0.01, 1.4, -1}},
                             {{0, 1, 2}, {0, 2, 3}});
  sheet.in_truth = worn_in_truth("", std::make_shared<const GroundTruth>(sheet.truth));
  for (GroundTruthFrame& frame : sheet.motion.frames) {
    frame.body = JudgedSheet::moved(sheet.truth.body.vertices, frame.frame_id);
  }
  const auto flat = [](double) { return 100.0; };
  sheet.take_pictures(flat);
  const JudgedScenes scenes =
      simulated_scenes(sheet.motion, sheet.truth, sheet.in_truth, nullptr, {});
  // Twenty steps off in the half beside the wall, and nowhere else.
  const auto figures = sheet.figures(
      scenes, 1, sheet.truth.garments[0].garment.mesh,
      [](double u) { return u < 0.5 ? 80.0 : 100.0; }, flat);
  const double off = 20 * std::log10(255 / 20.0);
  EXPECT_NEAR(figures.at("appearance.shadow_psnr_db").value, off, 1e-4);
  EXPECT_NEAR(figures.at("appearance.psnr_db").value, off + 10 * std::log10(2.0), 0.2);
}

TEST(AppearanceJudgement, Gains_AreRelativeToTheMeanOfTrainingCameras) {
  std::vector<Camera> all(3);
  all[0].id = "a";
  all[1].id = "b";
  all[2].id = "held";
  all[0].gain = {2, 1, 1};
  all[1].gain = {8, 1, 1};
  all[2].gain = {6, 1, 0.5};
  const auto gains = gains_of({all[2]}, all, {"a", "b"});
  ASSERT_EQ(gains.size(), 1U);
  EXPECT_NEAR(gains[0].x(), 1.5, 1e-12);  // 6 over the root of 2 x 8
  EXPECT_NEAR(gains[0].z(), 0.5, 1e-12);
}

}  // namespace
}  // namespace atelier::fixtures
