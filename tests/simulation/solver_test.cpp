#include "simulation/solver.h"

#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/renamed_options.h"
#include "simulation/cloth_state_archive.h"
#include "simulation/xpbd/xpbd.h"
#include "tests/simulation/cloth_fixtures.h"
#include "tests/simulation/test_bodies.h"

namespace atelier {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// A cloth of two layers that falls onto a ball which moves on.
struct SolverScene {
  Mesh ball = fixtures::sphere(0.1, 12, 24);
  SimulationModel model;
  SolverOptions options;

  SolverScene() {
    Garment garment = fixtures::garment_of(fixtures::sheet(8, 8, 0.02, 'a'), 0.2, 300, 1e-5);
    garment.mesh.vertices.col(1).array() += 0.102;
    Garment outer = garment;
    outer.mesh.vertices.col(1).array() += 0.003;
    model = {join_cloths({make_cloth(garment), make_cloth(outer)}), ball.faces};
    options.self_contact = true;
    options.substeps = 5;
    options.intersection_interval = 2;
    options.xpbd.iterations = 2;
  }

  Control control(int frame) const {
    Control control;
    control.body_start = ball.vertices.rowwise() + Eigen::RowVector3d(0.005 * frame, 0, 0);
    control.body_end = ball.vertices.rowwise() + Eigen::RowVector3d(0.005 * (frame + 1), 0, 0);
    return control;
  }
};

void expect_same(const ClothState& one, const ClothState& other) {
  EXPECT_EQ(one.frame, other.frame);
  EXPECT_EQ(one.positions, other.positions) << one.frame;
  EXPECT_EQ(one.velocities, other.velocities) << one.frame;
}

TEST(SolverInterface, Step_MatchesXpbdItself) {
  const SolverScene scene;
  XpbdOptions options;
  options.self_contact = true;
  options.substeps = 5;
  options.intersection_interval = 2;
  options.iterations = 2;
  for (const Device device : fixtures::devices()) {
    ClothSolver direct(scene.model.cloth, scene.model.body_faces, options, device);
    const std::unique_ptr<Solver> solver = create_solver(scene.model, scene.options, device);
    EXPECT_EQ(solver->name(), "xpbd");
    EXPECT_EQ(solver->device(), device);
    for (int frame = 0; frame < 8; ++frame) {
      const FrameReport expected = direct.advance(scene.control(frame));
      const FrameReport report = solver->step(scene.control(frame));
      expect_same(solver->state(), direct.state());
      EXPECT_EQ(report.strain_max, expected.strain_max);
      EXPECT_EQ(report.elastic_energy, expected.elastic_energy);
      EXPECT_EQ(report.body_contacts, expected.body_contacts);
      EXPECT_EQ(report.self_contacts, expected.self_contacts);
      EXPECT_EQ(report.crossings, expected.crossings);
      EXPECT_EQ(report.inside, expected.inside);
    }
  }
}

TEST(SolverInterface, RestartedMidway_ContinuesBitIdentically) {
  SolverScene scene;
  for (const std::string& name : solver_names()) {
    scene.options.name = name;
    for (const Device device : fixtures::devices()) {
      if (!solver_conflict(scene.options, device).empty()) {
        continue;
      }
      const std::unique_ptr<Solver> whole = create_solver(scene.model, scene.options, device);
      ClothState middle;
      for (int frame = 0; frame < 12; ++frame) {
        if (frame == 5) {
          middle = whole->state();
        }
        whole->step(scene.control(frame));
      }
      const std::unique_ptr<Solver> again = create_solver(scene.model, scene.options, device);
      again->set_state(cloth_state_of(archive_of(middle), middle.positions.rows()));
      for (int frame = 5; frame < 12; ++frame) {
        again->step(scene.control(frame));
      }
      expect_same(again->state(), whole->state());
      EXPECT_EQ(again->state().frame, 12);
    }
  }
}

TEST(SolverInterface, CreatedForEachFrame_IsBitIdentical) {
  const SolverScene scene;
  const std::unique_ptr<Solver> solver = create_solver(scene.model, scene.options);
  ClothState state = rest_state(scene.model.cloth);
  for (int frame = 0; frame < 4; ++frame) {
    solver->step(scene.control(frame));
    state = step(scene.model, state, scene.control(frame), scene.options);
    EXPECT_EQ(state.frame, frame + 1);
    expect_same(state, solver->state());
  }
  // Without a body it falls.
  const SimulationModel alone{scene.model.cloth, {}};
  const ClothState fallen = step(alone, rest_state(alone.cloth), {});
  EXPECT_NEAR(fallen.velocities.col(1).mean(), -9.81 / 60, 1e-4);
}

TEST(SolverInterface, BatchOfScenes_MatchesXpbdSweep) {
  const SolverScene scene;
  const std::vector<ClothVariation> variations{{1, 1, -1}, {4, 0.1, 0.1}};
  for (const Device device : fixtures::devices()) {
    ClothSweep direct(scene.model.cloth, variations, scene.model.body_faces,
                      xpbd_options(scene.options), device);
    const std::unique_ptr<SolverBatch> batch =
        create_solver_batch(scene.model, variations, scene.options, device);
    ASSERT_EQ(batch->scene_count(), 2);
    for (int frame = 0; frame < 3; ++frame) {
      direct.advance(scene.control(frame));
      EXPECT_EQ(batch->step(scene.control(frame)).size(), 2u);
    }
    expect_same(batch->state(0), direct.state(0));
    expect_same(batch->state(1), direct.state(1));
    batch->set_state(1, batch->state(0));
    expect_same(batch->state(1), direct.state(0));
  }
}

TEST(SolverOptions, OwnOptions_BeginWithTheSolver) {
  SolverOptions options;
  OptionTable table = describe(options);
  SolverOptions usual;
  const OptionTable common = describe_common(usual);
  const OptionTable xpbd = describe_xpbd(usual, usual.xpbd);
  const OptionTable projective = describe_projective(usual.projective);
  std::vector<std::string> names = {"solver"};
  for (const OptionField& field : common.fields) {
    names.push_back(field.name);
  }
  for (const OptionField& field : xpbd.fields) {
    names.push_back("xpbd." + field.name);
  }
  for (const OptionField& field : projective.fields) {
    names.push_back("projective_friction." + field.name);
  }
  ASSERT_EQ(table.fields.size(), names.size());
  for (std::size_t i = 0; i < names.size(); ++i) {
    EXPECT_EQ(table.fields[i].name, names[i]);
  }
  EXPECT_EQ(table.fields[0].choices, solver_names());
  EXPECT_EQ(set_option(table, "friction", "0.7"), "");
  EXPECT_EQ(set_option(table, "projective_friction.iterations", "3"), "");
  EXPECT_EQ(set_option(table, "xpbd.iterations", "7"), "");
  EXPECT_EQ(set_option(table, "solver", "projective-friction"), "");
  EXPECT_EQ(options.name, "projective-friction");
  EXPECT_EQ(options.friction, 0.7);
  EXPECT_EQ(options.projective.iterations, 3);
  EXPECT_EQ(xpbd_options(options).iterations, 7);
  EXPECT_EQ(xpbd_options(options).friction, 0.7);
  EXPECT_EQ(describe(options, {"time_step", "report"}).fields.size(), table.fields.size() - 2);
}

TEST(SolverOptions, ValuesOfEverySolver_HaveOneName) {
  SolverOptions options;
  std::map<const void*, std::string> names;  // by the place of the value
  for (const OptionField& field : describe(options).fields) {
    const void* const place = std::visit(
        [](const auto& target) -> const void* {
          if constexpr (std::is_pointer_v<std::decay_t<decltype(target)>>) {
            return target;
          }
          return nullptr;
        },
        field.target);
    ASSERT_NE(place, nullptr) << field.name;
    EXPECT_TRUE(names.try_emplace(place, field.name).second)
        << field.name << " is " << names[place];
  }
}

TEST(SolverOptions, NamesThatWereASolvers_AreUnderstood) {
  SolverOptions options;
  OptionTable table;
  table.add("cloth", describe(options));
  EXPECT_EQ(set_option(table, "cloth.xpbd.friction", "0.7"), "");
  EXPECT_EQ(set_option(table, "cloth.projective_friction.self_contact", "true"), "");
  EXPECT_EQ(options.friction, 0.7);
  EXPECT_TRUE(options.self_contact);
  EXPECT_THAT(table.notices,
              ElementsAre("cloth.xpbd.friction is now cloth.friction",
                          "cloth.projective_friction.self_contact is now cloth.self_contact"));
  SolverOptions usual;
  for (const OptionField& field : describe_common(usual).fields) {
    for (const std::string solver : {"xpbd.", "projective_friction."}) {
      EXPECT_EQ(renamed_option(solver + field.name, {field.name}), field.name);
    }
  }
}

TEST(SolverOptions, Flag_IsThatOfTheSolverInUse) {
  SolverOptions options;
  EXPECT_EQ(solver_flag("self_contact"), "--self-contact");
  EXPECT_EQ(solver_flag("substeps", "cloth"), "--cloth.xpbd.substeps");
  EXPECT_EQ(solver_flag("body_edges"), "--xpbd.body-edges");
  options.name = "projective-friction";
  EXPECT_EQ(solver_flag("self_contact", "cloth", options), "--cloth.self-contact");
  EXPECT_EQ(solver_flag("substeps", "", options), "--projective-friction.substeps");
  EXPECT_EQ(solver_flag("body_edges", "", options), "");
}

TEST(SolverOptions, IdleOnADevice_AreNamed) {
  SolverOptions options;
  EXPECT_EQ(option_without_effect(options, Device::Cpu), "");
  EXPECT_EQ(option_without_effect(options, Device::Cuda), "");
  options.xpbd.cuda_blocks = 4;
  options.xpbd.vectors = "scalar";
  EXPECT_EQ(option_without_effect(options, Device::Cpu), "cuda_blocks");
  EXPECT_EQ(option_without_effect(options, Device::Cuda), "vectors");
  options.name = "projective-friction";
  EXPECT_EQ(option_without_effect(options, Device::Cpu), "");
  options.projective.half_precision = true;
  EXPECT_EQ(option_without_effect(options, Device::Cpu), "half_precision");
  EXPECT_EQ(option_without_effect(options, Device::Cuda), "");
}

TEST(SolverInterface, ResidualsOfXpbd_AreNotThoseOfOtherSolvers) {
  SolverScene scene;
  EXPECT_GT(create_solver(scene.model, scene.options)->step(scene.control(0)).spring_residual, 0);
  scene.options.name = "projective-friction";
  const FrameReport report = create_solver(scene.model, scene.options)->step(scene.control(0));
  EXPECT_EQ(report.frame, 1);
  EXPECT_EQ(report.spring_residual, -1);
  EXPECT_EQ(report.hinge_residual, -1);
}

TEST(SolverRefused, UnknownName_SuggestsKnownNames) {
  EXPECT_THAT(solver_names(), Contains("xpbd"));
  SolverScene scene;
  scene.options.name = "xpdb";
  for (const bool batch : {false, true}) {
    try {
      if (batch) {
        create_solver_batch(scene.model, std::vector<ClothVariation>(1), scene.options);
      } else {
        create_solver(scene.model, scene.options);
      }
      FAIL() << "created";
    } catch (const DataError& error) {
      EXPECT_EQ(error.found, "'xpdb'");
      EXPECT_THAT(error.expected, HasSubstr("xpbd, projective-friction, did you mean 'xpbd'?"));
    }
  }
}

TEST(SolverRefused, NonFiniteState_Throws) {
  const SolverScene scene;
  ClothState state = rest_state(scene.model.cloth);
  state.positions(3, 0) = std::nan("");
  EXPECT_THROW(step(scene.model, state, scene.control(0), scene.options), DataError);
}

TEST(SolverInterface, ProjectiveBatch_VariesStiffnessAndFriction) {
  SolverScene scene;
  scene.options.name = "projective-friction";
  const std::vector<ClothVariation> variations{{1, 1, -1}, {4, 0.1, 0.1}};
  const std::unique_ptr<SolverBatch> batch =
      create_solver_batch(scene.model, variations, scene.options);
  ASSERT_EQ(batch->scene_count(), 2);
  const std::unique_ptr<Solver> alone = create_solver(scene.model, scene.options);
  for (int frame = 0; frame < 3; ++frame) {
    alone->step(scene.control(frame));
    EXPECT_EQ(batch->step(scene.control(frame)).size(), 2u);
  }
  expect_same(batch->state(0), alone->state());
  EXPECT_NE(batch->state(1).positions, alone->state().positions);
  batch->set_state(1, batch->state(0));
  expect_same(batch->state(1), alone->state());
  EXPECT_THROW(batch->state(2), LogicError);
}

TEST(SolverRefused, ConflictingOptions_Throw) {
  SolverScene scene;
  scene.options.name = "projective-friction";
  scene.options.projective.strain_limit = 0.05;
  for (const Device device : {Device::Cpu, Device::Cuda}) {
    EXPECT_EQ(solver_conflict(scene.options, device), "");
  }
  scene.options.name = "xpbd";
  scene.options.xpbd.vectors = "avx2";
  scene.options.xpbd.precision = "double";
  EXPECT_NE(solver_conflict(scene.options, Device::Cpu), "");
  EXPECT_THROW(create_solver(scene.model, scene.options), LogicError);
}

}  // namespace
}  // namespace atelier
