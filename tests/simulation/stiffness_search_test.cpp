#include "simulation/material/stiffness_search.h"

#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "simulation/xpbd/xpbd.h"
#include "tests/simulation/cloth_fixtures.h"

namespace atelier {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A bowl in the logarithms, lowest at its truth.
double bowl(const Stiffness& at, const Stiffness& truth) {
  const double s = std::log10(at.stretch / truth.stretch);
  const double b = std::log10(at.bending / truth.bending);
  return std::sqrt(4e-6 + 1e-4 * (s * s + 0.7 * b * b));
}

StiffnessObjective bowls(const std::vector<Stiffness>& truths) {
  return [truths](const std::vector<std::vector<Stiffness>>& scenes) {
    std::vector<std::vector<double>> distances;
    for (const auto& scene : scenes) {
      distances.emplace_back();
      for (std::size_t g = 0; g < truths.size(); ++g) {
        distances.back().push_back(bowl(scene[g], truths[g]));
      }
    }
    return distances;
  };
}

TEST(StiffnessSearch, QuadraticBowl_IsMinimizedForEachGarment) {
  const std::vector<Stiffness> truths = {{700, 3e-5}, {2500, 4e-6}};
  const auto fits = search_stiffness(2, bowls(truths));
  ASSERT_EQ(fits.size(), 2u);
  for (std::size_t g = 0; g < 2; ++g) {
    EXPECT_NEAR(fits[g].best.stretch / truths[g].stretch, 1, 0.02);
    EXPECT_NEAR(fits[g].best.bending / truths[g].bending, 1, 0.02);
    EXPECT_EQ(fits[g].trials.size(), 16u + 9u);
  }
}

TEST(StiffnessSearch, Ranges_HoldEquallyGoodValuesAndOpenEnds) {
  // Stretching says nothing, bending has its least at the lower end.
  const auto flat = [](const std::vector<std::vector<Stiffness>>& scenes) {
    std::vector<std::vector<double>> distances;
    for (const auto& scene : scenes) {
      distances.push_back({0.01 + scene[0].bending});
    }
    return distances;
  };
  StiffnessSearchOptions options;
  options.bending_high = 0.1;
  const StiffnessFit fit = search_stiffness(1, flat, options).front();
  EXPECT_DOUBLE_EQ(fit.stretch.low, options.stretch_low);
  EXPECT_DOUBLE_EQ(fit.stretch.high, options.stretch_high);
  EXPECT_TRUE(fit.stretch.open_low && fit.stretch.open_high);
  EXPECT_TRUE(fit.bending.open_low);
  EXPECT_FALSE(fit.bending.open_high);
  EXPECT_LT(fit.bending.high, 0.0011) << "ten percent of a hundredth";
  EXPECT_DOUBLE_EQ(fit.best.bending, options.bending_low);
}

TEST(StiffnessSearch, FailingScenes_CountAsFarOff) {
  const auto breaks = [](const std::vector<std::vector<Stiffness>>& scenes) {
    std::vector<std::vector<double>> distances;
    for (const auto& scene : scenes) {
      distances.push_back({scene[0].stretch < 500 ? std::nan("") : bowl(scene[0], {900, 1e-5})});
    }
    return distances;
  };
  const StiffnessFit fit = search_stiffness(1, breaks).front();
  EXPECT_NEAR(fit.best.stretch / 900, 1, 0.4);
  EXPECT_GT(fit.stretch.low, 500);
  for (const StiffnessTrial& trial : fit.trials) {
    EXPECT_EQ(trial.distance == kInfinity, trial.stiffness.stretch < 500);
  }
}

TEST(StiffnessSearch, CoarseAndFineGrids_HaveTheirSizes) {
  StiffnessSearchOptions options;
  options.coarse = 2;
  options.fine = 1;
  std::vector<std::size_t> asked;
  const auto count = [&](const std::vector<std::vector<Stiffness>>& scenes) {
    asked.push_back(scenes.size());
    return bowls({{700, 3e-5}})(scenes);
  };
  search_stiffness(1, count, options);
  EXPECT_THAT(asked, ::testing::ElementsAre(4u, 1u));
}

StiffnessObjective always(double distance) {
  return [distance](const std::vector<std::vector<Stiffness>>& scenes) {
    return std::vector<std::vector<double>>(scenes.size(), {distance});
  };
}

TEST(StiffnessSearch, UninformativeDistances_LeaveThePrior) {
  StiffnessSearchOptions options;
  options.fine = 0;
  options.prior = {800, 0.6, 3e-5, 0.5};
  const StiffnessFit fit = search_stiffness(1, always(0.01), options).front();
  EXPECT_EQ(fit.trials.size(), 16u);
  EXPECT_NEAR(fit.expected.stretch / 800, 1, 0.03);
  EXPECT_NEAR(fit.expected.bending / 3e-5, 1, 0.03);
  constexpr double kNineInTen = 1.645;  // standard deviations to each side
  EXPECT_NEAR(std::log(fit.credible_low.stretch / 800), -0.6 * kNineInTen, 0.06);
  EXPECT_NEAR(std::log(fit.credible_high.stretch / 800), 0.6 * kNineInTen, 0.06);
  EXPECT_NEAR(std::log(fit.credible_low.bending / 3e-5), -0.5 * kNineInTen, 0.09);
  EXPECT_NEAR(std::log(fit.credible_high.bending / 3e-5), 0.5 * kNineInTen, 0.09);
}

TEST(StiffnessSearch, NoPrior_GivesTheMiddleOfTheOpenRange) {
  StiffnessSearchOptions options;
  options.fine = 0;
  const StiffnessFit fit = search_stiffness(1, always(0.01), options).front();
  EXPECT_NEAR(fit.expected.stretch / 1000, 1, 1e-6);
  EXPECT_NEAR(std::log10(fit.credible_low.stretch), 2.1, 0.03);
  EXPECT_NEAR(std::log10(fit.credible_high.stretch), 3.9, 0.03);
  // Below a thousand it is ruled out: what is expected lies above, whatever the edge of the range.
  const auto one_sided = [](const std::vector<std::vector<Stiffness>>& scenes) {
    std::vector<std::vector<double>> distances;
    for (const auto& scene : scenes) {
      distances.push_back({0.01 * (1 + std::max(0.0, std::log10(1000 / scene[0].stretch)))});
    }
    return distances;
  };
  options.coarse = 9;
  options.prior = {300, 1, 3e-5, 1};
  const StiffnessFit above = search_stiffness(1, one_sided, options).front();
  EXPECT_GT(above.credible_low.stretch, 600);
  EXPECT_GT(above.expected.stretch, 800);
  EXPECT_LT(above.expected.stretch, 2000);
  EXPECT_TRUE(above.stretch.open_high);
}

TEST(StiffnessSearch, InformativeDistances_OutweighThePrior) {
  StiffnessSearchOptions options;
  options.coarse = 9;
  options.prior = {5000, 1, 2e-6, 1};
  const std::vector<Stiffness> truths = {{700, 3e-5}, {2500, 4e-6}};
  for (const auto& [truth, fit] :
       {std::pair{truths[0], search_stiffness(2, bowls(truths), options)[0]},
        {truths[1], search_stiffness(2, bowls(truths), options)[1]}}) {
    EXPECT_NEAR(fit.expected.stretch / truth.stretch, 1, 0.25);
    EXPECT_NEAR(fit.expected.bending / truth.bending, 1, 0.25);
    EXPECT_LT(fit.credible_low.stretch, truth.stretch);
    EXPECT_GT(fit.credible_high.stretch, truth.stretch);
  }
}

TEST(StiffnessSearch, Prior_IsTheMeanOfTheFabrics) {
  const StiffnessPrior usual = stiffness_prior();
  double stretch = 1;
  double bending = 1;
  int within = 0;
  const auto share = 1.0 / static_cast<double>(all_fabrics().size());
  for (const Fabric& fabric : all_fabrics()) {
    const Material& material = fabric.material;
    const double both = std::sqrt(material.stretch_warp * material.stretch_weft);
    stretch *= std::pow(both, share);
    bending *= std::pow(material.bending, share);
    within += std::abs(std::log(both / usual.stretch)) < 2 * usual.stretch_spread ? 1 : 0;
  }
  EXPECT_NEAR(usual.stretch / stretch, 1, 1e-9);
  EXPECT_NEAR(usual.bending / bending, 1, 1e-9);
  EXPECT_GE(within, 9) << "of ten";
}

TEST(StiffnessSearch, BadSearchInput_IsRefused) {
  const auto never = [](const std::vector<std::vector<Stiffness>>& scenes) {
    return std::vector<std::vector<double>>(scenes.size(), std::vector<double>(1, kInfinity));
  };
  EXPECT_THAT([&] { search_stiffness(1, never); },
              ThrowsMessage<DataError>(HasSubstr("no stiffness at which it holds together")));
  const auto short_one = [](const std::vector<std::vector<Stiffness>>&) {
    return std::vector<std::vector<double>>(1, std::vector<double>(1, 0.1));
  };
  EXPECT_THROW(search_stiffness(1, short_one), LogicError);
  const auto narrow = [](const std::vector<std::vector<Stiffness>>& scenes) {
    return std::vector<std::vector<double>>(scenes.size());
  };
  EXPECT_THROW(search_stiffness(1, narrow), LogicError);
  EXPECT_THROW(search_stiffness(0, never), LogicError);
  StiffnessSearchOptions options;
  options.stretch_low = options.stretch_high;
  EXPECT_THROW(search_stiffness(1, never, options), LogicError);
  options = {};
  options.bending_low = 0;
  EXPECT_THROW(search_stiffness(1, never, options), LogicError);
  options = {};
  options.coarse = 1;
  EXPECT_THROW(search_stiffness(1, never, options), LogicError);
  options = {};
  options.prior.stretch_spread = 1;
  EXPECT_THROW(search_stiffness(1, never, options), LogicError) << "of what?";
  options.prior = {1000, -1, 1e-5, 1};
  EXPECT_THROW(search_stiffness(1, never, options), LogicError);
}

/// A cloth that is held along one edge and falls from the level: bending says how far it droops,
/// stretching how long it becomes. Positions over time.
std::vector<Points> fallen(double stretch, double bending, int substeps) {
  const Garment garment =
      fixtures::garment_of(fixtures::sheet(4, 10, 0.02, 'e'), 0.4, stretch, bending);
  const std::vector<int> held = fixtures::vertices_where(
      garment.mesh.vertices, [](double, double, double z) { return z < 0.02; });
  const Cloth cloth = make_cloth(garment, held);
  XpbdOptions options;
  options.substeps = substeps;
  options.report = false;
  ClothSolver solver(cloth, Triangles(0, 3), options);
  solver.set_state(rest_state(cloth));
  std::vector<Points> frames;
  for (int frame = 0; frame < 30; ++frame) {
    solver.advance({});
    frames.push_back(solver.state().positions);
  }
  return frames;
}

TEST(StiffnessSearch, FallingCloth_GivesItsStiffnessBack) {
  constexpr Stiffness kTruth{40, 2.2e-4};
  const std::vector<Points> seen = fallen(kTruth.stretch, kTruth.bending, 40);
  const auto distances = [&](const std::vector<std::vector<Stiffness>>& scenes) {
    std::vector<std::vector<double>> result;
    for (const auto& scene : scenes) {
      const std::vector<Points> now = fallen(scene[0].stretch, scene[0].bending, 40);
      double sum = 0;
      for (std::size_t i = 0; i < now.size(); ++i) {
        sum += (now[i] - seen[i]).rowwise().norm().mean() / static_cast<double>(now.size());
      }
      result.push_back({sum});
    }
    return result;
  };
  StiffnessSearchOptions options;
  options.fine = 5;
  options.stretch_low = 10;
  options.stretch_high = 1000;
  options.bending_low = 1e-5;
  const StiffnessFit fit = search_stiffness(1, distances, options).front();
  EXPECT_NEAR(fit.best.bending / kTruth.bending, 1, 0.3);
  EXPECT_NEAR(fit.best.stretch / kTruth.stretch, 1, 0.3);
  EXPECT_LE(fit.bending.low, kTruth.bending * 1.5);
  EXPECT_GE(fit.bending.high, kTruth.bending / 1.5);
}

}  // namespace
}  // namespace atelier
