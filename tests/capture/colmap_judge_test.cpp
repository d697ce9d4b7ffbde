// COLMAP itself reads what we write, and we read what it writes. Skips where COLMAP is not
// installed (scripts/setup --judges).

#include <array>
#include <cstdio>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include "capture/layouts/open_dataset.h"
#include "capture/layouts/write_layout.h"
#include "tests/capture/small_capture.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// What a command prints, "" if it fails.
std::string output_of(const std::string& command) {
  std::FILE* pipe = popen((command + " 2>&1").c_str(), "r");
  if (pipe == nullptr) {
    return "";
  }
  std::string output;
  std::array<char, 4096> part{};
  while (const std::size_t count = std::fread(part.data(), 1, part.size(), pipe)) {
    output.append(part.data(), count);
  }
  const int status = pclose(pipe);
  return WIFEXITED(status) && WEXITSTATUS(status) == 0 ? output : "";
}

class Colmap : public ::testing::Test {
 protected:
  void SetUp() override {
    if (output_of("colmap help").empty()) {
      GTEST_SKIP() << "no program colmap (scripts/setup --judges)";
    }
    Camera& brown = small_.cameras[0];
    brown.distortion_model = Distortion::Brown;
    brown.distortion = {-0.2, 0.05, 0.001, -0.002, 0.003};
    Camera& fisheye = small_.cameras[1];
    fisheye.distortion_model = Distortion::Fisheye;
    fisheye.distortion = {0.02, -0.003, 0.001, 0.0005};
    fixtures::write_small_capture(folder_ / "capture", small_);
  }

  fixtures::TemporaryDirectory folder_;
  fixtures::SmallCapture small_;
};

TEST_F(Colmap, WrittenModel_HasAllCamerasAndImagesInColmap) {
  for (const std::string layout : {"colmap", "colmap_binary"}) {
    const fs::path model =
        write_layout(folder_ / "capture", layout, folder_ / layout).folders.front() / "sparse/0";
    const std::string said = output_of("colmap model_analyzer --path '" + model.string() + "'");
    EXPECT_THAT(said, ::testing::ContainsRegex("Cameras: 3")) << layout;
    EXPECT_THAT(said, ::testing::ContainsRegex("Registered images: 6")) << layout;
  }
}

TEST_F(Colmap, ModelConvertedByColmap_ProjectsToSamePixels) {
  const fs::path model =
      write_layout(folder_ / "capture", "colmap", folder_ / "colmap").folders.front() / "sparse/0";
  const std::array<std::pair<const char*, const char*>, 2> forms = {
      {{"BIN", "colmap_binary"}, {"TXT", "colmap"}}};
  for (const auto& [form, layout] : forms) {
    const fs::path out = folder_ / form / "sparse" / "0";
    fs::create_directories(out);
    output_of("colmap model_converter --input_path '" + model.string() + "' --output_path '" +
              out.string() + "' --output_type " + form);
    const Dataset dataset = open_dataset(folder_ / form);
    EXPECT_EQ(dataset.layout, layout);
    ASSERT_EQ(dataset.cameras.size(), 3U);
    for (std::size_t c = 0; c < 3; ++c) {
      for (const double x : {-0.4, 0.1, 0.3}) {
        const Eigen::Vector3d point(x, 0.9 + x, 0.2 - x);
        const auto expected = project(small_.cameras[c], point);
        const auto pixel = project(dataset.cameras[c], point);
        ASSERT_TRUE(expected && pixel);
        // COLMAP writes all digits of a double in text as well.
        EXPECT_LT((*expected - *pixel).norm(), 1e-9) << form;
      }
    }
  }
}

}  // namespace
}  // namespace atelier
