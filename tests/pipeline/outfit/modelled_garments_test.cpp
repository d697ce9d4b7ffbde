// Garments that others modelled, in their own units, put on the default woman as `simulate --scale
// --move-*` does. Nothing about them is known but their mesh; where it starts inside her, it comes
// out.

#include <gtest/gtest.h>

#include "core/io/mesh_file.h"
#include "core/topology.h"
#include "simulation/contact/crossings.h"
#include "simulation/material/fabric.h"
#include "tests/pipeline/outfit/human_fixture.h"
#include "tests/support/test_data.h"

namespace atelier {
namespace {

using fixtures::woman;

/// How a garment is put on her: her arms turned from the pose at rest until they lie in its
/// sleeves.
struct Worn {
  const char* file;
  double scale;             ///< m per unit
  Eigen::RowVector3d move;  ///< m, of the scaled garment
  double arms;              ///< rad, upwards
  double max_fall;          ///< m, of its upper edge until it hangs
};

class ModelledGarments : public ::testing::TestWithParam<Worn> {};

TEST_P(ModelledGarments, ModelledGarment_HangsOnTheWoman) {
  const Worn& worn = GetParam();
  ATELIER_TEST_FILE(file, std::string("garments/diffcloth/") + worn.file);
  Garment garment;
  garment.mesh = read_mesh(file, {.metres_per_unit = worn.scale, .up = 'y'});
  garment.mesh.vertices.rowwise() += worn.move;
  garment.material = fabric_material("cotton");
  garment.material.thickness = 3e-3;
  const Cloth cloth = make_cloth(garment);
  const Points body = fixtures::posed_woman(
      {{"left_shoulder", {0, 0, worn.arms}}, {"right_shoulder", {0, 0, -worn.arms}}});
  for (const Device device : fixtures::devices()) {
    SCOPED_TRACE(device_name(device));
    XpbdOptions options;
    options.self_contact = true;
    options.substeps = 30;        // at 10 it is so soft that it slips down over her hips
    options.contact_reach = 0.1;  // some of it begins deep inside her
    ClothSolver solver(cloth, woman().mesh.faces, options, device);
    const auto still = [&](int) { return body; };
    const fixtures::Course start =
        fixtures::run_on(solver, woman().mesh.faces, 10, 5, still, cloth.faces);
    const fixtures::Course course =
        fixtures::run_on(solver, woman().mesh.faces, 20, 10, still, cloth.faces);
    EXPECT_TRUE(course.end.positions.allFinite());
    EXPECT_LT(std::max(start.deepest, course.deepest), fixtures::kDeepest);
    EXPECT_LT(std::max(start.max_strain, course.max_strain), 0.2);
    EXPECT_LT(garment.mesh.vertices.col(1).maxCoeff() - course.end.positions.col(1).maxCoeff(),
              worn.max_fall);
    const int crossings = count_crossings(course.end.positions, cloth.faces);
    // A file's own sleeves may be crumpled through themselves, and those that begin inside her are
    // pushed through more of themselves as they come out (317, 1053 of the dress): a known gap.
    // They must not grow beyond that.
    const int of_file = count_crossings(garment.mesh.vertices, cloth.faces);
    EXPECT_LE(crossings, of_file == 0 ? 0 : start.max_crossings);
    RecordProperty(std::string("most_crossings_in_10_frames_") + device_name(device),
                   start.max_crossings);
    RecordProperty("crossings_of_the_file", of_file);
    RecordProperty(std::string("crossings_") + device_name(device), crossings);
  }
}

INSTANTIATE_TEST_SUITE_P(
    OfTheData, ModelledGarments,
    ::testing::Values(Worn{"tshirt1900.obj", 0.06, {0, 0.66, -0.015}, 0.35, 0.1},
                      Worn{"dress-v5k-f10k.obj", 0.031, {-0.735, -0.53, 0.02}, -0.45, 0.1},
                      Worn{"skirt3448.obj", 1.4, {0, -0.55, 0}, 0, 0.2}),
    [](const auto& one) {
      const std::string name = one.param.file;
      return name.substr(0, name.find_first_of("0123456789-."));
    });

}  // namespace
}  // namespace atelier
