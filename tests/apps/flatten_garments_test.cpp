// Garments of the test data through the program: whatever their seams and unit, no panel of what is
// written is turned or lies over itself, and both sides of seams are equal. ATELIER_SOAK=1 takes
// all, with all kinds of seams, in several units.

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/io/mesh_file.h"
#include "registration/flattening/flat_overlaps.h"
#include "tests/support/child_process.h"
#include "tests/support/places.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/test_data.h"

namespace atelier {
namespace {

struct GarmentFile {
  const char* path;
  const char* unit;
  bool has_uvs;
  bool quick;  ///< its seams are found within seconds
};

constexpr GarmentFile kGarments[] = {
    {"garments/diffcloth/dress-handsup-drape.obj", "dm", false, false},
    {"garments/diffcloth/dress-v5k-f10k.obj", "dm", false, false},
    {"garments/diffcloth/dress-v7k-f14k.obj", "dm", false, false},
    {"garments/diffcloth/skirt3448.obj", "m", false, true},
    {"garments/diffcloth/sock482.obj", "m", true, true},
    {"garments/diffcloth/tshirt1900.obj", "dm", true, false},
    {"garments/diffcloth/tshirt1900-flattened.obj", "dm", false, false},
    {"makehuman/clothes/female_elegantsuit01/female_elegantsuit01.obj", "dm", true, false},
    {"makehuman/clothes/female_sportsuit01/female_sportsuit01.obj", "dm", true, false},
    {"makehuman/clothes/male_casualsuit03/male_casualsuit03.obj", "dm", true, false},
    {"makehuman/clothes/male_casualsuit04/male_casualsuit04.obj", "dm", true, false},
    {"makehuman/clothes/male_elegantsuit01/male_elegantsuit01.obj", "dm", true, false},
    {"makehuman/clothes/shoes06/shoes06.obj", "dm", true, false},
};

class FlattenGarments : public ::testing::TestWithParam<GarmentFile> {
 protected:
  void SetUp() override {
    const auto help = fixtures::run_child({fixtures::program_path(), "flatten", "--help"});
    if (help.out.find("--mesh") == std::string::npos) {
      GTEST_SKIP() << "built without flatten";
    }
  }

  /// Flattens a garment and judges what was written.
  void expect_apart(const std::filesystem::path& file, const std::string& seams,
                    const std::string& unit, bool to_the_bound) const {
    SCOPED_TRACE(file.filename().string() + " " + seams + " " + unit);
    const fixtures::TemporaryDirectory root;
    const auto out = root.path() / "out";
    const auto result = fixtures::run_child({fixtures::program_path(), "flatten", "--mesh",
                                             file.string(), "--out", out.string(), "--seams", seams,
                                             "--input.unit", unit, "--no-pictures", "--json"});
    ASSERT_TRUE(result.exit_code == 0 || (!to_the_bound && result.exit_code == 4)) << result.err;
    const nlohmann::json json = nlohmann::json::parse(result.out);
    EXPECT_EQ(json["inverted"], 0);
    EXPECT_EQ(json["overlaps"], 0);
    EXPECT_LE(json["seam_mismatch"].get<double>(), 0.003);
    if (seams == "auto" && to_the_bound) {
      EXPECT_LE(json["stretch_p99"].get<double>(), 0.03);
    }
    const Mesh garment = read_mesh(out / "garment.obj");  // panels side by side
    EXPECT_EQ(turned_faces(garment.uvs, garment.uv_faces), 0);
    EXPECT_TRUE(overlapping_faces(garment.uvs, garment.uv_faces).empty());
  }
};

TEST_P(FlattenGarments, RealGarments_LieApartWithEqualSeams) {
  const GarmentFile garment = GetParam();
  ATELIER_TEST_FILE(file, garment.path);
  const bool soak = std::getenv("ATELIER_SOAK") != nullptr;
  expect_apart(file, "none", garment.unit, true);
  if (garment.has_uvs) {
    expect_apart(file, "uvs", garment.unit, true);
  }
  if (garment.quick || soak) {
    expect_apart(file, "auto", garment.unit, true);
  }
  if (soak) {
    // In a wrong unit surfaces are smoothed and give way by other shares: found seams may miss the
    // bound, but nothing may lie over itself.
    for (const std::string unit : {"m", "dm", "cm"}) {
      for (const char* seams : {"none", "uvs", "auto"}) {
        if (unit != garment.unit && (garment.has_uvs || seams != std::string("uvs"))) {
          expect_apart(file, seams, unit, seams != std::string("auto"));
        }
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(OfTheData, FlattenGarments, ::testing::ValuesIn(kGarments),
                         [](const auto& one) {
                           std::string name = std::filesystem::path(one.param.path).stem().string();
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

}  // namespace
}  // namespace atelier
