// SMC files (HDF5) of DNA-Rendering that are wrong: refused by file and name, or left out and said.

#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <string>

#include <gtest/gtest.h>

#include "capture/frame_reader.h"
#include "capture/layouts/open_dataset.h"
#include "capture/layouts/write_layout.h"
#include "core/archive.h"
#include "core/error.h"
#include "core/io/ground_truth_archive.h"
#include "tests/capture/small_capture.h"
#include "tests/support/refusals.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;
using Arrays = std::map<std::string, Tensor>;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

RowMatrix rows(Index row_count, Index columns, double value) {
  return RowMatrix::Constant(row_count, columns, value);
}

class Dna : public ::testing::Test {
 protected:
  Dna() {
    fixtures::write_small_capture(folder_ / "capture");
    capture_ = write_layout(folder_ / "capture", "dna", folder_ / "out").folders.front();
    annotations_ = capture_ / "annotations" / "clothed_annots.smc";
    sound_ = read_archive(annotations_, "dna.annotations", 1);
  }

  /// The same capture with other annotations.
  void write(const std::function<void(Arrays&)>& change) const {
    Archive archive = sound_;
    change(archive.datasets);
    write_archive(annotations_, archive);
  }

  /// That annotations with this array are refused, with the file, the array and these words.
  void refused(const std::string& name, const Tensor& tensor, const std::string& words) const {
    SCOPED_TRACE(name);
    write([&](Arrays& arrays) { arrays[name] = tensor; });
    try {
      open_dataset(capture_);
      ADD_FAILURE() << "was read; " << words;
    } catch (const DataError& error) {
      const std::string said = error.what();
      EXPECT_NE(said.find("clothed_annots.smc"), std::string::npos) << said;
      EXPECT_NE(said.find(words), std::string::npos) << said;
    }
  }

  fixtures::TemporaryDirectory folder_;
  fs::path capture_;
  fs::path annotations_;
  Archive sound_;
};

const Finding* find(const Dataset& dataset, const std::string& code) {
  for (const Finding& finding : dataset.findings) {
    if (finding.code == code) {
      return &finding;
    }
  }
  return nullptr;
}

TEST_F(Dna, NonFiniteCameraParameters_AreRefused) {
  RowMatrix k = matrix_of(sound_.datasets.at("Camera_Parameter/01/K"));
  k(0, 2) = kNan;
  refused("Camera_Parameter/01/K", tensor_of(k), "Camera_Parameter/01/K");
  RowMatrix rt = matrix_of(sound_.datasets.at("Camera_Parameter/01/RT"));
  rt(1, 3) = std::numeric_limits<double>::infinity();
  refused("Camera_Parameter/01/RT", tensor_of(rt), "Camera_Parameter/01/RT");
  refused("Camera_Parameter/02/D", tensor_of(std::vector<double>{0, kNan, 0, 0, 0}),
          "Camera_Parameter/02/D");
  refused("Camera_Parameter/00/Color_Calibration", tensor_of(rows(3, 3, kNan)),
          "Camera_Parameter/00/Color_Calibration");
}

TEST_F(Dna, MatricesOfOtherSize_AreRefused) {
  refused("Camera_Parameter/01/K", tensor_of(rows(2, 3, 1)), "Camera_Parameter/01/K");
  refused("Camera_Parameter/01/K", tensor_of(rows(3, 4, 1)), "Camera_Parameter/01/K");
  refused("Camera_Parameter/01/K", tensor_of(rows(0, 3, 1)), "Camera_Parameter/01/K");
  refused("Camera_Parameter/01/K", tensor_of(std::vector<double>(9, 1)), "Camera_Parameter/01/K");
  refused("Camera_Parameter/01/RT", tensor_of(rows(3, 3, 0)), "Camera_Parameter/01/RT");
  refused("Camera_Parameter/01/RT", tensor_of(rows(5, 4, 0)), "Camera_Parameter/01/RT");
  refused("Camera_Parameter/01/RT", tensor_of(rows(4, 4, 0)), "no rigid transform");
  refused("Camera_Parameter/01/D", tensor_of(std::vector<double>(7, 0)),
          "7 coefficients of distortion");
  refused("Camera_Parameter/01/Color_Calibration", tensor_of(rows(2, 4, 1)),
          "Camera_Parameter/01/Color_Calibration");
}

