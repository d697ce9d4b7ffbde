#include "simulation/cloth/schedule.h"

#include <set>

#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/simulation/cloth_fixtures.h"

namespace atelier {
namespace {

/// Every constraint once; no particle twice in a colour; no particle in two patches of a phase;
/// phase 0 holds every particle once; kinds in order.
void expect_valid(const Schedule& s, const std::vector<ConstraintParticles>& constraints,
                  Index vertices) {
  std::vector<int> seen(constraints.size(), 0);
  for (const Schedule::Phase& phase : s.phases) {
    std::set<int> in_phase;
    for (int p = phase.patch_begin; p < phase.patch_end; ++p) {
      const Schedule::Patch& patch = s.patches[p];
      std::set<int> in_patch(s.vertices.begin() + patch.vertex_begin,
                             s.vertices.begin() + patch.vertex_end);
      ASSERT_EQ(int(in_patch.size()), patch.vertex_end - patch.vertex_begin);
      for (int v : in_patch) {
        EXPECT_TRUE(in_phase.insert(v).second) << "particle in two patches of a phase";
      }
      for (int k = patch.colour_begin; k < patch.colour_end; ++k) {
        std::set<int> in_colour;
        for (int i = s.colours[k].begin[0]; i < s.colours[k].begin[3]; ++i) {
          const ConstraintParticles& c = constraints[s.order[i]];
          ++seen[s.order[i]];
          EXPECT_GE(i, s.colours[k].begin[c.kind]);
          EXPECT_LT(i, s.colours[k].begin[c.kind + 1]);
          const int pair = i - s.colours[k].begin[1];
          if (pair >= 0 && pair < s.colours[k].paired) {
            const ConstraintParticles& lead = constraints[s.order[s.colours[k].begin[0] + pair]];
            EXPECT_EQ((std::set<int>{c.particle[0], c.particle[1]}),
                      (std::set<int>{lead.particle[0], lead.particle[1]}));
            continue;
          }
          for (int v : c.particle) {
            if (v >= 0) {
              EXPECT_TRUE(in_colour.insert(v).second) << "particle twice in a colour";
              EXPECT_TRUE(in_patch.count(v)) << "particle outside the patch";
            }
          }
        }
      }
    }
    if (&phase == &s.phases.front()) {
      EXPECT_EQ(Index(in_phase.size()), vertices);
    }
  }
  for (int n : seen) {
    EXPECT_EQ(n, 1);
  }
}

std::vector<ConstraintParticles> constraints_of(const Cloth& cloth) {
  std::vector<ConstraintParticles> out;
  for (const ClothSpring& s : cloth.springs) {
    out.push_back({{s.a, s.b, -1, -1}, 1});
  }
  for (const ClothHinge& h : cloth.hinges) {
    out.push_back({{h.edge0, h.edge1, h.left, h.right}, 0});
  }
  return out;
}

TEST(Schedule, EveryConstraint_HasOnePlaceWithoutConflicts) {
  for (int patches : {1, 3, 8, 40}) {
    for (char kind : {'d', 'a', 'e'}) {
      ClothOptions options;
      options.schedule.patches = patches;
      const Cloth cloth = make_cloth(
          fixtures::garment_of(fixtures::sheet(40, 30, 0.02, kind), 0.2, 100, 1e-4), {}, options);
      expect_valid(cloth.schedule, constraints_of(cloth), cloth.rest_positions.rows());
    }
  }
}

TEST(Schedule, GridOfTenThousand_TakesFewPhasesAndColors) {
  const Cloth cloth =
      make_cloth(fixtures::garment_of(fixtures::sheet(99, 99, 0.01), 0.2, 100, 1e-4));
  expect_valid(cloth.schedule, constraints_of(cloth), 10000);
  EXPECT_LE(cloth.schedule.phases.size(), 4u);
  EXPECT_LE(cloth.schedule.max_colours, 18);
  EXPECT_LE(cloth.schedule.max_patch_vertices, 1400);
  RecordProperty("phases", int(cloth.schedule.phases.size()));
  RecordProperty("colours", cloth.schedule.max_colours);
}

TEST(Schedule, RepeatedSchedule_IsTheSame) {
  const Garment garment = fixtures::garment_of(fixtures::sheet(50, 50, 0.01, 'a'), 0.2, 100, 1e-4);
  const Schedule a = make_cloth(garment).schedule;
  const Schedule b = make_cloth(garment).schedule;
  EXPECT_EQ(a.order, b.order);
  EXPECT_EQ(a.vertices, b.vertices);
}

TEST(Schedule, UnconstrainedParticles_AreListed) {
  const Points x = Points::Random(5, 3);
  const Schedule s = make_schedule(x, {{{0, 1, -1, -1}, 1}});
  EXPECT_EQ(s.vertices.size(), 5u);
  EXPECT_EQ(s.order.size(), 1u);
}

TEST(Schedule, ParticleOutOfRange_IsRefused) {
  EXPECT_THROW(make_schedule(Points::Zero(2, 3), {{{0, 2, -1, -1}, 1}}), LogicError);
  EXPECT_THROW(make_schedule(Points::Zero(2, 3), {{{0, 1, -1, -1}, 3}}), LogicError);
}

}  // namespace
}  // namespace atelier