TEST_F(Dna, ContradictoryCameras_AreRefused) {
  RowMatrix k = matrix_of(sound_.datasets.at("Camera_Parameter/01/K"));
  refused("Camera_Parameter/01/K", tensor_of(RowMatrix(k.transpose())), "transposed");
  refused("Camera_Parameter/1/K", tensor_of(k), "each once");
  refused("Camera_Parameter/left/K", tensor_of(k), "'left'");
  write([](Arrays& arrays) { arrays.erase("Camera_Parameter/01/RT"); });
  ATELIER_EXPECT_REFUSED(open_dataset(capture_), DataError, "Camera_Parameter/01/RT");
  write([](Arrays& arrays) {
    std::erase_if(arrays, [](const auto& entry) { return entry.first.starts_with("Camera_"); });
  });
  ATELIER_EXPECT_REFUSED(open_dataset(capture_), DataError, "no camera");
}

TEST_F(Dna, CameraWithoutRotation_IsLeftOutWithAnError) {
  RowMatrix rt = RowMatrix::Identity(4, 4);
  rt(0, 0) = 3;
  write([&](Arrays& arrays) { arrays["Camera_Parameter/01/RT"] = tensor_of(rt); });
  const Dataset dataset = open_dataset(capture_);
  EXPECT_EQ(dataset.cameras.size(), 2U);
  EXPECT_TRUE(has_errors(dataset.findings));
}

TEST_F(Dna, KeypointsOfOtherShape_AreLeftOutWithAFinding) {
  write([](Arrays& arrays) {
    arrays["Keypoints_2D/01"] = tensor_of(rows(2, 75, 1));
    arrays["Keypoints_3D/keypoints3d"] =
        tensor_of(std::vector<double>(2 * 133 * 3, 1), {2, 133, 3});
  });
  const Dataset dataset = open_dataset(capture_);
  const Finding* finding = find(dataset, "keypoints-shape");
  ASSERT_NE(finding, nullptr);
  EXPECT_NE(finding->place.find("Keypoints_2D/01"), std::string::npos) << finding->place;
  EXPECT_NE(finding->what.find("[2,75]"), std::string::npos) << finding->what;
  EXPECT_TRUE(dataset.frames[1].keypoints.empty());
  EXPECT_FALSE(dataset.frames[0].keypoints.empty());
  EXPECT_TRUE(dataset.keypoints3d.empty());
}

TEST_F(Dna, NonFiniteKeypoints_AreRefusedWhenRead) {
  write([](Arrays& arrays) {
    arrays["Keypoints_2D/01"] = tensor_of(std::vector<double>(2 * 25 * 3, kNan), {2, 25, 3});
  });
  FrameReader reader(open_dataset(capture_));
  ATELIER_EXPECT_REFUSED(reader.keypoints(1, 0), DataError, "Keypoints_2D/01");
  EXPECT_FALSE(reader.keypoints(0, 0).empty());
}

TEST_F(Dna, EmptyKeypointRows_AreNotCounted) {
  write([](Arrays& arrays) {
    arrays["Keypoints_2D/01"] = {ElementType::Float64, {1'000'000, 0, 3}, {}, {}};
  });
  EXPECT_NE(find(open_dataset(capture_), "keypoints-shape"), nullptr);
  write([](Arrays& arrays) {
    arrays["Keypoints_2D/01"] = tensor_of(std::vector<double>(9 * 3, 1), {9, 1, 3});
  });
  Limits few;
  few.frames = 10;
  DatasetOptions options;
  ATELIER_EXPECT_REFUSED(open_dataset(capture_, options, few), DataError, "frames of keypoints");
}

TEST_F(Dna, BrokenImage_IsRefusedByName) {
  write([](Arrays& arrays) {
    arrays["Mask/01/mask/0"] = tensor_of(std::vector<double>{1, 2, 3});
    arrays["Mask/02/mask/0"] = {
        ElementType::UInt8, {4}, std::vector<std::byte>(4, std::byte{7}), {}};
  });
  FrameReader reader(open_dataset(capture_));
  ATELIER_EXPECT_REFUSED(reader.mask(1, 0), DataError, "Mask/01/mask/0");
  ATELIER_EXPECT_REFUSED(reader.mask(2, 0), DataError, "Mask/02/mask/0");
  EXPECT_TRUE(reader.mask(0, 0).has_value());
}

}  // namespace
}  // namespace atelier
